"""Diagnoses of closed loops and of drives that go by their own samples; records are other code's, in shorter steps."""

import json
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import vpm
from places import EXAMPLES
from sledge import MASS, POLE, SAMPLED, pushed
from sledge import OIL as DRAG
from slider_crank import OIL, SLIDER, SLIDER_CRANK, turned
from vpm import naming
from vpm.cli import app
from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.ranking import Ranking
from vpm.ranking.settings import Settings
from vpm.ranking.tracked_records import TrackedRecords
from vpm.ranking.tracker_residual import TrackerResidual
from vpm.report import write_report
from vpm.report.messages import estimate

LOOPS = EXAMPLES / "loops"
CHANNEL = "crank.position (observed)"
TRIED = ["coulomb_friction", "asymmetric_friction", "spring", "bias_force"]


@cache
def swings(dry: float) -> tuple[Experiment, Experiment]:
    """Two swings of the crank, of which only its encoder is read; the guide rubs with so many N."""
    return turned(seed=1, dry=dry, duration=2.0), turned(seed=2, dry=dry, duration=2.0)


@cache
def rubbing() -> vpm.Diagnosis:
    train, test = swings(2.0)
    effects = ["coulomb_friction", "viscous_friction", "spring"]
    return vpm.diagnose(Model.from_toml(SLIDER_CRANK), train, test, effects=effects, check=False, workers=1)


@cache
def pushes(dry: float, uneven: float = 0.0) -> list[Experiment]:
    return [pushed(seed=seed, dry=dry, uneven=uneven, pole=POLE, duration=4.0) for seed in (1, 2)]


def error(model: Model, record: Experiment) -> float:
    """Root mean square by which a run from the first sample misses the crank, rad."""
    run = vpm.simulate(model, record, "free_run")
    return float(np.sqrt(np.mean((run["crank.position"] - record["crank.position"]) ** 2)))


def test_a_guide_that_rubs_is_named_from_the_encoder_of_the_crank() -> None:
    why = rubbing()
    assert why.verdict == "effect_found"
    (found,) = why.effects
    assert (found.name, found.site) == ("coulomb_friction", "guide")
    assert found.probability > 0.9
    assert found.gain > 0.99
    size = next(p for p in found.parameters if p.name == "coulomb")
    assert size.value == pytest.approx(2.0, rel=0.01)
    assert 0.0 < size.std < 0.01 * size.value
    assert {(one.name, one.site) for one in why.refused} >= {("coulomb_friction", "crank"), ("spring", "guide")}


def test_the_repaired_slider_crank_predicts_a_swing_that_was_never_fitted() -> None:
    why, (_, test) = rubbing(), swings(2.0)
    # An observer hides most of what a model does wrong; a run without one shows it.
    assert error(why.model, test) < 0.01 * error(Model.from_toml(SLIDER_CRANK), test)
    gap = why.gap[CHANNEL]
    assert gap.after < 0.01 * gap.recalibrated < gap.before
    assert [step.unseen_error for step in why.steps] == pytest.approx(
        [gap.share(gap.recalibrated), gap.share(gap.after)], rel=0.05
    )


def test_a_right_slider_crank_agrees_with_its_records() -> None:
    right = Model.from_toml(SLIDER_CRANK).with_parameters({"slider.mass": SLIDER, "crank.friction.viscous": OIL})
    why = vpm.diagnose(right, *swings(0.0), check=False, workers=1)
    assert (why.verdict, why.effects) == ("no_disagreement", ())
    assert any(one.site == "guide" for one in why.refused)


def test_values_off_by_what_is_stated_are_no_effect() -> None:
    why = vpm.diagnose(
        Model.from_toml(SLIDER_CRANK), *swings(0.0), effects=["coulomb_friction"], check=False, workers=1
    )
    assert (why.verdict, why.effects) == ("parameters_only", ())
    assert why.fit["slider.mass"] == pytest.approx(SLIDER, rel=0.01)


def test_friction_behind_a_drive_by_its_own_samples_is_named_and_told_by_direction() -> None:
    """Each of two effects is said to take what it takes beside those before it, and together they leave nothing."""
    why = vpm.diagnose(Model.from_toml(SAMPLED), *pushes(3.0, 2.0), effects=TRIED, workers=1, cutoff=20.0, check=False)
    assert [(e.name, e.site) for e in why.effects] == [("coulomb_friction", "way"), ("asymmetric_friction", "way")]
    assert why.effects[0].parameters[0].value == pytest.approx(3.0, rel=0.01)
    errors = [step.unseen_error for step in why.steps]
    assert errors[0] > errors[1] > 100.0 * errors[2]
    assert [e.gain for e in why.effects] == pytest.approx(
        [1.0 - (after / before) ** 2 for before, after in pairwise(errors)], abs=1e-6
    )
    assert any("cut-off frequency is not used" in note for note in why.notes)


def sampled(model: Model, seed: int) -> Experiment:
    """The sledge as vpm simulates it in an eighth of the step of the log; an encoder errs by 5e-6 m."""
    step, fine, count, random = 2e-3, 8, 1500, np.random.default_rng(seed)
    time, phases = step * np.arange(count), random.uniform(0.0, 2.0 * np.pi, 3)
    waves = zip((5.0, 3.0, 1.5), (2.1, 5.3, 17.0), phases, strict=True)
    command = np.sum([size * np.sin(turn * time + phase) for size, turn, phase in waves], axis=0)
    machine, place = vpm.Simulation(model, step / fine), np.empty(count)
    for number in range(count):
        place[number] = machine["way.position"]
        for _ in range(fine):
            machine.step([command[number]])
    readings = place + 5e-6 * random.standard_normal(count)
    return Experiment.from_arrays(
        time, {"motor.command": command, "way.position": readings}, model=model, name=f"own {seed}"
    )


def test_deviations_cover_the_truth_where_the_law_is_the_right_one() -> None:
    right = {"sledge.mass": MASS, "way.friction.viscous": DRAG}
    dry = (
        Model.from_toml(SAMPLED)
        .with_parameters(right)
        .with_effect("coulomb_friction", "way", coulomb=3.0, transition_velocity=5e-3)
    )
    records = (sampled(dry, seed) for seed in (1, 2))
    why = vpm.diagnose(Model.from_toml(SAMPLED), *records, effects=["coulomb_friction"], check=False, workers=1)
    for name, truth in {**right, "way.friction.coulomb": 3.0, "way.friction.transition_velocity": 5e-3}.items():
        std = float(why.fit.std[why.fit.names.index(name)])
        # Of four normal numbers one is outside of three deviations once in 93 draws.
        assert abs(why.fit[name] - truth) < 3.0 * std
        assert std < 0.05 * truth


def test_nothing_is_missing_of_a_drive_by_its_own_samples_that_is_right() -> None:
    why = vpm.diagnose(Model.from_toml(SAMPLED), *pushes(0.0), effects=["coulomb_friction"], check=False, workers=1)
    assert (why.verdict, why.effects) == ("parameters_only", ())


@pytest.mark.nightly
def test_cranks_that_turn_alike_are_told_as_one_class() -> None:
    """Cranks and coupler of a parallelogram turn by the same angle: no record of it says which of its pins rubs."""
    model = Model.load(LOOPS / "parallelogram.toml")
    rubbing = model.with_effect("coulomb_friction", "right_crank", coulomb=0.3, transition_velocity=1e-3)
    why = vpm.diagnose(
        model, *(cranked(rubbing, seed) for seed in (1, 2)), effects=["coulomb_friction"], check=False, workers=1
    )
    (told,) = why.classes
    assert set(told) == {f"coulomb_friction at {joint}" for joint in ("left_crank", "elbow", "right_crank")}
    assert why.effects[0].parameters[0].value == pytest.approx(0.3, rel=0.02)
    assert why.effects[0].class_probability > 0.9


def cranked(model: Model, seed: int) -> Experiment:
    """A parallelogram under a controller, in a fourth of the step of the log; an encoder errs by 2e-5 rad."""
    step, fine, count, random = 2e-3, 4, 1000, np.random.default_rng(seed)
    phases, position, speed = random.uniform(0.0, 2.0 * np.pi, 2), "left_crank.position", "left_crank.velocity"
    machine, told = vpm.Simulation(model, step / fine, state={position: 0.3}), np.empty((count, 2))
    for number in range(count):
        wanted = np.array([0.5, 0.3]) @ np.sin(np.array([2.1, 6.3]) * step * number + phases)
        command = 8.0 * (float(wanted) - machine[position]) - 0.8 * machine[speed]
        told[number] = command, machine[position]
        for _ in range(fine):
            machine.step([command])
    motion = {"motor.command": told[:, 0], position: told[:, 1] + 2e-5 * random.standard_normal(count)}
    return Experiment.from_arrays(step * np.arange(count), motion, model=model, name=f"crank {seed}")


def test_the_residual_of_an_observer_has_the_derivatives_of_differences() -> None:
    model = Model.from_toml(SLIDER_CRANK)
    problem = TrackerResidual(TrackedRecords(model, swings(2.0), Settings()), 1.0)
    assert [block.experiment for block in problem.blocks] == ["swing 1", "swing 2"]
    assert all(block.time[0] >= 0.5 for block in problem.blocks)
    place, step = model.index("slider.mass"), 1e-5
    _, slope = problem.evaluate(model, model.theta, [place])
    ends = [model.theta + sign * step * (np.arange(len(model.theta)) == place) for sign in (1.0, -1.0)]
    ahead, behind = (problem.evaluate(model, theta)[0] for theta in ends)
    np.testing.assert_allclose(slope[:, 0], (ahead - behind) / (2.0 * step), atol=1e-5 * np.abs(slope).max())


def test_the_answer_is_written_read_and_drawn(tmp_path: Path) -> None:
    pytest.importorskip("jinja2", reason="the page needs the extra report")
    pytest.importorskip("matplotlib", reason="the page needs the extra report")
    why = rubbing()
    write_report(why, tmp_path)
    told = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert told["effects"][0]["parameters"]["coulomb"]["path"] == "guide.friction.coulomb"
    assert told["gap"][CHANNEL]["mode"] == "observed"
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "pictures of efforts and discriminating experiments are left out" in page
    assert "Measured and simulated" in page
    again = vpm.Diagnosis.load(tmp_path / "diagnosis.npz")
    assert (again.summary, again.gap.keys()) == (why.summary, why.gap.keys())
    assert np.array_equal(again.traces[0].after, why.traces[0].after)
    assert len(why.plot().axes) == len(why.traces) == 1


def test_the_command_writes_what_it_finds(tmp_path: Path) -> None:
    (tmp_path / "model.toml").write_text(SAMPLED, encoding="utf-8")
    logs = [str(record.to_csv(tmp_path / f"{record.name}.csv")) for record in pushes(3.0, 2.0)]
    words = ["diagnose", str(tmp_path / "model.toml"), logs[0], "--validate", logs[1], "--out", str(tmp_path / "out")]
    words += ["--effect", "coulomb_friction", "--limit", "1", "--no-check"]
    done = CliRunner().invoke(app, words, catch_exceptions=False)
    assert done.exit_code == 0
    assert "coulomb_friction at way" in done.output
    told = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert [effect["site"] for effect in told["effects"]] == ["way"]


def test_values_without_derivatives_are_told_as_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = TrackerResidual.evaluate

    def without(*given: Any) -> tuple[Any, Any]:
        residual, slopes = exact(*given)
        return residual, np.full_like(slopes, np.inf)

    monkeypatch.setattr(TrackerResidual, "evaluate", without)
    why = vpm.diagnose(
        Model.from_toml(SAMPLED), *pushes(3.0, 2.0), effects=["coulomb_friction"], check=False, workers=1
    )
    (found,) = why.effects
    assert found.gain > 0.5
    assert all(np.isnan(each.std) for each in found.parameters)
    assert "deviation unknown" in estimate(found.parameters[0].value, found.parameters[0].std, "N")


def test_ctrl_c_in_the_ranking_gives_what_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object, **__: object) -> Ranking:
        raise KeyboardInterrupt

    monkeypatch.setattr(naming, "rank", stopped)
    why = vpm.diagnose(Model.from_toml(SLIDER_CRANK), *swings(2.0), check=False)
    assert why.interrupted
    assert (why.verdict, why.effects, why.gap) == ("interrupted", (), {})


@pytest.mark.parametrize("lacking", [0, 1])
def test_a_record_that_lacks_a_channel_is_refused_in_a_sentence(lacking: int) -> None:
    records = list(swings(2.0))
    for kept, words in (("motor.command", "swing .*log a position"), ("crank.position", "swing .*'motor.command'")):
        less = [one.select([kept]) if number == lacking else one for number, one in enumerate(records)]
        with pytest.raises(VpmError, match=words) as told:
            vpm.diagnose(Model.from_toml(SLIDER_CRANK), *less)
        assert "\n" not in str(told.value)
