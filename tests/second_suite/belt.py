"""A carriage on a toothed belt: mm and A, on a level rail; a dry and viscous carriage guide behind the belt."""

from collections.abc import Callable

import numpy as np

from second_suite.machine import Array, Choice, Joint, Law, Machine, Values, loss_entries, uneven
from second_suite.motions import usual


def tree(values: Values, q: Array, v: Array) -> tuple[Array, Array]:
    """A mass on a level rail; a tilt of the rail pulls with its weight (`gravity_tilt`)."""
    del q
    mass = values["carriage.mass"]
    pull = 9.81 * mass * np.sin(values["tilt"]) if "tilt" in values else 0.0 * mass
    return mass[:, None, None], pull[None] + 0.0 * v


def law(machine: Machine, columns: int) -> Law:
    """Proportional and derivative, the wanted speed fed forward, in A."""
    del machine, columns

    def command(k: int, y: Array, dy: Array, asked: Array) -> Array:
        del k
        answer: Array = np.clip(720.0 * (asked[0] - y) + 16.0 * (asked[1] - dy), -9.0, 9.0)
        return answer

    return command


def motion(rng: np.random.Generator, time: Array, record: int) -> Array:
    return usual(rng, time, record, 0.3, 0.7, 2.5)[:, None]


def document(number: Callable[[str], object], without: frozenset[str]) -> dict[str, object]:
    joint: dict[str, object] = {
        "type": "prismatic",
        "parent": "world",
        "child": "carriage",
        "axis": [1.0, 0.0, 0.0],
        "rotor_inertia": number("axis.rotor"),
    }
    return {
        "name": "belt axis",
        "gravity": [0.0, 0.0, -9.81],
        "bodies": {"carriage": {"mass": number("carriage.mass")}},
        "joints": {"axis": joint},
        "actuators": {"drive": {"joint": "axis", "gain": {"value": GAIN, "unit": "N/A"}, "command_unit": "A"}},
        "sensors": {"encoder": {"measures": "axis.position", "noise": 4e-6, "resolution": 1e-5}},
        "effects": loss_entries(number, without, ["axis"]),
    }


GAIN = 42.0
MACHINE = Machine(
    name="belt",
    joints=(Joint("axis", "drive", "encoder", GAIN, 4e-6, 1e-5, 0.02, prismatic=True),),
    rate=400.0,
    substeps=10,
    lengths=(6.5, 9.0, 7.5, 8.0),
    values={"carriage.mass": 12.0, "axis.rotor": 6.0, "axis.coulomb": 14.0, "axis.viscous": 25.0},
    adjustable={"carriage.mass": 0.1, "axis.coulomb": 0.3, "axis.viscous": 0.3},
    tree=tree,
    law=law,
    motion=motion,
    document=document,
    latency=1,
    same=((("input_delay", "drive"), ("sensor_delay", "encoder")), (("bias_force", "axis"), ("gravity_tilt", "world"))),
    choices=(
        Choice("coulomb_friction", "axis", base="axis.coulomb"),
        Choice("viscous_friction", "axis", base="axis.viscous"),
        Choice("stribeck_friction", "axis", {"stribeck": (8.0, 14.0), "speed": (0.01, 0.03)}),
        uneven("axis", ((8.0, 14.0), (8.0, 20.0)), ((0.5, 1.0), (0.5, 1.0))),
        Choice("bias_force", "axis", {"force": (8.0, 16.0)}),
        Choice("spring", "axis", {"stiffness": (50.0, 110.0), "rest": (-0.05, 0.05)}),
        Choice("hysteresis", "axis", {"force": (12.0, 22.0), "way": (0.006, 0.015)}),
        Choice("torque_ripple", "axis", {"size": (5.0, 10.0), "period": (0.04, 0.08), "phase": (-3.0, 3.0)}),
        Choice("backlash", "axis", {"gap": (4e-4, 9e-4), "stiffness": (3e5, 5e5), "damping": (300.0, 600.0)}),
        Choice("joint_compliance", "axis", {"stiffness": (2.5e4, 6e4), "damping": (20.0, 50.0)}),
        Choice(
            "end_stop",
            "axis",
            {"stiffness": (6e3, 1.5e4), "damping": (0.3, 0.8), "end": (0.17, 0.2), "side": (1.0, 1.0)},
        ),
        Choice("input_delay", "drive", {"time": (0.005, 0.009)}),
        Choice("actuator_lag", "drive", {"time": (0.008, 0.016)}),
        Choice("dead_zone", "drive", {"width": (0.12, 0.3)}),
        Choice("saturation", "drive", {"limit": (1.1, 1.5)}),
        Choice("sensor_delay", "encoder", {"time": (0.005, 0.009)}),
    ),
    outside=(
        Choice("quadratic_drag", "axis", {"drag": (40.0, 80.0)}),
        Choice("cubic_spring", "axis", {"stiffness": (900.0, 1800.0), "rest": (-0.02, 0.02)}),
        Choice("warming_friction", "axis", {"coulomb": (12.0, 22.0), "time": (2.0, 4.0)}),
        Choice("position_dependent_friction", "axis", {"coulomb": (12.0, 22.0), "period": (0.25, 0.4)}),
    ),
    pairs=(
        (("backlash", "axis"), ("coulomb_friction", "axis")),
        (("torque_ripple", "axis"), ("input_delay", "drive")),
        (("hysteresis", "axis"), ("bias_force", "axis")),
    ),
)
