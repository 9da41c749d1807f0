"""An accepted effect and what would do in its place, told apart by runs of the model itself.

A constant force and a tilted world, a late drive and friction that differs with the direction: beside other effects
that are missing, or in a record of few reversals, a balance of effort knows little of which it is.
"""

from __future__ import annotations

from collections.abc import Sequence

from vpm.discrepancy.ambiguity import Rivals
from vpm.discrepancy.confirmation import Data, Trial
from vpm.discrepancy.own_run import OwnRun
from vpm.discrepancy.refusal import Thresholds, impossible_trial
from vpm.discrepancy.runs import WORTH_A_FIT, compared, criterion, first_run, fitted_run
from vpm.discrepancy.search import Search
from vpm.discrepancy.side_by_side import SideBySide
from vpm.discrepancy.standing import exchanged


def told_apart(
    found: Search, known: Sequence[Rivals], data: Data, each: SideBySide
) -> tuple[Search, tuple[Rivals, ...]]:
    """Let the rival that runs ask for most take the place of its effect, if training and unseen records are sure of it.

    Returns
    -------
    found : Search
        The same one if every effect stays.
    known : tuple of Rivals
    """
    tried = [(place, trial) for place, rivals in enumerate(known) for trial in rivals.tried]
    interval = min(m.dt for m in data.training.motions)
    asked = [
        (place, trial)
        for place, trial in tried
        if trial.probe.candidate.key not in found.gone and _possible(trial, interval)
    ]
    before = first_run(found.final, data) if asked else None
    if before is None:
        return found, tuple(known)
    runs = each(
        "telling apart: running",
        lambda one: first_run(one[1].judged, data) or "",
        asked,
        lambda one: one[1].probe.candidate.label,
    )
    better = [
        (criterion(run), place, trial, run)
        for (place, trial), run in zip(asked, runs, strict=True)
        if isinstance(run, OwnRun) and criterion(run) < criterion(before) - WORTH_A_FIT
    ]
    if not better:
        return found, tuple(known)
    first = fitted_run(before, data)
    thresholds = Thresholds(len(asked), interval)
    for _, place, trial, run in sorted(better, key=lambda one: one[0]):
        second = fitted_run(run, data)
        told = None if first is None or second is None else compared(first, second, data)
        if told is not None and told.sure(thresholds):
            return exchanged(found, known, data, place, trial, "in its place is what runs of the model itself ask for")
    return found, tuple(known)


def _possible(trial: Trial, interval: float) -> bool:
    return not trial.diverged and bool(trial.parameters) and not impossible_trial(trial, interval)
