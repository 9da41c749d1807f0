"""A spring behind a joint that swings within the whole band leaves what looks like noise; it is named all the same."""

import pytest

from shared_cases import shared_case
from vpm.diagnosing import diagnose


@pytest.mark.nightly
def test_a_swing_as_white_as_noise_is_named() -> None:
    case = shared_case("axis_rotary", "joint_compliance", 1004)
    why = diagnose(case.model(), case.train, case.validate, effects=["joint_compliance"])
    assert why.verdict == "effect_found"
    (found,) = why.effects
    assert (found.name, found.site) == ("joint_compliance", "axis")
    gap = why.gap["axis.effort"]
    assert gap.after < 0.5 * gap.recalibrated
