"""Whether probabilities are true: how often what was named with a probability was what was hidden."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from blind import score
from blind.answer import Answer, Named, Weighed
from vpm.files import replacing
from vpm.plot.style import BLUE, SOFT, panels, styled
from vpm.ranking.calibration import Calibration, Reliability, Round, calibrated, calibration_error, reliability
from vpm.ranking.posterior import robust_probabilities
from vpm.ranking.settings import Settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def stated(answers: Sequence[Answer]) -> list[tuple[float, bool]]:
    """Probability of the class of each effect that was named with one, and whether that holds what was hidden."""
    return [
        (named.probability, any(_is_hidden(answer, one) for one in (named, *map(_of_label, named.alike))))
        for answer in answers
        for named in answer.named
        if named.probability is not None
    ]


def bins(answers: Sequence[Answer]) -> list[Reliability]:
    """The points of a reliability diagram."""
    pairs = stated(answers)
    return reliability([probability for probability, _ in pairs], [right for _, right in pairs])


def rounds(answers: Sequence[Answer]) -> list[Round]:
    """What was weighed where each named effect came in, and what of it was true: what no other named one is."""
    found = []
    for answer in answers:
        for named in answer.named:
            several = _beside(answer, named)
            others = [one for one in answer.named if one is not named]
            missing = [h for h in answer.hidden if not any(score.site_right(answer.machine, h, one) for one in others)]
            right = [
                any(score.site_right(answer.machine, h, Named(one.name, one.site)) for h in missing) for one in several
            ]
            if several:
                found.append(Round(_gains(several), tuple(right), bool(missing)))
    return found


def _beside(answer: Answer, named: Named) -> list[Weighed]:
    """All that was weighed in the round in which an effect came in for the last time."""
    came = [one.round for one in answer.weighed if one.accepted and (one.name, one.site) == (named.name, named.site)]
    return [one for one in answer.weighed if came and one.round == came[-1]]


def _gains(several: Sequence[Weighed]) -> tuple[float, ...]:
    """Evidence beyond that at which an effect is as probable as none."""
    odds = Settings().odds
    return tuple(one.evidence - odds for one in several)


def calibrate(answers: Sequence[Answer]) -> Calibration:
    """Calibrate on cases of the proving ground."""
    usable = [answer for answer in answers if answer.weighed]
    seeds = ", ".join(map(str, sorted({answer.seed for answer in usable})))
    return calibrated(rounds(usable), seeds, len(usable))


def halves(answers: Sequence[Answer]) -> tuple[list[Answer], list[Answer]]:
    """Answers to cases with every other seed, and the rest: one half calibrates, the other one tells how well."""
    seeds = sorted({answer.seed for answer in answers})
    first = set(seeds[::2])
    return [a for a in answers if a.seed in first], [a for a in answers if a.seed not in first]


def restated(answers: Sequence[Answer], calibration: Calibration) -> list[Answer]:
    """The same answers with the probabilities that other numbers give."""
    return [replace(a, named=tuple(_restated(a, one, calibration) for one in a.named)) for a in answers]


def _restated(answer: Answer, named: Named, calibration: Calibration) -> Named:
    several = _beside(answer, named)
    if named.probability is None or not several:
        return named
    *shares, _, _ = robust_probabilities(_gains(several), calibration.tempering, calibration.astray)
    alike = {f"{named.name} at {named.site}", *named.alike}
    whole = sum(share for w, share in zip(several, shares, strict=True) if f"{w.name} at {w.site}" in alike)
    return replace(named, probability=float(whole))


def report(answers: Sequence[Answer]) -> tuple[Calibration, str]:
    """Numbers fitted to all answers, and how true those are that half of them give for the other half."""
    first, second = halves(answers)
    fitted, whole = calibrate(first), calibrate(answers)
    told = restated(second, fitted)
    error, count = calibration_error(bins(told)), len(stated(told))
    return whole, (
        f"calibrated on {fitted.cases} cases with every other seed: tempering {fitted.tempering:g}, astray "
        f"{fitted.astray:g}; calibration error {error:.3f} on {count} named classes of the other {len(second)} cases"
    )


def rows(answers: Sequence[Answer]) -> list[tuple[str, str, str]]:
    """Of a table: bin, mean of what was stated there, and how often that was right; in the end by machine."""
    found = [("", f"{one.stated:.3f}", str(score.Rate(one.right, one.count))) for one in bins(answers)]
    machines = dict.fromkeys(answer.machine for answer in answers)
    groups = [("all", answers), *((name, [a for a in answers if a.machine == name]) for name in machines)]
    for name, mine in groups:
        several = bins(mine)
        if several:
            count = sum(one.count for one in several)
            mean = sum(one.stated * one.count for one in several) / count
            right = score.Rate(sum(one.right for one in several), count)
            found.append((f"{name}, error {calibration_error(several):.3f}", f"{mean:.3f}", str(right)))
    return found


@styled
def diagram(answers: Sequence[Answer]) -> Figure:
    """The reliability diagram, with intervals of 95 %; needs the extra ``plot``."""
    figure, axes = panels(1, height=3.2, width=4.2)
    axis = axes[0][0]
    axis.plot((0.0, 1.0), (0.0, 1.0), color=SOFT, linewidth=0.8)
    for one in bins(answers):
        rate = score.Rate(one.right, one.count)
        axis.plot((one.stated, one.stated), rate.interval, color=BLUE, linewidth=1.0)
        axis.plot((one.stated,), (rate.value,), "o", color=BLUE, markersize=4.0)
    axis.set_xlabel("stated probability")
    axis.set_ylabel("share that was right")
    return figure


def draw(answers: Sequence[Answer], path: Path) -> Path:
    """Write the diagram as a picture."""
    with replacing(path) as beside:
        diagram(answers).savefig(beside, metadata={"Date": None, "Creator": None})
    return path


def _is_hidden(answer: Answer, named: Named) -> bool:
    return any(score.site_right(answer.machine, hidden, named) for hidden in answer.hidden)


def _of_label(label: str) -> Named:
    """An effect from its label, ``effect at site``."""
    name, _, site = label.partition(" at ")
    return Named(name, site)
