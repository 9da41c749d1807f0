"""A fit as files: the fitted model, a table, a report, a picture."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from vpm.errors import MissingExtraError
from vpm.files import make_folder, replacing, write_text
from vpm.identify.fitted import Fit

_COLUMNS = ("name", "start", "value", "std", "low", "high", "unit")


def write_fit(fit: Fit, folder: Path, lines: Sequence[str] = ()) -> list[Path]:
    """Write ``model.toml``, ``parameters.csv``, ``report.md``, ``fit.npz`` and, with the extra ``plot``, ``fit.png``.

    Parameters
    ----------
    fit : Fit
    folder : Path
        Made if it is not there.
    lines : sequence of str
        What was told of the fit, for the report.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    FileError
        The folder cannot be made or written to.
    """
    make_folder(folder)
    write_text(folder / "report.md", _report(fit, lines))
    with replacing(folder / "parameters.csv") as beside, beside.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(_COLUMNS)
        table.writerows(_rows(fit))
    fit.model.save(folder / "model.toml")
    written = [folder / name for name in ("model.toml", "parameters.csv", "report.md")] + [fit.save(folder / "fit.npz")]
    try:
        figure = fit.plot()
    except MissingExtraError:  # a plain install draws nothing
        return written
    with replacing(folder / "fit.png") as beside:
        figure.savefig(beside)
    return [*written, folder / "fit.png"]


def _rows(fit: Fit) -> list[tuple[object, ...]]:
    each = zip(fit.names, fit.start, fit.values, fit.std, fit.intervals, fit.units, strict=True)
    return [
        (name, float(start), float(value), float(std), float(low), float(high), unit)
        for name, start, value, std, (low, high), unit in each
    ]


def _report(fit: Fit, lines: Sequence[str]) -> str:
    records = ", ".join(fit.experiments)
    rows = [
        f"| {name} | {start:.6g} | {value:.6g} | {low:.6g} | {high:.6g} | {unit} |"
        for name, start, value, _, low, high, unit in _rows(fit)
    ]
    return "\n".join(
        [
            f"# {fit.model.name}: identification",
            "",
            f"Mode {fit.mode}, fitted to {records}, after {fit.evaluations} evaluations. Intervals of 95 %, SI units.",
            "",
            "| parameter | start | value | from | to | unit |",
            "| --- | --- | --- | --- | --- | --- |",
            *rows,
            "",
            *(f"- {line}" for line in lines),
            "",
        ]
    )
