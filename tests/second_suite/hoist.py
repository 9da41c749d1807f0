"""A hoist: a platform is driven up and down, a load hangs below it on a springy rope that nobody measures."""

from collections.abc import Callable

import numpy as np

from second_suite.machine import Array, Choice, Joint, Machine, Values, loss_entries, uneven
from second_suite.motions import usual
from second_suite.pid import Pid

LOAD_MASS, ROPE_DAMPING = 30.0, 70.0
GAIN = 95.0
METRE_PER_MINUTE = 1.0 / 60.0
PLATFORM_MASS = 40.0
#: Current that holds the weight of the data sheet.
HOLD = 9.81 * (PLATFORM_MASS + LOAD_MASS) / GAIN
SERVO = Pid("hoisting", "lift", 230.0, 600.0, 24.0, 7.0)


def tree(values: Values, q: Array, v: Array) -> tuple[Array, Array]:
    """Heights: the platform's, and the load's above where it hangs at rest without a payload. Both are heavy."""
    load_mass = LOAD_MASS + values.get("payload", np.zeros_like(q[0]))
    matrix = np.empty((q.shape[1], 2, 2))
    matrix[:, 0, 0] = values["platform.mass"] + load_mass
    matrix[:, 0, 1] = matrix[:, 1, 0] = matrix[:, 1, 1] = load_mass
    pull = np.empty_like(q)
    pull[0] = 9.81 * (values["platform.mass"] + load_mass)
    pull[1] = 9.81 * (load_mass - LOAD_MASS) + values["rope.stiffness"] * q[1] + ROPE_DAMPING * v[1]
    return matrix, pull


def rest(values: Values, first: Array) -> Array:
    """The load hangs at rest."""
    place = first.copy()
    place[1] = -9.81 * values.get("payload", np.zeros_like(first[1])) / values["rope.stiffness"]
    return place


def torque(rng: np.random.Generator, time: Array, record: int) -> tuple[Array, bool]:
    """What is added to the controller's output and logged beside it: the weight of the data sheet, in A."""
    del rng, record
    return np.stack([np.full_like(time, HOLD), np.zeros_like(time)], axis=1), False


def motion(rng: np.random.Generator, time: Array, record: int) -> Array:
    return np.stack([usual(rng, time, record, 0.4, 0.6, 2.2), np.zeros_like(time)], axis=1)


def document(number: Callable[[str], object], without: frozenset[str]) -> dict[str, object]:
    lift: dict[str, object] = {"type": "prismatic", "parent": "world", "child": "platform", "axis": [0.0, 0.0, 1.0]}
    if "lift.rotor" not in without:
        lift["rotor_inertia"] = number("lift.rotor")
    stiffness = number("rope.stiffness")
    written = float(str(stiffness["value"] if isinstance(stiffness, dict) else stiffness))
    # Zero is where the load hangs by the numbers of the file; the rope is relaxed above that.
    relaxed = 9.81 * LOAD_MASS / written
    rope: dict[str, object] = {"type": "spring", "at": "rope", "stiffness": stiffness, "rest": relaxed}
    return {
        "name": "hoist",
        "gravity": [0.0, 0.0, -9.81],
        "bodies": {"platform": {"mass": number("platform.mass")}, "load": {"mass": LOAD_MASS}},
        "joints": {
            "lift": lift,
            "rope": {"type": "prismatic", "parent": "platform", "child": "load", "axis": [0.0, 0.0, 1.0]},
        },
        "actuators": {"hoisting": {"joint": "lift", "gain": {"value": GAIN, "unit": "N/A"}, "command_unit": "A"}},
        "sensors": {
            "cable_encoder": {"measures": "lift.position", "noise": 5e-6, "resolution": 1e-5},
            "tacho": {"measures": "lift.velocity", "noise": 4e-4},
        },
        "controllers": {"servo": SERVO.entry()},
        "effects": [
            *loss_entries(number, without, ["lift"]),
            rope,
            {"type": "viscous_friction", "at": "rope", "viscous": ROPE_DAMPING},
        ],
    }


MACHINE = Machine(
    name="hoist",
    joints=(
        Joint("lift", "hoisting", "cable_encoder", GAIN, 5e-6, 1e-5, 0.02, True, "m/min", METRE_PER_MINUTE, 4e-4),
        Joint("rope", prismatic=True),
    ),
    rate=160.0,
    substeps=20,
    lengths=(8.0, 10.0, 9.0, 8.5),
    values={
        "platform.mass": PLATFORM_MASS,
        "rope.stiffness": 2.4e4,
        "lift.rotor": 25.0,
        "lift.coulomb": 30.0,
        "lift.viscous": 60.0,
    },
    adjustable={"platform.mass": 0.05, "rope.stiffness": 0.1, "lift.coulomb": 0.3, "lift.viscous": 0.3},
    tree=tree,
    law=SERVO.law,
    motion=motion,
    torque=torque,
    known_loop=True,
    rest=rest,
    document=document,
    choices=(
        Choice("coulomb_friction", "lift", base="lift.coulomb"),
        Choice("viscous_friction", "lift", base="lift.viscous"),
        Choice("rotor_inertia", "lift", base="lift.rotor"),
        Choice("coulomb_friction", "rope", {"coulomb": (15.0, 30.0)}),
        Choice("stribeck_friction", "lift", {"stribeck": (28.0, 40.0), "speed": (0.01, 0.03)}),
        uneven("lift", ((20.0, 40.0), (40.0, 80.0)), ((1.0, 2.0), (1.0, 2.0))),
        Choice("spring", "lift", {"stiffness": (100.0, 200.0), "rest": (-0.1, 0.1)}),
        Choice("hysteresis", "lift", {"force": (25.0, 45.0), "way": (0.01, 0.03)}),
        Choice("torque_ripple", "lift", {"size": (12.0, 22.0), "period": (0.08, 0.15), "phase": (-3.0, 3.0)}),
        Choice(
            "end_stop",
            "lift",
            {"stiffness": (8e3, 1.5e4), "damping": (0.3, 0.8), "end": (0.26, 0.28), "side": (1.0, 1.0)},
        ),
        Choice("payload", "load", {"mass": (4.0, 9.0)}),
        Choice("input_delay", "hoisting", {"time": (0.012, 0.02)}),
        Choice("actuator_lag", "hoisting", {"time": (0.015, 0.03)}),
        Choice("saturation", "hoisting", {"limit": (8.2, 8.8)}),
        Choice("sensor_gain", "cable_encoder", {"value": (1.05, 1.1)}),
    ),
    outside=(
        Choice("quadratic_drag", "lift", {"drag": (150.0, 300.0)}),
        Choice("cubic_spring", "lift", {"stiffness": (900.0, 1800.0), "rest": (-0.05, 0.05)}),
        Choice("warming_friction", "lift", {"coulomb": (30.0, 50.0), "time": (2.0, 4.0)}),
        Choice("position_dependent_friction", "lift", {"coulomb": (30.0, 50.0), "period": (0.3, 0.5)}),
    ),
    pairs=((("payload", "load"), ("coulomb_friction", "lift")), (("rotor_inertia", "lift"), ("torque_ripple", "lift"))),
)
