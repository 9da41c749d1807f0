"""A leg that hops on a vertical guide, by elementary laws in small explicit steps: its guide has no drive.

Height, both motors and the ground's force are logged. The foot slides on smooth ground, so that nothing holds it but
the guide.
"""

import numpy as np

from vpm.experiment import Experiment
from vpm.model import Model

TRUNK, THIGH, SHANK = 3.0, 1.2, 0.5
LENGTH, CENTRES, INERTIAS = 0.25, (0.10, 0.11), (0.008, 0.004)
STIFFNESS, DAMPING, DEPTH = 4e4, 150.0, 2e-3
GAIN, DRY, OIL, SLOW = 9.0, (0.5, 0.4), (0.08, 0.06), 0.02
STEP, FINE, GRAVITY = 2e-3, 20, 9.81

_JOINTS = "".join(
    f"""
[[effects]]
type = "coulomb_friction"
at = "{joint}"
coulomb = {{ value = {1.05 * dry}, uncertainty = 0.1 }}
transition_velocity = {SLOW}
[[effects]]
type = "viscous_friction"
at = "{joint}"
viscous = {{ value = {0.92 * oil}, uncertainty = 0.02 }}
[actuators.{joint}_motor]
joint = "{joint}"
gain = {GAIN}
[sensors.{joint}_encoder]
measures = "{joint}.position"
resolution = 5e-5
"""
    for joint, dry, oil in zip(("hip", "knee"), DRY, OIL, strict=True)
)
#: The leg with friction in its joints, a twentieth off, and none in the guide.
HOPPER = f"""
name = "hopper"
gravity = [0, 0, {-GRAVITY}]
[bodies.trunk]
mass = {TRUNK}
[bodies.thigh]
mass = {THIGH}
center_of_mass = [0, 0, {-CENTRES[0]}]
inertia = [{INERTIAS[0]}, {INERTIAS[0]}, 0.001, 0, 0, 0]
[bodies.shank]
mass = {SHANK}
center_of_mass = [0, 0, {-CENTRES[1]}]
inertia = [{INERTIAS[1]}, {INERTIAS[1]}, 0.0005, 0, 0, 0]
[joints.guide]
type = "prismatic"
parent = "world"
child = "trunk"
axis = [0, 0, 1]
[joints.hip]
type = "revolute"
parent = "trunk"
child = "thigh"
axis = [0, -1, 0]
[joints.knee]
type = "revolute"
parent = "thigh"
child = "shank"
axis = [0, -1, 0]
translation = [0, 0, {-LENGTH}]
[contacts.foot]
parent = "shank"
point = [0, 0, {-LENGTH}]
plane = {{ normal = [0, 0, 1] }}
stiffness = {{ value = {1.03 * STIFFNESS}, uncertainty = {0.1 * STIFFNESS} }}
damping = {DAMPING}
damping_depth = {DEPTH}
[sensors.height]
measures = "guide.position"
noise = 1e-4
[sensors.plate]
measures = "foot.normal_force"
noise = 2.0
{_JOINTS}"""


def hopped(*, dry: float = 0.0, oil: float = 0.0, seed: int, duration: float = 8.0) -> Experiment:
    """A record, with dry friction (N) and friction of oil (N s/m) in the guide."""
    random = np.random.default_rng(seed)
    pace, turn, reach = 0.9 + 0.4 * random.random(), 6.0 * random.random(), 0.28 + 0.12 * random.random()
    x, v = np.array([0.42, 0.5, -1.0]), np.zeros(3)
    told, force = [], 0.0
    for sample in range(int(duration / STEP)):
        time = sample * STEP
        stretch = 1.2 * reach * (0.5 + 0.5 * np.sin(2.0 * np.pi * pace * time + turn)) ** 3
        wanted = np.array([0.75 - stretch + 0.05 * np.sin(2.3 * time), -1.5 + 2.0 * stretch])
        torques = np.clip(60.0 * (wanted - x[1:]) - np.array([2.5, 2.0]) * v[1:], -22.0, 22.0)
        commands = np.round(torques / GAIN, 3)
        told.append([*x, *commands, force])
        for _ in range(FINE):
            rates, force = _accelerations(x, v, GAIN * commands, (dry, oil))
            v = v + STEP / FINE * rates
            x = x + STEP / FINE * v
    z, hip, knee, first, second, force_of_ground = np.array(told).T
    motion = {
        "guide.position": z + 1e-4 * random.standard_normal(len(z)),
        "hip.position": 5e-5 * np.round(hip / 5e-5),
        "knee.position": 5e-5 * np.round(knee / 5e-5),
        "hip_motor.command": first,
        "knee_motor.command": second,
        "foot.normal_force": force_of_ground + 2.0 * random.standard_normal(len(z)),
    }
    model = Model.from_toml(HOPPER)
    return Experiment.from_arrays(STEP * np.arange(len(z)), motion, model=model, name=f"hopped {seed}")


def _accelerations(
    x: np.ndarray, v: np.ndarray, torques: np.ndarray, guide: tuple[float, float]
) -> tuple[np.ndarray, float]:
    """Of height, hip and knee, by virtual work of point masses and their turning, and the force of the ground."""
    hip, both, turning = x[1], x[1] + x[2], v[1] + v[2]
    mass, load = np.diag([TRUNK, 0.0, 0.0]), np.array([-TRUNK * GRAVITY, 0.0, 0.0])
    mass[1:, 1:] += [[sum(INERTIAS), INERTIAS[1]], [INERTIAS[1], INERTIAS[1]]]
    # Places are (r sin, z - r cos) of the angles of both links.
    for weight, near, far in ((THIGH, CENTRES[0], 0.0), (SHANK, LENGTH, CENTRES[1])):
        across = [0.0, near * np.cos(hip) + far * np.cos(both), far * np.cos(both)]
        along = [1.0, near * np.sin(hip) + far * np.sin(both), far * np.sin(both)]
        moves = np.array([across, along])
        swung = np.array(
            [
                -near * np.sin(hip) * v[1] ** 2 - far * np.sin(both) * turning**2,
                near * np.cos(hip) * v[1] ** 2 + far * np.cos(both) * turning**2 + GRAVITY,
            ]
        )
        mass += weight * moves.T @ moves
        load -= weight * moves.T @ swung
    foot = np.array([1.0, LENGTH * (np.sin(hip) + np.sin(both)), LENGTH * np.sin(both)])
    depth, sinking = LENGTH * (np.cos(hip) + np.cos(both)) - x[0], -float(foot @ v)
    share = np.clip(depth / DEPTH, 0.0, 1.0)
    force = max(0.0, STIFFNESS * depth + DAMPING * share**2 * (3.0 - 2.0 * share) * sinking) if depth > 0.0 else 0.0
    load += foot * force
    load[0] -= guide[0] * np.tanh(v[0] / 0.01) + guide[1] * v[0]
    load[1:] += torques - np.array(DRY) * np.tanh(v[1:] / SLOW) - np.array(OIL) * v[1:]
    return np.linalg.solve(mass, load), force
