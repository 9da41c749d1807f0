"""Diagnosis by tracker, for machines without inverse dynamics: a ranking names effects, its tracker measures them."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vpm.discrepancy.diagnosis import Diagnosis, Trace
from vpm.discrepancy.diagnosis_fields import of_findings, so_far
from vpm.discrepancy.findings import Measured
from vpm.discrepancy.judged_model import Judged
from vpm.discrepancy.preparation import Records, moved_far
from vpm.discrepancy.ranked_effects import fitted_in, staged, tracker_gaps
from vpm.discrepancy.screening.candidates import Candidate, asked_for, candidates
from vpm.discrepancy.verdict import only_if_open, verdict, without_effects
from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.identify import Estimate, InverseDynamicsProblem, estimate, gain, segments
from vpm.identify.estimation import beside_held, beside_stated, standing
from vpm.model import Model
from vpm.ranking.result import Ranked, Ranking
from vpm.ranking.settings import Settings
from vpm.ranking.substitute_records import shown
from vpm.ranking.tracked_records import TrackedRecords
from vpm.ranking.tracker_residual import TrackerResidual
from vpm.simulate import Setup

#: Said of machines whose efforts do not follow from their motion.
BY_TRACKER = (
    "{reason}: all is measured by what an observer of {band:g} Hz leaves of the logged channels, and residuals over "
    "states, pictures of efforts and discriminating experiments are left out"
)


@dataclass(frozen=True)
class _Followed:
    """Residual problems by tracker of training and validation records, and substitute efforts."""

    training: TrackerResidual
    validation: TrackerResidual
    stand_in: InverseDynamicsProblem


def diagnosed_by_tracker(
    ranking: Ranking,
    model: Model,
    records: Records,
    asked: tuple[Sequence[str] | None, int],
    setup: Setup,
    reason: str,
) -> Diagnosis:
    """Diagnosis by tracker from a ranking of the records, with the verdict on its errors.

    Parameters
    ----------
    ranking : Ranking
        Of the training records, measured on the validation records.
    model : Model
        As the user wrote it.
    records : tuple
        See `vpm.discrepancy.preparation`; notes are added.
    asked : tuple
        Effects to try, all if None, and how many at most.
    setup : Setup
        With the hold that the ranking found.
    reason : str
        Why no efforts can be balanced.

    Raises
    ------
    VpmError
        The model runs away from the records under every tracker.
    """
    (training, validation, notes), (effects, limit) = records, asked
    settings = Settings(effects=limit)
    data, band = _followed(ranking, model, (training, validation), settings, setup)
    nominal, recalibrated = _judged(model, (), data), _judged(ranking.recalibrated, model.adjustable, data)
    found = staged(
        ranking,
        recalibrated,
        lambda current, with_it, one: _beside(current, with_it, one, data, refit=with_it is not ranking.model),
        lambda final: _offered(final, data, effects),
        settings,
    )
    notes.append(BY_TRACKER.format(reason=reason, band=band))
    gap = tracker_gaps(ranking, None)
    if gap and (kept := only_if_open(found, recalibrated, gap)) is not found:
        found, gap = kept, without_effects(gap)
    notes.extend(moved_far(model, found.final))
    told = of_findings(model, records, nominal, found, (data.training, data.validation))
    if not gap:
        return told
    word, summary, _ = verdict(None, nominal, recalibrated, found, gap, None, None)
    traced = _traces(data.validation, nominal, found.final)
    return replace(told, verdict=word, summary=so_far(found, summary), gap=gap, traces=traced)


def deviations_by_tracker(
    ranking: Ranking, model: Model, records: Records, setup: Setup, names: Sequence[str]
) -> dict[str, float]:
    """Standard deviations by tracker of parameters of ranked effects; none where no tracker keeps the model.

    ``names``: those that an inverse-dynamics residual does not show, as the gain of a tachometer. All others are as
    sure as the records and the model file make them together.
    """
    found = ranking.model
    own, others = ([name for name in several if name in found.parameters] for several in (names, model.adjustable))
    with contextlib.suppress(VpmError, ArithmeticError):
        data, _ = _followed(ranking, model, records[:2], Settings(), setup)
        return beside_held(_standing(found, tuple(own), data.training), found, data.training, others).deviations
    return {}


def _followed(
    ranking: Ranking,
    model: Model,
    records: tuple[Sequence[Experiment], Sequence[Experiment]],
    settings: Settings,
    setup: Setup,
) -> tuple[_Followed, float]:
    """Residual problems by the slowest tracker that keeps the model on the records, and its bandwidth, Hz.

    Raises
    ------
    VpmError
        There is none.
    """
    fitted, kept = (TrackedRecords(model, several, settings, setup) for several in records)
    *others, last = settings.bands
    for band in (*others, last):
        training, validation = TrackerResidual(fitted, band), TrackerResidual(kept, band)
        try:
            for one in (model, ranking.recalibrated, ranking.model):
                training.evaluate(one, one.theta)
                validation.evaluate(one, one.theta)
        except (VpmError, ArithmeticError):
            if band == last:
                raise
            continue
        break
    return _Followed(training, validation, shown(model, fitted)), band


def _judged(model: Model, free: tuple[str, ...], data: _Followed) -> Judged:
    """Model judged by tracker at its values, with their standard deviations."""
    validation, _ = data.validation.evaluate(model, model.theta)
    return Judged(model, free, _standing(model, free, data.training), validation, None)


def _standing(model: Model, free: tuple[str, ...], training: TrackerResidual) -> Estimate:
    """Standard deviations of values by tracker; unknown where derivatives diverge, as behind a backlash.

    A ranking weighs what the model file states, so that its values are as sure as that where records show no scale.
    """
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            return beside_stated(standing(model, training, free), model, training)
    except (ValueError, ArithmeticError):
        still, unknown = standing(model, training, ()), np.full((len(free), len(free)), np.nan)
        values = model.theta[[model.index(name) for name in free]]
        jacobian = np.full((len(still.residual), len(free)), np.nan)
        return replace(still, names=free, values=values, jacobian=jacobian, covariance=unknown)


def _beside(current: Judged, model: Model, one: Ranked, data: _Followed, *, refit: bool) -> Measured:
    """Model with a ranked effect, measured by tracker on validation records.

    Values of the ranking are those beside all that it found. Where a part of that is left out, one linear step fits the
    rest to it, if that leaves less of the training records.

    Raises
    ------
    VpmError
        The model runs away from the records.
    """
    known, own = fitted_in(current, model, one)
    judged = _judged(model, (*known, *own), data)
    if refit:
        first = estimate(model, data.training, judged.free, linear_only=True)
        if first.interrupted:
            raise KeyboardInterrupt
        moved = _judged(first.on(model), judged.free, data)
        judged = min(judged, moved, key=lambda each: float(each.fit.residual @ each.fit.residual))
    gained = gain(current.validation, judged.validation, segments(data.validation))
    return Measured(one.key, judged, gained, own)


def _offered(final: Judged, data: _Followed, effects: Sequence[str] | None) -> tuple[Candidate, ...]:
    """All candidate effects that could still be missing in a diagnosis by tracker."""
    residual, _ = data.stand_in.evaluate(final.model, final.model.theta)
    return candidates(final.model, data.stand_in, residual, asked_for(effects))


def _traces(problem: TrackerResidual, nominal: Judged, final: Judged) -> tuple[Trace, ...]:
    """Channels of the first validation record beside the tracker's outputs."""
    record = problem.tracked.experiments[0]
    found = []
    for block in problem.blocks[: len(problem.blocks) // len(problem.tracked.experiments)]:
        measured = np.interp(block.time, record.time, record[block.channel])
        before, after = (measured - one.validation[block.samples] / block.weight for one in (nominal, final))
        found.append(Trace(record.name, block.channel, block.unit, problem.mode, block.time, measured, before, after))
    return tuple(found)
