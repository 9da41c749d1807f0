"""The effects, one file each, and the order in which a page lists them.

Of effects that no digit of the data parts, a diagnosis names the one that stands first here.

The command passes the effects of an actuator in the order delay, dead zone, saturation, lag, gain. A sensor reads
``y = gain x(t - delay) + offset``. A cylinder, the valve that is screwed on it, and the actuator have one name; what is
described of leakage, air and frequency stays, and an effect comes on top of it.
"""

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
    "current_ripple",
    "lugre_friction",
    "warming_friction",
    "empirical_force",
)
"""Files of this folder."""

BUILT_IN: tuple[EffectType, ...] = tuple(import_module(f"{__name__}.{name}").EFFECT for name in ORDER)
"""Their entries."""
