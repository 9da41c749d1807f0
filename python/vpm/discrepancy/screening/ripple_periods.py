"""Start periods of effects that repeat along the way, from sums of the residual over the way."""

import numpy as np
from scipy.fft import next_fast_len

from vpm.discrepancy.settings import CELLS, FINER, MOST_WAVES, PASSED, PERIODS, SLOWEST
from vpm.numbers import Array


def ripple_periods(position: Array, values: Array, fewest: float) -> list[float]:
    """Start periods in ``position``: the strongest waves of the ``values``, then shorter ones that slow samples show.

    The first begin with ``fewest`` waves on the whole way; friction changes its sign with the motion, and half a wave
    suffices for it. They end where most samples pass too much of a wave until the next one. From there on each octave
    takes those that pass less. What a wave explains of their sum of squares counts.
    """
    travel = max(float(np.ptp(position)), 1e-12)
    place = (position - position.min()) / travel
    steps = np.abs(np.gradient(place))
    shortest = PASSED / max(float(np.median(steps)), 1.0 / len(values))
    most = max(min(shortest, MOST_WAVES), 4.0)
    found = _strongest([_periodogram(place, values, fewest, most)])
    octaves = []
    while shortest <= len(values):
        first, shortest = shortest, 2.0 * shortest
        slow = steps * shortest < PASSED
        if np.count_nonzero(slow) < SLOWEST:
            break
        octaves.append(_periodogram(place[slow], values[slow], first, shortest))
    short = _strongest(octaves) if octaves else []
    return [travel / waves for waves in (found or [fewest]) + [waves for waves in short if waves > most]]


def _periodogram(place: Array, values: Array, first: float, last: float) -> tuple[Array, Array]:
    """Waves on the whole way from the ``first`` to the ``last`` number, and what each explains of the squares.

    Law: least squares of a sine and a cosine, nearly orthogonal on many samples (N. Lomb, *Astrophysics and Space
    Science* 39, 1976); sums over cells of the way give all waves at once.
    """
    cells = next_fast_len(int(np.ceil(CELLS * last)), real=True)
    sums = np.bincount((place * cells).astype(np.int64), values - np.mean(values), cells + 1)
    power = np.abs(np.fft.rfft(sums, FINER * cells)) ** 2 * 2.0 / len(values)
    waves = np.arange(power.size) / FINER
    inside = (waves >= first) & (waves <= last)
    return waves[inside], power[inside]


def _strongest(spectra: list[tuple[Array, Array]]) -> list[float]:
    """Waves of the highest peaks of some spectra that follow each other, the highest first."""
    waves, power = (np.concatenate(part) for part in zip(*spectra, strict=True))
    inner = power[1:-1]
    peaks = np.flatnonzero((inner >= power[:-2]) & (inner > power[2:])) + 1
    return [float(waves[peak]) for peak in peaks[np.argsort(-power[peaks], kind="stable")][:PERIODS]]
