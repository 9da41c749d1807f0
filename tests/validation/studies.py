"""The studies: what is printed of carton and fingertip, and their solvers beside solutions without them."""

import numpy as np
from numpy.typing import ArrayLike

from study_solids import CURVED, curved_bar
from validation.row import Row, accepted, against, row
from vpm.studies.carton import FULL, LEVER, READINGS, carton, crease_stiffness, crease_torque, fold
from vpm.studies.crease import Damage, damaged, elastica
from vpm.studies.finger_body import block, hertz, layer_factor
from vpm.studies.fingertip import FINGER, averages, deviations
from vpm.studies.press import press

VALUES = accepted("studies")


def printed() -> list[Row]:
    """Values of the reference."""
    contact = carton().parameters
    found: dict[str, ArrayLike] = {
        "carton.contact.k_SI": contact["finger.stiffness"].value,
        "carton.contact.c_SI": contact["finger.damping"].value,
        "carton.crease_torque_90deg": [crease_torque(FULL, reading) for reading in READINGS],
        "finger.table_b3.average": averages(),
        "finger.table_b3.deviation": deviations(),
    }
    return [against(VALUES[name], value) for name, value in found.items()]


def solved() -> list[Row]:
    """Solvers beside closed forms and an ordinary differential equation."""
    flexible = fold(carton(level="elements(4)"))
    damage = Damage(0.2, np.radians(20.0))
    first, second = damaged(carton, fold, damage)
    stiffness = crease_stiffness()
    bent = elastica(FULL, stiffness, LEVER, carton())
    rows = [
        row("carton.flexible_panel", flexible.end, bent, "N", "elastica, solved by scipy", relative=1e-3),
        row(
            "carton.damage.loss",
            first.work - second.work,
            damage.lost(stiffness, FULL),
            "J",
            "closed form: torque over the angle",
            relative=2e-3,
        ),
    ]
    return [*rows, _layer(), _bar()]


def _layer() -> Row:
    """A ball on a bonded layer of constant volume: force over that of Hertz."""
    height, radius, share = 1e-2, 5e-2, 0.1
    way = (share * height) ** 2 / radius
    seen = press(block(height, 1.3 * share * height, FINGER.tissue, 2), [way], start=0.0, curvature=-1.0 / radius)
    ratio = seen[-1].force / float(hertz(way, radius, FINGER.tissue.young)[0])
    source = "Dimitriadis et al., Biophysical Journal 82, 2002"
    return row("finger.ball_on_layer", ratio, layer_factor(share), "1", source, relative=5e-3)


def _bar() -> Row:
    """Largest stress of a curved bar that is bent."""
    source = "Golovin: Timoshenko and Goodier, Theory of Elasticity, section 29"
    return row("knee.curved_bar", curved_bar(3)[0], CURVED, "Pa", source, relative=1e-2)
