"""A light slewing arm: a blade of aluminium on a gear, logged at 1 kHz, whose bending nobody measures."""

from collections.abc import Callable

import numpy as np

from second_suite.blade import Blade
from second_suite.machine import Array, Choice, Joint, Law, Machine, uneven
from second_suite.motions import moves, sines

GAIN, LIMIT = 0.8, 8.0
BLADE = Blade(0.7, 0.05, 0.004, 2700.0, 0.03, 0.3, 1e-4, 0.05, 0.4)
ENCODER = (1e-5, 3.8e-5)


def law(machine: Machine, columns: int) -> Law:
    """PI on the speed of the hub below P on its angle, with the wanted speed; the sum rests at the limit."""
    total, dt = np.zeros(columns), 1.0 / machine.rate
    others = np.zeros((len(machine.joints) - 1, columns))

    def command(k: int, y: Array, dy: Array, asked: Array) -> Array:
        del k
        nonlocal total
        slow = asked[1, 0] + 9.0 * (asked[0, 0] - y[0]) - dy[0]
        total = np.clip(total + dt * 35.0 * slow, -LIMIT, LIMIT)
        return np.concatenate([np.clip(6.0 * slow + total, -LIMIT, LIMIT)[None], others])

    return command


def motion(rng: np.random.Generator, time: Array, record: int) -> Array:
    """Sines, moves, sines around which the blade swings, and moves with sines on top."""
    path = {
        0: lambda: sines(rng, time, 0.4, 0.2, 2.0, 4),
        1: lambda: moves(rng, time, 0.9, 1.1),
        2: lambda: sines(rng, time, 0.06, 0.6, 5.0, 8),
        3: lambda: moves(rng, time, 0.6, 0.75) + sines(rng, time, 0.08, 0.5, 2.5, 3),
    }[record]()
    return np.stack([path, *[np.zeros_like(time)] * BLADE.modes], axis=1)


def document(number: Callable[[str], object], without: frozenset[str]) -> dict[str, object]:
    drive = {"joint": "slew", "gain": {"value": GAIN, "unit": "N m/A"}, "command_unit": "A"}
    sensors: dict[str, object] = {
        "resolver": {"measures": "slew.position", "noise": ENCODER[0], "resolution": ENCODER[1]}
    }
    return BLADE.document("sweeper", "bezier(5)", number, without, {"drive": drive}, sensors)


MACHINE = Machine(
    name="sweeper",
    joints=(
        Joint("slew", "drive", "resolver", GAIN, *ENCODER, 0.015),
        *(Joint(name) for name in ("root", "pad", "third", "fourth")),
    ),
    rate=1000.0,
    substeps=4,
    lengths=(8.0, 7.0, 6.0, 7.5),
    values={
        "hub.inertia": 0.07,
        "tip.mass": 0.3,
        "blade.young": 7e10,
        "blade.damping": 1e-3,
        "slew.rotor": 0.06,
        "slew.coulomb": 0.18,
        "slew.viscous": 0.15,
    },
    adjustable={
        "hub.inertia": 0.15,
        "tip.mass": 0.08,
        "blade.young": 0.05,
        "blade.damping": 0.4,
        "slew.coulomb": 0.3,
        "slew.viscous": 0.3,
    },
    tree=BLADE.tree(),
    law=law,
    motion=motion,
    document=document,
    same=((("input_delay", "drive"), ("sensor_delay", "resolver")),),
    choices=(
        Choice("coulomb_friction", "slew", base="slew.coulomb"),
        Choice("viscous_friction", "slew", base="slew.viscous"),
        Choice("structural_damping", "blade", base="blade.damping"),
        Choice("stribeck_friction", "slew", {"stribeck": (0.15, 0.3), "speed": (0.02, 0.06)}),
        uneven("slew", ((0.01, 0.02), (0.01, 0.02)), ((0.15, 0.25), (0.05, 0.1))),
        Choice("bias_force", "slew", {"force": (0.1, 0.2)}),
        Choice("spring", "slew", {"stiffness": (0.3, 0.6), "rest": (-0.2, 0.2)}),
        Choice("torque_ripple", "slew", {"size": (0.08, 0.15), "period": (0.05, 0.1), "phase": (-3.0, 3.0)}),
        Choice("backlash", "slew", {"gap": (0.004, 0.01), "stiffness": (1e3, 2e3), "damping": (0.4, 0.8)}),
        Choice("joint_compliance", "slew", {"stiffness": (120.0, 250.0), "damping": (0.1, 0.25)}),
        Choice("gravity_tilt", "world", {"angle": (0.04, 0.07)}),
        Choice("input_delay", "drive", {"time": (0.004, 0.008)}),
        Choice("actuator_lag", "drive", {"time": (0.005, 0.01)}),
        Choice("dead_zone", "drive", {"width": (0.12, 0.25)}),
        Choice("sensor_delay", "resolver", {"time": (0.004, 0.008)}),
    ),
    outside=(
        Choice("warming_friction", "slew", {"coulomb": (0.2, 0.35), "time": (2.0, 4.0)}),
        Choice("coulomb_friction", "pad", {"coulomb": (0.3, 0.5)}),
    ),
    pairs=(
        (("structural_damping", "blade"), ("bias_force", "slew")),
        (("joint_compliance", "slew"), ("coulomb_friction", "slew")),
    ),
)
