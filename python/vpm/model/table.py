"""Drives that look their effort up by command and velocity: their form in a model file, and what makes no table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vpm.model.entry import Entry, Number, Text
from vpm.model.messages import Problem, place

Array = NDArray[np.float64]


class Table(Entry):
    """Efforts over the command and the velocity of what the drive acts on, smooth in between and held beyond; SI."""

    type: Literal["table"]
    joint: Text | None = None
    line: Text | None = None
    transmission: Text | None = None
    commands: tuple[Number, ...]
    velocities: tuple[Number, ...]
    efforts: tuple[tuple[Number, ...], ...]
    command_unit: Text = "1"


#: How a key is written, for messages about missing ones.
EXAMPLES: Mapping[str, str] = {
    "actuators.commands": "commands = [-0.01, 0.0, 0.01]",
    "actuators.velocities": "velocities = [-0.5, 0.5]",
    "actuators.efforts": "efforts = [[900.0, -100.0], [400.0, -400.0], [100.0, -900.0]]",
}


def beyond(name: str, axis: tuple[float, ...], values: Array, unit: str, time: Array) -> str | None:
    """Sentence on where a run left an axis of a table, if it did.

    Parameters
    ----------
    name : str
        Channel.
    axis : tuple of float
    values, time : ndarray, shape (N,)
    unit : str
    """
    outside = np.maximum(axis[0] - values, values - axis[-1])
    worst = int(np.argmax(outside))
    if not outside[worst] > 0.0:
        return None
    count = f"{np.sum(outside > 0.0)} of {len(values)} samples are beyond"
    ends = f"the table of its drive ends at {axis[0]:g} and {axis[-1]:g} {unit} ({count})"
    return f"{name} is {values[worst]:g} {unit} at {time[worst]:g} s, but {ends}; widen the table"


def table_problems(name: str, table: Table) -> Iterator[Problem]:
    """Axes that do not rise, and efforts that are not one for each pair."""
    for key in ("commands", "velocities"):
        axis = getattr(table, key)
        falling = next((pair for pair in pairwise(axis) if not pair[0] < pair[1]), None)
        if len(axis) < 2:
            yield Problem(
                place("actuators", name, key), f"has {len(axis)} number, but a table takes two or more; add some"
            )
        elif falling is not None:
            rest = f"has {falling[1]:g} after {falling[0]:g}, but has to rise; sort it, each number once"
            yield Problem(place("actuators", name, key), rest)
    rows, columns = len(table.commands), len(table.velocities)
    if len(table.efforts) != rows:
        rest = f"has {len(table.efforts)} rows, but there are {rows} commands; give one row for each"
        yield Problem(place("actuators", name, "efforts"), rest)
    for number, row in enumerate(table.efforts):
        if len(row) != columns:
            rest = f"has {len(row)} numbers, but there are {columns} velocities; give one for each"
            yield Problem(place("actuators", name, "efforts", number), rest)
