"""Effects that a ranking names: refitted to the inverse-dynamics residual, and measured on validation records.

A ranking names what is missing, in order. This module changes none of its names, except on machines whose inverse
dynamics cannot be computed with an effect. Reported values are those of the residual wherever it shows them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue import EFFECTS
from vpm.discrepancy.diagnosis import OBSERVED, ChannelGap, RankedCandidate, RefusedEffect
from vpm.discrepancy.findings import Accepted, Alias, Findings, Measured, Stage
from vpm.discrepancy.judged_model import Data, Judged, judged_anyhow, shrinkage, unmoved
from vpm.discrepancy.rivals.ambiguity import Rivals
from vpm.discrepancy.screening.candidates import Candidate, Key, asked_for, candidates, extent_of
from vpm.discrepancy.screening.compliance_and_stop_start import beyond
from vpm.discrepancy.settings import LEAST_GAIN, NORMAL_95_ONE_SIDED, ROUNDED
from vpm.errors import VpmError
from vpm.identify import InverseDynamicsProblem, gain, segments
from vpm.identify.identifiability import Span, closest_column, is_alias
from vpm.identify.response_along_motion import joints_with_play
from vpm.model import Effect, Model
from vpm.numbers import Array, power
from vpm.simulate.setup import HOLDS

if TYPE_CHECKING:
    from vpm.ranking import Ranked, Ranking
    from vpm.ranking import Settings as RankingSettings

#: Why a residual says nothing of a spring that was loaded before its record: it begins without memory.
REMEMBERED = "nobody knows what the spring at {site} remembers of the motion before each record"
#: Part of the name of a parameter that acts behind a joint that is split.
BEHIND = ".link."
#: Units of measured forces and moments.
FORCES = ("N", "N m")


class NoResidualError(VpmError):
    """Ranked effect with which no inverse-dynamics residual can be computed: only a tracker measures it."""


def tracker_gaps(
    ranking: Ranking, balanced: Sequence[str] | None, judged: Collection[str] = ()
) -> dict[str, ChannelGap]:
    """Errors of the ranking's tracker on validation records at joints with play, or without inverse-dynamics residual.

    So of shafts that turn with such a joint, and of readings of a sensor at which an effect was named, unless the
    residual has ``judged`` them or follows them. So of measured forces, as of a load cell, which no residual of efforts
    holds. Of all channels where there is no such residual, and so no joint of which the efforts are ``balanced``.
    """
    model, joints = ranking.recalibrated, set(ranking.recalibrated.joints) - set(balanced or ())
    joints |= joints_with_play(ranking.model)
    joints |= {shaft for shaft in model.transmissions if joints & set(model.ratios(shaft))}
    followed, named = {*judged, *(f"{joint}.position" for joint in model.joints)}, {one.site for one in ranking.effects}
    return {
        f"{channel} ({OBSERVED})": ChannelGap(
            gap.before, gap.recalibrated, gap.after, gap.noise, gap.unit, gap.signal, OBSERVED
        )
        for channel, gap in ranking.gaps.items()
        if balanced is None
        or channel.rpartition(".")[0] in joints
        or (channel not in followed and (gap.unit in FORCES or ranking.model.sensor_of(channel) in named))
    }


def found_by(
    ranking: Ranking,
    recalibrated: Judged,
    data: Data,
    settings: RankingSettings,
    effects: Sequence[str] | None = None,
) -> tuple[Findings, tuple[Rivals, ...]]:
    """Findings of a ranking, with rivals of each ranked effect.

    - ``ranking``: of the training records
    - ``recalibrated``: the model without effects
    - ``settings``: of the ranking

    Ctrl-C gives the effects that were refitted until then; before the first one was, it raises.

    Raises NoResidualError: no efforts can be computed with an effect that was ranked, or they know not how it began.
    """
    known: tuple[Rivals, ...] = ()

    def offered(final: Judged) -> tuple[Candidate, ...]:
        return candidates(final.model, data.training, final.fit.residual, asked_for(effects))

    def beside(current: Judged, model: Model, one: Ranked) -> Measured:
        if EFFECTS[one.effect].memory and one.site in model.added_joints:
            raise NoResidualError(REMEMBERED.format(site=one.site))
        try:
            return _beside(current, model, one, data)
        except VpmError as error:
            raise NoResidualError(str(error)) from error

    found = staged(ranking, recalibrated, beside, offered, settings)
    found = replace(found, refused=(*found.refused, *_split_already(recalibrated.model, effects)))
    try:
        if found.interrupted == ranking.interrupted:
            known = _rivals(ranking, found.final, found.accepted, data)
    except KeyboardInterrupt:
        found = replace(found, interrupted=True)
    return found, known


def staged(
    ranking: Ranking,
    recalibrated: Judged,
    beside: Callable[[Judged, Model, Ranked], Measured],
    offered: Callable[[Judged], tuple[Candidate, ...]],
    settings: RankingSettings,
) -> Findings:
    """Findings from a ranking: its effects are added and refitted one by one.

    - ``recalibrated``: the model without effects
    - ``beside``: measures an effect: of a model without it, the model with it, and the effect
    - ``offered``: all that could still be missing of a model
    - ``settings``: of the ranking

    Ctrl-C gives the effects that were measured until then; before the first one was, it raises.
    """
    stages, accepted = [Stage("recalibrated", "", "", recalibrated)], list[Accepted]()
    outside: dict[Key, str] = {}
    lost: list[Ranked] = []
    interrupted = ranking.interrupted
    try:
        for place, one in enumerate(ranking.effects):
            gone = [*lost, *ranking.effects[place + 1 :]]
            try:
                measured = beside(stages[-1].judged, _without(ranking.model, gone), one)
            except NoResidualError:
                raise
            except VpmError as error:
                outside[one.key] = f"it {_removes(one)}, but no residual can be computed: {error}"
                lost.append(one)
                continue
            accepted.append(
                Accepted(measured, one.rivals, one.evidence, one.probability, one.side, one.class_probability)
            )
            stages.append(Stage("added", *one.key, measured.judged))
        if ranking.rounds:
            outside |= _unpromising(ranking, stages[-1].judged.model, offered(stages[-1].judged))
    except KeyboardInterrupt:
        if not accepted:
            raise
        interrupted, known = True, {*outside, *(entry.key for entry in accepted)}
        outside |= {
            one.key: f"it {_removes(one)}, but Ctrl-C came before it was measured"
            for one in ranking.effects
            if one.key not in known
        }
    gains = {entry.key: entry.measured.validation.relative for entry in accepted}
    refused, tried = refused_by(ranking, outside, settings), candidates_of(ranking, gains, settings)
    return Findings(
        tuple(stages),
        tuple(accepted),
        refused,
        tried,
        interrupted,
        left=ranking.left,
        ranked=ranking.model,
        within_laws=ranking.is_within_laws(settings),
    )


def _without(model: Model, gone: Sequence[Ranked]) -> Model:
    """Model without some ranked effects; the last ones go first, because they may rest on earlier ones."""
    for one in reversed(gone):
        model = model.without_effect(*one.key, one.side)
    return model


def _beside(current: Judged, model: Model, one: Ranked, data: Data) -> Measured:
    """Model with one more ranked effect, refitted as far as the inverse-dynamics residual shows its parameters.

    A parameter moves if the residual tells it from all others at these values, and stays where it is if not. The refit
    counts if the training records are left no more and the validation ones are simulated no worse than by those values.

    Raises VpmError: efforts cannot be balanced in this model.
    """
    known, own = fitted_in(current, model, one)
    residual, columns = data.training.evaluate(model, model.theta, [model.index(name) for name in (*known, *own)])
    visible = _has_derivatives(columns)
    beside, fresh = columns[:, : len(known)][:, visible[: len(known)]], np.where(visible, columns, 0.0)[:, len(known) :]
    known = tuple(compress(known, visible))
    fresh = np.where(_shows(model, one, own, fresh, residual), fresh, 0.0)
    moving, held, invisible = _sorted(model, (known, beside), (own, fresh), residual)
    judged = _refitted(current, model, one, (*known, *moving), data)
    validation = judged.validation * shrinkage(data.validation, current, judged)
    gained = gain(current.validation, validation, segments(data.validation))
    return Measured(one.key, judged, gained, moving, held, invisible)


def _shows(model: Model, one: Ranked, own: Sequence[str], fresh: Array, residual: Array) -> NDArray[np.bool_]:
    """Whether places of a ranked load could show in a residual that is noise, as far out as its body's own masses.

    Of a load on a table that turns about an upright axis its height does nothing. Where the file's axis is upright to
    eight digits, a fit would find a height of kilometres.
    """
    if one.site not in model.bodies:
        return np.ones(len(own), dtype=bool)
    effect, (_, reach) = model.effect(*one.key, one.side), extent_of(model, one.site)
    places = {
        dotted for short, dotted in effect.parameter_names.items() if effect.type.parameter(short).scale == "coordinate"
    }
    far = [max(abs(model.parameters[name].value), reach) if name in places else np.inf for name in own]
    with np.errstate(invalid="ignore"):
        moved = np.linalg.norm(fresh, axis=0) * far
    return np.asarray(~(moved <= np.sqrt(np.mean(residual**2))))


def _sorted(
    model: Model, known: tuple[Sequence[str], Array], added: tuple[Sequence[str], Array], residual: Array
) -> tuple[tuple[str, ...], tuple[Alias, ...], tuple[str, ...]]:
    """Parameters of a ranked effect that the residual identifies, confuses with others, and does not show.

    ``known`` and ``added`` are names and columns. Lengths are those of changes as large as the values, without which SI
    units would decide what is small.
    """
    (names, columns), (own, fresh) = known, added
    span = Span.of(columns)
    lengths, others = (
        np.linalg.norm(part, axis=0) * [abs(model.parameters[name].value) or 1.0 for name in several]
        for several, part in ((own, fresh), known)
    )
    largest = float(np.max([*others, *lengths], initial=0.0))
    visible = [i for i in range(len(own)) if lengths[i] > ROUNDED * largest]
    keep, held = list(visible), []
    for i in visible:
        rest = [j for j in keep if j != i]
        if is_alias(fresh[:, i], span.beside(fresh[:, rest]), residual):
            closest = closest_column(fresh[:, i], np.column_stack([columns, fresh[:, rest]]))
            held.append(Alias(own[i], [*names, *(own[j] for j in rest)][closest]))
            keep.remove(i)
    invisible = tuple(name for i, name in enumerate(own) if i not in visible)
    return tuple(own[i] for i in keep), tuple(held), invisible


def _has_derivatives(columns: Array) -> NDArray[np.bool_]:
    """Whether the residual has finite derivatives by each parameter of a ranked model."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(np.isfinite(np.sum(columns**2, axis=0)))


def _refitted(current: Judged, model: Model, one: Ranked, free: tuple[str, ...], data: Data) -> Judged:
    """Refit of ranked effects, or the ranking's own values where these predict better."""
    bounds = _bounds(current, model, one, data)
    still = unmoved(model, free, data, bounds)
    judged, _ = judged_anyhow(model, free, data, bounds)
    if judged.simulated is None and still.simulated is not None:
        return still
    if power(judged.fit.residual) > power(still.fit.residual):
        return still
    if data.simulation is not None and judged.simulated is not None and still.simulated is not None:
        gained = gain(still.simulated, judged.simulated, segments(data.simulation))
        if gained.relative < -LEAST_GAIN and gained.harm > NORMAL_95_ONE_SIDED:
            return still
    return judged


def fitted_in(current: Judged, model: Model, one: Ranked) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Parameters to refit without a ranked effect, and those that it adds, by their dotted names."""
    renamed = _renamed(current.model, model)
    known = (renamed.get(name, name) for name in current.free)
    fitted = {_anywhere(name) for name in one.values}
    names = model.effect(*one.key, one.side).parameter_names.values()
    own = tuple(name for name in names if _anywhere(name) in fitted)
    return tuple(name for name in known if name in model.parameters), own


def _anywhere(name: str) -> str:
    """Dotted name of a ranked effect's parameter on either side of a joint."""
    return name.replace(BEHIND, ".")


def _renamed(old: Model, new: Model) -> dict[str, str]:
    """New parameter names of ranked effects that are on the other side of their joint in another model."""
    names: dict[str, str] = {}
    there: dict[Key, list[Effect]] = {}
    for effect in new.effects:
        there.setdefault((effect.name, effect.at), []).append(effect)
    for effect in old.effects:
        places = there.get((effect.name, effect.at), [])
        same = next((one for one in places if one.side == effect.side), next(iter(places), None))
        if same is not None:
            names.update({dotted: same.parameter_names[short] for short, dotted in effect.parameter_names.items()})
    return names


def _bounds(current: Judged, model: Model, one: Ranked, data: Data) -> dict[str, tuple[float, float]]:
    """Bounds of a ranked effect's shape from the data, wide enough for the values of the ranking."""
    listed = candidates(current.model, data.training, current.fit.residual, [one.effect])
    shape = next((each.bounds for each in listed if each.key == one.key), {})
    renamed = _renamed(current.model, model)
    given = {renamed.get(name, name): pair for name, pair in current.bounds.items()}
    names = model.effect(*one.key, one.side).parameter_names
    given.update({names[short]: pair for short, pair in shape.items() if short in names})
    found = {}
    for name, (low, high) in given.items():
        if name in model.parameters:
            value = model.parameters[name].value
            found[name] = min(low, value), max(high, value)
    return found


# ---- what else would do ----------------------------------------------------------------------------------------------


def _rivals(ranking: Ranking, final: Judged, accepted: Sequence[Accepted], data: Data) -> tuple[Rivals, ...]:
    """Ranked effects that have rivals in the ranking, with the models in which these take their place."""
    found = []
    for entry in accepted:
        trials = []
        for label in entry.rivals:
            try:
                trials.append(_placed(_tried(ranking, entry.key, label), final, entry, data))
            except (VpmError, StopIteration):
                continue  # it is said, but there is no residual to plan an experiment by
        if trials:
            found.append(Rivals(*entry.key, tuple(trials)))
    return tuple(found)


def _tried(ranking: Ranking, key: Key, label: str) -> Ranked:
    """Trial of a rival as the ranking tried it in the round in which an effect came in."""
    several = next(listed for listed in ranking.rounds if listed and listed[0].key == key)
    return next(one for one in several if f"{one.effect} at {one.site}" == label)


def _placed(rival: Ranked, final: Judged, entry: Accepted, data: Data) -> Measured:
    """Model with a rival in the place of a ranked effect, beside all others.

    Raises VpmError: it cannot stand there.
    """
    model = final.model.without_effect(*entry.key, entry.side)
    free, bounds = final.kept_in(model)
    without, _ = judged_anyhow(model, free, replace(data, simulation=None), bounds)
    model = without.model.with_effect(*rival.key, side=rival.side)
    names = {_anywhere(name): name for name in model.effect(*rival.key, rival.side).parameter_names.values()}
    values = {names[_anywhere(name)]: value for name, value in rival.values.items() if _anywhere(name) in names}
    return _beside(without, model.with_parameters(values), rival, data)


# ---- what was tried --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Last:
    """Last trial of an effect in a ranking: what it added, and which effect came in then."""

    one: Ranked
    winner: Ranked | None
    came_in: bool


def refused_by(ranking: Ranking, outside: Mapping[Key, str], settings: RankingSettings) -> tuple[RefusedEffect, ...]:
    """Effects that a ranking refused or removed again, with the reason; the most hopeful of its last round first."""
    last: dict[Key, _Last] = {}
    for several in ranking.rounds:
        for one in several:
            winner = several[0] if _accepts(several, settings) else None
            last[one.key] = _Last(one, winner, winner is one)
    kept = {one.key for one in ranking.effects}
    reasons = {**{key: _reason(entry, settings) for key, entry in last.items() if key not in kept}, **outside}
    return tuple(RefusedEffect(*key, reason) for key, reason in reasons.items())


def _unpromising(ranking: Ranking, model: Model, offered: Sequence[Candidate]) -> dict[Key, str]:
    """Effects that no round of a ranking fitted, with the reason."""
    tried = {one.key for several in ranking.rounds for one in several}
    reason = "the first step of a fit predicted less evidence than others did, or too little for a fit"
    left = [candidate for candidate in offered if candidate.key not in tried]
    return {candidate.key: _why_unbuilt(model, candidate) or reason for candidate in left}


def _split_already(model: Model, effects: Sequence[str] | None) -> tuple[RefusedEffect, ...]:
    """Effects that a ranking cannot offer, for the model file has another one that gives way at their joint."""
    splitting = [EFFECTS[name] for name in asked_for(effects) if EFFECTS[name].splits]
    there = {(one.name, one.at) for one in model.effects}
    joints = [joint for joint in model.driven_joints if model.joint_behind(joint)]
    return tuple(
        RefusedEffect(
            effect.name,
            joint,
            f"{why}; take that out of the model file to try this one",
        )
        for effect in splitting
        for joint in joints
        if (effect.name, joint) not in there and (why := beyond(effect, joint, model))
    )


def _why_unbuilt(model: Model, candidate: Candidate) -> str:
    """Why a model cannot have an effect that a ranking offers, or "": behind a split joint nothing may have inertia."""
    if not candidate.effect.splits:
        return ""
    try:
        _ = model.with_effect(candidate.effect.name, candidate.site, **candidate.starts[0]).core
    except VpmError as error:
        return f"no machine has it as described: {error}"
    return ""


def _accepts(several: Sequence[Ranked], settings: RankingSettings) -> bool:
    """Whether the first effect of a ranking's round came in: only accepted effects have evidence."""
    return bool(several) and several[0].evidence > settings.odds


def _removes(one: Ranked) -> str:
    return one.judgement.words


def _reason(entry: _Last, settings: RankingSettings) -> str:
    one, winner = entry.one, entry.winner
    if entry.came_in:
        return "it is not needed any more beside what came in after it"
    if lacks := one.judgement.lacks(settings):
        return lacks
    if one.evidence <= settings.odds:
        return f"it {_removes(one)}, but adds {one.evidence:.3g} nats to the evidence; {settings.odds:g} are needed"
    if winner is None:
        return f"it {_removes(one)}, but its shape ends where the records do"
    return (
        f"it {_removes(one)} where {winner.effect} at {winner.site} {_removes(winner)}, "
        "and was not tried again beside that"
    )


def candidates_of(
    ranking: Ranking, gains: Mapping[Key, float], settings: RankingSettings
) -> tuple[RankedCandidate, ...]:
    """Candidates of all rounds of a ranking for the result, the most probable first."""
    found = []
    for number, several in enumerate(ranking.rounds):
        for place, one in enumerate(several):
            accepted = place == 0 and _accepts(several, settings) and one.key in gains
            validation = gains[one.key] if accepted else np.nan
            found.append(
                RankedCandidate(
                    *one.key, number + 1, one.judgement.removed, validation, accepted, one.evidence, one.probability
                )
            )
    return tuple(found)


def notes(accepted: Sequence[Accepted], training: InverseDynamicsProblem) -> list[str]:
    """Notes on parameters that only the ranking could estimate, and on delays of commands that were held."""
    half = 0.5e3 * max(m.dt for m in training.motions)
    held = "" if training.hold == HOLDS[0] else "not "
    late = [
        f"{entry.label}: commands were {held}held from sample to sample beside it; its time is {half:.3g} ms "
        f"{'shorter' if held else 'longer'} if they {'were' if held else 'were not'}"
        for entry in accepted
        if EFFECTS[entry.key[0]].late == "delay" and entry.key[1] in training.nominal.actuators
    ]
    blind = [", ".join(entry.measured.invisible) for entry in accepted if entry.measured.invisible]
    return [
        f"{names}: as the ranking fitted it, for the inverse-dynamics residual does not show it" for names in blind
    ] + late
