"""The files of a diagnosis."""

from __future__ import annotations

from pathlib import Path

from vpm.discrepancy import Diagnosis
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
        What was written.

    Raises
    ------
    MissingExtraError
        The packages of the extra ``report`` are not installed; ``report.json`` and the model are there all the same.
    """
    make_folder(folder)
    document = diagnosis.save_json(folder / "report.json")
    repaired = folder / "model.toml"
    diagnosis.model.save(repaired)
    everything = diagnosis.save(folder / "diagnosis.npz")
    page = report(diagnosis).save(folder / "report.html")
    return document, page, repaired, everything
