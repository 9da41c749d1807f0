"""Discrimination of rivals of an accepted effect by closed-loop predictions of the model.

Examples are a constant force and a tilted world, or a delay and direction-dependent friction. Beside other missing
effects, or in a record of few reversals, the inverse-dynamics residual hardly separates them.
"""

from __future__ import annotations

from collections.abc import Sequence

from vpm.discrepancy.confirmation.confirmation import Data, Trial
from vpm.discrepancy.confirmation.prediction_comparison import (
    WORTH_A_FIT,
    compared,
    criterion,
    fitted_prediction,
    predicted,
)
from vpm.discrepancy.confirmation.refusal import Thresholds, impossible_trial
from vpm.discrepancy.confirmation.whittle_likelihood import ClosedLoopPrediction
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.discrepancy.rivals.ambiguity import Rivals
from vpm.discrepancy.rivals.rival_exchange import exchanged
from vpm.discrepancy.search.search import Search


def discriminated(
    found: Search, known: Sequence[Rivals], data: Data, each: ParallelCandidates
) -> tuple[Search, tuple[Rivals, ...]]:
    """Exchange an effect for the rival that predictions discriminate clearly, on training and validation records.

    Returns
    -------
    found : Search
        The same one if every effect stays.
    known : tuple of Rivals
    """
    tried = [(place, trial) for place, rivals in enumerate(known) for trial in rivals.tried]
    interval = min(m.dt for m in data.training.motions)
    possible = [
        (place, trial)
        for place, trial in tried
        if trial.probe.candidate.key not in found.gone and _possible(trial, interval)
    ]
    before = predicted(found.final, data) if possible else None
    if before is None:
        return found, tuple(known)
    runs = each(
        "discriminating rivals: running",
        lambda one: predicted(one[1].judged, data) or "",
        possible,
        lambda one: one[1].probe.candidate.label,
    )
    better = [
        (criterion(run), place, trial, run)
        for (place, trial), run in zip(possible, runs, strict=True)
        if isinstance(run, ClosedLoopPrediction) and criterion(run) < criterion(before) - WORTH_A_FIT
    ]
    if not better:
        return found, tuple(known)
    first = fitted_prediction(before, data)
    thresholds = Thresholds(len(possible), interval)
    for _, place, trial, run in sorted(better, key=lambda one: one[0]):
        second = fitted_prediction(run, data)
        comparison = None if first is None or second is None else compared(first, second, data)
        if comparison is not None and comparison.sure(thresholds):
            return exchanged(found, known, data, place, trial, "in its place is what closed-loop predictions support")
    return found, tuple(known)


def _possible(trial: Trial, interval: float) -> bool:
    return not trial.diverged and bool(trial.parameters) and not impossible_trial(trial, interval)
