"""What a ranking gives back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from vpm.catalogue.kinds import Side, in_words
from vpm.model import Model
from vpm.results import Result, Storable


@dataclass(frozen=True, repr=False, eq=False)
class Ranked(Storable):
    """An effect that was tried.

    Attributes
    ----------
    effect, site : str
    evidence : float
        Nats that it adds to the evidence of the structure without it.
    values : dict
        Its parameters, SI.
    needed : float
        Evidence that it has to add to be accepted, nats.
    probability : float
        That this is what is missing beside what had been found before, and not another effect or none.
    rivals : tuple of str
        Effects that the records do not tell from it.
    side : {"motor", "link"}
        Of a joint that is split.
    """

    effect: str
    site: str
    evidence: float
    values: dict[str, float]
    needed: float = 0.0
    probability: float = float("nan")
    rivals: tuple[str, ...] = ()
    side: Side = "motor"

    @property
    def key(self) -> tuple[str, str]:
        """Effect and site."""
        return self.effect, self.site

    @property
    def place(self) -> str:
        """Site and side in words."""
        return in_words(self.site, self.side)


@dataclass(frozen=True, repr=False, eq=False)
class Gap(Storable):
    """Root mean square of what a slow observer leaves of a channel of validation records, at each stage.

    Attributes
    ----------
    before, recalibrated, after : float
        Of the model as it was, with fitted parameters, and with what was found, in ``unit``; NaN where it runs away.
    unit : str
    """

    before: float
    recalibrated: float
    after: float
    unit: str


@dataclass(frozen=True, repr=False, eq=False)
class Ranking(Result):
    """What a model is missing, in the order in which it was found.

    Attributes
    ----------
    effects : tuple of Ranked
        What was added.
    rounds : tuple of tuple of Ranked
        All that was fitted beside what had been found before, the best first.
    model : Model
        With what was added, at its most probable values.
    band : float
        Bandwidth of the observer under which the records are most probable, Hz: the smaller, the less is left.
    log_likelihood : float
        Of the records under ``model``.
    complete : float
        Probability that nothing else of the catalogue is missing; NaN where the search ended at its most effects.
    gaps : dict of str to Gap
        By channel, on records that decided nothing; empty if there are none.
    """

    effects: tuple[Ranked, ...]
    rounds: tuple[tuple[Ranked, ...], ...]
    model: Model
    band: float
    log_likelihood: float
    complete: float
    gaps: dict[str, Gap] = field(default_factory=dict)

    def _headline(self) -> Mapping[str, object]:
        return {f"{one.effect} at {one.place}": one.evidence for one in self.effects} or {"effects": "none"}

    def _frame_columns(self) -> Mapping[str, object]:
        tried = [(number + 1, one) for number, several in enumerate(self.rounds) for one in several]
        return {
            "round": [number for number, _ in tried],
            "effect": [one.effect for _, one in tried],
            "site": [one.site for _, one in tried],
            "evidence": [one.evidence for _, one in tried],
            "needed": [one.needed for _, one in tried],
            "probability": [one.probability for _, one in tried],
        }
