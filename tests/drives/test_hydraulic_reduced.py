"""Valves that follow at once and quasi-static pressures in model files."""

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vpm
from places import EXAMPLES
from vpm.errors import ModelError

RIG = vpm.Model.load(EXAMPLES / "servo_cylinder" / "rig.toml")


def reduced(*, static: bool = False, load: bool = False) -> dict[str, Any]:
    content = copy.deepcopy(RIG.to_dict())
    servo = content["actuators"]["servo"]
    if static:
        servo["valve"] = {k: v for k, v in servo["valve"].items() if k not in ("frequency", "damping")}
        servo["valve"]["spool"] = "static"
    if load:
        servo["cylinder"]["pressures"] = "load"
    return content


def moved(model: vpm.Model) -> vpm.Run:
    time = 1e-3 * np.arange(500)
    current = 1.5e-3 * np.sin(2.0 * np.pi * 4.0 * time)
    record = vpm.Experiment.from_arrays(time, {"servo.command": current}, model=model)
    return vpm.simulate(model, record)


@pytest.mark.parametrize(
    ("change", "states", "position"),
    [
        ({"static": True}, ("servo.chamber_a", "servo.chamber_b"), 0.04),
        ({"load": True}, ("servo.spool", "servo.spool_rate", "servo.load"), 0.06),
        ({"static": True, "load": True}, ("servo.load",), 0.1),
    ],
)
def test_reduced_drives_lose_states_and_little_motion(
    change: dict[str, bool], states: tuple[str, ...], position: float
) -> None:
    model, full = vpm.Model(reduced(**change)), moved(RIG)
    assert model.internal_names == states
    run = moved(model)
    apart = np.ptp(run["axis.position"] - full["axis.position"]) / np.ptp(full["axis.position"])
    assert 1e-4 < apart < position


def test_file_keeps_what_was_reduced(tmp_path: Path) -> None:
    model = vpm.Model(reduced(static=True, load=True))
    again = vpm.Model.load(model.save(tmp_path / "reduced.toml"))
    assert again.internal_names == ("servo.load",)
    assert "servo.valve.frequency" not in again.parameters


def test_measured_pressures_are_the_start_of_the_load_pressure() -> None:
    model = vpm.Model(reduced(load=True))
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
    content = copy.deepcopy(RIG.to_dict())
    valve = content["actuators"]["servo"]["valve"] | change
    content["actuators"]["servo"]["valve"] = {key: value for key, value in valve.items() if value is not None}
    with pytest.raises(ModelError, match=message):
        vpm.Model(content)


def test_static_spool_cannot_be_slower_than_described() -> None:
    with pytest.raises(ModelError, match="valve_dynamics makes it slower"):
        vpm.Model(reduced(static=True)).with_effect("valve_dynamics", at="servo", time=1e-3)
