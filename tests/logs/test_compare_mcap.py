"""Comparisons as MCAP: read back by the library and by vpm they are what was compared."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from vpm import Experiment, Model, demo, simulate
from vpm.cli import app
from vpm.compare import compare, write_mcap
from vpm.errors import ExperimentError, MissingExtraError
from vpm.experiment.readers import open_log
from written_logs import needs


def leaves(layout: object) -> list[str]:
    return [layout] if isinstance(layout, str) else leaves(layout["first"]) + leaves(layout["second"])  # type: ignore[index]


@needs("mcap")
def test_what_is_written_is_what_was_compared(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    model = Model.load(demo.MODEL)
    gap = compare(simulate(model, Experiment.load(demo.TRAIN, model=model), "inverse_dynamics"), record(model))
    path, layout = write_mcap(gap, tmp_path / "gap.mcap")
    (each,) = gap.channels
    with path.open("rb") as stream:
        messages = list(make_reader(stream).iter_messages())
    assert len(messages) == each.time.size
    schema, channel, message = messages[7]
    assert (channel.topic, channel.message_encoding) == ("/shoulder/effort", "json")
    assert schema is not None
    assert (schema.encoding, schema.name) == ("jsonschema", "shoulder.effort")
    assert json.loads(message.data)["residual"] == each.residual[7]
    assert message.log_time == round(1e9 * each.time[7])
    # vpm takes it as a log, with the units of the channels.
    back = Experiment.load(path)
    np.testing.assert_allclose(back.time, each.time - each.time[0], atol=1e-9)
    for field, column in (("measured", each.measured), ("simulated", each.simulated), ("residual", each.residual)):
        np.testing.assert_array_equal(back[f"/shoulder/effort.{field}"], column)
        assert back.unit(f"/shoulder/effort.{field}") == each.unit
    # Every plot of the layout shows a field that is there.
    told = json.loads(layout.read_text(encoding="utf-8"))
    assert sorted(leaves(told["layout"])) == sorted(told["configById"])
    shown = [line["value"] for plot in told["configById"].values() for line in plot["paths"]]
    assert sorted(shown) == sorted(open_log(path).header[1:])
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(ExperimentError, match=r"gap\.mcap cannot be read"):
        Experiment.load(path)


def test_the_command(tmp_path: Path) -> None:
    pytest.importorskip("mcap")
    done = CliRunner().invoke(app, ["compare", str(demo.MODEL), str(demo.TRAIN), "--mcap", str(tmp_path / "gap.mcap")])
    assert done.exit_code == 0, done.output
    assert {file.name for file in tmp_path.iterdir()} == {"gap.mcap", "gap.layout.json"}


@needs("mcap")
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"[1]", "holds no messages with numbers"),
        (b"{", "cannot be read as an MCAP file of JSON"),
        (b'{"a": "x"}', "holds no messages with numbers"),
    ],
)
def test_messages_that_are_no_log(tmp_path: Path, content: bytes, words: str) -> None:
    from mcap.writer import Writer

    path = tmp_path / "x.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        topic = writer.register_channel("/x", "json", writer.register_schema("x", "jsonschema", b"{}"))
        writer.add_message(topic, 5, content, 5)
        writer.finish()  # type: ignore[no-untyped-call]  # the library types what it takes only
    with pytest.raises(ExperimentError, match=words) as caught:
        Experiment.load(path)
    assert "\n" not in str(caught.value)


def record(model: Model) -> Experiment:
    return Experiment.load(demo.TRAIN, model=model)


def test_the_library_is_named_with_its_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = Model.load(demo.MODEL)
    gap = compare(simulate(model, record(model), "inverse_dynamics"), record(model))
    for module in [m for m in sys.modules if m.partition(".")[0] == "mcap"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "mcap", None)
    with pytest.raises(MissingExtraError, match=r'mcap, .* pip install "vpm-dynamics\[mcap\]"'):
        write_mcap(gap, tmp_path / "gap.mcap")
