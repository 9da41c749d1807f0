"""References and torques: moves from place to place with rests, sums of sines, chirps."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: Rest at the beginning of each record, and how long a sum of sines takes to begin [s].
REST, FADE = 0.4, 1.0


def fade(time: Array) -> Array:
    """From zero to one, smooth, after a rest."""
    x = np.clip((time - REST) / FADE, 0.0, 1.0)
    risen: Array = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    return risen


def moves(rng: np.random.Generator, time: Array, reach: float, speed: float) -> Array:
    """Moves of least jerk to random places within +-reach, none faster than speed, some of them slow."""
    path, place, begin = np.zeros_like(time), 0.0, REST
    while begin < time[-1]:
        target = float(np.sign(rng.uniform(-1, 1) - place / reach) * rng.uniform(0.2, 1.0) * reach)
        peak = speed * float(rng.choice([0.15, 0.5, 0.8, 1.0]))
        lasts = max(1.875 * abs(target - place) / peak, 0.25)
        x = np.clip((time - begin) / lasts, 0.0, 1.0)
        path += (target - place) * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        place, begin = target, begin + lasts + float(rng.uniform(0.05, 0.4))
    return path


def sines(rng: np.random.Generator, time: Array, reach: float, low: float, high: float, count: int = 5) -> Array:
    """A sum of sines with equal speeds between two frequencies [Hz], within +-reach."""
    rates = 2.0 * np.pi * np.geomspace(low, high, count) * rng.uniform(0.93, 1.07, count)
    wave = np.sin(np.outer(time, rates) + rng.uniform(0.0, 2.0 * np.pi, count)) @ (1.0 / rates)
    scaled: Array = reach * fade(time) * wave / np.abs(wave).max()
    return scaled


def chirp(rng: np.random.Generator, time: Array, reach: float, low: float, high: float) -> Array:
    """A sine whose frequency rises by the same factor each second, and whose speed stays."""
    rise = np.log(high / low) / time[-1]
    phase = 2.0 * np.pi * low * (np.exp(rise * time) - 1.0) / rise + rng.uniform(0.0, 2.0 * np.pi)
    waved: Array = reach * fade(time) * np.sin(phase) * np.exp(-0.8 * rise * time)
    return waved


def mixed(rng: np.random.Generator, time: Array, reach: float, speed: float, high: float) -> Array:
    """Moves with a small sum of sines on top."""
    both: Array = 0.8 * moves(rng, time, reach, speed) + 0.2 * sines(rng, time, reach, 0.5, high, 3)
    return both


def usual(rng: np.random.Generator, time: Array, record: int, reach: float, speed: float, high: float) -> Array:
    """What most axes run: moves, sines and a chirp to learn from, moves with sines to judge."""
    if record == 0:
        return moves(rng, time, reach, speed)
    if record == 1:
        return sines(rng, time, reach, 0.12, high)
    if record == 2:
        return chirp(rng, time, reach, 0.15, high)
    return mixed(rng, time, reach, speed, high)
