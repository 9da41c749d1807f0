"""An effect that was tried beside what had been found."""

from __future__ import annotations

from dataclasses import dataclass

from vpm.catalogue import EFFECTS
from vpm.discrepancy.candidates import Key
from vpm.ranking.fit import Fitted
from vpm.ranking.judgement import Judgement
from vpm.ranking.look import Look


@dataclass(frozen=True, eq=False)
class Trial:
    """An effect beside what was found, under one observer."""

    key: Key
    fitted: Fitted
    look: Look
    judgement: Judgement
    evidence: float = float("nan")
    rivals: tuple[str, ...] = ()

    @classmethod
    def of(cls, fitted: Fitted, look: Look, key: Key | None = None) -> Trial:
        """One of the effects of a structure, the last one if not told."""
        key = key or fitted.structure.effects[-1]
        return cls(key, fitted, look, look.judged(fitted, key))

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

    @property
    def numbers(self) -> int:
        """How many are unknown in it."""
        return len(self.fitted.structure.priors)
