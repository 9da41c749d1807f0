"""A motion on its mesh: what the program finds, and what it starts from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vpm.numbers import Array
from vpm.optimise.collocation import STAGES, at_times, spread


@dataclass(frozen=True)
class MeshMotion:
    """States at the points of a mesh and commands at its nodes, between which they run straight."""

    meshes: tuple[Array, ...]  #: Nodes of each phase as shares of its duration, from 0 to 1.
    durations: Array  #: Shape (phases,); s.
    states: Array  #: Shape (points, nx).
    commands: tuple[Array, ...]  #: Shapes (nodes, nu); of each phase; they may jump between phases.
    #: Constant commands of the rest at the beginning and at the end of each phase, where there is one.
    rests: tuple[Array | None, ...]

    @cached_property
    def starts(self) -> Array:
        """Start times of a motion's phases, and the end of the last, s."""
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    def of_phase(self, phase: int) -> tuple[Array, Array]:
        """Nodes in s and states of a motion's phase."""
        before = STAGES * sum(mesh.size - 1 for mesh in self.meshes[:phase])
        count = STAGES * (self.meshes[phase].size - 1) + 1
        nodes = self.starts[phase] + self.durations[phase] * self.meshes[phase]
        return nodes, self.states[before : before + count]

    @property
    def times(self) -> Array:
        """Times of a motion's states, s."""
        parts = [spread(self.of_phase(phase)[0])[1:] for phase in range(len(self.meshes))]
        return np.concatenate([[0.0], *parts])

    def at(self, times: Array) -> tuple[Array, Array, Array]:
        """States, rates and commands of a motion at some times."""
        nx, nu = self.states.shape[1], self.commands[0].shape[1]
        states, rates, commands = np.empty((times.size, nx)), np.empty((times.size, nx)), np.empty((times.size, nu))
        own = np.clip(np.searchsorted(self.starts, times, side="right") - 1, 0, len(self.meshes) - 1)
        for phase in range(len(self.meshes)):
            inside = own == phase
            nodes, points = self.of_phase(phase)
            states[inside], rates[inside] = at_times(nodes, points, times[inside])
            for column in range(nu):
                commands[inside, column] = np.interp(times[inside], nodes, self.commands[phase][:, column])
        return states, rates, commands

    def on(self, meshes: tuple[Array, ...]) -> MeshMotion:
        """The motion on other meshes."""
        states = [self.states[:1]]
        commands = []
        for phase, mesh in enumerate(meshes):
            nodes, points = self.of_phase(phase)
            moved = self.starts[phase] + self.durations[phase] * mesh
            states.append(at_times(nodes, points, spread(moved)[1:])[0])
            own = self.commands[phase]
            commands.append(np.stack([np.interp(moved, nodes, column) for column in own.T], axis=1))
        return MeshMotion(meshes, self.durations, np.concatenate(states), tuple(commands), self.rests)
