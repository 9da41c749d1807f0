"""Transmissions: shafts that turn with several joints, against hand-derived equations, reflected numbers and MuJoCo."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vpm
import wrist
from model_texts import described
from vpm.errors import ExperimentError, ModelError
from vpm.experiment import Experiment, joints_from_shafts
from vpm.model import Model
from vpm.numbers import Array

RANDOM = np.random.default_rng(3)
STATES = [(RANDOM.uniform(-1.5, 1.5, 2), RANDOM.uniform(-4.0, 4.0, 2)) for _ in range(25)]
COULOMB = {"type": "coulomb_friction", "at": "right", "coulomb": 4e-3, "transition_velocity": 0.5}


def rubbing(**more: Any) -> Model:
    """The wrist with dry friction of the right motor."""
    model = wrist.model(**more)
    return Model.from_dict({**model.to_dict(), "effects": [*model.to_dict()["effects"], COULOMB]})


def without(model: Model, *keys: str) -> Model:
    """A model without some of its tables."""
    return Model.from_dict({key: value for key, value in model.to_dict().items() if key not in keys})


def seen(model: Model, state: Array, commands: tuple[float, ...]) -> vpm.Run:
    """The first samples of a machine under commands that stand."""
    names = tuple(f"{name}.command" for name in model.actuators)
    units = tuple(model.channel_unit(name) for name in names)
    log = Experiment("short", wrist.times(10, 1e-4), np.tile(commands, (10, 1)), names, units)
    return vpm.simulate(model, log, initial_state=state, integrator="rk4")


# ---- what reaches the core -------------------------------------------------------------------------------------------


def test_a_transmission_reaches_the_core_as_it_is_written() -> None:
    model = wrist.model()
    told = described(model)
    places = {name: model.index(name) for name in model.parameter_names}
    assert told["transmissions"][1] == {
        "name": "right",
        "ratios": [
            {"joint": 0, "ratio": places["right.ratios.pitch"]},
            {"joint": 1, "ratio": places["right.ratios.roll"]},
        ],
        "inertia": places["right.inertia"],
    }
    assert [one["on"] for one in told["actuators"]] == [{"line": 0}, {"line": 1}]
    assert told["effects"][0]["transmission"] == 0
    assert told["effects"][0]["ratios"] == told["transmissions"][0]["ratios"]
    assert told["controllers"][1]["measures"] == {"kind": "length", "line": 1}
    assert model.parameters["right.inertia"].value == pytest.approx(2e-6)
    assert model.parameters["right.ratios.roll"].unit == "1"
    assert model.transmissions == ("left", "right")
    assert dict(model.ratios("left")) == {"pitch": "left.ratios.pitch", "roll": "left.ratios.roll"}
    assert (model.channel_unit("left.effort"), model.channel_unit("left_motor.force")) == ("N m", "N m")
    assert model.joints_of_actuator("left_motor") == ("pitch", "roll") == model.driven_joints
    assert model.transmission_of_actuator("left_motor") == "left"
    assert model.line_of_actuator("left_motor") is None
    with pytest.raises(ModelError, match='drives the transmission "left", which moves several joints'):
        model.joint_of_actuator("left_motor")
    assert Model.from_toml(model.to_toml()) == model


def test_descriptions_without_transmissions_know_nothing_of_them() -> None:
    assert (
        "transmission"
        not in without(wrist.model(), "transmissions", "actuators", "controllers", "effects", "channels").description()
    )


def test_transmissions_and_lines_are_numbered_one_after_the_other() -> None:
    content = wrist.model().to_dict()
    line = {"from": {"parent": "world", "point": [0.2, 0.0, 0.1]}, "to": {"parent": "fork", "point": [0.1, 0.0, 0.0]}}
    content |= {"lines": {"strut": line}}
    content["actuators"]["spring"] = {"line": "strut", "gain": 1.0}
    model, state = Model.from_dict(content), np.array([0.3, -0.2, 1.0, 0.5])
    assert [one["on"]["line"] for one in described(model)["actuators"]] == [1, 2, 0]
    run = seen(model, state, (0.0, 0.0, 0.0))
    angle, speed = wrist.RATIOS @ state[:2], wrist.RATIOS @ state[2:]
    assert [run[f"{name}.position"][0] for name in wrist.SHAFTS] == pytest.approx(angle)
    assert [run[f"{name}.velocity"][0] for name in wrist.SHAFTS] == pytest.approx(speed)
    ends = np.array([np.cos(0.3), -np.sin(0.3)]) * 0.1 - [0.2, 0.1]
    assert run["strut.length"][0] == pytest.approx(np.hypot(*ends))


def test_the_ratio_of_a_sliding_joint_is_an_angle_per_way() -> None:
    """A pinion of 20 mm radius that a turning joint carries along: theta = q_turn + q_slide / radius."""
    wheel = {"mass": 1.0, "inertia": [0.01, 0.01, 0.01, 0.0, 0.0, 0.0]}
    model = Model.from_dict(
        {
            "name": "rack",
            "gravity": [0.0, 0.0, 0.0],
            "bodies": {"arm": wheel, "rack": {"mass": 2.0}},
            "joints": {
                "turn": {"type": "revolute", "parent": "world", "child": "arm", "axis": [0.0, 0.0, 1.0]},
                "slide": {"type": "prismatic", "parent": "arm", "child": "rack", "axis": [0.0, 0.0, 1.0]},
            },
            "transmissions": {
                "pinion": {"ratios": {"turn": 1.0, "slide": {"value": 0.05, "unit": "rad/mm"}}, "inertia": 1e-3}
            },
        }
    )
    assert model.parameters["pinion.ratios.slide"].unit == "rad/m"
    assert model.parameters["pinion.ratios.slide"].value == pytest.approx(50.0)
    rigid = np.diag([0.01, 2.0])
    np.testing.assert_allclose(model.mass_matrix([0.1, 0.2]), rigid + 1e-3 * np.outer([1.0, 50.0], [1.0, 50.0]))


# ---- dynamics --------------------------------------------------------------------------------------------------------


def test_a_differential_obeys_lagranges_equations_worked_out_by_hand() -> None:
    model, other = rubbing(), wrist.RUBBING
    for q, v in STATES:
        np.testing.assert_allclose(model.mass_matrix(q), other.mass_matrix(q), rtol=1e-12, atol=1e-14)
        a = RANDOM.uniform(-20.0, 20.0, 2)
        needed = other.mass_matrix(q) @ a + other.bias(q, v) - other.friction(v)
        np.testing.assert_allclose(model.inverse_dynamics(q, v, a), needed, rtol=1e-12, atol=1e-12)
        torques = wrist.TORQUE * np.array([0.7, -1.1])
        expected = other.acceleration(q, v, torques)
        given_ = wrist.RATIOS.T @ torques
        np.testing.assert_allclose(model.forward_dynamics(q, v, given_), expected, rtol=1e-11, atol=1e-11)
        run = seen(model, np.concatenate([q, v]), (0.7, -1.1))
        found = [run[f"{joint}.acceleration"][0] for joint in model.joints]
        np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("ratio", [50.0, -7.5])
def test_a_shaft_of_one_joint_is_the_joint_with_reflected_numbers(ratio: float) -> None:
    shaft = {
        "transmissions": {"gear": {"ratios": {"pitch": ratio}, "inertia": 3e-6}},
        "actuators": {"motor": {"transmission": "gear", "gain": 0.03}},
        "effects": [
            {"type": "viscous_friction", "at": "gear", "viscous": 2e-5},
            {"type": "coulomb_friction", "at": "gear", "coulomb": 3e-3, "transition_velocity": 0.4},
            {"type": "torque_ripple", "at": "gear", "period": 0.6, "cosine": 1e-3, "sine": -2e-3},
            {"type": "hysteresis", "at": "gear", "force": 2e-3, "displacement": 0.8},
        ],
    }
    size = abs(ratio)
    direct = {
        "actuators": {"motor": {"joint": "pitch", "gain": 0.03 * ratio}},
        "effects": [
            {"type": "viscous_friction", "at": "pitch", "viscous": 2e-5 * ratio**2},
            {"type": "coulomb_friction", "at": "pitch", "coulomb": 3e-3 * size, "transition_velocity": 0.4 / size},
            {
                "type": "torque_ripple",
                "at": "pitch",
                "period": 0.6 / size,
                "cosine": 1e-3 * ratio,
                "sine": -2e-3 * size,
            },
            {"type": "hysteresis", "at": "pitch", "force": 2e-3 * size, "displacement": 0.8 / size},
            {"type": "rotor_inertia", "at": "pitch", "inertia": 3e-6 * ratio**2},
        ],
    }
    bare = without(wrist.model(), "transmissions", "actuators", "controllers", "effects", "channels").to_dict()
    one, other = Model.from_dict({**bare, **shaft}), Model.from_dict({**bare, **direct})
    commands = np.sin(wrist.times(400, 0.1))[:, None]
    log = Experiment("c", wrist.times(400, 2e-3), commands, ("motor.command",), ("1",))
    for integrator in ("rk4", "linearly_implicit", "additive", "rosenbrock", "semi_implicit"):
        found, expected = (vpm.simulate(each, log, integrator=integrator) for each in (one, other))
        for channel in ("pitch.position", "roll.velocity", "pitch.acceleration"):
            np.testing.assert_allclose(found[channel], expected[channel], rtol=1e-8, atol=1e-8, err_msg=integrator)
        np.testing.assert_allclose(found["gear.position"], ratio * found["pitch.position"], rtol=1e-12)
        np.testing.assert_allclose(ratio * found["gear.effort"], expected["pitch.effort"], rtol=1e-12, atol=1e-15)
    moving = log.with_channel("pitch.position", found["pitch.position"], "rad")
    moving = moving.with_channel("roll.position", found["roll.position"], "rad")
    balances = [vpm.simulate(each, moving, "inverse_dynamics", cutoff=40.0) for each in (one, other)]
    np.testing.assert_allclose(balances[0]["pitch.effort"], balances[1]["pitch.effort"], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(balances[0].measured, balances[1].measured, rtol=1e-12, atol=1e-12)


def test_energy_is_kept_without_friction() -> None:
    model, other = without(wrist.model(), "effects", "controllers"), replace(wrist.Wrist(), viscous=(0.0, 0.0))
    log = Experiment(
        "still", wrist.times(1001, 1e-3), np.zeros((1001, 2)), ("left_motor.command", "right_motor.command"), ("A", "A")
    )
    drifts = []
    for substeps in (4, 8):
        start = np.array([0.4, 0.9, 1.5, -2.0])
        run = vpm.simulate(model, log, initial_state=start, integrator="rk4", substeps=substeps)
        states = np.column_stack([run[f"{j}.{what}"] for what in ("position", "velocity") for j in ("pitch", "roll")])
        energies = [other.energy(x[:2], x[2:]) for x in states]
        assert model.energy(states[-1][:2], states[-1][2:])[0] == pytest.approx(
            0.5 * states[-1][2:] @ other.mass_matrix(states[-1][:2]) @ states[-1][2:]
        )
        drifts.append(abs(energies[-1] - energies[0]))
    assert drifts[1] < 1e-9


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.floats(-80.0, 80.0).filter(lambda r: abs(r) > 0.1), min_size=2, max_size=2),
    st.lists(st.floats(-5.0, 5.0), min_size=4, max_size=4),
    st.floats(-4.0, 4.0),
)
def test_a_shaft_takes_the_power_that_its_joints_get(ratios: list[float], state: list[float], command: float) -> None:
    """Virtual work: effort times rate on the shaft is the sum of efforts times rates of its joints."""
    pair = dict(zip(("pitch", "roll"), ratios, strict=True))
    model = without(wrist.model(transmissions__left__ratios=pair), "controllers")
    x = np.array(state)
    pushed, free = (seen(model, x, (current, 0.0)) for current in (command, 0.0))
    gained = [pushed[f"{joint}.acceleration"][0] - free[f"{joint}.acceleration"][0] for joint in model.joints]
    power = pushed["left.effort"][0] * pushed["left.velocity"][0]
    assert model.mass_matrix(x[:2]) @ gained @ x[2:] == pytest.approx(power, rel=1e-9, abs=1e-9)


def test_momentum_is_kept_where_nothing_holds_the_machine() -> None:
    """Two wheels on one axis and a shaft with a rotor that turns with both: both momenta stay, rotor included."""
    wheel = {"mass": 1.0, "inertia": [0.02, 0.02, 0.02, 0.0, 0.0, 0.0]}
    joint = {"type": "revolute", "parent": "world", "axis": [0.0, 0.0, 1.0]}
    model = Model.from_dict(
        {
            "name": "wheels",
            "gravity": [0.0, 0.0, 0.0],
            "bodies": {"one": wheel, "other": wheel},
            "joints": {"first": {**joint, "child": "one"}, "second": {**joint, "child": "other"}},
            "transmissions": {"shaft": {"ratios": {"first": 3.0, "second": -2.0}, "inertia": 0.01}},
            "effects": [{"type": "viscous_friction", "at": "shaft", "viscous": 0.1}],
        }
    )
    mass = np.diag([0.02, 0.02]) + 0.01 * np.outer([3.0, -2.0], [3.0, -2.0])
    np.testing.assert_allclose(model.mass_matrix([0.1, 0.2]), mass, rtol=1e-14)
    sim = vpm.Simulation(model, 1e-2, state=np.array([0.0, 0.0, 4.0, 1.0]))
    run = sim.run(np.zeros((500, 0)))
    speeds = np.column_stack([run["first.velocity"], run["second.velocity"]])
    # Friction of the shaft acts along (3, -2): momentum across it is that of before.
    across = speeds @ mass @ [2.0, 3.0]
    np.testing.assert_allclose(across, np.array([4.0, 1.0]) @ mass @ [2.0, 3.0], rtol=1e-11)
    assert abs(run["shaft.velocity"][-1]) < 1e-6 < abs(run["shaft.velocity"][0])


def test_linear_models_are_the_slopes_of_the_rates() -> None:
    model, other = rubbing(), wrist.RUBBING
    for q, v in STATES[:5]:
        linear = model.linearize(np.concatenate([q, v]), [0.4, -0.3])
        torques, h = wrist.TORQUE * np.array([0.4, -0.3]), 1e-6
        for k in range(4):
            up, down = np.concatenate([q, v]), np.concatenate([q, v])
            up[k], down[k] = up[k] + h, down[k] - h
            slope = (other.acceleration(up[:2], up[2:], torques) - other.acceleration(down[:2], down[2:], torques)) / (
                2 * h
            )
            np.testing.assert_allclose(linear.A[2:, k], slope, rtol=1e-6, atol=1e-5)
        np.testing.assert_allclose(
            linear.B[2:], np.linalg.solve(other.mass_matrix(q), wrist.RATIOS.T) * wrist.TORQUE, rtol=1e-10
        )
        shafts = [model.output_channels.index(f"{name}.position") for name in wrist.SHAFTS]
        np.testing.assert_allclose(linear.C[shafts], np.hstack([wrist.RATIOS, np.zeros((2, 2))]), rtol=1e-12)


@pytest.mark.parametrize(
    "integrator", ["linearly_implicit", "rosenbrock", "rk4", "additive", "semi_implicit", "adaptive(1e-8)"]
)
def test_runs_follow_the_integration_of_the_equations_by_hand(integrator: str) -> None:
    log = wrist.moved(wrist.RUBBING, duration=1.0)
    run = vpm.simulate(rubbing(), log, integrator=integrator, substeps=4, initial_state=np.zeros(4))
    for name in wrist.SHAFTS:
        # The encoder rounds to a line with a dither of one; methods of order 1 and 2 are off by some more.
        close = {"semi_implicit": 60.0, "linearly_implicit": 8.0}.get(integrator, 2.0)
        assert np.abs(run[f"{name}.position"] - log[f"{name}.position"]).max() < close * wrist.LINE, integrator


def test_a_controller_holds_motors_at_their_own_angle() -> None:
    model = wrist.model()
    time = wrist.times(1500, 2e-3)
    wanted = wrist.RATIOS @ np.array([0.3 * np.sin(2.0 * time), 0.5 * np.sin(3.0 * time)])
    channels = ("left_motor.reference", "right_motor.reference")
    log = Experiment("wanted", time, wanted.T, channels, ("rad", "rad"))
    run = vpm.simulate(model, log, "closed_loop", initial_state=np.zeros(4))
    assert np.abs(run["left.position"] - wanted[0])[500:].max() < 8.0
    assert np.ptp(run["roll.position"]) > 0.7


def test_motors_with_a_winding_turn_shafts() -> None:
    """Its rotor is one of the shaft, its back-EMF that of the shaft's speed."""
    motor = {"type": "dc_motor", "resistance": 2.0, "time_constant": 1e-3, "torque_constant": 0.05, "gear_ratio": 2.0}
    content = without(wrist.model(), "actuators", "controllers", "channels").to_dict()
    for place, name in enumerate(wrist.SHAFTS):
        content["transmissions"][name].pop("inertia")
        content["actuators"] = content.get("actuators", {})
        content["actuators"][f"{name}_motor"] = {**motor, "transmission": name, "rotor_inertia": (place + 1) * 1e-6}
    model = Model.from_dict(content)
    other = replace(wrist.Wrist(), rotors=(4e-6, 8e-6))
    q, v = STATES[0]
    np.testing.assert_allclose(model.mass_matrix(q), other.mass_matrix(q), rtol=1e-12)
    run = seen(model, np.array([*q, *v, 0.3, -0.4]), (6.0, 0.0))
    torques = 2.0 * 0.05 * np.array([0.3, -0.4])
    # The gear loses nothing by default.
    found = [run[f"{joint}.acceleration"][0] for joint in model.joints]
    np.testing.assert_allclose(found, other.acceleration(q, v, torques), rtol=1e-10)
    still = model.linearize({"pitch.velocity": 0.5}, {"left_motor": 6.0})
    assert still.state[4] == pytest.approx((6.0 - 0.05 * 2.0 * 50.0 * 0.5) / 2.0)


def test_a_joint_winds_up_behind_the_motors_of_a_differential() -> None:
    """The rotors of the shafts are before its spring, so that no other inertia has to be."""
    model = wrist.model().with_effect("joint_compliance", at="pitch", stiffness=200.0, damping=0.0)
    assert model.parameters["pitch.compliance.inertia"].value == 0.0
    mass, other = model.mass_matrix(np.zeros(3)), wrist.Wrist()
    rotors = wrist.RATIOS.T @ np.diag(other.rotors) @ wrist.RATIOS
    rigid = other.mass_matrix(np.zeros(2)) - rotors
    before, behind = model.joints.index("pitch"), model.joints.index("pitch_deflection")
    assert mass[before, before] - rotors[0, 0] == pytest.approx(rigid[0, 0])
    assert mass[behind, behind] == pytest.approx(rigid[0, 0])
    # Laws of shafts begin as those of joints that turn.
    rubbing = model.with_effect("coulomb_friction", at="left", coulomb=1e-3)
    assert rubbing.parameters["left.friction.transition_velocity"].value == 0.01


def test_effects_of_the_drive_chain_fit_motors_on_shafts() -> None:
    content = wrist.model().to_dict()
    content["effects"] += [
        {"type": "saturation", "at": "left_motor", "limit": 0.5},
        {"type": "drive_friction", "at": "left_motor", "driving": 0.2, "driven": 0.1, "transition_velocity": 0.1},
        {"type": "actuator_lag", "at": "right_motor", "time_constant": 0.01},
    ]
    model = Model.from_dict(content)
    q, v = np.array([0.2, 0.1]), np.array([1.0, 0.5])
    run = seen(model, np.array([*q, *v, 0.6]), (2.0, 0.0))
    left = 0.5 * wrist.TORQUE
    assert run["left.effort"][0] == pytest.approx(left * (1.0 - 0.2), rel=1e-6)
    assert run["right.effort"][0] == pytest.approx(0.6 * wrist.TORQUE)


def test_a_force_loop_pushes_through_the_ratio() -> None:
    loop = {"type": "force_loop", "actuator": "left_motor", "measures": "pitch.position", "proportional": 3.0}
    content = without(wrist.model(), "controllers").to_dict()
    content["controllers"] = {"arm": {**loop, "feed_forward": {"value": 1.0 / wrist.TORQUE, "unit": "A/(N m)"}}}
    model = Model.from_dict(content)
    channels, commands = ("left_motor.reference", "right_motor.command"), np.tile([0.2, 0.0], (10, 1))
    log = Experiment("held", wrist.times(10, 1e-3), commands, channels, ("rad", "A"))
    run = vpm.simulate(model, log, "closed_loop", initial_state=np.zeros(4))
    assert 50.0 * run["left.effort"][0] == pytest.approx(3.0 * 0.2)


def test_mujoco_moves_the_same_wrist() -> None:
    """A fixed tendon is a shaft: its armature a rotor, a motor on it an effort on the shaft."""
    mujoco: Any = pytest.importorskip("mujoco", reason="MuJoCo is not installed (pip install mujoco)")
    tendons = "".join(
        f'<fixed name="{name}" armature="{rotor}" damping="1.5e-5">'
        f'<joint joint="pitch" coef="{row[0]}"/><joint joint="roll" coef="{row[1]}"/></fixed>'
        for name, rotor, row in zip(wrist.SHAFTS, (2e-6, 2e-6), wrist.RATIOS, strict=True)
    )
    motors = "".join(f'<motor tendon="{name}" gear="{wrist.TORQUE}"/>' for name in wrist.SHAFTS)
    text = f"""<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81"/><worldbody><body name="fork">
      <joint name="pitch" type="hinge" axis="0 1 0"/>
      <inertial pos="0.05 0 0" mass="1.2" diaginertia="1e-3 3e-3 3e-3"/>
      <body name="hand" pos="0.12 0 0"><joint name="roll" type="hinge" axis="1 0 0"/>
        <inertial pos="0 0 -0.06" mass="0.6" diaginertia="1.2e-3 1.0e-3 0.5e-3"/></body></body></worldbody>
      <tendon>{tendons}</tendon><actuator>{motors}</actuator></mujoco>"""
    other = mujoco.MjModel.from_xml_string(text)
    data, model = mujoco.MjData(other), wrist.model()
    for q, v in STATES[:10]:
        data.qpos, data.qvel, data.ctrl = q, v, [0.7, -1.1]
        mujoco.mj_forward(other, data)
        run = seen(model, np.concatenate([q, v]), (0.7, -1.1))
        found = [run[f"{joint}.acceleration"][0] for joint in model.joints]
        np.testing.assert_allclose(found, data.qacc, rtol=1e-8, atol=1e-8)
        assert [run[f"{name}.position"][0] for name in wrist.SHAFTS] == pytest.approx(data.ten_length)


# ---- logs of motors --------------------------------------------------------------------------------------------------


def test_joints_follow_from_as_many_shafts() -> None:
    model, log = wrist.model(), wrist.moved(duration=1.0)
    told = joints_from_shafts(log, model)
    joints = np.linalg.solve(wrist.RATIOS, np.array([log["left.position"], log["right.position"]]))
    np.testing.assert_allclose([told["pitch.position"], told["roll.position"]], joints, rtol=1e-12, atol=1e-15)
    assert "left.position" not in told
    assert "left_motor.command" in told
    assert joints_from_shafts(told, model) is told
    half = log.select(["left.position", "left_motor.command", "right_motor.command"])
    with pytest.raises(
        ExperimentError, match=r"1 transmissions \(left\) do not tell those of 2 joints \(pitch, roll\)"
    ):
        joints_from_shafts(half, model)
    mixed = half.with_channel("roll.position", joints[1], "rad")
    np.testing.assert_allclose(joints_from_shafts(mixed, model)["pitch.position"], joints[0], atol=1e-12)
    # A second encoder that is off by what its shaft winds up moves the other joint by its share of both shafts.
    wound = log.with_channel("roll.position", joints[1] + 1e-3, "rad")
    np.testing.assert_allclose(joints_from_shafts(wound, model)["pitch.position"], joints[0], atol=1e-12)
    alike = wrist.model(transmissions__right__ratios={"pitch": 100.0, "roll": 80.0})
    with pytest.raises(ExperimentError, match="at least as many independent shafts as joints"):
        joints_from_shafts(log, alike)
    with pytest.raises(ExperimentError, match="do not tell"):
        vpm.identify(model, half, ["left.inertia"])
    with pytest.raises(
        ExperimentError, match=r"left\.ratios\.pitch cannot be fitted to positions of joints that follow from"
    ):
        vpm.identify(model, log, ["left.ratios.pitch"])


def test_gain_and_offset_of_a_motor_encoder_are_undone() -> None:
    log, told = wrist.moved(duration=1.0), joints_from_shafts(wrist.moved(duration=1.0), wrist.model())
    content = wrist.model().to_dict() | {"sensors": {"encoder": {"measures": "left.position"}}}
    errors = [
        {"type": "sensor_offset", "at": "encoder", "value": 0.3},
        {"type": "sensor_gain", "at": "encoder", "value": 1.1},
    ]
    model = Model.from_dict({**content, "effects": [*content["effects"], *errors]})
    seen_by_it = log.with_channel("left.position", 1.1 * log["left.position"] + 0.3, "rad")
    found = joints_from_shafts(seen_by_it, model)
    np.testing.assert_allclose(found["roll.position"], told["roll.position"], atol=1e-12)
    with pytest.raises(ExperimentError, match=r"encoder\.offset\.value cannot be fitted"):
        joints_from_shafts(seen_by_it, model, free=["encoder.offset.value"])
    late = Model.from_dict({**content, "effects": [{"type": "sensor_delay", "at": "encoder", "time": 1e-3}]})
    with pytest.raises(ExperimentError, match=r"late by encoder\.delay\.time"):
        joints_from_shafts(log, late)


@pytest.mark.parametrize("mode", ["inverse_dynamics", "free_run"])
def test_identification_finds_inertia_and_friction_of_motors(mode: str) -> None:
    truth = replace(wrist.RUBBING, rotors=(2.6e-6, 1.7e-6), viscous=(2.1e-5, 1.2e-5))
    log = wrist.moved(truth, seed=4)
    values = {
        "left.inertia": 2.6e-6,
        "right.inertia": 1.7e-6,
        "left.friction.viscous": 2.1e-5,
        "right.friction.viscous": 1.2e-5,
        "right.friction.coulomb": 4e-3,
    }
    setup = vpm.Setup(integrator="rk4", substeps=2) if mode == "free_run" else None
    fit = vpm.identify(rubbing(), log, list(values), mode=mode, setup=setup)
    for name, found, std in zip(fit.names, fit.values, fit.std, strict=True):
        assert std < 0.05 * values[name], (name, found, std)
        # A balance filters motion and holds commands: that shifts an inertia by up to 0.8 % beside what intervals know.
        assert abs(found - values[name]) < max(4.0 * std, 8e-3 * values[name]), (name, found, std)


def test_a_ranking_names_friction_at_the_right_motor() -> None:
    told = vpm.rank(wrist.model(), wrist.moved(wrist.RUBBING), workers=1)
    assert [(one.effect, one.site) for one in told.effects] == [("coulomb_friction", "right")]


@pytest.mark.nightly
def test_a_ranking_tells_friction_of_a_joint_from_that_of_motors() -> None:
    log = wrist.moved(replace(wrist.Wrist(), of_joints=(0.3, 0.0)), seed=1)
    told = vpm.rank(wrist.model(), log, workers=1)
    assert [(one.effect, one.site) for one in told.effects] == [("coulomb_friction", "pitch")]


def test_a_ranking_names_nothing_where_nothing_is_missing() -> None:
    assert vpm.rank(wrist.model(), wrist.moved(), workers=1).effects == ()


@pytest.mark.nightly
def test_a_diagnosis_names_friction_at_the_right_motor() -> None:
    told = vpm.diagnose(wrist.model(), wrist.moved(wrist.RUBBING), workers=1)
    assert [(one.name, one.site) for one in told.effects] == [("coulomb_friction", "right")]


# ---- what is refused -------------------------------------------------------------------------------------------------

SHAFT = {"ratios": {"pitch": 50.0, "roll": 40.0}}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"transmissions__left__ratios": {"pich": 50.0}},
            'ratios.pich is "pich", which is no joint of the model; did you mean "pitch"',
        ),
        ({"transmissions__left__ratios": {"pitch": 0.0}}, "ratios.pitch is 0, but a shaft that does not turn"),
        (
            {"transmissions__left__ratios": {"pitch": float("nan")}},
            "ratios.pitch is nan, but has to be a finite number",
        ),
        ({"transmissions__left__ratios": {}}, "left.ratios is empty; add"),
        ({"transmissions__left": {"inertia": 1e-6}}, "left.ratios is missing; add it, for example ratios ="),
        ({"transmissions__left": {**SHAFT, "ratio": 3.0}}, "left.ratio is not a known key"),
        (
            {"transmissions__left__inertia": -1e-6},
            "left.inertia is -1e-06 kg m^2, but only 0 kg m^2 or more is physically possible",
        ),
        ({"transmissions__pitch": SHAFT}, "all components share one namespace"),
        ({"actuators__left_motor__joint": "pitch"}, "drives a joint and a transmission; remove one of the two keys"),
        ({"actuators__left_motor__transmission": "lift"}, 'is "lift", which is no transmission of the model'),
        (
            {
                "actuators__left_motor": {
                    "type": "spring_damper",
                    "transmission": "left",
                    "stiffness": 1.0,
                    "free_length": 1.0,
                    "damping": 0.0,
                }
            },
            'is a spring_damper on the transmission "left", but its force acts along a line',
        ),
        (
            {"effects": [{"type": "joint_compliance", "at": "left", "stiffness": 1.0}]},
            "a transmission, but joint_compliance sits at a joint alone",
        ),
        (
            {"effects": [{"type": "rotor_inertia", "at": "left", "inertia": 1.0}]},
            "give the inertia of the transmission",
        ),
        (
            {"effects": [{"type": "load_dependent_friction", "at": "left", "driving": 0.1}]},
            "drive_friction of its actuator follows the load",
        ),
        (
            {"effects": [{"type": "viscous_friction", "at": "left", "side": "link", "viscous": 1.0}]},
            "a transmission has no sides",
        ),
        ({"controllers__left_servo__measures": "left.velocity"}, "which is no joint position"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ModelError) as error:
        wrist.model(**changes)
    assert words in str(error.value), str(error.value)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("spherical", "a spherical joint, which has 3 coordinates; name one of"),
        ("fixed", "a fixed joint, which has no coordinates"),
    ],
)
def test_joints_without_a_coordinate_of_their_own_name_turn_no_shaft(kind: str, words: str) -> None:
    joint = {"type": kind, "parent": "world", "child": "fork"}
    with pytest.raises(ModelError) as error:
        wrist.model(joints__pitch=joint)
    assert words in str(error.value), str(error.value)


def test_computed_torque_wants_actuators_on_its_joints() -> None:
    servo = {
        "type": "computed_torque",
        "actuators": ["left_motor", "right_motor"],
        "measures": ["pitch.position", "roll.position"],
        "proportional": [1.0, 1.0],
        "derivative": [1.0, 1.0],
    }
    with pytest.raises(ModelError, match='drives the transmission "left", but computed_torque needs each actuator on'):
        wrist.model(controllers={"both": servo})
