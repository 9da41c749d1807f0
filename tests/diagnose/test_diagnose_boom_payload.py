"""A boom on a geared motor, with a mass at its tip or a drifting bridge; records are of cubic finite elements."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.linalg import eigh, expm

import vpm
from vpm.experiment import Experiment
from vpm.model import Model

LENGTH, WIDTH, HEIGHT, YOUNG, DENSITY = 1.2, 0.04, 0.004, 70e9, 2700.0  # m, m, m, Pa, kg/m^3
TIP, HUB, RATIO, RESISTANCE, CONSTANT, ROTOR = 0.15, 0.01, 30.0, 1.2, 0.05, 2e-5  # kg, kg m^2, 1, Ohm, N m/A, kg m^2
DAMPING, ELEMENTS, MODES, GAUGE, STEP, COUNT = 0.01, 8, 2, 0.03, 0.004, 1500

FILE = f"""
name = "boom"
gravity = [0.0, 0.0, -9.81]
[bodies.hub]
mass = 1.0
inertia = [{HUB}, {HUB}, {HUB}, 0.0, 0.0, 0.0]
[joints.shoulder]
type = "revolute"
parent = "world"
child = "hub"
axis = [0.0, 0.0, 1.0]
[beams.boom]
parent = "hub"
rotation = [0.0, 1.5707963267948966, 0.0]
length = {LENGTH}
level = "modal(1)"
deforms = ["bending_x"]
material = {{ young = {{ value = 72.0, unit = "GPa", uncertainty = 5.0 }}, density = {DENSITY} }}
section = {{ shape = "rectangle", width = {WIDTH}, height = {HEIGHT} }}
damping = {{ ratios = [{{ value = {DAMPING}, uncertainty = 0.005 }}] }}
[gauges.root]
beam = "boom"
at = {GAUGE}
y = {-0.5 * HEIGHT}
[actuators.motor]
type = "dc_motor"
joint = "shoulder"
resistance = {RESISTANCE}
time_constant = 1e-4
torque_constant = {{ value = 0.045, uncertainty = 0.005 }}
gear_ratio = {RATIO}
rotor_inertia = {{ value = 2.3e-5, uncertainty = 4e-6 }}
[[effects]]
type = "viscous_friction"
at = "shoulder"
viscous = {{ value = 0.1, uncertainty = 0.1 }}
"""


def shapes(s: float, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Deflection and curvature of a cubic element of this size, by both ends' deflections and slopes."""
    deflection = [1 - 3 * s**2 + 2 * s**3, size * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, size * (s**3 - s**2)]
    curvature = [-6 + 12 * s, size * (-4 + 6 * s), 6 - 12 * s, size * (6 * s - 2)]
    return np.array(deflection), np.array(curvature) / size**2


def swung(seed: int, tip: float = TIP, push: float = 1.0, drift: tuple[float, float] = (0.0, 0.0)) -> Experiment:
    """Record of small motion, linear and exact between samples: angle and slowest modes of the clamped boom."""
    size, count = LENGTH / ELEMENTS, 2 * (ELEMENTS + 1)
    mass, stiffness = np.zeros((2, count, count))
    for element, (point, weight) in (
        (e, pair) for e in range(ELEMENTS) for pair in zip(*np.polynomial.legendre.leggauss(4), strict=True)
    ):
        here = slice(2 * element, 2 * element + 4)
        deflection, curvature = shapes(0.5 * (point + 1.0), size)
        mass[here, here] += 0.5 * size * weight * DENSITY * WIDTH * HEIGHT * np.outer(deflection, deflection)
        stiffness[here, here] += 0.5 * size * weight * YOUNG * WIDTH * HEIGHT**3 / 12.0 * np.outer(curvature, curvature)
    mass[-2, -2] += tip
    rigid = np.array([value for node in range(ELEMENTS + 1) for value in (node * size, 1.0)])
    squares, modes = eigh(stiffness[2:, 2:], mass[2:, 2:])
    squares, modes = squares[:MODES], np.vstack([np.zeros((2, MODES)), modes[:, :MODES]])
    inertia = np.eye(MODES + 1)
    inertia[0, 0] = rigid @ mass @ rigid + HUB + RATIO**2 * ROTOR
    inertia[0, 1:] = inertia[1:, 0] = modes.T @ mass @ rigid
    braking = np.diag([RATIO**2 * CONSTANT**2 / RESISTANCE, *(2.0 * DAMPING * np.sqrt(squares))])
    system = np.zeros((2 * MODES + 3, 2 * MODES + 3))  # angle and modes, their rates, voltage
    system[: MODES + 1, MODES + 1 : -1] = np.eye(MODES + 1)
    force = np.hstack([-np.diag([0.0, *squares]), -braking, [[RATIO * CONSTANT / RESISTANCE], *[[0.0]] * MODES]])
    system[MODES + 1 : -1] = np.linalg.solve(inertia, force)
    rng, time, step = np.random.default_rng(seed), STEP * np.arange(COUNT), expm(STEP * system)
    tones = [(3.0, 0.3), (2.0, 0.8), (1.2, 1.9)]
    voltage = push * sum(a * np.sin(2.0 * np.pi * f * time + rng.uniform(0.0, 2.0 * np.pi)) for a, f in tones)
    states = np.zeros((COUNT, 2 * MODES + 3))
    for k in range(COUNT - 1):
        states[k, -1] = voltage[k]
        states[k + 1] = step @ states[k]
    bent = modes[:4].T @ shapes(GAUGE / size, size)[1]
    values = {
        "motor.command": voltage,
        "shoulder.position": states[:, 0] + 5e-5 * rng.standard_normal(COUNT),
        "root.strain": 0.5 * HEIGHT * states[:, 1 : MODES + 1] @ bent
        + 3e-7 * rng.standard_normal(COUNT)
        + np.linspace(*drift, COUNT),
    }
    return Experiment.from_arrays(time, values, model=Model.from_toml(FILE), name=f"boom {seed}")


def test_a_tip_mass_is_named_whatever_the_constant_of_the_motor() -> None:
    """All forces may grow with that constant, which the file knows to 11 %; what only rounding shows stays at zero."""
    train, test = swung(1), swung(2)
    why = vpm.diagnose(Model.from_toml(FILE), train, test, effects=["payload"], check=False, workers=1)
    assert why.verdict == "effect_found"
    assert [(one.name, one.site) for one in why.effects] == [("payload", "boom")]
    found = {name: parameter.value for name, parameter in why.model.parameters.items()}
    # Slow swings tell the moment about the hub; how far beyond the tip the mass sits, they hardly do.
    moment = found["boom.payload.mass"] * (LENGTH + found["boom.payload.z"]) ** 2
    assert moment == pytest.approx(TIP * LENGTH**2, rel=0.1)
    assert found["boom.payload.x"] == 0.0  # upright, as the axis is
    assert why.gap["root.strain"].after < 0.2 * why.gap["root.strain"].recalibrated


def test_a_drifting_bridge_is_no_missing_physics() -> None:
    """Its zero moves by a tenth of the strains: no force of the boom does that, and a sensor is named."""
    ends = {"boom 3": (2e-6, 6e-6), "boom 4": (7e-6, 4e-6)}
    train, test = (swung(seed, 0.0, 0.2, ends[f"boom {seed}"]) for seed in (3, 4))
    model = Model.from_toml(FILE)
    why = vpm.diagnose(model, train, test, effects=["payload"], check=False, workers=1)
    assert why.verdict == "parameters_only", why.summary
    told = [re.search(r"offset of root.strain drifts from (\S+) to (\S+) 1 in (boom \d)", note) for note in why.notes]
    found = {one[3]: (float(one[1]), float(one[2])) for one in told if one is not None}
    assert found.keys() == ends.keys()
    for name, pair in found.items():
        assert pair == pytest.approx(ends[name], abs=3e-7)
