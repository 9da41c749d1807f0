"""A late laser at the cage of a hoist: known parameters go far astray to make up for it."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from vpm import Experiment, Model, rank

STEP, FINE, COUNT, LATE = 2e-3, 10, 4000, 0.06
MASS, BALANCE, INERTIA, RADIUS, G = 420.0, 300.0, 125.0, 0.24, 9.81
ROPE, DAMPING, AT_DRUM, AT_CAGE, GAIN = 1.6e5, 600.0, 60.0, 80.0, 66.15

HOIST = """
name = "hoist"
gravity = [0.0, 0.0, -9.81]

[bodies.counterweight]
mass = { value = 300, uncertainty = 3 }
inertia = [300.0, 300.0, { value = 135, uncertainty = 12 }, 0.0, 0.0, 0.0]

[joints.drum]
type = "helical"
parent = "world"
child = "counterweight"
axis = [0.0, 0.0, 1.0]
pitch = -0.24

[bodies.cage]
mass = { value = 420, uncertainty = 4 }

[joints.guide]
type = "prismatic"
parent = "world"
child = "cage"
axis = [0.0, 0.0, 1.0]

[transmissions.rope]
ratios = { drum = 0.24, guide = -1.0 }

[actuators.motor]
joint = "drum"
gain = 66.15
command_unit = "A"

[sensors.laser]
measures = "guide.position"

[[effects]]
type = "spring"
at = "rope"
stiffness = { value = 1.48e5, uncertainty = 1.5e4 }
rest = { value = -0.0278, uncertainty = 0.003 }

[[effects]]
type = "viscous_friction"
at = "rope"
viscous = { value = 700, uncertainty = 200 }

[[effects]]
type = "viscous_friction"
at = "drum"
viscous = { value = 50, uncertainty = 20 }

[[effects]]
type = "viscous_friction"
at = "guide"
viscous = { value = 100, uncertainty = 40 }
"""


def ridden(seed: int, model: Model) -> Experiment:
    """A record of 8 s: drum and cage by Euler's method, the laser every 20 ms."""
    random = np.random.default_rng(seed)
    time = STEP * np.arange(COUNT)
    goal = CubicSpline(np.linspace(0.0, 8.0, 6), np.append(0.0, random.uniform(-1.5, 1.5, 5)))
    state, found, summed = np.array([0.0, 0.0, 0.0, 0.0]), np.empty((COUNT, 3)), (MASS - BALANCE) * G * RADIUS / GAIN
    for k, now in enumerate(time):
        error = 3.0 * (goal(now) - RADIUS * state[0]) + goal(now, 1) - RADIUS * state[1]
        summed += 40.0 * error * STEP
        command = 12.0 * error + summed + sum(0.4 * np.sin(2.0 * np.pi * rate * now) for rate in (0.7, 1.9, 3.3, 5.7))
        found[k] = state[0], state[2], command
        torque = GAIN * (command + 0.03 * random.standard_normal())
        for _ in range(FINE):
            pull = MASS * G + ROPE * (RADIUS * state[0] - state[2]) + DAMPING * (RADIUS * state[1] - state[3])
            turning = torque - RADIUS * (pull - BALANCE * G) - AT_DRUM * state[1]
            state[1] += STEP / FINE * turning / (INERTIA + BALANCE * RADIUS**2)
            state[3] += STEP / FINE * (pull - MASS * G - AT_CAGE * state[3]) / MASS
            state[[0, 2]] += STEP / FINE * state[[1, 3]]
    drum, cage, command = found.T
    seen = time[::10]
    laser = CubicSpline(seen, np.interp(seen - LATE, time, cage) + 4e-4 * random.standard_normal(len(seen)))(time)
    drum = drum + 6e-6 * random.standard_normal(COUNT)
    values = {"drum.position": drum, "guide.position": laser, "motor.command": command}
    return Experiment.from_arrays(time, values, model=model, name=f"run {seed}")


def test_parameters_that_the_file_rules_out_do_not_hide_a_late_laser() -> None:
    model = Model.from_toml(HOIST)
    records = [ridden(5, model), ridden(6, model)]
    found = rank(model, records, effects=["sensor_delay", "actuator_lag", "input_delay", "coulomb_friction"])
    assert [(one.effect, one.site) for one in found.effects] == [("sensor_delay", "laser")]
    values = {name: found.model.parameters[name].value for name in ("laser.delay.time", "rope.spring.stiffness")}
    assert values == pytest.approx({"laser.delay.time": LATE, "rope.spring.stiffness": ROPE}, rel=0.1)
