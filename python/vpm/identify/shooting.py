"""Output errors of records whose first states are unknown, whole or in pieces that have to meet.

Multiple shooting: each piece of a record is simulated from a start state of its own, and the gaps between the end of
one piece and the start of the next are residuals as well, with a weight (H. G. Bock, *Modelling of Chemical Reaction
Systems*, Springer 1981; A. Ribeiro et al., *Automatica* 121, 2020, for what it does to the smoothness of the fit). With
no fitted states the pieces are restarts.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from vpm.errors import IdentificationError, check_known
from vpm.experiment import Experiment
from vpm.identify.first_states import OF_STATE, add_first_state, difference, first_state_slopes
from vpm.identify.output_error import OutputErrorProblem
from vpm.identify.parallel import in_order
from vpm.identify.problem import FEWEST_SAMPLES
from vpm.identify.settings import Fitting
from vpm.initial import initial_state, measured_states
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Setup, simulate_arrays, simulation_inputs


@dataclass(frozen=True)
class Pieces:
    """First rows, lengths and first states of the pieces into which multiple shooting cuts one record."""

    starts: NDArray[np.int64]
    length: int
    states: Array

    @property
    def rows(self) -> NDArray[np.int64]:
        """Rows of the log that shooting compares: each piece without its last sample."""
        return np.arange(self.starts[0], self.starts[-1] + self.length)


class ShootingProblem(OutputErrorProblem):
    """Measured minus simulated outputs from first states that are unknown, and the gaps between pieces.

    - ``mode``: one of "free_run", "closed_loop", pieces need a free run
    - ``fitting``: its first states, pieces and compared channels. With pieces, by default all states that an output
      shows are fitted; known ones are those of whole records.
    - ``setup``, ``workers``: as for `OutputErrorProblem`
    """

    def __init__(
        self,
        model: Model,
        experiments: Sequence[Experiment],
        mode: str,
        fitting: Fitting,
        *,
        setup: Setup | None = None,
        workers: int = 1,
    ) -> None:
        states, known, piece = fitting.states, fitting.known_states, fitting.piece
        if mode != "free_run" and (piece > 0.0 or mode != "closed_loop"):
            raise IdentificationError(
                f"first states are fitted in the modes free_run and closed_loop, pieces in free_run, not in '{mode}'; "
                "choose another mode or leave states and piece out"
            )
        check_known([*states, *known], model.state_names, IdentificationError, f"states: {model.name} has no state")
        if piece > 0.0 and not states:
            states = tuple(name for name in model.state_names if state_channel(model, name) is not None)
        self.states = states
        self._places = [model.state_names.index(name) for name in states]
        self._known = {model.state_names.index(name): value for name, value in known.items()}
        self.pieces = tuple(_cut(model, e, piece) for e in experiments)
        for pieces in self.pieces:
            for place, value in self._known.items():
                pieces.states[0, place] = value
        channels, offsets = fitting.channels or None, fitting.offsets
        super().__init__(model, experiments, mode, channels=channels, setup=setup, workers=workers, offsets=offsets)
        self._sizes = self._state_sizes(model)
        self._gap_columns = [
            (model.output_channels.index(c), place)
            for place, name in enumerate(states)
            if (c := state_channel(model, name)) is not None
        ]
        compared = dict.fromkeys(block.channel for block in self.blocks)
        weights = {block.channel: block.weight for block in self.blocks}
        self.gap_channels = tuple(model.output_channels[column] for column, _ in self._gap_columns)
        self._gap_weights = np.array(
            [
                np.sqrt(fitting.continuity) * (weights[c] if c in compared else 1.0 / self._sizes[place])
                for c, (_, place) in zip(self.gap_channels, self._gap_columns, strict=True)
            ]
        )
        self.labels = tuple(
            f"{e.name}, {e.time[row]:g} s: {name}"
            for e, p in zip(self.experiments, self.pieces, strict=True)
            for row in p.starts
            for name in self.states
        )

    @property
    def first_states(self) -> Array:
        """First states of shooting from the log: records, pieces and states one after the other."""
        return np.concatenate([p.states[:, self._places].ravel() for p in self.pieces])

    @property
    def state_sizes(self) -> Array:
        """Natural size of each of the shooting problem's `first_states`."""
        return np.concatenate([np.tile(self._sizes, len(p.starts)) for p in self.pieces])

    @property
    def gap_rows(self) -> int:
        """Number of rows at the end of the shooting residual that are gaps between pieces."""
        return sum(len(p.starts) - 1 for p in self.pieces) * len(self._gap_columns)

    def open_states(self, model: Model) -> tuple[Array, int]:
        """Sizes of unknown first states in shooting: none, because all pieces' states are fitted."""
        return np.zeros(len(model.state_names)), len(self.experiments)

    def evaluate(
        self, model: Model, theta: Array, columns: Sequence[int] = (), unknown: Array | None = None
    ) -> tuple[Array, Array]:
        """Shooting residual and its derivative by parameters and first states; see :class:`Problem`.

        - result ``residual``: shape (n,), outputs, then gaps
        - result ``jacobian``: shape (n, len(columns) + len(first_states))
        """
        unknown = self.first_states if unknown is None else unknown
        counts = [len(p.starts) * len(self.states) for p in self.pieces]
        mine = np.split(unknown, np.cumsum(counts)[:-1])
        jobs = [
            partial(
                self._record,
                model,
                theta,
                list(columns),
                k,
                values.reshape(len(self.pieces[k].starts), len(self.states)),
            )
            for k, values in enumerate(mine)
        ]
        parts = in_order(jobs, self.workers)
        p = len(columns)
        residual = np.concatenate([part[0] for part in parts] + [part[2] for part in parts])
        jacobian = np.zeros((residual.size, p + sum(counts)))
        row, column = 0, p
        for side in (1, 3):
            column = p
            for part, count in zip(parts, counts, strict=True):
                block = part[side]
                jacobian[row : row + len(block), :p] = block[:, :p]
                jacobian[row : row + len(block), column : column + count] = block[:, p:]
                row, column = row + len(block), column + count
        return self._left(residual), self._left(jacobian)

    def _record(
        self, model: Model, theta: Array, columns: list[int], number: int, values: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Shooting residual of one record: outputs and derivative, then gaps and derivative."""
        pieces, experiment = self.pieces[number], self.experiments[number]
        states = pieces.states.copy()
        if len(pieces.starts) == 1:
            states[0] = self._begun(model, experiment, theta)
        if self.states:
            states[:, self._places] = values
        outputs_from = partial(self._outputs, model, theta, experiment, pieces, columns=[])
        outputs, by_theta = self._outputs(model, theta, experiment, pieces, states, columns)
        if len(pieces.starts) == 1:
            fixed = [*self._known, *self._places]
            slopes = first_state_slopes(partial(self._begun, model, experiment), theta, columns, fixed)
            add_first_state(by_theta[0], lambda x: outputs_from(x[None])[0][0], states[0], slopes, theta[columns])
        k, p = len(self.states), len(columns)
        by_state = np.zeros((*outputs.shape, k))
        for j, (place, size) in enumerate(zip(self._places, self._sizes, strict=True)):
            by_state[..., j] = difference(lambda x: outputs_from(x)[0], states, np.s_[:, place], OF_STATE * size)
        channels = len(self._channels)
        mine = self.blocks[number * channels : (number + 1) * channels]
        count = len(pieces.starts)
        residuals, jacobians = [], []
        for block in mine:
            column = model.output_channels.index(block.channel)
            weight = block.weight * block.moving
            measured = experiment[block.channel][pieces.rows]
            residuals.append((measured - _joined(outputs[:, :, column])) * weight)
            jacobian = np.zeros((len(measured), p + count * k))
            jacobian[:, :p] = -_joined(by_theta[:, :, column, :])
            for piece in range(count):
                last = pieces.length - (piece < count - 1)
                rows = slice(piece * (pieces.length - 1), piece * (pieces.length - 1) + last)
                jacobian[rows, p + piece * k : p + (piece + 1) * k] = -by_state[piece, :last, column, :]
            jacobians.append(jacobian * weight[:, None])
        gaps, gap_jacobian = self._gaps(outputs, by_theta, by_state, pieces, p)
        return np.concatenate(residuals), np.concatenate(jacobians), gaps, gap_jacobian

    def _begun(self, model: Model, experiment: Experiment, theta: Array) -> Array:
        """First state of a whole record in shooting, from the log at these parameters, or known."""
        state = initial_state(model, experiment, theta)
        places, values = list(self._known), list(self._known.values())
        state[places] = values
        joints, coordinates = len(model.joints), len(model.coordinates)
        if coordinates > joints and any(place < joints for place in places):  # links hang as the known joints have them
            state[:coordinates] = model.core.equilibrium(theta, state[:joints])[0]
            state[places] = values
        return state

    def _gaps(self, outputs: Array, by_theta: Array, by_state: Array, pieces: Pieces, p: int) -> tuple[Array, Array]:
        """Gaps of shooting: end of each piece minus start of the next, in the fitted states."""
        count, k = len(pieces.starts), len(self.states)
        columns = [column for column, _ in self._gap_columns]
        weights = self._gap_weights * np.sqrt(pieces.length)
        gaps = (outputs[:-1, -1, :] - outputs[1:, 0, :])[:, columns] * weights
        jacobian = np.zeros((count - 1, len(columns), p + count * k))
        slopes = (by_theta[:-1, -1] - by_theta[1:, 0])[:, columns, :]
        jacobian[:, :, :p] = slopes * weights[:, None]
        for piece in range(count - 1):
            here = slice(p + piece * k, p + (piece + 1) * k)
            following = slice(p + (piece + 1) * k, p + (piece + 2) * k)
            jacobian[piece, :, here] = by_state[piece, -1][columns] * weights[:, None]
            jacobian[piece, :, following] = -(by_state[piece + 1, 0][columns] * weights[:, None])
        return gaps.ravel(), jacobian.reshape(gaps.size, p + count * k)

    def _outputs(
        self, model: Model, theta: Array, experiment: Experiment, pieces: Pieces, states: Array, columns: list[int]
    ) -> tuple[Array, Array]:
        """Outputs of shooting (pieces, length, channels) and their derivative by ``columns``."""
        if len(pieces.starts) == 1:
            run = simulate_arrays(
                model, experiment, self.mode, theta=theta, columns=columns, setup=self._setup, initial_state=states[0]
            )
            return run.outputs[None], run.jacobian[None]
        setup = self._setup
        inputs = simulation_inputs(model, experiment)
        stepping = (experiment.dt, setup.substeps, setup.method(model), columns, setup.course)
        return model.core.restart(theta, states, pieces.starts, pieces.length, inputs, *stepping)

    def _state_sizes(self, model: Model) -> Array:
        """Spread of each state fitted by shooting, in log or simulation; 1 if constant."""
        sizes = []
        simulated = [
            self._outputs(model, model.theta, e, p, p.states, [])[0]
            for e, p in zip(self.experiments, self.pieces, strict=True)
        ]
        for name, place in zip(self.states, self._places, strict=True):
            channel = state_channel(model, name)
            spread = 0.0
            if channel is not None:
                column = model.output_channels.index(channel)
                spread = max(
                    float(np.std(e[channel] if channel in e else outputs[:, :, column]))
                    for e, outputs in zip(self.experiments, simulated, strict=True)
                )
            values = np.concatenate([p.states[:, place] for p in self.pieces])
            sizes.append(spread or float(np.max(np.abs(values))) or 1.0)
        return np.array(sizes)

    def _rows(self, record: int) -> NDArray[np.int64]:
        """Rows of one record at which shooting pieces begin; see `OutputErrorProblem`."""
        return self.pieces[record].rows


def state_channel(model: Model, name: str) -> str | None:
    """Output that shows a state for shooting: of the same name, or a chamber's pressure."""
    for channel in (name, name.replace(".chamber_", ".pressure_")):
        if channel in model.output_channels:
            return channel
    return None


def _cut(model: Model, experiment: Experiment, seconds: float) -> Pieces:
    """Shooting pieces of equal length that leave as little of a record as they can."""
    samples = len(experiment)
    if seconds == 0.0:
        state = initial_state(model, experiment, model.theta)
        return Pieces(np.zeros(1, dtype=np.int64), samples, state[None])
    count = max(1, round((samples - 1) * experiment.dt / seconds))
    length = (samples - 1) // count
    if length < FEWEST_SAMPLES:
        raise IdentificationError(
            f"{experiment.name}: pieces of {seconds:g} s have {length} samples; make them at least "
            f"{FEWEST_SAMPLES * experiment.dt:g} s long"
        )
    starts = np.arange(count, dtype=np.int64) * length
    return Pieces(starts, length + 1, measured_states(model, experiment, model.theta, starts, None))


def _joined(values: Array) -> Array:
    """Shooting pieces joined, each without its last sample but the last piece."""
    pieces = [*values[:-1, :-1], values[-1]]
    return np.concatenate(pieces)
