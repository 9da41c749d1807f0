"""Pictures of the knee."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vpm.studies.pictures import curves, field
from vpm.studies.study import Picture
from vpm.studies.yoke import Yoke

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.studies.knee import Stressed


def pictures(yoke: Yoke, levels: Sequence[dict[str, Stressed]]) -> tuple[Picture, ...]:
    """All pictures of the study."""
    finest, stress = levels[-1], ("von Mises stress", "MPa")
    fineness = np.arange(1, len(levels) + 1)
    meshes = [(name, fineness, [1e-6 * level[name].peak for level in levels], "o-") for name in finest]
    across = [
        (name, 1e3 * depth, 1e-6 * value, "o-")
        for name, (depth, value) in ((name, each.line(yoke)) for name, each in finest.items())
    ]
    fields = [
        Picture(
            f"stress_{number}",
            f"Stress of von Mises on the front of the frame: {name}.",
            lambda name=name, each=each: _front(yoke, name, each),  # type: ignore[misc]
        )
        for number, (name, each) in enumerate(finest.items(), 1)
    ]
    return (
        *fields,
        Picture(
            "mesh",
            "Largest stress over the fineness of the mesh.",
            lambda: curves("Convergence", ("bricks through the thickness", ""), stress, meshes),
        ),
        Picture(
            "section",
            "Stress of von Mises across the middle of a corner, from inside.",
            lambda: curves("Across a corner", ("depth from inside", "mm"), stress, across),
        ),
    )


def _front(yoke: Yoke, name: str, seen: Stressed) -> Figure:
    """Front face: a quadrilateral for each brick that has one."""
    mesh, corners = seen.solid.mesh, seen.solid.corners
    facets = mesh.facets[:, mesh.boundary_facets()]
    on = np.all(np.abs(corners[1, facets[:4]] - 0.5 * yoke.width) < 1e-9, axis=0)
    faces = facets[:4, on]
    places = corners[[0, 2]][:, faces]
    turn = np.arctan2(*(places - places.mean(axis=1, keepdims=True))[::-1])
    faces = np.take_along_axis(faces, np.argsort(turn, axis=0), axis=0)
    values = 1e-6 * seen.equivalent[faces].mean(axis=0)
    return field(f"Stress of von Mises, {name}", "MPa", 1e3 * corners[[0, 2]], faces, values, ("x", "z"))
