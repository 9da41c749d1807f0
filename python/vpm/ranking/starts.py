"""Where a fit of an effect begins, beside what the candidates of the catalogue say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from vpm.discrepancy.candidates import Candidate
from vpm.discrepancy.structural import moved
from vpm.model import Model
from vpm.ranking.sizes import Sizes

#: Share of its force by which a stop is stronger against the fastest impact, to begin with.
LOSS = 0.1
#: How sharply a law bends: a detail that need not be seen.
DETAILS = frozenset({"transition_velocity", "width"})


def started(candidate: Candidate, model: Model, sizes: Sizes) -> Candidate:
    """A candidate whose contacts begin closed and stiff, where a fit can see them, and whose waves may be long."""
    ends = {name: pair for name, pair in candidate.bounds.items() if name not in DETAILS}
    if "period" in ends and candidate.site in sizes.ways:
        # One wave on all of the way that is seen: a longer one is a slope.
        (low, high), (first, last) = ends["period"], sizes.ways[candidate.site]
        ends["period"] = low, max(high, last - first)
    candidate = replace(candidate, bounds=ends)
    if candidate.effect.name == "backlash":
        return replace(candidate, starts=tuple(_backlash(start) for start in candidate.starts), fixed=())
    if candidate.effect.name == "end_stop":
        seen = candidate.site in sizes.ways  # nobody knows where a joint ends that nobody sees
        starts = tuple(_stop(start, candidate.site, model, sizes) for start in candidate.starts if seen)
        return replace(candidate, starts=starts, neutral=False)
    return candidate


def _backlash(start: Mapping[str, float]) -> Mapping[str, float]:
    """What rubs within the gap is friction, not the contact."""
    return {**start, "contact_damping": start["damping"], "damping": 0.0}


def _stop(start: Mapping[str, float], site: str, model: Model, sizes: Sizes) -> Mapping[str, float]:
    """Stiff enough to turn the fastest motion round on the way that is seen beyond the end."""
    low, high, speed = sizes.ways[site][0], sizes.ways[site][1], sizes.joints[site][1]
    beyond = max(high - start.get("high", high), start.get("low", low) - low, 1e-3 * (high - low))
    stiffness = moved(model, site) * (speed / beyond) ** 2
    return {**start, "stiffness": stiffness, "damping": LOSS / speed}
