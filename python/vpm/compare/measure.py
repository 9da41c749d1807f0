"""Compare a simulated run with the log of the machine."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from vpm.compare.comparison import ChannelComparison, Comparison
from vpm.compare.correlation import Correlation, autocorrelation, cross_correlation, effective_samples
from vpm.compare.regions import Region, Where, frequency_region, restart_region, state_regions, time_region
from vpm.errors import ExperimentError, near_match
from vpm.experiment import Experiment, choose_cutoff, differentiate, lowpass
from vpm.experiment.cutoff import FEWEST_SAMPLES
from vpm.experiment.signal import anti_alias
from vpm.numbers import Array
from vpm.simulate.run import Run

#: Endings of channels that drive a machine.
INPUTS = ("command", "reference", "disturbance")

#: Simulated and measured values closer than this share of the signal are one and the same number.
SAME = 1e-12


def compare(run: Run, experiment: Experiment, channels: Sequence[str] | None = None) -> Comparison:
    """Say how far simulation and measurement are apart, and where.

    Parameters
    ----------
    experiment : Experiment
        The log that was simulated.
    channels : sequence of str, optional
        By default every simulated channel that was measured and is no mere copy of the log.

    Raises
    ------
    ExperimentError
        A channel was not simulated or not measured, or none is left to compare.
    """
    if run.time.size < 2:
        raise ExperimentError(f"the run of {run.model_name} has {run.time.size} samples; compare at least two")
    measured = run.measured
    picked, skipped = _picked(run, experiment, measured, channels)
    pieces = _pieces(run)
    dt = float(np.median(np.concatenate([np.diff(run.time[piece]) for piece in pieces])))
    state, units = _state(run, experiment)
    inputs = _inputs(run, experiment, dt)
    compared = []
    for channel in picked:
        at = run.channels.index(channel)
        y, yhat = measured[:, at], run.values[:, at]
        residual = y - yhat
        others = [
            cross_correlation(residual, values, pieces, dt, name) for name, values in inputs.items() if name != channel
        ]
        regions = [time_region(residual, run.time), frequency_region(residual, y, pieces, dt)]
        if len(pieces) > 1:
            since = np.concatenate([run.time[piece] - run.time[piece.start] for piece in pieces])
            regions.append(restart_region(residual, since))
        regions += _state_regions(channel, residual, run.units[at], state, units)
        compared.append(_channel(run, at, y, pieces, dt, inputs=tuple(others), regions=tuple(regions)))
    return Comparison(run.model_name, experiment.name, run.mode, tuple(compared), state, units, skipped)


def _channel(
    run: Run,
    at: int,
    y: Array,
    pieces: Sequence[slice],
    dt: float,
    *,
    inputs: tuple[Correlation, ...],
    regions: tuple[Region, ...],
) -> ChannelComparison:
    residual = y - run.values[:, at]
    largest = int(np.argmax(np.abs(residual)))
    norm = float(np.linalg.norm(residual))
    return ChannelComparison(
        run.channels[at],
        run.units[at],
        np.array(run.time),
        np.array(y),
        np.array(run.values[:, at]),
        norm / float(np.sqrt(y.size)),
        100.0 * _ratio(norm, float(np.linalg.norm(y))),
        100.0 * (1.0 - _ratio(norm, float(np.linalg.norm(y - y.mean())))),
        float(residual[largest]),
        float(run.time[largest]),
        float(residual.mean()),
        effective_samples(residual, pieces),
        autocorrelation(residual, pieces, dt, run.channels[at]),
        inputs,
        Where(regions),
    )


def _ratio(part: float, whole: float) -> float:
    if part == 0.0:
        return 0.0
    return part / whole if whole > 0.0 else float("inf")


def _pieces(run: Run) -> list[slice]:
    edges = [*(int(start) for start in run.starts), run.time.size]
    return [slice(first, last) for first, last in pairwise(edges) if last - first > 1]


def _picked(
    run: Run, experiment: Experiment, measured: Array, channels: Sequence[str] | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Channels to measure the error of, and a sentence on each that is left out."""
    known = [bool(np.isfinite(column).all()) for column in measured.T]
    there = [channel for channel, is_known in zip(run.channels, known, strict=True) if is_known]
    for channel in channels or ():
        if channel not in run.channels:
            near = near_match(channel, run.channels, what="it has")
            raise ExperimentError(f'the run has no channel "{channel}"; {near}', channel=channel)
        if channel not in there:
            near = near_match(channel, there, what="comparable channels are")
            raise ExperimentError(
                f'{experiment.name}: the channel "{channel}" was simulated but not measured in mode {run.mode}; {near}',
                channel=channel,
            )
    if channels is not None:
        return tuple(dict.fromkeys(channels)), ()
    skipped = {channel: f"{channel} was not measured." for channel in run.channels if channel not in there}
    for channel in there:
        at = run.channels.index(channel)
        size = float(np.abs(measured[:, at]).max())
        if np.abs(measured[:, at] - run.values[:, at]).max() <= SAME * size:
            skipped[channel] = f"{channel} is given to the simulation, which repeats it."
    picked = tuple(channel for channel in run.channels if channel not in skipped)
    if picked:
        return picked, tuple(skipped.values())
    copied = [channel for channel in there if channel.rpartition(".")[2] not in INPUTS]
    if copied:  # a perfect simulation: nothing was given, everything agrees
        return tuple(copied), tuple(text for channel, text in skipped.items() if channel not in copied)
    raise ExperimentError(
        f"{experiment.name}: nothing to compare in mode {run.mode}, the run has {', '.join(run.channels)} and the log "
        f"{', '.join(experiment.channels)}; map a column to one of the simulated channels"
    )


def _state(run: Run, experiment: Experiment) -> tuple[dict[str, Array], dict[str, str]]:
    """Joint motion beside measured errors: from the log where it has positions, else as simulated."""
    state, units = {}, {}
    joints = [name.removesuffix(".position") for name in experiment.channels if name.endswith(".position")]
    for joint in joints if len(experiment) >= FEWEST_SAMPLES else ():
        channel = f"{joint}.position"
        raw, read = experiment[channel][:, None], [experiment.read_rate(channel)]
        cutoff = choose_cutoff(raw, experiment.rate, read, [experiment.retained.get(channel, np.inf)]).cutoff
        position = lowpass(raw, experiment.rate, cutoff)[:, 0]
        velocity = differentiate(position, experiment.dt)
        motion = {"position": position, "velocity": velocity, "acceleration": differentiate(velocity, experiment.dt)}
        for (quantity, values), per in zip(motion.items(), ("", "/s", "/s^2"), strict=True):
            state[f"{joint}.{quantity}"] = np.interp(run.time, experiment.time, values)
            units[f"{joint}.{quantity}"] = experiment.unit(f"{joint}.position") + per
    for at, channel in enumerate(run.channels):
        joint, _, quantity = channel.rpartition(".")
        if quantity in {"position", "velocity", "acceleration"} and joint not in joints:
            state[channel] = np.array(run.values[:, at])
            units[channel] = run.units[at]
    return state, units


def _inputs(run: Run, experiment: Experiment, dt: float) -> dict[str, Array]:
    """Varying inputs beside measured errors, at the samples of the run and within its band."""
    found = {}
    factor = dt / experiment.dt
    for channel in experiment.channels:
        if channel.rpartition(".")[2] in INPUTS and np.ptp(experiment[channel]) > 0.0:
            values = experiment[channel] if factor < 1.5 else anti_alias(experiment[channel], factor)
            found[channel] = np.interp(run.time, experiment.time, values)
    return found


def _state_regions(
    channel: str, residual: Array, unit: str, state: dict[str, Array], units: dict[str, str]
) -> list[Region]:
    """Regions in which a channel's error is measured: of its own joint, or of all."""
    joints = list(dict.fromkeys(name.rpartition(".")[0] for name in state))
    own = channel.rpartition(".")[0]
    regions = []
    for joint in [own] if own in joints else joints:
        mine = {name.rpartition(".")[2]: values for name, values in state.items() if name.rpartition(".")[0] == joint}
        base = next(units[f"{joint}.{quantity}"] for quantity in mine).split("/")[0]
        regions += state_regions(residual, joint, mine, unit=base, residual_unit=unit)
    return regions
