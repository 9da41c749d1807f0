"""What `identify_oil` answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.identify.statistics import NORMAL_95
from vpm.results import Result

Array = NDArray[np.float64]

_UNITS = {"compliance": "1/Pa", "flow_gain": "m^3/(s Pa^0.5)", "leakage": "m^3/(s Pa)", "air": "1", "offset": ""}


@dataclass(frozen=True, repr=False, eq=False)
class OilFit(Result):
    """What a record says about oil and valve.

    Attributes
    ----------
    names : tuple of str
        ``"compliance"`` (1/beta, 1/Pa), ``"flow_gain"`` (K_v, m^3/(s sqrt(Pa)) by unit of the command), and the extra
        columns.
    values : ndarray, shape (p,)
    covariance : ndarray, shape (p, p)
        With the correlation of neighbouring residuals in it.
    estimator, pressures : str
        How it was found, and where the pressures came from.
    noise_share : float
        Share of the power of the column of 1/beta that is noise of the sensors: so much of 1/beta plain least squares
        loses.
    residual : ndarray, shape (N, e)
        One column for each balance: m of the piston's place, or m/s.
    samples : int
    notes, warnings : tuple of str
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    estimator: str
    pressures: str
    noise_share: float
    residual: Array
    samples: int
    notes: tuple[str, ...]
    warnings: tuple[str, ...]

    def __getitem__(self, name: str) -> float:
        return float(self.values[self.names.index(name)])

    @property
    def std(self) -> Array:
        """Standard deviations, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def intervals(self) -> Array:
        """95 % intervals, shape (p, 2)."""
        reach = NORMAL_95 * self.std
        return np.column_stack([self.values - reach, self.values + reach])

    @property
    def bulk_modulus(self) -> float:
        """Of the oil, Pa; negative where the record says so."""
        return 1.0 / self["compliance"]

    @property
    def bulk_modulus_interval(self) -> tuple[float, float]:
        """95 % interval, Pa: the ends of that of 1/beta, upside down; open upwards where that reaches zero."""
        low, high = self.intervals[0]
        if high <= 0.0:
            return (np.nan, np.nan)
        return (1.0 / high, 1.0 / low if low > 0.0 else np.inf)

    @property
    def flow_gain(self) -> float:
        """K_v of one edge, m^3/(s sqrt(Pa)) by unit of the command."""
        return self["flow_gain"]

    @property
    def flow_gain_interval(self) -> tuple[float, float]:
        """95 % interval of `flow_gain`."""
        low, high = self.intervals[1]
        return (float(low), float(high))

    def _headline(self) -> Mapping[str, object]:
        return {
            "bulk_modulus": self.bulk_modulus,
            "bulk_modulus_interval": self.bulk_modulus_interval,
            "flow_gain": self.flow_gain,
            "flow_gain_interval": self.flow_gain_interval,
            "estimator": self.estimator,
            "pressures": self.pressures,
        }

    def _frame_columns(self) -> Mapping[str, object]:
        low, high = self.intervals.T
        units = [_UNITS[name] for name in self.names]
        return {"name": self.names, "value": self.values, "std": self.std, "low": low, "high": high, "unit": units}
