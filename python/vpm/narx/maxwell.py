"""The Maxwell element beside a spring as a difference equation."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vpm._core import Diverged
from vpm._core import MaxwellNarx as Compiled
from vpm.errors import DivergedError, IdentificationError, SimulationError, refused_as
from vpm.narx.maxwell_recursion import POWER_NAMES, Scheme
from vpm.numbers import Array
from vpm.results import Result


@dataclass(frozen=True, repr=False, eq=False)
class MaxwellNarx(Result):
    """``F + tau dF/dt = k0 (s - s0) + tau (k0 + k1) ds/dt``, ``tau = c1 / k1``, sampled.

    A spring k0 beside a spring k1 and a damper c1 in a row; stiffness and free length are polynomials of total degree 3
    or less in a drive signal u and the length s.

    Attributes
    ----------
    k0 : ndarray, shape (10,)
        Coefficients over ``1, u, s, u^2, u s, s^2, u^3, u^2 s, u s^2, s^3``; the first alone is a constant, N/m.
    s0 : ndarray, shape (10,)
        Likewise, m.
    k1 : float
        N/m.
    c1 : float
        N s/m.
    step : float
        Time between samples, s.
    scheme : {"trapezoidal", "printed", "central_mean"}
        Of second order; the printed equations 5.49 to 5.52, of first order with two interleaved sequences; their
        repair, of second order.
    """

    k0: Array
    s0: Array
    k1: float
    c1: float
    step: float
    scheme: Scheme = "trapezoidal"

    def __post_init__(self) -> None:
        """Fill both maps of the Maxwell element up to ten coefficients and check the numbers."""
        for name in ("k0", "s0"):
            given = np.atleast_1d(np.asarray(getattr(self, name), dtype=np.float64))
            if given.ndim != 1 or not 1 <= given.size <= 10:
                raise IdentificationError(
                    f"{name} has shape {given.shape}, but takes 1 to 10 coefficients; a cubic in u and s has ten"
                )
            object.__setattr__(self, name, np.concatenate([given, np.zeros(10 - given.size)]))
        _ = self._compiled

    @cached_property
    def _compiled(self) -> Compiled:
        with refused_as(IdentificationError):
            return Compiled(self.k0, self.s0, self.k1, self.c1, self.step, self.scheme)

    @property
    def relaxation_time(self) -> float:
        """Relaxation time of the Maxwell element, ``tau = c1 / k1`` in s."""
        return self.c1 / self.k1

    def simulate_free_run(
        self, length: ArrayLike, start: tuple[float, float], drive: ArrayLike | None = None, *, limit: float = np.inf
    ) -> Array:
        """Free run of the Maxwell element: force over a record from its own past.

        Parameters
        ----------
        length : array-like, shape (N,)
            s in m.
        start : tuple of two floats
            Force at the first two samples, N.
        drive : array-like, shape (N,), optional
            u; zero by default.
        limit : float
            Force that counts as diverged, N.

        Returns
        -------
        ndarray, shape (N,)
            N; positive where the element pulls its ends together.

        Raises
        ------
        SimulationError
            The arrays do not fit.
        DivergedError
            The force left the limit.
        """
        s = np.asarray(length, dtype=np.float64)
        u = np.zeros(s.shape) if drive is None else np.asarray(drive, dtype=np.float64)
        try:
            return self._compiled.simulate_free_run(list(start), u, s, limit)
        except Diverged as error:
            raise DivergedError(str(error), run=error.outputs, time=error.sample_index * self.step) from error
        except (ValueError, TypeError) as error:
            raise SimulationError(str(error)) from error

    def _headline(self) -> Mapping[str, object]:
        return {
            "k0": float(self.k0[0]),
            "s0": float(self.s0[0]),
            "k1": self.k1,
            "c1": self.c1,
            "tau": self.relaxation_time,
            "step": self.step,
            "scheme": self.scheme,
        }

    def _frame_columns(self) -> Mapping[str, object]:
        return {"power": POWER_NAMES, "k0_N_per_m": self.k0, "s0_m": self.s0}
