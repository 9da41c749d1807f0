"""Jobs on threads, in order: the core computes without the interpreter's lock, so records and starts share cores."""

import os
from collections.abc import Callable, Sequence
from typing import TypeVar

from vpm.errors import IdentificationError
from vpm.tasks import until_interrupted

T = TypeVar("T")


def worker_count(workers: int | None) -> int:
    """Number of parallel threads: as asked, or one per core."""
    count = (os.cpu_count() or 1) if workers is None else workers
    if count < 1:
        raise IdentificationError(f"{count} workers can do nothing; give at least 1")
    return count


def in_order(jobs: Sequence[Callable[[], T]], workers: int) -> list[T]:
    """Results of parallel jobs in their order, whatever the number of ``workers``.

    The first job that fails raises its error. Ctrl-C stops all of them.
    """
    if workers == 1 or len(jobs) < 2:
        return [job() for job in jobs]
    found, interrupted = until_interrupted(jobs, min(workers, len(jobs)))
    if interrupted:
        raise KeyboardInterrupt
    return [value for value in found if value is not None]
