"""Each example with parameters to fit finds the truth from a noisy log, from Python and on the command line."""

import csv
import tomllib
from pathlib import Path

import numpy as np
import pytest

from command_line import ran
from identify_cases import CASES, Case, fit_of, record_of
from nightly import at_night
from quotients import of_residual
from validation import table
from vpm.identify.comparison import comparison
from vpm.model import Model

NAMES = tuple(CASES)
#: Those that the command line fits outside of `make test-nightly`: one of each kind of data.
DAILY = {"emps, inverse dynamics", "emps, closed loop", "crane, free run", "servo_cylinder, input error"}
#: The part of the validation table whose rows are these fits.
PART = "Parameters of the examples from noisy logs"


def truth_of(case: Case) -> np.ndarray:
    return np.array([case.truth.parameters[name].value for name in case.free])


@pytest.mark.parametrize("name", NAMES)
def test_starts_away_from_the_truth_and_ends_surely(name: str) -> None:
    case, fit = CASES[name], fit_of(name)
    truth = truth_of(case)
    assert np.all(np.abs(fit.start - truth) > 0.04 * truth)
    assert np.all(fit.std < 0.02 * truth)
    assert not fit.at_bounds


def test_the_truth_is_within_three_deviations() -> None:
    """Of 24 estimates, one lies outside in 15 such tables."""
    assert table.wrong(PART) == []


@pytest.mark.parametrize("name", NAMES)
def test_the_residual_is_the_noise(name: str) -> None:
    case, fit = CASES[name], fit_of(name)
    if case.mode not in {"free_run", "closed_loop"}:
        pytest.skip("the residual is another one than that of an output")
    for channel, (rms, _, _) in fit.after.items():
        assert rms == pytest.approx(case.noise[channel], rel=0.15), channel


@pytest.mark.parametrize("name", at_night(NAMES, but=DAILY))
def test_the_command_line_finds_the_same(name: str, tmp_path: Path) -> None:
    case, record = CASES[name], record_of(name)
    model, log, out = tmp_path / "model.toml", tmp_path / f"{record.name}.csv", tmp_path / "fitted"
    content = case.begun.to_dict()
    content.pop("channels", None)  # the log has the names of the model, not those of the machine's own records
    Model.from_dict(content).save(model)
    record.to_csv(log)
    words = ["identify", str(model), str(log), "--mode", case.mode, "--integrator", case.setup.integrator]
    words += ["--substeps", str(case.setup.substeps), "--horizon", str(case.setup.horizon), "--out", str(out)]
    for free in case.free:
        words += ["--free", free]
    if (settings := case.fitting) is not None:
        words += ["--noise", settings.noise]
        for state, value in settings.known_states.items():
            words += ["--known-state", f"{state}={value!r}"]
    ran(*words)
    found = Model.load(out / "model.toml")
    fit = fit_of(name)
    for free, value, std in zip(fit.names, fit.values, fit.std, strict=True):
        assert abs(found.parameters[free].value - value) < 1e-3 * std + 1e-9 * abs(value)
    with (out / "parameters.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == list(fit.names)
    assert tomllib.loads((out / "model.toml").read_text(encoding="utf-8"))["name"] == case.truth.name


@pytest.mark.parametrize(
    "name", ["flexible_pendulum, free run", "servo_cylinder, free run", "crane, free run", "tudor, closed loop"]
)
def test_derivatives_of_flexible_and_hydraulic_machines_match_differences(name: str) -> None:
    """What parameters do to the first state is among them: a softer strip hangs lower before it is let go."""
    case, record = CASES[name], record_of(name).trim(0.0, 40 * CASES[name].step)
    model = case.truth
    data = comparison(model, [record], case.mode, setup=case.setup, fitting=case.fitting)
    columns = [model.index(free) for free in case.free]
    _, jacobian = data.evaluate(model, model.theta, columns)
    for k, column in enumerate(columns):
        difference = of_residual(data, model, column, 1e-5 * model.theta[column])
        assert np.linalg.norm(jacobian[:, k] - difference) < 1e-4 * np.linalg.norm(difference)
