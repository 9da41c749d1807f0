"""The residual of a model against data, in the modes of simulation, with its exact derivative.

A problem fixes the data and how they are compared; the model may change under it. That is what lets one problem judge
the nominal model, the recalibrated one and every candidate effect on the same samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from vpm.errors import DivergedError, IdentificationError, near_match
from vpm.experiment import Experiment, Motion
from vpm.identify.along import Response, bends, check_along, has_own_drives, respond, shown_channels
from vpm.identify.drive_memory import DriveMemory
from vpm.identify.first_state import add_first_state, first_state_slopes
from vpm.identify.gauges import gauge_gains, hold_of
from vpm.identify.parallel import in_order
from vpm.identify.reuse import Kept, parts_of
from vpm.identify.stops import at_stops, check_left
from vpm.initial import initial_state, joint_motion
from vpm.model import Model
from vpm.simulate import AUTOMATIC, Setup, SimulatedArrays, copied_channels, simulate_arrays

Array = NDArray[np.float64]

#: A joint stands still where it is slower than this share of its largest speed for one decimated sample on end: the
#: filter of the motion shows no shorter rest.
STANDSTILL_SHARE = 0.005
#: A drive rests where its joint is slower than this share of its largest speed, in the mean over this time, s.
REST_SHARE, REST_TIME = 0.03, 0.1
#: A joint that moves for less than this share of all records is judged at standstill too: nothing else is left of it.
LEAST_MOVING = 0.5
#: A record with fewer samples after decimation says nothing about anything.
FEWEST_SAMPLES = 12
#: One step of second order for each sample, and the share of what drives answer that it may be off by: noise of
#: pressures and currents is ten times as large on the best of logs.
LONG_STEPS, ROUGH = "linearly_implicit", 1e-3
#: Modes that simulate a record as a whole from its first sample.
WHOLE = ("free_run", "closed_loop")
#: Retained samples at each end of a record in which the parallel filter settles: what a record that ends in motion sets
#: off near the new Nyquist frequency falls by about two fifths from one retained sample to the next.
SETTLING = 8


@dataclass(frozen=True)
class Block:
    """One channel of one record inside the residual vector.

    Attributes
    ----------
    experiment, channel, unit : str
        Where the samples come from and their unit.
    samples : slice
        Their place in the residual vector.
    time : ndarray
        Time of each sample, s.
    scale : float
        Size of the measured signal (root mean square), in ``unit``; relative errors refer to it.
    weight : float
        What the residual was multiplied by, 1/``unit``, so that channels of different units can be added.
    moving : ndarray
        1 for samples that count, 0 for those at standstill, whose residual is zero.
    """

    experiment: str
    channel: str
    unit: str
    samples: slice
    time: Array
    scale: float
    weight: float
    moving: Array


class Problem(Protocol):
    """Residual ``(measured - predicted) * weight`` of a model on fixed data."""

    mode: str
    blocks: tuple[Block, ...]

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Residual, shape (n,), and its derivative by the named parameters, shape (n, len(columns))."""


def segments(problem: Problem) -> list[slice]:
    """The contiguous pieces of the residual vector."""
    return [block.samples for block in problem.blocks]


def gaps(problem: Problem, residual: Array) -> dict[str, tuple[float, float, str]]:
    """Root mean square, its share of the measured signal, and the unit, for each channel over all records."""
    result = {}
    for channel in dict.fromkeys(block.channel for block in problem.blocks):
        mine = [block for block in problem.blocks if block.channel == channel]
        count = sum(float(block.moving.sum()) for block in mine)
        power = sum(float(np.sum(residual[b.samples] ** 2)) / b.weight**2 for b in mine)
        signal = sum(b.scale**2 * float(b.moving.sum()) for b in mine)
        rms = float(np.sqrt(power / count))
        result[channel] = (rms, float(np.sqrt(power / signal)) if signal > 0.0 else np.inf, mine[0].unit)
    return result


class InverseDynamicsProblem:
    """Balance of effort at each joint: what the actuators deliver minus what the measured motion needs.

    Both sides, and so the regressor's columns, pass the same zero-phase low-pass and decimation: the parallel
    filtering of the inverse dynamic identification model (M. Gautier, *Annual Reviews in Control*, 1997; A. Janot et
    al., *IEEE Trans. Control Systems Technology* 22, 2014).

    What nobody measures is worked out along the motion, see `vpm.identify.along`: states inside of drives, elastic
    coordinates, joints without a sensor. Of what shows of it, all that the logs hold is compared too: pressures,
    currents, strains.

    Samples at which a joint stands still do not count, as long as half of them remain: friction at rest takes whatever
    value holds the joint, which no balance can predict. Nor do those at which a piston touches an end of its stroke.

    Parameters
    ----------
    model : Model
        Names the joints and actuators; its parameters do not enter the balance.
    experiments : sequence of Experiment
        Each with the position of every joint that moves by an actuator, and the command of every actuator.
    cutoff : float or sequence of float, optional
        Cut-off frequency of the motion filter, for all or for each record, Hz; chosen from each record if not given.
    band : float or sequence of float, optional
        Highest frequency that is compared, Hz; without it what the motion filter leaves alone.
    integrator : str
        How drives with states of their own are run along the motion, as `vpm.simulate.Setup` names it.
    """

    mode = "inverse_dynamics"

    def __init__(
        self,
        model: Model,
        experiments: Sequence[Experiment],
        *,
        cutoff: float | Sequence[float] | None = None,
        band: float | Sequence[float] | None = None,
        integrator: str = AUTOMATIC,
    ) -> None:
        self.experiments = tuple(experiments)
        #: What was given: the model before any fit.
        self.nominal = model
        self.motions: tuple[Motion, ...] = tuple(
            joint_motion(e, model, one, commanded=True, band=other)
            for e, one, other in zip(experiments, _each(cutoff, experiments), _each(band, experiments), strict=True)
        )
        for m in self.motions:
            check_along(model, m.joints)
        # The parallel filter passes over whole records: where one begins and ends at rest there is nothing to settle.
        self._whole = tuple(replace(m, edge=0) for m in self.motions)
        measured = self.motions[0].joints
        moved = {joint for name in model.actuators for joint in model.joints_of_actuator(name)}
        self._joints = [place for place, joint in enumerate(measured) if joint in moved] or list(range(len(measured)))
        self.joints = tuple(measured[place] for place in self._joints)
        #: Channels beside the balance that are compared too: what shows inside of drives, strains of links.
        self.shown = shown_channels(model, measured, experiments)
        origin = {name: parameter.value for name, parameter in model.parameters.items()}
        self._memories = tuple(DriveMemory(m.parallel, integrator, origin) for m in self.motions)
        self._compared = tuple(self._measured(m, e) for m, e in zip(self.motions, self.experiments, strict=True))
        self._gains = self._hold_gains(model)
        self._kept = self._held(self.experiments, self.motions)
        self.workers = 1
        self.blocks = self._lay_out(model)

    @property
    def integrators(self) -> tuple[str, ...]:
        """How drives with states of their own are run along each record."""
        return tuple(memory.integrator for memory in self._memories)

    def take_long_steps(self) -> None:
        """Run drives by one step of second order for each sample, along the records where that shows nothing.

        A search runs them hundreds of times, and the nominal model tells once whether steps as long as a sample do: the
        band that is compared ends far below the sampling rate.
        """
        model = self.nominal
        if not has_own_drives(model):
            return
        for record, memory in enumerate(self._memories):
            known, exact = memory.integrator, self._answer(model, model.theta, record)
            memory.take(LONG_STEPS)
            try:
                rough = self._answer(model, model.theta, record)
            except DivergedError:
                rough = None
            if rough is None or not _alike(exact, rough, self._compared[record]):
                memory.take(known)

    def later(self) -> InverseDynamicsProblem:
        """The same, but for commands, each of which holds from the sample after its own on."""
        moved = tuple(replace(m, inputs=np.concatenate([m.inputs[:1], m.inputs[:-1]])) for m in self._whole)
        same = copy(self)
        # What drives answered to commands at their own times is no answer to these; what the motion needs is.
        memories = tuple(memory.under(commands=1) for memory in self._memories)
        vars(same).update(_whole=moved, _memories=memories)
        return same

    def evaluate(
        self, model: Model, theta: Array, columns: Sequence[int] = (), origin: Array | None = None
    ) -> tuple[Array, Array]:
        """Residual of the balance and its derivative; see :class:`Problem`.

        With ``origin``, values of the parameters, links bend and drives answer as on the tangent there.
        """
        residuals, jacobians = [], []
        jobs = [partial(self._answer, model, theta, record, columns, origin) for record in range(len(self.motions))]
        for measured, answer in zip(self._compared, in_order(jobs, self.workers), strict=True):
            residuals.append(np.hstack([(answer.applied - answer.required)[:, self._joints], measured - answer.seen]))
            jacobians.append(-np.concatenate([answer.balance[:, self._joints], answer.slopes], axis=1))
        return self._stack(residuals), self._stack(jacobians)

    def _hold_gains(self, model: Model) -> dict[str, float]:
        """How firmly gauges hold links, the same for all records and for all models that are compared."""
        if not bends(model):
            return {}
        names, m = self.motions[0].joints, self.motions[0]
        middle = np.array([m.position[:, names.index(j)].mean() if j in names else 0.0 for j in model.joints])
        return gauge_gains(model, self.experiments, middle)

    def _held(self, experiments: Sequence[Experiment], motions: Sequence[Motion]) -> tuple[Kept, ...]:
        return tuple(Kept(hold_of(self._gains, e, m)) for e, m in zip(experiments, motions, strict=True))

    def share(self, whole: Model, others: Sequence[tuple[Model, Sequence[str]]]) -> None:
        """Let ``others`` take how links bend from ``whole``, which moves as they do; see `vpm.identify.reuse.Kept`.

        With each goes the list of its own parameters: those that ``whole`` was not differentiated by have no influence.
        """
        for m, kept in zip(self.motions, self._kept, strict=True):
            source = parts_of(whole, m.joints)
            for model, own in others:
                target = parts_of(model, m.joints)
                if source is not None and target is not None:
                    pair = (source, whole.theta[source.places]), (target, model.theta[target.places])
                    kept.share(*pair, own)

    def share_again(self, base: Model, others: Sequence[Model]) -> bool:
        """Let ``others``, which move as ``base`` does, have its motion and the derivatives that `share` gave before.

        Returns
        -------
        bool
            Whether all of them were shared before, at values not far from these.
        """
        self.evaluate(base, base.theta)
        for m, kept in zip(self.motions, self._kept, strict=True):
            parts = [(parts_of(model, m.joints), model.theta) for model in (base, *others)]
            known = [(part, theta[part.places]) for part, theta in parts if part is not None]
            if len(known) < len(parts) or not kept.share_again(known[0], known[1:]):
                return False
        return True

    def added(self, efforts: Sequence[Array]) -> Array:
        """What efforts add to the residual, filtered and weighed as it is, shape (n, k).

        Parameters
        ----------
        efforts : sequence of ndarray, shape (N, joints, k)
            At the measured joints along each record, applied minus required; k of them side by side.
        """
        records = []
        for m, values in zip(self.motions, efforts, strict=True):
            flat = m.parallel(values.reshape(len(values), -1))
            mine = flat.reshape(len(flat), *values.shape[1:])[:, self._joints]
            others = np.zeros((len(flat), len(self.shown), values.shape[2]))
            records.append(np.concatenate([mine, others], axis=1))
        return self._stack(records)

    def effort(self, model: Model, theta: Array, record: int) -> tuple[Array, Array, Array]:
        """Time, applied and required effort (n, joints) of one record, filtered as in the residual."""
        m = self.motions[record]
        answer = self._answer(model, theta, record)
        return m.time[m.retained], answer.applied[:, self._joints], answer.required[:, self._joints]

    def _answer(
        self, model: Model, theta: Array, record: int, columns: Sequence[int] = (), origin: Array | None = None
    ) -> Response:
        """What shows along one record, filtered."""
        whole, experiment, memory = self._whole[record], self.experiments[record], self._memories[record]
        return respond(
            model, theta, whole, experiment, columns, self.shown, memory, kept=self._kept[record], origin=origin
        )

    def strength(self, model: Model) -> float:
        """Root mean square of the weighted applied effort over all records: what a relative error is relative to."""
        power, count = 0.0, 0.0
        for record in range(len(self.motions)):
            _, applied, _ = self.effort(model, model.theta, record)
            for block, column in zip(self.efforts(record), applied.T, strict=True):
                power += float(np.sum((column * block.weight * block.moving) ** 2))
                count += float(block.moving.sum())
        return float(np.sqrt(power / count))

    def standstill(self, record: int) -> float:
        """Share of the samples of one record that do not count because a joint stands still."""
        blocks = self.efforts(record)
        settled = _settled(len(blocks[0].time), self.motions[record].decimation) > 0.0
        return 1.0 - float(np.mean([block.moving[settled].mean() for block in blocks]))

    def state(self, record: int) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration (n, joints) of one record at the retained samples."""
        m = self.motions[record]
        position, velocity, acceleration = (
            x[m.retained][:, self._joints] for x in (m.position, m.velocity, m.acceleration)
        )
        return position, velocity, acceleration

    def efforts(self, record: int) -> tuple[Block, ...]:
        """Blocks of the balance of one record, one for each of `joints`."""
        first = record * (len(self.joints) + len(self.shown))
        return self.blocks[first : first + len(self.joints)]

    def _measured(self, m: Motion, experiment: Experiment) -> Array:
        """Logged channels (n, shown), filtered."""
        columns = [experiment[channel] for channel in self.shown]
        return m.parallel(np.column_stack(columns)) if columns else np.zeros((len(m.retained), 0))

    def _lay_out(self, model: Model) -> tuple[Block, ...]:
        sizes, moving = self._sizes(model)
        typical = np.sqrt(np.mean(np.square(sizes), axis=0))
        channels = (*(f"{joint}.effort" for joint in self.joints), *self.shown)
        blocks, start = [], 0
        for record, m in enumerate(self.motions):
            time = m.time[m.retained]
            for column, channel in enumerate(channels):
                weight = 1.0 if len(channels) == 1 or typical[column] == 0.0 else 1.0 / float(typical[column])
                scale, counts = float(sizes[record][column]), moving[record][:, column]
                samples = slice(start, start + time.size)
                name, unit = self.experiments[record].name, model.channel_unit(channel)
                blocks.append(Block(name, channel, unit, samples, time, scale, weight, counts))
                start += time.size
        return tuple(blocks)

    def _sizes(self, model: Model) -> tuple[list[Array], list[Array]]:
        """For each record the size of each channel, and (n, channels) which samples count.

        Efforts are as large as what the drives deliver; of other channels, such as pressures, it is the spread.
        """
        sizes, moving = [], self._moving(model)
        for record, (m, experiment) in enumerate(zip(self.motions, self.experiments, strict=True)):
            _, applied, _ = self.effort(model, model.theta, record)
            if len(applied) < FEWEST_SAMPLES:
                raise IdentificationError(
                    f"{experiment.name}: only {len(applied)} samples are left after filtering at "
                    f"{m.cutoff:.3g} Hz; record longer or pass a higher cutoff"
                )
            efforts = np.sqrt(np.average(applied**2, axis=0, weights=moving[record]))
            spread = np.std(self._compared[record], axis=0)
            sizes.append(np.concatenate([efforts, spread]))
            settled = _settled(len(applied), m.decimation)
            columns = [self._counts(model, channel, record, settled) for channel in self.shown]
            moving[record] = np.column_stack([moving[record], *columns])
        return sizes, moving

    def _counts(self, model: Model, channel: str, record: int, settled: Array) -> Array:
        """Which samples of a shown channel count: those of a drive not while its joint rests.

        What a shut valve encloses drifts with the smallest leak, and whatever load dry friction takes up does not show.
        """
        owner = channel.rpartition(".")[0]
        if owner not in model.actuators:
            return settled
        joints = [self.joints.index(joint) for joint in model.joints_of_actuator(owner) if joint in self.joints]
        counts: Array = settled * np.prod(self._busy(record)[:, joints], axis=1)
        return counts

    def _busy(self, record: int) -> Array:
        """(n, joints): 0 where a joint is slow in the mean over ``REST_TIME``: noise must not pass for motion."""
        speeds = [np.abs(each.velocity[each.kept][:, self._joints]) for each in self.motions]
        largest = np.max([np.quantile(speed, 0.999, axis=0) for speed in speeds], axis=0)
        m = self.motions[record]
        width = max(1, round(REST_TIME / m.dt))
        mean = np.abs(uniform_filter1d(m.velocity[:, self._joints], width, axis=0))
        moving = maximum_filter1d(mean, width, axis=0) > REST_SHARE * largest
        busy = moving[m.retained].astype(np.float64)
        return busy if busy.mean() >= 0.5 else np.ones_like(busy)

    def _moving(self, model: Model) -> list[Array]:
        """For each record (n, joints): 1 where a joint moves, 0 where it stands still; all 1 if it mostly stands.

        Zero too where the parallel filter settles, and where a piston that moves it touches an end of its stroke.
        """
        speeds = [np.abs(m.velocity[:, self._joints]) for m in self.motions]
        kept = [speed[m.kept] for speed, m in zip(speeds, self.motions, strict=True)]
        largest = np.max([np.quantile(speed, 0.999, axis=0) for speed in kept], axis=0)
        masks = [
            ~_widened(_standing(speed, STANDSTILL_SHARE * largest, _period(m) // (2 if bends(model) else 1)), m)[
                m.retained
            ]
            for m, speed in zip(self.motions, speeds, strict=True)
        ]
        moves = np.mean(np.vstack(masks), axis=0) >= LEAST_MOVING
        free = [self._free(model, record) for record in range(len(masks))]
        return [
            (np.where(moves, mask, True) & away) * _settled(len(mask), m.decimation)[:, None]
            for mask, away, m in zip(masks, free, self.motions, strict=True)
        ]

    def _free(self, model: Model, record: int) -> NDArray[np.bool_]:
        """Where (n, joints) no piston of one record touches an end, as far as the filters carry the touch."""
        m, experiment = self.motions[record], self.experiments[record]
        away = np.ones((len(m.retained), len(self.joints)), dtype=np.bool_)
        for name, touching in at_stops(model, experiment, m).items():
            # An impact rings, in the oil and in the filters: three times as long as the ends of the record settle.
            near = maximum_filter1d(touching.view(np.uint8), 6 * m.edge + 1)[m.retained] > 0
            for column, joint in enumerate(self.joints):
                if near.any() and joint in model.joints_of_actuator(name):
                    away[:, column] &= ~near
                    check_left(experiment, joint, name, int(away[:, column].sum()), FEWEST_SAMPLES)
        return away

    def _stack(self, records: list[Array]) -> Array:
        """Concatenate (n, channels, ...) arrays block by block and apply the weights."""
        columns = [record[:, c] for record in records for c in range(record.shape[1])]
        scaled = zip(columns, self.blocks, strict=True)
        return np.concatenate([(x.T * (block.weight * block.moving)).T for x, block in scaled])


def _alike(exact: Response, rough: Response, measured: Array) -> bool:
    """Whether what drives answer differs by less than `ROUGH` of its size, or of what was measured in its place.

    Where something is missing the one may be many times the other, and it is the measured one that is to be explained.
    """
    triples = [(exact.applied, rough.applied, exact.applied), (exact.seen, rough.seen, measured)]
    for one, other, log in triples:
        size = np.maximum(np.linalg.norm(one, axis=0), np.linalg.norm(log, axis=0))
        if np.any(np.linalg.norm(one - other, axis=0) > ROUGH * size):
            return False
    return True


def _each(value: float | Sequence[float] | None, records: Sequence[Experiment]) -> Sequence[float | None]:
    """One value for each record."""
    return [value] * len(records) if value is None or isinstance(value, int | float) else value


def _settled(samples: int, decimation: int) -> Array:
    """1 for retained samples behind and ahead of which the parallel filter has all that it needs, else 0.

    A short record loses no more than a fifth at each end: what little there is has to do.
    """
    ends = min(SETTLING, samples // 5) if decimation > 1 else 0
    place = np.arange(samples)
    return ((place >= ends) & (place < samples - ends)).astype(np.float64)


def _period(m: Motion) -> int:
    """Samples in which the motion filter tells a stop from a reversal, no more than the parallel filter keeps apart."""
    return min(m.decimation, max(1, round(1.0 / (m.cutoff * m.dt))))


def _standing(speed: Array, limit: Array, samples: int) -> NDArray[np.bool_]:
    """Where all speeds within ``samples`` to both sides are below the limit."""
    return np.asarray(maximum_filter1d(speed, 2 * samples + 1, axis=0) < limit)


def _widened(standing: NDArray[np.bool_], m: Motion) -> NDArray[np.bool_]:
    """Standstill with its surroundings, into which the filters carry what happens in it."""
    reach = m.decimation + max(m.decimation, round(1.0 / (m.cutoff * m.dt)))
    return np.asarray(maximum_filter1d(standing.view(np.uint8), 2 * reach + 1, axis=0).astype(np.bool_))


class OutputErrorProblem:
    """Measured minus simulated outputs in free run, restarts, closed loop or on a prescribed motion.

    Parameters
    ----------
    model : Model
    experiments : sequence of Experiment
    mode : {"free_run", "restarts", "closed_loop", "prescribed_motion"}
    channels : sequence of str, optional
        Compared outputs; by default all measured ones that the simulation does not prescribe.
    setup : Setup, optional
        Integrator, substeps and horizon.
    cutoff : float, optional
        Of the motion that the joints follow, Hz.
    workers : int
        Records that are simulated at a time; the residual does not depend on it.
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
    ) -> None:
        self.mode = mode
        self.workers = workers
        self.experiments = tuple(experiments)
        self._setup = setup or Setup()
        follows = mode == "prescribed_motion"
        self._followed = [joint_motion(e, model, cutoff) if follows else None for e in self.experiments]
        self._channels = compared_channels(model, experiments, mode, channels)
        self.blocks = self._lay_out(model)

    @property
    def setup(self) -> Setup:
        """Integrator, substeps and horizon."""
        return self._setup

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Residual of the outputs and its derivative; see :class:`Problem`."""
        residuals, jacobians = [], []
        index = [model.output_channels.index(channel) for channel in self._channels]
        blocks = iter(self.blocks)
        jobs = [
            partial(self._simulated, model, e, theta, list(columns), followed)
            for e, followed in zip(self.experiments, self._followed, strict=True)
        ]
        results = in_order(jobs, self.workers)
        for experiment, result in zip(self.experiments, results, strict=True):
            for column, channel in zip(index, self._channels, strict=True):
                block = next(blocks)
                weight = block.weight * block.moving
                residuals.append((experiment[channel][result.rows] - result.outputs[:, column]) * weight)
                jacobians.append(-result.jacobian[:, column, :] * weight[:, None])
        return np.concatenate(residuals), np.concatenate(jacobians)

    def _simulated(
        self, model: Model, experiment: Experiment, theta: Array, columns: list[int], followed: Motion | None
    ) -> SimulatedArrays:
        """Simulation of one record; its derivative knows what parameters do to the first state of a whole record."""
        run = partial(simulate_arrays, model, experiment, self.mode, theta=theta, setup=self._setup)
        if not columns or self.mode not in WHOLE:
            return run(columns=columns, followed=followed)
        state = initial_state(model, experiment, theta)
        result = run(columns=columns, initial_state=state)
        slopes = first_state_slopes(partial(initial_state, model, experiment), theta, columns)
        add_first_state(result.jacobian, lambda x: run(initial_state=x).outputs, state, slopes, theta[columns])
        return result

    def _lay_out(self, model: Model) -> tuple[Block, ...]:
        blocks, start = [], 0
        counted = [self._counted(experiment) for experiment in self.experiments]
        parts = list(zip(self.experiments, counted, strict=True))
        spread = {c: float(np.sqrt(np.mean([np.var(e[c][n]) for e, n in parts]))) for c in self._channels}
        for (experiment, counts), followed in zip(parts, self._followed, strict=True):
            rows = simulate_arrays(model, experiment, self.mode, setup=self._setup, followed=followed).rows
            moving = counts[rows].astype(np.float64)
            for channel in self._channels:
                weight = 1.0 / spread[channel] if spread[channel] > 0.0 else 1.0
                scale = float(np.sqrt(np.mean(experiment[channel][counts] ** 2)))
                samples = slice(start, start + rows.size)
                unit = model.channel_unit(channel)
                blocks.append(
                    Block(experiment.name, channel, unit, samples, experiment.time[rows], scale, weight, moving)
                )
                start += rows.size
        return tuple(blocks)

    def _counted(self, experiment: Experiment) -> NDArray[np.bool_]:
        """Samples that count: not those while the first state settles."""
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
    """Outputs that are compared: those given, or all that every log holds and the mode does not copy from it.

    Raises
    ------
    IdentificationError
        There is none, or one is not in the model or a log.
    """
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
    """Complain about compared channels that the model does not give or a log does not hold."""
    for channel in channels:
        if channel not in model.output_channels:
            repair = near_match(channel, model.output_channels)
            raise IdentificationError(f'channels: {model.name} has no output "{channel}"; {repair}')
        for experiment in experiments:
            if channel not in experiment:
                raise IdentificationError(
                    f'channels: "{channel}" is not in {experiment.name}, which holds {", ".join(experiment.channels)}; '
                    "leave it out"
                )
