"""A diagnosis as one HTML page that needs nothing else: plots are SVG inside it."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from math import isnan
from os import PathLike
from pathlib import Path

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.catalogue.signature import signature_of
from vpm.discrepancy import Diagnosis, Evidence
from vpm.errors import MissingExtraError
from vpm.files import write_text
from vpm.plot import (
    figure_to_svg,
    plot_candidates,
    plot_evidence,
    plot_gap,
    plot_residual_against,
    plot_residual_time,
)
from vpm.report.story import VERDICT_WORDS
from vpm.simplify import Ladder


@dataclass(frozen=True)
class Report:
    """A diagnosis, and the way down if there is one, as a page.

    Attributes
    ----------
    diagnosis : Diagnosis
    ladder : Ladder or None
    """

    diagnosis: Diagnosis
    ladder: Ladder | None = None

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the page to an HTML file that needs no other file."""
        return write_text(path, render_html(self.diagnosis, self.ladder))

    def _repr_html_(self) -> str:
        return render_html(self.diagnosis, self.ladder)


def report(diagnosis: Diagnosis, ladder: Ladder | None = None) -> Report:
    """Put a diagnosis, and the simplification that followed it, on one page.

    Parameters
    ----------
    diagnosis : Diagnosis
    ladder : Ladder, optional
        What `vpm.simplify` made of the repaired model.

    Returns
    -------
    Report
        ``report(why).save("report.html")`` writes the page; a notebook shows it.
    """
    return Report(diagnosis, ladder)


def render_html(diagnosis: Diagnosis, ladder: Ladder | None = None) -> str:
    """Render the page.

    Parameters
    ----------
    diagnosis : Diagnosis
    ladder : Ladder, optional

    Returns
    -------
    str
        A complete HTML document.

    Raises
    ------
    MissingExtraError
        jinja2 or matplotlib is not installed.
    """
    try:
        from jinja2 import Environment
    except ImportError as error:
        raise MissingExtraError("jinja2", "report") from error
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["percent"] = lambda share: f"{100.0 * share:.2f} %"
    environment.filters["short"] = lambda value: "–" if isnan(value) else f"{value:.4g}"
    template = environment.from_string((files("vpm.report") / "report.html.jinja").read_text(encoding="utf-8"))
    words = VERDICT_WORDS[diagnosis.verdict]
    way_down = figure_to_svg(ladder.plot()) if ladder is not None else ""
    return template.render(
        d=diagnosis,
        words=words,
        evidence=_evidence(diagnosis),
        figures=_figures(diagnosis),
        ladder=ladder,
        way_down=way_down,
    )


def _evidence(diagnosis: Diagnosis) -> dict[tuple[str, str], tuple[str, str]]:
    """Picture and caption of each finding, by effect and site."""
    return {(e.effect, e.site): (figure_to_svg(plot_evidence(e)), _caption(e)) for e in diagnosis.evidence}


def _caption(evidence: Evidence) -> str:
    """What is to be seen, what is drawn, and what it is not."""
    entry = EFFECTS.get(evidence.effect)
    looks = (entry.signature if entry is not None else signature_of(evidence.effect)).looks
    law = f" {entry.law}" if entry is not None else ""
    unit = evidence.unit
    before, after = (float(np.sqrt(np.mean(r**2))) for r in (evidence.without, evidence.repaired))
    floor = "" if isnan(evidence.noise_floor) else f"; noise alone leaves {evidence.noise_floor:.3g} {unit}"
    return (
        f"{evidence.effect} at {evidence.site} on {evidence.record}, which was never fitted. What it looks like: "
        f"{looks[0].lower()}{looks[1:]}. Points: residual of {evidence.channel} at the retained samples, without the "
        f"effect (all other parameters as fitted with it) and with it. Black: the fitted law{law}. Root mean square "
        f"{before:.3g} {unit} without it, {after:.3g} {unit} with it{floor}."
    )


def _figures(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Captions and SVG pictures."""
    pictures = [("Gap on unseen data at each stage, relative to the measured signal", plot_gap(diagnosis.gap))]
    for p in diagnosis.pictures:
        stages = {"recalibrated": p.recalibrated, "with the accepted effects": p.after}
        name = f"{p.channel}, first unseen record"
        pictures.append((f"{name}: residual over time", plot_residual_time(p.time, stages, p.unit)))
        for axis, values, unit in (
            ("velocity", p.velocity, f"{p.coordinate_unit}/s"),
            ("position", p.position, p.coordinate_unit),
        ):
            figure = plot_residual_against(values, stages, f"{axis} [{unit}]", p.unit)
            pictures.append((f"{name}: residual against {axis}", figure))
    if diagnosis.candidates:
        pictures.append(("Candidates: what each would explain", plot_candidates(diagnosis.candidates)))
    return [(caption, figure_to_svg(figure)) for caption, figure in pictures]
