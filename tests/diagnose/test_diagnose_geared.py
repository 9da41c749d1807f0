"""Diagnosis of joints behind gears, of which a robot description tells inertia and no friction."""

from __future__ import annotations

import numpy as np

import geared_turntables
import vpm


def test_names_all_friction_of_gears_that_the_model_file_lacks() -> None:
    train, test = geared_turntables.log(31), geared_turntables.log(32)
    why = vpm.diagnose(geared_turntables.MODEL, train, test, workers=1)
    found = {(one.name, one.site): {value.name: value.value for value in one.parameters} for one in why.effects}
    assert set(found) == {(name, at) for name in ("viscous_friction", "coulomb_friction") for at in ("one", "two")}
    for place, joint in enumerate(("one", "two")):
        drag, dry = found["viscous_friction", joint]["viscous"], found["coulomb_friction", joint]["coulomb"]
        np.testing.assert_allclose(
            [drag, dry], [geared_turntables.DRAG[place], geared_turntables.DRY[place]], rtol=0.01
        )
    assert why.verdict == "effect_found"
