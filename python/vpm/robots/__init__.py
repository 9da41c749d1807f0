"""Robots of other programs: URDF, xacro and MJCF in, what was identified back into the URDF."""

from vpm.robots.exporting import ExportedRobot, export_robot
from vpm.robots.importing import ImportedRobot, import_robot

__all__ = ["ExportedRobot", "ImportedRobot", "export_robot", "import_robot"]
