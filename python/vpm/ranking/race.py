"""Fits of many proposals, of which those are given up that cannot win."""

from __future__ import annotations

import math
from collections.abc import Sequence

from vpm.discrepancy.side_by_side import SideBySide
from vpm.ranking.fit import Fitted, Fitter
from vpm.ranking.look import Look
from vpm.ranking.proposals import Proposal


def raced(chosen: Sequence[Proposal], fitter: Fitter, each: SideBySide) -> list[tuple[Fitted, Proposal]]:
    """Fits of proposals that may win.

    Of each look the most promising one is fitted first. Another one has to save a share of the cost that this one saved
    (O. Maron and A. Moore, *Advances in Neural Information Processing Systems* 6, 1994: those that cannot win leave a
    race early). The outcome does not depend on how many are fitted at a time.

    Parameters
    ----------
    chosen : sequence of Proposal
    fitter : Fitter
    each : SideBySide
    """
    leaders: dict[Look, Proposal] = {}
    for one in sorted(chosen, key=lambda one: -one.gain):
        leaders.setdefault(one.look, one)
    first = _fitted(list(leaders.values()), [math.inf] * len(leaders), fitter, each)
    goals = {
        one.look: one.look.fitted.cost - fitter.settings.share * max(one.look.fitted.cost - fitted.cost, 0.0)
        for fitted, one in first
    }
    others = [one for one in chosen if leaders[one.look] is not one]
    return first + _fitted(others, [goals.get(one.look, math.inf) for one in others], fitter, each)


def _fitted(
    several: Sequence[Proposal], goals: Sequence[float], fitter: Fitter, each: SideBySide
) -> list[tuple[Fitted, Proposal]]:
    def one_fitted(entry: tuple[Proposal, float]) -> Fitted:
        one, goal = entry
        return fitter.fitted(one.structure, one.look.fitted.observer, one.view, goal, one.residual)

    entries = list(zip(several, goals, strict=True))
    ends = each("fitting", one_fitted, entries, lambda entry: " at ".join(entry[0].key))
    return [(end, one) for end, one in zip(ends, several, strict=True) if isinstance(end, Fitted)]
