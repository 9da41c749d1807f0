"""Free principal moments of inertia in coordinates whose bounds are those of real bodies.

No principal moment exceeds the sum of the other two. A fit that moves the moments themselves runs into that border,
which no bound of a parameter shows: steps beyond it have no machine, and the fit creeps along or stalls. The second
moments of mass along the axes, ``xx = Y + Z``, are positive and nothing else (P. Wensing, S. Kim, J.-J. Slotine, *IEEE
Robotics and Automation Letters* 3, 2018); beside one known moment, sum and difference of the others have bounds.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from vpm.identify.feasibility import pseudo_inertia
from vpm.model import Model
from vpm.numbers import Array

AXES, PAIRS = ("xx", "yy", "zz"), ("xy", "xz", "yz")
#: Share of a sum of moments that a moment may lack and still be as large: a fit that stops for want of gain ends just
#: before the border, and nobody measures a moment to a thousandth.
TOUCHING = 1e-3
#: Halvings by which the border of what bodies can have is found: to a millionth of the way.
HALVINGS = 20
ROUNDED = 1e-12  #: Share of an inertia by which rounding may lead beyond that.


@dataclass(frozen=True, eq=False)
class Coordinates:
    """What a descent moves in place of parameters: ``parameters = matrix @ coordinates``, or the parameters themselves.

    Derivatives of parameters that stay themselves may be infinite, which no product with a matrix bears.
    """

    matrix: Array | None = None

    def parameters(self, x: Array) -> Array:
        """Parameters (p,) at coordinates (p,) of moments of inertia."""
        return x if self.matrix is None else np.asarray(self.matrix @ x)

    def at(self, parameters: Array) -> Array:
        """Coordinates (p,) for moments of inertia from parameters (p,)."""
        return parameters if self.matrix is None else np.asarray(np.linalg.solve(self.matrix, parameters))

    def spread(self, stated: Array) -> Array:
        """Standard deviations (p,) of coordinates for moments from those of parameters; infinite where unknown."""
        if self.matrix is None:
            return stated
        shares = np.linalg.inv(self.matrix)
        parts = np.multiply(shares, stated, out=np.zeros_like(shares), where=shares != 0.0)
        return np.asarray(np.linalg.norm(parts, axis=1))

    def by_coordinates(self, jacobian: Array) -> Array:
        """Derivative (n, p) by the coordinates of moments, from that by the parameters."""
        return jacobian if self.matrix is None or not jacobian.size else np.asarray(jacobian @ self.matrix)

    def by_parameters(self, jacobian: Array) -> Array:
        """Derivative (n, p) by the parameters, from that by the coordinates of moments."""
        return jacobian if self.matrix is None else np.asarray(np.linalg.solve(self.matrix.T, jacobian.T).T)


def real_bodies(
    model: Model, free: Sequence[str], low: Array, high: Array, *, inside: bool = False
) -> tuple[Coordinates, Array, Array]:
    """Coordinates of free parameters in a box, with those of moments of inertia inside what bodies can have.

    ``low``, ``high``: shape (p,), bounds of the parameters.

    - ``inside``: bounds that moments have of their own hold in all of the box; else some of its corners lie beyond them
    - result ``low``, ``high``: shape (p,), bounds of the coordinates. Moments with products of inertia beside them stay
      coordinates.
    """
    matrix, low, high = np.eye(len(free)), low.copy(), high.copy()
    for names in free_moments(model, free):
        mine = [free.index(name) for name in names]
        if ends := beside_known(model, names):
            low[mine], high[mine] = np.maximum(low[mine], ends[0]), np.minimum(high[mine], ends[1])
            continue
        if len(mine) == 3:
            if inside and any(low[k] > 0.0 or np.isfinite(high[k]) for k in mine):
                continue
            matrix[np.ix_(mine, mine)] = 1.0 - np.eye(3)
            low[mine], high[mine] = 0.0, [min(high[k] for k in mine if k != own) for own in mine]
        elif len(mine) == 2:
            (third,) = _known(model, names)
            least, most = _sum_and_difference(third, low[mine], high[mine], inside=inside)
            if np.all(least <= most):
                matrix[np.ix_(mine, mine)] = [[0.5, 0.5], [0.5, -0.5]]
                low[mine], high[mine] = least, most
    return Coordinates(None if np.array_equal(matrix, np.eye(len(free))) else matrix), low, high


def _sum_and_difference(third: float, low: Array, high: Array, *, inside: bool) -> tuple[Array, Array]:
    """Bounds (2,) of sum and difference of two moments of inertia beside a known third.

    - ``inside``: all moments of that box are within their own bounds; else the box just holds all that are
    """
    least, most = max(-third, low[0] - high[1]), min(third, high[0] - low[1])
    sums = float(np.sum(low)), float(np.sum(high))
    if inside:
        sums = max(2.0 * low[0] - least, 2.0 * low[1] + most), min(2.0 * high[0] - most, 2.0 * high[1] + least)
    return np.array([max(third, sums[0]), least]), np.array([sums[1], most])


def free_moments(model: Model, free: Collection[str]) -> list[list[str]]:
    """Free moments of inertia of each body whose axes are its principal ones, and stay so."""
    found = []
    for body in dict.fromkeys(name.rpartition(".inertia.")[0] for name in free if ".inertia." in name):
        products = [f"{body}.inertia.{pair}" for pair in PAIRS]
        mine = [name for axis in AXES if (name := f"{body}.inertia.{axis}") in free]
        if mine and not any(name in free or model.parameters[name].value != 0.0 for name in products):
            found.append(mine)
    return found


def beside_known(model: Model, names: Sequence[str]) -> tuple[float, float] | None:
    """Ends of the one free moment of inertia of a body beside two that are known; none where they leave no room."""
    known = _known(model, names)
    if len(known) != 2 or min(known) <= 0.0:
        return None
    return abs(known[0] - known[1]), known[0] + known[1]


def _known(model: Model, names: Sequence[str]) -> list[float]:
    """Moments of inertia of a body beside its free ones."""
    return [model.parameters[name].value for name in moments_of(names[0]) if name not in names]


def moments_of(moment: str) -> list[str]:
    """All three moments of inertia of a body, from the name of one."""
    body = moment.rpartition(".inertia.")[0]
    return [f"{body}.inertia.{axis}" for axis in AXES]


def to_the_border(before: Array, after: Array) -> Array:
    """Moments of inertia (3,) on the way from those of a real body to others, as far as a body can have them."""
    room, left = (np.sum(moments) - 2.0 * moments for moments in (before, after))
    shares = [r / (r - gone) for r, gone in zip(np.maximum(room, 0.0), left, strict=True) if gone < 0.0]
    return np.asarray(before + min(shares, default=1.0) * (after - before))


def free_tensors(model: Model, free: Collection[str]) -> list[str]:
    """Bodies with free moments or products of inertia whose principal axes may turn."""
    along = {names[0].rpartition(".inertia.")[0] for names in free_moments(model, free)}
    bodies = dict.fromkeys(name.rpartition(".inertia.")[0] for name in free if ".inertia." in name)
    return [body for body in bodies if body not in along]


def tensor_to_the_border(before: Array, after: Array) -> Array:
    """Inertia (6,), xx yy zz xy xz yz, on the way from that of a real body to another, as far as a body can have it.

    Second moments of mass, the half trace less the inertia, are linear in it, and no eigenvalue of theirs is negative
    (Wensing, Kim, Slotine 2018). The least one is concave along the way: bisection finds where it ends.
    """
    if _is_real(after):
        return after
    near, far = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = (near + far) / 2.0
        near, far = (middle, far) if _is_real(before + middle * (after - before)) else (near, middle)
    return np.asarray(before + near * (after - before))


def _is_real(inertia: Array) -> bool:
    """Whether a body can have an inertia (6,), given by its moments and products."""
    second = pseudo_inertia(np.append(np.zeros(4), inertia))[:3, :3]
    return bool(np.linalg.eigvalsh(second)[0] >= -ROUNDED * np.max(np.abs(inertia)))


def rods(model: Model, free: Collection[str]) -> list[tuple[str, str]]:
    """Pairs of free moments of slender rods: the third one is known and zero, so that both are equal."""
    pairs = [mine for mine in free_moments(model, free) if len(mine) == 2]
    return [(one, other) for one, other in pairs if _known(model, (one, other)) == [0.0]]


def on_the_border(model: Model, free: Sequence[str]) -> list[tuple[list[str], str]]:
    """Free moments, and a sentence, of bodies whose moments of inertia are as unequal as any body's can be."""
    told, equal = [], {name for pair in rods(model, free) for name in pair}
    for body in dict.fromkeys(name.rpartition(".inertia.")[0] for name in free if ".inertia." in name):
        largest, *others = sorted((model.parameters[f"{body}.inertia.{axis}"].value, axis) for axis in AXES)[::-1]
        beside = sum(value for value, _ in others)
        moved = [f"{body}.inertia.{axis}" for _, axis in (largest, *others) if f"{body}.inertia.{axis}" in free]
        if equal.issuperset(moved):
            continue
        if moved and beside > 0.0 and largest[0] >= (1.0 - TOUCHING) * beside:
            sentence = (
                f"{', '.join(moved)}: the moment {largest[1]}, {largest[0]:.6g} kg m^2, is as large as the other two "
                "together, the most that a body can have: free all three, or question the model"
            )
            told.append((moved, sentence))
    return told
