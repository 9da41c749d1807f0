"""One effect at several places at once: drives of one kind may all lack the same effect."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.ranking.fit import Fitter, View
from vpm.ranking.look import Look
from vpm.ranking.model_structure import Structure
from vpm.ranking.tried_effect import Trial


def alike(tried: Sequence[Trial], most: int, fitter: Fitter, each: ParallelCandidates) -> list[Trial]:
    """Fits of one effect at several places together, ``most`` effects at a time, by the error that they leave.

    Joints that move each other hide such an effect from each other. A command that is delayed at one drive alone would
    need a force at the next drive that no log holds.

    Parameters
    ----------
    tried : sequence of Trial
        Each effect alone.
    most : int
        Effects that a structure may still take.
    fitter : Fitter
    each : ParallelCandidates
    """
    several: dict[tuple[Look, str], dict[str, Trial]] = defaultdict(dict)
    for trial in sorted(tried, key=lambda one: one.left):
        name, site = trial.key
        several[trial.look, name].setdefault(site, trial)
    groups = [list(places.values()) for places in several.values() if 1 < len(places) <= most]

    def one_fitted(group: Sequence[Trial]) -> Trial:
        structure, look = _joined(group), group[0].look
        least = min(one.fitted.cost for one in tried if one.look is look)
        view, goal = View(look.view.noise), min(look.fitted.cost - look.needed, least)
        begun = fitter.fitted(structure, look.fitted.tracker, view, goal)
        return Trial.of(fitter.finished(begun, view) if begun.cost < goal else begun, look, ended=begun.cost < goal)

    ends = each("fitting at several places", one_fitted, groups, lambda group: group[0].key[0])
    return sorted((end for end in ends if isinstance(end, Trial)), key=lambda end: end.left)


def _joined(group: Sequence[Trial]) -> Structure:
    """Structure with one effect at several places, each with the values of its own fit.

    Where that led nowhere they begin at a size that is nothing unusual, one deviation of what is known of them.
    """
    first, *others = (_begun(trial) for trial in group)
    for other in others:
        first = first.with_last_of(other)
    return first


def _begun(trial: Trial) -> Structure:
    structure, known = trial.fitted.structure, trial.look.fitted.structure.priors
    if trial.fitted.cost < trial.look.fitted.cost:
        return structure
    fresh = np.array([name not in known for name in structure.priors])
    return structure.at(np.where(fresh, 1.0, structure.standard))
