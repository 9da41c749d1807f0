"""Fits of a ranking: what is known while it searches, effects that fade, sides, steps, the price of one more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from sledge import MASS, OIL, SLEDGE, pushed
from vpm.catalogue import EFFECTS
from vpm.discrepancy.candidates import candidates
from vpm.discrepancy.side_by_side import SideBySide
from vpm.experiment import Experiment
from vpm.identify import InverseDynamicsProblem
from vpm.initial import invertible
from vpm.model import Model
from vpm.ranking.fit import Fitted, Fitter, View
from vpm.ranking.observed import Observed, Observer
from vpm.ranking.proposals import proposals
from vpm.ranking.rank import _Search
from vpm.ranking.result import Ranked
from vpm.ranking.settings import Settings
from vpm.ranking.sizes import Sizes
from vpm.ranking.starts import started
from vpm.ranking.structure import Structure
from vpm.weighing import Prior

#: The sledge with an encoder, which may show too much.
SEEN = (
    SLEDGE
    + """
[sensors.encoder]
measures = "way.position"
"""
)

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


@lru_cache
def records() -> list[Experiment]:
    return [pushed(seed=1, duration=4.0), pushed(seed=2, duration=4.0)]


def fitter_of(model: Model) -> Fitter:
    return Fitter(Observed(model, records(), Settings()), Settings())


def structure_of(model: Model) -> Structure:
    known = {
        p.name: Prior(p.value, p.uncertainty, p.minimum, p.maximum) for p in model.parameters.values() if p.uncertainty
    }
    return Structure(model, model.theta.copy(), known)


@pytest.mark.parametrize("effect", ["coulomb_friction", "spring", "quadratic_drag", "hysteresis", "bias_force"])
def test_derivatives_by_what_is_known_stay_where_an_effect_does_nothing(effect: str) -> None:
    model = Model.from_toml(SLEDGE)
    shapes = {"hysteresis": {"displacement": 0.05}, "spring": {"rest": 0.1}}
    fitter, observer = fitter_of(model), Observer(1.0)
    without = structure_of(model)
    beside = without.carried(model.with_effect(effect, "way", **shapes.get(effect, {})))
    plain, more = fitter.followed(without, observer), fitter.followed(beside, observer)
    scale = np.abs(plain.jacobian).max(axis=(0, 1))
    assert np.abs(more.residual - plain.residual).max() < 1e-12
    np.testing.assert_allclose(more.jacobian / scale, plain.jacobian / scale, atol=1e-9)


def test_many_equal_steps_come_to_what_steps_of_controlled_error_say() -> None:
    model = Model.from_toml(SLEDGE).with_effect("end_stop", "way", low=-0.5, high=0.5, stiffness=4e4, damping=0.01)
    structure, fitter = structure_of(model), fitter_of(Model.from_toml(SLEDGE))
    exact = fitter.followed(structure, Observer(1.0, 1, controlled=True), ()).residual
    off = [np.abs(fitter.followed(structure, Observer(1.0, steps), ()).residual - exact).max() for steps in (1, 4, 16)]
    assert off[0] > 4.0 * off[1] > 16.0 * off[2]


def test_an_effect_that_parameters_can_do_is_walked_back_to_them() -> None:
    model = Model.from_toml(SEEN).with_effect("sensor_gain", "encoder", value=1.25)
    gain = "encoder.gain.value"
    assert gain in model.parameter_names
    # What the encoder shows a quarter too large moves as a sledge that is a quarter heavier.
    heavy = model.with_parameters({"sledge.mass": 1.25 * MASS, "way.friction.viscous": 1.25 * OIL})
    structure = replace(
        structure_of(heavy),
        priors={
            "sledge.mass": Prior(3.3, 1.0, 0.1, 100.0),
            "way.friction.viscous": Prior(7.0, 3.0, 0.0, 100.0),
            gain: Prior(1.0, 0.2, 0.1, 10.0),
        },
        effects=(("sensor_gain", "encoder"),),
    )
    fitter = fitter_of(Model.from_toml(SEEN))
    found = fitter.fitted(structure, Observer(1.0))
    rest = fitter.without(found, ("sensor_gain", "encoder"))
    assert rest.structure.effects == ()
    assert rest.structure.values["sledge.mass"] == pytest.approx(MASS, rel=2e-3)
    assert rest.structure.values["way.friction.viscous"] == pytest.approx(OIL, rel=5e-3)
    faded = fitter._faded(found, ("sledge.mass", "way.friction.viscous"))
    assert faded.values[gain] == pytest.approx(1.0)
    assert faded.values["sledge.mass"] == pytest.approx(MASS, rel=2e-2)


def test_friction_goes_to_the_other_side_of_a_backlash_and_back() -> None:
    model = Model.from_toml(SLEDGE).with_effect("backlash", "way", gap=1e-3, stiffness=1e5, inertia=0.3)
    structure = structure_of(model)
    there = structure.beside("way", "link")
    assert "way.link.friction.viscous" in there.priors
    assert there.values["way.link.friction.viscous"] == structure.values["way.friction.viscous"]
    assert (structure.side(("viscous_friction", "way")), there.side(("viscous_friction", "way"))) == ("motor", "link")
    assert Ranked("viscous_friction", "way", 9.0, {}, side="link").place == "way, link side"
    back = there.beside("way", "motor")
    assert back.model == structure.model
    assert back.values == structure.values
    assert structure.model.joint_behind("way") == "way_deflection"
    assert Model.from_toml(SLEDGE).joint_behind("way") is None


def test_another_effect_pays_for_what_laws_leave() -> None:
    model = Model.from_toml(SLEDGE)
    search = _Search(model, records(), Settings(), None, SideBySide(1, None), lambda _: None)
    found = search.fitter.fitted(search.start, Observer(1.0))
    search.bare = found.log_likelihood
    spring, drag = ("spring", "way"), ("quadratic_drag", "way")
    assert search._price(found, spring) == Settings().odds
    samples = sum(part.stop - part.start for part in search.fitter.observed.parts)
    nats = 0.05 * samples
    explained = replace(found, log_likelihood=found.log_likelihood + nats)
    # Little beside the noise: its share of the likelihood itself.
    anywhere = pytest.approx(Settings().odds + 0.05**2 * nats, rel=0.06)
    assert search._price(explained, spring) == anywhere
    # Drag and dry friction are two shapes of one curve over speed; a spring or another joint has another curve.
    search.effects.append(Ranked("coulomb_friction", "way", nats, {}))
    assert search._price(explained, drag) == pytest.approx(Settings().odds + 0.3**2 * nats, rel=0.06)
    assert search._price(explained, spring) == anywhere
    assert search._price(explained, ("quadratic_drag", "elbow")) == anywhere


def test_effects_that_cannot_come_as_far_as_the_best_are_not_refined(monkeypatch: pytest.MonkeyPatch) -> None:
    search = _Search(Model.from_toml(SLEDGE), records(), Settings(), None, SideBySide(1, None), lambda _: None)
    found = search.fitter.fitted(search.start, Observer(1.0))
    asked: list[list[float]] = []

    def better(fits: Sequence[Fitted]) -> list[Fitted]:
        asked.append([one.evidence for one in fits])
        return [replace(one, evidence=one.evidence + 50.0) for one in fits]

    monkeypatch.setattr(search, "_each_refined", better)
    first, second, third = (
        [replace(found, evidence=nats) for nats in several] for several in ((1000.0, 900.0), (1001.0, 999.0), (20.0,))
    )
    ends = search._refined([first, second, third])
    assert asked == [[1000.0, 900.0], [1001.0]]
    assert [one.evidence for one in ends] == [1050.0, 950.0, 1051.0]
    assert search._refined([]) == []


def test_effects_that_a_diagnosis_does_not_try_are_candidates_where_they_are_asked_for() -> None:
    model = Model.from_toml(SLEDGE)
    data = InverseDynamicsProblem(model, records()[:1])
    residual = data.evaluate(model, model.theta)[0]
    named = {one.effect.name for one in candidates(model, data, residual, tuple(EFFECTS))}
    usual = {one.effect.name for one in candidates(model, data, residual)}
    assert named > usual
    assert {"quadratic_drag", "cubic_spring", "warming_friction", "load_dependent_friction"} <= named - usual


def test_a_view_prefers_derivatives_that_are_there() -> None:
    model = Model.from_toml(SLEDGE)
    fitter, structure = fitter_of(model), structure_of(model)
    found = fitter.fitted(structure, Observer(1.0))
    followed, parts = fitter.followed(found.structure, Observer(1.0)), fitter.observed.parts
    known = dict(zip(followed.names, found.noise.whitened(followed.jacobian, parts).T, strict=True))
    bare = replace(followed, names=(), jacobian=followed.jacobian[:, :, :0])
    for one, other in zip(
        View(found.noise, known).errors(bare, parts), View(found.noise, {}).errors(followed, parts), strict=True
    ):
        np.testing.assert_allclose(one, other)


#: A pendulum that hangs on the sledge and that nobody measures.
HANGING = (
    SLEDGE.replace("[0, 0, 0]", "[0, 0, -9.81]")
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
        found = fitter.fitted(structure_of(Model.from_toml(SLEDGE)).carried(model), Observer(1.0))
        rest, plain = (
            observed._begun(one)[0] for one, observed in ((model, fitter.observed), (bare, fitter_of(bare).observed))
        )
        assert rest[: len(plain)] == pytest.approx(plain)
        assert rest[len(plain) :] == pytest.approx(0.0)
    data = InverseDynamicsProblem(Model.from_toml(SLEDGE), records())
    settings = replace(Settings(), seats=1, starts=1)
    listed = proposals(found, Fitter(fitter.observed, settings), data, Sizes(bare, data), SideBySide(1))
    assert all(proposal.structure.model.effect("hysteresis", "way", "link") for proposal in listed)


def test_a_split_joint_has_inverse_dynamics_without_what_remembers() -> None:
    model = Model.from_toml(SLEDGE).with_effect("hysteresis", "way", force=1.0, displacement=0.05)
    assert invertible(model, ["way"]) is model
    friction = structure_of(model).beside("way", "link").model.with_effect("joint_compliance", "way", stiffness=1e5)
    warm = friction.with_effect("warming_friction", "way", coulomb=1.0, time_constant=5.0)
    assert [effect.name for effect in invertible(warm, ["way"]).effects] == ["viscous_friction", "joint_compliance"]
    data = InverseDynamicsProblem(Model.from_toml(SLEDGE), records())
    assert np.isfinite(data.evaluate(invertible(warm, ["way"]), invertible(warm, ["way"]).theta)[0]).all()


def test_a_fit_stays_where_bodies_are_real() -> None:
    """No body has more inertia about an axis than about the two others together, whatever records ask for."""
    model = Model.from_toml(FLAT)
    time = 2e-3 * np.arange(1500)
    # A free inertia of 0.3 kg m^2 turns so under a torque of 2 cos 9t.
    angle = 2.0 / 0.3 * (1.0 - np.cos(9.0 * time)) / 81.0
    channels = {"motor.command": 2.0 * np.cos(9.0 * time), "hinge.position": angle}
    record = Experiment.from_arrays(time, channels, model=model, name="swing")
    fitter = Fitter(Observed(model, [record], Settings()), Settings())
    known = {"arm.inertia.zz": Prior(0.15, 0.1, 0.0, np.inf)}
    found = fitter.fitted(Structure(model, model.theta.copy(), known), Observer(2.0))
    assert 0.17 < found.structure.values["arm.inertia.zz"] <= 0.2
