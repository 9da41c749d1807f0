"""Bulk modulus and gain of the valve of a cylinder from its records."""

from vpm.studies.oil.equations import CylinderGeometry, pressures_from_force
from vpm.studies.oil.fit import OilFit, identify_oil

__all__ = ["CylinderGeometry", "OilFit", "identify_oil", "pressures_from_force"]
