"""Start values of a ranking's fits, beside those of the catalogue's candidates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from vpm.discrepancy.screening.candidates import Candidate
from vpm.discrepancy.screening.compliance_and_stop_start import moved
from vpm.model import Model
from vpm.ranking.parameter_priors import Sizes
from vpm.ranking.settings import LOSS


def started(candidate: Candidate, model: Model, sizes: Sizes) -> Candidate:
    """Candidate with start values for a ranking: closed stiff contacts, and long waves too."""
    ends = dict(candidate.bounds)
    if "period" in ends and candidate.site in sizes.ways:
        # One wave on all of the way that is seen: a longer one is a slope.
        (low, high), (first, last) = ends["period"], sizes.ways[candidate.site]
        ends["period"] = low, max(high, last - first)
    candidate = replace(candidate, bounds=ends)
    if candidate.effect.has_play:
        return replace(candidate, starts=tuple(_backlash(start) for start in candidate.starts), fixed=())
    if candidate.effect.stops:
        # Nobody knows where a joint ends that nobody sees, or that stands.
        seen = sizes.moves(candidate.site)
        starts = tuple(_stop(start, candidate.site, model, sizes) for start in candidate.starts if seen)
        return replace(candidate, starts=starts, neutral=False)
    return candidate


def _backlash(start: Mapping[str, float]) -> Mapping[str, float]:
    """Start values of a backlash: friction acts within the gap, its contact is closed."""
    return {**start, "contact_damping": start["damping"], "damping": 0.0}


def _stop(start: Mapping[str, float], site: str, model: Model, sizes: Sizes) -> Mapping[str, float]:
    """Start values of an end stop: stiff enough to reverse the fastest motion on the way seen beyond it."""
    low, high, speed = sizes.ways[site][0], sizes.ways[site][1], sizes.joints[site][1]
    beyond = max(high - start.get("high", high), start.get("low", low) - low, 1e-3 * (high - low))
    stiffness = moved(model, site) * (speed / beyond) ** 2
    return {**start, "stiffness": stiffness, "damping": LOSS / speed}
