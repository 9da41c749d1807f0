"""Linear algebra of small matrices, which threads of its own would only slow down."""

from collections.abc import Callable
from functools import wraps
from threading import Event, Lock, Thread
from types import TracebackType
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

P = ParamSpec("P")
R = TypeVar("R")


class _OneThread:
    """Linear algebra in one thread as long as anybody is within.

    The limit is one of the whole process, and blocks of several threads overlap: the first one sets it, and the last
    one that leaves takes it back. A thread of its own does both, for a limit obeys the thread alone that has set it.
    """

    def __init__(self) -> None:
        self._lock, self._inside = Lock(), 0

    def __enter__(self) -> None:
        with self._lock:
            if self._inside == 0:
                limited, self._over = Event(), Event()
                self._holder = Thread(target=_hold, args=(limited, self._over), name="vpm", daemon=True)
                self._holder.start()
                limited.wait()
            self._inside += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                self._over.set()
                self._holder.join()


def _hold(limited: Event, over: Event) -> None:
    with threadpool_limits(1, user_api="blas"):
        limited.set()
        over.wait()


#: For ``with``; see `in_one_thread`.
ONE_THREAD = _OneThread()


def in_one_thread(work: Callable[P, R]) -> Callable[P, R]:
    """A function whose linear algebra runs in one thread.

    Its matrices are long and narrow: on a busy machine a product of a millisecond waits half a second for the second
    thread. Cores are for candidates, side by side.
    """

    @wraps(work)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        with ONE_THREAD:
            return work(*args, **kwargs)

    return limited
