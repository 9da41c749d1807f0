"""Fits of many proposals, of which those are given up that cannot bring what is needed."""

from __future__ import annotations

from collections.abc import Sequence

from vpm.discrepancy.side_by_side import SideBySide
from vpm.ranking.fit import Fitted, Fitter
from vpm.ranking.proposals import Proposal, Reference

#: A proposal with the cost that it has to come below.
Entry = tuple[Proposal, float]


def raced(
    chosen: Sequence[Proposal], needed: Sequence[float], fitter: Fitter, each: SideBySide
) -> list[tuple[Fitted, Proposal]]:
    """Fits of proposals that may come to the evidence that is needed.

    Of each look the most promising one is fitted first. Another one has to save a share of the cost that this one saved
    (O. Maron and A. Moore, *Advances in Neural Information Processing Systems* 6, 1994: those that cannot win leave a
    race early). The outcome does not depend on how many are fitted at a time.

    Parameters
    ----------
    chosen : sequence of Proposal
    needed : sequence of float
        Evidence that each has to come to, nats.
    fitter : Fitter
    each : SideBySide
    """
    settings = fitter.settings
    entries = [(one, _goal(one, evidence)) for one, evidence in zip(chosen, needed, strict=True)]
    hopeful = [
        (one, goal)
        for one, goal in entries
        if not one.neutral or one.reference.cost - settings.patience * one.gain < goal
    ]
    leaders: dict[Reference, Entry] = {}
    for entry in sorted(hopeful, key=lambda entry: -entry[0].gain):
        leaders.setdefault(entry[0].reference, entry)
    first = _fitted(list(leaders.values()), fitter, each)
    behind = {
        one.reference: one.reference.cost - settings.share * (one.reference.cost - fitted.cost) for fitted, one in first
    }
    others = [
        (one, min(goal, behind.get(one.reference, goal)))
        for one, goal in hopeful
        if leaders[one.reference][0] is not one
    ]
    return first + _fitted(others, fitter, each)


def _goal(one: Proposal, needed: float) -> float:
    """Cost at which it comes to the evidence that is needed, where one follows the other."""
    return one.reference.cost - (needed - one.reference.fitted.evidence)


def _fitted(entries: Sequence[Entry], fitter: Fitter, each: SideBySide) -> list[tuple[Fitted, Proposal]]:
    def searched(entry: Entry) -> Fitted:
        one, goal = entry
        return fitter.searched(one.structure, one.observer, one.view, goal, one.residual)

    ends = each("fitting", searched, entries, lambda entry: " at ".join(entry[0].key))
    return [(end, one) for end, (one, _) in zip(ends, entries, strict=True) if isinstance(end, Fitted)]
