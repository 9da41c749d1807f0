"""The planar two-link flexible arm with its converged motions, and how near a result comes.

The motions were computed with eight curvature coordinates per link and Richardson extrapolation of 0.1 and 0.05 ms.
"""

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vpm.planar import FlexibleLink, Gauge, PlanarArm, Swing

Array = NDArray[np.float64]

DATA = Path(__file__).resolve().parent.parent / "crates" / "vpm-core" / "tests" / "data" / "flexible_arm.json"
REFERENCE = json.loads(DATA.read_text(encoding="utf-8"))
P = REFERENCE["params"]
MOTIONS = ("slow", "fast")
DURATION = float(P["T_end"])


def samples(motion: str) -> Array:
    """Rows (t, tip x, tip y, strain of link 1, of link 2) at 10 Hz, from 0.1 s on."""
    return np.array(REFERENCE["cases"][motion]["samples_10Hz"])


def swing(motion: str) -> Swing:
    """Where both joints should be."""
    case = REFERENCE["cases"][motion]
    return Swing(case["amp"], case["T"])


def planar_arm(motion: str, coefficients: int, points: int, order: int = 2) -> PlanarArm:
    """The arm with so many curvature coefficients per link, in steps of that order."""
    strip = {"young": P["E"], "density": P["rho"], "damping": P["beta"]}
    first = FlexibleLink.strip(
        P["l1"], P["b"], P["h"], **strip, hub_inertia=P["Jh1"], tip_mass=P["me"], tip_inertia=P["Je"]
    )
    second = FlexibleLink.strip(P["l2"], P["b"], P["h"], **strip, hub_inertia=P["Jh2"], tip_mass=P["mt"])
    gauges = [Gauge(link, P["gauge"], P["h"] / 2) for link in (0, 1)]
    gains = [(P["kp1"], P["kd1"]), (P["kp2"], P["kd2"])]
    return PlanarArm(
        [first, second],
        gains,
        swing(motion),
        gauges,
        gravity=(0.0, -P["g"]),
        coefficients=coefficients,
        points=points,
        order=order,
    )


def errors(motion: str, tip: Array, strains: Array) -> tuple[float, Array]:
    """RMS distance of the tip (m), and RMS errors of both strains relative to their RMS, from 0.1 s on."""
    wanted = samples(motion)[: len(tip)]
    distance = np.sqrt(((tip - wanted[:, 1:3]) ** 2).sum(axis=1).mean())
    off, size = strains - wanted[:, 3:], wanted[:, 3:]
    return float(distance), np.sqrt((off**2).sum(axis=0) / (size**2).sum(axis=0))
