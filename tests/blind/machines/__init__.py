"""The machines of the proving ground, one file each."""

from collections.abc import Mapping
from types import MappingProxyType

from blind.machine import Machine
from blind.machines import arm2r, axis, flexible_arm, hydraulic_leg, servo_cylinder

_ALL: tuple[Machine, ...] = (
    axis.LINEAR,
    axis.ROTARY,
    arm2r.Arm2R(),
    flexible_arm.FlexibleArm(),
    servo_cylinder.ServoCylinder(),
    hydraulic_leg.HydraulicLeg(),
)

MACHINES: Mapping[str, Machine] = MappingProxyType({machine.name: machine for machine in _ALL})
"""Every machine by name."""

__all__ = ["MACHINES"]
