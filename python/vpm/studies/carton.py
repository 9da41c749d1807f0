"""A panel of a carton folded on its crease, rigid and flexible (D'Imperio 2016, section B.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import VpmError
from vpm.numbers import Array
from vpm.studies.crease import Damage, damaged, elastica
from vpm.studies.pictures import curves
from vpm.studies.study import Compared, Picture, Study, Table
from vpm.units import convert

if TYPE_CHECKING:
    from vpm.model import Model


#: Equation B.2: stiffness of a crease per length, in its two readings.
PER_LENGTH = 0.009375
READINGS = {"per degree": "N mm/deg", "per radian": "N mm/rad"}
#: Length of the crease, mm, and lever of the finger, m: assumed.
CREASE, LEVER = 100.0, 0.05
#: What Fig. B.10 shows at 90 degrees, N, read off the picture.
PRINTED_FORCE = 1.6
FULL = 0.5 * np.pi
#: Time of a fold, and of rest before and after it, s; steps of the log, s; what the motion filter lets pass, Hz.
FOLD, REST, STEP, CUTOFF = 1.0, 0.3, 1e-3, 40.0
DAMAGE = Damage(share=0.2, scale=np.radians(20.0))

ASSUMED = (
    "crease 100 mm long, panel 80 mm, lever of the finger 50 mm; the finger stays square to the panel and its law is a "
    "smooth fold of 1 s: sizes and laws of the fingers are not printed",
    "equation B.2 in N mm per degree: the printed N/mm is no unit of a torsional spring, and only per degree gives "
    "the scale of Fig. B.10",
    "panel 0.5 mm thick, Young's modulus 2 GPa: printed is 0.10 MPa, by which a panel could not bear its own weight",
    "full damping of the contact at a depth of 0.1 mm, the printed trigger distance; gravity is left out: a panel of "
    "3.9 g moves its crease by less than 2 N mm",
    "damage: not in the thesis, whose crease is linear; an undamaged crease is the comparison, and a table shows what "
    "damage would do",
)


def carton(changes: Mapping[str, float] | None = None, *, level: str | None = None) -> Model:
    """Model file of the carton study, with other values of its parameters (SI)."""
    from vpm.model import Model

    path = files("vpm.studies") / "carton.toml"
    model = Model.from_toml(path.read_text(encoding="utf-8"))
    model = model.with_parameters(dict(changes or {}))
    return model.at(level) if level else model


def crease_stiffness(reading: str = "per degree", length: float = CREASE) -> float:
    """Stiffness of a carton's crease whose length is in mm, N m/rad."""
    return convert(PER_LENGTH * length, READINGS[reading], "N m/rad")


def crease_torque(angle: float, reading: str = "per degree") -> float:
    """Torque that holds the carton's folded crease at rest, N m."""
    model = carton({"crease.spring.stiffness": crease_stiffness(reading)}, level="rigid")
    still = [0.0, 0.0]
    return -float(model.inverse_dynamics([angle, -angle], still, still)[1])


@dataclass(frozen=True)
class Fold:
    """A fold from 0 to 90 degrees."""

    angle: Array  #: Of the finger, rad.
    force: Array  #: Of the contact, N.
    crease: Array  #: Angle of the crease, rad.

    def at(self, angle: float) -> float:
        """Force of a carton's fold at an angle, N."""
        return float(np.interp(angle, self.angle, self.force))

    @property
    def end(self) -> float:
        """Force at the end of a carton's fold, N."""
        return float(self.force[-1])

    @property
    def work(self) -> float:
        """Work of the finger that folds the carton, J: its force times its lever over the angle."""
        return float(np.trapezoid(self.force, self.angle) * LEVER)


def motion() -> tuple[Array, Array]:
    """Time (s) and angle (rad) of the finger that folds the carton, smooth from 0 to 90 degrees."""
    time = STEP * np.arange(round((FOLD + 2.0 * REST) / STEP))
    share = np.clip((time - REST) / FOLD, 0.0, 1.0)
    return np.asarray(time), np.asarray(0.5 * FULL * (1.0 - np.cos(np.pi * share)))


def fold(model: Model) -> Fold:
    """Turn the carton under its finger."""
    from vpm.experiment import Experiment
    from vpm.simulate import simulate

    time, angle = motion()
    log = Experiment.from_arrays(time, {"fold.position": angle}, units={"fold.position": "rad"}, name="fold")
    run = simulate(model, log, "prescribed_motion", cutoff=CUTOFF, integrator="adaptive")
    return Fold(np.interp(run.time, time, angle), run["finger.normal_force"], -run["crease.position"])


def fold_carton(fineness: int = 4) -> Study:
    """Run the study of folding a carton.

    ``fineness``: elements of the flexible panel; fewer ones show how its force converges.
    """
    if not 1 <= fineness <= 16:
        raise VpmError(f"a panel of {fineness} elements cannot be made; take a whole number from 1 to 16")
    level = f"elements({fineness})"
    rigid, flexible = fold(carton(level="rigid")), fold(carton(level=level))
    counts = range(1, fineness + 1)
    meshes = {n: flexible.end if n == fineness else fold(carton(level=f"elements({n})")).end for n in counts}
    first, second = damaged(carton, fold, DAMAGE)
    return Study(
        "carton",
        "B.3 A carton folded on its crease",
        _compared(rigid, flexible, fineness),
        (
            _angles(rigid, flexible),
            _readings(),
            _convergence(meshes),
            _panels(level),
            _damages(rigid, {0.05: None, 0.2: (first, second)}),
        ),
        ASSUMED,
        _pictures(rigid, flexible, first, second, meshes),
    )


def _compared(rigid: Fold, flexible: Fold, fineness: int) -> tuple[Compared, ...]:
    source = "Fig. B.10, read off"
    return (
        Compared("force at 90 degrees, rigid panel", rigid.end, PRINTED_FORCE, "N", source, "rigid"),
        Compared("flexible panel", flexible.end, None, "N", "Fig. B.10: below the rigid one", f"{fineness} elements"),
        Compared("crease torque at 90 degrees", 1e3 * crease_torque(FULL), None, "N mm", "equation B.2", "rigid"),
    )


def _angles(rigid: Fold, flexible: Fold) -> Table:
    rows = []
    for degrees in (10.0, 30.0, 60.0, 89.0):
        angle = np.radians(degrees)
        line = crease_stiffness() * angle / LEVER
        bent = elastica(angle, crease_stiffness(), LEVER, carton())
        rows.append((f"{degrees:.0f}", rigid.at(angle), line, flexible.at(angle), bent))
    return Table(
        "Force over the angle, N",
        ("degrees", "rigid", "spring by lever", "flexible", "elastica"),
        tuple(rows),
        "Spring by lever and elastica (an ordinary differential equation solved by scipy) know nothing of vpm; rigid "
        "panels lack the overlap of the contact, about 0.04 mm.",
    )


def _readings() -> Table:
    rows = [
        (name, 1e3 * crease_stiffness(name), 1e3 * crease_torque(FULL, name), crease_torque(FULL, name) / LEVER)
        for name in READINGS
    ]
    return Table(
        "Equation B.2 in its two readings, 90 degrees",
        ("reading", "stiffness N mm/rad", "torque N mm", "force N"),
        tuple(rows),
    )


def _convergence(meshes: Mapping[int, float]) -> Table:
    rows = [(f"{n} elements", force) for n, force in meshes.items()]
    rows.append(("bezier(6)", fold(carton(level="bezier(6)")).end))
    return Table("Convergence of the flexible panel", ("panel", "N at 90 degrees"), tuple(rows))


def _panels(level: str) -> Table:
    """Flexible panels of the carton with one assumption changed."""
    changed: dict[str, Mapping[str, float]] = {
        "as assumed": {},
        "1 GPa": {"panel.young": 1e9},
        "5 GPa": {"panel.young": 5e9},
        "0.4 mm": {"panel.section.width": 0.4e-3},
        "0.8 mm": {"panel.section.width": 0.8e-3},
        "crease of 80 mm": {"crease.spring.stiffness": crease_stiffness(length=80.0), "panel.section.height": 0.08},
    }
    rows = []
    for name, values in changed.items():
        model = carton(values, level=level)
        stiffness = model.parameters["crease.spring.stiffness"].value
        bent = elastica(FULL, stiffness, LEVER, model)
        rows.append((name, fold(model).end, bent, FULL * stiffness / LEVER))
    return Table(
        "What the assumptions do to a flexible panel, N at 90 degrees",
        ("changed", "vpm", "elastica", "rigid panel"),
        tuple(rows),
        "The force goes with the length of the crease, and with the inverse of the lever.",
    )


def _damages(rigid: Fold, folds: Mapping[float, Sequence[Fold] | None]) -> Table:
    rows = [("none", rigid.end, rigid.end, 0.0, 0.0)]
    for share, known in folds.items():
        damage = Damage(share, DAMAGE.scale)
        first, second = known or damaged(carton, fold, damage)
        lost = damage.lost(crease_stiffness(), FULL)
        rows.append(
            (f"{100.0 * share:.0f} %", first.end, second.at(0.5 * FULL), 1e3 * (first.work - second.work), 1e3 * lost)
        )
    rows[0] = ("none", rigid.end, rigid.at(0.5 * FULL), 0.0, 0.0)
    return Table(
        "What damage of the crease would do, rigid panel",
        ("damage", "N at 90, first fold", "N at 45, second fold", "lost mJ", "lost mJ, closed form"),
        tuple(rows),
        f"Torque K q (1 - D(q)), D = share (1 - exp(-q/{np.degrees(DAMAGE.scale):.0f} degrees)) on the first fold; "
        "what is damaged stays so, and later folds follow the straight line of what is left.",
    )


def _pictures(
    rigid: Fold, flexible: Fold, first: Fold, second: Fold, meshes: Mapping[int, float]
) -> tuple[Picture, ...]:
    """All pictures of the study."""
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
