"""A linear axis simulated without vpm: plain numbers at twenty times the sampling rate.

The friction here really sticks, the delay is a real queue and the encoder really counts: none of the package's
formulas is used, so that what the package finds is found in somebody else's data.
"""

from dataclasses import dataclass
from math import copysign, cos, exp, inf, pi

import numpy as np

from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array

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
    """What the machine really is; zero means that the effect is not there."""

    mass: float = 21.0
    viscous: float = 66.0
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
    saturation: float = inf
    cubic: float = 0.0
    noise: float = 2e-6
    force_noise: float = 0.0


class _Plant:
    """The moving parts."""

    def __init__(self, truth: Truth) -> None:
        self.truth = truth
        self.position = self.velocity = self.lagged = 0.0

    def advance(self, command: float, push: float, steps: int) -> None:
        """Fine steps under constant force, with friction that holds the axis where it can."""
        t, h = self.truth, DT / FINE
        answer = 1.0 - exp(-h / t.lag) if t.lag > 0.0 else 1.0
        command = copysign(min(max(abs(command) - t.dead_zone, 0.0), t.saturation), command)
        position, v, lagged = self.position, self.velocity, self.lagged
        for _ in range(steps):
            lagged += (command - lagged) * answer
            force = GAIN * lagged + push - t.bias - t.viscous * v - t.stiffness * position
            force -= 0.5 * t.viscous_difference * abs(v) + t.cubic * v * v * v
            if t.ripple:
                force -= t.ripple * cos(2.0 * pi * position / t.ripple_period)
            holding = t.coulomb
            if t.stribeck:
                holding += t.stribeck * exp(-((v / t.stribeck_velocity) ** 2))
            free = v + h * force / t.mass
            moving = copysign(max(abs(free) - h * holding / t.mass, 0.0), free)
            position += 0.5 * h * (v + moving)
            v = moving
        self.position, self.velocity, self.lagged = position, v, lagged


def reference(seconds: float, phases: Array) -> Array:
    """Sum of three sines from rest."""
    time = np.arange(0.0, seconds, DT)
    ramp = np.clip(time / 0.5, 0.0, 1.0) ** 2 * (3.0 - 2.0 * np.clip(time / 0.5, 0.0, 1.0))
    waves = zip((0.10, 0.04, 0.01), (0.31, 0.83, 2.3), phases, strict=True)
    path = sum(a * np.sin(2.0 * np.pi * f * time + p) for a, f, p in waves)
    return np.asarray(ramp * (path - path[0]))


def simulate_axis(truth: Truth, seeds: int, seconds: float, first_seed: int = 0) -> list[Experiment]:
    """Closed-loop records of the axis, one for each seed."""
    return [_record(truth, seconds, seed) for seed in range(first_seed, first_seed + seeds)]


def _record(truth: Truth, seconds: float, seed: int) -> Experiment:
    generator = np.random.default_rng(seed)
    target = reference(seconds, generator.uniform(0.0, 2.0 * np.pi, 3))
    noise, pushes = (
        (size * generator.standard_normal(round(seconds / DT) + 1)).tolist()
        for size in (truth.noise, truth.force_noise)
    )
    plant = _Plant(truth)
    measured: list[float] = []
    commands: list[float] = []
    whole, part = divmod(truth.delay / DT, 1.0)
    switch = round(part * FINE)
    before = mean_before = 0.0
    for k, place in enumerate(target.tolist()):
        y = COUNT * round((plant.position + noise[k]) / COUNT)
        mean = 0.5 * (y + (measured[-1] if k else y))
        speed = (mean - mean_before) / DT if k else 0.0
        mean_before = mean
        measured.append(y)
        commands.append(min(max(VELOCITY_GAIN * (POSITION_GAIN * (place - y) - speed), -LIMIT), LIMIT))
        late = commands[k - int(whole)] if k >= whole else 0.0
        plant.advance(before, pushes[k], switch)
        plant.advance(late, pushes[k], FINE - switch)
        before = late
    return _experiment(target, np.array(measured), np.array(commands), seed)


def _experiment(target: Array, position: Array, command: Array, seed: int) -> Experiment:
    time = DT * np.arange(len(target))
    channels = {"axis.position": position, "drive.command": command, "drive.reference": target}
    units = {"axis.position": "m", "drive.command": "V", "drive.reference": "m"}
    return Experiment.from_arrays(time, channels, units=units, name=f"seed {seed}")


def nominal() -> Model:
    """What the builder of the axis believes: other mass and friction, and none of the hidden effects."""
    return Model.from_toml(MODEL)
