"""Many simulations of one machine, side by side on all cores."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from operator import call
from typing import TypeVar

from numpy.typing import ArrayLike

from vpm.errors import SimulationError, VpmError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simulate import MODES, Run, Setup, simulate
from vpm.tasks import BatchInterruptedError, Done, Where, outcomes

Item = TypeVar("Item")

#: Trials that an executor gets together at most, and how many of such chunks each of its workers gets at least: a chunk
#: sends its model and its records once, and the last ones should not keep the others waiting.
CHUNK, EACH = 50, 4


@dataclass(frozen=True)
class Trial:
    """One simulation of a batch.

    Attributes
    ----------
    experiment : Experiment
        Its commands, references or motion drive the simulation.
    parameters : mapping of str to float
        SI values that differ from the model's, by dotted name.
    initial_state : mapping of str to float, or array_like of shape (nx,), optional
        As ``model.state`` takes it; by default estimated from the log.
    """

    experiment: Experiment
    parameters: Mapping[str, float] = field(default_factory=dict)
    initial_state: Mapping[str, float] | ArrayLike | None = None


def simulate_batch(
    model: Model,
    trials: Iterable[Trial | Experiment],
    mode: str = "free_run",
    *,
    workers: int | None = None,
    progress: Callable[[int, int], object] | bool = False,
    setup: Setup | None = None,
    cutoff: float | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
) -> list[Run | VpmError]:
    """Simulate a batch of one machine on threads: the core computes without the interpreter's lock.

    Parameters
    ----------
    mode : str
        As in :func:`vpm.simulate`.
    workers : int, optional
        Trials at a time; by default one per core.
    progress : callable or bool
        Called as ``progress(done, total)`` in the calling thread after each trial; True draws a bar.
    cutoff : float, optional
        As in :func:`vpm.simulate`.
    executor : Executor or callable, optional
        Runs the trials elsewhere, in chunks, see `vpm.tasks.Tasks`; ``workers`` then says how many it has, if it does
        not. The runs are the same.

    Returns
    -------
    list of Run or VpmError
        In the order of the trials. A trial that fails is an error in the list, a `DivergedError` with how far it came
        among them; the others go on.

    Raises
    ------
    SimulationError
        Mode or number of workers is impossible.
    ExecutorError
        The executor takes no work from the beginning. Later, trials whose worker died again and again are errors in the
        list.
    BatchInterruptedError
        Ctrl-C, a `KeyboardInterrupt` with what was finished; all other trials stop.
    """
    if mode not in MODES:
        raise SimulationError(f"unknown mode '{mode}'; choose one of {', '.join(MODES)}")
    listed = [trial if isinstance(trial, Trial) else Trial(trial) for trial in trials]
    chosen = setup or Setup()
    _ = model.core  # built once, here; a model that cannot be built is no failure of a trial
    one = partial(_one, model, mode, chosen, cutoff)
    if executor is None:
        return side_by_side([partial(one, trial) for trial in listed], workers, progress)
    workers = getattr(executor, "_max_workers", None) if workers is None else workers
    size = min(CHUNK, -(-len(listed) // (EACH * workers))) if workers else CHUNK
    chunks = [listed[at : at + size] for at in range(0, len(listed), max(size, 1))]
    with _shown(progress, len(listed)) as told:
        return _run_all([partial(_chunk, one, chunk) for chunk in chunks], [len(c) for c in chunks], executor, told)


def side_by_side(
    jobs: Sequence[Callable[[], Run]],
    workers: int | None = None,
    progress: Callable[[int, int], object] | bool = False,
) -> list[Run | VpmError]:
    """Simulations on threads, as `simulate_batch` does them, of machines that may differ.

    ``jobs``: each gives a run; ``workers``, ``progress``: as in `simulate_batch`.
    Result: in the order of the jobs; one that fails is an error in the list.
    Raises `SimulationError`: the number of workers is impossible.
    Raises `BatchInterruptedError`: Ctrl-C, a `KeyboardInterrupt` with what was finished; all other jobs stop.
    """
    workers = (os.cpu_count() or 1) if workers is None else workers
    if workers < 1:
        raise SimulationError(f"{workers} workers can do nothing; give at least 1")
    with _shown(progress, len(jobs)) as told:
        return _run_all([partial(_chunk, call, [job]) for job in jobs], [1] * len(jobs), workers, told)


def _run_all(
    chunks: Sequence[Callable[[], list[Run | VpmError]]],
    sizes: Sequence[int],
    where: Where,
    told: Callable[[int, int], object] | None,
) -> list[Run | VpmError]:
    """Runs of all chunks of a batch; one that dies with its worker is an error for each trial."""
    done = 0

    def heard(ended: list[Done[int]]) -> None:
        nonlocal done
        done += sum(sizes[each.key] for each in ended)
        if told is not None:
            told(done, sum(sizes))

    found, interrupted = outcomes(chunks, where, heard=heard)
    parts = [_outcomes_of(each, size) for each, size in zip(found, sizes, strict=True)]
    if interrupted:
        raise BatchInterruptedError(chain(*parts))
    return [outcome for outcome in chain(*parts) if outcome is not None]


def _outcomes_of(done: Done[int] | None, size: int) -> list[Run | VpmError | None]:
    if done is None:
        return [None] * size
    if isinstance(done.error, VpmError):
        return [done.error] * size
    if done.error is not None:
        raise done.error
    return list(done.value)


def _chunk(one: Callable[[Item], Run], items: Sequence[Item]) -> list[Run | VpmError]:
    """Runs of a batch's chunk, one after the other, with an error as a value in the place of a run."""
    found: list[Run | VpmError] = []
    for item in items:
        try:
            found.append(one(item))
        except VpmError as error:
            found.append(error)
    return found


def _one(model: Model, mode: str, setup: Setup, cutoff: float | None, trial: Trial) -> Run:
    machine = model.with_parameters(trial.parameters) if trial.parameters else model
    return simulate(
        machine,
        trial.experiment,
        mode,
        integrator=setup.integrator,
        substeps=setup.substeps,
        horizon=setup.horizon,
        cutoff=cutoff,
        initial_state=trial.initial_state,
        hold=setup.course,
    )


@contextmanager
def _shown(progress: Callable[[int, int], object] | bool, total: int) -> Iterator[Callable[[int, int], object] | None]:
    """Function that shows the progress of a batch: the caller's, a progress bar on stderr, or none."""
    if progress is not True:
        yield progress or None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task("simulating", total=total)
        yield lambda done, _: bar.update(task, completed=done)
