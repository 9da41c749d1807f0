"""Unmeasured diagnosis: what a ranking names, where Ctrl-C came before validation records were looked at."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.discrepancy.diagnosis import OBSERVED, AcceptedEffect, Diagnosis, EffectParameterEstimate
from vpm.discrepancy.preparation import Records
from vpm.discrepancy.ranked_effects import candidates_of, refused_by, tracker_gaps
from vpm.identify import Fit
from vpm.model import Model

if TYPE_CHECKING:
    from vpm.ranking import Ranked, Ranking
    from vpm.ranking import Settings as RankingSettings


def unmeasured(model: Model, records: Records, ranking: Ranking, settings: RankingSettings) -> Diagnosis:
    """Unmeasured diagnosis of a ranking, which may be empty.

    Values are those of the ranking, and nobody has looked at how sure they are.

    Parameters
    ----------
    model : Model
        As the user wrote it.
    records : tuple
        See `vpm.discrepancy.preparation`.
    ranking : Ranking
    settings : vpm.ranking.Settings
        Of the ranking.
    """
    training, validation, notes = records
    effects = ranking.effects
    names = ", ".join(f"{one.effect} at {one.site}" for one in effects)
    known = f"a ranking names {names}, on validation records not measured yet" if effects else "nothing is named yet"
    return Diagnosis(
        "effect_found" if effects else "interrupted",
        f"Stopped by Ctrl-C, {model.name}: {known}.",
        tuple(_effect(one, ranking.model) for one in effects),
        tracker_gaps(ranking, None),
        refused_by(ranking, {}, settings),
        candidates_of(ranking, {one.key: np.nan for one in effects}, settings),
        (),
        {},
        (),
        tuple(record.name for record in training),
        tuple(record.name for record in validation),
        tuple(notes),
        ranking.model,
        _fit(model, ranking.model, [record.name for record in training]),
        (),
        0.0,
        interrupted=True,
        classes=tuple((f"{one.effect} at {one.site}", *one.rivals) for one in effects if one.rivals),
        stated={name: parameter.value for name, parameter in model.parameters.items()},
    )


def _effect(one: Ranked, model: Model) -> AcceptedEffect:
    """Effect of an unmeasured diagnosis."""
    names = model.effect(*one.key, one.side).parameter_names
    values = {short: model.parameters[dotted] for short, dotted in names.items()}
    texts = {short: f"{parameter.value:.4g} {parameter.unit}" for short, parameter in values.items()}
    return AcceptedEffect(
        one.effect,
        one.site,
        EFFECTS[one.effect].sentence.format(at=one.site, **texts),
        tuple(
            EffectParameterEstimate(short, names[short], parameter.value, parameter.unit, np.nan)
            for short, parameter in values.items()
        ),
        np.nan,
        np.nan,
        tuple(f"not discriminated from it: {rival}" for rival in one.rivals),
        one.probability,
        one.evidence,
        one.class_probability,
    )


def _fit(model: Model, repaired: Model, experiments: list[str]) -> Fit:
    """Fit of an unmeasured diagnosis: values that a ranking moved, with unknown deviations."""
    names = tuple(
        name
        for name in model.adjustable
        if name in repaired.parameters and repaired.parameters[name].value != model.parameters[name].value
    )
    unknown = np.full(len(names), np.nan)
    return Fit(
        OBSERVED,
        tuple(experiments),
        names,
        tuple(model.parameters[name].unit for name in names),
        np.array([model.parameters[name].value for name in names]),
        np.array([repaired.parameters[name].value for name in names]),
        unknown,
        np.eye(len(names)),
        {},
        {},
        (),
        (),
        repaired,
    )
