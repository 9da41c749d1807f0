"""Robots as URDF that tests write: five of them, and random trees."""

import math
from typing import Any

from hypothesis import strategies as st


def inertial(mass: float, xyz: str = "0.02 -0.03 0.15", rpy: str = "0.4 -0.7 1.1", scale: float = 1.0) -> str:
    """An inertia off its frame and turned in it, of a body that can be."""
    moments = [scale * mass * value for value in (0.011, 0.013, 0.008, 0.001, -0.0007, 0.0012)]
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    written = " ".join(f'{key}="{value!r}"' for key, value in zip(keys, moments, strict=True))
    return f'<inertial><origin xyz="{xyz}" rpy="{rpy}"/><mass value="{mass!r}"/><inertia {written}/></inertial>'


def link(name: str, *content: str) -> str:
    return f'  <link name="{name}">{"".join(content)}</link>\n'


def joint(
    name: str,
    kind: str,
    parent: str,
    child: str,
    xyz: str = "0 0 0",
    rpy: str = "0 0 0",
    axis: str = "0 0 1",
    more: str = "",
) -> str:
    limit = '<limit lower="-2" upper="2" effort="0" velocity="0"/>' if kind in {"revolute", "prismatic"} else ""
    return (
        f'  <joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>{limit}{more}</joint>\n'
    )


def robot(*parts: str, name: str = "made") -> str:
    return f'<?xml version="1.0"?>\n<robot name="{name}">\n{"".join(parts)}</robot>\n'


#: A chain of six with turned inertias and oblique axes.
ARM = robot(
    link("base"),
    *(link(f"l{k}", inertial(4.0 - 0.5 * k, f"0.0{k} 0.02 0.1", f"0.{k} -0.5 0.{9 - k}")) for k in range(6)),
    joint("j0", "revolute", "base", "l0", "0 0 0.3", axis="0 0 1"),
    *(
        joint(f"j{k}", "revolute", f"l{k - 1}", f"l{k}", f"0.{k} 0 0.2", f"0.{k} 0.2 -0.{k}", axis)
        for k, axis in zip(range(1, 6), ("0 1 0", "0 1 0", "1 0 0", "0 0.6 0.8", "1 0 0"), strict=True)
    ),
)
#: A torso with two arms of two links, and a head.
BRANCHED = robot(
    link("pelvis"),
    link("torso", inertial(8.0)),
    link("head", inertial(2.0, "0 0 0.1")),
    *(link(f"{side}_{part}", inertial(1.5)) for side in ("left", "right") for part in ("upper", "lower")),
    joint("waist", "revolute", "pelvis", "torso", "0 0 0.9", axis="0 0 1"),
    joint("neck", "revolute", "torso", "head", "0 0 0.5", "0 0.1 0", "0 1 0"),
    joint("left_shoulder", "revolute", "torso", "left_upper", "0 0.2 0.4", "0.3 0 0", "0 1 0"),
    joint("left_elbow", "revolute", "left_upper", "left_lower", "0 0 -0.3", axis="0 1 0"),
    joint("right_shoulder", "revolute", "torso", "right_upper", "0 -0.2 0.4", "-0.3 0 0", "0 1 0"),
    joint("right_elbow", "revolute", "right_upper", "right_lower", "0 0 -0.3", axis="0 1 0"),
)
#: A gantry: two sliders, a wrist that turns without end.
GANTRY = robot(
    link("frame"),
    link("bridge", inertial(12.0)),
    link("carriage", inertial(5.0, rpy="0 0.3 0")),
    link("wheel", inertial(1.0)),
    joint("along", "prismatic", "frame", "bridge", "0 0 1", axis="1 0 0"),
    joint("across", "prismatic", "bridge", "carriage", "0.1 0 0", "0 0 0.3", "0 1 0"),
    joint("turn", "continuous", "carriage", "wheel", "0 0 -0.2", "0.5 0 0", "0 0.28 0.96"),
)
#: A trunk that floats, on two legs of two joints.
WALKER = robot(
    link("trunk", inertial(10.0)),
    *(link(f"{side}_{part}", inertial(1.2, "0 0 -0.15")) for side in ("l", "r") for part in ("thigh", "shank")),
    joint("l_hip", "revolute", "trunk", "l_thigh", "0 0.1 0", axis="0 1 0"),
    joint("l_knee", "revolute", "l_thigh", "l_shank", "0 0 -0.3", axis="0 1 0"),
    joint("r_hip", "revolute", "trunk", "r_thigh", "0 -0.1 0", axis="1 0 0"),
    joint("r_knee", "revolute", "r_thigh", "r_shank", "0 0 -0.3", axis="0 1 0"),
)
#: A hand behind a chain of fixed links, whose second finger follows the first one.
HAND = robot(
    link("base", inertial(3.0)),
    link("arm", inertial(4.0)),
    link("flange"),
    link("sensor", inertial(0.5, "0 0.01 0")),
    link("palm", inertial(1.1)),
    link("first", inertial(0.2, "0.02 0 0.05")),
    link("second", inertial(0.25, "-0.02 0 0.05")),
    link("tip"),
    joint("shoulder", "revolute", "base", "arm", "0 0 0.2", axis="0 1 0"),
    joint("to_flange", "fixed", "arm", "flange", "0 0 0.4", "0 0.3 0.1"),
    joint("to_sensor", "fixed", "flange", "sensor", "0 0 0.02", "0 0 1.2"),
    joint("wrist", "continuous", "sensor", "palm", "0 0 0.03", axis="0 0 1"),
    joint("close", "prismatic", "palm", "first", "0.05 0 0.1", axis="1 0 0"),
    joint(
        *("follow", "prismatic", "palm", "second", "-0.05 0 0.1", "0 0 0", "1 0 0"),
        '<mimic joint="close" multiplier="-0.8" offset="0.002"/>',
    ),
    joint("to_tip", "fixed", "first", "tip", "0 0 0.1", "0.2 1.5707963267948966 0"),
)
#: By name, with whether its root floats.
FIVE = {
    "arm": (ARM, False),
    "branched": (BRANCHED, False),
    "gantry": (GANTRY, False),
    "walker": (WALKER, True),
    "hand": (HAND, False),
}

_numbers = st.floats(-1.0, 1.0).map(lambda value: round(value, 6))


@st.composite
def random_robots(draw: st.DrawFn) -> str:
    """A tree of links on revolute, continuous, prismatic and fixed joints, some links without a mass."""
    count = draw(st.integers(1, 6))
    parts = [link("root")]

    def three(strategy: Any = _numbers) -> str:
        return " ".join(repr(draw(strategy)) for _ in range(3))

    for k in range(count):
        parent = "root" if k == 0 else draw(st.sampled_from(["root", *(f"l{j}" for j in range(k))]))
        kind = "revolute" if k == 0 else draw(st.sampled_from(["revolute", "continuous", "prismatic", "fixed"]))
        massless = kind == "fixed" and draw(st.booleans())
        parts.append(
            link(f"l{k}", "" if massless else inertial(draw(st.floats(0.1, 5.0)), three(), three(st.floats(-3, 3))))
        )
        axis = draw(st.tuples(_numbers, _numbers, _numbers).filter(lambda a: math.hypot(*a) > 0.1))
        parts.append(joint(f"j{k}", kind, parent, f"l{k}", three(), three(st.floats(-3, 3)), " ".join(map(repr, axis))))
    return robot(*draw(st.permutations(parts)))
