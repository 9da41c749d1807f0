"""Late drives beside dry friction: timed where the joint moves, for where it turns round friction is late by itself."""

import numpy as np
import pytest

import vpm
from shared_cases import shared_case
from vpm.discrepancy.confirmation.delay_in_motion import CREEPING, in_motion
from vpm.identify import InverseDynamicsProblem

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
def test_only_samples_in_clear_motion_count() -> None:
    case = shared_case("axis_rotary", "input_delay", SEED)
    problem = InverseDynamicsProblem(case.model(), case.train)
    counted = in_motion(problem)
    assert set(np.unique(counted)) == {0.0, 1.0}
    speed = np.concatenate([np.abs(problem.state(record)[1][:, 0]) for record in range(len(problem.motions))])
    largest = max(float(np.quantile(np.abs(m.velocity), 0.999)) for m in problem.motions)
    assert np.all(speed[counted > 0.0] >= CREEPING * largest)
    assert 0.3 < counted.mean() < 1.0
