"""The diagnosis as text in a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vpm.discrepancy import ChannelGap, Diagnosis
from vpm.numbers import percent, short
from vpm.report.messages import VERDICT_WORDS, estimate, last_stage, probability, refitted, step_name, took

if TYPE_CHECKING:
    from rich.console import Console


def print_story(diagnosis: Diagnosis, console: Console) -> None:
    """Print verdict, effects with their evidence, known parameters, the gap at each stage, and what was refused."""
    for paragraph in (_verdict, _effects, _known, _steps, _gaps, _refused, _ambiguous, _where, _notes):
        lines = paragraph(diagnosis)
        if lines:
            console.print("\n".join(lines), markup=False)
            console.print()


def _verdict(d: Diagnosis) -> list[str]:
    return [
        f"{d.model.name}: fitted on {', '.join(d.training)}; judged on {', '.join(d.unseen)}",
        f"verdict: {d.verdict}  ({VERDICT_WORDS[d.verdict]})",
        d.summary,
    ]


def _effects(d: Diagnosis) -> list[str]:
    lines = [f"effects, {d.order}:"] if d.effects else []
    for number, effect in enumerate(d.effects, 1):
        lines.append(f"  {number}. {effect.label}: {took(effect, d.effects[number:])}")
        lines += [f"       {text}" for text in (probability(effect),) if text]
        lines += [f"       {p.dotted} = {estimate(p.value, p.std, p.unit)}" for p in effect.parameters]
        lines += [f"       {note}" for note in effect.notes]
    return lines


def _known(d: Diagnosis) -> list[str]:
    rows = [f"  {name:44s} {stated:>16s}   {said}" for name, stated, said in refitted(d)]
    return [f"known parameters, fitted anew {last_stage(d)}".strip() + " (model file, fit):", *rows] if rows else []


def _steps(d: Diagnosis) -> list[str]:
    rows = [f"  {step_name(step):44s} {percent(step.unseen_error):>10s}" for step in d.steps]
    return ["error on validation data, in the order in which the model changed (share of what was measured):", *rows]


def _gaps(d: Diagnosis) -> list[str]:
    head = f"  {'channel':34s} {'before':>11s} {'recalibrated':>13s} {'after':>11s} {'noise floor':>12s}"
    lines = ["gap on validation data (root mean square):", head]
    for channel, gap in d.gap.items():
        numbers = f"{_cell(gap.before)} {_cell(gap.recalibrated, 13)} {_cell(gap.after)} {_cell(gap.noise_floor, 12)}"
        shares = f"{_share(gap.before, gap)} {_share(gap.recalibrated, gap, 13)} {_share(gap.after, gap)}"
        lines += [f"  {channel:34s} {numbers} {gap.unit}", f"  {'':34s} {shares}"]
    return lines


def _refused(d: Diagnosis) -> list[str]:
    sites: dict[str, dict[str, list[str]]] = {}
    for refused in d.refused:
        sites.setdefault(refused.reason, {}).setdefault(refused.name, []).append(refused.site)
    lines = []
    for reason, alike in sites.items():
        named = "; ".join(f"{name} at {', '.join(places)}" for name, places in alike.items())
        lines.append(f"  {named}: {reason}")
    return ["refused:", *lines] if lines else []


def _ambiguous(d: Diagnosis) -> list[str]:
    lines = [f"  {a.name} at {a.site} and {', '.join(a.others)}: {a.reason}" for a in d.ambiguous_with]
    listed = [f"  {experiment.sentence}" for experiment in d.experiments]
    head = ["these data do not discriminate:", *lines] if lines else []
    return [*head, *(["experiments that would:", *listed] if listed else [])]


def _where(d: Diagnosis) -> list[str]:
    lines = []
    for channel, sentences in d.where.items():
        lines.append(f"where the recalibrated model parts from {channel}:")
        lines += [f"  {sentence}" for sentence in sentences]
    return lines


def _notes(d: Diagnosis) -> list[str]:
    return [*(f"note: {note}" for note in d.notes), f"took {d.seconds:.1f} s"]


def _cell(value: float, width: int = 11) -> str:
    return f"{short(value):>{width}s}"


def _share(value: float, gap: ChannelGap, width: int = 11) -> str:
    return f"{percent(gap.share(value)):>{width}s}"
