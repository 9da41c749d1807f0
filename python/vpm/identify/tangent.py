"""Fits in which what links and drives do is taken from its tangent, so that few of their steps ask for a simulation."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vpm.errors import DivergedError
from vpm.identify.estimation import Estimate, estimate
from vpm.identify.inverse_dynamics import InverseDynamicsProblem
from vpm.identify.response_along_motion import bends, has_hidden, has_own_drives, joints_with_play, shows_drives_alone
from vpm.model import Model
from vpm.numbers import Array

#: Tangents that are tried one after the other, and shares of the way to where the fit on one of them ends.
TANGENTS, SHARES = 8, (1.0, 0.5, 0.25, 0.125)
#: The same where a link flies through a play: impacts shift in time, of which a tangent knows little, and the start was
#: read off the flights.
FLYING = 2
#: What the tangent may be off by where the fit ends, as a share of the residual: its sum of squares is then within the
#: square of it of the least one.
OFF = 0.03


class Tangent:
    """An inverse-dynamics residual with links and drives as on the tangent at ``origin``, values of the parameters."""

    mode = InverseDynamicsProblem.mode

    def __init__(self, data: InverseDynamicsProblem, origin: Array) -> None:
        self.data, self.origin, self.blocks = data, origin, data.blocks

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Residual and derivative on the tangent; see `vpm.identify.problem.Problem`."""
        return self.data.evaluate(model, theta, columns, self.origin)


def has_tangent(model: Model, data: InverseDynamicsProblem) -> bool:
    """Whether a fit on the tangent is possible: links bend, or several drives have states."""
    return drives_on_tangent(model, data) or data.bending(model) is not None


def drives_on_tangent(model: Model, data: InverseDynamicsProblem) -> bool:
    """Whether several drives with states are taken on the tangent; a single one is as soon simulated."""
    if not has_own_drives(model) or any(has_hidden(model, m.joints) for m in data.motions):
        return False
    return shows_drives_alone(model, data.shown) and len(model.actuators) > 1


def estimate_on_tangent(
    model: Model,
    data: InverseDynamicsProblem,
    free: tuple[str, ...],
    origin: Array,
    *,
    bounds: Mapping[str, tuple[float, float]],
    tolerance: float,
) -> Estimate:
    """A fit on one tangent after the other, until where it ends the tangent still holds.

    - ``origin``: shape (P,), where the tangent touches
    """
    residual, _ = data.evaluate(model, model.theta)
    cost, at, columns = float(residual @ residual), model, [model.index(name) for name in free]
    flying = bool(joints_with_play(model)) and not bends(model)
    flying = flying and has_hidden(model, data.motions[0].joints)
    for _ in range(FLYING if flying else TANGENTS):
        rough = estimate(at, Tangent(data, origin), free, bounds=bounds, tolerance=tolerance)
        for share in SHARES:
            values = _on_the_way(at.theta[columns], rough.values, share)
            reached = replace(rough, values=values).on(at)
            residual = _residual(data, reached)
            if residual @ residual <= cost * (1.0 + OFF**2):
                break
        else:
            if not flying:
                return estimate(at, data, free, bounds=bounds, tolerance=tolerance)
            reached, residual = at, _residual(data, at)
            break
        near = share == 1.0 and np.linalg.norm(residual - rough.residual) <= OFF * np.linalg.norm(residual)
        if near or rough.interrupted:
            break
        cost, at, origin = float(residual @ residual), reached, reached.theta
    return replace(rough, values=reached.theta[columns], residual=residual)


def _on_the_way(start: Array, end: Array, share: float) -> Array:
    """Values on the way of a tangent fit, never beyond its ends: rounding must not pass a bound."""
    return np.clip(start + share * (end - start), np.minimum(start, end), np.maximum(start, end))


def _residual(data: InverseDynamicsProblem, model: Model) -> Array:
    """Residual for a tangent fit; infinite where the machine cannot follow the motion."""
    try:
        return data.evaluate(model, model.theta)[0]
    except (DivergedError, ValueError):
        return np.full(data.blocks[-1].samples.stop, np.inf)
