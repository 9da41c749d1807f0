"""Structural parameters by linear least squares: masses, first moments, inertias, friction.

D'Imperio (2016), section 5.1.1, solves ``p = (F'F)^-1 F' tau``. Here the same problem is solved in base parameters, so
that what the data cannot tell is named; equations are weighted by the noise of their channel; deviations hold under
correlated noise; and a fit can be confined to parameters that a body can have.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import stdtrit

from vpm.errors import IdentificationError, check_known
from vpm.experiment import Experiment
from vpm.identify.feasibility import faults
from vpm.identify.identifiability import Base, find_base, least_step, unseen_combinations
from vpm.identify.inertial_fit import KNOWN, TOGETHER, UNSEEN, VAGUE, InertialFit
from vpm.identify.inertial_model import inertial_regression
from vpm.identify.inertial_regression import InertialRegression
from vpm.identify.inertial_solve import (
    Solution,
    channel_noise,
    effective_samples,
    solve_free,
    solve_physical,
    solve_pulled,
    weighted,
)
from vpm.model import Model
from vpm.numbers import Array

#: Relative singular value, columns of equal length, below which a direction counts as none: far above rounding (1e-15),
#: far below what any noise leaves visible.
RANK = 1e-8
#: Rounds in which the noise of the channels and the weights that follow from it are found.
ROUNDS = 4
#: Half width of a 95 % interval, relative to the value, up to which a parameter counts as known.
WITHIN = 0.2


def identify_inertial(
    source: Model | InertialRegression,
    records: Experiment | Sequence[Experiment] | None = None,
    *,
    others: Sequence[str] | None = None,
    cutoff: float | None = None,
    prior: float | Mapping[str, float] | None = None,
    physical: bool = False,
    complete: bool = False,
    within: float = WITHIN,
    tolerance: float = RANK,
) -> InertialFit:
    """Inertial parameters from motion and effort.

    Parameters
    ----------
    source : Model or InertialRegression
        A rigid model, all bodies of which are sought, or a regression of one's own.
    records : Experiment or sequence of Experiment, optional
        With a model: position of every joint and command of every actuator.
    others, cutoff : optional
        With a model, see `inertial_regression`.
    prior : float or mapping of str to float, optional
        Pulls towards the nominal values: their relative uncertainty, one for all, or standard deviations in SI by name.
    physical : bool
        Only parameters that bodies can have: see `vpm.identify.feasibility`. Begins at the nominal values, which also
        stand where the data say nothing. Deviations are those of the fit without it.
    complete : bool
        Refuse data that do not determine every parameter by itself.
    within : float
        Half width of a 95 % interval, relative to the CAD value (to the estimate without one), up to which a parameter
        counts as known.
    tolerance : float
        Relative singular value below which a direction counts as none, columns of equal length.

    Raises
    ------
    IdentificationError
        Data that no regression can be made of, or that do not determine all parameters though that was asked.
    """
    regression = _regression(source, records, others, cutoff)
    base, noise = _base_and_noise(regression, tolerance)
    if complete:
        _refuse_incomplete(regression, base, noise, tolerance)
    nominal = np.where(np.isfinite(regression.nominal), regression.nominal, 0.0)
    deviations = _prior(regression, prior)
    if deviations is None:
        solution = solve_free(regression, base, noise, nominal)
    else:
        solution = solve_pulled(regression, noise, nominal, deviations)
    if physical:
        solution = solve_physical(regression, noise, nominal, deviations, solution)
    return _result(regression, base, noise, solution, within, open_ended=deviations is None)


def _regression(
    source: Model | InertialRegression,
    records: Experiment | Sequence[Experiment] | None,
    others: Sequence[str] | None,
    cutoff: float | None,
) -> InertialRegression:
    if isinstance(source, InertialRegression):
        if records is not None or others is not None or cutoff is not None:
            raise IdentificationError(
                "a regression holds its own data; give records, others and cutoff with a model only"
            )
        source.check()
        return source
    if records is None:
        raise IdentificationError(f"{source.name}: no record was given; pass at least one")
    return inertial_regression(source, records, others=others, cutoff=cutoff)


def _base_and_noise(regression: InertialRegression, tolerance: float) -> tuple[Base, Array]:
    """Inertial base parameters, and the noise of each channel about their best fit, by turns."""
    size = np.sqrt(np.mean(regression.effort**2, axis=0))
    noise = np.where(size > 0.0, size, 1.0)
    count = len(regression.names)
    prefer = [regression.names.index(name) for name in regression.prefer]
    for _ in range(ROUNDS):
        table, effort = weighted(regression, noise)
        base = find_base(table.reshape(-1, count), tolerance=tolerance, prefer=prefer)
        if not base.kept:
            raise IdentificationError(
                f"no effort depends on any of {', '.join(regression.names[:12])}; these data hold nothing about them",
                parameters=regression.names,
            )
        beta = least_step(table[:, :, list(base.kept)].reshape(-1, base.rank), -effort.ravel())
        rest = regression.effort - regression.regressor[:, :, list(base.kept)] @ beta
        noise = channel_noise(rest, regression.effort, base.rank)
    return base, noise


def _refuse_incomplete(regression: InertialRegression, base: Base, noise: Array, tolerance: float) -> None:
    if base.rank == len(regression.names):
        return
    table, _ = weighted(regression, noise)
    found = unseen_combinations(table.reshape(-1, len(regression.names)), regression.names, tolerance)
    words = "; ".join(str(each) for each in found[:3]) + (f"; and {len(found) - 3} more" if len(found) > 3 else "")
    raise IdentificationError(
        f"{base.rank} of {len(regression.names)} parameters can be told from these data: {words}; leave the parameter "
        "out, move differently, or ask without complete=True for combinations",
        parameters=dict.fromkeys(name for each in found for name in each.names),
    )


def _prior(regression: InertialRegression, prior: float | Mapping[str, float] | None) -> Array | None:
    """Prior standard deviation (p,) of each inertial parameter, infinite where nothing is known."""
    if prior is None:
        return None
    if isinstance(prior, Mapping):
        check_known(prior, regression.names, IdentificationError, "prior: there is no parameter")
        deviations = np.array([float(prior.get(name, np.inf)) for name in regression.names])
    else:
        deviations = float(prior) * np.abs(regression.nominal)
        # Zero by symmetry in a CAD model is no certainty: such a value gets what the largest of its kind has.
        for unit in set(regression.units):
            mine = np.array([other == unit for other in regression.units])
            deviations[mine & (deviations == 0.0)] = deviations[mine].max()
    wrong = [k for k in range(len(deviations)) if not deviations[k] > 0.0 or not np.isfinite(regression.nominal[k])]
    for k in wrong:
        if np.isinf(deviations[k]):
            continue
        raise IdentificationError(
            f"prior: {regression.names[k]} has the nominal value {regression.nominal[k]:.4g} and the deviation "
            f"{deviations[k]:.4g}; give a nominal value, and a deviation above zero"
        )
    return deviations


def _directions(regression: InertialRegression, noise: Array, size: Array, std: float) -> int:
    """Directions of inertial parameters that noise leaves better known than ``std``."""
    table, _ = weighted(regression, noise)
    values = np.linalg.svd(np.linalg.qr(table.reshape(-1, size.size) * size, mode="r"), compute_uv=False)
    return int(np.sum(values * std >= 1.0))


def _result(
    regression: InertialRegression, base: Base, noise: Array, solution: Solution, within: float, *, open_ended: bool
) -> InertialFit:
    effort = regression.effort
    effective = effective_samples(solution.white, solution.robust, effort.size)
    quantile = float(stdtrit(max(effective - base.rank, 1.0), 0.975))
    std = np.sqrt(np.maximum(np.diag(solution.covariance), 0.0))
    alone = {base.kept[row] for row in range(base.rank) if not base.weights[row].any()}
    determined = np.array([k in alone for k in range(len(std))])
    if open_ended:
        std = np.where(determined, std, np.inf)
    size = np.where(np.isfinite(regression.nominal) & (regression.nominal != 0.0), regression.nominal, solution.values)
    sure = quantile * std <= within * np.abs(size)
    words = [
        UNSEEN if k in base.unseen else TOGETHER if not determined[k] else KNOWN if sure[k] else VAGUE
        for k in range(len(std))
    ]
    rest = (effort - regression.regressor @ solution.values) / noise
    return InertialFit(
        names=regression.names,
        units=regression.units,
        nominal=regression.nominal,
        values=solution.values,
        std=std,
        identifiable=tuple(words),
        base_names=tuple(regression.names[k] for k in base.kept),
        base_words=base.words(regression.names),
        base_map=base.map,
        base_nominal=base.map @ regression.nominal,
        base_values=base.map @ solution.values,
        base_std=np.sqrt(np.maximum(np.diag(base.map @ solution.covariance @ base.map.T), 0.0)),
        singular_values=base.singular_values,
        condition=base.condition,
        directions=_directions(regression, noise, np.abs(size), within / quantile),
        samples=len(effort),
        channels=regression.channels,
        noise=noise,
        effective=effective,
        quantile=quantile,
        residual=float(np.sqrt(np.mean(rest**2) * effort.size / max(effort.size - base.rank, 1))),
        faults=faults(regression, solution.values),
        method=solution.method,
    )
