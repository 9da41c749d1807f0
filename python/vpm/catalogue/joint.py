"""Effects that sit at a joint: they act with an effort that depends on its position and velocity, or on its path.

Smooth friction laws: the sign of the velocity is written tanh(v/vt), so that every law has derivatives; the transition
velocity vt is far below the speeds of interest. Coulomb, viscous and Stribeck terms: B. Armstrong-Helouvry, P. Dupont
and C. Canudas de Wit, "A survey of models, analysis tools and compensation methods for the control of machines with
friction", Automatica 30 (1994).
"""

from __future__ import annotations

from vpm.catalogue.drivetrain import DRIVETRAIN_EFFECTS
from vpm.catalogue.kinds import ANY, NOT_NEGATIVE, EffectParameter, EffectType, shape, size

#: Transition velocity where none is given: prismatic (m/s), revolute (rad/s).
TRANSITION = (1e-3, 1e-2)
#: Stribeck velocity where none is given: prismatic (m/s), revolute (rad/s).
STRIBECK = (1e-2, 1e-1)
#: Pre-sliding way where none is given: prismatic (m), revolute (rad).
_PRESLIDING = (1e-3, 1e-2)


def transition(suffix: str) -> EffectParameter:
    """Speed at which a friction law bends."""
    return shape(
        "transition_velocity",
        suffix,
        "{C}/s",
        "speed",
        "speed below which the law bends from one sign to the other",
        start=TRANSITION,
        learnt=True,
    )


VISCOUS_FRICTION = EffectType(
    name="viscous_friction",
    site="joint",
    group="friction",
    parameters=(
        size(
            "viscous",
            "friction.viscous",
            "{E} s/{C}",
            "effort_per_speed",
            "resistance per speed",
            physical=NOT_NEGATIVE,
        ),
    ),
    law="tau = -viscous v",
    sentence="{at} resists motion in proportion to its speed, with {viscous}.",
    impossible="a negative viscous friction would feed energy into the motion instead of taking it out",
    confused_with={
        "structural_damping": "both calm vibrations; friction also brakes motion that does not bend the link",
        "internal_leakage": "both let a loaded piston give way; the pressures of both chambers part them",
        "supply_drop": "both weaken fast motion; the pressures of both chambers part them",
        "coulomb_friction": "motion at one speed alone does not part them; records at several speeds do",
        "actuator_lag": "both weaken fast motion; steady motion at several speeds shows the friction alone",
        "saturation": "both weaken large commands; large commands at low speed part them",
        "sensor_gain": "both scale the effort that a speed needs; a reference length parts them",
    },
)

COULOMB_FRICTION = EffectType(
    name="coulomb_friction",
    site="joint",
    group="friction",
    parameters=(
        size(
            "coulomb",
            "friction.coulomb",
            "{E}",
            "effort",
            "resistance that does not depend on speed",
            physical=NOT_NEGATIVE,
        ),
        transition("friction.transition_velocity"),
    ),
    law="tau = -coulomb tanh(v/transition_velocity)",
    sentence="{at} resists motion with {coulomb} at any speed, against the direction of motion.",
    impossible="a negative Coulomb friction would push along the motion and feed energy into it",
    confused_with={
        "bias_force": "motion in one direction alone does not part them; motion in both directions does",
        "viscous_friction": "motion at one speed alone does not part them; records at several speeds do",
        "stribeck_friction": "they differ only at low speed; slow motion and starts from rest part them",
        "dead_zone": "they agree wherever command and velocity have the same sign; braking parts them",
        "hysteresis": "they agree but for the way after a reversal; short strokes and slow reversals part them",
    },
)

ASYMMETRIC_FRICTION = EffectType(
    name="asymmetric_friction",
    site="joint",
    group="friction",
    parameters=(
        size(
            "coulomb_difference",
            "friction.coulomb_difference",
            "{E}",
            "effort",
            "Coulomb friction in positive minus in negative direction",
        ),
        size(
            "viscous_difference",
            "friction.viscous_difference",
            "{E} s/{C}",
            "effort_per_speed",
            "viscous friction in positive minus in negative direction",
        ),
        transition("friction.asymmetric_transition_velocity"),
    ),
    law=(
        "tau = -1/2 coulomb_difference tanh(v/transition_velocity)^2"
        " - 1/2 viscous_difference v tanh(v/transition_velocity)"
    ),
    sentence=(
        "{at} resists motion differently in its two directions: by {coulomb_difference} at any speed and by"
        " {viscous_difference} in proportion to speed (positive minus negative direction)."
    ),
    impossible="either sign is possible; the friction of each direction as a whole has to stay above zero",
    confused_with={
        "bias_force": (
            "a difference of Coulomb friction and a constant load agree wherever the joint moves; only standstill and"
            " starts from rest part them"
        ),
    },
    contains=("bias_force",),
)

STRIBECK_FRICTION = EffectType(
    name="stribeck_friction",
    site="joint",
    group="friction",
    parameters=(
        size(
            "stribeck",
            "friction.stribeck",
            "{E}",
            "effort",
            "friction close to rest in excess of the Coulomb friction",
            physical=NOT_NEGATIVE,
        ),
        shape(
            "stribeck_velocity",
            "friction.stribeck_velocity",
            "{C}/s",
            "speed",
            "speed at which the excess has fallen to 37 %",
            start=STRIBECK,
            learnt=True,
        ),
        transition("friction.stribeck_transition_velocity"),
    ),
    law="tau = -stribeck tanh(v/transition_velocity) exp(-(v/stribeck_velocity)^2)",
    sentence=(
        "{at} sticks: close to rest it resists motion with {stribeck} more than in motion, an excess that fades at a"
        " speed of about {stribeck_velocity}."
    ),
    impossible="a negative Stribeck level would mean friction that is lower close to rest than in motion",
    confused_with={
        "coulomb_friction": "they differ only at low speed; slow motion and starts from rest part them",
        "dead_zone": "both hold the joint at rest under small commands; slow reversals under load part them",
        "hysteresis": "both shape the start of a motion; starts at several accelerations part speed from way",
    },
    requires="coulomb_friction",
)

BIAS_FORCE = EffectType(
    name="bias_force",
    site="joint",
    group="bias",
    parameters=(size("force", "bias.force", "{E}", "effort", "load that the drive has to overcome"),),
    law="tau = -force",
    sentence="{at} carries a constant load of {force}, in either direction and at rest.",
    impossible="either sign is possible: it says in which direction the load pulls",
    confused_with={
        "gravity_tilt": "they agree where gravity's lever does not change; other poses part them",
        "coulomb_friction": "motion in one direction alone does not part them; motion in both directions does",
        "asymmetric_friction": (
            "a constant load and a difference of Coulomb friction agree wherever the joint moves; only standstill and"
            " starts from rest part them"
        ),
        "payload": "they agree where gravity's lever does not change; other poses or fast motion part them",
        "sensor_offset": "through gravity or a spring a shifted zero acts like a load; other poses part them",
        "spring": "they agree over a short way; motion over a longer way parts them",
    },
)

SPRING = EffectType(
    name="spring",
    site="joint",
    link_side_alone=True,
    group="spring",
    parameters=(
        size(
            "stiffness",
            "spring.stiffness",
            "{E}/{C}",
            "effort_per_coordinate",
            "restoring effort per way",
            physical=NOT_NEGATIVE,
        ),
        shape(
            "rest",
            "spring.rest",
            "{C}",
            "coordinate",
            "position without restoring effort",
            start=0.0,
            bounds=ANY,
        ),
    ),
    law="tau = -stiffness (q - rest)",
    sentence="{at} is pulled back towards {rest} with {stiffness}.",
    impossible="a negative stiffness would push the joint away from its rest position",
    confused_with={
        "end_stop": "they agree over a way beyond the end alone; motion on both sides of it parts them",
        "bias_force": "they agree over a short way; motion over a longer way parts them",
        "payload": "near the hanging position gravity acts like a spring; large angles or fast motion part them",
        "sensor_offset": "a shifted rest position and a shifted zero agree; a reference position parts them",
        "torque_ripple": "they agree over less than a quarter of a period; a longer way parts them",
        "hysteresis": "they agree over ways that are too short to slide; a longer way parts them",
    },
)

TORQUE_RIPPLE = EffectType(
    name="torque_ripple",
    site="joint",
    group="ripple",
    parameters=(
        shape(
            "period",
            "ripple.period",
            "{C}",
            "coordinate",
            "way after which the ripple repeats; it follows from the machine: pole pitch, screw lead, teeth",
            start=None,
        ),
        size("cosine", "ripple.cosine", "{E}", "effort", "part that is greatest at the zero position"),
        size("sine", "ripple.sine", "{E}", "effort", "part that is zero at the zero position"),
    ),
    law="tau = -(cosine cos(2 pi q/period) + sine sin(2 pi q/period))",
    sentence="{at} is loaded by a ripple that repeats every {period}, with {cosine} (cosine) and {sine} (sine).",
    impossible="either sign is possible: the signs say where in the period the ripple is greatest",
    confused_with={
        "spring": "they agree over less than a quarter of a period; a longer way parts them",
        "payload": "gravity on a revolute joint repeats once per turn; a vertical axis or fast motion parts them",
    },
)

HYSTERESIS = EffectType(
    name="hysteresis",
    site="joint",
    group="hysteresis",
    memory="memory",
    parameters=(
        size(
            "force",
            "hysteresis.force",
            "{E}",
            "effort",
            "resistance after a long way in one direction",
            physical=NOT_NEGATIVE,
        ),
        shape(
            "displacement",
            "hysteresis.displacement",
            "{C}",
            "coordinate",
            "way over which the resistance builds up; from a relaxed start 63 % of it are there after that way",
            start=_PRESLIDING,
            learnt=True,
        ),
        shape(
            "shape",
            "hysteresis.shape",
            "1",
            "one",
            "stiffness on reversal over that about the relaxed state, less 1; 1 is Dahl's friction",
            start=1.0,
            bounds=NOT_NEGATIVE,
            learnt=True,
        ),
    ),
    law=(
        "tau = -force z, dz/dt = (v/displacement) (1 - |z|) where v z >= 0,"
        " (v/displacement) (1 + shape |z|) where v z < 0"
    ),
    sentence=(
        "{at} resists with a memory of its path: against {force} after a long way, which build up and turn round over"
        " ways of about {displacement}."
    ),
    impossible="a negative hysteresis would give out more energy in every loop than went in",
    confused_with={
        "coulomb_friction": "they agree but for the way after a reversal; short strokes and slow reversals part them",
        "stribeck_friction": "both shape the start of a motion; starts at several accelerations part speed from way",
        "spring": "they agree over ways that are too short to slide; a longer way parts them",
    },
)

JOINT_EFFECTS = (
    VISCOUS_FRICTION,
    COULOMB_FRICTION,
    ASYMMETRIC_FRICTION,
    STRIBECK_FRICTION,
    BIAS_FORCE,
    SPRING,
    TORQUE_RIPPLE,
    HYSTERESIS,
    *DRIVETRAIN_EFFECTS,
)
