"""Closed loops of a model: where they close, what is independent, what holds them, where they are singular."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vpm.errors import ModelError, near_match
from vpm.model.loops.assembly import CLOSED, NOTHING, assembled, followed, least, mirrored, null_space, pivots
from vpm.model.loops.path import Path, Singularity
from vpm.model.loops.states import rest
from vpm.numbers import Array, array_of, number_of

if TYPE_CHECKING:
    from vpm.model.evaluation import Evaluations


@dataclass(frozen=True)
class LoopState:
    """Closure equations of all loops at a state: gap, Jacobian, drift, and which are independent."""

    #: Shape (m,); per loop the way from A to B in the world (m), then cosines of angles that have to be right ones.
    gap: Array
    jacobian: Array  #: Shape (m, n); its derivative J by the coordinates.
    drift: Array  #: Shape (m,); ``J' v``.
    independent: NDArray[np.bool_]  #: Shape (m,); equations that say something that the others do not.

    @property
    def rank(self) -> int:
        """Number of independent closure equations."""
        return int(self.independent.sum())


class Loops:
    """The closed loops of a model, in the order of the file.

    Positions ``q``, velocities ``v`` and accelerations ``a`` have one number per coordinate, in the order of
    ``model.coordinates``.

    Examples
    --------
    >>> q = model.loops.assembled({"crank": 0.3})
    >>> model.loops.efforts(q, v, a)
    """

    def __init__(self, model: Evaluations) -> None:
        self._model = model

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the closures: joints that close loops."""
        return tuple(self._model.loop_entries)

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __repr__(self) -> str:
        return f"Loops({', '.join(self.names)})"

    # ---- kinematics --------------------------------------------------------------------------------------------------

    def at(self, q: ArrayLike, v: ArrayLike | None = None) -> LoopState:
        """Closure gap of the loops, its derivatives, and which equations are independent.

        Parameters
        ----------
        q : array_like, shape (n,)
        v : array_like, shape (n,), optional
            Zero by default.
        """
        q = np.asarray(q, dtype=np.float64)
        gap, jacobian, drift, chosen = self._model.core.loops(
            self._model.theta, q, np.zeros_like(q) if v is None else np.asarray(v, dtype=np.float64)
        )
        return LoopState(gap, jacobian, drift, chosen > 0.5)

    def assembled(self, held: Mapping[str, float] | None = None, guess: Mapping[str, float] | None = None) -> Array:
        """Coordinates at which all loop closures hold.

        Parameters
        ----------
        held : mapping of str to float, optional
            Positions (m, rad) of coordinates that stay as they are.
        guess : mapping of str to float, optional
            Where the others begin; elsewhere `start` of the model file, or zero. The assembly next to it is found.

        Returns
        -------
        ndarray, shape (n,)

        Raises
        ------
        ModelError
            A name is unknown, or the loops do not close there; the message names the gap that is left.
            Or two assemblies are as near to where the others begin, as from a stretched pose; the message tells both.
        """
        if not held and not guess and self._decided is not None:
            return self._decided.copy()
        return self._assembled(held or {}, guess or {})

    def _assembled(self, held: Mapping[str, float], guess: Mapping[str, float]) -> Array:
        q, fixed = self._begun(held, guess)
        closed = assembled(self, q, fixed, len(self._model.joints))
        self._complain(closed, held)
        if {*self._model.joints} - {*held} - {*guess}:
            self._refuse_two(closed, q, fixed)
        return closed

    def near(self, readings: Mapping[str, float], before: Array | None = None) -> Array:
        """Coordinates next to readings of joints (m, rad) at which all loop closures hold.

        They are reached by a motion from the assembly ``before``, by default that of the model file, so that loops
        stay on their side. Where the file does not decide between two, the readings do.
        """
        q, ends = self._begun(readings, {})
        begin = self._decided if before is None else before
        if begin is None:
            q[list(ends)] = list(ends.values())
            closed = assembled(self, q, {}, len(self._model.joints))
        else:
            closed = followed(self, begin, ends, len(self._model.joints))
        self._complain(closed, {})
        return closed

    def velocities(self, q: ArrayLike, held: Mapping[str, float]) -> Array:
        """Rates that keep the loop closures, the smallest ones with those of some coordinates given.

        Raises
        ------
        ModelError
            A name is unknown, or the loops do not let the coordinates move so.
        """
        v = np.zeros(len(self._model.coordinates))
        for name, value in held.items():
            v[self.place(name)] = number_of(value, f"{self._model.name}: {name}", ModelError)
        fixed = [self.place(name) for name in held]
        jacobian, left = self.at(q).jacobian, 0.0
        for count in (len(self._model.joints), v.size):  # flexible links move only where joints cannot
            free = [place for place in range(count) if place not in fixed]
            v[free] = least(jacobian[:, free], -jacobian[:, fixed] @ v[fixed])
            left = float(np.abs(jacobian @ v).max(initial=0.0))
            if left <= NOTHING * max(float(np.abs(v).max(initial=0.0)), 1.0):
                break
        else:
            given = ", ".join(f"{name} = {value:g}" for name, value in held.items())
            raise ModelError(
                f"the loops of {self._model.name} do not let {given} be velocities at once: they tear at {left:.3g} "
                "m/s or rad/s; give as many as there are degrees of freedom, or none in a singular configuration"
            )
        return v

    def independent(self, q: ArrayLike, prefer: Iterable[str] = ()) -> tuple[str, ...]:
        """Independent coordinates near ``q`` under the closures: as many as degrees of freedom.

        The dependent ones are the pivots of an elimination of the loops' derivative, sought among joints without an
        actuator first, then among the others, then among those to ``prefer`` and the coordinates of flexible links.
        """
        names, joints = self._model.coordinates, range(len(self._model.joints))
        preferred, driven = {self.place(name) for name in prefer}, {self.place(name) for name in self._driven}
        tiers: list[list[int]] = [
            [place for place in joints if place not in preferred | driven],
            [place for place in joints if place in driven - preferred],
            [place for place in joints if place in preferred],
            list(range(len(joints), len(names))),
        ]
        state = self.at(q)
        dependent = pivots(state.jacobian, state.rank, tiers)
        return tuple(name for place, name in enumerate(names) if place not in dependent)

    def transmission(self, q: ArrayLike, inputs: Sequence[str]) -> Array:
        """Rates of all coordinates that closures demand per unit rate of inputs, shape (n, len(inputs)).

        Its rows are ratios and levers: rad/m of a joint by a stroke, and the effort on a stroke by one on the joint.

        Raises
        ------
        ModelError
            A name is unknown, or these coordinates do not decide the others there, as in singular configurations.
        """
        places = [self.place(name) for name in inputs]
        state = self.at(q)
        n = state.jacobian.shape[1]
        free = [place for place in range(n) if place not in places]
        block = state.jacobian[:, free]
        if np.linalg.matrix_rank(block, tol=NOTHING) < len(free):
            raise ModelError(
                f"{', '.join(inputs)} do not decide the other coordinates of {self._model.name} there: the loops have "
                f"{n - state.rank} degrees of freedom, or these are singular; name others, or move away"
            )
        whole = np.zeros((n, len(places)))
        whole[places, np.arange(len(places))] = 1.0
        whole[free] = -np.linalg.lstsq(block, state.jacobian[:, places], rcond=NOTHING)[0]
        return whole

    def accelerations(self, q: ArrayLike, v: ArrayLike, given: Mapping[str, float]) -> Array:
        """Accelerations of all coordinates that closures demand for independent ones, shape (n,)."""
        state, names = self.at(q, v), tuple(given)
        a: Array = self.transmission(q, names) @ np.array([given[name] for name in names])
        free = [place for place, name in enumerate(self._model.coordinates) if name not in names]
        a[free] += least(state.jacobian[:, free], -state.drift)
        return a

    def turns(self, coordinate: str) -> bool:
        """Whether a closure's coordinate is an angle, so that a whole turn of it changes nothing."""
        return coordinate in self._model.joints and self._model.joint_kind(coordinate) == "revolute"

    @cached_property
    def angles(self) -> list[int]:
        """Places of the coordinates that turn a joint of the closed loops, see `turns`."""
        return [place for place, name in enumerate(self._model.coordinates) if self.turns(name)]

    # ---- what is said of them ----------------------------------------------------------------------------------------

    def summary(self, q: ArrayLike | None = None) -> str:
        """Sentence on the closure equations, redundant ones, and degrees of freedom."""
        state = self.at(self.assembled() if q is None else q)
        m, n = state.jacobian.shape
        redundant = m - state.rank
        said = f"{redundant or 'none'} of them {'are' if redundant > 1 else 'is'} redundant"
        return (
            f"closed loops {', '.join(self.names)}: {m} equations, of which {state.rank} are independent ({said}), "
            f"so that {n - state.rank} of {n} coordinates are free"
        )

    def describe(self, q: ArrayLike) -> str:
        """Joints of an assembly of the closed loops in words, ``crank = 0.3 rad, guide = 0.4 m``."""
        shown = zip(self._model.joints, np.asarray(q, dtype=np.float64).tolist(), strict=False)
        units = {True: "rad", False: "m"}
        return ", ".join(f"{name} = {value:.4g} {units[self.turns(name)]}" for name, value in shown)

    # ---- efforts -----------------------------------------------------------------------------------------------------

    def efforts(
        self, q: ArrayLike, v: ArrayLike, a: ArrayLike, joints: Sequence[str] | None = None
    ) -> dict[str, float]:
        """Efforts (N, N m) of the driven joints under loop closures: inverse dynamics.

        Parameters
        ----------
        q, v, a : array_like, shape (n,)
            With closed loops, see `assembled`, `velocities` and `accelerations`.
        joints : sequence of str, optional
            Joints that are driven; by default those with an actuator.

        Raises
        ------
        ModelError
            The motion opens the loops, or the joints are fewer or more than it needs.

        Notes
        -----
        ``S u + J^T l = M a + h`` in all coordinates, projected on the motions that the loops allow.
        """
        q, v, a = (
            array_of(x, f"{self._model.name}: {what}", ModelError) for x, what in zip((q, v, a), "qva", strict=True)
        )
        driven = tuple(self._driven if joints is None else joints)
        state = self.at(q, v)
        for what, left in (
            ("position", state.gap),
            ("velocity", state.jacobian @ v),
            ("acceleration", state.jacobian @ a + state.drift),
        ):
            size = max(1.0, float(np.abs(v).max(initial=0.0)) ** 2, float(np.abs(a).max(initial=0.0)))
            if (worst := np.abs(left).max(initial=0.0)) > 1e-6 * size:
                raise ModelError(f"the {what} opens the loops by {worst:.3g}; take it from model.loops")
        moves = null_space(state.jacobian)
        levers = moves[[self.place(name) for name in driven]].T
        if np.linalg.matrix_rank(levers, tol=NOTHING) < max(len(driven), moves.shape[1]):
            raise ModelError(
                f"the joints {', '.join(driven) or '(none)'} cannot be worked out for {moves.shape[1]} degrees of "
                "freedom there; name as many driven joints that move the machine independently"
            )
        needed = np.asarray(self._model.inverse_dynamics(q, v, a))
        return dict(zip(driven, np.linalg.solve(levers, moves.T @ needed).tolist(), strict=True))

    def rest(self, held: Mapping[str, float]) -> tuple[Array, dict[str, float]]:
        """Rest of closures under gravity with some joints held, where the loops' forces balance.

        Parameters
        ----------
        held : mapping of str to float
            Positions of the joints that are held (m, rad).

        Returns
        -------
        coordinates : ndarray, shape (n,)
        efforts : dict of str to float
            Efforts (N, N m) on the held joints; springs of lines carry their part.

        Raises
        ------
        ModelError
            The loops do not close, or no rest is found.
        """
        return rest(self._model, held)

    # ---- singular configurations -------------------------------------------------------------------------------------

    def singularities(
        self, coordinate: str, held: Mapping[str, float] | None = None, guess: Mapping[str, float] | None = None
    ) -> tuple[Singularity, ...]:
        """Singular configurations of closures on the way of one degree of freedom, all others held.

        Parameters
        ----------
        coordinate : str
            The one that drives, such as the stroke of an actuator.
        held : mapping of str to float, optional
            Coordinates that stand still, so that one degree of freedom is left.
        guess : mapping of str to float, optional
            Where the way begins, see `assembled`; each assembly may have a way of its own.

        Returns
        -------
        tuple of Singularity
            Places at which the coordinate stands still while others move: there it loses control of them.

        Raises
        ------
        ModelError
            The loops do not close, or not one degree of freedom is left.
        """
        held = dict(held or {})
        start = self.assembled(held, guess)
        fixed = [self.place(name) for name in held]
        return Path(self, self._model.coordinates, fixed).singular(start, self.place(coordinate))

    # ---- inside ------------------------------------------------------------------------------------------------------

    @cached_property
    def _starts(self) -> dict[str, float]:
        entries = self._model.loop_entries.values()
        return {name: value for entry in entries for name, value in entry.start.items()}

    @cached_property
    def _decided(self) -> Array | None:
        """Closure that the model file begins with, if it tells one."""
        try:
            return self._assembled({}, {})
        except ModelError:
            return None

    @cached_property
    def _driven(self) -> tuple[str, ...]:
        model = self._model
        direct = [name for name in model.actuators if model.line_of_actuator(name) is None]
        return tuple(dict.fromkeys(joint for name in direct for joint in model.joints_of_actuator(name)))

    def _begun(self, held: Mapping[str, float], guess: Mapping[str, float]) -> tuple[Array, dict[int, float]]:
        """Coordinates from which a closure is sought, and by place those that stay."""
        q = np.zeros(len(self._model.coordinates))
        for name, value in {**self._starts, **guess}.items():
            q[self.place(name)] = number_of(value, f"{self._model.name}: {name}", ModelError)
        fixed = {
            self.place(name): number_of(value, f"{self._model.name}: {name}", ModelError)
            for name, value in held.items()
        }
        return q, fixed

    def place(self, name: str) -> int:
        """Number of a coordinate in the closure equations.

        Raises
        ------
        ModelError
            There is none of that name.
        """
        short = name.removesuffix(".position").removesuffix(".velocity")
        if short not in self._model.coordinates:
            repair = near_match(short, self._model.coordinates, what="it has")
            raise ModelError(f'{self._model.name} has no coordinate "{short}"; {repair}', where=name)
        return self._model.coordinates.index(short)

    def _refuse_two(self, closed: Array, start: Array, fixed: Mapping[int, float]) -> None:
        other = mirrored(self, start, fixed, len(self._model.joints))
        if other is not None:
            raise ModelError(
                f"the loops of {self._model.name} close with {self.describe(closed)}, and as near to their start with "
                f"{self.describe(other)}; give a start nearer to the one that is meant"
            )

    def _complain(self, q: Array, held: Mapping[str, float]) -> None:
        gap = self.at(q).gap
        if np.abs(gap).max(initial=0.0) <= CLOSED:
            return
        gaps, first = {}, 0
        for name, entry in self._model.loop_entries.items():
            gaps[name] = gap[first : first + entry.equations]
            first += entry.equations
        worst = max(gaps, key=lambda name: float(np.abs(gaps[name]).max()))
        given = " with " + ", ".join(f"{name} = {value:g}" for name, value in held.items()) + " held" if held else ""
        way, turned = float(np.linalg.norm(gaps[worst][:3])), float(np.abs(gaps[worst][3:]).max(initial=0.0))
        open_by = [
            f"{size:.4g} {unit}" for size, unit in ((way, "m"), (math.asin(min(turned, 1.0)), "rad")) if size > CLOSED
        ]
        raise ModelError(
            f"the loops of {self._model.name} do not close{given}: loop {worst} stays open by {' and '.join(open_by)}; "
            "hold other positions, or give a start nearer to an assembly"
        )
