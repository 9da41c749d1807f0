"""A polynomial NARX model with its numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from vpm._core import Diverged, NarxStepper
from vpm._core import Narx as Compiled
from vpm.errors import DivergedError, IdentificationError, SimulationError, refused_as
from vpm.experiment import Experiment
from vpm.narx.records import RecordLike, Series, series
from vpm.narx.run import NarxRun
from vpm.numbers import Array
from vpm.results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class Narx(Result):
    """``y[k] = sum theta_i prod x``, each x a lagged output or a lagged input.

    Attributes
    ----------
    terms : tuple of tuple of (int, int)
        Factors of each term: signal (0 is the output, then the inputs) and lag; a term without factors is the constant.
    coefficients : ndarray, shape (P,)
    error_reduction : ndarray, shape (P,)
        Share of the output's energy in training that each term explains beyond those before it; NaN where terms were
        not selected.
    limit : float
        A free run beyond this magnitude counts as diverged.
    notes : tuple of str
        What to know before the model is trusted.
    criterion : ndarray, shape (M,)
        Value of the criterion after 1, 2, ... terms in the order of choice; empty where terms were not selected.
    """

    output: str
    inputs: tuple[str, ...]
    terms: tuple[tuple[tuple[int, int], ...], ...]
    coefficients: Array
    error_reduction: Array
    limit: float = float("inf")
    notes: tuple[str, ...] = ()
    criterion: Array = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        """Check the terms of the NARX model, once."""
        _ = self._compiled

    @classmethod
    def from_terms(
        cls,
        output: str,
        inputs: Sequence[str],
        terms: Sequence[Sequence[tuple[int, int]]],
        coefficients: Sequence[float] | Array,
    ) -> Narx:
        """NARX model from known terms and coefficients.

        Parameters
        ----------
        terms : sequence of sequence of (int, int)
            Factors of each term: signal (0 is the output, then the inputs) and lag.

        Raises
        ------
        IdentificationError
            A term is not possible.
        """
        theta = np.array(coefficients, dtype=np.float64)
        listed = tuple(tuple((int(signal), int(lag)) for signal, lag in term) for term in terms)
        return cls(output, tuple(inputs), listed, theta, np.full(theta.size, np.nan))

    @cached_property
    def _compiled(self) -> Compiled:
        listed = [list(term) for term in self.terms]
        with refused_as(IdentificationError):
            return Compiled([self.output, *self.inputs], listed, self.coefficients)

    @property
    def longest_lag(self) -> int:
        """Samples that a run of the NARX model needs before its first."""
        return self._compiled.longest_lag

    @property
    def term_names(self) -> tuple[str, ...]:
        """Terms of the NARX model as written, for example ``"force[k-1]*valve[k-2]"``."""
        return tuple(self._compiled.texts())

    @property
    def equation(self) -> str:
        """The model in one line."""
        summands = [f"{value:+.6g} {name}" for value, name in zip(self.coefficients, self.term_names, strict=True)]
        return f"{self.output}[k] = " + " ".join(summands).removeprefix("+")

    def predict_one_step(self, record: RecordLike) -> NarxRun:
        """One-step prediction of the NARX model: each sample from the **measured** outputs before it.

        Parameters
        ----------
        record : Experiment or mapping of str to array-like, shape (N,)

        Raises
        ------
        SimulationError
            The record does not fit the model.
        """
        given = series(record, self.output, self.inputs)
        with refused_as(SimulationError):
            values = self._compiled.predict_one_step(given.name, given.output, given.inputs)
        return self._run("one-step prediction", given, values, record)

    def simulate_free_run(self, record: RecordLike, *, limit: float | None = None) -> NarxRun:
        """Free run of the NARX model: each sample from the **simulated** outputs before it.

        Parameters
        ----------
        record : Experiment or mapping of str to array-like, shape (N,)
        limit : float, optional
            Magnitude that counts as diverged; by default that of the model.

        Raises
        ------
        SimulationError
            The record does not fit the model.
        DivergedError
            The output left the limit; `run` has the samples before.
        """
        given = series(record, self.output, self.inputs)
        bound = self.limit if limit is None else limit
        try:
            values = self._compiled.simulate_free_run(given.name, given.output, given.inputs, bound)
        except Diverged as error:
            at = error.sample_index
            cut = Series(given.name, given.time[:at], given.dt, given.output[:at], given.inputs[:at])
            partial = self._run("free run", cut, error.outputs, record)
            raise DivergedError(str(error), run=partial, time=float(given.time[at])) from error
        except ValueError as error:
            raise SimulationError(str(error)) from error
        return self._run("free run", given, values, record)

    def stepper(self) -> NarxStepper:
        """Stepper of the NARX model: ``start(output, inputs)``, then ``step(inputs)``."""
        return self._compiled.stepper()

    def plot(self) -> Figure:
        """Draw what each term of the NARX model explains."""
        from vpm.plot.narx import plot_narx_terms

        return plot_narx_terms(self.term_names, self.error_reduction)

    def _run(self, kind: str, given: Series, values: Array, record: RecordLike) -> NarxRun:
        unit = record.unit(self.output) if isinstance(record, Experiment) else "1"
        lag = min(self.longest_lag, given.time.size)
        parts = given.time, given.dt, given.output, values, given.inputs
        return NarxRun(kind, given.name, self.output, unit, self.inputs, *parts, lag)

    def _headline(self) -> Mapping[str, object]:
        return {
            "output": self.output,
            "inputs": self.inputs,
            "terms": len(self.terms),
            "longest_lag": self.longest_lag,
            "explained": float(np.sum(self.error_reduction)),
        }

    def _html_rows(self) -> Mapping[str, object]:
        named = zip(self.term_names, self.coefficients, strict=True)
        return {**self._headline(), **{name: float(value) for name, value in named}}

    def _frame_columns(self) -> Mapping[str, object]:
        return {"term": self.term_names, "coefficient": self.coefficients, "error_reduction": self.error_reduction}
