"""Pictures of the carton."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from vpm.studies.pictures import curves
from vpm.studies.study import Picture

if TYPE_CHECKING:
    from vpm.studies.carton import Fold


def pictures(
    rigid: Fold, flexible: Fold, first: Fold, second: Fold, meshes: Mapping[int, float]
) -> tuple[Picture, ...]:
    """All pictures of the study."""
    from vpm.studies.carton import LEVER, PRINTED_FORCE

    angle, force = ("angle of the finger", "degrees"), ("contact force", "N")
    folds = [(name, np.degrees(one.angle), one.force, "-") for name, one in (("rigid", rigid), ("flexible", flexible))]
    torques = [
        (name, np.degrees(one.crease), 1e3 * LEVER * one.force, "-")
        for name, one in (("undamaged", rigid), ("first fold", first), ("second fold", second))
    ]
    counts = list(meshes)
    return (
        Picture(
            "force",
            "Contact force over the angle, with a rigid and with a flexible panel.",
            lambda: curves("Force", angle, force, [*folds, ("read off Fig. B.10", [90.0], [PRINTED_FORCE], "s")]),
        ),
        Picture(
            "torque",
            "Torque over the angle of the crease, undamaged, damaged by a first fold, and on the second one.",
            lambda: curves("Crease", ("angle of the crease", "degrees"), ("torque", "N mm"), torques),
        ),
        Picture(
            "mesh",
            "Force at 90 degrees over the number of elements of the flexible panel.",
            lambda: curves("Convergence", ("elements", ""), force, [("flexible", counts, list(meshes.values()), "o-")]),
        ),
    )
