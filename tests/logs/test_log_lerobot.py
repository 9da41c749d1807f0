"""Data sets of LeRobot, in the layouts of versions 2.1 and 3.0, are campaigns of episodes."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vpm.errors import ExperimentError
from vpm.experiment import Campaign, Experiment
from vpm.experiment.readers import open_log
from vpm.model import ChannelEntry
from written_logs import needs

pytestmark = needs("pyarrow")

FPS = 50
LENGTHS = (40, 60, 30)
TABLE = {
    "time": ChannelEntry(column="timestamp", unit="s"),
    "axis.position": ChannelEntry(column="observation.state.shoulder", unit="deg"),
    "drive.command": ChannelEntry(column="action[0]", unit="A"),
}
#: As in ``meta/info.json`` of data sets on the hub: names are a list, or a table with one.
FEATURES = {
    "observation.state": {"dtype": "float32", "shape": [2], "names": {"motors": ["shoulder", "elbow"]}},
    "action": {"dtype": "float32", "shape": [2], "names": ["actions"]},
    "timestamp": {"dtype": "float32", "shape": [1], "names": None},
    "frame_index": {"dtype": "int64", "shape": [1], "names": None},
    "episode_index": {"dtype": "int64", "shape": [1], "names": None},
}


def episode(number: int) -> dict[str, Any]:
    frames = np.arange(LENGTHS[number])
    state = np.column_stack([10.0 * number + np.sin(0.1 * frames), frames]).astype(np.float32)
    return {
        "observation.state": state.tolist(),
        "action": (2.0 * state).tolist(),
        "timestamp": (frames / FPS).astype(np.float32),
        "frame_index": frames,
        "episode_index": np.full(frames.size, number),
        "note": ["x"] * frames.size,
    }


def write(folder: Path, version: str) -> Path:
    """Version 2.1 has a file for each episode, version 3.0 several in one; here the second file has the last."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    data = folder / "data" / "chunk-000"
    data.mkdir(parents=True)
    (folder / "meta").mkdir()
    if version == "v2.1":
        path, files = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet", [[0], [1], [2]]
        names = [f"episode_{number:06d}.parquet" for number in range(3)]
    else:
        path, files = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", [[0, 1], [2]]
        names = ["file-000.parquet", "file-001.parquet"]
    for name, numbers in zip(names, files, strict=True):
        pq.write_table(pa.concat_tables([pa.table(episode(number)) for number in numbers]), data / name)
    told = {"codebase_version": version, "fps": FPS, "total_episodes": 3, "data_path": path, "features": FEATURES}
    (folder / "meta" / "info.json").write_text(json.dumps(told), encoding="utf-8")
    return folder


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_episodes_are_records_of_a_campaign(tmp_path: Path, version: str) -> None:
    folder = write(tmp_path / "set", version)
    campaign = Campaign.load(folder, TABLE)
    assert campaign.names == ("episode_000000", "episode_000001", "episode_000002")
    for number, record in enumerate(campaign):
        frames = np.arange(LENGTHS[number])
        np.testing.assert_allclose(record.time, frames / FPS, rtol=1e-15)
        # numbers of single precision
        wanted = 10.0 * number + np.sin(0.1 * frames)
        np.testing.assert_allclose(record["axis.position"], np.deg2rad(wanted), rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(record["drive.command"], 2.0 * wanted, rtol=1e-6, atol=1e-6)
        assert "Stamps are those of frames at 50 Hz, to 0.0001 s." in record.history
    assert Experiment.load(folder / "episode_000001", TABLE) == campaign[1]
    log = open_log(folder / "episode_000002")
    assert log.header[:5] == ("time", "observation.state.shoulder", "observation.state.elbow", "action[0]", "action[1]")
    assert "note" in log.refused


def test_what_is_no_episode(tmp_path: Path) -> None:
    folder = write(tmp_path / "set", "v3.0")
    for path, column, words in (
        (
            folder,
            "observation.state[0]",
            r"is a data set of 3 episodes; load them by Campaign\.load, or one",
        ),
        (folder / "episode_000007", "observation.state[0]", r"set has no episode_000007; name one that it has"),
        (folder / "episode_000001", "observation.state[2]", r'has no column "observation\.state\[2\]"'),
        (folder / "episode_000001", "note", r'"note" for the channel "q" holds string, which is no number'),
        (folder / "episode_1x", "note", "does not exist"),
    ):
        table = {"time": TABLE["time"], "q": ChannelEntry(column=column, unit="1")}
        with pytest.raises(ExperimentError, match=words):
            Experiment.load(path, table)


@pytest.mark.parametrize("content", [b"", b"[]", b"{", b"\xff"])
def test_a_damaged_data_set(tmp_path: Path, content: bytes) -> None:
    folder = write(tmp_path / "set", "v2.1")
    (folder / "meta" / "info.json").write_bytes(content)
    with pytest.raises(ExperimentError, match=r"; (copy|check)") as caught:
        Experiment.load(folder / "episode_000001", TABLE)
    assert "\n" not in str(caught.value)
    for file in (folder / "data" / "chunk-000").iterdir():
        file.write_bytes(b"PAR1" + content)
    with pytest.raises(ExperimentError, match=r"cannot be read .*; check") as caught:
        Campaign.load(folder, TABLE)
    assert "\n" not in str(caught.value)


def test_a_description_without_names_numbers_the_components(tmp_path: Path) -> None:
    folder = write(tmp_path / "set", "v2.1")
    (folder / "meta" / "info.json").write_text('{"features": 1, "fps": "x"}', encoding="utf-8")
    assert "observation.state[1]" in open_log(folder / "episode_000001").header
