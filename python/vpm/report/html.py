"""A diagnosis as one HTML page that needs nothing else: plots are SVG inside it."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from os import PathLike
from pathlib import Path

from vpm.discrepancy import Diagnosis
from vpm.errors import MissingExtraError, MissingExtraWarning, needs
from vpm.files import make_folder, write_text
from vpm.numbers import percent, short
from vpm.report.messages import VERDICT_WORDS, estimate, last_stage, probability, refitted, step_name, took
from vpm.report.pictures import Drawn, drawn, finding, pictures, within
from vpm.simplify import Ladder

#: Characters of a page beside the words of its pictures, so that it stays below a megabyte.
ROOM = 950_000
#: Rows of a table that grows with the machine; `report.json` has all.
ROWS = 300


@dataclass(frozen=True)
class Report:
    """A diagnosis, and a model reduction if there is one, as a page."""

    diagnosis: Diagnosis
    ladder: Ladder | None = None

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the page to an HTML file that needs no other file."""
        return write_text(path, render_html(self.diagnosis, self.ladder))

    def _repr_html_(self) -> str:
        return render_html(self.diagnosis, self.ladder)


def report(diagnosis: Diagnosis, ladder: Ladder | None = None) -> Report:
    """HTML page of a diagnosis, and of the simplification that followed it.

    Parameters
    ----------
    ladder : Ladder, optional
        What `vpm.simplify` made of the repaired model.

    Returns
    -------
    Report
        ``report(why).save("report.html")`` writes the page; a notebook shows it.
    """
    return Report(diagnosis, ladder)


def render_html(diagnosis: Diagnosis, ladder: Ladder | None = None) -> str:
    """Render the report as one HTML page.

    Result: a complete HTML document, which is well-formed XML too.
    """
    with needs("jinja2", "report"):
        from jinja2 import Environment
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters.update(percent=percent, short=short, took=took, probability=probability, step=step_name)
    environment.globals.update(estimate=estimate)
    template = environment.from_string((files("vpm.report") / "report.html.jinja").read_text(encoding="utf-8"))
    evidence = {(e.effect, e.site): finding(e, n) for n, e in enumerate(diagnosis.evidence, 1)}

    def page(shown: Sequence[Drawn], left_out: Sequence[Drawn]) -> str:
        return template.render(
            d=diagnosis,
            words=VERDICT_WORDS[diagnosis.verdict],
            evidence=evidence,
            pictures=shown,
            left_out=left_out,
            rows=ROWS,
            refitted=refitted(diagnosis),
            last_stage=last_stage(diagnosis),
            ladder=ladder,
            reduction=_reduction(ladder) if ladder is not None else None,
        )

    return page(*within(ROOM - len(page((), ())), pictures(diagnosis)))


def _reduction(ladder: Ladder) -> Drawn:
    chosen = ladder.chosen
    words = (
        f"Error against the time of a step for {len(ladder.rungs)} models; the chosen one has an error of "
        f"{percent(chosen.error)} at {short(1e6 * chosen.seconds)} µs."
    )
    return drawn("picture-ladder", "Model reduction", "Error against the time of a step", words, ladder.plot())


def write_report(diagnosis: Diagnosis, folder: Path) -> tuple[Path, ...]:
    """Write ``report.json``, ``report.html``, the repaired ``model.toml`` and ``diagnosis.npz`` into a folder.

    The folder is made if need be; the last file holds everything, for `Diagnosis.load` and ``vpm report``.

    Returns
    -------
    tuple of Path
        What was written: without the packages of the extra ``report`` no ``report.html``, and a warning says so.
    """
    make_folder(folder)
    document = diagnosis.save_json(folder / "report.json")
    repaired = folder / "model.toml"
    diagnosis.model.save(repaired)
    everything = diagnosis.save(folder / "diagnosis.npz")
    try:
        page = report(diagnosis).save(folder / "report.html")
    except MissingExtraError as error:
        warnings.warn(f"report.html was left out: {error}", MissingExtraWarning, stacklevel=2)
        return document, repaired, everything
    return document, page, repaired, everything
