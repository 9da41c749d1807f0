"""Report of merit.py: one page of HTML, one of Markdown, and pictures."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

if TYPE_CHECKING:
    from merit import Judged

mpl.use("Agg")
from matplotlib import pyplot as plt

GAUGES = ("21", "22", "31", "32")
PLAY = "flexible with play"

#: Everything that is not fitted.
GIVEN = (
    ("lengths of the strips", "0.44 m, 0.41 m", "printed"),
    ("steel: Young's modulus, density", "206 GPa, 7850 kg/m^3", "assumed"),
    ("section of the strips", "15 mm x 4 mm", "assumed"),
    ("first gauge of each strip", "56 mm from the joint", "assumed"),
    ("second gauges", "from the ratio of the strains in the fitted half", "computed"),
    ("inertia of the elbow", "5e-4 kg m^2", "assumed"),
    ("contacts of the play: stiffness, rounding", "3 kN m/rad, 0.3 mrad", "assumed"),
    ("strains lead the joint channels", "10 ms, one sample", "measured"),
    ("payload", "none", "printed"),
)


def write_report(folder: Path, results: Mapping[str, Judged]) -> list[Path]:
    """Write everything into ``folder``; the paths of what was written."""
    folder.mkdir(parents=True, exist_ok=True)
    pictures = [_picture(folder / f"strains_{k}.png", way, r) for k, (way, r) in enumerate(results.items(), start=1)]
    first, second = results.values()
    sections = [
        ("Fit on the half that was not fitted, %", ("method", "way", *(f"gauge {g}" for g in GAUGES)), _fits(results)),
        (
            "Fitted, with 95 % intervals within a half and the spread between the halves",
            ("parameter", *results, "spread", "unit"),
            _parameters(first, second),
        ),
        ("Not fitted", ("what", "value", "how"), GIVEN),
    ]
    title = "TUDOR, measured: strains from joint angles"
    text = [f"# {title}\n", _words(results)]
    page = [f"<!doctype html><meta charset='utf-8'><title>{title}</title><h1>{title}</h1><p>{_words(results)}</p>"]
    for heading, head, rows in sections:
        text.append(f"\n## {heading}\n\n" + _markdown(head, rows))
        page.append(f"<h2>{heading}</h2>" + _table(head, rows))
    for picture in pictures:
        text.append(f"\n![{picture.stem}]({picture.name})")
        page.append(f"<p><img src='{picture.name}' alt='{picture.stem}' width='900'></p>")
    files = {folder / "report.md": "\n".join(text) + "\n", folder / "report.html": "\n".join(page)}
    for path, content in files.items():
        path.write_text(content, encoding="utf-8")
    return [*files, *pictures]


def _words(results: Mapping[str, Judged]) -> str:
    gains = [
        result.fits[PLAY] - np.maximum(result.fits["static map"], result.fits["one mode"])
        for result in results.values()
    ]
    return (
        "Every method was fitted to one half of the record and predicts the other. The flexible arm with play in "
        f"the gear of joint 2 is {np.min(gains):.1f} to {np.max(gains):.1f} points above the better baseline per "
        "gauge. The last gauge sits where the second strip is hardly strained: most of its signal is noise."
    )


def _fits(results: Mapping[str, Judged]) -> list[Sequence[str]]:
    names = next(iter(results.values())).fits
    return [(n, way, *(f"{v:.1f}" for v in result.fits[n])) for n in names for way, result in results.items()]


def _parameters(first: Judged, second: Judged) -> list[Sequence[str]]:
    one, other = first.flexible[PLAY].free, second.flexible[PLAY].free
    rows = []
    for name, (value, width, unit) in one.items():
        there, also, _ = other[name]
        cells = [f"{v:.4g} ± {w:.1g}" if np.isfinite(w) else f"{v:.4g}" for v, w in ((value, width), (there, also))]
        rows.append((name, *cells, f"{abs(there - value):.2g}", unit))
    return rows


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)) + "\n"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    return "<table border='1'>" + line(head, "th") + "".join(line(row, "td") for row in rows) + "</table>"


def _picture(path: Path, way: str, result: Judged) -> Path:
    figure, axes = plt.subplots(len(GAUGES), 1, figsize=(11, 9), sharex=True, layout="constrained")
    for axis, gauge, column in zip(axes, GAUGES, range(len(GAUGES)), strict=True):
        axis.plot(result.time, 1e6 * result.measured[:, column], color="0.6", lw=2.0, label="measured")
        for name, color in (("one mode", "tab:orange"), (PLAY, "tab:blue")):
            label = f"{name}, {result.fits[name][column]:.1f} %"
            axis.plot(result.time, 1e6 * result.predicted[name][:, column], color=color, lw=0.8, label=label)
        axis.set_ylabel(f"gauge {gauge}, µm/m")
        axis.legend(loc="upper right", ncols=3, fontsize=8)
    axes[-1].set_xlabel("time, s")
    figure.suptitle(f"fitted on one half, predicted on the other: {way}")
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path
