"""Fits of a ranking: what is known while it searches, secants, sides, steps, and what counts as an effect."""

from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.signal import lfilter

import vpm
from model_texts import effect_text, rod, two_links
from places import EXAMPLES
from second_suite import arm
from sledge import GAIN, MASS, OIL, SLEDGE, pushed
from vpm.catalogue import EFFECTS
from vpm.catalogue.kinds import Side, in_words
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.discrepancy.screening.candidates import candidates
from vpm.errors import ModelError
from vpm.experiment import Experiment
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.numbers import Array
from vpm.ranking.fit import Fitter, View, bounded_step, by_secant, counted_too_often
from vpm.ranking.judgement import Judgement
from vpm.ranking.lever import Lever
from vpm.ranking.look import Look
from vpm.ranking.model_structure import Structure
from vpm.ranking.parameter_priors import Sizes
from vpm.ranking.proposals import Proposal, _seated, proposals
from vpm.ranking.ranking_search import Search, _is_worse
from vpm.ranking.settings import PLACES, Settings
from vpm.ranking.several_at_once import _plainest_first, _spares_file
from vpm.ranking.start_values import _different_waves, started
from vpm.ranking.structure_extensions import Extensions
from vpm.ranking.tracked_records import TrackedRecords, Tracker, tracker_gains
from vpm.ranking.trials import Trials
from vpm.ranking.tried_effect import Trial
from vpm.weighing import Prior

#: An arm on a vertical hinge, without friction.
FLAT = """
name = "flat"
gravity = [0, 0, 0]
[bodies.arm]
mass = 1.0
inertia = [0.1, 0.1, 0.15, 0, 0, 0]
[joints.hinge]
type = "revolute"
parent = "world"
child = "arm"
axis = [0, 0, 1]
[actuators.motor]
joint = "hinge"
gain = 1.0
"""


#: A rod that stands on its end, on a hinge that a motor turns.
STANDING = rod(0.15)


def stood() -> Experiment:
    """The rod held up by a motor that feels a constant pull beside, which its model does not know."""
    step, fine, inertia, weight = 2e-3, 10, 0.002 + 0.15**2, 9.81 * 0.15
    angle, speed, pull = 0.0, 0.0, 0.3
    told = []
    for sample in range(2000):
        wanted = 0.2 * np.sin(3.0 * sample * step)
        torque = 8.0 * (wanted - angle) - 0.8 * speed - pull
        told.append((torque, angle))
        for _ in range(fine):
            speed += step / fine * (weight * np.sin(angle) + torque + pull) / inertia
            angle += step / fine * speed
    torques, angles = np.array(told).T
    motion = {"motor.command": torques, "hinge.position": angles}
    return Experiment.from_arrays(step * np.arange(2000), motion, model=Model.from_toml(STANDING), name="stood")


@lru_cache
def records() -> list[Experiment]:
    return [pushed(seed=1, duration=4.0), pushed(seed=2, duration=4.0)]


def fitter_of(model: Model) -> Fitter:
    return Fitter(TrackedRecords(model, records(), Settings()), Settings())


def structure_of(model: Model) -> Structure:
    known = {
        p.name: Prior(p.value, p.uncertainty, p.minimum, p.maximum) for p in model.parameters.values() if p.uncertainty
    }
    return Structure(model, model.theta.copy(), known)


@pytest.mark.parametrize("effect", ["coulomb_friction", "spring", "quadratic_drag", "hysteresis", "bias_force"])
def test_derivatives_by_what_is_known_stay_where_an_effect_does_nothing(effect: str) -> None:
    """Exact ones, that is: a fit has those of the order of the steps, but where the machine has a memory."""
    model = Model.from_toml(SLEDGE)
    shapes = {"hysteresis": {"displacement": 0.05}, "spring": {"rest": 0.1}}
    fitter, tracker = fitter_of(model), Tracker(1.0)
    without = structure_of(model)
    beside = without.carried(model.with_effect(effect, "way", **shapes.get(effect, {})))
    (residual, plain), (other, more) = (
        fitter.tracked.follow(one.model, one.theta, tracker, [one.place(name) for name in one.priors])
        for one in (without, beside)
    )
    scale = np.abs(plain).max(axis=(0, 1))
    assert np.abs(other - residual).max() < 1e-12
    np.testing.assert_allclose(more / scale, plain / scale, atol=1e-9)


def test_derivatives_without_those_of_the_matrix_miss_the_exact_ones_by_the_order_of_the_steps() -> None:
    document = {**arm.document(arm.MACHINE.values.__getitem__, frozenset()), "effects": []}
    model = Model.from_dict(document)
    channels = [f"{joint}.position" for joint in model.joints]
    time = 0.004 * np.arange(150)
    swing = np.sin(np.outer(time, 4.0 + np.arange(6.0)))
    gain = tracker_gains(model, channels, (3.0, 3.0), (len(time), 0.004), model.theta).reshape(len(time), -1)
    places = [model.output_channels.index(channel) for channel in channels]
    columns = [model.index(name) for name in ("link3.mass", "m2.gain", "m4.gain")]

    def slopes(substeps: int, moves: list[float] | None) -> Any:
        records = [(np.zeros(12), 5.0 * swing, 0.2 * swing, gain)]
        how = (places, 0.004, substeps, "linearly_implicit", columns, "zero_order", True, moves)
        return model.core.observe(model.theta, records, *how)[0][2]

    gaps = []
    for substeps in (1, 2, 4):
        exact = slopes(substeps, None)
        gaps.append(np.abs((slopes(substeps, [1e-6] * 3) - exact) / np.abs(exact).max(axis=(0, 1))).max())
    assert 1e-9 < gaps[0] < 1e-2
    assert gaps[1] < 0.35 * gaps[0]
    assert gaps[2] < 0.35 * gaps[1]


def test_differences_of_a_large_machine_are_those_of_runs_one_by_one() -> None:
    model = Model.load(EXAMPLES / "tudor" / "tudor.toml")
    channels = [f"{joint}.position" for joint in model.joints]
    time = 0.002 * np.arange(200)
    swing = np.sin(np.outer(time, 4.0 + np.arange(3.0)))
    gain = tracker_gains(model, channels, (3.0, 3.0), (len(time), 0.002), model.theta).reshape(len(time), -1)
    record = (np.zeros(len(model.state_names)), 0.5 * swing, 0.02 * swing, gain)
    how = ([model.output_channels.index(channel) for channel in channels], 0.002, 1, "crank_nicolson")
    columns = [model.index(name) for name in ("strip_1.young", "strip_2.density", "motor_2.gain")]
    moves = 1e-6 * model.theta[columns]

    def left(theta: Array) -> Array:
        return model.core.observe(theta, [record], *how, alone=True)[0][0]

    [(_, _, slopes)] = model.core.observe(model.theta, [record], *how, columns, "zero_order", True, moves)
    for number, (column, move) in enumerate(zip(columns, moves, strict=True)):
        moved = model.theta.copy()
        moved[column] += move
        assert np.array_equal(slopes[:, :, number], (left(moved) - left(model.theta)) / move)
        assert np.any(slopes[:, :, number])


def test_structures_are_compared_by_steps_whose_errors_are_small() -> None:
    model = Model.from_toml(SLEDGE).with_effect("end_stop", "way", low=-0.5, high=0.5, stiffness=4e4, damping=0.01)
    structure, fitter = structure_of(model), fitter_of(Model.from_toml(SLEDGE))
    exact = Fitter(TrackedRecords(Model.from_toml(SLEDGE), records(), Settings(exact=1e-8)), Settings())
    truth = exact.followed(structure, Tracker(1.0), ()).residual
    off = [
        np.abs(fitter.followed(structure, one, ()).residual - truth).max()
        for one in (Tracker(1.0).coarse, Tracker(1.0))
    ]
    assert off[0] > 4.0 * off[1]


def test_secants_make_derivatives_exact_where_all_is_linear() -> None:
    random = np.random.default_rng(5)
    true, slopes = random.standard_normal((20, 3)), random.standard_normal((20, 3))
    for move in np.eye(3):
        slopes = by_secant(slopes, true @ move, move)
    np.testing.assert_allclose(slopes, true, atol=1e-12)


def test_the_size_of_an_effect_is_its_amplitude_beside_all_effects() -> None:
    """A force of which a tenth is missing: the rest of it does nine tenths of what there is to do."""
    model = Model.from_toml(SLEDGE).with_parameters({"sledge.mass": MASS, "way.friction.viscous": OIL})
    pulled = [
        Experiment.from_arrays(
            one.time,
            {"motor.command": one["motor.command"] + 0.5, "way.position": one["way.position"]},
            model=model,
            name=one.name,
        )
        for one in records()
    ]
    fitter = Fitter(TrackedRecords(model, pulled, Settings()), Settings())
    wrong, right = (
        replace(structure_of(model.with_effect("bias_force", "way", force=share * 0.5 * GAIN)), priors={})
        for share in (0.9, 1.0)
    )
    oily = model.effects[0]
    assert wrong.bare([oily]).theta[model.index("way.friction.viscous")] == 0.0
    view = View(fitter.noise_of(wrong, Tracker(1.0)))
    begun, better = (fitter.fitted(one, Tracker(1.0), view) for one in (wrong, right))
    look = Look(begun, fitter)
    pulling = wrong.model.effect("bias_force", "way")
    assert look._removed([pulling]) == pytest.approx(10.0**2 - 1.0, rel=0.01)
    told = look.judged(better, ("bias_force", "way"))
    assert told.shape == pytest.approx(0.1, rel=0.01)
    assert told.size <= told.shape
    assert told.least > 0.99
    assert told.counts(Settings())
    assert not replace(told, size=0.002).counts(Settings())
    assert not replace(told, beside=0.04, least=0.5).counts(Settings())
    # What removes nearly all that is left is more than a law is wrong by, however small it is beside another one.
    assert replace(told, beside=0.04, least=0.9).counts(Settings())
    assert not replace(told, shape=0.01).counts(Settings())
    assert not replace(told, score=2.0, least=0.8).counts(Settings())
    assert not replace(told, least=0.01).counts(Settings())


def test_friction_goes_to_the_other_side_of_a_backlash_and_back() -> None:
    model = Model.from_toml(SLEDGE).with_effect("backlash", "way", gap=1e-3, stiffness=1e5, inertia=0.3)
    structure = structure_of(model)
    there = structure.beside("way", "link")
    assert "way.link.friction.viscous" in there.priors
    assert there.values["way.link.friction.viscous"] == structure.values["way.friction.viscous"]
    assert (structure.side(("viscous_friction", "way")), there.side(("viscous_friction", "way"))) == ("motor", "link")
    assert in_words("way", there.side(("viscous_friction", "way"))) == "way, link side"
    back = there.beside("way", "motor")
    assert back.model == structure.model
    assert back.values == structure.values
    assert structure.model.joint_behind("way") == "way_deflection"
    assert Model.from_toml(SLEDGE).joint_behind("way") is None


def test_all_effects_with_a_law_are_candidates() -> None:
    model = Model.from_toml(SLEDGE)
    data = InverseDynamicsProblem(model, records()[:1])
    residual = data.evaluate(model, model.theta)[0]
    named = {one.effect.name for one in candidates(model, data, residual, tuple(EFFECTS))}
    usual = {one.effect.name for one in candidates(model, data, residual)}
    assert named - usual == {"empirical_force"}
    assert {"quadratic_drag", "cubic_spring", "warming_friction", "load_dependent_friction"} <= usual


def test_a_view_prefers_derivatives_that_are_there() -> None:
    fitter, structure = fitter_of(Model.from_toml(SLEDGE)), structure_of(Model.from_toml(SLEDGE))
    followed = fitter.followed(structure, Tracker(1.0), tuple(structure.priors))
    noise, parts = fitter.noise_of(structure, Tracker(1.0)), fitter.tracked.parts
    known = dict(zip(followed.names, noise.whitened(followed.jacobian, parts).T, strict=True))
    bare = replace(followed, names=(), jacobian=followed.jacobian[:, :, :0])
    for one, other in zip(View(noise, known).errors(bare, parts), View(noise).errors(followed, parts), strict=True):
        np.testing.assert_allclose(one, other)


#: A pendulum that hangs on the sledge and that nobody measures.
HANGING = (
    SLEDGE.replace("[0.0, 0.0, 0.0]", "[0.0, 0.0, -9.81]")
    + """
[bodies.bob]
mass = 0.4
center_of_mass = [0, 0, -0.5]
inertia = [0.01, 0.01, 0.001, 0, 0, 0]
[joints.pivot]
type = "revolute"
parent = "sledge"
child = "bob"
axis = [0, 1, 0]
"""
)


def test_nobody_guesses_where_a_joint_ends_that_nobody_sees() -> None:
    model = Model.from_toml(HANGING)
    data = InverseDynamicsProblem(model, records()[:1])
    sizes = Sizes(model, data)
    found = candidates(model, data, data.evaluate(model, model.theta)[0])
    stops = {one.site: started(one, model, sizes).starts for one in found if one.effect.name == "end_stop"}
    assert stops["pivot"] == ()
    assert stops["way"]


def test_what_remembers_behind_a_spring_begins_with_nothing_to_remember() -> None:
    """At rest it pulls nothing: the spring hangs as without it, and another effect may be looked for beside it."""
    bare = Model.from_toml(SLEDGE).with_effect("joint_compliance", "way", stiffness=1e5, inertia=0.3)
    for side in ("motor", "link"):
        model = bare.with_effect("hysteresis", "way", side=side, force=1.0, displacement=0.05)
        fitter = fitter_of(model)
        carried = structure_of(Model.from_toml(SLEDGE)).carried(model)
        found = fitter.fitted(carried, Tracker(1.0), View(fitter.noise_of(carried, Tracker(1.0))))
        rest, plain = (
            tracked._begun(one)[0] for one, tracked in ((model, fitter.tracked), (bare, fitter_of(bare).tracked))
        )
        assert rest[: len(plain)] == pytest.approx(plain)
        assert rest[len(plain) :] == pytest.approx(0.0)
    data = InverseDynamicsProblem(Model.from_toml(SLEDGE), records())
    few = Fitter(fitter.tracked, Settings(seats=1, starts=1))
    listed = proposals(
        Look(found, few), few, data, Extensions(Sizes(bare, data)), ParallelCandidates(1), tuple(EFFECTS)
    )
    assert all(proposal.structure.model.effect("hysteresis", "way", "link") for proposal in listed)


def test_a_stiff_joint_answers_as_a_rigid_one() -> None:
    """Noise and what is missing elsewhere included: a tracker that moved the motor alone would pass for an effect."""
    rigid = fitter_of(Model.from_toml(SLEDGE))
    split = Model.from_toml(SLEDGE).with_effect("joint_compliance", "way", stiffness=1e6, damping=2e3, inertia=0.3)
    lighter = split.with_parameters({"sledge.mass": rigid.tracked.model.parameters["sledge.mass"].value - 0.3})
    for band in (1.0, 10.0):
        one, _ = rigid.tracked.follow(rigid.tracked.model, rigid.tracked.model.theta, Tracker(band))
        other, _ = fitter_of(lighter).tracked.follow(lighter, lighter.theta, Tracker(band))
        assert np.std(other - one) < 0.01 * np.std(one)


def test_a_place_that_may_lie_anywhere_begins_far_away_too() -> None:
    """A constant pull is a spring that rests far away; from its middle a first step does not get there."""
    model = Model.from_toml(SLEDGE)
    data = InverseDynamicsProblem(model, records()[:1])
    sizes = Sizes(model, data)
    found = {one.effect.name: started(one, model, sizes) for one in candidates(model, data, np.zeros(1), ("spring",))}
    low, high = sizes.ways["way"]
    rests = [start["rest"] for start in found["spring"].starts]
    assert rests[0] == pytest.approx(0.5 * (low + high))
    assert min(rests) < low - (high - low) < high + (high - low) < max(rests)


def test_start_values_of_an_effect_share_one_model() -> None:
    """Its equations are recorded once; the values are those of a model of its own."""
    model = Model.from_toml(SLEDGE)
    data, structure = InverseDynamicsProblem(model, records()[:1]), structure_of(model)
    extensions = Extensions(Sizes(model, data))
    (one,) = candidates(model, data, data.evaluate(model, model.theta)[0], ("joint_compliance",))
    made = [extensions.extended(structure, one, start, "motor") for start in one.starts]
    assert len({id(each.model) for each in made}) == 1
    for each, start in zip(made, one.starts, strict=True):
        assert each.theta == pytest.approx(model.with_effect("joint_compliance", "way", **start).theta)
        assert each.effects == (("joint_compliance", "way"),)


def test_an_effect_takes_the_place_of_another_one_as_it_was_fitted() -> None:
    model = Model.from_toml(SLEDGE)
    dry, late = model.with_effect("coulomb_friction", "way", coulomb=2.0), model.with_effect("input_delay", "motor")
    first = replace(structure_of(dry), effects=(("coulomb_friction", "way"),))
    name = late.effect("input_delay", "motor").parameter_names["time"]
    other = replace(structure_of(late), effects=(("input_delay", "motor"),))
    other.theta[late.index(name)] = 0.004
    other = replace(other, priors={**other.priors, name: Prior(0.0, 0.005, 0.0, np.inf)}, range_limited=(name,))
    both = first.with_last_of(other)
    assert both.effects == (("coulomb_friction", "way"), ("input_delay", "motor"))
    assert both.values[name] == 0.004
    assert both.theta[both.model.index("way.friction.coulomb")] == 2.0
    assert both.shows(("input_delay", "motor"))
    stuck = both.at(np.where(np.array(list(both.priors)) == name, both.ends[:, 0], both.standard))
    assert not stuck.shows(("input_delay", "motor"))
    assert stuck.shows(("coulomb_friction", "way"))


def test_seats_go_to_starts_that_promise_a_gain() -> None:
    structure = structure_of(Model.from_toml(SLEDGE))

    def one(name: str, gain: float, neutral: bool) -> Proposal:
        return Proposal(replace(structure, effects=((name, "way"),)), gain, neutral)

    ordered = [one("spring", 90.0, True), one("backlash", 80.0, False), one("spring", 70.0, True)]
    ordered += [one("bias_force", 60.0, True), one("backlash", 9.0, False), one("hysteresis", 8.0, True)]
    ordered += [one("end_stop", -50.0, False), one("end_stop", -60.0, False)]
    seated = [(each.key[0], each.gain) for each in _seated(ordered, 10.0, Settings(seats=1))]
    assert seated == [("spring", 90.0), ("spring", 70.0), ("backlash", 80.0)]


def test_starts_that_gain_the_same_take_one_seat() -> None:
    """They differ in what does nothing there; a spring that starts elsewhere is another one."""
    structure = structure_of(Model.from_toml(SLEDGE)).carried(Model.from_toml(SLEDGE).with_effect("spring", "way"))
    springs = [Proposal(replace(structure, effects=(("spring", "way"),)), gain, True) for gain in (90.0, 89.9, 70.0)]
    assert _seated(springs, 10.0, Settings()) == [springs[0], springs[2]]


@pytest.mark.parametrize(("more", "close"), [((), 1e-6), (("hysteresis",), 1e-3)])
def test_effects_that_do_nothing_share_a_pass_and_promise_the_same(
    more: tuple[str, ...], close: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing changes but the number of passes: none of them moves what the others add.

    A pass with a memory has exact derivatives, one without those of the order of its steps.
    """
    model = Model.from_toml(SLEDGE)
    pulled = [pushed(seed=1, dry=1.0, late=0.004, duration=2.0)]
    data = InverseDynamicsProblem(model, pulled)
    fitter = Fitter(TrackedRecords(model, pulled, Settings()), Settings(seats=99, patience=1e9))
    structure = structure_of(model)
    view = View(fitter.noise_of(structure, Tracker(1.0)))
    look = Look(fitter.fitted(structure, Tracker(1.0), view), fitter)
    effects = ("bias_force", "coulomb_friction", "quadratic_drag", "spring", *more, "input_delay", "payload")
    promised: list[dict[object, float]] = []
    passes: list[int] = []
    follow = TrackedRecords.follow

    def counted(*given: object) -> object:
        passes[-1] += 1
        return follow(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(TrackedRecords, "follow", counted)
    for at_once in (1, 4, 12):
        monkeypatch.setattr("vpm.ranking.proposals.AT_ONCE", at_once)
        passes.append(0)
        listed = proposals(look, fitter, data, Extensions(Sizes(model, data)), ParallelCandidates(1), effects)
        promised.append({(one.key, *sorted(one.structure.values.items())): one.gain for one in listed})
    assert passes[0] > passes[1] > passes[2]
    for others in promised[1:]:
        assert others == pytest.approx(promised[0], rel=close, abs=1e-6)


def test_effects_that_do_nothing_share_one_model_at_all_start_values(monkeypatch: pytest.MonkeyPatch) -> None:
    """What they do not feel where they begin, such as where a spring without stiffness rests, is not asked for."""
    model = Model.from_toml(SLEDGE)
    data, fitter = InverseDynamicsProblem(model, records()), fitter_of(model)
    structure = structure_of(model)
    look = Look(fitter.fitted(structure, Tracker(1.0), View(fitter.noise_of(structure, Tracker(1.0)))), fitter)
    assert look.coarse.names  # its derivatives are known before proposals are asked for
    passes: list[tuple[Model, int]] = []
    follow = TrackedRecords.follow

    def noted(tracked: TrackedRecords, told: Model, theta: Any, tracker: Tracker, columns: Any = (), *by: Any) -> Any:
        if not tracker.fine and columns:
            passes.append((told, len(columns)))
        return follow(tracked, told, theta, tracker, columns, *by)

    monkeypatch.setattr(TrackedRecords, "follow", noted)
    proposals(look, fitter, data, Extensions(Sizes(model, data)), ParallelCandidates(1), ("spring", "cubic_spring"))
    models, columns = {told for told, _ in passes}, [count for _, count in passes]
    assert (len(passes), len(models), columns) == (len(PLACES), 1, [2] * len(PLACES))
    pulled = model.with_effect("spring", "way", stiffness=0.0, rest=0.1)
    _, slopes = follow(fitter.tracked, pulled, pulled.theta, Tracker(1.0), [pulled.index("way.spring.rest")])
    assert not np.any(slopes)


def test_more_or_less_of_an_effect_promises_what_it_would_gain() -> None:
    """Where all is linear: half of a force leaves a quarter of its power, and points to all of it."""
    model = Model.from_toml(SLEDGE).with_parameters({"sledge.mass": MASS, "way.friction.viscous": OIL})
    motion = {"motor.command": records()[0]["motor.command"] + 0.5, "way.position": records()[0]["way.position"]}
    pulled = Experiment.from_arrays(records()[0].time, motion, model=model, name="pulled")
    fitter = Fitter(TrackedRecords(model, [pulled], Settings()), Settings())
    fixed = replace(structure_of(model), priors={})
    look = Look(fitter.fitted(fixed, Tracker(1.0), View(fitter.noise_of(fixed, Tracker(1.0)))), fitter)
    left = {}
    for share in (-0.5, 0.5, 1.0, 10.0):
        pulls = replace(structure_of(model.with_effect("bias_force", "way", force=share * 0.5 * GAIN)), priors={})
        left[share] = fitter.followed(pulls, Tracker(1.0).coarse, ())
    whole, _ = look.gain_along(left[1.0])
    assert whole > 100.0 * look.promising
    half, share = look.gain_along(left[0.5])
    assert half == pytest.approx(whole, rel=0.05)
    assert share == pytest.approx(2.0, rel=0.05)
    assert look.gain_along(left[-0.5])[0] < 0.0
    far, share = look.gain_along(left[10.0])
    assert share == pytest.approx(0.1, rel=0.05)
    assert far < 0.0  # a quarter of it, where the next start is, pulls too much


def test_what_all_else_explains_is_promised_by_no_effect() -> None:
    """A change of a hair is worth nothing, however much the fit of what is known still has to gain."""
    model = Model.from_toml(SLEDGE).with_parameters({"sledge.mass": 1.5 * MASS})
    known = {"sledge.mass": Prior(1.5 * MASS, 0.01 * MASS, 0.0, np.inf)}
    fitter = fitter_of(model)
    look = Look(fitter.unfitted(Structure(model, model.theta.copy(), known), Tracker(1.0)), fitter)
    hair = replace(structure_of(model.with_effect("bias_force", "way", force=1e-9)), priors={})
    assert look.gain_along(fitter.followed(hair, Tracker(1.0).coarse, ()))[0] < look.promising


def test_what_coarse_steps_do_wrong_is_promised_by_no_effect() -> None:
    """Another mass would explain what long steps make of a spring, and explains nothing of its oil."""
    model = Model.from_toml(SLEDGE + effect_text("spring", "way", stiffness="1875.0", rest="0.0"))
    time = 0.02 * np.arange(400)
    sweep = {"motor.command": 10.0 * np.sin(2.0 * time * (1.0 + time))}
    scene = Experiment.from_arrays(time, sweep | {"way.position": 0.0 * time}, model=model, name="sweep")
    dry = model.with_parameters({"way.friction.viscous": 0.8 * OIL})
    ran = vpm.simulate(dry, scene, substeps=50, initial_state=np.zeros(2))
    way = {"way.position": ran.values[:, ran.channels.index("way.position")]}
    fitter = Fitter(
        TrackedRecords(model, [Experiment.from_arrays(time, sweep | way, model=model, name="sweep")], Settings()),
        Settings(),
    )
    look = Look(fitter.unfitted(replace(structure_of(model), priors={}), Tracker(1.0)), fitter)
    heavier = Structure(model, model.theta.copy(), {"sledge.mass": Prior(MASS, 0.1 * MASS, 0.0, np.inf)})
    followed = fitter.followed(heavier, Tracker(1.0).coarse, ("sledge.mass",))
    errors, slopes = look.view.errors(followed, fitter.tracked.parts)
    move = bounded_step(heavier, errors, slopes, look.settings.reach)
    assert look.view.noise.cost(errors) - look.view.noise.cost(errors + slopes @ move) > 50.0 * look.promising
    assert look.predicted_gain(followed) < look.promising


#: Two sledges that have nothing to do with each other.
TWO = SLEDGE + SLEDGE[SLEDGE.index("[bodies") :].replace("sledge", "other").replace("way", "road").replace(
    "motor", "engine"
)


def test_an_effect_counts_as_much_on_one_of_two_machines() -> None:
    """Shares of error power that are left multiply: channels that it does not touch take nothing away from it."""
    pulled = pushed(seed=1, dry=0.5, duration=4.0)
    beside = records()[0]
    alone, two = Model.from_toml(SLEDGE), Model.from_toml(TWO)
    motion = {name: pulled[name] for name in ("motor.command", "way.position")}
    both = motion | {"engine.command": beside["motor.command"], "road.position": beside["way.position"]}
    told = []
    for model, channels in ((alone, motion), (two, both)):
        record = Experiment.from_arrays(pulled.time, channels, model=model, name="record")
        fitter = Fitter(TrackedRecords(model, [record], Settings()), Settings())
        one, dry = structure_of(model), model.with_effect("coulomb_friction", "way", coulomb=0.5)
        rubbed = replace(one.carried(dry), priors={**one.priors, "way.friction.coulomb": Prior(0.0, 1.0, 0.0, np.inf)})
        view = View(fitter.noise_of(one, Tracker(1.0)))
        look = Look(fitter.fitted(one, Tracker(1.0), view), fitter)
        told.append(look.judged(fitter.fitted(rubbed, Tracker(1.0), view), ("coulomb_friction", "way")))
    for number in ("removed", "least", "size", "beside", "shape"):
        assert getattr(told[1], number) == pytest.approx(getattr(told[0], number), rel=0.02)


def test_a_tracker_that_lets_a_machine_fall_is_not_looked_at() -> None:
    """A rod that stands on its end: at 1 Hz it falls over and leaves more than a rod at rest would."""
    model = Model.from_toml(STANDING)
    record = stood()
    fitter = Fitter(TrackedRecords(model, [record], Settings()), Settings())
    structure = replace(structure_of(model), priors={})
    looks = {}
    for band in Settings().bands:
        view = View(fitter.noise_of(structure, Tracker(band)))
        looks[band] = Look(fitter.fitted(structure, Tracker(band), view), fitter)
    assert {band: look.follows for band, look in looks.items()} == {1.0: False, 10.0: True}


def test_fits_under_the_next_tracker_begin_where_the_first_one_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    begun, fitted = [], Search.fitted

    def seen(search: Search, structure: Structure, tracker: Tracker) -> Any:
        begun.append((tracker.band, structure.values["sledge.mass"]))
        return fitted(search, structure, tracker)

    monkeypatch.setattr(Search, "fitted", seen)
    vpm.rank(Model.from_toml(SLEDGE), pushed(seed=1, duration=2.0), effects=[])
    (first, at_first), (second, then) = begun[:2]
    assert (first, second) == Settings().bands
    assert at_first == 3.3
    assert then == pytest.approx(MASS, rel=0.02)


def test_values_are_those_that_predict_best_under_all_trackers(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit under the slow tracker that ended at a mass far off, as one does where a joint sticks and slips."""
    model, fitted = Model.from_toml(SLEDGE), Search.fitted

    def astray(search: Search, structure: Structure, tracker: Tracker) -> Any:
        if tracker.band == Settings().bands[0]:
            off = model.with_parameters({"sledge.mass": 1.3 * MASS}).theta
            return search.fitter.unfitted(replace(structure, theta=off), tracker)
        return fitted(search, structure, tracker)

    monkeypatch.setattr(Search, "fitted", astray)
    ranking = vpm.rank(model, pushed(seed=1, duration=2.0), effects=[])
    assert ranking.model.parameters["sledge.mass"].value == pytest.approx(MASS, rel=0.02)


@pytest.mark.parametrize(("share", "begins"), [(0.5, [MASS, 3.3]), (2.0, [MASS])])
def test_fits_begin_at_the_file_where_nothing_counts_from_afar(
    monkeypatch: pytest.MonkeyPatch, share: float, begins: list[float]
) -> None:
    """Known parameters that stand in for what is missing need not lead back; the file rules such values out."""
    model, begun = Model.from_toml(SLEDGE.replace("uncertainty = 0.33", "uncertainty = 0.1")), list[float]()

    def nothing(_: Search, __: Look, start: Look, **___: Any) -> list[Any]:
        begun.append(float(start.fitted.structure.theta[model.index("sledge.mass")]))
        return []

    monkeypatch.setattr(Search, "tried", nothing)
    monkeypatch.setattr(Look, "has_room", lambda *_: True)
    gone = abs(MASS - 3.3) / float(model.parameters["sledge.mass"].uncertainty or 0.0)
    vpm.rank(model, pushed(seed=1, duration=2.0), effects=["spring"], settings=Settings(odds=share * 0.5 * gone**2))
    assert begun == pytest.approx(begins, rel=0.02)


def test_friction_on_the_other_side_has_to_make_the_file_more_probable() -> None:
    """It stands for values that the file rules out; one that is zero and spares none of them is nothing."""
    model = Model.from_toml(SLEDGE)
    stated = structure_of(model)
    off = stated.at(stated.standard + 3.0)
    assert stated.doubt == 0.0
    assert off.doubt == pytest.approx(4.5 * len(model.adjustable))
    trials = SimpleNamespace(settings=Settings())
    for without, evidence, spared in ((off, 12.9, True), (off, 5.0, False), (stated, 12.9, False)):
        look, fitted = (SimpleNamespace(structure=one) for one in (without, stated))
        trial: Any = SimpleNamespace(evidence=evidence, look=SimpleNamespace(fitted=look), fitted=fitted)
        assert _spares_file(cast("Trials", trials), trial) == spared


@pytest.mark.parametrize(
    ("period", "overtone"), [(0.2, True), (0.1333, True), (0.2 * 1.01, True), (0.4, False), (0.23, False), (0.8, False)]
)
def test_what_repeats_along_a_whole_fraction_of_a_period_is_an_overtone(period: float, overtone: bool) -> None:
    """One tone stands for what a motor cogs; its second and third harmonic are no ripple of the current."""
    cogging = Model.from_toml(SLEDGE).with_effect("torque_ripple", "way", period=0.4, cosine=1.0)
    both = structure_of(cogging.with_effect("current_ripple", "way", period=period, cosine=0.1))
    assert both.is_overtone(("current_ripple", "way"), 20.0) == overtone
    assert not both.is_overtone(("viscous_friction", "way"), 20.0)
    told = Judgement(0.9, 0.9, 9.0, 0.1, 0.1, 0.1, overtone=overtone)
    assert told.counts(Settings()) != overtone
    assert ("an overtone of that" in told.lacks(Settings())) == overtone


def test_a_fit_stays_where_bodies_are_real() -> None:
    """No body has more inertia about an axis than about the two others together, whatever records ask for."""
    model = Model.from_toml(FLAT)
    time = 2e-3 * np.arange(1500)
    # A free inertia of 0.3 kg m^2 turns so under a torque of 2 cos 9t.
    angle = 2.0 / 0.3 * (1.0 - np.cos(9.0 * time)) / 81.0
    channels = {"motor.command": 2.0 * np.cos(9.0 * time), "hinge.position": angle}
    record = Experiment.from_arrays(time, channels, model=model, name="swing")
    fitter = Fitter(TrackedRecords(model, [record], Settings()), Settings())
    known = {"arm.inertia.zz": Prior(0.15, 0.1, 0.0, np.inf)}
    structure = Structure(model, model.theta.copy(), known)
    found = fitter.fitted(structure, Tracker(2.0), View(fitter.noise_of(structure, Tracker(2.0))))
    assert 0.17 < found.structure.values["arm.inertia.zz"] <= 0.2


def test_a_fit_that_has_ended_is_not_worked_out_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that was given up, or whose derivatives were taken as known, has not ended."""
    structure, tracker = structure_of(Model.from_toml(SLEDGE)), Tracker(1.0)
    fitter = fitter_of(structure.model)
    noise = fitter.noise_of(structure, tracker)
    followed = fitter.followed(structure.at(structure.standard), tracker, tuple(structure.priors))
    slopes = noise.whitened(followed.jacobian, fitter.tracked.parts).T
    known = View(noise, dict(zip(followed.names, slopes, strict=True)))
    found = fitter.fitted(structure, tracker, View(noise))
    assert found.ended
    assert not fitter.fitted(structure, tracker, known).ended
    assert not fitter.fitted(structure, tracker, View(noise), goal=-1e9).ended
    assert fitter.finished(replace(found, ended=False), View(noise)).cost == pytest.approx(found.cost, abs=0.5)

    def no_pass(*_: object) -> None:
        raise AssertionError("a pass over the records is asked for")

    monkeypatch.setattr(fitter, "_pass", no_pass)
    assert fitter.finished(found, View(noise)) is found


@given(st.floats(0.1, 10.0), st.floats(-5.0, 5.0), st.floats(-0.5, 5.0), st.floats(-3.0, 3.0))
def test_a_spring_keeps_its_pull_where_a_step_moves_its_rest(
    size: float, rest: float, stiffer: float, further: float
) -> None:
    """Of a spring that rests far away records tell the pull, so that its product with the stiffness moves straight."""
    model = Model.from_toml(SLEDGE).with_effect("spring", "way", stiffness=size, rest=rest)
    names = ("way.spring.stiffness", "way.spring.rest")
    prior = Prior(0.0, 2.0, -np.inf, np.inf)
    structure = Structure(model, model.theta.copy(), dict.fromkeys(names, prior))
    change = size * stiffer
    moved = structure.moved(np.array([0.5 * change, 0.5 * further]))
    stiffness, place = (moved.values[name] for name in names)
    assert stiffness == pytest.approx(size + change, rel=1e-9)
    assert stiffness * place == pytest.approx(size * (rest + further) + change * rest, rel=1e-6, abs=1e-9)


def test_a_spring_comes_back_from_where_it_pulls_nearly_the_same_everywhere() -> None:
    """The step is as likely as where it ends: as the spring stiffens its rest goes less far than at its first size."""
    model = Model.from_toml(SLEDGE)
    truth = model.with_effect("spring", "way", stiffness=30.0, rest=-0.05)
    time = 2e-3 * np.arange(4000)
    sent = Experiment.from_arrays(
        time, {"motor.command": 2.0 * np.sin(2.5 * time)}, model=model, name="pushed to and fro"
    )
    ran = vpm.simulate(truth, sent, mode="free_run")
    read = ran["way.position"] + 1e-6 * np.random.default_rng(1).standard_normal(len(time))
    log = Experiment.from_arrays(
        time, {"motor.command": sent["motor.command"], "way.position": read}, model=model, name="pushed to and fro"
    )
    fitter, tracker = Fitter(TrackedRecords(model, [log], Settings()), Settings()), Tracker(1.0)
    names = ("way.spring.stiffness", "way.spring.rest")
    far = model.with_effect("spring", "way", stiffness=0.0, rest=-5.0)
    priors = dict(zip(names, (Prior(0.0, 50.0, 0.0, np.inf), Prior(0.0, 0.1, -np.inf, np.inf)), strict=True))
    start = Structure(far, far.theta.copy(), priors, (("spring", "way"),))
    found = fitter.fitted(start, tracker, View(fitter.noise_of(start, tracker)))
    assert found.structure.values == pytest.approx(dict(zip(names, (30.0, -0.05), strict=True)), rel=0.02)


MOVES = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).map(np.array)


@given(st.floats(0.1, 10.0), MOVES, st.floats(-0.05, 0.05), MOVES.map(lambda way: 0.05 * way))
def test_first_and_second_moments_of_a_mass_move_straight(mass: float, place: Array, share: float, way: Array) -> None:
    """Where a joint turns it the mass alone shows little: what records tell is what it weighs and takes to turn."""
    lever, more = Lever(0, (1, 2, 3), is_mass=True), share * mass
    assume(float(place @ place) > 0.1)
    after, there = lever.moved(mass, place, more, way)
    straight = place @ place * (mass + more) + 2.0 * mass * place @ way
    assert after * there == pytest.approx(mass * (place + way) + more * place, rel=1e-9, abs=1e-12)
    assert after * there @ there == pytest.approx(straight, rel=1e-9)
    back = lever.way(mass, place, after, there)
    assert [back[0], *back[1]] == pytest.approx([more, *way], rel=1e-6, abs=1e-9)


def test_a_payload_is_moved_by_its_moments_within_its_prior() -> None:
    model = Model.from_toml(SLEDGE).with_effect("payload", "sledge", mass=1.0, x=0.5, y=0.0, z=0.0)
    names = [f"sledge.payload.{one}" for one in ("mass", "x", "z")]
    prior = Prior(0.0, 1.0, -np.inf, np.inf)
    structure = Structure(model, model.theta.copy(), dict.fromkeys(names, prior))
    assert structure.anywhere == []  # far away a mass is as hard to turn as a house
    move = np.array([-0.1, 0.1, 0.2])
    moved = structure.moved(move)
    mass, x, z = moved.values.values()
    assert [mass * x, mass * z] == pytest.approx([1.0 * 0.6 - 0.1 * 0.5, 0.2])
    assert mass * (x**2 + z**2) == pytest.approx(0.5**2 * 0.9 + 2.0 * 0.5 * 0.1)
    assert structure.way_to(moved) == pytest.approx(move)
    narrow = {**structure.priors, names[0]: replace(prior, low=0.5, high=0.95)}
    kept = replace(structure, priors=narrow).moved(move)
    assert kept.values[names[0]] == pytest.approx(0.9)


def test_a_wave_that_several_bands_show_begins_once() -> None:
    """They differ by half a wave on all of the way at least: over less than that a fit finds its way."""
    starts = [{"period": period} for period in (0.5, 0.1, 0.502, 0.0975, 0.05)]
    assert [one["period"] for one in _different_waves(starts, 1.5)] == [0.5, 0.1, 0.05]
    assert [one["period"] for one in _different_waves(starts, 4.0)] == [0.5, 0.1, 0.0975, 0.05]


def test_a_place_is_moved_as_it_is_where_nothing_pulls() -> None:
    model = Model.from_toml(SLEDGE).with_effect("spring", "way", stiffness=0.0, rest=0.1)
    names = ("way.spring.stiffness", "way.spring.rest")
    prior = Prior(0.0, 1.0, -np.inf, np.inf)
    structure = Structure(model, model.theta.copy(), dict.fromkeys(names, prior))
    assert not structure.levers
    assert list(structure.moved(np.array([3.0, 0.5])).values.values()) == pytest.approx([3.0, 0.6])


@pytest.mark.parametrize("band", [1.0, 10.0])
def test_a_machine_that_is_too_heavy_is_drawn_along_by_the_tracker_alone(band: float) -> None:
    model = Model.from_toml(SLEDGE).with_parameters({"sledge.mass": 1e9})
    tracked = TrackedRecords(model, records(), Settings())
    left, _ = tracked.follow(model, model.theta, Tracker(band))
    drawn = tracked.drawn(band)
    for part in tracked.parts[2::3]:  # by then the first rate, which an encoder does not tell, is forgotten
        assert drawn[part] == pytest.approx(left[part], abs=1e-4 * float(np.std(left[part])))


def test_an_effect_that_makes_another_one_needless_has_to_do_its_work() -> None:
    """One came in beside another, which went. The same number of effects as before leaves more, or it does not."""

    def look(effects: int, band: float, left: float) -> Any:
        fitted = SimpleNamespace(structure=SimpleNamespace(effects=(None,) * effects), tracker=Tracker(band), left=left)
        return SimpleNamespace(fitted=fitted, judged=lambda other: SimpleNamespace(least=1.0 - other.left / left))

    was = [look(2, 1.0, 1.0), look(2, 10.0, 1.0)]
    assert _is_worse([look(2, 10.0, 1.4)], was)
    assert not _is_worse([look(2, 10.0, 0.8)], was)
    assert not _is_worse([look(3, 10.0, 1.4)], was)


def test_of_effects_at_several_places_that_are_as_good_the_plainest_comes_first() -> None:
    """Belts that stretch: contacts without play leave a millionth less than springs, by six numbers more."""
    look: Any = SimpleNamespace(settings=Settings())

    def end(effect: str, numbers: int, left: float) -> Any:
        fitted: Any = SimpleNamespace(structure=SimpleNamespace(priors=dict.fromkeys(range(numbers))))
        return Trial((effect, "x"), fitted, look, Judgement(1.0 - left, 1.0 - left, 10.0, 0.2, 1.0, 1.0))

    soft, play, lag = end("joint_compliance", 12, 9e-6), end("backlash", 18, 8e-6), end("actuator_lag", 8, 1e-3)
    assert _plainest_first([lag, soft, play]) == [soft, play, lag]
    clearly = end("backlash", 18, 1e-6)
    coarse = end("joint_compliance", 12, 4e-3)
    assert _plainest_first([coarse, clearly]) == [clearly, coarse]


def test_values_that_only_scale_return_to_what_is_known_beside_a_false_derivative() -> None:
    """Motion tells ratios of gain, mass and friction alone; one derivative that leads nowhere must not keep the rest.

    All three begin at 1.3 times what fits, six deviations of the gain away, and friction at rest has a derivative that
    promises to take all of the error.
    """
    model = Model.from_toml(SLEDGE).with_effect("coulomb_friction", "way", coulomb=0.0)
    scaled = {"sledge.mass": 1.3 * MASS, "way.friction.viscous": 1.3 * OIL, "motor.gain": 1.3 * GAIN}
    theta = model.with_parameters(scaled).theta
    priors = {
        "sledge.mass": Prior(MASS, 0.1 * MASS, 0.1, np.inf),
        "way.friction.viscous": Prior(OIL, 0.1 * OIL, 0.0, np.inf),
        "motor.gain": Prior(GAIN, 0.05 * GAIN, 0.0, np.inf),
        "way.friction.coulomb": Prior(0.0, 1.0, -np.inf, np.inf),
    }
    fitter, tracker = fitter_of(model), Tracker(1.0, fine=False)
    start = fitter.followed(Structure(model, theta, priors), tracker, tuple(priors))
    false = start.jacobian.copy()
    false[:, :, -1] = -start.residual
    noise = fitter.noise_of(start.structure, tracker)
    fitted, _ = fitter.moved(replace(start, jacobian=false), View(noise))
    assert np.abs(fitted.structure.standard).max() < 1.0


@given(st.sampled_from([0.0, 0.5, 0.9, 0.98]), st.integers(1, 2), st.integers(0, 2**32 - 1))
def test_samples_count_too_often_by_how_long_their_errors_last(memory: float, channels: int, seed: int) -> None:
    """Of an autoregression of first order a constant is known (1 + a) / (1 - a) times less well than of white noise."""
    random, samples = np.random.default_rng(seed), 40000
    errors = lfilter([1.0], [1.0, -memory], random.standard_normal((channels, samples)), axis=1).ravel()
    slopes = 1e3 * np.column_stack([np.ones(samples), np.linspace(-1.0, 1.0, samples)])
    often = counted_too_often(errors, np.tile(slopes, (channels, 1)), channels, 200)
    assert often == pytest.approx((1.0 + memory) / (1.0 - memory), rel=0.5)


@given(st.integers(0, 2**32 - 1))
def test_parameters_that_only_show_together_count_as_one(seed: int) -> None:
    """Two columns that are one, far larger than what is known of them: their normal equations are singular."""
    random = np.random.default_rng(seed)
    errors, column = random.standard_normal(400), 1e12 * random.standard_normal((400, 1))
    alone = counted_too_often(errors, column, 1, 20)
    assert counted_too_often(errors, np.hstack([column, column]), 1, 20) == pytest.approx(alone, rel=1e-6)


def test_an_effect_on_both_sides_of_a_joint_goes_from_the_side_that_is_said() -> None:
    model = Model.from_toml(SLEDGE).with_effect("joint_compliance", "way", stiffness=1e4, inertia=1.0)
    key = ("coulomb_friction", "way")
    for side in ("link", "motor"):
        model = model.with_effect(*key, side=side, coulomb=1.0)
    structure = replace(structure_of(model), effects=(key, key))
    assert [one.side for one in structure.added] == ["link", "motor"]
    pairs: list[tuple[Side, Side]] = [("link", "motor"), ("motor", "link")]
    for gone, stays in pairs:
        left = structure.without(key, gone)
        assert (left.effects, [one.side for one in left.added]) == ((key,), [stays])
    assert structure.without(key).side(key) == "link"


@pytest.mark.parametrize("along", [0.0, 2e-3])
def test_the_moments_of_a_slender_body_move_together(along: float) -> None:
    """Records show one moment across; the other one differs from it by no more than the moment along the body."""
    across = "{ value = 0.035, uncertainty = 0.01 }"
    model = Model.from_toml(f"""
name = "shank"
gravity = [0.0, 0.0, 0.0]
bodies.shank = {{ mass = 3.0, inertia = [{across}, {across}, {along}, 0.0, 0.0, 0.0] }}
joints.knee = {{ type = "revolute", parent = "world", child = "shank", axis = [1, 0, 0] }}
""")
    names = ("shank.inertia.xx", "shank.inertia.yy")
    structure = Structure(model, model.theta.copy(), dict.fromkeys(names, Prior(0.035, 0.01, 0.0, np.inf)))
    goal, shown = 0.055, 1e4 * np.linspace(-1.0, 1.0, 50)
    for _ in range(3):
        slopes = np.column_stack([shown, np.zeros(50)]) * structure.slopes
        errors = shown * (structure.values[names[0]] - goal)
        structure = structure.moved(bounded_step(structure, errors, slopes, np.inf, variance=1.0))
    assert structure.values[names[0]] == pytest.approx(goal, rel=1e-4)
    assert structure.values[names[1]] == pytest.approx(goal - along, rel=1e-4)


def test_a_rod_has_room_for_moves_of_one_moment_at_a_time() -> None:
    """Its two free moments are equal, and a quotient by one of them alone asks for a body that cannot be."""
    moment = "{ value = 44.0, uncertainty = 5.0 }"
    text = two_links(
        f"mass = 1.0\ninertia = [0.0, {moment}, {moment}, 0.0, 0.0, 0.0]", "mass = 1.0", "[0.0, 0.0, -0.6]"
    )
    model = Model.from_toml(text)
    structure = structure_of(model)
    names = list(structure.priors)
    places, moves = [structure.place(name) for name in names], structure.moves(names)
    theta = structure.with_room(places, moves)
    assert theta == pytest.approx(structure.theta, abs=1e-3)
    for place, move in zip(places, moves, strict=True):
        stuck, moved = (dict(zip(model.parameter_names, one, strict=True)) for one in (structure.theta, theta))
        name = model.parameter_names[place]
        model.with_parameters({**moved, name: moved[name] + move})
        with pytest.raises(ModelError, match="cannot exceed the sum"):
            model.with_parameters({**stuck, name: stuck[name] + move})


def test_an_effect_is_as_large_as_in_the_channel_where_it_does_more_than_errors_of_laws() -> None:
    """Beside what a stiff spring does to a position nothing is large; another channel may show it all the same."""
    model = Model.from_toml(SLEDGE)
    several = []
    for record in records():
        speed = np.gradient(record["way.position"], record.dt)
        noise = 1e-3 * np.random.default_rng(5).standard_normal(len(record))
        several.append(record.with_channel("way.velocity", speed + noise, "m/s"))
    fitter = Fitter(TrackedRecords(model, several, Settings()), Settings())
    fitted = fitter.unfitted(structure_of(model), Tracker(1.0))
    look = Look(fitted, fitter)
    position = fitter.tracked.records[0].channels.index("way.position")
    look.explained = np.where(np.arange(2) == position, 1e8, 10.0)
    left = np.where(np.arange(2) == position, 0.3, 0.6)
    assert look.judged(replace(fitted, residual=left * fitted.residual)).size > 0.1


@pytest.mark.parametrize(
    ("added", "words"),
    [
        (0.03, "it adds 3 % to the error power"),
        (9.0, "it makes the error power more than 10 times as large"),
        (4.21e23, "it makes the error power more than 10 times as large"),
    ],
)
def test_errors_that_grow_beyond_measure_are_told_without_their_digits(added: float, words: str) -> None:
    told = Judgement(-added, -added, 0.0, 0.1, 0.1, 0.1)
    assert told.lacks(Settings()).startswith(words)


def test_harm_to_validation_records_is_told_the_same_way() -> None:
    told = Judgement(0.9, 0.9, 9.0, 0.1, 0.1, 0.1)
    assert replace(told, refuted=0.5).lacks(Settings()).endswith("but adds 50 % to that of validation records")
    assert (
        replace(told, refuted=1e9)
        .lacks(Settings())
        .endswith("makes that of validation records more than 10 times as large")
    )
