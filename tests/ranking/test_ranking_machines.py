"""Rankings of machines without a balance of efforts, and of logs that hold a deflection; witnesses by other code."""

from itertools import product

import numpy as np
import pytest

import vpm
from quotients import quotient
from sledge import POLE, SAMPLED, SLEDGE, STIFFNESS, pushed, wound
from slider_crank import OIL, SLIDER, SLIDER_CRANK, turned
from vpm.errors import DivergedError
from vpm.model import Model
from vpm.ranking.settings import Settings
from vpm.ranking.substitute_records import opened, shown
from vpm.ranking.tracked_records import TrackedRecords, Tracker


def test_friction_behind_a_drive_that_goes_by_its_own_samples_is_named() -> None:
    model = Model.from_toml(SAMPLED)
    ranking = vpm.rank(model, [pushed(seed=seed, dry=3.0, pole=POLE, duration=4.0) for seed in (1, 2)])
    assert [(one.effect, one.site) for one in ranking.effects] == [("coulomb_friction", "way")]
    assert ranking.effects[0].values["way.friction.coulomb"] == pytest.approx(3.0, rel=0.01)


def test_nothing_is_named_where_such_a_drive_is_right() -> None:
    model = Model.from_toml(SAMPLED)
    assert vpm.rank(model, [pushed(seed=seed, pole=POLE, duration=4.0) for seed in (1, 2)]).effects == ()


def test_a_deflection_that_a_model_lacks_is_left_as_it_was_read() -> None:
    model, record = Model.from_toml(SLEDGE), wound(1, logged=True)
    tracked = TrackedRecords(model, [record], Settings())
    assert tracked.records[0].channels[-1] == "way_deflection.position"
    residual, slopes = tracked.follow(model, model.theta, Tracker(1.0), [0])
    assert np.array_equal(residual[:, -1], record["way_deflection.position"])
    assert not slopes[:, -1].any()
    assert slopes[:, 0].any()
    soft = model.with_effect("joint_compliance", at="way", stiffness=STIFFNESS, damping=40.0, inertia=0.8)
    left, _ = tracked.follow(soft, soft.theta, Tracker(1.0))
    assert np.std(left[500:, -1]) < 0.5 * np.std(residual[500:, -1])


def test_a_stiff_spring_is_named_where_the_log_holds_its_deflection_and_only_there() -> None:
    model = Model.from_toml(SLEDGE)
    without, seen = (vpm.rank(model, [wound(s, logged=logged) for s in (1, 2)]) for logged in (False, True))
    assert without.effects == ()
    assert [(one.effect, one.site) for one in seen.effects] == [("joint_compliance", "way")]
    assert seen.effects[0].judgement.removed > 0.99


def test_records_of_which_one_lacks_the_deflection_are_compared_without() -> None:
    records = [wound(1, logged=True), wound(2, logged=False)]
    assert TrackedRecords(Model.from_toml(SLEDGE), records, Settings()).records[0].channels == ("way.position",)


def test_a_tracker_keeps_a_slider_crank_on_the_equation_of_another_hand() -> None:
    true = Model.from_toml(SLIDER_CRANK).with_parameters({"slider.mass": SLIDER, "crank.friction.viscous": OIL})
    for seed, band in product((1, 2), (1.0, 10.0)):
        tracked = TrackedRecords(true, [turned(seed=seed, channels=("guide.position",))], Settings())
        residual, _ = tracked.follow(true, true.theta, Tracker(band))
        # Of noise a tracker leaves no more than all, and less of the guide, which the crank moves along.
        assert np.all(np.std(residual[500:], axis=0) < np.array([1e-4, 1e-5]))


def test_derivatives_of_a_slider_crank_are_those_of_differences() -> None:
    model, record = Model.from_toml(SLIDER_CRANK), turned(seed=2, dry=2.0, duration=1.0)
    model = model.with_effect("coulomb_friction", at="guide", coulomb=1.5, transition_velocity=0.02)
    tracked = TrackedRecords(model, [record], Settings())
    columns = [model.index(name) for name in ("slider.mass", "crank.friction.viscous", "guide.friction.coulomb")]
    _, slopes = tracked.follow(model, model.theta, Tracker(1.0), columns)
    for place, column in enumerate(columns):
        step = 1e-6 * max(1.0, abs(model.theta[column]))
        followed = quotient(lambda theta: tracked.follow(model, theta, Tracker(1.0))[0], model.theta, column, step)
        exact, difference = slopes[:, 0, place], followed[:, 0]
        assert np.max(np.abs(exact - difference)) < 1e-5 * np.max(np.abs(difference))


def test_dry_friction_of_a_guide_is_named_from_the_encoder_of_the_crank() -> None:
    ranking = vpm.rank(
        Model.from_toml(SLIDER_CRANK), turned(seed=1, dry=2.0, duration=3.0), effects=["coulomb_friction"]
    )
    assert [(one.effect, one.site) for one in ranking.effects] == [("coulomb_friction", "guide")]


@pytest.mark.nightly
@pytest.mark.parametrize("channels", [(), ("guide.position",)])
def test_dry_friction_of_a_guide_in_a_loop_is_named_and_not_that_of_the_crank(channels: tuple[str, ...]) -> None:
    model = Model.from_toml(SLIDER_CRANK)
    effects = ["coulomb_friction", "viscous_friction", "spring", "bias_force", "rotor_inertia"]
    records = [turned(seed=seed, dry=2.0, channels=channels) for seed in (1, 2)]
    ranking = vpm.rank(model, records, effects=effects)
    assert [(one.effect, one.site) for one in ranking.effects] == [("coulomb_friction", "guide")]
    assert ranking.effects[0].values["guide.friction.coulomb"] == pytest.approx(2.0, rel=0.05)


@pytest.mark.nightly
def test_nothing_is_named_of_a_loop_without_friction_on_its_guide() -> None:
    assert vpm.rank(Model.from_toml(SLIDER_CRANK), [turned(seed=seed) for seed in (1, 2)]).effects == ()


def test_the_stand_in_of_a_loop_moves_as_the_loop_does_and_weighs_what_its_inertia_weighs() -> None:
    model, record = Model.from_toml(SLIDER_CRANK), turned(seed=1, channels=("guide.position",))
    alone = record.select(["motor.command", "crank.position"])
    data = shown(model, TrackedRecords(model, [alone], Settings()))
    assert data.joints == ("crank", "pin", "guide")
    assert not opened(model).loops
    position, _, acceleration = data.state(0)
    read = np.interp(data.motions[0].time[data.motions[0].retained], record.time, record["guide.position"])
    assert np.std(position[:, 2] - read) < 0.05 * np.std(read)
    applied, required = data.effort(model, model.theta, 0)[1:]
    assert not applied[:, 2].any()
    wanted = 1.05 * SLIDER * acceleration[:, 2]
    assert np.std(required[:, 2] - wanted) < 0.03 * np.std(wanted)


def test_the_record_is_named_in_which_a_loop_comes_into_a_flat_pose() -> None:
    model, time = Model.load("examples/loops/parallelogram.toml"), np.arange(1500) / 250.0
    swing = 0.5 * np.sin(3.0 * time)

    def record(name: str, middle: float) -> vpm.Experiment:
        channels = {"motor.command": swing, "left_crank.position": middle + swing}
        return vpm.Experiment.from_arrays(time, channels, model=model, name=name)

    with pytest.raises(DivergedError, match=r"^flat: the closed loops .* singular configuration"):
        vpm.rank(model, [record("upright", 1.0), record("flat", 0.3)], [record("other", 1.0)], workers=1)
