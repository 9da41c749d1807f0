"""Motors, limits and springs of model files, simulated, against closed forms."""

import numpy as np
import pytest

import vpm
from drive_texts import MOTOR, RIG, SPRUNG
from hydraulic_reference import AREA, RATIO, held
from model_texts import changed
from vpm.errors import SimulationError
from vpm.experiment import Experiment
from vpm.identify import identify
from vpm.model import Model
from vpm.simulate import simulate

R, TAU, KT, GEAR = 2.0, 1e-3, 0.05, 20.0
#: The legs so heavy that springs along lines of some kN do not move them.
HEAVY = (("mass = 8.0", "mass = 8e9"), ("mass = 4.0", "mass = 4e9"), ("-9.81", "0.0"))


BOOM = """
[bodies.hub]
mass = 1.0
inertia = [0.01, 0.01, 0.01, 0.0, 0.0, 0.0]

[joints.luff]
type = "revolute"
parent = "world"
child = "hub"
axis = [0.0, -1.0, 0.0]

[beams.mast]
parent = "hub"
rotation = [0.0, 1.5707963267948966, 0.0]
length = 1.0
level = "strain(2)"
deforms = ["bending_y"]
material = { young = 70e9, density = 2700.0 }
section = { shape = "tube", outer = 0.05, inner = 0.04 }
damping = { stiffness = 1e-3 }

[lines.strut]
from = { parent = "world", point = [0.3, 0.0, -0.39] }
to = { parent = "mast", at = 0.3 }

"""


KNEE_LOOP = """
[actuators.knee_motor]
joint = "knee"
gain = { value = 1.0, unit = "N m/V" }
command_unit = "V"

[controllers.knee_loop]
type = "pid"
actuator = "knee_motor"
measures = "knee.position"
proportional = 400.0
integral = 2000.0
derivative = 10.0
"""


def motor(*changes: tuple[str, str], effects: str = "") -> Model:
    return changed(MOTOR + effects, *changes)


def effect(kind: str, values: str) -> str:
    return f'\n[[effects]]\ntype = "{kind}"\nat = "axis"\n{values}\n'


def test_a_motor_without_load_turns_as_fast_as_its_voltage_says() -> None:
    run = simulate(motor(), held(motor(), 1e-3, np.full(3000, 12.0)))
    assert run["axis.velocity"][-1] == pytest.approx(12.0 / (KT * GEAR), rel=1e-9)
    assert run["motor.current"][-1] == pytest.approx(0.0, abs=1e-9)


def test_a_motor_that_is_held_gives_its_stall_torque() -> None:
    model = motor(effects=effect("spring", "stiffness = 500.0") + effect("viscous_friction", "viscous = 5.0"))
    run = simulate(model, held(model, 1e-3, np.full(3000, 12.0)))
    stall = GEAR * KT * 12.0 / R
    assert run["motor.force"][-1] == pytest.approx(stall, rel=1e-9)
    assert run["motor.current"][-1] == pytest.approx(12.0 / R, rel=1e-9)
    assert run["axis.position"][-1] == pytest.approx(stall / 500.0, rel=1e-9)


def test_the_current_rises_with_its_time_constant() -> None:
    slow = motor(("mass = 1.0", "mass = 1e9"), ("inertia = [0.02, 0.02, 0.02", "inertia = [2e9, 2e9, 2e9"))
    run = simulate(slow, held(slow, 1e-4, np.full(101, 12.0)), integrator="rosenbrock")
    wanted = 12.0 / R * (1.0 - np.exp(-run.time / TAU))
    assert run["motor.current"] == pytest.approx(wanted, abs=1e-6)


def test_a_gear_takes_its_share() -> None:
    """Steady speed against friction: eta N k_t i = b w with i = (u - k_e N w) / R; the tanh of the loss is 1 there."""
    eta, b = 0.8, 0.3
    lossy = motor(("gear_ratio = 20.0", f"gear_ratio = 20.0\nefficiency = {eta}"))
    lossy = Model.from_toml(lossy.to_toml() + effect("viscous_friction", f"viscous = {b}"))
    run = simulate(lossy, held(lossy, 1e-3, np.full(3000, 12.0)))
    speed = eta * GEAR * KT * 12.0 / (R * b + eta * (GEAR * KT) ** 2)
    assert run["axis.velocity"][-1] == pytest.approx(speed, rel=1e-9)


def test_the_rotor_turns_with_the_gear() -> None:
    model = motor(("gear_ratio = 20.0", "gear_ratio = 20.0\nrotor_inertia = 1e-4"))
    assert model.mass_matrix([0.0])[0, 0] == pytest.approx(0.02 + GEAR**2 * 1e-4, rel=1e-14)


def test_a_reversed_gear_turns_the_other_way() -> None:
    back = motor(("gear_ratio = 20.0", "gear_ratio = -20.0"))
    run = simulate(back, held(back, 1e-3, np.full(3000, 12.0)))
    assert run["axis.velocity"][-1] == pytest.approx(-12.0, rel=1e-9)


def test_an_ideal_drive_is_cut_at_its_limit() -> None:
    text = MOTOR[: MOTOR.index("[actuators")] + '[actuators.motor]\njoint = "axis"\ngain = 2.0\nlimit = 3.0\n'
    model = Model.from_toml(text)
    run = simulate(model, held(model, 1e-3, np.linspace(-4.0, 4.0, 101)))
    assert run["motor.force"] == pytest.approx(np.clip(2.0 * np.linspace(-4.0, 4.0, 101), -3.0, 3.0))


def test_constants_of_a_motor_are_found_from_its_motion() -> None:
    truth = motor(("torque_constant = { value = 50.0", "torque_constant = { value = 57.0"))
    time = 1e-3 * np.arange(1000)
    command = np.where(time < 0.02, 0.0, 6.0 * np.sin(8.0 * time + 20.0 * time**2))  # at rest where it starts
    measured = simulate(truth, held(truth, 1e-3, command))
    record = held(truth, 1e-3, command, axis__position=measured["axis.position"])
    assert identify(motor(), record, mode="free_run")["motor.torque_constant"] == pytest.approx(0.057, rel=1e-6)
    # Every piece starts with a filtered velocity and a current that is taken as steady.
    assert identify(motor(), record, mode="restarts")["motor.torque_constant"] == pytest.approx(0.057, rel=1e-2)


def test_a_motor_in_restarts_starts_from_its_steady_current() -> None:
    """Where the log does not hold the current; where it does, from that."""
    model = motor()
    run = simulate(model, held(model, 1e-3, np.full(500, 12.0)))
    position = run["axis.position"]
    record = held(model, 1e-3, np.full(500, 12.0), axis__position=position, axis__velocity=run["axis.velocity"])
    pieces = simulate(model, record, "restarts", horizon=0.1)
    for row in pieces.starts:
        wanted = (12.0 - KT * GEAR * pieces["axis.velocity"][row]) / R
        assert pieces["motor.current"][row] == pytest.approx(wanted, rel=1e-6)
    seen = held(model, 1e-3, np.full(500, 12.0), axis__position=position, motor__current=np.full(500, 0.25))
    assert simulate(model, seen, "restarts", horizon=0.1)["motor.current"][0] == 0.25
    assert simulate(model, seen)["motor.current"][0] == 0.25


def test_springs_along_lines_push_by_their_laws() -> None:
    """Without commands in the log; the Maxwell element has settled at its length."""
    model = changed(SPRUNG, *HEAVY)
    time = 1e-3 * np.arange(100)
    run = simulate(model, Experiment.from_arrays(time, {"hip.position": 0.0 * time}, model=model))
    hip, knee = run["hip_strut.length"], run["knee_strut.length"]
    assert run["hip_drive.force"] == pytest.approx(83e3 * (0.3 - hip) - 3.3e3 * run["hip_strut.rate"], rel=1e-12)
    assert run["knee_drive.force"] == pytest.approx(44e3 * (0.42 - knee), rel=1e-6)
    assert run["knee_strut.tension"] == pytest.approx(run["knee_drive.force"])


def test_a_visco_elastic_drive_relaxes() -> None:
    """A step of its length by 1 cm: k_0 + k_1 at once, k_0 in the end, with the relaxation time in between."""
    model = changed(SPRUNG, *HEAVY)
    time = 1e-4 * np.arange(401)
    columns = {"knee_drive.command": np.full(401, 0.01), "hip_drive.command": np.full(401, 0.02)}
    run = simulate(model, Experiment.from_arrays(time, columns, model=model), integrator="rosenbrock")
    knee = run["knee_strut.length"][0]
    wanted = 44e3 * (0.42 + 0.01 - knee) + 20e3 * 0.01 * np.exp(-time / 4e-3)
    assert run["knee_drive.force"] == pytest.approx(wanted, rel=1e-6)
    spring = 83e3 * (0.32 - run["hip_strut.length"]) - 3.3e3 * run["hip_strut.rate"]
    assert run["hip_drive.force"] == pytest.approx(spring, rel=1e-12)


def test_springs_carry_a_leg_in_its_rest() -> None:
    """In the end springs hold the leg, by force times slope of the length, so that nothing is left to hold."""
    model = changed(SPRUNG).with_effect("viscous_friction", at="knee", viscous=10.0)
    time = 1e-3 * np.arange(6000)
    start = model.state({"hip.position": 0.1, "knee.position": 0.2})
    run = simulate(
        model, Experiment.from_arrays(time, {"hip_drive.command": 0.0 * time}, model=model), initial_state=start
    )
    assert abs(run["knee.velocity"][-1]) < 1e-6
    q = {name: run[name][-1] for name in ("hip.position", "knee.position")}
    still = np.zeros(2)
    needed = model.inverse_dynamics(list(q.values()), still, still)
    assert np.abs(model.equilibrium(list(q.values()))[1]).max() < 1e-5 * np.abs(needed).max()
    for name, effort in zip(("hip", "knee"), needed, strict=True):
        ends = [q | {f"{name}.position": q[f"{name}.position"] + step} for step in (1e-4, -1e-4)]
        lengths = [vpm.Simulation(model, 1e-3, state=end)[f"{name}_strut.length"] for end in ends]
        slope = (lengths[0] - lengths[1]) / 2e-4
        assert slope * run[f"{name}_drive.force"][-1] == pytest.approx(effort, rel=1e-5)
    assert vpm.Simulation(model, 1e-3).step({}).shape == (len(model.output_channels),)


def test_efforts_that_commands_do_not_say_are_not_balanced() -> None:
    record = held(motor(), 1e-3, np.zeros(2000), axis__position=np.sin(1e-3 * np.arange(2000)))
    with pytest.raises(
        SimulationError, match=r"that of motor \(type dc_motor\) does not follow from its command alone"
    ):
        simulate(motor(), record, "inverse_dynamics")


def test_ideal_drives_on_lines_are_diagnosed() -> None:
    """The balance of effort spreads the force of a line on the joints that it moves."""
    text = SPRUNG[: SPRUNG.index("[actuators")]
    for name in ("hip", "knee"):
        text += f'[actuators.{name}_drive]\nline = "{name}_strut"\ngain = {{ value = 100.0, unit = "N/V" }}\n'
        text += 'command_unit = "V"\n'
    model = Model.from_toml(text)
    rough = model.with_effect("viscous_friction", at="knee", viscous=30.0)
    time = 2e-3 * np.arange(4000)
    assert model.joints_of_actuator("hip_drive") == ("hip",)
    commands = _commands(rough, time, 1.5 * np.sin(3.0 * time), 1.0 * np.sin(5.0 * time + 0.3 * time**2))
    run = simulate(rough, commands, integrator="rosenbrock")
    rng = np.random.default_rng(2)
    columns = {name: commands[name] for name in commands.channels}
    for joint in model.joints:
        columns[f"{joint}.position"] = run[f"{joint}.position"] + 1e-6 * rng.standard_normal(time.size)
    record = Experiment.from_arrays(time, columns, model=model)
    found = vpm.diagnose(model, record, effects=["viscous_friction", "coulomb_friction", "input_delay"], limit=1)
    assert [(accepted.name, accepted.site) for accepted in found.effects] == [("viscous_friction", "knee")]


def _commands(model: Model, time: np.ndarray, hip: np.ndarray, knee: np.ndarray) -> Experiment:
    return Experiment.from_arrays(time, {"hip_drive.command": hip, "knee_drive.command": knee}, model=model)


def test_a_cylinder_lifts_a_flexible_boom() -> None:
    """At every level of detail the same drive; from rest, the cylinder carries the boom once it stands still."""
    boom = RIG[: RIG.index("[bodies")].replace("rig", "boom") + BOOM
    boom += RIG[RIG.index("[supplies") : RIG.index("[[effects")].replace('joint = "axis"', 'line = "strut"')
    flexible = changed(boom, ("value = -40.0", "value = 350.0"), ("internal_leakage = 1.7e-13", ""))
    flexible = flexible.with_effect("viscous_friction", at="luff", viscous=50.0)
    rigid = flexible.at("rigid")
    assert rigid.parameters == flexible.parameters
    assert flexible.joints_of_actuator("servo") == ("luff",)
    for model in (flexible, rigid):
        time = 1e-3 * np.arange(2000)
        record = Experiment.from_arrays(time, {"servo.command": 0.0 * time}, model=model)
        run = simulate(model, record)
        assert np.all(np.isfinite(run.values))
        assert abs(run["luff.velocity"][-1]) < 1e-7
        force = AREA * run["servo.pressure_a"][-1] - RATIO * AREA * run["servo.pressure_b"][-1]
        assert run["servo.force"][-1] == pytest.approx(force, rel=1e-9)
        place = run["luff.position"][-1]
        # The strut shortens with the boom's own sag as well, so the rigid slope holds within a hundredth only.
        holding = model.equilibrium([place])[1][0]
        ends = [rigid.state({"luff.position": place + step}) for step in (1e-4, -1e-4)]
        lengths = [vpm.Simulation(rigid, 1e-3, state=end)["strut.length"] for end in ends]
        assert run["servo.force"][-1] * (lengths[0] - lengths[1]) / 2e-4 == pytest.approx(
            holding, rel=1e-3 if model is rigid else 1e-2
        )


def test_a_closed_loop_needs_no_controller_for_a_spring() -> None:
    """The hip hangs on its spring, a motor holds the knee; the loop is closed."""
    text = SPRUNG[: SPRUNG.index("[actuators.knee_drive]")] + KNEE_LOOP
    model = Model.from_toml(text)
    time = 1e-3 * np.arange(3000)
    record = Experiment.from_arrays(time, {"knee_motor.reference": np.full(3000, 0.3)}, model=model)
    run = simulate(model, record, "closed_loop")
    assert run["knee.position"][-1] == pytest.approx(0.3, abs=0.02)
    spring = 83e3 * (0.3 - run["hip_strut.length"]) - 3.3e3 * run["hip_strut.rate"]
    assert run["hip_drive.force"] == pytest.approx(spring, rel=1e-9)
