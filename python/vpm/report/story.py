"""The diagnosis told in a terminal."""

from __future__ import annotations

from rich.console import Console

from vpm.discrepancy import ChannelGap, Diagnosis, Step

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

    def say(text: str = "") -> None:
        console.print(text, markup=False)

    say(f"{diagnosis.model.name}: fitted on {', '.join(diagnosis.training)}; judged on {', '.join(diagnosis.unseen)}")
    say()
    say(f"verdict: {diagnosis.verdict}  ({VERDICT_WORDS[diagnosis.verdict]})")
    say(diagnosis.summary)
    if diagnosis.effects:
        say()
        say("effects, in the order of acceptance:")
        for number, effect in enumerate(diagnosis.effects, 1):
            say(
                f"  {number}. {effect.name} at {effect.site}: took {100 * effect.gain:.1f} % of the unseen mean square "
                f"({effect.score:.1f} standard deviations)"
            )
            for p in effect.parameters:
                say(f"       {p.dotted} = {p.value:.5g} {_spread(p.std)}{p.unit}")
            for note in effect.notes:
                say(f"       {note}")
    say()
    say("error on unseen data, step by step (share of the measured effort):")
    for step in diagnosis.steps:
        say(f"  {_step_name(step):44s} {100 * step.unseen_error:6.2f} %")
    say()
    say("gap on unseen data (root mean square):")
    say(f"  {'channel':34s} {'before':>11s} {'recalibrated':>13s} {'after':>11s} {'noise floor':>12s}")
    for channel, gap in diagnosis.gap.items():
        say(f"  {channel:34s} {_cell(gap.before)} {_cell(gap.recalibrated, 13)} {_cell(gap.after)} {_floor(gap)} {gap.unit}")
        relative = f"{_share(gap.before, gap)} {_share(gap.recalibrated, gap, 13)} {_share(gap.after, gap)}"
        say(f"  {'':34s} {relative}")
    if diagnosis.refused:
        say()
        say("refused:")
        for refused in diagnosis.refused:
            say(f"  {refused.name} at {refused.site}: {refused.reason}")
    if diagnosis.ambiguous_with:
        say()
        say("these data cannot tell apart:")
        for ambiguity in diagnosis.ambiguous_with:
            say(f"  {ambiguity.name} at {ambiguity.site} and {', '.join(ambiguity.others)}: {ambiguity.reason}")
    for title, sentences in diagnosis.where.items():
        say()
        say(f"where the recalibrated model parts from {title}:")
        for sentence in sentences:
            say(f"  {sentence}")
    say()
    for note in diagnosis.notes:
        say(f"note: {note}")
    say(f"took {diagnosis.seconds:.1f} s")


def _step_name(step: Step) -> str:
    return f"+ {step.effect} at {step.site}" if step.effect else "recalibrated parameters"


def _spread(std: float) -> str:
    return f"± {std:.2g} " if std > 0.0 else "(held) "


def _cell(value: float, width: int = 11) -> str:
    return f"{value:>{width}.4g}"


def _share(value: float, gap: ChannelGap, width: int = 11) -> str:
    return f"{100 * value / gap.signal:>{width - 2}.3g} %" if gap.signal > 0.0 else " " * width


def _floor(gap: ChannelGap) -> str:
    return f"{gap.noise_floor:>12.4g}" if gap.noise_floor == gap.noise_floor else f"{'-':>12s}"
