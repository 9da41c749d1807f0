"""Effects with a motion of their own: their inverse dynamics and its derivatives."""

import numpy as np

import vpm
from vpm.identify import InverseDynamicsProblem

DT = 1e-3
AXIS = """
name = "axis"
gravity = [0.0, 0.0, 0.0]
bodies.load = { mass = 1.0, inertia = [0.02, 0.02, 0.02, 0.0, 0.0, 0.0] }
joints.axis = { type = "revolute", parent = "world", child = "load", axis = [0, 0, 1], rotor_inertia = 0.01 }
actuators.drive = { joint = "axis", gain = 1.0, command_unit = "N m" }

[[effects]]
type = "viscous_friction"
at = "axis"
viscous = { value = 0.05, uncertainty = 0.02 }
"""
HYSTERESIS = {"force": 0.3, "displacement": 0.05, "shape": 0.0}


def record(truth: vpm.Model) -> vpm.Experiment:
    """The machine's own run, without noise, held by a spring so that it stays near."""
    held = truth.with_effect("spring", at="axis", stiffness=0.5, rest=0.0)
    time = np.arange(4000) * DT
    torque = sum(size * np.sin(2 * np.pi * f * time) for size, f in ((0.6, 0.7), (0.5, 1.9), (0.6, 4.3)))
    units = {"drive.command": "N m", "axis.position": "rad"}
    given = vpm.Experiment.from_arrays(time, {"drive.command": torque}, units={"drive.command": "N m"})
    run = vpm.simulate(held, given)
    data = {"drive.command": torque, "axis.position": run["axis.position"]}
    return vpm.Experiment.from_arrays(time, data, units=units)


def test_a_joint_that_winds_up_is_balanced_with_the_memory_of_its_motor_side() -> None:
    """The machine's own run balances, which neither the hysteresis nor the spring alone would do."""
    rigid = vpm.Model.from_toml(AXIS).with_effect("spring", at="axis", stiffness=0.5, rest=0.0)
    soft = rigid.with_effect("joint_compliance", at="axis", stiffness=20.0, damping=0.02)
    both = soft.with_effect("hysteresis", at="axis", **HYSTERESIS)
    data = InverseDynamicsProblem(rigid, [record(both.without_effect("spring", "axis"))])

    def left(model: vpm.Model) -> float:
        return float(np.sqrt(np.mean(data.evaluate(model, model.theta)[0] ** 2)))

    least = min(left(soft), left(rigid.with_effect("hysteresis", at="axis", **HYSTERESIS)))
    assert left(both) < 0.05 * least
    names = ("axis.hysteresis.force", "axis.compliance.stiffness", "axis.friction.viscous")
    _, slopes = data.evaluate(both, both.theta, [both.index(name) for name in names])
    for name, column in zip(names, slopes.T, strict=True):
        step = 1e-4 * both.parameters[name].value
        sides = [both.with_parameters({name: both.parameters[name].value + sign * step}) for sign in (1.0, -1.0)]
        more, less = (data.evaluate(side, side.theta)[0] for side in sides)
        assert np.linalg.norm(column - (more - less) / (2.0 * step)) < 0.02 * np.linalg.norm(column), name
