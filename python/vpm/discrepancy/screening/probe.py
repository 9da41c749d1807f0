"""Probe of a candidate: the share of the training residual that its regressor explains in one linear step.

For each candidate one linearised step moves the free parameters and the new ones together. So a candidate gains nothing
that a better value of a known parameter would explain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from vpm.discrepancy.screening.candidates import Candidate
from vpm.discrepancy.settings import ROUNDED, SIZE_LEVEL
from vpm.identify import InverseDynamicsProblem, robust_covariance, segments
from vpm.identify.identifiability import Span, closest_column, column_lengths, is_alias
from vpm.model import Model
from vpm.numbers import Array


def linear_step(data: InverseDynamicsProblem, jacobian: Array, residual: Array) -> tuple[Array, Array, Array]:
    """Linear least-squares step, its standard deviations and the remaining residual (n,)."""
    if jacobian.shape[1] == 0:
        return np.zeros(0), np.zeros(0), residual
    lengths = column_lengths(jacobian)
    scaled = jacobian / lengths
    step = np.linalg.lstsq(scaled, -residual, rcond=1e-10)[0]
    left = residual + scaled @ step
    std = np.sqrt(np.diag(robust_covariance(scaled, left, segments(data)))) / lengths
    return step / lengths, std, left


@dataclass(frozen=True)
class Alias:
    """Alias in a probe: a parameter held at its start because data show it only together with another one."""

    parameter: str
    partner: str


@dataclass(frozen=True)
class Probe:
    """Probe of a candidate: estimates and gain of one linearised step."""

    candidate: Candidate
    model: Model  #: The model with the effect at the start values of the best shape tried.
    free: tuple[str, ...]  #: Dotted names of the effect's parameters that the data can see.
    held: tuple[Alias, ...]  #: Those that they do not discriminate from others.
    invisible: tuple[str, ...]  #: Those without any influence at the start values.
    #: Linearised estimate by dotted name, unbounded.
    values: Mapping[str, float]
    std: Mapping[str, float]
    drop: float  #: Share of the training residual's mean square that would go, beside what known parameters explain.
    here: float = 0.0  #: The same of the effort at the joint where the effect acts, of several.

    @property
    def score(self) -> float:
        """Score of a probe: predicted gain per root of the fitted numbers, so that richer effects pay for them."""
        return self.drop / float(np.sqrt(max(1, len(self.free))))


def size_is_clear(names: Sequence[str], values: Array, covariance: Array) -> bool:
    """Wald test of a probe that the parameters ``names`` are not all zero, at the level ``SIZE_LEVEL``."""
    if not names:
        return False
    if not np.all(np.isfinite(covariance)):
        return False
    statistic = float(values @ np.linalg.pinv(covariance, hermitian=True) @ values)
    return statistic > float(chdtri(len(names), SIZE_LEVEL))


def sort_columns(
    added: Sequence[str],
    fresh: Array,
    span: Span,
    known: tuple[Sequence[str], Array],
    residual: Array,
    sizes: tuple[Array, Array],
) -> tuple[list[int], tuple[Alias, ...], tuple[str, ...]]:
    """Sort the new columns of a probe: identifiable, confused with others, and without influence.

    The first come by their places, the others by name. ``known`` are names and columns of what has the ``span``.
    ``sizes`` are those of known and fresh parameters, without which SI units would decide what is small.
    """
    names, columns = known
    lengths = np.linalg.norm(fresh, axis=0) * sizes[1]
    largest = float(np.max([*(np.linalg.norm(columns, axis=0) * sizes[0]), *lengths], initial=0.0))
    visible = [i for i in range(len(added)) if lengths[i] > ROUNDED * largest]
    invisible = tuple(added[i] for i in range(len(added)) if i not in visible)
    keep, held = list(visible), []
    for i in visible:
        others = [j for j in keep if j != i]
        if is_alias(fresh[:, i], span.beside(fresh[:, others]), residual):
            closest = closest_column(fresh[:, i], np.column_stack([columns, fresh[:, others]]))
            held.append(Alias(added[i], [*names, *(added[j] for j in others)][closest]))
            keep.remove(i)
    return keep, tuple(held), invisible
