"""The effect `hysteresis`: in files, by one call, in simulation, balance of efforts, fit and diagnosis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import vpm
from vpm.errors import ModelError
from vpm.model import Model

Array = NDArray[np.float64]

RATE = 1000.0
FORCE, DISPLACEMENT, SHAPE = 8.0, 1.5e-3, 0.4


def slider() -> Model:
    return Model.from_dict(
        {
            "name": "slide",
            "gravity": [0, 0, 0],
            "bodies": {"carriage": {"mass": 3.0}},
            "joints": {"axis": {"type": "prismatic", "parent": "world", "child": "carriage", "axis": [1, 0, 0]}},
            "actuators": {"drive": {"joint": "axis", "gain": 1.0, "command_unit": "N"}},
            "sensors": {"scale": {"measures": "axis.position"}},
        }
    )


def rough(**values: float) -> Model:
    numbers = {"force": FORCE, "displacement": DISPLACEMENT, "shape": SHAPE, **values}
    return slider().with_effect("hysteresis", at="axis", **numbers)


def record(machine: Model, seed: int, tmp_path: Path) -> vpm.Experiment:
    """Log of a machine pushed over and below the limit of its friction, three seconds, read with the plain model."""
    time = np.arange(3000) / RATE
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 3)
    command = sum(a * np.sin(2.0 * np.pi * f * time + p) for a, f, p in zip((9.0, 6.0, 5.0), (0.7, 2.3, 5.1), phase))
    run = machine.core.simulate(
        machine.theta,
        np.zeros(machine.core.n_states),
        np.asarray(command)[:, None],
        1.0 / RATE,
        16,
        "rk4",
    )
    position = run.outputs[:, 0] + np.random.default_rng(seed + 1).normal(0.0, 1e-7, len(time))
    path = tmp_path / f"log_{seed}.csv"
    np.savetxt(
        path,
        np.column_stack([time, command, position]),
        delimiter=",",
        header="time[s],drive.command[N],axis.position[m]",
        comments="",
    )
    return vpm.Experiment.load(path, model=slider())


def test_a_file_keeps_it(tmp_path: Path) -> None:
    model = rough()
    model.save(tmp_path / "model.toml")
    again = Model.load(tmp_path / "model.toml")
    assert again == model
    assert again.parameters["axis.hysteresis.displacement"].value == DISPLACEMENT
    assert again.state_names == ("axis.position", "axis.velocity", "axis.memory")
    assert again.state_units == ("m", "m/s", "1")
    assert again.core.n_states == 3


def test_one_call_adds_it_with_what_data_have_to_tell() -> None:
    parameters = slider().with_effect("hysteresis", at="axis").parameters
    assert [parameters[f"axis.hysteresis.{name}"].value for name in ("force", "displacement", "shape")] == [0, 1e-3, 1]
    assert all(parameters[f"axis.hysteresis.{name}"].adjustable for name in ("force", "displacement", "shape"))
    assert not rough().parameters["axis.hysteresis.displacement"].adjustable
    for name, value in (("force", -1.0), ("displacement", 0.0), ("shape", -0.5)):
        with pytest.raises(ModelError, match=f"axis.hysteresis.{name}"):
            rough(**{name: value})


def test_linear_model_about_rest_is_a_spring() -> None:
    """About the relaxed state: stiffness force/displacement, felt through the memory."""
    matrix = rough().linearize().a
    assert matrix[1, 2] == pytest.approx(-FORCE / 3.0)
    assert matrix[2, 1] == pytest.approx(1.0 / DISPLACEMENT)
    frequency = np.abs(np.linalg.eigvals(matrix)).max()
    assert frequency == pytest.approx(np.sqrt(FORCE / DISPLACEMENT / 3.0))
