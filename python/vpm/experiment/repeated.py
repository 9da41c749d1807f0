"""Motions that were read more slowly than they were logged, so that each value is repeated until the next one."""

import numpy as np
from numpy.typing import NDArray

from vpm.experiment.noise import FEWEST_SAMPLES, noise_std, quantisation_step
from vpm.numbers import Array


def fresh_samples(time: Array, values: Array) -> NDArray[np.int64] | None:
    """Samples at which a motion was read, where it was repeated until it was read again.

    Mass and oil move without jumps. A motion that is read in every sample and moves by several steps of its sensor in
    one of them does so in its neighbours, too. So values were repeated that jump, and never in two samples running.
    One lost row may bring two jumps together.

    Parameters
    ----------
    time : ndarray, shape (N,)
        Increasing, s.
    values : ndarray, shape (N,)
        A position, velocity, length or pressure: what cannot jump.

    Returns
    -------
    ndarray of int, or None
        None where values were not repeated, or too few changed to tell. A stretch at rest is read as often as others.
    """
    moved = np.abs(np.diff(values))
    changes = np.flatnonzero(moved) + 1
    if changes.size < FEWEST_SAMPLES:
        return None
    step = quantisation_step(values) or 0.0
    if np.median(moved[changes - 1]) < 1.5 * step:  # steps of the sensor itself, in slow motion
        return None
    place = np.round((time - time[0]) / np.median(np.diff(time))).astype(np.int64)
    lost = np.flatnonzero(np.diff(place) > 1) + 1
    apart = np.diff(changes)
    if np.count_nonzero(apart == 1) > np.count_nonzero(np.isin(changes, lost)):
        return None
    period = int(np.median(apart))
    ends = np.append(changes[1:], values.size)
    stretches = [
        np.arange(start, max(start + 1, stop - period // 2), period) for start, stop in zip(changes, ends, strict=True)
    ]
    fresh = np.concatenate([np.arange(changes[0] - period, -1, -period)[::-1], *stretches])
    return fresh[~np.isin(fresh, lost)]  # behind a lost row nobody knows when it was read


def held_error(time: Array, values: Array, fresh: NDArray[np.int64]) -> float:
    """Error of a motion whose readings are repeated: speed times the time for which each is held, root mean square.

    Noise of two readings is in the way between them, too, and no part of the error.

    Parameters
    ----------
    time : ndarray, shape (N,)
        s.
    values : ndarray, shape (N,)
    fresh : ndarray of int
        Samples at which the motion was read, see `fresh_samples`.

    Returns
    -------
    float
        Unit of the values.
    """
    held = time - time[np.maximum.accumulate(np.where(np.isin(np.arange(time.size), fresh), np.arange(time.size), 0))]
    speeds = np.diff(values[fresh]) / np.diff(time[fresh])
    noise = np.sqrt(2.0) * noise_std(values[fresh]) / np.median(np.diff(time[fresh]))
    return float(np.sqrt(max(np.mean(speeds**2) - noise**2, 0.0) * np.mean(held**2)))
