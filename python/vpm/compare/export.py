"""A comparison as MCAP, with a layout, for Foxglove and PlotJuggler."""

from __future__ import annotations

import json
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vpm.errors import needs
from vpm.files import replacing, write_text

if TYPE_CHECKING:
    from vpm.compare.comparison import ChannelComparison, Comparison

#: What a message of a channel holds.
FIELDS = ("measured", "simulated", "residual")


def write_mcap(comparison: Comparison, path: str | PathLike[str]) -> tuple[Path, Path]:
    """Export measured, simulated and residual channels as MCAP, with the time stamps of the log.

    Each channel ``axis.position`` is a topic ``/axis/position`` of JSON messages, whose schema says the unit.

    ``path``: of the MCAP file; a layout for Foxglove is written beside it, ``NAME.layout.json``.
    """
    with needs("mcap", "mcap"):
        from mcap.writer import Writer
    # MCAP counts nanoseconds from zero on.
    shift = max(0.0, *(-float(each.time[0]) for each in comparison.channels), 0.0)
    with replacing(path) as beside, beside.open("wb") as stream:
        writer = Writer(stream)
        writer.start(library="vpm")
        metadata = {"model": comparison.model_name, "experiment": comparison.experiment_name, "mode": comparison.mode}
        writer.add_metadata("vpm", metadata)
        for each in comparison.channels:
            schema = writer.register_schema(each.channel, "jsonschema", json.dumps(_schema(each)).encode())
            topic = writer.register_channel(topic_of(each.channel), "json", schema)
            rows = zip(each.time, each.measured, each.simulated, each.residual, strict=True)
            for number, (time, *values) in enumerate(rows):
                stamp = round(1e9 * (float(time) + shift))
                message = json.dumps(dict(zip(FIELDS, map(float, values), strict=True))).encode()
                writer.add_message(topic, stamp, message, stamp, number)
        writer.finish()  # type: ignore[no-untyped-call]  # the library types what it takes only
    layout = Path(path).with_suffix(".layout.json")
    return Path(path), write_text(layout, json.dumps(_layout(comparison), indent=1) + "\n")


def topic_of(channel: str) -> str:
    """Topic of an exported channel; points separate topics from fields where they are plotted."""
    return "/" + channel.replace(".", "/")


def _schema(channel: ChannelComparison) -> dict[str, Any]:
    number = {"type": "number", "description": channel.unit}
    return {"type": "object", "title": channel.channel, "properties": dict.fromkeys(FIELDS, number)}


def _layout(comparison: Comparison) -> dict[str, Any]:
    """Layout to export for Foxglove: each channel measured and simulated, and the residual."""
    plots: dict[str, Any] = {}
    rows: list[Any] = []
    for at, each in enumerate(comparison.channels):
        both, left = f"Plot!both{at}", f"Plot!left{at}"
        plots[both] = _plot(each, FIELDS[:2])
        plots[left] = _plot(each, FIELDS[2:])
        rows.append({"direction": "row", "first": both, "second": left})
    stack = rows.pop()
    while rows:
        stack = {"direction": "column", "first": rows.pop(), "second": stack}
    return {
        "configById": plots,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": stack,
    }


def _plot(channel: ChannelComparison, fields: tuple[str, ...]) -> dict[str, Any]:
    paths = [
        {"value": f"{topic_of(channel.channel)}.{name}", "enabled": True, "timestampMethod": "receiveTime"}
        for name in fields
    ]
    title = f"{channel.channel} [{channel.unit}]"
    return {"title": title, "paths": paths, "showLegend": True, "isSynced": True, "xAxisVal": "timestamp"}
