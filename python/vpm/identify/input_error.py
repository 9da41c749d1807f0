"""Input error: the commands that a log holds, beside those that its measured motion asks the model for.

Where output error asks how far the simulated outputs are off, input error turns the model round: which command would
have led to what was measured? (K. Åström and P. Eykhoff, *Automatica* 7, 1971, for the three errors of a model.) A
model with drives has no inverse in closed form, and at a single sample the inverse divides noise by next to nothing. So
the record is cut into stretches, and the residual of each is the constant by which its logged command has to be
corrected for the simulated outputs to come nearest to the measured ones. The measured state at which a stretch begins
is corrected with it: what is wrong with one sample would else pass for a command of the whole stretch.

As the logged command has a size of its own, the trivial solution of a balance (no force and no inertia) is none here.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from vpm.errors import IdentificationError, SimulationError
from vpm.experiment import Experiment
from vpm.identify.output_error import compared_channels
from vpm.identify.parallel import in_order
from vpm.identify.problem import FEWEST_SAMPLES, Block
from vpm.initial import initial_state, measured_states
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Setup, restart_grid, simulation_inputs

#: Share of a command's size by which it is moved to find what the outputs do.
DIFFERENCE = 1e-4
#: Stretches in which a command moves the outputs by less than this share of the usual do not count: a joint sticks.
STUCK = 0.05
#: Least that commands have to move the outputs, both in units of their spread, for a model to be turned round.
UNMOVED = 1e-9
#: Relative singular value below which a direction of commands and first states does not show in the outputs.
CLEAR = 1e-6
#: States that the commands alone move: they are simulated from the beginning of a record, not corrected.
COMMANDED = ("spool", "spool_rate", "lag")
#: Weight of a first state's correction by its own size beside output errors in units of their spread: it decides on
#: corrections that the outputs hardly show.
HOLD = 1e-3
#: Gauss-Newton steps of the corrections.
STEPS = 2


@dataclass(frozen=True)
class _Stretches:
    """Stretches of a record one after the other; ``starts`` are their rows among ``inputs``."""

    time: Array
    starts: NDArray[np.int64]
    length: int
    states: Array
    measured: Array
    inputs: Array
    time_step: float


class InputErrorProblem:
    """Logged commands minus those that would have led to what was measured.

    - ``experiments``: each with the position of every joint, the command of every actuator, and both pressures of
      hydraulic drives
    - ``channels``: outputs that the model is turned round by; by default all that are measured
    - ``setup``: integrator, substeps, and as the horizon the length of a stretch
    - ``cutoff``: of the motion filter that the states are found with, Hz
    - ``workers``: records that are simulated at a time

    Raises
    ------
    IdentificationError, SimulationError
        The state is not measured, or a command does not show in the outputs.
    """

    mode = "input_error"

    def __init__(
        self,
        model: Model,
        experiments: Sequence[Experiment],
        *,
        channels: Sequence[str] | None = None,
        setup: Setup | None = None,
        cutoff: float | None = None,
        workers: int = 1,
    ) -> None:
        self.experiments = tuple(experiments)
        self.workers = workers
        self._setup = setup or Setup()
        self._commands = [place for place, name in enumerate(model.input_channels) if name.endswith(".command")]
        _check_state(model, experiments)
        self._followed = [place for place, name in enumerate(model.state_names) if name.rpartition(".")[2] in COMMANDED]
        names = compared_channels(model, experiments, "restarts", channels)
        self._columns = [model.output_channels.index(name) for name in names]
        spread = np.array([np.sqrt(np.mean([np.var(e[name]) for e in experiments])) for name in names])
        self._weights = 1.0 / np.where(spread > 0.0, spread, 1.0)
        self._stretches = tuple(self._cut(model, e, names, cutoff) for e in experiments)
        commands = np.std(np.concatenate([s.inputs[:, self._commands] for s in self._stretches]), axis=0)
        self._sizes = np.concatenate([commands, _sizes(np.concatenate([s.states for s in self._stretches]))])
        self._sizes = np.delete(self._sizes, [len(commands) + place for place in self._followed])
        self._unknowns = len(self._sizes)
        self._moved = [place for place in range(model.core.n_states) if place not in self._followed]
        self._check_sizes(model)
        self.blocks = self._lay_out(model)

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Input error: residual of the commands and its derivative; see :class:`vpm.identify.Problem`."""
        jobs = [partial(self._record, model, theta, list(columns), stretches) for stretches in self._stretches]
        blocks = iter(self.blocks)
        residuals, jacobians = [], []
        for correction, slopes in in_order(jobs, self.workers):
            for place in range(len(self._commands)):
                block = next(blocks)
                weight = block.weight * block.moving
                residuals.append(-correction[:, place] * weight)
                jacobians.append(-slopes[:, place, :] * weight[:, None])
        return np.concatenate(residuals), np.concatenate(jacobians)

    def _record(self, model: Model, theta: Array, columns: list[int], stretches: _Stretches) -> tuple[Array, Array]:
        """Input error of each command in each stretch (S, m), and its derivative (S, m, k).

        Gauss-Newton steps on commands and first states ``z``, from those of the log. At their end ``z`` solves
        ``A^T e = h^2 z`` with output errors ``e``, the response ``A`` to ``z`` and the hold ``h`` of first states, so
        that ``(A^T A + h^2) dz = dA^T e + A^T de``, but for the curvature of the outputs in ``z``.
        """
        hold = np.diag(np.where(np.arange(self._unknowns) < len(self._commands), 0.0, HOLD**2))
        z = np.zeros((len(stretches.starts), self._unknowns))
        for last in [False] * (STEPS - 1) + [True]:
            wanted = columns if last else []
            outputs, slopes = self._outputs(model, theta, stretches, z, wanted)
            response, response_slopes = self._response(model, theta, stretches, z, wanted)
            error = stretches.measured - outputs
            square = np.einsum("snm,snl->sml", response, response) + hold
            step = _solved(square, np.einsum("snm,sn->sm", response, error) - z @ hold)
            z += step
        left = error - np.einsum("snm,sm->sn", response, step)
        right = np.einsum("snmk,sn->smk", response_slopes, left) - np.einsum("snm,snk->smk", response, slopes)
        mine = slice(len(self._commands))
        return z[:, mine] * self._sizes[mine], _solved(square, right)[:, mine] * self._sizes[mine, None]

    def _response(
        self, model: Model, theta: Array, stretches: _Stretches, z: Array, columns: list[int]
    ) -> tuple[Array, Array]:
        """Change of weighted outputs by input corrections ``z`` (S, n, z), and derivative (S, n, z, k)."""
        values, slopes = [], []
        for place in range(self._unknowns):
            sides = []
            for step in (DIFFERENCE, -DIFFERENCE):
                moved = z.copy()
                moved[:, place] += step
                sides.append(self._outputs(model, theta, stretches, moved, columns))
            values.append((sides[0][0] - sides[1][0]) / (2.0 * DIFFERENCE))
            slopes.append((sides[0][1] - sides[1][1]) / (2.0 * DIFFERENCE))
        return np.stack(values, axis=2), np.stack(slopes, axis=2)

    def _outputs(
        self, model: Model, theta: Array, stretches: _Stretches, z: Array, columns: list[int]
    ) -> tuple[Array, Array]:
        """Weighted outputs of each stretch (S, n) for the input error, and derivative (S, n, k).

        ``z`` (S, m + nx) corrects commands and first states, in units of their sizes.
        """
        setup, m = self._setup, len(self._commands)
        stepping = (stretches.time_step, setup.substeps, setup.method(model), columns, setup.course)
        inputs = stretches.inputs.copy()
        inputs[:, self._commands] += np.repeat(z[:, :m] * self._sizes[:m], stretches.length, axis=0)
        states = stretches.states.copy()
        states[:, self._moved] += z[:, m:] * self._sizes[m:]
        outputs, jacobian = model.core.restart(theta, states, stretches.starts, stretches.length, inputs, *stepping)
        values = outputs[:, 1:, self._columns] * self._weights
        slopes = jacobian[:, 1:, self._columns, :] * self._weights[:, None]
        flat = values.reshape(len(stretches.starts), -1)
        return flat, slopes.reshape(*flat.shape, len(columns))

    def _cut(self, model: Model, experiment: Experiment, names: Sequence[str], cutoff: float | None) -> _Stretches:
        starts, length = restart_grid(experiment, self._setup.horizon)
        if len(starts) < FEWEST_SAMPLES:
            raise IdentificationError(
                f"{experiment.name}: mode 'input_error' finds one correction per stretch, and "
                f"{len(experiment)} samples have only {len(starts)} stretches of {self._setup.horizon:g} s; "
                "record longer or shorten the horizon"
            )
        rows = starts[:, None] + np.arange(1, length)
        measured = np.stack([experiment[name][rows] for name in names], axis=2) * self._weights
        states = measured_states(model, experiment, model.theta, starts, cutoff)
        inputs = simulation_inputs(model, experiment)
        self._follow_commands(model, inputs, states, starts, experiment)
        tiled = inputs[starts[:, None] + np.arange(length)].reshape(len(starts) * length, -1)
        places = np.arange(len(starts), dtype=np.int64) * length
        flat = measured.reshape(len(starts), -1)
        return _Stretches(experiment.time[starts], places, length, states, flat, tiled, experiment.dt)

    def _follow_commands(
        self, model: Model, inputs: Array, states: Array, starts: NDArray[np.int64], experiment: Experiment
    ) -> None:
        """Give states that inputs alone move, such as spools and lags, values of a record's run."""
        if not self._followed:
            return
        setup = self._setup
        begun = initial_state(model, experiment, model.theta)
        try:
            run = model.core.simulate(
                model.theta, begun, inputs, experiment.dt, setup.substeps, setup.method(model), [], setup.course
            )[1]
        except ValueError:  # the machine runs away in a free run: settled on the command, as at any restart
            return
        states[:, self._followed] = run[starts][:, self._followed]

    def _check_sizes(self, model: Model) -> None:
        for place, size in zip(self._commands, self._sizes, strict=False):
            if not size > 0.0:
                raise IdentificationError(
                    f"mode 'input_error' compares commands, but {model.input_channels[place]} is constant in all "
                    "records; log a command that moves, or choose another mode"
                )

    def _lay_out(self, model: Model) -> tuple[Block, ...]:
        strengths = [self._strength(model, stretches) for stretches in self._stretches]
        usual = np.median(np.concatenate(strengths))
        blocks, start = [], 0
        for experiment, stretches, strength in zip(self.experiments, self._stretches, strengths, strict=True):
            moving = (strength >= STUCK * usual).astype(np.float64)
            for place, size in zip(self._commands, self._sizes, strict=False):
                channel = model.input_channels[place]
                samples = slice(start, start + len(stretches.starts))
                scale = float(np.sqrt(np.mean(stretches.inputs[:, place] ** 2)))
                unit = model.channel_unit(channel)
                blocks.append(
                    Block(experiment.name, channel, unit, samples, stretches.time, scale, 1.0 / float(size), moving)
                )
                start = samples.stop
        return tuple(blocks)

    def _strength(self, model: Model, stretches: _Stretches) -> Array:
        """Least output change in each stretch (S,) by inputs of their own size."""
        z = np.zeros((len(stretches.starts), self._unknowns))
        response, _ = self._response(model, model.theta, stretches, z, [])
        m = len(self._commands)
        ours, states = response[:, :, :m], response[:, :, m:]
        alone = ours - states @ (np.linalg.pinv(states, rcond=CLEAR) @ ours)
        singular = np.linalg.svd(alone, compute_uv=False)[:, -1] / np.sqrt(response.shape[1])
        if not np.median(singular) > UNMOVED:
            weakest = model.input_channels[self._commands[int(np.argmin(np.linalg.norm(alone, axis=(0, 1))))]]
            raise SimulationError(
                f"mode 'input_error' turns the model round, but within {self._setup.horizon:g} s the measured outputs "
                f"do not answer to {weakest}, or not otherwise than to other commands; log what it moves, or take "
                "the mode 'free_run'"
            )
        return np.asarray(singular)


def _solved(square: Array, right: Array) -> Array:
    """Solution of the input error's normal equations of all stretches; what moves nothing stays."""
    inverse = np.linalg.pinv(square, rcond=CLEAR**2, hermitian=True)
    return np.asarray(np.einsum("sml,sl...->sm...", inverse, right))


def _sizes(states: Array) -> Array:
    """Size of each state (nx,) for the input error: root mean square over stretches; 1 where zero."""
    size = np.sqrt(np.mean(states**2, axis=0))
    return np.where(size > 0.0, size, 1.0)


def _check_state(model: Model, experiments: Sequence[Experiment]) -> None:
    """Refuse a stretch of the input error that cannot begin at the measured state."""
    if model.core.n_elastic:
        elastic = [name for name in model.beams if model.levels[name] != "rigid"]
        raise SimulationError(
            f"mode 'input_error' begins at measured states, but no log holds the elastic coordinates of "
            f"{', '.join(elastic)}; use the mode 'free_run' or 'prescribed_motion', or model.at('rigid')"
        )
    if not model.actuators:
        raise SimulationError(f"mode 'input_error' compares commands, but {model.name} has no actuator; use 'free_run'")
    for state in model.internal_names:
        owner, _, chamber = state.partition(".chamber_")
        for experiment in experiments:
            if chamber and owner in model.actuators and f"{owner}.pressure_{chamber}" not in experiment:
                raise IdentificationError(
                    f"{experiment.name}: mode 'input_error' begins at measured states, but the log does not hold "
                    f"{owner}.pressure_{chamber}; log it, or use the mode 'free_run'"
                )
