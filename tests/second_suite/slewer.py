"""A slewing arm: a motor with gear and hub turns a steel strip with a heavy tip; a strain gauge sits near the root."""

from collections.abc import Callable

import numpy as np

from second_suite.blade import Blade, Bridge
from second_suite.machine import Array, Choice, Joint, Law, Machine, uneven
from second_suite.motions import chirp, mixed, moves, sines

GAIN, LIMIT = 1.2, 9.0
STRIP = Blade(0.6, 0.04, 0.003, 7850.0, 0.05, 0.35, 3e-4, 0.03, 0.3)
ENCODER, GAUGE = (2e-5, 5e-5), (4e-7, 2e-7)


def law(machine: Machine, columns: int) -> Law:
    """PID on the angle of the hub, whose rate is filtered; the integral waits while the current is at its limit."""
    total, dt = np.zeros(columns), 1.0 / machine.rate
    others = np.zeros((len(machine.joints) - 1, columns))

    def command(k: int, y: Array, dy: Array, asked: Array) -> Array:
        del k
        nonlocal total
        error = asked[0, 0] - y[0]
        tried = total + dt * error
        wanted = 110.0 * error + 160.0 * tried + 9.0 * (asked[1, 0] - dy[0])
        total = np.where(np.abs(wanted) < LIMIT, tried, total)
        return np.concatenate([np.clip(wanted, -LIMIT, LIMIT)[None], others])

    return command


def motion(rng: np.random.Generator, time: Array, record: int) -> Array:
    """Smooth moves and sines, of which some are as fast as the strip swings."""
    makers: tuple[Callable[[], Array], ...] = (
        lambda: moves(rng, time, 0.7, 1.0),
        lambda: sines(rng, time, 0.4, 0.15, 3.0, 6),
        lambda: chirp(rng, time, 0.12, 0.2, 6.0),
        lambda: mixed(rng, time, 0.6, 0.8, 2.0),
    )
    return np.stack([makers[record](), *[np.zeros_like(time)] * STRIP.modes], axis=1)


def document(number: Callable[[str], object], without: frozenset[str]) -> dict[str, object]:
    motor = {"joint": "slew", "gain": {"value": GAIN, "unit": "N m/A"}, "command_unit": "A"}
    sensors: dict[str, object] = {
        "encoder": {"measures": "slew.position", "noise": ENCODER[0], "resolution": ENCODER[1]},
        "bridge": {"measures": "root.strain", "noise": GAUGE[0], "resolution": GAUGE[1]},
    }
    return STRIP.document("slewer", "bezier(5)", number, without, {"motor": motor}, sensors)


MACHINE = Machine(
    name="slewer",
    joints=(
        Joint("slew", "motor", "encoder", GAIN, *ENCODER, 0.01),
        Bridge("root", "", "bridge", 1.0, *GAUGE),
        *(Joint(name) for name in ("pad", "third", "fourth")),
    ),
    rate=500.0,
    substeps=8,
    lengths=(9.0, 11.0, 8.0, 10.0),
    values={
        "hub.inertia": 0.09,
        "tip.mass": 0.35,
        "blade.young": 2.06e11,
        "blade.damping": 1.2e-3,
        "slew.rotor": 0.11,
        "slew.coulomb": 0.25,
        "slew.viscous": 0.18,
    },
    adjustable={"blade.young": 0.06, "blade.damping": 0.3, "slew.coulomb": 0.3, "slew.viscous": 0.3},
    tree=STRIP.tree(),
    law=law,
    motion=motion,
    document=document,
    friction_at_load=False,
    latency=1,
    choices=(
        Choice("coulomb_friction", "slew", base="slew.coulomb"),
        Choice("viscous_friction", "slew", base="slew.viscous"),
        Choice("rotor_inertia", "slew", base="slew.rotor"),
        Choice("structural_damping", "blade", base="blade.damping"),
        Choice("stribeck_friction", "slew", {"stribeck": (0.2, 0.35), "speed": (0.03, 0.08)}),
        uneven("slew", ((0.2, 0.3), (0.1, 0.2)), ((0.01, 0.02), (0.01, 0.02))),
        Choice("bias_force", "slew", {"force": (0.1, 0.2)}),
        Choice("spring", "slew", {"stiffness": (0.4, 0.8), "rest": (-0.2, 0.2)}),
        Choice("hysteresis", "slew", {"force": (0.2, 0.35), "way": (0.02, 0.05)}),
        Choice("torque_ripple", "slew", {"size": (0.1, 0.2), "period": (0.08, 0.15), "phase": (-3.0, 3.0)}),
        Choice("backlash", "slew", {"gap": (0.003, 0.007), "stiffness": (1.5e3, 3e3), "damping": (0.8, 1.5)}),
        Choice("joint_compliance", "slew", {"stiffness": (250.0, 500.0), "damping": (0.2, 0.5)}),
        Choice("payload", "tip", {"mass": (0.04, 0.09)}),
        Choice("gravity_tilt", "world", {"angle": (0.04, 0.07)}),
        Choice("input_delay", "motor", {"time": (0.004, 0.008)}),
        Choice("actuator_lag", "motor", {"time": (0.005, 0.01)}),
        Choice("dead_zone", "motor", {"width": (0.08, 0.16)}),
        Choice("saturation", "motor", {"limit": (1.5, 1.9)}),
        Choice("sensor_gain", "encoder", {"value": (1.04, 1.08)}),
        Choice("sensor_delay", "encoder", {"time": (0.004, 0.008)}),
        Choice("sensor_gain", "bridge", {"value": (1.08, 1.14)}),
        Choice("sensor_offset", "bridge", {"value": (6e-6, 1.5e-5)}),
        Choice("sensor_delay", "bridge", {"time": (0.004, 0.01)}),
    ),
    outside=(
        Choice("quadratic_drag", "slew", {"drag": (0.4, 0.8)}),
        Choice("cubic_spring", "slew", {"stiffness": (3.0, 6.0), "rest": (-0.1, 0.1)}),
        Choice("position_dependent_friction", "slew", {"coulomb": (0.25, 0.4), "period": (0.3, 0.5)}),
        # A felt pad on an arm of the hub rubs on the strip: dry friction against its bending, which no catalogue has.
        Choice("coulomb_friction", "pad", {"coulomb": (0.2, 0.4)}),
    ),
    pairs=(
        (("payload", "tip"), ("coulomb_friction", "slew")),
        (("torque_ripple", "slew"), ("sensor_gain", "bridge")),
        (("backlash", "slew"), ("structural_damping", "blade")),
    ),
)
