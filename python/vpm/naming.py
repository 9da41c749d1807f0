"""Naming of missing effects by a ranking of the training records."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from vpm.discrepancy.diagnosis import RefusedEffect
from vpm.discrepancy.findings import Findings, Stage
from vpm.discrepancy.judged_model import Data, Judged
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.discrepancy.ranked_effects import found_by
from vpm.discrepancy.ranked_effects import notes as notes_of
from vpm.discrepancy.rivals.ambiguity import Rivals
from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.ranking import Ranking, Settings, rank
from vpm.ranking.substitute_records import why_unbalanced
from vpm.simulate import Setup

#: What an interrupted diagnosis says of itself.
STOPPED = "stopped by Ctrl-C before every candidate was tried: this is what was known until then"
#: Where the names came from, and why none came.
RANKED = "names come from a ranking of the training records"
UNRANKED = "nothing could be named, for a ranking of the training records fails: {reason}"
#: Said where an error follows the naming, and what such an error is.
FAILED = "{what} could not be computed: {error}"
BROKEN = (ValueError, ArithmeticError, LookupError)

#: Called with a sentence on what is being done.
Tell = Callable[[str], None]
Found = TypeVar("Found")


@dataclass(frozen=True)
class Request:
    """Request for names of missing effects: what is tried, who hears of it, and who computes."""

    effects: Sequence[str] | None  #: All of the catalogue if None.
    limit: int  #: Most effects to accept.
    tell: Tell
    each: ParallelCandidates


def ranking_of(
    model: Model,
    records: tuple[Sequence[Experiment], Sequence[Experiment]],
    request: Request,
    setup: Setup,
    notes: list[str],
) -> Ranking | None:
    """Ranking of the training records; none, with a note, where no observer can follow them.

    Validation records only say, at the end, how much of their error what was found leaves.
    """
    training, validation = records
    try:
        request.tell("ranking what could be missing")
        return rank(
            model,
            training,
            validation,
            effects=request.effects,
            settings=Settings(effects=request.limit),
            setup=setup,
            workers=request.each.workers,
            tell=request.tell,
            progress=request.each.progress,
        )
    except KeyboardInterrupt:
        return Ranking((), (), model, model, interrupted=True, hold=setup.course)
    except (VpmError, ArithmeticError) as error:
        if why_unbalanced(model, training):
            raise
        notes.append(UNRANKED.format(reason=error))
        return None


def named(
    ranking: Ranking | None, recalibrated: Judged, data: Data, request: Request, notes: list[str]
) -> tuple[Findings, tuple[Rivals, ...]]:
    """Naming of missing effects by a ranking, with rivals."""
    if ranking is None:
        return Findings((Stage("recalibrated", "", "", recalibrated),), (), (), ()), ()
    request.tell("measuring what was named on validation records")
    found, ambiguous = found_by(ranking, recalibrated, data, Settings(effects=request.limit), request.effects)
    notes.extend([*notes_of(found.accepted, data.training), *ranked_notes(ranking, found.refused, found.interrupted)])
    return found, ambiguous


def ranked_notes(ranking: Ranking, refused: Sequence[RefusedEffect], interrupted: bool) -> list[str]:
    """Notes on the naming: where names come from, and names of the ranking that were refused."""
    named = {one.key for one in ranking.effects}
    lost = [one for one in refused if (one.name, one.site) in named]
    told = [f"the ranking names {one.name} at {one.site}: {one.reason}" for one in lost]
    return [RANKED, *ranking.notes, *([STOPPED] if interrupted else []), *told]


def until_stopped(work: Callable[[], Found], nothing: Found) -> tuple[Found, bool]:
    """Result of some naming work, or ``nothing`` if Ctrl-C ended it, and whether it did."""
    try:
        return work(), False
    except KeyboardInterrupt:
        return nothing, True
