"""Sensor drift: a slow change of one channel's zero, which a model cannot explain and need not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vpm.discrepancy.diagnosis import ChannelGap
from vpm.experiment import Experiment
from vpm.identify import InverseDynamicsProblem
from vpm.identify.problem import Block
from vpm.model import Model
from vpm.numbers import Array, short


@dataclass(frozen=True)
class Drift:
    """Drift of a channel's offset in one record: a straight line over its time."""

    record: str
    channel: str
    unit: str
    ends: tuple[float, float]  #: Offset where the record begins and where it ends.

    @property
    def sentence(self) -> str:
        """Sentence on a sensor drift."""
        first, last = (short(end) for end in self.ends)
        return (
            f"the offset of {self.channel} drifts from {first} to {last} {self.unit} in {self.record}, which no effect "
            "explains: it was taken out of the record; describe a sensor of the channel to have its offset fitted"
        )


def without_drifts(records: Sequence[Experiment], drifts: Sequence[Drift]) -> tuple[Experiment, ...]:
    """Records without drifts of sensors."""
    found = []
    for record in records:
        clean = record
        for one in drifts:
            if one.record == record.name:
                line = np.interp(record.time, record.time[[0, -1]], one.ends)
                clean = clean.with_channel(one.channel, clean[one.channel] - line, one.unit)
        found.append(clean)
    return tuple(found)


def sensor_drifts(
    model: Model,
    problems: Sequence[tuple[InverseDynamicsProblem, Array]],
    gap: Mapping[str, ChannelGap],
    factor: float,
) -> list[Drift]:
    """Sensor drifts that explain a channel: without a straight line its error is noise.

    Of channels that are compared beside the efforts, such as strains, whose sensors no one described. The zero of a
    bridge is as slow as its temperature (E. Doebelin, *Measurement Systems*, 2004, section 3.2), and no force of a
    machine that moves goes along a straight line for a whole record. A pressure does: it is the integral of what flows,
    so that a leak which the model lacks moves it like that. Channels of drives and supplies are left as they are.

    - ``model``: the best model found
    - ``problems``: training and validation records, each with the residual of the model
    - ``gap``: on validation records, with the noise floor
    - ``factor``: of the noise floor up to which an error is noise
    """
    found: list[Drift] = []
    integrating = {*model.actuators, *model.supplies}
    for channel in problems[-1][0].shown:
        one = gap[channel]
        described = model.sensor_of(channel) is not None or channel.rpartition(".")[0] in integrating
        if described or not one.after > factor * one.noise_floor:
            continue
        lines, left = [], 0.0
        for problem, residual in problems:
            own = [block for block in problem.blocks if block.channel == channel]
            errors = [residual[block.samples] / block.weight for block in own]
            whole = {record.name: record.time for record in problem.experiments}
            told = [_line(block, error, whole[block.experiment]) for block, error in zip(own, errors, strict=True)]
            lines += [
                Drift(block.experiment, channel, block.unit, ends) for block, (ends, _) in zip(own, told, strict=True)
            ]
            powers = [power for _, power in told]
            left = float(np.sqrt(np.average(powers, weights=[float(block.moving.sum()) for block in own])))
        if left <= factor * one.noise_floor:
            found += lines
    return found


def _line(block: Block, error: Array, whole: Array) -> tuple[tuple[float, float], float]:
    """Ends of the straight line of a sensor drift over the times of the ``whole`` record, and the mean square left."""
    counts = block.moving > 0.0
    slope, level = np.polyfit(block.time[counts] - whole[0], error[counts], 1)
    rest = error - level - slope * (block.time - whole[0])
    return (float(level), float(level + slope * (whole[-1] - whole[0]))), float(np.mean(rest[counts] ** 2))
