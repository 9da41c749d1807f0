"""Ends of a way: where the search looks for them, and what it leaves alone."""

import numpy as np
import pytest

import vpm
from shared_cases import shared_case
from vpm.demo import MODEL
from vpm.discrepancy.screening.compliance_and_stop_start import ends_apart, stop_starts


@pytest.mark.parametrize(("side", "end"), [(1.0, "high"), (-1.0, "low")])
def test_a_stop_is_looked_for_where_the_residual_begins_to_grow(side: float, end: str) -> None:
    way = np.sin(np.linspace(0.0, 40.0, 3000))
    residual = side * np.maximum(side * way - 0.9, 0.0) + 1e-3 * np.random.default_rng(0).standard_normal(way.size)
    starts, bounds = stop_starts(way, residual, 0.0, 1.0, 2.0)
    nearest = min(abs(start[end] - side * 0.9) for start in starts if list(start) == [end])
    assert nearest < 0.02
    assert bounds[end] == (-1.2, 1.2)
    assert bounds["stiffness"] == (2.0, np.inf)


def test_nothing_that_pushes_back_gives_no_place_of_its_own() -> None:
    way = np.sin(np.linspace(0.0, 40.0, 3000))
    pulled, _ = stop_starts(way, -way, 0.0, 1.0, 2.0)
    pushed, _ = stop_starts(way, way, 0.0, 1.0, 2.0)
    assert len(pulled) == 6
    assert {tuple(sorted(start)) for start in pushed} == {("high",), ("low",), ("high", "low")}


@pytest.mark.nightly
def test_the_end_that_no_record_reached_stays_where_no_joint_comes() -> None:
    """Moved into the way of the validation record it would ruin what the other end explains."""
    case = shared_case("axis_rotary", "end_stop", 4)
    (hidden,) = case.truth.hidden
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=["end_stop"], workers=1)
    assert [(effect.name, effect.site) for effect in why.effects] == [("end_stop", "axis")]
    values = {parameter.name: parameter.value for parameter in why.effects[0].parameters}
    assert values["low"] == -1e9
    assert values["high"] == pytest.approx(hidden.parameters["high"], rel=2e-3)
    assert values["stiffness"] == pytest.approx(hidden.parameters["stiffness"], rel=0.02)
    assert values["damping"] == pytest.approx(hidden.parameters["damping"], rel=0.1)


def test_ends_of_a_stop_do_not_pass_each_other_in_a_fit() -> None:
    """Two soft ends in one way imitate what is outside of the catalogue; crossed, they are no model."""
    model = vpm.Model.load(MODEL).with_effect("end_stop", at="shoulder", stiffness=10.0, low=-0.2, high=0.4)
    low, high = "shoulder.end_stop.low", "shoulder.end_stop.high"
    bounds = ends_apart(model, (low, high), {low: (-1.0, 1.0)})
    assert bounds == {low: (-1.0, pytest.approx(0.1)), high: (pytest.approx(0.1), np.inf)}
    assert ends_apart(model, (low,), {low: (-1.0, 1.0)}) == {low: (-1.0, 1.0)}
