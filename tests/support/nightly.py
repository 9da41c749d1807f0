"""Claims about many machines or effects, of which a few stand for all in every run; the others are tested at night."""

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def at_night(every: Iterable[Any], but: Collection[Any]) -> list[Any]:
    """Parameters of a test: all of them, those beside ``but`` under the marker nightly.

    A tuple stands for several arguments. What ``but`` holds and ``every`` does not is a mistake.
    """
    entries = list(every)
    if missing := [one for one in but if one not in entries]:
        raise ValueError(f"{missing} are not among {entries}")
    marked = [(*one,) if isinstance(one, tuple) else (one,) for one in entries]
    return [
        one if one in but else pytest.param(*values, marks=pytest.mark.nightly)
        for one, values in zip(entries, marked, strict=True)
    ]
