"""Link flexibility: bending of what is described as rigid.

A rigid body that bends is a pseudo-rigid link: a torsion spring at its root carries its first mode (L. L. Howell,
"Compliant Mechanisms", 2001, chapter 5). A rigid beam that bends becomes elastic itself, with two strain polynomials in
each of its components, so that strain gauges on it show it too.

Source: Howell 2001, chapter 5.
"""

from vpm.catalogue.kinds import NOT_NEGATIVE, POSITIVE, EffectType, nonlinear, shape
from vpm.catalogue.shared import RIGID
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="link_flexibility",
    site="link",
    group="flexibility",
    parameters=(
        nonlinear(
            "stiffness",
            "N m/rad",
            "moment at the root per angle of the line from root to tip; of a uniform beam 3 E I/length",
            neutral=RIGID,
            physical=(POSITIVE, float("inf")),
            evaluable=(POSITIVE, float("inf")),
        ),
        nonlinear("time", "s", "damping per stiffness", neutral=0.0, physical=NOT_NEGATIVE, evaluable=NOT_NEGATIVE),
        shape(
            "inertia",
            "kg m^2",
            "inertia at the root of a rigid body that does not bend with it, as its joint feels it",
            start=0.0,
            bounds=NOT_NEGATIVE,
            learnt=True,
        ),
    ),
    law="moment = -stiffness (b + time db/dt) on the bending b of the link, with inertia before it",
    sentence="{at} bends: its tip gives way like a hinge at its root with {stiffness}, damped over {time}.",
    impossible="a negative stiffness would bend the link by itself, a negative damping would feed energy in",
    confused_with={
        "joint_compliance": "behind one motor both are a spring; a strain gauge or the motion of the tip discriminates",
    },
    contains=("rotor_inertia",),
    motion="bending",
    signature=Signature(
        ("frequency",),
        "A peak at the first natural frequency of the link",
        "A chirp or quick stops, with a strain gauge at the root",
    ),
)
