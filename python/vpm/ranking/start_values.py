"""Start values of a ranking's fits, beside those of the catalogue's candidates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from vpm.discrepancy.screening.candidates import Candidate
from vpm.discrepancy.screening.compliance_and_stop_start import moved
from vpm.model import Model
from vpm.ranking.parameter_priors import Sizes
from vpm.ranking.settings import ALIKE, LOSS, PLACES


def started(candidate: Candidate, model: Model, sizes: Sizes) -> Candidate:
    """Candidate with start values for a ranking: closed stiff contacts, and long waves too."""
    ends = dict(candidate.bounds)
    if "period" in ends and candidate.site in sizes.ways:
        # One wave on all of the way that is seen: a longer one is a slope.
        (low, high), (first, last) = ends["period"], sizes.ways[candidate.site]
        ends["period"] = low, max(high, last - first)
        candidate = replace(candidate, starts=_different_waves(candidate.starts, last - first))
    candidate = _placed(replace(candidate, bounds=ends), sizes)
    if candidate.effect.has_play:
        return replace(candidate, starts=tuple(_backlash(start) for start in candidate.starts), fixed=())
    if candidate.effect.stops:
        # Nobody knows where a joint ends that nobody sees, or that stands.
        seen = sizes.moves(candidate.site)
        starts = tuple(_stop(start, candidate.site, model, sizes) for start in candidate.starts if seen)
        return replace(candidate, starts=starts, neutral=False)
    return candidate


def _different_waves(starts: Sequence[Mapping[str, float]], way: float) -> tuple[Mapping[str, float], ...]:
    """Start values with periods that records tell apart: by half a wave or more on all of the ``way``.

    Several bands of the residual show the same one, and a fit from near by ends there.
    """
    found = list[Mapping[str, float]]()
    for start in starts:
        waves = way / start["period"]
        if all(abs(waves - way / one["period"]) >= ALIKE for one in found):
            found.append(start)
    return tuple(found)


def _placed(candidate: Candidate, sizes: Sizes) -> Candidate:
    """Candidate with several start values of a location parameter, such as where a spring rests.

    Without size an effect does not depend on its place, so a first step gives it a size and leaves the place. A spring
    that rests far away pulls nearly the same everywhere.
    """
    anywhere = [one.name for one in candidate.effect.parameters if one.is_place]
    if not candidate.neutral or len(anywhere) != 1 or len(candidate.starts) != 1 or candidate.site not in sizes.ways:
        return candidate
    (start,), (place,) = candidate.starts, anywhere
    low, high = sizes.ways[candidate.site]
    starts = tuple({**start, place: 0.5 * (low + high + share * (high - low))} for share in PLACES)
    return replace(candidate, starts=starts)


def _backlash(start: Mapping[str, float]) -> Mapping[str, float]:
    """Start values of a backlash: friction acts within the gap, its contact is closed."""
    closed = {"contact_damping": start["damping"]} if "damping" in start else {}  # else a spring in series tells
    return {**start, **closed, "damping": 0.0}


def _stop(start: Mapping[str, float], site: str, model: Model, sizes: Sizes) -> Mapping[str, float]:
    """Start values of an end stop: stiff enough to reverse the fastest motion on the way seen beyond it.

    So of the drive that pushes on, which with oil does far more than the inertia of what it moves.
    """
    low, high, speed = sizes.ways[site][0], sizes.ways[site][1], sizes.joints[site][1]
    beyond = max(high - start.get("high", high), start.get("low", low) - low, 1e-3 * (high - low))
    stiffness = max(moved(model, site) * (speed / beyond) ** 2, sizes.joints[site][0] / beyond)
    return {**start, "stiffness": stiffness, "damping": LOSS / speed}
