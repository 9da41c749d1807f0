"""Channels that are built from several columns of a log."""

from pathlib import Path

import numpy as np
import pytest

from vpm.errors import ExperimentError, ModelError
from vpm.experiment import Experiment
from vpm.log_check.table import corrected_text, line_of
from vpm.model import ChannelEntry, load_channel_table

TIME = 0.01 * np.arange(400)
ANGLE = 4.0 * TIME
COUNT = np.floor(ANGLE / (2.0 * np.pi) * 4096.0) + 1000.0
COLUMNS = {
    "t": TIME,
    "F_l": 3.0 + TIME,
    "F_r": 0.001 * TIME**2,
    "s": np.sin(ANGLE),
    "c": np.cos(ANGLE),
    "n": np.mod(COUNT, 4096.0),
    "one": np.ones(TIME.size),
    "z": (np.mod(COUNT, 4096.0) < 200.0).astype(float),
}
FORCES = 'columns = { a = { column = "F_l", unit = "N" }, b = { column = "F_r", unit = "kN" } }'


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "log.csv"
    rows = np.column_stack(list(COLUMNS.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(COLUMNS), comments="", fmt="%.17g")
    return path


def load(log: Path, *lines: str) -> Experiment:
    table = log.with_name("table.toml")
    table.write_text("\n".join(['time = { column = "t", unit = "s" }', *lines]), encoding="utf-8")
    return Experiment.load(log, table)


def test_values_over_columns(log: Path) -> None:
    record = load(
        log,
        f'difference = {{ value = "a - b", {FORCES}, unit = "N", scale = 2.0, offset = 1.0 }}',
        f'mean = {{ value = "mean(a, b)", {FORCES}, unit = "kN" }}',
        'angle = { value = "unwrap(atan2(s, c))", columns = { s = "s", c = "c" }, unit = "rad" }',
        'shaft = { value = "2*pi * zeroed(unwrap(n, 4096), z) / 4096", columns = { n = "n", z = "z" }, unit = "rad" }',
        'none = { value = "a - z", columns = { a = "F_l", z = "absent" }, unit = "1", optional = true }',
    )
    left, right = COLUMNS["F_l"], 1e3 * COLUMNS["F_r"]
    np.testing.assert_allclose(record["difference"], 2.0 * (left - right) + 1.0, rtol=1e-12)
    np.testing.assert_allclose(record["mean"], 0.5 * (left + right), rtol=1e-12)
    np.testing.assert_allclose(record["angle"], ANGLE, atol=1e-12)
    begin = int(np.flatnonzero(np.diff(COLUMNS["z"]) > 0.0)[0]) + 1
    np.testing.assert_allclose(record["shaft"], 2.0 * np.pi * (COUNT - COUNT[begin]) / 4096.0, rtol=1e-12)
    assert not record["none"].any()
    assert (record.unit("mean"), record.unit("angle")) == ("N", "rad")
    assert record.unused_columns == ("one",)
    assert any(
        'mean is value "mean(a, b)" of column "F_l" in N and column "F_r" in kN, converted from kN to N.' in sentence
        for sentence in record.history
    )


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (f'value = "a * b", {FORCES}, unit = "N"', r'channel x: "a \* b" is in kg\^2 m\^2/s\^4, but its unit is N'),
        ('value = "360 * n", columns = { n = "n" }, unit = "deg"', r'comes out in rad or 1, .* write unit = "rad"'),
        ('value = "a + n", columns = { a = { column = "F_l", unit = "N" }, n = "n" }, unit = "N"', "takes .* together"),
        ('value = "a - q", columns = { a = "F_l", q = "F_q" }, unit = "1"', r'has no column "F_q" for the channel "x"'),
        ('value = "zeroed(n, s)", columns = { n = "n", s = "one" }, unit = "1"', "has no index pulse in this record"),
    ],
)
def test_what_does_not_fit_the_log(log: Path, line: str, words: str) -> None:
    with pytest.raises(ExperimentError, match=words) as caught:
        load(log, f"x = {{ {line} }}")
    assert caught.value.channel == "x"
    assert "; " in str(caught.value)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('x = { unit = "N" }', "needs either a column, or a value over columns; give one"),
        (f'x = {{ column = "F_l", value = "a - b", {FORCES}, unit = "N" }}', "needs either a column, or a value"),
        (f'x = {{ value = "a", {FORCES}, unit = "N" }}', r"has columns\.b, which its value .* leave it out"),
        (f'x = {{ value = "a - b - d", {FORCES}, unit = "N" }}', "but columns has no d; name its column"),
        (f'x = {{ value = "a.real - b", {FORCES}, unit = "N" }}', r'has "a\.real", which is not known; use'),
        ('x = { value = "a", columns = { a = { column = "F_l", unit = "furlong" } }, unit = "N" }', "furlong"),
    ],
)
def test_a_table_that_cannot_be_right(log: Path, line: str, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        load(log, line)


def test_an_entry_is_written_as_it_was_read(tmp_path: Path) -> None:
    line = f'"x.y" = {{ value = "a - b", {FORCES}, unit = "N", scale = -1.0 }}'
    path = tmp_path / "table.toml"
    path.write_text(f"{line}\n", encoding="utf-8")
    entry: ChannelEntry = load_channel_table(path)["x.y"]
    assert line_of("x.y", entry) == line
    other = line_of("x.y", entry.model_copy(update={"scale": 1.0}))
    assert corrected_text(f"# mine\n{line}  # yes\n", {"x.y": other}, path) == f"# mine\n{other}  # yes\n"
