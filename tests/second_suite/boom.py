"""The boom of a loader crane, luffed by a cylinder below it through a proportional valve: degrees, V and bar."""

from collections.abc import Callable

import numpy as np

from second_suite.machine import Array, Choice, Joint, Law, Machine, PressureGauge, Values, loss_entries, uneven
from second_suite.motions import REST, chirp, fade, sines

DEGREE, BAR, GRAVITY = np.pi / 180.0, 1e5, 9.81
#: Centre of mass and tip in the boom's frame, whose x points from the pin along the boom, and z up [m].
CENTER, TIP = (1.2, 0.06), 2.4
#: Ends of the cylinder, x forward and z up from the pin, on the frame and on the level boom [m].
FOOT, EYE = (0.22, -0.86), (0.52, -0.05)
ACROSS = float(np.hypot(*FOOT) * np.hypot(*EYE))
SQUARES = float(np.hypot(*FOOT) ** 2 + np.hypot(*EYE) ** 2)
BETWEEN = float(np.arctan2(EYE[1], EYE[0]) - np.arctan2(FOOT[1], FOOT[0]))
RETRACTED, STROKE = 0.64, 0.62
#: Middle of all motions [rad], peak speed of lifts [rad/s], and drop that the controller expects over an edge [Pa].
MIDDLE, FASTEST, EXPECTED_DROP = 0.3, 0.5, 1e7
POSITION_GAIN, INTEGRAL_RATE, LARGEST = 3.0, 0.8, 10.0
VALUES = {
    "boom.mass": 220.0,
    "boom.inertia": 110.0,
    "luff.coulomb": 160.0,
    "luff.viscous": 400.0,
    "seals.coulomb": 150.0,
    "seals.viscous": 1500.0,
    "piston.area": 0.25 * np.pi * 0.032**2,
    "piston.ratio": 1.0 - (18.0 / 32.0) ** 2,
    "piston.retracted": RETRACTED,
    "piston.stroke": STROKE,
    "lines.a": 6e-5,
    "lines.b": 8e-5,
    "pump.pressure": 180.0 * BAR,
    "pump.tank": 2.0 * BAR,
    "oil.modulus": 1.1e9,
    "valve.gain": 9e-9,
    "valve.frequency": 2.0 * np.pi * 40.0,
    "valve.damping": 0.8,
    "valve.stroke": LARGEST,
}


def line(values: Values, q: Array) -> tuple[Array, Array]:
    """Law of cosines about the pin."""
    del values
    length = np.sqrt(SQUARES - 2.0 * ACROSS * np.cos(q + BETWEEN))
    return length, ACROSS * np.sin(q + BETWEEN) / length


def tree(values: Values, q: Array, v: Array) -> tuple[Array, Array]:
    """A heavy boom on a pin, level at zero; a tilt turns gravity about the pin."""
    tip = values.get("payload", np.zeros_like(q[0]))
    mass = values["boom.mass"]
    inertia = values["boom.inertia"] + mass * (CENTER[0] ** 2 + CENTER[1] ** 2) + tip * TIP**2
    angle = q[0] + values["tilt"] if "tilt" in values else q[0]
    weight = mass * (CENTER[0] * np.cos(angle) - CENTER[1] * np.sin(angle)) + tip * TIP * np.cos(angle)
    return inertia[:, None, None], (GRAVITY * weight)[None] + 0.0 * v


def law(machine: Machine, columns: int) -> Law:
    """PI on the angle, and the opening that the data sheet's valve needs for the speed that is asked for."""
    total, dt = np.zeros(columns), 1.0 / machine.rate
    swept = VALUES["piston.area"] / (VALUES["valve.gain"] * np.sqrt(EXPECTED_DROP))

    def command(k: int, y: Array, dy: Array, asked: Array) -> Array:
        del k, dy
        nonlocal total
        _, lever = line({}, y[0])
        error = asked[0, 0] - y[0]
        tried = total + dt * error
        wanted = swept * lever * (asked[1, 0] + POSITION_GAIN * (error + INTEGRAL_RATE * tried))
        total = np.where((np.abs(wanted) > LARGEST) & (wanted * error > 0.0), total, tried)
        answer: Array = np.clip(wanted, -LARGEST, LARGEST)[None]
        return answer

    return command


def lifts(rng: np.random.Generator, time: Array, reach: float) -> Array:
    """Lifts and descents within +-reach whose speeds rise and fall as a cosine does, with rests."""
    path, place, begin = np.zeros_like(time), 0.0, REST
    while begin < time[-1] - REST:
        target = float(-np.sign(place or rng.uniform(-1.0, 1.0)) * rng.uniform(-0.4, 1.0) * reach)
        lasts = max(2.0 * abs(target - place) / FASTEST, float(rng.uniform(0.8, 3.0)))
        share = np.clip((time - begin) / lasts, 0.0, 1.0)
        path += (target - place) * (share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi))
        place, begin = target, begin + lasts + float(rng.uniform(0.2, 0.9))
    return path


def motion(rng: np.random.Generator, time: Array, record: int) -> Array:
    """Lifts; slow sines and a chirp that end at rest; lifts again, with small sines."""
    if record == 0:
        path = lifts(rng, time, 0.5)
    elif record == 1:
        path = sines(rng, time, 0.36, 0.08, 0.7, 4) * fade(time[-1] - time)
    elif record == 2:
        path = chirp(rng, time, 0.42, 0.12, 0.8) * fade(time[-1] - time)
    else:
        path = lifts(rng, time, 0.42) + sines(rng, time, 0.05, 0.3, 0.8, 3)
    return (MIDDLE + path)[:, None]


def cylinder(number: Callable[[str], object], without: frozenset[str]) -> dict[str, object]:
    """The actuator of the model file."""
    entry: dict[str, object] = {
        "type": "hydraulic",
        "line": "cylinder",
        "supply": "pump",
        "command_unit": "V",
        "retracted_length": number("piston.retracted"),
        "valve": {
            "flow_gain": number("valve.gain"),
            "frequency": number("valve.frequency"),
            "damping": number("valve.damping"),
            "stroke": number("valve.stroke"),
        },
        "cylinder": {
            "area": number("piston.area"),
            "area_ratio": number("piston.ratio"),
            "stroke": number("piston.stroke"),
            "line_a": number("lines.a"),
            "line_b": number("lines.b"),
        },
    }
    friction = {key: number(f"seals.{key}") for key in ("viscous", "coulomb") if f"seals.{key}" not in without}
    return {**entry, "friction": friction} if friction else entry


def document(number: Callable[[str], object], without: frozenset[str]) -> dict[str, object]:
    return {
        "name": "luffing boom",
        "gravity": [0.0, 0.0, -GRAVITY],
        "bodies": {
            "boom": {
                "mass": number("boom.mass"),
                "center_of_mass": [CENTER[0], 0.0, CENTER[1]],
                "inertia": [2.0, number("boom.inertia"), 110.0, 0.0, 0.0, 0.0],
            }
        },
        "joints": {"luff": {"type": "revolute", "parent": "world", "child": "boom", "axis": [0.0, -1.0, 0.0]}},
        "lines": {
            "cylinder": {
                "from": {"parent": "world", "point": [FOOT[0], 0.0, FOOT[1]]},
                "to": {"parent": "boom", "point": [EYE[0], 0.0, EYE[1]]},
            }
        },
        "supplies": {
            "pump": {
                "pressure": number("pump.pressure"),
                "tank_pressure": number("pump.tank"),
                "oil": {"bulk_modulus": number("oil.modulus")},
            }
        },
        "actuators": {"lifter": cylinder(number, without)},
        "sensors": {
            "inclinometer": {"measures": "luff.position", "noise": 0.003 * DEGREE, "resolution": 0.005 * DEGREE},
            **{g.name: {"measures": g.channel, "noise": g.noise, "resolution": g.resolution} for g in GAUGES},
        },
        "effects": loss_entries(number, without, ["luff"]),
    }


GAUGES = tuple(PressureGauge(f"gauge_{side}", f"lifter.pressure_{side}", 0.6 * BAR, 0.05 * BAR) for side in "ab")
MACHINE = Machine(
    name="boom",
    joints=(
        Joint("luff", "lifter", "inclinometer", noise=0.003 * DEGREE, resolution=0.005 * DEGREE, command_unit="V"),
    ),
    rate=500.0,
    substeps=4,
    lengths=(14.0, 16.0, 12.0, 11.0),
    values=VALUES,
    adjustable={
        "boom.mass": 0.05,
        "valve.gain": 0.1,
        "oil.modulus": 0.25,
        "luff.coulomb": 0.3,
        "luff.viscous": 0.3,
    },
    tree=tree,
    law=law,
    motion=motion,
    document=document,
    line=line,
    gauges=GAUGES,
    choices=(
        Choice("coulomb_friction", "luff", base="luff.coulomb"),
        Choice("viscous_friction", "luff", base="luff.viscous"),
        Choice("stribeck_friction", "luff", {"stribeck": (200.0, 320.0), "speed": (0.03, 0.08)}),
        uneven("luff", ((10.0, 30.0), (20.0, 60.0)), ((220.0, 340.0), (350.0, 650.0))),
        Choice("bias_force", "luff", {"force": (350.0, 600.0)}),
        Choice("spring", "luff", {"stiffness": (500.0, 900.0), "rest": (0.1, 0.5)}),
        Choice("hysteresis", "luff", {"force": (160.0, 280.0), "way": (0.01, 0.03)}),
        Choice(
            "end_stop",
            "luff",
            {"stiffness": (6e3, 1.2e4), "damping": (0.3, 0.8), "end": (0.42, 0.47), "side": (1.0, 1.0)},
        ),
        Choice("payload", "boom", {"mass": (15.0, 35.0)}),
        Choice("gravity_tilt", "world", {"angle": (0.12, 0.18)}),
        Choice("input_delay", "lifter", {"time": (0.006, 0.016)}),
        Choice("dead_zone", "lifter", {"width": (0.08, 0.4)}),
        Choice("saturation", "lifter", {"limit": (4.5, 5.5)}),
        Choice("actuator_lag", "lifter", {"time": (0.012, 0.03)}),
        Choice("valve_dynamics", "lifter", {"time": (0.004, 0.009)}),
        Choice("internal_leakage", "lifter", {"coefficient": (1e-13, 6e-13)}),
        Choice("entrained_air", "pump", {"fraction": (0.04, 0.1)}),
        Choice("supply_drop", "pump", {"resistance": (5e9, 1.4e10), "time_constant": (0.015, 0.03)}),
        Choice("sensor_gain", "inclinometer", {"value": (1.02, 1.06)}),
        Choice("sensor_offset", "inclinometer", {"value": (0.015, 0.05)}),
        Choice("sensor_delay", "inclinometer", {"time": (0.008, 0.018)}),
        Choice("sensor_gain", "gauge_a", {"value": (1.04, 1.1)}),
        Choice("sensor_offset", "gauge_b", {"value": (3.0 * BAR, 6.0 * BAR)}),
    ),
    outside=(
        Choice("seal_friction", "lifter", {"share": (0.025, 0.045)}),
        Choice("load_dependent_friction", "luff", {"share": (0.08, 0.14)}),
        Choice("quadratic_drag", "luff", {"drag": (1600.0, 2800.0)}),
        Choice("uneven_edges", "lifter", {"less": (0.04, 0.15)}),
    ),
    pairs=(
        (("internal_leakage", "lifter"), ("coulomb_friction", "luff")),
        (("dead_zone", "lifter"), ("payload", "boom")),
        (("entrained_air", "pump"), ("sensor_gain", "gauge_a")),
    ),
)
