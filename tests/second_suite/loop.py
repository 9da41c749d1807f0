"""Machine, encoders, controller and drives in sampled time, many records side by side.

At sample k the encoders are read; the controller answers with a command that the drives hold until sample k + 1, and
the log keeps both in row k. A controller with a latency answers to earlier readings; its log holds what it gave out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from second_suite.machine import Array, Machine, Values
from second_suite.oil import OilPlant
from second_suite.plant import Hidden, Plant

#: Corner of the filter behind the difference of two readings, as share of the rate.
SPEED_FILTER = 0.12


@dataclass(frozen=True)
class Inputs:
    """What all columns are told: references and torques (samples, n, columns), and where the controller is on."""

    reference: Array
    torque: Array
    feedback: Array


@dataclass(frozen=True)
class Signals:
    """Readings and commands, (samples, n, columns), SI; pressures are (samples, gauges, columns)."""

    position: Array
    speed: Array
    command: Array
    pressure: Array


class Drives:
    """Commands to efforts: late, deaf to small ones, limited, slow."""

    def __init__(self, machine: Machine, hidden: Sequence[Hidden], step: float, columns: int) -> None:
        self.machine, self.step = machine, step
        self.at = {(h.effect, machine.index(h.site)): h.values for h in hidden if self._drive(h)}
        self.slow = np.zeros((len(machine.joints), columns))
        self.begun = False

    def _drive(self, h: Hidden) -> bool:
        return any(h.site == joint.drive for joint in self.machine.joints)

    def effort(self, history: Array, sample: int, sub: int, ripple: Array) -> Array:
        """Efforts of the step ``sub`` after a sample, from all commands so far."""
        out = np.zeros_like(self.slow)
        for i in self.machine.driven:
            late = round(self.at.get(("input_delay", i), {"time": 0.0})["time"] / self.step)
            row = (sample * self.machine.substeps + sub - late) // self.machine.substeps
            u: Array = history[max(row, 0), i]
            if ("dead_zone", i) in self.at:
                width = self.at["dead_zone", i]["width"]
                u = np.sign(u) * np.maximum(np.abs(u) - width, 0.0)
            if ("saturation", i) in self.at:
                limit = self.at["saturation", i]["limit"]
                u = np.clip(u, -limit, limit)
            if ("actuator_lag", i) in self.at:
                share = -np.expm1(-self.step / self.at["actuator_lag", i]["time"])
                self.slow[i] = self.slow[i] + share * (u - self.slow[i]) if self.begun else u
                u = self.slow[i]
            out[i] = self.machine.joints[i].gain * (u + ripple[i])
        self.begun = True
        return out


class Encoders:
    """Places to readings: late, scaled, shifted, with noise, in counts."""

    def __init__(self, machine: Machine, hidden: Sequence[Hidden], step: float) -> None:
        self.machine, self.step = machine, step
        self.at = {
            (h.effect, machine.index(h.site)): h.values
            for h in hidden
            if any(h.site == joint.encoder for joint in machine.joints)
        }
        self.late = {
            i: round(values["time"] / step) for (effect, i), values in self.at.items() if effect == "sensor_delay"
        }
        self.past: list[Array] = []

    def keep(self, place: Array) -> None:
        """Remember a place after a step, if anything is read late."""
        if self.late:
            self.past.append(place.copy())

    def read(self, place: Array, noise: Array, noisy: NDArray[np.bool_]) -> Array:
        """Readings now."""
        out = place.copy()
        for i, late in self.late.items():
            if self.past:
                out[i] = self.past[max(len(self.past) - 1 - late, 0)][i]
        for (effect, i), values in self.at.items():
            if effect == "sensor_gain":
                out[i] *= values["value"]
            elif effect == "sensor_offset":
                out[i] += values["value"]
        for i in self.machine.measured:
            joint = self.machine.joints[i]
            rough = out[i] + joint.noise * noise[i]
            if joint.resolution > 0.0:
                rough = joint.resolution * np.round(rough / joint.resolution)
            out[i] = np.where(noisy, rough, out[i])
        return out


class Gauges:
    """Pressures to readings: scaled, shifted, with noise, in counts."""

    def __init__(self, machine: Machine, hidden: Sequence[Hidden]) -> None:
        def of(effect: str, neutral: float) -> Array:
            found = {h.site: h.values["value"] for h in hidden if h.effect == effect}
            return np.array([[found.get(gauge.name, neutral)] for gauge in machine.gauges]).reshape(-1, 1)

        self.gain, self.offset = of("sensor_gain", 1.0), of("sensor_offset", 0.0)
        self.noise = np.array([gauge.noise for gauge in machine.gauges])[:, None]
        self.resolution = np.array([gauge.resolution for gauge in machine.gauges])[:, None]

    def read(self, pressure: Array, noise: Array, noisy: NDArray[np.bool_]) -> Array:
        """Readings now."""
        out = self.gain * pressure + self.offset
        rough = self.resolution * np.round((out + self.noise * noise) / self.resolution)
        return np.where(noisy, rough, out)


def plant_of(machine: Machine, values: Values, hidden: Sequence[Hidden], step: float) -> Plant:
    """The machine in time, with its oil if it has some."""
    kind = Plant if machine.line is None else OilPlant
    return kind(machine, values, hidden, step)


def simulated(
    machine: Machine,
    values: Values,
    hidden: Sequence[Hidden],
    inputs: Inputs,
    noisy: NDArray[np.bool_],
    rng: np.random.Generator,
) -> Signals:
    """All columns in closed loop, or open where the controller is off.

    - ``machine``, ``values``, ``hidden``: one structure, numbers by column
    - ``noisy``: shape (columns,), which columns have noise and counts
    - ``rng``: of the noise
    """
    samples, n, columns = inputs.reference.shape
    step = 1.0 / machine.rate / machine.substeps
    plant = plant_of(machine, values, hidden, step)
    first = inputs.reference[0]
    plant.start(first if machine.rest is None else machine.rest(plant.values, first))
    law, drives, encoders, gauges = (
        machine.law(machine, columns),
        Drives(machine, hidden, step, columns),
        Encoders(machine, hidden, step),
        Gauges(machine, hidden),
    )
    dt = 1.0 / machine.rate
    rates = np.gradient(inputs.reference, dt, axis=0)
    rates2 = np.gradient(rates, dt, axis=0)
    asked = np.stack([inputs.reference, rates, rates2], axis=1)
    shape = (samples, n, columns)
    position, speed, command = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    pressure = np.zeros((samples, len(machine.gauges), columns))
    seen_rate, share = np.zeros((n, columns)), -np.expm1(-2.0 * np.pi * SPEED_FILTER)
    on = inputs.feedback
    ripple_size = np.array([joint.drive_noise for joint in machine.joints])[:, None] * noisy
    tacho = [i for i, joint in enumerate(machine.joints) if joint.speed_unit]
    seen: list[tuple[Array, Array]] = []
    for k in range(samples):
        place, rate = plant.measured()
        position[k] = encoders.read(place, rng.standard_normal((n, columns)), noisy)
        pressure[k] = gauges.read(plant.pressures(), rng.standard_normal(pressure[k].shape), noisy)
        if k:
            seen_rate = seen_rate + share * ((position[k] - position[k - 1]) / dt - seen_rate)
        for i in tacho:
            speed[k, i] = rate[i] + noisy * machine.joints[i].speed_noise * rng.standard_normal(columns)
            seen_rate[i] = speed[k, i]
        seen.append((position[k], seen_rate))
        y, dy = seen[max(k - machine.latency, 0)]
        command[k] = on * law(k, y, dy, asked[k]) + inputs.torque[k]
        ripple = ripple_size * rng.standard_normal((n, columns))
        for sub in range(machine.substeps):
            plant.advance(drives.effort(command, k, sub, ripple))
            encoders.keep(plant.measured()[0])
    return Signals(position, speed, command, pressure)
