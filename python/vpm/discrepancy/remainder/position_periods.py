"""Periods in position at which a residual repeats: by itself, with direction or with load."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Judged
from vpm.identify import InverseDynamicsProblem
from vpm.numbers import Array

#: Shortest and longest period that is looked for, as parts and multiples of the whole travel.
SHORTEST, LONGEST = 1.0 / 40.0, 1.5
#: Periods that are proposed for each of the three ways in which a residual can repeat.
PROPOSED = 2
#: Most samples that take part.
MOST_SAMPLES = 4000


def harmonic_periods(
    base: Judged, data: InverseDynamicsProblem, joint: str, ranges: Mapping[str, float]
) -> tuple[float, ...]:
    """Periods in position (m or rad) at which a residual is strongest, itself or multiplied by direction or load.

    Least squares with a cosine and a sine at evenly spaced wave numbers, beside a constant and the direction (N. Lomb,
    *Astrophysics and Space Science* 39, 1976).
    """
    column = data.joints.index(joint)
    records = range(len(data.motions))
    position = np.concatenate([data.state(r)[0][:, column] for r in records])
    velocity = np.concatenate([data.state(r)[1][:, column] for r in records])
    load = np.concatenate([data.effort(base.model, base.model.theta, r)[1][:, column] for r in records])
    residual = np.concatenate([base.fit.residual[data.efforts(r)[column].samples] for r in records])
    thin = max(1, residual.size // MOST_SAMPLES)
    position, velocity, load, residual = (x[::thin] for x in (position, velocity, load, residual))
    travel = 2.0 * ranges["reach"]
    step = float(np.median(np.abs(np.diff(position)))) or travel / 1e3
    highest = min(1.0 / (2.5 * step), 1.0 / (SHORTEST * travel))
    waves = np.arange(1.0 / LONGEST, max(highest * travel, 2.0), 0.1) / travel
    direction = np.tanh(velocity / ranges["transition_velocity"])
    found: list[float] = []
    for factor in (np.ones_like(residual), direction, np.abs(load) / max(float(np.abs(load).max()), 1e-300)):
        power = np.array([_taken(residual, factor, direction, 2.0 * np.pi * wave * position) for wave in waves])
        peaks = [k for k in range(1, power.size - 1) if power[k - 1] <= power[k] > power[k + 1]]
        peaks = sorted(peaks or [int(np.argmax(power))], key=lambda k: -power[k])[:PROPOSED]
        found += [float(1.0 / waves[k]) for k in peaks]
    return tuple(dict.fromkeys(found))


def _taken(residual: Array, factor: Array, direction: Array, phase: Array) -> float:
    """Sum of squares that a wave of one period in position explains."""
    columns = np.column_stack([np.ones_like(phase), direction, factor * np.cos(phase), factor * np.sin(phase)])
    normal = columns.T @ columns + 1e-9 * phase.size * np.eye(4)
    right = columns.T @ residual
    return float(right @ np.linalg.solve(normal, right))
