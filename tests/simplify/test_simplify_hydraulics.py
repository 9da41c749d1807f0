"""Walking hydraulic drives down: what is offered, what is learnt, and what is chosen for the leg."""

import json
from pathlib import Path

import numpy as np
import pytest

import vpm
from places import EXAMPLES
from vpm.errors import ModelError
from vpm.numbers import Array
from vpm.simplify import Ladder, reductions, simplify
from vpm.simplify.hydraulics import BOTH, LOAD, NO_STATE, QUASI_STATIC, SIMPLER, STATIC, simpler
from vpm.simplify.judge import Judge, by_the_model
from vpm.simplify.learnt import maxwell_entry, narx_entry, trained
from vpm.simplify.replacement import commanded, replaced
from vpm.simplify.surrogates import _learnt, _taught, surrogates

CHANNELS = ("slider.position", "hip_drive.force", "knee_drive.force")
SPRING = json.dumps(
    {"type": "maxwell_narx", "sample_time": 1e-3, "k0": [2e4], "s0": [0.32], "k1": 1e5, "c1": 1e3, "command_unit": "1"}
)


@pytest.fixture(scope="module")
def leg() -> vpm.Model:
    return vpm.Model.load(EXAMPLES / "hyl" / "hydraulic.toml")


def record(model: vpm.Model, name: str, samples: int = 201) -> vpm.Experiment:
    whole = vpm.Experiment.load(EXAMPLES / "hyl" / f"{name}.csv", model=model)
    values = {channel: whole[channel][:samples] for channel in whole.channels}
    return vpm.Experiment.from_arrays(whole.time[:samples], values, model=model, name=name)


@pytest.fixture(scope="module")
def ladder(leg: vpm.Model) -> Ladder:
    return simplify(
        leg,
        [record(leg, "squat"), record(leg, "sway")],
        validate=record(leg, "pace"),
        tolerance=0.05,
        against="model",
        channels=CHANNELS,
    )


def test_leg_comes_down_within_the_tolerance_on_a_motion_that_nothing_was_fitted_to(ladder: Ladder) -> None:
    assert ladder.chosen.loss <= 0.05
    assert ladder.chosen.seconds < 0.2e-3
    assert ladder.full.error < 0.01
    assert any("drive" in change for rung in ladder.rungs for change in rung.removed)


def test_reduced_drives_err_by_what_they_leave_out(leg: vpm.Model) -> None:
    learn = [record(leg, name) for name in ("squat", "sway")]
    validation = by_the_model(leg, record(leg, "pace"), "closed_loop", 1000.0, CHANNELS)
    judge = Judge(leg, learn, [validation], 1000.0, "closed_loop", CHANNELS)
    setup = vpm.Setup("linearly_implicit")

    def error(model: vpm.Model) -> float:
        return max(judge.errors(model, setup).values())

    learnt = {str(each): each for each in surrogates(leg, learn, "closed_loop", 1000.0)}
    static, load = (error(simpler(leg, "knee_drive", change)) for change in (STATIC, LOAD))
    element = error(learnt["knee_drive as maxwell_narx"].applied(leg))
    assert error(leg) < 0.002 < static < 0.03 < load < 0.15
    assert 0.002 < element < 0.03


def test_every_channel_has_its_error(ladder: Ladder) -> None:
    for rung in ladder.rungs:
        errors = dict(rung.errors)
        assert set(errors) == set(CHANNELS)
        assert errors[rung.worst] == rung.error == max(errors.values())
    assert "error[hip_drive.force]" in ladder.to_frame()


def test_chosen_leg_does_what_its_rung_says(leg: vpm.Model, ladder: Ladder, tmp_path: Path) -> None:
    again = vpm.Model.load(ladder.model.save(tmp_path / "simple.toml"))
    pace = record(leg, "pace")
    mode = "closed_loop" if again.controlled_actuators else "free_run"
    chosen = ladder.chosen
    run = vpm.simulate(again, commanded(again, leg, pace), mode, integrator=chosen.integrator, substeps=chosen.substeps)
    full = vpm.simulate(leg, pace, "closed_loop", substeps=2)["hip_drive.force"]
    error = np.sqrt(np.mean((run["hip_drive.force"] - full) ** 2) / np.mean(full**2))
    assert error == pytest.approx(dict(chosen.errors)["hip_drive.force"], rel=0.3)


def test_changes_of_a_drive_exclude_each_other(leg: vpm.Model) -> None:
    sites = reductions(leg)
    assert [change.name for change in sites["drive", "hip_drive"]] == list(SIMPLER)
    static = simpler(leg, "hip_drive", STATIC)
    assert [change.name for change in reductions(static)["drive", "hip_drive"]] == [LOAD, QUASI_STATIC]
    both = simpler(leg, "hip_drive", BOTH)
    assert [change.name for change in reductions(both)["drive", "hip_drive"]] == [QUASI_STATIC]
    assert ("drive", "hip_drive") not in reductions(simpler(leg, "hip_drive", NO_STATE))
    assert static.core.n_states == leg.core.n_states - 2
    assert both.core.n_states == leg.core.n_states - 3
    assert simpler(leg, "hip_drive", NO_STATE).core.n_states == leg.core.n_states - 4


def test_element_takes_the_place_of_drive_and_controller(leg: vpm.Model) -> None:
    one = replaced(leg, "knee_drive", SPRING)
    assert one.controlled_actuators == ("hip_drive",)
    assert one.supplies == ("pump",)
    assert one.core.n_states == leg.core.n_states - 4
    both = replaced(one, "hip_drive", SPRING)
    assert both.supplies == both.controlled_actuators == ()
    pace = record(leg, "pace", 20)
    given = commanded(one, leg, pace)
    assert np.array_equal(given["knee_drive.command"], pace["knee_drive.reference"])
    assert "knee_drive.pressure_a" not in given
    assert np.array_equal(given["hip_drive.pressure_a"], pace["hip_drive.pressure_a"])
    assert commanded(leg, leg, pace) is pace


def test_element_cannot_stand_for_half_of_a_controller() -> None:
    rig = vpm.Model.load(EXAMPLES / "servo_cylinder" / "rig.toml")
    assert replaced(rig, "servo", SPRING).actuator_type("servo") == "maxwell_narx"
    with pytest.raises(ModelError):
        replaced(rig, "servo", SPRING.replace("maxwell_narx", "maxwell"))


def test_no_element_where_none_can_run(leg: vpm.Model) -> None:
    assert surrogates(leg, [record(leg, "squat", 50)], "restarts", 1000.0) == ()


def strut(seed: int, drive: float) -> dict[str, Array]:
    """A Maxwell element beside a spring, in a hundred small steps for each sample; k0 = 20 kN/m, s0 = 0.3 m + u."""
    stiffness, fast, damping, step, fine = 2e4, 8e4, 400.0, 1e-3, 100
    random = np.random.default_rng(seed)
    time = step / fine * np.arange(800 * fine)
    phase, speed = random.uniform(0.0, 6.0, 3), 2.0 * np.pi * random.uniform(1.0, 8.0, 3)
    length = 2e-3 * np.sin(speed[:, None] * time + phase[:, None]).sum(axis=0)
    rate, inner = np.gradient(length, step / fine), np.zeros(time.size)
    for k in range(1, time.size):
        inner[k] = inner[k - 1] + step / fine * (fast * rate[k - 1] - fast / damping * inner[k - 1])
    every = slice(None, None, fine)
    force, still = stiffness * (length - drive) + inner, np.full(time.size, drive)
    return {"force": force[every], "length": 0.3 + length[every], "drive": still[every], "rate": rate[every]}


def test_element_is_found_from_what_a_strut_does() -> None:
    entry = maxwell_entry([strut(1, -1e-3), strut(2, 0.0), strut(3, 2e-3)], 1e-3)
    assert entry is not None
    k0, s0 = (np.asarray(entry[name], dtype=np.float64) for name in ("k0", "s0"))
    test = strut(4, 1e-3)
    u, s = test["drive"], test["length"]
    powers = np.stack([u**0, u, s, u**2, u * s, s**2, u**3, u**2 * s, u * s**2, s**3])
    assert np.allclose((k0 @ powers) * (s - s0 @ powers), 2e4 * (s - 0.3 - u), atol=2.0)
    assert entry["k1"] == pytest.approx(8e4, rel=0.02)
    assert entry["c1"] == pytest.approx(400.0, rel=0.02)


def test_narx_model_is_found_from_what_it_does() -> None:
    def told(seed: int) -> dict[str, Array]:
        drive, length, rate = np.random.default_rng(seed).standard_normal((3, 400))
        effort = np.zeros(400)
        for k in range(1, 400):
            effort[k] = 0.8 * effort[k - 1] + 2.0 * drive[k] - 0.5 * rate[k - 1]
        return {"force": -effort, "drive": drive, "length": length, "rate": rate}

    channels = {"drive": "d.command", "length": "l.length", "rate": "l.rate"}
    entry = narx_entry([told(1), told(2)], 1e-3, channels)
    assert entry is not None
    terms = entry["terms"]
    assert isinstance(terms, dict)
    for name, value in {"effort[k-1]": 0.8, "drive[k]": 2.0, "rate[k-1]": -0.5}.items():
        assert terms.pop(name) == pytest.approx(value, abs=1e-8)
    assert all(abs(value) < 1e-6 for value in terms.values())


def test_narx_model_is_trained_in_the_loop_that_it_closes(leg: vpm.Model) -> None:
    learn, validation = (
        [by_the_model(leg, record(leg, name), "closed_loop", 1000.0, CHANNELS) for name in names]
        for names in (("squat", "sway"), ("pace",))
    )
    taught = [_taught(leg, each, "closed_loop", 1000.0) for each in learn]
    element = next(each for each in _learnt(leg, "knee_drive", taught, 1e-3) if each.name == "narx")
    judge = Judge(leg, learn, validation, 1000.0, "closed_loop", CHANNELS)
    better = trained(leg, element, learn, "closed_loop", CHANNELS)
    first, second = (max(judge.errors(each.applied(leg), vpm.Setup("rk4", 2)).values()) for each in (element, better))
    assert second < 0.8 * first
    # What no simulation can run with stays what it is.
    assert trained(leg, element, learn, "closed_loop", ["knee_drive.pressure_a"]) is element


def test_servo_cylinder_may_lose_its_spool_and_a_chamber() -> None:
    rig = vpm.Model.load(EXAMPLES / "servo_cylinder" / "rig.toml")
    time = 1e-3 * np.arange(300)

    def chirp(name: str, size: float, rise: float) -> vpm.Experiment:
        command = size * np.sin(2.0 * np.pi * (2.0 + rise * time) * time)
        return vpm.Experiment.from_arrays(time, {"servo.command": command}, model=rig, name=name)

    learn = [chirp("slow", 1e-3, 10.0), chirp("fast", 5e-4, 30.0)]
    validation = by_the_model(rig, chirp("other", 8e-4, 20.0), "free_run", 1000.0, ["axis.position"])
    judge = Judge(rig, learn, [validation], 1000.0, "free_run", ["axis.position"])

    def error(model: vpm.Model) -> float:
        return judge.errors(model, vpm.Setup("rk4"))["axis.position"]

    full = error(rig)
    for change in (STATIC, LOAD, BOTH):
        assert full < error(simpler(rig, "servo", change)) < 0.1
