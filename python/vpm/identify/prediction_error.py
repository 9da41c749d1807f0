"""The residual of an observer: what each reading says beyond the samples before it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from vpm.experiment import Experiment
from vpm.identify.parallel import in_order
from vpm.identify.problem import Block
from vpm.model import Model
from vpm.numbers import Array
from vpm.observer import Noise, Record, filtered, likely_noise
from vpm.observer.filtering import Pass, whitened
from vpm.simulate import Setup


class PredictionErrorProblem:
    """Innovations of an observer on all records, in units of their size, with its gains fixed.

    Nothing is differentiated and no whole run is asked to stay beside the log: unknown forces and noise of sensors are
    part of the model, so that closed loops, drift and unstable machines leave no bias (U. Forssell and L. Ljung,
    *Automatica* 35, 1999). The gains are those of an extended Kalman filter at the parameters with which the problem
    was set up; `renewed` gives the problem with those of other parameters.

    - ``channels``: outputs that are compared; by default all that each log holds
    - ``setup``: integrator, substeps and hold
    - ``noise``: by default that which makes the records most likely
    - ``workers``: records that are followed at a time
    """

    mode = "prediction_error"

    def __init__(
        self,
        model: Model,
        experiments: Sequence[Experiment],
        *,
        channels: Sequence[str] | None = None,
        setup: Setup | None = None,
        noise: Noise | None = None,
        workers: int = 1,
    ) -> None:
        self.experiments, self.workers = tuple(experiments), workers
        self._channels, self._setup, self._stated = channels, setup or Setup(), noise
        self.records = tuple(Record.of(model, experiment, channels) for experiment in experiments)
        self.noise = noise or likely_noise(model, self.records, setup=self._setup)
        #: A pass over each record, whose gains stay.
        self.passes = tuple(filtered(model, record, self.noise, setup=self._setup) for record in self.records)
        self.blocks = self._lay_out(model)

    def renewed(self, model: Model) -> PredictionErrorProblem:
        """Prediction-error problem with the noise and the gains of another model."""
        given = {"channels": self._channels, "setup": self._setup, "noise": self._stated}
        return PredictionErrorProblem(model, self.experiments, workers=self.workers, **given)  # type: ignore[arg-type]

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Prediction errors, whitened, and their derivative; see :class:`Problem`."""
        jobs = [
            partial(self._followed, model, theta, list(columns), *pair)
            for pair in zip(self.records, self.passes, strict=True)
        ]
        residuals, jacobians = [], []
        for values, slopes in in_order(jobs, self.workers):
            residuals.append(values.T.ravel())
            jacobians.append(slopes.transpose(1, 0, 2).reshape(values.size, len(columns)))
        return np.concatenate(residuals), np.concatenate(jacobians)

    def log_likelihood(self, residual: Array) -> float:
        """Log-likelihood of all readings from the prediction errors of `evaluate`."""
        ends = np.cumsum([one.innovations.size for one in self.passes])[:-1]
        pairs = zip(self.passes, np.split(residual, ends), strict=True)
        return sum(one.log_likelihood(part) for one, part in pairs)

    def _followed(
        self, model: Model, theta: Array, columns: list[int], record: Record, gains: Pass
    ) -> tuple[Array, Array]:
        """Whitened prediction errors (N, m) of one record, and their derivative (N, m, k)."""
        places = [model.output_channels.index(name) for name in record.channels]
        outputs, slopes = self._observed(model, theta, columns, record, gains)
        innovations = record.readings - outputs[:, places]
        return whitened(gains.covariances, innovations), whitened(gains.covariances, -slopes)

    def outputs(self, model: Model) -> Array:
        """All outputs that are predicted along the records, one after the other, shape (N, outputs)."""
        pairs = zip(self.records, self.passes, strict=True)
        return np.concatenate([self._observed(model, model.theta, [], record, gains)[0] for record, gains in pairs])

    def _observed(
        self, model: Model, theta: Array, columns: list[int], record: Record, gains: Pass
    ) -> tuple[Array, Array]:
        """Predicted outputs (N, outputs) of one record, and derivative of the measured ones (N, m, k)."""
        places = [model.output_channels.index(name) for name in record.channels]
        stepping = (record.dt, self._setup.substeps, self._setup.method(model), columns, self._setup.course)
        table = gains.gains.reshape(len(record.time), -1)
        followed = [(record.first, record.inputs, record.readings, table)]
        [(outputs, _, slopes)] = model.core.observe(theta, followed, places, *stepping)
        return outputs, slopes

    def _lay_out(self, model: Model) -> tuple[Block, ...]:
        blocks, start = [], 0
        for record, one in zip(self.records, self.passes, strict=True):
            for column, channel in enumerate(record.channels):
                size = float(np.sqrt(np.mean(one.covariances[:, column, column])))
                scale = float(np.sqrt(np.mean(record.readings[:, column] ** 2)))
                samples = slice(start, start + len(record.time))
                unit = model.channel_unit(channel)
                counts = np.ones(len(record.time))
                blocks.append(Block(record.name, channel, unit, samples, record.time, scale, 1.0 / size, counts))
                start = samples.stop
        return tuple(blocks)
