"""Naming of missing effects: by a ranking of the training records, or by a search on inverse-dynamics residuals."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Literal, TypeVar

from vpm.catalogue import EFFECTS
from vpm.discrepancy.confirmation.confirmation import Data, Judged
from vpm.discrepancy.diagnosis import RefusedEffect
from vpm.discrepancy.ranked_effects import free_joints, searched, why_not_ranked
from vpm.discrepancy.ranked_effects import notes as notes_of
from vpm.discrepancy.rivals.ambiguity import Rivals, in_order, rivals
from vpm.discrepancy.search.search import Search, begin, further
from vpm.discrepancy.search.search_round import Request
from vpm.discrepancy.search.usual_friction import with_usual_friction
from vpm.errors import DiagnosisError, VpmError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.ranking import Ranking, Settings, rank
from vpm.ranking.substitute_records import why_unbalanced
from vpm.simulate import Setup

#: What an interrupted diagnosis says of itself.
STOPPED = "stopped by Ctrl-C before every candidate was tried: this is what was known until then"
#: Which way the names came.
RANKED = "names come from a ranking of the training records"
SEARCHED = "names come from a search on inverse-dynamics residuals, for {reason}"
NOT_SEARCHED = "a search on inverse-dynamics residuals does not try {effects}"
NO_SEARCH = "{model} has no inverse-dynamics residual to search on, for {reason}; take names from a ranking"
#: Said where names come from a search.
UNSEEN = "the joint {joint} has no drive: no inverse-dynamics residual shows what acts there, and nothing is said of it"
#: Said where an error follows a search, and what such an error is.
FAILED = "{what} could not be computed: {error}"
BROKEN = (ValueError, ArithmeticError, LookupError)

#: Where names come from.
Names = Literal["ranking", "search"]
RANKING: Names = "ranking"
Found = TypeVar("Found")


def ranking_of(
    model: Model,
    records: tuple[Sequence[Experiment], Sequence[Experiment]],
    request: Request,
    setup: Setup,
    notes: list[str],
) -> Ranking | None:
    """Ranking of the training records if the naming uses one and it covers the machine.

    Validation records only say, at the end, how much of their error what was found leaves.

    What keeps it from that is noted.
    """
    names, effects = request.names, request.effects
    training, validation = records
    unbalanced = why_unbalanced(model, training)
    if names != "ranking":
        if unbalanced:
            raise DiagnosisError(NO_SEARCH.format(model=model.name, reason=unbalanced))
        notes.extend(_not_searched(effects, f'names="{names}" was asked for'))
        return None
    reason = "" if unbalanced else why_not_ranked(model, training)
    if not reason:
        try:
            request.tell("ranking what could be missing")
            return rank(
                model,
                training,
                validation,
                effects=effects,
                settings=Settings(effects=request.limit),
                setup=setup,
                workers=request.each.workers,
                tell=request.tell,
                progress=request.each.progress,
            )
        except KeyboardInterrupt:
            return Ranking((), (), model, model, interrupted=True, hold=setup.course)
        except (VpmError, ArithmeticError) as error:
            if unbalanced:
                raise
            reason = f"a ranking fails: {error}"
    notes.append(SEARCHED.format(reason=reason))
    notes.extend(_not_searched(effects, reason))
    notes.extend(UNSEEN.format(joint=joint) for joint in free_joints(model))
    return None


def named(
    ranking: Ranking | None, recalibrated: Judged, data: Data, request: Request, notes: list[str]
) -> tuple[Search, tuple[Rivals, ...], bool]:
    """Naming of missing effects by a ranking or a search, with rivals, and whether Ctrl-C ended it."""
    if ranking is not None:
        request.tell("measuring what was named on validation records")
        found, ambiguous = searched(ranking, recalibrated, data, Settings(effects=request.limit), request.effects)
        notes.extend([*notes_of(found.accepted), *ranked_notes(ranking, found.refused, found.interrupted)])
        return found, ambiguous, False
    screened = replace(request, effects=_searchable(request.effects))
    found = further(with_usual_friction(begin(recalibrated), data, screened), data, screened)
    if found.interrupted:
        notes.append(STOPPED)
    nothing: tuple[Rivals, ...] = ()
    settle = partial(_settled, found, data, screened)
    try:
        (found, ambiguous), late = until_stopped(settle, (found, nothing))
    except BROKEN as error:
        notes.append(FAILED.format(what="what else would do in the place of each effect", error=error))
        ambiguous, late = nothing, False
    return found, ambiguous, late


def ranked_notes(ranking: Ranking, refused: Sequence[RefusedEffect], interrupted: bool) -> list[str]:
    """Notes on the naming: where names come from, and names of the ranking that were refused."""
    named = {one.key for one in ranking.effects}
    lost = [one for one in refused if (one.name, one.site) in named]
    told = [f"the ranking names {one.name} at {one.site}: {one.reason}" for one in lost]
    return [RANKED, *ranking.notes, *([STOPPED] if interrupted else []), *told]


def _settled(found: Search, data: Data, request: Request) -> tuple[Search, tuple[Rivals, ...]]:
    """Names in their order, with the rivals of each, after it was removed again."""
    request.tell("looking for what else would do in the place of each effect")
    return in_order(found, rivals(found.final, data, found.accepted, request, found.last))


def until_stopped(work: Callable[[], Found], nothing: Found) -> tuple[Found, bool]:
    """Result of some naming work, or ``nothing`` if Ctrl-C ended it, and whether it did."""
    try:
        return work(), False
    except KeyboardInterrupt:
        return nothing, True


def _searchable(effects: Sequence[str] | None) -> Sequence[str] | None:
    """Effects asked for that naming by search tries; all of them if none were given."""
    return None if effects is None else [name for name in effects if EFFECTS[name].screened]


def _not_searched(effects: Sequence[str] | None, reason: str) -> list[str]:
    """Note on effects asked for that naming by search does not try."""
    left_out = [name for name in effects or () if not EFFECTS[name].screened]
    if not left_out:
        return []
    names = ", ".join(left_out)
    if not _searchable(effects):
        raise DiagnosisError(
            f"a search on inverse-dynamics residuals does not try {names}, and a ranking, which does, is no way here: "
            f"{reason}; ask for other effects"
        )
    return [NOT_SEARCHED.format(effects=names)]
