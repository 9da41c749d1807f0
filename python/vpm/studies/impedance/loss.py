"""Which law a loss follows: viscous, structural or Coulomb, from loops at several amplitudes and frequencies.

Energy of a cycle: viscous ``E = c int (dx/dt)^2 dt`` ~ omega X^2, structural (rate-independent, complex stiffness
``k (1 + i eta)``) ``E = pi eta k sum n |X_n|^2`` ~ X^2, Coulomb ``E = F_c oint |dx|`` ~ X (C. de Silva, *Vibration
Damping, Control, and Design*, CRC Press 2007, chapter 1). Each law has one coefficient. A law is kept if the logarithms
of ``E / measure`` scatter no more than the tests themselves do.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vpm.errors import IdentificationError
from vpm.numbers import Array
from vpm.results import Result
from vpm.studies.impedance.hysteresis_loop import Loop

#: Laws with the unit of their coefficient.
LAWS: Mapping[str, str] = {"viscous": "N s/m", "structural": "N/m", "Coulomb": "N"}
#: Energies of repeated loops agree no better than this, relative: load cells, temperature.
FLOOR = 0.02
#: Probability of refusing a law that is right.
REFUSAL = 0.01


@dataclass(frozen=True, repr=False, eq=False)
class LossLaw(Result):
    """Law that the energy lost in cycles follows: viscous, structural, Coulomb or mixed.

    Attributes
    ----------
    law : str
        ``"viscous"``, ``"structural"``, ``"Coulomb"``, ``"mixed"`` where none fits alone, or ``"undecided"`` where
        the tests cannot tell.
    possible : tuple of str
        Laws that the tests allow.
    coefficients : dict
        Of each law, as if it were the only one: damping (N s/m), ``eta k`` (N/m), dry friction (N).
    misfit : dict
        Standard deviation of each law's relative error.
    shares : dict
        Of the lost energy, if all three act side by side (non-negative least squares).
    amplitude_exponent, frequency_exponent : float
        ``E ~ X^p omega^q``; NaN where amplitude or frequency was not varied.
    scatter : float
        Relative standard deviation of the tests about that power law, not below 2 %.
    """

    law: str
    possible: tuple[str, ...]
    coefficients: dict[str, float]
    misfit: dict[str, float]
    shares: dict[str, float]
    amplitude_exponent: float
    frequency_exponent: float
    scatter: float
    sentence: str

    def __str__(self) -> str:
        return self.sentence

    def _frame_columns(self) -> Mapping[str, object]:
        return {
            "law": list(LAWS),
            "coefficient": [self.coefficients[law] for law in LAWS],
            "unit": list(LAWS.values()),
            "misfit": [self.misfit[law] for law in LAWS],
            "share": [self.shares[law] for law in LAWS],
        }


def identify_loss_law(loops: Sequence[Loop]) -> LossLaw:
    """Name the law that the lost energy follows.

    Parameters
    ----------
    loops : sequence of Loop
        At amplitudes and frequencies that differ, better by a factor of two and more.

    Raises
    ------
    IdentificationError
        Fewer than three loops, or one that loses no energy.
    """
    if len(loops) < 3:
        raise IdentificationError(
            f"a law of the loss needs three loops at least, and there are {len(loops)}; test at more amplitudes and "
            "frequencies"
        )
    for loop in loops:
        if not loop.energy > 0.0:
            raise IdentificationError(
                f'the loop "{loop.name}" at {loop.frequency:.3g} Hz loses {loop.energy:.3g} J, which no law of loss '
                "has; check the sense of its force and the delay between its channels"
            )
    energy = np.array([loop.energy for loop in loops])
    measures = {
        "viscous": np.array([loop.viscous_measure for loop in loops]),
        "structural": np.array([loop.structural_measure for loop in loops]),
        "Coulomb": np.array([loop.path for loop in loops]),
    }
    exponents, scatter = _power_law(loops, energy)
    coefficients, misfit, possible = {}, {}, []
    for law, measure in measures.items():
        ratio = np.log(energy / measure)
        coefficients[law] = float(np.exp(ratio.mean()))
        misfit[law] = float(ratio.std(ddof=1))
        if misfit[law] ** 2 * (len(loops) - 1) <= scatter**2 * _largest_square(len(loops) - 1):
            possible.append(law)
    shares = _shares(energy, measures)
    law = possible[0] if len(possible) == 1 else ("undecided" if possible else "mixed")
    told = _sentence(law, possible, coefficients, shares, exponents)
    return LossLaw(law, tuple(possible), coefficients, misfit, shares, *exponents, scatter, told)


def _largest_square(free: int) -> float:
    """Sum of squares of `free` normal values that chance exceeds once in a hundred loss tests."""
    from scipy.special import chdtri

    return float(chdtri(free, REFUSAL))


def _power_law(loops: Sequence[Loop], energy: Array) -> tuple[tuple[float, float], float]:
    """Power law of the loss in amplitude and frequency: exponents, and the scatter about it."""
    columns = [np.log([loop.amplitude for loop in loops]), np.log([loop.frequency for loop in loops])]
    varied = [bool(np.ptp(column) > np.log(1.05)) for column in columns]
    used = [column for column, use in zip(columns, varied, strict=True) if use]
    matrix = np.column_stack([np.ones(energy.size), *used])
    independent = int(np.linalg.matrix_rank(matrix, tol=0.02 * np.sqrt(energy.size))) == matrix.shape[1]
    found = np.linalg.lstsq(matrix, np.log(energy), rcond=None)[0]
    left = np.log(energy) - matrix @ found
    free = energy.size - matrix.shape[1]
    # Within what is known of each loop, and of the agreement between loops.
    own = float(np.sqrt(np.mean([(loop.energy_std / loop.energy) ** 2 for loop in loops])))
    scatter = max(FLOOR, own, float(np.sqrt(left @ left / free)) if free > 0 else 0.0)
    values = iter(found[1:])
    exponents = [float(next(values)) if use else np.nan for use in varied]
    return ((exponents[0], exponents[1]) if independent else (np.nan, np.nan)), scatter


def _shares(energy: Array, measures: Mapping[str, Array]) -> dict[str, float]:
    """Share of each law in the energy loss of all tests, each weighted alike."""
    from scipy.optimize import nnls

    matrix = np.column_stack([measure / energy for measure in measures.values()])
    scale = np.linalg.norm(matrix, axis=0)
    found = nnls(matrix / scale, np.ones(energy.size))[0] / scale
    parts = (matrix * found).mean(axis=0)
    return dict(zip(measures, map(float, parts / parts.sum()), strict=True))


def _sentence(
    law: str,
    possible: Sequence[str],
    coefficients: Mapping[str, float],
    shares: Mapping[str, float],
    exponents: tuple[float, float],
) -> str:
    """Sentence on the law that the energy losses follow."""
    grown = [
        f"{name}^{value + 0.0:.2f}"
        for name, value in zip(("X", "omega"), np.round(exponents, 2), strict=True)
        if np.isfinite(value)
    ]
    power = f" (E ~ {' '.join(grown)})" if grown else ""
    if law in LAWS:
        name = {"viscous": "damping", "structural": "loss factor times stiffness", "Coulomb": "dry friction"}[law]
        return f"the loss is {law}{power}: {name} {coefficients[law]:.4g} {LAWS[law]}"
    if law == "mixed":
        parts = ", ".join(f"{100.0 * share:.0f} % {name}" for name, share in shares.items() if share > 0.005)
        return f"no single law fits the loss{power}; side by side: {parts}"
    missing = []
    if "Coulomb" in possible and len(possible) > 1:
        missing.append("amplitudes")
    if {"viscous", "structural"} <= set(possible):
        missing.append("frequencies")
    return (
        f"the tests cannot tell {' from '.join(possible)} loss; add {' and '.join(missing)} that differ more, a factor "
        "of two at least"
    )
