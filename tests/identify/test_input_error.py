"""Input error: the model turned round, against truth on simulated machines, and where it cannot be."""

import runpy
from types import SimpleNamespace

import numpy as np
import pytest

from places import ROOT
from quotients import of_residual
from synthetic import Truth, nominal, simulate_axis
from test_fit_engine import FREE, MASS, STIFFNESS, TRUTH, VISCOUS, oscillator, recorded, wrong
from vpm.errors import ExperimentError, IdentificationError, SimulationError
from vpm.experiment import Experiment
from vpm.identify import Fitting, InputErrorProblem, identify, problem
from vpm.model import Model
from vpm.simulate import Setup

bench = SimpleNamespace(**runpy.run_path(str(ROOT / "examples/servo_cylinder/greybox.py"), run_name="bench"))
STRETCH = Setup("rk4", 2, horizon=0.5)


def test_the_command_of_a_model_that_is_right_needs_no_correction() -> None:
    model, record = oscillator(), recorded(noise=0.0, n=1500)
    data = problem(model, [record], "input_error", setup=STRETCH)
    residual, _ = data.evaluate(model, model.theta)
    assert np.max(np.abs(residual)) < 1e-6


def test_a_constant_force_that_the_model_lacks_is_what_the_commands_are_corrected_by() -> None:
    """A bias of 1.5 N acts like a command of -1.5 N: the definition, with nothing fitted."""
    model, record = oscillator(), recorded(noise=0.0, n=1500)
    data = problem(model, [record], "input_error", setup=STRETCH)
    biased = model.with_effect("bias_force", at="slide", force=1.5)
    residual, _ = data.evaluate(biased, biased.theta)
    (block,) = data.blocks
    assert block.channel == "push.command"
    assert block.unit == "N"
    sign = np.sign(residual[0])
    np.testing.assert_allclose(residual / block.weight, sign * 1.5, rtol=1e-3)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_parameters_come_back(noise: float) -> None:
    record = recorded(noise=noise, n=4000)
    fit = identify(wrong(), record, FREE, mode="input_error", setup=STRETCH)
    truth = np.array([TRUTH[name] for name in FREE])
    if noise == 0.0:
        np.testing.assert_allclose(fit.values, truth, rtol=1e-6)
    assert np.all(np.abs(fit.values - truth) <= 3.0 * fit.std + 1e-6 * truth)
    assert np.all(fit.std < 0.01 * truth)
    assert fit.mode == "input_error"


def test_it_agrees_with_inverse_dynamics_on_a_rigid_machine_with_an_ideal_drive() -> None:
    (record,) = simulate_axis(Truth(mass=21.3, viscous=71.0), 1, 10.0, first_seed=3)
    balance = identify(nominal(), record)
    turned = identify(nominal(), record, mode="input_error", setup=Setup(substeps=2, horizon=0.1))
    apart = np.abs(balance.values - turned.values)
    assert np.all(apart < 3.0 * np.hypot(balance.std, turned.std))
    np.testing.assert_allclose(turned.values, [21.3, 71.0], rtol=0.02)


def test_the_drive_of_a_servo_cylinder_is_turned_round() -> None:
    """Bulk modulus and gain of the valve from measured place and pressures, under noise of all three; 30 % off."""
    record = bench.measured(bench.random_gaussian(1.0), seed=1)
    rig, names = bench.rig(), bench.FREE[:2]
    truth = np.array([rig.parameters[name].value for name in names])
    start = rig.with_parameters(dict(zip(names, 0.7 * truth, strict=True)))
    fit = identify(
        start, record, names, mode="input_error", setup=Setup("rk4", 4, horizon=0.02), fitting=Fitting(log=True)
    )
    assert np.all(np.abs(fit.values - truth) < 4.0 * fit.std)
    np.testing.assert_allclose(fit.values, truth, rtol=0.01)
    assert fit.after["servo.command"][1] < 0.05


@pytest.mark.parametrize("name", [MASS, VISCOUS, STIFFNESS])
def test_derivatives_match_differences(name: str) -> None:
    """Near the truth; away from it they leave out the curvature of the outputs in the corrected states."""
    model = oscillator(block__mass=2.02)
    data = problem(model, [recorded(noise=1e-3, n=1500)], "input_error", setup=STRETCH)
    column = model.index(name)
    _, jacobian = data.evaluate(model, model.theta, [column])
    difference = of_residual(data, model, column, 1e-5 * model.theta[column])
    assert np.max(np.abs(jacobian[:, 0] - difference)) < 1e-4 * np.max(np.abs(difference))


def test_two_records_weigh_together_on_any_number_of_workers() -> None:
    records = [recorded(seed, n=1500) for seed in range(2)]
    one, two = (InputErrorProblem(oscillator(), records, setup=STRETCH, workers=workers) for workers in (1, 2))
    columns = [oscillator().index(name) for name in FREE]
    for a, b in zip(
        one.evaluate(oscillator(), wrong().theta, columns),
        two.evaluate(oscillator(), wrong().theta, columns),
        strict=True,
    ):
        assert np.array_equal(a, b)
    assert len(one.blocks) == 2


def fitted_with(record: Experiment, model: Model | None = None, horizon: float = 0.5) -> None:
    identify(model or oscillator(), record, FREE, mode="input_error", setup=Setup("rk4", 2, horizon))


def test_what_cannot_be_turned_round_is_refused_in_one_sentence() -> None:
    record = recorded(n=1500)
    idle = {"push.command": np.zeros(len(record)), "slide.position": record["slide.position"]}
    still = Experiment.from_arrays(record.time, idle, model=oscillator(), name="idle")
    with pytest.raises(
        IdentificationError, match=r"push\.command is constant in all records; log a command that moves"
    ):
        fitted_with(still)
    with pytest.raises(IdentificationError, match=r"15 s; record longer or shorten|stretches of 3 s; record longer"):
        fitted_with(record, horizon=3.0)
    deaf = oscillator().with_parameters({"push.gain": 0.0})
    with pytest.raises(SimulationError, match=r"do not answer to push\.command"):
        fitted_with(record, deaf)
    blind = Experiment.from_arrays(
        record.time, {"push.command": record["push.command"]}, model=oscillator(), name="blind"
    )
    with pytest.raises((IdentificationError, ExperimentError), match=r"slide\.position|no measured channel"):
        fitted_with(blind)


def test_states_that_no_log_holds_are_refused() -> None:
    current = bench.random_gaussian(0.5)
    whole = bench.measured(current, seed=None, setup=bench.FITTED)
    kept = {name: whole[name] for name in ("servo.command", "axis.position", "servo.pressure_a")}
    half = Experiment.from_arrays(whole.time, kept, model=bench.rig(), name="half")
    with pytest.raises(IdentificationError, match=r"does not hold servo\.pressure_b; log it, or use the mode"):
        identify(bench.rig(), half, bench.FREE[:1], mode="input_error", setup=Setup("rk4", 4, 0.02))
    beam = Model.load(ROOT / "examples/spinning_beam/spinning_beam.toml")
    time = 0.01 * np.arange(200)
    log = Experiment.from_arrays(
        time, {"motor.command": np.sin(time), "spin.position": np.sin(time)}, model=beam, name="spun"
    )
    with pytest.raises(SimulationError, match="no log holds the elastic coordinates of arm"):
        identify(beam, log, ["hub.mass"], mode="input_error")
