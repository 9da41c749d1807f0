"""Late drives and instruments beside dry friction, which is late by itself where a joint turns round."""

from types import SimpleNamespace
from typing import Any

import pytest

import vpm
from shared_cases import shared_case
from vpm.discrepancy.ranked_effects import notes

#: A lag, and the delays that it may be taken for.
LATE = ("actuator_lag", "input_delay", "sensor_delay")
#: A difference of friction between the ways, with a delay of two sampling intervals behind it.
HIDDEN, SEED = ("asymmetric_friction", "input_delay"), 0


@pytest.mark.nightly
def test_a_delay_beside_dry_friction_is_named_and_timed() -> None:
    case = shared_case("axis_rotary", HIDDEN, SEED)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=list(HIDDEN), workers=1)
    assert sorted(effect.name for effect in why.effects) == sorted(HIDDEN)
    delay = next(effect for effect in why.effects if effect.name == "input_delay").parameters[0]
    (true,) = (h.parameters["time"] for h in case.truth.hidden if h.name == "input_delay")
    # All samples together give more than twice the truth: less than a quarter off is what motion alone can give.
    assert delay.value == pytest.approx(true, rel=0.25)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("hidden", "seed", "named"),
    [("actuator_lag", 5, {"actuator_lag"}), ("input_delay", 2, {"input_delay", "sensor_delay"})],
)
def test_a_lag_is_named_only_where_it_shows(hidden: str, seed: int, named: set[str]) -> None:
    """A late drive and a late encoder of one axis are one delay."""
    case = shared_case("axis_linear", hidden, seed)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=LATE, workers=1)
    (effect,) = why.effects
    assert effect.name in named


@pytest.mark.nightly
@pytest.mark.parametrize("hidden", ["input_delay", "sensor_delay"])
def test_a_part_of_a_sampling_interval_is_named_where_it_explains_most(hidden: str) -> None:
    case = shared_case("axis_linear", hidden, 2003)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=LATE, workers=1)
    assert [effect.name for effect in why.effects] == ["input_delay"]
    late, truth = why.effects[0].parameters[0], case.truth.hidden[0].parameters["time"]
    assert late.value < case.train[0].dt
    assert late.value == pytest.approx(truth, rel=0.1)
    assert why.verdict == "effect_found"


@pytest.mark.nightly
def test_a_delay_of_a_machine_that_sticks_is_named() -> None:
    case = shared_case("axis_linear", "input_delay", 22)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=("input_delay",), workers=1)
    assert [effect.name for effect in why.effects] == ["input_delay"]
    truth = case.truth.hidden[0].parameters["time"]
    assert why.effects[0].parameters[0].value == pytest.approx(truth, rel=0.1)


@pytest.mark.parametrize(("hold", "said"), [("zero_order", "held "), ("first_order", "not held ")])
def test_a_delay_says_how_commands_were_held_beside_it(hold: str, said: str) -> None:
    """Commands of a faster loop that a log holds at every fourth cycle come early by what half a sample makes late."""
    nominal = SimpleNamespace(actuators=("motor",))
    training: Any = SimpleNamespace(hold=hold, motions=(SimpleNamespace(dt=2e-3),), nominal=nominal)
    measured = SimpleNamespace(invisible=())
    late: Any = [
        SimpleNamespace(key=key, label=" at ".join(key), measured=measured)
        for key in (("input_delay", "motor"), ("sensor_delay", "encoder"), ("spring", "axis"))
    ]
    (note,) = notes(late, training)
    assert note.startswith(f"input_delay at motor: commands were {said}from sample to sample")
    assert f"1 ms {'longer if they were not' if hold == 'zero_order' else 'shorter if they were'}" in note
