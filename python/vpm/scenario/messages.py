"""Problems of a scenario file, each as one sentence: where, the failing condition, the numbers, the repair."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

from vpm.errors import ScenarioError
from vpm.model.messages import place

Keys = tuple[str | int, ...]


def refuse(where: Keys | str, rest: str) -> NoReturn:
    """Refuse a scenario with a message on a problem at a place."""
    named = where if isinstance(where, str) else place(*where)
    raise ScenarioError(f"{named} {rest}", where=named)


@contextmanager
def in_file(path: str | None) -> Iterator[None]:
    """Name the file in front of every message."""
    try:
        yield
    except ScenarioError as error:
        if path is None or error.path is not None:
            raise
        raise ScenarioError(f"{path}: {error}", where=error.where, path=path, more=error.more) from None
