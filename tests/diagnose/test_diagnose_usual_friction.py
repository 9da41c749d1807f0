"""Arms of more joints than a ranking takes: friction that a description leaves out at all of them."""

from functools import cache

import numpy as np
import pytest

import vpm
from nightly import at_night
from vpm.numbers import Array

JOINTS = ("A1", "A2", "A3", "A4")
#: Dry friction in N m and viscous friction in N m s/rad of each joint.
DRY, OIL = (6.0, 9.0, 3.0, 1.2), (8.0, 10.0, 3.5, 0.9)
INTERVAL = 4e-3


def arm(friction: tuple[str, ...] = ()) -> vpm.Model:
    """Shoulder that turns about the vertical, two that lift, and a wrist; masses and centres known to some per cent."""
    mass = "mass = {{ value = {0}, uncertainty = {1} }}"
    lines = ['name = "arm"', "gravity = [0.0, 0.0, -9.81]"]
    placed = (("world", "z", (0, 0, 0)), ("b1", "y", (0, 0, 0.4)), ("b2", "y", (0.6, 0, 0)), ("b3", "x", (0.5, 0, 0)))
    for number, (parent, axis, origin) in enumerate(placed, 1):
        kilograms = 12.0 / number
        reach = "[{ value = 0.21, uncertainty = 0.02, unit = 'm' }, 0.01, 0.02]"
        moments = [0.01 * kilograms, 0.03 * kilograms, 0.03 * kilograms, 0.0, 0.0, 0.0]
        lines += [
            f"[bodies.b{number}]",
            mass.format(kilograms, 0.06 * kilograms),
            f"center_of_mass = {reach}",
            f"inertia = {moments}",
            f"[joints.A{number}]",
            f'type = "revolute"\nparent = "{parent}"\nchild = "b{number}"\ntranslation = {list(map(float, origin))}',
            f"axis = {[int(axis == other) for other in 'xyz']}",
            f'[actuators.M{number}]\njoint = "A{number}"\ngain = 1.0\ncommand_unit = "N m"',
        ]
    model = vpm.Model.from_toml("\n".join(lines))
    for joint, dry, oil in zip(JOINTS, DRY, OIL, strict=True):
        if joint in friction:
            model = model.with_effect("coulomb_friction", at=joint, coulomb=dry, transition_velocity=0.01)
            model = model.with_effect("viscous_friction", at=joint, viscous=oil)
    return model


@cache
def record(friction: tuple[str, ...], seed: int, seconds: float, ripple: float = 0.0) -> vpm.Experiment:
    """Log of a smooth motion: its efforts by inverse dynamics, and a ripple over the way of A3."""
    rng = np.random.default_rng(seed)
    time = np.arange(int(seconds / INTERVAL)) * INTERVAL
    turns = 2.0 * np.pi * rng.uniform(0.1, 0.5, (len(JOINTS), 3))
    phases, sizes = rng.uniform(0.0, 2.0 * np.pi, (2, len(JOINTS), 3))
    waves = [
        size * np.sin(turn * time[:, None] + phase)
        for size, turn, phase in zip(sizes / 9.0, turns, phases, strict=True)
    ]
    rates = [
        size * turn * np.cos(turn * time[:, None] + phase)
        for size, turn, phase in zip(sizes / 9.0, turns, phases, strict=True)
    ]
    position, velocity = (np.stack([one.sum(axis=1) for one in several], axis=1) for several in (waves, rates))
    acceleration = np.stack([-(wave * turn**2).sum(axis=1) for wave, turn in zip(waves, turns, strict=True)], axis=1)
    truth = arm(friction).with_parameters({"b2.mass": 6.3, "b3.center_of_mass.x": 0.225})
    effort = truth.core.inverse_dynamics(
        truth.theta, position, velocity, acceleration, np.zeros((len(time), len(JOINTS))), INTERVAL, []
    )[0]
    effort[:, 2] += ripple * np.sin(7.0 * position[:, 2] + 2.0 * np.sin(3.0 * position[:, 0]))
    data: dict[str, Array] = {}
    units: dict[str, str] = {}
    for place, joint in enumerate(JOINTS):
        data[f"{joint}.position"] = position[:, place] + rng.normal(0.0, 2e-6, len(time))
        data[f"M{place + 1}.command"] = effort[:, place] + rng.normal(0.0, 0.02, len(time))
        units |= {f"{joint}.position": "rad", f"M{place + 1}.command": "N m"}
    return vpm.Experiment.from_arrays(time, data, units=units)


def diagnosed(friction: tuple[str, ...], ripple: float = 0.0) -> vpm.Diagnosis:
    training, unseen = (record(friction, seed, seconds, ripple) for seed, seconds in ((1, 24.0), (2, 12.0)))
    usual = ["coulomb_friction", "viscous_friction"]
    return vpm.diagnose(arm(), training, unseen, effects=usual, check=False)


@pytest.mark.parametrize("ripple", at_night([0.0, 4.0], but=[4.0]))
def test_friction_is_named_at_all_joints_though_nothing_explains_one_of_them(ripple: float) -> None:
    found = diagnosed(JOINTS, ripple)
    named = {(one.name, one.site) for one in found.effects}
    explained = [joint for joint in JOINTS if not (ripple and joint == "A3")]
    assert {(name, joint) for name in ("coulomb_friction", "viscous_friction") for joint in explained} <= named
    values = {name: parameter.value for name, parameter in found.model.parameters.items()}
    for joint, dry, oil in zip(JOINTS, DRY, OIL, strict=True):
        if joint in explained:
            assert values[f"{joint}.friction.coulomb"] == pytest.approx(dry, rel=0.1 if ripple else 0.02)
            assert values[f"{joint}.friction.viscous"] == pytest.approx(oil, rel=0.1 if ripple else 0.02)


@pytest.mark.nightly
def test_friction_of_one_joint_is_not_seen_at_others() -> None:
    found = diagnosed(("A2",))
    assert {one.site for one in found.effects} == {"A2"}


def test_nothing_is_missing_where_no_joint_rubs() -> None:
    assert diagnosed(()).effects == ()
