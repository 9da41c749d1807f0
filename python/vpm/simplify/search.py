"""Walk a model back down: the cheapest one that still predicts the data within a tolerance.

The search goes in four strides. All flexible links together are made finer, from the coarsest, until that loses next to
nothing: what comes next is tried on that model, which is cheap, and what is slower by a coarse timing is not fitted.
Then each place by itself is made simpler by each of its changes. Losses and savings of single changes are added up to
foresee those of all combinations, and the combinations that should be best are fitted, simulated and timed. From the
best one each further change is tried while one pays.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from itertools import islice, product

from vpm.budget import budget
from vpm.errors import SimulationError
from vpm.experiment import Experiment, as_records
from vpm.model import Model
from vpm.simplify.judge import FITTING, Judge, by_the_model, reference_mode, shown
from vpm.simplify.pareto_front import Ladder, Rung, pareto
from vpm.simplify.reductions import COUPLING_TERMS, OFFERED, VELOCITY_TERMS, Reduction, reduced, reductions
from vpm.simplify.surrogates import surrogates
from vpm.simplify.terms import CURVED, ROUNDING, deformation_share, effort_share, motions, ranked
from vpm.simplify.trials import ALIKE, CLOCK, NEGLIGIBLE, PRIORITY, REPEATED, Changes, Trials
from vpm.simulate import Setup

#: Share of efforts or deformations, in tolerances, from which on no model is tried without the terms.
WEIGHTY = 5.0
#: Combinations that are foreseen, and of those the ones that are tried.
FORESEEN, TRIED = 100_000, 8
#: How near to the least error one is that a quicker way may have instead, and what time a round has to save to be
#: followed by another.
NEAR, SAVED = 1.1, 0.95
#: A change that alone loses so many tolerances is not tried on the cheapest model.
TOO_MUCH = 2.0
#: Steps timed of the chosen one: as many as these seconds allow, within these numbers.
CHOSEN_SECONDS, CHOSEN_STEPS = 1.0, (10_000, 100_000)

Sites = dict[tuple[str, str], tuple[Reduction, ...]]


def simplify(
    model: Model,
    experiments: Experiment | Sequence[Experiment],
    *,
    rate: float = 1000.0,
    tolerance: float = 0.02,
    share: float = 0.2,
    validate: Experiment | Sequence[Experiment] | None = None,
    against: str = "data",
    mode: str | None = None,
    channels: Sequence[str] | None = None,
    tell: Callable[[str], None] | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
) -> Ladder:
    """Make a model simpler, place by place, as far as the tolerance allows, and find the cheapest way to step it.

    Effects are left out, flexible links made coarser or rigid in single deformations, spools of hydraulic drives made
    static, their pressures one, NARX elements put in their place, Coriolis and centrifugal terms, coupling across
    joints and terms of second order of links left out where their shares allow it, and every integrator of fixed steps
    is tried with one, two and four steps in a period. The adjustable parameters of every reduced model are fitted again
    before it is judged by simulation, so that what remains may take over what it can. Ctrl-C ends the search with what
    is known.

    Parameters
    ----------
    experiments : Experiment or sequence of Experiment
        Trajectories on which accuracy counts.
    rate : float
        Rate of the controller, Hz.
    tolerance : float
        Largest loss of relative error against the full model.
    share : float
        Share of the period that a step may take.
    validate : Experiment or sequence of Experiment, optional
        Trajectories to judge on; by default those of the fit.
    against : {"data", "model"}
        Reference: what was measured, or what the full model does on the commands of the records.
    mode : str, optional
        Mode of simulation to judge in; by default closed loop or restarts, see `vpm.simulate.judging_mode`, and
        against the model free run instead of restarts.
    channels : sequence of str, optional
        What is compared; by default all measured outputs, and against the model strains, places of markers and
        pressures, or the positions of the joints where there are none.
    tell : callable, optional
        Called with a sentence at every step.
    executor : Executor or callable, optional
        Fits reduced models that do not wait for each other, one task each, see `vpm.tasks.Tasks`; steps are timed here.

    Raises
    ------
    SimulationError
        A number is out of its range, the records do not suit the rate, or nothing can be simulated.
    ExecutorError
        The executor takes no work.
    """
    if not tolerance >= 0.0:
        raise SimulationError(f"a tolerance of {tolerance:g} is not possible; give a share of zero or more")
    if against not in ("data", "model"):
        raise SimulationError(f'against is "{against}"; choose "data" or "model"')
    if not rate > 0.0:
        raise SimulationError(f"a rate of {rate:g} Hz is not possible; give a positive number")
    say = tell or (lambda _: None)
    records = as_records(experiments)
    validation = records if validate is None else as_records(validate)
    mode = reference_mode(model, records, against, mode)
    if against == "model":
        say("the full model as the reference")
        channels = shown(model) if channels is None else channels
        known = {id(each): by_the_model(model, each, mode, rate, channels) for each in (*records, *validation)}
        records, validation = ([known[id(each)] for each in group] for group in (records, validation))
    judge = Judge(model, records, validation, rate, mode, channels)
    trials = Trials(model, judge, lambda changes: bool(changes) or against == "data", say, tolerance, executor)
    sites = reductions(model, surrogates(model, judge.records, mode, rate, judge.channels))
    try:
        _weigh_terms(trials, sites)
        _descend(trials, sites)
    except KeyboardInterrupt:
        if not trials.rungs:
            raise
        say("interrupted: the best of what was tried")
    return _concluded(trials, sites, share, against)


def _descend(trials: Trials, sites: Sites) -> None:
    full = trials.attempt(())
    if not full:
        raise SimulationError(
            f"{trials.model.name}: no integrator of fixed steps can simulate the records at {trials.judge.rate:g} Hz: "
            f"{trials.reason}"
        )
    limit = min(rung.error for rung in full) + trials.tolerance
    base = _together(trials, sites, limit)
    singles = (_with(base, change) for changes in sites.values() for change in _coarser(changes, base))
    trials.ahead(singles, trials.as_quick_as(base))
    alone = {site: _alone(trials, base, changes) for site, changes in sites.items()}
    foreseen = _foreseen(trials, base, {site: _paying(found) for site, found in alone.items()}, limit)
    trials.ahead(foreseen, _within(trials.rungs, limit).seconds)
    for changes in foreseen:
        trials.attempt(changes, _within(trials.rungs, limit).seconds)
    lost = {change: added for found in alone.values() for change, (_, added) in found.items()}
    _polish(trials, sites, limit, {change for change, added in lost.items() if added > TOO_MUCH * trials.tolerance})


def _weigh_terms(trials: Trials, sites: Sites) -> None:
    """Terms of the search that are too large along the motion, or none, and are not tried."""
    judge, model, limit = trials.judge, trials.model, WEIGHTY * trials.tolerance
    terms = [site for site in sites if site[0].startswith("terms")]
    if not terms or judge.mode not in ("free_run", "closed_loop"):
        return
    try:
        along = motions(model, judge.validation, judge.mode, Setup(FITTING, judge.per_sample))
    except SimulationError:
        return
    for site in terms:
        if site in (VELOCITY_TERMS.site, COUPLING_TERMS.site):
            left, share = ranked(model, sites[site], lambda each: effort_share(model, each, along), limit)
            trials.say(f"{sites[site][-1].name} terms take {100 * share:.2g} % of the efforts")
        else:
            share = deformation_share(model, site[1], along)
            left = sites[site] if ROUNDING < share <= limit else ()
            trials.say(f"second-order terms take {100 * share:.2g} % of the deformation of {site[1]}")
        if left:
            sites[site] = left
        else:
            del sites[site]


def _together(trials: Trials, sites: Sites, limit: float) -> Changes:
    """Reductions in the search of all links to one coarser level: the cheapest with next to no loss.

    The coarsest come first, by the number of coordinates: they are quick to fit, and once one of them loses next to
    nothing, a coarse timing shows that the finer ones need no look.
    """
    best: Changes = ()
    seconds = min(rung.seconds for rung in trials.attempt(()))
    levels = [changes for (kind, _), changes in sites.items() if kind == "level"]
    together = [tuple(c for each in levels for c in each if c.name == level) for level in OFFERED]
    coarsest = sorted(filter(None, together), key=lambda changes: reduced(trials.model, changes).core.n_states)
    trials.ahead(coarsest)
    for changes in coarsest:
        rung = trials.cheapest(changes, limit - (1.0 - NEGLIGIBLE) * trials.tolerance)
        if rung is not None and rung.seconds < seconds:
            best, seconds = changes, rung.seconds
    return best


def _alone(trials: Trials, base: Changes, changes: Sequence[Reduction]) -> dict[Reduction, tuple[float, float]]:
    """Seconds saved and error added by each single change of the search on the common start.

    The common start loses next to nothing: what takes longer can win nothing, by itself or with others.
    """
    start, longest = _best(trials.attempt(base)), trials.as_quick_as(base)
    found: dict[Reduction, tuple[float, float]] = {}
    for change in _coarser(changes, base):
        rungs = trials.attempt(_with(base, change), longest)
        if rungs:
            best = _best(rungs)
            found[change] = (start.seconds - best.seconds, best.error - start.error)
    return found


def _paying(found: dict[Reduction, tuple[float, float]]) -> dict[Reduction, tuple[float, float]]:
    """Changes of one site in the search that no other one beats."""
    names = list(found)
    return {names[k]: found[names[k]] for k in pareto([(-saved, added) for saved, added in found.values()])}


def _coarser(changes: Sequence[Reduction], base: Changes) -> Sequence[Reduction]:
    """Changes of one site in the search beyond that in the base, finest first."""
    straight = _straight(base)
    changes = [each for each in changes if not _is_idle(each, straight)]
    taken = next((each for each in base if each in changes), None)
    return changes if taken is None else changes[changes.index(taken) + 1 :]


def _straight(changes: Changes) -> set[str]:
    """Links in the search of rigid segments, or rigid ones: no second-order terms to leave out."""
    return {each.at for each in changes if each.kind == "level" and not each.name.startswith(CURVED)}


def _is_idle(change: Reduction, straight: set[str]) -> bool:
    return change.name == "second-order" and change.at in straight


def _best(rungs: Sequence[Rung]) -> Rung:
    """Cheapest model of the search among those whose error is near the least."""
    least = min(rung.error for rung in rungs)
    return min((rung for rung in rungs if rung.error <= NEAR * least), key=lambda rung: rung.seconds)


def _with(base: Changes, change: Reduction) -> Changes:
    """Changes of the search with one more, without those that do nothing beside it."""
    changes = (*(each for each in base if each.site != change.site), change)
    straight = _straight(changes)
    return tuple(each for each in changes if not _is_idle(each, straight))


def _foreseen(
    trials: Trials, base: Changes, singles: dict[tuple[str, str], dict[Reduction, tuple[float, float]]], limit: float
) -> list[Changes]:
    """Foreseen best combinations of the search: the front of summed savings and losses."""
    start = _best(trials.attempt(base))
    options = [[None, *found] for found in singles.values()]
    numbers = {change: pair for found in singles.values() for change, pair in found.items()}
    points, combinations = [], []
    for choice in islice(product(*options), FORESEEN):
        taken = [change for change in choice if change is not None]
        error = start.error + sum(numbers[change][1] for change in taken)
        points.append((start.seconds - sum(numbers[change][0] for change in taken), error))
        combinations.append(taken)
    order = sorted(pareto(points), key=lambda k: abs(points[k][1] - limit))
    result = []
    for place in order[:TRIED]:
        changes = base
        for change in combinations[place]:
            changes = _with(changes, change)
        result.append(changes)
    return result


def _polish(trials: Trials, sites: Sites, limit: float, hopeless: set[Reduction]) -> None:
    """Polish at the end of the search: single further reductions, as long as one pays."""
    while True:
        best = _within(trials.rungs, limit)
        base = trials.changes_of(best)
        further = [change for changes in sites.values() for change in _coarser(changes, base) if change not in hopeless]
        trials.ahead((_with(base, change) for change in further), best.seconds)
        for change in further:
            trials.attempt(_with(base, change), best.seconds)
        if not _within(trials.rungs, limit).seconds < SAVED * best.seconds:
            return


def _within(rungs: Sequence[Rung], limit: float) -> Rung:
    return min((rung for rung in rungs if rung.error <= limit), key=lambda rung: rung.seconds)


def _concluded(trials: Trials, sites: Sites, share: float, against: str) -> Ladder:
    """Choice of the search, its steps timed once more as `vpm.budget` does."""
    rungs, judge = trials.rungs, trials.judge
    chosen = _simplest([rung for rung in rungs if rung.loss <= trials.tolerance])
    model = trials.fitted(trials.changes_of(chosen))
    report = budget(
        model,
        rate=judge.rate,
        share=share,
        steps=int(min(max(CHOSEN_SECONDS / chosen.seconds, CHOSEN_STEPS[0]), CHOSEN_STEPS[1])),
        integrator=chosen.integrator,
        substeps=chosen.substeps,
        experiment=trials.courses.record(model),
        priority=PRIORITY,
        # As all rungs were timed.
        compiled=False,
    )
    place = rungs.index(chosen)
    chosen = chosen.timed(report.quantiles["p50"], report.quantiles["p99.9"])
    rungs[place] = chosen
    return Ladder(
        tuple(sorted(rungs, key=lambda rung: rung.seconds)),
        chosen,
        report.holds,
        judge.rate,
        trials.tolerance,
        share,
        judge.mode,
        against,
        _dearest(trials, sites),
        model,
        report,
        trials.cut,
    )


def _simplest(rungs: Sequence[Rung]) -> Rung:
    """Simplest choice of the search: the cheapest, or as cheap with more left out or less error."""
    best = rungs[0]
    longest = ALIKE * best.seconds + CLOCK
    more = [rung for rung in rungs if set(rung.removed) >= set(best.removed) and rung.seconds <= longest]
    others = [
        rung
        for rung in rungs
        if (len(rung.removed), rung.states) == (len(best.removed), best.states)
        and rung.seconds <= REPEATED * best.seconds
    ]
    return max((*more, *others), key=lambda rung: (len(rung.removed), -rung.error))


def _dearest(trials: Trials, sites: Sites) -> tuple[tuple[str, float], ...]:
    """Step time that each place's last reduction in the search saves alone (s), the largest first."""
    full = min((r for r in trials.rungs if not r.removed), key=lambda r: r.seconds)
    setup = Setup(full.integrator, full.substeps)
    saved = ((str(changes[-1]), trials.saved(changes[-1], setup)) for changes in sites.values())
    return tuple(sorted(((name, gain) for name, gain in saved if gain > 0.0), key=lambda pair: -pair[1]))
