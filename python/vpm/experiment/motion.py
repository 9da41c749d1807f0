"""The motion behind a log: position, velocity and acceleration of every joint, and the commands."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vpm.errors import ExperimentError, near_match
from vpm.experiment.cutoff import HIGHEST, CutoffChoice, choose_cutoff
from vpm.experiment.record import Experiment
from vpm.experiment.signal import (
    RETAINED_BAND,
    UNDISTORTED_BAND,
    decimation_for,
    differentiate,
    lowpass,
    parallel_filter,
    settling_samples,
)
from vpm.numbers import Array
from vpm.results import Result

#: A record begins or ends at rest where its joints are slower than this share of their largest speed.
REST_SHARE = 0.01
#: Samples that have to remain between the two ends where the filter settles.
FEWEST_KEPT = 10

#: A floor of the position spectrum below this share of the motion's range is none that an instrument leaves.
NO_INSTRUMENT = 1e-9


class Machine(Protocol):
    """What `motion` asks of a model: its name, its joints in the order of its coordinates, and its inputs."""

    @property
    def name(self) -> str:
        """Name of the model whose motion is derived."""

    @property
    def joints(self) -> Iterable[str]:
        """Names of the joints whose motion is derived."""

    @property
    def input_channels(self) -> Iterable[str]:
        """Input channels of the log beside the motion."""

    @property
    def optional_inputs(self) -> Collection[str]:
        """Input channels beside the motion that are zero where the log does not hold them."""


@dataclass(frozen=True, repr=False, eq=False)
class Motion(Result):
    """Filtered motion of all joints and the commands on the grid of the log.

    Attributes
    ----------
    joints, drivers : tuple of str
        Columns of the motion, and channels of `inputs`.
    position, velocity, acceleration : ndarray, shape (N, n)
        m or rad, per second, per second squared.
    inputs : ndarray, shape (N, nu)
        Commands and pressures of supplies as logged, each held from its sample to the next, see `held_as`.
    time : ndarray, shape (N,)
        s.
    dt : float
        s.
    cutoff : float
        Cut-off frequency of the zero-phase filter, Hz.
    edge : int
        Samples at both ends in which the filter has not settled; leave them out.
    decimation : int
        Factor for `parallel_filter` that keeps the band which the filter left alone.
    notes : tuple of str
        One sentence for each choice that was made.
    """

    joints: tuple[str, ...]
    drivers: tuple[str, ...]
    position: Array
    velocity: Array
    acceleration: Array
    inputs: Array
    time: Array
    dt: float
    cutoff: float
    edge: int
    decimation: int
    notes: tuple[str, ...]

    def held_as(self, hold: str) -> Motion:
        """The motion with inputs of another hold, see `vpm.Setup`: each is its mean until the next sample.

        Held inputs are that already. A cubic lies off the straight line by a twelfth of what its slopes differ by.
        """
        if hold == "zero_order":
            return self
        ahead = np.concatenate([self.inputs[1:], self.inputs[-1:]])
        means = 0.5 * (self.inputs + ahead)
        if hold == "cubic":
            slopes = np.gradient(self.inputs, axis=0, edge_order=2)
            means[:-1] -= np.diff(slopes, axis=0) / 12.0
        return replace(self, inputs=means)

    @property
    def kept(self) -> slice:
        """Samples of a motion between its two ends."""
        return slice(self.edge, self.time.size - self.edge)

    @property
    def band(self) -> float:
        """Highest frequency of the motion that `parallel` keeps, Hz."""
        return 0.5 * RETAINED_BAND / (self.decimation * self.dt)

    @property
    def retained(self) -> NDArray[np.int64]:
        """Retained samples of the motion, counted from the record's beginning, between the two ends."""
        first = -(-self.edge // self.decimation) * self.decimation
        return np.arange(first, self.time.size - self.edge, self.decimation)

    def parallel(self, values: Array) -> Array:
        """Parallel filter over a motion's record, of which the `retained` samples are given.

        An end at rest is filtered with the rest: there is nothing to settle. At an end in motion the derivatives within
        `edge` are wrong, and what they make of a balance would ring on inside; it is cut off before.

        ``values``: shape (N,) or (N, k).
        Result: shape (n,) or (n, k), one row for each of `retained`.
        """
        retained = self.retained
        begins, ends = self._rests
        begin = 0 if begins else int(retained[0])
        end = self.time.size if ends else self.time.size - self.edge
        filtered = parallel_filter(values[begin:end], self.decimation)
        return np.ascontiguousarray(filtered[(retained - begin) // self.decimation])

    @cached_property
    def _rests(self) -> tuple[bool, bool]:
        """Whether the motion rests within the first and the last edge of the record."""
        speed = np.abs(self.velocity)
        slow, last = REST_SHARE * speed[self.kept].max(axis=0), self.time.size - self.edge
        begins, ends = (speed[edge].max(axis=0, initial=0.0) <= slow for edge in (slice(self.edge), slice(last, None)))
        return bool(np.all(begins)), bool(np.all(ends))

    def _headline(self) -> Mapping[str, object]:
        return {
            "joints": self.joints,
            "samples": self.time.size,
            "cutoff_hz": self.cutoff,
            "edge": self.edge,
            "decimation": self.decimation,
        }

    def _html_rows(self) -> Mapping[str, object]:
        return {**self._headline(), **{f"choice {i}": note for i, note in enumerate(self.notes, 1)}}

    def _frame_columns(self) -> Mapping[str, object]:
        columns: dict[str, object] = {"time_s": self.time}
        for column, joint in enumerate(self.joints):
            columns[f"{joint}.position"] = self.position[:, column]
            columns[f"{joint}.velocity"] = self.velocity[:, column]
            columns[f"{joint}.acceleration"] = self.acceleration[:, column]
        for column, channel in enumerate(self.drivers):
            columns[channel] = self.inputs[:, column]
        return columns


def motion(
    experiment: Experiment,
    model: Machine,
    cutoff: float | None = None,
    *,
    measured: Collection[str] = (),
    band: float | None = None,
) -> Motion:
    """Motion from a log: filtered positions, velocities, accelerations and inputs for inverse dynamics.

    Positions pass a zero-phase Butterworth filter of order 4 and two central differences, the customary preparation
    for inverse dynamic identification (M. Gautier, "Dynamic identification of robots with power model", ICRA 1997).

    Parameters
    ----------
    experiment : Experiment
        With the position of every joint and the command of every actuator.
    cutoff : float, optional
        Hz; without it `choose_cutoff` decides.
    measured : collection of {"velocity", "acceleration"}
        Derivatives to take from their own channels, through the same filter, instead of from the position.
    band : float, optional
        Highest frequency that `Motion.parallel` keeps, Hz; without it what the filter leaves alone.

    Raises
    ------
    ExperimentError
        A channel is missing, the cut-off frequency is not possible, or the log is too short for it.
    """
    joints, drivers = tuple(model.joints), tuple(model.input_channels)
    unknown = sorted(set(measured) - {"velocity", "acceleration"})
    if unknown:
        raise ExperimentError(f'"{unknown[0]}" cannot be taken as measured; choose from velocity, acceleration')
    raw = _channels(experiment, model, _of(joints, "position"))
    inputs = _channels(experiment, model, drivers, model.optional_inputs)
    rate = experiment.rate
    choice = _choice(experiment, model) if cutoff is None else None
    cutoff = choice.cutoff if choice is not None else float(cutoff or 0.0)
    position = lowpass(raw, rate, cutoff)
    edge = settling_samples(rate, cutoff) + 4  # two differences reach four samples outward
    _check_length(experiment, cutoff, edge)
    derivatives = [differentiate(position, experiment.dt)]
    notes = [_choice_note(choice, joints, np.ptp(raw, axis=0), rate, cutoff)]
    for order, quantity in enumerate(("velocity", "acceleration")):
        if quantity in measured:
            derivatives[order:] = [lowpass(_channels(experiment, model, _of(joints, quantity)), rate, cutoff)]
            notes.append(f"The {quantity} is the measured one, through the same filter.")
        if order == 0:
            derivatives.append(differentiate(derivatives[0], experiment.dt))
    wanted = decimation_for(rate, cutoff) if band is None else decimation_for(rate, band / UNDISTORTED_BAND)
    decimation = min(wanted, (len(experiment) - 2 * edge) // 4)
    notes.append(f"{edge} samples at each end are left to the settling of the filter.")
    return Motion(
        joints,
        drivers,
        position,
        derivatives[0],
        derivatives[1],
        inputs,
        experiment.time,
        experiment.dt,
        cutoff,
        edge,
        max(1, decimation),
        tuple(notes),
    )


def common_cutoff(experiments: Iterable[Experiment], model: Machine) -> float:
    """Cut-off frequency for records that are compared with each other: the lowest that `motion` chooses for any.

    Residuals of two records say the same only in the same band; a record that was filtered before it was stored would
    otherwise be judged in a wider one than the record that the parameters were fitted to.

    ``experiments``: at least one, each with the position of every joint.
    Result: Hz.
    """
    cutoffs = [_choice(each, model).cutoff for each in experiments]
    if not cutoffs:
        raise ExperimentError("a common cut-off frequency needs at least one record, and none was given")
    return min(cutoffs)


def _choice(experiment: Experiment, model: Machine) -> CutoffChoice:
    """Cut-off frequency for the motion of a log."""
    channels = _of(tuple(model.joints), "position")
    read = [experiment.read_rate(channel) for channel in channels]
    retained = [experiment.retained.get(channel, np.inf) for channel in channels]
    return choose_cutoff(_channels(experiment, model, channels), experiment.rate, read, retained)


def _of(owners: tuple[str, ...], quantity: str) -> tuple[str, ...]:
    return tuple(f"{owner}.{quantity}" for owner in owners)


def _channels(
    experiment: Experiment, model: Machine, channels: tuple[str, ...], optional: Collection[str] = ()
) -> Array:
    """Columns of a log for its motion; zeros for optional ones that it does not hold."""
    for channel in channels:
        if channel not in experiment and channel not in optional:
            owner, _, quantity = channel.rpartition(".")
            by_speed = quantity == "position" and f"{owner}.velocity" in experiment
            near = near_match(channel, experiment.channels, what="the log holds")
            rest = "a velocity alone is enough for a diagnosis, and for fits by free_run or prediction_error"
            raise ExperimentError(
                f'{experiment.name}: the motion of "{model.name}" needs the channel "{channel}", which the log does '
                f"not hold; map a column to it in the channel table ({rest if by_speed else near})",
                channel=channel,
            )
    known = {channel: experiment[channel] for channel in channels if channel in experiment}
    columns = [known.get(channel, np.zeros(len(experiment))) for channel in channels]
    return np.ascontiguousarray(np.column_stack(columns)) if columns else np.zeros((len(experiment), 0))


def _check_length(experiment: Experiment, cutoff: float, edge: int) -> None:
    kept = len(experiment) - 2 * edge
    if kept < FEWEST_KEPT:
        raise ExperimentError(
            f"{experiment.name}: {len(experiment)} samples at {experiment.rate:g} Hz leave {max(kept, 0)} after {edge} "
            f"at each end in which a filter of {cutoff:g} Hz settles; record longer, or raise the cut-off frequency"
        )


def _choice_note(choice: CutoffChoice | None, joints: tuple[str, ...], span: Array, rate: float, cutoff: float) -> str:
    if choice is None:
        return f"The cut-off frequency of {cutoff:.4g} Hz was given."
    bands = ", ".join(
        f"{joint} up to {band:.3g} Hz (noise {noise:.2g})"
        for joint, band, noise in zip(joints, choice.band, choice.noise, strict=True)
    )
    text = f"The cut-off frequency of {cutoff:.4g} Hz was chosen where motion stands 10 dB above the noise: {bands}"
    if any(noise < NO_INSTRUMENT * reach for noise, reach in zip(choice.noise, span, strict=True)):
        text += "; a record without a noise floor was simulated or filtered before"
    if choice.limited:
        edge = "highest" if cutoff > 0.5 * HIGHEST * rate else "lowest"
        text += f"; it is the {edge} that {rate:g} Hz allows"
    return text + "."
