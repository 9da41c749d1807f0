"""The pictures of a report, each with a caption and with words for those who do not see it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from typing import TYPE_CHECKING

import numpy as np

from vpm.catalogue import EFFECTS, signature_of
from vpm.compare.correlation import gapped_autocorrelation
from vpm.discrepancy import Diagnosis, Evidence
from vpm.discrepancy.diagnosis import Picture, Trace
from vpm.numbers import Array, percent, short
from vpm.plot import figure_to_svg, plot_candidates, plot_evidence, plot_gap, plot_parameters
from vpm.plot.bars import drawn_candidates
from vpm.plot.findings import (
    MOST_IN_SEGMENT,
    plot_joint_noise,
    plot_joint_over_state,
    plot_joint_over_time,
    plot_parameter_correlation,
    plot_traces,
)
from vpm.plot.signals import amplitude_density
from vpm.report.messages import last_stage

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Joints, channels and effects that a page shows pictures of: those with the largest errors.
MOST_JOINTS, MOST_TRACES = 4, 4


@dataclass(frozen=True)
class Drawn:
    """A picture on the page."""

    anchor: str  #: Name to link to.
    title: str
    caption: str
    svg: str  #: With its words inside.
    joint: bool = False  #: Whether it is of one of several joints.


def drawn(anchor: str, title: str, caption: str, words: str, figure: Figure, *, joint: bool = False) -> Drawn:
    """A picture with words, which describe it."""
    return Drawn(anchor, title, caption, figure_to_svg(figure, words), joint)


def pictures(d: Diagnosis) -> list[Drawn]:
    """All pictures but those of single findings, in the order of the page."""
    makers: list[Callable[[Diagnosis], Iterator[Drawn]]] = [_gaps, _simulated, _joints, _candidates, _parameters]
    return [picture for make in makers for picture in make(d)]


def within(room: int, found: list[Drawn]) -> tuple[list[Drawn], list[Drawn]]:
    """Pictures that fit into so many characters, and those that do not: of joints with small errors, the last first."""
    kept = list(found)
    for one in reversed(found):
        if sum(len(each.svg) for each in kept) <= room:
            break
        if one.joint:
            kept.remove(one)
    return kept, [one for one in found if one not in kept]


def finding(evidence: Evidence, number: int) -> Drawn:
    """Picture of one accepted effect."""
    entry = EFFECTS.get(evidence.effect)
    looks = (entry.signature if entry is not None else signature_of(evidence.effect)).looks
    law = f" {entry.law}" if entry is not None else ""
    floor = "" if isnan(evidence.noise_floor) else f"; noise alone leaves {short(evidence.noise_floor)} {evidence.unit}"
    title = f"{evidence.effect} at {evidence.site} on {evidence.record}"
    sizes = (
        f"Root mean square {short(_rms(evidence.without))} {evidence.unit} without it, "
        f"{short(_rms(evidence.repaired))} {evidence.unit} with it{floor}."
    )
    caption = (
        f"{title}, which was never fitted. What it looks like: {looks[0].lower()}{looks[1:]}. Points: residual of "
        f"{evidence.channel} at the samples used, without the effect (all other parameters as fitted with it) "
        f"and with it. Black: the fitted law{law}. {sizes}"
    )
    words = f"Residual of {evidence.channel} over {evidence.name}, without and with {title}. {sizes}"
    return drawn(f"finding-{number}", title, caption, words, plot_evidence(evidence))


def _gaps(d: Diagnosis) -> Iterator[Drawn]:
    if not d.gap:
        return
    title = "Error on validation data at each stage"
    parts = []
    for channel, gap in d.gap.items():
        floor = "" if isnan(gap.noise_floor) else f", noise floor {percent(gap.share(gap.noise_floor))}"
        stages = ", ".join(f"{percent(gap.share(getattr(gap, s)))} {s}" for s in ("before", "recalibrated", "after"))
        parts.append(f"{channel}: {stages}{floor}.")
    words = f"Bars of the root mean square error as a share of the measured signal. {' '.join(parts)}"
    caption = "Root mean square error as a share of the measured signal; the numbers are those of the table."
    yield drawn("picture-gap", title, caption, words, plot_gap(d.gap))


def _simulated(d: Diagnosis) -> Iterator[Drawn]:
    if not d.traces:
        return
    chosen = sorted(d.traces, key=lambda t: -_error(t))[:MOST_TRACES]
    first = chosen[0]
    more = len(d.traces) - len(chosen)
    parts = [
        f"{t.channel}: error {short(_rms(t.measured - t.before))} {t.unit} before and "
        f"{short(_rms(t.measured - t.after))} {t.unit} after, of a signal of {short(_rms(t.measured))} {t.unit}."
        for t in chosen
    ]
    rest = f" {more} more channels are not drawn." if more else ""
    caption = (
        f"{first.record}, which was never fitted, simulated in mode {first.mode}; before: the model file, after: the "
        f"model {last_stage(d) or 'with recalibrated parameters'}.{rest}"
    )
    words = f"Channels over time, root mean square errors: {' '.join(parts)}"
    yield drawn("picture-simulated", "Measured and simulated", caption, words, plot_traces(chosen))


def _error(trace: Trace) -> float:
    size = float(np.std(trace.measured))
    return _rms(trace.measured - trace.after) / size if size > 0.0 else 0.0


def _joints(d: Diagnosis) -> Iterator[Drawn]:
    chosen = sorted(d.pictures, key=lambda p: -_rms(p.recalibrated) / (_rms(p.measured) or 1.0))[:MOST_JOINTS]
    for number, picture in enumerate(chosen):
        yield from _joint(picture, number, last_stage(d))


def _joint(p: Picture, number: int, last: str) -> Iterator[Drawn]:
    """Pictures of one joint; of the recalibrated model alone where the last one is no other."""
    stages = {"recalibrated": p.recalibrated} | ({last: p.after} if last else {})
    name = p.channel
    sizes = " and ".join(f"{short(_rms(values))} {p.unit} {stage}" for stage, values in stages.items())
    left_out = 1.0 - float(np.mean(np.isfinite(p.after)))
    why = "at standstill, at a stop, or where the filter settles"
    masked = f" Gaps: {percent(left_out)} of the samples do not count: {why}." if left_out > 0.0 else ""
    worst = int(np.nanargmax(np.abs(p.after))) if np.isfinite(p.after).any() else 0
    yield drawn(
        f"picture-{number}-time",
        f"{name}: over time",
        f"First validation record: effort as measured and as the model needs it, {' and '.join(stages)}; below, the "
        f"residual.{masked}",
        f"Effort and residual of {p.channel} over {short(float(p.time[-1] - p.time[0]))} s. Residual, "
        f"root mean square: {sizes}; largest at the end {short(float(p.after[worst]))} {p.unit} at "
        f"{short(float(p.time[worst] - p.time[0]))} s.{masked}",
        plot_joint_over_time(p, stages),
        joint=True,
    )
    ways = [(word, sign * p.velocity > 0.0) for word, sign in (("forward", 1.0), ("backward", -1.0))]
    means = "; ".join(
        f"{stage}: {', '.join(f'{short(_mean(values[way]))} {p.unit} {word}' for word, way in ways)}"
        for stage, values in stages.items()
    )
    yield drawn(
        f"picture-{number}-state",
        f"{name}: against velocity and position",
        "Points: samples used. Lines: means of forward and of backward motion, so that a step at zero "
        "velocity stays one.",
        f"Residual of {p.channel} against velocity and position. Mean residual, {means}.",
        plot_joint_over_state(p, stages),
        joint=True,
    )
    yield from _noise(p, stages, number, name)


def _noise(p: Picture, stages: Mapping[str, Array], number: int, name: str) -> Iterator[Drawn]:
    """Picture of noise, correlation and spectrum, where there is a stretch of samples to have one."""
    step = float(np.median(np.diff(p.time))) if p.time.size > 1 else 0.0
    lags, values, band = gapped_autocorrelation(p.after, step)
    if lags.size < 2 or step <= 0.0:
        return
    outside, rate = float(np.mean(np.abs(values[1:]) > band[1:])), 1.0 / step
    frequency, density = amplitude_density(p.after, rate, MOST_IN_SEGMENT)
    peak = ""
    if frequency.size:
        top = int(np.argmax(density))
        peak = (
            f" The spectrum is largest at {short(float(frequency[top]))} Hz: {short(float(density[top]))} {p.unit}/√Hz."
        )
    words = (
        f"Left: correlation of the residual of {p.channel} with its own past; {percent(outside)} of {lags.size - 1} "
        f"lags are outside of the 95 % band, ± {short(float(band[1]))} at the first. Right: amplitude spectra.{peak}"
    )
    yield drawn(
        f"picture-{number}-noise",
        f"{name}: what is left",
        "Left: correlation with its own past, and the band that holds 95 % of it for white noise. Right: spectra, over "
        "stretches of samples used.",
        words,
        plot_joint_noise(stages, (lags, values, band), rate, p.unit),
        joint=True,
    )


def _candidates(d: Diagnosis) -> Iterator[Drawn]:
    if not d.candidates:
        return
    parts = []
    for c in drawn_candidates(d.candidates):
        what = "accepted" if c.accepted else "not refitted" if isnan(c.unseen) else "refused"
        shares = [f"{percent(c.screened)} screened"] * (not isnan(c.screened))
        shares += [f"{percent(c.unseen)} on validation data"] * (not isnan(c.unseen))
        parts.append(f"{c.name} at {c.site}, {what}: {', '.join(shares) or 'no share known'}.")
    words = f"Bars of the share of the mean square that each candidate takes away. {' '.join(parts)}"
    caption = "Share of the residual's mean square that goes with each candidate; a bar to the left: it grows."
    yield drawn("picture-candidates", "Candidates", caption, words, plot_candidates(d.candidates))


def _parameters(d: Diagnosis) -> Iterator[Drawn]:
    fit = d.fit
    if not fit.names:
        return
    words = "; ".join(
        f"{name} {short(float(value))} ± {std:.2g} {unit}"
        for name, value, std, unit in zip(fit.names, fit.values, fit.std, fit.units, strict=True)
    )
    caption = (
        "Relative to the model file, or to where the fit began for what the model file does not have; 95 % intervals."
    )
    start = [d.stated.get(name, begun) for name, begun in zip(fit.names, map(float, fit.start), strict=True)]
    figure = plot_parameters(fit.names, fit.values, fit.std, start, fit.units)
    yield drawn("picture-parameters", "Fitted parameters", caption, f"Fitted: {words}.", figure)
    if len(fit.names) > 1:
        title = "Correlation of the fitted parameters"
        caption = "Near 1 or −1, the data hardly separate two parameters; an empty row is one that they do not show."
        picture = plot_parameter_correlation(fit.names, fit.correlation)
        yield drawn("picture-correlation", title, caption, _pairs(fit.names, fit.correlation), picture)


def _pairs(names: Sequence[str], correlation: Array) -> str:
    """Words for a picture: the most correlated pairs."""
    first, second = np.triu_indices(len(names), 1)
    values = correlation[first, second]
    order = [k for k in np.argsort(-np.abs(np.nan_to_num(values))) if np.isfinite(values[k])][:5]
    listed = "; ".join(f"{names[first[k]]} and {names[second[k]]} {values[k]:.2f}" for k in order)
    return f"Matrix of {len(names)} parameters. The largest correlations: {listed or 'none is known'}."


def _rms(values: Array) -> float:
    """Root mean square of what counts in a picture; NaN without."""
    counted = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(counted**2))) if counted.size else float("nan")


def _mean(values: Array) -> float:
    counted = values[np.isfinite(values)]
    return float(np.mean(counted)) if counted.size else float("nan")
