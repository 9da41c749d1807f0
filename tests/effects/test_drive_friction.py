"""Friction of one of two drives of a joint: seals under pressure, the gear of one of two motors."""

import numpy as np
import pytest

import vpm
from vpm import Experiment, Model
from vpm.discrepancy.screening.candidates import candidates, shares_at
from vpm.errors import ModelError, SimulationError
from vpm.experiment import joints_from_shafts
from vpm.identify import InverseDynamicsProblem

LOSS = {"driving": 0.08, "driven": 0.08, "transition_velocity": 0.002}
STEP = 0.005


def rod(drives: int = 2) -> Model:
    """A rod that a press moves against the air in a cylinder, whose pressure somebody sets."""
    content = {
        "name": "rod",
        "gravity": [0, 0, 0],
        "bodies": {"rod": {"mass": 1.0}},
        "joints": {"axis": {"type": "prismatic", "parent": "world", "child": "rod", "axis": [1, 0, 0]}},
        "actuators": {
            "press": {"joint": "axis", "gain": 1.0, "command_unit": "N"},
            "air": {"joint": "axis", "gain": {"value": -50.0, "unit": "N/bar"}, "command_unit": "bar"},
        },
        "sensors": {"stroke": {"measures": "axis.position"}},
        "effects": [{"type": "viscous_friction", "at": "axis", "viscous": {"value": 200.0, "uncertainty": 100.0}}],
    }
    if drives == 1:
        del content["actuators"]["air"]  # type: ignore[attr-defined]
    return Model.from_dict(content)


def stroked(bar: float, seed: int, share: float, noise: float = 2e-6) -> Experiment:
    """Strokes by a position loop at one pressure, by a simulation of its own: friction that holds where it can.

    Semi-implicit steps of 50 us; where the friction would turn the motion round within a step, the rod stands.
    """
    random = np.random.default_rng(seed)
    count, fine = 1600, 100
    turn, phase = 2.0 * np.pi * np.array([0.31, 0.83, 1.7]), random.uniform(0.0, 6.28, 3)
    sizes = np.array([0.02, 0.008, 0.003])
    pressure = bar * (1.0 + 0.15 * np.sin(2.0 * np.pi * 0.21 * STEP * np.arange(count) + random.uniform(0.0, 6.28)))
    q, v, dt = float(sizes @ np.sin(phase)), 0.0, STEP / fine
    place, force = np.empty(count), np.empty(count)
    for k in range(count):
        place[k] = q
        wanted = sizes @ np.sin(turn * STEP * k + phase)
        rate = (sizes * turn) @ np.cos(turn * STEP * k + phase)
        air = -50.0 * pressure[k]
        force[k] = 4e4 * (wanted - q) + 400.0 * (rate - v) - air
        for _ in range(fine):
            pushed = v + dt * (force[k] + air - 200.0 * v)
            held = dt * share * abs(air)
            v = 0.0 if abs(pushed) <= held else pushed - np.sign(pushed) * held
            q += dt * v
    channels = {"axis.position": place + noise * random.standard_normal(count)}
    channels |= {"press.command": force, "air.command": pressure}
    units = {"axis.position": "m", "press.command": "N", "air.command": "bar"}
    return Experiment.from_arrays(STEP * np.arange(count), channels, units=units, name=f"{bar} bar")


def test_a_file_holds_it_and_says_what_is_wrong() -> None:
    model = rod().with_effect("drive_friction", at="air", **LOSS)
    assert model.parameters["air.friction.driving"].unit == "1"
    assert model.parameters["air.friction.transition_velocity"].unit == "m/s"
    assert Model.from_dict(model.to_dict()) == model
    assert not model.follows_command("air")
    assert model.follows_command("press")
    with pytest.raises(ModelError, match=r"driving is 1\.2, but only 0 to 0\.95"):
        rod().with_effect("drive_friction", at="air", driving=1.2)
    with pytest.raises(ModelError, match="which is no actuator of the model"):
        rod().with_effect("drive_friction", at="axis", driving=0.1)


def test_it_takes_its_share_of_the_effort_of_one_drive_alone() -> None:
    model = rod().with_effect("drive_friction", at="air", **LOSS).with_parameters({"axis.friction.viscous": 0.0})
    # 4 bar push with -200 N; the press holds them, and 16 N more keep the speed that is there.
    time = STEP * np.arange(20)
    channels = {"axis.position": 0.1 * time, "press.command": np.full(20, 216.0), "air.command": np.full(20, 4.0)}
    units = {"axis.position": "m", "press.command": "N", "air.command": "bar"}
    record = Experiment.from_arrays(time, channels, units=units)
    run = vpm.simulate(model, record, "free_run")
    np.testing.assert_allclose(run["axis.velocity"][1:], 0.1, rtol=1e-3)
    np.testing.assert_allclose(run["air.force"], -216.0, rtol=1e-6)
    np.testing.assert_allclose(run["press.force"], 216.0, rtol=1e-12)
    with pytest.raises(SimulationError, match="air \\(with friction of its own\\) does not follow from its command"):
        vpm.simulate(model, record, "inverse_dynamics")


def test_a_balance_gives_the_shares_back() -> None:
    """Efforts along the motion of a simulation whose friction holds; the law bends over a transition velocity."""
    records = [stroked(bar, 7 + place, 0.08) for place, bar in enumerate((2.0, 5.0))]
    start = rod().with_effect("drive_friction", at="air", driving=0.01, driven=0.01, transition_velocity=0.002)
    free = ["air.friction.driving", "air.friction.driven", "axis.friction.viscous"]
    fit = vpm.identify(start, records, free=free)
    assert fit.model.parameters["air.friction.driving"].value == pytest.approx(0.08, rel=0.1)
    assert fit.model.parameters["air.friction.driven"].value == pytest.approx(0.08, rel=0.1)


def test_it_is_looked_for_where_drives_share_a_joint_alone() -> None:
    sites = {}
    for drives in (1, 2):
        record, model = stroked(3.0, 1, 0.0), rod(drives)
        data = InverseDynamicsProblem(model, [record])
        residual = data.evaluate(model, model.theta)[0]
        sites[drives] = {one.site for one in candidates(model, data, residual, ["drive_friction"])}
    assert sites == {1: set(), 2: {"press", "air"}}


def test_a_ranking_names_the_drive_that_rubs() -> None:
    records = [stroked(bar, 20 + place, 0.08) for place, bar in enumerate((1.5, 3.0, 6.0))]
    why = vpm.diagnose(rod(), records[:1] + records[2:], records[1:2])
    assert [(one.name, one.site) for one in why.effects] == [("drive_friction", "air")]
    values = {p.name.rpartition(".")[2]: p.value for p in why.effects[0].parameters}
    assert values["driving"] == pytest.approx(0.08, rel=0.15)
    assert values["driven"] == pytest.approx(0.08, rel=0.15)


@pytest.mark.nightly
def test_nothing_is_named_where_nothing_rubs() -> None:
    records = [stroked(bar, 30 + place, 0.0) for place, bar in enumerate((1.5, 3.0, 6.0))]
    assert not vpm.diagnose(rod(), records[:1] + records[2:], records[1:2]).effects


def test_friction_of_a_drive_turns_round_at_a_speed_of_what_it_drives() -> None:
    """A shaft, which turns many times as fast as the joints behind it, or the length of a line."""
    wrist = Model.load("examples/wrist/wrist.toml")
    model = wrist.with_effect("drive_friction", at="left_motor", driving=0.1)
    assert model.parameters["left_motor.friction.transition_velocity"].unit == "rad/s"
    joints = ["pitch", "roll"]
    assert shares_at(wrist, "left_motor", joints).tolist() == shares_at(wrist, "left", joints).tolist() == [50.0, 40.0]
    leg = Model.load("examples/hyl/hydraulic.toml").with_effect("drive_friction", at="hip_drive", driving=0.1)
    assert leg.parameters["hip_drive.friction.transition_velocity"].unit == "m/s"


def test_friction_of_a_shaft_starts_at_a_speed_that_its_records_show() -> None:
    """Half a turn of a wrist is 60 of its motors: what bends within 0.01 rad/s there is a jump to any record."""
    model, time = Model.load("examples/wrist/wrist.toml"), np.arange(1000) / 200.0
    shafts = {"left.position": 60.0 * np.sin(3.0 * time), "right.position": 60.0 * np.sin(4.0 * time)}
    currents = {"left_motor.command": np.cos(3.0 * time), "right_motor.command": np.cos(4.0 * time)}
    log = joints_from_shafts(Experiment.from_arrays(time, shafts | currents, model=model), model)
    problem = InverseDynamicsProblem(model, [log])
    residual, _ = problem.evaluate(model, model.theta)
    for one in candidates(model, problem, residual, ["drive_friction"]):
        (start,) = one.starts
        assert start["transition_velocity"] == pytest.approx(0.01 * 180.0, rel=0.4)
    assert all(one.starts == ({},) for one in candidates(model, problem, residual, ["load_dependent_friction"]))
    started = model.with_effect("drive_friction", at="left_motor", driving=0.1)
    assert started.parameters["left_motor.friction.transition_velocity"].value == 0.01
