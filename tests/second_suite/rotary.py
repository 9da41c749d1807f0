"""An arm that hangs on a gear of 50: degrees and A; one record swings under torques alone, without a controller."""

from collections.abc import Callable

import numpy as np

from second_suite.machine import Array, Choice, Joint, Law, Machine, Values, below, loss_entries, uneven
from second_suite.motions import fade, sines, usual

DEGREE = np.pi / 180.0
MASS, RATIO, TORQUE_PER_AMPERE = 3.2, 50.0, 0.09
GAIN = RATIO * TORQUE_PER_AMPERE


def tree(values: Values, q: Array, v: Array) -> tuple[Array, Array]:
    """A physical pendulum, hanging at zero; a tilt turns gravity about its axis."""
    lever = values["arm.lever"]
    inertia = values["arm.inertia"] + MASS * lever**2
    angle = q[0] - values["tilt"] if "tilt" in values else q[0]
    return inertia[:, None, None], (MASS * 9.81 * lever * np.sin(angle))[None] + 0.0 * v


def law(machine: Machine, columns: int) -> Law:
    """Computed torque with the numbers of the data sheet, which forgets all friction."""
    del columns
    lever = machine.values["arm.lever"]
    inertia = machine.values["arm.inertia"] + MASS * lever**2 + machine.values["elbow.rotor"]

    def command(k: int, y: Array, dy: Array, asked: Array) -> Array:
        del k
        wanted = asked[2] + 2.0 * 0.8 * 32.0 * (asked[1] - dy) + 32.0**2 * (asked[0] - y)
        answer: Array = np.clip((inertia * wanted + MASS * 9.81 * lever * np.sin(y)) / GAIN, -8.0, 8.0)
        return answer

    return command


def motion(rng: np.random.Generator, time: Array, record: int) -> Array:
    return usual(rng, time, record, 1.5, 3.2, 2.0)[:, None]


def torque(rng: np.random.Generator, time: Array, record: int) -> tuple[Array, bool]:
    """The third record: sums of sines in A on the hanging arm, nothing else."""
    if record != 2:
        return np.zeros((time.size, 1)), False
    # Around the natural frequency of the hanging arm a small torque swings it far.
    return (1.25 * fade(time) + 0.1)[:, None] * sines(rng, time, 1.0, 0.3, 1.6)[:, None], True


def document(number: Callable[[str], object], without: frozenset[str]) -> dict[str, object]:
    return {
        "name": "rotary arm",
        "gravity": [0.0, 0.0, -9.81],
        "bodies": {
            "arm": {
                "mass": MASS,
                "center_of_mass": [0.0, 0.0, below(number("arm.lever"))],
                "inertia": [0.1, number("arm.inertia"), 0.1, 0.0, 0.0, 0.0],
            }
        },
        "joints": {
            "elbow": {
                "type": "revolute",
                "parent": "world",
                "child": "arm",
                "axis": [0.0, 1.0, 0.0],
                "rotor_inertia": number("elbow.rotor"),
            }
        },
        "actuators": {"motor": {"joint": "elbow", "gain": {"value": GAIN, "unit": "N m/A"}, "command_unit": "A"}},
        "sensors": {"resolver": {"measures": "elbow.position", "noise": 0.001 * DEGREE, "resolution": 0.002 * DEGREE}},
        "effects": loss_entries(number, without, ["elbow"]),
    }


MACHINE = Machine(
    name="rotary",
    joints=(Joint("elbow", "motor", "resolver", GAIN, 0.001 * DEGREE, 0.002 * DEGREE, 0.006),),
    rate=250.0,
    substeps=16,
    lengths=(8.0, 10.0, 7.0, 9.0),
    values={"arm.lever": 0.22, "arm.inertia": 0.045, "elbow.rotor": 0.2, "elbow.coulomb": 0.55, "elbow.viscous": 0.3},
    adjustable={"arm.lever": 0.08, "arm.inertia": 0.2, "elbow.coulomb": 0.3, "elbow.viscous": 0.3},
    tree=tree,
    law=law,
    motion=motion,
    torque=torque,
    document=document,
    same=(
        (("input_delay", "motor"), ("sensor_delay", "resolver")),
        (("sensor_offset", "resolver"), ("gravity_tilt", "world")),
    ),
    choices=(
        Choice("coulomb_friction", "elbow", base="elbow.coulomb"),
        Choice("viscous_friction", "elbow", base="elbow.viscous"),
        Choice("stribeck_friction", "elbow", {"stribeck": (0.5, 0.8), "speed": (0.08, 0.2)}),
        uneven("elbow", ((0.01, 0.02), (0.01, 0.02)), ((0.5, 0.8), (0.1, 0.2))),
        Choice("bias_force", "elbow", {"force": (0.5, 0.9)}),
        Choice("spring", "elbow", {"stiffness": (1.2, 2.2), "rest": (0.3, 0.6)}),
        Choice("hysteresis", "elbow", {"force": (0.7, 1.2), "way": (0.03, 0.08)}),
        Choice("torque_ripple", "elbow", {"size": (0.25, 0.5), "period": (0.15, 0.3), "phase": (-3.0, 3.0)}),
        Choice("backlash", "elbow", {"gap": (0.01, 0.025), "stiffness": (2e3, 4e3), "damping": (1.5, 3.0)}),
        Choice("joint_compliance", "elbow", {"stiffness": (180.0, 350.0), "damping": (0.3, 0.6)}),
        Choice(
            "end_stop",
            "elbow",
            {"stiffness": (60.0, 150.0), "damping": (0.1, 0.3), "end": (-0.8, -0.6), "side": (-1.0, -1.0)},
        ),
        Choice("gravity_tilt", "world", {"angle": (0.06, 0.12)}),
        Choice("input_delay", "motor", {"time": (0.007, 0.014)}),
        Choice("actuator_lag", "motor", {"time": (0.01, 0.02)}),
        Choice("dead_zone", "motor", {"width": (0.07, 0.15)}),
        Choice("saturation", "motor", {"limit": (1.2, 1.5)}),
        Choice("sensor_offset", "resolver", {"value": (0.06, 0.12)}),
        Choice("sensor_delay", "resolver", {"time": (0.007, 0.014)}),
    ),
    outside=(
        Choice("quadratic_drag", "elbow", {"drag": (0.25, 0.45)}),
        Choice("cubic_spring", "elbow", {"stiffness": (0.9, 1.6), "rest": (-0.1, 0.1)}),
        Choice("warming_friction", "elbow", {"coulomb": (0.6, 1.1), "time": (2.0, 4.0)}),
        Choice("position_dependent_friction", "elbow", {"coulomb": (0.6, 1.1), "period": (1.0, 1.6)}),
        Choice("load_dependent_friction", "elbow", {"share": (0.12, 0.22)}),
    ),
    pairs=(
        (("joint_compliance", "elbow"), ("bias_force", "elbow")),
        (("coulomb_friction", "elbow"), ("sensor_offset", "resolver")),
        (("torque_ripple", "elbow"), ("saturation", "motor")),
    ),
)
