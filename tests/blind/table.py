"""What the proving ground found, as lists and tables of Markdown that read well in a console too."""

from collections.abc import Iterable, Sequence
from functools import partial

import numpy as np

from blind import reliability, score
from blind.answer import Answer

Rows = list[Sequence[object]]

#: Said of a case whose hidden effect stands among the first three names.
AMONG = " (hidden one among the first three)"


def tables(answers: Sequence[Answer]) -> str:
    """All tables."""
    parts = [
        _head(answers),
        "### All in all\n\n" + _summary(answers),
        "### By machine\n\n" + _by_machine(answers),
        "### By effect\n\n" + _by_effect([a for a in answers if a.kind == "single"]),
        "### Hidden against named\n\n" + _confusion(answers),
        "### Errors of parameters\n\n" + _parameters(answers),
        "### Whether probabilities are true\n\n" + _probabilities(answers),
        "### What fails\n\n" + _failures(answers),
    ]
    return "\n\n".join(parts) + "\n"


def _head(answers: Sequence[Answer]) -> str:
    seeds = sorted({a.seed for a in answers})
    levels = sorted({a.noise_level for a in answers})
    busy = sum(a.seconds + a.making for a in answers) / 60.0
    return (
        f"{len(answers)} cases, seeds {_spans(seeds)}, noise levels {', '.join(f'{level:g}' for level in levels)}; "
        f"{busy:.0f} minutes on one core. In brackets: intervals of 95 %."
    )


def _spans(numbers: Sequence[int]) -> str:
    """Numbers in order, neighbours as one span."""
    spans: list[list[int]] = []
    for number in numbers:
        if spans and number == spans[-1][1] + 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    return ", ".join(str(first) if first == last else f"{first} to {last}" for first, last in spans)


def markdown(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table with its columns in line."""
    cells = [[str(cell).replace("|", "/") for cell in row] for row in (header, *rows)]
    widths = [max(3, *(len(row[k]) for row in cells)) for k in range(len(header))]
    lines = ["| " + " | ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) + " |" for row in cells]
    lines.insert(1, "|" + "|".join("-" * (w + 2) for w in widths) + "|")
    return "\n".join(lines)


def listed(rows: Iterable[Sequence[object]]) -> str:
    """A line for each pair of what is counted and its number."""
    return "\n".join(f"- {what}: {number}" for what, number in rows)


def _summary(answers: Sequence[Answer]) -> str:
    one, two, outside, nothing = (pick(answers) for pick in (score.single, score.pairs, score.outside, score.without))
    first, one_by_one = [a for a in one if score.top(a, 1)], score.pairs_alone(answers)
    silent = [a for a in answers if a.kind == "single" and not a.solvable]
    shrunk = score.closed(outside)
    rows: Rows = [
        ("solvable cases with one effect, named first (top-1)", score.rate(one, lambda a: score.top(a, 1))),
        ("among the first three (top-3)", score.rate(one, lambda a: score.top(a, 3))),
        ("site right where named first", score.rate(first, score.in_place)),
        ("named, and nothing else beside it", score.rate(one, score.alone)),
        ("named wrongly, another effect first", score.rate(one, lambda a: bool(a.named) and not score.top(a, 1))),
        ("left open, nothing named", score.rate(one, lambda a: not a.named)),
        ("solvable pairs, both named", score.rate(two, score.all_named)),
        ("pairs of which each effect is solvable alone, both named", score.rate(one_by_one, score.all_named)),
        ("nothing missing, false alarms", score.rate(nothing, score.alarmed)),
        ("nothing missing, called unexplained", score.rate(nothing, score.unexplained)),
        ("one effect too weak to be solvable, named", score.rate(silent, lambda a: score.top(a, 1))),
        ("outside the catalogue, unexplained", score.rate(outside, score.unexplained)),
        ("outside the catalogue, gap at least halved", f"{int(np.sum(shrunk <= 0.5))}/{len(outside)}"),
        ("outside the catalogue, gap after / before", _spread(shrunk)),
        ("gap after / gap of the oracle, one effect", _spread(score.gap_ratios(one))),
        ("gap after / gap of the oracle, pairs", _spread(score.gap_ratios(two))),
        ("time of a diagnosis on one core [s]", _spread([a.seconds for a in answers])),
        ("diagnoses that failed", score.rate(answers, lambda a: bool(a.error))),
        ("ended by the limit of time, judged by what they knew", score.rate(answers, lambda a: a.late)),
    ]
    return listed(rows)


def _spread(values: Sequence[float] | score.Array) -> str:
    if not len(values):
        return "none"
    middle, low, high = score.quartiles(values)
    return f"median {middle:.2f}, quartiles {low:.2f} to {high:.2f} ({len(values)})"


def _brief(rate: score.Rate) -> str:
    return f"{rate.hits}/{rate.count}" if rate.count else "·"


def _by_machine(answers: Sequence[Answer]) -> str:
    rows: Rows = []
    for name in dict.fromkeys(answer.machine for answer in answers):
        mine = [a for a in answers if a.machine == name]
        one, nothing, outside = score.single(mine), score.without(mine), score.outside(mine)
        rows.append((
            name,
            _brief(score.rate(one, lambda a: score.top(a, 1))),
            _brief(score.rate(one, lambda a: score.top(a, 3))),
            _brief(score.rate(score.pairs(mine), score.all_named)),
            _brief(score.rate(nothing, score.alarmed)),
            _brief(score.rate(outside, score.unexplained)),
            _middle(score.gap_ratios(one)),
            _middle([a.seconds for a in mine]),
        ))  # fmt: skip
    head = ("machine", "top-1", "top-3", "pairs", "false alarms", "unexplained", "gap/oracle", "s")
    return markdown(head, rows)


def _by_effect(answers: Sequence[Answer]) -> str:
    """Of the solvable cases with one effect: named first, among the first three, and what is left of the gap."""
    rows: Rows = []
    for name in dict.fromkeys(answer.hidden[0].name for answer in answers):
        one = score.single([a for a in answers if a.hidden[0].name == name])
        first, third = (score.rate(one, partial(score.top, count=count)) for count in (1, 3))
        rows.append((name, f"{_brief(first)}, {_brief(third)}, {_middle(score.gap_ratios(one))}"))
    return "Top-1, top-3, and gap after / gap of the oracle (median):\n\n" + listed(rows)


def _middle(values: Sequence[float] | score.Array) -> str:
    return f"{score.quartiles(values)[0]:.2f}" if len(values) else "·"


def _confusion(answers: Sequence[Answer]) -> str:
    """What was named in place of what was hidden, beside how often it was right; solvable cases only."""
    counted = [a for a in answers if a.kind != "pairs" and (a.solvable or a.kind in {"none", "parameters"})]
    rows: Rows = []
    for hidden in sorted({_hidden(a) for a in counted}, key=_last):
        named = [_first(a) for a in counted if _hidden(a) == hidden]
        wrong = [f"{name} {named.count(name)}" for name in sorted({*named} - {hidden}, key=_last)]
        if wrong:
            rows.append((hidden, ", ".join([f"right {named.count(hidden)}", *wrong])))
    return listed(rows) if rows else "Nothing is confused."


def _last(name: str) -> tuple[bool, str]:
    """Order of names; what is no effect comes last."""
    return name in {"nothing", "failed"}, name


def _hidden(answer: Answer) -> str:
    return answer.hidden[0].name if answer.hidden else "nothing"


def _first(answer: Answer) -> str:
    """What was named first; what is the same physics counts as what was hidden."""
    if answer.error:
        return "failed"
    if answer.hidden and score.top(answer, 1):
        return answer.hidden[0].name
    return answer.named[0].name if answer.named else "nothing"


def _parameters(answers: Sequence[Answer]) -> str:
    found = score.parameter_errors(a for a in answers if a.solvable)
    rows: Rows = []
    for effect, parameter in dict.fromkeys((e.effect, e.parameter) for e in found):
        mine = [e for e in found if (e.effect, e.parameter) == (effect, parameter)]
        sizes = [100.0 * abs(e.relative) for e in mine]
        deviations = [abs(e.deviations) for e in mine if np.isfinite(e.deviations)]
        middle, _, high = score.quartiles(sizes)
        within = sum(d <= 1.96 for d in deviations)
        size = f"{middle:.1f} ({high:.1f}), {_middle(deviations)}, {within}/{len(deviations)}"
        rows.append((f"{effect}.{parameter}", size))
    head = "Median (upper quartile) in %, median in deviations, and how many stand in their interval of 95 %:\n\n"
    return head + listed(rows) if rows else "No effect was named at its site."


def failed(answer: Answer) -> str:
    """What is wrong with an answer, in a few words; empty if nothing is."""
    if answer.error:
        return answer.error
    told = ", ".join(f"{n.name} at {n.site}" for n in answer.named) or answer.verdict
    if answer.kind in {"none", "parameters"}:
        return told if answer.named or answer.verdict == "unexplained" else ""
    if not answer.solvable:
        return ""
    if answer.kind == "outside":
        return "" if score.unexplained(answer) else told
    if answer.kind == "pairs":
        return "" if score.all_named(answer) else told
    if not score.top(answer, 1):
        return told + (AMONG if score.top(answer, 3) else "")
    return "" if score.in_place(answer) else told


def _probabilities(answers: Sequence[Answer]) -> str:
    found = reliability.rows(answers)
    if not found:
        return "No effect was named with a probability."
    lines = listed((f"{group}, mean {stated}", right) for group, stated, right in found if group)
    return f"Mean probability of the named classes, and how often the hidden effect was in one:\n\n{lines}"


def _failures(answers: Sequence[Answer]) -> str:
    """Machine, seed, what was hidden how many deviations out of the noise, and the answer."""
    several = len({a.noise_level for a in answers}) > 1
    rows: Rows = []
    for answer in answers:
        why = failed(answer)
        if why:
            hidden = ", ".join(f"{h.name} at {h.site}" for h in answer.hidden) or answer.request[0]
            strength = f" ({min(answer.strengths):.1f})" if answer.strengths else ""
            noise = f" noise {answer.noise_level:g}" if several else ""
            short = why.replace(AMONG, "*")
            short = short if len(short) < 110 else short[:107] + "..."
            rows.append((f"{answer.machine} {answer.seed}{noise}, {hidden}{strength}", short))
    head = "In brackets: deviations out of the noise. *: the hidden effect is among the first three names.\n\n"
    return head + listed(rows) if rows else "Nothing."
