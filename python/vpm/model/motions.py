"""What a model answers about motions, one or many at once: efforts, accelerations, inertia, kinematics, derivatives."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import CoreError, ModelError
from vpm.model.component_names import Components
from vpm.model.standard import OF_FILE, PLAIN, STANDARD, standard_parameters
from vpm.numbers import Array, array_of

if TYPE_CHECKING:
    from vpm._core import Dynamics, System
    from vpm.model.parameters import Parameter

Shape = tuple[int, ...]

#: Difference of efforts, relative to their size, below which they agree: rounding of long sums.
AGREE = 1e-8
#: Quantities in messages, in the order in which the core takes them.
MOTION = ("position", "velocity", "acceleration or effort")


@dataclass(frozen=True, eq=False)
class EffortDerivatives:
    """Efforts of an inverse dynamics with their exact derivatives; ``...`` is the shape of the motions."""

    effort: Array  #: Shape (..., n).
    #: Shape (..., n, n); column j is the derivative by coordinate j; the last one is the mass matrix, where no effect
    #: takes a share of the load.
    by_position: Array
    by_velocity: Array
    by_acceleration: Array
    by_parameters: Array  #: Shape (..., n, k); column j is the derivative by parameter j of those asked for.
    parameters: tuple[str, ...]  #: Their names.


class Motions(Components):
    """The part of a model that asks the core about motions.

    Positions, velocities and so on are arrays whose last axis has one number per coordinate, in the order of
    ``model.coordinates`` (joints, then the elastic coordinates of flexible links); m or rad, per second, N or N m.
    The axes before, ``...``, may be any, and those of several arguments are broadcast: all motions are worked out in
    one call of the core, on all threads. What remembers, such as a hysteresis, is relaxed. Errors count motions row by
    row.
    """

    @property
    @abstractmethod
    def parameters(self) -> Mapping[str, Parameter]:
        """Parameters by dotted name of the model whose motions are computed."""

    @property
    @abstractmethod
    def theta(self) -> Array:
        """Values of all parameters for motions, in index order."""

    @abstractmethod
    def index(self, name: str) -> int:
        """Index of a parameter for motions."""

    @property
    @abstractmethod
    def core(self) -> System:
        """Compiled system that computes motions."""

    @cached_property
    def dynamics(self) -> Dynamics:
        """The core's evaluations of single motions with this model's parameters, all buffers prepared.

        Its methods are those of the model, without a Python function in between, and take markers by number.
        """
        from vpm._core import Dynamics

        return Dynamics(self.core, self.theta)

    # ---- dynamics ----------------------------------------------------------------------------------------------------

    def mass_matrix(self, q: ArrayLike) -> Array:
        """Mass matrix M(q) at one or many motions, payloads included.

        Parameters
        ----------
        q : array_like, shape (..., n)

        Returns
        -------
        ndarray, shape (..., n, n)
            kg, kg m or kg m^2; symmetric.

        Raises
        ------
        CoreError
            The length is wrong, or a number is not finite.
        """
        if np.ndim(q) <= 1:
            return self.dynamics.mass_matrix(q)
        n = len(self.coordinates)
        return self._answers("mass_matrix", (q,), (n, n))

    @property
    def masses_at_zero(self) -> Array:
        """Mass matrix diagonal for motions about zero, shape (n,), kg or kg m^2."""
        return np.diag(self.mass_matrix(np.zeros(len(self.coordinates))))

    def inverse_dynamics(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
        """Efforts of actuators for motions with accelerations ``a``: ``M(q) a + h(q, v) - effects(q, v)``.

        Weight, Coriolis and centrifugal efforts are in h; frictions, springs and loads of the model are carried too.
        Of a machine with closed loops they are those on all coordinates of the open tree; `Loops.efforts` puts them on
        the driven joints.

        Parameters
        ----------
        q, v, a : array_like, shape (..., n)

        Returns
        -------
        ndarray, shape (..., n)
            N or N m. What a flexible link's coordinates need beside zero, no actuator can give.

        Raises
        ------
        CoreError
            A length is wrong, or a number is not finite.
        """
        if _single(q, v, a):
            return self.dynamics.inverse_dynamics(q, v, a)
        return self._answers("inverse_dynamics", (q, v, a), (len(self.coordinates),))

    def inverse_dynamics_derivatives(
        self, q: ArrayLike, v: ArrayLike, a: ArrayLike, *, parameters: Sequence[str] = ()
    ) -> EffortDerivatives:
        """Efforts of `inverse_dynamics` with their exact derivatives by the motion, and by parameters.

        At a kink, such as dry friction without a transition velocity at rest, they are those of one side.

        Parameters
        ----------
        q, v, a : array_like, shape (..., n)
        parameters : sequence of str
            Dotted names, as in ``model.parameters``.

        Raises
        ------
        ModelError
            A parameter is unknown.
        CoreError
            A length is wrong, a number is not finite, or a law decides by the value of a state.
        """
        if isinstance(parameters, str):
            raise ModelError(f'parameters is the text "{parameters}"; give a list of names, ["{parameters}"]')
        names = tuple(parameters)
        n, (effort, derivatives) = len(self.coordinates), self._differentiated((q, v, a), names, self.theta)
        by_q, by_v, by_a, rest = (part.copy() for part in np.split(derivatives, [n, 2 * n, 3 * n], axis=-1))
        return EffortDerivatives(effort, by_q, by_v, by_a, rest, names)

    def forward_dynamics(self, q: ArrayLike, v: ArrayLike, effort: ArrayLike) -> Array:
        """Accelerations at motions under actuator efforts, with all effects.

        Parameters
        ----------
        q, v, effort : array_like, shape (..., n)

        Returns
        -------
        ndarray, shape (..., n)
            m/s^2 or rad/s^2.

        Raises
        ------
        CoreError
            A length is wrong, or a number is not finite.
        """
        if _single(q, v, effort):
            return self.dynamics.forward_dynamics(q, v, effort)
        return self._answers("forward_dynamics", (q, v, effort), (len(self.coordinates),))

    def energy(self, q: ArrayLike, v: ArrayLike) -> tuple[Any, Any]:
        """Kinetic and potential energy at motions, J.

        The potential is that of the bodies in gravity and of the effects, flexible links, contacts, bushings and
        springs of lines that store energy, these without a command.

        Parameters
        ----------
        q, v : array_like, shape (..., n)

        Returns
        -------
        kinetic, potential : float, or ndarray of shape (...)

        Raises
        ------
        CoreError
            A length is wrong, or a number is not finite.
        """
        if _single(q, v):
            return self.dynamics.energy(q, v)
        both = self._answers("energy", (q, v), (2,))
        return both[..., 0].copy(), both[..., 1].copy()

    # ---- kinematics --------------------------------------------------------------------------------------------------

    def forward_kinematics(self, marker: str, q: ArrayLike) -> Array:
        """Pose of a marker in the world at motions.

        Parameters
        ----------
        q : array_like, shape (..., n)

        Returns
        -------
        ndarray, shape (..., 4, 4)
            ``[[R, t], [0, 1]]``: the columns of R are the marker's axes in the world, t (m) is its origin.

        Raises
        ------
        ModelError
            There is no such marker.
        CoreError
            A length is wrong, or a number is not finite.
        """
        return self._answers("marker_pose", (q,), (4, 4), self._marker(marker))

    def jacobian(self, marker: str, q: ArrayLike) -> Array:
        """Jacobian of a marker at motions: what the rates of the coordinates do to it.

        Parameters
        ----------
        q : array_like, shape (..., n)

        Returns
        -------
        ndarray, shape (..., 6, n)
            Angular velocity (rows 0 to 2) and velocity of its origin, in world axes, per unit rate of each coordinate.

        Raises
        ------
        ModelError
            There is no such marker.
        CoreError
            A length is wrong, or a number is not finite.
        """
        number = self._marker(marker)
        if np.ndim(q) <= 1:
            return self.dynamics.jacobian(q, number)
        return self._answers("marker_jacobian", (q,), (6, len(self.coordinates)), number)

    # ---- inertial parameters -----------------------------------------------------------------------------------------

    @property
    def standard_bodies(self) -> tuple[str, ...]:
        """Bodies whose inertial parameters the model file states."""
        return tuple(name for name in self.bodies if f"{name}.mass" in self.parameters)

    @property
    def standard_names(self) -> tuple[str, ...]:
        """Names of the columns of `regressor`: mass, first moment, moments of inertia about the frame's origin."""
        return tuple(f"{body}.{end}" for body in self.standard_bodies for end in STANDARD)

    @property
    def standard_parameters(self) -> Array:
        """Values of ``standard_names``, shape (p,): kg, kg m, kg m^2."""
        tens = self.theta[self._inertial_places].reshape(-1, 10)
        return np.concatenate([np.zeros(0), *(standard_parameters(float(row[0]), row[1:4], row[4:]) for row in tens)])

    def regressor(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
        """Regressor Y at motions: `inverse_dynamics` is ``Y @ model.standard_parameters`` and a rest.

        The rest is what frictions, springs, payloads, rotors and flexible links need, whatever the bodies are.

        Parameters
        ----------
        q, v, a : array_like, shape (..., n)

        Returns
        -------
        ndarray, shape (..., n, p)
            Columns are named by ``standard_names``, ten for each body.

        Raises
        ------
        ModelError
            The effort is not linear in the inertial parameters.
        CoreError
            A length is wrong, or a number is not finite.

        Notes
        -----
        At bodies with their centres in their origins the derivatives by mass, centre and inertia are those by the
        standard parameters (C. Atkeson, C. An, J. Hollerbach, *Int. J. Robotics Research* 5, 1986).
        """
        names = [f"{body}.{end}" for body in self.standard_bodies for end in OF_FILE]
        plain, tens = self.theta.copy(), np.tile(PLAIN, len(self.standard_bodies))
        plain[self._inertial_places] = tens
        effort, table = self._differentiated((q, v, a), names, plain, motion_too=False)
        own = np.asarray(self.inverse_dynamics(q, v, a))
        linear = effort + table @ (self.standard_parameters - tens)
        apart, size = (
            np.abs(own - linear).max(initial=0.0),
            np.abs(own).max(initial=0.0) + np.abs(table).max(initial=0.0),
        )
        if apart > AGREE * size:
            raise ModelError(
                f"the effort of {self.name} is not linear in its inertial parameters: it misses the linear law by "
                f"{apart:.2g} of {size:.3g}; leave out the effect that takes a share of the load"
            )
        return table

    @property
    def _inertial_places(self) -> list[int]:
        return [self.index(f"{body}.{end}") for body in self.standard_bodies for end in OF_FILE]

    # ---- the core ----------------------------------------------------------------------------------------------------

    def _marker(self, name: str) -> int:
        return self.markers.index(self._known(name, self.markers, "marker"))

    def _answers(self, question: str, motion: Sequence[ArrayLike], shape: Shape, marker: int = 0) -> Array:
        """Answer of the core to one question about all motions, (..., *shape)."""
        leading, tables = self._tables(motion)
        values, _ = self.core.answers(self.theta, question, marker, tables)
        return values.reshape(leading + shape)

    def _differentiated(
        self, motion: Sequence[ArrayLike], names: Sequence[str], theta: Array, *, motion_too: bool = True
    ) -> tuple[Array, Array]:
        """Efforts (..., n) and derivatives (..., n, k): by the motion, then by parameters."""
        places = [self.index(self._known(name, tuple(self.parameters), "parameter")) for name in names]
        once = list(dict.fromkeys(places))
        leading, tables = self._tables(motion)
        values, found = self.core.answers(theta, "inverse_dynamics", 0, tables, motion_too, once)
        n = len(self.coordinates)
        first = 3 * n if motion_too else 0
        columns = [*range(first), *(first + once.index(place) for place in places)]
        derivatives = found if len(once) == len(places) else found[..., columns]
        return values.reshape(*leading, n), derivatives.reshape(*leading, n, len(columns))

    def _tables(self, motion: Sequence[ArrayLike]) -> tuple[Shape, list[Array]]:
        """Common shape of the motions given, and each of their quantities as a table, a row each."""
        n, arrays = len(self.coordinates), []
        for name, given in zip(MOTION, motion, strict=False):
            array = array_of(given, f"{self.name}: {name}", CoreError)
            if array.ndim == 0 or array.shape[-1] != n:
                raise CoreError(
                    f"{self.name}: {name} has shape {array.shape}, but its last axis has to have {n} entries, one for "
                    f"each coordinate ({', '.join(self.coordinates[:6])}{', ...' if n > 6 else ''}); reshape it"
                )
            arrays.append(array)
        try:
            leading = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
        except ValueError:
            shapes = ", ".join(str(array.shape) for array in arrays)
            raise CoreError(
                f"{self.name}: motions of shapes {shapes} do not go together; give the same number of motions to all"
            ) from None
        rows = int(np.prod(leading, dtype=np.int64))
        return leading, [np.broadcast_to(array, (*leading, n)).reshape(rows, n) for array in arrays]


def _single(*motion: ArrayLike) -> bool:
    return all(np.ndim(part) <= 1 for part in motion)
