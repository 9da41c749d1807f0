"""Sparse formula for a residual: forward selection of a few terms of empirical forces by cross-validation.

Forward selection: of all terms at all joints the one that explains most of the training residual per number comes next.
It is fitted together with the parameters that are free already, so that it gains nothing that a better mass would
explain. A term stays only if it predicts parts of the training records that were left out (S. Chen, S. Billings and W.
Luo, "Orthogonal least squares methods and their application to non-linear system identification", *Int. J. Control* 50,
1989, with cross-validation in place of their error reduction ratio). The validation records take no part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vpm.catalogue import without_law
from vpm.catalogue.empirical import TERMS
from vpm.discrepancy.judged_model import Data, Judged
from vpm.discrepancy.screening.ripple_periods import ripple_periods
from vpm.discrepancy.settings import FOLDS, LONGEST_PERIOD, MOST_TERMS, PERIODS, TERM_GAIN, TRANSITION_SHARES
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.numbers import Array

_HARMONIC = (("cosine", "sine"), ("dry_cosine", "dry_sine"), ("load_cosine", "load_sine"))


@dataclass(frozen=True)
class Atom:
    """Atom of a sparse formula: terms at one joint that are selected together; harmonic ones with their period."""

    joint: str
    terms: tuple[str, ...]
    period: float | None
    columns: Array

    def fits(self, chosen: Sequence[Atom]) -> bool:
        """Whether an atom fits beside the chosen terms of a formula: a joint has one period."""
        periods = {a.period for a in chosen if a.joint == self.joint and a.period is not None}
        return self.period is None or not periods or self.period in periods


@dataclass(frozen=True)
class Formula:
    """Sparse formula: chosen terms of each joint, and their shape parameters."""

    terms: Mapping[str, tuple[str, ...]]
    shapes: Mapping[str, Mapping[str, float]]

    def add_to(self, model: Model) -> Model:
        """Model with the terms of a sparse formula added at zero size."""
        for joint, terms in self.terms.items():
            model = model.with_effect(without_law().name, at=joint, **self.shapes[joint], **dict.fromkeys(terms, 0.0))
        return model


def select(base: Judged, records: Data) -> Formula | None:
    """Select the terms of a sparse formula for the training residual of ``base``; None if none predicts.

    Of the validation records only the range of the motion is used: within it, and no farther, the formula may be
    followed.
    """
    data = records.training
    ranges = {joint: _ranges(base, data, records.validation, joint) for joint in data.joints}
    atoms = [atom for joint in data.joints for atom in _atoms(base, data, joint, ranges[joint])]
    scorer = _Folds(data, base.fit.residual, base.fit.jacobian)
    chosen: list[Atom] = []
    error = scorer.error(())
    while len(chosen) < MOST_TERMS:
        left = [a for a in atoms if not any(a is c for c in chosen) and a.fits(chosen)]
        best = _most_promising(base, chosen, left)
        tried = [(scorer.error((*chosen, atom)), atom) for atom in best]
        if not tried:
            break
        lowest, atom = min(tried, key=lambda pair: pair[0])
        if lowest > (1.0 - TERM_GAIN * len(atom.terms) ** 0.5) * error:
            break
        chosen, error = [*chosen, atom], lowest
        chosen, error = _without_needless(chosen, error, scorer)
    if not chosen:
        return None
    terms, shapes = {}, {}
    for joint in data.joints:
        mine = [atom for atom in chosen if atom.joint == joint]
        if mine:
            terms[joint] = tuple(name for name in TERMS if any(name in atom.terms for atom in mine))
            shapes[joint] = dict(ranges[joint])
            for atom in mine:
                if atom.period is not None:
                    shapes[joint]["period"] = atom.period
    return Formula(terms, shapes)


def _without_needless(chosen: list[Atom], error: float, scorer: _Folds) -> tuple[list[Atom], float]:
    """Sparse formula without terms that a later one replaced."""
    for atom in chosen[:-1]:
        rest = [a for a in chosen if a is not atom]
        without = scorer.error(rest)
        if without < (1.0 + 0.5 * TERM_GAIN) * error:
            chosen, error = rest, without
    return chosen, error


def _most_promising(base: Judged, chosen: Sequence[Atom], atoms: Sequence[Atom], count: int = 4) -> list[Atom]:
    """Atoms that lower the training residual most for each number they add to a formula."""
    known = np.column_stack([base.fit.jacobian, *(a.columns for a in chosen)])
    basis = _basis(known)
    rest = base.fit.residual - basis @ (basis.T @ base.fit.residual)
    scores = []
    for atom in atoms:
        own = atom.columns - basis @ (basis.T @ atom.columns)
        lengths = np.linalg.norm(atom.columns, axis=0)
        if np.any(np.linalg.norm(own, axis=0) < TERM_GAIN * lengths) or not np.all(lengths > 0.0):
            continue
        scores.append((float(np.sum((_basis(own).T @ rest) ** 2)) / len(atom.terms), atom))
    scores.sort(key=lambda pair: -pair[0])
    return [atom for _, atom in scores[:count]]


def _basis(columns: Array) -> Array:
    """Orthonormal basis of the columns of formula terms."""
    if not columns.shape[1]:
        return np.zeros((len(columns), 0))
    lengths = np.linalg.norm(columns, axis=0)
    u, values, _ = np.linalg.svd(columns / np.where(lengths > 0.0, lengths, 1.0), full_matrices=False)
    return np.asarray(u[:, values > 1e-8 * max(values[0], 1e-300)])


class _Folds:
    """Cross-validation of formula terms: mean square on parts of training records that were left out."""

    def __init__(self, data: InverseDynamicsProblem, residual: Array, jacobian: Array) -> None:
        self._residual, self._known = residual, jacobian
        self._fold = np.zeros(residual.size, dtype=np.int64)
        for block in data.blocks:
            count = block.samples.stop - block.samples.start
            self._fold[block.samples] = np.arange(count) * FOLDS // count

    def error(self, atoms: Sequence[Atom]) -> float:
        """Cross-validation error of formula terms, summed over all parts."""
        columns = np.column_stack([self._known, *(atom.columns for atom in atoms)])
        lengths = np.linalg.norm(columns, axis=0)
        columns = columns / np.where(lengths > 0.0, lengths, 1.0)
        total = 0.0
        for part in range(FOLDS):
            inside = self._fold == part
            step = np.linalg.lstsq(columns[~inside], -self._residual[~inside], rcond=1e-8)[0]
            total += float(np.sum((self._residual[inside] + columns[inside] @ step) ** 2))
        return total


def _ranges(
    base: Judged, data: InverseDynamicsProblem, validation: InverseDynamicsProblem, joint: str
) -> dict[str, float]:
    """Scales of formula terms at a joint: middle and reach of position, largest speed, transition velocity."""
    column = data.joints.index(joint)
    states = [data.state(record) for record in range(len(data.motions))]
    position = np.concatenate([q[:, column] for q, _, _ in states])
    velocity = np.concatenate([v[:, column] for _, v, _ in states])
    met = [validation.state(record) for record in range(len(validation.motions))]
    ways = np.concatenate([position, *(q[:, column] for q, _, _ in met)])
    rates = np.concatenate([velocity, *(v[:, column] for _, v, _ in met)])
    low, high = float(ways.min()), float(ways.max())
    speed = max(float(np.quantile(np.abs(rates), 0.999)), 1e-12)
    known = f"{joint}.friction.transition_velocity"
    if known in base.model.parameters:
        transition = base.model.parameters[known].value
    else:
        residual = np.concatenate([base.fit.residual[data.efforts(r)[column].samples] for r in range(len(states))])
        x = (position - 0.5 * (low + high)) / max(0.5 * (high - low), 1e-12)
        transition = speed * max(TRANSITION_SHARES, key=lambda s: _taken(residual, np.tanh(velocity / (s * speed)), x))
    return {
        "middle": 0.5 * (low + high),
        "reach": max(0.5 * (high - low), 1e-12),
        "speed": speed,
        "transition_velocity": transition,
    }


def _taken(residual: Array, sign: Array, x: Array) -> float:
    return float(np.sum((_basis(np.column_stack([sign, sign * x, sign * x * x])).T @ residual) ** 2))


def _atoms(base: Judged, data: InverseDynamicsProblem, joint: str, ranges: Mapping[str, float]) -> list[Atom]:
    """All atoms of a joint with exact regressors; no load terms where two-point elements pull."""
    skipped = ("load",) if base.model.lines else ()
    smooth = [t for t in TERMS if "cosine" not in t and "sine" not in t and not t.startswith(skipped or ("-",))]
    atoms = [
        Atom(joint, (term,), None, column[:, None])
        for term, column in zip(smooth, _columns(base, data, joint, ranges, smooth).T, strict=True)
    ]
    kinds = [pair for pair in _HARMONIC if not pair[0].startswith(skipped or ("-",))]
    for period in harmonic_periods(base, data, joint, ranges):
        names = [name for pair in kinds for name in pair]
        columns = _columns(base, data, joint, {**ranges, "period": period}, names)
        for at, pair in enumerate(kinds):
            atoms.append(Atom(joint, pair, period, columns[:, 2 * at : 2 * at + 2]))
    return atoms


def _columns(
    base: Judged, data: InverseDynamicsProblem, joint: str, shapes: Mapping[str, float], terms: Sequence[str]
) -> Array:
    """Columns of formula terms: derivatives of the residual by their coefficients at zero size."""
    model = base.model.with_effect(without_law().name, at=joint, **shapes, **dict.fromkeys(terms, 0.0))
    _, columns = data.evaluate(model, model.theta, [model.index(f"{joint}.empirical.{term}") for term in terms])
    return columns


def harmonic_periods(
    base: Judged, data: InverseDynamicsProblem, joint: str, ranges: Mapping[str, float]
) -> tuple[float, ...]:
    """Periods in position (m or rad) at which a residual is strongest, itself or multiplied by direction or load."""
    column, records = data.joints.index(joint), range(len(data.motions))
    position, velocity = (np.concatenate([data.state(r)[which][:, column] for r in records]) for which in (0, 1))
    load = np.concatenate([data.effort(base.model, base.model.theta, r)[1][:, column] for r in records])
    residual = np.concatenate([base.fit.residual[data.efforts(r)[column].samples] for r in records])
    direction = np.tanh(velocity / ranges["transition_velocity"])
    signals = (residual, residual * direction, residual * np.abs(load))
    found = (ripple_periods(position, signal, 1.0 / LONGEST_PERIOD)[:PERIODS] for signal in signals)
    return tuple(dict.fromkeys(period for several in found for period in several))
