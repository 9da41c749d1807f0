"""Start periods of effects that repeat along the way, from residuals in wider bands than exact accelerations allow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from vpm.discrepancy.screening.candidates import Candidate, candidates
from vpm.experiment.cutoff import HIGHEST
from vpm.identify import InverseDynamicsProblem
from vpm.identify.response_along_motion import has_own_drives
from vpm.model import Model


def wider_bands(model: Model, data: InverseDynamicsProblem) -> tuple[InverseDynamicsProblem, ...]:
    """Problems of short waves: motions are filtered an octave higher each, up to the highest cut-off frequency.

    A motion passes waves as fast as its speed over their period, and a filter that makes accelerations exact takes them
    away. What a wider one lets in of noise is spread over all periods. Drives with states answer too slowly to be run
    in each band.
    """
    cutoffs, found = [motion.cutoff for motion in data.motions], []
    if has_own_drives(model):
        return ()
    highest = [HIGHEST / motion.dt for motion in data.motions]
    while any(cutoff < most for cutoff, most in zip(cutoffs, highest, strict=True)):
        cutoffs = [min(2.0 * cutoff, most) for cutoff, most in zip(cutoffs, highest, strict=True)]
        found.append(type(data)(model, data.experiments, cutoff=cutoffs))
    return tuple(found)


def with_short_waves(
    listed: Sequence[Candidate], model: Model, bands: Sequence[InverseDynamicsProblem]
) -> list[Candidate]:
    """Candidates with the start period of short waves that each of the wider bands shows best, beside their own."""
    names = {one.effect.name for one in listed if "period" in one.starts[0]}
    if not names:
        return list(listed)
    wider = [
        one for band in bands for one in candidates(model, band, band.evaluate(model, model.theta)[0], sorted(names))
    ]
    return [_joined(candidate, [one for one in wider if one.key == candidate.key]) for candidate in listed]


def _joined(candidate: Candidate, wider: Sequence[Candidate]) -> Candidate:
    """Candidate with the first start period of the same one in each wider band of short waves."""
    if not wider:
        return candidate
    low, high = zip(*(one.bounds["period"] for one in (candidate, *wider)), strict=True)
    starts = (*candidate.starts, *(one.starts[0] for one in wider))
    return replace(candidate, starts=starts, bounds={**candidate.bounds, "period": (min(low), max(high))})
