"""A diagnosis in another process, with its calls of ``tell`` and ``progress`` recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from vpm.discrepancy.diagnosis import Diagnosis
from vpm.discrepancy.parallel_candidates import Progress


@dataclass(frozen=True)
class RecordedDiagnosis:
    """A diagnosis and the calls of ``tell`` and ``progress`` that it made, each in their order."""

    diagnosis: Diagnosis
    sentences: tuple[str, ...]
    steps: tuple[tuple[str, str, int, int], ...]

    def repeat(self, tell: Callable[[str], None] | None, progress: Progress | None) -> Diagnosis:
        """The diagnosis, once those who wanted to hear it have heard it.

        Parameters
        ----------
        tell, progress : callable, optional
        """
        if tell is not None:
            for sentence in self.sentences:
                tell(sentence)
        if progress is not None:
            for step in self.steps:
                progress(*step)
        return self.diagnosis


def recorded(diagnosed: Callable[..., Diagnosis], *given: object) -> RecordedDiagnosis:
    """Diagnose, and keep what is said.

    Parameters
    ----------
    diagnosed : callable
        Takes ``tell`` and ``progress`` too.
    *given
        What else it takes.
    """
    sentences: list[str] = []
    steps: list[tuple[str, str, int, int]] = []
    diagnosis = diagnosed(*given, tell=sentences.append, progress=lambda *step: steps.append(step))
    return RecordedDiagnosis(diagnosis, tuple(sentences), tuple(steps))
