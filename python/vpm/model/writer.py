"""From a checked document back to the content and the text of a model file."""

from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import Any

import tomli_w
from pydantic import BaseModel

from vpm.model.effects import EffectEntry
from vpm.model.entry import Quantity
from vpm.model.schema import Document


def content_of(document: Document, *, complete: bool = False) -> dict[str, Any]:
    """Content to write that reads back as the same document.

    ``complete``: keep what stands at its default; else it is left out.
    """
    return _table(document, complete)


def plain(value: object, complete: bool = False) -> object:
    """Value to write as a TOML parser would give it; a quantity with nothing but a number is a number."""
    match value:
        case Quantity():
            table = _table(value, complete)
            return table["value"] if len(table) == 1 else table
        case BaseModel():
            return _table(value, complete)
        case Mapping():
            return {key: plain(item, complete) for key, item in value.items()}
        case tuple():
            return [plain(item, complete) for item in value]
    return value


def _table(entry: BaseModel, complete: bool) -> dict[str, Any]:
    table: dict[str, Any] = {}
    for name, field in type(entry).model_fields.items():
        value = getattr(entry, name)
        default = None if field.is_required() else field.get_default(call_default_factory=True)
        if value is not None and (complete or value != default):
            table[field.alias or name] = plain(value, complete)
    if isinstance(entry, EffectEntry):
        table |= {name: plain(quantity, complete) for name, quantity in entry.values.items()}
    return table


#: What stands in a file beside its content, by place: ``("bodies", "arm")`` above a table, with a key behind its line.
Remarks = Mapping[tuple[str, ...], str]

#: Lines longer than this are written as one line for each item of their list.
WIDEST = 120


def toml_of(document: Document, remarks: Remarks = MappingProxyType({}), head: Iterable[str] = ()) -> str:
    """Write the text of a model file: one table per component, one line per key.

    ``remarks``: one line each, by place; ``head``: lines that stand above all, as comments.
    """
    lines = [f"# {line}".rstrip() for line in head]
    return "\n".join([*lines, *_lines(content_of(document), remarks)]) + "\n"


def _lines(content: Mapping[str, Any], remarks: Remarks) -> Iterator[str]:
    sections = {key: value for key, value in content.items() if isinstance(value, dict) or key == "effects"}
    yield from (_pair(key, value, remarks.get((key,))) for key, value in content.items() if key not in sections)
    for place, head, table in _tables(sections):
        above = [f"# {remarks[place]}"] if place in remarks else []
        yield from ("", *above, head)
        yield from (_pair(key, value, remarks.get((*place, key))) for key, value in table.items())


def _tables(sections: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], str, Mapping[str, Any]]]:
    """Place, heading and content of each table of a model file."""
    for section, content in sections.items():
        if section == "channels":
            yield (section,), "[channels]", content
        elif section == "effects":
            yield from (((section,), "[[effects]]", effect) for effect in content)
        else:
            yield from (((section, name), f"[{section}.{_key(name)}]", table) for name, table in content.items())


def _pair(key: str, value: object, remark: str | None = None) -> str:
    line, behind = f"{_key(key)} = {_value(value)}", f"  # {remark}" if remark else ""
    if len(line) > WIDEST and isinstance(value, list) and any(isinstance(item, Mapping) for item in value):
        items = "\n".join(f"    {_value(item)}," for item in value)
        return f"{_key(key)} = [{behind}\n{items}\n]"
    return line + behind


def _value(value: object) -> str:
    """Write a value on one line by the TOML library."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(_pair(key, item) for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return tomli_w.dumps({"v": value}).removeprefix("v = ").removesuffix("\n")


def _key(key: str) -> str:
    return tomli_w.dumps({key: 0}).removesuffix(" = 0\n")
