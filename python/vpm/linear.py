"""A machine near one state as a linear system: matrices with names, poles, responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import SimulationError, near_match, needs
from vpm.numbers import Array, Complex
from vpm.results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class LinearModel(Result):
    """Small deviations from a state: ``dx/dt = A x + B u``, ``y = C x + D u``.

    The matrices are exact derivatives, not difference quotients. A command that stands for long passes a delay
    unchanged, so delays are not in the matrices; `delays` names them. Dead zones and saturations have the slope that
    they have at the command, zero inside a dead zone and beyond a limit.

    Attributes
    ----------
    A, B, C, D : ndarray, shapes (nx, nx), (nx, nu), (ny, nx), (ny, nu)
        SI.
    states, inputs, outputs : tuple of str
        Names of rows and columns.
    state_units, input_units, output_units : tuple of str
        Their SI units.
    state, command : ndarray, shapes (nx,), (nu,)
        The point around which the deviations are counted.
    delays : dict of str to float
        Delays of actuators and sensors that the matrices leave out (s), by parameter.
    """

    model_name: str
    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    state_units: tuple[str, ...]
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    state: Array
    command: Array
    delays: dict[str, float] = field(default_factory=dict)

    def poles(self) -> Complex:
        """Poles of a linear model: eigenvalues of A, shape (nx,), in 1/s, slowest first."""
        values = np.linalg.eigvals(self.A).astype(np.complex128)
        return values[np.lexsort((-values.imag, np.round(np.abs(values), 9)))]

    def frequencies(self) -> Array:
        """Natural frequencies ``|p| / 2 pi`` of a linear model's oscillating poles, Hz, ascending."""
        return np.asarray(np.abs(self._oscillating()) / (2.0 * np.pi), dtype=np.float64)

    def damping_ratios(self) -> Array:
        """Damping ratios ``-Re p / |p|`` of a linear model's oscillating poles, as `frequencies`."""
        poles = self._oscillating()
        return np.asarray(-poles.real / np.abs(poles), dtype=np.float64)

    def _oscillating(self) -> Complex:
        poles = self.poles()
        # Rounding gives a real double pole a tiny imaginary part.
        return poles[poles.imag > 1e-6 * np.abs(poles)]

    @property
    def stable(self) -> bool:
        """Whether every deviation of a linear model dies out; a pole at zero does not."""
        return bool(np.all(np.linalg.eigvals(self.A).real < 0.0))

    def response(self, frequencies: ArrayLike) -> Complex:
        """Frequency response of a linear model, ``C (i w - A)^-1 B + D``, without the delays.

        Parameters
        ----------
        frequencies : array_like, shape (F,)
            Hz.

        Returns
        -------
        ndarray, shape (F, ny, nu)
        """
        angular = 2.0 * np.pi * np.atleast_1d(np.asarray(frequencies, dtype=np.float64))
        resolvent = 1j * angular[:, None, None] * np.eye(len(self.A)) - self.A
        return np.asarray(
            self.C @ np.linalg.solve(resolvent, np.broadcast_to(self.B, (angular.size, *self.B.shape))) + self.D
        )

    def sampled(self, time_step: float) -> tuple[Array, Array]:
        """Linear model in sampled time, ``x[k+1] = Ad x[k] + Bd u[k]``, for held commands, exact.

        Source: C. Van Loan, "Computing integrals involving the matrix exponential", IEEE TAC 23(3), 1978.

        Parameters
        ----------
        time_step : float
            s.

        Returns
        -------
        Ad, Bd : ndarray, shapes (nx, nx), (nx, nu)
        """
        if not time_step > 0.0:
            raise SimulationError(f"a time step of {time_step} s is not possible; give a positive time")
        from scipy.linalg import expm

        nx, nu = self.B.shape
        both = np.zeros((nx + nu, nx + nu))
        both[:nx, :nx], both[:nx, nx:] = self.A, self.B
        exponential = np.asarray(expm(time_step * both), dtype=np.float64)
        return exponential[:nx, :nx].copy(), exponential[:nx, nx:].copy()

    def part(self, *, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> LinearModel:
        """The linear model with some of the inputs and outputs, in the given order.

        Raises
        ------
        SimulationError
            A name is unknown; the message names near ones.
        """
        columns = _places(inputs, self.inputs, "input")
        rows = _places(outputs, self.outputs, "output")
        return LinearModel(
            self.model_name,
            self.A,
            self.B[:, columns],
            self.C[rows],
            self.D[np.ix_(rows, columns)],
            self.states,
            tuple(self.inputs[i] for i in columns),
            tuple(self.outputs[i] for i in rows),
            self.state_units,
            tuple(self.input_units[i] for i in columns),
            tuple(self.output_units[i] for i in rows),
            self.state,
            self.command[columns],
            self.delays,
        )

    def to_control(self, time_step: float | None = None) -> object:
        """Linear model as ``control.StateSpace`` of python-control, dots in names as underscores.

        Elastic coordinates and what drives hold are states like others. Needs the extra ``control``.

        Parameters
        ----------
        time_step : float, optional
            s; then in sampled time, exact for commands that are held, see `sampled`.

        Raises
        ------
        MissingExtraError
            python-control is not installed.
        SimulationError
            The time step is not positive.
        """
        with needs("control", "control"):
            import control
        names = {"states": self.states, "inputs": self.inputs, "outputs": self.outputs}
        plain = {kind: [name.replace(".", "_") for name in labels] for kind, labels in names.items()}
        A, B = (self.A, self.B) if time_step is None else self.sampled(time_step)
        sampling = () if time_step is None else (time_step,)
        return control.StateSpace(
            A,
            B,
            self.C,
            self.D,
            *sampling,
            name=self.model_name.replace(".", "_"),
            remove_useless_states=False,
            **plain,
        )

    def plot(
        self, kind: str = "poles", *, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
    ) -> Figure:
        """Plot a linear model's poles, or Bode diagram. Needs the extra ``plot``.

        Parameters
        ----------
        kind : {"poles", "bode"}
        inputs, outputs : sequence of str, optional
            What the Bode diagram shows: by default all inputs, and the positions of the joints.
        """
        from vpm.plot import plot_bode, plot_poles

        if kind == "poles":
            return plot_poles(self.poles())
        if kind != "bode":
            raise SimulationError(f"there is no plot '{kind}' of a linear model; choose poles or bode")
        positions = [name for name in self.outputs if name.endswith(".position")]
        shown = self.part(inputs=inputs, outputs=positions if outputs is None else outputs)
        grid = _grid(self.poles())
        return plot_bode(grid, shown.response(grid), shown.inputs, shown.outputs)

    def _headline(self) -> Mapping[str, object]:
        return {
            "model": self.model_name,
            "states": len(self.states),
            "inputs": ", ".join(self.inputs),
            "outputs": len(self.outputs),
            "stable": self.stable,
        }

    def _html_rows(self) -> Mapping[str, object]:
        modes = zip(self.frequencies(), self.damping_ratios(), strict=True)
        named = {f"mode {i}": f"{f:.4g} Hz, damping ratio {d:.3g}" for i, (f, d) in enumerate(modes, 1)}
        return {**self._headline(), **named}

    def _frame_columns(self) -> Mapping[str, object]:
        poles = self.poles()
        size = np.abs(poles)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(size > 0.0, -poles.real / size, np.nan)
            constant = np.where(poles.real != 0.0, -1.0 / poles.real, np.inf)
        return {
            "real_per_s": poles.real,
            "imaginary_per_s": poles.imag,
            "frequency_hz": size / (2.0 * np.pi),
            "damping_ratio": ratio,
            "time_constant_s": constant,
        }


def _grid(poles: Complex) -> Array:
    """Frequencies (Hz) for a linear model from a decade below the slowest to one above the fastest pole."""
    size = np.abs(poles) / (2.0 * np.pi)
    size = size[size > 1e-6]
    low, high = (size.min(), size.max()) if size.size else (0.1, 10.0)
    return np.geomspace(0.1 * low, 10.0 * high, 600)


def _places(names: Sequence[str] | None, known: tuple[str, ...], what: str) -> list[int]:
    if names is None:
        return list(range(len(known)))
    for name in names:
        if name not in known:
            raise SimulationError(f"the linear model has no {what} '{name}'; {near_match(name, known, what='it has')}")
    return [known.index(name) for name in names]
