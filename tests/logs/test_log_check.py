"""Logs with a wrong unit, sign, name or clock, of a machine that was written by a textbook's equations."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

import geared_turntables
import textbook_arm
import vpm
from command_line import vpm as run_vpm
from flexible_link import one_flexible_link
from nightly import at_night
from vpm import demo
from vpm.errors import ExperimentError, ModelError
from vpm.log_check import Finding, Settings
from vpm.log_check.checking import doubted
from vpm.log_check.correction import Correction
from vpm.log_check.stretches import odd_stretches
from vpm.log_check.table import corrected_text, line_of
from vpm.numbers import Array

Columns = dict[str, Array]

MODEL = vpm.Model.from_toml(textbook_arm.FILE)
GEARED = geared_turntables.MODEL
SLIDE_FILE = """
    name = "slide"
    gravity = [0.1, 0.0, -9.81]
    bodies.table = { mass = { value = 2.0, uncertainty = 0.2 } }
    joints.slide = { type = "prismatic", parent = "world", child = "table", axis = [1.0, 0.0, 0.0] }
    actuators.drive = { joint = "slide", gain = 1.0, command_unit = "N" }
"""
SLIDE = vpm.Model.from_toml(SLIDE_FILE)
PLAIN = textbook_arm.Arm()
#: Faults of the machine itself, none of which is a mistake of the log.
FAULTS = {
    "none": PLAIN,
    "friction": textbook_arm.Arm(friction=(1.5, 0.8)),
    "weak drives": textbook_arm.Arm(strength=0.7),
    "late commands": textbook_arm.Arm(delay=0.012),
}


def record(columns: Columns, name: str = "log") -> vpm.Experiment:
    names = {"q1": "one.position", "q2": "two.position", "i1": "m1.command", "i2": "m2.command"}
    values = {channel: columns[column] for column, channel in names.items()}
    return vpm.Experiment.from_arrays(columns["t"], values, {}, name=name, model=MODEL)


def scaled(column: str, factor: float) -> Callable[[Columns], Columns]:
    return lambda columns: {**columns, column: factor * columns[column]}


def exchanged(first: str, second: str) -> Callable[[Columns], Columns]:
    return lambda columns: {**columns, first: columns[second], second: columns[first]}


def stamped_late(column: str, samples: int) -> Callable[[Columns], Columns]:
    return lambda columns: {
        **columns,
        column: np.interp(np.arange(columns["t"].size) - samples, np.arange(columns["t"].size), columns[column]),
    }


def both(*changes: Callable[[Columns], Columns]) -> Callable[[Columns], Columns]:
    def change(columns: Columns) -> Columns:
        for one in changes:
            columns = one(columns)
        return columns

    return change


MISTAKES: dict[str, tuple[Callable[[Columns], Columns], str, tuple[str, ...], float]] = {
    "degrees": (scaled("q1", 180.0 / np.pi), "unit", ("one.position",), np.pi / 180.0),
    "turns": (scaled("q2", 0.5 / np.pi), "unit", ("two.position",), 2.0 * np.pi),
    "all in degrees": (
        both(scaled("q1", 180.0 / np.pi), scaled("q2", 180.0 / np.pi)),
        "unit",
        ("one.position", "two.position"),
        np.pi / 180.0,
    ),
    "milliampere": (scaled("i2", 1e3), "unit", ("m2.command",), 1e-3),
    "divided twice": (scaled("i1", 1e-3), "scale", ("m1.command",), 1e3),
    "ten times": (scaled("i1", 10.0), "scale", ("m1.command",), 0.1),
    "encoder turned round": (scaled("q2", -1.0), "sign", ("two.position",), -1.0),
    "command turned round": (scaled("i1", -1.0), "sign", ("m1.command",), -1.0),
    "joint turned round": (
        both(scaled("q1", -1.0), scaled("i1", -1.0)),
        "sign",
        ("one.position", "m1.command"),
        -1.0,
    ),
    "encoders exchanged": (exchanged("q1", "q2"), "swap", ("one.position", "two.position"), 1.0),
    "commands exchanged": (exchanged("i1", "i2"), "swap", ("m1.command", "m2.command"), 1.0),
    "milliseconds": (scaled("t", 1e3), "clock", ("time",), 1e-3),
    "kiloseconds": (scaled("t", 1e-3), "clock", ("time",), 1e3),
}


#: One of each kind.
DAILY = ("degrees", "milliampere", "divided twice", "joint turned round", "commands exchanged", "milliseconds")


@pytest.fixture(scope="module")
def logs() -> dict[str, Columns]:
    return {name: textbook_arm.log(arm, seed) for seed, (name, arm) in enumerate(FAULTS.items(), 1)}


@pytest.mark.parametrize("fault", at_night(["none", "friction"], but=["none"]))
@pytest.mark.parametrize("mistake", at_night(MISTAKES, but=DAILY))
def test_names_the_mistake_of_a_log(logs: dict[str, Columns], fault: str, mistake: str) -> None:
    change, kind, channels, factor = MISTAKES[mistake]
    found = vpm.check_log(MODEL, record(change(logs[fault])), workers=1)
    (one,) = found.mistakes
    assert kind in {one.kind, "clock" if one.kind == "clock" else kind}
    assert set(one.channels) == set(channels)
    assert one.factor == pytest.approx(factor)
    assert max(found.shares.values()) < 0.1


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_the_machine_is_no_mistake(logs: dict[str, Columns], fault: str) -> None:
    assert vpm.check_log(MODEL, record(logs[fault]), workers=1).mistakes == ()


@pytest.mark.parametrize("seed", at_night(range(6), but=[0]))
def test_friction_far_above_inertia_is_no_mistake(seed: int) -> None:
    found = vpm.check_log(GEARED, geared_turntables.log(seed), workers=1)
    assert found.mistakes == ()
    assert max(found.shares.values()) < 0.01


@pytest.mark.parametrize("seed", at_night(range(4), but=[0]))
def test_names_a_mistake_beside_friction_far_above_inertia(seed: int) -> None:
    found = vpm.check_log(GEARED, geared_turntables.log(seed, (1.0, 180.0 / np.pi)), workers=1)
    (one,) = found.mistakes
    assert (one.kind, one.channels) == ("unit", ("two.position",))


def test_a_log_of_which_the_model_explains_nothing_is_not_called_right(logs: dict[str, Columns]) -> None:
    """Numbers of samples read as seconds: a factor that is no unit of time."""
    found = vpm.check_log(MODEL, record(scaled("t", 37.0)(logs["none"])), workers=1)
    assert found.mistakes == ()
    (one,) = (each for each in found.findings if each.kind == "unexplained")
    assert one.channels == ("one.position", "two.position")
    assert "sampling time" in one.repair


def test_a_closed_loop_without_efforts_is_explained_by_its_motion() -> None:
    """No efforts follow from the motion of a loop, so they tell nothing of its log."""
    model = vpm.Model.load("examples/loops/parallelogram.toml")
    time = np.arange(3000) / 500.0
    command = {"motor.command": 12.0 + 4.0 * np.sin(4.0 * time) + 2.0 * np.sin(9.0 * time)}
    run = vpm.simulate(model, vpm.Experiment.from_arrays(time, command, model=model))
    logged = {**command, "left_crank.position": run["left_crank.position"]}
    found = vpm.check_log(model, vpm.Experiment.from_arrays(time, logged, model=model), workers=1)
    assert "unexplained" not in {one.kind for one in found.findings}


def test_no_machine_moves_before_its_command(logs: dict[str, Columns]) -> None:
    log = record(stamped_late("i2", 5)(logs["none"]))
    (one,) = vpm.check_log(MODEL, log, workers=1).mistakes
    assert (one.kind, one.channels) == ("delay", ("m2.command",))
    assert one.delay == pytest.approx(0.02, abs=0.002)


@pytest.mark.parametrize("samples", at_night([-25, 20], but=[-25]))
def test_a_long_delay_is_found_to_a_tenth_of_a_sample(logs: dict[str, Columns], samples: int) -> None:
    """A command 80 ms late, an encoder 100 ms early: far from what is linear in a delay."""
    column, channel = ("i2", "m2.command") if samples > 0 else ("q1", "one.position")
    first, *_ = vpm.check_log(MODEL, record(stamped_late(column, samples)(logs["none"])), workers=1).mistakes
    assert (first.kind, first.channels) == ("delay", (channel,))
    assert first.delay == pytest.approx(samples / 250.0, abs=4e-4)


def test_constant_forces_and_drag_do_not_hide_a_delay() -> None:
    """A slide with a push of a spring and drag of air that nobody wrote down; its command is stamped 30 ms late."""
    time = np.arange(0.0, 10.0, 0.004)
    way, speed, acceleration = (
        sum(size * w**order * np.sin(w * time + order * np.pi / 2.0) for size, w in ((0.1, 2.0), (0.03, 9.0)))
        for order in range(3)
    )
    force = 2.1 * acceleration + 3.0 * speed + 1.0 + 4.0 * speed * np.abs(speed)
    noise = 1e-6 * np.random.default_rng(4).standard_normal(time.size)
    held = np.interp(time + 0.002 - 0.03, time, force)  # for a whole sample, so that of its middle
    columns = {"slide.position": way + noise, "drive.command": held}
    log = vpm.Experiment.from_arrays(time, columns, {}, model=SLIDE)
    first, *_ = vpm.check_log(SLIDE, log, workers=1).findings
    assert first.kind == "delay"
    assert abs(first.delay) == pytest.approx(0.03, abs=4e-4)
    assert "ms early, or " in first.sentence or "ms late, or " in first.sentence


@pytest.mark.nightly
def test_a_pressure_ten_times_too_large_is_named_although_the_first_state_was_drawn_from_it() -> None:
    from blind import proving

    case = proving.make([proving.Job("servo_cylinder", "none", (), 3, 1.0)])[0][1]
    assert case is not None
    log = case.train[0]
    wrong = log.with_channel("servo.pressure_b", 10.0 * log["servo.pressure_b"], "Pa")
    (one,) = vpm.check_log(case.model(), wrong, workers=1).mistakes
    assert one.channels == ("servo.pressure_b",)
    assert one.factor == pytest.approx(0.1)


def held_slide(duration: float = 8.0, late: float = 0.02) -> tuple[vpm.Model, Columns]:
    """A slide whose controller is drawn behind its reference, by Newton's law, with its own acceleration."""
    loop = (
        'type = "cascade", actuator = "drive", measures = "slide.position", position_gain = 10.0, velocity_gain = 5.0'
    )
    ruler = 'sensors.ruler = { measures = "slide.position" }'
    model = vpm.Model.from_toml(f"{SLIDE_FILE}{ruler}\ncontrollers.servo = {{ {loop} }}")
    time = np.arange(0.0, duration, 0.002)
    way, rate = np.array([[0.1], [0.04]]), np.pi * np.array([[0.8], [2.2]])
    place, asked = (np.sum(way * np.sin(rate * (time + shift)), axis=0) for shift in (0.0, late))
    acceleration = np.sum(-way * rate**2 * np.sin(rate * time), axis=0)
    columns = {
        "slide.position": place,
        "drive.command": 2.0 * (acceleration - 0.1),
        "drive.reference": asked,
        "slide.acceleration": acceleration,
    }
    return model, {"time": time, **columns}


def mistakes_of(model: vpm.Model, columns: Columns) -> list[tuple[str, tuple[str, ...], float]]:
    values = {name: column for name, column in columns.items() if name != "time"}
    log = vpm.Experiment.from_arrays(columns["time"], values, {}, model=model)
    return [(one.kind, one.channels, one.factor) for one in vpm.check_log(model, log).mistakes]


@pytest.mark.parametrize(
    ("channel", "factor", "kind"),
    [
        ("drive.reference", 1e3, "unit"),
        ("drive.reference", -1.0, "sign"),
        ("slide.acceleration", 1.0 / 9.80665, "unit"),
        ("slide.acceleration", -1.0, "sign"),
    ],
)
def test_a_channel_that_no_tracker_compares_is_judged_by_what_tells_it(channel: str, factor: float, kind: str) -> None:
    model, columns = held_slide()
    assert not mistakes_of(model, columns)
    ((found, channels, repair),) = mistakes_of(model, scaled(channel, factor)(columns))
    assert (found, channels) == (kind, (channel,))
    assert repair == pytest.approx(1.0 / factor)


def test_a_reference_is_judged_by_all_of_a_record() -> None:
    model, columns = held_slide(20.0)
    columns["drive.reference"][columns["time"] < 6.0] = 0.0  # the controller takes over late
    assert not mistakes_of(model, columns)
    ((kind, channels, factor),) = mistakes_of(model, scaled("drive.reference", 1e3)(columns))
    assert (kind, channels) == ("unit", ("drive.reference",))
    assert factor == pytest.approx(1e-3)


def test_a_reference_that_is_hardly_followed_has_no_scale() -> None:
    model, columns = held_slide()
    assert not mistakes_of(model, scaled("drive.reference", 3.0)(columns))
    assert not mistakes_of(model, {**columns, "drive.reference": 0.1 * np.sign(np.sin(9.0 * columns["time"]))})


def test_a_sensor_that_stands_still_says_nothing_of_other_channels() -> None:
    model, columns = held_slide()
    found = mistakes_of(model, {**columns, "slide.position": np.full_like(columns["time"], -1e-5)})
    assert not {"drive.reference", "slide.acceleration"} & {name for _, channels, _ in found for name in channels}


@pytest.mark.parametrize("samples", [25, 220, 500])
def test_a_short_log_says_nothing_of_delays(logs: dict[str, Columns], samples: int) -> None:
    short = record({name: column[:samples] for name, column in logs["friction"].items()})
    assert vpm.check_log(MODEL, short, workers=1).mistakes == ()


def test_a_late_answer_may_be_the_clock_or_the_machine(logs: dict[str, Columns]) -> None:
    found = vpm.check_log(MODEL, record(logs["late commands"]), workers=1).findings
    late = [one for one in found if one.kind == "delay"]
    assert late
    assert not late[0].mistake
    assert "or a delay of the machine" in late[0].sentence


@pytest.mark.nightly
def test_two_mistakes_are_found_one_after_the_other(logs: dict[str, Columns]) -> None:
    log = record(both(scaled("q1", 180.0 / np.pi), scaled("i2", 1e3))(logs["none"]))
    found = vpm.check_log(MODEL, log, workers=1).mistakes
    assert {one.channels for one in found} == {("one.position",), ("m2.command",)}


def swung_link(changed: Mapping[str, float]) -> tuple[vpm.LogCheck, list[str]]:
    """Check of a bending link that rubs and carries more than its file allows; channels ``changed`` by factors."""
    text = one_flexible_link("strain(2)", young="2.1e11", section=(0.03, 0.004), damping=1.0, gains=(40.0, 4.0))
    loaded = text.replace("mass = 0.2", "mass = 0.23")
    machine = vpm.Model.from_toml(loaded).with_effect("coulomb_friction", "shoulder", coulomb=0.15)
    time = 0.002 * np.arange(3000)
    swing = np.minimum(time, 1.0) * (0.6 * np.sin(np.pi * time) + 0.2 * np.sin(2.6 * np.pi * time))
    asked = vpm.Experiment.from_arrays(time, {"motor.reference": swing}, {}, name="swing", model=machine)
    run = vpm.simulate(machine, asked, mode="closed_loop")
    noise = np.random.default_rng(3).normal(size=(2, len(time)))
    columns = {
        "shoulder.position": run["shoulder.position"] + 1e-5 * noise[0],
        "root.strain": run["root.strain"] + 1e-7 * noise[1],
        "motor.command": run["motor.command"],
    }
    columns |= {name: factor * columns[name] for name, factor in changed.items()}
    log = vpm.Experiment.from_arrays(time, columns, {}, name="swing", model=machine)
    stated = vpm.Model.from_toml(text.replace("mass = 0.2", "mass = { value = 0.2, uncertainty = 0.002 }"))
    tried: list[str] = []
    return vpm.check_log(stated, log, workers=1, progress=lambda _, name, *_counts: tried.append(name)), tried


def test_no_unit_of_a_bending_link_is_tried_whose_efforts_follow_from_its_motion() -> None:
    check, tried = swung_link({})
    assert not check.mistakes
    # A slow tracker needs a load that the file rules out; what bends along the motion does not.
    assert not [name for name in tried if " in " in name or " times " in name]


#: Channel of a bending link, what its readings are times the true ones, and the mistake that this is.
BENDING = [
    ("shoulder.position", np.degrees(1.0), "unit"),
    ("root.strain", -1.0, "sign"),
    ("motor.command", 1e3, "unit"),
]


@pytest.mark.parametrize(
    ("channel", "factor", "kind"),
    at_night(BENDING, but=BENDING[:2]),
)
def test_names_the_mistake_of_a_bending_link(channel: str, factor: float, kind: str) -> None:
    check, _ = swung_link({channel: factor})
    assert [(one.kind, one.channels) for one in check.mistakes] == [(kind, (channel,))]


def test_what_leaves_another_joint_unexplained_is_told_and_not_believed() -> None:
    found = Finding("scale", ("m2.command",), ("log",), "m2.command is ten times too large", "correct it", mistake=True)
    told = doubted(found, {"one.position"})
    assert not told.mistake
    assert "one.position stays unexplained with that, so that it may come from what the model lacks" in str(told)
    assert doubted(told, {"one.position"}) is told


@pytest.mark.parametrize(
    ("fault", "channels"),
    at_night([(f, c) for f in ("none", "friction") for c in ("one", "all")], but=[("friction", "one")]),
)
def test_finds_two_mistakes_that_hide_each_other(logs: dict[str, Columns], fault: str, channels: str) -> None:
    """Degrees and milliamperes of one joint: either alone makes the log less likely, or hardly more."""
    joints = "12" if channels == "all" else "1"
    changes = [scaled(f"q{n}", 180.0 / np.pi) for n in joints] + [scaled(f"i{n}", 1e3) for n in joints]
    found = vpm.check_log(MODEL, record(both(*changes)(logs[fault])), workers=1).mistakes
    named = {"one.position", "m1.command"} | ({"two.position", "m2.command"} if channels == "all" else set())
    assert {one.kind for one in found} == {"unit"}
    assert {channel for one in found for channel in one.channels} == named
    assert all("with both corrected" in one.sentence for one in found)


def test_a_value_that_the_file_rules_out_is_no_explanation(logs: dict[str, Columns]) -> None:
    """A gain ten times as small explains a command ten times as large, but the file says what the gain is."""
    file = textbook_arm.FILE.replace("gain = 4.0", "gain = { value = 4.0, uncertainty = 0.2 }")
    found = vpm.check_log(vpm.Model.from_toml(file), record(scaled("i1", 10.0)(logs["friction"])), workers=1)
    (one,) = found.mistakes
    assert one.channels == ("m1.command",)
    assert one.factor == pytest.approx(0.1)
    assert "only with m1.gain" in one.sentence


def test_a_mirror_image_that_explains_nearly_everything_is_not_believed() -> None:
    """A slide on a slope, written in a frame turned round: only its weight tells, and that is small."""
    time = np.arange(0.0, 8.0, 0.004)
    way = 0.1 * np.sin(5.0 * time) + 0.05 * np.sin(11.0 * time)
    acceleration = -2.5 * np.sin(5.0 * time) - 6.05 * np.sin(11.0 * time)
    force = 2.1 * (acceleration - 0.1)
    noise = 1e-6 * np.random.default_rng(4).standard_normal((2, time.size))
    for sign in (1.0, -1.0):
        columns = {"slide.position": sign * way + noise[0], "drive.command": sign * force + noise[1]}
        found = vpm.check_log(SLIDE, vpm.Experiment.from_arrays(time, columns, {}, model=SLIDE), workers=1)
        assert [one.channels for one in found.mistakes] == ([] if sign > 0.0 else [tuple(columns)])


@pytest.mark.nightly
def test_the_same_mistake_of_two_logs_is_told_once(logs: dict[str, Columns]) -> None:
    wrong = scaled("q2", -1.0)
    records = [record(wrong(logs[name]), name) for name in ("none", "friction")]
    (one,) = vpm.check_log(MODEL, records, workers=1).mistakes
    assert one.records == ("none", "friction")


@pytest.mark.nightly
def test_a_command_that_does_nothing_has_no_scale() -> None:
    """Without the drive every small factor does as well, so that none of them is its scale."""
    columns = textbook_arm.log(PLAIN, 9)
    noise = np.random.default_rng(9).standard_normal(len(columns["t"]))
    found = vpm.check_log(MODEL, record({**columns, "i2": 20.0 * noise}), workers=1)
    assert [one for one in found.mistakes if one.kind in {"unit", "scale"}] == []
    assert found.shares["two.position"] > 0.5


def test_says_of_which_parameters_a_log_says_nothing() -> None:
    spring = 'effects = [{ type = "spring", at = "two", stiffness = { value = 0.0, uncertainty = 1e-6 } }]'
    file = textbook_arm.FILE.replace('name = "textbook arm"', f'name = "textbook arm"\n{spring}')
    (one,) = vpm.check_log(vpm.Model.from_toml(file), record(textbook_arm.log(PLAIN, 5)), workers=1).findings
    assert one.kind == "unseen"
    assert "spring" in one.sentence


def test_what_one_log_shows_is_not_called_unseen_for_another() -> None:
    """The first instants of a motion say nothing of a mass, and the whole one does."""
    moving = record(textbook_arm.log(PLAIN, 5), "moving")
    model = vpm.Model.from_toml(textbook_arm.FILE)
    short = record({name: values[: len(values) // 50] for name, values in textbook_arm.log(PLAIN, 5).items()}, "short")
    (alone,) = vpm.check_log(model, short, workers=1).findings
    assert (alone.kind, alone.records) == ("unseen", ("short",))
    assert vpm.check_log(model, [short, moving], workers=1).findings == ()


def test_refuses_to_conclude_anything_from_such_a_log(logs: dict[str, Columns]) -> None:
    log = record(scaled("i1", 1e3)(logs["friction"]))
    with pytest.raises(ExperimentError, match=r"m1\.command is in mA, not in A.*leave out its check"):
        vpm.diagnose(MODEL, log, workers=1)


def test_a_diagnosis_notes_what_may_be_the_clock(logs: dict[str, Columns]) -> None:
    why = vpm.diagnose(MODEL, record(logs["late commands"]), effects=["coulomb_friction"], workers=1)
    assert "a clock of the log, or a delay of the machine" in why.notes[0]


def odd(values: Array, **numbers: float) -> list[Finding]:
    log = vpm.Experiment.from_arrays(
        np.arange(len(values)) / 500.0, {"one.position": values}, {}, name="log", model=MODEL
    )
    return list(odd_stretches(log, ["one.position"], [], Settings(**numbers)))  # type: ignore[arg-type]


def swing(noise: float = 1e-4) -> Array:
    time, drawn = np.arange(4000) / 500.0, np.random.default_rng(3)
    return np.asarray(np.sin(3.0 * time) + 0.3 * np.sin(11.0 * time + 1.0) + noise * drawn.standard_normal(4000))


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_nothing_is_odd_about_a_swing(noise: float) -> None:
    assert odd(swing(noise)) == []


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_finds_a_sensor_that_stood_still(noise: float) -> None:
    values = swing(noise)
    values[1000:1200] = values[1000]
    (one,) = odd(values)
    assert (one.kind, "from 2 s to 2.398 s" in one.sentence) == ("frozen", True)


def test_a_joint_at_rest_is_no_sensor_that_stood_still() -> None:
    values = swing(0.0)
    values[: len(values) // 2] = values[len(values) // 2]
    assert odd(values) == []


@pytest.mark.parametrize(("step", "digits"), [(1e-4, 16), (2.29e-4, 5)])
def test_a_rest_before_the_motion_is_no_sensor_that_stood_still(step: float, digits: int) -> None:
    """Noise below the step of an encoder does not move it at rest, though hardly two samples are alike in motion."""
    values = np.concatenate([np.zeros(40), swing(2e-5)[1000:] - swing(0.0)[1000]])
    assert odd(np.round(np.round(values / step) * step, digits)) == []


def test_a_reading_that_repeats_while_the_other_sensors_rest_did_not_stand_still() -> None:
    """Dry friction holds both joints: noise of 0.3 steps leaves the one's encoder on one value, and the other rests."""
    drawn = np.random.default_rng(8)
    moved = [swing(0.0), swing(0.0)[::-1]]
    held = [np.concatenate([one[:2000], np.full(60, one[2000]), one[2000:]]) for one in moved]
    # The first one is a difference of two encoders, so that its own steps are finer than its noise.
    noise = 1e-4 * drawn.standard_normal(len(held[0]))
    noise[2000:2060] = 0.0
    first = held[0] + noise
    first[2000:2060] = first[2000]

    def kinds(second: Array) -> list[str]:
        columns = {"one.position": first, "two.position": second}
        log = vpm.Experiment.from_arrays(np.arange(len(first)) / 500.0, columns, {}, name="log", model=MODEL)
        return [one.kind for one in odd_stretches(log, list(columns), [], Settings())]

    resting = held[1] + 1e-4 * drawn.standard_normal(len(first))
    assert kinds(resting) == []
    assert kinds(resting + 0.3 * np.sin(40.0 * np.arange(len(first)) / 500.0)) == ["frozen"]


def test_finds_spikes() -> None:
    values = swing()
    values[[700, 1900]] += 0.5
    (one,) = odd(values)
    assert (one.kind, "2 spikes, the first at 1.4 s" in one.sentence) == ("spikes", True)


def test_finds_what_was_cut_off() -> None:
    found = odd(np.clip(swing(), -2.0, 0.9))
    assert [one.kind for one in found] == ["clipped"]
    assert "largest value, 0.9," in found[0].sentence


def test_a_speed_reference_of_ramps_and_plateaus_is_not_cut_off() -> None:
    """A crane is told to travel at several speeds, each of which is held; its fastest one is no limit."""
    time = np.arange(3000) / 50.0
    goals = np.repeat([0.0, 0.5, 0.0, -0.35, 0.6, 0.15, -0.6, 0.0, 0.3, 0.0], 300)
    command, now = np.empty(len(time)), 0.0
    for k, goal in enumerate(goals):  # the inverter's ramp, 0.3 m/s2
        now += float(np.clip(goal - now, -0.3 / 50.0, 0.3 / 50.0))
        command[k] = now
    log = vpm.Experiment.from_arrays(time, {"m1.command": np.round(command, 3)}, {}, name="log", model=MODEL)
    assert list(odd_stretches(log, [], ["m1.command"], Settings())) == []
    limited = np.clip(4.0 * np.sin(1.3 * time) + 3.0 * np.sin(2.1 * time), -5.0, 5.0)
    log = vpm.Experiment.from_arrays(time, {"m1.command": limited}, {}, name="log", model=MODEL)
    assert [one.kind for one in odd_stretches(log, [], ["m1.command"], Settings())] == ["clipped", "clipped"]


def test_finds_coarse_steps() -> None:
    (one,) = odd(np.round(swing() / 0.05) * 0.05)
    assert one.kind == "coarse"


def test_a_resonance_above_the_noise_of_its_sensor_is_no_filter() -> None:
    from scipy.signal import butter, sosfilt

    noise = np.random.default_rng(5).standard_normal((2, 4000))
    shaken = np.asarray(sosfilt(butter(6, 0.25, output="sos"), 2e-3 * noise[0]))
    assert odd(swing(0.0) + shaken + 1e-4 * noise[1]) == []
    assert [one.kind for one in odd(swing(0.0) + shaken)] == ["filtered"]


def test_a_camera_that_reads_every_second_sample_was_not_filtered_before_it_was_stored(tmp_path: Path) -> None:
    """Splines through its readings have half of the noise's spectrum: the log is as the camera wrote it."""
    place, angle = swing(1e-3), swing(1e-3)[::-1]
    lines = [f"{k / 500.0},{place[k]},{'' if k % 2 else angle[k]}" for k in range(len(place))]
    (tmp_path / "log.csv").write_text("\n".join(["time,one.position,two.position", *lines]))
    log = vpm.Experiment.load(tmp_path / "log.csv", irregular="interpolate")
    assert log.slower
    assert list(odd_stretches(log, ["one.position", "two.position"], [], Settings())) == []


def test_finds_what_was_filtered_before_it_was_stored() -> None:
    from scipy.signal import butter, sosfilt

    assert [one.kind for one in odd(np.asarray(sosfilt(butter(4, 0.3, output="sos"), swing())))] == ["filtered"]


def test_what_loading_interpolated_was_not_filtered_before(tmp_path: Path) -> None:
    """A slow bus reads a position in every second row: its noise is white up to half of the slower rate."""
    values, rate = swing(1e-3), 500.0
    rows = [f"{k / rate:.3f},{'' if k % 2 else f'{value:.9f}'},{value:.9f}" for k, value in enumerate(values)]
    path = tmp_path / "bus.csv"
    path.write_text("\n".join(["time,slide.position,drive.command", *rows]) + "\n")
    log = vpm.Experiment.load(path, irregular="interpolate")
    assert log.read_rate("slide.position") == pytest.approx(0.5 * rate)
    assert list(odd_stretches(log, ["slide.position"], [], Settings())) == []
    stored = vpm.Experiment.from_arrays(log.time, {"slide.position": log["slide.position"]})
    assert [one.kind for one in odd_stretches(stored, ["slide.position"], [], Settings())] == ["filtered"]


@pytest.mark.parametrize(
    "correction",
    [
        Correction(("one.position",), -1.0),
        Correction(("one.position",), np.pi / 180.0, unit="deg"),
        Correction(("m1.command",), 1e-3, unit="mA"),
        Correction(("one.position", "two.position"), swap=True),
        Correction(("time",), 1e-3, unit="ms"),
        Correction(("two.position",), delay=0.02),
    ],
)
def test_the_corrected_table_reads_the_corrected_record(correction: Correction, tmp_path: Path) -> None:
    """What a finding tells the user to write reads what was found to be right."""
    path = tmp_path / "log.csv"
    path.write_text(textbook_arm.text(textbook_arm.log(PLAIN, 2, seconds=2.0)), encoding="utf-8")
    told = vpm.Experiment.load(path, {**MODEL.channel_table, **correction.entries(MODEL.channel_table)}, MODEL)
    wanted = correction.applied(vpm.Experiment.load(path, None, MODEL))
    np.testing.assert_allclose(told.time, wanted.time, atol=1e-12)
    for channel in wanted.channels:
        np.testing.assert_allclose(told[channel], wanted[channel], atol=1e-12)


def test_writes_the_corrected_entries_and_keeps_comments_and_ends_of_lines(tmp_path: Path) -> None:
    model, log = tmp_path / "arm.toml", tmp_path / "log.csv"
    model.write_text(textbook_arm.FILE, encoding="utf-8-sig", newline="\r\n")
    wrong = both(scaled("q1", 180.0 / np.pi), scaled("q2", 180.0 / np.pi))
    log.write_text(textbook_arm.text(wrong(textbook_arm.log(PLAIN, 2))), encoding="utf-8")
    told = run_vpm("check", str(model), str(log))
    assert told.returncode == 1
    assert 'write "one.position" = { column = "q1", unit = "deg" }' in told.stdout
    assert run_vpm("check", str(model), str(log), "--fix").returncode == 0
    text = model.read_bytes().decode("utf-8")
    assert text.startswith("\ufeff")
    assert text.count("\n") == text.count("\r\n") == textbook_arm.FILE.count("\n")
    assert '"one.position" = { column = "q1", unit = "deg" }  # the encoder at the base' in text
    assert '"two.position" = { column = "q2", unit = "deg" }' in text
    again = run_vpm("check", str(model), str(log))
    assert (again.returncode, "nothing is wrong" in again.stdout) == (0, True)


def test_writes_a_table_where_there_was_none(tmp_path: Path) -> None:
    model, log = tmp_path / "arm.toml", tmp_path / "log.csv"
    model.write_text(textbook_arm.FILE.partition("[channels]")[0], encoding="utf-8")
    columns = scaled("q1", 180.0 / np.pi)(textbook_arm.log(PLAIN, 2))
    names = {"t": "time", "q1": "one.position", "q2": "two.position [rad]", "i1": "m1.command", "i2": "m2.command"}
    log.write_text(textbook_arm.text({names[key]: column for key, column in columns.items()}), encoding="utf-8")
    assert run_vpm("check", str(model), str(log), "--fix").returncode == 0
    table = vpm.Model.load(model).channel_table
    assert table["one.position"].unit == "deg"
    assert table["two.position"].column == "two.position [rad]"
    assert run_vpm("check", str(model), str(log)).returncode == 0


def test_does_not_correct_a_table_of_several_logs_for_one_of_them(tmp_path: Path) -> None:
    model, logs = tmp_path / "arm.toml", [tmp_path / "a.csv", tmp_path / "b.csv"]
    model.write_text(textbook_arm.FILE, encoding="utf-8")
    for path, factor in zip(logs, (1.0, -1.0), strict=True):
        columns = scaled("q2", factor)(textbook_arm.log(PLAIN, 2))
        path.write_text(textbook_arm.text(columns), encoding="utf-8")
    told = run_vpm("check", str(model), *map(str, logs), "--fix")
    assert told.returncode == 1
    assert "only b of 2 logs has this mistake" in told.stderr
    assert model.read_text(encoding="utf-8") == textbook_arm.FILE


def test_says_which_entry_it_cannot_replace() -> None:
    entry = MODEL.channel_table["one.position"]
    spread = '[channels."one.position"]\ncolumn = "q1"\nunit = "rad"\n'
    with pytest.raises(ModelError, match=r"the entry of one\.position does not stand on a line of its own"):
        corrected_text(spread, {"one.position": line_of("one.position", entry)}, "arm.toml")


# The fit before it weighs by a noise of nothing, and NumPy warns of that: a mistake of its own, not what is tried here.
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_channel_that_is_drawn_to_the_last_digit_is_no_infinite_knowledge() -> None:
    """An encoder that stands still is followed to rounding, beside which no slope of the model may overflow."""
    arm = vpm.Model.load(demo.MODEL)
    log = vpm.Experiment.load(demo.TRAIN, model=arm)
    data = log.data[:399].copy()
    data[:, log.channels.index("shoulder.position")] = 1.0
    stuck = vpm.Experiment("stuck", log.time[:399], data, log.channels, log.units)
    assert any("shoulder.position" in finding.channels for finding in vpm.check_log(arm, stuck, workers=1).findings)


def gusty_slide(seed: int, sign: float = 1.0) -> vpm.Experiment:
    """A slide of 2 kg under a known force and gusts that no log holds, double by double integral of sines."""
    drawn, time = np.random.default_rng(seed), np.arange(1000) / 125.0
    rates, phases = 2.0 * np.pi * drawn.uniform(0.4, 2.0, (2, 4)), drawn.uniform(0.0, 6.0, (2, 4))
    waves = np.sin(rates[..., None] * time + phases[..., None])
    force = waves[0].sum(axis=0)
    way = -np.sum((waves / rates[..., None] ** 2)[0], axis=0) - 0.6 * np.sum((waves / rates[..., None] ** 2)[1], axis=0)
    columns = {"slide.position": sign * 0.5 * way + 1e-6 * drawn.standard_normal(1000), "drive.command": force}
    return vpm.Experiment.from_arrays(time, columns, {}, name=f"gusts {seed}", model=SLIDE)


def tries(*logs: vpm.Experiment) -> int:
    """Corrections that are tried in logs of gusts, which none explains."""
    seen: list[str] = []
    check = vpm.check_log(SLIDE, logs, workers=1, progress=lambda what, *_: seen.append(what))
    assert check.mistakes == ()
    assert max(check.shares.values()) > 0.1
    return seen.count("trying")


def test_what_explains_no_record_is_not_tried_again_for_the_next_one() -> None:
    """All records have one channel table. The one of which most is left is tried."""
    assert tries(gusty_slide(1), gusty_slide(2)) in {tries(gusty_slide(1)), tries(gusty_slide(2))} - {0}


@pytest.mark.nightly
def test_a_record_that_counts_the_other_way_is_tried_beside_one_that_nothing_explains() -> None:
    assert tries(gusty_slide(1), gusty_slide(1, sign=-1.0)) > tries(gusty_slide(1))


def test_commands_beyond_the_limit_of_a_drive_are_no_wrong_unit() -> None:
    """A slide whose drive gives 4 N where its controller asks for 36 N: smaller commands leave little, a limit less."""
    random, step, place, speed = np.random.default_rng(4), 2e-3, 0.0, 0.0
    rows = []
    for target in np.repeat(random.uniform(-0.4, 0.4, 8), 400):
        asked = np.clip(400.0 * (target - place) - 20.0 * speed, -36.0, 36.0)
        rows.append((place, asked))
        for _ in range(4):
            speed += step / 4 * (np.clip(asked, -4.0, 4.0) / 2.0 + 0.1)
            place += step / 4 * speed
    places, forces = np.array(rows).T
    read = {"slide.position": places + 1e-6 * random.standard_normal(places.size), "drive.command": forces}
    log = vpm.Experiment.from_arrays(step * np.arange(places.size), read, {}, name="jumps", model=SLIDE)
    found = vpm.check_log(SLIDE, log, workers=1).findings
    assert not any(one.mistake for one in found)
    assert "or the drive gives no more than a limit" in found[0].sentence
