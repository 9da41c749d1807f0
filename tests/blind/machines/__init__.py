"""The machines of the proving ground, one file each."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from blind.machine import Machine
from blind.machines import arm2r, axis, hydraulic_leg, servo_cylinder

MACHINES: Mapping[str, Machine] = MappingProxyType(
    {
        machine.name: machine
        for machine in (
            axis.LINEAR,
            axis.ROTARY,
            servo_cylinder.ServoCylinder(),
            arm2r.Arm2R(),
            hydraulic_leg.HydraulicLeg(),
        )
    },
)
"""Every machine by name."""

__all__ = ["MACHINES"]
