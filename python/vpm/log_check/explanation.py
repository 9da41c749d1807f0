"""The mistake of a channel table that explains the error of a model on a record, if one does."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.optimize import minimize_scalar

from vpm.discrepancy.parallel_candidates import Failure, ParallelCandidates
from vpm.experiment import Experiment
from vpm.identify.response_along_motion import bends
from vpm.log_check.correction import Correction, Pair
from vpm.log_check.shares import FORCES, Judge, Shares, Tangent, mean_logarithm
from vpm.log_check.tried_corrections import delays, delays_of_columns, delays_of_shafts, of_two, scales
from vpm.model import ChannelEntry

Change = TypeVar("Change", Correction, Pair)


@dataclass(frozen=True, eq=False)
class Explanation:
    """A correction that explains a record."""

    correction: Correction
    #: What is left of the record without it and with it.
    before: Shares
    after: Shares
    affected: tuple[str, ...]  #: Channels that the mistake affects.
    rivals: tuple[Correction, ...] = ()  #: Others that do as well.
    #: The model explains the record without it as well, but with values that its file rules out.
    is_of_values: bool = False
    at_once: bool = False  #: Another correction has to be made with it; alone it explains nothing.
    is_limit: bool = False  #: Drives that give no more than some limit explain the record as well as smaller commands.

    @property
    def is_possible(self) -> bool:
        """Whether an explanation could also be what the machine does by itself."""
        return self.is_limit or any(one.is_possible for one in (self.correction, *self.rivals))


class _Trial(NamedTuple):
    """A correction with what is left before and after it."""

    correction: Correction
    before: Shares
    after: Shares


class Explainer:
    """Finds the corrections of channel tables that explain what a model leaves of records.

    - ``units``: units in which the channels were read
    - ``table``: channel table by which they were read
    """

    def __init__(
        self, judge: Judge, units: Mapping[str, str], table: Mapping[str, ChannelEntry], each: ParallelCandidates
    ) -> None:
        self.judge, self.units, self.table, self.each = judge, units, table, each
        self.model, self.settings = judge.model, judge.settings

    def explained(self, part: Experiment, used: Sequence[str], left: Shares) -> list[Explanation]:
        """The correction that leaves least of a record, if it explains it; else two that explain it together; or none.

        - ``used``: channels that the model reads
        - ``left``: what is left of the record as it is
        """
        ended = self._ended(part, used, left)
        if (best := self._best(ended, used)) is not None:
            return [replace(best, is_limit=self._is_limit(best, part))]
        if not left.above(self.settings.harmless):
            return []
        return self._at_once(part, used, left) or self._one_by_one(ended, part, used)

    def _at_once(self, part: Experiment, used: Sequence[str], left: Shares) -> list[Explanation]:
        """Two corrections of a joint of which each alone explains nothing, for the other one hides what it does."""
        if not (doubtful := self.judge.doubtful(left)):
            return []
        pairs = [
            pair
            for pair in of_two(self.model, used, self.units, self.settings)
            if any(doubtful & set(self._affected(one, left)) for one in pair)
        ]
        before = self.judge.guessed(part)
        pairs = self._leaving_less_effort(pairs, part, left)
        tried = self._ordered("trying", self.judge.guessed, pairs, part)
        few = [pair for pair, shares in tried if shares.cost < before.cost][: self.settings.fitted]
        for pair, after in self._ordered("fitting", self.judge.fitted, few, part)[:1]:
            if all(self._explains(one, left, after, len(pair)) for one in pair):
                return [Explanation(one, left, after, self._affected(one, after), at_once=True) for one in pair]
        return []

    def _one_by_one(self, ended: Sequence[_Trial], part: Experiment, used: Sequence[str]) -> list[Explanation]:
        """Explanations by two corrections, of which the first one alone leaves less than none."""
        pairs = []
        firsts = [one for one in ended if one.after.cost < one.before.cost + math.log(self.settings.alike)]
        for correction, before, after in firsts[: self.settings.branches]:
            corrected = correction.applied(part)
            second = self._best(self._ended(corrected, used, after), used)
            again = second is not None and second.correction.channels == correction.channels
            if second is not None and not again and self._explains(correction, before, second.after, 2):
                first = Explanation(correction, before, after, self._showing(correction, before), ())
                pairs.append([first, second])
        return min(pairs, key=lambda pair: pair[-1].after.order, default=[])

    def _ended(self, part: Experiment, used: Sequence[str], left: Shares) -> list[_Trial]:
        """Fitted explanations with the errors before and after each correction, the least first."""
        if self.judge.falls(left) or (not left.above(self.settings.negligible) and left.far <= self.settings.far):
            return []
        tangent = self.judge.freed(part, left)
        freed = left if tangent is None else tangent.shares

        def ended(correction: Correction) -> _Trial:
            corrected = correction.applied(part)
            plain = self.judge.fitted(corrected)
            if correction.is_clock:  # springs and friction that nobody described fit a motion at any speed
                return _Trial(correction, left, plain)
            easier = self.judge.freed(corrected, plain)
            found = _Trial(correction, freed, plain if easier is None else easier.shares)
            if not (correction.swap or correction.factor < 0.0):
                return found
            # A constant force is the mirror image of a weight, and may hide or explain it.
            return min(_Trial(correction, left, plain), found, key=lambda one: one.after.cost - one.before.cost)

        found = self.each("fitting", ended, self._finalists(part, used, left), self._words)
        if part.duration * self.judge.band >= self.settings.periods:
            found = [*found, *self._late(part, used, tangent, freed, self._known(found))]
        ended_well = sorted((one for one in found if not isinstance(one, Failure)), key=lambda one: one.after.order)
        different: list[_Trial] = []
        for trial in ended_well:
            if not any(_is_same(trial.correction, other.correction) for other in different):
                different.append(trial)
        return different

    def _known(self, found: Sequence[_Trial | Failure]) -> float:
        """Cost of the best of some corrections that explain a record; infinite if none does."""
        known = (one.after.cost for one in found if not isinstance(one, Failure) and self._explains(*one))
        return min(known, default=math.inf)

    def _best(self, ended: Sequence[_Trial], used: Sequence[str]) -> Explanation | None:
        """The first of several corrections, if it explains what was left, with those that do as well.

        One with values that the model file rules out does not do as well as one without.
        """
        if not ended:
            return None
        close = ended[0].after.cost - math.log(self.settings.alike)
        alike = [one for one in ended if one.after.cost <= close]
        (correction, before, after), *others = [one for one in alike if one.after.far <= self.settings.far] or alike
        rivals = tuple(other.correction for other in others)
        if not self._explains(correction, before, after) or any(_is_no_scale(correction, other) for other in rivals):
            return None
        affected, of_values = self._showing(correction, before), self._is_of_values(correction, before, after)
        found = Explanation(correction, before, after, affected, rivals, of_values)
        return self._mirrored(found, used)

    def _is_limit(self, found: Explanation, part: Experiment) -> bool:
        """Whether drives that give no more than some limit explain a record as well as commands that are too large."""
        scaled = (one for one in (found.correction, *found.rivals) if 0.0 < one.factor < 1.0)
        asked = [one for one in scaled if all(name.endswith(".command") for name in one.channels)]
        if not asked:
            return False
        places = [part.channels.index(name) for name in asked[0].channels]
        most = np.max(np.abs(part.data[:, places]), axis=0)

        fitted: list[Shares] = []

        def cost(level: float) -> float:
            data, ends = np.array(part.data), math.exp(level) * most
            data[:, places] = np.clip(data[:, places], -ends, ends)
            fitted.append(self.judge.fitted(replace(part, data=data)))
            return fitted[-1].cost

        minimize_scalar(cost, bounds=(math.log(0.5 * asked[0].factor), 0.0), options={"xatol": 0.02})
        there = min(fitted, key=lambda one: one.cost)
        return there.far <= self.settings.far and there.cost <= found.after.cost - math.log(self.settings.alike)

    def _mirrored(self, found: Explanation, used: Sequence[str]) -> Explanation:
        """The explanation with the other side of a delay: some channels late is the same as all others early."""
        correction = found.correction
        others = tuple(name for name in used if name not in correction.channels)
        possible = {one.channels for one in delays(self.model, used, self.settings)}
        if others not in possible or not correction.delay or correction.column:
            return found
        mirror = replace(correction, channels=others, delay=-correction.delay)
        rivals = (one for one in found.rivals if set(one.channels) != set(others))
        return replace(found, rivals=(mirror, *rivals))

    def _finalists(self, part: Experiment, used: Sequence[str], left: Shares) -> list[Correction]:
        """Explanations that are worth a fit of the model; see `_late` for delays."""
        some = {one for one in left.above(self.settings.negligible) if left.told(one) > self.settings.harmless}
        everything = list(scales(self.model, used, self.units, self.settings))
        tried = self._about(everything, self.judge.doubtful(left), left)
        if not left.above(self.settings.lost):  # with a wrong clock the model explains nothing
            tried = [one for one in tried if not one.is_clock]
        # The mirror image of a machine explains most of a log as well as the machine does.
        tried += self._about((one for one in everything if one.is_mirror), some, left)
        tried = self._leaving_less_effort(list(dict.fromkeys(tried)), part, left)
        few = self._hopeful(tried, part, self.judge.guessed(part)) if tried else []
        return self._leaving_less_effort(few, part, left) if bends(self.model) else few

    def _leaving_less_effort(self, corrections: Sequence[Change], part: Experiment, left: Shares) -> list[Change]:
        """Corrections with which less is left of the efforts that they affect, and of all; all where none follow.

        What a slow tracker makes of a force that is missing does not enter. Of units and signs of pressures, what the
        pressures give tells. Where links bend it takes a run along the
        motion, so that many corrections are tried by the tracker alone.
        """
        if len(corrections) > self.settings.finalists and bends(self.model):
            return list(corrections)

        def better(correction: Change) -> bool:
            own = {name for one in correction.each if not one.delay for name in one.channels} & set(left.pressures)
            if own:
                pressures = self.judge.pressures_read(correction.applied(part)) or left.pressures
                if mean_logarithm(pressures, own) > mean_logarithm(left.pressures, own):
                    return False
            affected = {name for one in correction.each for name in self._affected(one, left)} & set(left.efforts)
            if not affected:
                return True
            efforts = self.judge.efforts_left(correction.applied(part), affected)
            # A position and its velocity may both be wrong, and are put right one after the other.
            told = affected | {name for name in left.efforts if not name.endswith(".velocity")}
            return told <= set(efforts) and all(
                mean_logarithm(efforts, names) <= mean_logarithm(left.efforts, names) for names in (affected, told)
            )

        told = self.each("comparing efforts", better, corrections, self._words)
        return [one for one, kept in zip(corrections, told, strict=True) if kept is True]

    def _about(self, corrections: Iterable[Correction], channels: set[str], left: Shares) -> list[Correction]:
        """Explanations that may have affected one of these channels."""
        return [correction for correction in corrections if channels & set(self._affected(correction, left))]

    def _affected(self, correction: Correction, left: Shares) -> tuple[str, ...]:
        """Channels that an explained mistake affects: its own, joints of a command, all by the clock."""
        found: list[str] = []
        for name in correction.channels:
            owner = name.rpartition(".")[0]
            if name in left.by_channel:
                found.append(name)
            elif owner in self.model.actuators:
                moved = [f"{joint}.position" for joint in self.model.joints_of_actuator(owner)]
                found += [channel for channel in moved if channel in left.by_channel]
        return tuple(found or left.by_channel)

    def _showing(self, correction: Correction, before: Shares) -> tuple[str, ...]:
        """Channels in which an explained mistake shows: those that it affects, or where the model gives way.

        Of a late reading that is where the machine is light, and nothing may be left of the reading itself.
        """
        own, some = self._affected(correction, before), before.above(self.settings.negligible)
        hidden = correction.delay and some.isdisjoint(own)
        return tuple(name for name in before.by_channel if name in some) if hidden and some else own

    def _hopeful(self, corrections: Sequence[Correction], part: Experiment, before: Shares) -> list[Correction]:
        """Few explanations of least error at the values of the model, better than without any."""

        def measure(correction: Correction) -> tuple[Correction, Shares]:
            quick = self.judge.of_sensor(correction, part, before)
            return correction, quick or self.judge.guessed(correction.applied(part))

        return self._few(self.each("trying", measure, corrections, self._words), before)

    def _late(
        self, part: Experiment, used: Sequence[str], tangent: Tangent | None, left: Shares, known: float
    ) -> list[_Trial]:
        """Few explanations by a delay of least predicted error if parameters change too.

        From fitted values, else from those of the model: a long delay drives fitted ones far away. They have to be
        predicted to leave about as little as the best correction that is ``known``, and less than their own fit from
        the fitted values. All channels are asked: the model
        is drawn to every reading, and gives way where it is light. Of a motor and a flywheel on one shaft, a late
        reading of the wheel shows at the motor.
        """
        columns = delays_of_columns(self.table, used, self.settings)
        shafts = delays_of_shafts(self.model, self.table, used, self.settings)
        tried = (*delays(self.model, used, self.settings), *columns, *shafts)
        corrections = tried if left.above(self.settings.negligible) else ()
        least, found = self.settings.held * part.dt, list[_Trial]()
        for at in (tangent, None):
            if (near := at or self.judge.tangent(part, self.judge.measured(part), FORCES)) is None:
                continue
            predicted = partial(self._predicted, part=part, tangent=near)
            likely = self.each("trying", predicted, corrections, self._words)
            few = self._few([one for one in likely if not _is_reached(one, found)], left, known)
            few = self._leaving_less_effort(few, part, left)
            fit = partial(self._fitted, part=part, tangent=near, left=left)
            fitted = [one for one in self.each("refining", fit, few, self._words) if not isinstance(one, Failure)]
            found += [one for one in fitted if abs(one.correction.delay) > least]
            # A fit beside a delay that came to nothing is one without, and may have gone on to a better end.
            without = [one.after for one in fitted if abs(one.correction.delay) <= least]
            left = min([left, *without], key=lambda shares: shares.cost)
            found = [one._replace(before=left) for one in found]
            if self._known(found) < math.inf or known < math.inf or not left.above(self.settings.harmless):
                break
        return found

    def _predicted(self, correction: Correction, part: Experiment, tangent: Tangent) -> tuple[Correction, Shares]:
        """Explanation by the delay of least predicted error, by secants on a tangent."""
        shares = tangent.shares
        for _ in range(self.settings.rounds):
            corrected = correction.applied(part)
            there = self.judge.measured(corrected, tangent.shares.values)
            if there.residual is None:
                return correction, there
            shares, share = tangent.predicted(corrected, part, there.residual)
            delay = self._possible(share * correction.delay)
            if abs(delay) <= self.settings.held * part.dt:
                return correction, tangent.shares
            near = abs(delay - correction.delay) < self.settings.delay_tolerance * part.dt
            correction = replace(correction, delay=delay)
            if near:
                break
        return correction, shares

    def _few(
        self, tried: Sequence[tuple[Correction, Shares] | Failure], before: Shares, known: float = math.inf
    ) -> list[Correction]:
        """Few best explanations, one of each kind, better than without any or with a known one."""
        pairs = [pair for pair in tried if not isinstance(pair, Failure) and pair[1].cost < before.cost]
        better = sorted(pairs, key=lambda pair: pair[1].order)
        least = min([known, *(left.cost for _, left in better[:1])])
        hopeful: list[Correction] = []
        for correction, left in better:
            near = left.cost <= least + self.settings.hopeful
            if near and not any(_is_same(correction, other) for other in hopeful):
                hopeful.append(correction)
        return hopeful[: self.settings.finalists]

    def _fitted(self, correction: Correction, part: Experiment, tangent: Tangent, left: Shares) -> _Trial:
        """Explanation by a delay, fitted with the parameters and all forces."""
        refined, after = self.judge.fit_delay(part, correction, tangent)
        return _Trial(refined, left, after)

    def _possible(self, delay: float) -> float:
        return float(np.clip(delay, -self.settings.longest_delay, self.settings.longest_delay))

    def _explains(self, correction: Correction, before: Shares, after: Shares, count: int = 1) -> bool:
        """Whether a correction explains what a model leaves, or by which values it leaves nothing.

        As one of a ``count``, each of which has to earn its tenth: there are many pairs, and some do well by chance.
        """
        if count == 1 and self._is_of_values(correction, before, after):
            return True
        affected = self._showing(correction, before)
        enough = count * math.log(self.settings.better)
        if after.cost > before.cost or after.logarithm(affected) - before.logarithm(affected) > enough:
            return False
        if correction.delay:
            return self._is_throughout(affected, before, after)
        told = set(affected) & set(before.efforts) & set(after.efforts)
        return not told or mean_logarithm(after.efforts, told) - mean_logarithm(before.efforts, told) <= enough

    def _is_of_values(self, correction: Correction, before: Shares, after: Shares) -> bool:
        """Whether the model explains the record anyway, but with values that its file rules out, now needless.

        Of delays that says nothing: what a model lacks moves its parameters as well, and looks late. But nothing that
        it lacks delays one column of a value against the others.
        """
        settings = self.settings
        if (
            (correction.delay and not correction.column)
            or before.far <= settings.far
            or after.chance < settings.believable
        ):
            return False
        doubtful = before.above(settings.doubtful) | after.above(settings.doubtful)
        return before.unlikely - after.unlikely > settings.likelier and not doubtful

    def _is_throughout(self, affected: Collection[str], before: Shares, after: Shares) -> bool:
        """Whether an explanation removes half of the error in each piece of the record."""
        if before.residual is None or after.residual is None:
            return after.residual is not None
        places = [place for place, name in enumerate(before.by_channel) if name in affected]
        old, new = (np.array_split(r[:, places], self.settings.pieces) for r in (before.residual, after.residual))
        return all(np.sum(n**2) <= self.settings.throughout * np.sum(o**2) for o, n in zip(old, new, strict=True))

    def _ordered(
        self, what: str, measure: Callable[[Experiment], Shares], corrections: Sequence[Change], part: Experiment
    ) -> list[tuple[Change, Shares]]:
        """Explanations by the error after each correction, the least first."""
        found = self.each(what, lambda correction: measure(correction.applied(part)), corrections, self._words)
        pairs = [
            (correction, left)
            for correction, left in zip(corrections, found, strict=True)
            if not isinstance(left, Failure)
        ]
        return sorted(pairs, key=lambda pair: pair[1].order)

    def _words(self, correction: Correction | Pair) -> str:
        return correction.sentence(self.units)


def _is_same(one: Correction, other: Correction) -> bool:
    """Whether two explanations move the same channels in time."""
    return bool(one.delay) and bool(other.delay) and (one.channels, one.column) == (other.channels, other.column)


def _is_reached(tried: tuple[Correction, Shares] | Failure, found: Iterable[_Trial]) -> bool:
    """Whether a fitted explanation by a delay leaves no more than is predicted for another start of that fit."""
    return not isinstance(tried, Failure) and any(
        _is_same(tried[0], one.correction) and one.after.cost <= tried[1].cost for one in found
    )


def _is_no_scale(one: Correction, other: Correction) -> bool:
    """Whether another factor explains as much: then no channel has a wrong scale."""
    scales_both = not (one.delay or other.delay or one.swap or other.swap)
    return scales_both and one.channels == other.channels and abs(one.factor) != abs(other.factor)
