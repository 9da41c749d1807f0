"""Records beside a model that an observer of stated bandwidth keeps on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.initial import initial_state
from vpm.model import Model
from vpm.observer import Record
from vpm.ranking.firsts import STEP, Firsts, hidden_states
from vpm.ranking.noise_model import Parts
from vpm.ranking.settings import Settings
from vpm.simulate import Setup

Array = NDArray[np.float64]

#: Damping of the error of an observer.
DAMPING = float(np.sqrt(0.5))
#: Fewest steps of the integrator within a sample where a joint is split: contacts and gears ring fast.
STEPS = 4
#: Most steps of equal length within a sample; where these are too coarse, the integrator controls its error.
FINEST = 8
#: The integrator that does.
CONTROLLED = "adaptive"


@dataclass(frozen=True)
class Observer:
    """How a model is kept on its records.

    Attributes
    ----------
    band : float
        Bandwidth, Hz.
    steps : int
        Steps of the integrator within a sample: its errors are errors of the model too.
    controlled : bool
        Whether it takes as many more as keep its error within a tolerance.
    """

    band: float
    steps: int = 1
    controlled: bool = False

    @property
    def label(self) -> str:
        """For people."""
        return f"{self.band:g} Hz"


class Observed:
    """Records, and what a model leaves of them under an observer.

    The observer knows no noise: each measured joint is drawn to its encoder with the bandwidth, as by a soft spring
    with a damper between the machine and its log. All structures are compared under the same one. Where a joint is
    split, the encoder sits at the motor and the motor alone is drawn; the load follows through its spring or backlash.

    Parameters
    ----------
    model : Model
    experiments : sequence of Experiment
    settings : Settings
    setup : Setup, optional
    """

    def __init__(
        self, model: Model, experiments: Sequence[Experiment], settings: Settings, setup: Setup | None = None
    ) -> None:
        self.model, self.settings, self.setup = model, settings, setup or Setup()
        self.experiments = tuple(experiments)
        self.records = tuple(Record.of(model, record) for record in self.experiments)
        self._starts: WeakKeyDictionary[Model, list[Array]] = WeakKeyDictionary()
        ends = np.cumsum([len(record.time) for record in self.records])
        self.parts: Parts = [
            slice(int(end) - len(r.time) + int(settings.settling / r.dt), int(end))
            for end, r in zip(ends, self.records, strict=True)
        ]

    @cached_property
    def firsts(self) -> Firsts:
        """First states that nobody measures, as far as the model moves them; none where it runs away."""
        states = hidden_states(self.model, self.records[0].channels)
        if not states:
            return Firsts()
        observer, theta = Observer(self.settings.bands[0]), self.model.theta
        try:
            begun = zip(self.records, self._begun(self.model), strict=True)
            motion = np.concatenate([self._run(self.model, theta, observer, (), *one)[1] for one in begun])
        except (VpmError, ArithmeticError):
            return Firsts()
        sizes = np.std(motion[:, [self.model.state_names.index(state) for state in states]], axis=0)
        moving = [(state, float(size)) for state, size in zip(states, sizes, strict=True) if 0.0 < size < np.inf]
        return Firsts(tuple(state for state, _ in moving), tuple(size for _, size in moving), len(self.records))

    def follow(
        self, model: Model, theta: Array, observer: Observer, columns: Sequence[int] = ()
    ) -> tuple[Array, Array]:
        """Readings less outputs (N, m) of all records, one after the other, and derivatives (N, m, len(columns)).

        ``theta`` are the parameters, then, if they are not those of balance, by how much the first states are others:
        all of the first record, all of the second, and so on.
        """
        own = len(model.theta)
        firsts = self.firsts if len(theta) > own else Firsts()
        moves = theta[own:].reshape(len(self.records), len(firsts.states))
        parameters = [column for column in columns if column < own]
        residuals: list[Array] = []
        slopes: list[Array] = []
        for record, begun, move in zip(self.records, self._begun(model), moves, strict=True):
            start = firsts.added(model, begun, move)
            outputs, _, slope = self._run(model, theta[:own], observer, parameters, record, start)
            whole = np.zeros((*outputs.shape, len(columns)))
            whole[:, :, [place for place, column in enumerate(columns) if column < own]] = -slope
            before = own + len(residuals) * len(firsts.states)
            for number, size in enumerate(firsts.sizes):
                if before + number in columns:
                    moved = firsts.added(model, start, STEP * size * (np.arange(len(firsts.sizes)) == number))
                    others, _, _ = self._run(model, theta[:own], observer, (), record, moved)
                    whole[:, :, columns.index(before + number)] = (outputs - others) / (STEP * size)
            residuals.append(record.readings - outputs)
            slopes.append(whole)
        return np.concatenate(residuals), np.concatenate(slopes)

    def _begun(self, model: Model) -> list[Array]:
        """First states, by a model's own values: an observer soon forgets them.

        Raises
        ------
        VpmError
            What moves unseen cannot be held in balance in this model.
        """
        if model not in self._starts:
            try:
                starts = [initial_state(model, experiment, model.theta) for experiment in self.experiments]
            except ValueError as error:
                raise VpmError(str(error)) from error
            self._starts[model] = starts
        return self._starts[model]

    def _run(
        self,
        model: Model,
        theta: Array,
        observer: Observer,
        columns: Sequence[int],
        record: Record,
        start: Array,
    ) -> tuple[Array, Array, Array]:
        """Outputs of the channels of a record (N, m), states (N, nx), derivatives of the outputs (N, m, columns)."""
        places = [model.output_channels.index(name) for name in record.channels]
        gain = observer_gain(model, record.channels, observer.band, record.dt)
        outputs, states, slopes = model.core.observe(
            theta,
            start,
            record.inputs,
            places,
            record.readings,
            np.tile(gain.ravel(), (len(record.time), 1)),
            record.dt,
            self.setup.substeps * observer.steps,
            CONTROLLED if observer.controlled else self.setup.method(model),
            list(columns),
            self.setup.hold,
        )
        return outputs[:, places], states, slopes


def fewest_steps(model: Model) -> int:
    """Steps of the integrator within a sample that a model needs at least."""
    return STEPS if model.added_joints else 1


def observer_gain(model: Model, channels: Sequence[str], band: float, dt: float) -> Array:
    """By how much the reading of each channel moves each state at a sample (nx, m).

    The gain of a mass without friction whose error dies away with the bandwidth (Hz) and `DAMPING`.
    """
    gain = np.zeros((len(model.state_names), len(channels)))
    coordinates, turn = model.coordinates, 2.0 * np.pi * band * dt
    for column, channel in enumerate(channels):
        joint, _, quantity = channel.rpartition(".")
        if quantity != "position" or joint not in coordinates:
            continue
        place, behind = coordinates.index(joint), model.joint_behind(joint)
        moved = -np.expm1(-2.0 * DAMPING * turn), turn**2 / dt
        for row, share in zip((place, len(coordinates) + place), moved, strict=True):
            gain[row, column] = share
            if behind is not None:
                gain[row - place + coordinates.index(behind), column] = -share
    return gain
