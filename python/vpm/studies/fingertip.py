"""A fingertip pressed onto a plate: force and area of contact (D'Imperio 2016, section B.2)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vpm.numbers import Array
from vpm.studies.finger_body import Finger, block, check_fineness, hertz, layer_factor
from vpm.studies.finger_pictures import pictures
from vpm.studies.material import Material
from vpm.studies.press import Pressed, press
from vpm.studies.study import Cell, Compared, Study, Table

#: Table B.3: force (N) at 1, 2 and 3 mm in five trials, and that of the thesis' model.
TRIALS = np.array(
    [
        [0.129, 0.825, 4.761],
        [0.111, 0.811, 4.759],
        [0.118, 0.867, 4.669],
        [0.114, 0.874, 4.672],
        [0.103, 0.829, 4.761],
    ]
)
PRINTED_FORCE = np.array([0.132, 0.646, 3.510])
#: Table B.4: area (mm^2) that bears 5 to 10, 10 to 15 ... 40 to 45 kPa at 3 mm, measured and of the thesis' model.
MEASURED_AREA = np.array([10.2, 9.32, 8.02, 9.50, 11.5, 12.4, 15.2, 28.1])
PRINTED_AREA = np.array([7.75, 7.55, 10.5, 12.5, 13.5, 14.6, 17.5, 21.0])
CLASSES = np.arange(5.0, 46.0, 5.0)
#: Force from which the indentation is counted, N (section B.2.2).
TOUCH = 0.02

#: Layers and epidermis as printed (Table B.2, section B.2.1); sizes and constants that are not printed are assumed.
FINGER = Finger(
    radius=8e-3,
    bone=0.5 * 6.35e-3,
    epidermis=0.41e-3,
    dermis=0.93e-3,
    tissue=Material({(1, 0): 5.7e3}),
    skin=Material({(1, 0): 9.4e3, (1, 1): 82e3}),
    surface=Material.linear(2.0e6, 0.30),
    held=True,
)
RIMS = {"rim held": True, "rim free": False}
DEPTHS = np.array([1.0, 2.0, 3.0])
#: Load steps: ways of the first touch (m), then indentations as the thesis counts them (mm).
FIRST = 1e-3 * np.array([0.05, 0.1, 0.2])
STEPS = np.array([0.3, 0.6, 1.0, 1.3, 1.6, 2.0, 2.25, 2.5, 2.75, 3.0])

ASSUMED = (
    "outer radius 8 mm; the tissue is half a ball around a ball of bone with the printed 6.35 mm as its diameter",
    "bone (17 GPa, printed as MPa), nail and plate are rigid beside tissue of some kPa",
    "subcutaneous tissue C10 = 5.7 kPa (Young's modulus 34 kPa), dermis C10 = 9.4 kPa and C11 = 82 kPa: of the size "
    "that is reported of tissue in vivo; both keep their volume",
    "epidermis: the printed 2 MPa and 0.30 as a neo-Hookean material, since it turns and stretches far",
    "what the nail does at the rim: held and free are both shown, as the two limits",
    "at rest at each depth: the visco-elastic terms are not printed",
)


def averages() -> Array:
    """Mean fingertip force of the five trials at 1, 2 and 3 mm, N."""
    return np.asarray(TRIALS.mean(axis=0))


def deviations() -> Array:
    """Fingertip force of the thesis' model less the measured mean, % of the measured mean."""
    return 100.0 * (PRINTED_FORCE / averages() - 1.0)


@dataclass(frozen=True)
class Curve:
    """Force and area over the way since the touch."""

    steps: Sequence[Pressed]
    touch: float  #: Way to the force from which the indentation is counted, m.

    @property
    def way(self) -> Array:
        """Indentation of the fingertip as the thesis counts it, mm."""
        return 1e3 * (np.array([step.indentation for step in self.steps]) - self.touch)

    def force(self, depth: Array) -> Array:
        """Fingertip force at indentations in mm, N."""
        return self._at(depth, lambda step: step.force)

    def area(self, depth: Array) -> Array:
        """Contact area of the fingertip at indentations in mm, mm^2."""
        return 1e6 * self._at(depth, lambda step: step.area)

    def balance(self) -> float:
        """Work of the plate on the fingertip less elastic energy, share of the energy."""
        from scipy.interpolate import PchipInterpolator

        way = np.array([0.0, *(step.indentation for step in self.steps)])
        force = PchipInterpolator(way, [0.0, *(step.force for step in self.steps)])
        work = float(force.integrate(way[0], way[-1]))
        return work / self.steps[-1].energy - 1.0

    def _at(self, depth: Array, what: Callable[[Pressed], float]) -> Array:
        from scipy.interpolate import PchipInterpolator

        return np.asarray(PchipInterpolator(self.way, [what(step) for step in self.steps])(depth))


def indent(finger: Finger, fineness: int, depths: Array = STEPS) -> Curve:
    """Press a finger onto a plate, up to indentations in mm as the thesis counts them."""
    from scipy.interpolate import PchipInterpolator

    body = finger.body(fineness)
    first = press(body, list(FIRST), start=-finger.radius)
    rising = PchipInterpolator([0.0, *(step.force for step in first)], [0.0, *(step.indentation for step in first)])
    touch = float(rising(TOUCH))
    rest = press(body, list(touch + 1e-3 * depths), start=-finger.radius, after=first[-1])
    return Curve([*first, *rest], touch)


def classes(step: Pressed) -> Array:
    """Fingertip area that bears each class of pressure, and what is beyond the last class, mm^2."""
    fine = np.linspace(0.0, step.contact_radius, 4001)
    pressure = 1e-3 * np.interp(fine, step.radius, step.pressure)
    rings = 1e6 * np.pi * np.diff(fine**2)
    edges = [*CLASSES, np.inf]
    middle = 0.5 * (pressure[1:] + pressure[:-1])
    return np.array([rings[(middle >= a) & (middle < b)].sum() for a, b in pairwise(edges)])


def fingertip(fineness: int = 3) -> Study:
    """Run the study of a soft fingertip.

    ``fineness``: of the finest mesh; coarser ones show how figures converge.
    """
    check_fineness(fineness)
    levels = {rim: [indent(FINGER.with_(held=held), n) for n in range(1, fineness + 1)] for rim, held in RIMS.items()}
    finest = {rim: curves[-1] for rim, curves in levels.items()}
    tables = (
        _measured(finest),
        _areas(finest),
        _convergence(levels),
        small_loads(max(fineness, 2)),
        penalties(),
        sensitivities(),
    )
    title = "B.2 A fingertip on a plate"
    return Study("fingertip", title, _compared(finest, fineness), tables, ASSUMED, pictures(levels, FINGER, fineness))


def mesh_words(fineness: int) -> str:
    """Fingertip mesh in words."""
    return f"{6 * fineness} x {12 * fineness} Q2/Q1"


def _compared(finest: dict[str, Curve], fineness: int) -> tuple[Compared, ...]:
    mesh = mesh_words(fineness)
    rows = []
    for rim, curve in finest.items():
        for depth, ours, printed in zip(DEPTHS, curve.force(DEPTHS), PRINTED_FORCE, strict=True):
            rows.append(Compared(f"force at {depth:.0f} mm, {rim}", ours, printed, "N", "Table B.3, numerical", mesh))
    for rim, curve in finest.items():
        area = float(classes(curve.steps[-1]).sum())
        rows.append(
            Compared(f"area above 5 kPa, {rim}", area, float(PRINTED_AREA.sum()), "mm^2", "Table B.4, sum", mesh)
        )
    return tuple(rows)


def _measured(finest: dict[str, Curve]) -> Table:
    forces = {rim: curve.force(DEPTHS) for rim, curve in finest.items()}
    rows = [
        (f"{depth:.0f} mm", averages()[k], PRINTED_FORCE[k], deviations()[k], *(each[k] for each in forces.values()))
        for k, depth in enumerate(DEPTHS)
    ]
    borne = [1e-3 * float(areas @ (0.5 * (CLASSES[1:] + CLASSES[:-1]))) for areas in (MEASURED_AREA, PRINTED_AREA)]
    return Table(
        "Force beside the measured mean of five trials",
        ("indentation", "measured N", "printed model N", "printed model less measured %", *(f"{r} N" for r in forces)),
        tuple(rows),
        f"Areas times pressures of Table B.4 bear {borne[0]:.3g} N (measured) and {borne[1]:.3g} N (model), less than "
        "the forces of Table B.3 at the same 3 mm.",
    )


def _areas(finest: dict[str, Curve]) -> Table:
    ours = {rim: classes(curve.steps[-1]) for rim, curve in finest.items()}
    names = [f"{a:.0f} to {b:.0f} kPa" for a, b in pairwise(CLASSES)]
    rows: list[tuple[Cell, ...]] = [
        (name, MEASURED_AREA[k], PRINTED_AREA[k], *(float(each[k]) for each in ours.values()))
        for k, name in enumerate(names)
    ]
    rows.append(("above 45 kPa", None, None, *(float(each[-1]) for each in ours.values())))
    return Table(
        "Area by pressure at 3 mm, mm^2",
        ("pressure", "measured", "printed model", *ours),
        tuple(rows),
        "Pressures are means of edges of the mesh: the fall to zero at the end of the contact lies within one of them.",
    )


def _convergence(levels: dict[str, list[Curve]]) -> Table:
    rows: list[tuple[Cell, ...]] = [
        (rim, mesh_words(n), *map(float, curve.force(DEPTHS)), float(curve.area(DEPTHS)[-1]), 100.0 * curve.balance())
        for rim, curves in levels.items()
        for n, curve in enumerate(curves, 1)
    ]
    return Table(
        "Convergence with the mesh",
        ("rim", "mesh", "N at 1 mm", "N at 2 mm", "N at 3 mm", "mm^2 at 3 mm", "work less energy %"),
        tuple(rows),
        "Work is a sum over load steps, energy that of the last step.",
    )


def small_loads(fineness: int) -> Table:
    """A ball on a flat layer, and the finger made of one material, beside Hertz."""
    rows: list[tuple[Cell, ...]] = []
    height, radius = 1e-2, 5e-2
    for share in (0.03, 0.1):
        way = (share * height) ** 2 / radius
        body = block(height, 1.3 * share * height, FINGER.tissue, fineness)
        seen = press(body, [way], start=0.0, curvature=-1.0 / radius)[-1]
        force, _ = hertz(way, radius, FINGER.tissue.young)
        rows.append(_beside("ball on a layer", share, seen, float(force), radius, float(layer_factor(share))))
    alone = FINGER.with_(skin=FINGER.tissue, surface=FINGER.tissue)
    for way in (0.02e-3, 0.05e-3):
        seen = press(alone.body(fineness, pole=4.0), [way], start=-alone.radius)[-1]
        force, edge = hertz(way, alone.radius, FINGER.tissue.young)
        share = float(edge) / alone.thickness
        rows.append(_beside("finger of one material", share, seen, float(force), alone.radius, None))
    return Table(
        "Small loads beside Hertz (Poisson's ratio 1/2)",
        ("body", "sqrt(R d)/h", "F/F_Hertz", "of the layer", "a^3 4 E*/(3 R F)"),
        tuple(rows),
        "Of the layer: Dimitriadis 2002, a bonded flat layer of constant volume. The last column is 1 for Hertz.",
    )


def _beside(
    name: str, share: float, seen: Pressed, force: float, radius: float, factor: float | None
) -> tuple[Cell, ...]:
    plane = FINGER.tissue.young / 0.75
    return name, share, seen.force / force, factor, seen.contact_radius**3 * 4.0 * plane / (3.0 * radius * seen.force)


def penalties() -> Table:
    """Fingertip force and overlap by the contact stiffness alone, and with augmented Lagrange."""
    rows, ways = [], [0.5e-3, 1e-3]
    for factor in (0.01, 0.1, 1.0, 10.0):
        body = FINGER.body(1)
        body.penalty *= factor
        seen = press(body, ways, start=-FINGER.radius, augmented=False)[-1]
        rows.append((f"{factor:g}", seen.force, 1e6 * seen.overlap))
    seen = press(FINGER.body(1), ways, start=-FINGER.radius)[-1]
    rows.append(("1, augmented Lagrange", seen.force, 1e6 * seen.overlap))
    return Table(
        "Convergence with the contact stiffness, rim held, 1 mm",
        ("stiffness / usual", "force N", "overlap um"),
        tuple(rows),
        "All other figures are by augmented Lagrange.",
    )


def variations() -> dict[str, Finger]:
    """Fingers with one assumption changed."""
    tissue, skin = FINGER.tissue, FINGER.skin
    return {
        "as assumed": FINGER,
        "rim free": FINGER.with_(held=False),
        "tissue x 1/2": FINGER.with_(tissue=tissue.scaled(0.5)),
        "tissue x 2": FINGER.with_(tissue=tissue.scaled(2.0)),
        "dermis x 1/2": FINGER.with_(skin=skin.scaled(0.5)),
        "dermis x 2": FINGER.with_(skin=skin.scaled(2.0)),
        "dermis without C11": FINGER.with_(skin=Material({(1, 0): skin.constants[1, 0]})),
        "epidermis 0.2 MPa": FINGER.with_(surface=FINGER.surface.scaled(0.1)),
        "outer radius 7.5 mm": FINGER.with_(radius=7.5e-3),
        "outer radius 9 mm": FINGER.with_(radius=9e-3),
        "rim free, tissue and dermis x 1/4": FINGER.with_(
            held=False, tissue=tissue.scaled(0.25), skin=skin.scaled(0.25)
        ),
    }


def sensitivities() -> Table:
    """Fingertip forces with one assumption changed at a time."""
    rows: list[tuple[Cell, ...]] = []
    for name, finger in variations().items():
        curve = indent(finger, 1)
        rows.append((name, *map(float, curve.force(DEPTHS)), float(curve.area(DEPTHS)[-1])))
    rows.append(("printed model", *map(float, PRINTED_FORCE), None))
    rows.append(("measured", *map(float, averages()), None))
    return Table(
        f"What the assumptions do ({mesh_words(1)})",
        ("changed", "N at 1 mm", "N at 2 mm", "N at 3 mm", "mm^2 at 3 mm"),
        tuple(rows),
    )
