"""What several effects share: friction that bends with the speed, contacts, and what comes on top of a description.

Smooth friction laws: the sign of the velocity is written tanh(v/vt), so that every law has derivatives; the transition
velocity vt is far below the speeds of interest. Coulomb, viscous and Stribeck terms: B. Armstrong-Helouvry, P. Dupont
and C. Canudas de Wit, "A survey of models, analysis tools and compensation methods for the control of machines with
friction", Automatica 30 (1994).
"""

from vpm.catalogue.kinds import ANY, NOT_NEGATIVE, EffectParameter, Range, nonlinear, shape, size

#: Transition velocity where none is given: prismatic (m/s), revolute (rad/s).
TRANSITION = (1e-3, 1e-2)
#: Bounds of a transition velocity, a detail of small speeds, as shares of the largest speed.
SLOW = (2e-4, 0.1)
#: Stribeck velocity where none is given: prismatic (m/s), revolute (rad/s).
STRIBECK = (1e-2, 1e-1)
#: Way over which a contact closes where none is given: prismatic (m), revolute (rad).
CONTACT = (1e-5, 1e-4)
#: A stiffness that nothing deflects; a place that no joint reaches, and a command that is never given.
RIGID, NEVER = 1e9, 1e9
#: Largest share of a load that inverse dynamics has one solution for.
_SHARE = (0.0, 0.95)
NEGATIVE_SHARE = "a negative share would give out more power than goes in"
#: What excites friction of all kinds.
SLOW_AND_FAST = "Motion in both directions at several constant speeds, with slow starts from rest"


def transition(suffix: str = "") -> EffectParameter:
    """Shared parameter: speed at which a friction law bends."""
    meaning = "speed below which the law bends from one sign to the other"
    return shape("transition_velocity", "{C}/s", meaning, start=TRANSITION, learnt=True, suffix=suffix)


def shares(driving: str, driven: str) -> tuple[EffectParameter, EffectParameter]:
    """Shares of an effort that friction takes, each with its meaning."""

    def share(name: str, meaning: str) -> EffectParameter:
        return size(name, "1", meaning, physical=_SHARE, linear=False)

    return share("driving", driving), share("driven", driven)


def law_of_load(effort: str) -> str:
    """Shared law of friction in proportion to an effort, which is said in words."""
    return (
        "tau = -|u| s (driving + driven + (driving - driven) s sign(u))/2, s = tanh(v/transition_velocity), "
        f"u {effort}, each share within 0.95"
    )


def motor_inertia() -> EffectParameter:
    """Shared parameter: inertia before a spring or backlash."""
    meaning = "inertia on the motor side, as the joint feels it, beside a rotor_inertia that is described"
    return shape("inertia", "{E} s^2/{C}", meaning, start=0.0, bounds=NOT_NEGATIVE, learnt=True)


def delay(meaning: str) -> EffectParameter:
    """Shared parameter of a delay: time by which something is late."""
    return nonlinear("time", "s", meaning, neutral=0.0, physical=NOT_NEGATIVE, evaluable=NOT_NEGATIVE)


def over_described(name: str, unit: str, meaning: str, typical: float, evaluable: Range = ANY) -> EffectParameter:
    """Shared size of what comes on top of a described value of a hydraulic drive."""
    return nonlinear(name, unit, meaning, neutral=0.0, physical=NOT_NEGATIVE, evaluable=evaluable, typical=typical)
