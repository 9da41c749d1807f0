"""The files of a diagnosis."""

from __future__ import annotations

from pathlib import Path

from vpm.discrepancy import Diagnosis
from vpm.report.html import render_html


def write_report(diagnosis: Diagnosis, folder: Path) -> tuple[Path, ...]:
    """Write ``report.json``, ``report.html`` and the repaired ``model.toml`` into a folder, made if need be.

    Parameters
    ----------
    diagnosis : Diagnosis
    folder : Path

    Returns
    -------
    tuple of Path
        What was written.

    Raises
    ------
    MissingExtraError
        The packages of the extra ``report`` are not installed; ``report.json`` and the model are there all the same.
    """
    folder.mkdir(parents=True, exist_ok=True)
    document = diagnosis.save_json(folder / "report.json")
    repaired = folder / "model.toml"
    diagnosis.model.save(repaired)
    page = folder / "report.html"
    page.write_text(render_html(diagnosis), encoding="utf-8")
    return document, page, repaired
