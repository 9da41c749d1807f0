"""Models weighed by their evidence: against exact integrals, and by what they say of machines that are known."""

import numpy as np
import pytest
from scipy.integrate import quad

import vpm
from test_observer import CARRIAGE, FORCE, READING, STEP, pushed
from vpm.errors import IdentificationError
from vpm.experiment import Experiment
from vpm.identify import PredictionErrorProblem, estimate
from vpm.model import Model
from vpm.weighing import Prior, priors_of
from vpm.weighing.weigh import _evidence, _Known


def held_model(*, bias: float) -> Model:
    """The carriage with all known but a constant force of this uncertainty (N)."""
    content = Model.from_toml(CARRIAGE).to_dict()
    content["bodies"]["carriage"]["mass"] = 2.0
    content["effects"] = [
        {"type": "viscous_friction", "at": "axis", "viscous": 6.0},
        {"type": "spring", "at": "axis", "stiffness": 50.0, "rest": 0.0},
        {"type": "bias_force", "at": "axis", "force": {"value": 0.0, "uncertainty": bias}},
    ]
    return Model.from_dict(content)


def exact_log_density(log: Experiment, bias: float) -> float:
    """Of the readings of `held_model`, by a Kalman filter whose third state is the constant force."""
    from scipy.linalg import expm

    rates = np.array([[0.0, 1.0, 0.0], [-25.0, -3.0, -0.5], [0.0, 0.0, 0.0]])
    # The core steps by a rational function; at 2 ms it agrees with the exponential to far below the noise.
    whole = expm(np.block([[rates, np.array([[0.0], [0.5], [0.0]])], [np.zeros((1, 4))]]) * STEP)
    step, push = whole[:3, :3], whole[:3, 3]
    carried = 0.5 * STEP * (step[:2, 1] + np.array([0.0, 1.0])) * 0.5 * FORCE
    state, covariance = np.zeros(3), np.diag([1e-4, 1.0, bias**2])
    first = Model.from_toml(CARRIAGE)
    state[:2] = vpm.observer.Record.of(first, log).first
    total = 0.0
    for reading, command in zip(log["axis.position"], log["drive.command"], strict=True):
        spread = covariance[0, 0] + READING**2
        gain, error = covariance[:, 0] / spread, reading - state[0]
        total -= 0.5 * (error**2 / spread + np.log(2.0 * np.pi * spread))
        state = state + gain * error
        covariance = covariance - np.outer(gain, gain) * spread
        state = step @ state + push * command
        covariance = step @ covariance @ step.T
        covariance[:2, :2] += np.outer(carried, carried)
    return total


@pytest.mark.parametrize("bias", [0.02, 0.5])
def test_the_evidence_of_a_linear_parameter_is_exact(bias: float) -> None:
    """A constant force moves all predictions linearly: Laplace's method is exact for it."""
    model, log = held_model(bias=bias), pushed(4, 1500, drift=0.3)
    noise = vpm.Noise({"axis.position": READING}, {"axis": FORCE})
    data = PredictionErrorProblem(model, [log], setup=vpm.Setup("rk4"), noise=noise)
    priors = priors_of(model, data)
    assert priors["axis.bias.force"] == Prior(0.0, bias, -np.inf, np.inf)
    known = _Known(data, priors)
    found = estimate(model, known, list(priors))
    fitted = model.with_parameters({"axis.bias.force": float(found.values[0])})
    evidence, _ = _evidence(fitted, known)
    assert evidence == pytest.approx(exact_log_density(log, bias), abs=0.01)


@pytest.mark.parametrize("viscous", [0.0, 0.05, 6.0])
def test_laplace_agrees_with_the_integral_over_a_parameter(viscous: float) -> None:
    """Also where the most likely value rests on its bound, zero, and half of the bell is impossible."""
    truth = Model.from_toml(CARRIAGE).with_parameters({"axis.friction.viscous": viscous})
    content = Model.from_toml(CARRIAGE).to_dict()
    content["bodies"]["carriage"]["mass"] = 2.0
    content["effects"][0]["viscous"] = {"value": 0.0, "uncertainty": 4.0}
    content["effects"][1]["stiffness"] = 50.0
    model, log = Model.from_dict(content), pushed(5, 1200, model=truth)
    noise = vpm.Noise({"axis.position": READING}, {"axis": FORCE})
    column = model.index("axis.friction.viscous")
    data = PredictionErrorProblem(model.with_parameters({"axis.friction.viscous": viscous}), [log], noise=noise)

    def density(value: float) -> float:
        theta = model.theta.copy()
        theta[column] = value
        prior = -0.5 * (value / 4.0) ** 2 + np.log(2.0 / (4.0 * np.sqrt(2.0 * np.pi)))
        return data.log_likelihood(data.evaluate(model, theta)[0]) + float(prior)

    known = _Known(data, priors_of(model, data))
    found = estimate(model, known, ["axis.friction.viscous"])
    best = float(found.values[0])
    fitted = model.with_parameters({"axis.friction.viscous": best})
    evidence, _ = _evidence(fitted, known)
    peak, width = density(best), float(found.std[0])
    low = max(0.0, best - 8.0 * width)
    area, _ = quad(lambda x: np.exp(density(x) - peak), low, best + 8.0 * width, epsabs=1e-10, epsrel=1e-6, limit=60)
    assert evidence == pytest.approx(peak + np.log(area), abs=0.05)


def test_machines_with_and_without_dry_friction_are_told_apart() -> None:
    """Of ten records of either kind, and friction of an eighth of the force and more, nine are told at least."""
    model = Model.from_toml(CARRIAGE)
    right = 0
    for seed in range(10):
        dry = seed % 2 == 1
        truth = model.with_effect("coulomb_friction", at="axis", coulomb=2.5) if dry else model
        log = pushed(200 + seed, 1500, model=truth)
        found = vpm.weigh({"plain": model, "dry": model.with_effect("coulomb_friction", at="axis")}, log)
        assert float(found.probability.sum()) == pytest.approx(1.0)
        right += found.names[0] == ("dry" if dry else "plain")
    assert right >= 9


def test_models_that_nothing_tells_apart_share_the_probability() -> None:
    """Two names for the same model are as probable as each other."""
    model, log = Model.from_toml(CARRIAGE), pushed(6, 800)
    found = vpm.weigh({"one": model, "other": model}, log)
    np.testing.assert_allclose(found.probability, 0.5)
    with pytest.raises(IdentificationError, match='"third" was not weighed; weighed were'):
        found["third"]
    with pytest.raises(IdentificationError, match="no model was given to weigh"):
        vpm.weigh({}, log)
    with pytest.raises(IdentificationError, match="no experiment was given"):
        vpm.weigh({"one": model}, [])
    limited = model.with_effect("saturation", at="drive")
    with pytest.raises(IdentificationError, match=r'"drive.saturation.limit" is .*; give it a value to begin with'):
        vpm.weigh({"limited": limited}, log)
