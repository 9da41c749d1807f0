"""Test signals over time: sine, chirp, straight lines between points.

The phase of a chirp is the integral of its frequency, which grows evenly (R. Pintelon and J. Schoukens, "System
Identification: A Frequency Domain Approach", 2012, chapter 5). Checked against numerical quadrature of the frequency,
and by properties that hold for all numbers: bounds, ends, jumps.
"""

import numpy as np

from vpm.numbers import Array

#: Share of a sampling interval by which a sample may miss a jump and still show the value behind it.
SLACK = 1e-6


def sine(time: Array, mean: float, amplitude: float, frequency: float, phase: float = 0.0, start: float = 0.0) -> Array:
    """Signal ``mean + amplitude sin(2 pi frequency (t - start) + phase)``; before ``start`` as at ``start``.

    - ``time``: shape (N,), s
    - ``mean``, ``amplitude``: in the unit of the channel
    - ``frequency``: Hz
    - ``phase``: rad
    - ``start``: s
    - result: shape (N,)
    """
    running = np.maximum(time - start, 0.0)
    return np.asarray(mean + amplitude * np.sin(2.0 * np.pi * frequency * running + phase))


def chirp(time: Array, mean: float, amplitude: float, first: float, last: float, duration: float) -> Array:
    """Chirp signal ``mean + amplitude sin(2 pi (f0 t + (f1 - f0) t^2 / (2 T)))`` from f0 to f1 over T.

    - ``time``: shape (N,); s
    - ``mean``, ``amplitude``: in the unit of the channel
    - ``first``, ``last``: frequency at time zero and after ``duration``, Hz
    - ``duration``: s

    Result: shape (N,).
    """
    turns = first * time + 0.5 * (last - first) * time**2 / duration
    return np.asarray(mean + amplitude * np.sin(2.0 * np.pi * turns))


def points(time: Array, at: Array, value: Array, time_step: float) -> Array:
    """Signal of straight lines between points, held before the first and after the last.

    Points at the same time are a jump; the value behind it holds from there on, also for a sample that misses the
    jump by rounding.

    - ``time``: shape (N,), s
    - ``at``: shape (P,), times of the points, not decreasing, s
    - ``value``: shape (P,)
    - ``time_step``: time between samples, s
    - result: shape (N,)
    """
    after = np.searchsorted(at, time + SLACK * time_step, side="right")
    before = np.clip(after - 1, 0, len(at) - 1)
    after = np.clip(after, 0, len(at) - 1)
    width = at[after] - at[before]
    share = np.where(width > 0.0, (time - at[before]) / np.where(width > 0.0, width, 1.0), 0.0)
    return np.asarray(value[before] + np.clip(share, 0.0, 1.0) * (value[after] - value[before]))
