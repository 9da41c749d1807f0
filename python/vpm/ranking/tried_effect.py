"""An effect that was tried beside what had been found."""

from __future__ import annotations

from dataclasses import dataclass

from vpm.catalogue import EFFECTS
from vpm.discrepancy.screening.candidates import Key
from vpm.model import Model
from vpm.ranking.fit import Fitted
from vpm.ranking.judgement import Judgement
from vpm.ranking.look import Look


@dataclass(frozen=True, eq=False)
class Trial:
    """An effect beside what was found, under one tracker."""

    key: Key
    fitted: Fitted
    look: Look
    judgement: Judgement
    evidence: float = float("nan")
    rivals: tuple[str, ...] = ()

    @classmethod
    def of(cls, fitted: Fitted, look: Look, key: Key | None = None, *, ended: bool = True) -> Trial:
        """One of the effects of a structure, the last one if not told; of a fit that has ``ended``, or only begun."""
        key = key or fitted.structure.effects[-1]
        return cls(key, fitted, look, look.judged(fitted, key, ended=ended))

    @property
    def counts(self) -> bool:
        """Whether it is shown, and does more than chance and more than what laws are wrong by."""
        return self.fitted.structure.shows(self.key) and self.judgement.counts(self.look.settings)

    @property
    def splits(self) -> bool:
        """Whether it splits a joint."""
        now, before = (one.structure.model.added_joints for one in (self.fitted, self.look.fitted))
        return len(now) > len(before)

    @property
    def left(self) -> float:
        """Share of the error power that it leaves."""
        return 1.0 - self.judgement.removed

    @property
    def label(self) -> str:
        """``effect at site``."""
        return " at ".join(self.key)

    @property
    def is_instrument(self) -> bool:
        """Whether it is a fault of a sensor, and none of the machine."""
        return EFFECTS[self.key[0]].site == "sensor"

    def contains(self, other: Trial) -> bool:
        """Whether it is the other effect at some values of its parameters."""
        return is_part(self.look.fitted.structure.model, other.key, self.key)

    @property
    def order(self) -> tuple[bool, int, int]:
        """Which comes first where records cannot tell: parts of the machine, then the plainest, then the commonest.

        The catalogue lists commoner effects first.
        """
        return self.is_instrument, self.numbers, list(EFFECTS).index(self.key[0])

    @property
    def numbers(self) -> int:
        """How many are unknown in it."""
        return len(self.fitted.structure.priors)


def is_part(model: Model, plainer: Key, richer: Key) -> bool:
    """Whether an effect is what a richer one is at some values of its parameters, at its joint or that of its body."""
    (name, site), (other, place) = plainer, richer
    return name in EFFECTS[other].contains and (site == place or model.joint_of_body(place) == site)
