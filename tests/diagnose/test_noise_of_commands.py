"""Noise of a command that no log holds: how much of it the readings of a cylinder allow."""

from dataclasses import replace

import numpy as np
import pytest

import vpm
from places import EXAMPLES
from vpm.discrepancy.noise.noise_floor import white_level
from vpm.discrepancy.noise.noise_spectrum import NoiseShape, noise_shapes
from vpm.discrepancy.settings import COMMAND_NOISE
from vpm.experiment import Experiment
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.numbers import Array

RATE = 1000.0
GAUGES = ("servo.pressure_a", "servo.pressure_b")


@pytest.fixture(scope="module")
def rig() -> Model:
    content = Model.load(EXAMPLES / "servo_cylinder" / "rig.toml").to_dict()
    measured = {"encoder": "axis.position", "gauge_a": GAUGES[0], "gauge_b": GAUGES[1]}
    content["sensors"] = {name: {"measures": channel} for name, channel in measured.items()}
    return Model.from_dict(content)


def problem(rig: Model, *, drive: float = 0.0, tank: Array | float = 0.0) -> InverseDynamicsProblem:
    """A log: the valve adds noise, a share ``drive`` of its command; the tank adds a pressure (Pa) to both gauges."""
    random, time = np.random.default_rng(4), np.arange(int(8.0 * RATE)) / RATE
    sent = 5e-4 * np.sin(2.0 * np.pi * time) + 3e-4 * np.sin(2.0 * np.pi * 1.7 * time)
    received = sent + drive * np.sqrt(np.mean(sent**2)) * random.standard_normal(len(time))
    command = Experiment.from_arrays(time, {"servo.command": received}, model=rig, name="bench")
    ran = vpm.simulate(rig, command, mode="free_run")
    read = {name: ran[name] + tank + 3e2 * random.standard_normal(len(time)) for name in GAUGES}
    read["axis.position"] = ran["axis.position"] + 1e-6 * random.standard_normal(len(time))
    log = Experiment.from_arrays(time, {"servo.command": sent, **read}, model=rig, name="bench")
    return InverseDynamicsProblem(rig, [log])


def of_gauges(rig: Model, one: InverseDynamicsProblem) -> dict[str, NoiseShape]:
    shapes = zip(one.blocks, noise_shapes(rig, one), strict=True)
    return {block.channel: shape for block, shape in shapes if shape is not None}


@pytest.mark.parametrize("share", [0.01, 0.05])
def test_readings_allow_the_noise_that_is_there(rig: Model, share: float) -> None:
    found = of_gauges(rig, problem(rig, drive=share))
    assert set(found) == set(GAUGES)
    for shape in found.values():
        assert shape.most >= (share / COMMAND_NOISE) ** 2


def test_a_pressure_that_wanders_is_no_noise_of_the_valve(rig: Model) -> None:
    """It has the spectrum of the noise that chambers integrate, but ends where that would go on to be read."""
    random, n = np.random.default_rng(5), int(8.0 * RATE)
    frequency = np.fft.rfftfreq(n, 1.0 / RATE)
    waves = random.standard_normal((2, frequency.size)) / np.maximum(frequency, 1.0) * (frequency < 60.0)
    wander = np.fft.irfft(waves[0] + 1j * waves[1], n)
    one = problem(rig, tank=6e5 * wander / wander.std())
    residual = one.evaluate(rig, rig.theta)[0]
    for block, shape in zip(one.blocks, noise_shapes(rig, one), strict=True):
        if shape is not None:
            bounded, free = (
                white_level(residual[block.samples], block.moving, bound) / block.weight
                for bound in (shape, replace(shape, most=np.inf))
            )
            assert bounded < 6e5 / 3.0
            assert bounded < 0.9 * free
