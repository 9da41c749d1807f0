"""Result of a comparison: numbers, correlations and regions for each channel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vpm.compare.correlation import Correlation
from vpm.compare.regions import Where
from vpm.errors import ExperimentError, near_match
from vpm.numbers import Array
from vpm.results import Result, Storable, html_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class ChannelComparison(Storable):
    """How far simulation and measurement are apart in one channel.

    The residual is measured minus simulated.

    Attributes
    ----------
    time, measured, simulated : ndarray, shape (N,)
        s, and the unit of the channel.
    rmse : float
        Root mean square of the residual.
    relative_error : float
        Norm of the residual over the norm of the measured signal, %.
    fit : float
        100 % minus the norm of the residual over that of the measured signal about its mean.
    max_error, max_error_time : float
        Residual of the largest size, and when it came (s).
    bias : float
        Mean residual.
    effective_samples : float
        How many independent samples the residual is worth.
    inputs : tuple of Correlation
        With each input that varies.
    where : Where
        When, at which frequencies and in which states the residual is large.
    """

    _samples = ("time", "measured", "simulated")

    channel: str
    unit: str
    time: Array
    measured: Array
    simulated: Array
    rmse: float
    relative_error: float
    fit: float
    max_error: float
    max_error_time: float
    bias: float
    effective_samples: float
    autocorrelation: Correlation
    inputs: tuple[Correlation, ...]
    where: Where

    @property
    def residual(self) -> Array:
        """Residual of a compared channel: measured minus simulated, shape (N,)."""
        return self.measured - self.simulated

    def __str__(self) -> str:
        """Line on a compared channel."""
        share = "of a signal that does not change"
        if np.isfinite(self.relative_error):
            share = f"{self.relative_error:.3g} % of the signal, fit {self.fit:.4g} %"
        return (
            f"{self.channel}: rms error {self.rmse:.4g} {self.unit}, {share}; "
            f"largest {self.max_error:.3g} {self.unit} at {self.max_error_time:.4g} s, "
            f"mean {self.bias:.3g} {self.unit}; {self.time.size} samples, {self.effective_samples:.0f} independent"
        )

    def _headline(self) -> Mapping[str, object]:
        return {"channel": self.channel, "rmse": self.rmse, "relative_error": self.relative_error, "fit": self.fit}


@dataclass(frozen=True, repr=False, eq=False)
class Comparison(Result):
    """How far simulation and measurement are apart.

    Attributes
    ----------
    state : dict of str to ndarray, shape (N,)
        Motion of the joints on the same samples, for example ``"axis.velocity"``, SI.
    skipped : tuple of str
        One sentence for each simulated channel that is not compared.
    """

    _samples = ("state",)

    model_name: str
    experiment_name: str
    mode: str
    channels: tuple[ChannelComparison, ...]
    state: dict[str, Array]
    state_units: dict[str, str]
    skipped: tuple[str, ...]

    def __getitem__(self, channel: str) -> ChannelComparison:
        """Comparison of one channel."""
        for each in self.channels:
            if each.channel == channel:
                return each
        names = [each.channel for each in self.channels]
        raise ExperimentError(
            f'the comparison has no channel "{channel}"; {near_match(channel, names, what="it has")}', channel=channel
        )

    def __str__(self) -> str:
        """Text of a comparison, a line per channel."""
        lines = [f"{self.model_name} against {self.experiment_name}, {self.mode}"]
        return "\n".join([*lines, *(f"  {each}" for each in self.channels)])

    def _headline(self) -> Mapping[str, object]:
        errors = {each.channel: f"{each.relative_error:.3g} %" for each in self.channels}
        return {"model": self.model_name, "experiment": self.experiment_name, "mode": self.mode, **errors}

    def _repr_html_(self) -> str:
        head = ("channel", "unit", "rms error", "of the signal", "fit", "largest", "mean", "where")
        rows: list[tuple[object, ...]] = [
            (
                each.channel,
                each.unit,
                f"{each.rmse:.4g}",
                f"{each.relative_error:.3g} %",
                f"{each.fit:.4g} %",
                f"{each.max_error:.3g} at {each.max_error_time:.4g} s",
                f"{each.bias:.3g}",
                " ".join(each.where.sentences),
            )
            for each in self.channels
        ]
        return html_table(f"{self.model_name} against {self.experiment_name}, {self.mode}", head, rows)

    def _frame_columns(self) -> Mapping[str, object]:
        fields = ("channel", "unit", "rmse", "relative_error", "fit", "max_error", "max_error_time", "bias")
        columns: dict[str, object] = {name: [getattr(each, name) for each in self.channels] for name in fields}
        columns["effective_samples"] = [each.effective_samples for each in self.channels]
        columns["lags_outside"] = [each.autocorrelation.outside for each in self.channels]
        return columns

    def plot(self) -> Figure:
        """Plot a comparison: overlay, residual over time and over velocity. Needs the extra ``plot``."""
        from vpm.plot import plot_comparison

        return plot_comparison(self)
