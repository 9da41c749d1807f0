"""Whole cycles of a record, and the sums over their harmonics."""

import numpy as np
from numpy.typing import NDArray

from vpm.errors import IdentificationError
from vpm.numbers import Array, Complex
from vpm.studies.impedance.channels import Columns
from vpm.studies.impedance.harmonics import Series, fundamental

#: Fewest samples in a cycle: two harmonics with twice as many samples as coefficients.
FEWEST_PER_CYCLE = 8
#: Share of a cycle that may be missing at the end: a series by least squares needs no exact end.
MISSING = 0.01


def whole_cycles(found: Columns, frequency: float | None) -> tuple[float, int, NDArray[np.bool_]]:
    """Frequency, number of whole cycles, and the samples in them."""
    time, x = found.time, found.values[0]
    if frequency is not None and not (np.isfinite(frequency) and frequency > 0.0):
        raise IdentificationError(f"frequency is {frequency} Hz; give a positive number")
    rate = fundamental(time, x) if frequency is None else float(frequency)
    step = float(np.median(np.diff(time)))
    held = (float(time[-1] - time[0]) + step) * rate
    cycles = int(held + MISSING)
    if cycles < (2 if frequency is None else 1):
        wanted = "two cycles to be estimated: give frequency=" if frequency is None else "one whole cycle: check it"
        raise IdentificationError(f"{found.name} holds {held:.3g} cycles of {rate:.4g} Hz, and it needs {wanted}")
    if 1.0 / (rate * step) < FEWEST_PER_CYCLE:
        raise IdentificationError(
            f"{found.name} has {1.0 / (rate * step):.3g} samples in a cycle of {rate:.4g} Hz, and a loop needs at "
            f"least {FEWEST_PER_CYCLE}; sample at {FEWEST_PER_CYCLE * rate:.4g} Hz or more"
        )
    return rate, cycles, time < time[0] + cycles / rate - 0.25 * step


def parts(time: Array, rate: float, cycles: int) -> list[NDArray[np.bool_]]:
    """Rows of a record that are the samples of each cycle."""
    at = np.minimum(((time - time[0]) * rate + 1e-9).astype(int), cycles - 1)
    return [at == cycle for cycle in range(cycles)]


def visible(series: Series, size: int) -> int:
    """Highest harmonic of the cycles that stands out of its noise, by four standard deviations."""
    limit = max(4.0 * series.noise * np.sqrt(2.0 / size), 1e-9 * float(np.abs(series.amplitudes).max()))
    out = np.flatnonzero(np.abs(series.amplitudes) > limit)
    return int(out[-1]) + 1 if out.size else 1


class Sums:
    """Sums over harmonics that energy, stiffness and damping are made of."""

    def __init__(self, moved: Series, pushed: Series, turn: Complex, rate: float, count: int, size: int) -> None:
        orders = np.arange(1, count + 1)
        self.x, self.f = moved.amplitudes[:count], (pushed.amplitudes * turn)[:count]
        squares = np.abs(self.x) ** 2 - 4.0 * moved.noise**2 / size
        self.orders, self.omega, self.size = orders, 2.0 * np.pi * rate, size
        both = self.f * np.conj(self.x)
        self.energy = float(np.pi * np.sum(orders * both.imag))
        self.viscous = float(np.pi * self.omega * np.sum(orders**2 * squares))
        self.structural = float(np.pi * np.sum(orders * squares))
        self.stiffness = float(np.sum(both.real) / np.sum(squares))
        self.damping = self.energy / self.viscous

    def spread(self, noise_x: float, noise_f: float) -> tuple[float, float, float]:
        """Standard deviations over cycles of stiffness, damping and energy by white noise, to first order."""
        squares = np.abs(self.x) ** 2
        reaction = self.stiffness**2 + (self.orders * self.omega * self.damping) ** 2
        each = 2.0 / self.size * squares * (noise_f**2 + reaction * noise_x**2)
        k = float(np.sqrt(each.sum()) / squares.sum())
        rates = self.orders * self.omega
        c = float(np.sqrt(np.sum(rates**2 * each)) / np.sum(rates**2 * squares))
        lost = 2.0 / self.size * (noise_f**2 * squares + noise_x**2 * np.abs(self.f) ** 2)
        return k, c, float(np.pi * np.sqrt(np.sum(self.orders**2 * lost)))
