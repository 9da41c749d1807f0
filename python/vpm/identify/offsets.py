"""What readings are off by in each record, as gauges and load cells are that drift from one record to the next."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vpm.identify.fitted import Fit
from vpm.identify.identifiability import RANK_TOLERANCE, column_lengths
from vpm.identify.objective import AnyProblem
from vpm.identify.output_error import OutputErrorProblem
from vpm.identify.problem import Block, less_means
from vpm.identify.sandwich import record_groups, sandwich
from vpm.identify.ties import tied, untied

Array = NDArray[np.float64]


def offset_blocks(data: AnyProblem) -> tuple[Block, ...]:
    """Channels of records that a fit takes to be off by an unknown constant."""
    plain = untied(data)
    return plain.offset_blocks if isinstance(plain, OutputErrorProblem) else ()


def with_offsets(fit: Fit, data: AnyProblem, weights: Array) -> Fit:
    """The same with offsets and their deviations, from the covariance of parameters, first states and constants.

    Parameters
    ----------
    fit : Fit
    data : problem
    weights : ndarray, shape (n,)
        With which rows went into the fit.
    """
    off = offset_blocks(data)
    if not off:
        return fit
    residual, jacobian = _with_constants(fit, data)
    constants = np.zeros((residual.size, len(off)))
    for column, block in enumerate(off):
        constants[block.samples, column] = block.weight * block.moving
    values = constants.T @ residual / np.sum(constants**2, axis=0)
    known = _priors(fit, jacobian.shape[1])
    seen = _seen(np.vstack([weights[:, None] * less_means(jacobian, off), known]))
    columns = np.column_stack([weights[:, None] * jacobian @ seen, weights[:, None] * constants])
    columns = np.vstack([columns, np.column_stack([known @ seen, np.zeros((len(known), len(off)))])])
    left = np.concatenate([weights * (residual - constants @ values), np.ones(len(columns) - residual.size)])
    lengths, outputs = column_lengths(columns), data.blocks[-1].samples.stop
    covariance = sandwich(columns / lengths, left, record_groups(data.blocks), range(outputs, len(left)))
    std = (np.sqrt(np.diag(covariance)) / lengths)[-len(off) :]
    labels = [f"{block.experiment}: {block.channel}" for block in off]
    found, deviations = (dict(zip(labels, map(float, numbers), strict=True)) for numbers in (values, std))
    return replace(fit, offsets=found, offsets_std=deviations)


def taken_by_offsets(fit: Fit, data: AnyProblem) -> dict[str, str]:
    """What to say of parameters whose whole effect is a constant that offsets leave open."""
    blind = [c.names[0] for c in fit.unidentifiable if len(c.names) == 1]
    if not offset_blocks(data) or not blind:
        return {}
    slopes = _with_constants(fit, data)[1]
    told = {}
    for name in blind:
        column = slopes[:, fit.names.index(name)]
        moved = dict.fromkeys(b.channel for b in offset_blocks(data) if np.any(column[b.samples]))
        if moved:
            told[name] = (
                f"{name} adds a constant to {', '.join(moved)} and does nothing else, so offsets take its place; fix "
                "it, or leave the channel out of offsets"
            )
    return told


def _with_constants(fit: Fit, data: AnyProblem) -> tuple[Array, Array]:
    """Residual of a fit with its offsets in it, and its derivative by parameters and first states."""
    plain, model = untied(data), fit.model
    whole = tied(plain.with_offsets_left() if isinstance(plain, OutputErrorProblem) else plain, fit.ties)
    given = {"unknown": np.array(list(fit.states.values()))} if fit.states else {}
    return whole.evaluate(model, model.theta, [model.index(name) for name in fit.names], **given)


def _seen(slopes: Array) -> Array:
    """Directions (p, k) in which a fit moved: in others it stayed where it was, and offsets are those beside that."""
    lengths = column_lengths(slopes)
    _, values, directions = np.linalg.svd(np.linalg.qr(slopes / lengths, mode="r"))
    return np.asarray(directions[values > RANK_TOLERANCE * values[0]].T / lengths[:, None])


def _priors(fit: Fit, columns: int) -> Array:
    """Rows that stand for what was known of the parameters."""
    known = [fit.model.parameters[name].uncertainty for name in fit.names]
    rows = np.zeros((len(known), columns))
    if fit.fitting is not None and fit.fitting.priors:
        np.fill_diagonal(rows, [1.0 / uncertainty if uncertainty else 0.0 for uncertainty in known])
    return rows[np.any(rows, axis=1)]
