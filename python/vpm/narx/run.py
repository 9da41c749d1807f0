"""What a model gives on a record, and what its residual still knows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np

from vpm.compare import Correlation, autocorrelation, cross_correlation
from vpm.numbers import NORMAL_95, Array
from vpm.results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def inside(correlation: Correlation) -> bool:
    """Whether a run's residual correlation is what chance gives.

    At most one lag in ten lies outside the band, where one in twenty is expected; and no single lag is larger than the
    largest of all lags would be in 19 of 20 independent signals (Bonferroni's inequality).
    """
    values = np.abs(correlation.values[correlation.lags != 0.0]) if correlation.lags[0] >= 0.0 else correlation.values
    if values.size == 0:
        return True
    largest = correlation.band / NORMAL_95 * NormalDist().inv_cdf(1.0 - 0.025 / values.size)
    return correlation.outside <= 0.1 and float(np.abs(values).max()) <= largest


@dataclass(frozen=True, repr=False, eq=False)
class ResidualTests(Result):
    """Correlations of a residual with its own past and with the inputs.

    A residual is white where its autocorrelation at lags other than zero lies **inside** the band ``1.96 / sqrt(N)``;
    it owes nothing to an input where the cross-correlation lies inside its band, which is wider where both signals
    vary slowly. One lag in twenty lies outside by chance.

    Attributes
    ----------
    inputs : tuple of Correlation
        One for each input.
    """

    own: Correlation
    inputs: tuple[Correlation, ...]

    @property
    def white(self) -> bool:
        """Whether a run's residual does not remember its own past: see `inside`."""
        return inside(self.own)

    @property
    def independent_of_inputs(self) -> bool:
        """Whether a run's residual owes nothing to any input: see `inside`."""
        return all(inside(correlation) for correlation in self.inputs)

    def _headline(self) -> Mapping[str, object]:
        outside = {name.of: round(name.outside, 4) for name in (self.own, *self.inputs)}
        return {"white": self.white, "independent_of_inputs": self.independent_of_inputs} | {
            f"outside[{name}]": share for name, share in outside.items()
        }

    def _frame_columns(self) -> Mapping[str, object]:
        rows = (self.own, *self.inputs)
        return {
            "with": [row.of for row in rows],
            "lags": [row.lags.size for row in rows],
            "band": [row.band for row in rows],
            "largest": [float(np.abs(row.values[row.lags != 0.0]).max(initial=0.0)) for row in rows],
            "outside": [row.outside for row in rows],
        }

    def plot(self) -> Figure:
        """Draw the autocorrelation of a run's residual with its band."""
        from vpm.plot.signals import plot_correlation

        return plot_correlation(self.own.lags, self.own.values, self.own.band, f"residual of {self.own.of}")


@dataclass(frozen=True, repr=False, eq=False)
class NarxRun(Result):
    """Output of a model on one record beside the measured one.

    Attributes
    ----------
    kind : str
        ``"free run"`` (from its own past) or ``"one-step prediction"`` (from the measured past).
    output : str
        Name of the output.
    time : ndarray, shape (N,)
        s, or samples where the record has no clock.
    measured, values : ndarray, shape (N,)
    input_values : ndarray, shape (N, m)
    start : int
        Samples at the beginning that are measured in both, because they have no past; they count in no error.
    """

    kind: str
    record: str
    output: str
    unit: str
    inputs: tuple[str, ...]
    time: Array
    dt: float
    measured: Array
    values: Array
    input_values: Array
    start: int

    @property
    def residual(self) -> Array:
        """Residual of a run: measured less computed output after the start, shape (N - start,)."""
        return (self.measured - self.values)[self.start :]

    @property
    def rmse(self) -> float:
        """Root of the mean squared residual of a run."""
        return float(np.sqrt(np.mean(self.residual**2))) if self.residual.size else 0.0

    @property
    def max_error(self) -> float:
        """Largest magnitude of a run's residual."""
        return float(np.abs(self.residual).max(initial=0.0))

    @property
    def fit(self) -> float:
        """Fit of a run, ``100 (1 - |y - yhat| / |y - mean y|)`` in %: 100 is perfect, 0 is the mean."""
        y = self.measured[self.start :]
        spread = float(np.linalg.norm(y - y.mean()))
        off = float(np.linalg.norm(self.residual))
        return 100.0 * (1.0 - off / spread) if spread > 0.0 else (100.0 if off == 0.0 else float("-inf"))

    def residual_tests(self) -> ResidualTests:
        """Correlations of a run's residual with its own past and with each input."""
        pieces, residual = [slice(0, self.residual.size)], self.residual
        columns = zip(self.inputs, self.input_values[self.start :].T, strict=True)
        return ResidualTests(
            autocorrelation(residual, pieces, self.dt, self.output),
            tuple(cross_correlation(residual, column, pieces, self.dt, name) for name, column in columns),
        )

    def plot(self) -> Figure:
        """Draw the computed over the measured output of a run."""
        from vpm.plot.narx import plot_narx_run

        return plot_narx_run(self)

    def _headline(self) -> Mapping[str, object]:
        return {
            "kind": self.kind,
            "record": self.record,
            "samples": self.time.size,
            "rmse": self.rmse,
            "fit": f"{self.fit:.2f} %",
        }

    def _frame_columns(self) -> Mapping[str, object]:
        inputs = dict(zip(self.inputs, self.input_values.T, strict=True))
        return {"time": self.time, **inputs, "measured": self.measured, "computed": self.values}
