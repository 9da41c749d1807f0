"""Table 3.2 of the thesis: how near a physically consistent arm comes to the published strains.

python examples/tudor/table.py

The arm is the model file as it is. Sought are the mean and the amplitude of slow swings of joints 2 and 3 with the
printed period of 12 s, and one factor common to both gauges, which no physics of the arm gives: it stands for whatever
scale the published strains were written in. The same search is made without the factor, and with joint 3 held in line.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simulate import simulate

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
PERIOD = 12.0
SAMPLE = 0.05
#: Amplitude and mean at the first gauge, amplitude and mean at the second, as printed.
MEASURED = np.array([3.70e-4, 1.47e-3, 1.28e-5, 6.67e-5])
SIMULATED = np.array([4.10e-4, 1.43e-3, 1.08e-5, 6.39e-5])
#: A swing: mean and amplitude of joint 2, mean and amplitude of joint 3 (rad); joint 3 may bend to either side.
LOW, HIGH = np.array([-1.2, 0.05, -1.2, -0.9]), np.array([1.2, 1.2, 1.2, 0.9])
#: Where the search begins: up from the horizontal with the second link in line, and with it bent.
STARTS = ((0.45, 0.45, 0.0, 0.0), (0.45, 0.45, 0.5, 0.1), (0.0, 0.6, 0.6, -0.2))


@dataclass(frozen=True)
class Closest:
    """The swing that comes closest.

    Attributes
    ----------
    swing : ndarray, shape (4,)
        Mean and amplitude of joint 2, mean and amplitude of joint 3, rad.
    factor : float
        Of both gauges.
    strains : ndarray, shape (4,)
        In the order of the table, factor included.
    """

    swing: Array
    factor: float
    strains: Array

    @property
    def deviations(self) -> Array:
        """From the measured strains, %."""
        return 100.0 * (self.strains / MEASURED - 1.0)


def strains_of(model: Model, swing: Array) -> Array:
    """Amplitude and mean of both gauges over the second of two periods, the joints following the swing."""
    time = np.arange(round(2.2 * PERIOD / SAMPLE)) * SAMPLE
    wave = -np.cos(2.0 * np.pi * time / PERIOD)
    zero = np.zeros(time.size)
    joints = {
        "joint_1.position": zero,
        "joint_2.position": swing[0] + swing[1] * wave,
        "joint_3.position": swing[2] + swing[3] * wave,
    }
    experiment = Experiment.from_arrays(time, joints, model=model, name="swing")
    run = simulate(model, experiment, "prescribed_motion", cutoff=2.0)
    late = (run.time >= 0.9 * PERIOD) & (run.time < 1.9 * PERIOD)
    numbers = []
    for gauge in ("gauge_1", "gauge_2"):
        strain = run[f"{gauge}.strain"][late]
        numbers += [0.5 * np.ptp(strain), 0.5 * (strain.max() + strain.min())]
    return np.array(numbers)


def best_factor(strains: Array) -> float:
    """The factor of least squares of the relative deviations."""
    ratio = strains / MEASURED
    return float(ratio.sum() / (ratio @ ratio))


def closest(model: Model, *, with_factor: bool, in_line: bool = False) -> Closest:
    """The swing, and the factor if one is allowed, with the least sum of squared relative deviations."""
    free = slice(0, 2 if in_line else 4)

    def whole(swing: Array) -> Array:
        return np.append(swing, np.zeros(4 - swing.size))

    def scaled(swing: Array) -> Array:
        strains = strains_of(model, whole(swing))
        return strains * (best_factor(strains) if with_factor else 1.0)

    def deviation(swing: Array) -> Array:
        return scaled(swing) / MEASURED - 1.0

    fits = [
        least_squares(
            deviation, start[free], bounds=(LOW[free], HIGH[free]), diff_step=1e-4, max_nfev=25, xtol=1e-4, ftol=1e-6
        )
        for start in STARTS
    ]
    swing = min(fits, key=lambda fit: float(fit.cost)).x
    swing = whole(swing)
    strains = strains_of(model, swing)
    factor = best_factor(strains) if with_factor else 1.0
    return Closest(swing, factor, factor * strains)


def main(model: Model) -> None:
    """Print the table."""
    print("Strain of both gauges, in 1e-6: amplitude 1, mean 1, amplitude 2, mean 2")
    print(row("published, measured", MEASURED))
    print(row("published, simulated", SIMULATED), deviations(100.0 * (SIMULATED / MEASURED - 1.0)))
    searches = (("this arm", False, False), ("in line, gauges scaled", True, True), ("gauges scaled", True, False))
    for words, with_factor, in_line in searches:
        found = closest(model, with_factor=with_factor, in_line=in_line)
        print(row(words, found.strains), deviations(found.deviations))
        second, third = found.swing[:2], found.swing[2:]
        print(f"    factor of both gauges {found.factor:.2f}, period {PERIOD:g} s")
        print(f"    q2 = {second[0]:.3f} {-second[1]:+.3f} cos, q3 = {third[0]:.3f} {-third[1]:+.3f} cos (rad)")


def row(words: str, strains: Array) -> str:
    """One line of the table."""
    return f"{words:26s}" + "".join(f"{1e6 * strain:10.1f}" for strain in strains)


def deviations(numbers: Array) -> str:
    """Deviations in %, in brackets."""
    return "(" + ", ".join(f"{number:+.1f} %" for number in numbers) + ")"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=Path, nargs="?", default=HERE / "tudor.toml", help="the model file of the arm")
    main(Model.load(parser.parse_args().model))
