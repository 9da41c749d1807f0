"""The mistake of a channel table that explains what a model leaves of a record, if one does."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vpm.discrepancy.side_by_side import Failure, SideBySide
from vpm.experiment import Experiment
from vpm.log_check.mend import Mend
from vpm.log_check.mends import delays, scales
from vpm.log_check.shares import Judge, Shares

#: Multiples of a delay that are tried next.
FINER = (0.5, 0.65, 0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2, 1.35, 1.5)


@dataclass(frozen=True, eq=False)
class Explanation:
    """A mend that explains a record.

    Attributes
    ----------
    mend : Mend
    before, after : Shares
        What is left of the record without it and with it.
    spoiled : tuple of str
        Channels that the mistake spoils.
    rivals : tuple of Mend
        Others that do as well.
    """

    mend: Mend
    before: Shares
    after: Shares
    spoiled: tuple[str, ...]
    rivals: tuple[Mend, ...]

    @property
    def is_mistake(self) -> bool:
        """Whether no machine does that by itself."""
        return not any(one.is_possible for one in (self.mend, *self.rivals))


class Explainer:
    """Tries mends of records.

    Parameters
    ----------
    judge : Judge
    units : mapping of str to str
        Units in which the channels were read.
    each : SideBySide
    """

    def __init__(self, judge: Judge, units: Mapping[str, str], each: SideBySide) -> None:
        self.judge, self.units, self.each = judge, units, each
        self.model, self.settings = judge.model, judge.settings

    def explained(self, part: Experiment, used: Sequence[str], left: Shares) -> list[Explanation]:
        """The mend that leaves least of a record, if it explains it; else two that explain it together; or none.

        Parameters
        ----------
        part : Experiment
        used : sequence of str
            Channels that the model reads.
        left : Shares
            What is left of the record as it is.
        """
        ended = self._ended(part, used, left)
        if (best := self._best(ended, left)) is not None:
            return [self._by_turns(best, part)]
        pairs = []
        for mend, after in ended[: self.settings.branches]:
            mended = mend.applied(part)
            second = self._best(self._ended(mended, used, after), after)
            if second is not None and self._explains(mend, left, second.after):
                pairs.append(
                    [Explanation(mend, left, after, self._spoiled(mend, after), ()), self._by_turns(second, mended)]
                )
        return min(pairs, key=lambda pair: pair[-1].after.order, default=[])

    def _ended(self, part: Experiment, used: Sequence[str], left: Shares) -> list[tuple[Mend, Shares]]:
        """Mends with what is left after each, the model fitted, the least first."""
        return self._ordered("fitting", self.judge.fitted, self._finalists(part, used, left), part)

    def _best(self, ended: Sequence[tuple[Mend, Shares]], left: Shares) -> Explanation | None:
        """The first of several mends, if it explains what was left, with those that do as well."""
        if not ended:
            return None
        (mend, after), *others = ended
        close = after.cost - math.log(self.settings.alike)
        rivals: list[Mend] = []
        for other, shares in others:
            if shares.cost <= close and not any(_is_same(other, one) for one in (mend, *rivals)):
                rivals.append(other)
        if not self._explains(mend, left, after) or any(_is_no_scale(mend, other) for other in rivals):
            return None
        return Explanation(mend, left, after, self._spoiled(mend, after), tuple(rivals))

    def _by_turns(self, found: Explanation, part: Experiment) -> Explanation:
        """A delay as the record has it; delay and parameters are fitted by turns."""
        for _ in range(self.settings.rounds if found.mend.delay else 0):
            finer = self._refined(found.mend, found.after, part)
            after = self.judge.fitted(finer.applied(part))
            if after.order >= found.after.order:
                break
            found = replace(found, mend=finer, after=after)
        return found

    def _finalists(self, part: Experiment, used: Sequence[str], left: Shares) -> list[Mend]:
        """Mends for which the model is worth a fit."""
        settings, found = self.settings, list[Mend]()
        everything = set(left.by_channel) if left.far > settings.far else set()
        if doubtful := everything | left.above(settings.doubtful):
            tried = self._about(scales(self.model, used, self.units, settings), doubtful, left)
            found += self._hopeful(tried, part, self.judge.measured(part))
        if some := left.above(settings.negligible):
            found += self._late(self._about(delays(self.model, used, settings), some, left), part, left)
        return list(dict.fromkeys(found))

    def _about(self, mends: Iterable[Mend], channels: set[str], left: Shares) -> list[Mend]:
        """Those that may have spoiled one of these channels."""
        return [mend for mend in mends if channels & set(self._spoiled(mend, left))]

    def _spoiled(self, mend: Mend, left: Shares) -> tuple[str, ...]:
        """Channels that a mistake spoils: its own, those of the joints of a command, all by the clock."""
        found: list[str] = []
        for name in mend.channels:
            owner = name.rpartition(".")[0]
            if name in left.by_channel:
                found.append(name)
            elif owner in self.model.actuators:
                moved = [f"{joint}.position" for joint in self.model.joints_of_actuator(owner)]
                found += [channel for channel in moved if channel in left.by_channel]
        return tuple(found or left.by_channel)

    def _hopeful(self, mends: Sequence[Mend], part: Experiment, before: Shares) -> list[Mend]:
        """The few that leave least at given values of the parameters, and less than is left without any."""

        def measure(mend: Mend) -> tuple[Mend, Shares]:
            quick = self.judge.of_sensor(mend, part, before)
            return mend, quick or self.judge.measured(mend.applied(part), before.values)

        return self._few(self.each("trying", measure, mends, self._words), before)

    def _late(self, mends: Sequence[Mend], part: Experiment, left: Shares) -> list[Mend]:
        """The few delays that promise to leave least if parameters give way: friction looks much like a delay."""
        tangent = self.judge.tangent(part, left)
        if tangent is None:
            return []

        def measure(mend: Mend) -> tuple[Mend, Shares]:
            mended = mend.applied(part)
            there = self.judge.measured(mended, left.values)
            if there.residual is None:
                return mend, there
            shares, share = tangent.promised(mended, part, there.residual)
            delay = float(np.clip(share * mend.delay, -self.settings.latest, self.settings.latest))
            return (replace(mend, delay=delay), shares) if abs(delay) > 0.5 * part.dt else (mend, left)

        return self._few(self.each("trying", measure, mends, self._words), left)

    def _few(self, tried: Sequence[tuple[Mend, Shares] | Failure], before: Shares) -> list[Mend]:
        """The mends that leave least, one of each kind, and less than is left without any."""
        pairs = [pair for pair in tried if not isinstance(pair, Failure) and pair[1].cost < before.cost]
        better = sorted(pairs, key=lambda pair: pair[1].order)
        hopeful: list[Mend] = []
        for mend, left in better:
            near = left.cost <= better[0][1].cost + self.settings.hopeful
            if near and not any(_is_same(mend, other) for other in hopeful):
                hopeful.append(mend)
        return hopeful[: self.settings.finalists]

    def _refined(self, mend: Mend, at: Shares, part: Experiment) -> Mend:
        """A delay as the record has it, by the values of the parameters with which something was left."""
        finer = [replace(mend, delay=share * mend.delay) for share in FINER]
        return self._ordered("refining", lambda record: self.judge.measured(record, at.values), finer, part)[0][0]

    def _explains(self, mend: Mend, before: Shares, after: Shares) -> bool:
        """Whether a mend leaves half of what was left, and the model then explains what the mistake would spoil.

        A mend that leaves no more does as well where the model else has values that its file rules out.
        """
        far, least = self.settings.far, math.log(self.settings.better)
        spoiled = self._spoiled(mend, after)
        if max(after.by_channel[name] for name in spoiled) > self.settings.explained:
            return False
        nearer = before.far > far and after.far < 0.5 * before.far and after.cost <= before.cost - least
        return nearer or (after.cost - before.cost <= least and after.over(spoiled) - before.over(spoiled) <= least)

    def _ordered(
        self, what: str, measure: Callable[[Experiment], Shares], mends: Sequence[Mend], part: Experiment
    ) -> list[tuple[Mend, Shares]]:
        """Mends with what is left after each, the least first."""
        found = self.each(what, lambda mend: measure(mend.applied(part)), mends, self._words)
        pairs = [(mend, left) for mend, left in zip(mends, found, strict=True) if not isinstance(left, Failure)]
        return sorted(pairs, key=lambda pair: pair[1].order)

    def _words(self, mend: Mend) -> str:
        return mend.sentence(self.units)


def _is_same(one: Mend, other: Mend) -> bool:
    """Whether two mends move the same channels in time."""
    return bool(one.delay) and bool(other.delay) and one.channels == other.channels


def _is_no_scale(mend: Mend, other: Mend) -> bool:
    """Whether another factor does as well for the same channels: then none of them is their scale."""
    same = mend.channels == other.channels and not (mend.delay or other.delay or mend.swap or other.swap)
    return same and abs(mend.factor) != abs(other.factor)
