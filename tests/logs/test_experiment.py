"""Records: what is read, what is done to it, what is written down about that, and what is refused."""

import time as stopwatch
from dataclasses import FrozenInstanceError
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from vpm.errors import ExperimentError, ModelError, UnitError
from vpm.experiment import (
    Experiment,
    Motion,
    choose_cutoff,
    common_cutoff,
    drawn_noise,
    instrument_noise,
    motion,
    read_noise,
)
from vpm.model import ChannelEntry, Model, load_channel_table
from vpm.numbers import Array

Irregular = Literal["error", "interpolate"]

TABLE = {
    "time": ChannelEntry(column="t", unit="ms"),
    "axis.position": ChannelEntry(column="q", unit="mm"),
    "drive.command": ChannelEntry(column="u", unit="V"),
}


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def log(folder: Path, rows: list[str] | None = None, header: str = "t,q,u", count: int = 12) -> Path:
    """A small log: ten milliseconds apart, a millimetre per sample."""
    lines = [f"{10 * k},{k},{0.5 * k}" for k in range(count)] if rows is None else rows
    return write(folder / "log.csv", "\n".join([header, *lines]) + "\n")


def changed(line: int, text: str, count: int = 12) -> list[str]:
    """The rows of the small log with one line of the file replaced."""
    rows = [f"{10 * k},{k},{0.5 * k}" for k in range(count)]
    rows[line - 2] = text
    return rows


def record(samples: int = 400, rate: float = 100.0) -> Experiment:
    time = np.arange(samples) / rate
    values = {"axis.position": np.sin(3 * time), "drive.command": np.sign(np.sin(5 * time))}
    return Experiment.from_arrays(time, values, {"axis.position": "m", "drive.command": "V"}, "small")


# ---- reading ---------------------------------------------------------------------------------------------------------


def test_a_log_is_mapped_scaled_and_converted(tmp_path: Path) -> None:
    table = {**TABLE, "axis.position": ChannelEntry(column="q", unit="mm", scale=2.0, offset=5.0)}
    exp = Experiment.load(log(tmp_path), table)
    assert exp.name == "log"
    assert exp.channels == ("axis.position", "drive.command")
    assert exp.units == ("m", "V")
    np.testing.assert_allclose(exp["axis.position"], 1e-3 * (2.0 * np.arange(12) + 5.0))
    np.testing.assert_allclose(exp.time, 0.01 * np.arange(12))
    assert (len(exp), exp.duration) == (12, 0.11)
    assert (exp.dt, exp.rate) == pytest.approx((0.01, 100.0))
    assert list(exp) == ["axis.position", "drive.command"]
    assert "drive.command" in exp
    assert "axis.velocity" not in exp
    assert any("times 2, plus 5 mm, converted from mm to m" in sentence for sentence in exp.history)


def test_unused_columns_are_named_and_may_hold_anything(tmp_path: Path) -> None:
    rows = [f"{10 * k},{k},running,{0.5 * k}" for k in range(12)]
    exp = Experiment.load(log(tmp_path, rows, "t,q,state,u"), TABLE)
    assert exp.unused_columns == ("state",)
    assert "state" in repr(exp)
    assert "state" in exp._repr_html_()


def test_an_optional_column_that_is_missing_is_zero_and_said_so(tmp_path: Path) -> None:
    table = {**TABLE, "drive.disturbance": ChannelEntry(column="pulse", unit="V", optional=True)}
    exp = Experiment.load(log(tmp_path), table)
    np.testing.assert_array_equal(exp["drive.disturbance"], 0.0)
    assert any('drive.disturbance is zero, because the file has no column "pulse"' in s for s in exp.history)


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_delimiters_and_line_ends(tmp_path: Path, delimiter: str, newline: str) -> None:
    rows = [delimiter.join(map(str, (10 * k, k, -k))) for k in range(12)]
    path = tmp_path / "log.csv"
    path.write_bytes(("\ufeff" + newline.join([delimiter.join(['"t"', " q", "u "]), *rows])).encode())
    exp = Experiment.load(path, TABLE)
    np.testing.assert_allclose(exp["drive.command"], -np.arange(12))


ROWS = [(10 * k, 0.5 * k, -k) for k in range(12)]


@pytest.mark.parametrize(
    ("above", "separator"),
    [
        ("# made by a logger\n#\n\nt,q,u\n", ","),
        ("# t,q,u\n", ","),
        ("% made by a logger\n% t q u\n", " "),
        ("t q  u\n", "  "),
        ("t|q|u\n", "|"),
        ("// a log\nt;q;u\n[ms];(mm);V\n", ";"),
        ("; a log\nt;q;u\nms;mm;V\n", ";"),
        ("t\tq\tu\n\nms\tmm\t-\n\n", "\t"),
    ],
)
@pytest.mark.parametrize("comma", [False, True])
def test_dialects(tmp_path: Path, above: str, separator: str, comma: bool) -> None:
    body = "\n".join(separator.join(map(str, row)) for row in ROWS)
    if comma and separator != ",":
        body = body.replace(".", ",")
    exp = Experiment.load(write(tmp_path / "log.csv", above + body + "\n"), TABLE)
    np.testing.assert_allclose(exp["axis.position"], 0.5e-3 * np.arange(12))
    np.testing.assert_allclose(exp["drive.command"], -np.arange(12))


@pytest.mark.parametrize(
    ("separator", "thousands", "decimal"),
    [(";", ".", ","), (";", ",", "."), ("\t", "'", "."), (";", "\u202f", ","), (";", " ", ","), (",", ",", ".")],
)
def test_marks_between_thousands_are_no_decimal_marks(
    tmp_path: Path, separator: str, thousands: str, decimal: str
) -> None:
    """Programs of controllers write 1.234,5 or 1,234.5 by the language of their computer, in quotes where needed."""

    def cell(value: float, digits: int) -> str:
        text = f"{value:,.{digits}f}".translate({ord(","): thousands, ord("."): decimal})
        return f'"{text}"' if separator in text else text

    rows = [separator.join((cell(250 * k, 0), cell(987.125 * k, 3), cell(-1.5 * k, 1))) for k in range(12)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([f"t{separator}q{separator}u", *rows]), encoding="utf-8")
    exp = Experiment.load(path, TABLE)
    assert exp.rate == pytest.approx(4.0)
    np.testing.assert_allclose(exp["axis.position"], 0.987125 * np.arange(12), rtol=1e-12)
    np.testing.assert_allclose(exp["drive.command"], -1.5 * np.arange(12))


def test_numpys_own_text_is_read(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "log.txt", ROWS, header="t q u")
    np.testing.assert_allclose(Experiment.load(tmp_path / "log.txt", TABLE)["axis.position"], 0.5e-3 * np.arange(12))


@pytest.mark.parametrize("row", ["s;inc;A", ";Inkr;A", "[s];-;[A]", ";;A"])
def test_words_that_are_no_units_stand_in_a_row_of_units(tmp_path: Path, row: str) -> None:
    """As loggers of counters write them; the table says what a count is."""
    path = tmp_path / "run.csv"
    rows = "".join(f"1000,{number:03};{4096 * number};-0,5\n" for number in range(12))
    path.write_text(f"Zeit;Zaehler;Strom\n{row}\n{rows}")
    turns = ChannelEntry(column="Zaehler", unit="rev", scale=1.0 / 4096.0)
    table = {"time": ChannelEntry(column="Zeit", unit="s"), "axis.position": turns}
    log = Experiment.load(path, channels=table)
    np.testing.assert_allclose(log["axis.position"], 2.0 * np.pi * np.arange(12.0))


@pytest.mark.parametrize("row", ["none;off;text", "2026-03-14;inc;A", "s;inc;2,5A", "s;nan;A"])
def test_other_rows_below_the_names_are_no_units(tmp_path: Path, row: str) -> None:
    path = tmp_path / "run.csv"
    rows = "".join(f"0,{number:03};1;-0,5\n" for number in range(12))
    path.write_text(f"time;q;i\n{row}\n{rows}")
    with pytest.raises(ExperimentError, match="line 2"):
        Experiment.load(
            path, channels={"time": ChannelEntry(column="time", unit="s"), "q": ChannelEntry(column="q", unit="rad")}
        )


def test_a_row_of_units_is_that_of_a_log_without_a_table(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = ["time;angle;Strom", "ms;°;mA", *(f"{10 * k};{k},5;{k}" for k in range(12))]
    path.write_bytes("\r\n".join(rows).encode("latin-1"))
    exp = Experiment.load(path)
    assert exp.units == ("rad", "A")
    np.testing.assert_allclose(exp["angle"], np.deg2rad(np.arange(12) + 0.5))
    assert exp.rate == pytest.approx(100.0)


def test_lines_are_those_of_the_file_in_every_dialect(tmp_path: Path) -> None:
    rows = [f"{10 * k} {k},5 0" for k in range(12)]
    rows[4] = "40 4,x 0"
    path = write(tmp_path / "log.txt", "# a\n\n# t q u\n\n" + "\n".join(rows))
    with pytest.raises(ExperimentError, match=r'line 9: "4,x" in column "q" is no number'):
        Experiment.load(path, TABLE)


def test_without_a_table_columns_are_channels(tmp_path: Path) -> None:
    rows = [f"{10 * k},{k},{0.5 * k}" for k in range(12)]
    exp = Experiment.load(log(tmp_path, rows, "time [ms],q [deg],u"))
    assert exp.channels == ("q", "u")
    assert exp.units == ("rad", "1")
    np.testing.assert_allclose(exp["q"], np.deg2rad(np.arange(12)))
    assert exp.rate == pytest.approx(100.0)
    assert any("its unit is not stated" in sentence for sentence in exp.history)


def test_the_table_comes_from_the_model_from_a_file_or_from_a_mapping(tmp_path: Path, emps: Model) -> None:
    rows = [f"{0.001 * k},{0.1 * k},{k},{0.2 * k}" for k in range(12)]
    path = log(tmp_path, rows, "time_s,q_m,u_V,qref_m")
    by_model = Experiment.load(path, model=emps)
    text = (
        'time = { column = "time_s", unit = "s" }\n"axis.position" = { column = "q_m", unit = "m" }\n'
        '"drive.command" = { column = "u_V", unit = "V" }\n'
    )
    table = write(tmp_path / "channels.toml", text)
    by_file = Experiment.load(path, table)
    assert by_file == Experiment.load(path, load_channel_table(table), emps)
    assert set(by_file.channels) < set(by_model.channels)
    np.testing.assert_array_equal(by_file["axis.position"], by_model["axis.position"])


def test_a_lagging_channel_is_moved_back(tmp_path: Path) -> None:
    time = np.arange(200) * 10.0
    late = np.sin(2 * (time - 23.0) / 1000)
    rows = [f"{t},{q:.12f},{t}" for t, q in zip(time, late, strict=True)]
    table = {**TABLE, "axis.position": ChannelEntry(column="q", unit="m", delay=0.023)}
    exp = Experiment.load(log(tmp_path, rows), table)
    assert len(exp) == 197
    np.testing.assert_allclose(exp["axis.position"], np.sin(2 * exp.time), atol=1e-7)
    np.testing.assert_allclose(exp["drive.command"], 1000 * exp.time, atol=1e-9)
    assert any("axis.position by 0.023 s; 3 samples at the ends" in sentence for sentence in exp.history)


@given(st.floats(-0.05, 0.05).filter(lambda d: abs(d) > 1e-6))
def test_align_undoes_a_delay_of_either_sign(delay: float) -> None:
    time = np.arange(300) * 0.01
    exp = Experiment.from_arrays(time, {"a.position": np.sin(2 * (time - delay)), "b.position": np.cos(time)})
    moved = exp.align({"a.position": delay})
    np.testing.assert_allclose(moved["a.position"], np.sin(2 * moved.time), atol=1e-6)
    np.testing.assert_array_equal(moved["b.position"], np.cos(moved.time))


@settings(max_examples=30)
@given(
    hnp.arrays(np.float64, (15, 2), elements=st.floats(-1e6, 1e6)),
    st.floats(0.01, 100.0),
    st.floats(-100.0, 100.0),
)
def test_scale_and_offset_are_the_stated_law(values: Array, scale: float, offset: float) -> None:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        rows = [f"{10 * k},{q!r},{u!r}" for k, (q, u) in enumerate(values.tolist())]
        table = {**TABLE, "axis.position": ChannelEntry(column="q", unit="mm", scale=scale, offset=offset)}
        exp = Experiment.load(log(Path(folder), rows), table)
    np.testing.assert_allclose(exp["axis.position"], 1e-3 * (values[:, 0] * scale + offset), rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(exp["drive.command"], values[:, 1])


@given(hnp.arrays(np.float64, (12, 2), elements=st.floats(-1e12, 1e12)))
def test_saved_records_come_back_exactly(values: Array) -> None:
    import tempfile

    exp = Experiment.from_arrays(np.arange(12) * 0.1, {"a": values[:, 0], "b": values[:, 1]}, {"a": "m"})
    with tempfile.TemporaryDirectory() as folder:
        path = exp.save(Path(folder) / "x.npz")
        again = Experiment.load(path)
    assert again == exp
    assert again.history == exp.history


def test_a_large_log_is_read_fast(tmp_path: Path) -> None:
    time = np.arange(25_000) / 1000
    table = np.column_stack([time, np.sin(time), np.cos(time), time, time])
    path = tmp_path / "large.csv"
    np.savetxt(path, table, delimiter=",", header="time,a,b,c,d", comments="", fmt="%.9g")
    seconds = []
    for _ in range(3):
        start = stopwatch.process_time()
        Experiment.load(path)
        seconds.append(stopwatch.process_time() - start)
    assert min(seconds) < 0.5  # a tenth of it on most machines


# ---- what is refused -------------------------------------------------------------------------------------------------


def load_small(path: Path) -> Experiment:
    return Experiment.load(path, TABLE)


@pytest.mark.parametrize(
    ("rows", "header", "words"),
    [
        (None, "t,Q,u", r'has no column "q" for the channel "axis.position"; its columns are Q, t, u'),
        (None, "t,q,u,q", r'line 1: the name "q" stands over columns 2 and 4'),
        (None, "t,,u", r"line 1: column 2 of 3 has no name"),
        (None, "0,1,2", r"line 1 holds numbers"),
        ([], "t,q,u", r"has a line of column names but no rows"),
        (changed(5, "30,x3,1"), "t,q,u", r'line 5: "x3" in column "q" is no number; write a number'),
        (changed(5, "30,,1"), "t,q,u", r'line 5: "axis\.position" has no number, as in 1 of 12 rows; fill'),
        (changed(5, "30,3"), "t,q,u", r"line 5: there are 2 cells where the header names 3 columns"),
        (changed(5, "30,3,1,7"), "t,q,u", r"line 5: there are 4 cells where the header names 3 columns"),
        (changed(5, "30,nan,1"), "t,q,u", r'line 5: column "q" \(axis.position\) is nan at t = 0.03 s, the only one'),
        (changed(5, "30,inf,1"), "t,q,u", r'line 5: column "q" \(axis.position\) is inf at t = 0.03 s'),
        (changed(5, "nan,3,1"), "t,q,u", r"line 5: the time is nan, the only one"),
        (changed(5, "20,3,1"), "t,q,u", r"line 5: the time goes from 0.02 s to 0.02 s.*delete the repeated row"),
        (changed(5, "15,3,1"), "t,q,u", r"line 5: the time goes from 0.02 s to 0.015 s.*sort the rows"),
        (changed(5, "31,3,1"), "t,q,u", r"line 5: the step at t = 0.02 s is 0.011 s, 10.00% off the median of 0.01 s"),
        ([f"5,{k},0" for k in range(12)], "t,q,u", r"the time is 0.005 s in all 12 samples"),
        (["0,0,0", "10,1,1"], "t,q,u", r"has 2 of at least 10 samples that are needed"),
    ],
)
def test_what_is_wrong_with_a_file(tmp_path: Path, rows: list[str] | None, header: str, words: str) -> None:
    path = log(tmp_path, rows, header)
    with pytest.raises(ExperimentError, match=words) as caught:
        load_small(path)
    assert str(path) in str(caught.value)
    assert caught.value.path == str(path)


def test_gaps_are_counted(tmp_path: Path) -> None:
    kept = [k for k in range(30) if k not in {7, 8, 9, 20}]
    path = log(tmp_path, [f"{10 * k},{k},0" for k in kept])
    words = r"line 9: 3 samples are missing after t = 0.06 s \(a step of 0.04 s where 0.01 s is usual\) and there are 1"
    with pytest.raises(ExperimentError, match=words) as caught:
        load_small(path)
    assert caught.value.time == pytest.approx(0.06)
    filled = Experiment.load(path, TABLE, irregular="interpolate")
    assert len(filled) == 30
    np.testing.assert_allclose(filled["axis.position"], 1e-3 * np.arange(30), atol=1e-12)
    assert any("4 samples are missing before, the longest gap being 3 long" in s for s in filled.history)


def test_a_clock_that_changes_its_rate_is_refused() -> None:
    steps = np.where(np.arange(2000) < 1000, 0.01, 0.01003)
    with pytest.raises(ExperimentError, match="because the clock's rate changes"):
        Experiment.from_arrays(np.cumsum(steps), {"a": np.zeros(2000)})


def test_a_clock_with_microsecond_jitter_passes_and_is_kept() -> None:
    time = np.round(np.arange(500) / 1024, 6)
    exp = Experiment.from_arrays(time, {"a": np.zeros(500)})
    np.testing.assert_array_equal(exp.time, time)
    assert exp.rate == pytest.approx(1024, rel=1e-5)


def test_lines_are_counted_with_the_blank_ones(tmp_path: Path) -> None:
    path = write(tmp_path / "x.csv", "t,q,u\n0,0,0\n\n10,1,1\n10,2,2\n" + "".join(f"{20 + k},0,0\n" for k in range(10)))
    with pytest.raises(ExperimentError, match=r"line 5: the time goes from 0.01 s to 0.01 s"):
        load_small(path)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty; a log starts with a line of column names"),
        (b"# one\n\n% two\n", "holds 2 lines of remarks and no numbers; a log starts with a line of column names"),
        (b"\n\n", "is empty"),
        (b"t,q,u\n\xff\xfe\x00", r"is not a t\w+"),
        (b"\x80\x81\x82", "is not a text file in UTF-8"),
        (
            b"t;q;u\n" + b"".join(b"%d.0;%d,5;0\n" % (k, k) for k in range(12)),
            r'"0,5" in column "q" is no number; numbers of this file have decimal points and commas',
        ),
        (b"t,q,u\n" + b"".join(b"%d,%d,5,0\n" % (k, k) for k in range(12)), r"line 2: there are 4 cells"),
    ],
)
def test_files_that_are_no_tables(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "x.csv"
    path.write_bytes(content)
    with pytest.raises(ExperimentError, match=words):
        load_small(path)


def test_files_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(ExperimentError, match=r"none\.csv does not exist; check the name and the folder"):
        load_small(tmp_path / "none.csv")
    with pytest.raises(ExperimentError, match="cannot be read"):
        load_small(tmp_path)
    with pytest.raises(ModelError, match=r"none\.toml"):
        Experiment.load(log(tmp_path), tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("entries", "error", "words"),
    [
        (
            {"axis.position": ChannelEntry(column="q", unit="V")},
            ExperimentError,
            r"is given in V \(.*\), but it is in m",
        ),
        (
            {"axis.sped": ChannelEntry(column="u", unit="m")},
            ExperimentError,
            r'mapped to both "drive.command" and "axis.sped"',
        ),
        (
            {"axis.velocity": ChannelEntry(column="q", unit="m/s")},
            ExperimentError,
            r'mapped to both "axis.position" and',
        ),
        ({"time": ChannelEntry(column="t", unit="m")}, ExperimentError, r'"time" is given in m .* it is in s'),
        ({"axis.position": ChannelEntry(column="q", unit="m", delay=5.0)}, ExperimentError, "check their unit"),
    ],
)
def test_tables_that_do_not_fit(
    tmp_path: Path, emps: Model, entries: dict[str, ChannelEntry], error: type[Exception], words: str
) -> None:
    with pytest.raises(error, match=words):
        Experiment.load(log(tmp_path), {**TABLE, **entries}, emps)


def test_near_names_are_offered(tmp_path: Path, emps: Model) -> None:
    rows = [f"{10 * k},{k},{k}" for k in range(12)]
    path = log(tmp_path, rows, "t,position_mm,u")
    table = {**TABLE, "axis.position": ChannelEntry(column="positon_mm", unit="mm")}
    with pytest.raises(ExperimentError, match=r'did you mean "position_mm"\?'):
        Experiment.load(path, table)
    with pytest.raises(ModelError, match=r'did you mean "axis.position'):
        Experiment.load(path, {"time": TABLE["time"], "axis.positon": ChannelEntry(column="u", unit="m")}, emps)


def test_a_table_needs_a_clock(tmp_path: Path) -> None:
    table = {channel: entry for channel, entry in TABLE.items() if channel != "time"}
    with pytest.raises(ExperimentError, match=r'maps no column to "time"; add time = \{ column'):
        Experiment.load(log(tmp_path), table)
    with pytest.raises(ExperimentError, match="has no column named time, time_s, t, its columns are x, y"):
        Experiment.load(write(tmp_path / "y.csv", "x,y\n1,2\n"))


def test_units_in_brackets_have_to_be_known(tmp_path: Path) -> None:
    rows = [f"{k},{k}" for k in range(12)]
    with pytest.raises(UnitError, match=r"channel q: unit .*furlong"):
        Experiment.load(log(tmp_path, rows, "time,q [furlong]"))


def test_a_table_may_leave_out_the_unit_behind_a_name(tmp_path: Path) -> None:
    path = log(tmp_path, [f"{k},{k},{2 * k}" for k in range(12)], "t [ms],axis [mm],axis [deg]")
    clock = ChannelEntry(column="t", unit="ms")
    several = {"time": clock, "axis.position": ChannelEntry(column="axis [mm]", unit="mm")}
    np.testing.assert_allclose(Experiment.load(path, several)["axis.position"], 1e-3 * np.arange(12))
    with pytest.raises(ExperimentError, match='has no column "axis"'):  # there are two
        Experiment.load(path, {"time": clock, "axis.position": ChannelEntry(column="axis", unit="mm")})


def test_a_temperature_is_read_in_kelvin(tmp_path: Path) -> None:
    rows = [f"{0.01 * k},{20 + k}" for k in range(12)]
    plain = Experiment.load(log(tmp_path, rows, "time,oil [°C]"))
    assert plain.units == ("K",)
    np.testing.assert_allclose(plain["oil"], 293.15 + np.arange(12))
    table = {"time": ChannelEntry(column="time", unit="s"), "oil": ChannelEntry(column="oil", unit="degF")}
    np.testing.assert_allclose(Experiment.load(tmp_path / "log.csv", table)["oil"], (20 + np.arange(12) + 459.67) / 1.8)
    np.testing.assert_allclose(plain.with_channel("air", np.full(12, 20.0), "°C")["air"], 293.15)


def test_irregular_takes_two_words(tmp_path: Path) -> None:
    word: Any = "ignore"
    with pytest.raises(ExperimentError, match='choose "error" or "interpolate"'):
        Experiment.load(log(tmp_path), TABLE, irregular=word)


# ---- arrays ----------------------------------------------------------------------------------------------------------


def test_arrays_are_converted_and_checked(emps: Model) -> None:
    time = np.arange(20) * 0.01
    exp = Experiment.from_arrays(time, {"axis.position": np.ones(20)}, {"axis.position": "mm"}, model=emps)
    np.testing.assert_allclose(exp["axis.position"], 1e-3)
    assert Experiment.from_arrays(time, {"axis.position": np.ones(20)}, model=emps).units == ("m",)
    bad = np.ones(20)
    bad[[4, 9]] = np.nan
    cases = [
        ({"a": bad}, None, r'arrays, sample 4: the channel "a" is nan at t = 0.04 s, the first of 2'),
        ({"a": np.ones(19)}, None, r'"a" has shape \(19,\) and the time \(20,\)'),
        ({"a": np.ones(20)}, {"b": "m"}, 'a unit is given for "b", which has no values'),
        ({"axis.position": np.ones(20)}, {"axis.position": "kg"}, "is given in kg"),
    ]
    for values, units, words in cases:
        with pytest.raises(ExperimentError, match=words):
            Experiment.from_arrays(time, values, units, model=emps if "axis.position" in values else None)
    with pytest.raises(ExperimentError, match="give one number per sample"):
        Experiment.from_arrays(np.ones((4, 2)), {})


def test_a_record_cannot_be_changed() -> None:
    exp = record()
    for attribute in ("name", "time", "data"):
        with pytest.raises(FrozenInstanceError):
            setattr(exp, attribute, None)
    with pytest.raises(ValueError, match="read-only"):
        exp["axis.position"][0] = 1.0
    source = np.zeros(20)
    copy = Experiment.from_arrays(np.arange(20.0), {"a": source})
    source[:] = 7.0
    np.testing.assert_array_equal(copy["a"], 0.0)


def test_parts_have_to_fit_together() -> None:
    with pytest.raises(ExperimentError, match="do not fit time of shape"):
        Experiment("x", np.arange(3.0), np.zeros((3, 2)), ("a",), ("m",))
    with pytest.raises(ExperimentError, match=r'the channel "a" is there twice'):
        Experiment("x", np.arange(3.0), np.zeros((3, 2)), ("a", "a"), ("m", "m"))


# ---- what can be done with a record ----------------------------------------------------------------------------------


def test_trim_and_split_keep_the_clock() -> None:
    exp = record()
    part = exp.trim(0.5, 2.0)
    assert (part.time[0], part.time[-1], len(part)) == (0.5, 2.0, 151)
    assert "Trimmed to 0.5 s ... 2 s, 151 of 400 samples" in part.history[-1]
    assert exp.trim() == Experiment(exp.name, exp.time, exp.data, exp.channels, exp.units, exp.trim().history)
    train, validation = exp.split(0.75)
    assert (len(train), len(validation)) == (300, 100)
    np.testing.assert_array_equal(np.concatenate([train.data, validation.data]), exp.data)
    assert validation.time[0] == pytest.approx(3.0)
    assert (train.name, validation.name) == ("small-train", "small-validation")


def test_resampling_keeps_motion_and_removes_what_would_fold() -> None:
    time = np.arange(4000) / 1000
    slow, fast = np.sin(2 * np.pi * 3 * time), np.sin(2 * np.pi * 80 * time)
    exp = Experiment.from_arrays(time, {"a.position": slow + fast}, {"a.position": "m"})
    down = exp.resample(100.0)
    assert down.rate == pytest.approx(100.0)
    inner = slice(40, -40)
    np.testing.assert_allclose(down["a.position"][inner], np.sin(2 * np.pi * 3 * down.time)[inner], atol=0.005)
    up = Experiment.from_arrays(time, {"a.position": slow}).resample(3333.0)
    np.testing.assert_allclose(up["a.position"], np.sin(2 * np.pi * 3 * up.time), atol=1e-6)
    assert up.time[-1] <= time[-1] + 1e-9
    assert "Resampled from 1000 Hz to 100 Hz below a filter at 40 Hz" in down.history[-1]


@pytest.mark.parametrize(("rate", "share"), [(100.0, 0.08), (400.0, 0.32)])
def test_noise_is_known_behind_an_anti_aliasing_filter(rate: float, share: float) -> None:
    """White noise keeps the share of its power that is below the filter, and none above."""
    time, sigma = np.arange(20_000) / 1000.0, 3e-3
    noise = sigma * np.random.default_rng(7).standard_normal(time.size)
    record = Experiment.from_arrays(time, {"a.position": np.sin(time) + noise}).resample(rate)
    level, edge = sigma * np.sqrt(share), 0.2  # differences hear most of the edge, where the filter falls off
    assert instrument_noise(record, "a.position") == pytest.approx(level, rel=edge)
    assert np.std((record["a.position"] - np.sin(record.time))[100:-100]) == pytest.approx(level, rel=0.1)
    again = drawn_noise(record, "a.position", np.random.default_rng(8))
    assert np.std(again) == pytest.approx(level, rel=edge)
    power = np.abs(np.fft.rfft(again * np.hanning(again.size))) ** 2
    lines = np.fft.rfftfreq(again.size)
    assert np.mean(power[lines > 0.45]) < 1e-3 * np.mean(power[lines < 0.35])
    passed = read_noise(record, "a.position", np.array([0.0, 0.2, 0.39, 0.41, 0.5]))
    assert passed.tolist() == [1.0, 1.0, 1.0, 0.0, 0.0]
    chosen = choose_cutoff(record["a.position"][:, None], rate, [rate], [record.retained["a.position"]])
    assert chosen.noise[0] == pytest.approx(level / np.sqrt(0.8), rel=0.1)  # as if it went on to half of the rate


def test_what_is_interpolated_to_a_higher_rate_was_read_at_the_lower_one() -> None:
    time, sigma = np.arange(4000) / 100.0, 3e-3
    noise = sigma * np.random.default_rng(9).standard_normal(time.size)
    record = Experiment.from_arrays(time, {"a.position": np.sin(time) + noise}).resample(500.0)
    assert record.read_rate("a.position") == pytest.approx(100.0)
    assert instrument_noise(record, "a.position") == pytest.approx(sigma, rel=0.1)


def test_loading_can_resample_an_uneven_clock() -> None:
    time = np.sort(np.random.default_rng(1).uniform(0, 5, 3000))
    values = {"a.position": np.sin(2 * time), "a.command": np.where(time > 2.5, 1.0, 0.0)}
    exp = Experiment.from_arrays(time, values, irregular="interpolate", resample=100.0)
    assert exp.rate == pytest.approx(100.0)
    np.testing.assert_allclose(exp["a.position"][20:-20], np.sin(2 * exp.time)[20:-20], atol=0.02)
    assert np.all(np.diff(exp.time) > 0)


def test_filter_and_derivatives_are_recorded() -> None:
    exp = record().filter("axis.position", 20.0).differentiate("axis.position").differentiate("axis.velocity")
    assert exp.channels == ("axis.position", "drive.command", "axis.velocity", "axis.acceleration")
    assert exp.units == ("m", "V", "m/s", "m/s^2")
    inner = slice(40, -40)
    np.testing.assert_allclose(exp["axis.velocity"][inner], 3 * np.cos(3 * exp.time)[inner], atol=1e-4)
    assert "filtered at 20 Hz" in exp.history[-3]
    assert exp.differentiate("drive.command", "slope").unit("slope") == "V/s"


def test_channels_are_added_and_replaced() -> None:
    exp = record().with_channel("axis.effort", np.ones(400), "kN").with_channel("axis.effort", np.ones(400), "N")
    assert exp.channels == ("axis.position", "drive.command", "axis.effort")
    np.testing.assert_array_equal(exp["axis.effort"], 1.0)
    assert "replaced" in exp.history[-1]


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda e: e["axis.positio"], r'small has no channel "axis.positio"; did you mean "axis.position"\?'),
        (lambda e: e.trim(5.0, 6.0), r"0 samples lie between 5 s and 6 s.*the record goes from 0 s to 3.99 s"),
        (lambda e: e.split(1.0), "leaves 400 and 0 of 400 samples"),
        (lambda e: e.resample(0.1), "gives fewer than 10 samples"),
        (lambda e: e.resample(-5.0), "choose a rate above"),
        (lambda e: e.filter("axis.position", 60.0), "between 0 and 50 Hz"),
        (lambda e: e.differentiate("drive.command"), "has no customary name; give one"),
        (lambda e: e.differentiate("axis.position", "drive.command"), '"drive.command" is there already'),
        (lambda e: e.with_channel("a", np.ones(3)), r"values of shape \(3,\) were given"),
        (lambda e: e.with_channel("a", np.full(400, np.inf)), 'the channel "a" is inf at t = 0 s, the first of 400'),
        (lambda e: e.align({"axis.position": 3.95}), "leave 5 of 400 samples"),
    ],
)
def test_what_a_record_refuses(act: object, words: str) -> None:
    assert callable(act)
    with pytest.raises(ExperimentError, match=words):
        act(record())


def test_frame_and_repr() -> None:
    exp = record()
    assert list(exp.to_frame().columns) == ["time_s", "axis.position", "drive.command"]
    assert "rate_hz=100" in repr(exp)
    assert "\n" not in repr(exp)
    assert "-1 ... 1 V" in exp._repr_html_()


# ---- motion ----------------------------------------------------------------------------------------------------------


class Axis:
    """The little that `motion` asks of a model."""

    name = "slide"
    joints = ("axis",)
    input_channels = ("drive.command",)
    optional_inputs = ()


def moving(samples: int = 4000, sigma: float = 1e-6) -> Experiment:
    time = np.arange(samples) / 500
    noise = sigma * np.random.default_rng(4).standard_normal((3, samples))
    values = {
        "axis.position": np.sin(2 * time) + noise[0],
        "axis.velocity": 2 * np.cos(2 * time) + 1.0 + noise[1],
        "axis.acceleration": -4 * np.sin(2 * time) + 2.0 + noise[2],
        "drive.command": np.sign(np.sin(time)),
    }
    return Experiment.from_arrays(time, values, name="run")


def test_motion_is_that_of_the_machine() -> None:
    exp = moving()
    m = motion(exp, Axis())
    assert m.position.shape == m.velocity.shape == m.acceleration.shape == m.inputs.shape == (4000, 1)
    t = exp.time[m.kept]
    np.testing.assert_allclose(m.position[m.kept, 0], np.sin(2 * t), atol=5e-6)
    np.testing.assert_allclose(m.velocity[m.kept, 0], 2 * np.cos(2 * t), atol=5e-4)
    np.testing.assert_allclose(m.acceleration[m.kept, 0], -4 * np.sin(2 * t), atol=0.05)
    np.testing.assert_array_equal(m.inputs[:, 0], exp["drive.command"])
    assert m.dt == exp.dt
    assert "was chosen where motion stands 10 dB above the noise: axis up to" in m.notes[0]
    assert "without a noise floor" not in m.notes[0]
    assert "without a noise floor" in motion(moving(sigma=0.0), Axis()).notes[0]


def test_motion_with_a_given_cutoff_and_measured_derivatives() -> None:
    exp = moving()
    m = motion(exp, Axis(), cutoff=50.0, measured=("velocity",))
    assert (m.cutoff, m.edge, m.decimation) == (50.0, 34, 10)
    inner = slice(100, -100)
    np.testing.assert_allclose(m.velocity[inner, 0], (2 * np.cos(2 * exp.time) + 1.0)[inner], atol=1e-4)
    np.testing.assert_allclose(m.acceleration[inner, 0], (-4 * np.sin(2 * exp.time))[inner], atol=1e-2)
    both = motion(exp, Axis(), cutoff=50.0, measured=("velocity", "acceleration"))
    np.testing.assert_allclose(both.acceleration[inner, 0], (2 - 4 * np.sin(2 * exp.time))[inner], atol=1e-4)
    assert "was given" in m.notes[0]
    assert "The velocity is the measured one" in m.notes[1]


def test_motion_is_a_result(tmp_path: Path) -> None:
    m = motion(moving(), Axis(), cutoff=40.0)
    assert Motion.load(m.save(tmp_path / "m.npz")) == m
    assert "axis.acceleration" in m.to_frame().columns
    assert "cutoff_hz=40" in repr(m)
    assert "was given" in m._repr_html_()


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda e: motion(e, Axis(), measured=("jerk",)), "choose from velocity, acceleration"),
        (lambda e: motion(e, Axis(), cutoff=300.0), "between 0 and 250 Hz"),
        (
            lambda e: motion(e.trim(0.0, 1.0), Axis(), cutoff=1.0),
            "501 samples at 500 Hz leave 0 after 1504 at each end",
        ),
        (lambda e: motion(e, type("Other", (Axis,), {"joints": ("elbow",)})()), 'needs the channel "elbow.position"'),
        (
            lambda e: motion(e, type("Other", (Axis,), {"input_channels": ("motor.command",)})()),
            'needs the channel "motor.command"',
        ),
        (lambda _: common_cutoff([], Axis()), "needs at least one record"),
    ],
)
def test_what_motion_refuses(act: object, words: str) -> None:
    assert callable(act)
    with pytest.raises(ExperimentError, match=words):
        act(moving())


def test_the_common_cutoff_is_the_lowest() -> None:
    quiet, noisy = moving(sigma=1e-7), moving(sigma=1e-3)
    chosen = [motion(each, Axis()).cutoff for each in (quiet, noisy)]
    assert common_cutoff([quiet, noisy], Axis()) == chosen[1] < chosen[0]


def of_stamps(stamps: Array, irregular: Irregular = "error") -> Experiment:
    """Record of stamps in s, whose readings are all different."""
    return Experiment.from_arrays(
        stamps, {"q": np.sin(np.arange(stamps.size) / 50.0)}, {"q": "rad"}, irregular=irregular
    )


@pytest.mark.parametrize("stamps", [np.floor(np.arange(7000) / 1000 * 1000) / 1000, np.round(np.arange(3000) / 300, 3)])
@pytest.mark.parametrize("irregular", ["error", "interpolate"])
def test_stamps_in_whole_milliseconds_are_taken_as_even(stamps: Array, irregular: Irregular) -> None:
    """The first are cut numbers, of which some repeat and some are left out; the second go by 3, 3 and 4 ms."""
    log = of_stamps(stamps, irregular)
    assert len(log) == stamps.size
    assert np.abs(log.time - stamps).max() < 1.1e-3
    assert any("counts whole 0.001 s" in sentence for sentence in log.history)


def test_a_lost_row_and_a_row_twice_are_no_rounding() -> None:
    even = np.arange(3000) / 1000
    with pytest.raises(ExperimentError, match="1 sample is missing"):
        of_stamps(np.delete(even, 1000))
    with pytest.raises(ExperimentError, match="delete the repeated row"):
        of_stamps(np.insert(even, 1000, even[1000]))
    with pytest.raises(ExperimentError, match=r"is missing|off the median"):
        of_stamps(np.delete(np.round(np.arange(3000) / 300, 3), 1000))
