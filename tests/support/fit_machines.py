"""Machines simulated without vpm, many records side by side, to count how often a fit is right about itself.

A linear axis (one mass, or two with a spring or a gap between them) and a vertical arm of two links, each under a
proportional-derivative controller that follows a sum of sines. Friction holds where it can, delays are queues.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from runge_kutta import moved
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array

DT, FINE, GRAVITY = 0.002, 4, 9.81
#: Size of a step of an encoder, and of the noise that stands for fine instruments, m or rad.
COUNT, INSTRUMENT = 5e-5, 2e-5


def sines(random: np.random.Generator, samples: int, machines: int, amplitude: float, lowest: float) -> Array:
    """Sums of four sines (samples, machines) from rest, frequencies and phases of their own for each machine."""
    time = DT * np.arange(samples)
    ramp = np.clip(time / 0.5, 0.0, 1.0)
    total = np.zeros((samples, machines))
    for ratio in (1.0, 2.7, 6.3, 10.4):
        frequency = lowest * ratio * (1.0 + 0.1 * random.uniform(-1.0, 1.0, machines))
        phase = random.uniform(0.0, 2.0 * np.pi, machines)
        total += amplitude / np.sqrt(ratio) * np.sin(2.0 * np.pi * frequency * time[:, None] + phase)
    return np.asarray((total - total[0]) * (ramp**2 * (3.0 - 2.0 * ramp))[:, None])


@dataclass(frozen=True)
class Axis:
    """A mass on a guide; with ``stiffness`` or ``gap`` two fifths of it hang behind a spring."""

    mass: float = 5.0
    viscous: float = 3.0
    gain: float = 4.0
    coulomb: float = 0.0
    stiffness: float = 0.0
    gap: float = 0.0
    delay: float = 0.0

    joints, drives, free = ("axis",), ("drive",), ("slide.mass", "axis.friction.viscous")

    @property
    def truth(self) -> Array:
        return np.array([self.mass, self.viscous])

    @property
    def model(self) -> Model:
        content = {
            "name": "axis",
            "gravity": [0, 0, 0],
            "bodies": {"slide": {"mass": {"value": 0.8 * self.mass, "unit": "kg", "uncertainty": 2.0, "min": 0.1}}},
            "joints": {"axis": {"type": "prismatic", "parent": "world", "child": "slide", "axis": [1, 0, 0]}},
            "actuators": {
                "drive": {
                    "joint": "axis",
                    "gain": {"value": self.gain, "unit": "N/A", "min": 0.01, "max": 100.0},
                    "command_unit": "A",
                }
            },
            "effects": [
                {
                    "type": "viscous_friction",
                    "at": "axis",
                    "viscous": {"value": 0.5 * self.viscous, "unit": "N s/m", "uncertainty": 3.0, "min": 0.0},
                }
            ],
        }
        return Model.from_dict(content)

    def run(self, machines: int, seed: int, seconds: float = 8.0) -> tuple[Array, Array]:
        """Positions and commands (samples, machines, 1)."""
        samples, h = round(seconds / DT), DT / FINE
        goal = sines(np.random.default_rng(seed), samples, machines, 0.1, 0.3)
        rate = np.gradient(goal, DT, axis=0)
        split = self.stiffness > 0.0 or self.gap > 0.0
        behind = 0.4 * self.mass
        mass, spring = self.mass - behind * split, self.stiffness or 4e4
        damper, late = 0.1 * np.sqrt(spring * behind), round(self.delay / h)
        q, v, x, w = np.zeros((4, machines))
        queue = [np.zeros(machines)] * (late + 1)
        positions, commands = np.zeros((2, samples, machines, 1))
        for sample in range(samples):
            command = (80.0 * (goal[sample] - q) + 12.0 * (rate[sample] - v)) * self.mass / self.gain
            positions[sample, :, 0], commands[sample, :, 0] = q, command
            for _ in range(FINE):
                queue = [*queue[-late:], command] if late else [command]
                force = self.gain * queue[0]
                if split:
                    apart = q - x
                    beyond = np.sign(apart) * np.maximum(np.abs(apart) - 0.5 * self.gap, 0.0)
                    pull = spring * beyond + damper * (v - w) * (np.abs(apart) >= 0.5 * self.gap)
                    w = w + h * pull / behind
                    x, force = x + h * w, force - pull
                # Viscous friction exactly over the step, then dry friction that stops where it can.
                decay = np.exp(-h * self.viscous / mass)
                ahead = v * decay + force / self.viscous * (1.0 - decay)
                ahead = np.sign(ahead) * np.maximum(np.abs(ahead) - h * self.coulomb / mass, 0.0)
                q, v = q + 0.5 * h * (v + ahead), ahead
        return positions, commands


@dataclass(frozen=True)
class Arm:
    """Two links in a vertical plane that turn about y; at zero they lie along x."""

    masses: tuple[float, float] = (4.0, 2.0)
    inertias: tuple[float, float] = (0.09, 0.03)
    viscous: tuple[float, float] = (1.5, 0.8)
    coulomb: float = 0.0
    delay: float = 0.0

    joints, drives = ("shoulder", "elbow"), ("first", "second")
    free = (
        "upper.inertia.yy",
        "fore.mass",
        "fore.inertia.yy",
        "shoulder.friction.viscous",
        "elbow.friction.viscous",
    )
    length, centres = 0.5, (0.25, 0.2)

    @property
    def truth(self) -> Array:
        return np.array([self.inertias[0], self.masses[1], self.inertias[1], *self.viscous])

    @property
    def model(self) -> Model:
        def body(place: int, share: float) -> dict[str, object]:
            inertia = self.inertias[place]
            yy = {"value": share * inertia, "unit": "kg m^2", "uncertainty": inertia}
            mass = {"value": share * self.masses[place], "unit": "kg", "uncertainty": 0.5}
            centre = [self.centres[place], 0, 0]
            return {"mass": mass, "center_of_mass": centre, "inertia": [inertia, yy, inertia, 0, 0, 0]}

        turning = {"type": "revolute", "axis": [0, 1, 0]}
        content = {
            "name": "arm",
            "gravity": [0, 0, -GRAVITY],
            "bodies": {"upper": body(0, 1.0) | {"mass": self.masses[0]}, "fore": body(1, 0.9)},
            "joints": {
                "shoulder": turning | {"parent": "world", "child": "upper"},
                "elbow": turning | {"parent": "upper", "child": "fore", "translation": [self.length, 0, 0]},
            },
            "actuators": {
                drive: {"joint": joint, "gain": {"value": 1.0, "unit": "N m/A"}, "command_unit": "A"}
                for drive, joint in zip(self.drives, self.joints, strict=True)
            },
            "effects": [
                {
                    "type": "viscous_friction",
                    "at": joint,
                    "viscous": {"value": 1.0, "unit": "N m s/rad", "uncertainty": 1.0, "min": 0.0},
                }
                for joint in self.joints
            ],
        }
        return Model.from_dict(content)

    def run(self, machines: int, seed: int, seconds: float = 8.0) -> tuple[Array, Array]:
        """Angles and commands (samples, machines, 2)."""
        samples, h, random = round(seconds / DT), DT / FINE, np.random.default_rng(seed)
        goal = np.stack([sines(random, samples, machines, a, f) for a, f in ((0.5, 0.25), (0.6, 0.33))], axis=-1)
        rate, late = np.gradient(goal, DT, axis=0), round(self.delay / h)
        q, v = np.zeros((2, machines, 2))
        queue = [np.zeros((machines, 2))] * (late + 1)
        positions, commands = np.zeros((2, samples, machines, 2))
        for sample in range(samples):
            command = np.array([250.0, 60.0]) * (goal[sample] - q) + np.array([35.0, 8.0]) * (rate[sample] - v)
            command = command + self._weight(q)
            positions[sample], commands[sample] = q, command
            for _ in range(FINE):
                queue = [*queue[-late:], command] if late else [command]
                q, v = moved(self._acceleration, q, v, queue[0], h)
        return positions, commands

    def _weight(self, q: Array) -> Array:
        """Efforts that hold the links."""
        (first, second), (near, far) = self.masses, self.centres
        elbow = -second * far * GRAVITY * np.cos(q[:, 0] + q[:, 1])
        shoulder = -(first * near + second * self.length) * GRAVITY * np.cos(q[:, 0]) + elbow
        return np.stack([shoulder, elbow], axis=-1)

    def _acceleration(self, q: Array, v: Array, effort: Array) -> Array:
        (first, second), (near, far) = self.masses, self.centres
        coupling, own = second * self.length * far, self.inertias[1] + second * far**2
        cosine, sine = coupling * np.cos(q[:, 1]), coupling * np.sin(q[:, 1])
        whole = self.inertias[0] + first * near**2 + second * self.length**2 + own + 2.0 * cosine
        mixed = own + cosine
        turning = np.stack([-sine * (2.0 * v[:, 0] * v[:, 1] + v[:, 1] ** 2), sine * v[:, 0] ** 2], axis=-1)
        rubbing = np.array(self.viscous) * v + self.coulomb * np.array([1.0, 0.5]) * np.tanh(v / 0.01)
        left = effort - rubbing - turning - self._weight(q)
        determinant = whole * own - mixed**2
        shoulder = (own * left[:, 0] - mixed * left[:, 1]) / determinant
        return np.stack([shoulder, (whole * left[:, 1] - mixed * left[:, 0]) / determinant], axis=-1)


def records(machine: Axis | Arm, kind: str, count: int, seed: int, effort: float = 0.05) -> list[Experiment]:
    """Records of a machine with noise of ``kind``: white, coloured (of effort, 50 ms long), or a counting encoder.

    ``effort`` is the noise of the logged commands, as a share of them.
    """
    random, model = np.random.default_rng(seed + 1), machine.model
    positions, commands = machine.run(count, seed)
    noise = random.standard_normal(commands.shape)
    if kind == "coloured":
        memory = np.exp(-DT / 0.05)
        noise = lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], noise, axis=0)
    commands = commands + effort * commands.std(axis=0) * noise
    if kind == "counted":
        phase = random.uniform(0.0, COUNT, positions.shape[1:])
        positions = np.round((positions + phase) / COUNT) * COUNT - phase
    else:
        positions = positions + INSTRUMENT * random.standard_normal(positions.shape)
    made = []
    for number in range(count):
        columns = {f"{joint}.position": positions[:, number, k] for k, joint in enumerate(machine.joints)}
        columns |= {f"{drive}.command": commands[:, number, k] for k, drive in enumerate(machine.drives)}
        time = DT * np.arange(len(positions))
        made.append(Experiment.from_arrays(time, columns, model=model, name=f"{kind} {number}"))
    return made
