"""Checks of arms that stand on their joints: they fall faster than a slow tracker draws them back."""

import math
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import vpm
from vpm.experiment import Experiment
from vpm.log_check import Settings
from vpm.log_check.falling import fall_rate
from vpm.log_check.related import left_of_velocities
from vpm.log_check.shares import Judge, Shares
from vpm.log_check.stretches import odd_stretches
from vpm.numbers import Array
from vpm.simulate import Setup

G, LENGTH, MASS, STEP, PER_TURN = 9.81, 0.05, 0.4, 1e-3, 2**16
FILE = f"""
    name = "finger"
    gravity = [0.0, 0.0, -{G}]
    [bodies.finger]
    mass = {{ value = {MASS}, uncertainty = 0.04 }}
    center_of_mass = [0.0, 0.0, {LENGTH}]
    inertia = {{ VALUE }}
    [joints.knuckle]
    type = "revolute"
    parent = "world"
    child = "finger"
    axis = [0.0, 1.0, 0.0]
    [actuators.motor]
    joint = "knuckle"
    command_unit = "N m"
    gain = 1.0
""".replace("{ VALUE }", "[1e-9, 1e-9, 1e-9, 0.0, 0.0, 0.0]")
MODEL = vpm.Model.from_toml(FILE)


@cache
def standing(factor: float = 1.0) -> Experiment:
    """A finger that a controller moves about its upright pose: m l^2 a = u + m g l sin q."""
    time = STEP * np.arange(8000)
    wanted = 0.5 * np.sin(2.0 * np.pi * 0.7 * time) + 0.3 * np.sin(2.0 * np.pi * 1.3 * time)
    inertia, angle, speed = MASS * LENGTH**2, 0.0, 0.0
    rows, before = [], 0.0
    for target in wanted:
        read = round(angle * PER_TURN / (2.0 * np.pi)) / PER_TURN * 2.0 * np.pi
        rate = (read - before) / STEP
        torque = inertia * (60.0**2 * (target - read) - 2.0 * 60.0 * rate)
        rows.append((read, rate, torque))
        before = read
        for _ in range(10):
            speed += STEP / 10 * (torque + MASS * G * LENGTH * math.sin(angle)) / inertia
            angle += STEP / 10 * speed
    read, rate, torque = np.array(rows[1:]).T
    values = {"knuckle.position": read, "knuckle.velocity": rate, "motor.command": factor * torque}
    return Experiment.from_arrays(time[1:], values, {}, name="standing", model=MODEL)


def test_a_pendulum_upside_down_falls_at_the_rate_of_its_length() -> None:
    assert fall_rate(MODEL, standing()) == pytest.approx(math.sqrt(G / LENGTH) / (2.0 * np.pi), rel=1e-3)
    hanging = standing().with_channel("knuckle.position", np.pi + 0.1 * standing()["knuckle.position"], "rad")
    assert fall_rate(MODEL, hanging) == 0.0


def test_a_clean_log_of_an_arm_that_stands_is_not_corrected() -> None:
    tried: list[str] = []

    def said(_: str, name: str, *__: int) -> None:
        tried.append(name)

    check = vpm.check_log(MODEL, standing(), workers=1, progress=said)
    assert not check.mistakes
    assert max(check.shares.values()) < Settings().harmless
    assert not any("late" not in sentence and "early" not in sentence for sentence in tried)


def test_a_wrong_unit_shows_on_an_arm_that_stands() -> None:
    (mistake,) = vpm.check_log(MODEL, standing(1e3), workers=1).mistakes
    assert mistake.channels == ("motor.command",)
    assert mistake.factor == pytest.approx(1e-3)


def test_a_velocity_is_judged_by_its_position_alone() -> None:
    record, name = standing(), "knuckle.velocity"
    assert left_of_velocities(record, (name, "knuckle.position"))[name] < 1e-3
    wrong = record.with_channel(name, 180.0 / np.pi * record[name], "rad/s")
    assert left_of_velocities(wrong, (name,))[name] == 1.0
    (mistake,) = vpm.check_log(MODEL, wrong, workers=1).mistakes
    assert mistake.channels == (name,)
    assert mistake.factor == pytest.approx(np.pi / 180.0)


def test_a_velocity_that_repeats_while_the_joint_goes_on_at_it_is_not_frozen() -> None:
    """Differences of an encoder that moves by two counts a sample are all the same, but for the digits of the file."""
    count, step = 1e-4, 0.01
    time = 1000.0 + step * np.arange(4000)
    speed = 2.0 + 1.7 * np.sin(0.05 * np.arange(time.size)) * np.sin(0.003 * np.arange(time.size))
    speed[1000:1101] = 2.0
    position = count * np.round(np.cumsum(speed))
    rate = np.round(np.diff(position, prepend=0.0) / step, 9)
    rate += 1e-6 * np.sin(7.0 * np.arange(time.size)) * (rate != rate[1050])
    names = ("knuckle.position", "knuckle.velocity")

    def sentences(position: Array) -> list[str]:
        values = {names[0]: position, names[1]: rate, "motor.command": np.zeros(time.size)}
        record = Experiment.from_arrays(time, values, {}, name="log", model=MODEL)
        return [one.sentence for one in odd_stretches(record, names, (), Settings()) if one.kind == "frozen"]

    assert not sentences(position)
    (sentence,) = sentences(position + 30.0 * count * np.sin(0.1 * np.arange(time.size)))
    begins, ends = (float(number) for number in re.findall(r"[0-9.]+(?= s)", sentence))
    assert begins == pytest.approx(1010.0, abs=0.1)
    assert ends == pytest.approx(1011.0, abs=0.1)


def test_a_wrong_effort_at_one_joint_moves_the_others_and_is_no_fall() -> None:
    """Where some effort is open, what a tracker leaves elsewhere may come from there."""
    judge = Judge(MODEL, Settings(), Setup())
    left = Shares({"one.position": 0.05, "two.position": 0.3}, MODEL.theta, efforts={"two.position": 1e-5})
    assert not judge.falls(left)
    assert not judge.falls(replace(left, efforts={**left.efforts, "one.position": 0.1}))
    assert judge.falls(replace(left, efforts={**left.efforts, "one.position": 1e-5}))
