"""Fits of many proposals in a race: those that cannot win are given up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.ranking.fit import Fitted, Fitter
from vpm.ranking.look import Look
from vpm.ranking.proposals import Proposal
from vpm.ranking.tried_effect import is_part


def raced(
    chosen: Sequence[Proposal], look: Look, fitter: Fitter, each: ParallelCandidates, saved: float = 0.0
) -> list[Fitted]:
    """Fits of the proposals that may win the race.

    Each has to gain what makes it worth while. The most promising one is fitted first, then the next two, four, and so
    on. Each has to save a share of the cost that the best one before saved (O. Maron and A. Moore, *Advances in Neural
    Information Processing Systems* 6, 1994: those that cannot win leave a race early); where a fit takes derivatives of
    its own, by its prediction already. Where the best one saved more than its first step predicted, contacts closed or
    opened on the way. Others of that kind may as well, so their predictions are compared with its own. A part of
    another one is fitted all the same: a rotor may seem to gain little where a spring takes it along. The outcome does
    not depend on how many are fitted at a time.

    Parameters
    ----------
    chosen : sequence of Proposal
    look : Look
        What there is without them.
    fitter : Fitter
    each : ParallelCandidates
    saved : float
        Cost that another fit has saved, nats.
    """
    ordered = sorted(chosen, key=lambda one: -one.gain)
    model, keys = look.fitted.structure.model, {one.key for one in chosen}
    parts = [one for one in ordered[1:] if any(is_part(model, one.key, key) for key in keys)]
    least = max(look.needed, fitter.settings.share * saved)
    ends, wanted = list[Fitted](), _Wanted(least, least)
    for several in _doubling([one for one in ordered if one not in parts]):
        hopeful = [one for one in several if one.neutral or fitter.settings.patience * one.gain >= wanted.of(one)]
        ended = _fitted(hopeful, wanted, look, fitter, each)
        for one, end in ended:
            wanted = wanted.after(look.fitted.cost - end.cost, one, fitter.settings.share)
        ends += [end for _, end in ended]
    return ends + [end for _, end in _fitted(parts, _Wanted(least, least), look, fitter, each)]


@dataclass(frozen=True)
class _Wanted:
    """Gain, nats, that a fit of a race has to promise: of effects that do nothing where they begin, and of others."""

    neutral: float
    other: float

    def of(self, one: Proposal) -> float:
        """What the fit of a proposal has to promise."""
        return self.neutral if one.neutral else self.other

    def after(self, saved: float, one: Proposal, share: float) -> _Wanted:
        """What is wanted after the fit of a proposal, of whose gain others have to promise a ``share``."""
        return _Wanted(max(self.neutral, share * saved), max(self.other, share * min(saved, one.gain)))


def _doubling(ordered: Sequence[Proposal]) -> Iterator[Sequence[Proposal]]:
    """Proposals in their order: one, the next two, the next four, and so on."""
    begin = 0
    while begin < len(ordered):
        yield ordered[begin : 2 * begin + 1]
        begin = 2 * begin + 1


def _fitted(
    several: Sequence[Proposal], wanted: _Wanted, look: Look, fitter: Fitter, each: ParallelCandidates
) -> list[tuple[Proposal, Fitted]]:
    def one_fitted(one: Proposal) -> Fitted:
        (view, residual), goal = one.seen_in(look), look.fitted.cost - wanted.of(one)
        return fitter.fitted(one.structure, look.fitted.tracker, view, goal, residual, rough=True)

    ends = each("fitting", one_fitted, several, lambda one: " at ".join(one.structure.effects[-1]))
    return [(one, end) for one, end in zip(several, ends, strict=True) if isinstance(end, Fitted)]
