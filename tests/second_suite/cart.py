"""A cart that a pendulum hangs on: the pendulum has an encoder and no drive, the cart a controller that is known."""

from collections.abc import Callable

import numpy as np

from second_suite.machine import Array, Choice, Joint, Machine, Values, below, loss_entries
from second_suite.motions import usual
from second_suite.pid import Pid

BOB_MASS, BOB_INERTIA, PAYLOAD_AT = 0.9, 0.014, 0.55
GAIN = 20.0
SERVO = Pid("winch", "rail", 90.0, 60.0, 14.0, 6.0)


def tree(values: Values, q: Array, v: Array) -> tuple[Array, Array]:
    """Lagrange's equations of a pendulum on a cart; both angles against the vertical, the tilt turns gravity."""
    lever, extra = values["bob.lever"], values.get("payload", np.zeros_like(q[0]))
    mass = BOB_MASS + extra
    moment = BOB_MASS * lever + extra * PAYLOAD_AT
    inertia = BOB_INERTIA + BOB_MASS * lever**2 + extra * PAYLOAD_AT**2
    tilt = values.get("tilt", np.zeros_like(q[0]))
    # Positive about y, the hanging bob moves to -x.
    matrix = np.empty((q.shape[1], 2, 2))
    matrix[:, 0, 0] = values["cart.mass"] + mass
    matrix[:, 0, 1] = matrix[:, 1, 0] = -moment * np.cos(q[1])
    matrix[:, 1, 1] = inertia
    load = np.empty_like(q)
    load[0] = moment * np.sin(q[1]) * v[1] ** 2 + 9.81 * (values["cart.mass"] + mass) * np.sin(tilt)
    load[1] = 9.81 * moment * np.sin(q[1] - tilt)
    return matrix, load


def motion(rng: np.random.Generator, time: Array, record: int) -> Array:
    return np.stack([usual(rng, time, record, 0.35, 0.8, 1.8), np.zeros_like(time)], axis=1)


def rest(values: Values, first: Array) -> Array:
    """The pendulum hangs along gravity."""
    place = first.copy()
    place[1] = values.get("tilt", np.zeros_like(first[1]))
    return place


def document(number: Callable[[str], object], without: frozenset[str]) -> dict[str, object]:
    return {
        "name": "cart with a pendulum",
        "gravity": [0.0, 0.0, -9.81],
        "bodies": {
            "cart": {"mass": number("cart.mass")},
            "bob": {
                "mass": BOB_MASS,
                "center_of_mass": [0.0, 0.0, below(number("bob.lever"))],
                "inertia": [BOB_INERTIA, BOB_INERTIA, 1e-3, 0.0, 0.0, 0.0],
            },
        },
        "joints": {
            "rail": {"type": "prismatic", "parent": "world", "child": "cart", "axis": [1.0, 0.0, 0.0]},
            "pivot": {"type": "revolute", "parent": "cart", "child": "bob", "axis": [0.0, 1.0, 0.0]},
        },
        "actuators": {"winch": {"joint": "rail", "gain": {"value": GAIN, "unit": "N/A"}, "command_unit": "A"}},
        "sensors": {
            "tape": {"measures": "rail.position", "noise": 2e-5, "resolution": 5e-5},
            "swing": {"measures": "pivot.position", "noise": 3e-4, "resolution": 7.7e-4},
        },
        "controllers": {"servo": SERVO.entry()},
        "effects": loss_entries(number, without, ["rail"], ["pivot"]),
    }


MACHINE = Machine(
    name="cart",
    joints=(
        Joint("rail", "winch", "tape", GAIN, 2e-5, 5e-5, 0.008, prismatic=True),
        Joint("pivot", "", "swing", 1.0, 3e-4, 7.7e-4),
    ),
    rate=125.0,
    substeps=16,
    lengths=(9.0, 12.0, 8.0, 11.0),
    values={"cart.mass": 4.0, "bob.lever": 0.33, "rail.coulomb": 3.0, "rail.viscous": 6.0, "pivot.viscous": 0.006},
    adjustable={"cart.mass": 0.1, "bob.lever": 0.05, "rail.coulomb": 0.3, "rail.viscous": 0.3, "pivot.viscous": 0.5},
    tree=tree,
    law=SERVO.law,
    motion=motion,
    rest=rest,
    document=document,
    known_loop=True,
    choices=(
        Choice("coulomb_friction", "rail", base="rail.coulomb"),
        Choice("coulomb_friction", "pivot", {"coulomb": (0.02, 0.05)}),
        Choice("stribeck_friction", "rail", {"stribeck": (2.5, 4.0), "speed": (0.03, 0.07)}),
        Choice("bias_force", "rail", {"force": (2.0, 4.0)}),
        Choice("spring", "rail", {"stiffness": (12.0, 25.0), "rest": (-0.05, 0.05)}),
        Choice("spring", "pivot", {"stiffness": (0.25, 0.6), "rest": (0.15, 0.3)}),
        Choice("hysteresis", "rail", {"force": (3.0, 5.0), "way": (0.01, 0.03)}),
        Choice("payload", "bob", {"mass": (0.1, 0.25)}),
        Choice("gravity_tilt", "world", {"angle": (0.04, 0.09)}),
        Choice("input_delay", "winch", {"time": (0.016, 0.026)}),
        Choice("actuator_lag", "winch", {"time": (0.02, 0.035)}),
        Choice("dead_zone", "winch", {"width": (0.1, 0.2)}),
        Choice("saturation", "winch", {"limit": (0.7, 0.9)}),
        Choice("sensor_offset", "swing", {"value": (0.04, 0.08)}),
        Choice("sensor_gain", "swing", {"value": (1.08, 1.15)}),
        Choice("sensor_delay", "swing", {"time": (0.02, 0.035)}),
    ),
    outside=(
        Choice("quadratic_drag", "pivot", {"drag": (0.008, 0.02)}),
        Choice("cubic_spring", "rail", {"stiffness": (150.0, 300.0), "rest": (-0.02, 0.02)}),
        Choice("warming_friction", "rail", {"coulomb": (2.5, 5.0), "time": (3.0, 5.0)}),
    ),
    pairs=((("coulomb_friction", "pivot"), ("bias_force", "rail")), (("sensor_offset", "swing"), ("spring", "rail"))),
)
