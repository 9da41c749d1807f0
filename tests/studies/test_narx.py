"""NARX models: runs against a plain recursion, selection of terms, what records cannot tell, residual tests, files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from vpm import narx
from vpm.errors import DivergedError, IdentificationError, SimulationError
from vpm.experiment import Experiment
from vpm.narx import MaxwellNarx, Narx, NarxRun, identify, split_in_time, validate
from vpm.numbers import Array

Term = tuple[tuple[int, int], ...]

# y[k] = 0.5 y[k-1] + u[k-2] + 0.1 u[k-2]^2 + 0.05 y[k-1] u[k-2]
TRUTH: dict[Term, float] = {((0, 1),): 0.5, ((1, 2),): 1.0, ((1, 2), (1, 2)): 0.1, ((0, 1), (1, 2)): 0.05}


def quadratic() -> Narx:
    return Narx.from_terms("y", ["u"], list(TRUTH), list(TRUTH.values()))


def noisy(seed: int, length: int = 600, noise: float = 1e-3) -> dict[str, ArrayLike]:
    random = np.random.default_rng(seed)
    u = random.uniform(-1.0, 1.0, length)
    run = quadratic().simulate_free_run({"y": np.zeros(length), "u": u})
    return {"y": run.values + noise * random.standard_normal(length), "u": u}


def plain(terms: list[Term], theta: Array, start: Array, inputs: Array, past: Array | None = None) -> Array:
    """The difference equation as it is written; `past` instead of its own outputs if given."""
    lag = max((delay for term in terms for _, delay in term), default=0)
    y = np.array(start)
    for k in range(lag, y.size):
        source = y if past is None else past
        factors = [[(source if s == 0 else inputs[:, s - 1])[k - d] for s, d in term] for term in terms]
        y[k] = sum(value * np.prod(one) for value, one in zip(theta, factors, strict=True))
    return y


@st.composite
def models(draw: st.DrawFn) -> tuple[list[Term], Array, int]:
    inputs = draw(st.integers(0, 3))
    lag = draw(st.sampled_from([1, 3, 7, 90]))  # the last needs a window beyond that of the fast path
    factor = st.one_of(
        st.tuples(st.just(0), st.integers(1, lag)),
        *([st.tuples(st.integers(1, inputs), st.integers(0, lag))] if inputs else []),
    )
    term = st.lists(factor, max_size=6).map(lambda factors: tuple(sorted(factors)))
    terms = draw(st.lists(term, min_size=1, max_size=25, unique=True))
    theta = np.array(draw(st.lists(st.floats(-1.0, 1.0), min_size=len(terms), max_size=len(terms))))
    return terms, theta / len(terms), inputs


@settings(max_examples=60, deadline=None)
@given(models(), st.integers(0, 2**32 - 1))
def test_runs_equal_a_plain_recursion_to_rounding(model: tuple[list[Term], Array, int], seed: int) -> None:
    terms, theta, count = model
    random = np.random.default_rng(seed)
    y, u = random.uniform(-1.0, 1.0, 150), random.uniform(-1.0, 1.0, (150, count))
    names = [f"u{at}" for at in range(count)]
    made = Narx.from_terms("y", names, terms, theta)
    record: Mapping[str, ArrayLike] = {"y": y, **dict(zip(names, u.T, strict=True))}
    free, predicted = made.simulate_free_run(record), made.predict_one_step(record)
    np.testing.assert_allclose(free.values, plain(terms, theta, y, u), rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(predicted.values, plain(terms, theta, y, u, past=y), rtol=0.0, atol=1e-13)
    stepper, lag = made.stepper(), made.longest_lag
    stepper.start(y[:lag], u[:lag])
    assert [stepper.step(row) for row in u[lag:]] == list(free.values[lag:])


@pytest.mark.parametrize("options", [{"n_terms": 4}, {"criterion": "unexplained", "value": 1e-5}])
def test_terms_and_coefficients_are_recovered_from_noise(options: dict[str, Any]) -> None:
    model = identify([noisy(1), noisy(2, 400)], output="y", inputs=["u"], degree=3, **options)
    found = dict(zip(model.terms, model.coefficients, strict=True))
    assert set(found) == set(TRUTH)
    assert max(abs(found[term] - TRUTH[term]) for term in TRUTH) < 1e-3
    assert model.error_reduction.sum() == pytest.approx(1.0, abs=1e-4)
    assert np.all(np.diff(model.error_reduction) < 0.0)


def test_free_run_tail_counts_terms_on_unseen_samples() -> None:
    model = identify(noisy(1), output="y", inputs=["u"], degree=3, criterion="free_run_tail")
    assert set(TRUTH) <= set(model.terms)
    assert model.criterion.argmin() + 1 == len(model.terms)
    assert validate(model, noisy(3)).free_run_rmse[0] < 1.5e-3


def test_all_terms_are_those_of_least_squares() -> None:
    record = noisy(4, 200, 0.1)
    y, u = np.asarray(record["y"]), np.asarray(record["u"])
    model = identify(record, output="y", inputs=["u"], n_terms="all")
    rows = np.column_stack([np.ones(198), y[1:-1], y[:-2], u[1:-1], u[:-2]])
    assert model.term_names == ("1", "y[k-1]", "y[k-2]", "u[k-1]", "u[k-2]")
    np.testing.assert_allclose(model.coefficients, np.linalg.lstsq(rows, y[2:])[0], rtol=1e-10)


def test_lags_do_not_reach_over_the_ends_of_records() -> None:
    whole = noisy(5, 300, 0.0)
    first, last = split_in_time(whole, 0.5)
    model = identify([first, last], output="y", inputs=["u"], degree=2, n_terms=4)
    assert dict(zip(model.terms, model.coefficients, strict=True)) == pytest.approx(TRUTH, abs=1e-9)
    jump = {name: np.concatenate([np.asarray(last[name]), np.asarray(first[name])]) for name in whole}
    joined = identify(jump, output="y", inputs=["u"], degree=2, n_terms=4)
    assert validate(joined, whole).prediction_rmse[0] > 1e-6  # joined, the seam is wrong data


def test_prediction_of_slow_motion_is_no_proof_of_a_model() -> None:
    time = np.linspace(0.0, 1.0, 500)
    record = {"y": np.sin(2.0 * np.pi * time), "u": np.cos(time)}
    lazy = Narx.from_terms("y", ["u"], [((0, 1),)], [1.0])
    table = validate(lazy, record)
    assert table.prediction_fit[0] > 98.0
    assert table.free_run_fit[0] < 5.0


def test_divergence_is_reported_with_what_came_before() -> None:
    model = Narx.from_terms("y", [], [((0, 1), (0, 1))], [1.0])
    record = {"y": np.full(20, 10.0)}
    with pytest.raises(DivergedError, match="sample 3, where `y` is 1e8") as caught:
        model.simulate_free_run(record, limit=1e6)
    run = caught.value.run
    assert isinstance(run, NarxRun)
    np.testing.assert_array_equal(run.values, [10.0, 100.0, 1e4])
    assert caught.value.time == 3.0
    table = validate(model, record)
    assert table.free_run_rmse == (float("inf"),)
    assert "diverged" in table.notes[0]


def test_identified_models_have_a_limit() -> None:
    model = identify(noisy(1), output="y", inputs=["u"], degree=2, n_terms=4)
    assert model.limit == pytest.approx(1e3 * np.abs(np.asarray(noisy(1)["y"])).max())


def with_sample(value: float) -> dict[str, ArrayLike]:
    y = np.array(noisy(1)["y"])
    y[7] = value
    return {**noisy(1), "y": y}


@pytest.mark.parametrize(
    ("record", "options", "message"),
    [
        (noisy(1, 12), {"degree": 3, "n_terms": "all"}, "10 equations for 35 parameters"),
        (noisy(1, 12), {"output_lags": 12}, "has 12 samples, but a model that looks back 12 samples needs at least 13"),
        ({**noisy(1), "u": np.ones(600)}, {}, "`u` has the value 1 in every sample"),
        (with_sample(np.nan), {}, "`y` of record `record 0` is NaN at sample 7"),
        ({**noisy(1), "u": np.ones(5)}, {}, 'shape \\(5,\\), but "y" has 600 samples'),
        ({"y": np.ones(5)}, {}, 'no channel "u"'),
        ({"y": ["a"], "u": ["b"]}, {}, "something else than numbers"),
        ([], {}, "there is no record"),
        (noisy(1), {"output_lags": [0, 1]}, "lags of y must be 1 or more"),
        (noisy(1), {"input_lags": [-1]}, "lags of u must be 0 or more"),
        (noisy(1), {"input_lags": {"v": 2}}, 'names "v"'),
        (noisy(1), {"degree": 0}, "degree must be 1 or more"),
        (noisy(1), {"degree": 9, "output_lags": 20}, "candidates, and at most"),
        (
            {"y": np.ones(20_000), "u": np.ones(20_000)},
            {"degree": 6, "output_lags": 8},
            "8008 candidates over 20000 samples take 1.6e\\+08 numbers",
        ),
        (noisy(1), {"criterion": "free_run_tail", "value": 1.5}, "free-run tail must lie between 0 and 1, got 1.5"),
        (noisy(1), {"criterion": "free_run_tail", "value": 0.999}, "has 600 samples, but a model that looks back 2"),
        (noisy(1), {"n_terms": 0}, "none is allowed"),
        (noisy(1), {"n_terms": -1}, "negative"),
        (noisy(1), {"criterion": "magic"}, "choices are terms, unexplained, bic"),
        ({"y": np.zeros(50), "u": np.arange(50.0)}, {}, "`y` has the value 0"),
    ],
)
def test_bad_inputs_are_refused_in_one_sentence(record: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(IdentificationError, match=message) as caught:
        identify(record, output="y", inputs=["u"], **options)
    assert "\n" not in str(caught.value)


def test_terms_that_depend_linearly_are_named() -> None:
    record = noisy(1)
    both = {**record, "v": 2.0 * np.asarray(record["u"])}
    with pytest.raises(IdentificationError, match=r"`v\[k-1\]` is a linear combination of `u\[k-1\]` within rounding"):
        identify(both, output="y", inputs=["u", "v"], output_lags=1, input_lags=1, n_terms="all")
    model = identify(both, output="y", inputs=["u", "v"], degree=1)
    assert any("cannot be told from" in note for note in model.notes)


def test_runs_refuse_records_that_do_not_fit() -> None:
    with pytest.raises(SimulationError, match="has 2 samples, but"):
        quadratic().simulate_free_run({"y": np.zeros(2), "u": np.zeros(2)})
    with pytest.raises(SimulationError, match="`u` of record `record` is inf at sample 3"):
        quadratic().predict_one_step({"y": np.zeros(5), "u": [0.0, 0.0, 0.0, np.inf, 0.0]})
    with pytest.raises(IdentificationError, match="contains the output"):
        Narx.from_terms("y", ["u"], [((0, 0),)], [1.0])
    with pytest.raises(IdentificationError, match="are 2, but the model has 1 terms"):
        Narx.from_terms("y", ["u"], [((0, 1),)], [1.0, 2.0])


def test_steppers_refuse_other_counts_of_inputs() -> None:
    stepper = quadratic().stepper()
    with pytest.raises(ValueError, match="has 2 numbers, but the model has 1 inputs"):
        stepper.step(np.zeros(2))
    with pytest.raises(ValueError, match="looks back 2 samples with 1 inputs"):
        stepper.start(np.zeros(3), np.zeros((3, 1)))


def test_splits_are_contiguous() -> None:
    time = np.arange(100) * 0.01
    log = Experiment.from_arrays(time, {"y": np.arange(100.0), "u": np.zeros(100)}, name="log")
    first, last = split_in_time(log, 0.6, overlap=3)
    np.testing.assert_array_equal(first["y"], np.arange(60.0))
    np.testing.assert_array_equal(last["y"], np.arange(57.0, 100.0))
    assert last.time[0] == time[57]
    for share, overlap in [(0.0, 0), (1.0, 0), (0.5, 80)]:
        with pytest.raises(IdentificationError, match="leaves no two parts"):
            split_in_time(log, share, overlap)


def test_residual_of_the_truth_is_white_and_of_a_lesser_model_is_not() -> None:
    random = np.random.default_rng(11)
    u = random.uniform(-1.0, 1.0, 2000)
    y = np.zeros(2000)
    for k in range(2, 2000):  # noise inside the equation, so that the prediction's residual is that noise
        y[k] = 0.5 * y[k - 1] + u[k - 2] + 0.1 * u[k - 2] ** 2 + 0.05 * y[k - 1] * u[k - 2]
        y[k] += 0.01 * random.standard_normal()
    record = {"y": y, "u": u}
    right = identify(record, output="y", inputs=["u"], degree=2, n_terms=4).predict_one_step(record).residual_tests()
    assert right.white
    assert right.independent_of_inputs
    assert right.own.band == pytest.approx(1.959964 / np.sqrt(1998))
    poor = Narx.from_terms("y", ["u"], [((1, 2),)], [1.0]).predict_one_step(record).residual_tests()
    assert not poor.white
    assert not poor.independent_of_inputs
    assert list(poor.to_frame()["with"]) == ["y", "u"]


def test_results_have_the_common_manners(tmp_path: Path) -> None:
    record = Experiment.from_arrays(np.arange(600) * 0.01, noisy(1), name="noise")
    model = identify(record, output="y", inputs=["u"], degree=2, n_terms=4)
    run = model.simulate_free_run(record)
    table = validate(model, record)
    results = [model, run, table, run.residual_tests(), MaxwellNarx(np.array([1e5]), np.array([0.3]), 5e5, 2e3, 1e-3)]
    for at, result in enumerate(results):
        assert type(result).load(result.save(tmp_path / f"{at}.npz")) == result
        assert "\n" not in repr(result)
        assert len(result.to_frame())
        assert result._repr_html_().startswith("<table>")
    assert "terms=4" in repr(model)
    assert "0.5" in model.equation
    assert run.unit == "1"
    assert run.fit > 99.0
    assert run.rmse <= run.max_error
    pytest.importorskip("matplotlib")
    for drawn in (model.plot(), run.plot(), run.residual_tests().plot()):
        assert drawn.axes


def maxwell_case(step: float) -> tuple[Array, Array]:
    """Length and exact force of a sine of 10 mm at 1.5 Hz: k0 = 1e5, s0 = 0.3, k1 = 5e5, c1 = 2e3."""
    time = np.arange(round(1.0 / step) + 1) * step
    w, tau = 2.0 * np.pi * 1.5, 2e3 / 5e5
    gain = (1e5 + tau * 6e5 * 1j * w) / (1.0 + tau * 1j * w)
    return 0.32 + 0.01 * np.sin(w * time), 1e5 * 0.02 + 0.01 * np.imag(gain * np.exp(1j * w * time))


@pytest.mark.parametrize(
    ("scheme", "error"), [("printed", 9.904262424), ("trapezoidal", 0.001393307901), ("central_mean", 0.04493970384)]
)
def test_maxwell_element_has_the_errors_of_the_reference(scheme: Any, error: float) -> None:
    length, force = maxwell_case(1e-3)
    element = MaxwellNarx(np.array([1e5]), np.array([0.3]), 5e5, 2e3, 1e-3, scheme)
    run = element.simulate_free_run(length, (force[0], force[1]))
    assert np.abs(run - force).max() == pytest.approx(error, rel=1e-3)


def test_maxwell_element_refuses_what_has_no_meaning() -> None:
    with pytest.raises(IdentificationError, match="c1 / k1"):
        MaxwellNarx(np.array([1.0]), np.array([0.0]), -1.0, 1.0, 1e-3)
    with pytest.raises(IdentificationError, match="1 to 10 coefficients"):
        MaxwellNarx(np.zeros(11), np.array([0.0]), 1.0, 1.0, 1e-3)
    element = MaxwellNarx(np.array([1.0]), np.array([0.0]), 1.0, 1.0, 1e-3)
    with pytest.raises(SimulationError, match="at sample 2"):
        element.simulate_free_run([0.0, 0.0, np.nan], (0.0, 0.0))
    with pytest.raises(DivergedError, match="limit"):
        element.simulate_free_run(np.full(50, 1e3), (0.0, 0.0), limit=1.0)


def test_maxwell_parameters_come_back_from_a_dynamic_record_by_name_of_terms() -> None:
    """The printed form is a linear NARX model: F[k-2], s[k-1], s[k-2] and a constant tell all four parameters."""
    h, k0, s0, k1, c1 = 1e-3, 1e5, 0.3, 5e5, 2e3
    length = np.concatenate([maxwell_case(h)[0], 0.32 + 0.005 * np.sin(30.0 * np.arange(500) * h)])
    element = MaxwellNarx(np.array([k0]), np.array([s0]), k1, c1, h, "printed")
    record = {"F": element.simulate_free_run(length, (2e3, 2e3)), "s": length}
    model = identify(record, output="F", inputs=["s"], output_lags=[2], input_lags=2, n_terms="all")
    theta = dict(zip(model.term_names, model.coefficients, strict=True))
    y = theta["F[k-2]"]  # x / (1 + x), x = tau / (2 h)
    tau, d = 2.0 * h * y / (1.0 - y), 1.0 - y
    stiffness = (theta["s[k-1]"] + theta["s[k-2]"]) / d
    fast = -theta["s[k-2]"] * h / (tau * d) - stiffness
    np.testing.assert_allclose(
        [stiffness, -theta["1"] / (d * stiffness), fast, tau * fast], [k0, s0, k1, c1], rtol=1e-6
    )


def test_terms_and_coefficients_are_those_of_sysidentpy() -> None:
    pytest.importorskip("sysidentpy")
    from narx_peer import sysidentpy_terms

    record = noisy(7, 500, 0.02)
    theirs = sysidentpy_terms(np.asarray(record["y"]), np.asarray(record["u"]), lags=2, degree=2, n_terms=6)
    model = identify(record, output="y", inputs=["u"], degree=2, n_terms=6)
    ours = dict(zip(model.terms, model.coefficients, strict=True))
    assert set(ours) == set(theirs)
    for term, value in theirs.items():
        assert ours[term] == pytest.approx(value, rel=1e-6)


def test_a_linear_model_is_the_arx_model_that_least_squares_and_control_give() -> None:
    """Coefficients by SciPy, and the free run of the transfer function by python-control."""
    from scipy.linalg import lstsq

    record = noisy(3, 600, 0.01)
    y, u = np.asarray(record["y"]), np.asarray(record["u"])
    model = identify(record, output="y", inputs=["u"], degree=1, constant=False, n_terms="all")
    table = np.column_stack([y[1:-1], y[:-2], u[1:-1], u[:-2]])
    expected = lstsq(table, y[2:])[0]
    theta = dict(zip(model.term_names, model.coefficients, strict=True))
    names = ("y[k-1]", "y[k-2]", "u[k-1]", "u[k-2]")
    np.testing.assert_allclose([theta[name] for name in names], expected, rtol=1e-9)
    control = pytest.importorskip("control")
    a1, a2, b1, b2 = expected
    transfer = control.tf([b1, b2], [1.0, -a1, -a2], dt=1.0)
    theirs = control.forced_response(transfer, np.arange(50.0), u[:50]).outputs
    ours = model.simulate_free_run({"y": theirs, "u": u[:50]}).values
    np.testing.assert_allclose(ours, theirs[-ours.size :], atol=1e-9 * np.abs(theirs).max())


def test_module_is_reachable_from_the_package() -> None:
    assert narx.identify is identify
