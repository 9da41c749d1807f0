"""Contacts that close and open again within a sample, between the stages of a long step."""

import numpy as np

import vpm

PUSH, SPRING, SPEED, ARRIVAL = 9.0, 1e5, 0.1, 1.5
#: A mass that its weight pulls up, away from the ground below.
GRAZE = f"""
name = "graze"
gravity = [0.0, 0.0, {PUSH}]

[bodies.mass]
mass = 1.0

[joints.guide]
type = "prismatic"
parent = "world"
child = "mass"
axis = [0.0, 0.0, 1.0]

[contacts.ground]
parent = "mass"
plane = {{ normal = [0.0, 0.0, 1.0] }}
stiffness = {SPRING}
"""


def test_a_touch_of_milliseconds_is_met_in_steps_of_a_second() -> None:
    # It flies towards the ground, in steps of a second as far as error control goes, touches it after 1.5 s at 0.1 m/s
    # for 8 ms, and flies off. On the ground it swings about a sag of m g / k and leaves as fast as it came.
    start = [SPEED * ARRIVAL + 0.5 * PUSH * ARRIVAL**2, -SPEED - PUSH * ARRIVAL]
    simulation = vpm.Simulation(vpm.Model.from_toml(GRAZE), 1.0, integrator="adaptive", state=start)
    for _ in range(3):
        simulation.step([])
    rate = np.sqrt(SPRING)
    touch = 2.0 * np.arctan(SPEED * rate / PUSH) / rate
    after = 3.0 - ARRIVAL - touch
    exact = [SPEED * after + 0.5 * PUSH * after**2, SPEED + PUSH * after]
    np.testing.assert_allclose(simulation.state[:2], exact, atol=1e-3)
