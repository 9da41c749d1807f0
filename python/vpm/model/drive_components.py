"""What a model answers about its drives and supplies, by name: types, what they move, inputs, states."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue import EFFECTS
from vpm.errors import ModelError, near_match
from vpm.model.checked import Checked
from vpm.model.drives import COMPLIANT
from vpm.model.hydraulic import Hydraulic
from vpm.model.pose import Pose
from vpm.model.splitting import joints_turned
from vpm.model.structure import Mount, Structure
from vpm.model.table import Table, beyond

Array = NDArray[np.float64]
#: States of a drive beside its lag, in the order of the core.
DRIVE_STATES: Mapping[str, tuple[str, ...]] = {
    "dc_motor": ("current",),
    "maxwell": ("stretch",),
}
#: What is lost of a supply's pressure on the way to the valves: group of the parameters, and state.
DROP = "drop"
#: States of a cylinder by how its pressures come about.
OIL_STATES: Mapping[str, tuple[str, ...]] = {
    "chambers": ("chamber_a", "chamber_b"),
    "load": ("load",),
    "quasi_static": (),
}


class DriveComponents:
    """The part of a model that knows its drives; it relies on the checked document and changes nothing."""

    _checked: Checked

    @property
    def supplies(self) -> tuple[str, ...]:
        """Hydraulic supplies."""
        return tuple(self._checked.document.supplies)

    @cached_property
    def logged_supplies(self) -> tuple[str, ...]:
        """Supplies whose pressure is an input, taken from the log."""
        supplies = self._checked.document.supplies
        return tuple(name for name, supply in supplies.items() if supply.source == "logged")

    @property
    def actuators(self) -> tuple[str, ...]:
        """Actuators; actuator k is input k."""
        return tuple(self._checked.document.actuators)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Inputs by name: each actuator for its command, then ``pump.pressure`` of each logged supply."""
        return (*self.actuators, *(f"{name}.pressure" for name in self.logged_supplies))

    @cached_property
    def input_channels(self) -> tuple[str, ...]:
        """Commands, one per actuator, then the pressures of logged supplies."""
        return (*(f"{name}.command" for name in self.actuators), *self.inputs[len(self.actuators) :])

    @cached_property
    def optional_inputs(self) -> frozenset[str]:
        """Commands that a log need not hold: lengths that are added to those of springs, none by default."""
        actuators = self._checked.document.actuators
        return frozenset(f"{name}.command" for name, entry in actuators.items() if isinstance(entry, COMPLIANT))

    @property
    def is_abrupt(self) -> bool:
        """Whether contacts or oil can change a motion within a sample, so that its steps need control."""
        document = self._checked.document
        return bool(document.contacts) or any(entry.type == "hydraulic" for entry in document.actuators.values())

    def actuator_type(self, actuator: str) -> str:
        """Type of an actuator.

        "ideal", "dc_motor", "spring_damper", "maxwell", "hydraulic", "table", "narx" or "maxwell_narx".

        Raises
        ------
        ModelError
            There is no such actuator.
        """
        return self._checked.document.actuators[self._known(actuator, self.actuators, "actuator")].type

    def follows_command(self, actuator: str) -> bool:
        """Whether the effort of an actuator follows from its command alone, sample by sample.

        Raises
        ------
        ModelError
            There is no such actuator.
        """
        return self.actuator_type(actuator) == "ideal" and not self._rubs(actuator)

    def _rubs(self, actuator: str) -> bool:
        """Whether an actuator has friction of its own."""
        own = (EFFECTS[e.type] for e in self._checked.document.effects if e.at == actuator)
        return any(effect.site == "actuator" and effect.rubs for effect in own)

    def beyond_tables(self, time: Array, columns: Mapping[str, Array]) -> tuple[str, ...]:
        """Sentences on where a run left the tables of its drives; none as a rule.

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
        """Channel that tells how fast what an actuator acts on moves.

        Raises
        ------
        ModelError
            There is no such actuator.
        """
        entry = self._checked.document.actuators[self._known(actuator, self.actuators, "actuator")]
        return f"{entry.line}.rate" if entry.line is not None else f"{entry.joint or entry.transmission}.velocity"

    def supply_of_actuator(self, actuator: str) -> str | None:
        """Supply of a hydraulic actuator; None for the others.

        Raises
        ------
        ModelError
            There is no such actuator.
        """
        entry = self._checked.document.actuators[self._known(actuator, self.actuators, "actuator")]
        return entry.supply if entry.type == "hydraulic" else None

    @cached_property
    def driven_joints(self) -> tuple[str, ...]:
        """Joints on which an actuator has an effect, see `joints_of_actuator`; a balance of effort sees no others."""
        driven = {joint for name in self.actuators for joint in self.joints_of_actuator(name)}
        return tuple(joint for joint in self._checked.structure.joints if joint in driven)

    def joints_of_actuator(self, actuator: str) -> tuple[str, ...]:
        """Joints on which an actuator has an effect: its own, those of its transmission, or those that move its line.

        Raises
        ------
        ModelError
            There is no such actuator.
        """
        entry = self._checked.document.actuators[self._known(actuator, self.actuators, "actuator")]
        if entry.line is None:
            return joints_turned(entry, self._checked.document)
        structure, line = self._checked.structure, self._checked.document.lines[str(entry.line)]
        ends = [structure.mounted(end.parent, end.at, Pose()).mount for end in (line.start, line.end)]
        ways = [set(_way(structure, end)) for end in ends]
        return tuple(name for k, name in enumerate(structure.joints) if k in ways[0] ^ ways[1])

    def has_lag(self, actuator: str) -> bool:
        """Whether an actuator follows its command with a lag, which adds a state."""
        self._known(actuator, self.actuators, "actuator")
        return any(e.traits.late == "lag" and e.at == actuator for e in self._checked.document.effects)

    @cached_property
    def internal_names(self) -> tuple[str, ...]:
        """States beside coordinates and rates: of actuators (lag, drive), of supplies (pressure, drop), memories."""
        of_drives = (state for name in self.actuators for state in self._states_of(name))
        of_supplies = (state for name in self.supplies for state in self._states_of_supply(name))
        effects = self._checked.document.effects
        memories = (f"{e.owner}.{EFFECTS[e.type].memory}" for e in effects if EFFECTS[e.type].memory)
        return (*of_drives, *of_supplies, *memories)

    def _states_of(self, actuator: str) -> Iterator[str]:
        if self.has_lag(actuator):
            yield f"{actuator}.lag"
        entry = self._checked.document.actuators[actuator]
        states = DRIVE_STATES.get(entry.type, ())
        if isinstance(entry, Hydraulic):
            moving = entry.valve.spool == "second_order"
            states = (*(("spool", "spool_rate") if moving else ()), *OIL_STATES[entry.cylinder.pressures])
        for state in states:
            yield f"{actuator}.{state}"

    def _states_of_supply(self, supply: str) -> Iterator[str]:
        """Its pressure if it sags, and what is lost on the way to the valves if anything is."""
        document = self._checked.document
        if document.supplies[supply].source == "sagging":
            yield f"{supply}.pressure"
        if any(EFFECTS[e.type].group == DROP and e.at == supply for e in document.effects):
            yield f"{supply}.{DROP}"

    def internal_unit(self, state: str) -> str:
        """SI unit of a state of `internal_names`."""
        owner, _, name = state.rpartition(".")
        pressures = dict.fromkeys(("chamber_a", "chamber_b", "load", "pressure", "drop"), "Pa")
        units = {"current": "A", "stretch": "m", "memory": "1"} | pressures
        if name in units:
            return units[name]
        command = self._checked.structure.unit(f"{owner}.command")
        return f"{command}/s" if name == "spool_rate" else command

    def _known(self, name: str, names: tuple[str, ...], what: str) -> str:
        if name not in names:
            model = self._checked.document.name
            raise ModelError(f'{model} has no {what} "{name}"; {near_match(name, names, what="it has")}', where=name)
        return name


def _way(structure: Structure, mount: Mount) -> Iterator[int]:
    """Joints on the way from a mount to the world."""
    while mount.kind != "world":
        if mount.kind == "section":
            mount = structure.frames[structure.beams[mount.index]].mount
        else:
            yield mount.index
            mount = structure.axes[mount.index].frame.mount
