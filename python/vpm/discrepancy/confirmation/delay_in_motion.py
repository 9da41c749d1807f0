"""Delays of drives and instruments, fitted to samples in motion: every joint moves clearly.

At a reversal a joint with dry friction sticks for a while, and filtered samples do not show when it breaks away. The
residual there is several times as large as elsewhere, and looks like a delay. A delay fitted to all samples is often
twice the true one on a stiff axis, which makes the simulation worse. In clear motion friction is smooth. So the delay
is fitted there, and held within that estimate while all other parameters are fitted to all samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d

from vpm.catalogue import EffectType
from vpm.discrepancy.settings import CREEPING, SAMPLES_EACH, TOLERANCE, VISIBLE
from vpm.identify import InverseDynamicsProblem, estimate
from vpm.identify.identifiability import column_lengths
from vpm.model import Model
from vpm.numbers import NORMAL_95, Array


class InMotion:
    """Inverse-dynamics residual of the samples in motion, on which a delay is fitted."""

    mode = InverseDynamicsProblem.mode

    def __init__(self, data: InverseDynamicsProblem) -> None:
        self.data, self.blocks, self.counted = data, data.blocks, in_motion(data)

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Residual in motion, see `vpm.identify.problem.Problem`."""
        residual, jacobian = self.data.evaluate(model, theta, columns)
        return self.counted * residual, self.counted[:, None] * jacobian


def is_dry(model: Model) -> bool:
    """Whether a joint of a model has dry friction and can stick, so that delays are fitted in motion."""
    return any(effect.type.sticks for effect in model.effects)


def is_late(effect: EffectType, model: Model) -> bool:
    """Whether an effect is a delay in a model that can stick, so that it is fitted in motion only."""
    return effect.shifts and is_dry(model)


def in_motion(problem: InverseDynamicsProblem) -> Array:
    """Mask of samples in motion: 1 where every joint moves clearly as far as the filters reach, else 0, shape (n,)."""
    speeds = [np.abs(m.velocity) for m in problem.motions]
    largest = np.max([np.quantile(speed, 0.999, axis=0) for speed in speeds], axis=0)
    counted = np.zeros(sum(block.time.size for block in problem.blocks))
    for record, (m, speed) in enumerate(zip(problem.motions, speeds, strict=True)):
        creeping = (speed < CREEPING * largest).any(axis=1)
        reach = m.decimation + round(1.0 / (m.cutoff * m.dt))
        near = maximum_filter1d(creeping.view(np.uint8), 2 * reach + 1)[m.retained] > 0
        for block in problem.efforts(record):
            counted[block.samples] = ~near
    return counted


def timed_in_motion(
    model: Model,
    free: Sequence[str],
    known: Sequence[str],
    training: InverseDynamicsProblem,
    bounds: Mapping[str, tuple[float, float]],
) -> dict[str, tuple[float, float]] | None:
    """Bounds of a delay's parameters by a fit to the samples in motion; None where those are too few.

    - ``model``: with the delay
    - ``free``, ``known``: its free parameters, and those of the model without the delay
    - ``bounds``: bounds of free parameters that replace those of the model
    """
    fitted = InMotion(training)
    own = [name for name in free if name not in known]
    if np.count_nonzero(fitted.counted) < SAMPLES_EACH * (len(free) + 1):
        return None
    shown = _shown(model, free, fitted, own)
    fit = estimate(model, fitted, shown, bounds=bounds, tolerance=TOLERANCE)
    found = {name: (float(v), float(s)) for name, v, s in zip(shown, fit.values, fit.std, strict=True) if name in own}
    if not np.all(np.isfinite([std for _, std in found.values()])):
        return None
    return {name: _near(model, name, *found[name], bounds) for name in own}


def _near(
    model: Model, name: str, value: float, std: float, bounds: Mapping[str, tuple[float, float]]
) -> tuple[float, float]:
    parameter = model.parameters[name]
    low, high = bounds.get(name, (parameter.minimum, parameter.maximum))
    return max(low, value - NORMAL_95 * std), min(high, value + NORMAL_95 * std)


def _shown(model: Model, free: Sequence[str], problem: InMotion, own: Sequence[str]) -> list[str]:
    """Free parameters that samples in motion identify, and those of the delay."""
    columns = [model.index(name) for name in free]
    _, whole = problem.data.evaluate(model, model.theta, columns)
    shares = np.sum((problem.counted[:, None] * whole) ** 2, axis=0) / column_lengths(whole) ** 2
    return [name for name, share in zip(free, shares, strict=True) if name in own or share >= VISIBLE]
