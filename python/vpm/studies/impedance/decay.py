"""Stiffness and damping of a mass that swings out or lands: the free motion itself, and the logarithmic decrement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import IdentificationError
from vpm.experiment import noise_std
from vpm.narx.records import RecordLike
from vpm.numbers import Array
from vpm.results import Result
from vpm.studies.impedance.channels import check_moves, columns

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult


#: Fewest samples of a decay.
FEWEST = 20
#: Smallest stroke of a decrement, as a share of the whole range: below it rounding turns the motion about.
LEAST_STROKE = 1e-3
#: Samples that the search for a start looks at.
COARSE = 400


@dataclass(frozen=True, repr=False, eq=False)
class Decay(Result):
    """Free motion ``m d2x/dt2 + c dx/dt + k (x - x_rest) = 0``.

    Attributes
    ----------
    stiffness, damping : float
        N/m, N s/m.
    stiffness_std, damping_std : float
        Of white noise.
    natural_frequency : float
        ``sqrt(k / m)``, rad/s.
    damping_ratio : float
        ``c / (2 sqrt(k m))``.
    rest : float
        x_rest, m; weight and other constant forces are in it.
    noise : float
        Root of the mean squared residual, m.
    """

    name: str
    stiffness: float
    damping: float
    stiffness_std: float
    damping_std: float
    natural_frequency: float
    damping_ratio: float
    rest: float
    noise: float
    notes: tuple[str, ...] = ()


def identify_decay(record: RecordLike, displacement: str, mass: float) -> Decay:
    """Fit the free motion of a known mass on a spring with a damper, oscillating or not.

    Frequency and damping ratio are searched, the rest, first place and first speed follow from each by linear least
    squares (variable projection, G. Golub, V. Pereyra, SIAM J. Numer. Anal. 10, 1973).

    Parameters
    ----------
    record : Experiment or mapping of str to array-like, shape (N,)
        From the instant at which no other force acts, such as touch-down.
    displacement : str
        Channel, m.
    mass : float
        kg.

    Raises
    ------
    IdentificationError
        The channel is missing or does not move, or the mass is no positive number.
    ExperimentError
        The channel holds values that are no numbers, time does not increase, or there are fewer than 20 samples.
    """
    from scipy.optimize import least_squares

    if not (np.isfinite(mass) and mass > 0.0):
        raise IdentificationError(f"mass is {mass} kg; give a positive number")
    found = columns(record, (displacement,), FEWEST)
    check_moves(found, displacement)
    time, x = found.time - found.time[0], found.values[0]
    scale = float(np.ptp(x))

    def left(place: Array, every: int = 1) -> Array:
        matrix = _motions(time[::every], float(np.exp(place[0])), float(np.exp(place[1])))
        return np.asarray(x[::every] - matrix @ np.linalg.lstsq(matrix, x[::every], rcond=None)[0]) / scale

    every = max(time.size // COARSE, 1)
    highest = np.log(np.pi / (4.0 * float(np.median(np.diff(time)))))
    rates = np.linspace(np.log(1.0 / time[-1]), highest, 40)
    starts = [
        min(([rate, ratio] for rate in rates), key=lambda place: float(np.sum(left(np.array(place), every) ** 2)))
        for ratio in np.log([0.005, 0.03, 0.1, 0.3, 0.7, 1.3, 3.0, 10.0])
    ]

    def ended(start: list[float]) -> OptimizeResult:
        # Bounds keep the logarithms where exp() means something: a ratio of 1e-6 is no damping.
        low, high = [start[0] - 3.0, np.log(1e-6)], [start[0] + 3.0, np.log(1e3)]
        return least_squares(left, start, bounds=(low, high), xtol=1e-14, ftol=1e-14, gtol=1e-14, x_scale=1.0)

    # An overdamped motion shows little but the ratio of both, along which a single fit may end anywhere.
    fit = min((ended(start) for start in starts), key=lambda fit: float(fit.cost))
    rate, ratio = map(float, np.exp(fit.x))
    matrix = _motions(time, rate, ratio)
    rest = float(np.linalg.lstsq(matrix, x, rcond=None)[0][0])
    jacobian = np.asarray(fit.jac, dtype=np.float64)
    variance = 2.0 * fit.cost / (time.size - 5)
    covariance = variance * np.linalg.pinv(jacobian.T @ jacobian)
    k, c = mass * rate**2, 2.0 * ratio * rate * mass
    k_std = k * 2.0 * float(np.sqrt(covariance[0, 0]))
    c_std = c * float(np.sqrt(covariance.sum()))
    notes = []
    if k_std > 0.2 * k or c_std > 0.2 * c:
        notes.append(
            f"the motion fixes stiffness to {100.0 * k_std / k:.0f} % and damping to {100.0 * c_std / c:.0f} % only; "
            "an overdamped landing shows little more than their ratio, so record the force and use identify_landing"
        )
    noise = float(np.sqrt(variance)) * scale
    return Decay(found.name, k, c, k_std, c_std, rate, ratio, rest, noise, tuple(notes))


def _motions(time: Array, rate: float, ratio: float) -> Array:
    """Rest, and two free decaying motions: shape (N, 3)."""
    inner = rate * np.sqrt(abs(1.0 - ratio**2))
    if ratio < 1.0:
        fade = np.exp(-ratio * rate * time)
        return np.column_stack(
            [np.ones_like(time), fade * np.cos(inner * time), fade * time * np.sinc(inner * time / np.pi)]
        )
    slow, fast = np.exp((inner - ratio * rate) * time), np.exp(-(inner + ratio * rate) * time)
    apart = 2.0 * inner * time
    # (slow - fast) / (2 inner) loses its digits near the aperiodic limit; expm1 keeps them.
    odd = np.where(apart > 1e-8, -slow * np.expm1(-apart) / max(2.0 * inner, 1e-300), slow * time)
    return np.column_stack([np.ones_like(time), 0.5 * (slow + fast), odd])


@dataclass(frozen=True, repr=False, eq=False)
class LogarithmicDecrement(Result):
    """Decrement of an oscillation that fades.

    Attributes
    ----------
    decrement : float
        ``ln(x_n / x_(n+1))`` of two maxima a period apart.
    decrement_std : float
        NaN with fewer than three strokes.
    damping_ratio : float
        ``delta / sqrt(4 pi^2 + delta^2)``.
    frequency : float
        Of the damped oscillation, Hz.
    strokes : int
        Strokes from one extreme to the next that were used.
    """

    name: str
    decrement: float
    decrement_std: float
    damping_ratio: float
    frequency: float
    strokes: int

    def stiffness(self, mass: float) -> float:
        """Stiffness from a decay, ``m omega_n^2``, N/m, with the undamped natural frequency."""
        natural = 2.0 * np.pi * self.frequency / np.sqrt(1.0 - self.damping_ratio**2)
        return float(mass * natural**2)

    def damping(self, mass: float) -> float:
        """Damping from a decay, ``2 m f delta``, N s/m."""
        return 2.0 * mass * self.frequency * self.decrement


def logarithmic_decrement(record: RecordLike, displacement: str) -> LogarithmicDecrement:
    """Logarithmic decrement of a decay, from strokes between neighbouring extremes.

    Parameters
    ----------
    record : Experiment or mapping of str to array-like, shape (N,)

    Raises
    ------
    IdentificationError
        Fewer than two strokes stand out of the noise.
    ExperimentError
        The channel holds values that are no numbers, time does not increase, or there are fewer than 20 samples.
    """
    found = columns(record, (displacement,), FEWEST)
    check_moves(found, displacement)
    times, places = _extremes(
        found.time,
        found.values[0],
        max(5.0 * noise_std(found.values[0]), LEAST_STROKE * float(np.ptp(found.values[0]))),
    )
    strokes = np.abs(np.diff(places))
    if strokes.size < 2:
        raise IdentificationError(
            f'{found.name}: "{displacement}" has {strokes.size} strokes between extremes that stand out of its noise, '
            "and a decrement needs two; where nothing oscillates use identify_decay"
        )
    n = np.arange(strokes.size)
    # The logarithm of a small stroke is as uncertain as the stroke is small.
    offset, slope = (float(one) for one in np.polynomial.polynomial.polyfit(n, np.log(strokes), 1, w=strokes))
    delta, free = -2.0 * slope, strokes.size - 2
    weights = strokes**2
    left = float(weights @ (np.log(strokes) - offset - slope * n) ** 2)
    middle = float(weights @ n / weights.sum())
    spread = 2.0 * float(np.sqrt(left / free / (weights @ (n - middle) ** 2))) if free else float("nan")
    frequency = 0.5 * (times.size - 1) / float(times[-1] - times[0])
    ratio = delta / float(np.sqrt(4.0 * np.pi**2 + delta**2))
    return LogarithmicDecrement(found.name, delta, spread, ratio, frequency, strokes.size)


def _extremes(time: Array, x: Array, least: float) -> tuple[Array, Array]:
    """Extremes of a decay whose strokes exceed `least`, each by a parabola."""
    turns = [0]
    heading = 0.0
    for at in range(1, x.size):
        away = x[at] - x[turns[-1]]
        if heading != 0.0 and away * heading > 0.0:
            turns[-1] = at  # the same way still
        elif abs(away) > least and away != 0.0:
            turns.append(at)
            heading = float(np.sign(away))
    inner = turns[1:-1]
    found = [_vertex(time, x, at, max(int(np.min(np.diff(turns))) // 6, 1)) for at in inner] if inner else []
    return np.array([t for t, _ in found]), np.array([v for _, v in found])


def _vertex(time: Array, x: Array, at: int, reach: int) -> tuple[float, float]:
    """Vertex of the parabola that fits a decay's samples about one of them."""
    part = slice(max(at - reach, 0), at + reach + 1)
    t = time[part] - time[at]
    if t.size < 3:
        return float(time[at]), float(x[at])
    c0, c1, c2 = (float(one) for one in np.polynomial.polynomial.polyfit(t / t[-1], x[part], 2))
    shift = -c1 / (2.0 * c2) * float(t[-1])
    return float(time[at] + shift), float(c0 - c1**2 / (4.0 * c2))
