"""A six-axis arm of the size of a PUMA 560: degrees and A, a weak servo with gravity fed forward.

Sizes, masses and inertias after B. Armstrong, O. Khatib, J. Burdick, "The explicit dynamic model and inertial
parameters of the PUMA 560 arm", IEEE Robotics and Automation 1986, rounded; frames after Craig (modified
Denavit-Hartenberg).
The published moments of the third link are none that a body can have: its smallest is 0.0225 kg m^2 here.
"""

from collections.abc import Callable

import numpy as np

from second_suite.machine import Array, Choice, Joint, Law, Machine, Values, columns_of, loss_entries
from second_suite.motions import mixed, moves, sines

DEGREE = np.pi / 180.0
COUNT = 6
ALPHA = np.array([0.0, -90.0, 0.0, -90.0, 90.0, -90.0]) * DEGREE
A = np.array([0.0, 0.0, 0.432, 0.020, 0.0, 0.0])
D = np.array([0.0, 0.0, 0.149, 0.433, 0.0, 0.0])
MASS = np.array([10.0, 17.4, 4.8, 0.82, 0.34, 0.09])
CENTRE = np.array(
    [[0, 0, 0], [0.068, 0.006, -0.016], [0, -0.07, 0.014], [0, 0, -0.019], [0, 0, 0], [0, 0, 0.032]], dtype=float
)
INERTIA = np.array(
    [
        [0.35, 0.35, 0.35],
        [0.13, 0.524, 0.539],
        [0.066, 0.0225, 0.086],
        [1.8e-3, 1.3e-3, 1.8e-3],
        [3e-4, 3e-4, 4e-4],
        [1.5e-4, 1.5e-4, 4e-5],
    ]
)
PAYLOAD_AT = np.array([0.03, 0.0, 0.09])
GAIN = (11.0, 20.0, 10.0, 2.6, 2.4, 2.4)
NAMES = tuple(f"j{i}" for i in range(1, COUNT + 1))
#: Around which the arm moves, how far, and how fast.
MIDDLE = np.array([0.2, -0.6, 0.9, 0.3, 0.7, -0.2])
REACH = np.array([1.0, 0.7, 0.8, 1.2, 0.9, 1.4])
SPEED = np.array([1.3, 1.0, 1.4, 2.2, 2.0, 2.6])


def _cross(a: Array, b: Array) -> Array:
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


def tree(values: Values, q: Array, v: Array) -> tuple[Array, Array]:
    """Newton's and Euler's equations in world axes, projected on the joints (d'Alembert): no recursion backwards.

    Vectors are (3, columns), rotations (columns, 3, 3). A tilt turns gravity about y of the world.
    """
    columns = q.shape[1]
    zero = np.zeros((3, columns))
    tilt = values.get("tilt", np.zeros(columns))
    # A machine that accelerates upward feels the same as one in gravity.
    turn, place, omega, alpha = np.broadcast_to(np.eye(3), (columns, 3, 3)), zero, zero, zero
    lift = np.stack([9.81 * np.sin(tilt), zero[0], 9.81 * np.cos(tilt)])
    axes, places = [], []
    mass, load = np.zeros((columns, COUNT, COUNT)), np.zeros((COUNT, columns))
    for i in range(COUNT):
        c, s, ca, sa = np.cos(q[i]), np.sin(q[i]), np.cos(ALPHA[i]), np.sin(ALPHA[i])
        local = np.zeros((columns, 3, 3))
        local[:, 0, 0], local[:, 0, 1] = c, -s
        local[:, 1, 0], local[:, 1, 1], local[:, 1, 2] = s * ca, c * ca, -sa
        local[:, 2, 0], local[:, 2, 1], local[:, 2, 2] = s * sa, c * sa, ca
        arm = (turn @ np.array([A[i], -sa * D[i], ca * D[i]])).T
        place = place + arm
        lift = lift + _cross(alpha, arm) + _cross(omega, _cross(omega, arm))
        turn = turn @ local
        z = turn[:, :, 2].T
        alpha = alpha + _cross(omega, z * v[i])
        omega = omega + z * v[i]
        axes.append(z)
        places.append(place)
        parts = [(np.full(columns, MASS[i]), CENTRE[i], INERTIA[i])]
        if i == COUNT - 1 and "payload" in values:
            parts.append((values["payload"], PAYLOAD_AT, np.zeros(3)))
        for weight, centre, inertia in parts:
            offset = (turn @ centre).T
            rate = lift + _cross(alpha, offset) + _cross(omega, _cross(omega, offset))
            spun = np.stack(axes, axis=1)
            swept = _cross(spun, (place + offset)[:, None] - np.stack(places, axis=1))
            load[: i + 1] += np.einsum("xkc,xc->kc", swept, weight * rate)
            across = swept.transpose(2, 1, 0)
            mass[:, : i + 1, : i + 1] += weight[:, None, None] * (across @ across.transpose(0, 2, 1))
            if inertia.any():
                own = spun.transpose(2, 1, 0) @ turn
                mass[:, : i + 1, : i + 1] += (own * inertia) @ own.transpose(0, 2, 1)
                omega_own = (turn.transpose(0, 2, 1) @ omega.T[:, :, None])[:, :, 0].T
                alpha_own = (turn.transpose(0, 2, 1) @ alpha.T[:, :, None])[:, :, 0].T
                moment = inertia[:, None] * alpha_own + _cross(omega_own, inertia[:, None] * omega_own)
                load[: i + 1] += (own @ moment.T[:, :, None])[:, :, 0].T
    return mass, load


def law(machine: Machine, columns: int) -> Law:
    """Independent joints with the wanted speed, and the weight at the readings, fed forward."""
    values = columns_of(machine.values, columns)
    gains = np.array(GAIN)[:, None]
    stiff = np.array([1800.0, 4000.0, 1100.0, 110.0, 90.0, 90.0])[:, None]
    slow = np.array([110.0, 230.0, 55.0, 9.0, 7.0, 7.0])[:, None]
    still = np.zeros((COUNT, columns))

    def command(k: int, y: Array, dy: Array, asked: Array) -> Array:
        del k
        _, weight = tree(values, y, still)
        answer: Array = np.clip((stiff * (asked[0] - y) + slow * (asked[1] - dy) + weight) / gains, -9.0, 9.0)
        return answer

    return command


def motion(rng: np.random.Generator, time: Array, record: int) -> Array:
    paths = []
    for i in range(COUNT):
        if record in {0, 2}:
            path = moves(rng, time, REACH[i], SPEED[i])
        elif record == 1:
            path = sines(rng, time, REACH[i], 0.12, 0.9)
        else:
            path = mixed(rng, time, REACH[i], SPEED[i], 1.2)
        paths.append(path + MIDDLE[i])
    return np.stack(paths, axis=1)


def document(number: Callable[[str], object], without: frozenset[str]) -> dict[str, object]:
    joints: dict[str, object] = {}
    for i, name in enumerate(NAMES):
        joint: dict[str, object] = {
            "type": "revolute",
            "parent": f"link{i}" if i else "world",
            "child": f"link{i + 1}",
            "dh": {"convention": "modified", "a": float(A[i]), "alpha": float(ALPHA[i]), "d": float(D[i])},
        }
        if f"{name}.rotor" not in without:
            joint["rotor_inertia"] = number(f"{name}.rotor")
        joints[name] = joint
    return {
        "name": "six-axis arm",
        "gravity": [0.0, 0.0, -9.81],
        "bodies": {
            f"link{i + 1}": {
                "mass": float(MASS[i]),
                "center_of_mass": CENTRE[i].tolist(),
                "inertia": [*INERTIA[i].tolist(), 0.0, 0.0, 0.0],
            }
            for i in range(COUNT)
        },
        "joints": joints,
        "actuators": {
            f"m{i + 1}": {"joint": name, "gain": GAIN[i], "command_unit": "A"} for i, name in enumerate(NAMES)
        },
        "sensors": {
            f"e{i + 1}": {"measures": f"{name}.position", "noise": 2e-5, "resolution": 5e-5}
            for i, name in enumerate(NAMES)
        },
        "effects": loss_entries(number, without, NAMES),
    }


COULOMB = (5.5, 8.0, 4.0, 1.2, 1.0, 0.8)
VISCOUS = (4.0, 6.0, 2.5, 0.6, 0.5, 0.4)
ROTOR = (1.14, 4.71, 0.83, 0.2, 0.18, 0.19)
MACHINE = Machine(
    name="arm",
    joints=tuple(Joint(name, f"m{i + 1}", f"e{i + 1}", GAIN[i], 2e-5, 5e-5, 0.01) for i, name in enumerate(NAMES)),
    rate=125.0,
    substeps=4,
    lengths=(7.0, 9.0, 6.0, 7.5),
    values={
        **{f"{name}.coulomb": COULOMB[i] for i, name in enumerate(NAMES)},
        **{f"{name}.viscous": VISCOUS[i] for i, name in enumerate(NAMES)},
        **{f"{name}.rotor": ROTOR[i] for i, name in enumerate(NAMES)},
    },
    adjustable={f"{name}.{kind}": 0.3 for name in NAMES for kind in ("coulomb", "viscous")},
    tree=tree,
    law=law,
    motion=motion,
    document=document,
    friction_at_load=False,
    choices=(
        Choice("coulomb_friction", "j2", base="j2.coulomb"),
        Choice("viscous_friction", "j5", base="j5.viscous"),
        Choice("rotor_inertia", "j3", base="j3.rotor"),
        Choice("payload", "link6", {"mass": (1.2, 2.5)}),
        Choice("gravity_tilt", "world", {"angle": (0.04, 0.08)}),
        Choice("bias_force", "j2", {"force": (5.0, 9.0)}),
        Choice("spring", "j2", {"stiffness": (10.0, 20.0), "rest": (-0.3, 0.1)}),
        Choice("hysteresis", "j1", {"force": (5.0, 9.0), "way": (0.02, 0.05)}),
        Choice("joint_compliance", "j1", {"stiffness": (6e3, 1.2e4), "damping": (8.0, 16.0)}),
        Choice("input_delay", "m3", {"time": (0.016, 0.028)}),
        Choice("sensor_offset", "e3", {"value": (0.04, 0.08)}),
    ),
    outside=(
        Choice("load_dependent_friction", "j2", {"share": (0.12, 0.25)}),
        Choice("warming_friction", "j1", {"coulomb": (6.0, 10.0), "time": (2.0, 4.0)}),
    ),
    pairs=((("payload", "link6"), ("coulomb_friction", "j2")), (("joint_compliance", "j1"), ("bias_force", "j2"))),
)
