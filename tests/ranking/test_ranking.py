"""What is missing, ranked by evidence: the parts against closed forms, the whole on machines of elementary laws."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import norm
from scipy.stats import t as student

import vpm
from hopper import HOPPER, hopped
from model_texts import effect_text, on_rail
from sledge import DRY, MASS, OIL, READING, SEEN, SLEDGE, TURN, WAVE, pushed, swung
from vpm.errors import DiagnosisError, ExperimentError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.ranking.judgement import Judgement
from vpm.ranking.noise_model import Colour, NoiseModel, Structured, fitted_noise, log_student, scale_of, white_noise
from vpm.ranking.settings import DAMPING, PARTS, Settings
from vpm.ranking.tracked_records import TrackedRecords, Tracker, tracker_gains


def test_an_autoregression_is_found_again_and_its_density_is_the_exact_one() -> None:
    random, count, first, second, size = np.random.default_rng(1), 60_000, 1.6, -0.8, 0.3
    values = np.zeros(count)
    errors = size * random.standard_normal(count)
    for k in range(2, count):
        values[k] = first * values[k - 1] + second * values[k - 2] + errors[k]
    parts = [slice(100, 30_000), slice(30_500, count)]
    noise = fitted_noise(values[:, None], parts, 2)
    assert noise.filters[0] == pytest.approx([1.0, -first, -second], abs=0.01)
    assert noise.deviations[0] == pytest.approx(size, rel=0.01)
    told = noise.log_density(noise.whitened(values[:, None], parts))
    kept = np.concatenate([errors[part][2:] for part in parts])
    exact = np.sum(-0.5 * (kept / size) ** 2 - 0.5 * np.log(2.0 * np.pi * size**2))
    # The most likely values of k parameters are better than the true ones by k/2 nats in the mean.
    known = 2 + len(noise.colours[0].sizes)
    assert 0.0 <= np.sum(told) - exact < 0.5 * known + 3.0 * np.sqrt(0.5 * known)


def test_what_is_slow_beside_a_short_past_is_white_all_the_same() -> None:
    """What a tracker of 0.2 Hz leaves of a force that wanders, at 1 kHz, beside the noise of a fine encoder."""
    random, count = np.random.default_rng(6), 30_000
    pole = np.exp(2e-3 * np.pi * 0.2 * (-0.7 + 0.7j))
    slow = lfilter([1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], random.standard_normal(count))
    values = slow + 2e-3 * np.std(slow) * random.standard_normal(count)
    parts = [slice(0, 14_000), slice(15_000, count)]
    noise = fitted_noise(values[:, None], parts, 12)
    without = replace(noise, colours=(Colour(),))
    of_both, of_past = (_largest_correlation(one.whitened(values[:, None], parts)) for one in (noise, without))
    assert of_both < 0.03
    assert of_past > 0.2


@pytest.mark.parametrize("level", [0.0, 0.3, 5.0])
def test_what_stands_out_of_white_noise_is_the_slow_error_below_it(level: float) -> None:
    """An error that wanders, below noise of so many times its size, in two stretches that do not close."""
    random, count = np.random.default_rng(7), 40_000
    pole = np.exp(2e-3 * np.pi * 0.5 * (-0.7 + 0.7j))
    slow = lfilter([1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], random.standard_normal(count))
    slow /= np.std(slow)
    noise = level * random.standard_normal(count)
    parts = [slice(0, 18_000), slice(20_000, count)]
    told = Structured.of([(slow + noise)[part] for part in parts])
    left = np.concatenate([told.part_of((slow + noise)[part]) - slow[part] for part in parts])
    assert np.mean(left**2) < 0.005 + 0.04 * level**2
    assert told.noise == pytest.approx(level, rel=0.1, abs=0.01)


def test_of_white_noise_hardly_anything_stands_out() -> None:
    values = np.random.default_rng(8).standard_normal(20_000)
    assert np.std(Structured.of([values]).part_of(values)) < 0.15


@pytest.mark.parametrize("count", [300, 2000])
def test_noise_of_a_few_lines_is_not_taken_for_less_than_it_is(count: int) -> None:
    """Of 300 pieces of white noise none passes for what stands 1.3 times above the level that is told of it."""
    random = np.random.default_rng(1)
    told = [Structured.of([random.standard_normal(count) for _ in range(3)]).noise for _ in range(300)]
    assert min(told) > 1.0 / 1.3
    assert np.mean(told) < 1.07


@pytest.mark.parametrize("count", [60, 100])
def test_several_bands_bound_the_noise_of_a_short_record(count: int) -> None:
    """Of 300 pieces with 60 lines each band alone bounds the level at 1.3 times, all of them at 1.15 times."""
    random = np.random.default_rng(2)
    told = [Structured.of([random.standard_normal(count) for _ in range(3)]).noise for _ in range(300)]
    assert min(told) > 1.0 / 1.3
    assert np.mean(told) < 1.2


@pytest.mark.parametrize("band", [1.0, 10.0])
def test_noise_is_told_where_a_tracker_follows_what_is_slow_of_it(band: float) -> None:
    """It draws the model to slow noise, too, and leaves less of that."""
    record, level = pushed(seed=4), 2e-3
    shaken = level * np.random.default_rng(4).standard_normal(len(record.time))
    record = record.with_channel("way.position", record["way.position"] + shaken, "m")
    true = Model.from_toml(SLEDGE).with_parameters({"sledge.mass": MASS, "way.friction.viscous": OIL})
    tracked = TrackedRecords(true, [record], Settings())
    residual, _ = tracked.follow(true, true.theta, Tracker(band))
    left = np.std(np.concatenate([residual[part, 0] for part in tracked.parts]))
    (told,) = tracked.structured(residual, band, tracked.parts, true)
    assert told.noise == pytest.approx(left, rel=0.15)


def _largest_correlation(errors: Array) -> float:
    """Of errors with those 1 to 20 samples before."""
    powers = [float(np.mean(errors[lag:] * errors[: len(errors) - lag])) for lag in range(21)]
    return max(map(abs, powers[1:])) / powers[0]


def test_the_density_of_errors_is_students_of_scipy() -> None:
    errors = np.linspace(-6.0, 6.0, 50)
    for freedom in (3.0, 10.0):
        told = log_student(errors[None], np.array([[freedom]]))[0]
        assert told == pytest.approx(student.logpdf(errors, freedom), abs=1e-12)
    both = log_student(np.tile(errors, (2, 1)), np.array([[np.inf], [3.0]]))
    assert both == pytest.approx(np.array([norm.logpdf(errors), student.logpdf(errors, 3.0)]), abs=1e-12)


def test_errors_with_heavy_tails_are_known_as_such_and_outliers_weigh_little() -> None:
    errors = 0.02 * np.random.default_rng(3).standard_t(4.0, 20_000)
    noise = fitted_noise(errors[:, None], [slice(0, len(errors))], 2)
    assert noise.tails == (4.0,)
    assert noise.deviations[0] == pytest.approx(0.02, rel=0.03)
    assert scale_of(errors[None], np.array([[4.0]])) == pytest.approx(0.02, rel=0.03)
    heavy = NoiseModel((np.ones(1),), (Colour(),), (1.0,), (4.0,)).roots(np.array([0.1] * 20 + [20.0]))
    assert heavy[-1] < 0.3 * heavy[0]


def test_weights_give_the_slope_of_the_cost() -> None:
    """About any errors, at their own scale: the slope of the density is that of weighted squares."""
    errors = np.random.default_rng(4).standard_t(3.0, 400)
    errors /= scale_of(errors[None], np.array([[6.0]]))
    noise, move = NoiseModel((np.ones(1),), (Colour(),), (1.0,), (6.0,)), np.cos(np.arange(400.0))
    slope = (noise.cost(errors + 1e-5 * move) - noise.cost(errors - 1e-5 * move)) / 2e-5
    assert slope == pytest.approx(float((noise.roots(errors) ** 2 * errors) @ move), rel=1e-6)


def test_channels_are_whitened_each_by_its_own_past() -> None:
    random = np.random.default_rng(2)
    values = random.standard_normal((500, 2)) * [1.0, 1e-3]
    parts = [slice(0, 500)]
    errors = white_noise(values, parts).whitened(values, parts)
    assert np.mean(errors[:500] ** 2) == pytest.approx(1.0, rel=1e-12)
    assert np.mean(errors[500:] ** 2) == pytest.approx(1.0, rel=1e-12)
    slopes = random.standard_normal((500, 2, 3))
    noise = fitted_noise(values, parts, 5)
    direct = np.column_stack([noise.whitened(slopes[:, :, k], parts) for k in range(3)])
    assert noise.whitened(slopes, parts) == pytest.approx(direct, abs=1e-12)


@pytest.mark.parametrize("band", [0.5, 1.0, 10.0])
def test_the_error_of_a_tracker_dies_away_with_its_bandwidth(band: float) -> None:
    """Poles of a free mass under the gain, against ``w (-d +- i sqrt(1 - d^2))`` of continuous time."""
    model = Model.from_toml(SLEDGE)
    (gain,) = tracker_gains(model, ("way.position",), (band, band), (1, 1e-4), model.theta)
    free = np.array([[1.0, 1e-4], [0.0, 1.0]])
    poles = np.log(np.linalg.eigvals(free @ (np.eye(2) - gain @ [[1.0, 0.0]]))) / 1e-4
    wanted = 2.0 * np.pi * band * (-DAMPING + 1j * np.sqrt(1.0 - DAMPING**2))
    assert np.sort_complex(poles)[-1] == pytest.approx(wanted, rel=0.01)


def test_what_a_sensor_multiplies_leaves_the_bandwidth_as_it_is() -> None:
    """Else the best gain of a sensor would be the one that makes the tracker quick."""
    model = Model.from_toml(SEEN)
    plain = tracker_gains(model, ("way.position",), (2.0, 10.0), (500, 1e-3), model.theta)
    tripled = model.with_effect("sensor_gain", "encoder", value=3.0)
    gain = tracker_gains(tripled, ("way.position",), (2.0, 10.0), (500, 1e-3), tripled.theta)
    assert 3.0 * gain == pytest.approx(plain, rel=1e-12)


def test_nothing_is_missing_where_the_model_is_right() -> None:
    ranking = vpm.rank(Model.from_toml(SLEDGE), [pushed(seed=4, duration=4.0), pushed(seed=5, duration=4.0)])
    assert ranking.effects == ()
    assert not any(one.judgement.counts(Settings()) for one in ranking.rounds[0])
    assert ranking.model.parameters["sledge.mass"].value == pytest.approx(MASS, rel=4e-3)
    assert ranking.model.parameters["way.friction.viscous"].value == pytest.approx(OIL, rel=1e-2)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("hidden", "named", "parameter", "value"),
    [
        ({"dry": 2.0}, "coulomb_friction", "way.friction.coulomb", 2.0),
        ({"lag": 0.008}, "actuator_lag", "motor.lag.time_constant", 0.008),
        ({"late": 0.008}, "input_delay", "motor.delay.time", 0.008),
        ({"ends": 0.6}, "end_stop", "way.end_stop.high", 0.6),
    ],
)
def test_one_missing_effect_is_named(hidden: dict[str, float], named: str, parameter: str, value: float) -> None:
    ranking = vpm.rank(Model.from_toml(SLEDGE), [pushed(seed=1, **hidden), pushed(seed=2, **hidden)])
    found = [one.effect for one in ranking.effects]
    # One command and one position: a delay of the one is a delay of the other.
    if named == "input_delay" and found == ["sensor_delay"]:
        assert "input_delay at motor" in ranking.effects[0].rivals
        return
    assert found == [named]
    assert ranking.model.parameters[parameter].value == pytest.approx(value, rel=0.05)


def test_a_lag_of_the_drive_is_named_with_its_time() -> None:
    held_out = pushed(seed=2, lag=0.008, duration=4.0)
    ranking = vpm.rank(Model.from_toml(SLEDGE), pushed(seed=1, lag=0.008, duration=4.0), held_out)
    assert [(one.effect, one.site) for one in ranking.effects] == [("actuator_lag", "motor")]
    assert ranking.effects[0].probability > 0.9
    assert ranking.effects[0].rivals == ()
    gap = ranking.gaps["way.position"]
    assert gap.unit == "m"
    assert gap.before > gap.recalibrated > 20.0 * gap.after
    assert gap.after < 3.0 * READING
    assert ranking.model.parameters["motor.lag.time_constant"].value == pytest.approx(0.008, rel=0.02)


@pytest.mark.parametrize(
    ("hidden", "named", "parameter", "value"),
    [
        ({"uneven": 2.0}, "asymmetric_friction", "way.friction.coulomb_difference", 2.0),
        ({"wavy": 1.5}, "position_dependent_friction", "way.friction.position_period", WAVE),
    ],
)
def test_dry_friction_is_told_from_what_pushes_as_much(
    hidden: dict[str, float], named: str, parameter: str, value: float
) -> None:
    """A constant force does nearly the same, with a number less; a wave is longer than half of the way."""
    records = [pushed(seed=seed, dry=3.0, duration=4.0, **hidden) for seed in (1, 2)]
    ranking = vpm.rank(Model.from_toml(DRY), records)
    assert [one.effect for one in ranking.effects] == [named]
    assert ranking.model.parameters[parameter].value == pytest.approx(value, rel=0.05)


def test_a_motor_whose_constant_is_none_is_told_from_one_that_cogs() -> None:
    """A wave along the way that is as large as the command: cogging would push where nothing is commanded, too."""
    records = [pushed(seed=seed, winding=0.1, duration=4.0) for seed in (1, 2)]
    ranking = vpm.rank(Model.from_toml(SLEDGE), records)
    assert [one.effect for one in ranking.effects] == ["current_ripple"]
    assert ranking.model.parameters["way.current_ripple.period"].value == pytest.approx(TURN, rel=0.01)
    assert ranking.model.parameters["way.current_ripple.sine"].value == pytest.approx(0.1, rel=0.05)


@pytest.mark.nightly
def test_two_missing_effects_are_named_one_after_the_other() -> None:
    hidden = {"dry": 2.0, "lag": 0.008}
    ranking = vpm.rank(Model.from_toml(SLEDGE), [pushed(seed=1, **hidden), pushed(seed=2, **hidden)])
    assert {one.effect for one in ranking.effects} == {"coulomb_friction", "actuator_lag"}


def test_a_large_payload_hides_no_small_friction() -> None:
    """Mechanics alone gives its law: what is left beside it is none of its shape, however much it has removed."""
    light = Model.from_toml(SLEDGE.replace("{ value = 3.3, uncertainty = 0.33 }", "1.2"))
    effects = ["payload", "coulomb_friction", "spring", "actuator_lag", "bias_force"]
    ranking = vpm.rank(light, pushed(dry=0.4, seed=1, duration=4.0), effects=effects)
    assert [one.effect for one in ranking.effects] == ["payload", "coulomb_friction"]
    assert ranking.effects[0].values["sledge.payload.mass"] == pytest.approx(MASS - 1.2, rel=0.1)


@pytest.mark.nightly
def test_friction_of_a_guide_without_a_drive_is_named_above_a_leg_that_hops() -> None:
    """No effort is known there; height and the force of the ground tell it. At 1 Hz the leg falls over."""
    model, effects = Model.from_toml(HOPPER), ["coulomb_friction", "spring", "bias_force", "actuator_lag"]
    ranking = vpm.rank(model, hopped(seed=1, dry=6.0, duration=6.0), effects=effects)
    assert [(one.effect, one.site) for one in ranking.effects] == [("coulomb_friction", "guide")]
    assert ranking.effects[0].band == 10.0
    assert ranking.model.parameters["guide.friction.coulomb"].value == pytest.approx(6.0, rel=0.05)
    assert vpm.rank(model, hopped(seed=1, duration=6.0), effects=effects).effects == ()


def test_the_number_of_workers_changes_nothing_and_a_ranking_is_kept(tmp_path: Path) -> None:
    record = pushed(seed=3, lag=0.008, duration=2.0)
    one, two = (vpm.rank(Model.from_toml(SLEDGE), record, workers=workers) for workers in (1, 2))
    assert [[r.judgement.removed for r in several] for several in one.rounds] == [
        [r.judgement.removed for r in several] for several in two.rounds
    ]
    one.save(tmp_path / "ranking.npz")
    assert vpm.Ranking.load(tmp_path / "ranking.npz") == one


def test_a_search_may_be_limited_to_some_effects_and_ended_early() -> None:
    record = pushed(seed=1, lag=0.008, duration=2.0)
    some = vpm.rank(Model.from_toml(SLEDGE), record, effects=["coulomb_friction", "spring"])
    assert {one.effect for several in some.rounds for one in several} <= {"coulomb_friction", "spring"}
    done = 0

    def stopped(what: str, *_: object) -> None:
        nonlocal done
        done += what == "finishing"
        if done:
            raise KeyboardInterrupt

    ranking = vpm.rank(Model.from_toml(SLEDGE), record, progress=stopped, workers=1)
    assert ranking.interrupted
    assert ranking.effects == ()
    assert ranking.model.parameters["sledge.mass"].value == ranking.recalibrated.parameters["sledge.mass"].value


def test_no_effect_comes_in_that_makes_no_sample_more_probable() -> None:
    """Whatever error power it removes; it is listed with its evidence, and said to lack it."""
    record = pushed(seed=1, lag=0.008, duration=2.0)
    strict = Settings(odds=1e9)
    ranking = vpm.rank(Model.from_toml(SLEDGE), record, effects=["actuator_lag"], settings=strict)
    assert ranking.effects == ()
    (told,) = (one for one in ranking.rounds[0] if np.isfinite(one.evidence))
    assert told.judgement.counts(strict)
    assert 0.0 < told.evidence < strict.odds


def test_each_part_of_a_record_is_held_back_once() -> None:
    tracked = TrackedRecords(
        Model.from_toml(SLEDGE), [pushed(seed=1, duration=3.0), pushed(seed=2, duration=2.0)], Settings()
    )
    turns = [tracked, *(tracked.holding_back(part) for part in range(PARTS))]
    fitted = [np.concatenate([np.r_[part] for part in turn.parts]) for turn in turns]
    held = [np.concatenate([np.r_[part] for part in turn.held_back]) for turn in turns]
    for one, other in zip(fitted, held, strict=True):
        assert np.array_equal(np.sort(np.concatenate([one, other])), np.sort(np.concatenate([fitted[0], held[0]])))
        assert len(other) == pytest.approx(len(one) / (PARTS - 1), rel=0.02)
    assert np.array_equal(held[-1], held[0])
    assert np.array_equal(np.sort(np.concatenate(held[1:])), np.sort(np.concatenate([fitted[0], held[0]])))


def test_what_one_part_of_a_record_leaves_open_all_of_it_decides(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three parts are surer than one by the root of three; here as much is asked for as one alone does not have."""
    model, record, effects = Model.from_toml(SLEDGE), pushed(seed=2, dry=0.6, duration=4.0), ["coulomb_friction"]
    (alone,) = vpm.rank(model, record, effects=effects).effects
    strict = Settings(score=1.25 * alone.judgement.score, clear=1.0)
    (all_of_it,) = vpm.rank(model, record, effects=effects, settings=strict).effects
    assert all_of_it.judgement.score == pytest.approx(np.sqrt(PARTS) * alone.judgement.score, rel=0.2)
    stricter = replace(strict, score=4.0 * alone.judgement.score)
    assert vpm.rank(model, record, effects=effects, settings=stricter).effects == ()
    monkeypatch.setattr(Judgement, "is_faint", lambda *_: False)
    assert vpm.rank(model, record, effects=effects, settings=strict).effects == ()


def test_commands_that_were_read_and_not_sent_hide_no_effect() -> None:
    """Held for a sample they come half a sample late, which a spring in the drive takes back in part."""
    model, effects = Model.from_toml(SLEDGE), ["joint_compliance", "actuator_lag"]
    ranking = vpm.rank(model, swung(1), swung(2), effects=effects)
    assert ranking.effects == ()
    assert ranking.hold == "cubic"
    assert ranking.model.parameters["sledge.mass"].value == pytest.approx(MASS, rel=4e-3)
    stated = vpm.rank(model, swung(1), swung(2), effects=effects, setup=vpm.Setup(hold="zero_order"))
    assert stated.hold == "zero_order"
    assert stated.gaps["way.position"].before > 5.0 * ranking.gaps["way.position"].after
    assert vpm.rank(model, pushed(seed=1, duration=2.0), effects=[]).hold == "zero_order"


def test_a_fast_tracker_shows_that_commands_were_read_beside_a_slow_force() -> None:
    """The slow one leaves a hundred times more of the force, and none of the catalogue's effects is like it."""
    ranking = vpm.rank(Model.from_toml(SLEDGE), [swung(1, tide=3.0), swung(2, tide=3.0)], effects=["torque_ripple"])
    assert ranking.effects == ()
    assert ranking.hold == "cubic"


#: A rod without a mass to speak of, that a press moves through a damper.
ROD = on_rail("rod", "1e-3", joint="way", drive="press") + effect_text(
    "viscous_friction", "way", viscous="{ value = 1000.0, uncertainty = 10000.0, min = 0.0 }"
)


def test_dry_friction_is_seen_where_nothing_has_inertia() -> None:
    """Without its oil the rod flies off; that is no measure of what its effects do."""
    model, time = Model.from_toml(ROD), 5e-3 * np.arange(2400)
    place, speed = 0.02 * np.sin(2.0 * time), 0.04 * np.cos(2.0 * time)
    force = 2e4 * speed + 300.0 * np.tanh(speed / 2e-3)
    record = Experiment.from_arrays(time, {"press.command": force, "way.position": place}, model=model, name="press")
    ranking = vpm.rank(model, record, effects=["coulomb_friction"])
    assert [one.effect for one in ranking.effects] == ["coulomb_friction"]
    assert ranking.model.parameters["way.friction.coulomb"].value == pytest.approx(300.0, rel=0.05)
    assert ranking.model.parameters["way.friction.viscous"].value == pytest.approx(2e4, rel=0.02)


def test_what_a_validation_record_lacks_is_said_before_the_search() -> None:
    record = pushed(seed=1, duration=2.0)
    places = {"way.position": record["way.position"]}
    lacking = Experiment.from_arrays(record.time, places, model=Model.from_toml(SLEDGE), name="lacking")
    told: list[str] = []
    with pytest.raises(ExperimentError, match=r"motor\.command"):
        vpm.rank(Model.from_toml(SLEDGE), record, lacking, tell=told.append)
    assert told == []


def test_a_ranking_without_a_record_says_so() -> None:
    with pytest.raises(DiagnosisError, match="no record was given"):
        vpm.rank(Model.from_toml(SLEDGE), [])
