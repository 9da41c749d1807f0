"""What keeps a diagnosis short: refits that creep end, the longest work begins first, and nothing depends on either."""

from collections.abc import Callable
from threading import Barrier

import numpy as np
import pytest

from vpm.discrepancy.parallel_candidates import Failure, ParallelCandidates
from vpm.errors import DiagnosisError
from vpm.identify import Worth


def _evaluations(course: Callable[[int], float], worth: Worth, most: int = 40) -> int:
    """After how many evaluations a fit whose least sum of squares runs so is ended, at most ``most``."""
    reached = [course(n) for n in range(most)]
    return next((n for n in range(1, most) if worth.lost(reached[:n]) or worth.creeps(reached[:n])), most)


WORTH = Worth(0.99, 10)


@pytest.mark.parametrize(
    ("course", "ended"),
    [
        (lambda n: 1.0 - 1e-4 * n, 10),  # has not shown its worth, and hardly comes nearer
        (lambda n: 0.9 - 1e-4 * n, 10),  # has shown it, and creeps along a bound
        (lambda n: 0.9 * 0.99**n, 40),  # has shown it, and goes on
        (lambda n: 1.0 - 0.04 * min(n, 20), 26),  # goes on, until five evaluations after the 21st say no more
    ],
)
def test_a_refit_ends_where_it_creeps(course: Callable[[int], float], ended: int) -> None:
    assert _evaluations(course, WORTH) == ended


def test_outcomes_stand_in_the_order_of_the_items_and_the_longest_begins_first() -> None:
    begun: list[int] = []

    def work(item: int) -> int:
        begun.append(item)
        if item == 5:
            raise DiagnosisError("none")
        return 10 * item

    outcomes = ParallelCandidates(1)("work", work, [1, 5, 3, 4], str, float)
    assert begun == [5, 4, 3, 1]
    assert [outcomes[0], *outcomes[2:]] == [10, 30, 40]
    assert isinstance(outcomes[1], Failure)


def test_as_many_items_run_at_a_time_as_there_are_workers() -> None:
    together = Barrier(3, timeout=600.0)
    found = ParallelCandidates(3)(
        "work", lambda item: np.array([item, together.wait() >= 0]), [1, 2, 3], str, lambda n: -n
    )
    assert [int(one[0]) for one in found if not isinstance(one, Failure)] == [1, 2, 3]
