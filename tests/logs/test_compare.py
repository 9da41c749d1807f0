"""Comparisons of runs whose difference from the record is known."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from command_line import ran
from vpm import demo
from vpm.compare import Comparison, autocorrelation, compare, cross_correlation, effective_samples, write_mcap
from vpm.compare.regions import time_region
from vpm.errors import ExperimentError, MissingExtraError
from vpm.experiment import Experiment
from vpm.experiment.readers import open_log
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Run, simulate
from written_logs import needs

RATE = 200.0


def log(samples: int = 4000) -> Experiment:
    time = np.arange(samples) / RATE
    values = {
        "axis.position": 0.5 * np.sin(2 * np.pi * 0.2 * time) + 0.01,
        "drive.command": np.sign(np.sin(2 * np.pi * 0.13 * time)),
        "drive.disturbance": np.zeros(samples),
    }
    return Experiment.from_arrays(time, values, {"axis.position": "m", "drive.command": "V"}, "log")


def made_up(
    exp: Experiment,
    values: Array,
    channels: tuple[str, ...] = ("axis.position",),
    units: tuple[str, ...] = ("m",),
) -> Run:
    """Run along a log, whose channels are the measured ones."""
    nothing = np.full(len(exp), np.nan)
    measured = np.column_stack([exp[name] if name in exp.channels else nothing for name in channels])
    return Run("slide", exp.name, "free_run", exp.time, channels, units, values, measured)


def run_with(residual: Array, exp: Experiment | None = None) -> Run:
    """Run whose residual, measured minus simulated, is given."""
    exp = exp or log(residual.size)
    return made_up(exp, (exp["axis.position"] - residual)[:, None])


def white(samples: int = 4000, seed: int = 0) -> Array:
    return np.random.default_rng(seed).standard_normal(samples)


def speed(exp: Experiment) -> Array:
    return np.pi * 0.2 * np.cos(2 * np.pi * 0.2 * exp.time)


# ---- numbers ---------------------------------------------------------------------------------------------------------


def test_the_numbers_are_those_of_their_definitions() -> None:
    exp = log()
    residual = 0.02 * white() + 0.005
    residual[1234] = -0.3
    got = compare(run_with(residual), exp)["axis.position"]
    y = exp["axis.position"]
    assert got.rmse == pytest.approx(np.sqrt(np.mean(residual**2)))
    assert got.relative_error == pytest.approx(100 * np.linalg.norm(residual) / np.linalg.norm(y))
    assert got.fit == pytest.approx(100 * (1 - np.linalg.norm(residual) / np.linalg.norm(y - y.mean())))
    assert got.bias == pytest.approx(residual.mean())
    assert got.max_error == pytest.approx(-0.3)
    assert got.max_error_time == pytest.approx(1234 / RATE)
    np.testing.assert_allclose(got.residual, residual, atol=1e-12)
    assert (got.channel, got.unit) == ("axis.position", "m")


@settings(max_examples=20)
@given(st.floats(1e-3, 1e3), st.integers(0, 100))
def test_units_change_no_ratio(scale: float, seed: int) -> None:
    exp = log(400)
    residual = 0.02 * white(400, seed)
    small = compare(run_with(residual, exp), exp)["axis.position"]
    scaled = exp.with_channel("axis.position", scale * exp["axis.position"], "m")
    large = compare(run_with(scale * residual, scaled), scaled)["axis.position"]
    assert large.rmse == pytest.approx(scale * small.rmse)
    for name in ("relative_error", "fit", "effective_samples"):
        assert getattr(large, name) == pytest.approx(getattr(small, name), rel=1e-6)
    np.testing.assert_allclose(large.autocorrelation.values, small.autocorrelation.values, atol=1e-9)
    assert [r.quantity for r in large.where.regions] == [r.quantity for r in small.where.regions]


def test_a_perfect_run_and_a_silent_channel() -> None:
    exp = log()
    perfect = compare(run_with(np.zeros(4000)), exp)["axis.position"]
    assert (perfect.rmse, perfect.relative_error, perfect.fit) == (0.0, 0.0, 100.0)
    silent = exp.with_channel("axis.position", np.zeros(4000), "m")
    got = compare(made_up(silent, np.ones((4000, 1))), silent)["axis.position"]
    assert got.relative_error == np.inf


# ---- which channels --------------------------------------------------------------------------------------------------


def test_inputs_that_are_repeated_are_left_out_and_named() -> None:
    exp = log()
    values = np.column_stack([exp["axis.position"] + 0.1, exp["drive.command"], np.zeros(4000)])
    run = made_up(exp, values, ("axis.position", "drive.command", "axis.velocity"), ("m", "V", "m/s"))
    got = compare(run, exp)
    assert [each.channel for each in got.channels] == ["axis.position"]
    assert set(got.skipped) == {
        "drive.command is given to the simulation, which repeats it.",
        "axis.velocity was not measured.",
    }
    chosen = compare(run, exp, ["drive.command", "axis.position", "drive.command"])
    assert [each.channel for each in chosen.channels] == ["drive.command", "axis.position"]


def test_what_is_refused() -> None:
    exp = log()
    run = run_with(0.01 * white())
    with pytest.raises(ExperimentError, match=r'the run has no channel "axis.positon"; did you mean "axis.position"\?'):
        compare(run, exp, ["axis.positon"])
    unmeasured = made_up(exp, np.zeros((4000, 2)), ("axis.position", "axis.velocity"), ("m", "m/s"))
    with pytest.raises(ExperimentError, match=r'"axis.velocity" was simulated but not measured in mode free_run'):
        compare(unmeasured, exp, ["axis.velocity"])
    other = made_up(exp, np.zeros((4000, 1)), ("elbow.position",), ("rad",))
    with pytest.raises(ExperimentError, match=r"nothing to compare in mode free_run, the run has elbow.position"):
        compare(other, exp)
    with pytest.raises(ExperimentError, match="has 1 samples; compare at least two"):
        compare(replace(run, time=exp.time[:1]), exp)
    with pytest.raises(ExperimentError, match=r'the comparison has no channel "q"; it has axis.position'):
        compare(run, exp)["q"]


def test_a_slower_run_is_compared_on_its_own_samples() -> None:
    exp = log()
    rows, run = slice(5, None, 10), run_with(np.full(4000, 0.25), exp)
    slower = replace(run, time=run.time[rows], values=run.values[rows], measured=run.measured[rows])
    got = compare(slower, exp)["axis.position"]
    np.testing.assert_allclose(got.residual, 0.25)
    assert got.time.size == 400


# ---- correlation -----------------------------------------------------------------------------------------------------


def whole(samples: int) -> list[slice]:
    return [slice(0, samples)]


def test_white_residuals_stay_within_the_band() -> None:
    shares = [autocorrelation(white(2000, seed), whole(2000), 0.01, "r").outside for seed in range(40)]
    assert np.mean(shares) == pytest.approx(0.05, abs=0.01)
    one = autocorrelation(white(2000), whole(2000), 0.01, "r")
    assert one.values[0] == 1.0
    assert one.lags[1] == 0.01
    assert one.band == pytest.approx(1.96 / np.sqrt(2000), rel=1e-4)


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9, 0.97])
def test_correlation_and_worth_of_a_first_order_process(memory: float) -> None:
    n, residual = 100_000, white(100_000, 3)
    for k in range(1, n):
        residual[k] += memory * residual[k - 1]
    rho = autocorrelation(residual, whole(n), 1.0, "r").values
    np.testing.assert_allclose(rho[:20], memory ** np.arange(20), atol=0.05)
    assert effective_samples(residual, whole(n)) == pytest.approx(n * (1 - memory) / (1 + memory), rel=0.15)


def test_an_input_that_leaks_into_the_residual_is_seen_at_its_lag() -> None:
    signal = np.repeat(white(500, 9), 8)
    residual = 0.3 * np.roll(signal, 12) + white(4000, 1)
    found = cross_correlation(residual, signal, whole(4000), 1.0, "drive.command")
    assert found.lags[np.argmax(np.abs(found.values))] == 12.0
    assert found.values.max() > 2 * found.band
    exp = log().with_channel("drive.command", signal, "V")
    got = compare(run_with(0.01 * residual, exp), exp)["axis.position"]
    assert [each.of for each in got.inputs] == ["drive.command"]  # the disturbance does not vary
    assert got.inputs[0].outside > 0.02


def test_slow_signals_that_have_nothing_in_common_stay_within_the_band() -> None:
    shares = []
    for seed in range(60):
        a, b = (np.convolve(white(4200, 2 * seed + side), np.ones(60) / 60, "same")[100:4100] for side in (0, 1))
        shares.append(cross_correlation(a, b, whole(4000), 1.0, "u").outside)
    assert np.mean(shares) < 0.1  # with the band of white noise it would be 0.7


def test_pieces_are_not_joined() -> None:
    piece = np.linspace(-1, 1, 50)
    pieces = [slice(50 * k, 50 * k + 50) for k in range(40)]
    alone = autocorrelation(np.tile(piece, 40), pieces, 1.0, "r")
    lag = 5
    direct = (piece[lag:] @ piece[:-lag]) / (piece @ piece)
    assert alone.values[lag] == pytest.approx(direct)
    assert alone.values.size == 13


# ---- where -----------------------------------------------------------------------------------------------------------


def test_shares_are_shares() -> None:
    got = compare(run_with(0.01 * white()), log())["axis.position"]
    names = [region.quantity for region in got.where.regions]
    assert names == ["time", "frequency", "axis.speed", "axis.velocity", "axis.acceleration", "axis.position"]
    for region in got.where.regions:
        assert sum(each.share for each in region.bins) == pytest.approx(1.0)
        assert sum(each.occupancy for each in region.bins) == pytest.approx(1.0)
    assert len(got.where.sentences) == len(names)
    with pytest.raises(KeyError, match="there are time, frequency"):
        got.where["colour"]


def test_a_burst_is_found_in_its_slice_of_time() -> None:
    residual = 1e-4 * white()
    residual[1600:1700] += 0.1
    region = compare(run_with(residual), log())["axis.position"].where["time"]
    assert len(region.bins) == 20
    assert (region.worst.low, region.worst.high) == pytest.approx((8.0, 9.0), abs=0.01)
    assert region.worst.share > 0.99
    assert region.sentence == "100 % of the residual's energy lies between 8 and 9 s, 5 % of the time."
    later = time_region(residual, 1.7e9 + np.arange(residual.size) / RATE)  # the clock of a computer
    assert "lies between 8 and 9 s from the first sample, 5 %" in later.sentence


def test_a_tone_is_found_in_its_octave() -> None:
    exp = log()
    region = compare(run_with(0.01 * np.sin(2 * np.pi * 17 * exp.time)), exp)["axis.position"].where["frequency"]
    assert (region.worst.low, region.worst.high) == pytest.approx((12.5, 25.0))
    assert region.worst.share > 0.99
    assert "lies between 12.5 and 25 Hz, where the measured signal has almost nothing" in region.sentence


def test_missing_coulomb_friction_shows_in_the_sign_of_the_velocity() -> None:
    exp = log()
    where = compare(run_with(0.02 * np.sign(speed(exp)) + 0.005), exp)["axis.position"].where
    assert where["axis.velocity"].sentence.startswith(
        "The mean residual is +0.025 m when axis moves forward and -0.015 m when it moves backward"
    )
    bins = where["axis.velocity"].bins
    assert bins[0].mean == pytest.approx(-0.015, abs=1e-4)
    assert bins[-1].mean == pytest.approx(0.025, abs=1e-4)
    assert "spread evenly" in where["time"].sentence


def test_a_residual_at_low_speed_and_one_at_one_place() -> None:
    exp = log()
    slow = np.abs(speed(exp)) < 0.05 * np.abs(speed(exp)).max()
    region = compare(run_with(np.where(slow, 0.01, 1e-5)), exp)["axis.position"].where["axis.speed"]
    low = [each for each in region.bins if each.high <= 0.0501 * np.abs(speed(exp)).max()]
    assert sum(each.share for each in low) > 0.95
    assert region.sentence.startswith("100 % of the residual's energy lies below 0.0314 m/s, 3 % of the time")
    place = np.abs(exp["axis.position"] - 0.3) < 0.04
    region = compare(run_with(np.where(place, 0.01, 1e-5)), exp)["axis.position"].where["axis.position"]
    assert region.worst.low < 0.3 < region.worst.high


def test_restarts_tell_how_the_error_grows() -> None:
    exp = log(4000)
    since = (np.arange(4000) % 100) / RATE
    run = replace(run_with(since**2, exp), mode="restarts", starts=np.arange(0, 4000, 100))
    got = compare(run, exp)["axis.position"]
    region = got.where["time since restart"]
    assert len(region.bins) == 5
    assert region.worst is region.bins[-1]
    assert "above 0.297 s after a restart" in region.sentence or "above 0.396 s after a restart" in region.sentence
    assert got.autocorrelation.values.size == 26  # a quarter of a piece


def test_without_a_measured_position_the_simulated_motion_says_where() -> None:
    exp = Experiment.from_arrays(log().time, {"axis.effort": white()}, {"axis.effort": "N"})
    values = np.column_stack([np.zeros(4000), speed(log())])
    run = made_up(exp, values, ("axis.effort", "axis.velocity"), ("N", "m/s"))
    got = compare(run, exp)
    assert list(got.state) == ["axis.velocity"]
    assert got.state_units == {"axis.velocity": "m/s"}
    assert "m/s of the time" not in got["axis.effort"].where["axis.speed"].sentence


# ---- the result ------------------------------------------------------------------------------------------------------


def test_it_is_a_result(tmp_path: Path) -> None:
    got = compare(run_with(0.01 * white()), log())
    assert Comparison.load(got.save(tmp_path / "c.npz")) == got
    frame = got.to_frame()
    assert frame["channel"].tolist() == ["axis.position"]
    assert frame["rmse"][0] == pytest.approx(got["axis.position"].rmse)
    assert repr(got).startswith("Comparison(model='slide', experiment='log', mode='free_run'")
    assert "\n" not in repr(got)
    assert "rms error 0.009984 m, 2.82 % of the signal, fit 97.18 %" in str(got)
    assert "<table>" in got._repr_html_()


def test_every_mode_of_a_simulation_can_be_compared(emps: Model) -> None:
    time = np.arange(3000) / 1000
    reference = 0.05 * (1 - np.cos(2 * np.pi * 0.8 * time))
    exp = Experiment.from_arrays(
        time,
        {"axis.position": reference, "drive.command": 2 * np.sin(5 * time), "drive.reference": reference},
        name="made up",
        model=emps,
    )
    expected = {
        "free_run": {"axis.position"},
        "restarts": {"axis.position"},
        "closed_loop": {"axis.position", "drive.command"},
        "inverse_dynamics": {"axis.effort"},
    }
    for mode, channels in expected.items():
        got = compare(simulate(emps, exp, mode), exp)
        assert {each.channel for each in got.channels} == channels, mode
        assert all(np.isfinite(each.relative_error) for each in got.channels)


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
    ran("compare", str(demo.MODEL), str(demo.TRAIN), "--mcap", str(tmp_path / "gap.mcap"))
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
