"""The tables of the proving ground, as Markdown that reads well in a console too."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from blind import reliability, score
from blind.answer import Answer

Rows = list[Sequence[object]]


def tables(answers: Sequence[Answer]) -> str:
    """All tables."""
    parts = [
        _head(answers),
        "### All in all\n\n" + _summary(answers),
        "### By machine\n\n" + _grouped(answers, "machine", lambda a: a.machine),
        "### By effect\n\n"
        + _grouped([a for a in answers if a.kind == "single"], "effect", lambda a: a.hidden[0].name),
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


def _summary(answers: Sequence[Answer]) -> str:
    one, two, outside, nothing = (pick(answers) for pick in (score.single, score.pairs, score.outside, score.without))
    first, one_by_one = [a for a in one if score.top(a, 1)], score.pairs_alone(answers)
    silent = [a for a in answers if a.kind == "single" and not a.solvable]
    shrunk = score.closed(outside)
    rows: Rows = [
        ("solvable cases with one effect: named first (top-1)", score.rate(one, lambda a: score.top(a, 1))),
        ("among the first three (top-3)", score.rate(one, lambda a: score.top(a, 3))),
        ("site right where named first", score.rate(first, score.in_place)),
        ("named, and nothing else beside it", score.rate(one, score.alone)),
        ("named wrongly: another effect first", score.rate(one, lambda a: bool(a.named) and not score.top(a, 1))),
        ("left open: nothing named", score.rate(one, lambda a: not a.named)),
        ("solvable pairs: both named", score.rate(two, score.all_named)),
        ("pairs of which each effect is solvable alone: both named", score.rate(one_by_one, score.all_named)),
        ("nothing missing: false alarms", score.rate(nothing, score.alarmed)),
        ("nothing missing: called unexplained", score.rate(nothing, score.unexplained)),
        ("one effect too weak to be solvable: named", score.rate(silent, lambda a: score.top(a, 1))),
        ("outside the catalogue: unexplained", score.rate(outside, score.unexplained)),
        ("outside the catalogue: gap at least halved", f"{int(np.sum(shrunk <= 0.5))}/{len(outside)}"),
        ("outside the catalogue: gap after / before", _spread(shrunk)),
        ("gap after / gap of the oracle, one effect", _spread(score.gap_ratios(one))),
        ("gap after / gap of the oracle, pairs", _spread(score.gap_ratios(two))),
        ("time of a diagnosis on one core [s]", _spread([a.seconds for a in answers])),
        ("diagnoses that failed", score.rate(answers, lambda a: bool(a.error))),
        ("ended by the limit of time, judged by what they knew", score.rate(answers, lambda a: a.late)),
    ]
    return markdown(("", ""), rows)


def _spread(values: Sequence[float] | score.Array) -> str:
    if not len(values):
        return "none"
    middle, low, high = score.quartiles(values)
    return f"median {middle:.2f}, quartiles {low:.2f} to {high:.2f} ({len(values)})"


def _brief(rate: score.Rate) -> str:
    return f"{rate.hits}/{rate.count}" if rate.count else "·"


def _grouped(answers: Sequence[Answer], title: str, group: Callable[[Answer], str]) -> str:
    rows: Rows = []
    for name in dict.fromkeys(map(group, answers)):
        mine = [a for a in answers if group(a) == name]
        one, nothing, outside = score.single(mine), score.without(mine), score.outside(mine)
        first = [a for a in one if score.top(a, 1)]
        rows.append((
            name,
            len(mine),
            _brief(score.rate(one, lambda a: score.top(a, 1))),
            _brief(score.rate(one, lambda a: score.top(a, 3))),
            _brief(score.rate(first, score.in_place)),
            _brief(score.rate(score.pairs(mine), score.all_named)),
            _brief(score.rate(nothing, score.alarmed)),
            _brief(score.rate(outside, score.unexplained)),
            _middle(score.gap_ratios(one)),
            _middle([a.seconds for a in mine]),
            sum(bool(a.error) for a in mine),
        ))  # fmt: skip
    head = (
        title,
        "cases",
        "top-1",
        "top-3",
        "site",
        "pairs",
        "false alarms",
        "unexplained",
        "gap/oracle",
        "s",
        "failed",
    )
    keep = [0, 1, 2, 3, 4, *(k for k in (5, 6, 7) if any(row[k] != "·" for row in rows)), 8, 9, 10]
    return markdown([head[k] for k in keep], [[row[k] for k in keep] for row in rows])


def _middle(values: Sequence[float] | score.Array) -> str:
    return f"{score.quartiles(values)[0]:.2f}" if len(values) else "·"


def _confusion(answers: Sequence[Answer]) -> str:
    """What was hidden, in rows, against what was named first, in columns; solvable cases only."""
    counted = [a for a in answers if a.kind != "pairs" and (a.solvable or a.kind in {"none", "parameters"})]
    rows = list(dict.fromkeys(_hidden(a) for a in counted))
    hidden, named = sorted(rows), sorted({_first(a) for a in counted})
    names = sorted({*hidden, *named}, key=lambda n: (n in {"nothing", "failed"}, n))
    number = {name: k for k, name in enumerate(names, 1)}
    columns = [name for name in names if name in named]
    table: Rows = []
    for row in (name for name in names if name in hidden):
        mine = [_first(a) for a in counted if _hidden(a) == row]
        table.append((f"{number[row]} {row}", *(mine.count(c) or "·" for c in columns)))
    legend = ", ".join(f"{number[c]} {c}" for c in columns if c not in hidden)
    text = markdown(("hidden \\ named", *(str(number[c]) for c in columns)), table)
    return text + (f"\n\nColumns without a row: {legend}." if legend else "")


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
    for key in dict.fromkeys((e.effect, e.parameter) for e in found):
        mine = [e for e in found if (e.effect, e.parameter) == key]
        sizes = [100.0 * abs(e.relative) for e in mine]
        deviations = [abs(e.deviations) for e in mine if np.isfinite(e.deviations)]
        middle, _, high = score.quartiles(sizes)
        within = sum(d <= 1.96 for d in deviations)
        rows.append((
            *key,
            len(mine),
            f"{middle:.1f} %",
            f"{high:.1f} %",
            _middle(deviations),
            f"{within}/{len(deviations)}",
        ))  # fmt: skip
    head = ("effect", "parameter", "cases", "median error", "upper quartile", "in deviations", "in the interval")
    return markdown(head, rows) if rows else "No effect was named at its site."


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
        return told + (" (hidden one among the first three)" if score.top(answer, 3) else "")
    return "" if score.in_place(answer) else told


def _probabilities(answers: Sequence[Answer]) -> str:
    found = reliability.rows(answers)
    head = ("of the classes that were named", "probability, mean", "the hidden effect is in it")
    return markdown(head, found) if found else "No effect was named with a probability."


def _failures(answers: Sequence[Answer]) -> str:
    rows: Rows = []
    for answer in answers:
        why = failed(answer)
        if why:
            hidden = ", ".join(f"{h.name} at {h.site}" for h in answer.hidden) or answer.request[0]
            strength = f"{min(answer.strengths):.1f}" if answer.strengths else "·"
            short = why if len(why) < 110 else why[:107] + "..."
            rows.append((answer.machine, hidden, answer.seed, f"{answer.noise_level:g}", strength, short))
    head = ("machine", "hidden", "seed", "noise", "strength", "answer")
    return markdown(head, rows) if rows else "Nothing."
