"""Fits of many proposals in a race: those that cannot win are given up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.ranking.fit import Fitted, Fitter
from vpm.ranking.look import Look
from vpm.ranking.proposals import Proposal
from vpm.ranking.tried_effect import is_part


def raced(chosen: Sequence[Proposal], look: Look, fitter: Fitter, each: ParallelCandidates) -> list[Fitted]:
    """Fits of the proposals that may win the race.

    Each has to gain what makes it worth while. The most promising one is fitted first, then the next two, four, and so
    on. Each has to save a share of the cost that the best one before saved (O. Maron and A. Moore, *Advances in Neural
    Information Processing Systems* 6, 1994: those that cannot win leave a race early); where a fit takes derivatives of
    its own, by its prediction already. A part of another one is fitted all the same: a rotor may seem to gain little
    where a spring takes it along. The outcome does not depend on how many are fitted at a time.

    Parameters
    ----------
    chosen : sequence of Proposal
    look : Look
        What there is without them.
    fitter : Fitter
    each : ParallelCandidates
    """
    ordered = sorted(chosen, key=lambda one: -one.gain)
    model, keys = look.fitted.structure.model, {one.key for one in chosen}
    parts = [one for one in ordered[1:] if any(is_part(model, one.key, key) for key in keys)]
    ends, wanted = list[Fitted](), look.needed
    for several in _doubling([one for one in ordered if one not in parts]):
        hopeful = [one for one in several if one.neutral or fitter.settings.patience * one.gain >= wanted]
        ended = _fitted(hopeful, wanted, look, fitter, each)
        wanted = max([wanted, *(fitter.settings.share * (look.fitted.cost - one.cost) for one in ended)])
        ends += ended
    return ends + _fitted(parts, look.needed, look, fitter, each)


def _doubling(ordered: Sequence[Proposal]) -> Iterator[Sequence[Proposal]]:
    """Proposals in their order: one, the next two, the next four, and so on."""
    begin = 0
    while begin < len(ordered):
        yield ordered[begin : 2 * begin + 1]
        begin = 2 * begin + 1


def _fitted(
    several: Sequence[Proposal], wanted: float, look: Look, fitter: Fitter, each: ParallelCandidates
) -> list[Fitted]:
    def one_fitted(one: Proposal) -> Fitted:
        view, residual = one.seen_in(look)
        return fitter.fitted(one.structure, look.fitted.tracker, view, look.fitted.cost - wanted, residual, rough=True)

    ends = each("fitting", one_fitted, several, lambda one: " at ".join(one.structure.effects[-1]))
    return [end for end in ends if isinstance(end, Fitted)]
