"""Fits on the command line: settings out of words, results as lines."""

from __future__ import annotations

import math
from collections.abc import Sequence

from vpm.errors import IdentificationError
from vpm.experiment import Experiment
from vpm.identify.fitted import Fit
from vpm.identify.intervals import Bootstrap, Profile, bootstrap, profile_intervals
from vpm.identify.unseen import Gaps


def told(fit: Fit) -> list[str]:
    """Values with their deviations, first states, offsets, agreement of starts, noise, warnings, gaps, a line each."""
    lines = [
        f"{name:40s} {value:14.6g} ± {std:<10.3g} {unit}"
        for name, value, std, unit in zip(fit.names, fit.values, fit.std, fit.units, strict=True)
    ]
    lines += [
        f"{label:40s} {value:14.6g} ± {fit.states_std[label]:<10.3g} first state" for label, value in fit.states.items()
    ]
    lines += [
        f"{label:40s} {value:14.6g} ± {fit.offsets_std[label]:<10.3g} offset" for label, value in fit.offsets.items()
    ]
    if fit.costs.size > 1:
        lines.append(f"{fit.agreeing} of {fit.costs.size} starts agree")
    lines += [f"noise of {channel}: {level:.4g}" for channel, level in fit.noise.items()]
    lines += [f"first states: {fit.first_states}"] if fit.first_states else []
    if fit.mode == "inverse_dynamics" and not fit.expected.size:
        lines.append("no simulation of the model stays by the records: intervals are those of the plain balance")
    lines += fit.warnings
    lines += [
        f"residual {channel}: {rms:.4g} {unit}, {_of_the_signal(share)}"
        for channel, (rms, share, unit) in fit.after.items()
    ]
    return lines


def told_unseen(judged: tuple[Gaps, Gaps]) -> list[str]:
    """Gaps on records that were never fitted, before and after, a line each."""
    before, after = judged
    return [
        f"unseen {channel}: {rms:.4g} {unit}, {_of_the_signal(share)}; before it {before[channel][0]:.4g}"
        for channel, (rms, share, unit) in after.items()
    ]


def _of_the_signal(share: float) -> str:
    return f"{100 * share:.2f} % of the signal" if math.isfinite(share) else "of a signal that does not change"


def intervals(
    fit: Fit, records: Sequence[Experiment], profile: Sequence[str], replicates: int, seed: int, cutoff: float | None
) -> list[Profile | Bootstrap]:
    """Intervals by profile of some parameters, and by bootstrap if ``replicates`` are asked for."""
    found: list[Profile | Bootstrap] = []
    if profile:
        found += profile_intervals(fit, records, profile, cutoff=cutoff)
    if replicates:
        found.append(bootstrap(fit, records, replicates=replicates, seed=seed, cutoff=cutoff))
    return found


def told_intervals(found: Sequence[Profile | Bootstrap]) -> list[str]:
    """Intervals, a line each."""
    lines = []
    for one in found:
        if isinstance(one, Profile):
            lines.append(f"{one.name}, profile: {one.low:.6g} to {one.high:.6g} {one.unit}")
            continue
        lines.append(f"bootstrap, {len(one.values)} times {one.drawn}:")
        lines += [
            f"{name}, bootstrap: {low:.6g} to {high:.6g} {unit}"
            for name, (low, high), unit in zip(one.names, one.intervals, one.units, strict=True)
        ]
    return lines


def numbers(words: Sequence[str] | None, option: str, form: str) -> dict[str, float]:
    """Read ``NAME=NUMBER`` words of an option.

    Raises
    ------
    IdentificationError
        A word has another form.
    """
    return {name: _number(value) for name, value in _pairs(words, option, form)}


def ranges(words: Sequence[str] | None, option: str, form: str) -> dict[str, tuple[float, float]]:
    """Read ``NAME=LOW:HIGH`` words of an option.

    Raises
    ------
    IdentificationError
        A word has another form.
    """
    found = {}
    for name, word in _pairs(words, option, form):
        low, sign, high = word.partition(":")
        if not sign:
            raise IdentificationError(f"{option} has '{word}' where a range belongs; write it as {form}")
        found[name] = (_number(low), _number(high))
    return found


def names(words: Sequence[str] | None, option: str, form: str) -> dict[str, str]:
    """Read ``NAME=NAME`` words of an option.

    Raises
    ------
    IdentificationError
        A word has another form.
    """
    return dict(_pairs(words, option, form))


def _pairs(words: Sequence[str] | None, option: str, form: str) -> list[tuple[str, str]]:
    pairs = [word.partition("=") for word in words or []]
    for name, sign, value in pairs:
        if not (name and sign and value):
            raise IdentificationError(f"{option} is '{name}{sign}{value}'; write it as {form}")
    return [(name, value) for name, _, value in pairs]


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        raise IdentificationError(f"'{word}' is no number; write one like 1e-3, in SI units") from None
