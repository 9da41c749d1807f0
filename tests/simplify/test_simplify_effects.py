"""Walking down: what may be left out."""

from pathlib import Path

import pytest

from synthetic import Truth, nominal, simulate_axis
from vpm.errors import SimulationError
from vpm.experiment import Experiment
from vpm.simplify import Ladder, simplify


@pytest.fixture(scope="module")
def record() -> Experiment:
    return simulate_axis(Truth(mass=20.0, viscous=60.0, coulomb=8.0), 1, 6.0, first_seed=4)[0]


@pytest.fixture(scope="module")
def ladder(record: Experiment) -> Ladder:
    full = nominal().with_effect("coulomb_friction", at="axis", coulomb=8.0, transition_velocity=1e-3)
    full = full.with_effect("torque_ripple", at="axis", period=0.05, cosine=0.001)
    return simplify(full, record, tolerance=0.01)


def test_leaves_out_what_does_nothing_and_keeps_what_matters(ladder: Ladder) -> None:
    kept = {effect.name for effect in ladder.model.effects}
    assert "coulomb_friction" in kept
    assert "torque_ripple" not in kept
    assert ladder.chosen.loss <= 0.01


def test_every_subset_and_integrator_was_tried(ladder: Ladder) -> None:
    assert len({(r.removed, r.integrator) for r in ladder.rungs}) == len(ladder.rungs)
    assert {r.removed for r in ladder.rungs} >= {
        (),
        ("without coulomb_friction at axis",),
        ("without torque_ripple at axis",),
    }


def test_one_joint_has_no_velocity_terms_to_leave_out(ladder: Ladder) -> None:
    assert not any("velocity terms" in simpler for rung in ladder.rungs for simpler in rung.removed)


def test_rungs_come_cheapest_first(ladder: Ladder) -> None:
    seconds = [r.seconds for r in ladder.rungs]
    assert seconds == sorted(seconds)


def test_ladder_saves_and_loads(ladder: Ladder, tmp_path: Path) -> None:
    assert Ladder.load(ladder.save(tmp_path / "ladder.npz")) == ladder


def test_negative_tolerance_is_refused(record: Experiment) -> None:
    with pytest.raises(SimulationError, match="tolerance of -1"):
        simplify(nominal(), record, tolerance=-1.0)
