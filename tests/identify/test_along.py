"""Efforts balanced along a measured motion, of machines that hold more than their joints show."""

import json

import numpy as np
import pytest

import vpm
from places import EXAMPLES
from quotients import of_residual
from vpm.errors import DivergedError, SimulationError
from vpm.identify import InverseDynamicsProblem, gaps
from vpm.simplify.hydraulics import NO_STATE, SIMPLER, simpler
from vpm.simplify.replacement import replaced
from vpm.simplify.surrogates import force_map

DT = 1e-3


def cylinder_record(
    truth: vpm.Model, channels: tuple[str, ...] = ("servo.pressure_a", "servo.pressure_b")
) -> vpm.Experiment:
    """A cylinder that swings about the middle of its stroke, without noise."""
    time = np.arange(3000) * DT
    command = 0.3e-3 * np.sin(2 * np.pi * 2.0 * time) + 0.5e-3 * np.sin(2 * np.pi * 7.0 * time)
    units = {"servo.command": "A", "axis.position": "m"} | dict.fromkeys(channels, "Pa")
    given = vpm.Experiment.from_arrays(time, {"servo.command": command}, units={"servo.command": "A"})
    run = vpm.simulate(truth, given)
    data = {"servo.command": command, "axis.position": run["axis.position"]} | {c: run[c] for c in channels}
    return vpm.Experiment.from_arrays(time, data, units=units)


@pytest.fixture(scope="module")
def cylinder() -> vpm.Model:
    return vpm.Model.load(EXAMPLES / "servo_cylinder" / "rig.toml")


def arm(level: str = "strain(4)") -> vpm.Model:
    text = f"""
name = "arm"
gravity = [0.0, 0.0, 0.0]

[bodies.hub]
mass = 0.2
inertia = [1e-3, 1e-3, 2e-3, 0.0, 0.0, 0.0]

[joints.shoulder]
type = "revolute"
parent = "world"
child = "hub"
axis = [0.0, 0.0, 1.0]

[beams.link]
parent = "hub"
rotation = [0.0, 1.5707963267948966, 0.0]
level = "{level}"
length = 0.5
deforms = ["bending_x"]
material = {{ young = 7e10, poisson = 0.35, density = 2700.0 }}
section = {{ shape = "given", area = 6e-5, moment_x = 4e-11, moment_y = 4e-9, torsion = 8e-11 }}
damping = {{ ratios = [0.03, 0.03, 0.03, 0.03] }}

[actuators.motor]
joint = "shoulder"
gain = {{ value = 1.0, unit = "N m/A" }}
command_unit = "A"
"""
    return vpm.Model.from_toml(text)


def test_values_that_make_no_machine_are_refused() -> None:
    model, time = arm("rigid"), 1e-3 * np.arange(1200)
    values = {"shoulder.position": 0.3 * np.sin(9.0 * time), "motor.command": np.sin(11.0 * time)}
    record = vpm.Experiment.from_arrays(time, values, units={"shoulder.position": "rad", "motor.command": "A"})
    problem, theta = InverseDynamicsProblem(model, [record], cutoff=60.0), model.theta.copy()
    problem.evaluate(model, theta)
    theta[model.index("hub.inertia.xx")] = 10.0
    with pytest.raises(ValueError, match="inertia"):
        problem.evaluate(model, theta)


def test_a_drives_own_run_balances(cylinder: vpm.Model) -> None:
    problem = InverseDynamicsProblem(cylinder, [cylinder_record(cylinder)])
    assert problem.shown == ("servo.pressure_a", "servo.pressure_b")
    for channel, (_, share, _) in gaps(problem, problem.evaluate(cylinder, cylinder.theta)[0]).items():
        assert share < 0.01, channel


#: Without a spool or a pressure that is a state, the force jumps with every command that is held for a sample, by a
#: share of what a light slide needs; a heavy one needs more.
HEAVY = 1000.0


@pytest.mark.parametrize("change", SIMPLER)
def test_a_drive_with_fewer_states_balances_its_own_run(cylinder: vpm.Model, change: str) -> None:
    """With a slow spool or none, one pressure or none that is a state."""
    reduced = simpler(cylinder, "servo", change)
    if change == NO_STATE:
        reduced = reduced.with_parameters({"slide.mass": HEAVY})
    problem = InverseDynamicsProblem(reduced, [cylinder_record(reduced)])
    for channel, (_, share, _) in gaps(problem, problem.evaluate(reduced, reduced.theta)[0]).items():
        assert share < 0.05, channel


def test_a_table_of_the_force_balances_its_own_run(cylinder: vpm.Model) -> None:
    likest = simpler(cylinder, "servo", NO_STATE)
    axes = [reach * np.sinh(np.linspace(-4.0, 4.0, 41)) / np.sinh(4.0) for reach in (2e-3, 0.3)]
    names, numbers = ("commands", "velocities", "efforts"), (*axes, force_map(likest, "servo", axes[0], axes[1]))
    entry = dict(zip(names, (each.tolist() for each in numbers), strict=True))
    tabled = replaced(cylinder, "servo", json.dumps({"type": "table", "command_unit": "A", **entry}))
    tabled = tabled.with_parameters({"slide.mass": HEAVY})
    problem = InverseDynamicsProblem(tabled, [cylinder_record(tabled, ())])
    ((_, share, _),) = gaps(problem, problem.evaluate(tabled, tabled.theta)[0]).values()
    assert share < 0.05


def test_faults_show_where_they_are(cylinder: vpm.Model) -> None:
    """Friction in the mechanics leaves the pressures alone, a wrong valve leaves the efforts alone."""
    rubbing = cylinder.with_effect("bias_force", at="axis", force=50.0)
    valve = {"servo.valve.flow_gain": 1.2 * cylinder.parameters["servo.valve.flow_gain"].value}
    wrong = cylinder.with_parameters(valve)
    shares = {}
    for name, truth in (("rubbing", rubbing), ("wrong", wrong)):
        problem = InverseDynamicsProblem(cylinder, [cylinder_record(truth)])
        residual, _ = problem.evaluate(cylinder, cylinder.theta)
        shares[name] = {channel: share for channel, (_, share, _) in gaps(problem, residual).items()}
    assert shares["rubbing"]["axis.effort"] > 0.2
    assert shares["rubbing"]["servo.pressure_a"] < 0.02
    assert shares["wrong"]["axis.effort"] < 0.01
    assert shares["wrong"]["servo.pressure_a"] > 0.1


def test_without_pressures_the_drive_is_simulated(cylinder: vpm.Model) -> None:
    problem = InverseDynamicsProblem(cylinder, [cylinder_record(cylinder, ())])
    assert problem.shown == ()
    ((_, share, _),) = gaps(problem, problem.evaluate(cylinder, cylinder.theta)[0]).values()
    assert share < 0.02


def test_derivatives_are_slopes(cylinder: vpm.Model) -> None:
    problem = InverseDynamicsProblem(cylinder, [cylinder_record(cylinder)])
    names = (
        "pump.oil.bulk_modulus",
        "servo.valve.flow_gain",
        "slide.mass",
        "servo.cylinder.bore",
        "axis.friction.viscous",
    )
    _, exact = problem.evaluate(cylinder, cylinder.theta, [cylinder.index(name) for name in names])
    for column, name in enumerate(names):
        size = 1e-4 * cylinder.parameters[name].value
        slope = of_residual(problem, cylinder, cylinder.index(name), size)
        assert np.abs(slope - exact[:, column]).max() < 2e-3 * np.abs(slope).max(), name


def test_an_elastic_link_balances_and_a_rigid_one_does_not() -> None:
    model = arm()
    time = np.arange(3000) * DT
    torque = 0.4 * np.sin(2 * np.pi * 1.1 * time) + 0.3 * np.sin(2 * np.pi * 4.3 * time)
    given = vpm.Experiment.from_arrays(time, {"motor.command": torque}, units={"motor.command": "A"})
    run = vpm.simulate(model, given, substeps=2)
    data = {"motor.command": torque, "shoulder.position": run["shoulder.position"]}
    record = vpm.Experiment.from_arrays(time, data, units={"motor.command": "A", "shoulder.position": "rad"})
    shares = {}
    for level in ("strain(4)", "rigid"):
        one = arm(level)
        problem = InverseDynamicsProblem(one, [record], cutoff=40.0)
        ((_, shares[level], _),) = gaps(problem, problem.evaluate(one, one.theta)[0]).values()
    assert shares["strain(4)"] < 0.03  # of the effort
    assert shares["rigid"] > 3.0 * shares["strain(4)"]


def geared(level: str = "strain(4)", **more: object) -> vpm.Model:
    """The arm with a winding, whose current follows its voltage and the motion, and a gauge at the root."""
    content = arm(level).to_dict()
    content["actuators"]["motor"] = {
        "type": "dc_motor",
        "joint": "shoulder",
        "command_unit": "V",
        "resistance": 1.0,
        "time_constant": 1e-3,
        "torque_constant": 0.1,
        "gear_ratio": 10.0,
        "efficiency": 0.9,
    }
    content["gauges"] = {"root": {"beam": "link", "at": 0.05, "x": 0.0, "y": 1e-3}}
    return vpm.Model.from_dict({**content, **more})


def test_a_drive_with_states_of_its_own_balances_a_link_that_bends() -> None:
    """The motor feels the joint alone: current, strain and effort are those of a simulation of both."""
    model, time = geared(), np.arange(2000) * DT
    voltage = 0.8 * np.sin(2 * np.pi * 1.1 * time) + 0.6 * np.sin(2 * np.pi * 4.3 * time)
    given = vpm.Experiment.from_arrays(time, {"motor.command": voltage}, units={"motor.command": "V"})
    run = vpm.simulate(model, given, substeps=2)
    channels = ("shoulder.position", "motor.current", "root.strain")
    record = vpm.Experiment.from_arrays(
        time, {"motor.command": voltage, **{channel: run[channel] for channel in channels}}, model=model
    )
    shares = {}
    for level in ("strain(4)", "rigid"):
        one = geared(level)
        problem = InverseDynamicsProblem(one, [record], cutoff=40.0)
        assert set(problem.shown) == {"motor.current", "root.strain"}
        left = gaps(problem, problem.evaluate(one, one.theta)[0])
        shares[level] = {channel: share for channel, (_, share, _) in left.items()}
    bent = shares["strain(4)"]
    assert bent["motor.current"] < 0.01
    assert bent["root.strain"] < 1e-3
    assert bent["shoulder.effort"] < 0.03 < 0.3 * shares["rigid"]["shoulder.effort"]
    problem, names = InverseDynamicsProblem(model, [record], cutoff=40.0), ("motor.resistance", "link.young")
    _, slopes = problem.evaluate(model, model.theta, [model.index(name) for name in names])
    for name, slope in zip(names, slopes.T, strict=True):
        sides = []
        for factor in (1.0 + 1e-4, 1.0 - 1e-4):
            moved = model.with_parameters({name: factor * model.parameters[name].value})
            sides.append(problem.evaluate(moved, moved.theta)[0])
        exact = (sides[0] - sides[1]) / (2e-4 * model.parameters[name].value)
        assert np.abs(slope - exact).max() < 2e-3 * np.abs(exact).max(), name


def test_what_cannot_be_balanced_is_refused() -> None:
    """A drive with states of its own beside a joint that nobody measured and no effect has split off."""
    content = geared().to_dict()
    tail = {"mass": 0.1, "inertia": [1e-4, 1e-4, 1e-4, 0.0, 0.0, 0.0]}
    swings = {"type": "revolute", "parent": "hub", "child": "tail", "axis": [0.0, 0.0, 1.0]}
    bodies, joints = {**content["bodies"], "tail": tail}, {**content["joints"], "loose": swings}
    model = geared(bodies=bodies, joints=joints)
    time = np.arange(500) * DT
    data = {"motor.command": np.sin(time), "shoulder.position": np.sin(3 * time)}
    record = vpm.Experiment.from_arrays(time, data, units={"motor.command": "V", "shoulder.position": "rad"})
    with pytest.raises(SimulationError, match="leaves link, loose free while the actuator motor has type dc_motor"):
        InverseDynamicsProblem(model, [record])


def test_what_diverges_along_a_motion_says_when(cylinder: vpm.Model) -> None:
    """The way begins with the record, not behind the settling of its filter."""
    problem = InverseDynamicsProblem(cylinder, [cylinder_record(cylinder)])
    assert problem.motions[0].edge > 10
    theta = cylinder.theta.copy()
    theta[cylinder.index("servo.valve.flow_gain")] = 1e200
    with pytest.raises(DivergedError, match=r"sample 2\)") as raised:
        problem.evaluate(cylinder, theta)
    assert raised.value.time == pytest.approx(2 * DT)
