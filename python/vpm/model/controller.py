"""Controllers of a model file: what each type is made of, and the units of its gains."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from vpm.catalogue import EFFORT_UNIT
from vpm.model.entry import ZERO, Entry, Number, ParameterValue, Quantity, Text

if TYPE_CHECKING:
    from vpm.model.structure import Structure


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


@dataclass(frozen=True)
class Gain:
    """A number of a controller: the end of its dotted name, the way to it in the table, what stands there, its unit."""

    suffix: str
    way: tuple[str | int, ...]
    quantity: Quantity
    unit: str
    is_limit: bool = False


def gains(controller: Controller, structure: Structure) -> Iterator[Gain]:
    """Every number of a controller that is a parameter, limits last.

    Parameters
    ----------
    controller : Controller
        Its references have to be right.
    structure : Structure

    Yields
    ------
    Gain
    """
    commands = [structure.document.actuators[actuator].command_unit for actuator, _ in controller.pairs]
    if isinstance(controller, ComputedTorque):
        for key, unit in (("proportional", "1/s^2"), ("derivative", "1/s")):
            for i, (joint, quantity) in enumerate(zip(controller.joints, getattr(controller, key), strict=True)):
                yield Gain(f"{key}.{joint}", (key, i), quantity, unit)
        for i, (joint, quantity) in enumerate(zip(controller.joints, controller.limit or (), strict=False)):
            yield Gain(f"limit.{joint}", ("limit", i), quantity, commands[i], is_limit=True)
        return
    units = _units(controller, commands[0], structure)
    for key in controller.GAINS:
        yield Gain(key, (key,), getattr(controller, key), units[key])
    if controller.limit is not None:
        yield Gain("limit", ("limit",), controller.limit, commands[0], is_limit=True)


def _units(controller: Cascade | Pid | Pd | ForceLoop, command: str, structure: Structure) -> dict[str, str]:
    held = structure.unit(controller.measures)
    if isinstance(controller, ForceLoop):
        effort = EFFORT_UNIT[structure.joint_kind(controller.measures.partition(".")[0])]
        stroke = "m" if structure.document.actuators[controller.actuator].line is not None else held
        return {
            "proportional": f"({effort})/({held})",
            "derivative": f"({effort}) s/({held})",
            "feed_forward": f"({command})/({structure.effort_unit(controller.actuator)})",
            "force_gain": f"({command})/({structure.effort_unit(controller.actuator)})",
            "velocity_gain": f"({command}) s/({stroke})",
        }
    return {
        "position_gain": "1/s",
        "velocity_gain": f"({command}) s/({held})",
        "proportional": f"({command})/({held})",
        "integral": f"({command})/({held} s)",
        "derivative": f"({command}) s/({held})",
    }
