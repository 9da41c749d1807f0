"""Error of a model on a record, as a share of the error of masses without forces."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue import EFFECTS
from vpm.catalogue.effects import BUILT_IN
from vpm.experiment import Experiment
from vpm.identify import InverseDynamicsProblem
from vpm.identify.following import Built
from vpm.identify.response_along_motion import bends, has_own_drives
from vpm.initial import areas_of_chambers, initial_state
from vpm.log_check.correction import Correction
from vpm.log_check.delay import Delayed, with_delay, without_delay
from vpm.log_check.falling import fall_rate
from vpm.log_check.related import left_of_velocities
from vpm.log_check.settings import Settings
from vpm.model import Model
from vpm.numbers import Array
from vpm.observer import measured_outputs
from vpm.ranking.fit import ASTRAY, Fitter, Followed, View
from vpm.ranking.model_structure import Structure
from vpm.ranking.noise_model import white_noise
from vpm.ranking.parameter_priors import stated
from vpm.ranking.regression import regressed
from vpm.ranking.settings import Settings as RankingSettings
from vpm.ranking.substitute_records import why_unbalanced
from vpm.ranking.tracked_records import TrackedRecords, Tracker, is_position
from vpm.simulate import Setup
from vpm.weighing.priors import Prior, natural_sizes

#: Friction that a joint may have without being described: nothing of it passes for a mistake of a log.
FRICTION = tuple(effect.name for effect in BUILT_IN if effect.usual == "friction")
#: Nor do these, unless a sign is in doubt: where a machine is heavy, a constant force is its mirror image.
FORCES = tuple(effect.name for effect in BUILT_IN if effect.usual)
#: Speed at which dry friction turns round, as a share of the usual speed of the joint.
TRANSITION = 0.02
#: How often derivatives are worked out in a fit of all forces.
TURNS = 2
#: Pieces of a record between whose ends speeds are measured, which noise hardly moves.
PIECES = 200
#: Tracked records that are kept: a few per core.
KEPT = 16


@dataclass(frozen=True, eq=False)
class Shares:
    """What is left of each channel, between 0 and 1: a model that leaves more than no model is not used.

    A share does not depend on the scale of its channel, so that records in other units can be compared by it.
    """

    by_channel: Mapping[str, float]
    values: Array  #: Parameters by which it was found.
    #: Shape (N, m); what is left of the channels; None where the model runs away from the record.
    residual: Array | None = None
    #: Shape (m,); what free masses leave of each channel, as a sum of squares.
    free: Array = field(default_factory=lambda: np.ones(1))
    seen: NDArray[np.intp] = field(default_factory=lambda: np.arange(0))  #: Samples that count.
    far: float = 0.0  #: By how many of its stated deviations a parameter of the model was moved, the farthest one.
    farthest: str = ""  #: Its name.
    #: How unlikely the model file makes its parameters, as half the sum of the squares of these deviations (nats).
    unlikely: float = 0.0
    chance: float = 1.0  #: Of deviations as large as these.
    floor: float = 0.0  #: Shares below this are as good as nothing.
    #: Inverse-dynamics residual of the effort at each position, and of strains along the motion; none where drives have
    #: states of their own. Of a velocity what the derivative of its position leaves.
    efforts: Mapping[str, float] = field(default_factory=dict)
    #: Where drives have states, such a residual at the values of the model, by each pressure of a chamber: as a share
    #: of what that adds to the effort, or of the whole where that is less. A wrong unit leaves a quarter at least.
    pressures: Mapping[str, float] = field(default_factory=dict)

    @property
    def cost(self) -> float:
        """Sum of the logarithms of the shares, but for what is negligible: each channel has a scale of its own."""
        return sum(math.log(max(share, self.floor)) for share in self.by_channel.values())

    def told(self, channel: str) -> float:
        """What is left of the efforts that tell of a channel; 1 where none do.

        A velocity is as good as the position of which it is the derivative.
        """
        joint, _, kind = channel.rpartition(".")
        names = (channel, f"{joint}.position") if kind == "velocity" else (channel,)
        return max(self.efforts.get(name, self.pressures.get(name, 1.0)) for name in names)

    def unexplained(self, channel: str) -> float:
        """What is left of a channel by its motion and by the efforts that tell of it, whichever is less."""
        return min(self.by_channel.get(channel, 1.0), self.told(channel))

    def logarithm(self, channels: Iterable[str]) -> float:
        """Mean of the logarithms of the shares of some channels."""
        return mean_logarithm(self.by_channel, channels)

    def above(self, share: float) -> set[str]:
        """Channels of which more than a share is left."""
        return {name for name, left in self.by_channel.items() if left > share}

    @property
    def order(self) -> tuple[float, float]:
        """Sort key of several shares: what leaves least comes first."""
        return self.cost, self.logarithm(self.by_channel)


@dataclass(frozen=True, eq=False)
class _Regressed:
    """Values that leave least of the inverse-dynamics residual of a record."""

    values: Array
    #: What they leave of efforts, see `Shares.efforts`; nothing where links or drives diverge along the motion.
    left: Mapping[str, float]


class _Numbers:
    """A record that is equal to another one of the same numbers."""

    def __init__(self, record: Experiment) -> None:
        self.record = record
        #: Digest of the numbers, in place of the record.
        self.key = blake2b(repr(record.channels).encode() + record.time.tobytes() + record.data.tobytes()).digest()

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Numbers) and self.key == other.key


class Judge:
    """Measures records by a model, to which friction and other forces were added at each joint without them.

    A tracker of stated bandwidth keeps the model on the record, see `vpm.ranking.tracked_records.TrackedRecords`.
    """

    def __init__(self, model: Model, settings: Settings, setup: Setup, records: Sequence[Experiment] = ()) -> None:
        self.settings, self.setup = settings, setup
        #: Bandwidth of the tracker, Hz: faster than the machine falls over anywhere in its records.
        self.band = max([settings.band, *(settings.firm * fall_rate(model, record) for record in records)])
        present = {(effect.name, effect.at) for effect in model.effects}
        joints = [name for name in model.joints if name not in model.added_joints]
        self.added = tuple((name, at) for at in joints for name in FORCES if (name, at) not in present)
        for name, at in self.added:
            model = model.with_effect(name, at)
        self.model = model
        self._built: Built = OrderedDict()
        #: One record is tracked with several values in a row.
        self._tracked_of = lru_cache(KEPT)(lambda one: self._tracked_anew(one.record))
        #: By the digest of their records: a correction is tried, and then fitted.
        self._near: dict[bytes, _Regressed | None] = {}

    def measured(self, record: Experiment, values: Array | None = None) -> Shares:
        """Shares at given values of the parameters, by default those of the model, without friction that was added."""
        tracker, values = self._tracker(record), self.model.theta if values is None else values
        try:
            tracked = self._tracked(record)
            residual, _ = tracked.follow(self.model, values, tracker)
        except ASTRAY:
            return self._lost(record, values)
        return self._shares(tracked, residual, tracker, values)

    def efforts_left(self, record: Experiment, channels: Collection[str]) -> Mapping[str, float]:
        """What is left of the effort at each position, and of velocities among channels; see `Shares.efforts`."""
        near = None if has_own_drives(self.model) else self._regressed(record)
        return self._told(record, near, channels)

    def _told(self, record: Experiment, near: _Regressed | None, channels: Collection[str]) -> dict[str, float]:
        """What is left of efforts, and of velocities beside the derivative of their positions; see `Shares.efforts`.

        Behind measured pressures of drives with states nobody knows of commands, of which efforts tell too.
        """
        told = left_of_velocities(record, channels)
        return told if near is None or has_own_drives(self.model) else {**told, **near.left}

    def efforts_read(self, record: Experiment) -> Mapping[str, float]:
        """Such a residual also where drives have states, if the pressures of both chambers tell what they give."""
        near = self._regressed(record) if self._tells_efforts(record) else None
        return {} if near is None else {name: left for name, left in near.left.items() if name.endswith(".position")}

    def pressures_read(self, record: Experiment) -> Mapping[str, float]:
        """Inverse-dynamics residual at the values of the model, by pressure; see `Shares.pressures`."""
        drives = [name for name in self.model.actuators if not self.model.follows_command(name)]
        if not drives or not self._tells_efforts(record) or why_unbalanced(self.model, [record]):
            return {}
        try:
            problem = InverseDynamicsProblem(self.model, [record], built=self._built)
            left = _left_of_efforts(problem, self.model, self.model.theta)
        except ASTRAY:
            return {}
        found, theta = dict[str, float](), self.model.theta
        for name in drives:
            most = max((left.get(f"{one}.position", 1.0) for one in self.model.joints_of_actuator(name)), default=1.0)
            areas = zip("ab", areas_of_chambers(self.model, theta, name), strict=True)
            first, second = (area * record[f"{name}.pressure_{side}"] for side, area in areas)
            power = float(np.var(first - second))
            for side, force in (("a", first), ("b", second)):
                found[f"{name}.pressure_{side}"] = _share(most * power, min(power, float(np.var(force))))
        return found

    def _tells_efforts(self, record: Experiment) -> bool:
        """Whether a record tells what drives give: by commands alone, or by the pressures of both chambers."""
        with_states = [name for name in self.model.actuators if not self.model.follows_command(name)]
        pressures = {f"{name}.pressure_{side}" for name in with_states for side in "ab"}
        return not bends(self.model) and pressures <= {*record.channels}

    def guessed(self, record: Experiment) -> Shares:
        """Shares where a fit would begin, whichever leaves least: at the values of the model, with friction or without.

        Dry friction is as large as is usual, or all is as the inverse-dynamics residual has it.
        """
        plain, dry = self.measured(record), [key for key in self.added if EFFECTS[key[0]].sticks]
        if not dry:
            return plain
        structure = self._structure(record)
        values = structure.theta.copy()
        for key in dry:
            parameter = self.model.effect(*key).parameter_names["coulomb"]
            values[self.model.index(parameter)] = structure.priors[parameter].spread
        tried = [plain, self.measured(record, values)]
        if self._is_lost(plain) and (near := self._regressed(record)) is not None:
            tried.append(self.measured(record, near.values))
        return min(tried, key=lambda shares: shares.order)

    def fitted(self, record: Experiment) -> Shares:
        """Shares when the uncertain parameters of the model, and friction of its joints, have been fitted.

        What a slow tracker leaves is not linear in a friction that is missing: where the model as it is does not follow
        the record, another fit begins where the inverse-dynamics residual is least.
        """
        structure, plain = self._structure(record), self.measured(record)
        starts, is_lost = [(structure, plain)], self._is_lost(plain)
        near = self._regressed(record) if is_lost or not has_own_drives(self.model) else None
        pressures = self.pressures_read(record)
        if near is not None and is_lost:
            there = self.measured(record, near.values)
            there = replace(there, efforts=self._told(record, near, there.by_channel), pressures=pressures)
            if self.falls(there):
                return there
            starts.append((replace(structure, theta=near.values), there))
        found = [self._fitted(record, *start) or plain for start in starts]
        best = min(found, key=lambda shares: shares.order)
        return replace(best, efforts=self._told(record, near, best.by_channel), pressures=pressures)

    def fitted_from(self, record: Experiment, known: Array, left: Shares) -> Shares:
        """Shares at values that are ``known`` from another record, or when a fit from there has ended.

        What is ``left`` of the efforts goes by the record alone.
        """
        structure, own = self._structure(record), len(self.model.theta)
        values = np.append(known[:own], structure.theta[own:])
        start = self.measured(record, values)
        found = self._fitted(record, replace(structure, theta=values), start)
        best = start if found is None else min(start, found, key=lambda shares: shares.order)
        return replace(best, efforts=left.efforts, pressures=left.pressures)

    def _fitted(self, record: Experiment, structure: Structure, start: Shares) -> Shares | None:
        """Shares where a fit ends that begins at the values of a structure and its shares; None if it runs away."""
        if start.residual is None:
            return None
        tracker, tracked = self._tracker(record), self._tracked(record)
        noise = white_noise(start.residual, tracked.parts)
        try:
            fitter = Fitter(tracked, tracked.settings)
            found = fitter.fitted(structure, tracker, View(noise))
        except ASTRAY:
            return None
        shares = self._shares(tracked, found.residual, tracker, found.structure.theta)
        return self._with_departure(shares, found.structure)

    def doubtful(self, left: Shares) -> set[str]:
        """Channels that the model does not explain; all where its file rules out the values by which it does.

        But for those without an inverse-dynamics residual: a wrong unit or sign shows there. What shows in the motion
        alone is a small force of which a slow tracker makes a large error, such as one at which a joint sticks.
        """
        share = self.settings.doubtful
        found = set(left.by_channel) if left.far > self.settings.far else left.above(share)
        return {name for name in found if left.told(name) > share}

    def falls(self, left: Shares) -> bool:
        """Whether the model leaves its record although all efforts are as they should be: then nothing follows from it.

        An arm that stands on its joints falls over faster than a slow tracker draws it back.
        """
        told = all(left.told(name) <= self.settings.harmless for name in left.by_channel)
        return told and bool(left.above(self.settings.doubtful))

    def _is_lost(self, plain: Shares) -> bool:
        """Whether the model as it is does not follow a record, by its ``plain`` shares."""
        return bool(plain.above(self.settings.doubtful))

    def _regressed(self, record: Experiment) -> _Regressed | None:
        """Values that leave least of the inverse-dynamics residual of a record, see `vpm.ranking.regression`.

        None where no efforts follow from the motion. Values that the model file rules out are none: commands that are
        far too small ask for masses that are.
        """
        key = _Numbers(record).key
        if key not in self._near:
            self._near[key] = self._regressed_anew(record)
        return self._near[key]

    def _regressed_anew(self, record: Experiment) -> _Regressed | None:
        if why_unbalanced(self.model, [record]):
            return None
        structure = self._structure(record)
        priors = {name: self._within(name, prior) for name, prior in structure.priors.items()}
        try:
            asked = [structure.place(name) for name in priors]
            problem = InverseDynamicsProblem(self.model, [record], first=(structure.theta, asked), built=self._built)
            values = regressed(replace(structure, priors=priors), problem).theta
        except ASTRAY:
            return None
        try:
            return _Regressed(values, _left_of_efforts(problem, self.model, values))
        except ASTRAY:
            return _Regressed(values, {})

    def _within(self, name: str, prior: Prior) -> Prior:
        """Prior of a parameter with bounds beyond which the model file rules values out."""
        if name in self._of_added:
            return prior
        ends = prior.value(-self.settings.far), prior.value(self.settings.far)
        return replace(prior, low=min(ends), high=max(ends))

    def tangent(self, record: Experiment, at: Shares, forces: Collection[str] = FRICTION) -> Tangent | None:
        """Tangent of the error share by the parameters; None where that cannot be computed."""
        if at.residual is None:
            return None
        tracker, structure = self._tracker(record), replace(self._structure(record, forces), theta=at.values)
        tracked = self._tracked(record)
        try:
            fitter = Fitter(tracked, tracked.settings)
            followed = fitter.followed(structure, tracker, tuple(structure.priors))
        except ASTRAY:
            return None
        if not np.all(np.isfinite(followed.jacobian)):
            return None
        return Tangent(structure, followed.residual, followed.jacobian * structure.slopes, at)

    def freed(self, record: Experiment, plain: Shares) -> Tangent | None:
        """Tangent of the error share where all forces have been fitted, from friction alone in ``plain``.

        Derivatives cost most: secants correct them on the way. They are worked out once more in between, for no tangent
        says where a spring rests that is not there yet; where hardly anything was gained, there is none.
        """
        tracked, tracker, found = self._tracked(record), self._tracker(record), None
        for _ in range(TURNS):
            start = self.tangent(record, plain if found is None else found.shares, FORCES)
            if start is None:
                break
            found = self._descended(tracked, tracker, start)
            if found.shares.cost > start.shares.cost + math.log(self.settings.alike):
                break
        return found

    def _descended(self, tracked: TrackedRecords, tracker: Tracker, start: Tangent) -> Tangent:
        """Tangent of the error share where secants lead from another one."""
        noise = white_noise(start.residual, tracked.parts)
        fitted, slopes = Fitter(tracked, tracked.settings).moved(start.followed(tracker), View(noise))
        sizes, kept = np.array(noise.deviations)[:, None, None], np.zeros_like(start.slopes)
        seen = _seen(tracked)
        kept[seen] = (slopes.reshape(len(sizes), -1, slopes.shape[1]) * sizes).transpose(1, 0, 2)
        shares = self._shares(tracked, fitted.residual, tracker, fitted.structure.theta)
        shares = replace(self._with_departure(shares, fitted.structure), efforts=start.shares.efforts)
        return Tangent(fitted.structure, fitted.residual, kept, shares)

    def fit_delay(self, record: Experiment, correction: Correction, tangent: Tangent) -> tuple[Correction, Shares]:
        """Error share of a delay that is fitted with the parameters and all forces."""
        tracker, longest_delay = self._tracker(record), self.settings.longest_delay
        structure = with_delay(tangent.structure, correction.delay, longest_delay)
        try:
            whole = Delayed(self.model, record, correction, longest_delay, self._ranking(record), self.setup)
            tracked = whole.whole()
            residual, slope = tracked.follow(self.model, structure.theta, tracker, [len(self.model.theta)])
            known = tangent.slopes[whole.cut : whole.cut + len(residual)]
            start = Tangent(structure, residual, np.concatenate([known, slope * longest_delay], axis=2), tangent.shares)
            view = View(white_noise(residual, tracked.parts))
            fitted, _ = Fitter(tracked, tracked.settings).moved(start.followed(tracker), view, anew=True)
            found = fitted.structure
        except ASTRAY:
            return correction, self._lost(record, tangent.shares.values)
        *values, delay = found.theta.tolist()
        refined = replace(correction, delay=delay)
        shares = self.measured(refined.applied(record), np.array(values))
        shares = self._with_departure(shares, without_delay(found))
        efforts = self.efforts_left(refined.applied(record), shares.by_channel)
        return refined, replace(shares, efforts=efforts, pressures=tangent.shares.pressures)

    def _with_departure(self, shares: Shares, structure: Structure) -> Shares:
        """Shares with how far the parameters of the model are from what its file states."""
        from scipy.stats import chi2  # slow to import, and seldom needed

        own = self._departures(structure)
        farthest = max(own, key=lambda name: own[name], default="")
        unlikely = sum(far**2 for far in own.values()) / 2.0
        chance = float(chi2.sf(2.0 * unlikely, max(len(own), 1)))
        return replace(shares, far=own.get(farthest, 0.0), farthest=farthest, unlikely=unlikely, chance=chance)

    def _departures(self, structure: Structure) -> dict[str, float]:
        """By how many of its stated deviations each parameter of the model was moved."""
        moved = zip(structure.priors, np.abs(structure.standard).tolist(), strict=True)
        return {name: far for name, far in moved if name not in self._of_added}

    def undetermined(self, tangent: Tangent) -> list[str]:
        """Uncertain parameters of the model on which a record's error share hardly depends."""
        deviations = zip(tangent.structure.priors, tangent.deviations.tolist(), strict=True)
        return [name for name, left in deviations if left > self.settings.undetermined and name not in self._of_added]

    def of_sensor(self, correction: Correction, record: Experiment, before: Shares) -> Shares | None:
        """Error share of a corrected sensor that does not draw the model; None where it takes another run."""
        if before.residual is None or any(
            name not in before.by_channel or is_position(self.model, name) for name in correction.channels
        ):
            return None
        corrected = correction.applied(record)
        if not self._begins_alike(corrected, record):
            return None
        rows, shares = rows_of(corrected, record), dict(before.by_channel)
        kept = np.isin(rows, before.seen)
        for place, name in enumerate(before.by_channel):
            if name in correction.channels:
                reading, shown = corrected[name][kept], (record[name] - before.residual[:, place])[rows[kept]]
                free = float(np.sum((reading - np.mean(reading)) ** 2))
                shares[name] = _share(float(np.sum((reading - shown) ** 2)), free)
        return replace(before, by_channel=shares)

    def _begins_alike(self, corrected: Experiment, record: Experiment) -> bool:
        """Whether a corrected record begins in the same first state, so that shares compare."""
        first, then = (initial_state(self.model, one, self.model.theta) for one in (record, corrected))
        return bool(np.array_equal(first, then))

    def _structure(self, record: Experiment, forces: Collection[str] = FRICTION) -> Structure:
        """Model with forces at each joint that begin at nothing, for error shares."""
        model = self.model
        priors, values = stated(model), model.theta.copy()
        for name, joint in self.added:
            sizes, shapes = self._usual(record, joint)
            effect = model.effect(name, joint)
            for short, parameter in effect.parameter_names.items():
                entry = effect.type.parameter(short)
                if entry.shape:
                    values[model.index(parameter)] = shapes[entry.scale]
                    if name in forces and entry.scale == "coordinate":
                        priors[parameter] = Prior(shapes[entry.scale], sizes[entry.scale], *entry.physical)
                elif name in forces:
                    priors[parameter] = Prior(0.0, sizes[entry.scale], *entry.physical)
        return Structure(model, values, priors, free_places=False)

    def _usual(self, record: Experiment, joint: str) -> tuple[dict[str, float], dict[str, float]]:
        """Usual sizes of forces at a joint, and shapes, for error shares."""
        place, channel = self.model.coordinates.index(joint), f"{joint}.position"
        if channel not in record or np.ptp(record[channel]) == 0.0:
            return natural_sizes(1.0, 1.0, 1.0), {"speed": TRANSITION, "coordinate": 0.0}
        ends = np.linspace(0, len(record) - 1, min(PIECES, len(record))).astype(int)
        way, speed = np.std(record[channel]), np.std(np.diff(record[channel][ends]) / np.diff(record.time[ends])) + 1e-9
        effort = float(self.model.masses_at_zero[place] * speed**2 / way + self._weights[place]) + 1e-9
        middle = float(np.mean(record[channel]))
        return natural_sizes(effort, float(speed), float(way)), {"speed": TRANSITION * speed, "coordinate": middle}

    @cached_property
    def _weights(self) -> Array:
        """Effort that holds each coordinate where all are zero, for error shares."""
        rest = np.zeros(len(self.model.coordinates))
        return np.abs(self.model.inverse_dynamics(rest, rest, rest))

    @cached_property
    def _of_added(self) -> frozenset[str]:
        """Parameters of forces that were added for error shares."""
        return frozenset(name for key in self.added for name in self.model.effect(*key).parameter_names.values())

    def _tracker(self, record: Experiment) -> Tracker:
        return Tracker(min(self.band, self.settings.turn / record.dt), fine=False)

    def _ranking(self, record: Experiment) -> RankingSettings:
        return RankingSettings(bands=(self._tracker(record).band,), iterations=self.settings.steps)

    def _tracked_anew(self, record: Experiment) -> TrackedRecords:
        return TrackedRecords(self.model, [record], self._ranking(record), self.setup).whole()

    def _tracked(self, record: Experiment) -> TrackedRecords:
        return self._tracked_of(_Numbers(record))

    def _shares(self, tracked: TrackedRecords, residual: Array, tracker: Tracker, values: Array) -> Shares:
        drawn, seen = tracked.drawn(tracker.band), _seen(tracked)
        free = np.sum(np.where(np.any(drawn != 0.0, axis=0), drawn, tracked.motion)[seen] ** 2, axis=0)
        with np.errstate(all="ignore"):
            errors = map(_share, np.sum(residual[seen] ** 2, axis=0).tolist(), free.tolist())
        shares = dict(zip(tracked.records[0].channels, errors, strict=True))
        return Shares(shares, values, residual, free, seen, floor=self.settings.negligible)

    def _lost(self, record: Experiment, values: Array) -> Shares:
        """Shares of a record from which the model runs away: all of every channel is left."""
        shares = dict.fromkeys(measured_outputs(self.model, record), 1.0)
        return Shares(shares, values, floor=self.settings.negligible)


@dataclass(frozen=True, eq=False)
class Tangent:
    """What is left of a record near fitted values of the parameters, as far as it is linear."""

    structure: Structure
    residual: Array  #: Shape (N, m).
    slopes: Array  #: Shape (N, m, k); derivatives by deviations of the priors.
    shares: Shares  #: Of the fit.

    def followed(self, tracker: Tracker) -> Followed:
        """Residual with derivatives from which a fit of the error share begins."""
        names, jacobian = tuple(self.structure.priors), self.slopes / self.structure.slopes
        return Followed(self.structure, tracker, names, self.residual, jacobian)

    @property
    def deviations(self) -> Array:
        """Standard deviations of the parameters, as shares of those that the model file states (k,)."""
        normal = self._normal + np.eye(len(self._normal))
        sizes = 1.0 / np.sqrt(np.diag(normal))
        spread = np.diag(np.linalg.pinv(normal * np.outer(sizes, sizes), hermitian=True))
        return np.asarray(sizes * np.sqrt(np.maximum(spread, 0.0)))

    def predicted(self, corrected: Experiment, record: Experiment, residual: Array) -> tuple[Shares, float]:
        """Predicted error share of more or less of a correction if all parameters change too.

        ``residual`` is what the same values of the parameters leave of the corrected record.
        """
        rows = rows_of(corrected, record)
        kept = np.flatnonzero(np.isin(rows, self.shares.seen))
        whole, sizes = self._all
        there = np.isin(self.shares.seen, rows[kept])
        slopes = (whole if np.all(there) else whole[there]).reshape(-1, whole.shape[2])
        lost = whole[~there].reshape(-1, whole.shape[2])  # a delay cuts off some samples at the ends
        before, after = (part / sizes for part in (self.residual[rows[kept]], residual[kept]))
        along = (after - before).ravel()
        square = float(along @ along)
        beside = slopes.T @ along
        own = self._normal - lost.T @ lost + np.eye(len(beside))
        normal = np.block([[own, beside[:, None]], [beside[None, :], np.array([[(1.0 + 1e-12) * square + 1e-300]])]])
        pull = np.append(slopes.T @ before.ravel() + self.structure.standard, along @ before.ravel())
        move = -np.linalg.solve(normal, pull)
        left = (before.ravel() + slopes @ move[:-1] + move[-1] * along).reshape(before.shape) * sizes
        scale = self.shares.free * len(kept) / len(self.shares.seen)
        errors = map(_share, np.sum(left**2, axis=0).tolist(), scale.tolist())
        return replace(self.shares, by_channel=dict(zip(self.shares.by_channel, errors, strict=True))), float(move[-1])

    @cached_property
    def _all(self) -> tuple[Array, Array]:
        """Weighed slopes of the error share at all samples that count (n, m, k), and sizes."""
        slopes, sizes = self._weighed(self.shares.seen)
        return slopes.reshape(-1, len(sizes), slopes.shape[1]), sizes

    @cached_property
    def _normal(self) -> Array:
        """Squares of the weighed slopes of the error share (k, k)."""
        slopes = self._all[0].reshape(-1, self._all[0].shape[2])
        return np.asarray(slopes.T @ slopes)

    def _weighed(self, rows: NDArray[np.intp]) -> tuple[Array, Array]:
        """Slopes of the error share, weighed sample by sample and channel by channel, and sizes."""
        # What is drawn to the last digit is known no better than to rounding: squares of its slopes stay finite.
        rounding = np.finfo(np.float64).eps * np.max(np.abs(self.slopes), axis=(0, 2), initial=0.0)
        sizes = np.sqrt(np.mean(self.residual[self.shares.seen] ** 2, axis=0)) + rounding + 1e-150
        slopes = self.slopes[rows] / sizes[:, None]
        return slopes.reshape(-1, slopes.shape[2]), sizes


def mean_logarithm(shares: Mapping[str, float], channels: Iterable[str]) -> float:
    """Mean of the logarithms of some shares."""
    own = [math.log(max(shares[name], 1e-300)) for name in channels]
    return sum(own) / len(own)


def rows_of(part: Experiment, record: Experiment) -> NDArray[np.intp]:
    """Rows of a record that are the samples of a part of it, for error shares."""
    return np.asarray(np.round((part.time - record.time[0]) / record.dt), dtype=np.intp)


def _left_of_efforts(problem: InverseDynamicsProblem, model: Model, values: Array) -> dict[str, float]:
    """Inverse-dynamics residual of the effort at each position, and of each channel beside, as a share of its variance.

    Of the variance, for what holds a weight says nothing of the scale of a motion.
    """
    _, applied, required = problem.effort(model, values, 0)
    found = {}
    for place, block in enumerate(problem.efforts(0)):
        counts = block.moving > 0.0
        moved = applied[counts, place]
        left = float(np.sum((moved - required[counts, place]) ** 2))
        found[f"{problem.joints[place]}.position"] = (
            _share(left, float(np.sum((moved - moved.mean()) ** 2))) if moved.size else 1.0
        )
    residual, _ = problem.evaluate(model, values) if problem.shown else (applied, None)
    for block in problem.blocks[len(found) :]:
        error, size = residual[block.samples], block.weight * block.scale
        found[block.channel] = _share(float(np.sum(error**2)), len(error) * size**2)
    return found


def _seen(tracked: TrackedRecords) -> NDArray[np.intp]:
    """Samples that count in an error share: all but the beginning."""
    return np.concatenate([np.arange(part.start, part.stop) for part in tracked.parts])


def _share(left: float, free: float) -> float:
    """Error power as a share of that of free masses; one at most."""
    share = left / max(free, 1e-300)
    return min(share, 1.0) if np.isfinite(share) else 1.0
