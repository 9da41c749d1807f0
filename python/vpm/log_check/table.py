"""Channel tables as text, and as they should be."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from vpm.errors import ModelError
from vpm.log_check.finding import Finding
from vpm.model import ChannelEntry


def line_of(channel: str, entry: ChannelEntry) -> str:
    """Line of TOML in a channel table for an entry; defaults are left out."""
    parts = [*_source(entry), f"unit = {_quoted(entry.unit)}"]
    numbers = (("scale", entry.scale, 1.0), ("offset", entry.offset, 0.0), ("delay", entry.delay, 0.0))
    parts += [f"{key} = {value!r}" for key, value, default in numbers if value != default]
    parts += ["optional = true"] if entry.optional else []
    return f"{channel if channel == 'time' else _quoted(channel)} = {{ {', '.join(parts)} }}"


def corrected_lines(findings: Iterable[Finding]) -> dict[str, str]:
    """Corrected entries of a channel table, by channel; the last correction has all of them."""
    return {channel: line for one in findings if one.mistake for channel, line in one.lines.items()}


def corrected_text(text: str, lines: Mapping[str, str], path: str | Path) -> str:
    """The text of a file with a channel table, in which entries were replaced; comments stay.

    Raises ModelError: an entry does not stand on one line.
    """
    inner = r"\{(?:[^{}\n]|\{[^{}\n]*\})*\}"  # columns of a value, and the entry of each
    for channel, line in lines.items():
        entry = (
            rf"""^[ \t]*["']?{re.escape(channel)}["']?[ \t]*=[ \t]*\{{(?=[^\n]*\bcolumns?\b)(?:[^{{}}\n]|{inner})*\}}"""
        )
        found = list(re.finditer(entry, text, re.MULTILINE))
        if len(found) != 1:
            raise ModelError(
                f"{path}: the entry of {channel} does not stand on a line of its own; replace it by {line}",
                where=f"channels.{channel}",
                path=str(path),
            )
        text = text[: found[0].start()] + line + text[found[0].end() :]
    return text


def _source(entry: ChannelEntry) -> list[str]:
    """Source in a channel table: the column, or the value and its columns."""
    if not entry.value:
        return [f"column = {_quoted(entry.column)}"]
    each = (
        f"{name} = {{ column = {_quoted(part.column)}, unit = {_quoted(part.unit)}"
        f"{f', delay = {part.delay!r}' if part.delay else ''} }}"
        for name, part in entry.columns.items()
    )
    return [f"value = {_quoted(entry.value)}", f"columns = {{ {', '.join(each)} }}"]


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
