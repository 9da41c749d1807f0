"""Pictures of the fingertip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from vpm.numbers import Array
from vpm.studies.finger_body import Finger
from vpm.studies.pictures import curves, field
from vpm.studies.press import Pressed
from vpm.studies.soft import SoftBody, State
from vpm.studies.study import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.studies.fingertip import Curve


def equivalent_stress(body: SoftBody, state: State) -> Array:
    """Stress of von Mises at each point, Pa; pressure has no part in it."""
    strain = body.strain(state)
    a, b, c, d, e = strain
    stress = body.energy_density(strain).gradient
    volume = (a * d - b * c) * e
    rr = (stress[0] * a + stress[1] * b) / volume
    rz = (stress[0] * c + stress[1] * d) / volume
    zz = (stress[2] * c + stress[3] * d) / volume
    hoop = stress[4] * e / volume
    return np.asarray(np.sqrt(0.5 * ((rr - zz) ** 2 + (zz - hoop) ** 2 + (hoop - rr) ** 2) + 3.0 * rz**2))


def pictures(levels: Mapping[str, Sequence[Curve]], finger: Finger, fineness: int) -> tuple[Picture, ...]:
    """All pictures of the study."""
    from vpm.studies.fingertip import DEPTHS, PRINTED_FORCE, averages

    finest = {rim: each[-1] for rim, each in levels.items()}
    last = {rim: each.steps[-1] for rim, each in finest.items()}
    printed = [("printed model", DEPTHS, PRINTED_FORCE, "s"), ("measured", DEPTHS, averages(), "o")]
    ours = [(rim, each.way, [step.force for step in each.steps], "-") for rim, each in finest.items()]
    areas = [(rim, each.way, [1e6 * step.area for step in each.steps], "-") for rim, each in finest.items()]
    borne = [(rim, 1e3 * step.radius, 1e-3 * step.pressure, "-") for rim, step in last.items()]
    meshes = [
        (f"{rim}, {depth:.0f} mm", np.arange(1, len(each) + 1), [float(one.force(depth)) for one in each], "o-")
        for rim, each in levels.items()
        for depth in DEPTHS
    ]
    way, force, radius = ("indentation", "mm"), ("force", "N"), ("radius", "mm")

    def stresses() -> Figure:
        return _stresses(finger, last["rim held"], fineness)

    return (
        Picture("force", "Force over indentation.", lambda: curves("Force", way, force, [*ours, *printed])),
        Picture("area", "Area of contact over indentation.", lambda: curves("Area", way, ("area", "mm²"), areas)),
        Picture(
            "pressure",
            "Contact pressure over the radius at 3 mm.",
            lambda: curves("Pressure at 3 mm", radius, ("pressure", "kPa"), borne),
        ),
        Picture(
            "mesh",
            "Forces over the fineness of the mesh.",
            lambda: curves("Convergence", ("elements through the epidermis", ""), force, meshes, logarithmic=True),
        ),
        Picture("stress", "Stress of von Mises at 3 mm, rim held.", stresses),
    )


def _stresses(finger: Finger, step: Pressed, fineness: int) -> Figure:
    body = finger.with_(held=True).body(fineness)
    values = 1e-3 * equivalent_stress(body, step.state).mean(axis=1)
    corners = body.mesh.p[:, : body.basis.nodal_dofs.shape[1]] + step.state.displacement[body.basis.nodal_dofs]
    return field("Stress of von Mises", "kPa", 1e3 * corners, body.mesh.t[:4], values, ("r", "z"))
