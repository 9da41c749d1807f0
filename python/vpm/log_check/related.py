"""Channels that follow from another one: references from measured channels, accelerations from the motion."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from vpm.experiment import Experiment, choose_cutoff
from vpm.experiment.signal import differentiate, lowpass, settling_samples
from vpm.log_check.correction import Correction
from vpm.log_check.settings import Settings
from vpm.log_check.tried_corrections import scales
from vpm.model import Model
from vpm.numbers import Array


@dataclass(frozen=True, eq=False)
class Related:
    """Values of a channel beside those that another channel says it should have, shape (N,)."""

    channel: str
    teller: str
    #: Shape (N,); what the channel holds, and what it should.
    values: Array
    expected: Array

    def error(self, factor: float = 1.0) -> float:
        """Mean square error of ``factor`` times a related channel, as a share of the variance."""
        moved = float(np.var(self.expected))
        return float(np.mean((factor * self.values - self.expected) ** 2)) / moved if moved > 0.0 else 0.0

    @property
    def least(self) -> float:
        """Least error of a related channel with the best of all factors, see `error`."""
        power = float(np.mean(self.values**2))
        return self.error(float(np.mean(self.values * self.expected)) / power) if power > 0.0 else self.error()


def wrong_scales(
    model: Model, record: Experiment, units: Mapping[str, str], settings: Settings
) -> Iterator[tuple[Correction, Related]]:
    """Wrong units and signs of related channels that no tracker compares.

    A machine follows the references of its controllers more or less; derivatives of a position are its acceleration.

    - ``record``: its other mistakes corrected
    - ``units``: units in which the channels, and the time, were read
    """
    for related in (*_references(model, record), *_accelerations(model, record)):
        before = related.error()
        if before <= settings.doubtful:
            continue
        tried = [one for one in scales(model, (related.channel,), units, settings) if not one.is_clock]
        best, *others = sorted(tried, key=lambda one: related.error(one.factor))
        after = related.error(best.factor)
        rivals = [related.error(one.factor) for one in others if one.factor != -best.factor]
        # Where a factor of no unit does better, or another one as well, none of them is the scale.
        is_scale = settings.alike * after <= related.least and after < settings.alike * min(rivals)
        if after <= settings.better * before and is_scale:
            yield best, related


def _references(model: Model, record: Experiment) -> Iterator[Related]:
    for actuator, held in model.held_channels.items():
        reference = f"{actuator}.reference"
        if reference in record and _moves(record, held):
            yield Related(reference, held, record[reference], record[held])


def _accelerations(model: Model, record: Experiment) -> Iterator[Related]:
    """Related accelerations: measured, and of the filtered positions, without the ends."""
    for joint in model.joints:
        yield from _derivative(record, f"{joint}.position", f"{joint}.acceleration", 2)


def left_of_velocities(record: Experiment, channels: Collection[str]) -> dict[str, float]:
    """Share of the variance of each velocity among channels that the derivative of its position does not explain.

    That is a relation of two sensors, which no force and no mass enters.
    """
    found = {}
    for joint, _, kind in (name.rpartition(".") for name in channels):
        for one in _derivative(record, f"{joint}.position", f"{joint}.velocity", 1) if kind == "velocity" else ():
            found[one.channel] = min(one.error(), 1.0)
    return found


def _derivative(record: Experiment, position: str, channel: str, order: int) -> Iterator[Related]:
    """Related derivative of a position, if a record holds both: measured, and of the filtered position."""
    if channel not in record or not _moves(record, position):
        return
    read, retained = [record.read_rate(position)], [record.retained.get(position, np.inf)]
    cutoff = choose_cutoff(record[position][:, None], record.rate, read, retained).cutoff
    inside = slice((edge := settling_samples(record.rate, cutoff)), len(record) - edge)
    if len(record) <= 4 * edge:
        return
    expected, values = lowpass(record[position], record.rate, cutoff), lowpass(record[channel], record.rate, cutoff)
    for _ in range(order):
        expected = differentiate(expected, record.dt)
    which = {1: "derivative", 2: "second derivative"}[order]
    yield Related(channel, f"the {which} of {position}", values[inside], expected[inside])


def _moves(record: Experiment, channel: str) -> bool:
    """Whether a record holds a channel that tells a related one: where a sensor stands still, it tells nothing."""
    return channel in record and bool(np.ptp(record[channel]) > 0.0)
