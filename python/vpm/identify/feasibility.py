"""Which inertial parameters a real body can have, and a least-squares fit among them.

A body's ten parameters are those of a distribution of mass if and only if its pseudo-inertia is positive definite,
``J = [[S, h], [h', m]]`` with the first moment h and ``S = tr(I)/2 - I`` for the inertia I about the frame's origin.
Then its mass is positive, and so are the principal moments about the centre of mass, none above the sum of the others
(P. Wensing, S. Kim, J.-J. Slotine, "Linear matrix inequalities for physically consistent inertial parameter
identification", *IEEE Robotics and Automation Letters* 3, 2018).

``D(J, J0) = -log det(J / J0) + tr(J / J0) - 4`` is the distance to the nominal body that knows no units and no frames,
and infinite at the border (T. Lee, P. Wensing, F. Park, "Geometric robot dynamic identification: a convex programming
approach", *IEEE Trans. Robotics* 36, 2020). Least squares with a small share of it is convex, so that Newton's method
finds the one answer, inside the border (S. Boyd, L. Vandenberghe, *Convex Optimization*, 2004, section 11.3).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from vpm.errors import IdentificationError
from vpm.identify.identifiability import column_lengths
from vpm.identify.inertial_regression import InertialRegression
from vpm.numbers import Array

#: Radius of gyration that a body without extent gets as a start, m.
LEAST_RADIUS = 0.01
#: Weight of the distance to the nominal bodies beside squared residuals in units of noise. It moves a parameter that
#: data know to a share s by about 0.01 s^2, and one that they do not know to its nominal value.
WEIGHT = 0.01
#: Half the squared Newton step, in units of the cost, at which the last round ends, and that of the rounds before.
SETTLED, NEARLY = 1e-8, 0.05
#: Newton steps of one round.
MOST_STEPS = 200


def pseudo_inertia(ten: Array) -> Array:
    """Pseudo-inertia (4, 4) for feasibility, from mass, first moment and inertia xx yy zz xy xz yz."""
    mass, first, (xx, yy, zz, xy, xz, yz) = ten[0], ten[1:4], ten[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return np.block([[second, first[:, None]], [first[None, :], np.array([[mass]])]])


def fault(ten: Array) -> str:
    """Why ten inertial parameters are not feasible; empty if some body has them."""
    mass = float(ten[0])
    if not mass > 0.0:
        return f"mass {mass:.4g} kg is not positive"
    second = pseudo_inertia(ten)
    about = second[:3, :3] - np.outer(second[:3, 3], second[:3, 3]) / mass
    low, middle, high = np.linalg.eigvalsh(np.trace(about) * np.eye(3) - about)
    if not low > 0.0:
        return f"principal moment {low:.4g} kg m^2 about the centre of mass is not positive"
    if not high < low + middle:
        return f"principal moment {high:.4g} kg m^2 is above the sum of the others, {low + middle:.4g} kg m^2"
    return ""


def faults(regression: InertialRegression, values: Array) -> dict[str, str]:
    """Infeasible parameters by body or name; empty text where nothing is."""
    place = {name: k for k, name in enumerate(regression.names)}
    found = {body: fault(values[[place[name] for name in ten]]) for body, ten in regression.bodies.items()}
    for name in regression.positive:
        value = float(values[place[name]])
        unit = regression.units[place[name]]
        found[name] = "" if value > 0.0 else f"{value:.4g}{'' if unit == '1' else f' {unit}'} is not positive"
    return found


class Distance:
    """Distance of parameters to nominal ones that is infinite where no body can have them.

    A sum of D for each body, of its scalar form ``-log(p/p0) + p/p0 - 1`` for other positive parameters, and of squared
    relative differences for the rest.

    ``regression``: with feasible nominal values.
    """

    def __init__(self, regression: InertialRegression) -> None:
        place = {name: k for k, name in enumerate(regression.names)}
        self._tens = [np.array([place[name] for name in ten]) for ten in regression.bodies.values()]
        self._positive = np.array([place[name] for name in regression.positive], dtype=int)
        bound = {int(k) for ten in self._tens for k in ten} | set(self._positive.tolist())
        self._free = np.array([k for k in range(len(regression.names)) if k not in bound], dtype=int)
        self.start = start = np.where(np.isfinite(regression.nominal), regression.nominal, 0.0)
        for name, ten in zip(regression.bodies, self._tens, strict=True):
            start[ten] = _extended(start[ten])
            if fault(start[ten]):
                raise IdentificationError(
                    f"the nominal values of {name} are those of no body: {fault(start[ten])}; a physical fit begins "
                    "there, give feasible ones"
                )
        for k in self._positive:
            if not start[k] > 0.0:
                raise IdentificationError(
                    f"the nominal value of {regression.names[k]} is {regression.nominal[k]:.4g}; a physical fit begins "
                    "there, give a positive one"
                )
        self._scale = np.where(start[self._free] != 0.0, np.abs(start[self._free]), 1.0)
        self._inverses = [np.linalg.inv(pseudo_inertia(start[ten])) for ten in self._tens]

    def __call__(self, values: Array) -> float:
        """Distance from the feasible border; infinite where it has no finite value."""
        total = float(np.sum(((values - self.start)[self._free] / self._scale) ** 2))
        ratio = values[self._positive] / self.start[self._positive]
        if np.any(ratio <= 0.0):
            return np.inf
        total += float(np.sum(ratio - 1.0 - np.log(ratio)))
        for ten, inverse in zip(self._tens, self._inverses, strict=True):
            matrix = pseudo_inertia(values[ten])
            try:
                factor = np.linalg.cholesky(matrix)
            except np.linalg.LinAlgError:
                return np.inf
            logarithm = 2.0 * float(np.sum(np.log(np.diag(factor)))) + float(np.linalg.slogdet(inverse)[1])
            total += float(np.sum(inverse * matrix)) - 4.0 - logarithm
        return total

    def root(self, values: Array) -> tuple[Array, Array]:
        """Root of the feasibility distance: C (k, p) and c (k,) with Hessian ``C'C`` and gradient ``C'c``."""
        count = len(values)
        rows, right = [], []
        for ten, inverse in zip(self._tens, self._inverses, strict=True):
            # In the frame of the factor L of J = L L', the change E_k of J by parameter k is L^-1 E_k L^-T.
            factor = np.linalg.cholesky(pseudo_inertia(values[ten]))
            changes = np.array([_seen_from(factor, unit) for unit in _UNITS])
            block = np.zeros((16, count))
            block[:, ten] = changes.reshape(10, 16).T
            rows.append(block)
            right.append((factor.T @ inverse @ factor - np.eye(4)).ravel())
        for k in self._positive:
            block = np.zeros((1, count))
            block[0, k] = 1.0 / values[k]
            rows.append(block)
            right.append(np.array([values[k] / self.start[k] - 1.0]))
        block = np.zeros((len(self._free), count))
        block[np.arange(len(self._free)), self._free] = np.sqrt(2.0) / self._scale
        return np.vstack([*rows, block]), np.concatenate([*right, block @ (values - self.start)])


def nearest(columns: Array, right: Array, distance: Distance) -> Array:
    """Nearest feasible parameters (p,): ``|columns p - right|^2 / 2 + WEIGHT distance`` is least.

    Newton's method from the nominal values, with weights of the distance that fall by tens down to the last.
    """
    values = distance.start.copy()
    first = max(0.5 * float(np.sum((columns @ values - right) ** 2)), WEIGHT)
    weights = [*(first * 0.1**k for k in range(int(np.log10(first / WEIGHT)) + 1)), WEIGHT]
    for weight in weights:
        values = _newton(columns, right, distance, values, weight, SETTLED if weight == WEIGHT else NEARLY)
    return values


def _newton(columns: Array, right: Array, distance: Distance, values: Array, weight: float, settled: float) -> Array:
    size = np.sqrt(weight)

    def cost(p: Array) -> float:
        return 0.5 * float(np.sum((columns @ p - right) ** 2)) + weight * distance(p)

    now = cost(values)
    for _ in range(MOST_STEPS):
        root, gradient = distance.root(values)
        rows = np.vstack([columns, size * root])
        lengths = column_lengths(rows)
        against = np.concatenate([right - columns @ values, -size * gradient])
        step = np.linalg.lstsq(rows / lengths, against, rcond=1e-15)[0] / lengths
        gain = 0.5 * float(np.sum((rows @ step) ** 2))
        if gain <= settled * (1.0 + now if settled == SETTLED else weight):
            return values
        share = 1.0
        while not (new := cost(values + share * step)) < now - 1e-4 * share * gain:
            share *= 0.5
            if share < 1e-10:
                return values  # rounding: the cost falls no further
        values, now = values + share * step, new
    raise IdentificationError(
        f"the physical fit did not settle in {MOST_STEPS} steps; give a prior, or nominal values nearer by"
    )


def _extended(ten: Array) -> Array:
    """Feasible extent: a point mass or a thin rod gets a little in all directions."""
    matrix = pseudo_inertia(ten)
    if not ten[0] > 0.0 or not fault(ten):
        return ten
    about = matrix[:3, :3] - np.outer(matrix[:3, 3], matrix[:3, 3]) / ten[0]
    if np.linalg.eigvalsh(about)[0] < -1e-9 * ten[0]:
        return ten  # not thin but impossible
    matrix[:3, :3] += ten[0] * LEAST_RADIUS**2 * np.eye(3)
    second = matrix[:3, :3]
    inertia = np.trace(second) * np.eye(3) - second
    return np.array([ten[0], *ten[1:4], *inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])


_UNITS = np.array([pseudo_inertia(unit) for unit in np.eye(10)])


def _seen_from(factor: NDArray[np.floating], change: Array) -> Array:
    half = solve_triangular(factor, change, lower=True)
    return np.asarray(solve_triangular(factor, half.T, lower=True))
