"""Delays of drives and instruments, fitted to samples in motion: every joint moves clearly.

At a reversal a joint with dry friction sticks for a while, and filtered samples do not show when it breaks away. The
residual there is several times as large as elsewhere, and looks like a delay. A delay fitted to all samples is often
twice the true one on a stiff axis, which makes the simulation worse. In clear motion friction is smooth. So the delay
is fitted there, and held within that estimate while all other parameters are fitted to all samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from vpm.catalogue import EffectType
from vpm.identify import Gain, InverseDynamicsProblem, estimate, gain, segments
from vpm.identify.identifiability import column_lengths
from vpm.model import Model
from vpm.numbers import Array

#: Share of its largest speed below which a joint may stick.
CREEPING = 0.05
#: Samples in clear motion that a fit needs, for each fitted number.
FEWEST = 10
#: A parameter that shows less of itself in motion than this share of its regressor's power stays as it is.
SHOWN = 0.1
#: Standard deviations around a time fitted in motion within which it stays when all samples are fitted.
WITHIN = 2.0
#: A fit stops when the sum of squares changes by less than this share.
TOLERANCE = 1e-6


class InMotion:
    """Inverse-dynamics residual of the samples in motion, on which a delay is fitted."""

    mode = InverseDynamicsProblem.mode

    def __init__(self, data: InverseDynamicsProblem) -> None:
        self.data, self.blocks, self.counted = data, data.blocks, in_motion(data)

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Residual in motion, see `vpm.identify.problem.Problem`."""
        residual, jacobian = self.data.evaluate(model, theta, columns)
        return self.counted * residual, self.counted[:, None] * jacobian


@dataclass(frozen=True)
class Timed:
    """Delay that was fitted in motion, with its interval."""

    bounds: Mapping[str, tuple[float, float]]  #: Of its own parameters, by dotted name.
    #: On validation samples in motion, against the model without it that was fitted to the same samples.
    validation: Gain


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
    current: tuple[Model, Sequence[str]],
    late: tuple[Model, Sequence[str]],
    training: InverseDynamicsProblem,
    validation: InverseDynamicsProblem,
    bounds: Mapping[str, tuple[float, float]],
) -> Timed | None:
    """Fit a model without a delay and with it to the samples in motion; None where those are too few.

    Parameters
    ----------
    current, late : (Model, sequence of str)
        Without the effect and with it, each with its free parameters; those that only ``late`` has are the effect's.
    training, validation : InverseDynamicsProblem
    bounds : mapping
        Bounds of free parameters that replace those of the models.
    """
    fitted, predicted = InMotion(training), InMotion(validation)
    own = [name for name in late[1] if name not in current[1]]
    if np.count_nonzero(fitted.counted) < FEWEST * (len(late[1]) + 1) or not np.any(predicted.counted):
        return None
    left, spread = [], {}
    for model, free in (current, late):
        shown = _shown(model, free, fitted, own)
        fit = estimate(model, fitted, shown, bounds=bounds, tolerance=TOLERANCE)
        values = dict(zip(shown, map(float, fit.values), strict=True))
        moved = model.with_parameters(values)
        left.append(predicted.evaluate(moved, moved.theta)[0])
        spread = {name: (values[name], float(s)) for name, s in zip(shown, fit.std, strict=True) if name in own}
    if not np.all(np.isfinite([s for _, s in spread.values()])):
        return None
    near = {name: _near(late[0], name, *spread[name], bounds) for name in own}
    return Timed(near, gain(left[0], left[1], segments(validation)))


def _near(
    model: Model, name: str, value: float, std: float, bounds: Mapping[str, tuple[float, float]]
) -> tuple[float, float]:
    parameter = model.parameters[name]
    low, high = bounds.get(name, (parameter.minimum, parameter.maximum))
    return max(low, value - WITHIN * std), min(high, value + WITHIN * std)


def _shown(model: Model, free: Sequence[str], problem: InMotion, own: Sequence[str]) -> list[str]:
    """Free parameters that samples in motion identify, and those of the delay."""
    columns = [model.index(name) for name in free]
    _, whole = problem.data.evaluate(model, model.theta, columns)
    shares = np.sum((problem.counted[:, None] * whole) ** 2, axis=0) / column_lengths(whole) ** 2
    return [name for name, share in zip(free, shares, strict=True) if name in own or share >= SHOWN]
