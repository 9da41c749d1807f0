"""The planar two-link flexible arm with its converged motions, and how near a result comes.

The motions were computed with eight curvature coordinates per link and Richardson extrapolation of 0.1 and 0.05 ms.
"""

import json
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import vpm
from places import ROOT

Array = NDArray[np.float64]

DATA = ROOT / "crates" / "vpm-core" / "tests" / "data" / "flexible_arm.json"
REFERENCE = json.loads(DATA.read_text(encoding="utf-8"))
P = REFERENCE["params"]
DURATION = float(P["T_end"])


def samples(motion: str) -> Array:
    """Rows (t, tip x, tip y, strain of link 1, of link 2) at 10 Hz, from 0.1 s on."""
    return np.array(REFERENCE["cases"][motion]["samples_10Hz"])


@dataclass(frozen=True)
class Swing:
    """Where both joints should be: from zero to the amplitude (rad) and back in a period (s)."""

    amplitude: float
    period: float

    def angle(self, time: Array) -> Array:
        """Wanted angle, rad."""
        return 0.5 * self.amplitude * (1.0 - np.cos(2.0 * np.pi * time / self.period))

    def rate(self, time: Array) -> Array:
        """Wanted rate, rad/s."""
        return np.pi * self.amplitude / self.period * np.sin(2.0 * np.pi * time / self.period)


def swing(motion: str) -> Swing:
    """Where both joints should be."""
    case = REFERENCE["cases"][motion]
    return Swing(case["amp"], case["T"])


def log(motion: str, step: float) -> vpm.Experiment:
    """What the servos are told in a motion, every ``step`` (s): what they push for the wanted angle and rate."""
    time: Array = step * np.arange(round(DURATION / step) + 1, dtype=np.float64)
    wanted = swing(motion)
    commands = {
        f"motor_{joint}.command": P[f"kp{joint}"] * wanted.angle(time) + P[f"kd{joint}"] * wanted.rate(time)
        for joint in (1, 2)
    }
    return vpm.Experiment.from_arrays(time, commands, units=dict.fromkeys(commands, "N m"), name=motion)


def tip_and_strains(run: vpm.Run) -> tuple[Array, Array]:
    """Of a run of the arm, at 10 Hz from 0.1 s on."""
    every = round(0.1 / (run.time[1] - run.time[0]))
    pairs = (("tip.x", "tip.z"), ("gauge_1.strain", "gauge_2.strain"))
    tip, strains = (np.column_stack([run[name][every::every] for name in names]) for names in pairs)
    return tip, strains


def errors(motion: str, tip: Array, strains: Array) -> tuple[float, Array]:
    """RMS distance of the tip (m), and RMS errors of both strains relative to their RMS, from 0.1 s on."""
    wanted = samples(motion)[: len(tip)]
    distance = np.sqrt(((tip - wanted[:, 1:3]) ** 2).sum(axis=1).mean())
    off, size = strains - wanted[:, 3:], wanted[:, 3:]
    return float(distance), np.sqrt((off**2).sum(axis=0) / (size**2).sum(axis=0))
