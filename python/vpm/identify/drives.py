"""Drives with states of their own on a measured motion: where they begin, what shows of them, and their efforts."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from vpm.experiment import Experiment, Motion
from vpm.initial import measured_states
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import AUTOMATIC, Setup

#: Where drives are run by one step per sample, derivatives are taken by steps of up to this, s: what is compared
#: of them is ten times as slow, and each costs as much as the run itself.
SLOPE_STEP = 2e-3


def picked(model: Model, outputs: Array, jacobian: Array, rows: slice, channels: Sequence[str]) -> tuple[Array, Array]:
    """Outputs of drives and their derivative, by the names of channels; zero for those that a machine lacks."""
    known = [column for column, channel in enumerate(channels) if channel in model.output_channels]
    places = [model.output_channels.index(channels[column]) for column in known]
    kept, slopes = outputs[rows], jacobian[rows]
    seen, derivative = np.zeros((len(kept), len(channels))), np.zeros((len(kept), len(channels), slopes.shape[2]))
    seen[:, known], derivative[:, known] = kept[:, places], slopes[:, places]
    return seen, derivative


def shown_and_efforts(
    model: Model,
    theta: Array,
    columns: Sequence[int],
    m: Motion,
    experiment: Experiment,
    channels: Sequence[str],
    internal: Array,
    integrator: str,
) -> tuple[Array, Array]:
    """Channels, then efforts of drives on joints (N, k), and their derivative (N, k, columns)."""
    run = partial(driven, model, theta, m, experiment, internal=internal, integrator=integrator)
    every = int(SLOPE_STEP / m.dt + 1e-6) if integrator != AUTOMATIC else 1
    if not columns or every < 2:
        return _shown(model, *run(columns), channels)
    values, _ = _shown(model, *run(()), channels)
    _, slopes = _shown(model, *run(columns, every=every), channels)
    return values, _between(slopes, every, len(values))


def _shown(model: Model, outputs: Array, slopes: Array, channels: Sequence[str]) -> tuple[Array, Array]:
    """Channels, then efforts of drives on joints, of all that drives answer, and their derivative."""
    seen, derivative = picked(model, outputs, slopes, slice(None), channels)
    first = len(model.output_channels)
    return np.hstack([seen, outputs[:, first:]]), np.concatenate([derivative, slopes[:, first:]], axis=1)


def _thinned(m: Motion, every: int) -> Motion:
    """Thinned samples of a motion for drives, with commands of the same mean."""
    rows = np.arange(0, len(m.time), every)
    held = np.add.reduceat(m.inputs, rows) / np.diff(np.append(rows, len(m.time)))[:, None]
    motion = {name: getattr(m, name)[rows] for name in ("time", "position", "velocity", "acceleration")}
    return replace(m, **motion, inputs=held, dt=every * m.dt)


def _between(slopes: Array, every: int, samples: int) -> Array:
    """Derivatives of drives at all samples by cubic splines through every so many."""
    from scipy.interpolate import CubicSpline

    grid = every * np.arange(len(slopes))
    return np.asarray(CubicSpline(grid, slopes)(np.minimum(np.arange(samples), grid[-1])))


def first_drives(model: Model, theta: Array, m: Motion, experiment: Experiment) -> Array:
    """States of drives and supplies at the beginning of a record.

    From there on: what nobody knows of the first state has the filter's settling to die away.
    """
    given = None if model.added_joints else m
    state = measured_states(model, experiment, theta, np.zeros(1, dtype=np.int64), m.cutoff, given)[0]
    return np.asarray(state[2 * len(model.joints) :])


def driven(
    model: Model,
    theta: Array,
    m: Motion,
    experiment: Experiment,
    columns: Sequence[int],
    internal: Array,
    integrator: str = AUTOMATIC,
    every: int = 1,
) -> tuple[Array, Array]:
    """Outputs and efforts of the drives on their joints, and their derivative, at ``every`` so many samples."""
    setup = Setup(integrator)
    m = m if every == 1 else _thinned(m, every)
    motion = (m.position, m.velocity, m.acceleration, m.inputs)
    places, seen = _measured_states(model, experiment)
    stepping = (m.dt, setup.substeps, setup.method(model), list(columns))
    outputs, _, jacobian = model.core.simulate_drives(theta, *motion, internal, places, seen[::every], *stepping)
    return outputs, jacobian


def _measured_states(model: Model, experiment: Experiment) -> tuple[list[int], Array]:
    """Numbers and values of states of drives that the log holds: currents, and both pressures of a cylinder or none."""
    places: list[int] = []
    columns: list[Array] = []
    for place, name in enumerate(model.internal_names):
        owner, _, quantity = name.partition(".")
        pair = [f"{owner}.pressure_{side}" for side in "ab"]
        if quantity == "current" and name in experiment:
            places, columns = [*places, place], [*columns, experiment[name]]
        elif quantity == "chamber_a" and all(channel in experiment for channel in pair):
            places, columns = [*places, place, place + 1], [*columns, *(experiment[channel] for channel in pair)]
    return places, np.column_stack(columns) if columns else np.zeros((len(experiment), 0))
