"""A drive that gives a tenth of what its controller asks for: nothing that the file states can make up for that."""

import numpy as np
import pytest

import vpm

INERTIA, PULL, COULOMB, VISCOUS, LIMIT = 0.046, 0.95, 0.11, 0.09, 0.5
STEP, FINE, NOISE = 0.001, 10, 2e-5
MODEL = vpm.Model.from_toml("""
name = "pendulum"
gravity = [0.0, 0.0, -9.81]
bodies.body.mass = 1.7
bodies.body.center_of_mass = [0.0, 0.0, { value = -0.0605, uncertainty = 0.006 }]
bodies.body.inertia = [0.035, { value = 0.0375, uncertainty = 0.004 }, 0.035, 0.0, 0.0, 0.0]
joints.axis = { type = "revolute", parent = "world", child = "body", axis = [0.0, 1.0, 0.0] }
actuators.drive = { joint = "axis", gain = 1.0, command_unit = "N m" }
sensors.encoder = { measures = "axis.position", noise = 2e-5 }

[[effects]]
type = "viscous_friction"
at = "axis"
viscous = { value = 0.084, uncertainty = 0.017 }

[[effects]]
type = "coulomb_friction"
at = "axis"
coulomb = { value = 0.105, uncertainty = 0.02 }
""")


def driven(seed: int, seconds: float = 5.0) -> vpm.Experiment:
    """Log of a cascaded controller whose drive saturates, by Newton's law in small steps."""
    dice, angle, speed = np.random.default_rng(seed), 0.0, 0.0
    time = STEP * np.arange(round(seconds / STEP))
    way, rate = dice.uniform(0.3, 0.8, 3), dice.uniform(0.8, 4.0, 3)
    asked = np.minimum(time, 1.0) * np.sum(way[:, None] * np.sin(rate[:, None] * time), axis=0)
    read, command, last = np.zeros(len(time)), np.zeros(len(time)), 0.0
    for sample, target in enumerate(asked):
        read[sample] = angle + NOISE * dice.normal()
        command[sample] = np.clip(2.4 * (11.0 * (target - read[sample]) - (read[sample] - last) / STEP), -4.2, 4.2)
        last = read[sample]
        torque = np.clip(command[sample], -LIMIT, LIMIT)
        for _ in range(FINE):
            friction = COULOMB * np.tanh(speed / 0.002) + VISCOUS * speed
            speed += (torque - friction - PULL * np.sin(angle)) / INERTIA * STEP / FINE
            angle += speed * STEP / FINE
    columns = {"axis.position": read, "drive.command": command}
    return vpm.Experiment.from_arrays(time, columns, {}, name=f"driven {seed}", model=MODEL)


def test_a_drive_far_below_its_commands_is_found_though_known_parameters_go_astray() -> None:
    ranking = vpm.rank(MODEL, [driven(1), driven(2)], workers=1)
    assert [(one.effect, one.site) for one in ranking.effects] == [("saturation", "drive")]
    assert ranking.model.parameters["drive.saturation.limit"].value == pytest.approx(LIMIT, rel=0.01)
    lost = ranking.recalibrated.parameters["axis.friction.viscous"].value
    assert lost > 0.3, "nothing but a tale of friction and mass is left without it"
