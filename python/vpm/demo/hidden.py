"""What can be hidden in the demo's machine, where it sits, and what the model calls its values.

A case says what the machine has and by which parameters the model would know it; the catalogue says whose these are.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from vpm.catalogue import SiteKind, effects_for_site
from vpm.demo.machine import Machine


@dataclass(frozen=True)
class Hidden:
    """One machine that differs from its model."""

    machine: Machine
    site: str  #: Where the effect sits, as the model names it; "" for none.
    parameters: Mapping[str, float]  #: Its true values by the names of the model.
    #: Effects and sites that come with it, which the model does not have either.
    beside: tuple[tuple[str, str], ...] = ()


#: Components of the demo's model.
_SITES: Mapping[str, SiteKind] = {
    "shoulder": "joint",
    "arm": "body",
    "world": "world",
    "motor": "actuator",
    "encoder": "sensor",
}


def _owner(parameter: str) -> tuple[str, str]:
    """Effect and site of a hidden parameter of the model."""
    site, _, suffix = parameter.partition(".")
    named = {own.suffix: effect.name for effect in effects_for_site(_SITES[site]) for own in effect.parameters}
    return named[suffix], site


def _case(machine: Machine, parameters: Mapping[str, float], refused: str = "") -> tuple[str, Hidden, str]:
    """Hidden case: its name, first parameter's effect, meaning, and why it cannot be asked for."""
    (name, site), *others = dict.fromkeys(map(_owner, parameters))
    return name, Hidden(machine, site, parameters, tuple(others)), refused


_RIPPLE = Machine(ripple=0.40)

_TURNED = "on a single link a load beside its axis, a tilted base and a shifted zero all turn gravity by an angle"

#: The one that is hidden if nothing is asked for comes first.
_CASES = (
    _case(Machine(coulomb=0.55), {"shoulder.friction.coulomb": 0.55}),
    _case(
        Machine(viscous=0.45),
        {"shoulder.friction.viscous": 0.45},
        refused="the model has it already, with another value",
    ),
    _case(Machine(viscous_difference=0.15), {"shoulder.friction.viscous_difference": 0.15}),
    _case(
        Machine(coulomb=0.40, stribeck=0.45, stribeck_velocity=0.5),
        {
            "shoulder.friction.stribeck": 0.45,
            "shoulder.friction.stribeck_velocity": 0.5,
            "shoulder.friction.coulomb": 0.40,
        },
    ),
    _case(Machine(bias=0.60), {"shoulder.bias.force": 0.60}),
    _case(
        Machine(spring=1.5, spring_rest=0.3),
        {"shoulder.spring.stiffness": 1.5, "shoulder.spring.rest": 0.3},
    ),
    _case(
        _RIPPLE,
        {
            "shoulder.ripple.period": _RIPPLE.ripple_period,
            "shoulder.ripple.cosine": _RIPPLE.ripple * math.cos(_RIPPLE.ripple_phase),
            "shoulder.ripple.sine": _RIPPLE.ripple * math.sin(_RIPPLE.ripple_phase),
        },
    ),
    _case(
        Machine(hysteresis=0.6, hysteresis_way=0.15),
        {"shoulder.hysteresis.force": 0.6, "shoulder.hysteresis.displacement": 0.15},
    ),
    _case(
        Machine(gear_stiffness=600.0, gear_damping=0.6, gear_play=0.03, rotor=0.02),
        {
            "shoulder.backlash.gap": 0.03,
            "shoulder.backlash.stiffness": 600.0,
            "shoulder.backlash.inertia": 0.02,
        },
    ),
    _case(
        Machine(gear_stiffness=80.0, gear_damping=0.6, rotor=0.03),
        {"shoulder.compliance.stiffness": 80.0, "shoulder.compliance.inertia": 0.03},
    ),
    _case(
        Machine(stop_stiffness=40.0, stop_damping=0.05, stop_high=0.95),
        {"shoulder.end_stop.stiffness": 40.0, "shoulder.end_stop.high": 0.95},
    ),
    _case(
        Machine(payload=0.5),
        {"arm.payload.mass": 0.5, "arm.payload.x": 0.15, "arm.payload.z": 0.12},
        refused=_TURNED,
    ),
    _case(Machine(tilt=math.radians(4.0)), {"world.tilt.second": -math.radians(4.0)}),
    _case(Machine(dead_zone=0.25), {"motor.dead_zone.width": 0.25}),
    _case(Machine(saturation=2.2), {"motor.saturation.limit": 2.2}),
    _case(Machine(delay=0.005), {"motor.delay.time": 0.005}),
    _case(Machine(lag=0.02), {"motor.lag.time_constant": 0.02}),
    _case(Machine(sensor_offset=0.06), {"encoder.offset.value": 0.06}, refused=_TURNED),
    _case(Machine(sensor_gain=1.08), {"encoder.gain.value": 1.08}),
    _case(
        Machine(sensor_delay=0.006),
        {"encoder.delay.time": 0.006},
        refused="from commands to readings it shows only in its sum with a delay of the drive",
    ),
    ("none", Hidden(Machine(), "", {}), ""),
)

#: What is not made either.
_PART_OF_LINK = "on a single link it is a part of the link's inertia, which the model knows only roughly"

HIDDEN: Mapping[str, Hidden] = MappingProxyType({name: case for name, case, _ in _CASES})
"""What can be hidden, by the name of the effect."""

LISTED = tuple(name for name, _, refused in _CASES if not refused)
"""What ``vpm demo --hide`` takes: the diagnosis names each of these on the two records, and its site."""

DEFAULT = LISTED[0]
"""What is hidden if nothing is asked for."""

REFUSED: Mapping[str, str] = MappingProxyType(
    {
        **{name: refused for name, _, refused in _CASES if refused},
        _owner("shoulder.rotor.inertia")[0]: _PART_OF_LINK,
    }
)
"""What ``vpm demo --hide`` does not take, and why: mostly what no record of one link can show on its own."""
