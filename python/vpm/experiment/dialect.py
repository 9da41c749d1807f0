"""How a text file writes a table: letters, remarks above the names, separators, marks in numbers, a row of units."""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from os import PathLike
from pathlib import Path

from vpm.errors import ExperimentError
from vpm.experiment.dates import STAMP_BYTES
from vpm.units import is_unit

#: Separators that are looked for; where a file has none of them, blanks separate.
DELIMITERS = (",", ";", "\t", "|")
#: What a line begins with that is a remark.
REMARKS = ("#", "%", "//", ";")
#: Lines and bytes in which the names have to be found.
PREAMBLE, MOST_BEFORE = 1000, 1 << 20
#: Bytes of no text: what controls terminals and printers, but for tabulators, ends of lines and of pages.
_CONTROLS = bytes({*range(32)} - {*b"\t\n\r\f\x1b"})
_ENCODINGS = ("utf-8-sig", "cp1252")
#: Marks that group the digits of a number in threes: point and comma if the other one is decimal, apostrophes, blanks.
_GROUPS = (".", ",", "'", "\u2019", "\u00a0", "\u202f", " ")


@dataclass(frozen=True)
class Dialect:
    """How a text file writes its table."""

    encoding: str
    header: tuple[str, ...]  #: Names of the columns.
    units: tuple[str, ...]  #: Their units, where a row below the names states them; else empty.
    named: int  #: Line of the names, which counts from 1.
    skipped: int  #: Lines above the numbers.
    delimiter: str | None  #: None where blanks separate.
    comma: bool  #: Numbers have decimal commas.
    group: str = ""  #: Mark between thousands, as the point in 1.234,5; empty where there is none.

    def rows(self, path: str | PathLike[str]) -> Iterator[tuple[int, list[str]]]:
        """Cells of each row of numbers in a dialect, as they stand there, with its line."""
        with Path(path).open(encoding=self.encoding, newline="") as file:
            lines = islice(file, self.skipped, None)
            if self.delimiter is None:
                split = ((number, line.split()) for number, line in enumerate(lines, self.skipped + 1))
            else:
                reader = csv.reader(lines, delimiter=self.delimiter)
                split = ((self.skipped + reader.line_num, row) for row in reader)
            yield from ((number, row) for number, row in split if any(cell.strip() for cell in row))

    def number(self, cell: str) -> str:
        """Cell of a dialect with a decimal point and no marks between thousands."""
        plain = cell.replace(self.group, "") if self.group else cell
        return plain.replace(",", ".") if self.comma else plain


def read_dialect(path: str | PathLike[str]) -> Dialect:
    """Read the dialect in which a text file writes its table.

    Remarks and blank lines may stand above the names, and the names may be a remark themselves, as ``numpy.savetxt``
    writes them. Blanks separate where the names hold no other separator. Commas are decimal ones where another
    separator is there, or quotes, and no number has a point but between thousands; dates are no numbers.
    """
    content = _content(path)
    encoding = _encoding(path, content)
    beginning = re.split(rb"\r\n|\r|\n", content[:MOST_BEFORE])[:PREAMBLE]
    lines = [line.decode(encoding, "replace").strip() for line in beginning]
    told = [place for place, line in enumerate(lines) if line]
    named, line = _names(path, lines, told)
    delimiter = max(DELIMITERS, key=line.count)
    separator = delimiter if delimiter in line or not line.split()[1:] else None
    header = tuple(cell.strip() for cell in _cells(line, separator))
    below = next((place for place in told if place > named), None)
    units = () if below is None else _units(_cells(lines[below], separator), len(header))
    skipped = below + 1 if units and below is not None else named + 1
    numbers = content.split(b"\n", skipped)[-1]
    if separator == ",":  # then a comma within a number needs quotes
        numbers = b"\n".join(re.findall(rb'"([^"\n]*)"', numbers))
    text = STAMP_BYTES.sub(b"", numbers).decode(encoding)
    group = next((mark for mark in _GROUPS if _groups(mark, text, separator)), "")
    text = text.replace(group, "")
    comma = re.search(r"\d,\d", text) is not None and re.search(r"\d\.\d", text) is None
    return Dialect(encoding, header, units, named + 1, skipped, separator, comma, group)


def _groups(mark: str, text: str, separator: str | None) -> bool:
    """Whether a mark stands between the thousands of numbers in a dialect, and nowhere else in a number."""
    if mark not in text or (mark == " " and separator is None):
        return False
    decimal = {".": ",", ",": r"\."}.get(mark, "")
    code = re.escape(mark)
    whole = rf"(?<![\d.,])\d{{1,3}}(?:{code}\d{{3}})+{decimal}"
    elsewhere = rf"\d{{4}}{code}\d|\d{code}(?!\d{{3}}(?!\d))\d"
    return re.search(whole, text) is not None and re.search(elsewhere, text) is None


def _content(path: str | PathLike[str]) -> bytes:
    try:
        return Path(path).read_bytes()
    except FileNotFoundError as error:
        raise ExperimentError(f"{path} does not exist; check the name and the folder", path=str(path)) from error
    except OSError as error:
        raise ExperimentError(
            f"{path} cannot be read ({error.strerror}); give the path of a CSV file", path=str(path)
        ) from error


def _encoding(path: str | PathLike[str], content: bytes) -> str:
    """Encoding of a dialect: UTF-8, or the Latin letters of Windows that older programs write."""
    odd = len(content.translate(None, _CONTROLS)) < len(content)
    for encoding in () if odd else _ENCODINGS:
        try:
            content.decode(encoding)
        except UnicodeDecodeError:
            continue
        return encoding
    raise ExperimentError(f"{path} is not a text file in UTF-8 or Latin letters; export the log as CSV", path=str(path))


def _names(path: str | PathLike[str], lines: Sequence[str], told: Sequence[int]) -> tuple[int, str]:
    """Names line of a dialect: the first line that is no remark, or the last remark above the numbers."""
    first = next((place for place in told if not lines[place].startswith(REMARKS)), None)
    if first is None:
        what = f"holds {len(told)} lines of remarks and no numbers" if told else "is empty"
        raise ExperimentError(f"{path} {what}; a log starts with a line of column names", path=str(path))
    if not _is_numbers(lines[first]):
        return first, lines[first]
    above = max((place for place in told if place < first), default=None)
    if above is None:
        raise ExperimentError(
            f'{path}, line {first + 1} holds numbers ("{lines[first][:40]}"); put a line of column names above them',
            path=str(path),
        )
    bare = lines[above].lstrip("#%/ ")
    return above, lines[above] if bare.startswith(DELIMITERS) else bare


def _cells(line: str, separator: str | None) -> list[str]:
    return line.split() if separator is None else next(csv.reader([line], delimiter=separator))


def _units(cells: Sequence[str], columns: int) -> tuple[str, ...]:
    """Units line of a dialect below the names, if it holds units and no number or date; else none.

    Loggers write words there that are no units, such as ``inc`` of a counter; a table says what these are.
    """
    units = tuple(re.sub(r"^[\[(](.*)[\])]$", r"\1", cell.strip()) for cell in cells)
    told = len(units) == columns and any(unit and is_unit(unit) for unit in units)
    words = all(is_unit(unit) or not re.search(r"\d", unit) for unit in units if unit)
    if not told or not words or any(map(is_number, cells)):
        return ()
    return tuple("1" if unit in ("", "-") else unit for unit in units)


def _is_numbers(line: str) -> bool:
    """Whether all cells of a line are numbers in any dialect."""
    cells = [cell for cell in re.split(r"[,;\t| ]+", line.replace('"', "")) if cell]
    return all(map(is_number, cells))


def is_number(cell: str) -> bool:
    """Whether a cell of a dialect is a number with a decimal point."""
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell  # Python reads 1_000, tables do not
