"""What drives in sampled time have in common: their step, and files that they may stand in.

A model is complete in itself: the numbers of a file take the place of its name.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from pydantic import AfterValidator

from vpm.errors import VpmError
from vpm.model.drives.drive import Drive
from vpm.model.entry import Number, Text
from vpm.model.messages import Problem, place
from vpm.results import Result

if TYPE_CHECKING:
    from vpm.model.structure import Structure


def _positive(value: float) -> float:
    if not value > 0.0:
        raise ValueError(f"is {value:g}, but has to be above 0; correct the value")
    return value


Positive = Annotated[Number, AfterValidator(_positive)]


class Sampled(Drive):
    """Drive that acts at samples of its own; none of its numbers is a parameter of its own."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {"sample_time": "sample_time = 1e-3"}
    #: Keys that say what a file says.
    SAVED: ClassVar[tuple[str, ...]]

    sample_time: Positive | None = None
    file: Text | None = None

    def lag_problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Effects that act between its samples."""
        for position, effect in enumerate(structure.document.effects):
            if effect.traits.late == "lag" and effect.at == name:
                rest = f'is a lag at "{name}", a {self.type}, which sees its own samples and no lag between them; '
                yield Problem(place("effects", position), f"{rest}remove it, or identify it with the model")

    @property
    def said_twice(self) -> list[str]:
        """Keys of a sampled drive that repeat what its file says."""
        return [key for key in self.SAVED if getattr(self, key) is not None]

    def with_file(self, path: Path) -> Self:
        """Sampled drive with the numbers of a saved result."""
        result, kind = Result.load(path), type(self).__name__
        if type(result).__name__ != kind:
            raise VpmError(f"{path} is a saved {type(result).__name__}, but the type {self.type} needs a {kind}")
        return self.model_copy(update={"file": None, **self.read(result.to_stored())})

    @abstractmethod
    def read(self, saved: Mapping[str, Any]) -> dict[str, Any]:
        """Fields of a sampled drive from a saved result, by key."""
