"""Output errors of the element over records, with exact derivatives; starting forces are solved for on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vpm.narx.maxwell_basis import Basis
from vpm.narx.maxwell_records import Samples
from vpm.narx.maxwell_recursion import Recursion, Scheme, seen, stretch
from vpm.numbers import Array

#: Relaxation times that records can show: half a step, below which samples alternate in the trapezoidal form, and so
#: many times the longest record.
SHORTEST, LONGEST = 0.5, 10.0


@dataclass(frozen=True)
class Parameters:
    """Maps over their bases, ``k1`` in N/m and the relaxation time in s."""

    k0: Array
    s0: Array
    k1: float
    tau: float

    @classmethod
    def from_vector(cls, x: Array, terms: int) -> Parameters:
        """Parameters of a Maxwell problem from one array; k0 has `terms` coefficients."""
        return cls(x[:terms], x[terms:-2], float(x[-2]), float(np.exp(x[-1])))

    def to_vector(self) -> Array:
        """Array of a Maxwell problem's k0, s0, k1 and the logarithm of tau."""
        return np.concatenate([self.k0, self.s0, [self.k1, np.log(self.tau)]])


class OutputErrors:
    """Computed less measured forces of records in free run.

    The equation is linear in the force, so that a free run and its derivatives by every parameter are outputs of one
    and the same linear filter. The starting forces of each record, which are measured with noise, enter linearly; they
    are replaced by their best values, and the derivatives by what those leave of them (variable projection: G. Golub
    and V. Pereyra, Inverse Problems 19, 2003; derivatives after L. Kaufman, BIT 15, 1975).

    ``scheme``: one of "trapezoidal", "printed", "central_mean"; ``k0``, ``s0``: of the maps.
    """

    def __init__(self, records: Sequence[Samples], scheme: Scheme, k0: Basis, s0: Basis) -> None:
        self.records = list(records)
        self.scheme: Scheme = scheme
        self.terms = len(k0.terms)
        self.count = self.terms + len(s0.terms) + 2
        self._columns = [(k0.columns(one.drive, one.length), s0.columns(one.drive, one.length)) for one in self.records]
        self._stretch = [stretch(scheme, one.length) for one in self.records]

    @property
    def limits(self) -> tuple[float, float]:
        """Logarithms of the relaxation times that the records of a Maxwell problem can show."""
        longest = max(one.force.size * one.step for one in self.records)
        return float(np.log(SHORTEST * self.records[0].step)), float(np.log(LONGEST * longest))

    @property
    def freedom(self) -> int:
        """Degrees of freedom of a Maxwell problem: samples less starting forces."""
        return sum(one.force.size - Recursion(self.scheme, 1.0).weights.lag for one in self.records)

    def columns(self, at: int) -> tuple[Array, Array]:
        """Monomials of k0 and of s0 in one record of a Maxwell problem."""
        return self._columns[at]

    def residual(self, x: Array) -> Array:
        """Residual of a Maxwell problem: computed less measured forces, N, shape (all samples,)."""
        return np.concatenate([self.record(at, x)[0] for at in range(len(self.records))])

    def jacobian(self, x: Array) -> Array:
        """Derivatives of a Maxwell problem's residual, shape (all samples, parameters)."""
        return np.concatenate([self._derivatives(at, x) for at in range(len(self.records))])

    def record(self, at: int, x: Array) -> tuple[Array, Array]:
        """Residual of one record in a Maxwell problem, and its computed force."""
        p, one = Parameters.from_vector(x, self.terms), self.records[at]
        recursion = Recursion(self.scheme, p.tau / one.step)
        elastic, rate = self._parts(at, p)
        force = recursion.filtered(elastic + recursion.ratio * rate)
        starts = recursion.start_responses(one.force.size)
        best, *_ = np.linalg.lstsq(starts, one.force - force, rcond=None)
        force = force + starts @ best
        return force - one.force, force

    def _parts(self, at: int, p: Parameters) -> tuple[Array, Array]:
        columns_k, columns_s = self._columns[at]
        stiffness = columns_k @ p.k0
        elastic = stiffness * (self.records[at].length - columns_s @ p.s0)
        rate = (seen(self.scheme, stiffness) + p.k1) * self._stretch[at]
        return seen(self.scheme, elastic), rate

    def _derivatives(self, at: int, x: Array) -> Array:
        p, one, ds = Parameters.from_vector(x, self.terms), self.records[at], self._stretch[at]
        columns_k, columns_s = self._columns[at]
        recursion = Recursion(self.scheme, p.tau / one.step)
        r = recursion.ratio
        _, force = self.record(at, x)
        _, rate = self._parts(at, p)
        free = one.length - columns_s @ p.s0
        by_k0 = seen(self.scheme, columns_k * free[:, None]) + r * seen(self.scheme, columns_k) * ds[:, None]
        by_s0 = -seen(self.scheme, columns_s * (columns_k @ p.k0)[:, None])
        right = np.column_stack([by_k0, by_s0, r * ds])
        whole = np.column_stack([recursion.filtered(right), r * recursion.by_ratio(force, rate)])
        directions, _ = np.linalg.qr(recursion.start_responses(one.force.size))
        return np.asarray(whole - directions @ (directions.T @ whole))

    def search(self, x: Array, ratios: Array) -> Array:
        """Search of a Maxwell problem over relaxation times, with the best k1 of each; the maps stay.

        ``x``: k1 and tau in it are not used; ``ratios``: ``tau / h`` to be tried.
        """
        step, best, least = self.records[0].step, x.copy(), np.inf
        for ratio in ratios:
            trial = x.copy()
            trial[-2:] = 0.0, np.log(ratio * step)
            zero = self.residual(trial)
            trial[-2] = 1.0
            slope = self.residual(trial) - zero
            size = float(slope @ slope)
            k1 = -float(slope @ zero) / size if size > 0.0 else 0.0
            cost = float(np.sum((zero + k1 * slope) ** 2))
            if cost < least:
                trial[-2] = k1
                least, best = cost, trial
        return best
