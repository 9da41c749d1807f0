"""What a study gives: figures beside printed ones, tables, pictures, and what had to be assumed."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from vpm.files import make_folder, replacing, write_text
from vpm.json_values import plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Cell = str | float | None


@dataclass(frozen=True)
class Compared:
    """A number beside the printed one."""

    what: str
    ours: float
    printed: float | None  #: None where nothing is printed.
    unit: str
    source: str  #: Where it is printed.
    mesh: str = ""  #: What it was computed on.

    @property
    def difference(self) -> float | None:
        """Difference of a study's figure to the printed one, % of that."""
        return None if self.printed is None else 100.0 * (self.ours / self.printed - 1.0)


@dataclass(frozen=True)
class Table:
    """Numbers under a title; a remark says how to read them."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    remark: str = ""


@dataclass(frozen=True)
class Picture:
    """A figure, drawn when it is wanted."""

    name: str  #: Of its file.
    words: str  #: What is to be seen.
    draw: Callable[[], Figure]


@dataclass(frozen=True)
class Study:
    """A study that has been run."""

    name: str
    title: str
    compared: tuple[Compared, ...]
    tables: tuple[Table, ...]
    assumed: tuple[str, ...]  #: What the source does not say.
    pictures: tuple[Picture, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """Numbers and words of a study, as JSON has them."""
        compared = [{**vars(each), "difference": each.difference} for each in self.compared]
        tables = [vars(each) for each in self.tables]
        document = plain({"name": self.name, "title": self.title, "compared": compared, "tables": tables})
        return {**document, "assumed": list(self.assumed)}  # type: ignore[dict-item]

    @property
    def all_tables(self) -> tuple[Table, ...]:
        """All tables of a study, the comparison first."""
        rows = tuple((c.what, c.unit, c.ours, c.printed, c.difference, c.mesh, c.source) for c in self.compared)
        first = Table(
            "Beside the printed figures",
            ("what", "unit", "ours", "printed", "difference %", "mesh", "source"),
            rows,
        )
        return (first, *self.tables)

    def __str__(self) -> str:
        parts = [self.title, *(_text(table) for table in self.all_tables)]
        return "\n\n".join([*parts, "\n".join(["Assumed, as the source does not say:", *_listed(self.assumed)])])

    def save(self, folder: Path) -> tuple[Path, ...]:
        """Write ``study.json``, ``report.html`` and the pictures into a folder, which is made if need be.

        Raises
        ------
        MissingExtraError
            matplotlib is not installed.
        """
        make_folder(folder)
        figures = [(picture, picture.draw()) for picture in self.pictures]
        written = [write_text(folder / "study.json", json.dumps(self.to_dict(), indent=1) + "\n")]
        for picture, figure in figures:
            path = folder / f"{picture.name}.png"
            with replacing(path) as beside:
                figure.savefig(beside)
            written.append(path)
        return (*written, write_text(folder / "report.html", self._page(figures)))

    def _page(self, figures: Sequence[tuple[Picture, Figure]]) -> str:
        from vpm.plot.style import figure_to_svg

        body = [f"<h1>{escape(self.title)}</h1>", *(_html(table) for table in self.all_tables)]
        body += ["<h2>Assumed, as the source does not say</h2><ul>"]
        body += [f"<li>{escape(each)}</li>" for each in self.assumed]
        body += ["</ul>"]
        body += [f"<p>{escape(each.words)}</p>{figure_to_svg(figure, each.words)}" for each, figure in figures]
        return _HEAD.replace("TITLE", escape(self.title)) + "\n".join(body) + "\n</body></html>\n"


_HEAD = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"/><title>TITLE</title><style>
body {font: 15px/1.5 sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #1b2430}
table {border-collapse: collapse; font-size: 13px} td, th {padding: .2em .8em; text-align: left}
tr:nth-child(even) {background: #f2f4f7} svg {max-width: 100%; height: auto}
</style></head><body>
"""


def _cell(value: Cell) -> str:
    if value is None:
        return "-"
    return value if isinstance(value, str) else f"{value:.4g}"


def _listed(lines: Sequence[str]) -> list[str]:
    return [f"- {line}" for line in lines]


def _text(table: Table) -> str:
    rows = [table.columns, *(tuple(map(_cell, row)) for row in table.rows)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return "\n".join([table.title, *(f"  {line}" for line in lines), *([table.remark] if table.remark else [])])


def _html(table: Table) -> str:
    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    rows = [line(table.columns, "th"), *(line([_cell(cell) for cell in row], "td") for row in table.rows)]
    return f"<h2>{escape(table.title)}</h2><table>{''.join(rows)}</table><p>{escape(table.remark)}</p>"
