"""Recorded calls of ``tell`` and ``progress``, for a diagnosis in another process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from vpm.discrepancy.diagnosis import Diagnosis
from vpm.discrepancy.parallel_candidates import Progress


@dataclass(frozen=True)
class RecordedDiagnosis:
    """Diagnosis with its recorded calls of ``tell`` and ``progress``, each in their order."""

    diagnosis: Diagnosis
    sentences: tuple[str, ...]
    steps: tuple[tuple[str, str, int, int], ...]

    def repeat(self, tell: Callable[[str], None] | None, progress: Progress | None) -> Diagnosis:
        """Repeat the recorded calls in this process and return the diagnosis.

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
    """Diagnose with all calls of ``tell`` and ``progress`` recorded.

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
