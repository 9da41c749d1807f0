"""A hanging slide behind a spring: nobody knows where the reading of the deflection has its zero."""

import numpy as np
import pytest

from model_texts import on_rail
from vpm import Experiment, Model, rank

J, L, K, DAMPING, G = 0.5, 2.0, 3000.0, 8.0, 9.81
HANGING = L * G / K  #: What its weight stretches the spring by, m.

SOFT = """
[[effects]]
type = "joint_compliance"
at = "axis"
stiffness = { value = 2800.0, uncertainty = 300.0 }
damping = { value = 9.0, uncertainty = 3.0 }
inertia = { value = 0.55, uncertainty = 0.3 }
"""


def hanging(springs: str, mass: str) -> Model:
    rotor = "" if springs else "rotor_inertia = { value = 0.55, uncertainty = 0.05 }\n"
    gravity, up = f"[0.0, 0.0, -{G}]", "[0.0, 0.0, 1.0]"
    text = on_rail("slide", mass, gain='{ value = 1.0, unit = "N/A" }', gravity=gravity, along=up)
    return Model.from_toml(text.replace("[actuators", rotor + "[actuators") + 'command_unit = "A"\n' + springs)


def hung_up(seed: int, model: Model, zero: float, fastest: float) -> Experiment:
    """A motor's motion with what hangs on a spring behind it, in closed form; the deflection reads ``zero`` more."""
    generator = np.random.default_rng(seed)
    time = 2e-3 * np.arange(3000)
    rates = 2.0 * np.pi * generator.uniform(0.1, 1.0, 8) * fastest
    sizes = 0.02 * np.exp(2j * np.pi * generator.uniform(size=8))
    bent = L * rates**2 / (K - L * rates**2 + 1j * DAMPING * rates) * sizes
    force = -J * rates**2 * sizes - (K + 1j * DAMPING * rates) * bent
    position, deflection, effort = (np.real(np.exp(1j * np.outer(time, rates)) @ each) for each in (sizes, bent, force))
    values = {
        "axis.position": position,
        "drive.command": effort + L * G,
        "axis_deflection.position": deflection - HANGING + zero,
    }
    noisy = {name: x + 1e-3 * x.std() * generator.standard_normal(x.size) for name, x in values.items()}
    return Experiment.from_arrays(time, noisy, model=model, name=f"run {seed}")


@pytest.mark.parametrize(
    ("springs", "mass", "zero", "fastest", "missing"),
    [
        (SOFT, "{ value = 2.1, uncertainty = 0.4 }", 0.1 * HANGING, 5.0, []),
        ("", "2.0", HANGING, 1.0, [("joint_compliance", "axis")]),
    ],
)
def test_the_zero_of_a_deflection_is_no_force(
    springs: str, mass: str, zero: float, fastest: float, missing: list[tuple[str, str]]
) -> None:
    model = hanging(springs, mass)
    names = ["bias_force", "cubic_spring", "joint_compliance"]
    found = rank(model, [hung_up(1, model, zero, fastest), hung_up(2, model, zero, fastest)], effects=names)
    assert [(one.effect, one.site) for one in found.effects] == missing
    assert found.model.parameters["axis_deflection_reading.offset.value"].value == pytest.approx(zero, rel=0.02)
