"""Tracked records: observers of fixed bandwidth keep a model on records, and leave an error."""

from __future__ import annotations

import contextlib
import copy
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import groupby, pairwise
from typing import TypeAlias
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from vpm.errors import CoreError, DivergedError, VpmError
from vpm.experiment import Experiment, drawn_noise, read_noise
from vpm.first_bending import bending_gains
from vpm.identify.shooting import state_channel
from vpm.initial import initial_state, joints_by_velocity
from vpm.model import Model
from vpm.numbers import Array
from vpm.observer import Record
from vpm.ranking.between_readings import between_readings
from vpm.ranking.hidden_first_states import STEP, HiddenFirstStates, hidden_states
from vpm.ranking.noise_model import NoiseModel, Parts, Structured, frequencies
from vpm.ranking.settings import (
    COARSE,
    CONTROLLED,
    DAMPING,
    DRAWS,
    LONGEST,
    LONGEST_OF_FOURTH_ORDER,
    OF_PRESSURES,
    PARTS,
    SEED,
    STEPS,
    STRETCHES,
    Settings,
)
from vpm.simulate import Setup
from vpm.simulate.setup import AUTOMATIC, HOLDS

#: Places of parameters by which there are derivatives, and by how much these may be moved; exact ones if not given.
By: TypeAlias = tuple[Sequence[int], Array | None]
NOTHING: By = ((), None)


@dataclass(frozen=True)
class Tracker:
    """Tracker: an observer of fixed bandwidth; `vpm.observer` has that of least variance."""

    band: float  #: Bandwidth, Hz.
    #: Whether its steps are exact enough to compare structures by what they leave, or cost as little as they can.
    fine: bool = True
    fewest: int = 1  #: Fewest steps within a sample.

    @property
    def coarse(self) -> Tracker:
        """Tracker of this bandwidth with the coarsest integration steps that it works with."""
        return Tracker(self.band, fine=False)

    @property
    def label(self) -> str:
        """Label of a tracker: its bandwidth."""
        return f"{self.band:g} Hz"


class TrackedRecords:
    """Tracked records, and the error that a model leaves of them under a tracker.

    The tracker knows no noise. It draws each measured joint to its encoder with the bandwidth, as by a soft spring with
    a damper between the machine and its log. All structures are compared under the same one. Where a joint is split,
    the load behind its spring or backlash is drawn along with the motor. Else both would answer to noise, and to
    missing effects elsewhere, otherwise than a rigid joint does. A joint of which the logs hold the velocity alone is
    drawn to that. A deflection that the logs hold is compared and not drawn: a structure without the joint behind
    predicts zero. Of joints in closed loops, as many are drawn as there are degrees of freedom. More of them would have
    to be weighed against each other.

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
        self.records = tuple(_records(model, self.experiments))
        #: Channels to which the model is drawn.
        self.drawn_to = _drawn(model, self.records[0].channels) if self.records else ()
        #: Bandwidth with which pressures are drawn, Hz.
        self.of_pressures = OF_PRESSURES[1]
        #: Channels of those drawn that show a joint, and no pressure.
        self.drawn_joints = tuple(name for name in self.drawn_to if not _chamber(model, name))
        self._starts: WeakKeyDictionary[Model, list[Array]] = WeakKeyDictionary()
        self._starts[model] = [record.first for record in self.records]
        self._bent: WeakKeyDictionary[Model, dict[int, Array]] = WeakKeyDictionary()
        ends = np.cumsum([len(record.time) for record in self.records])
        cuts = [
            int(end) - np.linspace(len(r.time) - min(int(settings.settling / r.dt), len(r.time) // 2), 0, STRETCHES + 1)
            for end, r in zip(ends, self.records, strict=True)
        ]
        self._stretches = [np.linspace(*pair, PARTS + 1).astype(int) for cut in cuts for pair in pairwise(cut)]
        #: Samples that are fitted, and those that are held back.
        self.parts, self.held_back = _divided(self._stretches, PARTS - 1)

    @cached_property
    def ways(self) -> dict[str, float]:
        """Way along which each joint or transmission that a channel shows moves in all tracked records."""
        places = {name: place for place, name in enumerate(self.records[0].channels) if name.endswith(".position")}
        return {
            name.removesuffix(".position"): float(
                np.ptp(np.concatenate([one.readings[:, place] for one in self.records]))
            )
            for name, place in places.items()
        }

    def with_hold(self, hold: str) -> TrackedRecords:
        """Tracked records with another hold of commands between samples."""
        if hold == self.setup.course:
            return self
        other = TrackedRecords(self.model, self.experiments, self.settings, replace(self.setup, hold=hold))
        return other.with_pressures(self.of_pressures)

    def with_commands_later(self, samples: int) -> TrackedRecords:
        """Tracked records whose commands come by whole samples later, or earlier where there are fewer than none."""
        other, rows = copy.copy(self), [np.arange(len(record.time)) - samples for record in self.records]
        other.records = tuple(
            replace(record, inputs=record.inputs[np.clip(places, 0, len(places) - 1)])
            for record, places in zip(self.records, rows, strict=True)
        )
        return other

    def with_pressures(self, band: float) -> TrackedRecords:
        """Tracked records with pressures that are drawn with another bandwidth, Hz."""
        other = copy.copy(self)
        other.of_pressures = band
        return other

    def _band(self, channel: str, band: float) -> float:
        """Bandwidth with which a tracker of some bandwidth draws to a channel, Hz."""
        return band if channel in self.drawn_joints else self.of_pressures

    def holding_back(self, part: int) -> TrackedRecords:
        """Tracked records with another part of each stretch held back, counted from 0."""
        other = copy.copy(self)
        other.parts, other.held_back = _divided(self._stretches, part)
        return other

    def whole(self) -> TrackedRecords:
        """Tracked records with nothing held back."""
        other = copy.copy(self)
        other.parts, other.held_back = [slice(int(ends[0]), int(ends[-1])) for ends in self._stretches], []
        return other

    @property
    def rows(self) -> list[slice]:
        """Samples of each tracked record from where its first state is forgotten."""
        parts, ends = self.whole().parts, np.cumsum([len(record.time) for record in self.records])
        return [
            slice(min(part.start for part in parts if part.stop > end - len(record.time)), int(end))
            for end, record in zip(ends, self.records, strict=True)
        ]

    @cached_property
    def firsts(self) -> HiddenFirstStates:
        """Unmeasured first states of tracked records, as far as the model moves them; none if it diverges."""
        states = hidden_states(self.model, self.records[0].channels)
        if not states:
            return HiddenFirstStates()
        try:
            motion = np.concatenate(self.states(self.model, Tracker(self.settings.bands[0], fine=False)))
        except (VpmError, ArithmeticError):
            return HiddenFirstStates()
        sizes = np.std(motion[:, [self.model.state_names.index(state) for state in states]], axis=0)
        moving = [(state, float(size)) for state, size in zip(states, sizes, strict=True) if 0.0 < size < np.inf]
        return HiddenFirstStates(
            tuple(state for state, _ in moving), tuple(size for _, size in moving), len(self.records)
        )

    @cached_property
    def motion(self) -> Array:
        """Residual of tracked records under a model at rest (N, m): readings minus their means."""
        return np.concatenate([record.readings - np.mean(record.readings, axis=0) for record in self.records])

    @cached_property
    def farthest(self) -> Array:
        """Farthest that each channel of tracked records is from its mean (m,)."""
        return np.asarray(np.maximum(np.max(np.abs(self.motion), axis=0), 1e-300))

    def drawn(self, band: float) -> Array:
        """Residual of tracked records under free masses (N, m); zero for channels that are not drawn.

        Of a machine that is far too heavy it leaves the same, for no force of its model does anything any more.
        """
        from scipy.signal import lfilter  # slow to import, and seldom needed

        left = np.zeros_like(self.motion)
        for end, record in zip(np.cumsum([len(one.time) for one in self.records]), self.records, strict=True):
            for column, channel in enumerate(record.channels):
                if channel in self.drawn_to:
                    zeros, poles = _free_mass(channel, self._band(channel, band), record.dt)
                    reading = record.readings[:, column] - record.readings[0, column]
                    left[end - len(reading) : end, column] = lfilter(zeros, poles, reading)
        return left

    def structured(
        self,
        residual: Array,
        band: float,
        parts: Parts,
        model: Model,
        theta: Array | None = None,
        *,
        held: bool = False,
    ) -> list[Structured]:
        """Part of a tracked residual (N, m) above the noise of each channel.

        A ``model`` near the machine says what noise of gauges and commands does to it, with its own parameters or
        ``theta``; of commands that are ``held``, too, if asked for.
        """
        noisy = [name for name in self.drawn_to if name not in self.drawn_joints]
        noisy += self.model.input_channels if held or self.setup.course != HOLDS[0] else ()
        moved = self._moved_by_noise(model, model.theta if theta is None else theta, band, noisy) if noisy else []
        return [
            Structured.of(
                [values[part] for part in parts],
                self._passed(band, parts, channel),
                [[one[part, place] for part in parts] for one in moved],
            )
            for place, (values, channel) in enumerate(zip(residual.T, self.records[0].channels, strict=True))
        ]

    def _moved_by_noise(self, model: Model, theta: Array, band: float, channels: Collection[str]) -> list[Array]:
        """Changes of a tracked residual (N, m) by noise of other ``channels``, drawn several times.

        A command that is held from sample to sample is mostly what a controller sent, and exact. One that runs on in
        between was read like any output: what its noise does to the machine, such as the ringing of a shaft, is not
        missing. Nor is what noise of gauges does to a piston whose pressures are drawn to them.
        """
        random, others = np.random.default_rng(SEED), [name not in channels for name in self.records[0].channels]
        for tracker in (Tracker(band).coarse, Tracker(band)):  # few steps diverge behind a piston that stands
            with contextlib.suppress(VpmError, ArithmeticError):
                quiet, _ = self.follow(model, theta, tracker)
                draws = (self._with_noise_of(channels, random).follow(model, theta, tracker)[0] for _ in range(DRAWS))
                return [(one - quiet) * others for one in draws]
        return []

    def _with_noise_of(self, channels: Collection[str], random: np.random.Generator) -> TrackedRecords:
        """Tracked records some channels of which have noise as in their logs once more."""
        other = copy.copy(self)
        noisy = []
        for record, log in zip(self.records, self.experiments, strict=True):
            inputs, readings = record.inputs.copy(), record.readings.copy()
            for values, names in ((inputs, self.model.input_channels), (readings, record.channels)):
                for column, channel in enumerate(names):
                    if channel in channels and channel in log:
                        values[:, column] += drawn_noise(log, channel, random)
            noisy.append(replace(record, inputs=inputs, readings=readings))
        other.records = tuple(noisy)
        return other

    def falls(self, model: Model, theta: Array, tracker: Tracker) -> bool:
        """Whether noise of the readings moves the tracked model by more than it moves them.

        A tracker that is stable passes on what is slow, and damps all else. A machine that falls over, or meets the
        ground, faster than it is drawn back amplifies any difference, so that no parameter explains what is left. It
        does so to the noise of one reading alone, too. What a coarse sensor does to the readings of a fine one is no
        fall.
        """
        random, channels = np.random.default_rng(SEED), self.records[0].channels
        noise = [np.column_stack([drawn_noise(log, name, random) for name in channels]) for log in self.experiments]
        left = self.follow(model, theta, tracker)[0]

        def amplified(*places: int) -> float:
            """Mean logarithm of the power by which noise of some readings moves these, over its own."""
            share, noisy = np.isin(np.arange(len(channels)), places), copy.copy(self)
            pairs = zip(self.records, noise, strict=True)
            noisy.records = tuple(replace(record, readings=record.readings + more * share) for record, more in pairs)
            added = np.concatenate(noise) * share
            moved = added + left - noisy.follow(model, theta, tracker)[0]
            powers = (sum(np.sum(values[rows] ** 2, axis=0) for rows in self.rows) for values in (moved, added))
            after, before = (np.maximum(power[list(places)], 1e-300) for power in powers)
            return float(np.mean(np.log(np.maximum(after / before, 1e-300))))

        places = [channels.index(name) for name in self.drawn_to]
        return amplified(*places) > 0.0 and sum(amplified(one) for one in places) > 0.0

    def _passed(self, band: float, parts: Parts, channel: str) -> list[Array]:
        """Share of white sensor noise that a tracker passes to the residual, by frequency.

        It draws the model to what is slow, noise among that: less than all of it is left there. Of a channel that was
        read more slowly than its record there is none between two readings, and what a logger filtered is left out.
        """
        ends = np.cumsum([len(record.time) for record in self.records])
        found = []
        for part in parts:
            place, lines = int(np.searchsorted(ends, part.stop)), frequencies(part.stop - part.start)
            passed = read_noise(self.experiments[place], channel, lines)
            if channel in self.drawn_to:
                turns = np.exp(2j * np.pi * lines)
                mass = _free_mass(channel, self._band(channel, band), self.records[place].dt)
                zeros, poles = (np.polyval(one, turns) for one in mass)
                passed = passed * np.abs(zeros / poles) ** 2
            found.append(passed)
        return found

    def states(self, model: Model, tracker: Tracker) -> list[Array]:
        """States (N, nx) of the tracked model along each record.

        Raises DivergedError: it runs away from a record, which the sentence names.
        """
        found = []
        for log, record, start in zip(self.experiments, self.records, self._begun(model), strict=True):
            try:
                [(_, states, _)] = self._runs(model, model.theta, tracker, NOTHING, [(record, start)])
            except CoreError as error:
                raise DivergedError(f"{log.name}: {error}") from None
            found.append(states)
        return found

    def outputs(self, model: Model, channels: Sequence[str]) -> list[Array]:
        """Outputs (N,) of a model along all records, as the slowest tracker has them; none where it runs away."""
        places = [model.output_channels.index(name) for name in channels]
        coarse = Tracker(self.settings.bands[0]).coarse
        if not places:
            return []
        with contextlib.suppress(VpmError, ArithmeticError):
            begun = zip(self.records, self._begun(model), strict=True)
            ran = self._runs(model, model.theta, coarse, NOTHING, begun, alone=False)
            return list(np.concatenate([outputs for outputs, _, _ in ran]).T[places])
        return []

    def follow(
        self,
        model: Model,
        theta: Array,
        tracker: Tracker,
        columns: Sequence[int] = (),
        moves: Array | None = None,
    ) -> tuple[Array, Array]:
        """Readings minus outputs (N, m) of the tracked model on all records, with derivatives (N, m, len(columns)).

        ``theta`` are the parameters. Differences of the first states from equilibrium follow, if there are any: all of
        the first record, all of the second, and so on. Derivatives are exact, or approximate where ``moves``
        (len(columns),) tell by how much each of these numbers may be moved for a difference.
        """
        own = len(model.theta)
        firsts = self._firsts_of(model, theta)
        places, by = among_parameters(own, columns, moves)
        residuals: list[Array] = []
        slopes: list[Array] = []
        begun = list(zip(self.records, self._starts_of(model, theta), strict=True))
        runs = self._runs(model, theta[:own], tracker, by, begun)
        for (record, start), (outputs, _, slope) in zip(begun, runs, strict=True):
            whole = np.zeros((*outputs.shape, len(columns)))
            whole[:, :, places] = -slope
            before = own + len(residuals) * len(firsts.states)
            for number, size in enumerate(firsts.sizes):
                if before + number in columns:
                    moved = firsts.added(model, start, STEP * size * (np.arange(len(firsts.sizes)) == number))
                    [(others, _, _)] = self._runs(model, theta[:own], tracker, NOTHING, [(record, moved)])
                    whole[:, :, columns.index(before + number)] = (outputs - others) / (STEP * size)
            for place, told in self._told_slowly(self.experiments[len(residuals)], record):
                outputs[:, place], whole[:, place] = told(outputs[:, place]), told(whole[:, place])
            residuals.append(record.readings - outputs)
            slopes.append(whole)
        return np.concatenate(residuals), np.concatenate(slopes)

    def mirrored(self, model: Model, theta: Array, tracker: Tracker, residual: Array) -> TrackedRecords:
        """Tracked records of which a model leaves the mirror image of the ``residual`` (N, m) that it leaves of these.

        Law: a model in innovations form (T. Kailath, *IEEE Transactions on Automatic Control* 13, 1968), driven by its
        innovations with the other sign (wild bootstrap; C. F. J. Wu, *The Annals of Statistics* 14, 1986).

        Raises
        ------
        Diverged
            The model runs away with these.
        """
        ends, own, records = np.cumsum([len(record.time) for record in self.records]), len(model.theta), []
        logs = zip(ends, self.experiments, self.records, self._starts_of(model, theta), strict=True)
        for end, log, record, start in logs:
            other = replace(record, readings=-residual[end - len(record.time) : end])
            [(outputs, _, _)] = self._runs(model, theta[:own], tracker, NOTHING, [(other, start)], innovations=True)
            for place, told in self._told_slowly(log, record):
                outputs[:, place] = told(outputs[:, place])
            records.append(replace(other, readings=other.readings + outputs))
        mirrored = copy.copy(self)
        mirrored.records = tuple(records)
        return mirrored

    def _told_slowly(self, log: Experiment, record: Record) -> Iterator[tuple[int, Callable[[Array], Array]]]:
        """Channels of a tracked record that were read more slowly, with how their outputs are read."""
        for place, channel in enumerate(record.channels):
            if channel in log.read_at and channel not in self.drawn_to:
                yield place, partial(between_readings, log, channel)

    def squares(self, residual: Array, noise: NoiseModel) -> tuple[Array, Array]:
        """Squares of a tracked residual (N, m) under a noise model: of fitted (n, m) and held-back samples."""
        fitted, held = (noise.by_channel(noise.whitened(residual, part)) ** 2 for part in (self.parts, self.held_back))
        return fitted.T, held.T

    def stepping(self, model: Model, tracker: Tracker, dt: float) -> tuple[str, int]:
        """Integrator of a tracker, and its steps within a sample of ``dt`` seconds.

        Structures are compared by short steps, or by steps of controlled error where that takes fewer. These need the
        exact Jacobian, which flexible links make large. Derivatives and proposals only show the way.
        """
        own, fewest = self.setup.method(model, drawn=True), STEPS if model.added_joints else 1
        automatic, linear = self.setup.integrator == AUTOMATIC, own == "additive"
        if (linear or not tracker.fine) and not any(effect.type.has_play for effect in model.effects):
            fewest = min(fewest, int(np.ceil(dt / COARSE)))
        if not tracker.fine:
            return ("crank_nicolson" if automatic and linear else own), max(fewest, tracker.fewest)
        short = int(np.ceil(dt / (LONGEST_OF_FOURTH_ORDER if linear else LONGEST)))
        if automatic and short > CONTROLLED * fewest and not model.levels:
            return f"adaptive({self.settings.exact:g})", 1
        return own, max(fewest, short)

    def _firsts_of(self, model: Model, theta: Array) -> HiddenFirstStates:
        """Unmeasured first states of tracked records that follow the parameters, if any do."""
        return self.firsts if len(theta) > len(model.theta) else HiddenFirstStates()

    def _starts_of(self, model: Model, theta: Array) -> Iterator[Array]:
        """First states of tracked records with what ``theta`` tells of them."""
        firsts = self._firsts_of(model, theta)
        shifts = theta[len(model.theta) :].reshape(len(self.records), len(firsts.states))
        return (firsts.added(model, *pair) for pair in zip(self._begun(model), shifts, strict=True))

    def _begun(self, model: Model) -> list[Array]:
        """First states of tracked records by the model's own values; a tracker soon forgets them.

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

    def _bending(self, model: Model, record: Record, channels: Sequence[str], start: Array) -> Array:
        """Gains (n, nx, m) by which the first samples of a tracked record tell how links bend; see `bending_gains`."""
        known = self._bent.setdefault(model, {})
        if id(record.time) not in known:  # names of records may be the same
            readings = record.readings[:, [record.channels.index(name) for name in channels]]
            grid = min(int(self.settings.settling / record.dt), len(readings) // 2), record.dt
            known[id(record.time)] = bending_gains(model, channels, readings, (start, record.inputs[0]), grid)
        return known[id(record.time)]

    def _runs(
        self,
        model: Model,
        theta: Array,
        tracker: Tracker,
        by: By,
        begun: Iterable[tuple[Record, Array]],
        *,
        alone: bool = True,
        innovations: bool = False,
    ) -> Iterator[tuple[Array, Array, Array]]:
        """Outputs of tracked records (N, m), states (N, nx) and derivatives ``by`` some numbers (N, m, k), one by one.

        Each record comes with its first state. Outputs are those of its channels ``alone``, or all of the model. Its
        readings may be ``innovations``.
        """
        for (names, dt), several in groupby(begun, key=lambda one: (one[0].channels, one[0].dt)):
            known = [column for column, name in enumerate(names) if name in model.output_channels]
            channels = [names[column] for column in known]
            method, steps = self.stepping(model, tracker, dt)
            runs = model.core.observe(
                theta,
                [
                    (
                        start,
                        record.inputs,
                        record.readings[:, known],
                        self._gains_along(model, theta, tracker, channels, record, start),
                    )
                    for record, start in several
                ],
                [model.output_channels.index(name) for name in channels],
                dt,
                self.setup.substeps * steps,
                method,
                list(by[0]),
                self.setup.course,
                alone=alone,
                moves=by[1],
                innovations=innovations,
            )
            fewer = alone and len(known) < len(names)
            for outputs, states, slopes in runs:
                yield (
                    _among(known, len(names), outputs) if fewer else outputs,
                    states,
                    _among(known, len(names), slopes) if fewer else slopes,
                )

    def _gains_along(
        self, model: Model, theta: Array, tracker: Tracker, channels: Sequence[str], record: Record, start: Array
    ) -> Array:
        """Gains of a tracker on these channels along a record (N, nx * m)."""
        bands = tracker.band, max(tracker.band, *self.settings.bands)
        gains = tracker_gains(model, channels, bands, (len(record.time), record.dt), theta, self.of_pressures)
        gains[:, :, [name not in self.drawn_to for name in channels]] = 0.0
        bent = self._bending(model, record, channels, start)
        gains[: len(bent)] += bent
        first = min(int(self.settings.settling / record.dt), len(record.time) // 2)
        gains[:first] += memory_gains(model, channels, bands, (first, record.dt), theta)
        return gains.reshape(len(record.time), -1)


def among_parameters(own: int, columns: Sequence[int], moves: Array | None) -> tuple[list[int], By]:
    """Indices of columns among the ``own`` parameters of a tracked model, with their steps."""
    places = [place for place, column in enumerate(columns) if column < own]
    return places, ([columns[place] for place in places], None if moves is None else moves[places])


def _records(model: Model, experiments: Sequence[Experiment]) -> Iterator[Record]:
    """Tracked records with the outputs of a model, and deflections that all of them hold."""
    held = [channel for channel in model.deflections if all(channel in experiment for experiment in experiments)]
    for experiment in experiments:
        record = Record.of(model, experiment)
        readings = np.column_stack([record.readings, *(experiment[channel] for channel in held)])
        yield replace(record, channels=(*record.channels, *held), readings=readings)


def _drawn(model: Model, channels: Sequence[str]) -> tuple[str, ...]:
    """Channels that a tracker draws independently: positions, those of driven joints first, or else velocities.

    So are pressures of chambers, which add up what flows in: without a reading nobody knows them after a while.
    """
    positions = [name for name in channels if is_position(model, name)]
    pressures = [name for name in channels if _chamber(model, name)]
    if not model.loops:
        return (*positions, *(f"{joint}.velocity" for joint in joints_by_velocity(model, channels)), *pressures)
    joints = {name.rpartition(".")[0]: name for name in positions}
    start, driven = model.loops.assembled(), [joint for joint in joints if joint in model.driven_joints]
    ways = [set(joints) & set(model.loops.independent(start, preferred)) for preferred in (driven, list(joints))]
    return (*(joints[joint] for joint in joints if joint in max(ways, key=len)), *pressures)


def _among(columns: Sequence[int], count: int, values: Array) -> Array:
    """Channels (N, ...) of tracked records in their columns among more, the others zero."""
    whole = np.zeros((len(values), count, *values.shape[2:]))
    whole[:, columns] = values
    return whole


def _divided(stretches: Sequence[NDArray[np.int_]], held: int) -> tuple[Parts, Parts]:
    """Division of tracked records into fitted samples and one held-back part of each stretch."""
    fitted: list[slice] = []
    for ends in stretches:
        sides = (slice(int(ends[0]), int(ends[held])), slice(int(ends[held + 1]), int(ends[-1])))
        fitted += [side for side in sides if side.start < side.stop]
    return fitted, [slice(int(ends[held]), int(ends[held + 1])) for ends in stretches]


def tracker_gains(
    model: Model,
    channels: Sequence[str],
    bands: tuple[float, float],
    grid: tuple[int, float],
    theta: Array,
    of_pressures: float = OF_PRESSURES[1],
) -> Array:
    """Gains of a tracker: by how much each channel's error moves each state at each sample of a grid (N, nx, m).

    In the end those of a mass without friction whose error dies away with the first of the ``bands`` (Hz) and
    `DAMPING`. No smoothed beginning tells the velocity with which a controller that is switched on throws a machine:
    at first they are those of the second one, and become smaller as a line through more and more readings tells the
    first states (expanding memory; N. Morrison, *Introduction to Sequential Smoothing and Prediction*, 1969). A sensor
    that shows a multiple of what it measures is corrected for it: else it would change the bandwidth, and pass for a
    better model.
    """
    (samples, dt), coordinates = grid, model.coordinates
    # A line through more readings than these gives less weight to the last one than a tracker does in the end.
    count = np.arange(1.0, min(samples, int(2.0 / (np.pi * bands[0] * dt)) + 1) + 1.0)
    gains = np.zeros((samples, len(model.state_names), len(channels)))
    for column, channel in enumerate(channels):
        joint, _, quantity = channel.rpartition(".")
        own_bands = bands
        if chamber := _chamber(model, channel):
            places, own_bands = [model.state_names.index(chamber)], (of_pressures, of_pressures)
        elif joint in coordinates and quantity in {"position", "velocity"}:
            places = [coordinates.index(joint), len(coordinates) + coordinates.index(joint)]
        else:
            continue
        own = slice(-len(places), None)  # of a pressure the rate alone is drawn
        slow, quick = (np.array(_gains(channel, band, dt))[own] for band in own_bands)
        factor = _factor(model, channel, theta)
        gains[:, places, column] = slow / factor
        gains[: len(count), places, column] = np.clip(_gains_of_line(channel, count, dt)[:, own], slow, quick) / factor
    return gains


def memory_gains(
    model: Model, channels: Sequence[str], bands: tuple[float, float], grid: tuple[int, float], theta: Array
) -> Array:
    """Gains of a tracker (samples, nx, m) by which first readings of a deflection tell what its spring remembers.

    Where a spring with hysteresis was left by the motion before the record, nobody knows. At rest it bends less by
    force/stiffness for each unit of its memory. These gains draw the deflection with it, which else would swing.
    """
    (samples, dt), count = grid, len(model.coordinates)
    gains = np.zeros((samples, len(model.state_names), len(channels)))
    springs = {model.joint_behind(joint): joint for joint in model.driven_joints}
    for effect in model.effects:
        channel, stiffness = f"{effect.at}.position", f"{springs.get(effect.at)}.compliance.stiffness"
        forces = [effect.parameter_names[one.name] for one in effect.type.parameters if one.scale == "effort"]
        if not effect.type.memory or channel not in channels or stiffness not in model.parameters:
            continue
        force = sum(theta[model.index(name)] for name in forces)
        if force > 0.0:
            place, column = model.coordinates.index(effect.at), channels.index(channel)
            slow, quick = (-np.expm1(-2.0 * np.pi * band * dt) for band in bands)
            told = np.clip(1.0 / np.arange(1.0, samples + 1.0), slow, quick)
            gains[:, [place, count + place], column] = _gains(channel, bands[1], dt)
            memory = model.state_names.index(f"{effect.at}.{effect.type.memory}")
            gains[:, memory, column] = -theta[model.index(stiffness)] / force * told
    return gains


def _chamber(model: Model, channel: str) -> str:
    """State of a tracked model that a channel shows, if it is the pressure of a chamber, or ""."""
    pressures = (name for name in model.internal_names if ".chamber_" in name and state_channel(model, name) == channel)
    return next(pressures, "")


def _gains_of_line(channel: str, count: Array, dt: float) -> Array:
    """Gains (N, 2) as `_gains` gives them, for a tracker by a line through so many readings."""
    if not channel.endswith(".position"):
        return np.column_stack([np.zeros_like(count), 1.0 / count])
    rate = 6.0 / (count * (count + 1.0))
    return np.column_stack([rate * (2.0 * count - 1.0) / 3.0, rate / dt])


def is_position(model: Model, channel: str) -> bool:
    """Whether a channel is a joint position, to which a tracker draws the model.

    None that an effect has split off: another structure does not have it, and all have to be under the same tracker.
    """
    joint, _, quantity = channel.rpartition(".")
    return quantity == "position" and joint in model.coordinates and joint not in model.added_joints


def _gains(channel: str, band: float, dt: float) -> tuple[float, float]:
    """Gains of a tracker from an error of a position, or of a velocity or pressure, to the position and its rate."""
    turn = 2.0 * np.pi * band * dt
    if not channel.endswith(".position"):
        return 0.0, float(-np.expm1(-turn))
    return float(-np.expm1(-2.0 * DAMPING * turn)), turn**2 / dt


def _free_mass(channel: str, band: float, dt: float) -> tuple[list[float], list[float]]:
    """Error of a tracked free mass: numerator and denominator polynomials of the transfer function."""
    place, rate = _gains(channel, band, dt)
    if not channel.endswith(".position"):
        return [1.0, -1.0], [1.0, rate - 1.0]
    return [1.0, -2.0, 1.0], [1.0, place + dt * rate - 2.0, 1.0 - place]


def _factor(model: Model, channel: str, theta: Array) -> float:
    """Sensor gain by which a tracked channel is multiplied."""
    sensor = model.sensor_of(channel)
    factors = [
        float(theta[model.index(name)])
        for effect in model.effects
        for short, name in effect.parameter_names.items()
        if effect.at == sensor and effect.type.site == "sensor" and effect.type.parameter(short).neutral == 1.0
    ]
    return max(abs(float(np.prod(factors))), 1e-3)
