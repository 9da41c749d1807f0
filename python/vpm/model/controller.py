"""Controllers of a model file: what each type is made of."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from vpm.model.entry import ZERO, Entry, Number, ParameterValue, Text


def _period(value: float) -> float:
    if not value > 0.0:
        raise ValueError(
            f"is {value:g} s, but samples need a positive time between them; leave it out to use every sample"
        )
    return value


def _lateness(value: float) -> float:
    if not value >= 0.0:
        raise ValueError(f"is {value:g} s, but a command cannot come before its measurement; give 0 or more")
    return value


class Sampled(Entry):
    """When a controller measures, and how late its command is."""

    sample_time: Annotated[Number, AfterValidator(_period)] | None = None
    delay: Annotated[Number, AfterValidator(_lateness)] = 0.0


class OneAxis(Sampled):
    """Controller of one actuator by one channel."""

    actuator: Text
    measures: Text

    #: Gains by key, in the order of their parameters.
    GAINS: ClassVar[tuple[str, ...]] = ()

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Each actuator that it commands, with the channel that it measures there."""
        return ((self.actuator, self.measures),)


class Cascade(OneAxis):
    """Position and velocity loop: u = kv (kp (r - y) - dy)."""

    type: Literal["cascade"]
    position_gain: ParameterValue
    velocity_gain: ParameterValue
    limit: ParameterValue | None = None

    GAINS: ClassVar[tuple[str, ...]] = ("position_gain", "velocity_gain")


class Pid(OneAxis):
    """u = kp e + ki int e + kd de/dt."""

    type: Literal["pid"]
    proportional: ParameterValue
    integral: ParameterValue = ZERO
    derivative: ParameterValue = ZERO
    limit: ParameterValue | None = None

    GAINS: ClassVar[tuple[str, ...]] = ("proportional", "integral", "derivative")


class Pd(OneAxis):
    """u = kp (r - y) - kd dy, with dy as it is measured."""

    type: Literal["pd"]
    proportional: ParameterValue
    derivative: ParameterValue = ZERO
    limit: ParameterValue | None = None

    GAINS: ClassVar[tuple[str, ...]] = ("proportional", "derivative")


class ForceLoop(OneAxis):
    """tau = kp (r - q) - kd dq, u = kff tau / (ds/dq) + kf (tau / (ds/dq) - F) + kv ds/dt."""

    type: Literal["force_loop"]
    proportional: ParameterValue
    derivative: ParameterValue = ZERO
    feed_forward: ParameterValue = ZERO
    force_gain: ParameterValue = ZERO
    velocity_gain: ParameterValue = ZERO
    limit: ParameterValue | None = None

    GAINS: ClassVar[tuple[str, ...]] = ("proportional", "derivative", "feed_forward", "force_gain", "velocity_gain")


_Several = Annotated[tuple[ParameterValue, ...], Field(min_length=1)]
_Names = Annotated[tuple[Text, ...], Field(min_length=1)]


class ComputedTorque(Sampled):
    """tau = M (r'' + kd (r' - dq) + kp (r - q)) + h - effects, over the joints of several actuators."""

    type: Literal["computed_torque"]
    actuators: _Names
    measures: _Names
    proportional: _Several
    derivative: _Several
    limit: _Several | None = None

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Each actuator that it commands, with the channel that it measures there."""
        return tuple(zip(self.actuators, self.measures, strict=False))

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints that it measures."""
        return tuple(channel.partition(".")[0] for channel in self.measures)


Controller = Annotated[Cascade | Pid | Pd | ForceLoop | ComputedTorque, Field(discriminator="type")]

#: Types of controllers, as a model file names them.
TYPES: tuple[type[Sampled], ...] = (Cascade, Pid, Pd, ForceLoop, ComputedTorque)
