"""Problems of a model file, each as one sentence: where, the failing condition, the numbers, the repair."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NoReturn

from vpm.errors import ModelError, ScenarioError


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong."""

    where: str  #: Place in the file, ``"bodies.carriage.mass"``.
    rest: str  #: The sentence that begins with the place.

    def __str__(self) -> str:
        return f"{self.where} {self.rest}"


def raise_first(
    problems: Sequence[Problem], path: str | None, error: type[ModelError | ScenarioError] = ModelError
) -> NoReturn:
    """Raise the message of the first problem and say how many more there are."""
    more = len(problems) - 1
    tail = f" (and {more} more problem{'s' if more > 1 else ''})" if more else ""
    head = f"{path}: " if path else ""
    raise error(f"{head}{problems[0]}{tail}", where=problems[0].where, path=path, more=more)


def place(*keys: str | int) -> str:
    """Place in a file for messages: ``effects[0].viscous``, ``channels."axis.position".unit``."""
    text = ""
    for key in keys:
        if isinstance(key, int):
            text += f"[{key}]"
        else:
            written = key if re.fullmatch(r"[\w-]+", key) else f'"{key}"'
            text += f".{written}" if text else written
    return text


def shown(value: object) -> str:
    """Content of a file in a message: ``"text"``, ``true``, ``a table``, ``a list of 3``."""
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    return str(value)
