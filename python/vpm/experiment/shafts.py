"""Positions of joints that follow from those of shafts, where a log holds motor encoders alone."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from vpm.errors import ExperimentError
from vpm.experiment.record import Experiment
from vpm.model import Model
from vpm.numbers import Array

#: A matrix of ratios whose condition number is above this, its columns of equal length, tells no joints.
REGULAR = 1e6


def joints_from_shafts(
    experiment: Experiment, model: Model, theta: Array | None = None, *, free: Collection[str] = ()
) -> Experiment:
    """Record with positions of joints in the place of those of shafts that tell them.

    Law: ``q = R^+ (theta - R_known q_known)``, R the ratios of the joints that the log does not hold, ``theta`` behind
    gain and offset of a sensor. Where more shafts are logged than joints lack, as beside a linear scale on one of them,
    R^+ takes least squares. A record that holds all joints, or no shaft that turns with others, stays as it is.

    Parameters
    ----------
    theta : ndarray, shape (P,), optional
        Values of the parameters, the ratios among them; by default those of the model.
    free : collection of str
        Parameters that are to be fitted to the result.
    """
    values = model.theta if theta is None else theta
    held = [joint for joint in model.joints if f"{joint}.position" in experiment]
    logged = {name: model.ratios(name) for name in model.transmissions if f"{name}.position" in experiment}
    shafts = {name: ratios for name, ratios in logged.items() if not set(held).issuperset(ratios)}
    lacking = [joint for joint in model.joints if joint not in held and any(joint in own for own in shafts.values())]
    if not lacking:
        return experiment
    _check_known(experiment, model, shafts, lacking[0], free)

    def ratio(name: str, joint: str) -> float:
        return float(values[model.index(shafts[name][joint])]) if joint in shafts[name] else 0.0

    ratios = np.array([[ratio(name, joint) for joint in lacking] for name in shafts])
    _check_regular(experiment, model, ratios, tuple(shafts), lacking)
    angles = np.array([_angle(experiment, model, values, name) for name in shafts])
    known = [[ratio(name, joint) for joint in held] for name in shafts]
    angles -= np.array(known) @ np.array([experiment[f"{joint}.position"] for joint in held]) if held else 0.0
    spent = {f"{name}.position" for name in shafts}
    told = experiment.select([channel for channel in experiment.channels if channel not in spent])
    for joint, position in zip(lacking, np.linalg.pinv(ratios) @ angles, strict=True):
        told = told.with_channel(f"{joint}.position", position, model.channel_unit(f"{joint}.position"))
    return told


def _check_regular(
    experiment: Experiment, model: Model, ratios: Array, shafts: Sequence[str], lacking: Sequence[str]
) -> None:
    """Complain about shafts that do not tell the joints."""
    if len(shafts) >= len(lacking) and np.linalg.cond(ratios / np.linalg.norm(ratios, axis=0)) <= REGULAR:
        return
    raise ExperimentError(
        f"{experiment.name}: the positions of {len(shafts)} transmissions ({', '.join(shafts)}) do not tell those of "
        f"{len(lacking)} joints ({', '.join(lacking)}) of {model.name}; log at least as many independent "
        f'shafts as joints, or the joints themselves, such as "{lacking[0]}.position"',
        channel=f"{lacking[0]}.position",
    )


def _check_known(
    experiment: Experiment, model: Model, shafts: Mapping[str, Mapping[str, str]], joint: str, free: Collection[str]
) -> None:
    """Refuse shafts whose ratios and sensors are to be fitted, and delayed sensors."""
    errors = [parameter for name in shafts for parameter in _errors(model, name)]
    taken = [parameter for ratios in shafts.values() for parameter in ratios.values()] + errors
    repair = f'log the joints themselves, such as "{joint}.position"'
    for parameter in taken:
        if parameter.endswith(".delay.time"):
            rest = f"positions of joints do not follow from a shaft whose sensor is late by {parameter}; {repair}"
        elif parameter in free:
            rest = (
                f"{parameter} cannot be fitted to positions of joints that follow from it; {repair}, or keep its value"
            )
        else:
            continue
        raise ExperimentError(f"{experiment.name}: {rest}", channel=f"{joint}.position")


def _angle(experiment: Experiment, model: Model, values: Array, name: str) -> Array:
    """Angle of a shaft behind gain and offset of its sensor, rad."""
    numbers = {parameter.split(".")[-2]: float(values[model.index(parameter)]) for parameter in _errors(model, name)}
    reading: Array = experiment[f"{name}.position"]
    return (reading - numbers.get("offset", 0.0)) / numbers.get("gain", 1.0)


def _errors(model: Model, name: str) -> list[str]:
    """Parameters of the sensor of a shaft's angle: gain, offset, delay."""
    sensor = model.sensor_of(f"{name}.position")
    return [] if sensor is None else [one for one in model.parameter_names if one.startswith(f"{sensor}.")]
