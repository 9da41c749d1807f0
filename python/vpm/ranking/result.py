"""Result of a ranking."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vpm.catalogue.kinds import Side, in_words
from vpm.discrepancy.settings import FLOOR_FACTOR
from vpm.model import Model
from vpm.ranking.judgement import Judgement
from vpm.ranking.settings import Settings
from vpm.results import Result, Storable
from vpm.simulate.setup import HOLDS


@dataclass(frozen=True, repr=False, eq=False)
class Ranked(Storable):
    """Ranked effect in the result: it was tried, and judged.

    Attributes
    ----------
    effect, site : str
    values : dict
        Its parameters, SI.
    judgement : Judgement
        What it removes of the error.
    band : float
        Bandwidth of the tracker under which it does so, Hz.
    side : {"motor", "link"}
        Of a joint that is split.
    evidence : float
        Nats that it adds to the evidence of the structure without it; NaN of effects that were not fitted to the end.
    probability : float
        That this is what is missing next, and not another one that was fitted to the end, or none; NaN likewise.
    rivals : tuple of str
        Effects that the records do not tell from it.
    class_probability : float
        That it is this or one of these.
    """

    effect: str
    site: str
    values: dict[str, float]
    judgement: Judgement
    band: float
    side: Side = "motor"
    evidence: float = float("nan")
    probability: float = float("nan")
    rivals: tuple[str, ...] = ()
    class_probability: float = float("nan")

    @property
    def key(self) -> tuple[str, str]:
        """Effect and site of a ranked effect in the result."""
        return self.effect, self.site

    @property
    def place(self) -> str:
        """Site and side of a ranked effect in words, for the result."""
        return in_words(self.site, self.side)


@dataclass(frozen=True, repr=False, eq=False)
class Gap(Storable):
    """Error in the result of a ranking: root mean square of a tracked validation channel at each stage.

    Attributes
    ----------
    before, recalibrated, after : float
        Of the model as it was, with fitted parameters, and with what was found, in ``unit``; NaN where it runs away.
    unit : str
    left : float
        Share of the error power above the noise that effects leave; NaN if not known. It refers to the error of the
        recalibrated model or, if that is less, of masses on which nothing acts.
    noise : float
        What noise alone leaves, as far as it is white; NaN if not known.
    signal : float
        Root mean square of the channel about its mean.
    explained : float
        Error without the effects of the model whose laws are not exact, found ones included. It is no more than the
        motion itself, and the same as with them where there are none.
    """

    before: float
    recalibrated: float
    after: float
    unit: str
    left: float
    noise: float
    signal: float
    explained: float = float("nan")

    def is_within_laws(self, settings: Settings) -> bool:
        """Whether a channel error in a ranking result is within the errors of the model's laws."""
        return self.after <= settings.slight * self.explained

    @property
    def is_noise(self) -> bool:
        """Whether a channel error in a ranking result is no more than its noise."""
        return self.after <= FLOOR_FACTOR * self.noise


@dataclass(frozen=True, repr=False, eq=False)
class Ranking(Result):
    """Ranking result: the effects that a model is missing, in the order in which they were found.

    Attributes
    ----------
    effects : tuple of Ranked
        What was added, at the values of the model.
    rounds : tuple of tuple of Ranked
        All that was fitted beside what had been found before, the best first.
    model : Model
        With what was added, at its most probable values.
    recalibrated : Model
        As it was, its uncertain parameters fitted.
    gaps : dict of str to Gap
        By channel, on validation records; empty if there are none, or Ctrl-C came before they were measured.
    interrupted : bool
        Ctrl-C ended the search, where there may be more, or the measuring of what it found.
    hold : str
        What commands were taken to do between samples, see `Setup.hold`; pass it on to simulate the model.
    notes : tuple of str
        Records of which the model leaves an error that others do not show.
    """

    effects: tuple[Ranked, ...]
    rounds: tuple[tuple[Ranked, ...], ...]
    model: Model
    recalibrated: Model
    gaps: dict[str, Gap] = field(default_factory=dict)
    interrupted: bool = False
    hold: str = HOLDS[0]
    notes: tuple[str, ...] = ()

    @property
    def left(self) -> dict[str, float]:
        """Result by joint or other channel owner: share of validation error power that effects leave.

        Of its channel that they explain best.
        """
        found: dict[str, float] = {}
        for channel, gap in self.gaps.items():
            owner = channel.rpartition(".")[0]
            if np.isfinite(gap.left):
                found[owner] = min(gap.left, found.get(owner, np.inf))
        return found

    def is_within_laws(self, settings: Settings) -> bool:
        """Whether channel errors of a ranking result are within the errors of laws, but for channels of noise alone."""
        within = [gap.is_within_laws(settings) for gap in self.gaps.values()]
        return any(within) and all(fine or gap.is_noise for fine, gap in zip(within, self.gaps.values(), strict=True))

    def _headline(self) -> Mapping[str, object]:
        return {f"{one.effect} at {one.place}": one.judgement.removed for one in self.effects} or {"effects": "none"}

    def _frame_columns(self) -> Mapping[str, object]:
        tried = [(number + 1, one) for number, several in enumerate(self.rounds) for one in several]
        own = ("effect", "site", "band", "evidence", "probability")
        told = ("removed", "least", "score", "size", "beside", "shape")
        return {
            "round": [number for number, _ in tried],
            **{name: [getattr(one, name) for _, one in tried] for name in own},
            **{name: [getattr(one.judgement, name) for _, one in tried] for name in told},
        }
