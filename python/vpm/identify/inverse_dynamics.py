"""The inverse-dynamics residual along measured motions, joint by joint."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial
from typing import Self

import numpy as np

from vpm.errors import DivergedError, IdentificationError
from vpm.experiment import Experiment, Motion
from vpm.identify.first_states import BegunAnywhere
from vpm.identify.following import Built, Following, Memo, gauge_gains, hold_of
from vpm.identify.parallel import in_order
from vpm.identify.parts import Bending
from vpm.identify.problem import FEWEST_SAMPLES, Block
from vpm.identify.response_along_motion import (
    Response,
    answers_at_once,
    bending_of,
    bends,
    check_along,
    guided,
    has_own_drives,
    read_where_bent,
    respond,
    shown_channels,
)
from vpm.identify.sample_mask import SampleMask, settled
from vpm.initial import joint_motion
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import AUTOMATIC
from vpm.simulate.setup import HOLDS

#: One step of second order for each sample, and the share of what drives answer that it may be off by: noise of
#: pressures and currents is ten times as large on the best of logs.
LONG_STEPS, ROUGH = "linearly_implicit", 1e-3


class InverseDynamicsProblem(BegunAnywhere):
    """Inverse-dynamics residual at each joint: what the actuators deliver minus what the measured motion needs.

    Both sides, and so the regressor's columns, pass the same zero-phase low-pass and decimation: the parallel
    filtering of the inverse dynamic identification model (M. Gautier, *Annual Reviews in Control*, 1997; A. Janot et
    al., *IEEE Trans. Control Systems Technology* 22, 2014).

    What nobody measures is worked out along the motion, see `vpm.identify.response_along_motion`: states inside of
    drives, elastic coordinates, joints without a sensor. Of what shows of it, all that the logs hold is compared too:
    pressures, currents, strains.

    Samples at which a joint stands still do not count, as long as half of them remain: friction at rest takes whatever
    value holds the joint, which nothing here can predict. Nor do those at which a piston touches an end of its stroke.

    - ``model``: names the joints and actuators; its parameters do not enter the residual
    - ``experiments``: each with the position of every joint that moves by an actuator, and the command of every
      actuator
    - ``cutoff``: cut-off frequency of the motion filter, for all or for each record, Hz; chosen from each record if not
      given
    - ``band``: highest frequency that is compared, Hz; without it what the motion filter leaves alone
    - ``integrator``: how drives with states of their own are run along the motion, as `vpm.simulate.Setup` names it
    - ``hold``: what inputs do between samples, as the same names it
    - ``first``: values and places of parameters at which derivatives are asked for first; sizes come with them
    - ``built``: parts of the model that problems on other records share with this one
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
        hold: str = HOLDS[0],
        first: tuple[Array, Sequence[int]] | None = None,
        built: Built | None = None,
    ) -> None:
        self._built = built
        self.experiments = tuple(experiments)
        #: What was given: the model before any fit.
        self.nominal = model
        self.hold = hold
        self._bands = tuple(_each(band, experiments))
        self.motions = self._motions(experiments, _each(cutoff, experiments))
        for m in self.motions:
            check_along(model, m.joints)
        # The parallel filter passes over whole records: where one begins and ends at rest there is nothing to settle.
        self._whole = tuple(replace(m, edge=0) for m in self.motions)
        measured = self.motions[0].joints
        told = self._shown_joints(model)
        self._joints = [place for place, joint in enumerate(measured) if joint in told] or list(range(len(measured)))
        self.joints = tuple(measured[place] for place in self._joints)
        #: Channels beside the efforts that are compared too: what shows inside of drives, strains of links.
        self.shown = shown_channels(model, measured, experiments)
        self._compared = tuple(self._measured(m, e) for m, e in zip(self.motions, self.experiments, strict=True))
        self._gains = self._hold_gains(model)
        self._known = self._held(self.experiments, self.motions, [integrator] * len(self.motions), None)
        self.workers = 1
        if first is not None and not answers_at_once(model):
            for record in range(len(self.motions)):
                self._answer(model, first[0], record, first[1])
        self.blocks = self._lay_out(model)
        #: What is left at the true values, as far as that is known; see `vpm.identify.closed_loop_prediction`.
        self.expected: Array | float = 0.0

    def _shown_joints(self, model: Model) -> Collection[str]:
        """Joints at which inverse dynamics compares efforts: driven ones, or all that are measured without a drive."""
        return model.driven_joints

    def _motions(self, experiments: Sequence[Experiment], cutoffs: Sequence[float | None]) -> tuple[Motion, ...]:
        return tuple(
            joint_motion(e, self.nominal, cutoff, commanded=True, band=band).held_as(self.hold)
            for e, cutoff, band in zip(experiments, cutoffs, self._bands, strict=True)
        )

    def on(self, experiments: Sequence[Experiment]) -> InverseDynamicsProblem:
        """Inverse-dynamics problem on other records of the same lengths, filtered and weighed alike."""
        motions = self._motions(experiments, [m.cutoff for m in self.motions])
        pairs = list(zip(motions, experiments, strict=True))
        return self.changed(
            experiments=tuple(experiments),
            motions=motions,
            expected=0.0,
            _whole=tuple(replace(m, edge=0) for m in motions),
            _compared=tuple(self._measured(m, e) for m, e in pairs),
            _known=self._held(experiments, motions, self.integrators, self.departures),
        )

    def less(self, expected: Array) -> InverseDynamicsProblem:
        """Inverse-dynamics problem less the residual ``expected`` at the true values, shape (n,)."""
        return self.changed(expected=expected)

    def side_by_side(self, workers: int) -> InverseDynamicsProblem:
        """Inverse-dynamics problem computed by ``workers`` threads, a record each."""
        return self.changed(workers=workers)

    @property
    def integrators(self) -> tuple[str, ...]:
        """Integrators of drives with states along each record, for inverse dynamics."""
        return tuple(known.integrator for known in self._known)

    def take_long_steps(self) -> None:
        """Run drives of inverse dynamics by one second-order step for each sample, where that is exact enough.

        A search runs them hundreds of times, and the nominal model tells once whether steps as long as a sample do: the
        band that is compared ends far below the sampling rate.
        """
        model = self.nominal
        if not has_own_drives(model):
            return
        for record, known in enumerate(self._known):
            exact, quick = self._answer(model, model.theta, record), replace(known, integrator=LONG_STEPS)
            try:
                rough = self._answer(model, model.theta, record, known=quick)
            except DivergedError:
                continue
            if _alike(exact, rough, self._compared[record]):
                self._known = (*self._known[:record], quick, *self._known[record + 1 :])

    def later(self) -> InverseDynamicsProblem:
        """Inverse-dynamics problem with commands one sample later."""
        moved = tuple(replace(m, inputs=np.concatenate([m.inputs[:1], m.inputs[:-1]])) for m in self._whole)
        # What drives answered to commands at their own times is no answer to these; what the motion needs is.
        return self.changed(_whole=moved, _known=tuple(replace(known, commands=1) for known in self._known))

    def evaluate(
        self, model: Model, theta: Array, columns: Sequence[int] = (), origin: Array | None = None
    ) -> tuple[Array, Array]:
        """Inverse-dynamics residual and its derivative; see :class:`Problem`.

        With ``origin``, values of the parameters, links bend and drives answer as on the tangent there.
        """
        residuals, jacobians = [], []
        jobs = [partial(self._answer, model, theta, record, columns, origin) for record in range(len(self.motions))]
        for measured, answer in zip(self._compared, in_order(jobs, self.workers), strict=True):
            residuals.append(np.hstack([(answer.applied - answer.required)[:, self._joints], measured - answer.seen]))
            jacobians.append(-np.concatenate([answer.balance[:, self._joints], answer.slopes], axis=1))
        return self._left(self._stack(residuals)) - self.expected, self._left(self._stack(jacobians))

    def _hold_gains(self, model: Model) -> dict[str, float]:
        """Gauge gains that hold links in inverse dynamics, the same for all compared models."""
        if not bends(model):
            return {}
        names, m = self.motions[0].joints, self.motions[0]
        middle = np.array([m.position[:, names.index(j)].mean() if j in names else 0.0 for j in model.joints])
        return gauge_gains(model, self.experiments, middle)

    def _held(
        self,
        experiments: Sequence[Experiment],
        motions: Sequence[Motion],
        integrators: Sequence[str],
        departures: Array | None,
    ) -> tuple[Following, ...]:
        begun = [None] * len(motions) if departures is None else departures
        memo, parts = Memo(self._built), zip(motions, experiments, integrators, begun, strict=True)
        return tuple(
            Following(m.parallel, steps, 0, hold_of(self._gains, e, m), departure, record, memo)
            for record, (m, e, steps, departure) in enumerate(parts)
        )

    def begun(self, departures: Array | None) -> Self:
        """Inverse-dynamics problem with other first states, coordinates, then rates; see :class:`BegunAnywhere`."""
        known = self._held(self.experiments, self.motions, self.integrators, departures)
        return super().begun(departures).changed(_known=known)

    def open_states(self, model: Model) -> tuple[Array, int]:
        """Sizes of unknown first states of inverse dynamics: unmeasured joints, links without gauges."""
        coordinates, joints = len(model.coordinates), self.motions[0].joints
        free = np.array([joint not in joints for joint in model.joints] + [not self._gains] * model.core.n_elastic)
        sizes = np.zeros(2 * coordinates)
        if np.any(free):
            for record in range(len(self.motions)):
                sizes = np.maximum(sizes, np.std(self.hidden_states(model, record), axis=0))
            sizes = np.where(np.tile(free, 2), np.where(sizes > 0.0, sizes, 1.0), 0.0)
        return sizes, len(self.motions)

    def hidden_states(self, model: Model, record: int) -> Array:
        """States of unmeasured motion in inverse dynamics, coordinates, then rates, along one record."""
        return guided(model, model.theta, self._whole[record], (), self._known[record])[1]

    def bending(self, model: Model) -> Bending | None:
        """Split of inverse dynamics into parts that bend or fly; see `vpm.identify.parts.bending`."""
        return bending_of(model, self.motions[0].joints, self._known[0])

    def share(self, whole: Model, others: Sequence[tuple[Model, Sequence[str]]]) -> None:
        """Let ``others`` in inverse dynamics have how links bend from ``whole``, which moves alike.

        With each goes the list of its own parameters: those that ``whole`` was not differentiated by have no influence.
        """
        read = read_where_bent(self.motions[0].joints, self.shown)
        if (source := self.bending(whole)) is None:
            return
        targets = [(target.bare, model.theta, own) for model, own in others if (target := self.bending(model))]
        for known in self._known:
            known.share((source.bare, whole.theta), targets, read)

    def added(self, efforts: Sequence[Array]) -> Array:
        """Part of the inverse-dynamics residual (n, k) that given efforts add.

        ``efforts``: each of shape (N, joints, k), at the measured joints along each record, applied minus required; k
        of them side by side.
        """
        records = []
        for m, values in zip(self.motions, efforts, strict=True):
            flat = m.parallel(values.reshape(len(values), -1))
            mine = flat.reshape(len(flat), *values.shape[1:])[:, self._joints]
            others = np.zeros((len(flat), len(self.shown), values.shape[2]))
            records.append(np.concatenate([mine, others], axis=1))
        return self._stack(records)

    def effort(self, model: Model, theta: Array, record: int) -> tuple[Array, Array, Array]:
        """Time, applied and required effort (n, joints) of one record, as inverse dynamics filters them."""
        m = self.motions[record]
        answer = self._answer(model, theta, record)
        return m.time[m.retained], answer.applied[:, self._joints], answer.required[:, self._joints]

    def _answer(
        self,
        model: Model,
        theta: Array,
        record: int,
        columns: Sequence[int] = (),
        origin: Array | None = None,
        known: Following | None = None,
    ) -> Response:
        """Filtered efforts and outputs of inverse dynamics along one record; see `Response`."""
        whole, experiment, known = self._whole[record], self.experiments[record], known or self._known[record]
        return respond(model, theta, whole, experiment, columns, self.shown, known, origin)

    def strengths(self, model: Model, theta: Array | None = None) -> Array:
        """Root mean square of the applied effort on each joint, the scale of inverse-dynamics errors."""
        theta = model.theta if theta is None else theta
        power, count = np.zeros(len(self.joints)), np.zeros(len(self.joints))
        for record in range(len(self.motions)):
            _, applied, _ = self.effort(model, theta, record)
            for joint, (block, column) in enumerate(zip(self.efforts(record), applied.T, strict=True)):
                power[joint] += float(np.sum((column * block.moving) ** 2))
                count[joint] += float(block.moving.sum())
        return np.asarray(np.sqrt(power / np.maximum(count, 1.0)))

    def standstill(self, record: int) -> float:
        """Share of one record's samples outside of inverse dynamics because a joint stands still."""
        blocks = self.efforts(record)
        away = settled(len(blocks[0].time), self.motions[record].decimation) > 0.0
        return 1.0 - float(np.mean([block.moving[away].mean() for block in blocks]))

    def state(self, record: int) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration (n, joints) of one record in inverse dynamics."""
        m = self.motions[record]
        position, velocity, acceleration = (
            x[m.retained][:, self._joints] for x in (m.position, m.velocity, m.acceleration)
        )
        return position, velocity, acceleration

    def efforts(self, record: int) -> tuple[Block, ...]:
        """Effort blocks of one record in inverse dynamics, one for each of `joints`."""
        first = record * (len(self.joints) + len(self.shown))
        return self.blocks[first : first + len(self.joints)]

    def _measured(self, m: Motion, experiment: Experiment) -> Array:
        """Logged channels (n, shown) beside inverse dynamics, filtered."""
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
        """Size of each inverse-dynamics channel by record, and the samples (n, channels) that count.

        Efforts are as large as what the drives deliver, and of a joint that coasts as what its inertia takes; of other
        channels, such as pressures, it is the spread.
        """
        mask = SampleMask(self.experiments, self.motions, self.joints, self._joints)
        sizes, moving = [], mask.moving(model)
        for record, (m, experiment) in enumerate(zip(self.motions, self.experiments, strict=True)):
            _, applied, _ = self.effort(model, model.theta, record)
            if len(applied) < FEWEST_SAMPLES:
                raise IdentificationError(
                    f"{experiment.name}: only {len(applied)} samples are left after filtering at "
                    f"{m.cutoff:.3g} Hz; record longer or pass a higher cutoff"
                )
            # Of a joint that rests all the time, and may stick, no sample counts.
            counts = np.maximum(np.sum(moving[record], axis=0), 1.0)
            efforts = np.sqrt(np.sum(applied**2 * moving[record], axis=0) / counts)
            if not efforts.all():
                efforts = np.where(efforts > 0.0, efforts, self._inertial(model, record))
            spread = np.std(self._compared[record], axis=0)
            sizes.append(np.concatenate([efforts, spread]))
            ends = settled(len(applied), m.decimation)
            columns = [mask.of_channel(model, channel, record, ends) for channel in self.shown]
            moving[record] = np.column_stack([moving[record], *columns])
        return sizes, moving

    def _inertial(self, model: Model, record: int) -> Array:
        """Root mean square effort of the inertia at each joint alone, for inverse dynamics."""
        places = [model.joints.index(joint) for joint in self.joints]
        return np.asarray(model.masses_at_zero[places] * np.sqrt(np.mean(self.state(record)[2] ** 2, axis=0)))

    def _stack(self, records: list[Array]) -> Array:
        """Stacked inverse-dynamics blocks (n, channels, ...) with their weights."""
        columns = [record[:, c] for record in records for c in range(record.shape[1])]
        scaled = zip(columns, self.blocks, strict=True)
        return np.concatenate([(x.T * (block.weight * block.moving)).T for x, block in scaled])


def _alike(exact: Response, rough: Response, measured: Array) -> bool:
    """Whether two drive answers in inverse dynamics differ by less than `ROUGH` of their size.

    Where something is missing the one may be many times the other, and it is the measured one that is to be explained.
    """
    triples = [(exact.applied, rough.applied, exact.applied), (exact.seen, rough.seen, measured)]
    for one, other, log in triples:
        size = np.maximum(np.linalg.norm(one, axis=0), np.linalg.norm(log, axis=0))
        if np.any(np.linalg.norm(one - other, axis=0) > ROUGH * size):
            return False
    return True


def _each(value: float | Sequence[float] | None, records: Sequence[Experiment]) -> Sequence[float | None]:
    """One number of inverse dynamics for each record, such as a cut-off (Hz); a single one stands for all."""
    return [value] * len(records) if value is None or isinstance(value, int | float) else value
