"""References: sums of sines that never repeat, and moves with rests, from rest at zero."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Array = NDArray[np.float64]


def smooth_step(x: Array) -> Array:
    """From 0 to 1 with two derivatives that vanish at both ends (quintic)."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x**3 * (10.0 - 15.0 * x + 6.0 * x**2))


def sines(generator: Generator, time: Array, reach: float, speed: float) -> Array:
    """Five sines, faded in and out, that reach ``reach`` and have a root mean square speed of about ``speed``."""
    slowest = speed / (0.8 * reach)
    rates = slowest * np.array([0.35, 0.8, 1.7, 3.5, 7.0]) * generator.uniform(0.85, 1.15, 5)
    sizes = np.array([1.0, 0.55, 0.25, 0.08, 0.025]) * generator.uniform(0.8, 1.2, 5)
    phases = generator.uniform(0.0, 2.0 * np.pi, 5)
    path = np.sum(sizes[:, None] * np.sin(rates[:, None] * time + phases[:, None]), 0)
    ends = smooth_step(time / 1.0) * smooth_step((time[-1] - time) / 1.0)
    path = ends * (path - path.mean())
    return np.asarray(reach * path / np.abs(path).max())


def jumps(generator: Generator, time: Array, size: float) -> Array:
    """Small jumps to and fro at irregular times, none near both ends, which make flexible links ring."""
    path, begin, side = np.zeros_like(time), 0.6, 1.0
    while begin < time[-1] - 1.0:
        end = begin + float(generator.uniform(0.5, 1.0))
        path += side * size * ((time >= begin) & (time < min(end, time[-1] - 0.5)))
        begin, side = end + float(generator.uniform(0.2, 0.8)), -side
    return path


def moves(generator: Generator, time: Array, reach: float, speed: float) -> Array:
    """Moves from place to place, each followed by a rest; the first two go to both ends of the reach."""
    path, place, begin = np.zeros_like(time), 0.0, 0.4
    ends = [reach * float(side) for side in generator.permutation((-1.0, 1.0))]
    while begin < time[-1] - 1.5:
        target = ends.pop() if ends else float(generator.uniform(-1.0, 1.0)) * reach
        if abs(target - place) < 0.3 * reach:
            target = float(-np.sign(place or 1.0)) * 0.7 * reach
        duration = 1.9 * abs(target - place) / (speed * float(generator.uniform(0.8, 2.2)))
        path += (target - place) * smooth_step((time - begin) / duration)
        place, begin = target, begin + duration + float(generator.uniform(0.1, 0.6))
    return path
