"""Linear algebra of small matrices, which threads of its own would only slow down."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

P = ParamSpec("P")
R = TypeVar("R")


def in_one_thread(work: Callable[P, R]) -> Callable[P, R]:
    """A function whose linear algebra runs in one thread.

    Its matrices are long and narrow: on a busy machine a product of a millisecond waits half a second for the second
    thread. Cores are for candidates, side by side.

    Parameters
    ----------
    work : callable

    Returns
    -------
    callable
    """

    @wraps(work)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        with threadpool_limits(1, user_api="blas"):
            return work(*args, **kwargs)

    return limited
