"""What can be hidden, where, and how large: sizes are drawn relative to the machine's efforts, speeds and ways.

The sizes reach from what drowns in the noise to what nobody overlooks, evenly on a logarithmic scale. Parameters of
known effects are named as in the catalogue, in the end at least; an effect with ``known = False`` is physics that is
not in it, so that "unexplained" is the right answer.
"""

from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.random import Generator

Draw = Callable[[Generator, "Scale"], dict[str, float]]


@dataclass(frozen=True)
class Scale:
    """What is usual at a site."""

    #: Root mean square effort and speed, and reach of the motion [E, C/s, C].
    effort: float = 1.0
    speed: float = 1.0
    way: float = 1.0
    inertia: float = 1.0  #: What the drive has to accelerate [E s^2/C].
    command: float = 1.0  #: Root mean square command.
    #: Of a body: mass [kg], and distance of a load on it from its joint [m].
    mass: float = 1.0
    lever: float = 0.0
    #: Friction that is there anyway [E, E s/C].
    coulomb: float = 0.0
    viscous: float = 0.0
    centre: float = 0.0  #: Middle of the motion [C].


@dataclass(frozen=True)
class Effect:
    """One entry: kind of site, draw of its parameters, what the nominal model has to hold already."""

    name: str
    site: str
    draw: Draw
    needs: tuple[str, ...] = ()
    known: bool = True


def between(generator: Generator, low: float, high: float) -> float:
    """Number between two bounds, evenly on a logarithmic scale."""
    return float(np.exp(generator.uniform(np.log(low), np.log(high))))


def _sign(generator: Generator) -> float:
    return float(generator.choice((-1.0, 1.0)))


def _asymmetric(g: Generator, s: Scale) -> dict[str, float]:
    """Each direction on its own dissipates."""
    dry = min(between(g, 0.005, 0.3) * s.effort, 1.8 * s.coulomb)
    viscous = min(between(g, 0.005, 0.2) * s.effort / s.speed, 1.8 * s.viscous)
    return {"coulomb_difference": _sign(g) * dry, "viscous_difference": _sign(g) * viscous}


def _ripple(g: Generator, s: Scale) -> dict[str, float]:
    size, phase = between(g, 0.003, 0.2) * s.effort, g.uniform(0.0, 2.0 * np.pi)
    return {
        "period": s.way / between(g, 2.0, 12.0),
        "cosine": size * float(np.cos(phase)),
        "sine": size * float(np.sin(phase)),
    }


def _backlash(g: Generator, s: Scale) -> dict[str, float]:
    stiffness = s.inertia * (2.0 * np.pi * float(g.uniform(40.0, 80.0))) ** 2
    return {
        "gap": between(g, 1e-4, 2e-2) * s.way,
        "stiffness": stiffness,
        "damping": 0.1 * float(np.sqrt(stiffness * s.inertia)),
    }


def _compliance(g: Generator, s: Scale) -> dict[str, float]:
    stiffness = s.inertia * (2.0 * np.pi * between(g, 5.0, 80.0)) ** 2
    return {"stiffness": stiffness, "damping": 0.05 * float(np.sqrt(stiffness * s.inertia))}


def _end_stop(g: Generator, s: Scale) -> dict[str, float]:
    stiffness = between(g, 20.0, 300.0) * s.effort / s.way
    place = float(g.uniform(0.6, 0.95)) * s.way
    high, low = (s.centre + place, -1e9) if g.uniform() < 0.5 else (1e9, s.centre - place)
    return {"stiffness": stiffness, "damping": 0.3 * stiffness / s.speed, "low": low, "high": high}


def _payload(g: Generator, s: Scale) -> dict[str, float]:
    return {"mass": between(g, 0.005, 0.3) * s.mass, "lever": s.lever * float(g.uniform(0.7, 1.0))}


_ALL = (
    Effect("viscous_friction", "joint", lambda g, s: {"viscous": between(g, 0.004, 0.4) * s.effort / s.speed}),
    Effect("coulomb_friction", "joint", lambda g, s: {"coulomb": between(g, 0.003, 0.3) * s.effort}),
    Effect("asymmetric_friction", "joint", _asymmetric, needs=("coulomb_friction", "viscous_friction")),
    Effect(
        "stribeck_friction",
        "joint",
        lambda g, s: {
            "stribeck": between(g, 0.006, 0.3) * s.effort,
            "stribeck_velocity": between(g, 0.005, 0.2) * s.speed,
        },
        needs=("coulomb_friction",),
    ),
    Effect("bias_force", "joint", lambda g, s: {"force": _sign(g) * between(g, 0.003, 0.3) * s.effort}),
    Effect(
        "spring",
        "joint",
        lambda g, s: {
            "stiffness": between(g, 0.005, 0.5) * s.effort / s.way,
            "rest": s.centre + float(g.uniform(-0.3, 0.3)) * s.way,
        },
    ),
    Effect("torque_ripple", "joint", _ripple),
    Effect("backlash", "joint", _backlash),
    Effect(
        "hysteresis",
        "joint",
        lambda g, s: {"force": between(g, 0.005, 0.3) * s.effort, "way": between(g, 0.01, 0.2) * s.way},
    ),
    Effect("joint_compliance", "joint", _compliance),
    Effect("rotor_inertia", "joint", lambda g, s: {"inertia": between(g, 0.03, 0.5) * s.inertia}),
    Effect("end_stop", "joint", _end_stop),
    Effect("payload", "link", _payload),
    Effect(
        "link_flexibility",
        "link",
        lambda g, _s: {"share": between(g, 0.4, 1.2)},
    ),
    Effect("structural_damping", "link", lambda g, _s: {"time": between(g, 1e-4, 2e-3)}),
    Effect("gravity_tilt", "world", lambda g, _s: {"angle": _sign(g) * between(g, np.radians(0.3), np.radians(8.0))}),
    Effect("input_delay", "actuator", lambda g, _s: {"time": between(g, 5e-4, 8e-3)}),
    Effect("dead_zone", "actuator", lambda g, s: {"width": between(g, 0.003, 0.3) * s.command}),
    Effect("saturation", "actuator", lambda g, s: {"limit": float(g.uniform(0.9, 2.2)) * s.command}),
    Effect("actuator_lag", "actuator", lambda g, _s: {"time_constant": between(g, 5e-4, 1.5e-2)}),
    Effect("valve_dynamics", "valve", lambda g, _s: {"frequency": between(g, 15.0, 100.0)}),
    Effect("internal_leakage", "cylinder", lambda g, _s: {"coefficient": between(g, 5e-14, 3e-12)}),
    Effect("entrained_air", "supply", lambda g, _s: {"fraction": between(g, 2e-3, 5e-2)}),
    Effect("supply_drop", "supply", lambda g, _s: {"resistance": between(g, 2e9, 6e10), "capacitance": 5e-12}),
    Effect("sensor_offset", "sensor", lambda g, s: {"value": _sign(g) * between(g, 2e-3, 5e-2) * s.way}),
    Effect("sensor_gain", "sensor", lambda g, _s: {"excess": _sign(g) * between(g, 3e-3, 0.1)}),
    Effect("sensor_delay", "sensor", lambda g, _s: {"time": between(g, 5e-4, 8e-3)}),
    Effect("quadratic_drag", "joint", lambda g, s: {"drag": between(g, 0.01, 0.5) * s.effort / s.speed**2}),
    Effect("cubic_spring", "joint", lambda g, s: {"stiffness": between(g, 0.02, 1.5) * s.effort / s.way**3}),
    Effect("load_dependent_friction", "joint", lambda g, _s: {"share": between(g, 0.01, 0.3)}),
    Effect(
        "position_dependent_friction",
        "joint",
        lambda g, s: {
            "coulomb": between(g, 0.05, 0.4) * s.effort,
            "period": s.way * float(g.uniform(0.3, 1.5)),
            "phase": float(g.uniform(0.0, 6.28)),
        },
    ),
    Effect(
        "friction_drift",
        "joint",
        lambda g, _s: {"share": -float(g.uniform(0.2, 0.7)), "time": float(g.uniform(2.0, 8.0))},
        needs=("coulomb_friction",),
    ),
    Effect("seal_friction", "cylinder", lambda g, _s: {"area": between(g, 1e-6, 2e-5)}),
)

_OUTSIDE = (
    Effect(
        "load_dependent_cogging",
        "joint",
        lambda g, s: {"share": between(g, 0.005, 0.2), "period": s.way / between(g, 2.0, 12.0)},
    ),
    Effect(
        "periodic_disturbance",
        "joint",
        lambda g, s: {"amplitude": between(g, 0.005, 0.3) * s.effort, "frequency": between(g, 0.7, 8.0)},
    ),
)

EFFECTS = MappingProxyType(
    {
        **{effect.name: effect for effect in _ALL},
        **{e.name: Effect(e.name, e.site, e.draw, e.needs, known=False) for e in _OUTSIDE},
    }
)
"""Every effect that can be hidden, by name."""
