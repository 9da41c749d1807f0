"""Mistakes of logs, found before anything is concluded from them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vpm.discrepancy.parallel_candidates import ParallelCandidates, Progress
from vpm.errors import ExperimentError, VpmError
from vpm.experiment import Experiment, as_records, joints_from_shafts
from vpm.log_check.correction import TIME, Correction
from vpm.log_check.dead_centres import beyond_dead_centres
from vpm.log_check.explanation import Explainer, Explanation
from vpm.log_check.finding import Finding, LogCheck
from vpm.log_check.related import Related, wrong_scales
from vpm.log_check.settings import Settings
from vpm.log_check.shares import Judge, Shares
from vpm.log_check.stretches import odd_stretches
from vpm.log_check.table import line_of
from vpm.model import ChannelEntry, Model
from vpm.numbers import Array, rough_percent
from vpm.observer import measured_outputs
from vpm.one_thread import in_one_thread
from vpm.simulate import Setup, with_running_lengths

#: What else it may be that looks like a mistake.
DELAY = "a clock of the log, or a delay of the machine or of its sensors"
LIMIT = "or the drive gives no more than a limit, which the model does not know"
#: Said after Ctrl-C.
UNCHECKED = "nothing is known yet: {record} was still being checked for wrong units, signs, names and clocks"


@in_one_thread
def check_log(
    model: Model,
    experiments: Experiment | Sequence[Experiment],
    *,
    table: Mapping[str, ChannelEntry] | None = None,
    settings: Settings | None = None,
    setup: Setup | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> LogCheck:
    """Find wrong units, signs, names and clocks of logs, and stretches of channels that cannot be right.

    A slow tracker keeps the model on the beginning of each record. What it leaves of a channel is compared with what
    it leaves of masses on which nothing acts: that share does not depend on the scale of the channel. A mistake is
    named where its correction leaves at most a tenth of what is left without it. In both cases the uncertain parameters
    of the model and friction of its joints have been fitted, so that a missing effect does not pass for a mistake.

    Parameters
    ----------
    model : Model
    experiments : Experiment or sequence of Experiment
    table : mapping of str to ChannelEntry, optional
        Channel table by which they were read; that of the model by default.
    settings : Settings, optional
        The numbers that decide.
    setup : Setup, optional
        Integrator and hold.
    workers : int, optional
        Corrections that are tried at a time; one per core if not given. The result does not depend on it.
    progress : callable, optional
        Called after every correction with what is being done, its name, how many are done and how many there are.

    Returns
    -------
    LogCheck

    Raises
    ------
    VpmError
        A log lacks a command, or holds nothing that the model has.
    KeyboardInterrupt
        Ctrl-C, with a sentence.

    Examples
    --------
    >>> check_log(model, log).mistakes
    (Finding(kind='unit', channels=('axis.position',)),)
    """
    settings = settings or Settings()
    found: dict[int, list[Finding]] = {}
    shares: dict[str, float] = {}
    checked = "the first record"
    try:
        records = as_records(experiments)
        records, setup = with_running_lengths(model, records, setup or Setup())
        judge = Judge(model, settings, setup, records)
        check = _Check(judge, ParallelCandidates(workers, progress))
        begun: list[_Begun] = []
        for record in records:
            checked = record.name
            begun.append(check.begun(record))
        known = check.known(begun)
        for place in check.order(begun):
            checked = begun[place].record.name
            found[place], left = check.of(begun[place], known, model.channel_table if table is None else table)
            for name, share in left.by_channel.items():
                shares[name] = max(share, shares.get(name, 0.0))
    except KeyboardInterrupt:
        raise KeyboardInterrupt(UNCHECKED.format(record=checked)) from None
    findings = [finding for place in sorted(found) for finding in found[place]] + check.unseen(begun)
    return LogCheck(tuple(sorted(_together(findings), key=lambda one: not one.mistake)), shares)


def refuse_mistakes(
    model: Model,
    experiments: Experiment | Sequence[Experiment],
    *,
    setup: Setup | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> tuple[Finding, ...]:
    """What is odd in logs, see `check_log`, unless nothing can be concluded from them.

    What keeps a log from being checked is no business of this: whoever uses it will say it.

    Raises ExperimentError: there is a wrong unit, sign, name or clock.
    """
    try:
        found = check_log(model, experiments, setup=setup, workers=workers, progress=progress)
    except (VpmError, ArithmeticError):
        return ()
    if found.mistakes:
        sentences = ". ".join(str(one) for one in found.mistakes)
        raise ExperimentError(
            f"{sentences}. Nothing is concluded from such a log; to do it anyway, leave out its check"
        )
    return found.findings


@dataclass(frozen=True)
class _Begun:
    """A record to check, the beginning of its motion, and what is left of that as it is."""

    logged: Experiment
    record: Experiment  #: With the positions of joints that it holds as angles of shafts.
    part: Experiment
    left: Shares
    sides: list[Finding]  #: Joints that are on the other side of a dead centre, which the record has put right.


class _Check:
    """Looks at one record after the other."""

    def __init__(self, judge: Judge, each: ParallelCandidates) -> None:
        self.judge, self.each, self.settings = judge, each, judge.settings
        self._in_vain: list[Shares] = []  # what is left of records that no correction explains
        self._undetermined: dict[str, list[str]] = {}  # parameters of which each record says next to nothing

    def begun(self, logged: Experiment) -> _Begun:
        """Beginning of a check: what is left of a record as it is."""
        record = joints_from_shafts(logged, self.judge.model)
        record, sides = beyond_dead_centres(self.judge, record, self.settings)
        part = _beginning(record, measured_outputs(self.judge.model, record), self.settings)
        return _Begun(logged, record, part, self.judge.fitted(part), sides)

    def order(self, begun: Sequence[_Begun]) -> list[int]:
        """Places of records in the order of a check: where most is left a mistake shows best.

        What explains nothing there is not tried again in the others, see `_is_as_before`.
        """

        def left(place: int) -> float:
            return sum(begun[place].left.told(name) for name in self.judge.doubtful(begun[place].left))

        return sorted(range(len(begun)), key=left, reverse=True)

    def known(self, begun: Sequence[_Begun]) -> Array | None:
        """Values by which the model explains the record of which a check leaves least; None if it explains none."""
        explained = [one.left for one in begun if not one.left.above(self.settings.doubtful)]
        return min(explained, key=lambda left: left.order).values if explained else None

    def of(self, begun: _Begun, known: Array | None, table: Mapping[str, ChannelEntry]) -> tuple[list[Finding], Shares]:
        """Checked findings of a record, and the record when they are corrected.

        A record of which the model explains little is tried with values that are ``known`` from another one: it is the
        same machine, and a mistake of this record would still show.
        """
        record, part, left, model = begun.record, begun.part, begun.left, self.judge.model
        if known is not None and left.above(self.settings.doubtful) and not self.judge.falls(left):
            left = min(left, self.judge.fitted_from(part, known, left), key=lambda one: one.order)
        outputs = measured_outputs(model, record)
        inputs = tuple(name for name in model.input_channels if name in record)
        # A joint may rest while the shafts turn from which its angle is worked out, step by step of their encoders.
        sensed = measured_outputs(model, begun.logged)
        stretches = list(odd_stretches(begun.logged, sensed, inputs, self.settings))
        found, affected, whole = list[Finding](), set[str](), record
        says = len(part) >= self.settings.judged and not self._is_as_before(left)
        for _ in range(self.settings.rounds if says else 0):
            units = _units(model, record, table)
            explanations = Explainer(self.judge, units, table, self.each).explained(part, (*outputs, *inputs), left)
            for one in explanations:
                changed = one.correction.entries(table)
                table = {**table, **changed}
                found.append(_finding(one, units, changed, record.name, self.settings))
                affected |= set(one.affected)
                part, whole, left = one.correction.applied(part), one.correction.applied(whole), one.after
            if not explanations:
                break
        if says and not found:
            self._in_vain.append(left)
            if outputs and (least := min(map(left.unexplained, outputs))) > self.settings.lost:
                found.append(_of_unexplained(outputs, least, record.name))
        if others := left.above(self.settings.doubtful) - affected:
            found = [doubted(one, others) for one in found]
        units = _units(model, record, table)
        for correction, related in wrong_scales(model, whole, units, self.settings):
            found.append(_of_related(correction, related, units, correction.entries(table), record.name))
        tangent = None if self.judge.falls(left) else self.judge.tangent(part, left)
        if tangent is not None:
            self._undetermined[record.name] = self.judge.undetermined(tangent)
        return [*begun.sides, *found, *stretches], left

    def unseen(self, begun: Sequence[_Begun]) -> list[Finding]:
        """Finding of a check on parameters of which no record says anything; none if there are no such."""
        records = tuple(one.record.name for one in begun if one.record.name in self._undetermined)
        told = [self._undetermined[name] for name in records]
        names = [name for name in (told[0] if told else ()) if all(name in other for other in told)]
        return [_of_parameters(names, records)] if names else []

    def _is_as_before(self, left: Shares) -> bool:
        """Whether a checked record leaves what another one left that no correction explains.

        All records have one channel table: what the model lacks shows in each of them. A mistake of this record alone
        would leave more of its channels.
        """
        some, share = self.judge.doubtful(left), self.settings.doubtful
        return bool(some) and any(
            all(
                left.told(name) * self.settings.alike <= other.told(name)
                and left.by_channel[name] * self.settings.alike <= max(other.by_channel.get(name, 0.0), share)
                for name in some
            )
            for other in self._in_vain
        )


def doubted(found: Finding, others: Collection[str]) -> Finding:
    """Finding of a check that is no mistake for sure, for the corrected record leaves other channels unexplained.

    What the model lacks there moves the rest of the machine too, and may look like a mistake.
    """
    more = f"{', '.join(sorted(others))} stays unexplained with that, so that it may come from what the model lacks"
    return replace(found, mistake=False, sentence=f"{found.sentence}; {more}") if found.mistake else found


def _beginning(record: Experiment, outputs: Sequence[str], settings: Settings) -> Experiment:
    """Beginning of the motion of a checked record, from rest if it begins so."""
    fewest, most = settings.samples
    speeds = np.zeros(len(record))
    for name in outputs:
        step = np.diff(record[name], prepend=record[name][0]) ** 2
        speeds += step / max(float(np.mean(step)), 1e-300)
    done = np.cumsum(speeds) / max(float(np.sum(speeds)), 1e-300)
    first = max(int(np.searchsorted(done, settings.still)) - int(settings.before / record.dt), 0)
    enough = int(np.searchsorted(done, done[first] + settings.part)) - first
    count = min(max(int(settings.window / record.dt), fewest, enough), most)
    kept = slice(max(min(first, len(record) - count), 0), first + count)
    return replace(record, time=record.time[kept], data=record.data[kept])


def _finding(
    found: Explanation,
    units: Mapping[str, str],
    changed: Mapping[str, ChannelEntry],
    record: str,
    settings: Settings,
) -> Finding:
    """Checked finding of a correction that explains a record."""
    correction, before, after = found.correction, found.before.by_channel, found.after.by_channel
    said = ", or ".join(one.sentence(units) for one in (correction, *found.rivals))
    if found.is_possible:
        said += f" ({LIMIT if found.is_limit else DELAY})"
    harms = not correction.delay or max(before[name] for name in found.affected) > settings.harmless
    place = min(found.affected, key=lambda name: after[name] / max(before[name], 1e-300))
    lines, repair = _written(correction, changed)
    return Finding(
        correction.kind,
        correction.channels,
        (record,),
        f"{said}; {_evidence(found, place)}",
        repair,
        harms and not found.is_possible,
        correction.factor,
        correction.delay,
        (before[place], after[place]),
        lines,
    )


def _written(correction: Correction, changed: Mapping[str, ChannelEntry]) -> tuple[dict[str, str], str]:
    """Lines of the checked channel table as they should be, and the repair in words."""
    lines = {channel: line_of(channel, entry) for channel, entry in changed.items()}
    return lines, f"write {' and '.join(lines.values())}" if lines else correction.repair


def _of_related(
    correction: Correction, related: Related, units: Mapping[str, str], changed: Mapping[str, ChannelEntry], record: str
) -> Finding:
    """Checked finding of a channel that contradicts a related one."""
    lines, repair = _written(correction, changed)
    before, after = related.error(), related.error(correction.factor)
    return Finding(
        correction.kind,
        correction.channels,
        (record,),
        f"{correction.sentence(units)}; {related.teller} differs from it by {rough_percent(before)} of its power as it "
        f"is, and by {rough_percent(after)} with that corrected",
        repair,
        True,
        correction.factor,
        share=(before, after),
        lines=lines,
    )


def _units(model: Model, record: Experiment, table: Mapping[str, ChannelEntry]) -> dict[str, str]:
    """Units of time and channels in a checked record that the model has."""
    own = {name: model.channel_unit(name) for name in record.channels if name in model.channels}
    return {TIME: "s", **own, **{name: entry.unit for name, entry in table.items()}}


def _evidence(found: Explanation, place: str) -> str:
    """Sentence of a check with the numbers by which a correction explains a record."""
    before, after = found.before, found.after
    corrected = "both corrected" if found.at_once else "that corrected"
    if found.is_of_values:
        return (
            f"as it is the model explains the log only with {before.farthest} {before.far:.2g} of its deviations "
            f"away from the model file, and with {corrected} none is farther away than {after.far:.2g}"
        )
    left, then = (rough_percent(shares.by_channel[place]) for shares in (before, after))
    return f"of {place} the model leaves {left} unexplained as it is, and {then} with {corrected}"


def _of_unexplained(outputs: Sequence[str], least: float, record: str) -> Finding:
    joined, share = ", ".join(outputs), rough_percent(least)
    sentence = f"of {joined} the model leaves at least {share} unexplained, and no other unit helps"
    repair = "look at the sampling time, at gear ratios and at signs of several channels at once, then at the model"
    return Finding("unexplained", tuple(outputs), (record,), sentence, repair)


def _of_parameters(undetermined: Sequence[str], records: tuple[str, ...]) -> Finding:
    motion = "its motion" if len(records) == 1 else "their motions"
    sentence = f"the beginning of {motion} says next to nothing of {', '.join(undetermined)}"
    repair = "see by vpm identify whether the rest says more; else fit others, or move the machine so that they matter"
    return Finding("unseen", (), records, sentence, repair)


def _together(findings: Sequence[Finding]) -> list[Finding]:
    """Checked findings of the same mistake in several records, as one."""
    found: list[Finding] = []
    for one in findings:
        place = next((n for n, other in enumerate(found) if one.is_alike(other)), None)
        if place is None:
            found.append(one)
        else:
            found[place] = replace(found[place], records=(*found[place].records, *one.records))
    return found
