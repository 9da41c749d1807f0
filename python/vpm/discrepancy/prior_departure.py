"""Departure of parameters from their prior: a fit moves them far from the model file's stated uncertainty.

A stated uncertainty is a measurement. A correct effect brings the known parameters back to it. An effect that imitates
another force together with a shifted centre of mass moves them away. For example, a linear spring with an inverted
pendulum imitates a hardening spring.
"""

from __future__ import annotations

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Judged
from vpm.discrepancy.settings import FAR
from vpm.identify.moments import on_the_border
from vpm.model import Model, Parameter
from vpm.numbers import NORMAL_95, short


def moved_far(model: Model, recalibrated: Judged) -> list[str]:
    """Notes on parameters that a recalibration moved far from their prior, alone or together, or to a border."""
    notes = []
    for name, std in zip(recalibrated.free, recalibrated.fit.std, strict=True):
        before, after = model.parameters[name], recalibrated.model.parameters[name]
        spread = _stated(before)
        if abs(after.value - before.value) - NORMAL_95 * float(std) > FAR * spread:
            notes.append(
                f"recalibration moved {name} from {short(before.value)} to {short(after.value)} {before.unit}, "
                f"{abs(after.value - before.value) / spread:.1f} times its stated uncertainty"
            )
    together = {name: away for name, away in _least_departures(model, recalibrated).items() if away > FAR}
    if together:
        notes.append(
            f"the records show {', '.join(together)} only together; no values that explain them lie nearer to the "
            f"model file than {max(together.values()):.1f} times their stated uncertainties: question the file, or "
            "look for what it lacks there, such as a load"
        )
    known = [names for names, _ in on_the_border(model, recalibrated.free)]
    found = on_the_border(recalibrated.model, recalibrated.free)
    return notes + [f"recalibration stopped at {sentence}" for names, sentence in found if names not in known]


def _least_departures(model: Model, recalibrated: Judged) -> dict[str, float]:
    """Prior departures, in stated uncertainties, of parameters in unidentifiable combinations.

    Values anywhere along these combinations explain the records as well. Those count whose squared departures have the
    least sum: of Gaussian priors the most probable.
    """
    parts = [dict(zip(one.names, one.weights, strict=True)) for one in recalibrated.fit.unseen]
    if not parts:
        return {}
    names = [name for name in recalibrated.free if any(name in part for part in parts)]
    spreads = np.array([_stated(model.parameters[name]) for name in names])
    moved = [recalibrated.model.parameters[name].value - model.parameters[name].value for name in names]
    along = np.array([[part.get(name, 0.0) for part in parts] for name in names]) / spreads[:, None]
    away = np.array(moved) / spreads
    away -= along @ np.linalg.lstsq(along, away, rcond=None)[0]
    return dict(sorted(zip(names, map(float, np.abs(away)), strict=True), key=lambda item: -item[1]))


def driven_away(nominal: Model, recalibrated: Judged, final: Judged, ranked: Model | None = None) -> dict[str, float]:
    """Parameters that accepted effects clearly drive away from their prior in the model file.

    - ``nominal``: as the file has it
    - ``recalibrated``, ``final``: without the effects, and with them
    - ``ranked``: with the effects, as an observer of all joints knows it: the residual may see some of them alone

    Stated uncertainties by which the parameter stands away, the farthest first. Parameters that were as far before are
    left out: the file is wrong whatever is missing. So are those that the data hardly show beside the effects.
    """
    found = {}
    for name, std in zip(final.free, final.fit.std, strict=True):
        if name not in nominal.parameters or name not in recalibrated.model.parameters:
            continue
        parameter = nominal.parameters[name]
        spread = _stated(parameter)
        after = final.model.parameters[name].value
        away = abs(after - parameter.value) - NORMAL_95 * float(std)
        moved = abs(after - recalibrated.model.parameters[name].value)
        if ranked is not None and abs(ranked.parameters[name].value - parameter.value) <= FAR * spread:
            continue
        if min(away, moved) > FAR * spread:
            found[name] = abs(after - parameter.value) / spread
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def _stated(parameter: Parameter) -> float:
    """Prior deviation of a parameter as the model file states it; infinite if nothing is stated."""
    return parameter.uncertainty or float("inf")
