"""Valves that follow at once, load and quasi-static pressures, and tables of efforts in the place of cylinders."""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vpm
from places import EXAMPLES
from quotients import quotient
from vpm.errors import ModelError
from vpm.simplify.reductions import reductions
from vpm.simplify.replacement import replaced
from vpm.simplify.surrogates import force_map, tables
from vpm.simulate import Setup, simulate_arrays

RIG = vpm.Model.load(EXAMPLES / "servo_cylinder" / "rig.toml")
CLOCK = 1e-3 * np.arange(400)


def content(*, static: bool = True, clearance: float | None = 1e-4, pressures: str = "quasi_static") -> dict[str, Any]:
    """The rig with fewer states of its spool and of its pressures."""
    content = copy.deepcopy(RIG.to_dict())
    servo = content["actuators"]["servo"]
    if static:
        servo["valve"] = {k: v for k, v in servo["valve"].items() if k not in ("frequency", "damping")}
        servo["valve"]["spool"] = "static"
    if clearance is not None:
        servo["valve"]["clearance"] = clearance
    servo["cylinder"]["pressures"] = pressures
    return content


def quasi_static() -> vpm.Model:
    return vpm.Model(content())


def moved(model: vpm.Model, size: float = 1.5e-3, integrator: str = "guarded") -> vpm.Run:
    record = vpm.Experiment.from_arrays(
        CLOCK, {"servo.command": size * np.sin(2.0 * np.pi * 4.0 * CLOCK)}, model=model, name="sine"
    )
    return vpm.simulate(model, record, integrator=integrator)


def apart(found: vpm.Run, other: vpm.Run, channel: str) -> float:
    return float(np.std(found[channel] - other[channel]) / np.std(other[channel]))


def table(model: vpm.Model, reach: float = 0.3) -> dict[str, Any]:
    sizes = ((1e-2, 61), (reach, 41))
    commands, velocities = (size * np.sinh(np.linspace(-4.0, 4.0, count)) / np.sinh(4.0) for size, count in sizes)
    efforts = force_map(model, "servo", commands, velocities)
    axes = {"commands": commands.tolist(), "velocities": velocities.tolist(), "efforts": efforts.tolist()}
    return {"type": "table", "command_unit": "A", **axes}


def with_table(entry: dict[str, Any]) -> vpm.Model:
    changed = copy.deepcopy(RIG.to_dict())
    del changed["supplies"]
    changed["actuators"]["servo"] = {"joint": "axis", **entry}
    return vpm.Model(changed)


@pytest.mark.parametrize(("static", "states"), [(True, ()), (False, ("servo.spool", "servo.spool_rate"))])
def test_pressures_are_no_states_and_the_motion_stays(static: bool, states: tuple[str, ...]) -> None:
    model = vpm.Model(content(static=static))
    assert model.internal_names == states
    run, full = moved(model), moved(RIG)
    assert 1e-3 < apart(run, full, "axis.velocity") < 0.04
    assert apart(run, full, "axis.position") < 0.04
    # Below the pressure of the supply and above that of vapour while the piston moves, as the flows have it.
    assert np.all(run["servo.pressure_a"] >= 2000.0)


def test_slower_motion_comes_nearer() -> None:
    # What oil under pressure takes up grows with the frequency, what the piston displaces does not.
    gaps = []
    for frequency in (64.0, 16.0):
        runs = []
        for model in (quasi_static(), vpm.Model(content(pressures="chambers"))):
            time = 0.008 / frequency * np.arange(500)
            command = 2e-3 * np.sin(2.0 * np.pi * frequency * time)
            record = vpm.Experiment.from_arrays(time, {"servo.command": command}, model=model, name="sine")
            runs.append(vpm.simulate(model, record, integrator="adaptive", initial_state=_start(model)))
        found, full = (run["axis.velocity"][250:] for run in runs)
        gaps.append(float(np.std(found - full) / np.std(full)))
    assert 0.01 < gaps[0] < 0.5
    assert gaps[1] < 0.5 * gaps[0]


def _start(model: vpm.Model) -> np.ndarray:
    state = np.zeros(model.core.n_states)
    state[2:] = model.core.internal_state(model.theta, [0.0])
    return state


def test_file_keeps_it(tmp_path: Path) -> None:
    again = vpm.Model.load(quasi_static().save(tmp_path / "reduced.toml"))
    assert again.internal_names == ()
    assert again.parameters["servo.valve.clearance"].value == 1e-4
    found = with_table(table(quasi_static()))
    kept = vpm.Model.load(found.save(tmp_path / "table.toml"))
    assert np.array_equal(moved(kept).values, moved(found).values)


@pytest.mark.parametrize(
    ("clearance", "message"),
    [(None, "valve.clearance is missing; with pressures"), (0.02, "is 0.02 A, but the spool moves by 0.01 A only")],
)
def test_clearance_that_does_not_suit_is_refused(clearance: float | None, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        vpm.Model(content(clearance=clearance))


def test_sensitivities_are_those_of_differences() -> None:
    model = quasi_static()
    names = ["servo.valve.clearance", "servo.valve.flow_gain", "pump.pressure", "servo.cylinder.internal_leakage"]
    columns = [model.index(name) for name in names]
    record = vpm.Experiment.from_arrays(
        CLOCK, {"servo.command": 1.5e-3 * np.sin(25.0 * CLOCK)}, model=model, name="sine"
    )
    setup = Setup("guarded")
    place = model.output_channels.index("axis.position")
    exact = simulate_arrays(model, record, "free_run", columns=columns, setup=setup).jacobian[:, place]

    def position(theta: np.ndarray) -> np.ndarray:
        return simulate_arrays(model, record, "free_run", theta=theta, setup=setup).outputs[:, place]

    for number, column in enumerate(columns):
        slope = quotient(position, model.theta, column, 1e-4 * model.theta[column])
        assert np.max(np.abs(exact[:, number] - slope)) < 1e-2 * np.max(np.abs(slope))


def test_table_does_what_it_was_read_of() -> None:
    model = quasi_static()
    run, found = moved(model), moved(with_table(table(model)))
    assert apart(found, run, "axis.velocity") < 0.02
    assert found.notes == ()


def test_table_says_where_it_was_left() -> None:
    narrow = with_table(table(quasi_static(), reach=0.02))
    (note,) = moved(narrow).notes
    assert note.startswith("axis.velocity is ")
    assert "the table of its drive ends at -0.02 and 0.02 m/s (" in note
    loud = moved(with_table(table(quasi_static())), size=12e-3)
    assert loud.notes[0].startswith("servo.command is ")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"commands": [0.0, 0.0]}, r"servo.commands has 0 after 0, but has to rise"),
        ({"velocities": [0.0]}, r"servo.velocities has 1 number, but a table takes two or more"),
        ({"efforts": [[1.0, 2.0]]}, r"servo.efforts has 1 rows, but there are 2 commands"),
        ({"efforts": [[1.0, 2.0], [1.0]]}, r"servo.efforts\[1\] has 1 numbers, but there are 2 velocities"),
    ],
)
def test_what_is_no_table_is_refused(change: dict[str, Any], message: str) -> None:
    entry = {"type": "table", "commands": [0.0, 1.0], "velocities": [0.0, 1.0], "efforts": [[1.0, 2.0], [3.0, 4.0]]}
    with pytest.raises(ModelError, match=message):
        with_table({**entry, **change})


def test_both_are_offered() -> None:
    run = moved(RIG)
    taught = {channel: run[channel] for channel in run.channels}
    offered = reductions(RIG, tables(RIG, [taught], lambda model: [moved(model)]))["drive", "servo"]
    words = [str(change) for change in offered]
    assert "servo with quasi-static pressures" in words
    assert "servo with a static spool and quasi-static pressures" in words
    assert "servo as table" in words
    states = {str(change): change.applied(RIG).core.n_states for change in offered}
    assert states["servo as table"] == 2
    assert states["servo with a static spool and quasi-static pressures"] == 2
    assert states["servo with quasi-static pressures"] == 4


def test_table_forgets_what_only_a_valve_has() -> None:
    slow = RIG.with_effect("valve_dynamics", at="servo", time=1e-3)
    model = replaced(slow, "servo", json.dumps(table(quasi_static())))
    assert model.supplies == ()
    assert all(effect.at != "servo" for effect in model.effects)


@pytest.mark.parametrize(
    ("change", "states", "position"),
    [
        ({"pressures": "chambers"}, ("servo.chamber_a", "servo.chamber_b"), 0.04),
        ({"static": False, "pressures": "load"}, ("servo.spool", "servo.spool_rate", "servo.load"), 0.06),
        ({"pressures": "load"}, ("servo.load",), 0.1),
    ],
)
def test_reduced_drives_lose_states_and_little_motion(
    change: dict[str, Any], states: tuple[str, ...], position: float
) -> None:
    model, full = vpm.Model(content(clearance=None, **change)), moved(RIG, integrator="auto")
    assert model.internal_names == states
    run = moved(model, integrator="auto")
    apart = np.ptp(run["axis.position"] - full["axis.position"]) / np.ptp(full["axis.position"])
    assert 1e-4 < apart < position


def test_file_keeps_the_load_pressure(tmp_path: Path) -> None:
    model = vpm.Model(content(clearance=None, pressures="load"))
    again = vpm.Model.load(model.save(tmp_path / "reduced.toml"))
    assert again.internal_names == ("servo.load",)
    assert "servo.valve.frequency" not in again.parameters


def test_measured_pressures_are_the_start_of_the_load_pressure() -> None:
    model = vpm.Model(content(static=False, clearance=None, pressures="load"))
    columns = {
        "servo.command": np.zeros(50),
        "servo.pressure_a": np.full(50, 5e6),
        "servo.pressure_b": np.full(50, 4e6),
    }
    record = vpm.Experiment.from_arrays(1e-3 * np.arange(50), columns, model=model)
    state = vpm.initial.initial_state(model, record, model.theta)
    alpha = 1.0 - (10.0 / 16.0) ** 2
    assert state[model.state_names.index("servo.load")] == pytest.approx(5e6 - alpha * 4e6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"spool": "static"}, "frequency is given, but a static spool follows at once"),
        ({"frequency": None}, "frequency is missing; add it"),
    ],
)
def test_spool_without_or_with_too_much_is_refused(change: dict[str, Any], message: str) -> None:
    changed = copy.deepcopy(RIG.to_dict())
    valve = changed["actuators"]["servo"]["valve"] | change
    changed["actuators"]["servo"]["valve"] = {key: value for key, value in valve.items() if value is not None}
    with pytest.raises(ModelError, match=message):
        vpm.Model(changed)


def test_static_spool_cannot_be_slower_than_described() -> None:
    with pytest.raises(ModelError, match="valve_dynamics makes it slower"):
        vpm.Model(content(clearance=None, pressures="chambers")).with_effect("valve_dynamics", at="servo", time=1e-3)
