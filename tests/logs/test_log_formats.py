"""Logs as they come: every format gives the numbers that were written, and what cannot be read is one sentence."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from command_line import ran, vpm
from vpm.demo import MODEL, TRAIN
from vpm.errors import ExperimentError
from vpm.experiment import Experiment
from vpm.experiment.readers import guarded, open_log
from vpm.model import ChannelEntry, Model
from vpm.numbers import Array
from written_logs import COUNT, TIME, Q, check, needs, table

MATRIX = np.column_stack([np.cos(TIME), Q, TIME**2])


# ---- writers ---------------------------------------------------------------------------------------------------------


def write_parquet(path: Path, **columns: object) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table(columns), path)
    return path


def write_hdf5(path: Path) -> Path:
    import h5py

    with h5py.File(path, "w") as file:
        group = file.create_group("run")
        group["t"] = TIME
        group["q"] = Q
        group["q"].attrs["unit"] = "mm"
        group["column"] = Q[:, None]
        group["states"] = MATRIX
        group["wide"] = MATRIX.T
        group["short"] = Q[:-1]
        group["note"] = "slow run"
        group["cube"] = np.zeros((4, 4, 4))
        rows = np.zeros(COUNT, dtype=[("t", "f8"), ("q", "f4")])
        rows["t"], rows["q"] = TIME, Q
        group["rows"] = rows
    return path


def write_mat73(path: Path) -> Path:
    """As MATLAB 7.3 writes: a header block, arrays transposed, classes in attributes."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in {"t": TIME[None, :], "log/q": Q[None, :], "log/X": MATRIX.T}.items():
            file[name] = value
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
        file["text"] = np.array([[104], [105]], dtype=np.uint16)
        file["text"].attrs["MATLAB_class"] = np.bytes_("char")
        file.create_group("#refs#")["a"] = TIME
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + b" " * 8 + b"\x00\x02IM"
    with path.open("r+b") as raw:
        raw.write(header.ljust(512, b"\x00"))
    return path


class Bag:
    """Writes joint states at 100 Hz and torques at 400 Hz, jittered by up to 0.2 ms, to a bag."""

    def __init__(self, path: Path, *, ros1: bool = False, mcap: bool = False) -> None:
        from rosbags.rosbag1 import Writer as Writer1
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        self.ros1 = ros1
        self.store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
        plugin = StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
        self.writer = Writer1(path) if ros1 else Writer(path, version=9, storage_plugin=plugin)

    def header(self, stamp: int) -> Any:
        types = self.store.types
        time = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
        extra = {"seq": 0} if self.ros1 else {}
        return types["std_msgs/msg/Header"](stamp=time, frame_id="", **extra)

    def state(self, stamp: int, names: list[str], position: Array) -> object:
        empty = np.zeros(0)
        return self.store.types["sensor_msgs/msg/JointState"](
            header=self.header(stamp), name=names, position=position, velocity=empty, effort=empty
        )

    def send(self, topic: str, kind: str, messages: Sequence[tuple[int, object]]) -> None:
        connection = self.writer.add_connection(topic, kind, typestore=self.store)
        serialize = self.store.serialize_ros1 if self.ros1 else self.store.serialize_cdr
        for received, message in messages:
            self.writer.write(connection, received, serialize(message, kind))


START = 1_700_000_000_000_000_000
LATENCY = 3_000_000


def write_bag(path: Path, *, ros1: bool = False, mcap: bool = False, jitter: int = 0) -> Path:
    bag = Bag(path, ros1=ros1, mcap=mcap)
    rng = np.random.default_rng(4)
    stamps = [START + 10_000_000 * k + int(rng.integers(-jitter, jitter + 1)) for k in range(COUNT)]
    seconds = [(stamp - START) * 1e-9 for stamp in stamps]
    with bag.writer:
        states = []
        for k, (stamp, t) in enumerate(zip(stamps, seconds, strict=True)):
            names, place = ["elbow", "shoulder"], np.array([t, np.sin(3.0 * t)])
            if k % 2:  # the order of the joints is no promise
                names, place = names[::-1], place[::-1].copy()
            states.append((stamp + LATENCY, bag.state(stamp, names, place)))
        bag.send("/joint_states", "sensor_msgs/msg/JointState", states)
        torques = []
        for k in range(4 * COUNT):
            stamp = START + 2_500_000 * k + 1_000_000
            vector = bag.store.types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=2.0 * (stamp - START) * 1e-9)
            kind = bag.store.types["geometry_msgs/msg/Vector3Stamped"]
            torques.append((stamp + LATENCY, kind(header=bag.header(stamp), vector=vector)))
        bag.send("/torque", "geometry_msgs/msg/Vector3Stamped", torques)
    return path


# ---- the same numbers ------------------------------------------------------------------------------------------------


@needs("pyarrow")
def test_parquet(tmp_path: Path) -> None:
    path = write_parquet(tmp_path / "log.parquet", t=TIME, q=Q, label=["a"] * COUNT)
    record = Experiment.load(path, table("t", "q"))
    check(record)
    assert "Read 60 rows of log.parquet." in record.history
    with pytest.raises(ExperimentError, match=r'log\.parquet: "label" for the channel "axis\.position" holds string'):
        Experiment.load(path, table("t", "label"))
    with pytest.raises(ExperimentError, match=r'log\.parquet has no column "qq".* did you mean "q"'):
        Experiment.load(path, table("t", "qq"))
    plain = Experiment.load(write_parquet(tmp_path / "plain.pq", **{"time": TIME, "axis.position [mm]": Q}))
    check(plain)


@needs("pyarrow")
def test_parquet_stamps_structures_and_missing_values(tmp_path: Path) -> None:
    stamps = (np.datetime64("2024-05-01T10:00:00", "ns") + (1e9 * TIME).astype("timedelta64[ns]")).astype(
        "datetime64[ns]"
    )
    rows: list[dict[str, float | None]] = [{"q": float(q)} for q in Q]
    path = write_parquet(tmp_path / "log.parquet", stamp=stamps, state=rows)
    check(Experiment.load(path, table("stamp", "state.q")))
    wrong = {**table("stamp", "state.q"), "time": ChannelEntry(column="stamp", unit="ms")}
    with pytest.raises(ExperimentError, match=r'"stamp" holds stamps, which are read in seconds.* write unit = "s"'):
        Experiment.load(path, wrong)
    rows[7]["q"] = None
    hole = write_parquet(tmp_path / "hole.parquet", stamp=stamps, state=rows)
    with pytest.raises(ExperimentError, match=r'sample 7: column "state\.q" .* is nan at t = 0\.07 s'):
        Experiment.load(hole, table("stamp", "state.q"))


@needs("pandas")
def test_frames() -> None:
    import pandas as pd

    frame = pd.DataFrame({"t": TIME, "q": Q, "note": ["x"] * COUNT, "few": pd.array([1, None] * (COUNT // 2))})
    check(Experiment.from_frame(frame, table("t", "q")))
    clock = pd.Index(pd.Timestamp("2026-01-01 12:00") + pd.to_timedelta(TIME, unit="s"), name="clock")
    dated = pd.DataFrame({("arm", "q"): Q, ("arm", "spare"): Q}, index=clock)
    record = Experiment.from_frame(dated, table("clock", "arm.q"), name="day")
    check(record)
    assert (record.name, record.unused_columns) == ("day", ("arm.spare",))
    plain = Experiment.from_frame(pd.DataFrame({"time": TIME, "q [mm]": Q}))
    np.testing.assert_allclose(plain["q"], 1e-3 * Q)
    for wrong, words in (
        (table("t", "note"), '"note" for the channel "axis.position" holds .*, which is no number'),
        (table("t", "few"), r'column "few" \(axis.position\) is nan at t = 0.01 s, the first of 30'),
        (table("t", "Q"), 'frame has no column "Q" for the channel "axis.position"'),
    ):
        with pytest.raises(ExperimentError, match=words):
            Experiment.from_frame(frame, wrong)
    with pytest.raises(ExperimentError, match='two columns named "q"'):
        Experiment.from_frame(pd.concat([frame, frame[["q"]]], axis=1), table("t", "q"))


def test_what_is_no_frame_is_refused() -> None:
    with pytest.raises(ExperimentError, match="frame is a list without columns; give a data frame with named ones"):
        Experiment.from_frame([TIME, Q])  # type: ignore[arg-type]


def test_mat_up_to_version_7_2(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    savemat(
        path, {"t": TIME, "log": {"q": Q[:, None], "arm": {"X": MATRIX}}, "wide": MATRIX.T, "note": "slow", "k": 3.0}
    )
    check(Experiment.load(path, table("t", "log.q")))
    for column in ("log.arm.X[:, 1]", "log.arm.X.1", "wide[1, :]", "log.arm.X[ :,1 ]"):
        check(Experiment.load(path, table("t", column)))
    assert open_log(path).header == (
        "t", "log.q", "log.arm.X[:, 0]", "log.arm.X[:, 1]", "log.arm.X[:, 2]", "wide[0, :]", "wide[1, :]", "wide[2, :]"
    )  # fmt: skip
    for column, words in {
        "log.arm.X": r"is a matrix of 60 x 3; name one column of it, from log\.arm\.X\[:, 0\] to log\.arm\.X\[:, 2\]",
        "note": "holds text; name a variable of numbers",
        "k": "has the size a single number",
        "log.arm.X[:, 3]": r'has no column "log\.arm\.X\[:, 3\]".*did you mean',
        "log.w": r'has no column "log\.w".*did you mean "log\.q"',
    }.items():
        with pytest.raises(ExperimentError, match=words):
            Experiment.load(path, table("t", column))
    twice = table("t", "log.arm.X.1", **{"drive.command": "log.arm.X[:, 1]"})
    with pytest.raises(ExperimentError, match=r'is mapped to both "axis\.position" and "drive\.command"'):
        Experiment.load(path, twice)


@needs("h5py")
def test_mat_version_7_3(tmp_path: Path) -> None:
    path = write_mat73(tmp_path / "log.mat")
    for column in ("log.q", "log.X[:, 1]", "log.X.1"):
        check(Experiment.load(path, table("t", column)))
    with pytest.raises(ExperimentError, match=r'"text" .* holds char, which is no real number'):
        Experiment.load(path, table("t", "text"))


@needs("h5py")
def test_hdf5(tmp_path: Path) -> None:
    path = write_hdf5(tmp_path / "log.h5")
    for column in (
        "run/q",
        "/run/q",
        "run/column",
        "run/column[:, 0]",
        "run/states[:, 1]",
        "run/states.1",
        "run/wide[1, :]",
    ):
        check(Experiment.load(path, table("run/t", column)))
    single = Experiment.load(path, table("run/rows.t", "run/rows.q"))
    check(single, Q.astype(np.float32).astype(np.float64))
    for column, words in {
        "run/states": r"is a matrix of 60 x 3; name one column",
        "run/note": "holds object, which is no real number",
        "run/cube": "has the size 4 x 4 x 4; a column is a vector",
        "run/short": r'"run/short" has 59 values and the clock "run/t" 60',
        "run/p": r'has no column "run/p"',
    }.items():
        with pytest.raises(ExperimentError, match=words):
            Experiment.load(path, table("run/t", column))


@needs("h5py")
def test_hdf5_without_a_table_takes_units_from_the_file(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["run/time"], file["run/q"] = TIME, Q
        file["run/q"].attrs["units"] = "mm"
    record = Experiment.load(tmp_path / "log.h5")
    assert (record.channels, record.units) == (("run/q",), ("m",))
    np.testing.assert_allclose(record["run/q"], 1e-3 * Q)


BAGS: dict[str, Callable[[Path], Path]] = {
    "ros1.bag": lambda path: write_bag(path, ros1=True),
    "ros2": write_bag,
    "mcap": lambda path: next(write_bag(path, mcap=True).glob("*.mcap")),
    "db3": lambda path: next(write_bag(path).glob("*.db3")),
}


@needs("rosbags")
@pytest.mark.parametrize("kind", BAGS)
def test_bags(tmp_path: Path, kind: str) -> None:
    path = BAGS[kind](tmp_path / kind)
    for column in ("/joint_states.position[shoulder]", "joint_states.position[1]"):
        for clock in ("time", "/joint_states", "/joint_states.header.stamp", "/joint_states.time"):
            record = Experiment.load(path, table(clock, column))
            check(record)
    assert "/torque.vector.z" in record.unused_columns
    how = "The clock is when messages of /joint_states were recorded; it counts from 1700000000.003000000 s"
    assert any(how in sentence for sentence in record.history)


@needs("rosbags")
def test_topics_with_clocks_of_their_own_come_to_one_grid(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag", jitter=200_000)
    mapped = table("/torque", "/joint_states.position[shoulder]", **{"drive.command": "/torque.vector.z"})
    with pytest.raises(ExperimentError, match=r'"axis\.position" has 60 samples on a clock of its own.*interpolate'):
        Experiment.load(path, mapped)
    record = Experiment.load(path, mapped, irregular="interpolate")
    assert record.rate == pytest.approx(400.0)
    true_time = record.time + 0.001  # the first torque is stamped a millisecond after the start
    assert true_time[0] >= 0.0
    # A cubic spline through samples h apart misses by at most 5/384 h^4 max|q''''| (Hall and Meyer, 1976), besides
    # its ends, where the error is that of the not-a-knot rule: within ten times as much.
    bound = 10.0 * 5.0 / 384.0 * 0.0104**4 * 81.0
    np.testing.assert_allclose(record["axis.position"], 1e-3 * np.sin(3.0 * true_time), atol=1e-3 * bound)
    np.testing.assert_allclose(record["drive.command"], 2.0 * true_time, atol=1e-12)
    assert any("axis.position came every 0.01" in s and "cubic splines" in s for s in record.history)
    slow = {**mapped, "time": ChannelEntry(column="/joint_states", unit="s")}
    filtered = Experiment.load(path, slow, irregular="interpolate")
    assert filtered.rate == pytest.approx(100.0, rel=0.01)
    assert any(
        re.search(r"drive\.command came every 0\.0025.* behind a filter at (39|40)", s) for s in filtered.history
    )


@needs("rosbags")
def test_what_is_wrong_in_a_bag(tmp_path: Path) -> None:
    bag = Bag(tmp_path / "bag")
    with bag.writer:
        states = [
            (
                START + 10_000_000 * k,
                bag.state(START + 10_000_000 * (k if k != 20 else 19), ["a"], np.array([float(k)])),
            )
            for k in range(COUNT)
        ]
        bag.send("/joint_states", "sensor_msgs/msg/JointState", states)
        bag.send("/empty", "sensor_msgs/msg/JointState", [])
    with pytest.raises(ExperimentError, match=r'"/empty" for the channel "axis\.position" has no messages; record it'):
        Experiment.load(tmp_path / "bag", table("time", "/empty.position[0]"))
    with pytest.raises(ExperimentError, match=r'"/joint_states\.header\.stamp" is a clock and no channel'):
        Experiment.load(tmp_path / "bag", table("/joint_states.time", "/joint_states.header.stamp"))
    with pytest.raises(
        ExperimentError, match=r"message 20 of /joint_states does not lie after.*map time to /joint_states\.time"
    ):
        Experiment.load(tmp_path / "bag", table("time", "/joint_states.position[0]"))
    Experiment.load(tmp_path / "bag", table("/joint_states.time", "/joint_states.position[0]"))
    with pytest.raises(ExperimentError, match=r'did you mean "/joint_states\.position\[a\]"'):
        Experiment.load(tmp_path / "bag", table("time", "/joint_states.position[b]"))
    with pytest.raises(
        ExperimentError, match=r'"/joint_states\.position\[a\]" is no clock; map time to /joint_states\.header'
    ):
        Experiment.load(tmp_path / "bag", {"time": ChannelEntry(column="/joint_states.position[0]", unit="s")})


# ---- files that are not what they say --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "package"),
    [
        ("x.parquet", "pyarrow"),
        ("x.mat", "scipy"),
        ("x.h5", "h5py"),
        ("x.bag", "rosbags"),
        ("x.mcap", "rosbags"),
        ("x.db3", "rosbags"),
        ("x.mf4", "asammdf"),
        ("x.tdms", "nptdms"),
        ("x.ulg", "pyulog"),
    ],
)
@pytest.mark.parametrize("content", [b"", b"time,q\n0,1\n", bytes(range(256)) * 8])
def test_a_file_that_is_not_what_its_ending_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, package: str, content: bytes
) -> None:
    pytest.importorskip(package)
    monkeypatch.setattr(guarded, "GuardedLog", lambda path, reader: reader(path))  # in this process, which is quicker
    path = tmp_path / name
    with pytest.raises(ExperimentError, match="does not exist; check the name"):
        Experiment.load(path)
    path.write_bytes(content)
    with pytest.raises(ExperimentError, match=rf"{name} cannot be read as an? .*; ") as caught:
        Experiment.load(path)
    assert caught.value.path == str(path)
    assert "\n" not in str(caught.value)


# ---- on the command line ---------------------------------------------------------------------------------------------


@needs("rosbags")
def test_a_bag_is_identified_from_the_command_line(tmp_path: Path) -> None:
    model = Model.load(MODEL)
    log = Experiment.load(TRAIN, model=model).trim(0.0, 2.0)
    bag = Bag(tmp_path / "bag", mcap=True)
    double = bag.store.types["std_msgs/msg/Float64"]
    lines = ['time = { column = "time", unit = "s" }']
    with bag.writer:
        for at, channel in enumerate(log.channels):
            shift = 0 if at == 0 else 200_000  # each topic has a clock of its own
            stamps = [START + round(1e9 * (t - log.time[0])) + shift for t in log.time]
            messages = [(stamp, double(data=float(x))) for stamp, x in zip(stamps, log[channel], strict=True)]
            bag.send(f"/topic_{at}", "std_msgs/msg/Float64", messages)
            lines.append(f'"{channel}" = {{ column = "/topic_{at}.data", unit = "{log.unit(channel)}" }}')
    (tmp_path / "channels.toml").write_text("\n".join(lines), encoding="utf-8")
    command = ["compare", str(MODEL), str(tmp_path / "bag"), "--channels", str(tmp_path / "channels.toml")]
    assert vpm(*command).returncode == 1
    ran(*command, "--interpolate")


@needs("rosbags")
def test_joints_of_two_senders_on_one_topic(tmp_path: Path) -> None:
    """An arm and a gripper publish in turn; each joint is read from the messages that hold it."""
    bag = Bag(tmp_path / "bag")
    with bag.writer:
        messages = []
        for k, t in enumerate(TIME):
            stamp = START + 10_000_000 * k
            messages.append((stamp, bag.state(stamp, ["shoulder"], np.array([np.sin(3.0 * t)]))))
            late = stamp + 5_000_000
            messages.append((late, bag.state(late, ["finger"], np.array([t + 0.005]))))
        bag.send("/joint_states", "sensor_msgs/msg/JointState", messages)
    check(Experiment.load(tmp_path / "bag", table("time", "/joint_states.position[shoulder]")))
