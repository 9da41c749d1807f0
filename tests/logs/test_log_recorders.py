"""Logs of measurement systems: TDMS and ULog give the numbers that were written, or one sentence."""

import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vpm.errors import ExperimentError, MissingExtraError
from vpm.experiment import Experiment
from vpm.experiment.readers import open_log
from vpm.model import ChannelEntry
from written_logs import COUNT, TIME, Q, check, needs, table

FAST = 0.001 + 0.0025 * np.arange(4 * COUNT)
U = 2.0 * FAST
#: A cubic spline through samples h apart misses by at most 5/384 h^4 max|q''''| (Hall and Meyer, 1976), besides its
#: ends, where the error is that of the not-a-knot rule: within ten times as much.
SPLINE = 10.0 * 5.0 / 384.0 * 0.01**4 * 81.0


def check_merged(path: Path, mapped: dict[str, ChannelEntry], after: float = 0.0) -> None:
    """Columns of 100 and of 400 Hz come to the grid of the faster; ``after`` is when the clock of the file begins."""
    with pytest.raises(ExperimentError, match=r"samples on a clock of its own.*interpolate"):
        Experiment.load(path, mapped)
    record = Experiment.load(path, mapped, irregular="interpolate")
    assert record.rate == pytest.approx(400.0)
    time = record.time + after
    np.testing.assert_allclose(time[0], FAST[0], atol=1e-12)
    np.testing.assert_allclose(record["axis.position"], 1e-3 * np.sin(3.0 * time), atol=1e-3 * SPLINE)
    np.testing.assert_allclose(record["drive.command"], 2.0 * time, atol=1e-12)


# ---- TDMS ------------------------------------------------------------------------------------------------------------


def wave(step: float, unit: str = "", start: str = "", offset: float = 0.0) -> dict[str, Any]:
    told = {"unit_string": unit} if unit else {}
    dated = {"wf_start_time": np.datetime64(start, "us")} if start else {}
    return {"wf_increment": step, "wf_start_offset": offset, **told, **dated}


def write_tdms(path: Path) -> Path:
    from nptdms import ChannelObject, TdmsWriter

    stamps = np.datetime64("2024-05-01T10:00:00", "us") + np.round(1e6 * TIME).astype("timedelta64[us]")
    with TdmsWriter(path) as file:
        for part in (slice(0, 30), slice(30, COUNT)):
            file.write_segment([
                ChannelObject("run", "q", Q[part], wave(0.01, "mm", "2024-05-01T10:00:00")),
                ChannelObject("run", "seconds", TIME[part]),
                ChannelObject("run", "stamp", stamps[part]),
                ChannelObject("run", "note", ["slow"] * 30),
                ChannelObject("run", "phasor", 1j * Q[part]),
                ChannelObject("run", "never", np.zeros(0)),
            ])  # fmt: skip
        file.write_segment([ChannelObject("fast", "u", U, wave(0.0025, "V", "2024-05-01T10:00:00.001"))])
    return path


@needs("nptdms")
def test_tdms(tmp_path: Path) -> None:
    path = write_tdms(tmp_path / "log.tdms")
    for clock in ("time", "run/seconds", "run/stamp"):
        check(Experiment.load(path, table(clock, "run/q")))
    check(Experiment.load(path, table("run/stamp", "/run/q")))
    log = open_log(path)
    assert log.header == ("time", "run/q", "run/seconds", "run/stamp", "fast/u")
    assert log.units == {"run/q": "mm", "fast/u": "V"}
    # The fast channel begins a millisecond after the other.
    check_merged(path, table("time", "run/q", **{"drive.command": "fast/u"}))
    for clock, column, words in (
        ("time", "run/note", r'"run/note" for the channel "axis\.position" holds text, which is no real number'),
        ("time", "run/phasor", "holds complex128, which is no real number"),
        ("time", "run/never", "has no samples; record it, or do not map it"),
        ("time", "run/seconds", r'"run/seconds" has no wf_increment.*map time to a channel that holds the times'),
        ("run/stamp", "fast/u", r'"fast/u" has 240 values and the clock "run/stamp" 60; map channels'),
        ("run/stamp", "time", r'"time" is a clock and no channel'),
        ("time", "run/p", r'has no column "run/p"'),
    ):
        with pytest.raises(ExperimentError, match=words):
            Experiment.load(path, table(clock, column))


@needs("nptdms")
def test_tdms_without_a_table_takes_units_from_the_file(tmp_path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(tmp_path / "wave.tdms") as file:
        file.write_segment([ChannelObject("run", "q", Q, wave(0.01, "mm", offset=0.5))])
    record = Experiment.load(tmp_path / "wave.tdms")
    assert (record.channels, record.units) == (("run/q",), ("m",))
    np.testing.assert_allclose(record.time, 0.5 + TIME, atol=1e-12)
    np.testing.assert_allclose(record["run/q"], 1e-3 * Q, rtol=1e-12)
    with TdmsWriter(tmp_path / "plain.tdms") as file:
        file.write_segment([ChannelObject("run", "time", TIME), ChannelObject("run", "q", Q)])
    np.testing.assert_array_equal(Experiment.load(tmp_path / "plain.tdms")["run/q"], Q)


@needs("nptdms")
def test_tdms_that_was_cut(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """What was whole when the recorder stopped is there, and the history says that more was to come."""
    from nptdms import ChannelObject, TdmsWriter

    path = tmp_path / "log.tdms"
    sizes = []
    with TdmsWriter(path) as file:
        for part in (slice(0, 30), slice(30, COUNT)):
            file.write_segment([ChannelObject("run", "q", Q[part], wave(0.01))])
            sizes.append(path.stat().st_size)
    whole = path.read_bytes()
    path.write_bytes(whole[:-80])  # ten numbers less
    record = Experiment.load(path, table("time", "run/q"))
    np.testing.assert_allclose(record["axis.position"], 1e-3 * Q[:50], rtol=1e-12)
    assert any("ends in the middle of a segment" in sentence for sentence in record.history)
    assert capfd.readouterr().err == ""
    path.write_bytes(whole[:20])
    with pytest.raises(ExperimentError, match=r"log\.tdms (cannot be read as a TDMS file|has no channel of numbers)"):
        Experiment.load(path, table("time", "run/q"))


# ---- ULog ------------------------------------------------------------------------------------------------------------


def message(kind: str, content: bytes) -> bytes:
    """Message of a ULog file: size, type, content (PX4 guide, "ULog file format")."""
    return struct.pack("<HB", len(content), ord(kind)) + content


def ulog_head() -> bytes:
    """Header, flags, formats of two topics and of one that never comes, and three senders."""
    formats = (
        "state:uint64_t timestamp;double[2] q;bool on;char[4] note;",
        "drive:uint64_t timestamp;double u;",
        "never:uint64_t timestamp;float x;",
    )
    senders = ((0, 0, b"state"), (1, 1, b"state"), (0, 2, b"drive"))
    head = b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 5_000_000) + message("B", bytes(40))
    head += b"".join(message("F", text.encode()) for text in formats)
    return head + b"".join(message("A", struct.pack("<BH", multi, number) + name) for multi, number, name in senders)


def write_ulog(path: Path) -> Path:
    """The second sender of ``state`` has the sine at 100 Hz, ``drive`` a ramp at 400 Hz."""
    start = 5_000_000_000
    messages = []
    for t, q in zip(TIME, Q, strict=True):
        when = start + round(1e6 * t)
        for number, pair in ((0, (t, -q)), (1, (t, q))):
            messages.append((when, number, struct.pack("<QddB4s", when, *pair, 1, b"slow")))
    for t, u in zip(FAST, U, strict=True):
        when = start + round(1e6 * t)
        messages.append((when, 2, struct.pack("<Qd", when, u)))
    body = (message("D", struct.pack("<H", number) + content) for _, number, content in sorted(messages))
    path.write_bytes(ulog_head() + b"".join(body))
    return path


@needs("pyulog")
def test_ulog(tmp_path: Path) -> None:
    path = write_ulog(tmp_path / "log.ulg")
    for clock in ("time", "state.1.timestamp", "state.1", "state"):
        record = Experiment.load(path, table(clock, "state.1.q[1]"))
        check(record)
    check(Experiment.load(path, table("time", "state.q[1]")), -Q)
    assert "Times count from 5000.000000 s after the start of the autopilot." in record.history
    topic = ("q[0]", "q[1]", "on")
    log = open_log(path)
    assert log.header == ("time", "drive.u", *(f"state.{f}" for f in topic), *(f"state.1.{f}" for f in topic))
    check_merged(path, table("time", "state.1.q[1]", **{"drive.command": "drive.u"}))
    for column, words in {
        "never.x": r'"never" for the channel "axis\.position" has no messages; log this topic',
        "state.note[0]": "holds text; map a field of numbers",
        "state.q[2]": r'has no column "state\.q\[2\]".*did you mean',
        "drive.timestamp": "is a clock and no channel",
    }.items():
        with pytest.raises(ExperimentError, match=words):
            Experiment.load(path, table("time", column))


@needs("pyulog")
def test_ulog_that_is_cut_or_damaged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = write_ulog(tmp_path / "log.ulg").read_bytes()
    size = len(message("D", struct.pack("<HQd", 2, 0, 0.0)))
    path = tmp_path / "cut.ulg"
    path.write_bytes(whole[: -size // 2])  # in the middle of the last message, as when the power goes
    assert Experiment.load(path, table("drive", "drive.u")).time.size == 4 * COUNT - 1
    path.write_bytes(ulog_head())
    with pytest.raises(ExperimentError, match=r"cut\.ulg holds no messages with numbers; log its topics anew"):
        Experiment.load(path, table("time", "drive.u"))
    path.write_bytes(whole + message("D", struct.pack("<HQ", 77, 0)))  # of a sender that is not there
    record = Experiment.load(path, table("drive", "drive.u"))
    assert any("damaged in places" in sentence for sentence in record.history)
    assert capsys.readouterr().out == ""


# ---- files that are not what they say --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "package", "extra"),
    [
        ("x.mf4", "asammdf", "mdf"),
        ("x.tdms", "nptdms", "tdms"),
        ("x.ulg", "pyulog", "ulog"),
        ("x.parquet", "pyarrow", "parquet"),
        ("x.h5", "h5py", "hdf5"),
        ("x.mcap", "rosbags", "ros"),
    ],
)
def test_a_missing_library_is_named_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, package: str, extra: str
) -> None:
    for module in [m for m in sys.modules if m.partition(".")[0] == package]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, package, None)
    (tmp_path / name).touch()
    with pytest.raises(MissingExtraError, match=rf'(?i){package}, .* pip install "vpm-dynamics\[{extra}\]"'):
        Experiment.load(tmp_path / name)
