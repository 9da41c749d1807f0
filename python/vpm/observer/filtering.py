"""One pass of an extended Kalman filter over a record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import DivergedError, ExperimentError, SimulationError, check_known
from vpm.experiment import Experiment
from vpm.initial import initial_state
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Setup
from vpm.simulate.inputs import held_inputs

if TYPE_CHECKING:
    from vpm.observer.noise import Noise


#: How far coordinates and rates may be from the first state, SI; states of drives by this share of themselves.
COORDINATES, RATES, DRIVES = 1e-2, 1.0, 0.1


@dataclass(frozen=True)
class Record:
    """Readings, inputs and first state of a log, as an observer takes them."""

    name: str
    time: Array  #: Shape (N,); s.
    dt: float  #: Time between samples, s.
    channels: tuple[str, ...]  #: Outputs of the model that the log holds.
    readings: Array  #: Shape (N, m).
    inputs: Array  #: Shape (N, inputs).
    first: Array  #: Shape (nx,); state at the first sample as the log suggests it.

    @classmethod
    def of(cls, model: Model, experiment: Experiment, channels: Sequence[str] | None = None) -> Record:
        """Record of a log for filtering.

        Raises
        ------
        SimulationError, ExperimentError
            No channel can be compared, one is unknown, or the log lacks a command.
        """
        names = tuple(channels) if channels is not None else measured_outputs(model, experiment)
        if not names:
            raise SimulationError(
                f"{experiment.name}: an observer compares measured outputs, and the log holds none of "
                f"{model.name}; log a position"
            )
        check_known(names, model.output_channels, SimulationError, "channels:", "is unknown")
        for name in names:
            if name not in experiment:
                raise ExperimentError(
                    f'channels: "{name}" is not in {experiment.name}, which holds {", ".join(experiment.channels)}'
                )
        readings = np.column_stack([experiment[name] for name in names])
        inputs = held_inputs(model, experiment, "observe")
        first = initial_state(model, experiment, model.theta)
        return cls(experiment.name, experiment.time, experiment.dt, names, readings, inputs, first)

    def stretch(self, samples: int) -> Record:
        """First so many samples of a record for filtering."""
        kept = {name: getattr(self, name)[:samples] for name in ("time", "readings", "inputs")}
        return Record(self.name, kept["time"], self.dt, self.channels, kept["readings"], kept["inputs"], self.first)


@dataclass(frozen=True)
class Pass:
    """Innovations, gains and states of one pass of the Kalman filter over a record; see `vpm._core.System.filter`."""

    innovations: Array  #: Shape (N, m).
    covariances: Array  #: Shape (N, m, m).
    gains: Array  #: Shape (N, nx, m).
    #: Shape (N, nx).
    states: Array
    deviations: Array

    def whitened(self) -> Array:
        """Whitened innovations of a filter pass (N, m), without correlation among channels."""
        return whitened(self.covariances, self.innovations)

    def log_likelihood(self, whitened: Array | None = None) -> float:
        """Log-likelihood of the readings in a filter pass, one sample after the other.

        ``whitened`` innovations, of any shape, may be those of other parameters under the same gains.
        """
        values = self.whitened() if whitened is None else whitened
        return -0.5 * float(np.sum(values**2) + self.log_volume() + values.size * np.log(2.0 * np.pi))

    def log_volume(self) -> float:
        """Log-determinants of a filter pass' covariances, summed."""
        return float(np.sum(np.linalg.slogdet(self.covariances)[1]))


def whitened(covariances: Array, values: Array) -> Array:
    """Whitened filter innovations ``L^-1 e`` with ``L L' = S``, (N, m), or derivatives (N, m, k)."""
    if covariances.shape[1] == 1:
        deviation = np.sqrt(covariances[:, 0, 0])
        return np.asarray(values / deviation.reshape(-1, *[1] * (values.ndim - 1)))
    roots = np.linalg.cholesky(covariances)
    columns = values if values.ndim == 3 else values[:, :, None]
    return np.asarray(np.linalg.solve(roots, columns).reshape(values.shape))


def filtered(model: Model, record: Record, noise: Noise, *, setup: Setup | None = None) -> Pass:
    """Pass of the Kalman filter of ``model`` over a ``record``.

    Raises `DivergedError`, `SimulationError`: the model runs away from the log, or cannot be filtered.
    """
    from vpm._core import Diverged

    setup = setup or Setup()
    places = [model.output_channels.index(name) for name in record.channels]
    spreads = noise.spreads(model, record)
    try:
        found = model.core.filter(
            model.theta,
            record.first,
            record.inputs,
            places,
            record.readings,
            spreads,
            record.dt,
            setup.substeps,
            setup.method(model),
            setup.course,
        )
    except Diverged as error:
        raise DivergedError(f"{record.name}: {error}", run=None, time=float(record.time[len(error.outputs)])) from None
    except ValueError as error:
        raise SimulationError(f"{record.name}: {error}") from error
    return Pass(*found)


def first_deviations(model: Model, first: Array) -> Array:
    """Deviation of each state from the filter's first one (nx,)."""
    n = len(model.coordinates)
    spread = np.full(len(first), RATES)
    spread[:n] = COORDINATES
    spread[2 * n :] = DRIVES * np.maximum(np.abs(first[2 * n :]), DRIVES)
    return spread


def measured_outputs(model: Model, experiment: Experiment) -> tuple[str, ...]:
    """Outputs in the log for filtering, without commands and accelerations."""
    inputs = set(model.input_channels)
    return tuple(
        name
        for name in model.output_channels
        if name in experiment and name not in inputs and not name.endswith(".acceleration")
    )
