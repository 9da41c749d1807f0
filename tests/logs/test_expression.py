"""Expressions over columns: right numbers, checked units, and nothing that runs."""

from pathlib import Path

import numpy as np
import pytest

from vpm.errors import ExperimentError, ModelError, VpmError
from vpm.experiment import Experiment
from vpm.expression import Quantity, read_expression
from vpm.log_check.table import corrected_text, line_of
from vpm.model import ChannelEntry, load_channel_table
from vpm.units import parse_unit

X = np.linspace(0.1, 20.0, 200)
Y = 1.0 + np.cos(X)

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


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x - 2*y/4 + 1", X - 0.5 * Y + 1.0),
        ("-x**2 + pow(y, -1)", -X * X + 1.0 / Y),
        ("mean(x, y, 3)", (X + Y + 3.0) / 3.0),
        ("max(x, y) + min(x, y)", X + Y),
        ("hypot(3*x, 4*x)", 5.0 * X),
        ("unwrap(atan2(sin(x), cos(x)))", X),
        ("unwrap(x - 4*pi, 2*pi)", X - 4.0 * np.pi),
        ("log(exp(x/10))", X / 10.0),
    ],
)
def test_numbers(text: str, expected: np.ndarray) -> None:
    got = read_expression(text)({name: Quantity(column) for name, column in (("x", X), ("y", Y))})
    np.testing.assert_allclose(got.values, expected, rtol=1e-12, atol=1e-13)


def test_a_count_that_wraps_and_one_with_an_index() -> None:
    count = np.arange(-40.0, 400.0, 3.0)
    wrapped = read_expression("unwrap(n, 64)")({"n": Quantity(np.mod(count, 64.0))})
    np.testing.assert_array_equal(np.diff(wrapped.values), np.diff(count))
    pulse = np.isin(np.arange(count.size), (0, 1, 50, 51, 100)).astype(float)  # high at the beginning: no rise
    parts = {"n": Quantity(count), "z": Quantity(pulse)}
    np.testing.assert_array_equal(read_expression("zeroed(n, z)")(parts).values, count - count[50])
    with pytest.raises(VpmError, match=r'"zeroed\(n, n\)" has no index pulse in this record; record one'):
        read_expression("zeroed(n, n)")({"n": Quantity(np.ones(9))})


def test_kinds() -> None:
    force, length = parse_unit("N").dimension, parse_unit("m").dimension
    parts = {"f": Quantity(X, force), "s": Quantity(X, length)}
    for text, unit in (
        ("f*s", "J"),
        ("f/s**2", "Pa"),
        ("sqrt(s**3)", "m^1.5"),
        ("hypot(f, 2*f)", "N"),
        ("abs(s)", "mm"),
    ):
        assert read_expression(text)(parts).dimension == parse_unit(unit).dimension
    for text in ("f + s", "mean(f, s)", "sin(f)", "atan2(f, s)", "unwrap(s)", "f - 1"):
        with pytest.raises(VpmError, match=rf'"{text[:3]}.*takes .* together in ".*"; state the units'):
            read_expression(text)(parts)


@pytest.mark.parametrize(
    "text",
    [
        *("__import__('os').system('x')", "x.y", "x[0]", "[x]", "lambda: x", "x if x else 1", "'a'*x", "(y := x)"),
        *("9**9**9*x", "x**y", "x**1000", "x^2", "sin(x", "snn(x)", "mean(x)", "unwrap(x, x)", "mean(*x, y)", "True*x"),
        *("1", "", "\0", "1e999*x", "x" * 301),
    ],
)
def test_what_is_no_expression_is_one_sentence(text: str) -> None:
    with pytest.raises(VpmError) as caught:
        read_expression(text)(dict.fromkeys("xy", Quantity(X)))
    assert "; " in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "log.csv"
    rows = np.column_stack(list(COLUMNS.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(COLUMNS), comments="", fmt="%.17g")
    return path


def load(log: Path, *lines: str, time: str = 'column = "t", unit = "s"') -> Experiment:
    table = log.with_name("table.toml")
    table.write_text("\n".join([f"time = {{ {time} }}", *lines]), encoding="utf-8")
    return Experiment.load(log, table)


STAMP = (
    'value = "sec + ns", columns = {{ sec = {{ column = "{}", unit = "s" }}, ns = {{ column = "{}", unit = "ns" }} }}'
)


def test_a_clock_of_seconds_and_nanoseconds(tmp_path: Path) -> None:
    """A stamp of ROS 2 is a whole number of seconds since 1970, and the nanoseconds beyond."""
    log, nanoseconds = tmp_path / "stamps.csv", 1763980000_987654321 + np.arange(400, dtype=np.int64) * 4_000_000
    rows = np.column_stack([nanoseconds // 10**9, nanoseconds % 10**9, np.arange(400)])
    np.savetxt(log, rows, delimiter=",", header="stamp.sec,stamp.nanosec,position[0]", comments="", fmt="%d")
    stamp = STAMP.format("stamp.sec", "stamp.nanosec")
    record = load(log, 'q = { column = "position[0]", unit = "rad" }', time=f'{stamp}, unit = "s"')
    # Doubles of this size are 2.4e-7 s apart.
    np.testing.assert_allclose(record.time - record.time[0], 4e-3 * np.arange(400), atol=5e-7)
    np.testing.assert_array_equal(record["q"], np.arange(400.0))


def test_a_clock_of_several_columns_has_a_number_in_each_row(log: Path) -> None:
    names, *rows = (line.split(",") for line in log.read_text(encoding="utf-8").splitlines())
    for row in rows[::2]:
        row[names.index("s")] = ""
    log.write_text("\n".join(",".join(row) for row in (names, *rows)), encoding="utf-8")
    with pytest.raises(ExperimentError, match=r'column "s" has a clock of its own.*; map one column to time'):
        load(log, 's = { column = "s", unit = "1" }', time=f'{STAMP.format("t", "z")}, unit = "s"')


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
        ('value = "360 * n", columns = { n = "n" }, unit = "deg"', r"in rad or 1, .* give its columns the units"),
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
