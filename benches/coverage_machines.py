"""Machines of the study of intervals: an axis, an arm that bends, a leg moved by a cylinder, a cart with a pendulum."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

import vpm

Array = NDArray[np.float64]
Span = tuple[float, float]
Content = dict[str, object]


@dataclass(frozen=True)
class Effect:
    """One effect that a machine may have.

    Attributes
    ----------
    name, at : str
    sizes : mapping
        Range of each parameter, SI; a fit that has the effect frees them.
    known : mapping
        Parameters that both know.
    group : str
        No two effects of one group act together: data tell them apart badly.
    """

    name: str
    at: str
    sizes: Mapping[str, Span]
    known: Mapping[str, float] = field(default_factory=dict)
    group: str = ""

    @property
    def label(self) -> str:
        """What is printed."""
        return f"{self.name} at {self.at}"


@dataclass(frozen=True)
class Machine:
    """A machine, its loop and its instruments.

    Attributes
    ----------
    content : callable
        The model file as a dictionary.
    effects : tuple of Effect
    start, way : ndarray, shape (joints,)
        Middle and deviation of the motion of the joints that are driven, m or rad.
    command : callable
        Commands from errors and speeds of the joints (joints,).
    noise : mapping
        Deviations of the readings by channel, SI; joints first.
    command_noise : float
        Deviation of what drives are not told but deliver, in units of the command.
    seconds, time_step : float
        Of the log, s.
    swing : mapping
        Deviation of the place at which joints begin that nobody measures, m or rad.
    """

    content: Callable[[], Content]
    effects: tuple[Effect, ...]
    start: Array
    way: Array
    command: Callable[[Array, Array], Array]
    noise: Mapping[str, float]
    command_noise: float
    seconds: float
    time_step: float
    swing: Mapping[str, float] = field(default_factory=dict)

    def first_state(self, model: vpm.Model, start: Mapping[str, float]) -> Array:
        """At rest at the start."""
        return model.state({name: value for name, value in start.items() if name in model.state_names})


# ---- an axis with 5 kg under 20 N, at 0.3 m/s ------------------------------------------------------------------------


def axis() -> Content:
    """A slide with a motor."""
    return {
        "name": "axis",
        "gravity": [0.0, 0.0, 0.0],
        "bodies": {"slide": {"mass": {"value": 5.0, "unit": "kg", "uncertainty": 0.5}}},
        "joints": {"axis": {"type": "prismatic", "parent": "world", "child": "slide", "axis": [1.0, 0.0, 0.0]}},
        "actuators": {"drive": {"joint": "axis", "gain": 4.0, "command_unit": "A"}},
        "sensors": {"encoder": {"measures": "axis.position"}},
        "effects": [
            {"type": "viscous_friction", "at": "axis", "viscous": {"value": 12.0, "uncertainty": 2.0}},
            {"type": "coulomb_friction", "at": "axis", "coulomb": {"value": 4.0, "uncertainty": 0.5}},
        ],
    }


AXIS = Machine(
    axis,
    (
        Effect("bias_force", "axis", {"force": (1.0, 3.0)}, group="one way"),
        Effect("spring", "axis", {"stiffness": (15.0, 60.0)}, group="spring"),
        Effect("cubic_spring", "axis", {"stiffness": (500.0, 1500.0)}, group="spring"),
        Effect("asymmetric_friction", "axis", {"coulomb_difference": (1.0, 2.0)}, group="one way"),
        Effect("torque_ripple", "axis", {"cosine": (0.6, 2.0), "sine": (0.6, 2.0)}, {"period": 0.02}),
        Effect("quadratic_drag", "axis", {"drag": (15.0, 40.0)}),
        Effect("input_delay", "drive", {"time": (0.005, 0.015)}, group="late"),
        Effect("actuator_lag", "drive", {"time_constant": (0.005, 0.015)}, group="late"),
        Effect("dead_zone", "drive", {"width": (0.2, 0.5)}),
    ),
    np.array([0.0]),
    np.array([0.08]),
    lambda error, speed: 300.0 * error - 12.0 * speed,
    {"axis.position": 5e-6},
    0.02,
    8.0,
    0.004,
)

# ---- an arm that bends, 5 Hz with its hub held -----------------------------------------------------------------------


def flexible_arm() -> Content:
    """A hub with a strip of aluminium and a mass at its end, in a level plane; a gauge near its root."""
    return {
        "name": "flexible arm",
        "gravity": [0.0, 0.0, -9.81],
        "bodies": {
            "hub": {"mass": 0.5, "inertia": [0.02, 0.02, {"value": 0.02, "uncertainty": 0.002}, 0.0, 0.0, 0.0]},
            "load": {"mass": 0.2, "inertia": [1e-5, 1e-5, 1e-5, 0.0, 0.0, 0.0]},
        },
        "joints": {
            "shoulder": {"type": "revolute", "parent": "world", "child": "hub", "axis": [0.0, 0.0, 1.0]},
            "grip": {"type": "fixed", "parent": "strip", "child": "load"},
        },
        "beams": {
            "strip": {
                "parent": "hub",
                "rotation": [0.0, float(np.pi / 2.0), 0.0],
                "length": 0.5,
                "level": "bezier(3)",
                "deforms": ["bending_x"],
                "material": {"young": {"value": 70e9, "uncertainty": 4e9}, "poisson": 0.33, "density": 2700.0},
                "section": {"shape": "rectangle", "width": 0.03, "height": 0.004},
                "damping": {"stiffness": 1e-3},
            }
        },
        "gauges": {"gauge": {"beam": "strip", "at": 0.05, "x": 0.0, "y": 0.002}},
        "actuators": {"drive": {"joint": "shoulder", "gain": 2.0, "command_unit": "A"}},
        "sensors": {"encoder": {"measures": "shoulder.position"}},
        "effects": [
            {"type": "viscous_friction", "at": "shoulder", "viscous": {"value": 0.2, "uncertainty": 0.03}},
        ],
    }


FLEXIBLE_ARM = Machine(
    flexible_arm,
    (
        Effect("coulomb_friction", "shoulder", {"coulomb": (0.05, 0.15)}),
        Effect("bias_force", "shoulder", {"force": (0.05, 0.15)}),
        Effect("spring", "shoulder", {"stiffness": (0.1, 0.5)}),
        Effect("quadratic_drag", "shoulder", {"drag": (0.1, 0.3)}),
        Effect("torque_ripple", "shoulder", {"cosine": (0.05, 0.15), "sine": (0.05, 0.15)}, {"period": 0.3}),
        Effect("input_delay", "drive", {"time": (0.005, 0.015)}),
        Effect("dead_zone", "drive", {"width": (0.02, 0.06)}),
    ),
    np.array([0.0]),
    np.array([0.5]),
    lambda error, speed: 8.0 * error - 0.6 * speed,
    {"shoulder.position": 2e-5, "gauge.strain": 3e-7},
    0.005,
    8.0,
    0.004,
)

# ---- a shank turned by a cylinder, as the knee of examples/hyl -------------------------------------------------------


def leg() -> Content:
    """A shank that hangs from a hinge, turned by a cylinder between two pins."""
    return {
        "name": "leg",
        "gravity": [0.0, -9.81, 0.0],
        "bodies": {
            "shank": {
                "mass": {"value": 4.0, "uncertainty": 0.3},
                "center_of_mass": [0.125, 0.0, 0.0],
                "inertia": [0.0, 0.04, 0.04, 0.0, 0.0, 0.0],
            }
        },
        "joints": {"knee": {"type": "revolute", "parent": "world", "child": "shank", "axis": [0.0, 0.0, 1.0]}},
        "lines": {
            "cylinder": {
                "from": {"parent": "world", "point": [-0.31863692, -0.04500836, 0.0]},
                "to": {"parent": "shank", "point": [0.04475348, -0.00470378, 0.0]},
            }
        },
        "supplies": {
            "pump": {
                "pressure": 160e5,
                "tank_pressure": 1e5,
                "oil": {"bulk_modulus": {"value": 1.2e9, "uncertainty": 0.15e9}},
            }
        },
        "actuators": {
            "drive": {
                "type": "hydraulic",
                "line": "cylinder",
                "supply": "pump",
                "retracted_length": 0.281,
                "command_unit": "A",
                "valve": {
                    "flow_gain": {"value": 6.68e-6, "unit": "m^3/(s Pa^0.5 A)", "uncertainty": 0.5e-6},
                    "stroke": 0.01,
                    "frequency": {"value": 250.0, "unit": "rev/s"},
                    "damping": 0.7,
                },
                "cylinder": {
                    "bore": 0.016,
                    "rod": 0.010,
                    "stroke": 0.08,
                    "line_a": 2.9e-6,
                    "line_b": 1.7e-6,
                    "internal_leakage": 1.7e-13,
                },
            }
        },
        "sensors": {"encoder": {"measures": "knee.position"}},
        "effects": [
            {"type": "viscous_friction", "at": "knee", "viscous": {"value": 3.0, "uncertainty": 0.5}},
        ],
    }


LEG = Machine(
    leg,
    (
        Effect("coulomb_friction", "knee", {"coulomb": (0.5, 1.5)}),
        Effect("bias_force", "knee", {"force": (0.5, 1.5)}, group="weight"),
        Effect("spring", "knee", {"stiffness": (2.0, 6.0)}, {"rest": -1.3}, group="weight"),
        Effect("quadratic_drag", "knee", {"drag": (0.5, 1.5)}),
        Effect("internal_leakage", "drive", {"coefficient": (2e-13, 6e-13)}),
        Effect("input_delay", "drive", {"time": (0.003, 0.01)}),
        Effect("dead_zone", "drive", {"width": (1e-4, 3e-4)}),
    ),
    np.array([-1.3]),
    np.array([0.25]),
    lambda error, _: 0.002 * error,
    {"knee.position": 2e-5, "drive.pressure_a": 5e3, "drive.pressure_b": 5e3},
    2e-6,
    6.0,
    0.002,
)

# ---- a cart under a motor with a pendulum of 0.9 Hz whose angle nobody measures --------------------------------------


def cart() -> Content:
    """A cart on a rail, and a pendulum that hangs from it."""
    return {
        "name": "cart",
        "gravity": [0.0, 0.0, -9.81],
        "bodies": {
            "slide": {"mass": {"value": 4.0, "unit": "kg", "uncertainty": 0.4}},
            "bob": {
                "mass": {"value": 1.0, "unit": "kg", "uncertainty": 0.1},
                "center_of_mass": [0.0, 0.0, -0.28],
                "inertia": [0.008, 0.008, 0.001, 0.0, 0.0, 0.0],
            },
        },
        "joints": {
            "axis": {"type": "prismatic", "parent": "world", "child": "slide", "axis": [1.0, 0.0, 0.0]},
            "pivot": {"type": "revolute", "parent": "slide", "child": "bob", "axis": [0.0, 1.0, 0.0]},
        },
        "actuators": {"drive": {"joint": "axis", "gain": 4.0, "command_unit": "A"}},
        "sensors": {"encoder": {"measures": "axis.position"}},
        "effects": [
            {"type": "viscous_friction", "at": "axis", "viscous": {"value": 12.0, "uncertainty": 2.0}},
            {"type": "coulomb_friction", "at": "axis", "coulomb": {"value": 4.0, "uncertainty": 0.5}},
            {"type": "viscous_friction", "at": "pivot", "viscous": {"value": 0.02, "uncertainty": 0.004}},
        ],
    }


CART = Machine(
    cart,
    (
        Effect("bias_force", "axis", {"force": (1.0, 3.0)}),
        Effect("spring", "axis", {"stiffness": (15.0, 60.0)}),
        Effect("quadratic_drag", "axis", {"drag": (15.0, 40.0)}),
        Effect("coulomb_friction", "pivot", {"coulomb": (0.02, 0.06)}, group="bearing"),
        Effect("quadratic_drag", "pivot", {"drag": (0.01, 0.03)}, group="bearing"),
        Effect("spring", "pivot", {"stiffness": (0.3, 1.0)}),
        Effect("input_delay", "drive", {"time": (0.005, 0.015)}),
        Effect("dead_zone", "drive", {"width": (0.2, 0.5)}),
    ),
    np.array([0.0]),
    np.array([0.08]),
    lambda error, speed: 300.0 * error - 12.0 * speed,
    {"axis.position": 5e-6},
    0.02,
    8.0,
    0.004,
    {"pivot": 0.3},
)

MACHINES = {"axis": AXIS, "flexible_arm": FLEXIBLE_ARM, "leg": LEG, "cart": CART}
