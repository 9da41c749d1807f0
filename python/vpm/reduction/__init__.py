"""Solids of finite elements as flexible links: Craig-Bampton reduction (docs/reduced_links.md)."""

from vpm.reduction.craig_bampton import Reduction, reduce_structure
from vpm.reduction.files import read_structure, reduce
from vpm.reduction.solid import box_mesh, read_mesh, solid
from vpm.reduction.structure import Interface, Structure

__all__ = [
    "Interface",
    "Reduction",
    "Structure",
    "box_mesh",
    "read_mesh",
    "read_structure",
    "reduce",
    "reduce_structure",
    "solid",
]
