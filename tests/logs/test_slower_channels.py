"""Logs of controllers: dates as clocks, channels with empty cells, and channels that repeat what a slow sensor read."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from vpm import Experiment
from vpm.errors import ExperimentError
from vpm.experiment import choose_cutoff, drawn_noise, instrument_noise, lowpass, read_noise
from vpm.experiment.dates import seconds_of_dates
from vpm.identify.closed_loop_prediction import Noise
from vpm.model import ChannelEntry
from vpm.model.channels import ColumnPart

STEP, SLOW = 0.01, 5  # s; samples between two readings of the slow sensor
COUNT = 1200


def swing(time: np.ndarray) -> np.ndarray:
    """Swing of a load, deg."""
    return 6.0 * np.sin(2.0 * time) + 2.0 * np.sin(5.1 * time)


def table(clock: str, unit: str) -> dict[str, ChannelEntry]:
    """The channel table of these logs."""
    return {
        "time": ChannelEntry(column=clock, unit=unit),
        "travel.position": ChannelEntry(column="Weg_mm", unit="mm"),
        "swing.position": ChannelEntry(column="Winkel_Grad", unit="deg"),
    }


def written(path: Path, clock: str, stamps: list[str], slow: list[str], lost: frozenset[int] = frozenset()) -> Path:
    """File of a German controller, without the rows that were lost."""
    ways = [f"{1000.0 * np.sin(0.7 * STEP * k):.1f}".replace(".", ",") for k in range(COUNT)]
    rows = [f"{stamps[k]};{ways[k]};{slow[k]}" for k in range(COUNT) if k not in lost]
    path.write_text("\n".join([f"{clock};Weg_mm;Winkel_Grad", *rows]) + "\n", encoding="cp1252")
    return path


def german(value: float) -> str:
    """Number with a decimal comma, as coarse as the sensor."""
    return f"{value:.2f}".replace(".", ",")


READ = swing(STEP * np.arange(COUNT))
HELD = [german(READ[k - k % SLOW]) for k in range(COUNT)]
SPARSE = [german(READ[k]) if k % SLOW == 0 else "" for k in range(COUNT)]
MILLISECONDS = [str(10 * k) for k in range(COUNT)]
#: From one day to the next.
DATES = [
    (datetime(2026, 3, 13, 23, 59, 55, tzinfo=UTC) + timedelta(milliseconds=10 * k)).strftime("%d.%m.%Y %H:%M:%S,%f")[
        :-3
    ]
    for k in range(COUNT)
]


def test_dates_are_a_clock_beside_decimal_commas(tmp_path: Path) -> None:
    every = [german(value) for value in READ]
    log = Experiment.load(written(tmp_path / "plc.csv", "Zeitstempel", DATES, every), table("Zeitstempel", "s"))
    np.testing.assert_allclose(log.time, STEP * np.arange(COUNT), atol=1e-9)
    np.testing.assert_allclose(log["swing.position"], np.radians(READ), atol=np.radians(0.0051))


@pytest.mark.parametrize(
    ("cells", "seconds"),
    [
        (["2026-03-14T09:26:53.5Z", "2026-03-14T09:26:54Z"], 0.5),
        (["2026-10-25 02:59:59+02:00", "2026-10-25 02:00:01+01:00"], 2.0),  # summer time ends
        (["28.02.24 23:59:59", "29.02.24 00:00:00"], 1.0),
        (["3/14/2026 09:26:53.000001", "3/14/2026 09:26:53.000002"], 1e-6),
        (["09:26:53,120", "09:26:53,130"], 0.01),
    ],
)
def test_dates_in_seconds(cells: list[str], seconds: float) -> None:
    np.testing.assert_allclose(seconds_of_dates(cells), [0.0, seconds], rtol=1e-9)


@pytest.mark.parametrize(
    ("cell", "words"),
    [
        ("31.02.2026 09:26:53", "line 4: .*is no date"),
        ("yesterday", 'line 4: "yesterday" in column "Zeit" is no number; write a number, or a date such as'),
        ("3/5/2026 09:26:53", "line 4: .*is another day, and slashes do not tell its order"),
    ],
)
def test_what_is_no_date(tmp_path: Path, cell: str, words: str) -> None:
    stamps = [f"3/4/2026 00:00:{k // 100:02d}.{k % 100:02d}" for k in range(COUNT)]
    stamps[2] = cell
    with pytest.raises(ExperimentError, match=words):
        Experiment.load(written(tmp_path / "plc.csv", "Zeit", stamps, HELD), table("Zeit", "s"))


@pytest.mark.parametrize("slow", [SPARSE, HELD], ids=["empty cells", "repeated values"])
def test_a_slow_sensor_counts_where_it_was_read(tmp_path: Path, slow: list[str]) -> None:
    """Held values are two samples late in the mean: 0.02 s times 22 deg/s are 0.4 deg, 40 times the error here."""
    lost = frozenset({403, 404, 700, 805, 1011})  # among them two at which the sensor was read
    path = written(tmp_path / "plc.csv", "ms", MILLISECONDS, slow, lost)
    with pytest.raises(ExperimentError, match=r"swing\.position.*--interpolate"):
        Experiment.load(path, table("ms", "ms"))
    log = Experiment.load(path, table("ms", "ms"), irregular="interpolate")
    error = np.degrees(log["swing.position"]) - swing(log.time)
    assert log.rate == pytest.approx(1.0 / STEP)
    assert np.abs(error).max() < 0.06  # a reading lost: the spline's error over two steps of 0.05 s
    assert np.median(np.abs(error)) < 0.005  # the step of the sensor


def test_rows_without_a_number_of_a_slow_sensor_are_empty_cells(tmp_path: Path) -> None:
    """Merged frames and MATLAB write NaN where a device has nothing; of two devices no row has both."""
    time = STEP * np.arange(COUNT)
    every = np.sort(np.concatenate([time, time[::SLOW] + 0.3 * STEP]))
    drive, slow = np.isin(every, time), ~np.isin(every, time)
    columns = {
        "t": every,
        "Weg_mm": np.where(drive, 1000.0 * np.sin(0.7 * every), np.nan),
        "Winkel_Grad": np.where(slow, swing(every), np.nan),
    }
    savemat(tmp_path / "merged.mat", columns)
    with pytest.raises(ExperimentError, match=r'sample 1: column "Weg_mm".*is nan.*fill these cells, or.*interpolate'):
        Experiment.load(tmp_path / "merged.mat", table("t", "s"))
    log = Experiment.load(tmp_path / "merged.mat", table("t", "s"), irregular="interpolate")
    assert log.rate == pytest.approx(1.0 / STEP)
    assert log.slower["swing.position"] == pytest.approx(1.0 / (SLOW * STEP))
    np.testing.assert_allclose(log["travel.position"], np.sin(0.7 * log.time), atol=1e-9)
    np.testing.assert_allclose(log["swing.position"], np.radians(swing(log.time)), atol=2e-5)  # of the spline
    arrays = {"travel.position": columns["Weg_mm"], "swing.position": columns["Winkel_Grad"]}
    units = {"travel.position": "mm", "swing.position": "deg"}
    np.testing.assert_array_equal(Experiment.from_arrays(every, arrays, units, irregular="interpolate").data, log.data)


def test_a_turn_is_unwrapped_over_rows_without_a_number(tmp_path: Path) -> None:
    """An expression takes the rows in which all of its columns have numbers."""
    turns = 37.0 * np.arange(COUNT) % 256.0
    turns[[5, 6, 400]] = np.nan
    savemat(tmp_path / "counter.mat", {"t": STEP * np.arange(COUNT), "n": turns})
    counter = ChannelEntry(value="unwrap(n, 256)", columns={"n": ColumnPart(column="n")}, unit="1")
    entries = {"time": ChannelEntry(column="t", unit="s"), "a.position": counter}
    log = Experiment.load(tmp_path / "counter.mat", entries, irregular="interpolate")
    np.testing.assert_allclose(log["a.position"], 37.0 * np.arange(COUNT), atol=1e-6)
    savemat(tmp_path / "counter.mat", {"t": STEP * np.arange(COUNT), "n": np.full(COUNT, np.nan)})
    with pytest.raises(ExperimentError, match=r'no row has a number for the channel "a\.position"; do not map it'):
        Experiment.load(tmp_path / "counter.mat", entries, irregular="interpolate")


@pytest.mark.parametrize("times", [1.0, 5.0])
def test_values_held_for_two_samples_are_refused_where_that_costs_more_than_noise(times: float) -> None:
    """Half of the samples are one step late, so the error is the step times the speed, by the root of two."""
    noise, time = 1e-3, STEP * np.arange(4 * COUNT)
    read = times * 0.2 * np.sin(0.7 * time) + noise * np.random.default_rng(2).normal(size=time.size)
    held = read[np.arange(time.size) // 2 * 2]
    cost = times * 0.2 * 0.7 / np.sqrt(2.0) * STEP / np.sqrt(2.0)
    if cost > noise:
        with pytest.raises(
            ExperimentError, match=r"off by 0\.003\d+ rad.* more than its noise of 0\.00(09|1).*interpolate"
        ):
            Experiment.from_arrays(time, {"boom.position": held}, {"boom.position": "rad"})
        return
    log = Experiment.from_arrays(time, {"boom.position": held}, {"boom.position": "rad"})
    np.testing.assert_array_equal(log["boom.position"], held)
    (told,) = [sentence for sentence in log.history if "repeated" in sentence]
    assert "no more than its noise" in told
    assert log.read_rate("boom.position") == pytest.approx(0.5 / STEP)
    assert instrument_noise(log, "boom.position") == pytest.approx(noise, rel=0.15)


def test_each_message_of_a_bus_has_its_own_rows(tmp_path: Path) -> None:
    """The record has the clock of the message that came most often."""
    time = STEP * np.arange(COUNT)
    rows = ["t,q,p"]
    for k, now in enumerate(time):
        rows += [f"{now:.4f},{np.sin(now):.9f},"] + ([f"{now + 0.003:.4f},,{np.cos(now + 0.003):.9f}"] if k % 2 else [])
    path = tmp_path / "bus.csv"
    path.write_text("\n".join(rows) + "\n")
    entries = {
        "time": ChannelEntry(column="t", unit="s"),
        "boom.position": ChannelEntry(column="q", unit="rad"),
        "boom.pressure_a": ChannelEntry(column="p", unit="bar"),
    }
    log = Experiment.load(path, entries, irregular="interpolate")
    assert log.dt == pytest.approx(STEP)
    np.testing.assert_allclose(log["boom.position"], np.sin(log.time), atol=1e-6)
    np.testing.assert_allclose(log["boom.pressure_a"], 1e5 * np.cos(log.time), atol=10.0)  # straight lines: h^2/8


def test_a_message_between_those_of_the_record_leaves_these_as_they_were_read(tmp_path: Path) -> None:
    """Half a step beside its readings a position would lose noise, and a held command its jumps."""
    random, time, noise = np.random.default_rng(4), STEP * np.arange(COUNT), 2e-3
    read = np.sin(time) + noise * random.normal(size=COUNT)
    held = np.repeat(random.normal(size=COUNT // 4), 4)
    rows = ["t,q,u,p"]
    for k, now in enumerate(time):
        rows += [f"{now:.4f},{read[k]:.9f},{held[k]:.9f},", f"{now + 0.5 * STEP:.4f},,,{np.cos(now):.9f}"][: 1 + k % 2]
    path = tmp_path / "bus.csv"
    path.write_text("\n".join(rows) + "\n")
    entries = {
        "time": ChannelEntry(column="t", unit="s"),
        "boom.position": ChannelEntry(column="q", unit="rad"),
        "drive.command": ChannelEntry(column="u", unit="1"),
        "boom.pressure_a": ChannelEntry(column="p", unit="bar"),
    }
    log = Experiment.load(path, entries, irregular="interpolate")
    places = np.round(log.time / STEP).astype(int)
    np.testing.assert_allclose(log.time, time[places], atol=1e-9)
    np.testing.assert_allclose(log["boom.position"], read[places], atol=1e-6)
    np.testing.assert_allclose(log["drive.command"], held[places], atol=1e-6)
    assert instrument_noise(log, "boom.position") == pytest.approx(noise, rel=0.15)


@pytest.mark.parametrize(
    "values",
    [
        np.round(2.0 * np.sin(0.5 * STEP * np.arange(COUNT)), 2),  # slow motion of a coarse encoder: its own steps
        np.sin(3.0 * STEP * np.arange(COUNT)) * (np.sin(0.9 * STEP * np.arange(COUNT)) > 0.0),  # long rests
    ],
    ids=["coarse", "resting"],
)
def test_what_was_read_in_every_sample_stays(values: np.ndarray) -> None:
    log = Experiment.from_arrays(STEP * np.arange(COUNT), {"boom.position": values}, irregular="interpolate")
    np.testing.assert_allclose(log["boom.position"], values, atol=1e-9)
    forces = np.repeat(np.random.default_rng(3).normal(size=COUNT // 4), 4)  # held by a controller, as they act
    for channel in ("drive.command", "boom.acceleration"):
        held = Experiment.from_arrays(STEP * np.arange(COUNT), {channel: forces}, irregular="interpolate")
        np.testing.assert_allclose(held[channel], forces, atol=1e-9)


def test_noise_between_two_readings_is_not_taken_for_none(tmp_path: Path) -> None:
    """Of white noise with deviation s, read at r, no more than its density 2 s^2 / r shows, up to r / 2."""
    noise, time = 2e-3, STEP * np.arange(6000)
    truth = 0.4 * np.sin(1.9 * time) + 0.1 * np.sin(4.4 * time)
    read = truth + noise * np.random.default_rng(11).normal(size=time.size)
    cells = [f"{value:.9f}" if k % SLOW == 0 else "" for k, value in enumerate(read)]
    rows = [f"{now:.2f},{way:.9f},{cell}" for now, way, cell in zip(time, truth, cells, strict=True)]
    path = tmp_path / "noisy.csv"
    path.write_text("\n".join(["t,x,q", *rows]) + "\n")
    entries = {
        "time": ChannelEntry(column="t", unit="s"),
        "travel.position": ChannelEntry(column="x", unit="m"),
        "swing.position": ChannelEntry(column="q", unit="rad"),
    }
    log = Experiment.load(path, entries, irregular="interpolate")
    assert log.read_rate("travel.position") == pytest.approx(1.0 / STEP)
    assert log.read_rate("swing.position") == pytest.approx(1.0 / (SLOW * STEP))
    assert instrument_noise(log, "swing.position") == pytest.approx(noise, rel=0.15)

    for first in range(1, SLOW):  # a cut record does not begin with a reading
        cut = log.trim(log.time[first], log.time[-1])
        assert instrument_noise(cut, "swing.position") == pytest.approx(noise, rel=0.15)

    lines = np.linspace(0.0, 0.5, 2001)
    share = np.trapezoid(read_noise(log, "swing.position", lines), lines) / 0.5
    error = log["swing.position"] - 0.4 * np.sin(1.9 * log.time) - 0.1 * np.sin(4.4 * log.time)
    assert np.std(error) == pytest.approx(noise * np.sqrt(SLOW * share), rel=0.1)
    assert np.all(read_noise(log, "travel.position", lines) == 1.0)

    # Noise that is drawn once more is no larger and no smaller than that of the log, and as slow.
    again = drawn_noise(log, "swing.position", np.random.default_rng(5))
    assert np.std(again) == pytest.approx(np.std(error), rel=0.1)
    assert np.std(np.diff(again)) == pytest.approx(np.std(np.diff(error)), rel=0.1)
    simulated = Noise(np.array([[0.0, noise]]), np.zeros((1, 2)))
    ((drawn, _),) = simulated.drawn([log], np.random.default_rng(6))
    assert np.std(drawn[:, 1]) == pytest.approx(np.std(error), rel=0.1)
    assert np.std(np.diff(drawn[:, 1])) == pytest.approx(np.std(np.diff(error)), rel=0.1)

    swing_alone = log["swing.position"][:, None]
    chosen = choose_cutoff(swing_alone, log.rate, [log.read_rate("swing.position")])
    assert chosen.noise[0] == pytest.approx(noise * np.sqrt(SLOW), rel=0.25)
    inside = slice(600, -600)
    bent = np.gradient(np.gradient(lowpass(swing_alone, log.rate, chosen.cutoff)[:, 0], log.dt), log.dt)
    exact = -0.4 * 1.9**2 * np.sin(1.9 * log.time) - 0.1 * 4.4**2 * np.sin(4.4 * log.time)
    assert np.std((bent - exact)[inside]) < 0.15 * np.std(exact[inside])
    kept = log.trim(5.0, 40.0).select(["swing.position"])
    assert kept.read_rate("swing.position") == log.read_rate("swing.position")
    assert log.with_channel("swing.position", truth[: len(log)], "rad").read_rate("swing.position") == log.rate


def test_a_grid_stays_on_its_samples_where_stamps_are_rounded(tmp_path: Path) -> None:
    """Stamps in whole milliseconds every 2.5 ms, and a clock of the epoch whose numbers hold no more than 0.24 us."""
    count, step = 4000, 0.0025
    force = np.random.default_rng(0).normal(size=count)
    for start, clock in (
        (0.0, np.round(1e3 * step * np.arange(count))),
        (1.7e9, 1.7e12 + 1e3 * step * np.arange(count)),
    ):
        rows = [
            f"{stamp!r},{value!r},{'' if k % 2 else k}"
            for k, (stamp, value) in enumerate(zip(clock.tolist(), force.tolist(), strict=True))
        ]
        path = tmp_path / "log.csv"
        path.write_text("\n".join(["t,F,x", *rows]), encoding="utf-8")
        entries = {"time": ChannelEntry(column="t", unit="ms"), "drive.command": ChannelEntry(column="F", unit="N")}
        entries["axis.position"] = ChannelEntry(column="x", unit="m")
        log = Experiment.load(path, entries, irregular="interpolate")
        assert log.dt == pytest.approx(step, rel=2e-4 if start == 0.0 else 1e-7)
        if start:
            np.testing.assert_allclose(log["drive.command"], force[: len(log)], atol=1e-3)
