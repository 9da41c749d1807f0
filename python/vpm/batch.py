"""Many simulations of one machine, side by side on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from threading import Event

from numpy.typing import ArrayLike

from vpm.errors import SimulationError, VpmError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simulate import MODES, Run, Setup, simulate

#: Time between two looks at Ctrl-C, s.
PATIENCE = 0.1


class BatchInterruptedError(KeyboardInterrupt):
    """Ctrl-C while simulations ran side by side.

    Attributes
    ----------
    outcomes : tuple of Run, VpmError or None
        In the order of the jobs; None for those that were not finished.
    """

    def __init__(self, outcomes: Iterable[Run | VpmError | None]) -> None:
        super().__init__("interrupted")
        self.outcomes = tuple(outcomes)


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
) -> list[Run | VpmError]:
    """Simulate a machine many times, on threads: the core computes without the interpreter's lock.

    Parameters
    ----------
    model : Model
    trials : iterable of Trial or Experiment
    mode : str
        As in :func:`vpm.simulate`.
    workers : int, optional
        Trials at a time; by default one per core.
    progress : callable or bool
        Called as ``progress(done, total)`` in the calling thread after each trial; True draws a bar.
    setup : Setup, optional
    cutoff : float, optional
        As in :func:`vpm.simulate`.

    Returns
    -------
    list of Run or VpmError
        In the order of the trials. A trial that fails is an error in the list, a `DivergedError` with how far it came
        among them; the others go on.

    Raises
    ------
    SimulationError
        Mode or number of workers is impossible.
    BatchInterruptedError
        Ctrl-C, a `KeyboardInterrupt` with what was finished; all other trials stop.
    """
    if mode not in MODES:
        raise SimulationError(f"unknown mode '{mode}'; choose one of {', '.join(MODES)}")
    listed = [trial if isinstance(trial, Trial) else Trial(trial) for trial in trials]
    chosen = setup or Setup()
    _ = model.core  # built once, here; a model that cannot be built is no failure of a trial
    return side_by_side([partial(_one, model, trial, mode, chosen, cutoff) for trial in listed], workers, progress)


def side_by_side(
    jobs: Sequence[Callable[[], Run]],
    workers: int | None = None,
    progress: Callable[[int, int], object] | bool = False,
) -> list[Run | VpmError]:
    """Simulations on threads, as `simulate_batch` does them, of machines that may differ.

    Parameters
    ----------
    jobs : sequence of callable
        Each gives a run.
    workers, progress
        As in `simulate_batch`.

    Returns
    -------
    list of Run or VpmError
        In the order of the jobs; one that fails is an error in the list.

    Raises
    ------
    SimulationError
        The number of workers is impossible.
    BatchInterruptedError
        Ctrl-C, a `KeyboardInterrupt` with what was finished; all other jobs stop.
    """
    workers = (os.cpu_count() or 1) if workers is None else workers
    if workers < 1:
        raise SimulationError(f"{workers} workers can do nothing; give at least 1")
    if progress is True:
        with _bar(len(jobs)) as shown:
            return _run_all(jobs, workers, shown)
    return _run_all(jobs, workers, progress or None)


def _run_all(
    jobs: Sequence[Callable[[], Run]], workers: int, progress: Callable[[int, int], object] | None
) -> list[Run | VpmError]:
    from vpm._core import stop_when

    stop = Event()
    with ThreadPoolExecutor(workers, "vpm", initializer=lambda: stop_when(stop.is_set)) as pool:
        futures = [pool.submit(_kept, job) for job in jobs]
        try:
            _watch(futures, progress)
        except BaseException as reason:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            if isinstance(reason, KeyboardInterrupt):
                raise BatchInterruptedError(map(_finished, futures)) from reason
            raise
    return [future.result() for future in futures]


def _finished(future: Future[Run | VpmError]) -> Run | VpmError | None:
    done = future.done() and not future.cancelled() and future.exception() is None
    return future.result() if done else None


def _watch(futures: Sequence[Future[Run | VpmError]], progress: Callable[[int, int], object] | None) -> None:
    """Wait for all trials, awake enough for Ctrl-C."""
    waiting: set[Future[Run | VpmError]] = set(futures)
    while waiting:
        done, waiting = wait(waiting, timeout=PATIENCE, return_when=FIRST_COMPLETED)
        if done and progress is not None:
            progress(len(futures) - len(waiting), len(futures))


def _kept(job: Callable[[], Run]) -> Run | VpmError:
    """What a job gives, an error as a value."""
    try:
        return job()
    except VpmError as error:
        return error


def _one(model: Model, trial: Trial, mode: str, setup: Setup, cutoff: float | None) -> Run:
    machine = model.with_parameters(trial.parameters) if trial.parameters else model
    state = None if trial.initial_state is None else machine.state(trial.initial_state)
    return simulate(
        machine,
        trial.experiment,
        mode,
        integrator=setup.integrator,
        substeps=setup.substeps,
        horizon=setup.horizon,
        cutoff=cutoff,
        initial_state=state,
        hold=setup.course,
    )


@contextmanager
def _bar(total: int) -> Iterator[Callable[[int, int], object]]:
    """A progress bar on the error stream."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task("simulating", total=total)
        yield lambda done, _: bar.update(task, completed=done)
