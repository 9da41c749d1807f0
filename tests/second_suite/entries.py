"""What a model file says of a hidden effect, in the numbers of vpm's catalogue: to check that both mean the same."""

from collections.abc import Callable, Mapping

import numpy as np

from second_suite.laws import Numbers
from second_suite.machine import Machine
from second_suite.plant import SPLITTING, Hidden

#: Speed over which dry friction of a file turns round: slow creep for what sticks here.
CREEP = 1e-5
#: Numbers that have other names in a file, or other meanings. A rotor's inertia is there already.
NUMBERS: dict[str, Callable[[Numbers], dict[str, float]]] = {
    "gravity_tilt": lambda n: {"second": n["angle"]},
    "actuator_lag": lambda n: {"time_constant": n["time"]},
    "warming_friction": lambda n: {"coulomb": n["coulomb"], "time_constant": n["time"]},
    "joint_compliance": lambda n: {**n, "inertia": 1e-9},
    "backlash": lambda n: {
        "gap": n["gap"],
        "stiffness": n["stiffness"],
        "contact_damping": n["damping"],
        "inertia": 1e-9,
        "width": 2e-6,
    },
    "torque_ripple": lambda n: {
        "period": n["period"],
        "cosine": n["size"] * float(np.sin(n["phase"])),
        "sine": n["size"] * float(np.cos(n["phase"])),
    },
    "hysteresis": lambda n: {"force": n["force"], "displacement": n["way"]},
    "stribeck_friction": lambda n: {"stribeck": n["stribeck"], "stribeck_velocity": n["speed"]},
    "position_dependent_friction": lambda n: {"period": n["period"], "sine": 0.5 * n["coulomb"]},
    "asymmetric_friction": lambda n: {
        f"{law}_difference": n[f"{law}_up"] - n[f"{law}_down"] for law in ("coulomb", "viscous")
    },
}
#: Means of two of them, which a file calls plain friction.
MEANS: dict[str, Callable[[Numbers], dict[str, float]]] = {
    "position_dependent_friction": lambda n: {"coulomb": 0.5 * n["coulomb"]},
    "asymmetric_friction": lambda n: {law: 0.5 * (n[f"{law}_up"] + n[f"{law}_down"]) for law in ("coulomb", "viscous")},
}


def file(
    m: Machine, values: Mapping[str, float], hidden: Hidden | None = None, *, told: bool = True
) -> dict[str, object]:
    """The model file of a machine with what is hidden in it, or, if not ``told``, without.

    Friction sits where it does in the machine, before or behind a gear.
    """
    numbers, more = dict(values), []
    if hidden and hidden.base:
        numbers |= {} if told else {hidden.base: 0.0}
    elif hidden and told:
        means = MEANS[hidden.effect](hidden.values) if hidden.effect in MEANS else {}
        numbers |= {f"{hidden.site}.{law}": numbers[f"{hidden.site}.{law}"] + mean for law, mean in means.items()}
        said = NUMBERS[hidden.effect](hidden.values) if hidden.effect in NUMBERS else hidden.values
        more = [{"type": hidden.effect, "at": hidden.site, **said}]
    document = m.document(lambda key: numbers[key], frozenset(key for key, value in numbers.items() if not value))
    assert isinstance(document["effects"], list)
    effects = [*document["effects"], *more]
    behind = m.friction_at_load and any(effect["type"] in SPLITTING for effect in effects)
    for effect in (effect for effect in effects if effect["type"].endswith("_friction")):
        effect.update({"side": "link"} if behind else {})
        effect.update({} if effect["type"] == "viscous_friction" else {"transition_velocity": CREEP})
    return document | {"effects": effects}
