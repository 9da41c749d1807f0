"""Controllers: what each type is made of, its gains with their units, and what it may command and measure."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import AfterValidator, Field

from vpm.errors import near_match
from vpm.model.component import Component, Described, Index
from vpm.model.entry import ZERO, Number, ParameterValue, Text
from vpm.model.joint import EFFORT_UNIT
from vpm.model.messages import Problem, place
from vpm.model.outputs import described_channel
from vpm.model.parameters import ABOVE_ZERO, ANY, Keys, Rule, Slot, rules_of
from vpm.units import si_unit

if TYPE_CHECKING:
    from vpm.model.schema import Document
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


Gain = Annotated[ParameterValue, Rule("", ANY)]
Limit = Annotated[ParameterValue | None, Rule("", ABOVE_ZERO)]


class Sampled(Component):
    """When a controller measures, and how late its command is."""

    if TYPE_CHECKING:  # each law has the key at a place of its own

        @property
        def type(self) -> str:
            """Type of a controller's law."""

    sample_time: Annotated[Number, AfterValidator(_period)] | None = None
    delay: Annotated[Number, AfterValidator(_lateness)] = 0.0

    @property
    @abstractmethod
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Each actuator that a controller commands, with the channel that it measures there."""

    def commands(self, structure: Structure) -> list[str]:
        """Units of a controller's commands."""
        return [structure.document.actuators[actuator].command_unit for actuator, _ in self.pairs]

    def _common(self, name: str) -> Described:
        return {"type": self.type, "name": name, "sample_time": self.sample_time, "delay": self.delay or None}


class OneAxis(Sampled):
    """Controller of one actuator by one channel."""

    actuator: Text
    measures: Text

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """The actuator that a controller commands, with the channel that it measures there."""
        return ((self.actuator, self.measures),)

    def units(self, name: str, structure: Structure) -> Mapping[str, str]:  # noqa: ARG002
        """SI units of a one-axis controller's gains and limit."""
        (command,) = self.commands(structure)
        return {key: si_unit(unit) for key, unit in self._units(command, structure).items()}

    def _units(self, command: str, structure: Structure) -> dict[str, str]:
        held = structure.unit(self.measures)
        return {
            "limit": command,
            "position_gain": "1/s",
            "velocity_gain": f"({command}) s/({held})",
            "proportional": f"({command})/({held})",
            "integral": f"({command})/({held} s)",
            "derivative": f"({command}) s/({held})",
        }

    def described(self, name: str, structure: Structure, index: Index) -> Described:
        """What the core reads of a controller of one actuator by one channel."""
        return {
            **self._common(name),
            "actuator": list(structure.document.actuators).index(self.actuator),
            "measures": described_channel(self.measures, structure),
            **{key: index.get(f"{name}.{key}") for key in rules_of(type(self))},
        }


class Cascade(OneAxis):
    """Position and velocity loop: u = kv (kp (r - y) - dy)."""

    type: Literal["cascade"]
    position_gain: Gain
    velocity_gain: Gain
    limit: Limit = None


class Pid(OneAxis):
    """u = kp e + ki int e + kd de/dt."""

    type: Literal["pid"]
    proportional: Gain
    integral: Gain = ZERO
    derivative: Gain = ZERO
    limit: Limit = None


class Pd(OneAxis):
    """u = kp (r - y) - kd dy, with dy as it is measured."""

    type: Literal["pd"]
    proportional: Gain
    derivative: Gain = ZERO
    limit: Limit = None


class ForceLoop(OneAxis):
    """tau = kp (r - q) - kd dq, u = kff tau / (ds/dq) + kf (tau / (ds/dq) - F) + kv ds/dt."""

    type: Literal["force_loop"]
    proportional: Gain
    derivative: Gain = ZERO
    feed_forward: Gain = ZERO
    force_gain: Gain = ZERO
    velocity_gain: Gain = ZERO
    limit: Limit = None

    def _units(self, command: str, structure: Structure) -> dict[str, str]:
        held, entry = structure.unit(self.measures), structure.document.actuators[self.actuator]
        effort = EFFORT_UNIT[structure.joint_kind(self.measures.partition(".")[0])]
        stroke = held if entry.joint is not None else "m" if entry.line is not None else "rad"
        per_force = f"({command})/({structure.effort_unit(self.actuator)})"
        return {
            "limit": command,
            "proportional": f"({effort})/({held})",
            "derivative": f"({effort}) s/({held})",
            "feed_forward": per_force,
            "force_gain": per_force,
            "velocity_gain": f"({command}) s/({stroke})",
        }


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
        """Each actuator that a computed-torque controller commands, with the channel that it measures there."""
        return tuple(zip(self.actuators, self.measures, strict=False))

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints that a computed-torque controller measures."""
        return tuple(channel.partition(".")[0] for channel in self.measures)

    def slots(self, keys: Keys, structure: Structure) -> Iterator[Slot]:
        """Gains of a computed-torque controller, and its limits."""
        commands = self.commands(structure)
        units = {"proportional": ["1/s^2"] * len(commands), "derivative": ["1/s"] * len(commands), "limit": commands}
        for key, of_key in units.items():
            for i, (quantity, unit) in enumerate(zip(getattr(self, key) or (), of_key, strict=False)):
                bounds, named = ABOVE_ZERO if key == "limit" else ANY, f"{keys[1]}.{key}.{self.joints[i]}"
                yield Slot((*keys, key, i), quantity, si_unit(unit), bounds, named=named)

    def described(self, name: str, structure: Structure, index: Index) -> Described:
        """What the core reads of a computed-torque controller."""
        actuators = list(structure.document.actuators)

        def of_joints(key: str) -> list[int]:
            return [index[f"{name}.{key}.{joint}"] for joint in self.joints]

        return {
            **self._common(name),
            "actuators": [actuators.index(actuator) for actuator in self.actuators],
            "measures": [described_channel(channel, structure) for channel in self.measures],
            **{key: of_joints(key) for key in ("proportional", "derivative")},
            "limit": None if self.limit is None else of_joints("limit"),
        }


Controller = Annotated[Cascade | Pid | Pd | ForceLoop | ComputedTorque, Field(discriminator="type")]


def controller_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Controllers that name what is not there, command what is commanded already, or cannot do what they are to."""
    seen: dict[str, str] = {}
    for name, controller in document.controllers.items():
        if isinstance(controller, ComputedTorque):
            yield from _list_problems(name, controller)
            yield from _elastic_problems(name, document)
        for i, (actuator, channel) in enumerate(controller.pairs):
            several: tuple[str | int, ...] = (i,) if isinstance(controller, ComputedTorque) else ()
            key = "actuators" if several else "actuator"
            where = place("controllers", name, key, *several)
            if actuator not in document.actuators:
                repair = near_match(actuator, document.actuators, what="it has")
                yield Problem(where, f'is "{actuator}", which is no actuator of the model; {repair}')
            elif actuator in seen:
                rest = f'is "{actuator}", which controller "{seen[actuator]}" already commands; remove one'
                yield Problem(where, rest)
            seen.setdefault(actuator, name)
            where = place("controllers", name, "measures", *several)
            yield from _channel_problems(where, channel, controller, structure)
            if actuator in document.actuators and channel in structure.outputs:
                yield from _pair_problems(where, actuator, channel, controller, document)


def _channel_problems(where: str, channel: str, controller: Controller, structure: Structure) -> Iterator[Problem]:
    positions = [f"{joint}.position" for joint in structure.joints]
    if isinstance(controller, Cascade | Pid | Pd):
        positions += [f"{shaft}.position" for shaft in structure.document.transmissions]
    lengths = [f"{line}.length" for line in structure.document.lines] if isinstance(controller, Pd) else []
    if channel not in (*positions, *lengths):
        repair = near_match(channel, [*positions, *lengths], what="it can measure")
        what = "no joint position or line length" if lengths else "no joint position"
        yield Problem(where, f'is "{channel}", which is {what} of the model; {repair}')


def _pair_problems(
    where: str, actuator: str, channel: str, controller: Controller, document: Document
) -> Iterator[Problem]:
    """Problems of controllers from a joint to an actuator that is elsewhere."""
    entry, joint = document.actuators[actuator], channel.partition(".")[0]
    elsewhere = entry.joint not in {None, joint}
    drives = entry.acted_on
    if isinstance(controller, ForceLoop) and elsewhere:
        rest = (
            f"but a force_loop needs an actuator on a line or on the joint it measures; measure {entry.joint}.position"
        )
        yield Problem(where, f'is "{channel}", while "{actuator}" drives {drives}, {rest}')
    if isinstance(controller, ComputedTorque) and entry.type != "ideal":
        rest = f'has the type "{entry.type}", but computed_torque commands efforts; make it "ideal" or control it by pd'
        yield Problem(place("actuators", actuator, "type"), rest)
    elif isinstance(controller, ComputedTorque) and entry.joint != joint:
        rest = "but computed_torque needs each actuator on the joint it measures in the same place; reorder the lists"
        rest += "" if entry.joint is not None else ", or use force_loop"
        yield Problem(where, f'is "{channel}", while "{actuator}" drives {drives}, {rest}')


def _list_problems(name: str, controller: ComputedTorque) -> Iterator[Problem]:
    count = len(controller.actuators)
    for key in ("measures", "proportional", "derivative", "limit"):
        found = getattr(controller, key)
        if found is not None and len(found) != count:
            rest = f"has {len(found)} entries for {count} actuators; give one for each, in their order"
            yield Problem(place("controllers", name, key), rest)


def _elastic_problems(name: str, document: Document) -> Iterator[Problem]:
    elastic = [beam for beam, entry in document.beams.items() if entry.detail.name != "rigid"]
    if elastic:
        rest = (
            f'inverts the model of the machine, but nobody measures the elastic coordinates of beam "{elastic[0]}"; '
            'set its level to "rigid" or use type = "pd"'
        )
        yield Problem(place("controllers", name), rest)
