"""Identification against known truth: values, intervals that cover, and what cannot be seen."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vpm
from quotients import of_residual
from synthetic import Truth, nominal, simulate_axis
from vpm import Model
from vpm.errors import IdentificationError
from vpm.experiment import Experiment
from vpm.identify import (
    InverseDynamicsProblem,
    OutputErrorProblem,
    gain,
    identify,
    problem,
    robust_covariance,
    unseen_combinations,
)
from vpm.identify.identifiability import Span
from vpm.identify.statistics import correlation_length
from vpm.simulate import Setup

TRUTH = Truth(mass=21.3, viscous=71.0)
CLEAN = replace(TRUTH, noise=0.0)

RIG = Path(__file__).parents[2] / "examples/servo_cylinder/rig.toml"
COLUMNS = {
    "time": {"column": "t", "unit": "s"},
    "axis.position": {"column": "x_mm", "unit": "mm"},
    "servo.command": {"column": "i_mA", "unit": "mA"},
    "servo.pressure_a": {"column": "pa_bar", "unit": "bar"},
    "servo.pressure_b": {"column": "pb_bar", "unit": "bar"},
}


@pytest.fixture(scope="module")
def record() -> Experiment:
    return simulate_axis(TRUTH, 1, 10.0, first_seed=3)[0]


def test_inverse_dynamics_recovers_mass_and_friction(record: Experiment) -> None:
    fit = identify(nominal(), record)
    assert fit["slide.mass"] == pytest.approx(21.3, rel=5e-3)
    assert fit["axis.friction.viscous"] == pytest.approx(71.0, rel=1e-2)
    assert not fit.unidentifiable
    assert not fit.at_bounds


@pytest.mark.parametrize("mode", ["closed_loop", "restarts"])
def test_output_error_recovers_them_too(record: Experiment, mode: str) -> None:
    fit = identify(nominal(), record, mode=mode, setup=Setup(substeps=2, horizon=0.5))
    assert fit["slide.mass"] == pytest.approx(21.3, rel=2e-2)
    assert fit["axis.friction.viscous"] == pytest.approx(71.0, rel=2e-2)


def test_free_run_recovers_friction() -> None:
    """Friction and gain of an integrating axis by free run on a noise-free record."""
    (record,) = simulate_axis(CLEAN, 1, 4.0, first_seed=3)
    fit = identify(nominal(), record, mode="free_run", setup=Setup(substeps=4))
    assert fit["axis.friction.viscous"] == pytest.approx(71.0, rel=2e-2)


def test_several_experiments_in_one_fit_are_better_than_one() -> None:
    records = simulate_axis(TRUTH, 4, 8.0, first_seed=20)
    one, all_four = identify(nominal(), records[0]), identify(nominal(), records)
    assert np.all(all_four.std < one.std)
    assert all_four.experiments == tuple(r.name for r in records)


@pytest.mark.nightly
def test_intervals_cover_the_truth() -> None:
    """Ninety-five percent intervals over forty noise seeds: binomial chance of fewer than 32 hits is below 1e-3."""
    noisy = replace(TRUTH, force_noise=3.0)
    hits = np.zeros(2)
    for record in simulate_axis(noisy, 40, 8.0, first_seed=300):
        low, high = identify(nominal(), record).intervals.T
        truth = np.array([21.3, 71.0])
        hits += (low <= truth) & (truth <= high)
    assert np.all(hits >= 32), hits


def test_a_model_is_unchanged_by_its_own_fit(record: Experiment) -> None:
    first = identify(nominal(), record)
    second = identify(first.model, record)
    np.testing.assert_allclose(second.values, first.values, rtol=1e-8)


def test_fit_reports_what_the_data_cannot_see(record: Experiment) -> None:
    """A payload at the origin of the body is the same number as the body's mass."""
    model = nominal().with_effect("payload", at="slide")
    fit = identify(model, record, free=["slide.mass", "slide.payload.mass", "axis.friction.viscous"])
    (combination,) = fit.unidentifiable
    assert set(combination.names) == {"slide.mass", "slide.payload.mass"}
    assert np.isinf(fit.std[:2]).all()
    assert np.isfinite(fit.std[2])


def test_parameter_without_influence_keeps_its_value(record: Experiment) -> None:
    fit = identify(nominal(), record, free=["slide.mass", "slide.inertia.xx"])
    assert fit["slide.inertia.xx"] == nominal().parameters["slide.inertia.xx"].value
    assert fit.unidentifiable[0].names == ("slide.inertia.xx",)


def test_estimate_on_a_bound_is_reported() -> None:
    (record,) = simulate_axis(Truth(mass=20.0, viscous=0.0, bias=3.0), 1, 6.0, first_seed=2)
    model = nominal().with_effect("coulomb_friction", at="axis").without_effect("viscous_friction", "axis")
    fit = identify(model, record, free=["slide.mass", "axis.friction.coulomb"])
    if fit["axis.friction.coulomb"] == 0.0:
        assert fit.at_bounds == ("axis.friction.coulomb",)
    else:
        assert abs(fit["axis.friction.coulomb"]) < 0.3


def test_fit_saves_and_loads(record: Experiment, tmp_path: Path) -> None:
    fit = identify(nominal(), record)
    assert type(fit).load(fit.save(tmp_path / "fit.npz")) == fit


@pytest.mark.parametrize("mode", ["inverse_dynamics", "restarts", "closed_loop"])
def test_problem_jacobian_matches_differences(record: Experiment, mode: str) -> None:
    model = nominal().with_effect("coulomb_friction", at="axis", coulomb=4.0, transition_velocity=0.02)
    short = record.trim(1.0, 4.0)
    data = problem(model, [short], mode, setup=Setup(substeps=2))
    names = ["slide.mass", "axis.friction.viscous", "axis.friction.coulomb", "axis.friction.transition_velocity"]
    columns = [model.index(name) for name in names]
    _, jacobian = data.evaluate(model, model.theta, columns)
    for place, column in enumerate(columns):
        difference = of_residual(data, model, column, 1e-5 * model.theta[column])
        np.testing.assert_allclose(
            jacobian[:, place], difference, rtol=1e-4, atol=1e-5 * np.abs(difference).max(), err_msg=names[place]
        )


def test_blocks_cover_the_residual_once(record: Experiment) -> None:
    model = nominal()
    for data in (InverseDynamicsProblem(model, [record, record]), OutputErrorProblem(model, [record], "closed_loop")):
        residual, _ = data.evaluate(model, model.theta)
        covered = np.concatenate([np.arange(residual.size)[b.samples] for b in data.blocks])
        np.testing.assert_array_equal(np.sort(covered), np.arange(residual.size))
        assert all(b.time.size == b.samples.stop - b.samples.start for b in data.blocks)


def moves_and_rests() -> Experiment:
    """Minimum-jerk moves to and fro, with rests in which friction of 10 N holds a load of 5 N; mass 21, viscous 66."""
    dt, count = 0.002, 750
    x = np.arange(count) / count
    reach, slope, bend = x**3 * (10 - 15 * x + 6 * x**2), 30 * (x * (1 - x)) ** 2, 60 * x * (1 - x) * (1 - 2 * x)
    position, force, here = [], [], 0.0
    for step in (0.1, -0.16, 0.13, -0.07, 0.2, -0.2):
        v, a = step * slope / (count * dt), step * bend / (count * dt) ** 2
        position += [here + step * reach, np.full(300, here + step)]
        force += [21.0 * a + 66.0 * v + 10.0 * np.sign(v), np.full(300, 5.0)]
        here += step
    channels = {"axis.position": np.concatenate(position), "drive.command": np.concatenate(force) / 10.0}
    time = dt * np.arange(channels["axis.position"].size)
    return Experiment.from_arrays(time, channels, units={"axis.position": "m", "drive.command": "V"}, name="rests")


def test_standstill_does_not_count() -> None:
    """Friction at rest holds any load up to its size; counted, the rests would be a gap of a sixth of the effort."""
    model = nominal().with_effect("coulomb_friction", at="axis", coulomb=8.0, transition_velocity=1e-4)
    record = moves_and_rests()
    assert InverseDynamicsProblem(model, [record], cutoff=20.0).standstill(0) == pytest.approx(0.3, abs=0.06)
    fit = identify(model, record, cutoff=20.0)
    np.testing.assert_allclose(fit.values, [21.0, 66.0, 10.0], rtol=0.02)
    assert fit.after["axis.effort"][1] < 0.01


def test_a_machine_that_mostly_stands_is_compared_all_the_same() -> None:
    time = 0.002 * np.arange(3000)
    position = 0.05 * np.clip(time - 5.0, 0.0, 0.5)
    channels = {"axis.position": position, "drive.command": np.full(time.size, 0.3)}
    log = Experiment.from_arrays(time, channels, units={"axis.position": "m", "drive.command": "V"}, name="still")
    assert InverseDynamicsProblem(nominal(), [log], cutoff=20.0).standstill(0) == 0.0


def test_nothing_free_is_an_error(record: Experiment) -> None:
    known = nominal()
    with pytest.raises(IdentificationError, match="no parameter is free"):
        identify(known, record, free=[])


def test_unknown_mode_is_an_error(record: Experiment) -> None:
    with pytest.raises(IdentificationError, match="unknown mode 'forward'"):
        identify(nominal(), record, mode="forward")


@given(seed=st.integers(0, 1000), rows=st.integers(200, 400))
@settings(max_examples=20, deadline=None)
def test_robust_covariance_is_the_usual_one_for_white_residuals(seed: int, rows: int) -> None:
    generator = np.random.default_rng(seed)
    jacobian = generator.standard_normal((20 * rows, 2))
    residual = generator.standard_normal(20 * rows)
    usual = np.linalg.inv(jacobian.T @ jacobian)
    robust = robust_covariance(jacobian, residual, [slice(0, 20 * rows)])
    np.testing.assert_allclose(np.diag(robust), np.diag(usual), rtol=0.25)


def test_robust_covariance_grows_with_correlation() -> None:
    """Mean of an AR(1) sequence: its variance is (1 + a)/(1 - a) times that of white noise (Priestley, 1981)."""
    generator = np.random.default_rng(1)
    a, n = 0.9, 200_000
    noise = generator.standard_normal(n)
    residual = np.empty(n)
    residual[0] = noise[0]
    for k in range(1, n):
        residual[k] = a * residual[k - 1] + noise[k]
    robust = robust_covariance(np.ones((n, 1)), residual, [slice(0, n)])[0, 0]
    expected = residual.var() / n * (1.0 + a) / (1.0 - a)
    assert robust == pytest.approx(expected, rel=0.25)


def test_correlation_length_of_a_sine_is_its_quarter_period() -> None:
    residual = np.cos(2.0 * np.pi * np.arange(4000) / 400.0)
    assert 80 <= correlation_length(residual) <= 110


@given(scale=st.floats(1e-6, 1e6))
@settings(max_examples=30, deadline=None)
def test_unseen_combinations_do_not_depend_on_units(scale: float) -> None:
    generator = np.random.default_rng(4)
    x = generator.standard_normal((100, 2))
    jacobian = np.column_stack([x[:, 0], x[:, 0] * scale, x[:, 1]])
    (combination,) = unseen_combinations(jacobian, ["a", "b", "c"])
    weights = dict(zip(combination.names, combination.weights, strict=True))
    assert set(weights) == {"a", "b"}
    assert weights["a"] + scale * weights["b"] == pytest.approx(0.0, abs=1e-9 * abs(weights["a"]))


def test_share_of_a_span_is_the_squared_cosine() -> None:
    x = np.array([1.0, 0.0, 0.0])
    y = np.array([[1.0], [1.0], [0.0]])
    assert Span.of(y).share(x) == pytest.approx(0.5)


@given(st.integers(0, 6), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_a_step_beside_a_span_is_the_step_in_all_columns(known: int, new: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((60, known + new)) * 10.0 ** rng.uniform(-6.0, 6.0, known + new)
    columns[:, : known // 2] = columns[:, known - known // 2 : known] * 3.0  # copies of others
    residual = rng.standard_normal(60)
    lengths = np.linalg.norm(columns, axis=0)
    whole = np.linalg.lstsq(columns / lengths, residual, rcond=1e-10)[0] / lengths
    span = Span.of(columns[:, :known])
    alone = np.linalg.lstsq(span.rest(columns[:, known:] / lengths[known:]), span.rest(residual), rcond=None)[0]
    np.testing.assert_allclose(alone, (whole * lengths)[known:], atol=1e-9 * float(np.linalg.norm(residual)))
    assert span.basis.shape[1] == known - known // 2
    assert span.beside(columns).basis.shape[1] == known - known // 2 + new


def test_gain_of_a_smaller_residual_is_significant_and_of_noise_is_not() -> None:
    generator = np.random.default_rng(9)
    before = generator.standard_normal(5000)
    better = gain(before, 0.5 * before, [slice(0, 5000)])
    assert better.relative == pytest.approx(0.75)
    assert better.score > 10.0
    other = gain(before, before + 0.3 * generator.standard_normal(5000), [slice(0, 5000)])
    assert abs(other.score) < 4.0
    assert other.relative < 0.0
    assert other.harm > 5.0  # larger without doubt
    assert better.harm < -5.0
    shift = 0.02 * generator.standard_normal(5000)
    assert abs(gain(before, before + shift, [slice(0, 5000)]).harm) < 2.0  # by chance


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_simulation_that_has_run_away_is_no_gain() -> None:
    """Numbers whose squares overflow are finite all the same, and have to be told from an error."""
    before = np.random.default_rng(0).standard_normal(400)
    away = np.where(np.arange(400) < 300, before, 1e200)
    told = gain(before, away, [slice(0, 400)])
    assert told.relative == -np.inf
    assert told.harm == np.inf


def test_a_cylinder_is_fitted_beside_its_columns(tmp_path: Path) -> None:
    """Both pressures tell the force, so the friction of the slide comes back from its own run."""
    rig = Model.from_dict({**Model.load(RIG).to_dict(), "channels": COLUMNS})
    time = 5e-4 * np.arange(3000)
    current = 2e-3 * np.cos(2.0 * np.pi * 3.0 * time)
    run = vpm.simulate(rig, vpm.Experiment.from_arrays(time, {"servo.command": current}), integrator="rosenbrock")
    shown = [run[name] for name in ("axis.position", "servo.pressure_a", "servo.pressure_b")]
    rows = np.column_stack([time, 1e3 * shown[0], 1e3 * current, 1e-5 * shown[1], 1e-5 * shown[2]])
    path = tmp_path / "log.csv"
    np.savetxt(path, rows, delimiter=",", header="t,x_mm,i_mA,pa_bar,pb_bar", comments="", fmt="%.9g")

    start = rig.with_parameters({"axis.friction.viscous": 500.0})
    fit = vpm.identify(start, vpm.Experiment.load(path, model=start), free=["axis.friction.viscous"])
    assert fit["axis.friction.viscous"] == pytest.approx(700.0, rel=0.01)
