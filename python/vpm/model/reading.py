"""Content of a model file: TOML, or what an importer makes of another format."""

import math
import re
import tomllib
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from vpm.errors import ModelError, VpmError
from vpm.files import unreadable
from vpm.model.messages import Problem, place, raise_first
from vpm.numbers import LARGEST
from vpm.plugins import Plugin, told, usable

#: Ending of files that nobody else imports.
OWN = ("", "toml")
#: Deepest nesting of a file; a model file needs seven.
DEEPEST = 32


def read_toml(path: str | PathLike[str]) -> dict[str, Any]:
    """Read the content of a TOML file."""
    if reason := unreadable(path):
        raise ModelError(reason, path=str(path))
    if (plugin := importer_of(path)) is not None:
        return _imported(plugin, path)
    try:
        text = Path(path).read_text(encoding="utf-8-sig")  # editors of Windows write a mark before the text
    except FileNotFoundError:
        raise ModelError(f"{path} does not exist; check the path", path=str(path)) from None
    except UnicodeDecodeError as error:
        raise ModelError(f"{path} is not UTF-8 text (byte {error.start}); save it as UTF-8", path=str(path)) from None
    except OSError as error:
        raise ModelError(f"{path} cannot be read: {error.strerror or error}", path=str(path)) from error
    return parse_toml(text, str(path))


def importer_of(path: str | PathLike[str]) -> Plugin | None:
    """Importer that reads a file which is no TOML, by its ending."""
    ending = Path(path).suffix.lower()[1:]
    return None if ending in OWN else usable("importers", OWN).get(ending)


def _imported(plugin: Plugin, path: str | PathLike[str]) -> dict[str, Any]:
    """Content read by an importer of another package: what it names is called with the path."""
    importer = plugin.load()
    try:
        found = importer(path)  # type: ignore[operator]  # an error says so
        return dict(found.to_dict() if hasattr(found, "to_dict") else found)
    except VpmError:
        raise
    except Exception as error:
        raise ModelError(
            f"{path} cannot be imported by {plugin} ({told(error)}); check the file", path=str(path)
        ) from error


def check_plain(content: Mapping[str, object], path: str | None = None) -> None:
    """Refuse tables of tables without end and impossible numbers when reading a model file."""
    left: list[tuple[tuple[str | int, ...], object]] = [((), content)]
    while left:
        way, value = left.pop()
        if len(way) > DEEPEST:
            where = f"{place(*way[:3])} ..."
            raise_first([Problem(where, f"is nested more than {DEEPEST} deep; write it flatter")], path)
        if isinstance(value, int) and not -(2**63) <= value < 2**63:
            rest = "is an integer of more than 64 bits; write a number with a point, 1e300"
            raise_first([Problem(place(*way), rest)], path)
        if isinstance(value, float) and LARGEST < abs(value) < math.inf:
            rest = f"is {value:g}, which is more than any machine has; correct the value"
            raise_first([Problem(place(*way), rest)], path)
        if isinstance(value, Mapping):
            left += [((*way, str(key)), inner) for key, inner in value.items()]
        elif isinstance(value, list | tuple):
            left += [((*way, at), inner) for at, inner in enumerate(value)]


def parse_toml(text: str, path: str | None = None) -> dict[str, Any]:
    """Read the content of a TOML text."""
    head = f"{path}: " if path else ""
    try:
        content = tomllib.loads(text)
    except RecursionError:
        raise ModelError(f"{head}tables or lists are nested without end; write them flatter", path=path) from None
    except tomllib.TOMLDecodeError as error:
        if text.lstrip().startswith("<"):
            raise ModelError(
                f"{head}this is XML, not TOML; vpm import makes a model file of a robot", path=path
            ) from None
        found = re.fullmatch(
            r"(?P<what>.*) \(at (?:line (?P<line>\d+), column (?P<column>\d+)|end of document)\)", str(error)
        )
        lines = text.splitlines() or [""]
        what = found["what"] if found else str(error)
        line = int(found["line"]) if found and found["line"] else len(lines)
        column = int(found["column"]) if found and found["column"] else len(lines[-1]) + 1
        message = f"{head}line {line}, column {column} is not TOML: {what[:1].lower()}{what[1:]}; correct the line"
        raise ModelError(message, path=path, line=line, column=column) from None
    except ValueError:  # Python reads no integer of thousands of digits
        raise ModelError(f"{head}an integer has more than 64 bits; write a number with a point", path=path) from None
    check_plain(content, path)
    return content
