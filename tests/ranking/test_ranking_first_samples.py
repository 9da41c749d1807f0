"""A record that begins with a jerk, of an arm whose controller is switched on while its sensor is off."""

import numpy as np

import vpm

MASS, CENTRE, INERTIA, DAMPING, GRAVITY = 3.2, 0.23, 0.42, 0.3, 9.81
OFFSET, NOISE, STEP, FINE = 0.09, 2e-5, 0.004, 20
MODEL = vpm.Model.from_toml(f"""
name = "arm"
gravity = [0.0, 0.0, -{GRAVITY}]
bodies.arm = {{ mass = {MASS}, center_of_mass = [0.0, 0.0, -{CENTRE}], inertia = [0.1, 0.05, 0.1, 0.0, 0.0, 0.0] }}
joints.elbow = {{ type = "revolute", parent = "world", child = "arm", axis = [0.0, 1.0, 0.0], rotor_inertia = 0.20072 }}
actuators.motor = {{ joint = "elbow", gain = 1.0, command_unit = "N m" }}
sensors.resolver = {{ measures = "elbow.position", noise = {NOISE} }}
effects = [{{ type = "viscous_friction", at = "elbow", viscous = {{ value = {DAMPING}, uncertainty = 0.1 }} }}]
""")


def swung(seed: int) -> vpm.Experiment:
    """Log of a swing from rest, by Newton's law: the first reading is off, and the controller throws the arm there."""
    dice, angle, speed = np.random.default_rng(seed), 0.0, 0.0
    time = STEP * np.arange(2500)
    way, rate = dice.uniform(0.3, 0.7, 3), dice.uniform(1.0, 6.0, 3)
    asked = np.minimum(time / 2.0, 1.0) * np.sum(way[:, None] * np.sin(rate[:, None] * time), axis=0)
    read, command, before = np.zeros(len(time)), np.zeros(len(time)), 0.0
    for sample, target in enumerate(asked):
        read[sample] = angle + OFFSET + NOISE * dice.normal()
        missing = target - read[sample]
        command[sample] = 90.0 * missing + 2.0 * (missing - before) / STEP
        before = missing
        for _ in range(FINE):
            effort = command[sample] - DAMPING * speed - MASS * GRAVITY * CENTRE * np.sin(angle)
            speed += effort / INERTIA * STEP / FINE
            angle += speed * STEP / FINE
    columns = {"elbow.position": read, "motor.command": command}
    return vpm.Experiment.from_arrays(time, columns, {}, name=f"swing {seed}", model=MODEL)


def test_what_a_tracker_makes_of_a_jerk_at_the_beginning_is_no_effect() -> None:
    ranking = vpm.rank(MODEL, [swung(1), swung(2)], workers=1)
    # A level arm that is tilted and an angle that is off are one physics.
    assert [one.effect for one in ranking.effects] in (["gravity_tilt"], ["sensor_offset"])
