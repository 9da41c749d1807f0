"""A SCARA: two joints that turn in a level plane, a quill that slides down; computed torque; friction at the motors."""

from collections.abc import Callable

import numpy as np

from second_suite.machine import Array, Choice, Joint, Law, Machine, Values, columns_of, loss_entries, uneven
from second_suite.motions import usual

DEGREE = np.pi / 180.0
UPPER, UPPER_MASS, UPPER_LEVER = 0.35, 9.0, 0.17
FORE, FORE_MASS, FORE_LEVER = 0.3, 5.0, 0.14
QUILL_MASS, QUILL_INERTIA = 2.2, 0.004
NAMES = ("shoulder", "elbow", "quill")


def tree(values: Values, q: Array, v: Array) -> tuple[Array, Array]:
    """Two links and a point at their end; the quill slides along z, upward positive. A tilt turns gravity to +x."""
    tool = QUILL_MASS + values.get("payload", np.zeros_like(q[0]))
    tilt = values.get("tilt", np.zeros_like(q[0]))
    far = values["fore.inertia"] + FORE_MASS * FORE_LEVER**2 + QUILL_INERTIA + tool * FORE**2
    near = values["upper.inertia"] + UPPER_MASS * UPPER_LEVER**2 + (FORE_MASS + tool) * UPPER**2
    moment = FORE_MASS * FORE_LEVER + tool * FORE
    cross = UPPER * moment * np.cos(q[1])
    matrix = np.zeros((q.shape[1], 3, 3))
    matrix[:, 0, 0] = near + far + 2.0 * cross
    matrix[:, 0, 1] = matrix[:, 1, 0] = far + cross
    matrix[:, 1, 1] = far
    matrix[:, 2, 2] = tool
    bend = UPPER * moment * np.sin(q[1])
    aside = 9.81 * np.sin(tilt)
    load = np.empty_like(q)
    load[1] = bend * v[0] ** 2 + aside * moment * np.sin(q[0] + q[1])
    load[0] = -bend * (2.0 * v[0] + v[1]) * v[1] + load[1] - bend * v[0] ** 2
    load[0] += aside * (UPPER_MASS * UPPER_LEVER + (FORE_MASS + tool) * UPPER) * np.sin(q[0])
    load[2] = 9.81 * np.cos(tilt) * tool
    return matrix, load


def law(machine: Machine, columns: int) -> Law:
    """Computed torque from the data sheet, without friction."""
    values = columns_of(machine.values, columns)
    rotors = np.array([machine.values[f"{name}.rotor"] for name in NAMES])
    gains = np.array([joint.gain for joint in machine.joints])[:, None]
    stiff, limit = np.array([25.0, 28.0, 30.0])[:, None], np.array([9.0, 9.0, 6.0])[:, None]

    def command(k: int, y: Array, dy: Array, asked: Array) -> Array:
        del k
        matrix, load = tree(values, y, dy)
        matrix[:, range(3), range(3)] += rotors
        wanted = asked[2] + 1.6 * stiff * (asked[1] - dy) + stiff**2 * (asked[0] - y)
        answer: Array = np.clip((np.einsum("cij,jc->ic", matrix, wanted) + load) / gains, -limit, limit)
        return answer

    return command


def motion(rng: np.random.Generator, time: Array, record: int) -> Array:
    turns = [usual(rng, time, record, reach, speed, 1.8) for reach, speed in ((1.1, 2.2), (1.4, 2.8), (0.07, 0.25))]
    return np.stack(turns, axis=1)


def document(number: Callable[[str], object], without: frozenset[str]) -> dict[str, object]:
    joints: dict[str, dict[str, object]] = {
        "shoulder": {"type": "revolute", "parent": "world", "child": "upper", "axis": [0.0, 0.0, 1.0]},
        "elbow": {
            "type": "revolute",
            "parent": "upper",
            "child": "fore",
            "axis": [0.0, 0.0, 1.0],
            "translation": [UPPER, 0.0, 0.0],
        },
        "quill": {
            "type": "prismatic",
            "parent": "fore",
            "child": "tool",
            "axis": [0.0, 0.0, 1.0],
            "translation": [FORE, 0.0, 0.0],
        },
    }
    for name in NAMES:
        if f"{name}.rotor" not in without:
            joints[name]["rotor_inertia"] = number(f"{name}.rotor")
    return {
        "name": "scara",
        "gravity": [0.0, 0.0, -9.81],
        "bodies": {
            "upper": {
                "mass": UPPER_MASS,
                "center_of_mass": [UPPER_LEVER, 0.0, 0.0],
                "inertia": [0.2, 0.2, number("upper.inertia"), 0.0, 0.0, 0.0],
            },
            "fore": {
                "mass": FORE_MASS,
                "center_of_mass": [FORE_LEVER, 0.0, 0.0],
                "inertia": [0.1, 0.1, number("fore.inertia"), 0.0, 0.0, 0.0],
            },
            "tool": {"mass": QUILL_MASS, "inertia": [0.02, 0.02, QUILL_INERTIA, 0.0, 0.0, 0.0]},
        },
        "joints": joints,
        "actuators": {
            f"{joint.name}_motor": {"joint": joint.name, "gain": joint.gain, "command_unit": "A"}
            for joint in MACHINE.joints
        },
        "sensors": {
            joint.encoder: {"measures": f"{joint.name}.position", "noise": joint.noise, "resolution": joint.resolution}
            for joint in MACHINE.joints
        },
        "effects": loss_entries(number, without, NAMES),
    }


MACHINE = Machine(
    name="scara",
    joints=(
        Joint("shoulder", "shoulder_motor", "shoulder_encoder", 14.0, 2e-5, 4e-5, 0.015),
        Joint("elbow", "elbow_motor", "elbow_encoder", 7.0, 2e-5, 4e-5, 0.015),
        Joint("quill", "quill_motor", "quill_encoder", 30.0, 4e-6, 1e-5, 0.01, prismatic=True),
    ),
    rate=200.0,
    substeps=10,
    lengths=(7.0, 9.0, 6.0, 8.0),
    values={
        "upper.inertia": 0.12,
        "fore.inertia": 0.055,
        "shoulder.rotor": 0.55,
        "elbow.rotor": 0.18,
        "quill.rotor": 2.5,
        "shoulder.coulomb": 3.0,
        "elbow.coulomb": 1.6,
        "quill.coulomb": 6.0,
        "shoulder.viscous": 2.0,
        "elbow.viscous": 1.0,
        "quill.viscous": 20.0,
    },
    adjustable=dict.fromkeys(
        ("upper.inertia", "fore.inertia", *(f"{j}.coulomb" for j in NAMES), *(f"{j}.viscous" for j in NAMES)), 0.3
    ),
    tree=tree,
    law=law,
    motion=motion,
    document=document,
    friction_at_load=False,
    latency=1,
    choices=(
        Choice("coulomb_friction", "elbow", base="elbow.coulomb"),
        Choice("viscous_friction", "shoulder", base="shoulder.viscous"),
        Choice("rotor_inertia", "elbow", base="elbow.rotor"),
        Choice("stribeck_friction", "shoulder", {"stribeck": (1.5, 3.0), "speed": (0.03, 0.1)}),
        uneven("quill", ((3.0, 6.0), (4.0, 10.0)), ((0.1, 0.2), (0.1, 0.2))),
        Choice("bias_force", "quill", {"force": (5.0, 9.0)}),
        Choice("spring", "elbow", {"stiffness": (0.8, 1.8), "rest": (-0.4, 0.4)}),
        Choice("hysteresis", "shoulder", {"force": (2.5, 4.5), "way": (0.02, 0.05)}),
        Choice("torque_ripple", "shoulder", {"size": (0.8, 1.6), "period": (0.15, 0.3), "phase": (-3.0, 3.0)}),
        Choice("backlash", "elbow", {"gap": (0.004, 0.01), "stiffness": (1.2e4, 2e4), "damping": (8.0, 15.0)}),
        Choice("joint_compliance", "shoulder", {"stiffness": (1.2e3, 2.5e3), "damping": (1.0, 3.0)}),
        Choice(
            "end_stop",
            "elbow",
            {"stiffness": (60.0, 150.0), "damping": (0.1, 0.3), "end": (0.8, 0.95), "side": (1.0, 1.0)},
        ),
        Choice("payload", "tool", {"mass": (0.5, 1.2)}),
        Choice("gravity_tilt", "world", {"angle": (0.03, 0.06)}),
        Choice("input_delay", "elbow_motor", {"time": (0.01, 0.016)}),
        Choice("actuator_lag", "shoulder_motor", {"time": (0.012, 0.025)}),
        Choice("dead_zone", "elbow_motor", {"width": (0.12, 0.25)}),
        Choice("saturation", "shoulder_motor", {"limit": (0.8, 1.1)}),
        Choice("sensor_gain", "elbow_encoder", {"value": (1.12, 1.2)}),
        Choice("sensor_offset", "elbow_encoder", {"value": (0.08, 0.15)}),
    ),
    outside=(
        Choice("quadratic_drag", "shoulder", {"drag": (1.6, 2.8)}),
        Choice("warming_friction", "elbow", {"coulomb": (1.5, 2.5), "time": (2.0, 4.0)}),
        Choice("position_dependent_friction", "shoulder", {"coulomb": (3.0, 5.0), "period": (0.8, 1.2)}),
        Choice("load_dependent_friction", "quill", {"share": (0.12, 0.25)}),
    ),
    pairs=(
        (("payload", "tool"), ("coulomb_friction", "elbow")),
        (("joint_compliance", "shoulder"), ("gravity_tilt", "world")),
        (("backlash", "elbow"), ("viscous_friction", "shoulder")),
    ),
)
