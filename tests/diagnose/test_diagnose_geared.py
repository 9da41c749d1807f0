"""Diagnosis of joints behind gears, of which a robot description tells inertia and no friction."""

import numpy as np

import geared_turntables
import vpm
from vpm.identify import InverseDynamicsProblem
from vpm.ranking.model_structure import Structure
from vpm.ranking.regression import regressed
from vpm.weighing import Prior


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


def test_names_no_friction_of_a_joint_that_has_none() -> None:
    only_one = [geared_turntables.log(seed, dry=(0.9, 0.0)) for seed in (33, 34)]
    found = vpm.rank(geared_turntables.MODEL, only_one, workers=1).effects
    names = {("viscous_friction", "one"), ("viscous_friction", "two"), ("coulomb_friction", "one")}
    assert {one.key for one in found} == names


def test_a_regression_finds_friction_however_far_above_inertia() -> None:
    model = geared_turntables.MODEL
    for joint in ("one", "two"):
        model = model.with_effect("viscous_friction", joint, viscous=0.0).with_effect("coulomb_friction", joint)
    log = geared_turntables.log(35)
    names = [f"{joint}.friction.{kind}" for kind in ("viscous", "coulomb") for joint in ("one", "two")]
    priors = {name: Prior(0.0, 0.05, 0.0, np.inf) for name in names}
    start = Structure(model, model.theta, priors)
    found = regressed(start, InverseDynamicsProblem(model, [log])).values
    truth = [*geared_turntables.DRAG, *geared_turntables.DRY]
    np.testing.assert_allclose([found[name] for name in names], truth, rtol=0.05)
