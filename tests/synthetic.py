"""A linear axis simulated without vpm: plain NumPy at twenty times the sampling rate, many seeds side by side.

The friction here really sticks, the delay is a real queue and the encoder really counts: none of the package's
formulas is used, so that what the package finds is found in somebody else's data.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Experiment
from vpm.model import Model

Array = NDArray[np.float64]

DT = 0.002
FINE = 20
POSITION_GAIN, VELOCITY_GAIN, LIMIT = 25.0, 120.0, 40.0
GAIN = 10.0
COUNT = 2e-6

MODEL = f"""
name = "synthetic axis"
gravity = [0.0, 0.0, 0.0]
[bodies.slide]
mass = {{ value = 20.0, unit = "kg", uncertainty = 4.0, min = 1.0, max = 100.0 }}
[joints.axis]
type = "prismatic"
parent = "world"
child = "slide"
axis = [1.0, 0.0, 0.0]
[actuators.drive]
joint = "axis"
gain = {{ value = {GAIN}, unit = "N/V" }}
command_unit = "V"
[sensors.encoder]
measures = "axis.position"
[controllers.servo]
type = "cascade"
actuator = "drive"
measures = "axis.position"
position_gain = {{ value = {POSITION_GAIN}, unit = "1/s" }}
velocity_gain = {{ value = {VELOCITY_GAIN}, unit = "V s/m" }}
limit = {{ value = {LIMIT}, unit = "V" }}
[[effects]]
type = "viscous_friction"
at = "axis"
viscous = {{ value = 60.0, unit = "N s/m", uncertainty = 20.0, min = 0.0, max = 1000.0 }}
"""


@dataclass(frozen=True)
class Truth:
    """What the machine really is; zero means that the effect is not there. Arrays hold one value for each seed."""

    mass: float | Array = 21.0
    viscous: float | Array = 66.0
    coulomb: float = 0.0
    stribeck: float = 0.0
    stribeck_velocity: float = 0.02
    bias: float = 0.0
    viscous_difference: float = 0.0
    stiffness: float = 0.0
    ripple: float = 0.0
    ripple_period: float = 0.02
    delay: float = 0.0
    dead_zone: float = 0.0
    lag: float = 0.0
    saturation: float = np.inf
    cubic: float = 0.0
    noise: float | Array = 2e-6
    force_noise: float | Array = 0.0


@dataclass
class _Plant:
    """The moving parts, one column for each seed."""

    truth: Truth
    position: Array
    velocity: Array
    lagged: Array
    step: float = DT / FINE
    extra: dict[str, float] = field(default_factory=dict)

    def advance(self, command: Array, disturbance: Array) -> None:
        """One fine step under constant force, with friction that holds the axis where it can."""
        t = self.truth
        command = np.clip(
            np.sign(command) * np.maximum(np.abs(command) - t.dead_zone, 0.0), -t.saturation, t.saturation
        )
        if t.lag > 0.0:
            self.lagged += (command - self.lagged) * (1.0 - np.exp(-self.step / t.lag))
            command = self.lagged
        v = self.velocity
        force = GAIN * command + disturbance - t.bias - t.viscous * v - t.stiffness * self.position
        force = force - 0.5 * t.viscous_difference * np.abs(v) - t.cubic * v * np.abs(v) ** 2
        force = force - t.ripple * np.cos(2.0 * np.pi * self.position / t.ripple_period)
        holding = t.coulomb + t.stribeck * np.exp(-((v / t.stribeck_velocity) ** 2))
        free = v + self.step * force / t.mass
        brake = self.step * holding / t.mass
        self.velocity = np.sign(free) * np.maximum(np.abs(free) - brake, 0.0)
        self.position = self.position + 0.5 * self.step * (v + self.velocity)


def reference(seconds: float, phases: Array, still: float = 0.0) -> Array:
    """Sum of three sines from rest, shape (samples, seeds); ``still`` is the share of the time spent waiting."""
    time = np.arange(0.0, seconds, DT)[:, None]
    ramp = np.clip(time / 0.5, 0.0, 1.0) ** 2 * (3.0 - 2.0 * np.clip(time / 0.5, 0.0, 1.0))
    waves = zip((0.10, 0.04, 0.01), (0.31, 0.83, 2.3), phases, strict=True)
    path = sum(a * np.sin(2.0 * np.pi * f * time + p) for a, f, p in waves)
    return np.asarray(ramp * (path - path[0]) * (1.0 - still))


def simulate_axis(truth: Truth, seeds: int, seconds: float, first_seed: int = 0) -> list[Experiment]:
    """Closed-loop records of the axis, one for each seed."""
    generators = [np.random.default_rng(first_seed + s) for s in range(seeds)]
    phases = np.array([g.uniform(0.0, 2.0 * np.pi, 3) for g in generators]).T
    noise = truth.noise * np.array([g.standard_normal(round(seconds / DT) + 1) for g in generators]).T
    pushes = truth.force_noise * np.array([g.standard_normal(round(seconds / DT) + 1) for g in generators]).T
    target = reference(seconds, phases)
    plant = _Plant(truth, np.zeros(seeds), np.zeros(seeds), np.zeros(seeds))
    measured, commands = np.zeros_like(target), np.zeros_like(target)
    whole, part = divmod(truth.delay / DT, 1.0)
    before, mean_before = np.zeros(seeds), np.zeros(seeds)
    for k in range(len(target)):
        y = COUNT * np.round((plant.position + noise[k]) / COUNT)
        previous = measured[k - 1] if k else y
        mean = 0.5 * (y + previous)
        speed = (mean - mean_before) / DT if k else np.zeros(seeds)
        mean_before = mean
        u = np.clip(VELOCITY_GAIN * (POSITION_GAIN * (target[k] - y) - speed), -LIMIT, LIMIT)
        measured[k], commands[k] = y, u
        late = commands[k - int(whole)] if k >= whole else np.zeros(seeds)
        switch = round(part * FINE)
        for fine in range(FINE):
            plant.advance(before if fine < switch else late, pushes[k])
        before = late
    return [_experiment(target[:, s], measured[:, s], commands[:, s], first_seed + s) for s in range(seeds)]


def _experiment(target: Array, position: Array, command: Array, seed: int) -> Experiment:
    time = DT * np.arange(len(target))
    channels = {"axis.position": position, "drive.command": command, "drive.reference": target}
    units = {"axis.position": "m", "drive.command": "V", "drive.reference": "m"}
    return Experiment.from_arrays(time, channels, units=units, name=f"seed {seed}")


def nominal() -> Model:
    """What the builder of the axis believes: other mass and friction, and none of the hidden effects."""
    return Model.from_toml(MODEL)
