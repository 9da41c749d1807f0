"""Many diagnoses, here or on other machines: one task each."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Unpack

from vpm.diagnosing import Asked, check_asked, diagnosed, with_provenance
from vpm.discrepancy import Diagnosis
from vpm.errors import DiagnosisError, VpmError
from vpm.experiment import Experiment, as_records
from vpm.model import Model
from vpm.tasks import BatchInterruptedError, Done, outcomes


@dataclass(frozen=True)
class Case:
    """One of the diagnoses that `diagnose_many` runs.

    Attributes
    ----------
    validate : Experiment or sequence of Experiment, optional
        As for `vpm.diagnose`.
    name : str
        What sentences call it; by default its model and its first record.
    """

    model: Model
    experiments: Experiment | Sequence[Experiment]
    validate: Experiment | Sequence[Experiment] | None = None
    name: str = ""

    @property
    def records(self) -> tuple[list[Experiment], list[Experiment]]:
        """Records to fit and to judge on."""
        return as_records(self.experiments), as_records(self.validate or ())

    @property
    def called(self) -> str:
        """Name of a case in sentences: its own, or model and first record."""
        return self.name or " on ".join([self.model.name, *(record.name for record in self.records[0][:1])])


def diagnose_many(
    cases: Iterable[Case],
    *,
    executor: Executor | Callable[[], Executor] | None = None,
    workers: int | None = None,
    tell: Callable[[str], object] | None = None,
    **asked: Unpack[Asked],
) -> list[Diagnosis | VpmError]:
    """Diagnose many machines or logs; each answer is that of `vpm.diagnose` alone.

    Parameters
    ----------
    executor : Executor or callable, optional
        Does the diagnoses, one task each: any `concurrent.futures.Executor`, or a function that makes one, which is
        called again where a pool broke. One after the other in this process if not given.
    workers : int, optional
        Threads of each diagnosis; one if there is an executor, else one per core.
    tell : callable, optional
        Called with a sentence for each diagnosis that is done, and for each task that died.
    **asked
        ``effects``, ``cutoff``, ``setup``, ``limit``, ``names``, ``check`` of `vpm.diagnose`, for all cases.

    Returns
    -------
    list of Diagnosis or VpmError
        In the order of the cases. One that fails, or whose worker died with it again and again, is an error in the
        list; the others go on.

    Raises
    ------
    DiagnosisError
        An effect name or the source of names is unknown.
    ExecutorError
        The executor takes no work from the beginning.
    BatchInterruptedError
        Ctrl-C, a `KeyboardInterrupt` with what was found until then; what was not begun is called back.
    """
    listed = list(cases)
    check_asked(asked, workers)
    names = [case.called for case in listed]
    answers: dict[int, Diagnosis | VpmError] = {}

    def noted(done: Done[int]) -> None:
        if not isinstance(done.error, KeyboardInterrupt) and done.key not in answers:
            answers[done.key] = _answer(done, listed[done.key], asked, workers)

    def heard(ended: list[Done[int]]) -> None:
        for done in ended:
            noted(done)
            if tell is not None and done.key in answers:
                tell(f"{len(answers)}/{len(listed)}  {names[done.key]}: {_line(answers[done.key])}")

    threads = workers or (None if executor is None else 1)
    jobs = [partial(diagnosed, case.model, *case.records, asked, threads) for case in listed]
    found, interrupted = outcomes(jobs, 1 if executor is None else executor, tell, heard, names)
    if not interrupted:
        return [answers[number] for number in range(len(listed))]
    for done in found:
        if done is not None:
            noted(done)
    raise BatchInterruptedError(answers.get(number) for number in range(len(listed)))


def _answer(done: Done[int], case: Case, asked: Asked, workers: int | None) -> Diagnosis | VpmError:
    """Diagnosis of a case with its provenance, or the error of one that failed: it takes no other with it."""
    if done.error is None:
        return with_provenance(done.value, case.model, *case.records, asked, workers)
    if isinstance(done.error, VpmError):
        return done.error
    error = DiagnosisError(f"{case.called} could not be diagnosed: {type(done.error).__name__}: {done.error}")
    error.__cause__ = done.error
    return error


def _line(answer: Diagnosis | VpmError) -> str:
    if isinstance(answer, VpmError):
        return f"failed: {answer}"
    named = ", ".join(f"{effect.name} at {effect.site}" for effect in answer.effects) or answer.verdict
    return f"{named} ({answer.seconds:.1f} s)"
