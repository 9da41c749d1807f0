"""Backward elimination: drops effects that later ones replace, and frees parameters that were held."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Data, Judged, gain_at, judge
from vpm.discrepancy.confirmation.refusal import CLEAR_GAIN, LEAST_GAIN, NORMAL_95_ONE_SIDED
from vpm.discrepancy.screening.candidates import Key
from vpm.discrepancy.search.candidate_choice import Accepted
from vpm.errors import DivergedError, ModelError
from vpm.identify import Gain, gain, segments
from vpm.identify.identifiability import Span, is_alias
from vpm.identify.response_along_motion import answers_at_once
from vpm.model import Model


@dataclass(frozen=True)
class Stage:
    """Stage of the search, with its model; ``change`` is "recalibrated", "added" or "removed"."""

    change: str
    effect: str
    site: str
    judged: Judged


def drop_replaced(stages: list[Stage], accepted: list[Accepted], data: Data, dropped: dict[Key, str]) -> None:
    """Backward elimination of each earlier effect without which the model predicts validation data as well.

    A parameter of a later effect may have been held because the data show it only together with the earlier effect. It
    is set free for the trial: a spring that may rest elsewhere needs no constant force beside it. One name for what two
    would say is the shorter answer. The same holds for a size, such as a difference of dry friction beside a constant
    force, which are one effect in motion. Where neither size has work to do beside it, these data do not tell, and both
    names stay. Where efforts follow at once, one step tells what does most of the work.
    """
    newest = accepted[-1]
    for entry in accepted[:-1]:
        current = stages[-1].judged
        own = set(entry.trial.parameters)
        freed = {alias.parameter for other in accepted for alias in other.trial.held if alias.partner in own}
        renamed = any(current.model.parameters[name].kind == "linear" for name in freed)
        try:
            model = current.model.without_effect(*entry.key)
            known = tuple(name for name in current.free if name in model.parameters)
            free = (*known, *sorted(name for name in freed - set(known) if name in model.parameters))
            bounds = {name: pair for name, pair in current.bounds.items() if name in free}
            if answers_at_once(current.model):
                near = judge(model, free, replace(data, simulation=None), bounds, linear_only=True)
                if _work(entry, near, current, data).relative >= CLEAR_GAIN:
                    continue
            reduced = judge(model, free, data, bounds)
        except (DivergedError, ModelError):
            continue  # without it the model cannot follow the validation data at all, or another effect cannot stand
        needless = _work(entry, reduced, current, data).relative < LEAST_GAIN
        if needless and (not renamed or _renamed(current, reduced, model, known, data)):
            accepted.remove(entry)
            accepted[:] = [_released(other, freed) for other in accepted]
            stages.append(Stage("removed", *entry.key, reduced))
            dropped[entry.key] = f"it is not needed any more beside {newest.trial.probe.candidate.label}"


def _work(entry: Accepted, reduced: Judged, current: Judged, data: Data) -> Gain:
    """Validation gain of an effect before elimination over the model without it, of all or at its joint alone."""
    site = entry.trial.probe.candidate.site
    whole = gain(reduced.validation, current.validation, segments(data.validation))
    own = gain_at(current.model, data.validation, site, reduced.validation, current.validation)
    return whole if own is None else max(whole, own, key=lambda one: one.relative)


def _renamed(current: Judged, reduced: Judged, model: Model, free: tuple[str, ...], data: Data) -> bool:
    """Whether released parameters only take over the work of an effect that elimination dropped.

    Without them, and without the effect, ``model`` with ``free`` fitted predicts the validation data worse. With them
    it simulates the validation records as well. Where there is none, as many numbers as before would tell nothing.
    """
    if current.simulated is not None and reduced.simulated is not None and data.simulation is not None:
        simulated = gain(current.simulated, reduced.simulated, segments(data.simulation))
        if simulated.relative < -LEAST_GAIN and simulated.harm > NORMAL_95_ONE_SIDED:
            return False
    bounds = {name: pair for name, pair in current.bounds.items() if name in free}
    bare = judge(model, free, replace(data, simulation=None), bounds)
    work = gain(bare.validation, reduced.validation, segments(data.validation))
    return work.relative >= LEAST_GAIN and work.score >= NORMAL_95_ONE_SIDED


def release_shown(stages: list[Stage], accepted: list[Accepted], data: Data) -> None:
    """Release after elimination what was held because something hid it that a later effect explains.

    It stays released if the model predicts validation data better with it. Without this a payload beside an unknown
    mass, named while friction was missing, never gets its place.
    """
    current = stages[-1].judged
    names = [alias.parameter for entry in accepted for alias in entry.trial.held]
    names = [name for name in dict.fromkeys(names) if name in current.model.parameters and name not in current.free]
    if not names or len(accepted) == 1:
        return
    model = current.model
    _, columns = data.training.evaluate(model, model.theta, [model.index(name) for name in names])
    known, shown = Span.of(current.fit.jacobian), list[str]()
    for name, column in zip(names, columns.T, strict=True):
        if np.any(column) and not is_alias(column, known, current.fit.residual):
            shown.append(name)
            known = known.beside(column[:, None])
    if not shown:
        return
    try:
        judged = judge(model, (*current.free, *shown), data, dict(current.bounds))
    except DivergedError:
        return
    if gain(current.validation, judged.validation, segments(data.validation)).relative > 0.0:
        stages[-1] = replace(stages[-1], judged=judged)
        accepted[:] = [_released(entry, set(shown)) for entry in accepted]


def _released(entry: Accepted, freed: set[str]) -> Accepted:
    """Accepted effect whose held parameters are released during elimination."""
    trial = entry.trial
    mine = tuple(alias.parameter for alias in trial.held if alias.parameter in freed)
    if not mine:
        return entry
    held = tuple(alias for alias in trial.held if alias.parameter not in freed)
    return replace(entry, trial=replace(trial, held=held, parameters=(*trial.parameters, *mine)))


def refitted(best: Accepted, data: Data) -> Accepted:
    """Refit before elimination, to the end, of a model that was fitted on a tangent."""
    judged = best.trial.judged
    try:
        exact = judge(judged.model, judged.free, data, dict(judged.bounds))
    except DivergedError:
        return best
    return replace(best, trial=replace(best.trial, judged=exact))
