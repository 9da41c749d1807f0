"""First states that nobody measures: a load on a spring of which friction holds the first place."""

from functools import lru_cache

import numpy as np
import pytest

import vpm
from quotients import quotient
from sledge import FINE, GAIN, MASS, OIL, READING, SLEDGE, STEP
from vpm.catalogue import EFFECTS
from vpm.discrepancy.screening.candidates import candidates
from vpm.experiment import Experiment
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.ranking.fit import Fitter, View
from vpm.ranking.hidden_first_states import hidden_states
from vpm.ranking.model_structure import Structure
from vpm.ranking.parameter_priors import Sizes
from vpm.ranking.settings import Settings
from vpm.ranking.start_values import started
from vpm.ranking.tracked_records import TrackedRecords, Tracker

LOAD, STIFFNESS, DAMPING, DRY = 1.0, 400.0, 6.0, 1.2
#: The sledge carries a load on a spring.
CARRYING = (
    SLEDGE
    + f"""
[bodies.load]
mass = {LOAD}
[joints.tail]
type = "prismatic"
parent = "sledge"
child = "load"
axis = [1, 0, 0]
[[effects]]
type = "spring"
at = "tail"
stiffness = {STIFFNESS}
[[effects]]
type = "viscous_friction"
at = "tail"
viscous = {DAMPING}
"""
)
#: Where the load begins, m: friction holds it within 1.2 N / 400 N/m.
BEGINS = (2.5e-3, -2e-3)
#: Seeds of pairs of records.
PAIRS = range(0, 24, 2)


@lru_cache
def records() -> list[Experiment]:
    return [carried(begins, seed) for seed, begins in enumerate(BEGINS)]


def carried(begins: float, seed: int, duration: float = 4.0) -> Experiment:
    """Sledge and load by small explicit steps, dry friction between them as an impulse that at most stops them."""
    random, samples, h = np.random.default_rng(seed), round(duration / STEP), STEP / FINE
    time = STEP * np.arange(samples)
    phase = random.uniform(0.0, 2.0 * np.pi, 2)
    swing = np.sin(2.1 * time + phase[0]) + 0.6 * np.sin(9.0 * time + phase[1])
    command = 6.0 * swing * np.minimum(0.5 * time, 1.0)
    place, speed, apart, parting = 0.0, 0.0, begins, 0.0
    places = np.empty(samples)
    for sample in range(samples):
        places[sample] = place
        for _ in range(FINE):
            pull = STIFFNESS * apart + DAMPING * parting
            pushed = (GAIN * command[sample] - OIL * speed + pull) / MASS
            free = parting + h * (-pull / LOAD - pushed)
            impulse = np.clip(-free / (1.0 / MASS + 1.0 / LOAD), -h * DRY, h * DRY)
            speed += h * pushed - impulse / MASS
            parting = free + impulse * (1.0 / MASS + 1.0 / LOAD)
            place, apart = place + h * speed, apart + h * parting
    readings = places + READING * random.standard_normal(samples)
    signals = {"motor.command": command, "way.position": readings}
    return Experiment.from_arrays(time, signals, model=Model.from_toml(CARRYING), name=f"carried {seed}")


def rubbing() -> Model:
    model = Model.from_toml(CARRYING).with_parameters({"sledge.mass": MASS, "way.friction.viscous": OIL})
    return model.with_effect("coulomb_friction", "tail", coulomb=DRY, transition_velocity=1e-4)


def test_first_states_are_unknown_where_no_channel_tells_them() -> None:
    model = rubbing()
    assert hidden_states(model, ("way.position",)) == ("tail.position", "tail.velocity")
    assert hidden_states(model, ("way.position", "tail.position")) == ()
    split = model.with_effect("joint_compliance", "way", stiffness=1e5)
    assert hidden_states(split, ("way.position",)) == ("tail.position", "tail.velocity")
    firsts = TrackedRecords(model, records(), Settings()).firsts
    assert list(firsts.priors)[2:] == ["tail.position where record 2 begins", "tail.velocity where record 2 begins"]
    assert 1e-4 < firsts.priors["tail.position where record 1 begins"].spread < 0.1


def test_derivatives_by_first_states_are_those_of_differences() -> None:
    model = Model.from_toml(CARRYING)  # without friction it is linear, and differences are exact
    tracked = TrackedRecords(model, records(), Settings())
    theta = np.append(model.theta, [1e-3, 0.0, -5e-4, 1e-2])
    columns = [*range(len(model.theta), len(theta)), 0]
    _, slopes = tracked.follow(model, theta, Tracker(1.0), columns)
    for place, column in enumerate(columns[:-1]):
        expected = quotient(lambda at: tracked.follow(model, at, Tracker(1.0))[0], theta, column, 1e-3)
        assert np.abs(slopes[:, :, place] - expected).max() < 1e-6 * np.abs(expected).max()
        # A record knows nothing of where another one begins.
        other = slice(0, len(records()[0].time)) if place > 1 else slice(len(records()[0].time), None)
        assert not slopes[other, :, place].any()


def test_a_fit_makes_of_balance_most_of_what_the_true_first_states_make() -> None:
    """Before the settled part of a record, several pairs of place and speed lead to the same rest.

    Friction that sticks makes steps of what a fit sees of them, so that it may end on the way.
    """
    made = [fitted_firsts([carried(begins, seed + pair) for seed, begins in enumerate(BEGINS)]) for pair in PAIRS]
    assert np.mean([share for share, _ in made]) > 0.8
    assert min(share for share, _ in made) > 0.5
    for _, found in made:
        assert found.values == {}
        rest = found.carried(Model.from_toml(CARRYING))
        assert rest.theta[-4:] == pytest.approx(found.theta[-4:])
        assert rest.columns == [len(rest.model.theta) + place for place in range(4)]


def fitted_firsts(pair: list[Experiment]) -> tuple[float, Structure]:
    """Share that a fit from balance gains of what one from the true first states gains, and where it ends."""
    model, tracker = rubbing(), Tracker(Settings().bands[-1])
    fitter = Fitter(TrackedRecords(model, pair, Settings()), Settings())
    firsts = fitter.tracked.firsts.priors
    balanced = Structure(model, model.theta.copy(), {})
    begun = [
        Structure(model, np.append(model.theta, moves), firsts, firsts=tuple(firsts))
        for moves in (np.zeros(4), np.array([BEGINS[0], 0.0, BEGINS[1], 0.0]))
    ]
    view = View(fitter.noise_of(balanced, tracker))
    known, found, true = (fitter.finished(fitter.fitted(one, tracker, view), view) for one in (balanced, *begun))
    return (known.cost - found.cost) / (known.cost - true.cost), found.structure


@pytest.mark.nightly
def test_friction_that_held_a_load_is_named_alone() -> None:
    ranking = vpm.rank(Model.from_toml(CARRYING), records())
    assert [(one.effect, one.site) for one in ranking.effects] == [("coulomb_friction", "tail")]
    assert ranking.model.parameters["tail.friction.coulomb"].value == pytest.approx(DRY, rel=0.03)


def test_what_remembers_is_tried_beside_a_joint_that_nobody_measures() -> None:
    model = Model.from_toml(CARRYING)
    data = InverseDynamicsProblem(model, records()[:1])
    residual = data.evaluate(model, model.theta)[0]
    tried = {one.key for one in candidates(model, data, residual, tuple(EFFECTS))}
    remembering = {name for name, effect in EFFECTS.items() if effect.memory}
    assert tried >= {(name, joint) for name in remembering for joint in ("way", "tail")}


def test_a_wave_may_be_as_long_as_the_way_that_is_seen() -> None:
    model = Model.from_toml(CARRYING)
    data = InverseDynamicsProblem(model, records())
    residual = data.evaluate(model, model.theta)[0]
    sizes = Sizes(model, data)
    (ripple,) = (one for one in candidates(model, data, residual, ("torque_ripple",)) if one.site == "way")
    way = np.ptp(np.concatenate([record["way.position"] for record in records()]))
    assert ripple.bounds["period"][1] < way
    assert started(ripple, model, sizes).bounds["period"][1] == pytest.approx(way, rel=0.05)
