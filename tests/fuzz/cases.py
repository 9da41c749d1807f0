"""The doors of vpm, and how often a case goes through each."""

import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

from fuzz import doors, logs, stored

#: What damages something and gives it to vpm, with its share of the cases; those of no share are asked for by name.
DOORS: dict[str, tuple[Callable[[Random, Path], None], int]] = {
    "model": (doors.model, 36),
    "scenario": (doors.scenario, 10),
    "compiled model": (doors.compiled, 10),
    "table": (logs.table, 16),
    "log": (logs.octets, 16),
    "channel table": (logs.channels, 6),
    "log check": (logs.checked, 1),
    "result": (stored.result, 5),
    "recorder": (logs.recorders, 0),
    "guarded log": (logs.guarded, 0),
}


def case(seed: int, folder: Path, only: str = "") -> Iterator[str]:
    """One case: yields the name of its door, then goes through it."""
    dice = Random(seed)
    shares = [share for _, share in DOORS.values()]
    name = only or dice.choices(tuple(DOORS), shares)[0]
    yield name
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        DOORS[name][0](dice, folder)
