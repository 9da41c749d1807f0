"""Positions of joints that follow from those of shafts, where a log holds motor encoders alone."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vpm.errors import ExperimentError
from vpm.experiment.record import Experiment

Array = NDArray[np.float64]

#: A matrix of ratios whose condition number is above this, its columns of equal length, tells no joints.
REGULAR = 1e6


class Geared(Protocol):
    """What is asked of a model: its joints, and which of them turn the shafts of transmissions."""

    @property
    def name(self) -> str:
        """Name of the model."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints."""

    @property
    def transmissions(self) -> tuple[str, ...]:
        """Names of the transmissions."""

    @property
    def theta(self) -> Array:
        """Values of the parameters."""

    def ratios(self, transmission: str) -> Mapping[str, str]:
        """Parameter that is the ratio of each joint of a transmission."""

    def index(self, name: str) -> int:
        """Place of a parameter."""

    def channel_unit(self, channel: str) -> str:
        """SI unit of a channel."""


def joints_from_shafts(
    experiment: Experiment, model: Geared, theta: Array | None = None, *, free: Collection[str] = ()
) -> Experiment:
    """Record with positions of joints in the place of those of shafts that tell them.

    Law: ``q = R^-1 (theta - R_known q_known)``, R the ratios of the joints that the log does not hold. A record that
    holds all of them, or no shaft that turns with another one, stays as it is.

    Parameters
    ----------
    experiment : Experiment
    model : Model
    theta : ndarray, shape (P,), optional
        Values of the parameters, the ratios among them; by default those of the model.
    free : collection of str
        Parameters that are to be fitted to the result.

    Raises
    ------
    ExperimentError
        The shafts in the record are not as many as the joints that it lacks, or do not tell them; or their ratios are
        to be fitted to what would follow from these ratios.
    """
    values = model.theta if theta is None else theta
    turned = {
        name: {joint: float(values[model.index(ratio)]) for joint, ratio in model.ratios(name).items()}
        for name in model.transmissions
        if f"{name}.position" in experiment
    }
    held = {joint for joint in model.joints if f"{joint}.position" in experiment}
    shafts = {name: ratios for name, ratios in turned.items() if not held.issuperset(ratios)}
    lacking = [
        joint for joint in model.joints if any(joint in ratios for ratios in shafts.values()) and joint not in held
    ]
    if not lacking:
        return experiment
    ratios = np.array([[own.get(joint, 0.0) for joint in lacking] for own in shafts.values()])
    scaled = ratios / np.linalg.norm(ratios, axis=0)
    if len(shafts) != len(lacking) or np.linalg.cond(scaled) > REGULAR:
        raise ExperimentError(
            f"{experiment.name}: the positions of {len(shafts)} transmissions ({', '.join(shafts)}) do not tell those "
            f"of {len(lacking)} joints ({', '.join(lacking)}) of {model.name}; log as many independent shafts as "
            f'joints, or the joints themselves, such as "{lacking[0]}.position"',
            channel=f"{lacking[0]}.position",
        )
    sought = [ratio for name in shafts for ratio in model.ratios(name).values() if ratio in free]
    if sought:
        raise ExperimentError(
            f"{experiment.name}: {sought[0]} cannot be fitted to positions of joints that follow from it; log the "
            f'joints themselves, such as "{lacking[0]}.position", or take the ratio as known',
            channel=f"{lacking[0]}.position",
        )
    angles = [
        experiment[f"{name}.position"]
        - sum((ratio * experiment[f"{joint}.position"] for joint, ratio in own.items() if joint in held), 0.0)
        for name, own in shafts.items()
    ]
    positions = np.linalg.solve(ratios, np.array(angles))
    kept = experiment.select(
        [
            name
            for name in experiment.channels
            if name.rpartition(".")[0] not in shafts or not name.endswith(".position")
        ]
    )
    for joint, position in zip(lacking, positions, strict=True):
        kept = kept.with_channel(f"{joint}.position", position, model.channel_unit(f"{joint}.position"))
    return kept
