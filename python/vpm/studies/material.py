"""Strain energies of soft materials in bodies of revolution.

The gradient of the deformation of a body that stays one of revolution is ``[[a, b, 0], [c, d, 0], [0, 0, e]]``, so an
energy is a function of five numbers, and its invariants are polynomials of them. With ``s = a^2 + b^2 + c^2 + d^2``
and ``k = a d - b c``: ``I1 = s + e^2``, ``I2 = e^2 s + k^2`` (sum of the squared cofactors), ``J = k e``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vpm.errors import VpmError
from vpm.numbers import Array
from vpm.studies.jet import Jet, variables


@dataclass(frozen=True)
class Material:
    """``W = sum C_ij (I1 - 3)^i (I2 - 3)^j + K/2 (J - 1)^2`` with the invariants at constant volume (thesis, B.1).

    The invariants are those of ``F J^(-1/3)``, so that K alone answers to pressure.
    """

    constants: Mapping[tuple[int, int], float] = field(default_factory=dict)  #: C_ij in Pa, by (i, j).
    bulk: float = np.inf  #: K in Pa; infinite for a material that keeps its volume.

    def __post_init__(self) -> None:
        if not self.shear > 0.0:
            raise VpmError(f"a material has the shear modulus {self.shear:.4g} Pa; 2 (C10 + C01) has to be above zero")

    @classmethod
    def linear(cls, young: float, poisson: float) -> Material:
        """Neo-Hookean material that is the linear one at small strain."""
        return cls({(1, 0): young / (4.0 * (1.0 + poisson))}, young / (3.0 * (1.0 - 2.0 * poisson)))

    @property
    def shear(self) -> float:
        """Shear modulus of a material at small strain, Pa."""
        return 2.0 * (self.constants.get((1, 0), 0.0) + self.constants.get((0, 1), 0.0))

    @property
    def compliance(self) -> float:
        """Compressibility of a material, ``1/K``, 1/Pa."""
        return 0.0 if np.isinf(self.bulk) else 1.0 / self.bulk

    @property
    def young(self) -> float:
        """Young's modulus of a material at small strain, Pa."""
        return 9.0 / (3.0 / self.shear + self.compliance)

    def scaled(self, factor: float) -> Material:
        """Material with all constants times a factor."""
        return Material({key: factor * value for key, value in self.constants.items()}, factor * self.bulk)

    def isochoric(self, strain: Array) -> Jet:
        """Energy of shape of a material, with derivatives.

        ``strain``: shape (5, ...), a, b, c, d and e of the gradient.
        """
        first, second, volume = invariants(strain)
        x = first * volume.power(-2.0 / 3.0) - 3.0
        y = second * volume.power(-4.0 / 3.0) - 3.0
        total = volume * 0.0
        for (i, j), constant in self.constants.items():
            total += x.power(i) * y.power(j) * constant
        return total


def invariants(strain: Array) -> tuple[Jet, Jet, Jet]:
    """Invariants ``I1``, ``I2`` and ``J`` of gradients for a material, with derivatives."""
    a, b, c, d, e = variables(strain)
    s, k, hoop = a * a + b * b + c * c + d * d, a * d - b * c, e * e
    return s + hoop, hoop * s + k * k, k * e
