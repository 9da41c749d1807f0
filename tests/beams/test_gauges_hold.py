"""Links held to what their gauges showed: no error of the measured motion rings on, and nothing else changes."""

import sys

import numpy as np
import pytest

import vpm
from test_along import DT, arm
from vpm.identify import InverseDynamicsProblem, gaps

STRAIN, EFFORT = "root.strain", "shoulder.effort"
NOISE = 2e-5


@pytest.fixture(scope="module")
def machine() -> vpm.Model:
    """The arm with a gauge on a link that loses next to nothing."""
    text = arm().to_toml().replace("0.03, 0.03, 0.03, 0.03", "0.001, 0.001, 0.001, 0.001")
    return vpm.Model.from_toml(text + '\n[gauges.root]\nbeam = "link"\nat = 0.05\nx = 0.0\ny = 0.001\n')


def record(model: vpm.Model, deviation: float) -> vpm.Experiment:
    """A torque of two tones, and noise of the encoder."""
    time = np.arange(6000) * DT
    torque = 0.4 * np.sin(2 * np.pi * 1.1 * time) + 0.3 * np.sin(2 * np.pi * 3.3 * time)
    units = {"motor.command": "A", "shoulder.position": "rad", STRAIN: "1"}
    given = vpm.Experiment.from_arrays(time, {"motor.command": torque}, units={"motor.command": "A"})
    run = vpm.simulate(model, given, substeps=4)
    noise = deviation * np.random.default_rng(4).standard_normal(time.size)
    data = {"motor.command": torque, "shoulder.position": run["shoulder.position"] + noise, STRAIN: run[STRAIN]}
    return vpm.Experiment.from_arrays(time, data, units=units)


def test_noise_of_the_encoder_does_not_ring_on(machine: vpm.Model) -> None:
    log = record(machine, NOISE)
    shares = []
    for each in (log.select(["motor.command", "shoulder.position"]), log):
        problem = InverseDynamicsProblem(machine, [each], cutoff=40.0)
        shares.append(gaps(problem, problem.evaluate(machine, machine.theta)[0])[EFFORT][1])
    assert shares[1] < 0.5 * shares[0], shares


def test_without_noise_it_balances_and_shows_a_wrong_stiffness(machine: vpm.Model) -> None:
    log = record(machine, 0.0)
    problem = InverseDynamicsProblem(machine, [log], cutoff=40.0)
    found = gaps(problem, problem.evaluate(machine, machine.theta)[0])
    assert found[EFFORT][1] < 0.01
    assert found[STRAIN][1] < 0.01
    softer = machine.with_parameters({"link.young": 0.8 * machine.parameters["link.young"].value})
    found = gaps(problem, problem.evaluate(softer, softer.theta)[0])
    assert found[STRAIN][1] > 0.1


def test_derivatives_on_fewer_samples_are_nearly_those_on_all(
    machine: vpm.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = record(machine, NOISE)
    columns = [machine.index(name) for name in ("link.young", "link.density")]
    answers = []
    for samples in (8.0, np.inf):
        monkeypatch.setattr(sys.modules["vpm.identify.response_along_motion"], "SLOPE_SAMPLES", samples)
        problem = InverseDynamicsProblem(machine, [log], cutoff=30.0)
        answers.append(problem.evaluate(machine, machine.theta, columns))
    (few, slopes), (residual, exact) = answers
    # Outputs come alone by machine code, beside derivatives by operations: the same but for rounding.
    np.testing.assert_allclose(few, residual, rtol=0.0, atol=1e-9 * np.abs(residual).max())
    apart = np.linalg.norm(slopes - exact, axis=0) / np.linalg.norm(exact, axis=0)
    assert np.all(apart > 0.0)
    assert np.all(apart < 0.02), apart
