"""The machines of the table, as model files say them."""

import math
from collections.abc import Mapping, Sequence

import vpm

#: z of a beam along x of what it sits on, its x downward, its y kept.
ALONG_X = (0.0, math.pi / 2.0, 0.0)

Content = Mapping[str, object]


def strip(line: float = 1.0, bending: float = 1.0) -> dict[str, object]:
    """A slender uniform beam of that mass per length (kg/m) and E J (N m^2); its radius of gyration is 1e-6 m."""
    area, gyration = 1e-4, 1e-6
    moment = area * gyration**2
    sizes = {"area": area, "moment_x": moment, "moment_y": moment, "torsion": moment, "shear_x": 1.0, "shear_y": 1.0}
    return {
        "material": {"young": bending / moment, "poisson": 0.3, "density": line / area},
        "section": {"shape": "given", **sizes},
    }


def rectangle(young: float, density: float, width: float, height: float) -> dict[str, object]:
    """A bar of a rectangular section, width along x."""
    return {
        "material": {"young": young, "poisson": 0.3, "density": density},
        "section": {"shape": "rectangle", "width": width, "height": height},
    }


def cantilever(
    level: str,
    length: float,
    beam: Content,
    *,
    deforms: Sequence[str] = ("bending_y",),
    tip: float = 0.0,
    gravity: float = 0.0,
) -> vpm.Model:
    """A horizontal beam clamped to the world, with a point mass (kg) at its tip."""
    content: dict[str, object] = {
        "name": "cantilever",
        "gravity": [0.0, 0.0, -gravity],
        "beams": {
            "beam": {
                "parent": "world",
                "rotation": ALONG_X,
                "length": length,
                "level": level,
                "deforms": list(deforms),
                **beam,
            }
        },
        "markers": {"tip": {"parent": "beam"}},
    }
    if tip:
        content["bodies"] = {"mass": {"mass": tip}}
        content["joints"] = {"flange": {"type": "fixed", "parent": "beam", "child": "mass"}}
    return vpm.Model.from_dict(content)


def rotor(radius: float, deforms: str, level: str) -> vpm.Model:
    """A unit beam on a hub of that radius that nothing slows down, turning about z."""
    return vpm.Model.from_dict(
        {
            "name": "rotor",
            "gravity": [0.0, 0.0, 0.0],
            "bodies": {"hub": {"mass": 1.0, "inertia": [1e9, 1e9, 1e9, 0.0, 0.0, 0.0]}},
            "joints": {"spin": {"type": "revolute", "parent": "world", "child": "hub", "axis": [0.0, 0.0, 1.0]}},
            "beams": {
                "beam": {
                    "parent": "hub",
                    "translation": [radius, 0.0, 0.0],
                    "rotation": ALONG_X,
                    "length": 1.0,
                    "level": level,
                    "deforms": [deforms],
                    **strip(),
                }
            },
        }
    )


def arm(p: Mapping[str, float], level: str, *, gravity: bool = True) -> vpm.Model:
    """The planar two-link arm of the reference, its servos as springs and dampers that a command moves."""
    link = rectangle(p["E"], p["rho"], p["h"], p["b"])
    damping = {"damping": {"stiffness": p["beta"]}, "deforms": ["bending_y"], "rotation": ALONG_X}

    def turning(inertia: float, mass: float = 1e-6) -> dict[str, object]:
        return {"mass": mass, "inertia": [inertia, inertia, inertia, 0.0, 0.0, 0.0]}

    axis = {"type": "revolute", "axis": [0.0, -1.0, 0.0]}
    motor = {"gain": 1.0, "command_unit": "N m"}
    content: dict[str, object] = {
        "name": "two-link arm",
        "gravity": [0.0, 0.0, -p["g"] if gravity else 0.0],
        "bodies": {"hub_1": turning(p["Jh1"]), "drive": turning(p["Je"], p["me"]), "hub_2": turning(p["Jh2"])},
        "joints": {
            "shoulder": {**axis, "parent": "world", "child": "hub_1"},
            "flange": {"type": "fixed", "parent": "link_1", "child": "drive"},
            "elbow": {**axis, "parent": "link_1", "child": "hub_2"},
        },
        "beams": {
            "link_1": {**link, **damping, "parent": "hub_1", "length": p["l1"], "level": level},
            "link_2": {
                **link,
                **damping,
                "parent": "hub_2",
                "rotation": [0.0, 0.0, 0.0],
                "length": p["l2"],
                "level": level,
            },
        },
        "actuators": {"motor_1": {**motor, "joint": "shoulder"}, "motor_2": {**motor, "joint": "elbow"}},
        "gauges": {
            "gauge_1": {"beam": "link_1", "at": p["gauge"], "x": 0.5 * p["h"]},
            "gauge_2": {"beam": "link_2", "at": p["gauge"], "x": 0.5 * p["h"]},
        },
        "markers": {"tip": {"parent": "link_2"}},
        "effects": [
            {"type": "payload", "at": "link_2", "mass": p["mt"], "x": 0.0, "y": 0.0, "z": 0.0},
            {"type": "spring", "at": "shoulder", "stiffness": p["kp1"]},
            {"type": "viscous_friction", "at": "shoulder", "viscous": p["kd1"]},
            {"type": "spring", "at": "elbow", "stiffness": p["kp2"]},
            {"type": "viscous_friction", "at": "elbow", "viscous": p["kd2"]},
        ],
    }
    return vpm.Model.from_dict(content)
