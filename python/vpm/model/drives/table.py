"""Drives that look their effort up by command and velocity."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from vpm.model.component import Described, Index
from vpm.model.drives.drive import Drive
from vpm.model.entry import Number, Text
from vpm.model.messages import Problem, place
from vpm.numbers import Array

if TYPE_CHECKING:
    from vpm.model.structure import Structure


class Table(Drive):
    """Efforts over the command and the velocity of what the drive acts on, smooth in between and held beyond; SI.

    Its numbers belong together, so that none is a parameter of its own.
    """

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        "commands": "commands = [-0.01, 0.0, 0.01]",
        "velocities": "velocities = [-0.5, 0.5]",
        "efforts": "efforts = [[900.0, -100.0], [400.0, -400.0], [100.0, -900.0]]",
    }

    type: Literal["table"]
    commands: tuple[Number, ...]
    velocities: tuple[Number, ...]
    efforts: tuple[tuple[Number, ...], ...]
    command_unit: Text = "1"

    def problems(self, name: str, structure: Structure) -> Iterator[Problem]:  # noqa: ARG002
        """Problems of a drive's table: axes that do not rise, and efforts that are not one for each pair."""
        keys = ("actuators", name)
        for key in ("commands", "velocities"):
            axis = getattr(self, key)
            falling = next((pair for pair in pairwise(axis) if not pair[0] < pair[1]), None)
            if len(axis) < 2:
                yield Problem(place(*keys, key), f"has {len(axis)} number, but a table takes two or more; add some")
            elif falling is not None:
                rest = f"has {falling[1]:g} after {falling[0]:g}, but has to rise; sort it, each number once"
                yield Problem(place(*keys, key), rest)
        rows, columns = len(self.commands), len(self.velocities)
        if len(self.efforts) != rows:
            rest = f"has {len(self.efforts)} rows, but there are {rows} commands; give one row for each"
            yield Problem(place(*keys, "efforts"), rest)
        for number, row in enumerate(self.efforts):
            if len(row) != columns:
                rest = f"has {len(row)} numbers, but there are {columns} velocities; give one for each"
                yield Problem(place(*keys, "efforts", number), rest)

    def law(self, name: str, structure: Structure, index: Index) -> Described:  # noqa: ARG002
        """What the core reads of the law of a table."""
        efforts = [effort for row in self.efforts for effort in row]
        return {"commands": list(self.commands), "velocities": list(self.velocities), "efforts": efforts}


def beyond(name: str, axis: tuple[float, ...], values: Array, unit: str, time: Array) -> str | None:
    """Sentence on where a run left an axis of a table, if it did.

    ``name``: channel; ``values``, ``time``: shape (N,).
    """
    outside = np.maximum(axis[0] - values, values - axis[-1])
    worst = int(np.argmax(outside))
    if not outside[worst] > 0.0:
        return None
    count = f"{np.sum(outside > 0.0)} of {len(values)} samples are beyond"
    ends = f"the table of its drive ends at {axis[0]:g} and {axis[-1]:g} {unit} ({count})"
    return f"{name} is {values[worst]:g} {unit} at {time[worst]:g} s, but {ends}; widen the table"
