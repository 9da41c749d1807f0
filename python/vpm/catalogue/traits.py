"""What an effect does, by its physics: what the rest of the package asks of an effect instead of its name."""

from dataclasses import dataclass
from typing import Literal

#: How a split part moves against what it hangs on.
Motion = Literal["", "deflection", "bending"]
#: Friction of every joint, or a force that many have.
Usual = Literal["", "friction", "force"]
#: Whole and unchanged; gradually, as a system of first order; as a valve's spool, a system of second order.
Late = Literal["", "delay", "lag", "spool"]
#: Numbers of a joint that all descriptions of robots have: effort per speed, dry effort, effort per way.
Plain = Literal["", "damping", "friction", "stiffness"]
#: What the data show, in which a start value is measured: largest speed, half travel, half travel about the middle of
#: the way, sampling interval, largest command, longest record; "one" for numbers that no data scale.
Seen = Literal["speed", "travel", "way", "interval", "command", "record", "one"]


@dataclass(frozen=True)
class Tried:
    """Start values of one parameter that are tried, and its bounds."""

    parameter: str
    """Its short name."""
    of: Seen
    """What the start values and their bounds are multiples of."""
    shares: tuple[float, ...]
    """The start values; none for a parameter that has bounds alone."""
    within: tuple[float, float]
    """The bounds that the data give it."""
    sampled: bool = False
    """Whether it is a way that has to last from one sample to the next, else it cannot be seen."""


@dataclass(frozen=True, kw_only=True)
class Traits:
    """Traits of an effect; one that is not given is not there."""

    motion: Motion = ""
    """The motion that nobody measures which it adds: of a link against its motor, or of a link that bends."""
    impacts: bool = False
    """Whether its sides come into contact and part again: those of a play, or of a way and its end."""
    rotor: bool = False
    """Whether it is nothing but an inertia that turns with the motor."""
    sticks: bool = False
    """Whether a joint can stick by it where it turns round, so that what is late is timed in clear motion."""
    close_to_rest: bool = False
    """Whether it acts while a joint lets go, which filtered records hardly show and runs of the model do."""
    usual: Usual = ""
    """What joints have of themselves, so that no log is blamed for it; a force may look like a wrong sign."""
    plain: Plain = ""
    """What its first parameter is in other descriptions of robots, where it stands for a joint as a number alone."""
    zero: bool = False
    """Whether it is nothing but a shifted zero, as every reading may have one."""
    late: Late = ""
    """How what it passes on comes late."""
    damps: bool = False
    """Whether all that it does is to damp vibrations of links that bend."""
    motor_side_alone: bool = False
    """Whether, at a joint with a compliance or backlash, it belongs to the motor side or to the spring itself."""
    link_side_alone: bool = False
    """Whether the link alone has it, and never the shaft of a transmission: links run into ends and hang on springs."""
    in_springs: bool = False
    """Whether a spring that gives way between a motor and its link, or at the root of a link, may have it in itself."""
    takes_effort: bool = False
    """Whether it does nothing at a joint on which no actuator acts itself."""
    beside_others: bool = False
    """Whether it is looked for at an actuator on a line or beside others alone: elsewhere it is one of the joint."""
    memory: str = ""
    """What the memory of its law, a state of the machine, is called at its site; "" if it has none."""
    exact: bool = False
    """Whether mechanics alone gives its law, so that no machine differs from it by its shape."""
    requires: str | None = None
    """The effect that has to be at the same site before this one is worth looking for: it is a correction of that."""
    contains: tuple[str, ...] = ()
    """Plainer effects that it is at some values of its parameters."""
    tried: tuple[Tried, ...] = ()
    """The start values that are tried, and bounds, where a fit would not end well from anywhere."""
    fixed: tuple[str, ...] = ()
    """Short names of the shapes that are left at their start."""
    of_spring: tuple[tuple[str, str], ...] = ()
    """What a play in series with a spring of its joint has from that: short names, with those that they have there."""

    @property
    def shifts(self) -> bool:
        """Trait: whether an effect shifts in time what it passes on, as a lag nearly does."""
        return self.late in {"delay", "lag"}

    @property
    def has_play(self) -> bool:
        """Trait: whether an effect has a gap within which its two sides move without each other."""
        return self.impacts and bool(self.motion)

    @property
    def stops(self) -> bool:
        """Trait: whether an effect ends the way of a joint."""
        return self.impacts and not self.motion

    @property
    def elastic(self) -> bool:
        """Trait: whether an effect is a spring with a motion of its own."""
        return bool(self.motion) and not self.impacts

    @property
    def winds_up(self) -> bool:
        """Trait: whether an effect is a spring between a motor and its link."""
        return self.elastic and self.motion == "deflection"

    @property
    def splits(self) -> bool:
        """Trait: whether an effect splits a joint into motor side and link side."""
        return self.motion == "deflection"
