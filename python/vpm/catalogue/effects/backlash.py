"""Backlash: play in a gear, between contacts that close over a short way.

At a driven joint it splits the joint, as a compliance does: the joint's own coordinate stays that of the motor side,
which is measured and on which the actuator and all other effects of the joint act. The link hangs behind a joint
without actuator, named like the joint with ``_deflection`` after it, whose coordinate is link side minus motor side.
Beside a compliance it is in series with that: a joint gives way by the gap and then as that spring does.

Source: Nordin and Gutman 2002, section 2.
"""

from vpm.catalogue.kinds import NOT_NEGATIVE, EffectType, shape, size
from vpm.catalogue.shared import CONTACT, motor_inertia
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="backlash",
    site="joint",
    group="backlash",
    parameters=(
        shape("gap", "{C}", "free way from contact to contact", start=None, bounds=NOT_NEGATIVE),
        size("stiffness", "{E}/{C}", "effort per way beyond the gap", physical=NOT_NEGATIVE),
        size("damping", "{E} s/{C}", "resistance per speed, within the gap and beyond", physical=NOT_NEGATIVE),
        size("contact_damping", "{E} s/{C}", "resistance per speed of a closed contact alone", physical=NOT_NEGATIVE),
        shape("width", "{C}", "way over which a contact closes", start=CONTACT),
        motor_inertia(),
    ),
    law=(
        "tau = -stiffness (q + 1/2 sqrt((q - 1/2 gap)^2 + width^2) - 1/2 sqrt((q + 1/2 gap)^2 + width^2))"
        " - damping v - contact_damping (1 + 1/2 (q - 1/2 gap) / sqrt((q - 1/2 gap)^2 + width^2)"
        " - 1/2 (q + 1/2 gap) / sqrt((q + 1/2 gap)^2 + width^2)) v"
    ),
    sentence=(
        "{at} has a backlash of {gap} between contacts of {stiffness}, damped with {contact_damping}, and with"
        " {damping} within it as well."
    ),
    impossible="a negative stiffness would pull the contacts into each other, a negative damping would feed energy in",
    contains=("rotor_inertia", "joint_compliance"),
    motion="deflection",
    of_spring=(("stiffness", "stiffness"), ("contact_damping", "damping"), ("inertia", "inertia")),
    impacts=True,
    fixed=("damping", "width"),
    motor_side_alone=True,
    signature=Signature(
        ("position", "effort"),
        "A flat part where nothing is passed on, with a step wherever the effort changes its sign",
        "Reversals under a small load, with a sensor on either side of the gap",
    ),
)
