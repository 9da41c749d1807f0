"""How links bend is worked out once: the same numbers as by simulating everything, and a fit on the tangent."""

import sys
from collections.abc import Callable

import numpy as np
import pytest

import vpm
from test_along import DT, arm
from vpm.identify import InverseDynamicsProblem, estimate
from vpm.identify.tangent import Tangent, estimate_on_tangent, has_tangent

YOUNG = "link.young"


@pytest.fixture(scope="module")
def record() -> vpm.Experiment:
    """The arm with viscous friction, moved by a torque of two tones."""
    model = arm().with_effect("viscous_friction", at="shoulder", viscous=0.05)
    time = np.arange(2000) * DT
    torque = 0.4 * np.sin(2 * np.pi * 1.1 * time) + 0.3 * np.sin(2 * np.pi * 4.3 * time)
    given = vpm.Experiment.from_arrays(time, {"motor.command": torque}, units={"motor.command": "A"})
    run = vpm.simulate(model, given, substeps=2)
    data = {"motor.command": torque, "shoulder.position": run["shoulder.position"]}
    return vpm.Experiment.from_arrays(time, data, units={"motor.command": "A", "shoulder.position": "rad"})


def flexed() -> vpm.Model:
    """The rigid arm whose link bends by an effect."""
    return arm("rigid").with_effect("link_flexibility", at="link", stiffness=17.0, time=1e-3)


@pytest.mark.parametrize("bent", [arm, flexed], ids=["described", "by an effect"])
def test_laws_beside_the_bending_are_what_a_whole_simulation_gives(
    bent: Callable[[], vpm.Model], record: vpm.Experiment, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = bent().with_effect("viscous_friction", at="shoulder", viscous=0.03)
    model = model.with_effect("torque_ripple", at="shoulder", period=0.3, cosine=0.02, sine=0.01)
    model = model.with_effect("rotor_inertia", at="shoulder", inertia=0.01)
    model = model.with_effect("actuator_lag", at="motor", time_constant=0.004)
    columns = [model.index(name) for name in model.parameter_names]
    problem = InverseDynamicsProblem(model, [record], cutoff=40.0)
    assert has_tangent(model, problem)
    residual, jacobian = problem.evaluate(model, model.theta, columns)
    monkeypatch.setattr(sys.modules["vpm.identify.response_along_motion"], "bending_of", lambda *_, **__: None)
    whole = InverseDynamicsProblem(model, [record], cutoff=40.0).evaluate(model, model.theta, columns)
    assert np.abs(residual - whole[0]).max() < 1e-10 * np.abs(whole[0]).max()
    for mine, other, name in zip(jacobian.T, whole[1].T, model.parameter_names, strict=True):
        assert np.abs(mine - other).max() <= 1e-9 * np.abs(other).max(), name


def test_the_tangent_touches(record: vpm.Experiment) -> None:
    model = arm()
    problem = InverseDynamicsProblem(model, [record], cutoff=40.0)
    tangent = Tangent(problem, model.theta)
    place = model.index(YOUNG)
    apart = []
    for share in (2e-3, 1e-3):
        theta = model.theta.copy()
        theta[place] *= 1.0 + share
        apart.append(np.abs(tangent.evaluate(model, theta)[0] - problem.evaluate(model, theta)[0]).max())
    assert 0.0 < apart[1] < 0.3 * apart[0]  # of second order


def test_a_fit_on_tangents_ends_where_the_fit_does(record: vpm.Experiment) -> None:
    model = arm().with_effect("viscous_friction", at="shoulder", viscous=0.02)
    model = model.with_parameters({YOUNG: 0.97 * model.parameters[YOUNG].value})
    problem = InverseDynamicsProblem(model, [record], cutoff=40.0)
    free = (YOUNG, "shoulder.friction.viscous")
    exact = estimate(model, problem, free, tolerance=1e-8)
    fit = estimate_on_tangent(model, problem, free, model.theta, bounds={}, tolerance=1e-8)
    assert float(fit.residual @ fit.residual) < 1.002 * float(exact.residual @ exact.residual)
    assert fit.values[1] == pytest.approx(exact.values[1], rel=0.01)
    assert fit.values[0] == pytest.approx(exact.values[0], rel=0.01)


def test_a_machine_that_moves_alike_has_the_answer_of_another_one(record: vpm.Experiment) -> None:
    model = arm()
    lossy = model.with_effect("structural_damping", at="link", time=0.0)
    time = "link.structural_damping.time"
    problem, fresh = (InverseDynamicsProblem(model, [record], cutoff=40.0) for _ in range(2))
    whole = lossy.with_effect("viscous_friction", at="shoulder", viscous=0.0)
    problem.evaluate(whole, whole.theta, [whole.index(time)])
    problem.share(whole, [(lossy, (time,))])
    shared = problem.evaluate(lossy, lossy.theta, [lossy.index(time)])
    for mine, other in zip(shared, fresh.evaluate(lossy, lossy.theta, [lossy.index(time)]), strict=True):
        assert np.abs(mine - other).max() <= 1e-9 * np.abs(other).max()
