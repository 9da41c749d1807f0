"""MDF files give the numbers that were written, or one sentence; their library works in a process of its own."""

import os
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from test_log_recorders import FAST, U, check_merged
from vpm.errors import ExperimentError
from vpm.experiment import Experiment
from vpm.experiment.readers import guarded, open_log
from vpm.experiment.readers.clocked import ClockedLog
from vpm.numbers import Array
from written_logs import COUNT, TIME, Q, check, needs, table

pytestmark = needs("asammdf")


@pytest.fixture
def direct(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reader in this process: a process for each of many good files would only take time."""
    monkeypatch.setattr(guarded, "GuardedLog", lambda path, reader: reader(path))


def write_mdf(path: Path, version: str = "4.10") -> Path:
    from asammdf import MDF, Signal

    states = {"val_0": 0, "text_0": "off", "val_1": 1, "text_1": "on"}
    bit = (np.arange(COUNT) % 2).astype(np.uint8)
    with MDF(version=version) as file:
        file.append([
            Signal(Q, TIME, name="q", unit="mm"),
            Signal(bit, TIME, name="ramp", unit="-", conversion={"a": 2.0, "b": 1.0}),
            Signal(bit, TIME, name="bent", conversion={"formula": "2 * X + sqrt(X + 4) / exp(0)"}),
            Signal(bit, TIME, name="state", conversion=states),
            Signal(np.array([b"slow"] * COUNT), TIME, name="note", encoding="utf-8"),
        ])  # fmt: skip
        file.append([Signal(U, FAST, name="u", unit="V"), Signal(U, FAST, name="twice")])
        file.append([Signal(Q, TIME, name="twice")])
        file.append([Signal(np.zeros(0), np.zeros(0), name="never")])
        return Path(file.save(path)).rename(path)  # which ending it takes depends on the version


@pytest.mark.usefixtures("direct")
@pytest.mark.parametrize(("version", "ending"), [("4.10", "mf4"), ("4.10", "mdf"), ("3.30", "mdf"), ("2.14", "mdf")])
def test_mdf(tmp_path: Path, version: str, ending: str) -> None:
    path = write_mdf(tmp_path / f"log.{ending}", version)
    for clock in ("time", "0.time"):
        record = Experiment.load(path, table(clock, "q"))
        check(record)
    assert 'The clock is that of "0".' in record.history
    assert "Read 60 rows" in record.history[0]
    log = open_log(path)
    assert log.header == ("time", "q", "ramp", "bent", "u", "1.twice", "2.twice")
    assert log.units == {"q": "mm", "u": "V"}
    ramp = Experiment.load(path, table("time", "q", ramp="ramp", bent="bent"))
    np.testing.assert_array_equal(ramp["ramp"], 1.0 + 2.0 * (np.arange(COUNT) % 2))
    ones = np.arange(COUNT) % 2
    np.testing.assert_allclose(ramp["bent"], 2.0 * ones + np.sqrt(ones + 4.0), rtol=1e-15)
    check_merged(path, table("time", "q", **{"drive.command": "u"}))
    for column, words in {
        "state": r'"state" for the channel "axis\.position" holds text; map a channel of numbers',
        "note": "holds text; map a channel of numbers",
        "never": "has no samples; record it, or do not map it",
        "twice": r'has no column "twice".*did you mean "[12]\.twice"',
        "1.time": r'"1\.time" is a clock and no channel; map it to time only',
    }.items():
        with pytest.raises(ExperimentError, match=words):
            Experiment.load(path, table("time", column))
    with pytest.raises(ExperimentError, match=r'"u" is a channel and no clock; map time to a clock: time, 0\.time'):
        Experiment.load(path, table("u", "q"))


@pytest.mark.usefixtures("direct")
def test_mdf_without_a_table_takes_units_from_the_file(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF() as file:
        signals = [Signal(Q, TIME, name="q", unit="mm"), Signal(Q, TIME, name="speed", unit="furlong")]
        file.append(signals)
        file.append([Signal(Q, TIME, name="r", unit="deg")])
        file.save(tmp_path / "log.mf4")
    record = Experiment.load(tmp_path / "log.mf4")
    assert (record.channels, record.units) == (("q", "speed", "r"), ("m", "1", "rad"))
    np.testing.assert_allclose(record["q"], 1e-3 * Q, rtol=1e-12)
    assert 'speed is column "speed", as it is, its unit is not stated.' in record.history


@pytest.mark.usefixtures("direct")
def test_mdf_samples_that_are_invalid_arrays_and_names_of_groups(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    path = tmp_path / "log.mf4"
    invalid = np.arange(COUNT) == 7
    matrix = np.rec.fromarrays([np.column_stack([Q, Q])], dtype=[("matrix", "(2,)<f8")])
    with MDF() as file:
        file.append([Signal(Q, TIME, name="q", invalidation_bits=invalid), Signal(Q, TIME, name="good")])
        file.append([Signal(matrix, TIME, name="matrix")])
        file.append([Signal(Q, TIME, name="good")], acq_name="arm")
        file.save(path)
    check(Experiment.load(path, table("time", "0.good")))
    check(Experiment.load(path, table("time", "arm.good")))
    with pytest.raises(ExperimentError, match=r'column "q" \(axis\.position\) is nan at t = 0\.07 s'):
        Experiment.load(path, table("time", "q"))
    with pytest.raises(ExperimentError, match=r'"matrix" .* is an array or a structure; record its elements'):
        Experiment.load(path, table("time", "matrix"))


@pytest.mark.usefixtures("direct")
@pytest.mark.parametrize("version", ["4.10", "3.30"])
def test_mdf_that_was_cut(tmp_path: Path, version: str) -> None:
    whole = write_mdf(tmp_path / "log.mdf", version).read_bytes()
    for share in (0.02, 0.3, 0.6, 0.95):
        (tmp_path / "cut.mdf").write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(ExperimentError, match=r"cut\.mdf cannot be read as an MDF file") as caught:
            Experiment.load(tmp_path / "cut.mdf", table("time", "q"))
        assert "\n" not in str(caught.value)


@pytest.mark.usefixtures("direct")
@pytest.mark.parametrize(("version", "count"), [("4.10", (80, "<Q")), ("3.30", (22, "<I"))])
def test_mdf_with_fewer_samples_than_it_promises(tmp_path: Path, version: str, count: tuple[int, str]) -> None:
    """As when a file that is written from its front is cut: the count of a channel group is made larger."""
    from asammdf import MDF, Signal

    with MDF(version=version) as file:
        file.append([Signal(Q, TIME, name="q")])
        path = Path(file.save(tmp_path / "log")).rename(tmp_path / "log.mdf")
    raw = bytearray(path.read_bytes())
    with path.open("rb") as stream, MDF(stream) as file:
        place = file.groups[0].channel_group.address + count[0]
    assert struct.unpack_from(count[1], raw, place) == (COUNT,)
    struct.pack_into(count[1], raw, place, 100_000)
    path.write_bytes(raw)
    with pytest.raises(ExperimentError, match=r'"q" should have 100000 samples, of which \d+ are there; check that'):
        Experiment.load(path, table("time", "q"))


@pytest.mark.usefixtures("direct")
def test_mdf_whose_recorder_was_stopped(tmp_path: Path) -> None:
    """Marked as unfinished, with the length of its last block of data to be completed (ASAM MDF 4.1, block ID)."""
    path = write_mdf(tmp_path / "log.mf4")
    raw = bytearray(path.read_bytes())
    raw[:8] = b"UnFinMF "
    struct.pack_into("<H", raw, 60, 1 << 2)
    path.write_bytes(raw)
    check(Experiment.load(path, table("time", "q")))
    assert path.read_bytes() == raw


# ---- what is no good file --------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("direct")
@pytest.mark.parametrize("version", ["4.10", "3.30"])
def test_a_formula_is_read_and_never_run(tmp_path: Path, version: str) -> None:
    from asammdf import MDF, Signal

    trap = "X + __import__('pathlib').Path('trap').touch()"
    with MDF(version=version) as file:
        file.append([Signal(Q, TIME, name="q", conversion={"formula": trap}), Signal(Q, TIME, name="good")])
        path = Path(file.save(tmp_path / "log")).rename(tmp_path / "log.mdf")
    check(Experiment.load(path, table("time", "good")))
    with pytest.raises(
        ExperimentError, match=r'"q" for .* is converted by a formula that is not known \(.*; record it'
    ):
        Experiment.load(path, table("time", "q"))
    assert not Path("trap").exists()


def test_a_reader_in_a_process_of_its_own(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = write_mdf(tmp_path / "log.mf4")
    log = open_log(path)
    assert isinstance(log, guarded.GuardedLog)
    assert (log.find("0.time"), log.find("q"), log.find("p")) == ("0.time", "q", None)
    check_merged(path, table("time", "q", **{"drive.command": "u"}))
    # The reader says what it would say here.
    with pytest.raises(ExperimentError, match=r'"note" for the channel "axis\.position" holds text') as caught:
        Experiment.load(path, table("time", "note"))
    assert (caught.value.path, caught.value.channel) == (str(path), "axis.position")
    del log, caught
    assert capfd.readouterr() == ("", "")


class Crashing(ClockedLog):
    """A reader whose library ends the process, or never ends, or takes all memory."""

    package, extra, kind = "numpy", "none", "a file"

    def __init__(self, path: str) -> None:
        what = Path(path).read_text(encoding="utf-8")
        if what == "abort":
            os.abort()
        if what == "exit":
            sys.exit(0)
        if what == "memory":
            np.ones(1 << 40)
        while what == "loop":
            pass
        time.sleep(1000.0)

    def times(self, group: str) -> Array:
        raise NotImplementedError

    def values(self, column: str) -> Array:
        raise NotImplementedError


@pytest.mark.skipif(sys.platform != "linux", reason="needs limits as Linux has them")
@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("abort", "its library ended with SIGABRT"),
        ("exit", "its library ended with code 0"),
        ("loop", "reading took more than 2 s of processor time, or 4 s by the clock"),
        ("sleep", "reading took more than 2 s of processor time, or 4 s by the clock"),
        ("memory", "memory|allocate"),
    ],
)
def test_a_library_that_ends_its_process_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str, words: str
) -> None:
    path = tmp_path / "x.log"
    path.write_text(what, encoding="utf-8")
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    monkeypatch.setattr(Crashing, "__module__", "test_log_mdf")
    if what in {"loop", "sleep"}:  # the others end by themselves, however long their libraries take to load
        monkeypatch.setattr(guarded, "START", 2.0)
        monkeypatch.setattr(guarded, "PATIENCE", 2.0)
    with pytest.raises(
        ExperimentError, match=rf"x\.log cannot be read .*({words}).*; check that it was closed"
    ) as caught:
        guarded.GuardedLog(path, Crashing)
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(sys.platform != "linux", reason="needs processes with limits as Linux has them")
@pytest.mark.parametrize("count", [3, pytest.param(400, marks=pytest.mark.nightly)])
def test_damaged_files_are_refused_or_give_finite_numbers(count: int) -> None:
    command = [sys.executable, "-m", "fuzz", str(count), "1", "guarded log"]
    done = subprocess.run(command, cwd=Path(__file__).parents[1], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
