"""Contacts of a backlash: their stiffness and damping, from closed-loop predictions of the model.

Along a measured motion the errors of simulated flights accumulate. The inverse-dynamics residual therefore prefers
contacts that absorb impacts, and confuses their damping with softness and with a smaller inertia before them. In closed
loop the controller brings the model back to its reference after every impact, so hard and soft contacts differ. The
width of the backlash and the damping of the contacts still come from the residual.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag

from vpm.discrepancy.confirmation.confirmation import Data, Judged, judge
from vpm.discrepancy.confirmation.refusal import LEAST_GAIN, NORMAL_95_ONE_SIDED, WORTH_A_NAME
from vpm.discrepancy.confirmation.whittle_likelihood import ClosedLoopPrediction, fit_prediction
from vpm.discrepancy.parallel_candidates import Failure, ParallelCandidates
from vpm.discrepancy.screening.backlash_start import is_read_off
from vpm.discrepancy.screening.candidates import Key
from vpm.discrepancy.screening.compliance_and_stop_start import moved
from vpm.discrepancy.search.candidate_choice import Accepted
from vpm.discrepancy.search.search import Search
from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.identify import OutputErrorProblem, gain, segments
from vpm.model import Model
from vpm.numbers import Array

#: Contacts between which the model runs first: frequencies, Hz, and damping ratios.
CONTACTS, DAMPINGS = (10.0, 14.0, 20.0, 30.0, 45.0, 65.0), (0.03, 0.1, 0.3)
#: So many of these are fitted to the records.
FITTED = 2
#: Damping ratios from which the residual is fitted again.
SWALLOWING = (0.3, 0.7)
#: The beginnings of the training records that models run along last so long together, s: dozens of impacts, for a run
#: with its derivatives takes long.
LASTING = 6.0
#: Records that are hardly longer are taken as they are.
ALL = 0.9
#: What only a run tells of a backlash, by short name.
TOLD = ("stiffness", "inertia")


def with_predicted_contacts(found: Search, data: Data, each: ParallelCandidates) -> Search:
    """Search whose backlashes have contacts as stiff as closed-loop predictions of training records support.

    The predicted values stand if they simulate the training records better, beyond chance. The validation records may
    not be simulated worse, nor have a larger residual.
    """
    final = found.final
    for entry in found.accepted:
        if is_read_off(final.model, data.training, entry.trial.probe.candidate):
            final = _harder(final, entry, data, each)
    if final is found.final:
        return found
    return replace(found, stages=(*found.stages[:-1], replace(found.stages[-1], judged=final)))


def _harder(final: Judged, entry: Accepted, data: Data, each: ParallelCandidates) -> Judged:
    """Model with harder contacts of one backlash where predictions support them, or unchanged."""
    if data.simulation is None or data.simulation.mode != "closed_loop":
        return final
    records, setup = beginnings(data.training.experiments), data.simulation.setup
    runs = OutputErrorProblem(final.model, records, data.simulation.mode, setup=setup)
    key, label = entry.key, entry.trial.probe.candidate.label
    names = tuple(name for name in _predicted_values(final.model, key) if name in final.free)
    tried = [final.model, *(with_contact(final.model, key, f, z) for f in CONTACTS for z in DAMPINGS)]
    what = "how hard contacts are: runs along the records"
    left = each(what, lambda model: runs.evaluate(model, model.theta)[0], tried, lambda _: label)
    costs = [math.inf if isinstance(one, Failure) else float(one @ one) for one in left]
    before, best = left[0], np.argsort(costs)[:FITTED]
    if isinstance(before, Failure) or not names or costs[best[0]] > (1.0 - WORTH_A_NAME) * costs[0]:
        return final
    fitted = each(
        what,
        lambda model: fit_prediction(model, final.free, records, setup),
        [tried[place] for place in best if place],
        lambda _: label,
    )
    better = [run for run in fitted if not isinstance(run, Failure)]
    balanced = [_balanced(final, run, names, key, ratio, data) for run in better for ratio in SWALLOWING]
    supported = [
        one for one in balanced if one is not None and _better(final, one, data) and _predicts_better(before, one, runs)
    ]
    return min(supported, key=lambda one: float(one.fit.residual @ one.fit.residual), default=final)


def beginnings(records: Sequence[Experiment]) -> list[Experiment]:
    """First part of each record, long enough to predict the contacts of a backlash."""
    most = LASTING / len(records)
    whole = [float(record.time[-1] - record.time[0]) for record in records]
    shares = [most / length if length > most else 1.0 for length in whole]
    return [r if share > ALL else r.split(share)[0] for r, share in zip(records, shares, strict=True)]


def _predicted_values(model: Model, key: Key) -> tuple[str, ...]:
    """Parameters of a backlash's contacts that a closed-loop prediction estimates, by dotted name."""
    effect = model.effect(*key)
    return tuple(effect.parameter_names[short] for short in TOLD)


def with_contact(model: Model, key: Key, frequency: float, ratio: float) -> Model:
    """Model with backlash contacts on which the link swings at a frequency, Hz, while the motor stands."""
    effect = model.effect(*key)
    stiffness = moved(model, key[1]) * (2.0 * math.pi * frequency) ** 2
    values = {effect.parameter_names["stiffness"]: stiffness}
    return _damped(model.with_parameters(values), key, ratio)


def _damped(model: Model, key: Key, ratio: float) -> Model:
    """Model with another damping ratio of its backlash contacts."""
    names = model.effect(*key).parameter_names
    stiffness = model.parameters[names["stiffness"]].value
    resistance = 2.0 * ratio * math.sqrt(stiffness * moved(model, key[1]))
    return model.with_parameters({names["contact_damping"]: resistance})


def _balanced(
    final: Judged, run: ClosedLoopPrediction, names: Sequence[str], key: Key, ratio: float, data: Data
) -> Judged | None:
    """Refit to the residual with predicted contacts of a backlash held; None where that cannot be computed."""
    rest = tuple(name for name in final.free if name not in names)
    bounds = {name: pair for name, pair in final.bounds.items() if name in rest}
    try:
        judged = judge(_damped(run.model, key, ratio), rest, data, bounds)
        columns = [judged.model.index(name) for name in names]
        _, slopes = data.training.evaluate(judged.model, judged.model.theta, columns)
    except VpmError:
        return None
    fit = replace(
        judged.fit,
        names=(*rest, *names),
        values=np.concatenate([judged.fit.values, judged.model.theta[columns]]),
        jacobian=np.column_stack([judged.fit.jacobian, slopes]),
        covariance=block_diag(judged.fit.covariance, np.diag([run.estimated(name)[1] ** 2 for name in names])),
    )
    return replace(judged, free=fit.names, fit=fit, bounds=dict(final.bounds))


def _predicts_better(before: Array, one: Judged, runs: OutputErrorProblem) -> bool:
    """Whether harder contacts simulate the training records better than ``before``, beyond chance."""
    try:
        after, _ = runs.evaluate(one.model, one.model.theta)
    except VpmError:
        return False
    gained = gain(before, after, segments(runs))
    return gained.relative >= LEAST_GAIN and gained.score >= NORMAL_95_ONE_SIDED


def _better(final: Judged, one: Judged, data: Data) -> bool:
    """Whether a model with other contacts predicts the validation records at least as well, in both views."""
    if data.simulation is None or final.simulated is None or one.simulated is None:
        return False
    views = ((final.validation, one.validation, data.validation), (final.simulated, one.simulated, data.simulation))
    return all(gain(before, after, segments(view)).harm <= NORMAL_95_ONE_SIDED for before, after, view in views)
