"""Several effects at once in a round of a ranking, where none alone does as well."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeAlias

from vpm.catalogue import EFFECTS
from vpm.ranking.both_sides import on_both_sides
from vpm.ranking.choice_by_evidence import weighed
from vpm.ranking.fit import ASTRAY, View
from vpm.ranking.look import Look
from vpm.ranking.model_structure import Structure
from vpm.ranking.result import Ranked
from vpm.ranking.several_places import alike
from vpm.ranking.substitute_records import why_unbalanced
from vpm.ranking.trials import Trials
from vpm.ranking.tried_effect import Trial
from vpm.ranking.usual_friction import with_usual_friction

#: Looks at what was found, and a round for each new effect; looks as they were and none if nothing was.
Found: TypeAlias = tuple[list[Look], list[tuple[Ranked, ...]]]


def several_at_once(trials: Trials, looks: list[Look], best: Trial | None, tried: Sequence[Trial]) -> Found:
    """Round with several effects at once, where no effect alone does as well."""
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
    for trial in alike(comparable, room, trials.fitter, trials.each):
        with contextlib.suppress(*ASTRAY):
            if not trial.counts or (best is not None and not trials.is_likelier(trial, best)):
                continue
            look = trials.look(trial.fitted)
            new = [key for key in trial.fitted.structure.effects if key not in trial.look.fitted.structure.effects]
            found = [trials.weighed_beside_others(key, look) for key in new]
            if all(map(trials.stands, found)):
                trials.say(f"{trial.key[0]} at {' and '.join(site for _, site in new)} together {trial.removing}")
                return trials.all_looks(look), [trials.listed(one, [one]) for one in found]
    return looks, []


def brought_back(trials: Trials, looks: list[Look]) -> Found:
    """Looks begun with the usual friction that counts, of a model that is lost at several joints without it."""
    if why_unbalanced(trials.start.model, trials.fitter.tracked.experiments) or not all(look.is_lost for look in looks):
        return looks, []
    with contextlib.suppress(*ASTRAY):
        most = trials.settings.effects
        structure = with_usual_friction(looks[0], trials.data, trials.extensions, trials.sizes, trials.names, most)
        if structure is not None:
            return _with_needed(trials, structure, looks, trials.stands, "bring the model back to its records")
    return looks, []


def _resting_on_another(trials: Trials, looks: list[Look], tried: Sequence[Trial]) -> Found:
    """Round with an effect and one that rests on it, where none counts alone.

    Friction that differs along the way by as much as there is of it has no mean that piece after piece shows.
    """
    resting = {name: needed for name in trials.names if (needed := EFFECTS[name].requires)}
    bare = {one.key: one for one in sorted(tried, key=lambda one: -one.left) if one.key[0] in resting.values()}
    for first in sorted(bare.values(), key=lambda one: one.left):
        with contextlib.suppress(*ASTRAY):
            look = trials.look(trials.fitter.finished(first.fitted, View(first.look.view.noise)))
            names = [name for name, needed in resting.items() if needed == first.key[0]]
            beside = trials.finished(trials.tried(look, look, names))
            counting = [two for two in beside if two.counts and two.key[1] == first.key[1]]
            best = min(counting, key=lambda two: two.left, default=None)
            if best is None:
                continue
            both = weighed([Trial.of(best.fitted, first.look, first.key)], trials.fitter)[0]
            if not trials.stands(both):
                continue
            trials.say(f"{first.label} and {best.key[0]} together {both.removing}")
            (second,) = trials.listed(None, weighed([best], trials.fitter))
            (one,) = trials.listed(both, [both])
            own = {name: value for name, value in one.values.items() if name not in second.values}
            return trials.all_looks(trials.look(best.fitted)), [(replace(one, values=own),), (second,)]
    return looks, []


def _rubbing_on_both_sides(trials: Trials, looks: list[Look]) -> Found:
    """Round with friction on both sides of split joints, where that makes the records more probable.

    Masses and springs that the model file rules out may stand for friction that is on the wrong side. They leave no
    error, and only the evidence knows of the file.
    """
    with contextlib.suppress(*ASTRAY):
        structure = on_both_sides(looks[0].fitted.structure, trials.extensions, trials.names, trials.settings.effects)
        return _with_needed(
            trials, structure, looks, partial(_spares_file, trials), "on the other side of what gives way, too"
        )
    return looks, []


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
