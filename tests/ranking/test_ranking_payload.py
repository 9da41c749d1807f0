"""A payload on a body that is nearly in equilibrium about its axis, beside a drive whose gain is not known well."""

import numpy as np

import vpm
from vpm.ranking import Settings

TUBE = """
name = "elevation axis"
gravity = [0.0, 0.0, -9.81]
bodies.tube.mass = 60.0
bodies.tube.center_of_mass = [0.02, 0.0, 0.03]
bodies.tube.inertia = [8.0, { value = 11.3, uncertainty = 1.2 }, 8.0, 0.0, 0.0, 0.0]
joints.axis = { type = "revolute", parent = "world", child = "tube", axis = [0, -1, 0] }
actuators.motor = { joint = "axis", gain = { value = 9.2, uncertainty = 0.3 }, command_unit = "A" }
"""
MASS, FORWARD, UP = 2.0, 0.35, 0.1  # kg and m of the payload
INERTIA, GAIN = 12.0, 9.0  # kg m^2 about the axis without it, N m/A
STEP = 4e-3  # s


def turned(model: vpm.Model, seed: int) -> vpm.Experiment:
    """Record of the axis by Newton's law, held by a weak servo, with the noise of an encoder."""
    random = np.random.default_rng(seed)
    phases, rates, parts = random.uniform(0.0, 6.0, 4), np.array([1.1, 2.3, 4.7, 8.9]), 25
    inertia = INERTIA + 60.0 * (0.02**2 + 0.03**2) + MASS * (FORWARD**2 + UP**2)
    across, along = 60.0 * 0.02 + MASS * FORWARD, 60.0 * 0.03 + MASS * UP
    angle, speed, rows = 0.1, 0.0, []
    for time in STEP * np.arange(2000):
        wanted = 0.1 + np.sum(0.25 / rates * np.sin(rates * time + phases))
        current = round((900.0 * (wanted - angle) - 90.0 * speed) / GAIN + 2.0, 3)
        rows.append((angle + 2e-6 * random.standard_normal(), current))
        for _ in range(parts):  # the middle of each part: of second order
            middle = angle + 0.5 * STEP / parts * speed
            load = 9.81 * (across * np.cos(middle) - along * np.sin(middle))
            speed += STEP / parts * (GAIN * current - load) / inertia
            angle = middle + 0.5 * STEP / parts * speed
    angles, currents = np.array(rows).T
    return vpm.Experiment.from_arrays(
        STEP * np.arange(len(rows)), {"axis.position": angles, "motor.command": currents}, model=model
    )


def test_a_payload_off_the_ray_through_the_centre_of_mass_is_found_where_the_gain_is_unknown() -> None:
    """Gravity alone gives efforts a scale: on that ray a payload is another gain, so it has to be sought beside it.

    A tilt leaves as little error, and so does a payload below the axis, by gains that the model file all but rules out.
    """
    model = vpm.Model.from_toml(TUBE)
    records, rivals = [turned(model, 1), turned(model, 2)], ("payload", "gravity_tilt", "spring", "bias_force")
    ranking = vpm.rank(model, records, [turned(model, 3)], effects=rivals, settings=Settings(effects=1), workers=1)
    assert [(one.effect, one.site) for one in ranking.effects] == [("payload", "tube")]
