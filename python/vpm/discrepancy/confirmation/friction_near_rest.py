"""Friction near rest, judged by closed-loop predictions of the model.

Such friction acts for milliseconds while a joint breaks away. The filter of a measured motion smears that instant. The
inverse-dynamics residual hardly shows it, and takes part of it for friction at small speeds. In closed loop a machine
sticks when its model sticks. So the model predicts the training records without and with the effect
(`vpm.discrepancy.confirmation.whittle_likelihood`). The validation records then give the share of the change that they
support: zero for an absent effect, one for a present effect.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Data, Judged, Trial, confirm, judge
from vpm.discrepancy.confirmation.delay_in_motion import WITHIN
from vpm.discrepancy.confirmation.reference_response import against, part
from vpm.discrepancy.confirmation.refusal import MODEST_FACTOR, Thresholds
from vpm.discrepancy.confirmation.whittle_likelihood import (
    SMOOTHED,
    ClosedLoopPrediction,
    fit_prediction,
    least,
    misfit,
    predict,
    spectra,
    weighted,
)
from vpm.discrepancy.screening.candidates import Candidate
from vpm.discrepancy.screening.probe import Probe, impossible_values
from vpm.errors import VpmError
from vpm.identify import Gain
from vpm.identify.response_along_motion import bends, has_own_drives
from vpm.model import Model

#: Share of the change from one prediction to another from which on records support it rather than no change.
LEAST_SUPPORT = 0.5
#: Starts that are fitted to the end, of those that fit best as they are.
FITTED = 2
#: Sizes with which a fit may begin, as shares of the Coulomb friction.
SIZES = (0.1, 0.4, 1.6)


@dataclass(frozen=True)
class Support:
    """Support of records for friction near rest: share of the change between two predictions."""

    #: Gain on the error of the run without the effect, relative to the noise at each frequency. The weight is the
    #: supported share of the change, beside all other parameters.
    training: Gain
    validation: Gain
    run: ClosedLoopPrediction  #: With the effect, fitted to the training records.


def needs_prediction(current: Judged, data: Data, probe: Probe) -> bool:
    """Whether a candidate is friction near rest that a closed-loop prediction has to judge.

    Links that bend and drives with states take too long for that.
    """
    if not probe.candidate.effect.close_to_rest or not probe.free or impossible_values(probe):
        return False
    closed = data.simulation is not None and data.simulation.mode == "closed_loop"
    return closed and not bends(current.model) and not has_own_drives(current.model)


def prediction_without(current: Judged, data: Data) -> ClosedLoopPrediction | None:
    """Closed-loop prediction without friction near rest; None if the model cannot follow its references."""
    if data.simulation is None:
        return None
    try:
        return fit_prediction(current.model, current.free, data.training.experiments, data.simulation.setup)
    except VpmError:
        return None


def judged_by_prediction(
    current: Judged, data: Data, before: ClosedLoopPrediction, thresholds: Thresholds, probe: Probe
) -> Trial | str:
    """Trial of friction near rest that closed-loop predictions support, or reasons of refusal.

    Parameters
    ----------
    current : Judged
        The model without it.
    data : Data
    before : ClosedLoopPrediction
        The run of that model along the training records, see `prediction_without`.
    thresholds : Thresholds
    probe : Probe
        Of the candidate.
    """
    trial = confirm(current, data, probe)
    answer = support_of(before, trial, data)
    if answer is None:
        return "in closed-loop predictions it does not fit the training records better"
    return _refused(answer, probe, thresholds) or _fitted_trial(current, trial, answer, data)


def _refused(answer: Support, probe: Probe, thresholds: Thresholds) -> str:
    """Reason to refuse friction near rest by its closed-loop prediction, or "".

    The model creeps where a machine sticks, so that as much is asked of a run as of what explains a modest part only.
    """
    fades = _own_names(probe.candidate.site)[1]
    speed, (_, highest) = answer.run.model.parameters[fades].value, probe.candidate.bounds["stribeck_velocity"]
    if speed > highest:
        return f"{fades} comes out as {speed:.3g} in closed-loop predictions: no excess close to rest any more"
    for name, gained in (("training", answer.training), ("validation", answer.validation)):
        needed = MODEST_FACTOR * thresholds.score(gained.pieces)
        if not LEAST_SUPPORT <= gained.weight <= 1.0 / LEAST_SUPPORT or gained.score < needed:
            return (
                f"of its change of closed-loop predictions the {name} records support {100.0 * gained.weight:.0f} %, "
                f"{gained.score:.1f} standard deviations of their noise, and {needed:.1f} are needed"
            )
    return ""


def support_of(before: ClosedLoopPrediction, trial: Trial, data: Data) -> Support | None:
    """Support of all records for friction near rest: the change from the run ``before`` to one with the effect.

    None if there is no such run that fits the training records better.
    """
    if data.simulation is None:
        return None
    setup, found = data.simulation.setup, list[ClosedLoopPrediction]()
    free = (*before.free, *_own_names(trial.probe.candidate.site))
    for _, start in _starts(before, trial)[:FITTED]:
        try:
            found.append(fit_prediction(start, free, data.training.experiments, setup))
        except VpmError:
            continue
    best = min(found, key=misfit, default=None)
    if best is None or misfit(best) >= misfit(before):
        return None
    try:
        pair = [predict(run.model, run.free, data.validation.experiments, setup) for run in (before, best)]
    except VpmError:
        return None
    return Support(gain_of_predictions(before, best), gain_of_predictions(*pair), best)


def is_supported(before: ClosedLoopPrediction, trial: Trial, data: Data, thresholds: Thresholds) -> bool:
    """Whether validation records support friction near rest of the size that the residual gives.

    Training records do not count: the friction was fitted to them and may imitate a part of the delay.

    Parameters
    ----------
    before : ClosedLoopPrediction
        The model without the effect, run along the training records.
    trial : Trial
        Of the effect, in an inverse-dynamics residual.
    data : Data
    thresholds : Thresholds
    """
    if data.simulation is None or data.simulation.mode != "closed_loop":
        return False
    candidate, fitted = trial.probe.candidate, trial.judged.model.parameters
    after = before.model.with_effect(candidate.effect.name, at=candidate.site, **candidate.starts[0])
    after = after.with_parameters({name: fitted[name].value for name in trial.parameters})
    records, setup = data.validation.experiments, data.simulation.setup
    try:
        free = (*before.free, *trial.parameters)
        gained = gain_of_predictions(
            predict(before.model, before.free, records, setup), predict(after, free, records, setup)
        )
    except VpmError:
        return False
    return LEAST_SUPPORT <= gained.weight <= 1.0 / LEAST_SUPPORT and gained.score >= thresholds.score(gained.pieces)


def _fitted_trial(current: Judged, trial: Trial, answer: Support, data: Data) -> Trial:
    """Trial of friction near rest, refitted near its predicted values, with the validation gain of predictions."""
    own = [name for name in answer.run.free if name not in current.free]
    values = {name: answer.run.estimated(name) for name in own}
    model = current.model
    candidate = trial.probe.candidate
    start = _with_effect(model, candidate, {name: value for name, (value, _) in values.items()})
    near = {
        name: (max(start.parameters[name].minimum, v - WITHIN * std), v + WITHIN * std)
        for name, (v, std) in values.items()
    }
    judged = judge(start, (*current.free, *own), data, {**current.bounds, **near})
    return replace(
        trial,
        judged=judged,
        parameters=tuple(own),
        held=(),
        validation=answer.validation,
        training=answer.training,
        clear=True,
        from_prediction=True,
    )


def _with_effect(model: Model, candidate: Candidate, values: dict[str, float]) -> Model:
    """Model with friction near rest whose sign changes with speed as its Coulomb friction does."""
    transition = model.parameters[f"{candidate.site}.friction.transition_velocity"].value
    return model.with_effect(*candidate.key, transition_velocity=transition).with_parameters(values)


def _starts(before: ClosedLoopPrediction, trial: Trial) -> list[tuple[float, Model]]:
    """Start models for the fit of friction near rest that beat the model without it, the best first."""
    candidate, model = trial.probe.candidate, before.model
    size, fades = _own_names(candidate.site)
    balance = trial.judged.model.parameters
    dry = model.parameters[f"{candidate.site}.friction.coulomb"].value
    speeds = [start["stribeck_velocity"] * share for start in candidate.starts for share in (1.0, 0.5)]
    tried = [(share * dry, speed) for share in SIZES for speed in speeds]
    found, plain = list[tuple[float, Model]](), misfit(before)
    for strength, speed in ((balance[size].value, balance[fades].value), *tried):
        start = _with_effect(model, candidate, {size: strength, fades: speed})
        try:
            left, _ = before.problem.evaluate(start, start.theta)
        except VpmError:
            continue
        found.append((misfit(before, left), start))
    return sorted((one for one in found if one[0] < plain), key=lambda one: one[0])


def _own_names(site: str) -> tuple[str, str]:
    return f"{site}.friction.stribeck", f"{site}.friction.stribeck_velocity"


def gain_of_predictions(before: ClosedLoopPrediction, after: ClosedLoopPrediction) -> Gain:
    """Gain by predictions of friction near rest: the share of their change that the first error supports."""
    apart, score = part(against(before, after))
    _, noise, _ = least(after.spectra())
    left = [
        np.concatenate(
            [
                weighted(s, n).ravel()
                for s, n in zip(spectra(run.model, run.problem, run.left[:, None]), noise, strict=True)
            ]
        )
        for run in (before, after)
    ]
    size = [float(np.sqrt(np.mean(values**2))) for values in left]
    pieces = round(len(noise) / SMOOTHED)
    return Gain(size[0], size[1], score / apart if apart > 0.0 else 0.0, score, pieces)
