"""What a model answers about its drives and supplies, by name: types, what they move, inputs, states."""

from collections.abc import Mapping
from functools import cached_property

from vpm.catalogue import EFFECTS
from vpm.errors import ModelError, near_match
from vpm.model.checked_document import Checked
from vpm.model.drives.actuator import Actuator
from vpm.model.drives.spring import Compliant
from vpm.model.drives.table import Table, beyond
from vpm.model.pose import Pose
from vpm.numbers import Array


class DriveComponents:
    """The part of a model that knows its drives; it relies on the checked document and changes nothing."""

    _checked: Checked

    @property
    def supplies(self) -> tuple[str, ...]:
        """Answers with the hydraulic supplies of a model, by name."""
        return tuple(self._checked.document.supplies)

    @cached_property
    def logged_supplies(self) -> tuple[str, ...]:
        """Answers with the supplies whose pressure is an input, taken from the log."""
        supplies = self._checked.document.supplies
        return tuple(name for name, supply in supplies.items() if supply.source == "logged")

    @property
    def actuators(self) -> tuple[str, ...]:
        """Answers with the actuators; actuator k is input k."""
        return tuple(self._checked.document.actuators)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Answers with input names: each actuator's command, then ``pump.pressure`` of logged supplies."""
        return (*self.actuators, *(f"{name}.pressure" for name in self.logged_supplies))

    @cached_property
    def input_channels(self) -> tuple[str, ...]:
        """Answers with input channels: commands of actuators, then pressures of logged supplies."""
        return (*(f"{name}.command" for name in self.actuators), *self.inputs[len(self.actuators) :])

    @cached_property
    def optional_inputs(self) -> frozenset[str]:
        """Answers with commands that a log need not hold: lengths added to springs, none by default."""
        actuators = self._checked.document.actuators
        return frozenset(f"{name}.command" for name, entry in actuators.items() if isinstance(entry, Compliant))

    @property
    def is_abrupt(self) -> bool:
        """Answers whether contacts or oil can change a motion within a sample, so that steps need control."""
        document = self._checked.document
        return bool(document.contacts) or any(entry.type == "hydraulic" for entry in document.actuators.values())

    def actuator_type(self, actuator: str) -> str:
        """Answers with the type of an actuator.

        "ideal", "dc_motor", "spring_damper", "maxwell", "hydraulic", "table", "narx" or "maxwell_narx".

        Raises
        ------
        ModelError
            There is no such actuator.
        """
        return self._drive(actuator).type

    def follows_command(self, actuator: str) -> bool:
        """Answers whether an actuator's effort follows from its command alone, sample by sample.

        Raises
        ------
        ModelError
            There is no such actuator.
        """
        entry = self._drive(actuator)
        return entry.type == "ideal" and not entry.rubs(actuator, self._checked.document)

    def beyond_tables(self, time: Array, columns: Mapping[str, Array]) -> tuple[str, ...]:
        """Answers with sentences on where a run left the tables of its drives; none as a rule.

        Parameters
        ----------
        time : ndarray, shape (N,)
            s.
        columns : mapping of str to ndarray, shape (N,)
            Channels of the run.
        """
        found = []
        for name, entry in self._checked.document.actuators.items():
            if isinstance(entry, Table):
                moving = self.rate_channel(name)
                axes = {f"{name}.command": entry.commands, moving: entry.velocities}
                units = self._checked.structure.unit
                told = (
                    beyond(key, axis, columns[key], units(key), time) for key, axis in axes.items() if key in columns
                )
                found += [sentence for sentence in told if sentence]
        return tuple(found)

    def rate_channel(self, actuator: str) -> str:
        """Answers with the channel of the speed at which an actuator's target moves.

        Raises
        ------
        ModelError
            There is no such actuator.
        """
        entry = self._drive(actuator)
        return f"{entry.line}.rate" if entry.line is not None else f"{entry.joint or entry.transmission}.velocity"

    def supply_of_actuator(self, actuator: str) -> str | None:
        """Answers with the supply of a hydraulic actuator; None for the others.

        Raises
        ------
        ModelError
            There is no such actuator.
        """
        entry = self._drive(actuator)
        return entry.supply if entry.type == "hydraulic" else None

    @cached_property
    def driven_joints(self) -> tuple[str, ...]:
        """Answers with all joints on which an actuator has an effect, see `joints_of_actuator`."""
        driven = {joint for name in self.actuators for joint in self.joints_of_actuator(name)}
        return tuple(joint for joint in self._checked.structure.joints if joint in driven)

    def joints_of_actuator(self, actuator: str) -> tuple[str, ...]:
        """Answers with the joints of one actuator: its own, its transmission's, or those of its line.

        Raises
        ------
        ModelError
            There is no such actuator.
        """
        entry = self._drive(actuator)
        if entry.line is None:
            return entry.joints_turned(self._checked.document)
        structure, line = self._checked.structure, self._checked.document.lines[str(entry.line)]
        ends = [structure.mounted(end.parent, end.at, Pose()).mount for end in (line.start, line.end)]
        ways = [set(structure.way(end)) for end in ends]
        return tuple(name for k, name in enumerate(structure.joints) if k in ways[0] ^ ways[1])

    def has_lag(self, actuator: str) -> bool:
        """Answers whether an actuator follows its command with a lag, which adds a state."""
        self._known(actuator, self.actuators, "actuator")
        return any(e.traits.late == "lag" and e.at == actuator for e in self._checked.document.effects)

    @cached_property
    def internal_names(self) -> tuple[str, ...]:
        """Answers with states beside coordinates and rates: of actuators, supplies, and memories."""
        return tuple(self._internal_units)

    def internal_unit(self, state: str) -> str:
        """Answers with the SI unit of a state of `internal_names`."""
        return self._internal_units[state]

    @cached_property
    def _internal_units(self) -> Mapping[str, str]:
        document, units = self._checked.document, dict[str, str]()
        for name, drive in document.actuators.items():
            command = self._checked.structure.unit(f"{name}.command")
            units |= {f"{name}.lag": command} if self.has_lag(name) else {}
            states = drive.states.items()
            units |= {f"{name}.{state}": f"{command}{own}" if own in {"", "/s"} else own for state, own in states}
        for name, supply in document.supplies.items():
            units |= dict.fromkeys((f"{name}.{state}" for state in supply.states(name, document)), "Pa")
        memories = (f"{e.owner}.{EFFECTS[e.type].memory}" for e in document.effects if EFFECTS[e.type].memory)
        return units | dict.fromkeys(memories, "1")

    def _drive(self, actuator: str) -> Actuator:
        return self._checked.document.actuators[self._known(actuator, self.actuators, "actuator")]

    def _known(self, name: str, names: tuple[str, ...], what: str) -> str:
        if name not in names:
            model = self._checked.document.name
            raise ModelError(f'{model} has no {what} "{name}"; {near_match(name, names, what="it has")}', where=name)
        return name
