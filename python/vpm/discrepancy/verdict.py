"""Verdict of a diagnosis in one word and a few sentences, from the effects found and the remaining error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from vpm.discrepancy.diagnosis import OBSERVED, ChannelGap, RefusedEffect
from vpm.discrepancy.findings import Accepted, Findings, Stage
from vpm.discrepancy.judged_model import Data, Judged, judged_anyhow
from vpm.discrepancy.noise.noise_floor import Structure
from vpm.discrepancy.preparation import is_as_stated, ruled_out, ruled_out_together
from vpm.discrepancy.remainder.remainder import Remainder
from vpm.discrepancy.screening.candidates import joint_at
from vpm.discrepancy.settings import (
    CLEAR_GAIN,
    FALSE_ALARM_LEVEL,
    FLOOR_FACTOR,
    LEAST_GAIN,
    NEGLIGIBLE,
)
from vpm.errors import VpmError
from vpm.identify import gain, segments
from vpm.identify.response_along_motion import joints_with_play
from vpm.identify.settings import MOSTLY_OPEN
from vpm.model import Model
from vpm.numbers import percent, short

#: Said of what stays after effects were found.
_REST = " A structured residual above the noise remains."
#: The same of readings that effects at other places leave as open as they were.
_READINGS = " Most of what was open of {channels} still is."
#: The same where effects explain what is missing at other joints.
_OPEN = " What is left at {joints} is structured, and no effect of the catalogue explains it."

#: Of channels that noise hides, where nothing is missing.
_NOISE = (
    " Nothing is said of {channels}: noise of the records would leave as much with the right model. A finer sensor of "
    "the motion would show more."
)
#: The same of channels with more than noise leaves.
_PATTERNLESS = (
    " More is left of {channels} than noise of the records leaves, but with no pattern that repeats: something outside "
    "the machine acted that no log holds, or a sensor is noisier than it looks."
)


def main_gaps(gap: Mapping[str, ChannelGap]) -> list[ChannelGap]:
    """Errors of the residual's channels, on which the verdict stands."""
    return [g for g in gap.values() if g.mode == "inverse_dynamics"]


def is_negligible(gap: Mapping[str, ChannelGap]) -> bool:
    """Whether the remaining error is negligible beside the efforts, for the verdict that nothing is missing."""
    return all(g.after <= (NEGLIGIBLE * g.signal or FLOOR_FACTOR * g.noise_floor) for g in main_gaps(gap))


def _is_clear(value: float, gap: ChannelGap) -> bool:
    """Whether an error of a channel is clear of its noise, where that is known, and not negligible beside its signal.

    A channel far above its noise that is nothing beside its signal says nothing of one that is not.
    """
    return not value <= FLOOR_FACTOR * gap.noise_floor and value > NEGLIGIBLE * gap.signal


def _above(main: list[ChannelGap]) -> float:
    """Ratio of the remaining error to the noise in the verdict's worst channel; 0 without channels."""
    return max((g.after / g.noise_floor if g.noise_floor > 0.0 else np.inf for g in main), default=0.0)


def verdict(
    data: Data | None,
    nominal: Judged,
    recalibrated: Judged,
    found: Findings,
    gap: dict[str, ChannelGap],
    left: Structure | None,
    rest: Remainder | None,
) -> tuple[str, str, bool]:
    """Verdict, summary, and whether the remaining error should be described.

    - ``data``: None where no efforts can be balanced: gaps are those of an observer alone
    - ``left``: of the residual with the accepted effects; None without efforts
    - ``rest``: None where nothing was found and what is left is negligible
    """
    errors = _Errors.of(data, found, gap, left, rest)
    if found.accepted:
        word, summary, more = _of_named(found, data, gap, errors, left, rest)
        doubt = _doubt(nominal.model, found.ranked, found.final) if word == "effect_found" else ""
        return word, summary + doubt, more
    if not errors.remaining:
        doubt = _doubt(nominal.model, found.ranked, recalibrated)
        word, said = _nothing_missing(data, nominal, recalibrated, (errors.main, errors.beside), errors.worst, doubt)
        return word, said + _unheard(gap, nominal.model), False
    beside = "" if errors.structured or data is None else ", ".join(open_readings(gap))
    subject = f"What is left of {beside}" if beside else "The residual"
    clear = f"{subject} is structured and {errors.above:.2g} times the noise floor, and"
    numbers = f"Error on validation data: {_stages(errors.worst)}."
    if found.interrupted:
        return "interrupted", f"{clear} no effect was accepted until then. {numbers}", False
    return "unexplained", f"{clear} no effect of the catalogue explains it. {numbers}", True


@dataclass(frozen=True)
class _Errors:
    """Errors on which a verdict stands."""

    main: list[ChannelGap]  #: Of the residual.
    beside: list[ChannelGap]  #: Of what an observer alone measures.
    still: list[ChannelGap]  #: Of these, what is clear of noise and not negligible.
    above: float  #: Ratio of the worst to its noise.
    structured: bool  #: Whether the residual has structure clear of the noise.
    remaining: bool  #: Whether there is anything left to explain.
    worst: ChannelGap

    @classmethod
    def of(
        cls,
        data: Data | None,
        found: Findings,
        gap: Mapping[str, ChannelGap],
        left: Structure | None,
        rest: Remainder | None,
    ) -> _Errors:
        """Errors for the `verdict`."""
        main, beside = main_gaps(gap), [g for g in gap.values() if g.mode == OBSERVED]
        still = [g for g in beside if _is_clear(g.after, g)]
        structured = left is not None and left.present and any(_is_clear(g.after, g) for g in main)
        remaining = structured or (rest is not None and rest.repeats and not is_negligible(gap)) or bool(still)
        judged = beside if beside and _rests_on_tracker(found, data) else main + beside
        # A channel of noise alone, such as a deflection of what does not bend, says nothing.
        shown = [g for g in judged if not g.signal <= FLOOR_FACTOR * g.noise_floor]
        worst = max(shown or judged, key=_clear_of_noise)
        above = _above(main + still or beside)
        return cls(main, beside, still, above, structured, remaining and not found.within_laws, worst)

    @property
    def share_left(self) -> float:
        """Share of the mean square of the worst error that effects leave, for the verdict."""
        return (self.worst.after / self.worst.recalibrated) ** 2 if self.worst.recalibrated > 0.0 else 0.0


def _of_named(
    found: Findings,
    data: Data | None,
    gap: Mapping[str, ChannelGap],
    errors: _Errors,
    left: Structure | None,
    rest: Remainder | None,
) -> tuple[str, str, bool]:
    """Verdict on named effects."""
    names, worst = ", then ".join(e.label for e in found.accepted), errors.worst
    numbers = f"Error on validation data: {_stages(worst)}, {_percent(worst.after, worst)} after."
    tracked = min(found.left.values(), default=np.nan)
    open_anywhere = errors.structured or (data is None and bool(errors.still))  # without efforts an observer can tell
    described_better = rest is not None and rest.open > MOSTLY_OPEN
    mostly_open = (open_anywhere and errors.share_left > MOSTLY_OPEN) or described_better
    joints = Joints.of(gap, left, found.left)
    apart = joints.differ and not any(joints.has(entry, found.final.model) for entry in found.accepted)
    spoiled = _spoiled(found, gap, tracked) or _left_to_readings(found, gap, tracked)
    if spoiled or (not apart and not _is_explanation(found, tracked, mostly_open)):
        share = f"{100.0 * (tracked if tracked >= 1.0 else errors.share_left):.0f} % of its mean square"
        return (
            "unexplained",
            f"The residual is structured and {errors.above:.2g} times the noise floor. The effects of the catalogue "
            f"that come closest, {names}, leave {spoiled or share}: they are not the explanation. {numbers}",
            True,
        )
    more = _OPEN.format(joints=", ".join(joints.open)) if apart else _REST if errors.remaining else ""
    if errors.remaining and (readings := open_readings(gap)):
        more += _READINGS.format(channels=", ".join(readings))
    return "effect_found", f"Missing: {names}. {numbers}{more}", errors.remaining


def open_readings(gap: Mapping[str, ChannelGap]) -> tuple[str, ...]:
    """Readings beside efforts that a verdict leaves open: clear of noise, and about as far off as before effects."""
    left = (
        channel.partition(" ")[0]
        for channel, g in gap.items()
        if g.mode in ("inverse_dynamics", OBSERVED)
        and not channel.endswith(".effort")
        and _is_clear(g.after, g)
        and g.after**2 > MOSTLY_OPEN * g.recalibrated**2
    )
    return tuple(dict.fromkeys(left))


def _spoiled(found: Findings, gap: Mapping[str, ChannelGap], tracked: float) -> str:
    """What spoils the verdict on named effects: most of an effort where they act, or of a deflection, is left; or "".

    No noise excuses that of an effort: the floor of a drive that gives next to nothing is as large. A backlash is hard
    to balance: where little is left of what a tracker sees, that says more. A deflection behind their joint is told by
    a tracker alone, and what it leaves of that as it was is no law on either side.
    """
    if tracked <= _most_left(found) and joints_with_play(found.final.model):
        return ""
    joints = _joints(found)
    behind = {found.final.model.joint_behind(joint) for joint in joints if joint}
    for channel, g in gap.items():
        joint, _, quantity = channel.rpartition(".")
        if joint in joints and quantity == "effort" and g.after**2 > CLEAR_GAIN * g.signal**2:
            return f"{100.0 * (g.after / g.signal) ** 2:.0f} % of the mean square of {channel}"
        bent = g.mode == OBSERVED and joint in behind
        if bent and g.after**2 > CLEAR_GAIN * g.recalibrated**2 and _is_clear(g.after, g):
            return f"{100.0 * (g.after / g.recalibrated) ** 2:.0f} % of what was left of {channel}"
        if g.mode == "inverse_dynamics" and g.recalibrated < g.signal < g.after:
            return f"more of {channel} than a model without any force"
    return ""


def _left_to_readings(found: Findings, gap: Mapping[str, ChannelGap], tracked: float) -> str:
    """What readings beside efforts keep, in a verdict on effects that no effort shows; "" where one is explained.

    An effect that a fine reading alone tells is judged by its noise: what is little beside the way may be all of it.
    """
    main, beside = main_gaps(gap), {channel: g for channel, g in gap.items() if g.mode == OBSERVED}
    shown = any(g.after**2 <= (1.0 - LEAST_GAIN) * g.recalibrated**2 for g in main)
    open_ones = {channel: g for channel, g in beside.items() if g.recalibrated > FLOOR_FACTOR * g.noise_floor}
    if not main or not open_ones or shown or found.within_laws or tracked <= _most_left(found):
        return ""
    shares = {channel: (g.after / g.recalibrated) ** 2 for channel, g in open_ones.items()}
    least = min(shares, key=lambda channel: shares[channel])
    still = all(g.after > FLOOR_FACTOR * g.noise_floor for g in open_ones.values())
    return f"{100.0 * shares[least]:.0f} % of what was left of {least}" if still and shares[least] > MOSTLY_OPEN else ""


def _rests_on_tracker(found: Findings, data: Data | None) -> bool:
    """Whether the verdict rests on a tracker: all named effects act at joints with play, or without a residual."""
    at = _joints(found)
    if data is None or not at:
        return False
    return at <= joints_with_play(found.final.model) or not at & {*data.training.joints, ""}


def _joints(found: Findings) -> set[str]:
    """Joints of the verdict at which named effects act; "" for effects on all."""
    model, sites = found.final.model, [entry.key[1] for entry in found.accepted]
    return {model.joint_of_body(site) if site in model.bodies else joint_at(model, site) for site in sites}


def _clear_of_noise(gap: ChannelGap) -> float:
    """Error before effects that is clear of noise, as a share of the signal, for the verdict."""
    floor = gap.noise_floor if np.isfinite(gap.noise_floor) else 0.0
    return float(np.sqrt(max(gap.recalibrated**2 - floor**2, 0.0))) / gap.signal if gap.signal else 0.0


def _is_explanation(found: Findings, tracked: float, mostly_open: bool) -> bool:
    """Whether the verdict is that named effects explain the model error.

    The share ``tracked`` of the error power that a tracker has left, of the joint that is explained best, decides where
    it is clear. Effects that leave little there are the explanation; those that leave more than there was are none.
    """
    if found.within_laws:
        return True
    if np.isnan(tracked):
        return not mostly_open
    return tracked <= _most_left(found) or (tracked < 1.0 and not mostly_open)


def _most_left(found: Findings) -> float:
    """Largest share of the error power that effects of a clear verdict may have left under the tracker.

    From impact to impact a play multiplies what is a little off, so that there most of the work is enough.
    """
    return 1.0 - CLEAR_GAIN if joints_with_play(found.final.model) else MOSTLY_OPEN


def _nothing_missing(
    data: Data | None,
    nominal: Judged,
    recalibrated: Judged,
    both: tuple[list[ChannelGap], list[ChannelGap]],
    worst: ChannelGap,
    doubt: str,
) -> tuple[str, str]:
    """Verdict that nothing is missing: by errors of the residual, and by an observer of other joints."""
    (main, beside), numbers = both, _stages(worst)
    small = max((g.before / g.signal if g.signal > 0.0 else 0.0 for g in main), default=0.0) <= NEGLIGIBLE
    agrees = small or max((g.before / g.noise_floor if g.noise_floor > 0.0 else np.inf) for g in main) <= FLOOR_FACTOR
    balanced = data is not None and not agrees and _is_better(nominal, recalibrated, data)
    if balanced or any(_was_closed(g) for g in main + beside):
        closed = max(main + beside, key=_closed)
        if _closed(worst) < 0.0 < _closed(closed):
            numbers = f"{_stages(closed)}; in another channel it grew, {numbers}"
        elif not _is_clear(worst.recalibrated, worst):  # noise alone, whatever the parameters are
            numbers = _stages(closed)
        return (
            "parameters_only",
            "Nothing is missing: other values of the known parameters close the gap. "
            f"Error on validation data: {numbers}.{doubt}",
        )
    return "no_disagreement", f"The nominal model agrees with the data. Error on validation data: {numbers}."


def _unheard(gap: Mapping[str, ChannelGap], model: Model) -> str:
    """Sentences of the verdict that nothing is missing on channels of which most is left, or "".

    Chambers integrate the noise of the motion, which may leave more of a pressure than the machine makes it change. A
    deflection of what the model takes for rigid is no such channel: noise alone is what it then should show.
    """
    left = {
        name: g.after <= FLOOR_FACTOR * g.noise_floor
        for name, g in gap.items()
        if g.mode == "inverse_dynamics" and name not in model.deflections and g.after**2 > MOSTLY_OPEN * g.signal**2
    }
    pairs = ((_NOISE, [name for name in left if left[name]]), (_PATTERNLESS, [name for name in left if not left[name]]))
    return "".join(sentence.format(channels=", ".join(names)) for sentence, names in pairs if names)


def _doubt(nominal: Model, ranked: Model | None, final: Judged) -> str:
    """Sentence of the verdict on the parameter of the final model that is farthest from the model file, or "".

    A load that was taken along moves masses, whatever else is missing. So does an effect that imitates another force
    together with a shifted centre of mass: nobody can tell which it is. Noise of an encoder that a controller answers
    to looks like damping to the residual; what an observer of all channels finds as the file states it is no doubt.
    """
    for far, where in ((ruled_out, ""), (ruled_out_together, " at the most probable values that explain the records")):
        told = far(nominal, final).items()
        if away := {name: times for name, times in told if not is_as_stated(nominal, ranked, name)}:
            name = max(away, key=lambda one: away[one])
            return (
                f" But {name} is {away[name]:.1f} times its stated uncertainty away from the model file{where}: "
                "the file is wrong there, or what is missing acts as that parameter does."
            )
    return ""


def _is_better(nominal: Judged, recalibrated: Judged, data: Data) -> bool:
    """Verdict on calibration: whether other known parameters surely lower the validation residual."""
    better = gain(nominal.validation, recalibrated.validation, segments(data.validation))
    return better.relative > LEAST_GAIN and better.score > float(ndtri(1.0 - FALSE_ALARM_LEVEL))


def _was_closed(gap: ChannelGap) -> bool:
    """Verdict on calibration: whether other known parameters explain the model error."""
    return _is_clear(gap.before, gap) and gap.recalibrated < gap.before * np.sqrt(1.0 - LEAST_GAIN)


def _stages(gap: ChannelGap) -> str:
    return f"{_percent(gap.before, gap)} before, {_percent(gap.recalibrated, gap)} recalibrated"


def _closed(gap: ChannelGap) -> float:
    """Share of the signal by which other known parameters lower an error in the verdict; negative if it grew."""
    return (gap.before - gap.recalibrated) / gap.signal if gap.signal > 0.0 else 0.0


def _percent(value: float, gap: ChannelGap) -> str:
    return percent(value / gap.signal) if gap.signal > 0.0 else f"{short(value)} {gap.unit}"


@dataclass(frozen=True)
class Joints:
    """Joints with a clear residual: open ones, and closed ones that effects explain."""

    open: Mapping[str, float]  #: Joints at which most of the gap is left, and the share of its mean square that is.
    closed: tuple[str, ...]  #: Joints at which they explain it.
    worst: str  #: The joint with the largest gap beside its effort, "" without any.

    @classmethod
    def of(cls, gap: Mapping[str, ChannelGap], left: Structure | None, tracked: Mapping[str, float]) -> Joints:
        """Open and closed joints, from the residual by joint and what a tracker leaves, see `Findings.left`."""
        efforts = {
            channel.removesuffix(".effort"): g
            for channel, g in gap.items()
            if channel.endswith(".effort") and g.mode == "inverse_dynamics" and _is_clear(g.recalibrated, g)
        }
        shares = {
            joint: min((g.after / g.recalibrated) ** 2, tracked.get(joint, np.inf)) for joint, g in efforts.items()
        }
        most = {joint: share for joint, share in shares.items() if share > MOSTLY_OPEN}
        still = {
            joint: share
            for joint, share in most.items()
            if left is not None and left.present and _is_clear(efforts[joint].after, efforts[joint])
        }
        worst = max(
            efforts, key=lambda joint: efforts[joint].recalibrated / max(efforts[joint].signal, 1e-300), default=""
        )
        return cls(still, tuple(joint for joint in shares if joint not in most), worst)

    @property
    def differ(self) -> bool:
        """Whether there are both open and closed joints."""
        return bool(self.open and self.closed)

    def has(self, entry: Accepted, model: Model) -> bool:
        """Whether an effect acts at an open joint; one that acts on all joints counts at the worst."""
        return (joint_at(model, entry.key[1]) or self.worst) in self.open


def only_where_closed(found: Findings, data: Data, gap: Mapping[str, ChannelGap], left: Structure) -> Findings:
    """Findings without effects at joints whose residual stays open, if other joints are closed.

    What happens at one joint says nothing of effects at another one. All is fitted again without them.
    """
    joints, model = Joints.of(gap, left, found.left), found.final.model
    gone = [entry for entry in found.accepted if joints.has(entry, model)]
    if not joints.differ or not 0 < len(gone) < len(found.accepted):
        return found
    try:
        for entry in reversed(gone):
            model = model.without_effect(*entry.key, entry.side)
        free, bounds = found.final.kept_in(model)
        judged, _ = judged_anyhow(model, free, data, bounds)
    except VpmError:
        return found  # another one rests on it
    return replace(
        found,
        stages=(*found.stages, *(Stage("removed", *entry.key, judged) for entry in gone)),
        accepted=tuple(entry for entry in found.accepted if entry not in gone),
        refused=(*(_refused(entry, joints, found.final.model) for entry in gone), *found.refused),
    )


def only_if_open(found: Findings, recalibrated: Judged, gap: Mapping[str, ChannelGap]) -> Findings:
    """Findings without effects that explain nothing where nothing was open.

    An observer finds as much left with them as without, and that is noise or next to nothing.
    """
    counted = [*main_gaps(gap), *(g for g in gap.values() if g.mode == OBSERVED)]
    left = min(found.left.values(), default=0.0)
    tried = found.accepted and not found.interrupted and not found.within_laws
    if not tried or left < 1.0 or any(_is_clear(g.recalibrated, g) for g in counted):
        return found
    reason = "as much is left with it as without, and that is noise or next to nothing"
    return replace(
        found,
        stages=(*found.stages, *(Stage("removed", *entry.key, recalibrated) for entry in reversed(found.accepted))),
        accepted=(),
        refused=(*(RefusedEffect(*entry.key, reason) for entry in found.accepted), *found.refused),
    )


def without_effects(gap: Mapping[str, ChannelGap]) -> dict[str, ChannelGap]:
    """Gaps of a verdict that has withdrawn all effects: after them as before."""
    return {channel: replace(g, after=g.recalibrated) for channel, g in gap.items()}


def _refused(entry: Accepted, joints: Joints, model: Model) -> RefusedEffect:
    joint = joint_at(model, entry.key[1]) or joints.worst
    share = 100.0 * joints.open[joint]
    return RefusedEffect(*entry.key, f"{share:.0f} % of the mean square of the gap at {joint} is left with it")
