"""A slider-crank with a rigid rod, by its one equation of motion: dry friction on its guide, nothing on its pins."""

import math

import numpy as np

from vpm.experiment import Experiment
from vpm.model import Model

CRANK, ROD, SLIDER, ARM, LENGTH = 1.5, 0.8, 1.2, 0.1, 0.3
OF_CRANK, OF_ROD, OIL, GAIN = 0.01, 0.006, 0.05, 2.0
STEP, FINE, READING = 2e-3, 8, 2e-5

#: The machine without friction on its guide; the mass of the slider is a twentieth off.
SLIDER_CRANK = f"""
name = "slider_crank"
gravity = [0, 0, 0]
[bodies.wheel]
mass = {CRANK}
inertia = [{OF_CRANK}, {OF_CRANK}, {OF_CRANK}, 0, 0, 0]
[bodies.rod]
mass = {ROD}
center_of_mass = [{0.5 * LENGTH}, 0, 0]
inertia = [1e-5, {OF_ROD}, {OF_ROD}, 0, 0, 0]
[bodies.slider]
mass = {{ value = {1.05 * SLIDER}, uncertainty = 0.12 }}
[joints.crank]
type = "revolute"
parent = "world"
child = "wheel"
axis = [0, 1, 0]
[joints.pin]
type = "revolute"
parent = "wheel"
child = "rod"
translation = [{ARM}, 0, 0]
axis = [0, 1, 0]
[joints.guide]
type = "prismatic"
parent = "world"
child = "slider"
axis = [1, 0, 0]
[loops.wrist]
type = "spherical"
a = {{ parent = "rod", point = [{LENGTH}, 0, 0] }}
b = {{ parent = "slider" }}
start = {{ crank = 1.5, pin = -1.84, guide = 0.29 }}
[actuators.motor]
joint = "crank"
gain = {GAIN}
[[effects]]
type = "viscous_friction"
at = "crank"
viscous = {{ value = {0.9 * OIL}, uncertainty = 0.01 }}
"""


def _rod(angle: float) -> float:
    """Angle of the rod in the world."""
    return -math.asin(ARM / LENGTH * math.sin(angle))


def _slide(angle: float) -> float:
    """Place of the slider."""
    return ARM * math.cos(angle) + LENGTH * math.cos(_rod(angle))


def _levers(angle: float) -> tuple[float, float]:
    """By what the place of the slider changes with the angle of the crank, and the inertia that the crank feels."""
    rod = _rod(angle)
    turn = -ARM * math.cos(angle) / (LENGTH * math.cos(rod))
    slide = -ARM * math.sin(angle) - LENGTH * math.sin(rod) * turn
    half = 0.5 * LENGTH * turn
    centre = (-ARM * math.sin(angle) - half * math.sin(rod)) ** 2 + (ARM * math.cos(angle) + half * math.cos(rod)) ** 2
    return slide, OF_CRANK + ROD * centre + OF_ROD * turn**2 + SLIDER * slide**2


def _pushed(angle: float, rate: float, torque: float) -> float:
    """Acceleration of the crank without dry friction: ``M(q) q'' + M'(q) q'^2 / 2 = torque``."""
    slope = (_levers(angle + 1e-5)[1] - _levers(angle - 1e-5)[1]) / 2e-5
    return (torque - OIL * rate - 0.5 * slope * rate**2) / _levers(angle)[1]


def turned(*, dry: float = 0.0, seed: int = 0, duration: float = 4.0, channels: tuple[str, ...] = ()) -> Experiment:
    """The crank swings under a controller; dry friction (N) of the guide is an impulse that at most stops it.

    Steps by midpoints. The crank's encoder is logged, and ``channels``.
    """
    random, samples, h = np.random.default_rng(seed), round(duration / STEP), STEP / FINE
    time, phases = STEP * np.arange(samples), random.uniform(0.0, 2.0 * np.pi, 3)
    waves = [(0.8, 3.1), (0.3, 7.3), (0.08, 19.0)]
    wanted = 1.5 + np.sum([s * np.sin(w * time + p) for (s, w), p in zip(waves, phases, strict=True)], axis=0)
    angle, rate = float(wanted[0]), 0.0
    command, angles = np.empty(samples), np.empty(samples)
    for sample in range(samples):
        angles[sample] = angle
        command[sample] = float(np.clip(8.0 * (wanted[sample] - angle) - 0.4 * rate, -6.0, 6.0))
        torque = GAIN * float(command[sample])
        for _ in range(FINE):
            middle = rate + 0.5 * h * _pushed(angle, rate, torque)
            half, before = angle + 0.5 * h * rate, rate
            rate += h * _pushed(half, middle, torque)
            slide, inertia = _levers(half)
            most = h * dry * abs(slide) / inertia
            rate -= min(max(rate, -most), most)
            angle += 0.5 * h * (before + rate)
    places = {"crank.position": angles, "guide.position": np.array([_slide(float(one)) for one in angles])}
    read = {
        name: places[name] + noise * random.standard_normal(samples)
        for name, noise in (("crank.position", READING), *((name, 0.1 * READING) for name in channels))
    }
    model = Model.from_toml(SLIDER_CRANK)
    return Experiment.from_arrays(time, {"motor.command": command, **read}, model=model, name=f"swing {seed}")
