"""Ambiguity: rival effects that explain the records as well as an accepted effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from vpm.discrepancy.diagnosis import Ambiguity
from vpm.discrepancy.findings import Measured


@dataclass(frozen=True)
class Rivals:
    """Rivals of an accepted effect, measured in its place."""

    effect: str
    site: str
    trials: tuple[Measured, ...]  #: Those that predict the validation data as well.

    @property
    def label(self) -> str:
        """Label of the ambiguous effect that rivals compete with: ``effect at site``."""
        return f"{self.effect} at {self.site}"


def listed(known: Sequence[Ambiguity], found: Sequence[Rivals]) -> tuple[Ambiguity, ...]:
    """Ambiguities for the result: those that the findings hold, and rivals found afterwards, each named once."""
    said = {(a.name, a.site, other) for a in known for other in a.others}
    more = []
    for entry in found:
        labels = (trial.label for trial in entry.trials)
        names = tuple(label for label in labels if (entry.effect, entry.site, label) not in said)
        if names:
            reason = "put in its place and fitted, it predicts the validation data as well"
            more.append(Ambiguity(entry.effect, entry.site, names, reason))
    return (*known, *more)
