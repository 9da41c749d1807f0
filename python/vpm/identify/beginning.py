"""First states that nobody measured well enough, beside the parameters of a fit.

A simulation begins where a log suggests: at the first samples, which are noisy, with links, oil and loads at rest,
which they need not be. What first states can do to the outputs is a linear space, to first order. Projected off it, the
residual says of the parameters what it says whatever the first states are (variable projection: G. Golub and V.
Pereyra, *SIAM J. Numerical Analysis* 10, 1973), and the covariance of the parameters is that beside unknown first
states.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vpm.identify.objective import AnyProblem
from vpm.identify.output_error import WHOLE, OutputErrorProblem
from vpm.identify.settings import Checks
from vpm.identify.shooting import ShootingProblem
from vpm.identify.whiteness import basis, explained_by, explained_size
from vpm.model import Model

Array = NDArray[np.float64]


class BegunAnywhere(OutputErrorProblem):
    """Output errors of whole records, less what any first states would explain of them.

    Parameters
    ----------
    data : OutputErrorProblem
    slopes : ndarray, shape (n, k)
        Derivative of the residual by first states.
    """

    def __init__(self, data: OutputErrorProblem, slopes: Array) -> None:
        vars(self).update(vars(data))
        self._space = basis(slopes)

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Residual and its derivative beside unknown first states; see :class:`Problem`."""
        residual, jacobian = super().evaluate(model, theta, columns)
        if not np.all(np.isfinite(residual)):
            return residual, jacobian
        return self._left(residual), self._left(jacobian)

    def _left(self, values: Array) -> Array:
        return values - self._space @ (self._space.T @ values)


def first_state_derivative(model: Model, data: AnyProblem) -> Array:
    """Derivative of the residual by all first states of all records, (n, k); no columns in other modes.

    Parameters
    ----------
    model : Model
        At which values.
    data : problem
    """
    if type(data) is not OutputErrorProblem or data.mode not in WHOLE:
        return np.zeros((data.blocks[-1].samples.stop, 0))
    channels = tuple(dict.fromkeys(block.channel for block in data.blocks))
    begun = ShootingProblem(
        model,
        data.experiments,
        data.mode,
        states=model.state_names,
        channels=channels,
        setup=data.setup,
        workers=data.workers,
    )
    slopes = begun.evaluate(model, model.theta)[1]
    return slopes if np.all(np.isfinite(slopes)) else slopes[:, :0]


def matters(data: AnyProblem, residual: Array, jacobian: Array, slopes: Array, checks: Checks) -> bool:
    """Whether first states other than the supposed ones explain what no parameter does, and enough of it to be seen.

    Parameters
    ----------
    data : problem
    residual : ndarray, shape (n,)
    jacobian : ndarray, shape (n, p)
        By the parameters.
    slopes : ndarray, shape (n, k)
        By the first states.
    checks : Checks
        ``begun`` is the probability of a yes where the supposed ones are right.
    """
    if not slopes.shape[1] or not np.all(np.isfinite(residual)):
        return False
    chances, seen = [], []
    for block in data.blocks:
        rows, counts = block.samples, block.moving > 0.0
        share, chance = explained_by(residual[rows], jacobian[rows], slopes[rows], counts)
        chances.append(chance)
        seen.append(explained_size(share, residual[rows][counts], block.weight) >= checks.visible * block.scale)
    return any(chance < checks.begun / len(chances) and shown for chance, shown in zip(chances, seen, strict=True))
