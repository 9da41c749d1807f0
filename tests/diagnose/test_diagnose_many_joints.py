"""An arm with six joints and no friction in its file: it is named at each joint, whatever another one does."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from second_suite import arm, loop
from second_suite.cases import NONE, Case, make_case
from vpm import Diagnosis, diagnose
from vpm.numbers import Array

#: Joints of the wrist and the arm that only rub.
OTHERS = tuple(name for name in arm.NAMES if name != "j4")


def without_friction(seed: int) -> Case:
    """An arm whose file knows of no friction at any joint."""
    case = make_case("arm", NONE, seed)
    return replace(case, document={**case.document, "effects": []})


def told(case: Case) -> Diagnosis:
    return diagnose(case.model(), case.train, case.holdout, workers=2)


@pytest.mark.nightly
def test_friction_is_named_at_all_joints() -> None:
    why = told(without_friction(114))
    assert why.verdict == "effect_found"
    named = {(effect.name, effect.site) for effect in why.effects}
    assert {("coulomb_friction", joint) for joint in arm.NAMES} <= named
    assert {name for name, _ in named} == {"coulomb_friction", "viscous_friction"}
    assert len(named) >= 11


@pytest.mark.nightly
def test_friction_is_named_all_the_same_where_nothing_explains_another_joint(monkeypatch: pytest.MonkeyPatch) -> None:
    undisturbed = loop.Drives.effort

    def jammed(self: loop.Drives, history: Array, sample: int, sub: int, ripple: Array) -> Array:
        """Beside the drives, pulses at the fourth joint that follow nothing that is logged."""
        out = undisturbed(self, history, sample, sub, ripple)
        time, record = (sample * self.machine.substeps + sub) * self.step, np.arange(out.shape[1])
        pulses = np.sin(2.0 * np.pi * (0.83 + 0.21 * record) * time + 1.7 * record) * np.sin(5.1 * time + record)
        out[3] += 1.5 * np.where(pulses > 0.2, 1.0, -0.4)
        return out

    monkeypatch.setattr(loop.Drives, "effort", jammed)
    why = told(without_friction(114))
    named = {(effect.name, effect.site) for effect in why.effects}
    assert {("coulomb_friction", joint) for joint in OTHERS} <= named
    assert {site for _, site in named} == set(OTHERS)
    assert "What is left at j4 is structured" in why.summary
    left: Any = why.gap["j4.effort"]
    assert left.after > 0.5 * left.recalibrated
