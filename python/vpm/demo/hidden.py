"""What can be hidden in the demo's machine, where it sits, and what the model calls its values."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from vpm.demo.machine import Machine


@dataclass(frozen=True)
class Hidden:
    """One machine that differs from its model.

    Attributes
    ----------
    machine : Machine
    site : str
        Where the effect sits, as the model names it; "" for none.
    parameters : dict of str to float
        Its true values by the names of the model.
    beside : tuple of (str, str)
        Effects and sites that come with it, which the model does not have either.
    """

    machine: Machine
    site: str
    parameters: Mapping[str, float]
    beside: tuple[tuple[str, str], ...] = ()


_RIPPLE = Machine(ripple=0.40)

HIDDEN: Mapping[str, Hidden] = MappingProxyType(
    {
        "coulomb_friction": Hidden(Machine(coulomb=0.55), "shoulder", {"shoulder.friction.coulomb": 0.55}),
        "viscous_friction": Hidden(Machine(viscous=0.45), "shoulder", {"shoulder.friction.viscous": 0.45}),
        "asymmetric_friction": Hidden(
            Machine(viscous_difference=0.15), "shoulder", {"shoulder.friction.viscous_difference": 0.15}
        ),
        "stribeck_friction": Hidden(
            Machine(coulomb=0.40, stribeck=0.45, stribeck_velocity=0.5),
            "shoulder",
            {
                "shoulder.friction.stribeck": 0.45,
                "shoulder.friction.stribeck_velocity": 0.5,
                "shoulder.friction.coulomb": 0.40,
            },
            (("coulomb_friction", "shoulder"),),
        ),
        "bias_force": Hidden(Machine(bias=0.60), "shoulder", {"shoulder.bias.force": 0.60}),
        "spring": Hidden(
            Machine(spring=1.5, spring_rest=0.3),
            "shoulder",
            {"shoulder.spring.stiffness": 1.5, "shoulder.spring.rest": 0.3},
        ),
        "torque_ripple": Hidden(
            _RIPPLE,
            "shoulder",
            {
                "shoulder.ripple.period": _RIPPLE.ripple_period,
                "shoulder.ripple.cosine": _RIPPLE.ripple * math.cos(_RIPPLE.ripple_phase),
                "shoulder.ripple.sine": _RIPPLE.ripple * math.sin(_RIPPLE.ripple_phase),
            },
        ),
        "hysteresis": Hidden(
            Machine(hysteresis=0.6, hysteresis_way=0.15),
            "shoulder",
            {"shoulder.hysteresis.force": 0.6, "shoulder.hysteresis.displacement": 0.15},
        ),
        "backlash": Hidden(
            Machine(gear_stiffness=600.0, gear_damping=0.6, gear_play=0.03, rotor=0.02),
            "shoulder",
            {
                "shoulder.backlash.gap": 0.03,
                "shoulder.backlash.stiffness": 600.0,
                "shoulder.backlash.inertia": 0.02,
            },
        ),
        "joint_compliance": Hidden(
            Machine(gear_stiffness=80.0, gear_damping=0.6, rotor=0.03),
            "shoulder",
            {"shoulder.compliance.stiffness": 80.0, "shoulder.compliance.inertia": 0.03},
        ),
        "end_stop": Hidden(
            Machine(stop_stiffness=40.0, stop_damping=0.05, stop_high=0.95),
            "shoulder",
            {"shoulder.end_stop.stiffness": 40.0, "shoulder.end_stop.high": 0.95},
        ),
        "payload": Hidden(
            Machine(payload=0.5), "arm", {"arm.payload.mass": 0.5, "arm.payload.x": 0.15, "arm.payload.z": 0.12}
        ),
        "gravity_tilt": Hidden(Machine(tilt=math.radians(4.0)), "world", {"world.tilt.second": -math.radians(4.0)}),
        "dead_zone": Hidden(Machine(dead_zone=0.25), "motor", {"motor.dead_zone.width": 0.25}),
        "saturation": Hidden(Machine(saturation=2.2), "motor", {"motor.saturation.limit": 2.2}),
        "input_delay": Hidden(Machine(delay=0.005), "motor", {"motor.delay.time": 0.005}),
        "actuator_lag": Hidden(Machine(lag=0.02), "motor", {"motor.lag.time_constant": 0.02}),
        "sensor_offset": Hidden(Machine(sensor_offset=0.06), "encoder", {"encoder.offset.value": 0.06}),
        "sensor_gain": Hidden(Machine(sensor_gain=1.08), "encoder", {"encoder.gain.value": 1.08}),
        "sensor_delay": Hidden(Machine(sensor_delay=0.006), "encoder", {"encoder.delay.time": 0.006}),
        "none": Hidden(Machine(), "", {}),
    }
)
"""What can be hidden, by the name of the effect."""

LISTED = (
    "coulomb_friction",
    "asymmetric_friction",
    "stribeck_friction",
    "bias_force",
    "spring",
    "torque_ripple",
    "hysteresis",
    "backlash",
    "joint_compliance",
    "end_stop",
    "gravity_tilt",
    "dead_zone",
    "saturation",
    "input_delay",
    "actuator_lag",
    "sensor_gain",
    "none",
)
"""What ``vpm demo --hide`` takes: the diagnosis names each of these on the two records, and its site."""

_TURNED = "on a single link a load beside its axis, a tilted base and a shifted zero all turn gravity by an angle"

REFUSED: Mapping[str, str] = MappingProxyType(
    {
        "viscous_friction": "the model has it already, with another value",
        "payload": _TURNED,
        "sensor_offset": _TURNED,
        "sensor_delay": "from commands to readings it shows only in its sum with a delay of the drive",
        "rotor_inertia": "on a single link it is a part of the link's inertia, which the model knows only roughly",
    }
)
"""What ``vpm demo --hide`` does not take, and why: mostly what no record of one link can show on its own."""
