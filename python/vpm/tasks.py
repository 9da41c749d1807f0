"""Tasks side by side: on threads of this process, or on any `concurrent.futures.Executor`.

The core computes without the interpreter's lock, so threads share the cores of one machine. To other processes and
machines a task goes as bytes, see `vpm.sending`. A task that dies there, not by an error of its own, is tried again.
"""

import multiprocessing
import os
import signal
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from dataclasses import dataclass
from functools import partial
from threading import Event, local
from types import TracebackType
from typing import Any, Generic, Self, TypeVar

from vpm.errors import ExecutorError
from vpm.sending import packed, run_packed, unpacked, vpm_version

K = TypeVar("K")
T = TypeVar("T")

#: Where tasks run: so many threads of this process, an executor, or a function that makes one.
Where = int | Executor | Callable[[], Executor]
Say = Callable[[str], object]

#: Time between two looks at Ctrl-C, s.
PATIENCE = 0.1
#: How often a task is begun that dies with its worker; the last time it runs alone.
ATTEMPTS = 3
#: Tasks that an executor holds at a time for each of its workers, and where it does not tell how many it has: what is
#: sent takes memory, and cannot be called back from some.
AHEAD, UNTOLD = 2, 1000


class BatchInterruptedError(KeyboardInterrupt):
    """Ctrl-C while simulations, or diagnoses, ran side by side.

    Attributes
    ----------
    outcomes : tuple
        In the order of the jobs, a value or a `VpmError`; None for those that were not finished.
    """

    def __init__(self, outcomes: Iterable[Any]) -> None:
        super().__init__("interrupted")
        self.outcomes = tuple(outcomes)


@dataclass(frozen=True)
class Done(Generic[K]):
    """A task that has ended: with its value, or with an error."""

    key: K
    value: Any = None
    error: BaseException | None = None


@dataclass
class _Task(Generic[K]):
    key: K
    job: Callable[[], object]
    name: str
    attempt: int = 0


def _never() -> bool:
    return False


class _Outer(local):
    """Function that says, for this thread, whether the task around its tasks was told to stop."""

    asked: Callable[[], bool] = staticmethod(_never)


_OUTER = _Outer()


class Tasks(Generic[K]):
    """Tasks that are done side by side, in the order in which they end; leaving the block ends what still runs.

    - ``where``: a pool of processes that breaks, as all do of which a worker is killed, takes no more tasks: as many
      new processes take its place, or what the function makes. An executor that a function made ends with the block.
    - ``say``: called with a sentence where a task died or a pool broke; a `RuntimeWarning` says it if not given

    Raises `ExecutorError`: by `answered`: the executor takes no task from the beginning, or a worker cannot work for
    this program.
    """

    def __init__(self, where: Where, say: Say | None = None, folders: Sequence[str] = ()) -> None:
        self._say, self._folders = say or _warn, tuple(folders)
        self._stop = Event()
        self._make = _maker(where)
        self._executor: Executor = where if isinstance(where, Executor) else self._make()
        self._owned = not isinstance(where, Executor)
        # Threads stop when they are told to, and share what the others must be sent.
        self._threads = isinstance(self._executor, ThreadPoolExecutor)
        self._ready, self._alone = deque[_Task[K]](), deque[_Task[K]]()
        self._flying: dict[Future[Any], tuple[_Task[K], Executor]] = {}
        self._refused: list[Done[K]] = []
        self._begun, self._broken = False, 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop.set()
        for future in self._flying:
            future.cancel()
        if self._owned:
            _end(self._executor)

    @property
    def count(self) -> int:
        """Tasks whose end was not yet told."""
        return len(self._ready) + len(self._alone) + len(self._flying) + len(self._refused)

    @property
    def width(self) -> int:
        """Tasks that are given away at a time."""
        workers = getattr(self._executor, "_max_workers", None)
        return AHEAD * workers if isinstance(workers, int) else UNTOLD

    def add(self, key: K, job: Callable[[], object], name: str = "") -> None:
        """Add a task to those that wait for a worker.

        - ``key``: by which its end is told
        - ``job``: a function of a module or a `functools.partial` of one, unless it runs on threads
        """
        self._ready.append(_Task(key, job, name or f"task {key}"))

    def answered(self) -> list[Done[K]]:
        """Tasks that have ended since; waits until there is one. Ctrl-C raises here."""
        ended: list[Done[K]] = []
        while self.count and not ended:
            if _OUTER.asked():
                raise KeyboardInterrupt
            self._give()
            ended, self._refused = self._refused, []
            ready, _ = wait(self._flying, timeout=0.0 if ended else PATIENCE, return_when=FIRST_COMPLETED)
            ended += [done for future in ready if (done := self._ended(future)) is not None]
        return ended

    def stopped(self) -> list[Done[K]]:
        """Stop tasks: call back what was not begun; threads say what they have."""
        self._stop.set()
        for future in self._flying:
            future.cancel()
        if self._threads:
            wait(self._flying)
        known = []
        for future, (task, _) in self._flying.items():
            if future.done() and not future.cancelled() and future.exception() is None:
                known += [done for done in [self._told(task, future.result())] if done is not None]
        self._ready.clear()
        self._alone.clear()
        self._flying.clear()
        return known

    def _give(self) -> None:
        """Give tasks to the executor as far as it holds them; twice-failed ones run alone at the end."""
        while self._ready and len(self._flying) < self.width:
            self._launch(self._ready.popleft())
        if self._alone and not self._flying and not self._ready:
            self._launch(self._alone.popleft())

    def _launch(self, task: _Task[K]) -> None:
        try:
            self._flying[self._submitted(task)] = task, self._executor
        except BrokenExecutor as reason:
            self._ready.appendleft(task)
            self._renew(str(reason))
        except ExecutorError as reason:
            self._refuse(task, reason)
        except Exception as reason:  # noqa: BLE001  executors of others raise what they like
            kind = type(self._executor).__name__
            self._refuse(task, ExecutorError(f"the {kind} takes no task ({reason}); give one that is not shut down"))

    def _submitted(self, task: _Task[K]) -> Future[Any]:
        if self._threads:
            return self._executor.submit(_watching, self._stop.is_set, task.job)
        return self._executor.submit(run_packed, vpm_version(), self._folders, packed(task.job), task.attempt)

    def _refuse(self, task: _Task[K], reason: ExecutorError) -> None:
        """A task that nobody takes; where it is the first one, no other will be taken either."""
        if not self._begun:
            raise reason
        self._refused.append(Done(task.key, error=reason))

    def _ended(self, future: Future[Any]) -> Done[K] | None:
        """Outcome of a task whose future ended; None of one that is tried again."""
        task, executor = self._flying.pop(future)
        try:
            answer = future.result()
        except (Exception, CancelledError, KeyboardInterrupt) as error:  # noqa: BLE001  see below
            return self._died(task, executor, error)
        done = self._told(task, answer)
        self._begun, self._broken = True, 0
        return done

    def _told(self, task: _Task[K], answer: Any) -> Done[K] | None:  # noqa: ANN401  as workers give it
        if self._threads:
            value, error = answer
            return Done(task.key, value, error)
        ending, content = answer
        if ending == "value":
            return Done(task.key, unpacked(content))
        if ending == "error":
            return Done(task.key, error=unpacked(content))
        if ending == "interrupted":
            return Done(task.key, error=KeyboardInterrupt())
        # Another worker may be one that can; where the first one cannot, the others hardly will.
        task.attempt += 1
        if not self._begun or task.attempt == ATTEMPTS:
            self._refuse(task, ExecutorError(content))
        else:
            self._ready.append(task)
        return None

    def _died(self, task: _Task[K], executor: Executor, reason: BaseException) -> Done[K] | None:
        """A task of which the executor says that it failed: its own errors are answers, so its worker is gone."""
        if isinstance(reason, ModuleNotFoundError):
            raise ExecutorError(
                f"a worker of {type(executor).__name__} cannot begin ({reason}); "
                f"install vpm-dynamics {vpm_version()} there"
            ) from reason
        task.attempt += 1
        why = f"{type(reason).__name__}: {reason}".partition("\n")[0].rstrip(": ")
        if isinstance(reason, BrokenExecutor) and executor is self._executor:
            self._renew(why)
        if task.attempt == ATTEMPTS:
            return Done(
                task.key,
                error=ExecutorError(
                    f"{task.name} died with its worker {ATTEMPTS} times, the last time alone ({why}); "
                    "give workers more memory or time, or run it in this process to see why"
                ),
            )
        self._say(f"{task.name} died with its worker ({why}): it is tried again, {task.attempt + 1} of {ATTEMPTS}")
        (self._alone if task.attempt == ATTEMPTS - 1 else self._ready).append(task)
        return None

    def _renew(self, why: str) -> None:
        """Another executor for the tasks in the place of one that broke."""
        self._broken += 1
        if self._broken > ATTEMPTS * (len(self._flying) + len(self._ready) + len(self._alone) + 1):
            raise ExecutorError(f"executors break one after the other ({why}); give one whose workers can begin")
        if self._owned:
            _end(self._executor)
        broken, self._executor, self._owned = self._executor, self._make(), True
        self._say(f"{type(broken).__name__} broke ({why}): {type(self._executor).__name__} takes its place")


def outcomes(
    jobs: Sequence[Callable[[], object]],
    where: Where,
    say: Say | None = None,
    heard: Callable[[list[Done[int]]], object] | None = None,
    names: Sequence[str] = (),
) -> tuple[list[Done[int] | None], bool]:
    """Outcomes of tasks in their order wherever they ran, and whether Ctrl-C was pressed.

    Of jobs that Ctrl-C kept from an end there is None. Those that run on threads see ``KeyboardInterrupt`` in the core
    and may still give what they have.

    ``heard``: called in this thread with what has ended since, as it comes.
    """
    found: list[Done[int] | None] = [None] * len(jobs)
    with Tasks[int](where, say) as tasks:
        for number, job in enumerate(jobs):
            tasks.add(number, job, names[number] if names else "")
        try:
            while tasks.count:
                _note(found, ended := tasks.answered())
                if heard is not None:
                    heard(ended)
                if any(isinstance(done.error, KeyboardInterrupt) for done in ended):
                    raise KeyboardInterrupt
        except KeyboardInterrupt:
            _note(found, tasks.stopped())
            return found, True
    return found, False


def until_interrupted(jobs: Sequence[Callable[[], T]], where: Where) -> tuple[list[T | None], bool]:
    """Results of tasks, None for those that Ctrl-C ended, and whether it was pressed.

    The first job in their order that fails raises its error, after the others have ended.
    """
    found, interrupted = outcomes(jobs, where)
    return [None if done is None else _value(done) for done in found], interrupted


def done_by(executor: Executor | Callable[[], Executor], job: Callable[[], T], say: Say | None = None) -> T:
    """Result of one task that an executor does; its error is raised."""
    (found,), interrupted = outcomes([job], executor, say)
    if interrupted or found is None:
        raise KeyboardInterrupt
    value: T = _value(found)
    return value


def processes(count: int) -> ProcessPoolExecutor:
    """New processes for tasks that leave Ctrl-C to this one."""
    return ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), _deaf)


def _maker(where: Where) -> Callable[[], Executor]:
    """Function that makes an executor for tasks, also in the place of a broken one."""
    if isinstance(where, int):
        return partial(ThreadPoolExecutor, where, "vpm")
    if isinstance(where, Executor):
        return partial(processes, getattr(where, "_max_workers", None) or os.cpu_count() or 1)
    return where


def _end(executor: Executor) -> None:
    """End an executor of tasks that nobody else uses, with its processes."""
    if isinstance(executor, ProcessPoolExecutor):
        running = list((executor._processes or {}).values())  # noqa: SLF001  a shutdown would wait for their tasks
        executor.shutdown(wait=False, cancel_futures=True)
        for process in running:
            process.terminate()
    else:
        executor.shutdown(wait=isinstance(executor, ThreadPoolExecutor))


def _warn(sentence: str) -> None:
    warnings.warn(sentence, RuntimeWarning, stacklevel=2)


def _deaf() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _watching(asked: Callable[[], bool], job: Callable[[], object]) -> tuple[object, BaseException | None]:
    """Result of a task, and its error, on a thread that stops when it is asked to."""
    from vpm._core import stop_when

    stop_when(asked)
    _OUTER.asked = asked
    try:
        return job(), None
    except BaseException as error:  # noqa: BLE001  the error is the answer, whatever it is
        return None, error
    finally:
        stop_when(None)
        _OUTER.asked = _never


def _note(found: list[Done[int] | None], ended: Iterable[Done[int]]) -> None:
    for done in ended:
        if not isinstance(done.error, KeyboardInterrupt):
            found[done.key] = done


def _value(done: Done[int]) -> Any:  # noqa: ANN401  whatever the task gave
    if done.error is not None:
        raise done.error
    return done.value
