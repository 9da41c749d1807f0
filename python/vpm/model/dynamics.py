"""The dynamics of a model for many fast evaluations, markers by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from vpm.numbers import Array

if TYPE_CHECKING:
    from vpm.model.model import Model


class Dynamics:
    """Mass matrix, inverse and forward dynamics and energy of a model, ready to be evaluated many times a second.

    All buffers are made once. Contiguous arrays of double precision are read where they are; each call makes one new
    array, its result. Arrays have one number per coordinate, in the order of ``model.coordinates``: m or rad, per
    second, N or N m. Wrong lengths and numbers that are not finite raise ``CoreError``.
    An object may be shared between threads, but one for each is faster.

    Examples
    --------
    >>> dynamics = Dynamics(model)
    >>> effort = dynamics.inverse_dynamics(q, v, a)
    """

    __slots__ = ("_jacobian", "_numbers", "energy", "forward_dynamics", "inverse_dynamics", "mass_matrix", "model")

    def __init__(self, model: Model) -> None:
        from vpm._core import Dynamics as Core

        core = Core(model.core, model.theta)
        self.model = model
        # The core's own methods, without a Python function in between.
        self.mass_matrix = core.mass_matrix
        self.inverse_dynamics = core.inverse_dynamics
        self.forward_dynamics = core.forward_dynamics
        self.energy = core.energy
        self._jacobian = core.jacobian
        self._numbers = {name: number for number, name in enumerate(model.markers)}

    def jacobian(self, marker: str, q: ArrayLike) -> Array:
        """Jacobian (6, n) of a marker; see :meth:`vpm.Model.jacobian`."""
        number = self._numbers.get(marker)
        return self.model.jacobian(marker, q) if number is None else self._jacobian(q, number)

    def __repr__(self) -> str:
        return f"Dynamics({self.model.name!r}, coordinates={len(self.model.coordinates)})"
