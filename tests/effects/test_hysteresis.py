"""The effect `hysteresis`: in files, by one call, in simulation, balance of efforts, fit and diagnosis."""

from pathlib import Path

import numpy as np
import pytest

import vpm
from quotients import quotient
from vpm.errors import ModelError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array

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


def record(machine: Model, seed: int) -> Experiment:
    """Log of a machine pushed over and below the limit of its friction, three seconds."""
    time = np.arange(3000) / RATE
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 3)
    command = sum(
        a * np.sin(2.0 * np.pi * f * time + p) for a, f, p in zip((9.0, 6.0, 5.0), (0.7, 2.3, 5.1), phase, strict=True)
    )
    outputs = machine.core.simulate(
        machine.theta, np.zeros(machine.core.n_states), np.asarray(command)[:, None], 1.0 / RATE, 16, "rk4"
    )[0]
    position = outputs[:, 0] + np.random.default_rng(seed + 1).normal(0.0, 1e-7, len(time))
    channels = {"axis.position": position, "drive.command": np.asarray(command)}
    units = {"axis.position": "m", "drive.command": "N"}
    return Experiment.from_arrays(time, channels, units=units, name=f"seed {seed}")


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
        with pytest.raises(ModelError, match=rf"\.{name} is "):
            rough(**{name: value})


def test_linear_model_about_rest_is_a_spring() -> None:
    """About the relaxed state: stiffness force/displacement, felt through the memory."""
    matrix = rough().linearize().A
    assert matrix[1, 2] == pytest.approx(-FORCE / 3.0)
    assert matrix[2, 1] == pytest.approx(1.0 / DISPLACEMENT)
    frequency = np.abs(np.linalg.eigvals(matrix)).max()
    assert frequency == pytest.approx(np.sqrt(FORCE / DISPLACEMENT / 3.0))


def test_balance_of_efforts_finds_what_a_simulation_had() -> None:
    found = vpm.identify(slider().with_effect("hysteresis", at="axis"), record(rough(), 1), cutoff=120.0)
    values = found.model.parameters
    assert values["axis.hysteresis.force"].value == pytest.approx(FORCE, rel=0.01)
    assert values["axis.hysteresis.displacement"].value == pytest.approx(DISPLACEMENT, rel=0.05)
    assert values["axis.hysteresis.shape"].value == pytest.approx(SHAPE, abs=0.1)


def test_balance_has_the_derivatives_of_differences() -> None:
    model, log = rough(), record(rough(), 2)
    names = [f"axis.hysteresis.{name}" for name in ("force", "displacement", "shape")]
    columns = [model.index(name) for name in names]
    position = np.array(log["axis.position"])[:, None]
    velocity = np.gradient(position, 1.0 / RATE, axis=0)
    still = np.zeros_like(position)

    def required(theta: Array) -> Array:
        return model.core.inverse_dynamics(theta, position, velocity, still, still, 1.0 / RATE, [])[0]

    exact = model.core.inverse_dynamics(model.theta, position, velocity, still, still, 1.0 / RATE, columns)[2]
    for k, column in enumerate(columns):
        difference = quotient(required, model.theta, column, 1e-5 * model.theta[column])
        scale = np.abs(difference).max()
        assert scale > 0.0
        np.testing.assert_allclose(exact[:, :, k] / scale, difference / scale, atol=1e-5)


@pytest.mark.nightly
def test_a_diagnosis_names_it() -> None:
    train, test = (record(rough(), seed) for seed in (3, 4))
    found = vpm.diagnose(
        slider(), train, test, effects=["viscous_friction", "coulomb_friction", "hysteresis", "spring"]
    )
    assert ("hysteresis", "axis") in [(effect.name, effect.site) for effect in found.effects]


def test_a_plain_model_has_no_memory() -> None:
    assert slider().state_names == ("axis.position", "axis.velocity")
