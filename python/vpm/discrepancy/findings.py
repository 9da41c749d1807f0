"""Findings of a diagnosis: effects that came in one by one, each with its model, and what was refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from vpm.catalogue.kinds import Side, in_words
from vpm.discrepancy.diagnosis import Ambiguity, RankedCandidate, RefusedEffect
from vpm.discrepancy.judged_model import Judged
from vpm.discrepancy.screening.candidates import Key
from vpm.identify import Gain
from vpm.model import Model


@dataclass(frozen=True)
class Alias:
    """Parameter held at its start, because data show it only together with another one."""

    parameter: str
    partner: str


@dataclass(frozen=True)
class Measured:
    """Measured effect: the model with it, refitted, and its gain on validation records."""

    key: Key
    judged: Judged
    validation: Gain
    free: tuple[str, ...]  #: Dotted names of the effect's parameters that the residual identifies.
    held: tuple[Alias, ...] = ()  #: Those that it does not discriminate from others.
    invisible: tuple[str, ...] = ()  #: Those without any influence on it.

    @property
    def label(self) -> str:
        """Label of a measured effect: ``effect at site``."""
        return " at ".join(self.key)


@dataclass(frozen=True)
class Accepted:
    """Accepted effect as it was measured, and rivals that would do as well.

    With its evidence in nats, its probability and its side of a joint that is split.
    """

    measured: Measured
    rivals: tuple[str, ...]
    evidence: float = float("nan")
    probability: float = float("nan")
    side: Side = "motor"
    class_probability: float = float("nan")

    @property
    def key(self) -> Key:
        """Effect and site of an accepted effect."""
        return self.measured.key

    @property
    def label(self) -> str:
        """Label of an accepted effect: ``effect at site``, with its side behind what gives way."""
        return in_words(self.measured.label, self.side)


@dataclass(frozen=True)
class Stage:
    """Stage of the findings, with its model; ``change`` is "recalibrated", "added" or "removed"."""

    change: str
    effect: str
    site: str
    judged: Judged


@dataclass(frozen=True)
class Findings:
    """Findings of a ranking, also of one that Ctrl-C ended.

    ``left`` is by joint the share of validation error power that effects leave under its tracker, ``ranked`` its model,
    and ``within_laws`` says whether that leaves less than the errors of laws.
    """

    stages: tuple[Stage, ...]
    accepted: tuple[Accepted, ...]
    refused: tuple[RefusedEffect, ...]
    ranking: tuple[RankedCandidate, ...]
    interrupted: bool = False
    left: Mapping[str, float] = field(default_factory=dict)
    ranked: Model | None = None
    within_laws: bool = False

    @property
    def final(self) -> Judged:
        """Final model of the findings."""
        return self.stages[-1].judged


def ambiguities(accepted: Sequence[Accepted]) -> tuple[Ambiguity, ...]:
    """Ambiguities of the findings: rivals of an accepted effect in its round, and parameters held beside it."""
    found = []
    for entry in accepted:
        if entry.rivals:
            reason = "the records do not discriminate them"
            found.append(Ambiguity(*entry.key, entry.rivals, reason))
        for alias in entry.measured.held:
            reason = f"{alias.parameter} was held at its start: these data show it only together with {alias.partner}"
            found.append(Ambiguity(*entry.key, (alias.partner,), reason))
    return tuple(found)
