"""Effects that do less than any law of a machine is exact to: a search names none of them.

The pendulum's torque is that of a textbook, (J + m c^2) q'' + m g c sin q + d q', with dry friction beside it.
"""

import numpy as np
import pytest

import vpm

FILE = """
    name = "rod"
    gravity = [0.0, 0.0, -9.81]
    [bodies.rod]
    mass = 3.0
    center_of_mass = [0.0, 0.0, { value = -0.38, uncertainty = 0.05 }]
    inertia = [0.2, { value = 0.2, uncertainty = 0.06 }, 0.2, 0.0, 0.0, 0.0]
    [joints.hinge]
    type = "revolute"
    parent = "world"
    child = "rod"
    axis = [0.0, 1.0, 0.0]
    [actuators.motor]
    joint = "hinge"
    gain = 1.0
    command_unit = "N m"
    [[effects]]
    type = "viscous_friction"
    at = "hinge"
    viscous = { value = 0.3, uncertainty = 0.2 }
"""
MODEL = vpm.Model.from_toml(FILE)


def record(share: float, rhythm: float, seed: int) -> vpm.Experiment:
    """Record of a swing, with dry friction that is a share of the torque's root mean square."""
    time, drawn = np.arange(3000) / 500.0, np.random.default_rng(seed)
    sizes, rates = np.array([[0.5], [0.2]]), rhythm * np.array([[3.0], [7.1]])
    angle, velocity = np.sum(sizes * np.sin(rates * time), 0), np.sum(sizes * rates * np.cos(rates * time), 0)
    acceleration = -np.sum(sizes * rates**2 * np.sin(rates * time), 0)
    torque = (0.16 + 3.0 * 0.4**2) * acceleration + 3.0 * 9.81 * 0.4 * np.sin(angle) + 0.2 * velocity
    torque += share * np.sqrt(np.mean(torque**2)) * np.tanh(velocity / 0.05)
    values = {
        "hinge.position": angle + 1e-7 * drawn.standard_normal(time.size),
        "motor.command": torque + 1e-4 * drawn.standard_normal(time.size),
    }
    return vpm.Experiment.from_arrays(time, values, name=f"log{seed}", model=MODEL)


@pytest.mark.parametrize(("share", "named"), [(0.002, ()), (0.02, ("coulomb_friction",))])
def test_what_no_law_is_exact_to_has_no_name(share: float, named: tuple[str, ...]) -> None:
    logs = [record(share, rhythm, seed) for rhythm, seed in ((1.0, 1), (0.8, 2))]
    read = vpm.Setup(hold="first_order")
    why = vpm.diagnose(MODEL, *logs, effects=["coulomb_friction"], names="search", setup=read, check=False, workers=1)
    assert tuple(effect.name for effect in why.effects) == named
