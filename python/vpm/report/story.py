"""The diagnosis told in a terminal."""

from __future__ import annotations

from math import isnan
from typing import TYPE_CHECKING

from vpm.discrepancy import AcceptedEffect, ChannelGap, Diagnosis, Step

if TYPE_CHECKING:
    from rich.console import Console

VERDICT_WORDS = {
    "effect_found": "An effect is missing in the model, and the data name it.",
    "parameters_only": "Nothing is missing: the known parameters only had other values.",
    "no_disagreement": "Model and data agree.",
    "unexplained": "Something is missing, and no effect of the catalogue explains it.",
}


def print_story(diagnosis: Diagnosis, console: Console) -> None:
    """Print verdict, effects with their evidence, the gap at each stage, and what was refused and why.

    Parameters
    ----------
    diagnosis : Diagnosis
    console : rich.console.Console
    """
    for paragraph in (_verdict, _effects, _steps, _gaps, _refused, _ambiguous, _where, _notes):
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
    lines = ["effects, in the order of acceptance:"] if d.effects else []
    for number, effect in enumerate(d.effects, 1):
        lines.append(
            f"  {number}. {effect.name} at {effect.site}: took {100 * effect.gain:.1f} % of the unseen mean square "
            f"({effect.score:.1f} standard deviations)"
        )
        if not isnan(effect.evidence_nats):
            lines.append(f"       evidence {effect.evidence_nats:.4g} nats, probability {_probability(effect)}")
        lines += [f"       {p.dotted} = {p.value:.5g} {_spread(p.std)}{p.unit}" for p in effect.parameters]
        lines += [f"       {note}" for note in effect.notes]
    return lines


def _probability(effect: AcceptedEffect) -> str:
    own, whole = effect.probability, effect.class_probability
    return f"{own:.2f}, {whole:.2f} with what is not told from it" if whole > own else f"{own:.2f}"


def _steps(d: Diagnosis) -> list[str]:
    rows = [f"  {_step_name(step):44s} {100 * step.unseen_error:6.2f} %" for step in d.steps]
    return ["error on unseen data, step by step (share of the measured effort):", *rows]


def _gaps(d: Diagnosis) -> list[str]:
    head = f"  {'channel':34s} {'before':>11s} {'recalibrated':>13s} {'after':>11s} {'noise floor':>12s}"
    lines = ["gap on unseen data (root mean square):", head]
    for channel, gap in d.gap.items():
        numbers = f"{_cell(gap.before)} {_cell(gap.recalibrated, 13)} {_cell(gap.after)} {_floor(gap)}"
        shares = f"{_share(gap.before, gap)} {_share(gap.recalibrated, gap, 13)} {_share(gap.after, gap)}"
        lines += [f"  {channel:34s} {numbers} {gap.unit}", f"  {'':34s} {shares}"]
    return lines


def _refused(d: Diagnosis) -> list[str]:
    lines = [f"  {refused.name} at {refused.site}: {refused.reason}" for refused in d.refused]
    return ["refused:", *lines] if lines else []


def _ambiguous(d: Diagnosis) -> list[str]:
    lines = [f"  {a.name} at {a.site} and {', '.join(a.others)}: {a.reason}" for a in d.ambiguous_with]
    told = [f"  {experiment.sentence}" for experiment in d.experiments]
    head = ["these data cannot tell apart:", *lines] if lines else []
    return [*head, *(["experiments that would:", *told] if told else [])]


def _where(d: Diagnosis) -> list[str]:
    lines = []
    for channel, sentences in d.where.items():
        lines.append(f"where the recalibrated model parts from {channel}:")
        lines += [f"  {sentence}" for sentence in sentences]
    return lines


def _notes(d: Diagnosis) -> list[str]:
    return [*(f"note: {note}" for note in d.notes), f"took {d.seconds:.1f} s"]


def _step_name(step: Step) -> str:
    signs = {"recalibrated": "recalibrated parameters", "added": "+ ", "removed": "- "}
    return signs[step.change] + (f"{step.effect} at {step.site}" if step.effect else "")


def _spread(std: float) -> str:
    return f"± {std:.2g} " if std > 0.0 else "(held) "


def _cell(value: float, width: int = 11) -> str:
    return f"{value:>{width}.4g}"


def _share(value: float, gap: ChannelGap, width: int = 11) -> str:
    return f"{100 * value / gap.signal:>{width - 2}.3g} %" if gap.signal > 0.0 else " " * width


def _floor(gap: ChannelGap) -> str:
    return f"{'-':>12s}" if isnan(gap.noise_floor) else f"{gap.noise_floor:>12.4g}"
