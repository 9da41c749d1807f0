"""Where each effect shows: the state over which its residual is a line, what that line looks like, what excites it.

A report draws its evidence over this state, and the page of the catalogue says it in words.
"""

from dataclasses import dataclass
from typing import Literal

Axis = Literal[
    "velocity",
    "position",
    "acceleration",
    "effort",
    "command",
    "command_rate",
    "pressure_difference",
    "flow",
    "frequency",
    "time",
]
"""What a residual can be drawn over: motion of the joint, effort that it needs, command and its rate, hydraulics."""


@dataclass(frozen=True)
class Signature:
    """How an effect shows itself."""

    #: What to draw the residual over. Of several the one that explains most of the effect in the data at hand.
    lives_in: tuple[Axis, ...]
    looks: str  #: What is to be seen there, a sentence without its full stop.
    excite: str  #: The experiment that shows it best, a sentence without its full stop.


#: For effects that users add without saying where they live: what explains most of it is drawn.
ANYWHERE = Signature(
    ("velocity", "position", "acceleration", "effort", "command", "time"),
    "A line over one of the states",
    "Motion that covers the states that its law names",
)
