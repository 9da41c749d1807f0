"""A sampled control loop around a machine: sensors that count, controllers that hold, drives with buffers.

Order within a sample: the true outputs are there; the sensors read them, late, scaled, shifted, noisy and in counts;
the controllers compute from the readings; the drives work on the held commands until the next sample.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from blind.loads import Array, Column, clip, stack


class Plant(Protocol):
    """A machine in continuous time."""

    def outputs(self) -> Array:
        """True values of all sensed channels, shape (sensors, columns)."""

    def advance(self, command: Array, time: float) -> None:
        """One fine step under what the drives have got, shape (actuators, columns)."""


class Actuators:
    """Delay by an exact buffer, then dead zone, limit and lag of each drive."""

    def __init__(self, names: Sequence[str], columns: Sequence[Column], dt: float, fine: int) -> None:
        delay = stack(columns, names, "input_delay.time") / dt
        self.whole = np.floor(delay).astype(np.int64)
        self.switch = (delay - self.whole) * fine
        self.width = stack(columns, names, "dead_zone.width")
        self.limit = stack(columns, names, "saturation.limit", np.inf)
        lag = stack(columns, names, "actuator_lag.time_constant")
        self.delayed, self.lags = bool(delay.any()), bool(lag.any())
        self.cut = bool(self.width.any() or np.isfinite(self.limit).any())
        step = dt / fine
        ratio = step / np.where(lag > 0.0, lag, 1e-30)
        self.decay = np.exp(-ratio)
        self.mean_share = np.where(lag > 0.0, -np.expm1(-ratio) / ratio, 0.0)
        self.history = np.zeros((int(self.whole.max()) + 2, *delay.shape))
        self.place = np.indices(delay.shape)
        self.state: Array | None = None
        self.new = self.old = np.zeros(delay.shape)
        self.noise = stack(columns, names, "noise")

    def sample(self, k: int, command: Array, noise: Array) -> None:
        """A new command and the noise of the drive (standard normal); before the first one, the first one is held."""
        command = command + self.noise * noise
        if self.delayed:
            if k == 0:
                self.history[:] = command
            size = len(self.history)
            self.history[k % size] = command
            self.new = self._cut(self.history[(k - self.whole) % size, *self.place])
            self.old = self._cut(self.history[(k - self.whole - 1) % size, *self.place])
        else:
            self.new = self._cut(command)
        if self.state is None:
            self.state = self.new.copy()

    def _cut(self, command: Array) -> Array:
        if not self.cut:
            return command
        beyond = command - clip(command, -self.width, self.width)
        return clip(beyond, -self.limit, self.limit)

    def step(self, j: int) -> Array:
        """Mean command over fine step ``j`` of the sample."""
        given = self.new
        if self.delayed:
            given = self.old + clip(j + 1 - self.switch, 0.0, 1.0) * (self.new - self.old)
        if not self.lags or self.state is None:
            return given
        mean = given + (self.state - given) * self.mean_share
        self.state = given + (self.state - given) * self.decay
        return mean


class Sensors:
    """Readings of true values: late, scaled, shifted, noisy, in counts."""

    def __init__(self, names: Sequence[str], columns: Sequence[Column], dt: float, fine: int) -> None:
        self.gain = 1.0 + stack(columns, names, "sensor_gain.excess")
        self.offset = stack(columns, names, "sensor_offset.value")
        self.noise = stack(columns, names, "noise")
        self.quantum = stack(columns, names, "quantum")
        self.counts = self.quantum > 0.0
        self.safe = np.where(self.counts, self.quantum, 1.0)
        self.late = stack(columns, names, "sensor_delay.time") * fine / dt
        self.delayed = bool(self.late.any())
        self.back = np.floor(self.late).astype(np.int64)
        self.history = np.zeros((int(self.back.max()) + 2, *self.late.shape))
        self.place = np.indices(self.late.shape)
        self.count = 0

    def keep(self, true: Array) -> None:
        """Remember true values of one fine step."""
        if self.delayed:
            if self.count == 0:
                self.history[:] = true
            self.history[self.count % len(self.history)] = true
            self.count += 1

    def read(self, true: Array, noise: Array) -> Array:
        """Readings, with standard normal numbers ``noise``."""
        if self.delayed:
            newest, size = self.count - 1, len(self.history)
            after = self.history[(newest - self.back) % size, *self.place]
            before = self.history[(newest - self.back - 1) % size, *self.place]
            true = after + (self.late - self.back) * (before - after)
        exact = self.gain * true + self.offset + self.noise * noise
        return np.where(self.counts, self.quantum * np.round(exact / self.safe), exact)


@dataclass
class Cascade:
    """``u = kv (kp (r - y) - dy)``, dy = (y[k] - y[k-2]) / (2 dt), within a limit."""

    position_gain: Array
    velocity_gain: Array
    limit: Array
    dt: float
    before: tuple[Array, Array] | None = None

    @classmethod
    def of(cls, columns: Sequence[Column], servos: Sequence[str], dt: float) -> Self:
        """The cascades of these servos, by their values."""
        outer, inner, limit = (stack(columns, servos, name) for name in ("position_gain", "velocity_gain", "limit"))
        return cls(outer, inner, limit, dt)

    def __call__(self, reference: Array, reading: Array) -> Array:
        last, second = self.before or (reading, reading)
        speed = (reading - second) / (2.0 * self.dt)
        self.before = (reading, last)
        wanted = self.velocity_gain * (self.position_gain * (reference - reading) - speed)
        return clip(wanted, -self.limit, self.limit)


@dataclass
class Proportional:
    """``u = kp (r - y)`` within a limit."""

    proportional: Array
    limit: Array

    def __call__(self, reference: Array, reading: Array) -> Array:
        return clip(self.proportional * (reference - reading), -self.limit, self.limit)


class Controller(Protocol):
    """Commands from references and readings, each of shape (actuators, columns)."""

    def __call__(self, reference: Array, reading: Array) -> Array: ...


@dataclass(frozen=True)
class Inputs:
    """What comes from outside."""

    references: Array  #: Shape (samples, actuators, records).
    owner: NDArray[np.int64]  #: The record whose reference a column follows; shape (columns,).
    #: Standard normal numbers. That of a drive is not in its logged command: the effort that it delivers is not
    #: quite what it was told; shape (samples, actuators and sensors, records).
    noise: Array
    loud: NDArray[np.int64]  #: The column of each record that has this noise; shape (records,).


def closed_loop(
    plant: Plant, controller: Controller, actuators: Actuators, sensors: Sensors, inputs: Inputs, dt: float, fine: int
) -> Array:
    """Readings and commands, shape (samples, sensors and actuators, columns).

    The first sensors are those that the controllers see, one for each actuator.
    """
    samples, drives = inputs.references.shape[:2]
    channels, columns = inputs.noise.shape[1], len(inputs.owner)
    seen, noise = np.zeros((samples, channels, columns)), np.zeros((channels, columns))
    sensed = channels - drives
    sensors.keep(plant.outputs())
    step = dt / fine
    for k in range(samples):
        noise[:, inputs.loud] = inputs.noise[k]
        seen[k, :sensed] = sensors.read(plant.outputs(), noise[drives:])
        seen[k, sensed:] = controller(inputs.references[k][:, inputs.owner], seen[k, :drives])
        actuators.sample(k, seen[k, sensed:], noise[:drives])
        for j in range(fine):
            plant.advance(actuators.step(j), k * dt + j * step)
            if sensors.delayed:
                sensors.keep(plant.outputs())
    return seen
