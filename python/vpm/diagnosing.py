"""Find what a model is missing: recalibrate, look, rank or search the catalogue, and say what the data support."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import Literal, TypedDict, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue import EFFECTS
from vpm.discrepancy.ambiguity import Rivals, listed, rivals
from vpm.discrepancy.apart import only_where_closed
from vpm.discrepancy.beliefs import moved_far
from vpm.discrepancy.by_ranking import free_joints, observed_gaps, searched, why_not_ranked
from vpm.discrepancy.by_ranking import notes as notes_of
from vpm.discrepancy.candidates import asked_for, slow_speeds
from vpm.discrepancy.choice import Accepted
from vpm.discrepancy.confirmation import Data, Judged, is_clear, judge, judged_anyhow, weaker
from vpm.discrepancy.contacts import with_told_contacts
from vpm.discrepancy.diagnosis import (
    AcceptedEffect,
    ChannelGap,
    Diagnosis,
    EffectParameterEstimate,
    Step,
)
from vpm.discrepancy.elimination import Stage
from vpm.discrepancy.empirical import beside
from vpm.discrepancy.evidence import gather
from vpm.discrepancy.filters import filters
from vpm.discrepancy.floor import noise_floor
from vpm.discrepancy.moving import check_moving, check_stuck
from vpm.discrepancy.overheard import overheard
from vpm.discrepancy.overlooked import overlooked
from vpm.discrepancy.provenance import own_settings, provenance
from vpm.discrepancy.remainder import Remainder, remainder
from vpm.discrepancy.search import Search, ambiguities, further, search
from vpm.discrepancy.shown import pictures, traces, where
from vpm.discrepancy.side_by_side import Progress, SideBySide
from vpm.discrepancy.standing import in_order, replaced, timed_again
from vpm.discrepancy.structure import Structure, structure
from vpm.discrepancy.telling_apart import experiments as experiments_for
from vpm.discrepancy.timing import in_time
from vpm.discrepancy.told_apart import told_apart
from vpm.discrepancy.verdict import is_negligible, verdict
from vpm.errors import DiagnosisError, DivergedError, VpmError
from vpm.experiment import Experiment, as_records, joints_from_shafts
from vpm.experiment.signal import check_cutoff
from vpm.identify import InverseDynamicsProblem, OutputErrorProblem, gaps
from vpm.identify.fitted import fit_of
from vpm.identify.parallel import worker_count
from vpm.log_check import refuse_mistakes
from vpm.model import Model
from vpm.one_thread import in_one_thread
from vpm.ranking import Ranking, Settings, rank
from vpm.simulate import Setup, judging_mode
from vpm.tasks import done_by

Array = NDArray[np.float64]

#: Share of each record that is kept out of the fit when no validation record is given.
HELD_OUT = 0.3
#: Most effects to accept, if not given, of machines with few joints.
LEAST_LIMIT = 6
#: What an interrupted diagnosis says of itself.
STOPPED = "stopped by Ctrl-C before every candidate was tried: this is what was known until then"
#: Said of what would do in the place of an effect.
ALIKE = "predicts the unseen data as well"
#: Said where the logs tell what commands do between samples.
FOUND_HOLD = "commands run from sample to sample, as readings of a drive do; simulate with hold {hold} too"
#: Which way the names came.
RANKED = "names come from a ranking of the training records"
SEARCHED = "names come from a search on balances of effort, for {reason}"
NOT_SEARCHED = "a search on balances of effort does not try {effects}"
STOPPED_LATE = "stopped by Ctrl-C before what is left, and what else would do, was examined"
#: What is odd in a channel and may pass for an effect.
NOTED = ("delay", "frozen", "clipped", "spikes")
#: Said where an error follows a search, and what such an error is.
FAILED = "{what} could not be computed: {error}"
BROKEN = (ValueError, ArithmeticError, LookupError)
#: Said where names come from a search.
UNSEEN = "the joint {joint} has no drive, so that no balance of effort sees what acts there, and nothing is said of it"
#: Stated uncertainties, on a logarithmic scale, that a recalibration may move what the model is not linear in.
REACH = 4.0

Tell = Callable[[str], None]
#: Where names come from.
Names = Literal["ranking", "search"]
RANKING: Names = "ranking"
Found = TypeVar("Found")


class Asked(TypedDict, total=False):
    """Of what `diagnose` takes, that which holds for many diagnoses."""

    effects: Sequence[str] | None
    cutoff: float | None
    setup: Setup | None
    limit: int | None
    names: Names
    check: bool


_Records = tuple[tuple[Experiment, ...], tuple[Experiment, ...], list[str]]


def diagnose(
    model: Model,
    experiments: Experiment | Sequence[Experiment],
    validate: Experiment | Sequence[Experiment] | None = None,
    *,
    effects: Sequence[str] | None = None,
    cutoff: float | None = None,
    setup: Setup | None = None,
    limit: int | None = None,
    names: Names = RANKING,
    check: bool = True,
    workers: int | None = None,
    tell: Tell | None = None,
    progress: Progress | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
) -> Diagnosis:
    """Name the physics that ``model`` is missing, with evidence on data that were not fitted.

    Logs with a wrong unit, sign, name or clock are refused, see `vpm.check_log`. The parameters that the model file
    calls uncertain are fitted first, for a wrong parameter is not a missing effect. Where links are rigid and up to
    three joints move, a ranking of the training records names what is missing, see `vpm.rank`, and unseen records
    decide no name. Elsewhere every effect is screened at every site by its regressor; the promising ones are refitted
    together with the model and have to predict unseen records, both as a balance of effort and in simulation. One is
    accepted at a time, the one with the largest unseen gain per number.

    Parameters
    ----------
    model : Model
        The nominal model. Parameters with an uncertainty may be recalibrated.
    experiments : Experiment or sequence of Experiment
        Records to fit: position of every joint, or of as many independent transmissions, and command of every
        actuator.
    validate : Experiment or sequence of Experiment, optional
        Records that are never fitted. Without them the last 30 % of each record is kept out.
    effects : sequence of str, optional
        Restrict the catalogue to these names.
    cutoff : float, optional
        Cut-off frequency of the motion filter, Hz; chosen from each record if not given.
    setup : Setup, optional
        Integrator, substeps and horizon of the simulations.
    limit : int, optional
        Most effects to accept; two for each joint, but at least six, if not given.
    names : {"ranking", "search"}
        Where names come from: from `vpm.rank` where that covers the machine and from rounds of screening on balances of
        effort elsewhere, or from these in any case.
    check : bool
        Refuse logs with a mistake that no machine makes by itself.
    workers : int, optional
        Candidates that are worked on at a time; one per core if not given. The result does not depend on it.
    tell : callable, optional
        Called with a sentence at every step and for every candidate that was refitted, from several threads; an
        exception raised there ends the diagnosis.
    progress : callable, optional
        Called after every candidate with what is being done, its name, how many are done, and how many there are.
    executor : Executor or callable, optional
        Does the diagnosis as one task, see `vpm.tasks.Tasks`; `vpm.diagnose_many` gives it many. ``tell`` and
        ``progress`` hear of it when it is done, ``workers`` is one if not given.

    Returns
    -------
    Diagnosis
        Ctrl-C during the search gives what is known until then, with ``interrupted``; earlier it raises.

    Raises
    ------
    DiagnosisError
        No record was given, or an effect name or the source of names is unknown.
    ExperimentError
        A channel is missing, or a log cannot be believed.
    ExecutorError
        The executor does not take the diagnosis, or its worker died with it again and again.
    """
    asked = Asked(effects=effects, cutoff=cutoff, setup=setup, limit=limit, names=names, check=check)
    given = (as_records(experiments), as_records(validate or ()))
    check_asked(asked, workers)
    if executor is None:
        diagnosis = diagnosed(model, *given, asked, workers, tell, progress)
    else:
        told = done_by(executor, partial(overheard, diagnosed, model, *given, asked, workers or 1), tell)
        diagnosis = told.repeat(tell, progress)
    return with_provenance(diagnosis, model, *given, asked, workers)


def check_asked(asked: Asked, workers: int | None) -> None:
    """Refuse what no diagnosis can be asked.

    Raises
    ------
    DiagnosisError, IdentificationError
        An effect, the source of names or the number of workers is none.
    """
    asked_for(asked.get("effects"))
    if (names := asked.get("names", RANKING)) not in get_args(Names):
        raise DiagnosisError(f'names come from a "search" or a "ranking", not from "{names}"')
    worker_count(workers)


def with_provenance(
    diagnosis: Diagnosis,
    model: Model,
    experiments: Sequence[Experiment],
    validate: Sequence[Experiment],
    asked: Asked,
    workers: int | None,
) -> Diagnosis:
    """The diagnosis with what it was made of, as this process knows it: where it was done, paths may be others.

    Parameters
    ----------
    diagnosis : Diagnosis
    model, experiments, validate, asked, workers
        As for `diagnosed`.
    """
    usual = {"effects": None, "cutoff": None, "limit": None, "names": RANKING, "check": True, "workers": None}
    given = {**usual, **asked, "workers": workers}
    settings: dict[str, tuple[object, object]] = {name: (given[name], default) for name, default in usual.items()}
    settings |= own_settings(asked.get("setup") or Setup(), "setup")
    return replace(diagnosis, provenance=provenance(model, experiments, validate, "vpm.diagnose", settings))


@in_one_thread
def diagnosed(
    model: Model,
    experiments: list[Experiment],
    validate: list[Experiment],
    asked: Asked,
    workers: int | None = None,
    tell: Tell | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """What `diagnose` finds, without where it comes from; a task for an executor.

    Parameters
    ----------
    model : Model
    experiments, validate : list of Experiment
    asked : Asked
    workers, tell, progress
        As for `diagnose`.
    """
    effects, cutoff, limit = asked.get("effects"), asked.get("cutoff"), asked.get("limit")
    setup = asked.get("setup") or Setup()
    records = _records(model, experiments, validate)
    if cutoff is not None:
        for record in chain(*records[:2]):
            check_cutoff(cutoff, record.rate, len(record.time))
    each = SideBySide(workers, progress)
    odd: list[str] = []
    if asked.get("check", True):
        if tell is not None:
            tell("checking the channels of the logs")
        found = refuse_mistakes(model, [*experiments, *validate], setup=setup, workers=workers, progress=progress)
        odd = [str(one) for one in found if one.kind in NOTED]
    most = max(LEAST_LIMIT, 2 * len(model.joints)) if limit is None else limit
    names = asked.get("names", RANKING)
    diagnosis = _diagnosis(model, records, effects, cutoff, setup, most, names, each, tell)
    return replace(diagnosis, notes=(*odd, *diagnosis.notes))


def _diagnosis(
    model: Model,
    records: _Records,
    effects: Sequence[str] | None,
    cutoff: float | None,
    setup: Setup,
    limit: int,
    names: Names,
    each: SideBySide,
    tell: Tell | None,
) -> Diagnosis:
    """See `diagnose`."""
    began = time.perf_counter()
    say = tell or (lambda _: None)
    training, unseen, notes = records
    # A record cut off in the middle of a motion does not say what its controller remembers.
    mode = "restarts" if notes else judging_mode(model, unseen)
    by = (names, effects, limit)
    ranking = _ranking(model, (training, unseen), by, setup, say, each, notes)
    if ranking is not None and ranking.hold != setup.course:
        notes.append(FOUND_HOLD.format(hold=ranking.hold))
        setup = replace(setup, hold=ranking.hold)
    data = _data(model, training, unseen, mode, cutoff, setup, notes)
    say("comparing the nominal model with the data")
    nominal = _nominal(model, data, notes)
    say("recalibrating the nominal parameters")
    recalibrated = _recalibrated(model, data, notes, each)
    found, ambiguous, late = _named(ranking, recalibrated, data, by, say, each, notes)
    try:
        say("measuring the noise floor")
        measure = partial(_examined, nominal, recalibrated, data, mode, setup)
        floor, gap, left = measure(found.final)
        if (kept := only_where_closed(found, data, gap, left)) is not found:
            found, (floor, gap, left) = kept, measure(kept.final)
        say("examining what is left")
        rest, stopped = _until_stopped(
            lambda: _rest(recalibrated, found, data, each) if found.accepted or not is_negligible(gap) else None, None
        )
        beyond = observed_gaps(ranking, data.training.joints) if ranking is not None else {}
        word, summary, described = verdict(data, nominal, recalibrated, found, gap | beyond, left, rest)
        final, empirical, accepted = found.final, None, found.accepted
        if described and rest is not None:
            told = rest.best if word == "unexplained" else rest.choices[-1]
            final, empirical = told.judged, told.told
            accepted = accepted if told.base is found.final else ()
            if accepted:
                empirical, final = beside(found.final, empirical, final, data)
            gap = _gaps(data, nominal, recalibrated, final, floor)
            summary = f"{summary} {empirical.sentence}" + (f" {rest.seals.sentence}" if rest.seals is not None else "")
        if not accepted:
            ambiguous = ()
        say("looking for the experiment that tells effects apart")
        if stopped or late:
            notes.append(STOPPED_LATE)
        return Diagnosis(
            word,
            f"Stopped before every candidate was tried. {summary}" if found.interrupted else summary,
            tuple(_accepted_effect(entry, found.final) for entry in accepted),
            gap | beyond,
            found.refused,
            found.ranking,
            listed(ambiguities(accepted), ambiguous),
            where(recalibrated.model, data.unseen),
            tuple(_step(data, stage) for stage in found.stages),
            tuple(e.name for e in training),
            tuple(e.name for e in unseen),
            tuple(notes),
            final.model,
            fit_of(final.model, data.training, final.fit, nominal.fit.residual, [e.name for e in training]),
            pictures(data, nominal, recalibrated, final),
            time.perf_counter() - began,
            found.interrupted or stopped or late,
            gather(found.final.model, [entry.key for entry in accepted if entry.side == "motor"], data.unseen, floor),
            empirical,
            experiments_for(found.final, ambiguous, data.training, floor),
            _classes(accepted, ambiguous),
            traces(data, nominal, final),
            {name: parameter.value for name, parameter in model.parameters.items()},
        )
    except BROKEN as error:
        notes.append(FAILED.format(what="what follows the search", error=error))
        return _of_search(model, records, recalibrated, found, data, time.perf_counter() - began)


def _of_search(
    model: Model, records: _Records, recalibrated: Judged, found: Search, data: Data, seconds: float
) -> Diagnosis:
    """What a search found, where nothing after it can be computed: nobody waits for it twice."""
    training, unseen, notes = records
    names = ", ".join(entry.label for entry in found.accepted) or "no effect"
    return Diagnosis(
        "effect_found" if found.accepted else "unexplained",
        f"The search accepts {names} in {model.name}; what is left on unseen records could not be computed.",
        tuple(_accepted_effect(entry, found.final) for entry in found.accepted),
        {},
        found.refused,
        found.ranking,
        (),
        {},
        (),
        tuple(e.name for e in training),
        tuple(e.name for e in unseen),
        tuple(notes),
        found.final.model,
        fit_of(
            found.final.model,
            data.training,
            found.final.fit,
            recalibrated.fit.residual,
            [e.name for e in training],
        ),
        (),
        seconds,
        found.interrupted,
    )


def _ranking(
    model: Model,
    records: tuple[Sequence[Experiment], Sequence[Experiment]],
    by: tuple[Names, Sequence[str] | None, int],
    setup: Setup,
    tell: Tell,
    each: SideBySide,
    notes: list[str],
) -> Ranking | None:
    """A ranking of the training records where names are to come from one and it covers the machine.

    Unseen records only say, at the end, how much of their error what was found leaves.

    ``by`` says where names come from, of which effects, and how many at most. What keeps it from that is noted.
    """
    names, effects, limit = by
    training, unseen = records
    if names != "ranking":
        notes.extend(_not_searched(effects, f'names="{names}" was asked for'))
        return None
    reason = why_not_ranked(model, training)
    if not reason:
        tell("ranking what could be missing")
        try:
            return rank(
                model,
                training,
                unseen,
                effects=effects,
                settings=Settings(effects=limit),
                setup=setup,
                workers=each.workers,
                tell=tell,
                progress=each.progress,
            )
        except KeyboardInterrupt:
            return Ranking((), (), model, model, interrupted=True, hold=setup.course)
        except (VpmError, ArithmeticError) as error:
            reason = f"a ranking fails: {error}"
    notes.append(SEARCHED.format(reason=reason))
    notes.extend(_not_searched(effects, reason))
    notes.extend(UNSEEN.format(joint=joint) for joint in free_joints(model))
    return None


def _named(
    ranking: Ranking | None,
    recalibrated: Judged,
    data: Data,
    by: tuple[Names, Sequence[str] | None, int],
    tell: Tell,
    each: SideBySide,
    notes: list[str],
) -> tuple[Search, tuple[Rivals, ...], bool]:
    """What is missing by a ranking or else by a search, what else would do, and whether Ctrl-C left that open."""
    _, effects, limit = by
    screened = _searchable(effects)
    if ranking is not None:
        tell("measuring what was named on unseen records")
        found, ambiguous = searched(ranking, recalibrated, data, Settings(effects=limit), effects)
        named = {one.key for one in ranking.effects}
        lost = [one for one in found.refused if (one.name, one.site) in named]
        notes.extend([RANKED, *notes_of(found.accepted), *([STOPPED] if found.interrupted else [])])
        notes.extend(f"the ranking names {one.name} at {one.site}: {one.reason}" for one in lost)
        return found, ambiguous, False
    found = search(recalibrated, data, screened, limit, tell, each)
    if found.interrupted:
        notes.append(STOPPED)
    tell("looking for what else would do in the place of each effect")
    nothing: tuple[Rivals, ...] = ()
    settle = partial(_settled, found, data, screened, limit, tell, each)
    try:
        (found, ambiguous), late = _until_stopped(settle, (found, nothing))
    except BROKEN as error:
        notes.append(FAILED.format(what="what else would do in the place of each effect", error=error))
        ambiguous, late = nothing, False
    return found, ambiguous, late


def _settled(
    found: Search, data: Data, effects: Sequence[str] | None, limit: int, tell: Tell, each: SideBySide
) -> tuple[Search, tuple[Rivals, ...]]:
    """Names and their order when each effect has been taken out again, with what would do in its place.

    Where something takes the place of an effect, or comes in beside it as runs of the model ask for it, the search goes
    on beside that.
    """
    known = rivals(found.final, data, found.accepted, effects, each, found.last)
    for _ in range(limit):
        changed, known = replaced(found, known, data)
        if changed is found:
            changed, known = timed_again(found, known, data)
        if changed is found and not found.interrupted:
            changed, known = told_apart(found, known, data, each)
        if changed is found and not found.interrupted:
            changed = overlooked(found, data, each)
        if changed is found:
            break
        found = changed if found.interrupted else further(changed, data, effects, limit, tell, each)
        if len(found.accepted) != 1 or len(known) != 1 or found.final is not changed.final:
            known = rivals(found.final, data, found.accepted, effects, each, found.last)
    found, known = in_order(found, known)
    return with_told_contacts(found, data, each), known


def _until_stopped(work: Callable[[], Found], nothing: Found) -> tuple[Found, bool]:
    """What some work gives, or ``nothing`` if Ctrl-C ended it, and whether it did."""
    try:
        return work(), False
    except KeyboardInterrupt:
        return nothing, True


def _searchable(effects: Sequence[str] | None) -> Sequence[str] | None:
    """Those of the effects asked for that a search tries; all of these if not given."""
    return None if effects is None else [name for name in effects if EFFECTS[name].screened]


def _not_searched(effects: Sequence[str] | None, reason: str) -> list[str]:
    """What is to be said of effects that were asked for and that a search does not try.

    Raises
    ------
    DiagnosisError
        There are no others; ``reason`` says why no ranking tries them.
    """
    left_out = [name for name in effects or () if not EFFECTS[name].screened]
    if not left_out:
        return []
    told = ", ".join(left_out)
    if not _searchable(effects):
        raise DiagnosisError(
            f"a search on balances of effort does not try {told}, and a ranking, which does, is no way here: {reason}; "
            "ask for other effects"
        )
    return [NOT_SEARCHED.format(effects=told)]


def _records(model: Model, experiments: Sequence[Experiment], validate: Sequence[Experiment]) -> _Records:
    """Records to fit, records to judge on, and notes on both."""
    training = tuple(joints_from_shafts(record, model, free=model.adjustable) for record in experiments)
    if not training:
        raise DiagnosisError("no record was given; pass at least one experiment")
    check_moving(model, training)
    unseen = tuple(joints_from_shafts(record, model) for record in validate)
    if unseen:
        check_stuck(model, unseen)
        return training, unseen, []
    pairs = [e.split(1.0 - HELD_OUT) for e in training]
    note = f"no validation record was given: the last {100 * HELD_OUT:.0f} % of each record was kept out of the fit"
    return tuple(p[0] for p in pairs), tuple(p[1] for p in pairs), [note]


def _data(
    model: Model,
    training: Sequence[Experiment],
    unseen: Sequence[Experiment],
    mode: str,
    cutoff: float | None,
    setup: Setup,
    notes: list[str],
) -> Data:
    balance = partial(InverseDynamicsProblem, model, hold=setup.course)
    fitted = balance(training, cutoff=cutoff)
    states, bands = filters(model, fitted, cutoff)
    if states != tuple(m.cutoff for m in fitted.motions):
        fitted = balance(training, cutoff=states, band=bands)
    # One filter for all unseen records: a gap that is measured in another band is another gap.
    predicted = balance(unseen, cutoff=min(states), band=min(bands))
    for problem in (fitted, predicted):
        problem.take_long_steps()
        for number, (record, m) in enumerate(zip(problem.experiments, problem.motions, strict=True)):
            still = problem.standstill(number)
            rest = f"; {100 * still:.0f} % at standstill left out of the balance" if still > 0.0 else ""
            notes.append(f"{record.name}: motion filtered at {m.cutoff:.4g} Hz, compared up to {m.band:.3g} Hz{rest}")
    notes.append(f"unseen records simulated in mode {mode}")
    return Data(fitted, predicted, OutputErrorProblem(model, unseen, mode, setup=setup))


def _nominal(model: Model, data: Data, notes: list[str]) -> Judged:
    """The model as it stands; a nominal model that cannot simulate the records is still compared by effort."""
    try:
        return judge(model, (), data, {})
    except DivergedError as error:
        notes.append(f"the nominal model could not simulate the unseen records: {error}")
        return judge(model, (), replace(data, simulation=None), {})


def _recalibrated(model: Model, data: Data, notes: list[str], each: SideBySide) -> Judged:
    """The model with its uncertain parameters fitted, compared by effort alone where it cannot simulate the records."""
    free = model.adjustable
    if not free:
        notes.append("the model file gives no parameter an uncertainty, so none was recalibrated")
    transitions = _transitions(model, data.training)
    bounds = {**_within_reach(model, free), **transitions}
    # This fit has all cores for its records; candidates share them from here on.
    alone = replace(data, training=data.training.side_by_side(worker_count(each.workers)))
    recalibrated, stopped = judged_anyhow(model, (*free, *transitions), alone, bounds)
    if stopped:
        notes.append(f"the recalibrated model could not simulate the unseen records: {stopped}")
    notes.extend(moved_far(model, recalibrated))
    return recalibrated


def _transitions(model: Model, data: InverseDynamicsProblem) -> dict[str, tuple[float, float]]:
    """Transition velocities of the dry friction that the model has, with bounds from the data.

    Nobody knows them beforehand, and a wrong one leaves a gap at every reversal, where the finer effects live.
    """
    found = {}
    for effect in model.effects:
        name = effect.parameter_names.get("transition_velocity")
        dry = effect.type.sticks and not effect.type.close_to_rest
        if dry and name is not None and effect.at in data.joints:
            joint = data.joints.index(effect.at)
            speeds = np.concatenate([np.abs(data.state(record)[1][:, joint]) for record in range(len(data.motions))])
            found[name] = slow_speeds(float(np.quantile(speeds, 0.999)))
    return found


def _within_reach(model: Model, free: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Bounds of positive parameters that the model is not linear in, from their stated uncertainties.

    With something large missing, a fit may flee to where nothing shows any more, such as oil as soft as air, from where
    no effect leads back. What is linear comes back by itself.
    """
    found = {}
    for name in free:
        parameter = model.parameters[name]
        value, spread = parameter.value, parameter.uncertainty or np.inf
        if parameter.kind != "linear" and value > 0.0 and np.isfinite(spread):
            factor = float(np.exp(REACH * spread / value))
            found[name] = max(parameter.minimum, value / factor), min(parameter.maximum, value * factor)
    return found


def _rest(recalibrated: Judged, found: Search, data: Data, each: SideBySide) -> Remainder:
    """What is left; what an interrupted search accepted stands, for rounds that would have judged it were not to be."""
    start = found.final if found.interrupted or not found.accepted else recalibrated
    return remainder(start, found.final, data, min(m.dt for m in data.training.motions), worker_count(each.workers))


def _gaps(
    data: Data, nominal: Judged, recalibrated: Judged, final: Judged, floor: dict[str, float]
) -> dict[str, ChannelGap]:
    judged = (nominal, recalibrated, final)
    stages = [gaps(data.unseen, stage.unseen) for stage in judged]
    # Of efforts as the drives of the nominal model give them: no drive may shrink them together with its error.
    shrunk = (weaker(data.unseen, nominal, stage) for stage in (recalibrated, final))
    factors = np.array([np.ones(len(data.unseen.joints)), *shrunk])
    by_channel = {f"{joint}.effort": own for joint, own in zip(data.unseen.joints, factors.T, strict=True)}
    result = {}
    for channel, (_, _, unit) in stages[0].items():
        own = by_channel.get(channel, np.ones(len(judged)))
        before, known, after = (float(stage[channel][0] * factor) for stage, factor in zip(stages, own, strict=True))
        signal, noise = _signal(data.unseen, channel), float(floor.get(channel, np.nan) * own[-1])
        result[channel] = ChannelGap(before, known, after, noise, unit, signal, data.unseen.mode)
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


def _examined(
    nominal: Judged, recalibrated: Judged, data: Data, mode: str, setup: Setup, final: Judged
) -> tuple[dict[str, float], dict[str, ChannelGap], Structure]:
    """Noise floor of each channel, gaps at all stages, and what is left of the last one."""
    floor = noise_floor(final.model, data.unseen, final.unseen, mode, setup)
    timed = in_time(final, data)
    left = structure(final.model, data.training, data.unseen, timed.fitted, timed.unseen)
    return floor, _gaps(data, nominal, recalibrated, final, floor), left


def _signal(problem: InverseDynamicsProblem | OutputErrorProblem, channel: str) -> float:
    mine = [block for block in problem.blocks if block.channel == channel]
    return float(np.sqrt(np.average([b.scale**2 for b in mine], weights=[b.moving.sum() for b in mine])))


def _accepted_effect(entry: Accepted, final: Judged) -> AcceptedEffect:
    candidate = entry.trial.probe.candidate
    effect = final.model.effect(*candidate.key, entry.side)
    estimates = []
    for short, dotted in effect.parameter_names.items():
        parameter = final.model.parameters[dotted]
        std = float(final.fit.std[final.free.index(dotted)]) if dotted in final.free else 0.0
        estimates.append(EffectParameterEstimate(short, dotted, parameter.value, parameter.unit, std))
    texts = {e.name: f"{e.value:.4g} {e.unit}" for e in estimates}
    notes = [f"{alias.parameter} held: not told from {alias.partner}" for alias in entry.trial.held]
    if entry.trial.alone:
        notes.append("told by runs of the model itself in closed loop; a balance of effort hardly shows it")
    elif not entry.ranked and not is_clear(final, tuple(e.dotted for e in estimates if e.std > 0.0)):
        notes.append("beside the effects that came later, its interval covers zero: one of them may be enough")
    return AcceptedEffect(
        candidate.effect.name,
        candidate.site,
        candidate.effect.sentence.format(at=candidate.site, **texts),
        tuple(estimates),
        entry.trial.unseen.relative,
        entry.trial.unseen.score,
        (*notes, *(f"{'not told from it' if entry.ranked else ALIKE}: {rival}" for rival in entry.rivals)),
        entry.probability,
        entry.evidence,
        entry.class_probability,
    )


def _classes(accepted: Sequence[Accepted], ambiguous: Sequence[Rivals]) -> tuple[tuple[str, ...], ...]:
    """Each accepted effect with all that would do in its place, where something would."""
    beside = {(rivals.effect, rivals.site): rivals.trials for rivals in ambiguous}
    found = []
    for entry in accepted:
        others = (*entry.rivals, *(trial.probe.candidate.label for trial in beside.get(entry.key, ())))
        if others:
            found.append(tuple(dict.fromkeys((entry.label, *others))))
    return tuple(found)


def _step(data: Data, stage: Stage) -> Step:
    fit, model = stage.judged.fit, stage.judged.model
    names = stage.judged.free
    return Step(
        stage.change,
        stage.effect,
        stage.site,
        {name: model.parameters[name].value for name in names},
        dict(zip(names, map(float, fit.std), strict=True)),
        {name: model.parameters[name].unit for name in names},
        max(share for _, share, _ in gaps(data.training, fit.residual).values()),
        max(share for _, share, _ in gaps(data.unseen, stage.judged.unseen).values()),
    )
