"""Closed linkages: KARL, a limb driven by two strokes, and the leg of HyQ, driven by two cylinders.

Both are described by a TOML file or by numbers, and answer with frozen results that print, plot and become tables::

    from vpm import linkages

    karl = linkages.load("examples/karl/karl.toml")
    print(karl.direct((0.20, 0.18)).to_frame())

The laws are those of the core, see ``docs/linkages.md``. Angles in rad, lengths in m, all numbers SI.
"""

from vpm.studies.linkages.dropping import DropLimit, drop_limit
from vpm.studies.linkages.karl import Karl, KarlGeometry
from vpm.studies.linkages.karl_results import KarlPoses, KarlSingularities, KarlWorkspace
from vpm.studies.linkages.leg import Leg
from vpm.studies.linkages.leg_parameters import Attachment, Cylinder, LegParameters, LegPart, Segment
from vpm.studies.linkages.leg_regressor import INERTIAL_NAMES, inertial_values, with_inertial_values
from vpm.studies.linkages.leg_results import LegReactions, LegStrokes, LegTerms, ShareMap
from vpm.studies.linkages.load import load

__all__ = [
    "INERTIAL_NAMES",
    "Attachment",
    "Cylinder",
    "DropLimit",
    "Karl",
    "KarlGeometry",
    "KarlPoses",
    "KarlSingularities",
    "KarlWorkspace",
    "Leg",
    "LegParameters",
    "LegPart",
    "LegReactions",
    "LegStrokes",
    "LegTerms",
    "Segment",
    "ShareMap",
    "drop_limit",
    "inertial_values",
    "load",
    "with_inertial_values",
]
