"""A nonlinear program that is linear but for functions of single points, with exact sparse derivatives for IPOPT.

All constraints are ``A z + sum B_i G(V_i z)``, where ``G`` is a small function of the variables of a point (its state,
command and duration). First and second derivatives are those of ``G``, evaluated for all points at once and put to
their places by constant sparse matrices.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array

from vpm.numbers import Array
from vpm.optimise.equations import Expression, casadi

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Group:
    """One function of a nonlinear program at several points."""

    #: Symbols of one point, shape (nv,), and what follows from them, shape (nr,).
    variables: Expression
    results: Expression
    count: int  #: Points.
    V: csr_array  #: Variables of all points; shape (count * nv, nz).
    #: What each result adds to the constraints, and in the last row to the objective; shape (ng + 1, count * nr).
    B: csc_array


@dataclass
class Program:
    """The program: make ``c z + last row`` least."""

    A: csr_array  #: Shape (ng, nz).
    groups: list[Group]
    slack: Array  #: 1 for variables whose sum is made least where the task cannot be done; shape (nz,).
    c: Array
    _solvers: dict[str, Any] = field(default_factory=dict)

    def functions(self) -> tuple[Any, dict[str, Any]]:
        """Symbols and expressions of the program for ``nlpsol``, and its derivatives as options."""
        ca = casadi()
        ng, nz = self.A.shape
        z, p = ca.MX.sym("z", nz), ca.MX.sym("p")
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", ng)
        own, slack = ca.DM(self.c).T, ca.DM(self.slack).T
        # p = 0 is the task, p = 1 its slacks alone.
        total = ca.mtimes(_dm(self.A), z)
        cost = (1 - p) * ca.mtimes(own, z) + p * ca.mtimes(slack, z)
        jacobian = _Entries(*_triplets(csc_array(self.A)), self.A.shape)
        gradient = ca.densify((1 - p) * own + p * slack)
        hessian = _Entries(*_triplets(csc_array((nz, nz))), (nz, nz))
        for group in self.groups:
            nv, nr = group.variables.numel(), group.results.numel()
            v = ca.reshape(ca.mtimes(_dm(group.V), z), nv, group.count)
            G = ca.Function("G", [group.variables], [group.results])
            found = ca.vec(G.map(group.count)(v))
            B, d = group.B[:ng], group.B[[ng]]
            total += ca.mtimes(_dm(B), found)
            cost += (1 - p) * ca.mtimes(_dm(d), found)
            J = ca.jacobian(group.results, group.variables)
            jf = ca.vec(ca.Function("J", [group.variables], [_nonzeros(J)]).map(group.count)(v))
            places = _pattern(J)
            jacobian.add(_products(B, group.V, places, (nr, nv), group.count), jf)
            gradient += (1 - p) * _row(d, group, places, (nr, nv), jf, nz)
            mult = ca.SX.sym("m", nr)
            H = ca.hessian(ca.dot(mult, group.results), group.variables)[0]
            weights = ca.reshape(
                ca.mtimes(_dm(csc_array(B.T)), lam_g) + lam_f * (1 - p) * ca.mtimes(_dm(csc_array(d.T)), 1),
                nr,
                group.count,
            )
            hf = ca.vec(ca.Function("H", [group.variables, mult], [_nonzeros(H)]).map(group.count)(v, weights))
            hessian.add(_products(csc_array(group.V.T), group.V, _pattern(H), (nv, nv), group.count, upper=True), hf)
        options = {
            "grad_f": ca.Function("grad_f", [z, p], [cost, gradient.T], ["x", "p"], ["f", "grad_f_x"]),
            "jac_g": ca.Function("jac_g", [z, p], [total, jacobian.matrix()], ["x", "p"], ["g", "jac_g_x"]),
            "hess_lag": ca.Function(
                "hess_lag",
                [z, p, lam_f, lam_g],
                [hessian.matrix()],
                ["x", "p", "lam_f", "lam_g"],
                ["triu_hess_gamma_x_x"],
            ),
        }
        return {"x": z, "p": p, "f": cost, "g": total}, options

    def solver(self, options: dict[str, Any], callback: Any) -> Any:  # noqa: ANN401
        """IPOPT on the program, called with start, bounds and ``p``."""
        ca = casadi()
        if not self._solvers:
            self._solvers["problem"], self._solvers["derivatives"] = self.functions()
        settings = {
            "print_time": False,
            "error_on_fail": False,
            "show_eval_warnings": False,
            "iteration_callback": callback,
            "ipopt": options,
        }
        return ca.nlpsol("solver", "ipopt", self._solvers["problem"], {**settings, **self._solvers["derivatives"]})


class _Entries:
    """A sparse matrix whose entries are sums of given expressions."""

    def __init__(self, rows: Indices, columns: Indices, constants: Array, shape: tuple[int, int]) -> None:
        self.shape = shape
        self._rows, self._columns, self._values = [rows], [columns], [constants]
        self._of, self._sizes = [np.full(rows.size, -1)], 0
        self._sources: list[Expression] = []

    def add(self, products: tuple[Indices, Indices, Indices, Array], source: Expression) -> None:
        rows, columns, of, values = products
        self._rows.append(rows)
        self._columns.append(columns)
        self._values.append(values)
        self._of.append(of + self._sizes)
        self._sources.append(source)
        self._sizes += source.numel()

    def matrix(self) -> Expression:
        ca = casadi()
        rows, columns = np.concatenate(self._rows), np.concatenate(self._columns)
        of, values = np.concatenate(self._of), np.concatenate(self._values)
        # Places in the order of CasADi: column by column.
        keys, entry = np.unique(columns * self.shape[0] + rows, return_inverse=True)
        pattern = ca.Sparsity.triplet(*self.shape, (keys % self.shape[0]).tolist(), (keys // self.shape[0]).tolist())
        constant = np.bincount(entry[of < 0], values[of < 0], keys.size)
        moved = of >= 0
        put = csc_array((values[moved], (entry[moved], of[moved])), shape=(keys.size, max(1, self._sizes)))
        found = ca.MX(ca.DM(constant))
        if self._sources:
            found += ca.mtimes(_dm(put), ca.vertcat(*self._sources))
        return ca.MX(pattern, found)


def _dm(matrix: Any) -> Any:  # noqa: ANN401
    """Constant matrix of CasADi for the program."""
    ca = casadi()
    columns = csc_array(matrix)
    columns.sort_indices()
    pattern = ca.Sparsity(*columns.shape, columns.indptr.tolist(), columns.indices.tolist())
    return ca.DM(pattern, columns.data)


def _nonzeros(matrix: Expression) -> Expression:
    ca = casadi()
    return ca.vertcat(*matrix.nonzeros()) if matrix.nnz() else ca.SX.zeros(0, 1)


def _pattern(matrix: Expression) -> tuple[Indices, Indices]:
    rows, columns = matrix.sparsity().get_triplet()
    return np.asarray(rows, dtype=np.int64), np.asarray(columns, dtype=np.int64)


def _triplets(matrix: csc_array) -> tuple[Indices, Indices, Array]:
    found = matrix.tocoo()
    return found.row.astype(np.int64), found.col.astype(np.int64), found.data


def _products(
    left: csc_array,
    right: csr_array,
    places: tuple[Indices, Indices],
    size: tuple[int, int],
    count: int,
    *,
    upper: bool = False,
) -> tuple[Indices, Indices, Indices, Array]:
    """Entries of ``left D right`` in the program, where D holds ``count`` blocks of one pattern."""
    left, right = csc_array(left), csr_array(right)
    blocks = np.arange(count)[:, None]
    inner = (blocks * size[0] + places[0]).ravel()
    outer = (blocks * size[1] + places[1]).ravel()
    lefts, rights = np.diff(left.indptr)[inner], np.diff(right.indptr)[outer]
    pairs = lefts * rights
    of = np.repeat(np.arange(inner.size), pairs)
    within = np.arange(of.size) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    a = left.indptr[inner][of] + within // np.maximum(1, rights[of])
    b = right.indptr[outer][of] + within % np.maximum(1, rights[of])
    rows, columns = left.indices[a].astype(np.int64), right.indices[b].astype(np.int64)
    factors = left.data[a] * right.data[b]
    keep = rows <= columns if upper else np.ones(rows.size, dtype=bool)
    return rows[keep], columns[keep], of[keep], factors[keep]


def _row(
    d: csc_array, group: Group, places: tuple[Indices, Indices], size: tuple[int, int], entries: Expression, nz: int
) -> Expression:
    """Gradient row of a group's share in the program's objective."""
    ca = casadi()
    _, columns, of, factors = _products(d, group.V, places, size, group.count)
    put = csc_array((factors, (columns, of)), shape=(nz, max(1, entries.numel())))
    return ca.mtimes(_dm(put), entries).T if entries.numel() else ca.DM.zeros(1, nz)
