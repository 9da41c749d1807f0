"""What to know before the numbers of a fit are trusted: one sentence each, with the parameter's name."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from vpm.experiment import Experiment
from vpm.identify.estimation import touching
from vpm.identify.problem import Block
from vpm.identify.settings import Checks
from vpm.model import Model
from vpm.numbers import Array

if TYPE_CHECKING:
    from vpm.identify.fit_result import Fit


#: Correlation of two estimates beyond which they are called collinear.
COLLINEAR = 0.99
#: Samples per parameter below which there are too few.
SAMPLES_EACH = 10
#: A parameter has not moved if it changed by less than this share, and by less than this share of its deviation.
STILL, STILL_STD = 1e-3, 1e-3
#: Distance to a bound, in deviations of the estimate, at which it rests on it all the same.
TOUCHING_STD = 1e-3
#: Share of a measured signal beyond which a simulation has lost it: silence would be nearer.
LOST = 1.0


def resting(fit: Fit, box: Mapping[str, tuple[float, float]]) -> tuple[str, ...]:
    """Diagnostics of estimates on a bound, or nearer to it than a trace of their deviation."""
    low, high = (np.array([box[name][side] for name in fit.names]) for side in (0, 1))
    near = TOUCHING_STD * np.where(np.isfinite(fit.std), fit.std, 0.0)
    at = (fit.values - low <= near) | (high - fit.values <= near)
    beside = touching(fit.names, fit.values, low, high)
    return tuple(name for name, rests in zip(fit.names, at, strict=True) if rests or name in beside)


def contradictions(model: Model, fit: Fit, checks: Checks) -> list[str]:
    """Diagnostics of estimates that contradict the model file by both deviations."""
    told = []
    for name, value, std in zip(fit.names, fit.values, fit.std, strict=True):
        before = model.parameters[name]
        if before.uncertainty is None or not np.isfinite(std):
            continue
        away = abs(float(value) - before.value) / float(np.hypot(before.uncertainty, std))
        if away > checks.far:
            told.append(
                f"{name} moved from {before.value:.6g} to {value:.6g} {before.unit}, {away:.1f} of its deviations "
                f"(stated {before.uncertainty:.2g}, estimated {std:.2g}): correct the model file, or an effect may be "
                "missing, run `vpm diagnose`"
            )
    return told


def remarks(
    fit: Fit,
    limits: Mapping[str, tuple[float, float]],
    blocks: Sequence[Block],
    others: int = 0,
    reasons: Mapping[str, str] | None = None,
) -> list[str]:
    """Diagnostics of a fit's parameters, as sentences.

    - ``limits``: bounds of the parameters that rest on one
    - ``others``: unknowns beside the parameters, such as first states
    - ``reasons``: why data see nothing of a parameter, where more is known than that
    """
    names, correlation = fit.names, fit.correlation
    told = []
    for name, (low, high) in limits.items():
        value = fit[name]
        side = "lower" if abs(value - low) <= abs(value - high) else "upper"
        told.append(f"{name} rests on its {side} bound {value:.6g}: widen it or question the model")
    for combination in fit.unidentifiable:
        alone = combination.names[0] if len(combination.names) == 1 else ""
        told.append(f"not identifiable from these data: {(reasons or {}).get(alone, combination)}")
    blind = {name for combination in fit.unidentifiable for name in combination.names}
    for name, first, value, deviation in zip(names, fit.start, fit.values, fit.std, strict=True):
        moved = abs(value - first)
        if name not in limits and name not in blind and moved <= min(STILL * abs(first), STILL_STD * deviation):
            told.append(f"{name} is still at its start {first:.6g}: begin elsewhere and see whether it comes back")
    told += _collinear(names, correlation, blind)
    count, unknowns = int(sum(block.moving.sum() for block in blocks)), len(names) + others
    if count < SAMPLES_EACH * unknowns:
        told.append(
            f"{count} samples are too few for {unknowns} unknowns, {', '.join(names)} among them: record longer or "
            "free less"
        )
    return told


def _collinear(names: Sequence[str], correlation: Array, blind: Collection[str]) -> list[str]:
    """Diagnostic sentence on each group of parameters that the data know only together."""
    from scipy.sparse.csgraph import connected_components  # slow to import, and seldom needed

    seen = [place for place, name in enumerate(names) if name not in blind]
    size = np.abs(correlation[np.ix_(seen, seen)])
    count, groups = connected_components(size > COLLINEAR, directed=False)
    told = []
    for group in range(count):
        mine = np.flatnonzero(groups == group)
        if len(mine) > 1:
            *most, last = (names[seen[place]] for place in mine)
            least = float(np.min(size[np.ix_(mine, mine)]))
            told.append(
                f"{', '.join(most)} and {last} are collinear, correlation {'at least ' * (len(mine) > 2)}{least:.4f} "
                "in size: these data know a combination of them much better than each"
            )
    return told


def joints_not_compared(fit: Fit, model: Model, records: Sequence[Experiment], blocks: Sequence[Block]) -> list[str]:
    """Diagnostic sentence on logged joints without a drive, at which inverse dynamics compares nothing."""
    if fit.mode != "inverse_dynamics" or not fit.unidentifiable:
        return []
    compared = {block.channel for block in blocks}
    logged = [joint for joint in model.joints if all(f"{joint}.position" in record for record in records)]
    blind = [joint for joint in logged if f"{joint}.effort" not in compared]
    if not blind:
        return []
    return [
        f"no effort at {', '.join(blind)} was compared, for no drive acts there: the mode restarts compares its motion"
    ]


def constant_channels(model: Model, records: Sequence[Experiment], blocks: Sequence[Block]) -> list[str]:
    """Diagnostics of compared channels and inputs of a record that never change."""
    compared = list(dict.fromkeys((b.experiment, b.channel) for b in blocks))
    inputs = [(e.name, c) for e in records for c in model.input_channels]
    held = {e.name: e for e in records}
    return [
        f"{channel} is constant in {record}: it says nothing there"
        for record, channel in dict.fromkeys([*compared, *inputs])
        if channel in held[record] and np.ptp(held[record][channel]) == 0.0
    ]


def lost_channels(fit: Fit) -> list[str]:
    """Diagnostic of the output that a simulation misses by more than its whole size."""
    channel, share = max(((c, s) for c, (_, s, _) in fit.after.items()), key=lambda pair: pair[1], default=("", 0.0))
    if fit.mode in {"inverse_dynamics", "input_error"} or not share > LOST:
        return []
    return [
        f"{channel} is {share:.3g} times its own size off after the fit: the simulation loses the record (unstable, "
        f"integrating, or a wrong valley), and {', '.join(fit.names)} mean nothing; take restarts, pieces, a closed "
        "loop, or more starts"
    ]
