"""Parallel computation of candidates on all cores, reported in an order independent of the number of cores."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from threading import Lock
from typing import TypeVar

from vpm.identify.parallel import in_order, worker_count

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")

#: Called with what is being done, the candidate that is done with, how many are, and how many there are.
Progress = Callable[[str, str, int, int], None]


@dataclass(frozen=True)
class Failure:
    """Failure of a candidate in the parallel computation: it cannot be computed, and why.

    It is one that is refused, and no reason to give up all the others.
    """

    reason: str


@dataclass(frozen=True)
class ParallelCandidates:
    """Number of candidates computed in parallel, and where progress is reported."""

    #: Threads; None for one per core. The core lets go of the interpreter while it computes.
    workers: int | None = None
    progress: Progress | None = None  #: See `Progress`; called from the threads, one at a time.

    def __call__(
        self,
        what: str,
        work: Callable[[Item], Outcome],
        items: Sequence[Item],
        name: Callable[[Item], str],
    ) -> list[Outcome | Failure]:
        """Compute candidates in parallel, in the order of the items. Ctrl-C stops all and raises KeyboardInterrupt.

        The linear algebra inside is small: with threads of its own it would only take the cores from the others.
        """
        lock, done = Lock(), 0

        def one(item: Item) -> Outcome | Failure:
            nonlocal done
            outcome: Outcome | Failure
            try:
                outcome = work(item)
            except (ValueError, ArithmeticError) as error:
                outcome = Failure(f"it cannot be computed here: {error}")
            with lock:
                done += 1
                if self.progress is not None:
                    self.progress(what, name(item), done, len(items))
            return outcome

        return in_order([partial(one, item) for item in items], worker_count(self.workers))
