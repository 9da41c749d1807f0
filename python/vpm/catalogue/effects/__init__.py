"""The effects, one file each, and the order in which a page lists them.

Of effects that no digit of the data parts, a diagnosis names the one that stands first here. Of two that records
confuse, the later one says what tells them apart.

The command passes the effects of an actuator in the order delay, dead zone, saturation, lag, gain. A sensor reads
``y = gain x(t - delay) + offset``. A cylinder, the valve that is screwed on it, and the actuator have one name; what is
described of leakage, air and frequency stays, and an effect comes on top of it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib import import_module

from vpm.catalogue.kinds import EffectType

ORDER = (
    "viscous_friction",
    "coulomb_friction",
    "asymmetric_friction",
    "stribeck_friction",
    "bias_force",
    "spring",
    "torque_ripple",
    "hysteresis",
    "backlash",
    "joint_compliance",
    "rotor_inertia",
    "end_stop",
    "payload",
    "link_flexibility",
    "structural_damping",
    "gravity_tilt",
    "input_delay",
    "dead_zone",
    "saturation",
    "actuator_lag",
    "internal_leakage",
    "valve_dynamics",
    "entrained_air",
    "supply_drop",
    "sensor_offset",
    "sensor_gain",
    "sensor_delay",
    "quadratic_drag",
    "cubic_spring",
    "position_dependent_friction",
    "load_dependent_friction",
    "drive_friction",
    "seal_friction",
    "current_ripple",
    "lugre_friction",
    "warming_friction",
    "empirical_force",
)
"""Files of this folder."""


def _mutual(effects: Sequence[EffectType]) -> Iterator[EffectType]:
    """Effects each of which is confused with those that are confused with it."""
    told = {frozenset((one.name, other)): how for one in effects for other, how in one.confused_with.items()}
    for one in effects:
        pairs = {other.name: frozenset((one.name, other.name)) for other in effects}
        yield replace(one, confused_with={other: told[pair] for other, pair in pairs.items() if pair in told})


BUILT_IN = tuple(_mutual([import_module(f"{__name__}.{name}").EFFECT for name in ORDER]))
"""Their entries."""
