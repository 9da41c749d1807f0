"""Limits of drives: where the search looks for them."""

import numpy as np
import pytest

import vpm
from shared_cases import shared_case
from vpm.discrepancy.screening.candidates import limit_start
from vpm.identify import InverseDynamicsProblem


@pytest.mark.nightly
def test_a_limit_is_looked_for_where_the_residual_begins_to_grow_with_the_command() -> None:
    """Found in the residual that it leaves, however much larger the largest command is."""
    case = shared_case("axis_rotary", "none", 42)
    model = case.model()
    data = InverseDynamicsProblem(model, case.train)
    largest = max(float(np.abs(record["drive.command"]).max()) for record in case.train)
    limited = model.with_effect("saturation", at="drive", limit=0.5 * largest)
    whole, _ = data.evaluate(model, model.theta)
    cut, _ = data.evaluate(limited, limited.theta)
    assert limit_start(data, "axis", 0, whole - cut) == pytest.approx(0.5 * largest, rel=0.05)


@pytest.mark.nightly
def test_where_nothing_is_left_no_limit_is_seen() -> None:
    case = shared_case("axis_rotary", "none", 42)
    data = InverseDynamicsProblem(case.model(), case.train)
    residual, _ = data.evaluate(case.model(), case.model().theta)
    assert limit_start(data, "axis", 0, np.zeros_like(residual)) is None


@pytest.mark.nightly
def test_a_limit_far_below_the_largest_command_is_named() -> None:
    """A loop whose drive gives no more asks for several times the limit; none of the usual starts is near it."""
    case = shared_case("arm2r", "saturation", 6001)
    (hidden,) = case.truth.hidden
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=["saturation"], workers=1)
    assert [(effect.name, effect.site) for effect in why.effects] == [("saturation", "first")]
    assert why.effects[0].parameters[0].value == pytest.approx(hidden.parameters["limit"], rel=1e-3)
