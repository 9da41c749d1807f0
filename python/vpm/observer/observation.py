"""What an observer of a record finds: innovations, how large they should be, the states behind them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import SimulationError, check_known
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.observer.filtering import Record, filtered
from vpm.observer.noise import Noise, likely_noise
from vpm.results import Result
from vpm.simulate import Setup

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Lags whose correlations tell whether innovations are white.
LAGS = 20


@dataclass(frozen=True, repr=False, eq=False)
class Observation(Result):
    """Innovations, their sizes and the states of a record that an observer follows.

    Attributes
    ----------
    time : ndarray, shape (N,)
        s.
    innovations : ndarray, shape (N, m)
        What each reading says beyond the samples before it, SI.
    expected : ndarray, shape (N, m)
        Standard deviation that they should have.
    whitened : ndarray, shape (N, m)
        Innovations in units of these, without correlation among channels: white, of size 1, if model and noise are
        right.
    states, deviations : ndarray, shape (N, nx)
        What is in the machine, corrected by the readings up to then, and its standard deviation.
    log_likelihood : float
        Logarithm of the probability density of the readings.
    noise : Noise
        As stated, or as the record made it most likely.
    """

    time: Array
    channels: tuple[str, ...]
    units: tuple[str, ...]
    innovations: Array
    expected: Array
    whitened: Array
    state_names: tuple[str, ...]
    states: Array
    deviations: Array
    log_likelihood: float
    noise: Noise

    @property
    def whiteness(self) -> dict[str, float]:
        """Probability by channel that white innovations are as correlated as in an observation.

        G. Ljung and G. Box, *Biometrika* 65, 1978.
        """
        from scipy.stats import chi2

        found = {}
        for column, name in enumerate(self.channels):
            values = self.whitened[:, column] - np.mean(self.whitened[:, column])
            count = len(values)
            lags = np.arange(1, min(LAGS, count - 1) + 1)
            shared = np.array([values[lag:] @ values[:-lag] for lag in lags]) / (values @ values)
            statistic = count * (count + 2.0) * float(np.sum(shared**2 / (count - lags)))
            found[name] = float(chi2.sf(statistic, len(lags)))
        return found

    def state(self, name: str) -> Array:
        """State of an observation over time (N,), SI."""
        check_known([name], self.state_names, SimulationError, "", "is no state of this machine")
        return self.states[:, self.state_names.index(name)]

    def _headline(self) -> Mapping[str, object]:
        sizes = np.sqrt(np.mean(self.innovations**2, axis=0))
        shown = {name: f"{size:.3g} {unit}" for name, size, unit in zip(self.channels, sizes, self.units, strict=True)}
        return {"samples": len(self.time), **shown, "log_likelihood": self.log_likelihood}

    def _frame_columns(self) -> Mapping[str, object]:
        columns: dict[str, object] = {"time_s": self.time}
        for place, name in enumerate(self.channels):
            columns |= {name: self.innovations[:, place], f"{name} expected": self.expected[:, place]}
        return columns

    def plot(self) -> Figure:
        """Plot an observation: innovations between their 95 % bounds. Needs the extra ``plot``."""
        from vpm.plot import plot_channels

        title = "innovations, and the bounds of 95 % of them"
        return plot_channels(self.time, self.innovations, self.channels, self.units, title=title, std=self.expected)


def observe(
    model: Model,
    experiment: Experiment,
    *,
    channels: Sequence[str] | None = None,
    noise: Noise | None = None,
    setup: Setup | None = None,
) -> Observation:
    """Observation of ``experiment`` by ``model`` with an extended Kalman filter.

    Nothing is differentiated or inverted, and no controller, reference or start at rest is needed: any of the measured
    outputs will do. Where the machine does what the model says, innovations are white and as large as expected.

    Parameters
    ----------
    experiment : Experiment
        Holds the commands, and the position of a joint or another output.
    channels : sequence of str, optional
        Outputs that correct the model; by default all that the log holds.
    noise : Noise, optional
        By default that which makes the record most likely.
    setup : Setup, optional
        Integrator, substeps and hold.

    Raises
    ------
    SimulationError, ExperimentError
        A channel or a name of the noise is unknown, or the log lacks a command.
    DivergedError
        The model runs away from the log.

    Examples
    --------
    >>> seen = observe(model, log)
    >>> seen.whiteness
    {'axis.position': 0.43}
    """
    record = Record.of(model, experiment, channels)
    noise = noise or likely_noise(model, [record], setup=setup)
    found = filtered(model, record, noise, setup=setup)
    diagonal = np.einsum("nmm->nm", found.covariances)
    return Observation(
        record.time,
        record.channels,
        tuple(model.channel_unit(name) for name in record.channels),
        found.innovations,
        np.sqrt(diagonal),
        found.whitened(),
        model.state_names,
        found.states,
        found.deviations,
        found.log_likelihood(),
        noise,
    )
