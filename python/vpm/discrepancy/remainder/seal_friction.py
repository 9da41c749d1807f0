"""Friction of seals that the chambers press: it grows with the pressures, and the catalogue does not have it.

An asymmetric cylinder has other pressures on its way out than on its way back. Such friction therefore looks like dry
friction and a constant force. The sum of the logged pressures tells more than the direction: it changes with the load
and at each reversal. One number, the share of the piston's area that presses the seals, is fitted together with the
free parameters of the model without any effect. Its residual is compared with that of the effects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vpm.discrepancy.judged_model import Data, Judged
from vpm.discrepancy.settings import TRANSITION_SHARES, UNIT_PRESSURE
from vpm.identify import InverseDynamicsProblem, robust_covariance, segments
from vpm.identify.drives import driven, first_drives
from vpm.identify.identifiability import column_lengths
from vpm.identify.response_along_motion import has_hidden
from vpm.model import Model
from vpm.numbers import NORMAL_95, Array


@dataclass(frozen=True)
class Seals:
    """Friction of one cylinder's seals in the place of all accepted effects."""

    drive: str
    #: Of the piston's area that the seals press with, friction coefficient and all.
    share: float
    std: float
    #: Residuals on training and validation records.
    fitted: Array
    validation: Array

    @property
    def sentence(self) -> str:
        """Sentence on the friction of the seals for the result."""
        return (
            f"Friction of the seals of {self.drive} that grows with the pressures in its chambers, by "
            f"{self.share:.3g} ± {self.std:.2g} of the piston's area times their sum, predicts the validation data "
            "better."
        )


def seals(base: Judged, data: Data) -> Seals | None:
    """Friction of seals with the least training residual; None where none surely dissipates.

    - ``base``: the recalibrated model without effects
    """
    drives = _pressed(base.model, data.training)
    if not drives:
        return None
    _, slopes = data.validation.evaluate(base.model, base.model.theta, [base.model.index(name) for name in base.free])
    found = []
    for drive in drives:
        seen, met = (_strokes(problem, drive) for problem in (data.training, data.validation))
        for bend in _bends(base.model, data.training, drive, seen):
            columns = (_column(data.training, seen, bend), _column(data.validation, met, bend))
            one = _fitted(base, data, drive, columns, slopes)
            if one.share > NORMAL_95 * one.std:
                found.append(one)
    return min(found, key=lambda one: float(one.fitted @ one.fitted), default=None)


@dataclass(frozen=True)
class _Stroke:
    """Stroke along one record for seal friction: pressure sum (N,), effort per pressure (N, joints), flow (N,)."""

    pressed: Array
    levers: Array
    flow: Array


def _pressed(model: Model, problem: InverseDynamicsProblem) -> list[str]:
    """Cylinders whose seals may have friction: all logs hold both pressures."""
    if any(has_hidden(model, m.joints) for m in problem.motions):
        return []
    return [name for name in model.actuators if all(channel in problem.shown for channel in _pressures(name))]


def _pressures(drive: str) -> tuple[str, str]:
    return f"{drive}.pressure_a", f"{drive}.pressure_b"


def _strokes(problem: InverseDynamicsProblem, drive: str) -> list[_Stroke]:
    found = []
    for record, (experiment, m) in enumerate(zip(problem.experiments, problem.motions, strict=True)):
        levers = _per_pressure(problem, record, drive)
        pressed = np.sum([experiment[channel] for channel in _pressures(drive)], axis=0)
        found.append(_Stroke(pressed, levers, np.sum(levers * m.velocity, axis=1)))
    return found


def _per_pressure(problem: InverseDynamicsProblem, record: int, drive: str) -> Array:
    """Effort at each joint per chamber pressure (N, joints), to which the seals' friction is proportional."""
    model, m, experiment = problem.nominal, problem.motions[record], problem.experiments[record]
    for name in model.actuators:
        for channel, value in zip(_pressures(name), (UNIT_PRESSURE * (name == drive), 0.0), strict=True):
            if channel in experiment:
                experiment = experiment.with_channel(channel, np.full(len(m.time), value), experiment.unit(channel))
    first = first_drives(model, model.theta, m, experiment)
    outputs, _ = driven(model, model.theta, m, experiment, (), first, problem.integrators[record])
    return outputs[:, len(model.output_channels) :] / UNIT_PRESSURE


def _bends(model: Model, training: InverseDynamicsProblem, drive: str, strokes: Sequence[_Stroke]) -> list[float]:
    """Transition flows of the seals' friction, from the joint's transition velocity if it has one."""
    fastest = _fastest([stroke.flow for stroke in strokes])
    moved, joints = model.joints_of_actuator(drive), training.motions[0].joints
    joint = moved[0] if len(moved) == 1 else ""
    known = model.parameters.get(f"{joint}.friction.transition_velocity")
    if known is None or joint not in joints:
        return [share * fastest for share in TRANSITION_SHARES]
    speed = _fastest([m.velocity[:, joints.index(joint)] for m in training.motions])
    return [known.value / speed * fastest]


def _fastest(rates: Sequence[Array]) -> float:
    return max(float(np.quantile(np.abs(np.concatenate(rates)), 0.999)), 1e-300)


def _column(problem: InverseDynamicsProblem, strokes: Sequence[_Stroke], bend: float) -> Array:
    """Residual column of the friction of seals on the whole piston area."""
    efforts = [-(one.pressed * np.tanh(one.flow / bend))[:, None] * one.levers for one in strokes]
    return np.asarray(problem.added([effort[:, :, None] for effort in efforts])[:, 0])


def _fitted(base: Judged, data: Data, drive: str, columns: tuple[Array, Array], slopes: Array) -> Seals:
    """Fit of the friction of seals: one linear step with everything that is free.

    ``slopes`` are those of the validation residual by what is free.
    """
    known = base.fit.jacobian
    jacobian = np.column_stack([known, columns[0]])
    lengths = column_lengths(jacobian)
    scaled = jacobian / lengths
    taken = np.linalg.lstsq(scaled, -base.fit.residual, rcond=1e-10)[0]
    left = base.fit.residual + scaled @ taken
    std = np.sqrt(np.diag(robust_covariance(scaled, left, segments(data.training)))) / lengths
    step = taken / lengths
    seen = base.fit.residual + known @ step[:-1] + step[-1] * columns[0]
    met = base.validation + slopes @ step[:-1] + step[-1] * columns[1]
    return Seals(drive, float(step[-1]), float(std[-1]), seen, met)
