"""A machine that falls over without its controller: a slow observer loses it, and nothing is missing."""

from __future__ import annotations

import numpy as np

import vpm

#: Pendulum that a motor holds above its joint: mass, kg; distance of its centre, m; inertia about it, kg m^2; viscous
#: friction of the joint, N m s/rad; step of the log, s; step of the encoder, rad. It falls at 9.2 rad/s, faster than an
#: observer of 1 Hz draws it back.
MASS, HEIGHT, TURN, DRAG, STEP, COUNTS = 2.0, 0.1, 0.003, 0.02, 2e-3, 2.0 * np.pi / 65536

PENDULUM = """
name = "inverted pendulum"
gravity = [0.0, 0.0, -9.81]
[bodies.rod]
mass = { value = 1.7, uncertainty = 0.25, min = 0.2 }
center_of_mass = [0.0, 0.0, 0.1]
inertia = [0.004, { value = 0.0035, uncertainty = 0.0006, min = 1e-4 }, 0.002, 0.0, 0.0, 0.0]
[joints.hinge]
type = "revolute"
parent = "world"
child = "rod"
axis = [0.0, 1.0, 0.0]
[actuators.motor]
joint = "hinge"
gain = 1.0
command_unit = "1"
[[effects]]
type = "viscous_friction"
at = "hinge"
viscous = { value = 0.03, uncertainty = 0.02 }
"""


def held(seed: int, model: vpm.Model) -> vpm.Experiment:
    """Record of a pendulum that a controller sways about the upright place: Newton's equation by small steps."""
    random = np.random.default_rng(seed)
    rates, phases = 2.0 * np.pi * np.array([0.4, 1.1, 2.3]), random.uniform(0.0, 6.0, 3)
    sizes, inertia, every = np.array([0.25, 0.12, 0.06]), TURN + MASS * HEIGHT**2, 20
    angle, speed, torque, before = float(sizes @ np.sin(phases)), 0.0, 0.0, None
    rows = np.empty((5000, 2))
    for k in range(len(rows) * every):
        if k % every == 0:
            read = round(angle / COUNTS) * COUNTS
            rate = 0.0 if before is None else (read - before) / STEP
            turn = rates * k * STEP / every + phases
            torque = 6.0 * (float(sizes @ np.sin(turn)) - read) + 0.3 * (float(sizes * rates @ np.cos(turn)) - rate)
            before, rows[k // every] = read, (read, torque)
        speed += STEP / every * (torque + MASS * 9.81 * HEIGHT * float(np.sin(angle)) - DRAG * speed) / inertia
        angle += STEP / every * speed
    columns = {"hinge.position": rows[:, 0], "motor.command": rows[:, 1]}
    return vpm.Experiment.from_arrays(STEP * np.arange(len(rows)), columns, model=model)


def test_an_observer_under_which_a_machine_falls_over_says_nothing() -> None:
    model = vpm.Model.from_toml(PENDULUM)
    effects = ["link_flexibility", "coulomb_friction", "bias_force", "payload", "spring"]
    ranking = vpm.rank(model, [held(1, model), held(2, model)], effects=effects, workers=1)
    assert ranking.effects == ()
    found = ranking.recalibrated.parameters
    assert abs(found["rod.mass"].value / MASS - 1.0) < 0.02
