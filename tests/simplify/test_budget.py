"""Whether a step fits the period, and what it is made of."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from command_line import ran, vpm
from places import EXAMPLES
from synthetic import Truth, nominal, simulate_axis
from vpm import Model
from vpm.budget import BudgetReport, Stage, budget
from vpm.budget.measure import count_instructions
from vpm.budget.report import REST
from vpm.budget.steps import commands
from vpm.errors import SimulationError
from vpm.experiment import Experiment
from vpm.simulate import Setup

needs_valgrind = pytest.mark.skipif(
    shutil.which("valgrind") is None, reason="counts instructions with valgrind, which is not here"
)
TUDOR = EXAMPLES / "tudor" / "tudor.toml"


@pytest.fixture(scope="module")
def record() -> Experiment:
    return simulate_axis(Truth(mass=20.0, viscous=60.0, coulomb=8.0), 1, 6.0, first_seed=4)[0]


@pytest.fixture(scope="module")
def report() -> BudgetReport:
    return budget(nominal(), steps=20_000)


def test_quantiles_are_ordered(record: Experiment) -> None:
    report = budget(nominal(), steps=20_000, experiment=record)
    values = list(report.quantiles.values())
    assert values == sorted(values)
    assert values[0] > 0.0
    assert report.taken == pytest.approx(report.quantiles["p99.9"] * 1000.0)


def test_a_rate_that_no_machine_has_does_not_hold_and_the_stage_is_named() -> None:
    report = budget(nominal(), rate=1e9, steps=2000)
    assert not report.holds
    assert report.overruns > 1900
    assert f"is: {report.largest.name}" in report.verdict


def test_a_model_made_too_slow_fails_and_names_what_made_it_slow(tmp_path: Path) -> None:
    # Twenty elements in each link: what takes the time is their mass matrix and what an implicit step makes of it.
    path = tmp_path / "slow.toml"
    path.write_text(TUDOR.read_text(encoding="utf-8").replace("bezier(5)", "elements(20)"), encoding="utf-8")
    models = (Model.load(file) for file in (TUDOR, path))
    fast, slow = (budget(model, steps=1000, share=1.0, integrator="linearly_implicit") for model in models)
    assert slow.quantiles["p50"] > 5.0 * fast.quantiles["p50"]
    slow = replace(slow, share=0.5 * slow.quantiles["p50"] * slow.rate)
    assert not slow.holds
    assert slow.largest.name in {"mass matrix", "iteration matrix"}
    assert f"is: {slow.largest.name}" in slow.verdict


def test_a_record_drives_the_model_at_its_own_speed_whatever_the_rate(record: Experiment) -> None:
    model = nominal()
    command = record[model.input_channels[0]]
    faster = commands(model, 4.0 * record.rate, record)[:, 0]
    slower = commands(model, record.rate / 5.0, record)[:, 0]
    np.testing.assert_array_equal(commands(model, record.rate, record)[:, 0], command)
    np.testing.assert_array_equal(faster, np.repeat(command, 4))
    np.testing.assert_array_equal(slower, command[::5][: len(slower)])
    assert len(slower) * 5 == pytest.approx(len(command), abs=5)


def test_a_log_with_a_lost_sample_drives_the_model_as_elsewhere(tmp_path: Path) -> None:
    rows = [f"{2 * k},{np.sin(0.01 * k):.6f},{np.cos(0.01 * k):.6f}" for k in range(500) if k != 200]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["t_ms,q_mm,u_V", *rows]) + "\n")
    table = tmp_path / "table.toml"
    table.write_text(
        'time = { column = "t_ms", unit = "ms" }\n"axis.position" = { column = "q_mm", unit = "mm" }\n'
        '"drive.command" = { column = "u_V", unit = "V" }\n'
    )
    words = ["budget", str(EXAMPLES / "emps" / "model.toml"), "--log", str(path), "--channels", str(table)]
    words += ["--steps", "1000", "--latency", "0", "--share", "1000"]
    refused = vpm(*words)
    assert (refused.returncode, "--interpolate" in refused.stderr) == (1, True)
    assert "the budget holds" in ran(*words, "--interpolate").stdout


def test_a_machine_that_sines_drive_into_a_singular_place_needs_a_record() -> None:
    """The cranks of a parallelogram lie in one line with its coupler where they turn over."""
    content = Model.load(EXAMPLES / "loops" / "parallelogram.toml").to_dict()
    content["actuators"]["motor"]["gain"] = {"value": 200.0, "unit": "N m"}
    with pytest.raises(SimulationError, match=r"singular.*; sums of sines drove it, so give a record .*--log"):
        budget(Model.from_dict(content), steps=5000)


def test_report_saves_and_loads(report: BudgetReport, tmp_path: Path) -> None:
    assert BudgetReport.load(report.save(tmp_path / "budget.npz")) == report


@pytest.mark.parametrize("steps", [0, 999])
def test_too_few_steps_are_refused(steps: int) -> None:
    with pytest.raises(SimulationError, match="too few"):
        budget(nominal(), steps=steps)


def test_more_substeps_take_longer() -> None:
    one, many = (np.median(budget(nominal(), steps=5000, substeps=n).quantiles["p50"]) for n in (1, 40))
    assert many > 5.0 * one


def test_stages_add_up_to_the_median_step(report: BudgetReport) -> None:
    total = sum(stage.seconds for stage in report.stages)
    assert total == pytest.approx(report.quantiles["p50"], rel=1e-9) or report.stages[-1].seconds == 0.0
    assert {stage.name for stage in report.stages} == {"rates", "iteration matrix", "sample", REST}


def test_machine_code_is_timed_as_a_whole() -> None:
    report = budget(Model.load(TUDOR), steps=1000, integrator="linearly_implicit")
    assert report.direct == ""
    assert "evaluated as machine code" in str(report)
    stages = {stage.name: stage for stage in report.stages}
    assert set(stages) == {"rates", "iteration matrix", "sample", REST}
    assert [stages[name].calls for name in ("rates", "iteration matrix", "sample")] == [1.0, 1.0, 1.0]
    assert report.allocations == 0


def test_a_machine_too_large_for_code_is_timed_directly_and_says_why() -> None:
    report = budget(Model.load(TUDOR).at("elements(14)"), steps=1000, integrator="additive")
    assert "operations" in report.direct
    assert f"evaluated directly: {report.direct}" in str(report)
    assert {"beams", "solve"} <= {stage.name for stage in report.stages}


def test_stages_of_a_flexible_arm_have_beams_and_a_mass_matrix() -> None:
    report = budget(Model.load(TUDOR), steps=1000, integrator="linearly_implicit", compiled=False)
    assert "not asked for" in report.direct
    assert "sensors" in {stage.name for stage in report.stages}
    stages = {stage.name: stage for stage in report.stages}
    assert {"kinematics", "beams", "mass matrix"} <= set(stages)
    # One evaluation for the sample, one for the second stage of the method.
    assert stages["mass matrix"].calls == 2.0
    assert stages["iteration matrix"].calls == 1.0


def test_steps_ask_for_no_memory_and_one_that_does_breaks_the_budget(report: BudgetReport) -> None:
    assert report.allocations == 0
    # However long a busy machine takes for some of the steps: what counts here is the memory.
    held = replace(report, share=1e9)
    assert held.holds
    broken = replace(held, allocations=3)
    assert not broken.holds
    assert "asked for memory 3 times" in str(broken)


def test_memory_grows_with_the_model(report: BudgetReport) -> None:
    assert 1000 < report.memory < 1e6
    assert budget(Model.load(TUDOR), steps=1000).memory > 2 * report.memory


def test_latency_is_measured_apart(report: BudgetReport) -> None:
    assert report.latency == {}
    watched = budget(nominal(), steps=1000, latency=0.05)
    assert set(watched.latency) == set(watched.quantiles)
    assert "apart from all the above" in str(watched)


def test_the_largest_stage_is_the_one_that_takes_most(report: BudgetReport) -> None:
    slow = replace(report, stages=(*report.stages, Stage("contact", 1.0, 1.0)), share=1e-9)
    assert slow.verdict.endswith("is: contact")


def test_progress_is_told() -> None:
    told: list[str] = []
    budget(nominal(), steps=150_000, tell=told.append)
    assert [word.split(",")[0] for word in told] == ["timed 100000 of 150000 steps", "timed 150000 of 150000 steps"]


@pytest.mark.parametrize(
    ("setting", "words"), [({"latency": -1.0}, "latency is -1 s"), ({"rate": 0.0}, "rate of 0 Hz")]
)
def test_settings_without_meaning_are_refused(setting: dict[str, float], words: str) -> None:
    with pytest.raises(SimulationError, match=words):
        budget(nominal(), steps=1000, **setting)  # type: ignore[arg-type]


def counted(substeps: int) -> float:
    return count_instructions(nominal(), 1000.0, Setup(substeps=substeps), commands(nominal(), 1000.0), 4e-4)


@pytest.mark.nightly
@needs_valgrind
def test_a_step_of_an_axis_takes_some_thousand_instructions() -> None:
    assert 1e3 < counted(1) < 2e4


@needs_valgrind
@pytest.mark.nightly
def test_instructions_grow_with_the_substeps() -> None:
    # The sample itself counts once, each substep as often as there are.
    one, four = (counted(n) for n in (1, 4))
    assert 1.8 * one < four < 4.2 * one


def test_instructions_without_valgrind_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(SimulationError, match="install your system's package valgrind"):
        budget(nominal(), steps=1000, instructions=True)
