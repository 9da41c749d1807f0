"""A joint compliance, looked for among the frequencies at which it may swing."""

import math

import pytest

import vpm
from shared_cases import shared_case
from vpm.discrepancy.screening.candidates import candidates
from vpm.discrepancy.screening.compliance_and_stop_start import moved
from vpm.discrepancy.screening.probe import Baseline, probe
from vpm.identify import InverseDynamicsProblem, estimate

PAIR = ("joint_compliance", "viscous_friction")


@pytest.mark.nightly
def test_a_spring_is_looked_for_where_it_swings() -> None:
    # A linearised step promises most of a spring that is fifty times as stiff, from where a refit finds a rigid one.
    case = shared_case("axis_linear", PAIR, 159)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=PAIR, workers=1)
    assert {effect.name for effect in why.effects} == set(PAIR)
    found = next(effect for effect in why.effects if effect.name == "joint_compliance")
    stiffness, true = found.parameters[0], case.truth.hidden[0].parameters["stiffness"]
    assert stiffness.name == "stiffness"
    assert abs(stiffness.value / true - 1.0) < 0.1


@pytest.mark.nightly
def test_a_start_is_as_near_as_springs_that_are_tried() -> None:
    case = shared_case("axis_linear", PAIR, 159)
    model = case.model().with_effect("viscous_friction", at="axis")
    data = InverseDynamicsProblem(model, case.train)
    names = (*(p.name for p in model.parameters.values() if p.adjustable), "axis.friction.viscous")
    fit = estimate(model, data, names)
    fitted = model.with_parameters(dict(zip(fit.names, map(float, fit.values), strict=True)))
    (spring,) = candidates(fitted, data, fit.residual, ["joint_compliance"])
    found = probe(Baseline(fitted, fit.names, fit.residual, fit.jacobian), data, spring)
    true = math.sqrt(case.truth.hidden[0].parameters["stiffness"] / moved(fitted, "axis"))
    start = found.model.parameters["axis.compliance.stiffness"].value
    assert abs(math.sqrt(start / moved(fitted, "axis")) / true - 1.0) < 0.2
