"""Several effects at once in a round of a ranking, where none alone does as well."""

from __future__ import annotations

import contextlib
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import takewhile
from typing import TypeAlias

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.discrepancy.screening.candidates import Candidate, candidates
from vpm.model.splitting import spring_in_series
from vpm.ranking.choice_by_evidence import as_good, weighed
from vpm.ranking.fit import ASTRAY, View
from vpm.ranking.look import Look
from vpm.ranking.model_structure import Structure
from vpm.ranking.one_step_without import beside_others, shown_in_efforts
from vpm.ranking.regression import regressed
from vpm.ranking.result import Ranked
from vpm.ranking.start_values import started
from vpm.ranking.structure_extensions import SIDES
from vpm.ranking.substitute_records import why_unbalanced
from vpm.ranking.trials import Trials
from vpm.ranking.tried_effect import Trial

#: Looks at what was found, and a round for each new effect; looks as they were and none if nothing was.
Found: TypeAlias = tuple[list[Look], list[tuple[Ranked, ...]]]


def several_at_once(trials: Trials, looks: list[Look], best: Trial | None, tried: Sequence[Trial]) -> Found:
    """Round with several effects at once, where no effect alone does as well."""
    looks, together = _rubbing_everywhere(trials, looks, best)
    if not together:
        looks, together = _at_several_places(trials, looks, best, tried)
    if not (best or together):
        looks, together = _resting_on_another(trials, looks, tried)
    return (looks, together) if best or together else _rubbing_on_both_sides(trials, looks)


def _at_several_places(trials: Trials, looks: list[Look], best: Trial | None, tried: Sequence[Trial]) -> Found:
    """Round with one effect at several places, where no effect alone does as well."""
    room = trials.settings.effects - len(looks[0].fitted.structure.effects)
    if best is not None and not best.look.has_room(best.fitted):
        return looks, []
    comparable = [one for one in tried if best is None or one.look is best.look]
    for trial in _alike(trials, comparable, room):
        with contextlib.suppress(*ASTRAY):
            if not trial.counts or (best is not None and not _does_better(trials, trial, best)):
                continue
            look = trials.look(trial.fitted)
            new = [key for key in trial.fitted.structure.effects if key not in trial.look.fitted.structure.effects]
            found = list(takewhile(trials.stands, (trials.weighed_beside_others(key, look) for key in new)))
            if len(found) == len(new) and trials.against_validation(trial).counts:
                trials.say(f"{trial.key[0]} at {' and '.join(site for _, site in new)} together {trial.removing}")
                return trials.all_looks(look), [trials.listed(one, [one]) for one in found]
    return looks, []


def _does_better(trials: Trials, trial: Trial, best: Trial) -> bool:
    """Whether one effect at several places does more than another alone, by more than that one's law is wrong by.

    Where all sensors are late, so is the drive: with more numbers they always leave a little less.
    """
    if as_good(best, trial, trials.settings):
        return False
    return trials.advantage(trial.fitted, best.fitted) > trials.settings.odds


def _alike(trials: Trials, tried: Sequence[Trial], most: int) -> list[Trial]:
    """Fits of one effect at several places together, ``most`` effects at a time, the best first.

    Joints that move each other hide such an effect from each other. A command that is delayed at one drive alone would
    need a force at the next drive that no log holds.
    """
    several: dict[tuple[Look, str], dict[str, Trial]] = defaultdict(dict)
    for trial in sorted(tried, key=lambda one: one.left):
        name, site = trial.key
        several[trial.look, name].setdefault(site, trial)
    groups = [list(places.values()) for places in several.values() if 1 < len(places) <= most]

    def one_fitted(group: Sequence[Trial]) -> Trial:
        structure, look = _joined(group), group[0].look
        least = min(one.fitted.cost for one in tried if one.look is look)
        view, goal = View(look.noise), min(look.fitted.cost - look.needed, least)
        begun = trials.fitter.fitted(structure, look.fitted.tracker, view, goal, rough=True)
        return Trial.of(
            trials.fitter.finished(begun, view) if begun.cost < goal else begun, look, ended=begun.cost < goal
        )

    ends = trials.each("fitting at several places", one_fitted, groups, lambda group: group[0].key[0])
    return _plainest_first([end for end in ends if isinstance(end, Trial)])


def _plainest_first(ends: Sequence[Trial]) -> list[Trial]:
    """Fits at several places by the error that they leave, but the plainest first of those as good as the best.

    A contact whose play shrinks to nothing is a spring: with more numbers it leaves as little.
    """
    ordered = sorted(ends, key=lambda end: end.left)
    alike = [end for end in ordered if end.look is ordered[0].look and as_good(end, ordered[0], end.look.settings)]
    return [*sorted(alike, key=lambda end: end.order), *(end for end in ordered if end not in alike)]


def _joined(group: Sequence[Trial]) -> Structure:
    """Structure with one effect at several places, each with the values of its own fit.

    Where that led nowhere they begin at a size that is nothing unusual, one deviation of what is known of them.
    """
    first, *others = (_begun(trial) for trial in group)
    for other in others:
        first = first.with_last_of(other)
    return first


def _begun(trial: Trial) -> Structure:
    structure, known = trial.fitted.structure, trial.look.fitted.structure.priors
    if trial.fitted.cost < trial.look.fitted.cost:
        return structure
    fresh = np.array([name not in known for name in structure.priors])
    return structure.at(np.where(fresh, 1.0, structure.standard))


def with_usual_friction(trials: Trials, looks: list[Look]) -> Found:
    """Looks begun with the usual friction of several joints, where that leaves nothing that another effect could do.

    A description of a robot often states no friction. Each joint that lacks it hides what friction at another one would
    explain, and known parameters go astray to make up for all of it.
    """
    first, *_ = looks
    if why_unbalanced(trials.start.model, trials.fitter.tracked.experiments) or not first.has_room():
        return looks, []
    with contextlib.suppress(*ASTRAY):
        structure = _with_usual_friction(trials, first)
        if structure is None:
            return looks, []
        rubbing = trials.fitted(structure, first.fitted.tracker)
        if not first.judged(rubbing).is_repeated(trials.settings):
            return looks, []
        trials.rubbing = rubbing.structure
        if all(one.is_lost for one in looks) or not first.has_room(rubbing):
            return _without_needless(trials, trials.look(rubbing), looks)
    return looks, []


def _rubbing_everywhere(trials: Trials, looks: list[Look], best: Trial | None) -> Found:
    """Looks with the usual friction of several joints, where no effect alone does as well and something stays open."""
    if trials.rubbing is None or looks[0].fitted.structure.effects:
        return looks, []
    if best is not None and not best.look.has_room(best.fitted):
        return looks, []
    with contextlib.suppress(*ASTRAY):
        look = looks[0] if best is None else best.look
        rubbing = trials.fitted(trials.rubbing, look.fitted.tracker)
        if best is None or _does_better(trials, Trial.of(rubbing, look), best):
            return _without_needless(trials, trials.look(rubbing), looks)
    return looks, []


def _with_usual_friction(trials: Trials, look: Look) -> Structure | None:
    """Structure with the usual friction that its joints lack, by regression; None where only one of them lacks it."""
    structure, usual = look.fitted.structure, [name for name in trials.names if EFFECTS[name].usual == "friction"]
    model, data = structure.repaired, trials.data
    residual, _ = data.evaluate(model, model.theta)
    listed = [started(one, model, trials.sizes) for one in candidates(model, data, residual, usual)]
    if len({one.site for one in listed}) < 2 or len(listed) > trials.settings.effects:
        return None
    for candidate in listed:
        structure = trials.extensions.extended(structure, candidate, candidate.starts[0], "motor")
    return regressed(structure, data)


def _without_needless(trials: Trials, look: Look, looks: list[Look]) -> Found:
    """Looks with the usual friction of several joints, but for what nothing shows beside all else.

    What does least leaves first, for others may do what it did, with all that the records are more probable without. A
    fast tracker shows what a slow one hides behind a force at another joint that nothing explains.
    """
    while len({site for _, site in look.fitted.structure.effects}) > 1:
        now = trials.all_looks(look)
        found = [trial for one in now for trial in beside_others(trials, one, look.fitted.structure.effects)]
        shown = shown_in_efforts(trials, look.fitted.structure, look.fitted.structure.effects)
        ordered = sorted(found, key=lambda one: one.evidence)
        standing = {one.key: one for one in ordered if trials.stands(one) or one.key in shown}
        needless = [trial for trial in found if trial.key not in standing]
        if not needless:
            named = sorted(standing.values(), key=lambda one: -one.evidence)
            trials.say(f"{' and '.join(one.label for one in named)}: several joints lack it")
            return now, [trials.listed(one, [one]) for one in named]
        likely = {trial.key: trial.evidence for trial in ordered}  # under the tracker that shows it best
        leaving = {min(needless, key=lambda one: one.judgement.least).key}
        leaving |= {trial.key for trial in needless if likely[trial.key] < 0.0}
        structure = look.fitted.structure
        for key in leaving:
            structure = structure.without(key)
        look = trials.look(trials.fitted(structure, look.fitted.tracker))
    return looks, []


def _resting_on_another(trials: Trials, looks: list[Look], tried: Sequence[Trial]) -> Found:
    """Round with an effect and one that rests on it, where none counts alone.

    Friction that differs along the way by as much as there is of it has no mean that piece after piece shows.
    """
    if len(looks[0].fitted.structure.effects) + 2 > trials.settings.effects:
        return looks, []
    resting = {name: needed for name in trials.names if (needed := EFFECTS[name].requires)}
    bare = {one.key: one for one in sorted(tried, key=lambda one: -one.left) if one.key[0] in resting.values()}
    for first in sorted(bare.values(), key=lambda one: one.left):
        with contextlib.suppress(*ASTRAY):
            found, pair = _paired(trials, first, [name for name, needed in resting.items() if needed == first.key[0]])
            if pair:
                return found, pair
    return looks, []


def _paired(trials: Trials, first: Trial, names: Sequence[str]) -> Found:
    """A tried effect with the best of those ``names`` that rest on it, if both count together."""
    look = trials.look(trials.fitter.finished(first.fitted, View(first.look.noise)))
    beside = trials.finished(trials.tried(look, look, names))
    counting = [two for two in beside if two.counts and two.key[1] == first.key[1]]
    if not counting:
        return [look], []
    best = min(counting, key=lambda two: two.left)
    both = weighed([Trial.of(best.fitted, first.look, first.key)], trials.fitter)[0]
    if not trials.stands(both):
        return [look], []
    trials.say(f"{first.label} and {best.key[0]} together {both.removing}")
    (second,) = trials.listed(None, weighed([best], trials.fitter))
    (one,) = trials.listed(both, [both])
    own = {name: value for name, value in one.values.items() if name not in second.values}
    return trials.all_looks(trials.look(best.fitted)), [(replace(one, values=own),), (second,)]


def _rubbing_on_both_sides(trials: Trials, looks: list[Look]) -> Found:
    """Round with friction on both sides of split joints, where that makes the records more probable.

    Masses and springs that the model file rules out may stand for friction that is on the wrong side. They leave no
    error, and only the evidence knows of the file.
    """
    with contextlib.suppress(*ASTRAY):
        structure = _on_both_sides(trials, looks[0].fitted.structure)
        return _with_needed(
            trials, structure, looks, partial(_spares_file, trials), "on the other side of what gives way, too"
        )
    return looks, []


def _on_both_sides(trials: Trials, structure: Structure) -> Structure:
    """Structure with the usual friction of joints that were split on their other side too, as far as it has room.

    A model of a whole joint says how much rubs there, and not before or behind what gives way. All of it came to one
    side with what split the joint.
    """
    model = structure.model
    splitting = [one for one in structure.added if one.type.splits]
    split = {one.at for one in splitting if spring_in_series(one.type, one.at, model.effects) is None}
    taken = {(one.name, one.at, one.side) for one in model.effects}
    for effect in model.effects:
        usual = effect.type.usual == "friction" and effect.name in trials.names
        if not usual or effect.at not in split or len(structure.effects) == trials.settings.effects:
            continue
        (other,) = (side for side in SIDES if side != effect.side)
        if (effect.name, effect.at, other) in taken or (effect.name, effect.at) in structure.effects:
            continue
        # It turns round at the same speed there.
        shapes = tuple(one.name for one in effect.type.parameters if one.shape)
        values = {short: float(structure.theta[structure.place(effect.parameter_names[short])]) for short in shapes}
        start = {**{one.name: 0.0 for one in effect.type.parameters}, **values}
        structure = trials.extensions.extended(
            structure, Candidate(effect.type, effect.at, (start,), fixed=shapes), start, other
        )
    return structure


def _with_needed(
    trials: Trials, structure: Structure, looks: list[Look], stands: Callable[[Trial], bool], done: str
) -> Found:
    """Structure with several effects at once, but for those that do not stand beside the others."""
    before = looks[0].fitted.structure.effects
    while new := [key for key in structure.effects if key not in before]:
        look = trials.look(trials.fitted(structure, looks[0].fitted.tracker))
        found = [trials.weighed_beside_others(key, look) for key in new]
        needless = [one.key for one in found if not stands(one)]
        if not needless:
            trials.say(f"{' and '.join(one.label for one in found)} {done}")
            return trials.all_looks(look), [trials.listed(one, [one]) for one in found]
        structure = look.fitted.structure
        for key in needless:
            structure = structure.without(key)
    return looks, []


def _spares_file(trials: Trials, trial: Trial) -> bool:
    """Whether a weighed effect is more probable than chance, and what the file states is with it."""
    without, with_it = (one.structure.doubt for one in (trial.look.fitted, trial.fitted))
    return trial.evidence > trials.settings.odds and without - with_it > trials.settings.tolerance
