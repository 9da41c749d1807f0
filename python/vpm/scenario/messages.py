"""Problems of a scenario file, each as one sentence: where, the failing condition, the numbers, the repair."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NoReturn

from vpm.errors import ScenarioError
from vpm.model.messages import Problem, place

Keys = tuple[str | int, ...]


def refuse(where: Keys | str, rest: str) -> NoReturn:
    """Refuse a scenario with a message on a problem at a place."""
    named = where if isinstance(where, str) else place(*where)
    raise ScenarioError(f"{named} {rest}", where=named)


def raise_first(problems: Sequence[Problem]) -> NoReturn:
    """Raise the message of the first problem and say how many more there are."""
    more = len(problems) - 1
    tail = f" (and {more} more problem{'s' if more > 1 else ''})" if more else ""
    raise ScenarioError(f"{problems[0]}{tail}", where=problems[0].where, more=more)


@contextmanager
def in_file(path: str | None) -> Iterator[None]:
    """Name the file in front of every message."""
    try:
        yield
    except ScenarioError as error:
        if path is None or error.path is not None:
            raise
        raise ScenarioError(f"{path}: {error}", where=error.where, path=path, more=error.more) from None
