"""Effects between a drive and its link: play, wind-up, the inertia of the rotor, and the ends of the way.

Play and wind-up split a joint. Its own coordinate stays that of the motor side, which is measured and on which the
actuator and all other effects of the joint act; the link hangs behind a joint without actuator, named like the joint
with ``_deflection`` after it, whose coordinate is link side minus motor side.
"""

from __future__ import annotations

from vpm.catalogue.kinds import ANY, NOT_NEGATIVE, EffectParameter, EffectType, nonlinear, shape, size

#: Way over which a contact closes where none is given: prismatic (m), revolute (rad).
_CONTACT = (1e-5, 1e-4)
#: A stiffness that nothing winds up, and a place that no joint reaches.
_RIGID, _NEVER = 1e9, 1e9


def _inertia(suffix: str) -> EffectParameter:
    return shape(
        "inertia",
        suffix,
        "{E} s^2/{C}",
        "inertia",
        "inertia on the motor side, as the joint feels it, beside a rotor_inertia that is described",
        start=0.0,
        bounds=NOT_NEGATIVE,
        learnt=True,
    )


JOINT_COMPLIANCE = EffectType(
    name="joint_compliance",
    site="joint",
    group="compliance",
    motor_side_alone=True,
    parameters=(
        nonlinear(
            "stiffness",
            "compliance.stiffness",
            "{E}/{C}",
            "effort_per_coordinate",
            "effort per wind-up between motor side and link side",
            neutral=_RIGID,
            physical=NOT_NEGATIVE,
            evaluable=ANY,
        ),
        size(
            "damping",
            "compliance.damping",
            "{E} s/{C}",
            "effort_per_speed",
            "resistance per rate of the wind-up",
            physical=NOT_NEGATIVE,
            linear=False,
        ),
        _inertia("compliance.inertia"),
    ),
    law="tau = -stiffness d - damping dd/dt on the wind-up d, with inertia on the motor side",
    sentence=(
        "{at} is elastic between motor and link: it winds up with {stiffness}, damped with {damping}, with {inertia} on"
        " the side of the motor."
    ),
    impossible="a negative stiffness would drive motor and link apart, a negative damping would feed energy in",
    confused_with={
        "backlash": "they agree where the load never changes its sign; reversals and small motion part them",
        "link_flexibility": "behind one motor both are a spring; a strain gauge or the motion of the tip parts them",
        "rotor_inertia": "far below the resonance only the inertias show; faster motion parts them",
        "actuator_lag": "both delay the motion of the link; free vibration after a stop shows the spring alone",
    },
    contains=("rotor_inertia",),
)

BACKLASH = EffectType(
    name="backlash",
    site="joint",
    group="backlash",
    motor_side_alone=True,
    parameters=(
        shape(
            "gap",
            "backlash.gap",
            "{C}",
            "coordinate",
            "free way from contact to contact",
            start=None,
            bounds=NOT_NEGATIVE,
        ),
        size(
            "stiffness",
            "backlash.stiffness",
            "{E}/{C}",
            "effort_per_coordinate",
            "effort per way beyond the play",
            physical=NOT_NEGATIVE,
        ),
        size(
            "damping",
            "backlash.damping",
            "{E} s/{C}",
            "effort_per_speed",
            "resistance per speed, within the play and beyond",
            physical=NOT_NEGATIVE,
        ),
        size(
            "contact_damping",
            "backlash.contact_damping",
            "{E} s/{C}",
            "effort_per_speed",
            "resistance per speed of a closed contact alone",
            physical=NOT_NEGATIVE,
        ),
        shape("width", "backlash.width", "{C}", "coordinate", "way over which a contact closes", start=_CONTACT),
        _inertia("backlash.inertia"),
    ),
    law=(
        "tau = -stiffness (q + 1/2 sqrt((q - 1/2 gap)^2 + width^2) - 1/2 sqrt((q + 1/2 gap)^2 + width^2))"
        " - damping v - contact_damping (1 + 1/2 (q - 1/2 gap) / sqrt((q - 1/2 gap)^2 + width^2)"
        " - 1/2 (q + 1/2 gap) / sqrt((q + 1/2 gap)^2 + width^2)) v"
    ),
    sentence=(
        "{at} has a play of {gap} between contacts of {stiffness}, damped with {contact_damping}, and with {damping}"
        " within it as well."
    ),
    impossible="a negative stiffness would pull the contacts into each other, a negative damping would feed energy in",
    confused_with={
        "joint_compliance": "they agree where the load never changes its sign; reversals and small motion part them",
    },
    contains=("rotor_inertia",),
)

ROTOR_INERTIA = EffectType(
    name="rotor_inertia",
    site="joint",
    group="rotor",
    motor_side_alone=True,
    parameters=(
        size(
            "inertia",
            "rotor.inertia",
            "{E} s^2/{C}",
            "inertia",
            "inertia of the rotor as the joint feels it, ratio squared times its own",
            physical=NOT_NEGATIVE,
        ),
    ),
    law="tau = -inertia d^2q/dt^2, without gravity or gyroscopic effects",
    sentence="{at} has to accelerate {inertia} more than its links have: that of a rotor, which no gravity acts on.",
    impossible="a negative inertia of a rotor would mean that the links are too heavy: correct their inertia",
    confused_with={
        "payload": "both need effort to accelerate; a payload has weight and loads the joints before it too",
        "sensor_gain": "both scale the effort that an acceleration needs; a record with a known load parts them",
        "joint_compliance": "far below the resonance only the inertias show; faster motion parts them",
    },
    exact=True,
)

END_STOP = EffectType(
    name="end_stop",
    site="joint",
    link_side_alone=True,
    group="end_stop",
    parameters=(
        size(
            "stiffness",
            "end_stop.stiffness",
            "{E}/{C}",
            "effort_per_coordinate",
            "effort per way beyond an end",
            physical=NOT_NEGATIVE,
        ),
        shape(
            "damping",
            "end_stop.damping",
            "s/{C}",
            "one_per_speed",
            "share by which the effort grows per approaching speed",
            start=0.0,
            bounds=NOT_NEGATIVE,
            learnt=True,
        ),
        shape("low", "end_stop.low", "{C}", "coordinate", "lower end of the way", start=-_NEVER, bounds=ANY),
        shape("high", "end_stop.high", "{C}", "coordinate", "upper end of the way", start=_NEVER, bounds=ANY),
        shape("width", "end_stop.width", "{C}", "coordinate", "way over which a contact closes", start=_CONTACT),
    ),
    law=(
        "tau = -stiffness (p(q - high) r(damping v) - p(low - q) r(-damping v)), p(x) = 1/2 (x + sqrt(x^2 + width^2)),"
        " r(y) = 1 + y, rounded above 0"
    ),
    sentence=(
        "{at} runs against stops at {low} and {high}, which push back with {stiffness}, harder by {damping} in impact."
    ),
    impossible="a negative stiffness would pull the joint beyond its end",
    confused_with={
        "spring": "they agree over a way beyond the end alone; motion on both sides of it parts them",
        "saturation": "both stop the motion at large commands; the same command in the middle of the way parts them",
    },
)

DRIVETRAIN_EFFECTS = (BACKLASH, JOINT_COMPLIANCE, ROTOR_INERTIA, END_STOP)
