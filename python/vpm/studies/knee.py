"""Stress in the frame of a knee prosthesis under loads of a gait (D'Imperio 2016, section B.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError
from vpm.numbers import Array
from vpm.studies.pictures import curves, field
from vpm.studies.solid import Solid, von_mises
from vpm.studies.study import Cell, Compared, Picture, Study, Table
from vpm.studies.yoke import Yoke, frame

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Table B.1: Young's modulus (GPa) as printed and as it has to be, yield stress (MPa) likewise.
MATERIALS = {
    "AISI 304": (192.0, 192.0, 270.0, 270.0),
    "AISI 1020": (200.0, 200.0, 330.0, 330.0),
    "teak": (11.7, 11.7, 65.0, 65.0),
    "titanium": (960.0, 96.0, 96.3, 930.0),
}
POISSON = 0.30


@dataclass(frozen=True)
class Load:
    """A force down along the leg, and where its line passes the top."""

    force: float  #: N.
    #: Offsets of the line, m.
    side: float = 0.0
    front: float = 0.0


#: The axial force of the test is printed; the lines of the standard are not, so these are assumed.
LOADS = {
    "axial, as tested": Load(1250.0),
    "line I, heel": Load(1250.0, -0.050, 0.052),
    "line II, forefoot": Load(1250.0, -0.035, 0.072),
}
ASSUMED = (
    "the frame: an arch of AISI 304, 60 mm wide, 90 mm high, section 10 x 30 mm, corners of 10 mm inside; the thesis "
    "shows its frame in pictures only",
    "the ends of the legs are held, and the adapter presses with a traction that is linear over a pad of 20 x 30 mm; "
    "stresses within one and a half thicknesses of both are left out: a held corner has no bounded stress, and a real "
    "adapter presses otherwise",
    "lines I and II: the printed 1250 N with offsets of 50 and 52 mm, 35 and 72 mm at the knee, of the size of those "
    "of ISO 10328; the thesis names the standard and prints no numbers, so look them up before you use them",
    "Poisson's ratio 0.30; titanium 96 GPa and 930 MPa, for 960 GPa and 96.3 MPa are printed",
)


@dataclass(frozen=True)
class Stressed:
    """A frame under one load."""

    solid: Solid
    stress: Array  #: Shape (3, 3, corners); Pa.
    deflection: float  #: Largest way of a node, m.
    support: float  #: Force along z at the held ends, N.
    clear: NDArray[np.bool_]  #: Shape (corners,); where stresses count.

    @property
    def equivalent(self) -> Array:
        """Stress of von Mises at the corners of the knee's frame, Pa."""
        return von_mises(self.stress)

    @property
    def peak(self) -> float:
        """Largest equivalent stress of the knee away from held ends and pad, Pa."""
        return float(self.equivalent[self.clear].max())

    def line(self, yoke: Yoke) -> tuple[Array, Array]:
        """Depth (m) and stress of von Mises (Pa) across the middle of the knee's right corner."""
        inner, leg = 0.5 * yoke.spacing - yoke.turn, yoke.leg
        x, y, z = self.solid.corners
        out = np.hypot(x - inner, z - leg)
        on = (np.abs(np.arctan2(z - leg, x - inner) - 0.25 * np.pi) < 1e-6) & (np.abs(y) < 1e-9)
        order = np.argsort(out[on])
        return out[on][order] - yoke.corner, self.equivalent[on][order]


def loaded(yoke: Yoke, fineness: int, loads: dict[str, Load], young: float) -> dict[str, Stressed]:
    """Solve the knee's frame under all loads."""
    if not 1 <= fineness <= 6:
        raise VpmError(f"a mesh with {fineness} bricks through the frame cannot be solved; take 1 to 6")
    solid, held, pad = frame(yoke, fineness, young, POISSON)
    forces = [
        load.force * solid.load(pad, lambda place, load=load: yoke.pressed(place, load.side, load.front))  # type: ignore[misc]
        for load in loads.values()
    ]
    clear = yoke.clear(solid.corners)
    answers = solid.solve(held, *forces)
    return {name: _stressed(solid, held, moved, clear) for name, moved in zip(loads, answers, strict=True)}


def _stressed(solid: Solid, held: Array, moved: Array, clear: NDArray[np.bool_]) -> Stressed:
    inside = solid.stiffness @ moved
    upward = np.concatenate([solid.basis.nodal_dofs[2], solid.basis.edge_dofs[2]])
    support = float(inside[np.intersect1d(held, upward)].sum())
    way = np.linalg.norm(moved[solid.basis.nodal_dofs], axis=0).max()
    stress = solid.corner_stress(moved)
    return Stressed(solid, stress, float(way), support, clear)


def knee(fineness: int = 4) -> Study:
    """Run the study of a knee.

    ``fineness``: bricks through the thickness of the finest mesh; coarser ones show how stresses converge.
    """
    yoke, young = Yoke(), 1e9 * MATERIALS["AISI 304"][1]
    if not 1 <= fineness <= 6:
        raise VpmError(f"a mesh with {fineness} bricks through the frame cannot be solved; take 1 to 6")
    levels = [loaded(yoke, n, LOADS, young) for n in range(1, fineness + 1)]
    finest = levels[-1]
    return Study(
        "knee",
        "B.1 The frame of a knee prosthesis",
        _compared(finest, fineness),
        (_margins(finest), _convergence(levels), _sizes(yoke, young, min(fineness, 2)), _offsets(yoke, young)),
        ASSUMED,
        pictures(yoke, levels),
    )


def mesh_words(fineness: int) -> str:
    """Mesh of the knee in words."""
    return f"{22 * fineness} x {fineness} x {2 * fineness} bricks"


def _compared(finest: dict[str, Stressed], fineness: int) -> tuple[Compared, ...]:
    mesh = mesh_words(fineness)
    source = "none printed: pictures only"
    return tuple(
        Compared(f"largest von Mises, {name}", 1e-6 * each.peak, None, "MPa", source, mesh)
        for name, each in finest.items()
    )


def _margins(finest: dict[str, Stressed]) -> Table:
    """Yield over the largest stress of the knee, which does not depend on Young's modulus."""
    steel = MATERIALS["AISI 304"][1]
    rows: list[tuple[Cell, ...]] = []
    for name, (printed, young, printed_yield, yields) in MATERIALS.items():
        margins = [1e6 * yields / each.peak for each in finest.values()]
        way = 1e3 * finest["line I, heel"].deflection * steel / young
        rows.append((name, printed, young, printed_yield, yields, *margins, way))
    return Table(
        "Yield stress over the largest stress",
        ("material", "E printed", "E GPa", "yield printed", "yield MPa", *finest, "deflection mm, line I"),
        tuple(rows),
        "Stress does not depend on Young's modulus here, deflection goes with its inverse.",
    )


def _convergence(levels: list[dict[str, Stressed]]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for n, level in enumerate(levels, 1):
        axial = level["axial, as tested"]
        rows.append(
            (mesh_words(n), *(1e-6 * each.peak for each in level.values()), 1e3 * axial.deflection, axial.support)
        )
    return Table(
        "Convergence with the mesh",
        ("mesh", *(f"{name} MPa" for name in levels[0]), "deflection mm, axial", "support N, axial"),
        tuple(rows),
    )


def _sizes(yoke: Yoke, young: float, fineness: int) -> Table:
    changed = {
        "as assumed": yoke,
        "thickness 8 mm": yoke.with_(thickness=0.008),
        "thickness 12 mm": yoke.with_(thickness=0.012),
        "corner 6 mm": yoke.with_(corner=0.006),
        "corner 14 mm": yoke.with_(corner=0.014),
        "width 24 mm": yoke.with_(width=0.024),
    }
    rows: list[tuple[Cell, ...]] = []
    for name, one in changed.items():
        seen = loaded(one, fineness, LOADS, young)
        rows.append((name, *(1e-6 * each.peak for each in seen.values())))
    return Table(f"What the sizes do, largest MPa ({mesh_words(fineness)})", ("changed", *LOADS), tuple(rows))


def _offsets(yoke: Yoke, young: float) -> Table:
    lines = {"on the axis": Load(1250.0), "10 mm to the side": Load(1250.0, 0.01), "10 mm ahead": Load(1250.0, 0, 0.01)}
    seen = loaded(yoke, 1, lines, young)
    rows = tuple((name, 1e-6 * each.peak) for name, each in seen.items())
    return Table(f"What the line of 1250 N does ({mesh_words(1)})", ("line", "largest MPa"), rows)


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
