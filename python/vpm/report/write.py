"""The files of a diagnosis."""

from __future__ import annotations

import warnings
from pathlib import Path

from vpm.discrepancy import Diagnosis
from vpm.errors import MissingExtraError, MissingExtraWarning
from vpm.files import make_folder
from vpm.report.html import report


def write_report(diagnosis: Diagnosis, folder: Path) -> tuple[Path, ...]:
    """Write ``report.json``, ``report.html``, the repaired ``model.toml`` and ``diagnosis.npz`` into a folder.

    The folder is made if need be; the last file holds everything, for `Diagnosis.load` and ``vpm report``.

    Parameters
    ----------
    diagnosis : Diagnosis
    folder : Path

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
