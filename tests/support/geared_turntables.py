"""Two turntables behind gears whose friction takes many times the torque of their inertia, by Newton's law."""

import numpy as np

import vpm

MODEL = vpm.Model.from_toml("""
name = "geared turntables"
gravity = [0.0, 0.0, -9.81]
bodies.near = { mass = 1.0, inertia = [0.02, 0.02, { value = 0.02, uncertainty = 0.002 }, 0.0, 0.0, 0.0] }
bodies.far = { mass = 1.0, inertia = [0.005, 0.005, { value = 0.005, uncertainty = 0.0005 }, 0.0, 0.0, 0.0] }
joints.one = { type = "revolute", parent = "world", child = "near", axis = [0.0, 0.0, 1.0] }
joints.two = { type = "revolute", parent = "world", child = "far", axis = [0.0, 0.0, 1.0] }
actuators.m1 = { joint = "one", gain = 1.0, command_unit = "N m" }
actuators.m2 = { joint = "two", gain = 1.0, command_unit = "N m" }
""")
INERTIA, DRY, DRAG = np.array([0.02, 0.005]), np.array([0.9, 0.5]), np.array([0.6, 0.3])


def log(
    seed: int, factors: tuple[float, float] = (1.0, 1.0), dry: tuple[float, float] = (DRY[0], DRY[1])
) -> vpm.Experiment:
    """Angles (rad) and torques (N m) of a motion about a reference; angles are logged times ``factors``."""
    drawn, dt, steps = np.random.default_rng(seed), 0.004, 32
    tones, phases = drawn.uniform(0.15, 0.6, (2, 3)), drawn.uniform(0.0, 2.0 * np.pi, (2, 3))
    time = np.arange(0.0, 10.0, dt)
    q, v, angles, torques = np.sum(np.sin(phases), axis=1), np.zeros(2), [], []
    for t in time:
        torque = 30.0 * (np.sum(np.sin(2.0 * np.pi * tones * t + phases), axis=1) - q) - 0.3 * v
        angles.append(q + 2e-5 * drawn.standard_normal(2))
        torques.append(torque)
        for _ in range(steps):
            v = v + dt / steps * (torque - np.array(dry) * np.tanh(v / 0.02) - DRAG * v) / INERTIA
            q = q + dt / steps * v
    (q1, q2), (m1, m2) = np.array(angles).T * np.array(factors)[:, None], np.array(torques).T
    columns = {"one.position": q1, "two.position": q2, "m1.command": m1, "m2.command": m2}
    return vpm.Experiment.from_arrays(time, columns, {}, name=f"log {seed}", model=MODEL)
