"""Jobs on threads, in order: the core computes without the interpreter's lock, so records and starts share cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from threading import Event
from typing import TypeVar

from vpm.errors import IdentificationError

T = TypeVar("T")

#: Time between two looks at Ctrl-C, s.
PATIENCE = 0.1


def worker_count(workers: int | None) -> int:
    """Number of threads: as asked, or one per core.

    Raises
    ------
    IdentificationError
        Less than one was asked for.
    """
    count = (os.cpu_count() or 1) if workers is None else workers
    if count < 1:
        raise IdentificationError(f"{count} workers can do nothing; give at least 1")
    return count


def in_order(jobs: Sequence[Callable[[], T]], workers: int) -> list[T]:
    """What each job gives, in the order of the jobs whatever the number of ``workers``.

    The first job that fails raises its error. Ctrl-C stops all of them.

    Parameters
    ----------
    jobs : sequence of callable
    workers : int
    """
    if workers == 1 or len(jobs) < 2:
        return [job() for job in jobs]
    found, interrupted = until_interrupted(jobs, workers)
    if interrupted:
        raise KeyboardInterrupt
    return [value for value in found if value is not None]


def until_interrupted(jobs: Sequence[Callable[[], T]], workers: int) -> tuple[list[T | None], bool]:
    """What each job gives, None for those that Ctrl-C kept from beginning, and whether it was pressed.

    Jobs that run when Ctrl-C is pressed see ``KeyboardInterrupt`` in the core and may still give what they have.

    Parameters
    ----------
    jobs : sequence of callable
    workers : int
    """
    from vpm._core import stop_when

    stop = Event()
    with ThreadPoolExecutor(min(workers, len(jobs)), "vpm", initializer=lambda: stop_when(stop.is_set)) as pool:
        futures = [pool.submit(job) for job in jobs]
        try:
            waiting: set[Future[T]] = set(futures)
            while waiting:
                _, waiting = wait(waiting, timeout=PATIENCE, return_when=FIRST_COMPLETED)
        except BaseException as error:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
            if not isinstance(error, KeyboardInterrupt):
                raise
    return [_given(future) for future in futures], stop.is_set()


def _given(future: Future[T]) -> T | None:
    if future.cancelled():
        return None
    try:
        return future.result()
    except KeyboardInterrupt:
        return None
