"""First states that nobody measured well enough, beside the parameters of a fit.

A simulation begins where a log suggests: at the first samples, which are noisy, with links, oil and loads at rest,
which they need not be. So does what is worked out along a measured motion, such as a joint without an encoder. What
first states can do to a residual is a linear space, to first order. Projected off it, the residual says of the
parameters what it says whatever the first states are (variable projection: G. Golub and V. Pereyra, *SIAM J. Numerical
Analysis* 10, 1973), and the covariance of the parameters is that beside unknown first states. So that first order is
enough, the records begin where the first states are likeliest (L. Kaufman, *BIT* 15, 1975).

Parameters move first states too: equilibria of flexible links, chambers at rest, sensors undone. The core
differentiates the steps that it takes; what the first state adds comes from differences here.
"""

from collections.abc import Callable, Sequence
from copy import copy
from typing import Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from vpm.errors import DivergedError
from vpm.identify.identifiability import least_step
from vpm.identify.problem import Block
from vpm.identify.settings import Checks
from vpm.identify.whiteness import DEPENDENT, basis, explained_by, explained_size
from vpm.model import Model
from vpm.numbers import Array

Rows = NDArray[np.bool_]
#: Index of one entry of an array, or of entries of all rows.
Place = int | tuple[slice, int]

#: Shares of a state's size, and of a parameter, by which they are moved to find a derivative; errors of the difference
#: are the squares of these.
OF_STATE, OF_PARAMETER = 1e-5, 1e-4
#: Steps towards the likeliest first states, and shares of each that are tried.
STEPS, SHARES = 8, (1.0, 0.5, 0.25, 0.125)
#: Shares of the records from which first states are sought one after the other: what begins far from where it is taken
#: to be soon runs out of step.
HORIZONS = (0.125, 0.25, 0.5, 1.0)
#: A step that lowers the sum of squares by less than this share is the last.
SETTLED = 1e-3


def difference(function: Callable[[Array], Array], at: Array, place: Place, step: float) -> Array:
    """Central difference by first states or other entries ``at[place]`` of the argument, which move together."""
    sides = []
    for sign in (1.0, -1.0):
        moved = at.copy()
        moved[place] += sign * step
        sides.append(function(moved))
    return np.asarray((sides[0] - sides[1]) / (2.0 * step))


class BegunAnywhere:
    """A problem whose records may begin elsewhere than their logs suggest."""

    mode: str
    blocks: tuple[Block, ...]
    #: By how much first states differ from those that the logs suggest (records, states), if they do.
    departures: Array | None = None
    #: Orthonormal basis (n, k) of what unknown first states can do to the residual.
    _space: Array | None = None

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Residual and derivative beside unknown first states; see `vpm.identify.problem.Problem`."""
        raise NotImplementedError

    def open_states(self, model: Model) -> tuple[Array, int]:
        """Sizes of the first states (states,) that no log tells, 0 for those that one does; number of records."""
        raise NotImplementedError

    def begun(self, departures: Array | None) -> Self:
        """The problem with other first states, which are taken for known."""
        return self.changed(departures=departures, _space=None)

    def beside(self, slopes: Array) -> Self:
        """The problem beside unknown first states, by which the residual has these slopes (n, k)."""
        return self.changed(_space=basis(slopes) if slopes.shape[1] else None)

    def changed(self, **attributes: object) -> Self:
        """Copy of a problem with unknown first states, with other attributes."""
        same = copy(self)
        vars(same).update(attributes)
        return same

    @property
    def unknown(self) -> int:
        """Number of unknown first states that the residual shows."""
        return 0 if self._space is None else self._space.shape[1]

    def _left(self, values: Array) -> Array:
        """Residual (n,) or its derivative (n, columns) without what first states explain of it."""
        if self._space is None or not np.all(np.isfinite(values)):
            return values
        return np.asarray(values - self._space @ (self._space.T @ values))


AnyBegun = TypeVar("AnyBegun", bound=BegunAnywhere)


def first_state_derivative(model: Model, data: BegunAnywhere) -> Array:
    """Derivative of the residual by all open first states of all records, (n, records * k)."""
    sizes, records = data.open_states(model)
    places = np.flatnonzero(sizes)
    known = _departures(data, sizes, records)
    slopes = np.zeros((data.blocks[-1].samples.stop, records, places.size))
    for column, place in enumerate(places):
        slope = difference(
            lambda x: _residual(model, data.begun(x)), known, np.s_[:, int(place)], OF_STATE * sizes[place]
        )
        if not np.all(np.isfinite(slope)):
            return slopes[:, 0, :0]
        for number, block in enumerate(data.blocks):  # the blocks of one record after those of another
            slopes[block.samples, number * records // len(data.blocks), column] = slope[block.samples]
    return slopes.reshape(len(slopes), records * places.size)


def begun_likeliest(model: Model, data: AnyBegun) -> AnyBegun:
    """The problem beside unknown first states, begun where these leave least at a model's values."""
    horizons = HORIZONS if data.departures is None else HORIZONS[-1:]
    data = data.begun(_departures(data, *data.open_states(model)))
    for share in horizons:
        data = _nearer(model, data, _early(data, share))
    return data.beside(first_state_derivative(model, data))


def begun_again(model: Model, data: AnyBegun) -> AnyBegun:
    """The problem with the likeliest first states of its records, if it is beside unknown ones; else as it is."""
    return begun_likeliest(model, data) if data.unknown else data


def _nearer(model: Model, data: AnyBegun, early: Rows) -> AnyBegun:
    """Problem with first states at which its early rows (n,) are least, by Gauss-Newton steps."""
    (sizes, records), residual = data.open_states(model), _residual(model, data.begun(data.departures), early)
    places = np.flatnonzero(sizes)
    for _ in range(STEPS if np.all(np.isfinite(residual)) else 0):
        step = np.zeros((records, sizes.size))
        slopes = np.where(early[:, None], first_state_derivative(model, data), 0.0)
        if not slopes.shape[1]:
            break
        # Along the directions that the data show.
        step[:, places] = least_step(slopes, residual, DEPENDENT).reshape(records, places.size)
        for share in SHARES:
            tried = data.begun(_departures(data, sizes, records) + share * step)
            left = _residual(model, tried, early)
            if left @ left < residual @ residual:
                break
        else:
            break
        near = left @ left > (1.0 - SETTLED) * (residual @ residual)
        data, residual = tried, left
        if near:
            break
    return data


def _early(data: BegunAnywhere, share: float) -> Rows:
    """True for the first of the rows (n,) that count of each record, until these are a share of them."""
    counted = [np.cumsum(block.moving > 0.0) for block in data.blocks]
    return np.concatenate([number <= share * number[-1] for number in counted])


def _departures(data: BegunAnywhere, sizes: Array, records: int) -> Array:
    return np.zeros((records, sizes.size)) if data.departures is None else data.departures


def _residual(model: Model, data: BegunAnywhere, rows: Rows | bool = True) -> Array:
    """Residual (n,) of first states, 0 but for some rows; infinite where the machine diverges."""
    try:
        residual = data.evaluate(model, model.theta)[0]
    except (DivergedError, ValueError):
        residual = np.full(data.blocks[-1].samples.stop, np.inf)
    return np.where(rows, residual, 0.0)


def matters(model: Model, data: BegunAnywhere, residual: Array, jacobian: Array, checks: Checks) -> bool:
    """Whether first states other than the supposed ones explain what no parameter does, and enough of it to be seen.

    - ``model``: as fitted
    - ``residual``: shape (n,)
    - ``jacobian``: shape (n, p), by the parameters
    - ``checks``: ``begun`` is the probability of a yes where the supposed ones are right
    """
    slopes = first_state_derivative(model, data)
    if not slopes.shape[1] or not np.all(np.isfinite(residual)):
        return False
    chances, seen = [], []
    for block in data.blocks:
        rows, counts = block.samples, block.moving > 0.0
        share, chance = explained_by(residual[rows], jacobian[rows], slopes[rows], counts)
        chances.append(chance)
        seen.append(explained_size(share, residual[rows][counts], block.weight) >= checks.visible * block.scale)
    return any(chance < checks.begun / len(chances) and shown for chance, shown in zip(chances, seen, strict=True))


def first_state_slopes(
    begin: Callable[[Array], Array], theta: Array, columns: Sequence[int], fixed: Sequence[int] = ()
) -> dict[int, Array]:
    """Derivative of the first state by parameters, for those that move it.

    ``begin``: first state (nx,) at parameters; ``fixed``: states that nothing moves, because they are known or fitted.
    Result: ``{place in columns: derivative (nx,)}``.
    """
    found = {}
    for k, column in enumerate(columns):
        try:
            slope = difference(begin, theta, column, OF_PARAMETER * (abs(theta[column]) or 1.0))
        except ValueError:  # no machine, or no equilibrium there
            continue
        slope[list(fixed)] = 0.0
        if np.any(slope):
            found[k] = slope
    return found


def add_first_state(
    jacobian: Array, outputs: Callable[[Array], Array], state: Array, slopes: dict[int, Array], theta: Array
) -> None:
    """Add what the first state does to outputs (n, channels) to their derivative (n, channels, k), in place.

    - ``state``: shape (nx,)
    - ``slopes``: of `first_state_slopes`
    - ``theta``: shape (k,), parameters in question, for the size of the difference
    """
    for k, slope in slopes.items():
        step = OF_PARAMETER * (abs(theta[k]) or 1.0)
        ahead, behind = (outputs(state + sign * step * slope) for sign in (1.0, -1.0))
        jacobian[:, :, k] += (ahead - behind) / (2.0 * step)
