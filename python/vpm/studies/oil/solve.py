"""Least squares over the balances of oil: rows as rates or as integrals, instruments, weights, covariance."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from vpm.experiment.signal import differentiate, lowpass, settling_samples
from vpm.identify.statistics import correlation_length, window_sums
from vpm.numbers import Array
from vpm.studies.oil.equations import Equation

#: Lags (s) of the command that serve as instruments: a chamber fills within some milliseconds after the valve reverses.
LAGS = (0.0, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3, 32e-3)

#: Least share of the residuals' variance that a combination of balances is given: more would trust rounding and
#: quadrature.
FLOOR = 1e-4

#: Third differences this many times their median are no noise.
OUTLYING = 6.0


@dataclass(frozen=True)
class Rows:
    """Regression of one or several balances on the same instants."""

    #: Shape (e, n, p); columns of the unknowns; and what stands in for them in the normal equations.
    regressors: Array
    instruments: Array
    target: Array  #: Shape (e, n).
    constants: Array  #: Shape (n, c); columns that each balance has for itself.
    scale: Array  #: Shape (e, n); unit of the residual by that of the piston's place or speed.
    kept: slice  #: Which samples of the record the rows stand for.
    steps: Array  #: Shape (e, n, p) or (0, 0, 0); of integrals: what each sample adds to them, whose noise they gather.


def _columns(equation: Equation, opening: Array, columns: Sequence[str]) -> tuple[list[Array], list[Array]]:
    """Oil that each unknown stores, and the flow that it lets through; zeros where it does not."""
    zero = np.zeros_like(opening)
    stored = {"compliance": equation.stored, "air": equation.air}
    flows = {"flow_gain": -equation.flow * opening, "leakage": equation.leakage, "offset": -equation.flow}
    return [stored.get(name, zero) for name in columns], [flows.get(name, zero) for name in columns]


def integral_rows(
    equations: Sequence[Equation],
    opening: Array,
    columns: Sequence[str],
    dt: float,
    pieces: Sequence[slice],
    *,
    instrument: bool,
) -> Rows:
    """Integral rows to solve for oil: ``stored X + int(flow) X + c = -place``, a constant each piece."""
    count = len(opening)
    constants = np.zeros((count, len(pieces)))
    for k, piece in enumerate(pieces):
        constants[piece, k] = 1.0
    regressors, instruments, steps = [], [], []
    for equation in equations:
        stored, flows = _columns(equation, opening, columns)
        flowed = [cumulative_trapezoid(flow, dx=dt, initial=0) for flow in flows]
        steps.append(dt * np.column_stack(flows))
        regressors.append(np.column_stack([s + f for s, f in zip(stored, flowed, strict=True)]))
        if instrument:
            replaced = regressors[-1].copy()
            basis = np.column_stack([constants, *flowed, *_from_command(opening, dt)])
            for k, name in enumerate(columns):
                if name in {"compliance", "air"}:
                    replaced[:, k] = _projected(stored[k], basis)
            instruments.append(replaced)
    target = np.stack([-equation.place for equation in equations])
    scale = np.stack([equation.scale for equation in equations])
    matrix = np.stack(regressors)
    return Rows(
        matrix,
        np.stack(instruments) if instrument else matrix,
        target,
        constants,
        scale,
        slice(0, count),
        np.stack(steps),
    )


def rate_rows(
    equations: Sequence[Equation], opening: Array, columns: Sequence[str], dt: float, cutoff: float | None
) -> Rows:
    """Rows of rates of oil balances: by central differences, or all columns through the same filter."""
    count = len(opening)
    edge = 1 if cutoff is None else min(settling_samples(1.0 / dt, cutoff) + 2, count // 4)
    kept = slice(edge, count - edge)

    def smooth(values: Array) -> Array:
        return values if cutoff is None else lowpass(values, 1.0 / dt, cutoff)

    def rate(values: Array) -> Array:
        return np.gradient(values, dt) if cutoff is None else differentiate(smooth(values), dt)

    regressors, target = [], []
    for equation in equations:
        stored, flows = _columns(equation, opening, columns)
        rows = [rate(s) + smooth(f) for s, f in zip(stored, flows, strict=True)]
        regressors.append(np.column_stack(rows)[kept])
        target.append(-rate(equation.place)[kept])
    matrix = np.stack(regressors)
    scale = np.stack([equation.scale[kept] for equation in equations])
    return Rows(matrix, matrix, np.stack(target), np.zeros((count - 2 * edge, 0)), scale, kept, np.zeros((0, 0, 0)))


def solve(rows: Rows, weights: Array | None, *, weighted: bool) -> tuple[Array, Array, Array]:
    """Solve for the oil: estimate, covariance, and residual in units of piston place (or speed).

    The covariance counts the correlation of residuals in time (W. Newey and K. West, *Econometrica* 55, 1987) and of
    the balances at one instant. Integrals gather the noise of the pressures under their roots as a random walk, too
    slow for that sum over lags; its share is computed from the noise of one step.    Shapes (p,), (p, p) and (n, e).
    """
    mixing = np.eye(len(rows.target))
    factor = (
        1.0 / rows.scale
        if weighted
        else np.broadcast_to(1.0 / rows.scale.mean(axis=1, keepdims=True), rows.scale.shape)
    )
    if weights is not None:
        factor = factor * np.sqrt(weights[rows.kept])
    values, covariance, residual = _once(rows, factor, mixing)
    if weighted and len(mixing) > 1:
        # Noise of the place stands in both balances: their common part weighs less, what it does not touch weighs more.
        common = np.cov(residual.T)
        mixing = np.linalg.inv(np.linalg.cholesky(common / np.trace(common) + FLOOR * np.eye(len(mixing))))
        values, covariance, residual = _once(rows, factor, mixing)
    return values, covariance, residual


def _once(rows: Rows, factor: Array, mixing: Array) -> tuple[Array, Array, Array]:
    """Solve the oil's least squares for one weighting, with columns of one size."""
    constants = rows.constants[None] * factor[:, :, None]
    spread = np.einsum("fe,enc->fnec", mixing, constants).reshape(len(mixing), factor.shape[1], -1)
    size = np.sqrt(np.mean((rows.regressors * factor[:, :, None]) ** 2, axis=(0, 1)))
    size = np.where(size > 0.0, size, 1.0)

    def mixed(matrix: Array) -> Array:
        columns = np.einsum("fe,enp->fnp", mixing, matrix * factor[:, :, None]) / size
        return np.concatenate([columns, spread * np.max(np.abs(columns))], axis=2)

    A, Z = mixed(rows.regressors), mixed(rows.instruments)
    B = np.einsum("fe,en->fn", mixing, rows.target * factor)
    q = A.shape[2]
    normal = np.einsum("enp,enq->pq", Z, A)
    inverse = np.linalg.pinv(normal, rcond=1e-14)
    X = inverse @ np.einsum("enp,en->p", Z, B)
    left = B - A @ X
    score = np.einsum("enp,en->np", Z, left)
    length = max(correlation_length(each) for each in left) + 1
    sums = window_sums(score, length)
    meat = sums.T @ sums
    if rows.steps.size:
        meat += _walk(rows.steps @ (X[: len(size)] / size), Z, mixing, factor)
    covariance = inverse @ meat @ inverse.T
    p = len(size)
    # A fit of q numbers takes some of the residual with it.
    covariance = covariance[:p, :p] / np.outer(size, size) * (left.size / max(1, left.size - q))
    return X[:p] / size, 0.5 * (covariance + covariance.T), np.linalg.solve(mixing, left).T


def _walk(steps: Array, Z: Array, mixing: Array, factor: Array) -> Array:
    """Covariance of the oil's normal equations by a random walk with the noise of `steps`, shape (e, n)."""
    noise = _white_noise(steps)
    reach = np.einsum("fnp,fe,en->npe", Z, mixing, factor)
    ahead = np.cumsum(reach[::-1], axis=0)
    return np.asarray(np.einsum("npe,eg,nqg->pq", ahead, noise, ahead), dtype=np.float64)


def _white_noise(signals: Array) -> Array:
    """Covariance of white noise on oil signals of shape (e, n).

    A third difference leaves nothing of a parabola, and of white noise twenty times its variance. Where a valve
    reverses, flow and pressure have corners; those differences are no noise.
    """
    third = np.diff(signals, 3, axis=1)
    size = np.abs(third) / np.maximum(np.median(np.abs(third), axis=1, keepdims=True), np.finfo(float).tiny)
    quiet = third[:, size.max(axis=0) < OUTLYING]
    return np.asarray(quiet @ quiet.T / (20.0 * max(1, quiet.shape[1])), dtype=np.float64)


def noise_share(rows: Rows, equations: Sequence[Equation], dt: float) -> float:
    """Share of the first oil column's power that white noise of its sensor explains."""
    from_noise = power = 0.0
    integral = rows.constants.shape[1] > 0
    for k, equation in enumerate(equations):
        variance = float(_white_noise(equation.stored[None])[0, 0])
        scale = rows.scale[k]
        column = rows.regressors[k, :, 0] / scale
        others = np.column_stack([rows.regressors[k, :, 1:], rows.constants]) / scale[:, None]
        column = column - _projected(column, others)
        weight = float(np.mean(1.0 / scale**2))
        from_noise += weight * variance * (1.0 if integral else 0.5 / dt**2)
        power += float(np.mean(column**2))
    return min(1.0, from_noise / power) if power > 0.0 else 1.0


def unexplained(rows: Rows, values: Array, residual: Array) -> tuple[float, float, float]:
    """Root mean squares of an oil solution: residual, its white noise, and the part of 1/beta.

    A residual that is neither white noise nor small beside the compression of the oil has a cause of its own.
    """
    noise = np.sqrt(np.trace(_white_noise(residual.T)))
    column = rows.regressors[:, :, 0] / rows.scale * values[0]
    compressed = np.sqrt(np.sum(np.var(column, axis=1)))
    return float(np.sqrt(np.sum(np.mean(residual**2, axis=0)))), float(noise), float(compressed)


def _from_command(opening: Array, dt: float) -> list[Array]:
    """Instruments to solve for oil: functions of the command without noise of pressure sensors."""
    size = float(np.abs(opening).max())
    relative = opening / size
    found = [cumulative_trapezoid(one, dx=dt, initial=0) for one in (relative, np.abs(relative))]
    seen: set[int] = set()
    for lag in LAGS:
        shift = round(lag / dt)
        if shift in seen:
            continue
        seen.add(shift)
        past = np.concatenate([np.full(shift, relative[0]), relative[: len(relative) - shift]])
        found += [past, np.abs(past), np.tanh(20.0 * past)]
    return found


def _projected(values: Array, basis: Array) -> Array:
    """Part of an oil signal that a basis explains."""
    size = np.sqrt(np.mean(basis**2, axis=0))
    scaled = basis / np.where(size > 0.0, size, 1.0)
    return np.asarray(scaled @ np.linalg.lstsq(scaled, values, rcond=1e-10)[0], dtype=np.float64)
