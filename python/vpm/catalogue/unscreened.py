"""Effects of a joint or a drive that a ranking tries, and no search.

Drag, a stiffening spring, a ripple of the current, and friction that depends on the place, on the load, on the effort
of one drive, on the time since a cold start and on the way of bristles. The sources stand at the laws in the core.
"""

from __future__ import annotations

from vpm.catalogue.joint import STRIBECK, transition
from vpm.catalogue.kinds import ABOVE_ZERO, ANY, NOT_NEGATIVE, EffectParameter, EffectType, shape, size

#: Way over which bristles bend where none is given: prismatic (m), revolute (rad).
_PRESLIDING = (1e-5, 1e-4)
#: Largest share of a load that inverse dynamics has one solution for.
_SHARE = (0.0, 0.95)
_NEGATIVE_SHARE = "a negative share would give out more power than goes in"


def _shares(driving: str, driven: str) -> tuple[EffectParameter, EffectParameter]:
    """Shares of an effort that friction takes, each with its meaning."""

    def share(name: str, meaning: str) -> EffectParameter:
        return size(name, f"friction.{name}", "1", "one", meaning, physical=_SHARE, linear=False)

    return share("driving", driving), share("driven", driven)


def _law_of_load(effort: str) -> str:
    """Law of friction in proportion to an effort, which is said in words."""
    return (
        "tau = -|u| s (driving + driven + (driving - driven) s sign(u))/2, s = tanh(v/transition_velocity), "
        f"u {effort}, each share within 0.95"
    )


QUADRATIC_DRAG = EffectType(
    name="quadratic_drag",
    site="joint",
    group="friction",
    parameters=(
        size(
            "drag",
            "friction.quadratic",
            "{E} s^2/{C}^2",
            "effort_per_speed_squared",
            "resistance per square of the speed",
            physical=NOT_NEGATIVE,
        ),
    ),
    law="tau = -drag |v| v",
    sentence="{at} resists motion in proportion to the square of its speed, with {drag}.",
    impossible="a negative drag would feed energy into the motion instead of taking it out",
    confused_with={},
    screened=False,
)

CUBIC_SPRING = EffectType(
    name="cubic_spring",
    site="joint",
    link_side_alone=True,
    group="cubic_spring",
    parameters=(
        size(
            "stiffness",
            "cubic_spring.stiffness",
            "{E}/{C}^3",
            "effort_per_coordinate_cubed",
            "restoring effort per cube of the way",
        ),
        shape(
            "rest",
            "cubic_spring.rest",
            "{C}",
            "coordinate",
            "position without restoring effort",
            start=0.0,
            bounds=ANY,
        ),
    ),
    law="tau = -stiffness (q - rest)^3",
    sentence="{at} is pulled back towards {rest} with the cube of its way, with {stiffness}.",
    impossible="either sign is possible: beside a spring a negative one makes it softer on its way",
    confused_with={},
    screened=False,
)

POSITION_DEPENDENT_FRICTION = EffectType(
    name="position_dependent_friction",
    site="joint",
    group="friction",
    parameters=(
        shape(
            "period",
            "friction.position_period",
            "{C}",
            "coordinate",
            "way after which the level repeats; it follows from the machine: a turn of a shaft, screw or gear",
            start=None,
        ),
        size("cosine", "friction.position_cosine", "{E}", "effort", "part of the level that is greatest at zero"),
        size("sine", "friction.position_sine", "{E}", "effort", "part of the level that vanishes at zero"),
        transition("friction.position_transition_velocity"),
    ),
    law="tau = -(cosine cos(2 pi q/period) + sine sin(2 pi q/period)) tanh(v/transition_velocity)",
    sentence="{at} rubs differently along its way, by {cosine} (cosine) and {sine} (sine), every {period} alike.",
    impossible="either sign is possible; the friction of each place as a whole has to stay above zero",
    confused_with={},
    requires="coulomb_friction",
    screened=False,
)

LOAD_DEPENDENT_FRICTION = EffectType(
    name="load_dependent_friction",
    site="joint",
    group="friction",
    parameters=(
        *_shares(
            "share of the actuators' effort that is lost where they drive the joint",
            "share of their effort that brakes the joint besides where it drives them",
        ),
        transition("friction.load_transition_velocity"),
    ),
    law=_law_of_load("the effort of the actuators on the joint"),
    sentence=(
        "{at} rubs in proportion to its load: it loses {driving} of the effort where the drive pushes, and {driven} of"
        " it brakes where the joint pushes the drive."
    ),
    impossible=_NEGATIVE_SHARE,
    confused_with={},
    screened=False,
    motor_side_alone=True,
    takes_effort=True,
)

DRIVE_FRICTION = EffectType(
    name="drive_friction",
    site="actuator",
    group="friction",
    parameters=(
        *_shares(
            "share of the effort of this actuator that is lost where it drives",
            "share of its effort that brakes besides where it is driven",
        ),
        transition("friction.transition_velocity"),
    ),
    law=_law_of_load("the effort of this actuator"),
    sentence=(
        "{at} rubs in proportion to its own effort, as seals under pressure do: {driving} of it is lost where it"
        " drives, and {driven} of it brakes where it is driven."
    ),
    impossible=_NEGATIVE_SHARE,
    confused_with={},
    screened=False,
    beside_others=True,
)

CURRENT_RIPPLE = EffectType(
    name="current_ripple",
    site="joint",
    group="current_ripple",
    parameters=(
        shape(
            "period",
            "current_ripple.period",
            "{C}",
            "coordinate",
            "way after which the ripple repeats; it follows from the motor: a turn, or a pair of its poles",
            start=None,
        ),
        size("cosine", "current_ripple.cosine", "1", "one", "share of the actuators' effort that is lost at zero"),
        size("sine", "current_ripple.sine", "1", "one", "share of it that is lost a quarter of a period later"),
    ),
    law=(
        "tau = -u (cosine cos(2 pi q/period) + sine sin(2 pi q/period)), u the effort of the actuators on the joint,"
        " the bracket within 0.95"
    ),
    sentence=(
        "{at} gets more and less of its effort along its way, by {cosine} (cosine) and {sine} (sine), every {period}"
        " alike."
    ),
    impossible="a motor that pushes the other way at some angles is wired wrongly",
    confused_with={},
    screened=False,
    motor_side_alone=True,
    takes_effort=True,
)

LUGRE_FRICTION = EffectType(
    name="lugre_friction",
    site="joint",
    group="lugre",
    parameters=(
        size(
            "coulomb",
            "lugre.coulomb",
            "{E}",
            "effort",
            "resistance in fast motion, but for its viscous part",
            physical=NOT_NEGATIVE,
        ),
        size(
            "damping",
            "lugre.damping",
            "{E} s/{C}",
            "effort_per_speed",
            "resistance of the bristles to bending",
            physical=NOT_NEGATIVE,
        ),
        shape(
            "displacement",
            "lugre.displacement",
            "{C}",
            "coordinate",
            "way over which the bristles bend; their stiffness is coulomb/displacement",
            start=_PRESLIDING,
            learnt=True,
        ),
        shape(
            "excess",
            "lugre.excess",
            "1",
            "one",
            "share by which the resistance in slow motion is larger",
            start=0.0,
            bounds=NOT_NEGATIVE,
            learnt=True,
        ),
        shape(
            "stribeck_velocity",
            "lugre.stribeck_velocity",
            "{C}/s",
            "speed",
            "speed at which this share has fallen to 37 %",
            start=STRIBECK,
            learnt=True,
        ),
    ),
    law=(
        "tau = -coulomb z - damping displacement dz/dt, dz/dt = (v - |v| z/h)/displacement,"
        " h = 1 + excess exp(-(v/stribeck_velocity)^2)"
    ),
    sentence=(
        "{at} rubs as bristles do: they bend over ways of about {displacement}, damped with {damping}, and slide with"
        " {coulomb} in fast motion."
    ),
    impossible="a negative friction of bristles would push along the motion and feed energy into it",
    confused_with={},
    screened=False,
    memory="lugre.memory",
    contains=("coulomb_friction",),
)

WARMING_FRICTION = EffectType(
    name="warming_friction",
    site="joint",
    group="warming",
    parameters=(
        size(
            "coulomb",
            "warming.coulomb",
            "{E}",
            "effort",
            "cold less warm resistance that does not depend on speed",
            physical=NOT_NEGATIVE,
        ),
        size(
            "viscous",
            "warming.viscous",
            "{E} s/{C}",
            "effort_per_speed",
            "cold less warm resistance per speed",
            physical=NOT_NEGATIVE,
        ),
        shape(
            "time_constant",
            "warming.time_constant",
            "s",
            "time",
            "time after which 63 % of these are gone",
            start=None,
            bounds=ABOVE_ZERO,
        ),
        transition("warming.transition_velocity"),
    ),
    law=(
        "tau = -(1 - w) (coulomb tanh(v/transition_velocity) + viscous v), dw/dt = (1 - w)/time_constant,"
        " w = 0 at the first sample"
    ),
    sentence=(
        "{at} rubs more while it is cold: at the beginning by {coulomb} at any speed and by {viscous} in proportion to"
        " speed, which fade with a time constant of {time_constant}."
    ),
    impossible="a negative one would mean friction that grows as the machine gets warm",
    confused_with={},
    screened=False,
    memory="warming.memory",
)

UNSCREENED_EFFECTS = (
    QUADRATIC_DRAG,
    CUBIC_SPRING,
    POSITION_DEPENDENT_FRICTION,
    LOAD_DEPENDENT_FRICTION,
    DRIVE_FRICTION,
    CURRENT_RIPPLE,
    LUGRE_FRICTION,
    WARMING_FRICTION,
)
