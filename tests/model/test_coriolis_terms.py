"""Models without products of rates: what is missing, what share of the efforts that is, and where a search tries it."""

import numpy as np
import pytest

import vpm
from model_texts import two_links
from vpm.errors import ModelError
from vpm.simplify import Ladder, reductions, simplify
from vpm.simplify.reductions import VELOCITY_TERMS
from vpm.simplify.terms import parts

#: Two rods in a horizontal plane: masses at 0.5 m and 0.4 m from their joints, the second joint at 0.8 m.
FIRST, SECOND, LENGTH, CENTER = 3.0, 2.0, 0.8, 0.4
UPPER = f"mass = {FIRST}\ncenter_of_mass = [0.5, 0.0, 0.0]\ninertia = [0.1, 0.1, 0.1, 0, 0, 0]"
LOWER = f"mass = {SECOND}\ncenter_of_mass = [{CENTER}, 0.0, 0.0]\ninertia = [0.05, 0.05, 0.05, 0, 0, 0]"
ARM = f"""{two_links(UPPER, LOWER, f"[{LENGTH}, 0.0, 0.0]")}
[actuators.one]
joint = "shoulder"
command_unit = "N m"
gain = 1.0
[actuators.two]
joint = "elbow"
command_unit = "N m"
gain = 1.0
[controllers.first]
type = "pid"
actuator = "one"
measures = "shoulder.position"
proportional = 400.0
derivative = 40.0
[controllers.second]
type = "pid"
actuator = "two"
measures = "elbow.position"
proportional = 100.0
derivative = 10.0
"""


@pytest.fixture(scope="module")
def arm() -> vpm.Model:
    return vpm.Model.from_toml(ARM)


def coriolis(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Craig, Introduction to Robotics, section 6.7, with the mass of the second link at its centre."""
    size = SECOND * LENGTH * CENTER * np.sin(q[1])
    return np.array([-size * (2.0 * v[0] * v[1] + v[1] ** 2), size * v[0] ** 2])


def test_what_is_missing_is_the_closed_form_and_comes_back_with_the_key(arm: vpm.Model) -> None:
    still = VELOCITY_TERMS.applied(arm)
    assert "velocity_terms = false" in still.to_toml()
    assert vpm.Model.from_toml(still.to_toml()).to_dict() == still.to_dict()
    random = np.random.default_rng(3)
    for _ in range(5):
        q, v, a = random.normal(size=(3, 2))
        missing = arm.inverse_dynamics(q, v, a) - still.inverse_dynamics(q, v, a)
        assert missing == pytest.approx(coriolis(q, v), abs=1e-12)
        assert still.forward_dynamics(q, v, a) == pytest.approx(arm.forward_dynamics(q, 0.0 * v, a), rel=1e-12)
    with pytest.raises(ModelError, match="velocity_terms"):
        vpm.Model.from_toml(ARM.replace("gravity", 'velocity_terms = "no"\ngravity', 1))


def test_parts_of_the_efforts_are_those_by_hand(arm: vpm.Model) -> None:
    q, v, a = (np.array([row]) for row in ([0.3, 1.1], [2.0, -1.0], [3.0, 1.0]))
    velocity, inertia = np.linalg.norm(coriolis(q[0], v[0])), np.linalg.norm(arm.mass_matrix(q[0]) @ a[0])
    assert parts(arm, q, v, a)[0] == pytest.approx([velocity, inertia, 0.0], abs=1e-12)
    # Twice as fast along the same path: both four times as large.
    assert parts(arm, q, 2.0 * v, 4.0 * a) == pytest.approx(4.0 * parts(arm, q, v, a), abs=1e-12)
    turned = vpm.Model.from_toml(ARM.replace("gravity = [0.0, 0.0, 0.0]", "gravity = [0.0, -9.81, 0.0]"))
    weight = np.linalg.norm(turned.inverse_dynamics(q[0], 0.0 * v[0], 0.0 * a[0]))
    assert parts(turned, q, v, a)[0, 2] == pytest.approx(weight, rel=1e-12)


def swing(arm: vpm.Model, elbow: float) -> vpm.Experiment:
    """The shoulder swings by 0.3 rad around, the elbow by so much, both once in a second."""
    time = 4e-3 * np.arange(250)
    wave = 1.0 - np.cos(2.0 * np.pi * time)
    values = {"one.reference": 0.3 * wave, "two.reference": elbow * wave}
    return vpm.Experiment.from_arrays(time, values, model=arm, name="swing")


def search(arm: vpm.Model, elbow: float, told: list[str]) -> Ladder:
    return simplify(arm, swing(arm, elbow), rate=1000.0, tolerance=0.02, against="model", tell=told.append)


def share_of(told: list[str]) -> float:
    return float(next(sentence for sentence in told if sentence.startswith("velocity")).split()[3]) / 100.0


def test_a_search_leaves_them_out_where_the_motion_allows_it(arm: vpm.Model) -> None:
    told: list[str] = []
    ladder = search(arm, 0.02, told)
    without = [rung for rung in ladder.rungs if rung.removed == (str(VELOCITY_TERMS),)]
    assert 0.0 < share_of(told) <= 0.1
    assert any(rung.loss <= 0.02 for rung in without)
    assert VELOCITY_TERMS.site in reductions(arm)
    assert VELOCITY_TERMS.site not in reductions(VELOCITY_TERMS.applied(arm))


def test_a_search_keeps_them_untried_where_they_are_much_of_the_efforts(arm: vpm.Model) -> None:
    told: list[str] = []
    ladder = search(arm, 1.5, told)
    assert share_of(told) > 0.1
    assert all(rung.removed == () for rung in ladder.rungs)


def test_a_servo_yields_to_what_is_missing_as_much_as_its_gain_says(arm: vpm.Model) -> None:
    record = swing(arm, 0.02)
    full, without = (
        vpm.simulate(model, record, "closed_loop", substeps=8) for model in (arm, VELOCITY_TERMS.applied(arm))
    )
    states = np.column_stack([full["shoulder.position"], full["elbow.position"]])
    rates = np.gradient(states, record.dt, axis=0)
    missing = np.array([coriolis(q, v)[1] for q, v in zip(states, rates, strict=True)])
    # Slow beside the servo, whose gain is 100 N m/rad: displaced as by a load at rest, up to inertia and damping.
    moved = full["elbow.position"] - without["elbow.position"]
    assert np.max(np.abs(moved)) == pytest.approx(np.max(np.abs(missing)) / 100.0, rel=0.4)
