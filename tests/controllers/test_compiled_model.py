"""Compiled models hold all that a step needs; the C library's own tests step them (crates/vpm-c/tests)."""

import json
from pathlib import Path

import numpy as np
import pytest

from places import EXAMPLES, ROOT
from synthetic import nominal
from vpm import Model, Simulation
from vpm.errors import SimulationError
from vpm.realtime import compile_model

AXIS = EXAMPLES / "emps" / "model.toml"
COMPILED = ROOT / "crates" / "vpm-c" / "tests" / "data" / "axis.json"


def test_the_file_of_the_librarys_tests_is_what_the_example_compiles_to() -> None:
    assert json.loads(compile_model(Model.load(AXIS), 1000.0).text) == json.loads(COMPILED.read_text(encoding="utf-8"))


def test_parameters_are_those_of_the_model_now(tmp_path: Path) -> None:
    model = nominal()
    name = next(iter(model.parameters))
    other = model.with_parameters({name: 2.0 * model.parameters[name].value})
    compiled = compile_model(other, 500.0, state={"axis.position": 0.25})
    content = json.loads(compiled.save(tmp_path / "axis.json").read_text(encoding="utf-8"))
    np.testing.assert_array_equal(content["description"]["parameters"], other.theta)
    assert content["time_step"] == 2e-3
    assert content["start"][content["states"].index("axis.position")] == 0.25
    assert content["outputs"] == list(Simulation(model, 2e-3).channels)


def test_integrators_have_bounded_work_unless_another_is_asked_for() -> None:
    rig = Model.load(EXAMPLES / "crane" / "crane.toml")
    assert json.loads(compile_model(rig, 1000.0).text)["integrator"] == "guarded"
    assert json.loads(compile_model(rig, 1000.0, integrator="rosenbrock").text)["integrator"] == "rosenbrock"


@pytest.mark.parametrize("rate", [0.0, -1.0])
def test_a_rate_without_meaning_is_refused(rate: float) -> None:
    with pytest.raises(SimulationError, match="is not possible"):
        compile_model(nominal(), rate)
