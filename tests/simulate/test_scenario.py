"""Scenario files: what they drive, what they start from, what they refuse, and what comes out."""

import math
import time
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import vpm
from command_line import vpm as command
from interrupting import pressed
from model_texts import on_rail
from places import EXAMPLES, ROOT
from vpm.errors import ModelError, ScenarioError
from vpm.plot.scenarios import readable_unit
from vpm.scenario import Scenario, ScenarioInterruptedError, ScenarioRun, signals

SLED = (
    on_rail("sled", gain='{ value = 3.0, unit = "N/V" }', gravity="[0.0, 0.0, -9.81]", along="[0.0, 0.0, 1.0]")
    + 'command_unit = "V"\n'
)

SERVO = """
[controllers.servo]
type = "pid"
actuator = "drive"
measures = "axis.position"
proportional = 200.0
derivative = 20.0
"""

HAND = """
[actuators.hand]
joint = "axis"
gain = 1.0
command_unit = "N"
"""

LAG = """
[[effects]]
type = "actuator_lag"
at = "drive"
time_constant = 0.01
"""

PLAIN = """
scenario = "lift"
duration = 0.2
time_step = 1e-3
[[runs]]
name = "bare"
model = "sled.toml"
"""

number = st.floats(-1e3, 1e3)
positive = st.floats(1e-2, 1e2)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "sled.toml").write_text(SLED, encoding="utf-8")
    (tmp_path / "servo.toml").write_text(SLED + SERVO, encoding="utf-8")
    return tmp_path


def scenario(folder: Path, text: str = PLAIN, **changes: Any) -> Scenario:
    return Scenario.from_dict(tomllib.loads(text) | changes, folder=folder)


# ---- signals ---------------------------------------------------------------------------------------------------------


@given(number, number, positive, number, st.floats(0.0, 1.0))
def test_sine_stays_within_its_amplitude_and_waits_for_its_start(
    mean: float, amplitude: float, frequency: float, phase: float, start: float
) -> None:
    time = np.linspace(0.0, 2.0, 201)
    values = signals.sine(time, mean, amplitude, frequency, phase, start)
    # The mean is taken off with its rounding.
    assert np.all(np.abs(values - mean) <= abs(amplitude) * (1.0 + 1e-12) + 1e-15 * abs(mean))
    assert np.all(values[time <= start] == values[0])
    assert values[0] == pytest.approx(mean + amplitude * math.sin(phase), abs=1e-9 * (1.0 + abs(amplitude)))


@given(positive, positive, positive)
def test_chirp_has_the_integral_of_its_frequency_for_a_phase(first: float, last: float, duration: float) -> None:
    time = np.linspace(0.0, duration, 2001)
    frequency = first + (last - first) * time / duration
    # The trapezoidal rule is exact for a straight line.
    turns = np.concatenate([[0.0], np.cumsum(0.5 * (frequency[1:] + frequency[:-1]) * np.diff(time))])
    expected = 1.0 + 2.0 * np.sin(2.0 * np.pi * turns)
    assert signals.chirp(time, 1.0, 2.0, first, last, duration) == pytest.approx(expected, abs=1e-6)


@given(st.lists(st.integers(0, 100), min_size=1, max_size=8).map(sorted), st.data())
def test_points_meet_their_values_and_stay_between_them(marks: list[int], data: st.DataObject) -> None:
    step = 1e-3
    at = np.array(marks) * step
    value = data.draw(arrays(np.float64, len(marks), elements=number))
    time = np.linspace(-20 * step, 139 * step, 160)
    shown = signals.points(time, at, value, step)
    assert shown.min() >= value.min() - 1e-9
    assert shown.max() <= value.max() + 1e-9
    for place, mark in enumerate(marks):  # of several at a time, the last one holds from there on
        if mark not in marks[place + 1 :]:
            assert shown[mark + 20] == pytest.approx(value[place], abs=1e-9)
    assert np.all(shown[: marks[0] + 20] == value[0])
    assert np.all(shown[marks[-1] + 20 :] == value[-1])


def test_points_are_straight_between_and_jump_where_a_time_stands_twice() -> None:
    time = np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.3])
    at, value = np.array([0.1, 0.1, 0.3]), np.array([1.0, 5.0, 7.0])
    assert signals.points(time, at, value, 0.05).tolist() == pytest.approx([1.0, 1.0, 5.0, 5.5, 6.0, 7.0])
    # A sample that misses the time of the jump by rounding shows the value behind it.
    step = 1.0 / 3.0 * 1e-2
    clock = np.arange(1000, dtype=np.float64) * np.float64(step)
    place = next(k for k in range(1, 1000) if clock[k] < k / 300.0)
    at = np.array([place / 300.0] * 2)
    shown = signals.points(clock, at, np.array([0.0, 1.0]), step)
    assert shown[place - 1 : place + 1].tolist() == [0.0, 1.0]


# ---- what runs -------------------------------------------------------------------------------------------------------


def test_a_body_falls_by_the_law_of_galilei(folder: Path) -> None:
    initial = {"axis.position": {"value": 500, "unit": "mm"}, "axis.velocity": 1.5}
    run = scenario(folder, initial=initial).run()["bare"]
    assert run["axis.position"] == pytest.approx(0.5 + 1.5 * run.time - 0.5 * 9.81 * run.time**2, abs=1e-12)
    assert run.time[-1] == pytest.approx(0.2)


def test_commands_are_those_of_a_hand_made_log(folder: Path) -> None:
    command = {"type": "sine", "mean": 6.54, "amplitude": {"value": 500, "unit": "mV"}, "frequency": 8.0, "start": 0.05}
    made = scenario(folder, commands={"drive": command}, integrator="rosenbrock", substeps=2)
    time = np.arange(201) * 1e-3
    volts = 6.54 + 0.5 * np.sin(2 * np.pi * 8.0 * np.maximum(time - 0.05, 0.0))
    model = vpm.Model.load(folder / "sled.toml")
    log = vpm.Experiment.from_arrays(time, {"drive.command": volts}, model=model)
    expected = vpm.simulate(model, log, integrator="rosenbrock", substeps=2)
    run = made.run()["bare"]
    assert run.values == pytest.approx(expected.values, rel=1e-12, abs=1e-12)
    assert run.mode == "free_run"


def test_references_close_the_loop_and_inputs_serve_elsewhere(folder: Path) -> None:
    reference = {"type": "chirp", "amplitude": {"value": 1.0, "unit": "cm"}, "from": 1.0, "to": 8.0}
    runs = [{"name": "servo", "model": "servo.toml"}]
    made = scenario(folder, runs=runs, references={"drive": reference})
    result = made.run()
    model = made.models["servo"]
    again = vpm.simulate(model, made.experiment("servo"), made.mode(model), initial_state=made.initial_state(model))
    assert np.array_equal(result["servo"].values, again.values)
    log = result.experiment("servo")
    assert {"drive.reference", "axis.position", "drive.command"} <= set(log.channels)
    fit = vpm.identify(model, [log], ["sled.mass"])
    assert fit.values[0] == pytest.approx(2.0, rel=1e-3)


def test_a_controller_without_a_reference_holds_where_it_is(folder: Path) -> None:
    initial = {"axis.position": 0.25}
    made = scenario(folder, initial=initial, runs=[{"name": "servo", "model": "servo.toml"}])
    assert np.all(made.experiment("servo")["drive.reference"] == 0.25)
    run = made.run()["servo"]
    assert run.notes == ("drive has no reference, so it holds axis.position at its initial 0.25 m.",)


def test_a_hand_without_a_controller_pushes_a_controlled_machine(folder: Path) -> None:
    (folder / "pushed.toml").write_text(SLED + HAND + SERVO, encoding="utf-8")
    push = {"type": "sine", "amplitude": 2.0, "frequency": 4.0, "mean": 1.0}
    made = scenario(folder, commands={"hand": push}, runs=[{"name": "pushed", "model": "pushed.toml"}])
    run = made.run()["pushed"]
    # The same force through the drive itself, added to what its controller commands.
    inputs = made.experiment("pushed")
    model = vpm.Model.load(folder / "servo.toml")
    values = {"drive.reference": inputs["drive.reference"], "drive.disturbance": inputs["hand.command"] / 3.0}
    log = vpm.Experiment.from_arrays(inputs.time, values, model=model)
    alone = vpm.simulate(model, log, "closed_loop")
    assert np.abs(run["axis.position"]).max() > 0.01
    assert run["axis.position"] == pytest.approx(alone["axis.position"], abs=1e-12)
    assert np.array_equal(run["hand.command"], inputs["hand.command"])


def test_runs_differ_in_effects_parameters_and_level(folder: Path) -> None:
    runs = [
        {"name": "bare", "model": "sled.toml"},
        {"name": "light", "model": "sled.toml", "set": {"sled.mass": {"value": 500, "unit": "g"}}},
        {
            "name": "rough",
            "model": "sled.toml",
            "with_effects": [{"type": "viscous_friction", "at": "axis", "viscous": {"value": 3.0, "unit": "N s/m"}}],
            "set": {"axis.friction.viscous": 4.0},
        },
    ]
    command = {"type": "constant", "value": 7.0}
    result = scenario(folder, runs=runs, commands={"drive": command}).run()
    for name, mass in (("bare", 2.0), ("light", 0.5)):
        assert result[name]["axis.acceleration"] == pytest.approx(21.0 / mass - 9.81, abs=1e-9)
    # m dv/dt = F - m g - d v from rest.
    force, time = 21.0 - 2.0 * 9.81, result.time
    assert result["rough"]["axis.velocity"] == pytest.approx(force / 4.0 * (1.0 - np.exp(-2.0 * time)), abs=1e-6)


def test_lags_and_named_states_begin_as_told(folder: Path) -> None:
    (folder / "sled.toml").write_text(SLED + LAG, encoding="utf-8")
    command = {"type": "constant", "value": 7.0}
    rest = scenario(folder, commands={"drive": command})
    assert rest.initial_state("bare").tolist() == [0.0, 0.0, 0.0]
    settled = scenario(folder, commands={"drive": command}, initial={"drive.lag": {"value": 7000, "unit": "mV"}})
    assert settled.initial_state("bare").tolist() == [0.0, 0.0, 7.0]
    assert settled.run()["bare"]["drive.force"] == pytest.approx(21.0)
    assert rest.run()["bare"]["drive.force"][0] == 0.0


def test_logged_supplies_have_the_pressure_that_is_given_or_that_of_the_model(folder: Path) -> None:
    text = (EXAMPLES / "servo_cylinder" / "rig.toml").read_text(encoding="utf-8")
    text = text.replace("[supplies.pump]", '[supplies.pump]\nsource = "logged"', 1)
    (folder / "rig.toml").write_text(text, encoding="utf-8")
    runs = [{"name": "rig", "model": "rig.toml"}]
    falling = {"type": "points", "time": [0.0, 0.02], "value": {"value": [140.0, 100.0], "unit": "bar"}}
    made = scenario(folder, runs=runs, supplies={"pump": falling}, duration=0.02, integrator="rosenbrock", substeps=4)
    run = made.run()["rig"]
    assert run.notes == ()
    assert run["pump.pressure"] == pytest.approx(np.linspace(140e5, 100e5, 21))
    # At rest without net force the chambers share the pressures of the pump, here the first one, and of the tank.
    begin = dict(zip(made.models["rig"].state_names, made.initial_state("rig"), strict=True))
    assert begin["servo.chamber_a"] + begin["servo.chamber_b"] == pytest.approx(141e5)
    kept = scenario(folder, runs=runs, duration=0.02, integrator="rosenbrock", substeps=4).run()["rig"]
    assert kept.notes == ("pump has no pressure over time, so it keeps the 1.6e+07 Pa of its model.",)
    assert np.all(kept["pump.pressure"] == 160e5)


def test_flexible_links_begin_in_their_equilibrium() -> None:
    made = Scenario.load(EXAMPLES / "flexible_pendulum" / "release.toml")
    model = made.models["bezier(7)"]
    place = math.radians(30.0)
    assert made.initial_state("bezier(7)")[: len(model.coordinates)] == pytest.approx(model.equilibrium([place])[0])
    assert made.models["rigid"].coordinates == ("pivot",)


# ---- results ---------------------------------------------------------------------------------------------------------


def test_a_run_that_fails_leaves_the_others(folder: Path) -> None:
    runs = [
        {"name": "bare", "model": "sled.toml"},
        {
            "name": "mad",
            "model": "servo.toml",
            "set": {"servo.proportional": -1e9, "servo.derivative": -1e9},
        },
    ]
    told: list[tuple[int, int]] = []
    result = scenario(folder, runs=runs, duration=2.0).run(progress=lambda *counts: told.append(counts))
    assert list(result.failures) == ["mad"]
    assert result.told[0].startswith('run "mad": ')
    assert result["bare"].time.size == 2001
    assert 0 < result["mad"].time.size < 2001
    assert told[-1] == (2, 2)
    # The picture shows the whole of the one that went well, whatever numbers the other came to.
    low, high = result.plot().axes[0].get_ylim()
    assert low < result["bare"]["axis.position"].min() < -19.0
    assert high - low < 25.0
    assert "failed:" in str(result)
    assert result.to_frame()["run"].value_counts()["bare"] == 2001


def test_ctrl_c_stops_all_runs(folder: Path) -> None:
    made = scenario(folder, duration=5e2, substeps=1000)
    begin = time.process_time()
    with pytest.raises(KeyboardInterrupt), pressed(0.3):
        made.run()
    assert time.process_time() - begin < 3.0


TWO = (
    PLAIN
    + """
[[runs]]
name = "again"
model = "sled.toml"
"""
)


def test_ctrl_c_keeps_the_runs_that_were_finished(folder: Path) -> None:
    def stop(*_: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(ScenarioInterruptedError) as caught:
        scenario(folder, TWO).run(progress=stop, workers=1)
    result = caught.value.result
    assert "bare" in result.runs
    assert {*result.runs, *result.failures} == {"bare", "again"}
    assert set(result.failures.values()) <= {"it was interrupted"}
    np.testing.assert_array_equal(result["bare"].values, scenario(folder).run()["bare"].values)


def test_the_command_writes_the_runs_that_were_finished(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "two.toml").write_text(TWO, encoding="utf-8")
    whole = Scenario.run

    def stopped(self: Scenario, **_: Any) -> ScenarioRun:
        result = whole(self)
        runs = {"bare": result["bare"]}
        raise ScenarioInterruptedError(replace(result, runs=runs, failures={"again": "it was interrupted"}))

    monkeypatch.setattr(Scenario, "run", stopped)
    done = command("simulate", "two.toml", "--out", "two.npz", cwd=folder)
    assert done.returncode == 130
    assert "failed: it was interrupted" in done.stdout
    assert list(ScenarioRun.load(folder / "two.npz").runs) == ["bare"]


def test_the_result_has_the_manners_of_results(folder: Path, tmp_path: Path) -> None:
    runs = [{"name": "bare", "model": "sled.toml"}, {"name": "servo", "model": "servo.toml"}]
    plot = {"panels": [["axis.position", "drive.reference"], ["drive.force"]]}
    made = scenario(folder, runs=runs, plot=plot)
    result = made.run()
    assert repr(result) == "ScenarioRun(name='lift', runs=('bare', 'servo'), samples=201)"
    assert "\n" not in repr(made)
    assert "drive.force" in result._repr_html_()
    assert ScenarioRun.load(result.save(tmp_path / "lift.npz")) == result
    table = result.to_frame()
    assert list(table.columns[:3]) == ["run", "time", "axis.position"]
    assert len(table) == 402
    row = next(row for row in result.extremes("bare") if row.channel == "axis.position")
    fallen = -0.5 * 9.81 * 0.2**2
    assert (row.unit, row.least, row.largest, row.final) == pytest.approx(("m", fallen, 0.0, fallen))
    figure = result.plot()
    assert [len(axis.lines) for axis in figure.axes] == [3, 2]  # the bare sled follows no reference
    with pytest.raises(ScenarioError, match='did you mean "bare"'):
        result["bear"]


def test_columns_of_the_picture_stand_side_by_side_on_one_scale(folder: Path) -> None:
    runs = [{"name": "bare", "model": "sled.toml"}, {"name": "servo", "model": "servo.toml"}]
    plot = {"panels": [["axis.position"], ["drive.force"]], "columns": {"open": ["bare"], "closed": ["servo"]}}
    figure = scenario(folder, runs=runs, plot=plot).run().plot()
    assert [len(axis.lines) for axis in figure.axes] == [1, 1, 1, 1]
    assert figure.axes[0].get_ylim() == figure.axes[1].get_ylim()
    assert figure.axes[0].lines[0].get_color() != figure.axes[1].lines[0].get_color()
    assert {text.get_text() for axis in figure.axes for text in axis.texts} == {"open", "closed"}


@pytest.mark.parametrize(
    ("unit", "largest", "shown"),
    [("Pa", 1.6e7, "bar"), ("m", 0.05, "mm"), ("m", 0.5, "m"), ("N", 5e4, "kN"), ("rad", 1e-3, "rad"), ("m", 0.0, "m")],
)
def test_pictures_use_units_that_people_read(unit: str, largest: float, shown: str) -> None:
    assert readable_unit(unit, largest) == shown


def test_without_panels_positions_and_forces_are_shown(folder: Path) -> None:
    assert scenario(folder).panels == (("axis.position",), ("drive.force",))


# ---- refusals --------------------------------------------------------------------------------------------------------

POINTS = {"type": "points", "time": [0.0, 0.1], "value": [0.0, 0.1]}
SERVED = [{"name": "servo", "model": "servo.toml"}]


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"durations": 1.0}, 'durations is not a known key; did you mean "duration"?'),
        ({"duration": None}, "duration has to be a number or a table"),
        ({"duration": 0.0}, "duration is 0 s, but has to be above 0 s; correct it"),
        ({"time_step": -1e-3}, "time_step is -0.001 s, but has to be above 0 s"),
        ({"duration": {"value": 1.0, "unit": "kg"}}, 'duration is wrong: unit "kg" is of the kind kg'),
        (
            {"time_step": 3e-3},
            "time_step is 0.003 s, which does not divide the duration of 0.2 s (66.6667 steps); write for example "
            "0.00298507",
        ),
        ({"time_step": 1e-12}, "which makes 2e+11 samples"),
        ({"integrator": "euler"}, "integrator is wrong: unknown integrator 'euler'"),
        ({"substeps": 0}, "substeps is 0, but has to be 1 or more"),
        ({"runs": []}, "runs is empty; add a table [[runs]]"),
        ({"runs": [{"name": "a"}]}, 'runs[0].model is missing; add it, for example model = "arm.toml"'),
        (
            {"runs": [{"name": "a", "model": "sled.toml", "sets": {}}]},
            'runs[0].sets is not a known key; did you mean "set"?',
        ),
        ({"runs": [{"name": "a", "model": "slet.toml"}]}, 'did you mean "sled.toml"?'),
        ({"runs": [{"name": "a", "model": "a" * 300}]}, "runs[0].model cannot be read: "),
        (
            {"runs": [{"name": "a", "model": "sled.toml"}, {"name": "a", "model": "sled.toml"}]},
            'runs[1].name is "a", which another run is called already',
        ),
        (
            {"runs": [{"name": "a", "model": "sled.toml", "set": {"sled.mas": 1.0}}]},
            'runs[0].set."sled.mas" is no parameter of sled; did you mean "sled.mass"?',
        ),
        (
            {"runs": [{"name": "a", "model": "sled.toml", "set": {"sled.mass": {"value": 1.0, "unit": "m"}}}]},
            'runs[0].set."sled.mass" is wrong: unit "m" is of the kind m, but kg is needed',
        ),
        (
            {"runs": [{"name": "a", "model": "sled.toml", "set": {"sled.mass": -1.0}}]},
            "runs[0].set cannot be: bodies.sled.mass is -1 kg",
        ),
        (
            {"runs": [{"name": "a", "model": "sled.toml", "level": "rigid"}]},
            "runs[0].level cannot be: sled has no beams",
        ),
        (
            {"runs": [{"name": "a", "model": "sled.toml", "with_effects": [{"type": "payload", "at": "axis"}]}]},
            'runs[0].with_effects[0].at is "axis", which is no body of the model',
        ),
        (
            {"runs": [{"name": "a", "model": "m", "with_effects": [{"type": "t", "at": "a", "size": {"mni": 1.0}}]}]},
            'runs[0].with_effects[0].size.mni is not a known key; did you mean "min"?',
        ),
        ({"references": {"drive": POINTS}}, "write [commands.drive], or add a controller to sled"),
        ({"commands": {"drive": POINTS}, "runs": SERVED}, "write [references.drive]"),
        ({"commands": {"drives": POINTS}}, 'commands.drives is no actuator of run "bare"; did you mean "drive"?'),
        ({"supplies": {"pump": POINTS}}, 'supplies.pump is no supply with source = "logged" of run "bare"'),
        (
            {"commands": {"drive": {"type": "ramp"}}},
            'commands.drive has the type "ramp"; the choices are chirp, constant, points, sine',
        ),
        ({"commands": {"drive": {"value": 1.0}}}, "commands.drive has no type"),
        (
            {"commands": {"drive": {"type": "constant", "valeu": 1.0}}},
            'commands.drive.valeu is not a known key; did you mean "value"?',
        ),
        (
            {"commands": {"drive": {"type": "constant", "value": {"value": 1.0, "unit": "N"}}}},
            'commands.drive.value is wrong: unit "N"',
        ),
        (
            {"commands": {"drive": {"type": "sine", "amplitude": 1.0, "frequency": 600.0}}},
            "commands.drive.frequency is 600 Hz, but samples every 0.001 s carry 0 to 500 Hz only",
        ),
        (
            {"commands": {"drive": POINTS | {"value": [0.0]}}},
            "commands.drive has 2 times and 1 values; give one value for each time",
        ),
        (
            {"commands": {"drive": POINTS | {"time": [0.1, 0.0]}}},
            "commands.drive.time goes back from 0.1 s to 0 s",
        ),
        ({"commands": {"drive": POINTS | {"time": 0.1}}}, "commands.drive.time has to be a list of numbers"),
        (
            {"commands": {"drive": POINTS | {"value": [0.0, "a"]}}},
            'commands.drive.value[1] is "a", but has to be a number',
        ),
        ({"initial": {"axis.positon": 0.1}}, 'initial."axis.positon" is no state of run "bare"'),
        (
            {"initial": {"axis.position": {"value": 3.0, "unit": "deg"}}},
            'initial."axis.position" is wrong: unit "deg" is of the kind 1, but m is needed',
        ),
        (
            {"plot": {"panels": [["axis.posit"]]}},
            'plot.panels[0][0] is "axis.posit", which is a channel of no run; did you mean "axis.position"?',
        ),
        (
            {"plot": {"panels": [["axis.position", "drive.force"]]}},
            "plot.panels[0] mixes channels in N and m",
        ),
        ({"plot": {"panels": []}}, "plot.panels is empty"),
        (
            {"plot": {"panels": [["axis.position"]], "columns": {"all": ["bear"]}}},
            'plot.columns.all[0] is "bear", which is no run of the scenario; did you mean "bare"?',
        ),
    ],
)
def test_refusals_say_where_why_and_what_to_do(folder: Path, changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        scenario(folder, **changes)
    assert sentence in str(caught.value)
    assert caught.value.where is not None
    assert "\n" not in str(caught.value)


def test_refusals_name_the_file_and_count_the_rest(folder: Path) -> None:
    path = folder / "lift.toml"
    path.write_text(PLAIN.replace("duration", "duratoin"), encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        Scenario.load(path)
    message = f'{path}: duratoin is not a known key; did you mean "duration"? (and 1 more problem)'
    assert str(caught.value) == message
    assert (caught.value.path, caught.value.where, caught.value.more) == (str(path), "duratoin", 1)


def test_a_wrong_model_file_speaks_for_itself(folder: Path) -> None:
    (folder / "sled.toml").write_text(SLED.replace("mass = 2.0", "mass = -2.0"), encoding="utf-8")
    with pytest.raises(ModelError, match=r"sled\.toml: bodies\.sled\.mass is -2"):
        scenario(folder)


def test_frequencies_in_radians_per_second_are_turned_into_hertz(folder: Path) -> None:
    def sine(frequency: object) -> Any:
        command = {"type": "sine", "amplitude": 1.0, "frequency": frequency}
        return scenario(folder, commands={"drive": command}).experiment("bare")["drive.command"]

    assert sine({"value": 2.0 * math.pi * 5.0, "unit": "rad/s"}) == pytest.approx(sine(5.0), abs=1e-12)
    assert sine({"value": 300.0, "unit": "rpm"}) == pytest.approx(sine(5.0), abs=1e-12)


def test_the_page_shows_the_example_as_it_is() -> None:
    page = (ROOT / "docs" / "scenarios.md").read_text(encoding="utf-8")
    shown = page.partition("```toml\n")[2].partition("```")[0]
    example = (EXAMPLES / "emps" / "step.toml").read_text(encoding="utf-8")
    assert tomllib.loads(shown) == tomllib.loads(example)
