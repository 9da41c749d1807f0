"""A designed excitation: samples with names and units, on their way to a robot, a simulation or a scenario."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import ExcitationError, check_known
from vpm.experiment import Experiment
from vpm.files import replacing
from vpm.numbers import Array
from vpm.results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Fewest samples that make an excitation.
FEWEST_SAMPLES = 10


@dataclass(frozen=True, repr=False, eq=False)
class Excitation(Result):
    """Samples of commands, references or motions.

    Attributes
    ----------
    time : ndarray, shape (N,)
        s, from zero in equal steps.
    data : ndarray, shape (N, C)
    channels, units : tuple of str
        Channel names as in a model, and the unit of each.
    notes : tuple of str
        What was designed and what came out, one sentence each.
    """

    _samples = ("time", "data")

    name: str
    time: Array
    data: Array
    channels: tuple[str, ...]
    units: tuple[str, ...]
    notes: tuple[str, ...]

    def __post_init__(self) -> None:
        """Freeze the arrays of an excitation."""
        for attribute in ("time", "data"):
            values = np.array(getattr(self, attribute), dtype=np.float64)
            values.setflags(write=False)
            object.__setattr__(self, attribute, values)

    @property
    def time_step(self) -> float:
        """Time between samples of an excitation, s."""
        return float(self.time[-1] - self.time[0]) / (self.time.size - 1)

    def __len__(self) -> int:
        """Count of an excitation's samples."""
        return self.time.size

    def __getitem__(self, channel: str) -> Array:
        """Values of an excitation's channel, shape (N,)."""
        check_known([channel], self.channels, ExcitationError, f"{self.name} has no channel", what="it has")
        return self.data[:, self.channels.index(channel)]

    def unit(self, channel: str) -> str:
        """Unit of a channel of an excitation."""
        return self.units[self.channels.index(channel)] if channel in self.channels else str(self[channel])

    def crest_factor(self, channel: str) -> float:
        """Crest factor of an excitation: largest sample over the root mean square; sqrt(2) for a sine."""
        values = self[channel]
        return float(np.max(np.abs(values)) / np.sqrt(np.mean(values**2)))

    def spectrum(self, channel: str) -> tuple[Array, Array]:
        """Amplitude of each sine in an excitation's channel, taken as one period.

        Returns
        -------
        frequency : ndarray, shape (N // 2 + 1,)
            Hz.
        amplitude : ndarray, shape (N // 2 + 1,)
            Unit of the channel; the mean at zero.
        """
        values = self[channel]
        amplitude = np.abs(np.fft.rfft(values)) * 2.0 / values.size
        amplitude[0] *= 0.5
        if values.size % 2 == 0:
            amplitude[-1] *= 0.5
        return np.asarray(np.fft.rfftfreq(values.size, self.time_step), dtype=np.float64), amplitude

    def to_csv(self, path: str | PathLike[str]) -> Path:
        """Write an excitation for the robot: ``time [s]`` and each channel with its unit in brackets.

        `vpm.Experiment.load` reads it back without a channel table.
        """
        names = [f"{channel} [{unit}]" for channel, unit in zip(self.channels, self.units, strict=True)]
        with replacing(path) as beside, beside.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["time [s]", *names])
            for time, row in zip(self.time, self.data, strict=True):
                writer.writerow([f"{time:.12g}", *(f"{value:.12g}" for value in row)])
        return Path(path)

    def to_experiment(self, references: Mapping[str, str] | None = None) -> Experiment:
        """The excitation as a record, whose commands and references `vpm.simulate` takes.

        Parameters
        ----------
        references : mapping of str to str, optional
            Channels that a controller follows, and what they copy: ``{"motor.reference": "shoulder.position"}``.
        """
        values = {channel: self[channel] for channel in self.channels}
        units = dict(zip(self.channels, self.units, strict=True))
        for reference, channel in (references or {}).items():
            values[reference], units[reference] = self[channel], self.unit(channel)
        return Experiment.from_arrays(self.time, values, units, self.name)

    def to_points(self, channel: str) -> Mapping[str, object]:
        """Channel of an excitation as the signal ``points`` of a scenario file."""
        return {
            "type": "points",
            "time": {"value": self.time.tolist(), "unit": "s"},
            "value": {"value": self[channel].tolist(), "unit": self.unit(channel)},
        }

    def beside(self, *others: Excitation) -> Excitation:
        """Several excitations of the same samples in time as one, so that all inputs move at once."""
        for other in others:
            if other.time.shape != self.time.shape or not np.allclose(other.time, self.time, rtol=0.0, atol=1e-9):
                raise ExcitationError(
                    f"{self.name} has {len(self)} samples every {self.time_step:g} s and {other.name} {len(other)} "
                    f"every {other.time_step:g} s; design them with one duration and one time step"
                )
        every = (self, *others)
        channels = tuple(channel for one in every for channel in one.channels)
        repeated = [channel for at, channel in enumerate(channels) if channel in channels[:at]]
        if repeated:
            raise ExcitationError(f'two of the excitations drive "{repeated[0]}"; name each channel once')
        return Excitation(
            " and ".join(one.name for one in every),
            self.time,
            np.column_stack([one.data for one in every]),
            channels,
            tuple(unit for one in every for unit in one.units),
            tuple(note for one in every for note in one.notes),
        )

    def plot(self) -> Figure:
        """Plot all channels of an excitation over time. Needs the extra ``plot``."""
        from vpm.plot import plot_channels

        return plot_channels(self.time, self.data, self.channels, self.units, title=self.name)

    def _headline(self) -> Mapping[str, object]:
        return {"name": self.name, "samples": len(self), "time_step": self.time_step, "channels": self.channels}

    def _html_rows(self) -> Mapping[str, object]:
        rows: dict[str, object] = {"name": self.name, "samples": len(self), "time step": f"{self.time_step:.6g} s"}
        for channel, unit, column in zip(self.channels, self.units, self.data.T, strict=True):
            rows[channel] = f"{column.min():.6g} ... {column.max():.6g} {unit}"
        return {**rows, **{f"note {at}": note for at, note in enumerate(self.notes, 1)}}

    def _frame_columns(self) -> Mapping[str, object]:
        return {"time_s": self.time, **dict(zip(self.channels, self.data.T, strict=True))}


def clock(duration: float, time_step: float, *, whole: bool = False) -> Array:
    """Sample times of an excitation, s: whole periods without the last sample, otherwise with both ends."""
    if not (np.isfinite(duration) and np.isfinite(time_step) and time_step > 0.0 and duration > 0.0):
        raise ExcitationError(f"a duration of {duration:g} s in steps of {time_step:g} s is none; give positive times")
    count = round(duration / time_step)
    if count < FEWEST_SAMPLES:
        raise ExcitationError(
            f"{duration:g} s in steps of {time_step:g} s are {count} samples, and at least {FEWEST_SAMPLES} are "
            "needed; give a longer duration or a shorter time step"
        )
    if abs(count * time_step - duration) > 1e-6 * time_step * max(1.0, count * 1e-6):
        raise ExcitationError(
            f"{duration:g} s are {duration / time_step:.6g} steps of {time_step:g} s, which is no whole number; "
            f"give a duration of {count * time_step:.9g} s"
        )
    return np.asarray(time_step * np.arange(count if whole else count + 1), dtype=np.float64)


def check_band(low: float, high: float, time_step: float, what: str) -> None:
    """Refuse an excitation band that is empty or that the samples do not carry."""
    nyquist = 0.5 / time_step
    if not 0.0 <= low <= high < nyquist:
        raise ExcitationError(
            f"the {what} from {low:g} Hz to {high:g} Hz is not within 0 and {nyquist:g} Hz in rising order, which is "
            f"what samples every {time_step:g} s carry; correct it or shorten the time step"
        )


def check_positive(value: float, what: str) -> None:
    """Refuse a number of an excitation that is not positive and finite."""
    if not (np.isfinite(value) and value > 0.0):
        raise ExcitationError(f"the {what} is {value:g}, and it has to be positive; correct it")
