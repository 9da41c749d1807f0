"""Effects that sit at a body, an actuator or a sensor.

The command passes the effects of an actuator in the order delay, dead zone, saturation, lag, gain. A sensor reads
``y = gain x(t - delay) + offset``.
"""

from __future__ import annotations

from vpm.catalogue.kinds import (
    ABOVE_ZERO,
    ANY,
    NOT_NEGATIVE,
    POSITIVE,
    EffectParameter,
    EffectType,
    nonlinear,
    shape,
    size,
)

#: A saturation that no command reaches.
_NEVER_REACHED = 1e9


def _coordinate(name: str) -> EffectParameter:
    return shape(
        name, f"payload.{name}", "m", "coordinate", f"{name} of the payload in the body's frame", start=0.0, bounds=ANY
    )


def _delay(meaning: str) -> EffectParameter:
    return nonlinear(
        "time", "delay.time", "s", "time", meaning, neutral=0.0, physical=NOT_NEGATIVE, evaluable=NOT_NEGATIVE
    )


PAYLOAD = EffectType(
    name="payload",
    site="body",
    group="payload",
    parameters=(
        size("mass", "payload.mass", "kg", "mass", "mass of the payload, a point", physical=NOT_NEGATIVE),
        _coordinate("x"),
        _coordinate("y"),
        _coordinate("z"),
    ),
    law="a point of the given mass, fixed to the body at (x, y, z) of its frame",
    sentence="{at} carries {mass} more than described, at ({x}, {y}, {z}) of its frame.",
    impossible="a negative payload would mean that the body is lighter than described: correct the mass of the body",
    confused_with={
        "gravity_tilt": "both change the load of gravity; fast motion shows the payload's inertia",
        "rotor_inertia": "both need effort to accelerate; a payload has weight and loads the joints before it too",
        "bias_force": "they agree where gravity's lever does not change; other poses or fast motion part them",
        "spring": "near the hanging position gravity acts like a spring; large angles or fast motion part them",
        "torque_ripple": "gravity on a revolute joint repeats once per turn; a vertical axis or fast motion parts them",
        "sensor_gain": "both scale the effort that an acceleration needs; a record with a known load parts them",
    },
    exact=True,
)

INPUT_DELAY = EffectType(
    name="input_delay",
    site="actuator",
    group="delay",
    parameters=(_delay("time between a command and its effect"),),
    law="u_delayed(t) = u(t - time)",
    sentence="{at} acts on a command {time} late.",
    impossible="a negative delay would mean that the drive acts before it is told to: check the time stamps of the log",
    confused_with={
        "valve_dynamics": "they agree for slow commands; steps and fast commands part them",
        "actuator_lag": "they agree for slow commands; steps and fast commands part them",
        "sensor_delay": "from commands to readings only their sum shows; a second sensor or time stamps part them",
    },
)

DEAD_ZONE = EffectType(
    name="dead_zone",
    site="actuator",
    group="dead_zone",
    parameters=(
        nonlinear(
            "width",
            "dead_zone.width",
            "{U}",
            "command",
            "command below which nothing happens",
            neutral=0.0,
            physical=NOT_NEGATIVE,
            evaluable=ANY,
        ),
    ),
    law="u_out = sign(u) max(|u| - width, 0)",
    sentence="{at} does not answer to commands below {width}, and takes as much off larger ones.",
    impossible="a negative dead zone would mean that the drive acts on no command at all",
    confused_with={
        "coulomb_friction": "they agree wherever command and velocity have the same sign; braking parts them",
        "stribeck_friction": "both hold the joint at rest under small commands; slow reversals under load part them",
    },
)

SATURATION = EffectType(
    name="saturation",
    site="actuator",
    group="saturation",
    parameters=(
        nonlinear(
            "limit",
            "saturation.limit",
            "{U}",
            "command",
            "largest command that is followed",
            neutral=_NEVER_REACHED,
            physical=ABOVE_ZERO,
            evaluable=ABOVE_ZERO,
        ),
    ),
    law="u_out = min(max(u, -limit), limit)",
    sentence="{at} does not follow commands beyond {limit}.",
    impossible="a limit of zero or less would mean that the drive never acts",
    confused_with={
        "end_stop": "both stop the motion at large commands; the same command in the middle of the way parts them",
        "supply_drop": "both limit the speed; a log of the pressure at the valve parts them",
        "viscous_friction": "both weaken large commands; large commands at low speed part them",
    },
)

ACTUATOR_LAG = EffectType(
    name="actuator_lag",
    site="actuator",
    group="lag",
    parameters=(
        nonlinear(
            "time_constant",
            "lag.time_constant",
            "s",
            "time",
            "time after which 63 % of a step have arrived",
            neutral=POSITIVE,
            physical=ABOVE_ZERO,
            evaluable=ABOVE_ZERO,
        ),
    ),
    law="time_constant dx/dt = u - x",
    sentence="{at} follows its command gradually, with a time constant of {time_constant}.",
    impossible="a negative time constant would mean a drive that runs away from its command",
    confused_with={
        "joint_compliance": "both delay the motion of the link; free vibration after a stop shows the spring alone",
        "valve_dynamics": "a lag is a pole before the spool, that is the spool itself; fast commands part them",
        "entrained_air": "both delay the force behind the command; pressures at a loaded piston part them",
        "input_delay": "they agree for slow commands; steps and fast commands part them",
        "sensor_delay": "they agree for slow motion; steps and fast motion part them",
        "viscous_friction": "both weaken fast motion; steady motion at several speeds shows the friction alone",
    },
)

SENSOR_OFFSET = EffectType(
    name="sensor_offset",
    site="sensor",
    group="offset",
    parameters=(
        nonlinear(
            "value",
            "offset.value",
            "{S}",
            "channel",
            "reading at a true zero",
            neutral=0.0,
            physical=ANY,
            evaluable=ANY,
        ),
    ),
    law="y = x + value",
    sentence="{at} reads {value} too much, always.",
    impossible="either sign is possible: it says in which direction the zero is shifted",
    confused_with={
        "gravity_tilt": "a shifted zero of an angle turns gravity for all that hangs on it; other poses part them",
        "bias_force": "through gravity or a spring a shifted zero acts like a load; other poses part them",
        "spring": "a shifted zero and a shifted rest position agree; a reference position parts them",
    },
)

SENSOR_GAIN = EffectType(
    name="sensor_gain",
    site="sensor",
    group="gain",
    parameters=(
        nonlinear(
            "value",
            "gain.value",
            "1",
            "one",
            "reading per true value",
            neutral=1.0,
            physical=ABOVE_ZERO,
            evaluable=ABOVE_ZERO,
        ),
    ),
    law="y = value x",
    sentence="{at} reads {value} times the true value.",
    impossible="a gain of zero or less would mean a reading that does not follow the motion, or runs against it",
    confused_with={
        "rotor_inertia": "both scale the effort that an acceleration needs; a record with a known load parts them",
        "payload": "both scale the effort that an acceleration needs; a record with a known load parts them",
        "viscous_friction": "both scale the effort that a speed needs; a reference length parts them",
    },
)

SENSOR_DELAY = EffectType(
    name="sensor_delay",
    site="sensor",
    group="delay",
    parameters=(_delay("time between the motion and its reading"),),
    law="y(t) = x(t - time)",
    sentence="{at} reads {time} late.",
    impossible="a negative delay would mean a reading ahead of the motion: check the time stamps of the log",
    confused_with={
        "input_delay": "from commands to readings only their sum shows; a second sensor or time stamps part them",
        "actuator_lag": "they agree for slow motion; steps and fast motion part them",
    },
)

BODY_EFFECTS = (PAYLOAD,)
ACTUATOR_EFFECTS = (INPUT_DELAY, DEAD_ZONE, SATURATION, ACTUATOR_LAG)
SENSOR_EFFECTS = (SENSOR_OFFSET, SENSOR_GAIN, SENSOR_DELAY)
