"""Where a term of a leg's dynamics may be left out, and that no more is missing there than is said."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from vpm.errors import ModelError
from vpm.linkages import DropLimit, Leg, drop_limit

TOLERANCE = 0.05


@pytest.fixture(scope="module")
def leg() -> Leg:
    return Leg.hyq()


@pytest.fixture(scope="module")
def velocity(leg: Leg) -> DropLimit:
    return drop_limit(leg, "velocity", TOLERANCE)


def share(leg: Leg, q: NDArray[np.float64], v: NDArray[np.float64], a: NDArray[np.float64], term: str) -> float:
    """The missing share from torques alone: differences of them with and without motion, no shares asked for."""
    still = np.zeros(2)
    weight = leg.torques(q, still, still)
    moving = leg.torques(q, v, still) - weight
    inertia = leg.torques(q, still, a) - weight
    norms = {"velocity": np.linalg.norm(moving), "inertia": np.linalg.norm(inertia), "weight": np.linalg.norm(weight)}
    return float(norms[term] / sum(norms.values()))


def worst(leg: Leg, limit: float, term: str) -> float:
    """Largest missing share on the edge of the allowed motions, at the configurations of the map and between them."""
    found = 0.0
    for q1 in np.radians(np.arange(-40.0, 61.0, 5.0)):
        for q2 in np.radians(np.arange(-140.0, -19.0, 5.0)):
            for signs in ((1.0, 1.0), (1.0, -1.0), (1.0, 0.0), (0.0, 1.0)):
                v, a = (
                    (np.array(signs) * limit, np.zeros(2))
                    if term == "velocity"
                    else (np.zeros(2), np.array(signs) * limit)
                )
                found = max(found, share(leg, np.array([q1, q2]), v, a, term))
    return found


@pytest.mark.parametrize("term", ["velocity", "inertia"])
def test_no_more_is_missing_than_is_said(leg: Leg, term: str) -> None:
    found = drop_limit(leg, term, TOLERANCE)  # type: ignore[arg-type]
    # A fifth more: between the configurations of the map, and between the sampled motions.
    assert 0.9 * TOLERANCE < worst(leg, found.limit, term) < 1.2 * TOLERANCE


def test_velocity_terms_may_go_at_low_rates_and_not_at_high_ones(velocity: DropLimit) -> None:
    # At low duty (2.5 rad/s) weight is most of the effort, and still a third of the effort can be velocity terms.
    assert velocity.limit < 2.5
    assert velocity.share_of_workspace(0.5 * velocity.limit) == 1.0
    assert velocity.share_of_workspace(10.0) < 0.1


def test_limits_of_velocity_terms_grow_with_the_root_of_the_tolerance(leg: Leg) -> None:
    # V ~ v^2 beside a weight that stays: for small shares twice the rate means four times the share.
    small, large = (drop_limit(leg, "velocity", tolerance).limit for tolerance in (0.005, 0.02))
    assert large / small == pytest.approx(2.0, rel=0.02)


def test_other_motion_leaves_less_missing(leg: Leg, velocity: DropLimit) -> None:
    quiet = drop_limit(leg, "inertia", TOLERANCE)
    assert drop_limit(leg, "inertia", TOLERANCE, other=3.0).limit >= quiet.limit
    assert velocity.unit == "rad/s"
    assert quiet.unit == "rad/s^2"


def test_it_says_saves_and_draws(velocity: DropLimit, tmp_path: Path) -> None:
    assert "velocity terms may be left out up to" in str(velocity)
    assert DropLimit.load(velocity.save(tmp_path / "limit.npz")) == velocity
    assert velocity.to_frame().shape == (143, 3)
    assert velocity.plot().axes


@pytest.mark.parametrize(
    ("term", "tolerance", "other", "words"),
    [
        ("gravity", 0.1, 0.0, 'a term "gravity" cannot be left out'),
        ("velocity", 0.0, 0.0, "a tolerance of 0"),
        ("velocity", 1.5, 0.0, "a tolerance of 1.5"),
        ("inertia", 0.1, -1.0, "a limit of -1"),
    ],
)
def test_questions_without_meaning_are_refused(leg: Leg, term: str, tolerance: float, other: float, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        drop_limit(leg, term, tolerance, other=other)  # type: ignore[arg-type]
