"""Fields of a diagnosis, computed after the naming: channel errors at all stages, accepted effects, rivals, steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from vpm.catalogue.kinds import Side
from vpm.compare import compare
from vpm.discrepancy.diagnosis import (
    OBSERVED,
    AcceptedEffect,
    ChannelGap,
    Diagnosis,
    EffectParameterEstimate,
    Picture,
    Step,
    Trace,
)
from vpm.discrepancy.findings import Accepted, Findings, Stage, ambiguities
from vpm.discrepancy.judged_model import Data, Judged, weaker
from vpm.discrepancy.noise.noise_floor import Structure, noise_floor, structure
from vpm.discrepancy.preparation import Records
from vpm.discrepancy.ranked_effects import candidates_of, refused_by, tracker_gaps
from vpm.discrepancy.rivals.ambiguity import Rivals, listed
from vpm.discrepancy.screening.candidates import Key
from vpm.discrepancy.shifted_commands import in_time
from vpm.identify import Estimate, Fit, InverseDynamicsProblem, OutputErrorProblem, Problem, gaps
from vpm.identify.estimation import beside_held
from vpm.identify.fit_result import fit_of
from vpm.model import Model
from vpm.numbers import stretches
from vpm.simulate import Run, Setup

if TYPE_CHECKING:
    from vpm.ranking import Ranked, Ranking
    from vpm.ranking import Settings as RankingSettings


def of_findings(
    model: Model,
    records: Records,
    start: Judged,
    found: Findings,
    problems: tuple[Problem, Problem],
    ambiguous: Sequence[Rivals] = (),
    std: Mapping[str, float] | None = None,
) -> Diagnosis:
    """Diagnosis with the fields of the findings alone: all there is where what follows it failed or was stopped.

    - ``start``: what the last fit is compared with
    - ``problems``: residuals of training and validation records
    - ``std``: deviations of what the final model has, by dotted names; by default those that the residual tells
    """
    training, validation, notes = records
    names = ", ".join(entry.label for entry in found.accepted) or "no effect"
    std = deviations(found, problems[0]) if std is None else std
    return Diagnosis(
        "effect_found" if found.accepted else "interrupted" if found.interrupted else "unexplained",
        so_far(found, f"The ranking names {names} in {model.name}; what is left on validation records is not judged."),
        tuple(accepted_effect(entry, found.final.model, std) for entry in found.accepted),
        {},
        found.refused,
        found.ranking,
        listed(ambiguities(found.accepted), ambiguous),
        {},
        tuple(step(*problems, stage) for stage in found.stages),
        tuple(e.name for e in training),
        tuple(e.name for e in validation),
        tuple(notes),
        found.final.model,
        fit_beside(model, found.final, problems[0], start, found, [e.name for e in training]),
        (),
        0.0,
        found.interrupted,
        classes=classes(found.accepted, ambiguous),
        stated=_values(model),
    )


def so_far(found: Findings, summary: str) -> str:
    """Summary of a diagnosis whose naming Ctrl-C may have ended."""
    return f"Stopped before every candidate was tried. {summary}" if found.interrupted else summary


def _values(model: Model) -> dict[str, float]:
    return {name: parameter.value for name, parameter in model.parameters.items()}


def gaps_of(
    data: Data, nominal: Judged, recalibrated: Judged, final: Judged, floor: dict[str, float]
) -> dict[str, ChannelGap]:
    """Field of a diagnosis: error and noise floor of each channel, of residual and simulation, at three stages."""
    judged = (nominal, recalibrated, final)
    stages = [gaps(data.validation, stage.validation) for stage in judged]
    # Of efforts as the drives of the nominal model give them: no drive may shrink them together with its error.
    shrunk = (weaker(data.validation, nominal, stage) for stage in (recalibrated, final))
    factors = np.array([np.ones(len(data.validation.joints)), *shrunk])
    by_channel = {f"{joint}.effort": own for joint, own in zip(data.validation.joints, factors.T, strict=True)}
    result = {}
    for channel, (_, _, unit) in stages[0].items():
        own = by_channel.get(channel, np.ones(len(judged)))
        before, known, after = (float(stage[channel][0] * factor) for stage, factor in zip(stages, own, strict=True))
        signal, noise = _signal(data.validation, channel), float(floor.get(channel, np.nan) * own[-1])
        result[channel] = ChannelGap(before, known, after, noise, unit, signal, data.validation.mode)
    simulation = data.simulation
    simulated = [] if simulation is None else [gaps(simulation, j.simulated) for j in judged if j.simulated is not None]
    # A stage that ran away from the records has nothing to be compared.
    if simulation is not None and len(simulated) == len(judged):
        for channel, (_, _, unit) in simulated[0].items():
            before, known, after = (stage[channel][0] for stage in simulated)
            signal = _signal(simulation, channel)
            key = f"{channel} ({simulation.mode})"
            result[key] = ChannelGap(before, known, after, np.nan, unit, signal, simulation.mode)
    return result


def examined(
    nominal: Judged, recalibrated: Judged, data: Data, mode: str, setup: Setup, final: Judged
) -> tuple[dict[str, float], dict[str, ChannelGap], Structure]:
    """Noise floor, errors at all stages and residual structure of the final model: fields of a diagnosis."""
    floor = noise_floor(final.model, data.validation, final.validation, mode, setup)
    timed = in_time(final, data)
    left = structure(final.model, data.training, data.validation, timed.fit.residual, timed.validation)
    return floor, gaps_of(data, nominal, recalibrated, final, floor), left


def _signal(problem: InverseDynamicsProblem | OutputErrorProblem, channel: str) -> float:
    mine = [block for block in problem.blocks if block.channel == channel]
    return float(np.sqrt(np.average([b.scale**2 for b in mine], weights=[b.moving.sum() for b in mine])))


def deviations(found: Findings, training: Problem) -> dict[str, float]:
    """Field of a diagnosis: deviations of what the final model has, by dotted names."""
    return _beside_held(found.final, training, found.accepted).deviations


def fit_beside(
    model: Model, final: Judged, training: Problem, before: Judged, found: Findings, records: Sequence[str]
) -> Fit:
    """Field of a diagnosis: the final fit, with what was held where an observer had moved it from the model file.

    - ``model``: as the user wrote it
    - ``before``: what it is compared with
    """
    told, stated, now = _beside_held(final, training, found.accepted), model.parameters, final.model.parameters
    moved = {name for name in told.names if name in stated and now[name].value != stated[name].value}
    return fit_of(final.model, training, told.of({*final.free, *moved}), before.fit.residual, records)


def _beside_held(final: Judged, training: Problem, accepted: Sequence[Accepted]) -> Estimate:
    """Estimate of the final model of a diagnosis, with all that was held beside it.

    Values of the model file that were held, as masses beside a load, are no surer than the file says.
    """
    aliases = (alias.parameter for entry in accepted for alias in entry.measured.held)
    held = [name for name in dict.fromkeys((*aliases, *final.model.adjustable)) if name not in final.free]
    return beside_held(final.fit, final.model, training, held) if held else final.fit


def accepted_effect(entry: Accepted, final: Model, deviations: Mapping[str, float]) -> AcceptedEffect:
    """Field of a diagnosis: an accepted effect with its estimates in the final model, and its evidence."""
    measured = entry.measured
    estimates = _estimates(final, entry.key, entry.side, lambda dotted: deviations.get(dotted, 0.0))
    notes = [f"{alias.parameter} held: not discriminated from {alias.partner}" for alias in measured.held]
    if measured.invisible and not (measured.free or measured.held):
        notes.append("that is a share of the inverse-dynamics residual, which does not show it; see the observed gaps")
    return AcceptedEffect(
        *entry.key,
        final.effect(*entry.key, entry.side).sentence(final.parameters),
        estimates,
        measured.validation.relative,
        measured.validation.score,
        (*notes, *(f"not discriminated from it: {rival}" for rival in entry.rivals)),
        entry.probability,
        entry.evidence,
        entry.class_probability,
        entry.side,
    )


def _estimates(model: Model, key: Key, side: Side, std: Callable[[str], float]) -> tuple[EffectParameterEstimate, ...]:
    known, names = model.parameters, model.effect(*key, side).parameter_names
    return tuple(
        EffectParameterEstimate(short, dotted, known[dotted].value, known[dotted].unit, std(dotted))
        for short, dotted in names.items()
    )


def classes(accepted: Sequence[Accepted], ambiguous: Sequence[Rivals]) -> tuple[tuple[str, ...], ...]:
    """Field of a diagnosis: classes of an accepted effect and its rivals that predict as well."""
    beside = {(rivals.effect, rivals.site): rivals.trials for rivals in ambiguous}
    found = []
    for entry in accepted:
        others = (*entry.rivals, *(trial.label for trial in beside.get(entry.key, ())))
        if others:
            found.append(tuple(dict.fromkeys((entry.label, *others))))
    return tuple(found)


def step(training: Problem, validation: Problem, stage: Stage) -> Step:
    """Field of a diagnosis: one stage of the findings with its parameter values and its largest channel errors."""
    fit, model = stage.judged.fit, stage.judged.model
    names = stage.judged.free
    return Step(
        stage.change,
        stage.effect,
        stage.site,
        {name: model.parameters[name].value for name in names},
        dict(zip(names, map(float, fit.std), strict=True)),
        {name: model.parameters[name].unit for name in names},
        max(share for _, share, _ in gaps(training, fit.residual).values()),
        max(share for _, share, _ in gaps(validation, stage.judged.validation).values()),
    )


def unmeasured(model: Model, records: Records, ranking: Ranking, settings: RankingSettings) -> Diagnosis:
    """Unmeasured diagnosis of a ranking, which may be empty.

    Values are those of the ranking, and nobody has looked at how sure they are.

    - ``model``: as the user wrote it
    - ``records``: see `vpm.discrepancy.preparation`
    - ``settings``: of the ranking
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
        stated=_values(model),
    )


def _effect(one: Ranked, model: Model) -> AcceptedEffect:
    """Effect of an unmeasured diagnosis."""
    estimates = _estimates(model, one.key, one.side, lambda _: np.nan)
    return AcceptedEffect(
        one.effect,
        one.site,
        model.effect(*one.key, one.side).sentence(model.parameters),
        estimates,
        np.nan,
        np.nan,
        tuple(f"not discriminated from it: {rival}" for rival in one.rivals),
        one.probability,
        one.evidence,
        one.class_probability,
        one.side,
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


def traces(data: Data, nominal: Judged, final: Judged) -> tuple[Trace, ...]:
    """Samples for the plot of simulated and measured channels of the first validation record."""
    problem = data.simulation
    if problem is None or final.simulated is None:
        return ()
    record = problem.experiments[0]
    found = []
    for block in problem.blocks[: len(problem.blocks) // len(problem.experiments)]:
        measured = np.interp(block.time, record.time, record[block.channel])
        counts = np.where(block.moving > 0.0, 1.0, np.nan)
        simulated = [
            np.full(measured.shape, np.nan)
            if stage.simulated is None
            else measured - counts * stage.simulated[block.samples] / block.weight
            for stage in (nominal, final)
        ]
        found.append(Trace(record.name, block.channel, block.unit, problem.mode, block.time, measured, *simulated))
    return tuple(found)


def pictures(data: Data, nominal: Judged, recalibrated: Judged, final: Judged) -> tuple[Picture, ...]:
    """Samples for the residual plots, one for each joint of the first validation record."""
    found = []
    problem = data.validation
    position, velocity, _ = problem.state(0)
    _, applied, _ = problem.effort(final.model, final.model.theta, 0)
    for joint, block in enumerate(problem.efforts(0)):
        counts = np.where(block.moving > 0.0, 1.0, np.nan)
        residuals = [counts * j.validation[block.samples] / block.weight for j in (nominal, recalibrated, final)]
        unit = final.model.channel_unit(block.channel.replace(".effort", ".position"))
        found.append(
            Picture(
                block.channel,
                block.unit,
                unit,
                block.time,
                position[:, joint],
                velocity[:, joint],
                applied[:, joint],
                *residuals,
            )
        )
    return tuple(found)


def where(model: Model, validation: InverseDynamicsProblem) -> dict[str, tuple[str, ...]]:
    """Sentences on the residual by state region, for each channel of the first validation record."""
    time, applied, required = validation.effort(model, model.theta, 0)
    record, sentences = validation.experiments[0], {}
    for joint, block in enumerate(validation.efforts(0)):
        parts = [part for part in stretches(block.moving > 0.0) if part.stop - part.start > 1]
        if not parts:
            continue
        rows = np.concatenate([np.arange(part.start, part.stop) for part in parts])
        starts = np.cumsum([0, *(part.stop - part.start for part in parts[:-1])]).astype(np.int64)
        columns = (required[rows, joint : joint + 1], applied[rows, joint : joint + 1])
        run = Run(
            model.name, record.name, "inverse_dynamics", time[rows], (block.channel,), (block.unit,), *columns, starts
        )
        (found,) = compare(run, record, [block.channel]).channels
        # Unlike in multi-step predictions, the state is not reset where a stretch begins.
        sentences[block.channel] = tuple(r.sentence for r in found.where.regions if r.quantity != "time since restart")
    return sentences
