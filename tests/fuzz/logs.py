"""Logs: in every format, damaged byte by byte; tables of numbers and channel tables with a sense of their structure."""

import importlib.util
import math
import struct
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray
from scipy.io import savemat

from fuzz import damage
from fuzz.doors import arm, finite
from vpm import Experiment, check_log, demo, simulate
from vpm.log_check.settings import Settings

#: Rows of the log that is damaged.
ROWS = 120
#: A channel table for the columns of `files`.
CHANNELS = {
    "time": {"column": "time", "unit": "s"},
    "shoulder.position": {"column": "q", "unit": "deg", "scale": 0.5, "offset": 1.0},
    "motor.command": {"column": "u", "unit": "A", "delay": 0.004},
}


@cache
def columns() -> dict[str, NDArray[np.float64]]:
    """A small log."""
    time: NDArray[np.float64] = 0.002 * np.arange(ROWS, dtype=np.float64)
    return {"time": time, "q": np.sin(time), "u": np.cos(time)}


@cache
def files(folder: Path) -> dict[str, bytes]:
    """The same log in each format whose library is there."""
    written = columns()
    lines = (f"{t:.6g},{q:.6g},{u:.6g}" for t, q, u in zip(*written.values(), strict=True))
    (folder / "good.csv").write_text("time,q,u\n" + "\n".join(lines), encoding="utf-8")
    savemat(folder / "good.mat", {**written, "log": {"name": "arm", "v": np.ones((ROWS, 2))}})
    table = np.column_stack([written["q"], written["u"]])
    Experiment("made", written["time"], table, ("q", "u"), ("1", "1")).save(folder / "good.npz")
    if importlib.util.find_spec("pyarrow"):
        import pyarrow as pa
        import pyarrow.parquet as pq

        pq.write_table(pa.table(written), folder / "good.parquet")
    if importlib.util.find_spec("h5py"):
        import h5py

        with h5py.File(folder / "good.h5", "w") as file:
            for name, column in written.items():
                file[name] = column
    if importlib.util.find_spec("rosbags"):
        _write_bags(folder)
    _write_recorders(folder)
    return {path.suffix: path.read_bytes() for path in folder.glob("good.*")}


def _write_bags(folder: Path) -> None:
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    one, two = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
    kind = "std_msgs/msg/Float64"
    with Writer1(folder / "good.bag") as old:
        topic = old.add_connection("/q", kind, typestore=one)
        for t, q in zip(columns()["time"], columns()["q"], strict=True):
            old.write(topic, int(1e9 + 1e9 * t), one.serialize_ros1(one.types[kind](data=float(q)), kind))
    for plugin, ending in ((StoragePlugin.MCAP, "mcap"), (StoragePlugin.SQLITE3, "db3")):
        whole = folder / f"bag_{ending}"
        with Writer(whole, version=9, storage_plugin=plugin) as new:
            sent = new.add_connection("/q", kind, typestore=two)
            for t, q in zip(columns()["time"], columns()["q"], strict=True):
                new.write(sent, int(1e9 + 1e9 * t), two.serialize_cdr(two.types[kind](data=float(q)), kind))
        next(whole.glob(f"*.{ending}")).rename(folder / f"good.{ending}")


def _write_recorders(folder: Path) -> None:
    written = columns()
    if importlib.util.find_spec("nptdms"):
        from nptdms import ChannelObject, TdmsWriter

        with TdmsWriter(folder / "good.tdms") as tdms:
            wave = {"wf_increment": 0.002, "wf_start_offset": 0.0}
            tdms.write_segment([ChannelObject("run", name, written[name], wave) for name in ("q", "u")])
    if importlib.util.find_spec("pyulog"):
        (folder / "good.ulg").write_bytes(_ulog())


def _ulog() -> bytes:
    """A topic of ``q`` and ``u`` (PX4 guide, "ULog file format": a message is its size, its type and its content)."""

    def message(kind: str, content: bytes) -> bytes:
        return struct.pack("<HB", len(content), ord(kind)) + content

    head = b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 0) + message("B", bytes(40))
    head += message("F", b"arm:uint64_t timestamp;double q;double u;") + message("A", struct.pack("<BH", 0, 0) + b"arm")
    rows = zip(*columns().values(), strict=True)
    return head + b"".join(message("D", struct.pack("<HQdd", 0, round(1e6 * t), q, u)) for t, q, u in rows)


@cache
def mdf(folder: Path) -> dict[str, bytes]:
    """An MDF file of each version: two groups with clocks of their own, units and conversions."""
    from asammdf import MDF, Signal

    written = columns()
    for version in ("4.10", "3.30"):
        with MDF(version=version) as file:
            file.append([Signal(written["q"], written["time"], name="q", unit="deg", conversion={"a": 2.0, "b": 1.0})])
            file.append([Signal(written["u"], written["time"], name="u", conversion={"formula": "2 * X"})])
            file.save(folder / f"mdf_{version[0]}", compression=2 if version == "4.10" else 0)
    return {path.suffix: path.read_bytes() for path in folder.glob("mdf_*")}


def _irregular(dice: Random) -> Any:
    return dice.choice(("error", "interpolate"))


def table(dice: Random, folder: Path) -> None:
    """A table of numbers: read, and a simulation along it."""
    rows, path = demo.TRAIN.read_text(encoding="utf-8").splitlines()[:ROWS], folder / "log.csv"
    path.write_bytes(damage.table("\n".join(rows), dice).encode("utf-8", "replace"))
    record = Experiment.load(path, model=arm(), irregular=_irregular(dice))
    finite("record", record.time, record.data)
    if dice.random() < 0.3:
        finite("run", simulate(arm(), record, dice.choice(("free_run", "inverse_dynamics", "restarts"))).values)


def octets(dice: Random, folder: Path) -> None:
    """A file of any format."""
    _damaged(dice, folder, sorted(files(folder)))


def recorders(dice: Random, folder: Path) -> None:
    """A TDMS or a ULog file."""
    _damaged(dice, folder, sorted({".tdms", ".ulg"} & set(files(folder))))


def _damaged(dice: Random, folder: Path, endings: list[str]) -> None:
    known = files(folder)
    ending = dice.choice(endings)
    path = folder / f"log{ending}"
    path.write_bytes(damage.octets(known[ending], dice))
    record = Experiment.load(path, irregular=_irregular(dice))
    finite("record", record.time, record.data)


def guarded(dice: Random, folder: Path) -> None:
    """An MDF file, whose reader is a process of its own: one of these costs as much as hundreds of other cases."""
    known = mdf(folder)
    ending = dice.choice(sorted(known))
    path = folder / f"log{ending}"
    path.write_bytes(damage.octets(known[ending], dice))
    record = Experiment.load(path, irregular=_irregular(dice))
    finite("record", record.time, record.data)


def channels(dice: Random, folder: Path) -> None:
    """A channel table, and what it makes of a good log."""
    files(folder)
    changed, path = damage.document(CHANNELS, dice), folder / "table.toml"
    try:
        text = tomli_w.dumps(changed)
    except (TypeError, ValueError):  # what no file can hold
        text = tomli_w.dumps(CHANNELS)
    path.write_bytes(damage.octets(text.encode(), dice) if dice.random() < 0.3 else text.encode())
    record = Experiment.load(folder / "good.csv", path, dice.choice((None, arm())), irregular=_irregular(dice))
    finite("record", record.time, record.data)


def checked(dice: Random, folder: Path) -> None:
    """A log with mistakes that somebody makes with units, signs and clocks, and its check."""
    rows, path = demo.TRAIN.read_text(encoding="utf-8").splitlines()[:400], folder / "log.csv"
    names, *numbers = (line.split(",") for line in rows)
    values = np.array(numbers, dtype=np.float64)
    for _ in range(dice.choice((1, 1, 2))):
        column, scale = (
            dice.randrange(len(names)),
            dice.choice((-1.0, 0.0, 1e-3, 1e3, math.pi / 180.0, 1e9, 1e-12, 1e155)),
        )
        begin = dice.choice((0, 0, 200))
        match dice.randrange(3):
            case 0:
                values[begin:, column] *= scale
            case 1:
                values[begin:, column] = dice.choice((0.0, 1.0, 1e308))
            case _:
                values[begin:, column] = np.roll(values[begin:, column], dice.randrange(1, 90))
    body = "\n".join(",".join(map(repr, row)) for row in values.tolist())
    path.write_text(f"{','.join(names)}\n{body}\n", encoding="utf-8")
    record = Experiment.load(path, model=arm(), irregular=_irregular(dice))
    found = check_log(arm(), record, settings=Settings(), workers=1)
    finite("log check", *found.shares.values())
    str(found)
