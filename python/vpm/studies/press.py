"""Newton's method with line search, rounds of augmented Lagrange and load steps for a soft body on an obstacle."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError
from vpm.numbers import Array
from vpm.studies.jet import Jet
from vpm.studies.soft import Obstacle, SoftBody, State

#: Newton steps, halvings of a step, halvings of a load step, rounds of contact.
STEPS, HALVINGS, CUTS, ROUNDS = 30, 6, 6, 12
#: Balance that counts as reached, of a force of the body's size; overlap that counts as none, of the way pressed;
#: change of the force between rounds that counts as none.
BALANCE, OVERLAP, SETTLED = 1e-9, 1e-4, 1e-4


class _StuckError(Exception):
    """Newton's method found no balance, or rounds of contact left an overlap."""


@dataclass(frozen=True)
class Pressed:
    """A body pressed so far."""

    indentation: float  #: Way of the obstacle since it touched, m.
    force: float  #: N.
    energy: float  #: Elastic, J.
    #: Radius now (m) and mean true pressure (Pa) of the edges of the skin, from the axis outwards.
    radius: Array
    pressure: Array
    contact_radius: float  #: m.
    overlap: float  #: Mean overlap, weighed by the pressure, m.
    state: State
    newton: int  #: Newton steps that it took.

    @property
    def area(self) -> float:
        """Area of contact of a pressed body, m^2."""
        return float(np.pi * self.contact_radius**2)


def press(
    body: SoftBody,
    ways: Iterable[float],
    *,
    start: float,
    curvature: float = 0.0,
    augmented: bool = True,
    after: Pressed | None = None,
) -> list[Pressed]:
    """Raise an obstacle against a body, one load step after the other.

    - ``ways``: indentations in growing order, m
    - ``start``: height of the obstacle where it touches, m
    - ``curvature``: of the obstacle, see `Obstacle`
    - ``augmented``: False for the penalty alone, which lets the body overlap
    - ``after``: where to go on
    """
    state, reached = (after.state, after.indentation) if after else (body.rest(), 0.0)
    results = []
    for way in ways:
        state, steps = _advance(body, state, reached, way, start, curvature, augmented)
        reached = way
        results.append(_seen(body, state, way, Obstacle(start + way, curvature), steps))
    return results


def _advance(
    body: SoftBody, state: State, reached: float, way: float, start: float, curvature: float, augmented: bool
) -> tuple[State, int]:
    """Balance of a pressed body at the next indentation, reached in halved steps where need be."""
    step, smallest, total = way - reached, (way - reached) / 2**CUTS, 0
    while reached < way * (1.0 - 1e-12):
        goal = min(reached + step, way)
        try:
            state, steps = _settled(body, state.copy(), Obstacle(start + goal, curvature), goal, augmented)
            reached, total = goal, total + steps
        except _StuckError as error:
            step /= 2.0
            if step < smallest:
                raise VpmError(
                    f"no balance was found beyond an indentation of {1e3 * reached:.4g} mm (asked {1e3 * way:.4g} mm), "
                    "not even in small steps; press less deep, take a finer mesh or a stiffer material"
                ) from error
    return state, total


def _settled(body: SoftBody, state: State, obstacle: Obstacle, way: float, augmented: bool) -> tuple[State, int]:
    """Balance on an obstacle, with contact pressures that leave no overlap that the mesh could avoid.

    An element in which the contact ends has fewer freedoms than points, so that some overlap may stay for ever. Rounds
    end when they no longer move the force.
    """
    total, before = 0, np.inf
    for _ in range(ROUNDS):
        state, steps = _newton(body, state, obstacle)
        total, force = total + steps, body.force(state, obstacle)
        settled = abs(force - before) <= SETTLED * abs(force)
        if not augmented or settled or _overlap(body, state, obstacle) < OVERLAP * way:
            return state, total
        state.multiplier, before = body.touch(state, obstacle), force
    raise _StuckError


def _overlap(body: SoftBody, state: State, obstacle: Obstacle) -> float:
    """Mean overlap, weighed by the pressure that acts through it, m: what contact takes of the work, by the force.

    Its largest value says less: a curve of the second order has not enough freedom for every point of the element in
    which the contact ends.
    """
    pressure, gap = body.touch(state, obstacle), body.gap(state, obstacle)[0]
    weight = pressure * np.asarray(body.skin.global_coordinates()[0]) * body.skin.dx
    return float(np.sum(weight * np.maximum(0.0, -gap)) / max(np.sum(weight), np.finfo(float).tiny))


def _newton(body: SoftBody, state: State, obstacle: Obstacle) -> tuple[State, int]:
    from scipy.sparse.linalg import spsolve

    count = body.basis.N
    free = np.setdiff1d(np.arange(count + state.pressure.size), body.fixed)
    residual, known = body.residual(state, obstacle)
    scale = _scale(body)
    for step in range(STEPS):
        if _size(residual[free], scale) < BALANCE:
            return state, step
        matrix = body.tangent(state, obstacle, known)[free][:, free]
        change = np.zeros(residual.size)
        change[free] = spsolve(matrix.tocsc(), -residual[free])
        state, residual, known = _searched(body, state, obstacle, change, _size(residual[free], scale), free)
    raise _StuckError


def _scale(body: SoftBody) -> tuple[int, float, float]:
    """Number of displacements, and scales of force and volume for the balance of a pressed body."""
    shear = max(material.shear for material in body.materials)
    extent = float(np.ptp(body.mesh.doflocs, axis=1).max())
    return body.basis.N - body.fixed.size, shear * extent**2, extent**3


def _size(residual: Array, scale: tuple[int, float, float]) -> float:
    count, force, volume = scale
    return float(np.hypot(np.linalg.norm(residual[:count]) / force, np.linalg.norm(residual[count:]) / volume))


def _searched(
    body: SoftBody, state: State, obstacle: Obstacle, change: Array, before: float, free: NDArray[np.int64]
) -> tuple[State, Array, tuple[Jet, Jet, Array]]:
    """Line search of a pressed body: the longest of halved steps that lessens the imbalance."""
    count, share = body.basis.N, 1.0
    for _ in range(HALVINGS):
        trial = State(
            state.displacement + share * change[:count], state.pressure + share * change[count:], state.multiplier
        )
        with np.errstate(all="ignore"):
            residual, known = body.residual(trial, obstacle)
            after = _size(residual[free], _scale(body))
            upright = bool(np.all(known[1].value > 0.0))
        if np.isfinite(after) and upright and after < 2.0 * before:
            return trial, residual, known
        share /= 2.0
    raise _StuckError


def _seen(body: SoftBody, state: State, way: float, obstacle: Obstacle, steps: int) -> Pressed:
    """Force, energy, contact radius and pressure of a pressed body in balance."""
    touching = body.touch(state, obstacle) > 0.0
    now = body.gap(state, obstacle)[1]
    edge = float(now[touching].max()) if touching.any() else 0.0
    after = now[~touching & (now > edge)]
    contact = 0.5 * (edge + float(after.min())) if edge and after.size else edge
    force, energy = body.force(state, obstacle), body.energy(state)
    radius, pressure = _pressures(body, state, obstacle)
    return Pressed(way, force, energy, radius, pressure, contact, _overlap(body, state, obstacle), state, steps)


def _pressures(body: SoftBody, state: State, obstacle: Obstacle) -> tuple[Array, Array]:
    """Mean true pressure of each edge: its force over its shadow on the obstacle, from the axis outwards.

    Within an edge the pressures at the points jump about that mean, which alone the mesh can tell.
    """
    field, normal = body.skin.interpolate(state.displacement), np.asarray(body.skin.normals)
    along = np.stack([-normal[1], normal[0]])
    grow = along[0] + np.einsum("jkq,jkq->kq", np.asarray(field.grad)[0], along)
    rest = np.asarray(body.skin.global_coordinates()[0])
    now = rest + np.asarray(field)[0]
    force = np.sum(body.touch(state, obstacle) * rest * body.skin.dx, axis=1)
    shadow = np.sum(now * np.abs(grow) * body.skin.dx, axis=1)
    order = np.argsort(rest.mean(axis=1))
    pressure = force / np.maximum(shadow, 1e-12 * float(np.max(rest)) ** 2)
    return np.asarray(now.mean(axis=1)[order]), np.asarray(pressure[order])
