"""Judgement of an effect: the share of the error that it removes, and whether that counts."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from vpm.numbers import rough_percent
from vpm.ranking.settings import Settings
from vpm.results import Storable

#: Error powers above this many times what they were say no more than that it does harm.
MANY = 10.0


@dataclass(frozen=True, repr=False, eq=False)
class Judgement(Storable):
    """Judgement of an effect by the error that it removes under a tracker.

    Attributes
    ----------
    removed : float
        Share of the error power; the shares that are left of several channels multiply.
    least : float
        The same of fitted and of held-back stretches of record, the smaller one.
    score : float
        How surely it is removed from pieces of the held-back stretches, in standard deviations; of all stretches, each
        held back in turn, where the last ones alone leave that open.
    size : float
        Its amplitude in the channel in which it removes most, as a share of that of all effects of the model whose laws
        are not exact.
    beside : float
        The same of those that were added before.
    shape : float
        The same of those that show over the same states at the same place, one curve with two shapes, and of the
        bending of links where that is what a gauge reads.
    alone : float
        Of an effect that adds inertia, the share of the error power that is left, in the channel in which it removes
        most, of what the tracker leaves of a mass on which nothing acts: too heavy a machine is drawn along by the
        tracker alone.
    overtone : bool
        Whether it repeats along a whole fraction of the period of another effect at its place.
    explained : float
        Share of the error power that it explains: of the error and not of its mirror image.
    reshaped : str
        An effect of the same curve that was found before and does as well by another shape of its law; "" if none does.
    timed : str
        A shift of all commands, or of its readings, within one sample that does as well; "" if none does.
    apart : bool
        Whether it has a gap whose contacts never meet in the records, so that only their roundings act.
    refuted : float
        Share of the error power that it adds to validation records, where that refutes it.
    """

    removed: float
    least: float
    score: float
    size: float
    beside: float
    shape: float
    alone: float = 0.0
    overtone: bool = False
    explained: float = 1.0
    reshaped: str = ""
    timed: str = ""
    apart: bool = False
    refuted: float = 0.0

    @property
    def words(self) -> str:
        """Text of a judgement: ``removes 3 % of the error power``, or adds it where the share is negative."""
        share = round(self.least, 4)  # beyond that is what fits end with
        if share < 0.0:
            return _adding(-share, "the error power")
        return f"removes {rough_percent(abs(share))} of the error power"

    def counts(self, settings: Settings) -> bool:
        """Whether a judgement counts: more than chance, and more than errors of laws."""
        return not self.lacks(settings)

    def is_repeated(self, settings: Settings) -> bool:
        """Whether a judgement is more than chance: enough goes, from piece after piece, or nearly all of it.

        An end of a way may be met once or twice. Values that were fitted to one impact and foretell another one are not
        right by chance.
        """
        return self.least > settings.worth and (self.score > settings.score or self.least > settings.clear)

    def is_faint(self, settings: Settings, parts: int) -> bool:
        """Whether a judgement fails only by its score, and would count with more parts of the record."""
        enough = replace(self, score=math.sqrt(parts) * self.score)
        return not self.counts(settings) and enough.counts(settings)

    def lacks(self, settings: Settings) -> str:
        """Text on what a judgement lacks to count; "" where it counts."""
        if self.refuted:
            return f"it {self.words}, but {_adding(self.refuted, 'that of validation records')}"
        if self.least <= settings.worth:
            return f"it {self.words}; {rough_percent(settings.worth)} have to go"
        if not self.is_repeated(settings):
            return (
                f"it {self.words}, but not from piece after piece: "
                f"{self.score:.2g} standard deviations, {settings.score:g} are needed"
            )
        if self.size <= settings.slight:
            done = rough_percent(self.size)
            return f"it does {done} of what all effects of the model do, and no law is as exact as that"
        if self.beside <= settings.second and self.least <= settings.clear:
            return (
                f"it does {rough_percent(self.beside)} of what the effects that were found do, "
                f"and {rough_percent(settings.second)} may be what their laws are wrong by"
            )
        if self.shape <= settings.inexact:
            return (
                f"it does {rough_percent(self.shape)} of what the same states do there, and no law is as exact as that"
            )
        if self.alone >= 1.0 - settings.worth:
            return (
                f"it leaves {rough_percent(self.alone)} of the error power of a mass on which nothing acts: it makes "
                "the machine too heavy for its forces"
            )
        if self.overtone:
            return "it repeats along a whole fraction of the period of another effect there, and is an overtone of that"
        if self.explained <= settings.worth:
            return (
                f"it {self.words}, and as much of that of its mirror image: it answers otherwise to noise, "
                "and explains nothing"
            )
        if self.reshaped:
            return f"{self.reshaped} does as well by another shape of its law"
        if self.timed:
            return f"{self.timed}, do as well"
        if self.apart:
            return f"it {self.words}, but its contacts never meet: their roundings act as a spring"
        return ""


def _adding(share: float, what: str) -> str:
    """Text on a judgement of what makes errors larger: ``adds 3 % to the error power``."""
    if share >= MANY - 1.0:
        return f"makes {what} more than {MANY:g} times as large"
    return f"adds {rough_percent(share)} to {what}"
