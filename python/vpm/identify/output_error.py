"""The residual of simulated outputs, and what readings are off by in each record.

Gauges and load cells drift from one record to the next: a constant of its own in each record is fitted beside the
parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from vpm.errors import IdentificationError, check_known
from vpm.experiment import Experiment, Motion
from vpm.identify.first_states import BegunAnywhere, add_first_state, first_state_slopes
from vpm.identify.identifiability import RANK_TOLERANCE, column_lengths
from vpm.identify.parallel import in_order
from vpm.identify.problem import FEWEST_SAMPLES, Block, Problem, less_means, tied, untied
from vpm.identify.statistics import record_groups, sandwich
from vpm.initial import initial_state, joint_motion
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Setup, SimulatedArrays, copied_channels, simulate_arrays, simulated_rows

if TYPE_CHECKING:
    from vpm.identify.fit_result import Fit


#: Modes that simulate a record as a whole from its first sample.
WHOLE = ("free_run", "closed_loop")


class OutputErrorProblem(BegunAnywhere):
    """Measured minus simulated outputs in free run, restarts, closed loop or on a prescribed motion.

    - ``mode``: one of "free_run", "restarts", "closed_loop", "prescribed_motion"
    - ``channels``: compared outputs; by default all measured ones that the simulation does not prescribe
    - ``setup``: integrator, substeps and horizon
    - ``cutoff``: of the motion that the joints follow, Hz
    - ``workers``: records that are simulated at a time; the residual does not depend on it
    - ``offsets``: compared channels that are off by a constant in each record, which is taken off their residual
    """

    def __init__(
        self,
        model: Model,
        experiments: Sequence[Experiment],
        mode: str,
        *,
        channels: Sequence[str] | None = None,
        setup: Setup | None = None,
        cutoff: float | None = None,
        workers: int = 1,
        offsets: Sequence[str] = (),
    ) -> None:
        self.mode = mode
        self.workers = workers
        self.experiments = tuple(experiments)
        self._setup = setup or Setup()
        follows = mode == "prescribed_motion"
        self._followed = [joint_motion(e, model, cutoff) if follows else None for e in self.experiments]
        self._channels = compared_channels(model, experiments, mode, channels)
        self.offsets = tuple(offsets)
        self._check_offsets()
        self.blocks = self._lay_out(model)

    @property
    def setup(self) -> Setup:
        """Setup of the output-error simulations: integrator, substeps and horizon."""
        return self._setup

    @property
    def offset_blocks(self) -> tuple[Block, ...]:
        """Output channels of records that are off by a constant."""
        return tuple(block for block in self.blocks if block.channel in self.offsets)

    def with_offsets_left(self) -> Self:
        """Output-error problem with constant sensor offsets left in its residual."""
        return self.changed(offsets=())

    def _left(self, values: Array) -> Array:
        """Output error (n,) or derivative (n, columns) without offsets and first states."""
        return super()._left(less_means(values, self.offset_blocks))

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Residual of the outputs and its derivative; see :class:`Problem`."""
        residuals, jacobians = [], []
        index = [model.output_channels.index(channel) for channel in self._channels]
        blocks = iter(self.blocks)
        jobs = [
            partial(self._simulated, model, e, theta, list(columns), followed, record)
            for record, (e, followed) in enumerate(zip(self.experiments, self._followed, strict=True))
        ]
        results = in_order(jobs, self.workers)
        for experiment, result in zip(self.experiments, results, strict=True):
            for column, channel in zip(index, self._channels, strict=True):
                block = next(blocks)
                weight = block.weight * block.moving
                residuals.append((experiment[channel][result.rows] - result.outputs[:, column]) * weight)
                jacobians.append(-result.jacobian[:, column, :] * weight[:, None])
        return self._left(np.concatenate(residuals)), self._left(np.concatenate(jacobians))

    def open_states(self, model: Model) -> tuple[Array, int]:
        """Sizes of unknown first states of an output-error problem; see :class:`BegunAnywhere`.

        Of machines with closed loops none: first states next to one another would leave their loops open.
        """
        if model.loops:
            return np.zeros(len(model.state_names)), len(self.experiments)
        spread = np.zeros(len(model.state_names))
        for record, experiment in enumerate(self.experiments if self.mode in WHOLE else ()):
            states = self._simulated(model, experiment, model.theta, [], None, record).states
            if states is not None and len(states):
                spread = np.maximum(spread, np.where(np.ptp(states, axis=0) > 0.0, np.std(states, axis=0), 1.0))
        return spread, len(self.experiments)

    def _simulated(
        self,
        model: Model,
        experiment: Experiment,
        theta: Array,
        columns: list[int],
        followed: Motion | None,
        record: int,
    ) -> SimulatedArrays:
        """Simulated outputs of one record; the derivative covers its first state."""
        run = partial(simulate_arrays, model, experiment, self.mode, theta=theta, setup=self._setup)
        if self.mode not in WHOLE:
            return run(columns=columns, followed=followed)
        state = initial_state(model, experiment, theta)
        if self.departures is not None:
            state += self.departures[record]
        result = run(columns=columns, initial_state=state)
        slopes = first_state_slopes(partial(initial_state, model, experiment), theta, columns)
        add_first_state(result.jacobian, lambda x: run(initial_state=x).outputs, state, slopes, theta[columns])
        return result

    def _lay_out(self, model: Model) -> tuple[Block, ...]:
        blocks, start = [], 0
        counted = [self._counted(experiment) for experiment in self.experiments]
        parts = list(zip(self.experiments, counted, strict=True))
        spread = {c: float(np.sqrt(np.mean([np.var(e[c][n]) for e, n in parts]))) for c in self._channels}
        for record, (experiment, counts) in enumerate(parts):
            rows = self._rows(record)
            moving = counts[rows].astype(np.float64)
            for channel in self._channels:
                weight = 1.0 / spread[channel] if spread[channel] > 0.0 else 1.0
                scale = self._scale(channel, experiment[channel][counts])
                samples = slice(start, start + rows.size)
                unit = model.channel_unit(channel)
                blocks.append(
                    Block(experiment.name, channel, unit, samples, experiment.time[rows], scale, weight, moving)
                )
                start += rows.size
        return tuple(blocks)

    def _rows(self, record: int) -> NDArray[np.int64]:
        """Rows of a log that output errors compare."""
        return simulated_rows(self.experiments[record], self.mode, self._setup, self._followed[record])

    def _check_offsets(self) -> None:
        """Refuse offsets of outputs that are not compared."""
        rest = f"is not compared in mode '{self.mode}'"
        check_known(self.offsets, self._channels, IdentificationError, "offsets:", rest)

    def _scale(self, channel: str, measured: Array) -> float:
        """Size of a measured output, without an unknown offset."""
        return float(np.std(measured) if channel in self.offsets else np.sqrt(np.mean(measured**2)))

    def _counted(self, experiment: Experiment) -> NDArray[np.bool_]:
        """Samples of an output error that count: not those while the first state settles."""
        settling = 0.0 if self.mode == "restarts" else self._setup.settling
        counted = experiment.time - experiment.time[0] >= settling - 0.5 * experiment.dt
        if settling > 0.0 and counted.sum() < FEWEST_SAMPLES:
            raise IdentificationError(
                f"{experiment.name}: {int(counted.sum())} samples are left after {settling:g} s of settling; "
                "give a longer record or less settling"
            )
        return np.asarray(counted)


def compared_channels(
    model: Model, experiments: Sequence[Experiment], mode: str, channels: Sequence[str] | None
) -> tuple[str, ...]:
    """Outputs that are compared: those given, or all that every log holds and the mode does not copy from it."""
    chosen = tuple(channels) if channels is not None else _compared(model, experiments, mode)
    if not chosen:
        raise IdentificationError(
            f"no measured channel to compare in mode '{mode}': the logs hold {', '.join(experiments[0].channels)}; "
            "log a position or velocity, or choose another mode"
        )
    _check_channels(model, experiments, chosen)
    return chosen


def _compared(model: Model, experiments: Sequence[Experiment], mode: str) -> tuple[str, ...]:
    """Outputs that every log holds and that the mode does not simply copy from the log."""
    prescribed = copied_channels(model, mode)
    return tuple(
        channel
        for channel in model.output_channels
        if channel not in prescribed and all(channel in experiment for experiment in experiments)
    )


def _check_channels(model: Model, experiments: Sequence[Experiment], channels: Sequence[str]) -> None:
    """Refuse compared outputs that the model does not give or a log does not hold."""
    check_known(channels, model.output_channels, IdentificationError, f"channels: {model.name} has no output")
    for channel in channels:
        for experiment in experiments:
            if channel not in experiment:
                raise IdentificationError(
                    f'channels: "{channel}" is not in {experiment.name}, which holds {", ".join(experiment.channels)}; '
                    "leave it out"
                )


def offset_blocks(data: Problem) -> tuple[Block, ...]:
    """Output channels of records that a fit takes to be off by an unknown constant."""
    plain = untied(data)
    return plain.offset_blocks if isinstance(plain, OutputErrorProblem) else ()


def with_offsets(fit: Fit, data: Problem, weights: Array) -> Fit:
    """Output-error fit with sensor offsets and their deviations.

    ``weights``: shape (n,), with which rows went into the fit.
    """
    off = offset_blocks(data)
    if not off:
        return fit
    residual, jacobian = _with_constants(fit, data)
    constants = np.zeros((residual.size, len(off)))
    for column, block in enumerate(off):
        constants[block.samples, column] = block.weight * block.moving
    values = constants.T @ residual / np.sum(constants**2, axis=0)
    known = _priors(fit, jacobian.shape[1])
    seen = _seen(np.vstack([weights[:, None] * less_means(jacobian, off), known]))
    columns = np.column_stack([weights[:, None] * jacobian @ seen, weights[:, None] * constants])
    columns = np.vstack([columns, np.column_stack([known @ seen, np.zeros((len(known), len(off)))])])
    left = np.concatenate([weights * (residual - constants @ values), np.ones(len(columns) - residual.size)])
    exact = range(data.blocks[-1].samples.stop, len(left))
    std = np.sqrt(np.diag(sandwich(columns, left, record_groups(data.blocks), exact)))[-len(off) :]
    labels = [f"{block.experiment}: {block.channel}" for block in off]
    found, deviations = (dict(zip(labels, map(float, numbers), strict=True)) for numbers in (values, std))
    return replace(fit, offsets=found, offsets_std=deviations)


def taken_by_offsets(fit: Fit, data: Problem) -> dict[str, str]:
    """Message on parameters whose whole effect on outputs is a constant that offsets leave open."""
    blind = [c.names[0] for c in fit.unidentifiable if len(c.names) == 1]
    if not offset_blocks(data) or not blind:
        return {}
    slopes = _with_constants(fit, data)[1]
    told = {}
    for name in blind:
        column = slopes[:, fit.names.index(name)]
        moved = dict.fromkeys(b.channel for b in offset_blocks(data) if np.any(column[b.samples]))
        if moved:
            told[name] = (
                f"{name} adds a constant to {', '.join(moved)} and does nothing else, so offsets take its place; fix "
                "it, or leave the channel out of offsets"
            )
    return told


def _with_constants(fit: Fit, data: Problem) -> tuple[Array, Array]:
    """Output error of a fit with its offsets in it, and derivative by parameters and first states."""
    plain, model = untied(data), fit.model
    whole = tied(plain.with_offsets_left() if isinstance(plain, OutputErrorProblem) else plain, fit.ties)
    given = {"unknown": np.array(list(fit.states.values()))} if fit.states else {}
    return whole.evaluate(model, model.theta, [model.index(name) for name in fit.names], **given)


def _seen(slopes: Array) -> Array:
    """Directions (p, k) in which an output-error fit moved."""
    lengths = column_lengths(slopes)
    _, values, directions = np.linalg.svd(np.linalg.qr(slopes / lengths, mode="r"))
    return np.asarray(directions[values > RANK_TOLERANCE * values[0]].T / lengths[:, None])


def _priors(fit: Fit, columns: int) -> Array:
    """Prior rows of an output-error fit's parameters."""
    known = [fit.model.parameters[name].uncertainty for name in fit.names]
    rows = np.zeros((len(known), columns))
    if fit.fitting is not None and fit.fitting.priors:
        np.fill_diagonal(rows, [1.0 / uncertainty if uncertainty else 0.0 for uncertainty in known])
    return rows[np.any(rows, axis=1)]
