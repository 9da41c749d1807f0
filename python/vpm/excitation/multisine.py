"""Multisines: sums of sines of one period with chosen amplitudes, and phases that keep the peaks low."""

from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vpm.errors import ExcitationError
from vpm.excitation.excitation import Excitation, check_band, check_positive, clock
from vpm.numbers import Array

#: Called with (iterations so far, crest factor).
Progress = Callable[[int, float], None]

#: Powers of the norms that lead from the root mean square to the peak, one after the other.
NORMS = (4, 8, 16, 32, 64, 128, 256)

#: Points per period of the highest sine while phases are optimised.
OVERSAMPLING = 16


def multisine(
    channel: str,
    unit: str = "1",
    *,
    band: tuple[float, float],
    period: float,
    time_step: float,
    peak: float,
    periods: int = 1,
    shape: Callable[[Array], ArrayLike] | None = None,
    odd: bool = False,
    phases: Literal["optimised", "schroeder", "random", "zero"] = "optimised",
    seed: int = 0,
    progress: Progress | None = None,
) -> Excitation:
    """Sum of sines at multiples of ``1/period`` within a band.

    Low peaks put more power into the same range of an actuator. Phases by M. Schroeder, "Synthesis of Low-Peak-Factor
    Signals and Binary Sequences With Low Autocorrelation", *IEEE Trans. Information Theory* 16, 1970; optimised ones
    go on from there to the least norm of rising power (P. Guillaume et al., "Crest-Factor Minimization Using Nonlinear
    Chebyshev Approximation Methods", *IEEE Trans. Instrumentation and Measurement* 40, 1991).

    Parameters
    ----------
    band : tuple of float
        Lowest and highest frequency, Hz.
    period : float
        s; its inverse is the distance of the lines of the spectrum.
    time_step : float
        s; the period is a whole number of them.
    peak : float
        Largest absolute value, also between samples, in `unit`.
    periods : int
        How often the period is repeated; the first ones carry the transient of the machine.
    shape : callable, optional
        Relative amplitude for frequencies in Hz; flat by default.
    odd : bool
        Odd multiples only: even ones of the response are then due to nonlinearity.
    phases : {"optimised", "schroeder", "random", "zero"}
    seed : int
        For random phases.
    progress : callable, optional
        Called during the optimisation; ``KeyboardInterrupt`` ends it.

    Raises
    ------
    ExcitationError
        The band holds no line or cannot be sampled, or a number is not positive.
    """
    check_positive(peak, "peak")
    check_positive(period, "period")
    time = clock(period, time_step, whole=True)
    check_band(*band, time_step, "band")
    if periods < 1:
        raise ExcitationError(f"{periods} periods are none; give at least one")
    lines = np.arange(1, time.size // 2 + 1)
    inside = (lines >= band[0] * period - 1e-9) & (lines <= band[1] * period + 1e-9) & (2 * lines < time.size)
    lines = lines[inside & (lines % 2 == 1)] if odd else lines[inside]
    if not lines.size:
        raise ExcitationError(
            f"no {'odd ' if odd else ''}multiple of {1.0 / period:g} Hz lies between {band[0]:g} and {band[1]:g} Hz; "
            "give a wider band or a longer period"
        )
    amplitudes = _amplitudes(lines / period, shape)
    angles = _phases(lines, amplitudes, phases, seed, progress)
    amplitudes = amplitudes * (peak / peak_bound(lines, amplitudes, angles))
    grid = 2.0 * np.pi * np.outer(time / period, lines)
    once = np.cos(grid + angles) @ amplitudes
    values = np.tile(once, periods)
    note = (
        f"{lines.size} sines from {lines[0] / period:.6g} Hz to {lines[-1] / period:.6g} Hz with {phases} phases; "
        f"crest factor {peak / np.sqrt(0.5 * np.sum(amplitudes**2)):.4g}."
    )
    times = np.asarray(time_step * np.arange(values.size), dtype=np.float64)
    return Excitation("multisine", times, values[:, None], (channel,), (unit,), (note,))


def schroeder_phases(amplitudes: Array) -> Array:
    """Multisine phases of low peaks, rad: ``-2 pi sum_{l<k} (k - l) p_l`` with power shares ``p``.

    For equal amplitudes of K sines that is ``-pi k (k - 1) / K``.
    """
    shares = amplitudes**2 / np.sum(amplitudes**2)
    return np.asarray(-2.0 * np.pi * np.concatenate([[0.0], np.cumsum(np.cumsum(shares))[:-1]]))


def peak_bound(lines: NDArray[np.int64], amplitudes: Array, angles: Array) -> float:
    """Bound of a multisine's largest absolute value over all times.

    The largest of M samples, divided by ``cos(pi n / M)`` for a highest multiple n (S. Bernstein's inequality; H.
    Ehlich and K. Zeller, *Mathematische Zeitschrift* 86, 1964): 0.5 % above it at most, with 32 samples to each.
    """
    highest = int(lines[-1])
    count = 32 * highest
    return float(np.max(np.abs(_wave(lines, amplitudes, angles, count))) / np.cos(np.pi * highest / count))


def _wave(lines: NDArray[np.int64], amplitudes: Array, angles: Array, count: int) -> Array:
    spectrum = np.zeros(count // 2 + 1, dtype=np.complex128)
    spectrum[lines] = 0.5 * count * amplitudes * np.exp(1j * angles)
    return np.asarray(np.fft.irfft(spectrum, count))


def _amplitudes(frequency: Array, shape: Callable[[Array], ArrayLike] | None) -> Array:
    given: Array = np.ones(frequency.size) if shape is None else np.asarray(shape(frequency), dtype=np.float64)
    if given.shape != frequency.shape or not np.all(np.isfinite(given)) or np.any(given < 0.0) or not given.any():
        raise ExcitationError(
            f"the shape gives {given.shape} values for {frequency.size} frequencies, or values that are no amplitudes; "
            "return one finite number of at least 0 for each, not all of them 0"
        )
    return np.asarray(given / np.sqrt(0.5 * np.sum(given**2)))


def _phases(lines: NDArray[np.int64], amplitudes: Array, kind: str, seed: int, progress: Progress | None) -> Array:
    match kind:
        case "zero":
            return np.zeros(lines.size)
        case "random":
            return np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, lines.size)
        case "schroeder":
            return schroeder_phases(amplitudes)
        case "optimised":
            return _optimised(lines, amplitudes, progress)
    raise ExcitationError(f'phases="{kind}" are not known; choose "optimised", "schroeder", "random" or "zero"')


def _optimised(lines: NDArray[np.int64], amplitudes: Array, progress: Progress | None) -> Array:
    """Multisine phases of least peak, by norms of rising power; never worse than the start."""
    from scipy.optimize import minimize

    count = 1 << int(np.ceil(np.log2(OVERSAMPLING * lines[-1])))
    done = 0

    def crest(angles: Array) -> float:
        return peak_bound(lines, amplitudes, angles)  # the root mean square is one

    def tell(xk: Array) -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, crest(np.asarray(xk)))

    best = angles = schroeder_phases(amplitudes)
    if lines.size == 1:
        return best
    for power in NORMS:
        result = minimize(
            partial(_log_norm, lines=lines, amplitudes=amplitudes, count=count, power=power),
            angles,
            jac=True,
            method="L-BFGS-B",
            callback=tell,
            options={"maxiter": 60},
        )
        angles = np.asarray(result.x, dtype=np.float64)
        best = angles if crest(angles) < crest(best) else best
    return best


def _log_norm(
    angles: Array, lines: NDArray[np.int64], amplitudes: Array, count: int, power: int
) -> tuple[float, Array]:
    """Logarithm of a multisine's norm of a power, and its derivative by the phases."""
    wave = _wave(lines, amplitudes, angles, count)
    top = float(np.max(np.abs(wave)))
    relative = wave / top
    mean = float(np.mean(relative**power))
    pull = np.fft.rfft(relative ** (power - 1))[lines] / (count * mean * top)
    # d wave / d angle_k = -a_k sin(k w t + angle_k): the imaginary part of the correlation with the k-th line.
    gradient = amplitudes * np.imag(np.conj(pull) * np.exp(1j * angles)) * -1.0
    return np.log(top) + np.log(mean) / power, np.asarray(gradient)
