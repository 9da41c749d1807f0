"""Colours and words of what is drawn, on light and on dark ground."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Look:
    """Colours, word in the legend and transparency of a role in a scene."""

    #: Colours on light and on dark ground.
    light: str
    dark: str
    word: str  #: In the legend; "" for none.
    solid: float = 1.0  #: Less than 1 where one sees through it.


#: By role, in the order of the legend. Hues of M. Okabe and K. Ito, "Color Universal Design", 2008.
LOOKS: Mapping[str, Look] = {
    "beam": Look("#0072b2", "#56b4e9", "bending link"),
    "link": Look("#4f7ea3", "#7fa9c9", "link"),
    "mass": Look("#9aa7b5", "#8794a3", "mass", 0.45),
    "inertia": Look("#b3bec9", "#71808f", "box of the same inertia", 0.35),
    "joint": Look("#2b3642", "#dfe6ed", "joint and its axis"),
    "rail": Look("#8a94a0", "#66717d", "way of a slider"),
    "barrel": Look("#b08a2e", "#b8923a", "cylinder"),
    "rod": Look("#c9ced4", "#d9dee3", "rod of a cylinder"),
    "line": Look("#8a6d9e", "#b79ccb", "line"),
    "measured": Look("#e69f00", "#f0b429", "measured", 0.6),
    "contact force": Look("#d55e00", "#ff7f3f", "force of a contact"),
    "drive force": Look("#009e73", "#2fc79b", "force of a drive"),
    "torque": Look("#cc79a7", "#e39bc2", "torque of a drive, along its axis"),
    "contact": Look("#3d8f70", "#5fbf9a", "point of a contact"),
    "marker": Look("#1b2430", "#ffffff", "marker"),
    "plane": Look("#7fb59f", "#3f7a64", "contact plane"),
    "floor": Look("#d3dae1", "#333e4a", "floor"),
    "x": Look("#d62f3c", "#ff6b6b", "x of a joint's frame"),
    "y": Look("#2f9e44", "#69d27c", "y"),
    "z": Look("#2b6cb0", "#6aa8ff", "z"),
}

#: Ground and writing.
GROUND = Look("#fbfcfd", "#12171d", "")
INK = Look("#1b2430", "#e6ebf0", "")
SOFT = Look("#5d6b7a", "#93a1b0", "")


def colour(look: Look, *, dark: bool) -> tuple[float, float, float]:
    """Colour of a look: red, green and blue from 0 to 1."""
    text = look.dark if dark else look.light
    red, green, blue = (int(text[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return red, green, blue
