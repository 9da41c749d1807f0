"""The Maxwell NARX element from records: runs and their errors, refinement, sentences, a machine from a model file."""

import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from maxwell_element import C1, SIGNALS, STEP, Record, element, made, motions, poses
from places import EXAMPLES
from vpm import narx
from vpm.errors import DivergedError, IdentificationError, SimulationError
from vpm.experiment import Experiment
from vpm.narx import MaxwellSignals

EXAMPLE = EXAMPLES / "maxwell_narx" / "run.py"


# ---- runs and errors -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", ["trapezoidal", "printed", "central_mean"])
def test_one_step_and_free_run_are_two_things(scheme: Any) -> None:
    e = element(scheme, np.array([1e5, 2e4, 3e4]), np.array([0.3, 0.01, 0.02]))
    exact = motions(e, samples=500)[0]
    for run in (narx.maxwell_one_step(e, exact, SIGNALS), narx.maxwell_free_run(e, exact, SIGNALS)):
        assert run.max_error < 1e-9 * np.abs(exact["F"]).max()
    offset = {**exact, "F": exact["F"] + np.where(np.arange(500) >= 250, 100.0, 0.0)}  # the gauge jumps
    free, ahead = narx.maxwell_free_run(e, offset, SIGNALS), narx.maxwell_one_step(e, offset, SIGNALS)
    assert free.residual[-1] == pytest.approx(100.0, rel=1e-6)  # a free run does not see it
    assert 0.0 < ahead.residual[-1] < 70.0
    assert (free.kind, ahead.kind) == ("free run", "one-step prediction")


def test_divergence_is_reported_with_the_run_before() -> None:
    e = element(k0=np.array([1e5, 0, 0, 0, 0, 0, 0, 0, 0, 1e12]))
    record = {"F": np.full(50, 10.0), "s": np.linspace(0.3, 30.0, 50), "u": np.zeros(50)}
    with pytest.raises(DivergedError, match="on record `record 0` diverged at sample 2") as caught:
        narx.maxwell_free_run(e, record, SIGNALS)
    assert isinstance(caught.value.run, narx.NarxRun)
    table = narx.maxwell_errors(e, record, SIGNALS)
    assert table.rmse == (float("inf"),)
    assert "record `record 0` diverged" in table.notes[0]


def test_measures_of_the_table() -> None:
    e = element()
    record = motions(e, 2.0)[1]
    table = narx.maxwell_errors(e, record, SIGNALS)
    run = narx.maxwell_free_run(e, record, SIGNALS)
    f, g = np.abs(run.measured[2:]), np.abs(run.values[2:])
    assert table.sigma[0] == pytest.approx(100.0 * sum((a - b) / a for a, b in zip(f, g, strict=True)) / f.size)
    assert table.fit == (run.fit,)
    assert (table.white, table.independent) == ((True,), (True,))
    assert table.rmse[0] == pytest.approx(2.0, rel=0.05)
    assert table.prediction_rmse[0] > table.rmse[0]  # one step ahead the noise of two samples counts
    poor = narx.maxwell_errors(element(k0=np.array([9e4, 2e4])), record, SIGNALS)
    assert not poor.white[0]
    assert not poor.independent[0]


# ---- refinement, sentences, manners ----------------------------------------------------------------------------------


def test_refinement_is_refused_where_it_is_no_better(tmp_path: Path) -> None:
    e = element()
    records = motions(e, 1.0)
    once = narx.refine_maxwell(element(k0=np.array([9e4, 1e4])), records, SIGNALS)
    assert once.refined
    assert once.refined_rmse < once.staged_rmse
    assert "the refinement is kept" in once.notes[0]
    again = narx.refine_maxwell(once.element, records, SIGNALS)
    assert not again.refined
    assert again.element == once.element
    assert any("the refinement is refused" in note for note in again.notes)
    assert narx.MaxwellFit.load(again.save(tmp_path / "kept.npz")).element == once.element  # NaN and all


def moving_pose() -> list[Record]:
    ramp = made(element(), 0.0, np.linspace(0.31, 0.32, 400), 0.1, np.random.default_rng(0))
    return [*poses(element(), 0.1)[:3], ramp]


def nonsense() -> Record:
    record = motions(element())[0]
    return {**record, "F": np.random.default_rng(0).standard_normal(2000)}


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: narx.static_windows(poses(element())[0], SIGNALS, step=STEP),
            r"rank 2 of 3 and only k0 \(s - s0\)",
        ),
        (lambda: narx.static_windows(poses(element())[0], SIGNALS), "has no clock; give the time between"),
        (lambda: narx.static_windows([], SIGNALS), "there is no record"),
        (lambda: narx.static_windows(poses(element()), SIGNALS, step=STEP, width=1), "take 2 poses or more"),
        (lambda: narx.static_windows(poses(element()), SIGNALS, step=STEP, settle=0.399), "leave 1 samples of it"),
        (lambda: narx.static_windows(moving_pose(), SIGNALS, step=STEP), "record record 3 is not at rest"),
        (
            lambda: narx.identify_maxwell(poses(element())[:5], motions(element()), SIGNALS, step=STEP),
            'drive signal "u" is -1 in all 3 windows',
        ),
        (
            lambda: narx.identify_maxwell(poses(element())[:10], motions(element()), SIGNALS, step=STEP, degree=3),
            "a map of k0 of degree 3 has 10 coefficients, but there are 6 windows",
        ),
        (
            lambda: narx.identify_maxwell(poses(element()), poses(element()), SIGNALS, step=STEP),
            "the length does not move in test record 0",
        ),
        (
            lambda: narx.identify_maxwell(poses(element()), motions(element(), samples=10), SIGNALS, step=STEP),
            "has 10 samples, but k1 and c1 need 20",
        ),
        (
            lambda: narx.refine_maxwell(element(), motions(element(), samples=20)[:1], SIGNALS, degree=3),
            "samples are too few for .* coefficients",
        ),
        (
            lambda: narx.identify_maxwell(poses(element()), [nonsense()], SIGNALS, step=STEP),
            "whose relaxation time no record in steps of 0.001 s can show",
        ),
        (
            lambda: narx.identify_maxwell(poses(element()), motions(element()), SIGNALS, step=STEP, cutoff=900.0),
            "a cut-off of 900 Hz is not between zero and half",
        ),
        (
            lambda: narx.maxwell_errors(element(), {**motions(element())[0], "F": np.full(2000, np.nan)}, SIGNALS),
            '"F" of record record 0 is nan at sample 0',
        ),
    ],
)
def test_bad_inputs_are_refused_in_one_sentence(call: Any, message: str) -> None:
    with pytest.raises(IdentificationError, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_records_of_another_clock_are_refused() -> None:
    record = motions(element(), samples=50)[0]
    other = Experiment.from_arrays(np.arange(50) * 2e-3, record, name="slow")
    with pytest.raises(SimulationError, match=r"record slow is sampled every 0\.002 s, but the element every 0\.001 s"):
        narx.maxwell_free_run(element(), other, SIGNALS)
    first = Experiment.from_arrays(np.arange(50) * 1e-3, record, name="fast")
    with pytest.raises(IdentificationError, match="a difference equation has one step"):
        narx.refine_maxwell(element(), [first, other], SIGNALS)


def test_a_damper_without_spring_has_the_shortest_tau_and_a_note() -> None:
    """F = k0 (s - s0) + c1 ds/dt is the element with an infinite k1: c1 comes back, k1 has a lower bound."""
    random, time = np.random.default_rng(4), STEP * np.arange(4000)
    poses_at = [np.full(300, s) for s in (0.31, 0.33, 0.35)]
    rest = [{"F": 1e5 * (s - 0.3) + 0.1 * random.standard_normal(300), "s": s} for s in poses_at]
    length = 0.33 + 0.01 * np.sin(12.0 * time)
    force = 1e5 * (length - 0.3) + C1 * 0.12 * np.cos(12.0 * time) + 0.1 * random.standard_normal(time.size)
    fit = narx.identify_maxwell(rest, {"F": force, "s": length}, MaxwellSignals("F", "s"), step=STEP)
    assert fit.element.relaxation_time == pytest.approx(0.5 * STEP, rel=1e-2)
    assert fit.element.c1 == pytest.approx(C1, rel=1e-3)
    assert any("tau stands at half a step" in note for note in fit.notes)


def test_results_have_the_common_manners(tmp_path: Path) -> None:
    e = element()
    windows = narx.static_windows(poses(e), SIGNALS, step=STEP)
    fit = narx.identify_maxwell(poses(e), motions(e, 1.0), SIGNALS, step=STEP)
    results = [windows, narx.fit_maxwell_map(windows, "s0"), fit, narx.maxwell_errors(e, motions(e), SIGNALS)]
    for at, result in enumerate(results):
        assert type(result).load(result.save(tmp_path / f"{at}.npz")) == result
        assert "\n" not in repr(result)
        assert len(result.to_frame())
    order = fit.to_frame()["coefficient"][:10].str[3:-1]
    assert list(order) == ["1", "u", "s", "u^2", "u*s", "s^2", "u^3", "u^2*s", "u*s^2", "s^3"]


# ---- a machine from a model file -------------------------------------------------------------------------------------


def test_example_finds_the_strut_of_its_model_file() -> None:
    bench = SimpleNamespace(**runpy.run_path(str(EXAMPLE), run_name="bench"))
    fit, errors = bench.fitted(bench.strut())
    e = fit.element
    assert e.k0[0] == pytest.approx(2e4, rel=5e-4)
    assert e.s0[:2] == pytest.approx([0.32, 1.0], rel=1e-3)
    assert abs(e.k1 - 5e5) < 3.0 * fit.k1_std
    assert e.c1 == pytest.approx(2e3, rel=1e-3)
    assert errors.fit[0] > 99.0
    assert errors.white[0]
