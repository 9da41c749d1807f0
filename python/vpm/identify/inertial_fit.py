"""What an identification of inertial parameters answers with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import IdentificationError, check_known
from vpm.numbers import Array
from vpm.results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.experiment import Experiment
    from vpm.identify.problem import Gaps
    from vpm.model import Model


#: What data can say about a parameter.
KNOWN, VAGUE, TOGETHER, UNSEEN = "yes", "too uncertain", "only in combination", "no"


@dataclass(frozen=True, repr=False, eq=False)
class InertialFit(Result):
    """Inertial parameters from efforts, with what the data can know of them.

    Attributes
    ----------
    names, units : tuple of str
        Of the p parameters, SI.
    nominal : ndarray, shape (p,)
        CAD values; NaN where none were given.
    values : ndarray, shape (p,)
        Estimates. What the data leave open is as near to the CAD values as the rest allows.
    std : ndarray, shape (p,)
        Standard deviations; infinite where the data alone leave a parameter open and no prior says anything.
    identifiable : tuple of str
        For each: ``yes``; ``too uncertain``: determined, but its 95 % interval is wider than asked; ``only in
        combination`` with others; ``no``: without effect.
    base_names, base_words : tuple of str
        Base parameters: the parameter that each is called after, and the sum that it is.
    base_map : ndarray, shape (rank, p)
        From parameters to those sums.
    base_nominal, base_values, base_std : ndarray, shape (rank,)
        Of those sums; the deviation holds whatever the single parameters are.
    singular_values : ndarray
        Of the regressor with columns of equal length, relative to the largest, unseen columns left out.
    condition : float
        Of its independent directions.
    directions : int
        Independent combinations of relative changes that the data alone know as well as a parameter has to be known.
    samples, channels : int and tuple of str
        Instants, and the efforts at each.
    noise : ndarray, shape (n,)
        Standard deviation of each channel's residual.
    effective : float
        Equations with independent noise that would say as much.
    quantile : float
        Half a 95 % interval over the standard deviation: Student's t for that number.
    residual : float
        Root mean square of the residual over the noise of the fit without constraints: 1 if constraints cost nothing.
    faults : dict of str to str
        For each body, and parameter that cannot be negative, what is impossible in `values`; empty text if nothing is.
    method : str
        How it was solved.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    nominal: Array
    values: Array
    std: Array
    identifiable: tuple[str, ...]
    base_names: tuple[str, ...]
    base_words: tuple[str, ...]
    base_map: Array
    base_nominal: Array
    base_values: Array
    base_std: Array
    singular_values: Array
    condition: float
    directions: int
    samples: int
    channels: tuple[str, ...]
    noise: Array
    effective: float
    quantile: float
    residual: float
    faults: dict[str, str]
    method: str

    @property
    def rank(self) -> int:
        """Number of base parameters in an inertial fit."""
        return len(self.base_names)

    @property
    def feasible(self) -> bool:
        """Whether some body can have the estimates of an inertial fit."""
        return not any(self.faults.values())

    @property
    def intervals(self) -> Array:
        """95 % intervals of an inertial fit's parameters, shape (p, 2)."""
        half = self.quantile * self.std
        return np.stack([self.values - half, self.values + half], axis=1)

    @property
    def base_intervals(self) -> Array:
        """95 % intervals of an inertial fit's base parameters, shape (rank, 2)."""
        half = self.quantile * self.base_std
        return np.stack([self.base_values - half, self.base_values + half], axis=1)

    @property
    def difference(self) -> Array:
        """Inertial estimate over CAD value, less one, shape (p,); NaN without a CAD value or where it is zero."""
        return self.values / np.where(self.nominal == 0.0, np.nan, self.nominal) - 1.0

    def combine(self, values: ArrayLike) -> Array:
        """Base parameters (rank,) of an inertial fit from parameters (p,) of a known machine."""
        return np.asarray(self.base_map @ np.asarray(values, dtype=np.float64))

    def __getitem__(self, name: str) -> float:
        check_known([name], self.names, IdentificationError, "there is no parameter")
        return float(self.values[self.names.index(name)])

    def repaired(self, model: Model) -> Model:
        """Model with the estimates of an inertial fit, for simulation and diagnosis.

        What the data leave open stands as near to the CAD values as the rest allows: sums are right, not each number.

        Raises
        ------
        IdentificationError
            The estimates are of another machine, or of no body: fit with ``physical=True``.
        """
        from vpm.identify.inertial_model import repaired

        return repaired(model, dict(zip(self.names, map(float, self.values), strict=True)))

    def judged_on(
        self, model: Model, experiments: Experiment | Sequence[Experiment], *, cutoff: float | None = None
    ) -> tuple[Gaps, Gaps]:
        """Effort errors on other records of a model, and of the same model with the inertial fit.

        Returns
        -------
        before, after : dict
            ``{channel: (root mean square, share of the applied effort, unit)}``.

        Raises
        ------
        IdentificationError
            As for `repaired`.
        """
        from vpm.experiment import as_records
        from vpm.identify.inverse_dynamics import InverseDynamicsProblem
        from vpm.identify.problem import gaps

        data = InverseDynamicsProblem(model, as_records(experiments), cutoff=cutoff)
        machines = (model, self.repaired(model))
        before, after = (gaps(data, data.evaluate(machine, machine.theta)[0]) for machine in machines)
        return before, after

    @property
    def summary(self) -> tuple[str, ...]:
        """Sentences on an inertial fit: rank, condition, noise and feasibility."""
        known = sum(word == KNOWN for word in self.identifiable)
        shares = ", ".join(f"{channel} {noise:.3g}" for channel, noise in zip(self.channels, self.noise, strict=True))
        impossible = [f"{name}: {text}" for name, text in self.faults.items() if text]
        return (
            f"{self.method}; {self.samples} samples of {len(self.channels)} channels, worth {self.effective:.0f} "
            "independent equations",
            f"rank {self.rank} of {len(self.names)}, condition number {self.condition:.3g}; {known} single parameters "
            f"and {self.directions} of their combinations are known",
            f"residual: {shares}",
            "physically feasible" if not impossible else "not feasible, " + "; ".join(impossible),
        )

    def table(self, *, all_parameters: bool = False) -> str:
        """Table of an inertial fit: CAD value, estimate, deviation, difference, as D'Imperio (2016), Table 5.1.

        Parameters
        ----------
        all_parameters : bool
            Also those without any effect.
        """
        width = max(len(name) for name in self.names)
        head = f"{'parameter':{width}s} {'CAD':>11s} {'identified':>11s} {'std':>9s} {'difference':>11s}  identifiable"
        rows = []
        for k, name in enumerate(self.names):
            if self.identifiable[k] == UNSEEN and not all_parameters:
                continue
            spread = f"{self.std[k]:9.2g}" if np.isfinite(self.std[k]) else f"{'open':>9s}"
            cad = f"{self.nominal[k]:11.4g}" if np.isfinite(self.nominal[k]) else f"{'-':>11s}"
            apart = f"{100.0 * self.difference[k]:+9.1f} %" if np.isfinite(self.difference[k]) else f"{'-':>11s}"
            rows.append(f"{name:{width}s} {cad} {self.values[k]:11.4g} {spread} {apart}  {self.identifiable[k]}")
        left = sum(word == UNSEEN for word in self.identifiable)
        if left and not all_parameters:
            rows.append(f"and {left} parameters without any effect")
        return "\n".join([head, *rows])

    def base_table(self) -> str:
        """Table of an inertial fit's base parameters: CAD value, estimate, deviation, and meaning."""
        head = f"{'CAD':>11s} {'identified':>11s} {'std':>9s} {'std/value':>10s}  base parameter"
        rows = [
            f"{cad:11.4g} {value:11.4g} {std:9.2g} {100.0 * std / abs(value) if value else np.inf:8.1f} %  {words}"
            for cad, value, std, words in zip(
                self.base_nominal, self.base_values, self.base_std, self.base_words, strict=True
            )
        ]
        return "\n".join([head, *rows])

    def __str__(self) -> str:
        """Text of an inertial fit: summary, and both tables."""
        return "\n".join([*self.summary, "", self.table(), "", self.base_table()])

    def _headline(self) -> Mapping[str, object]:
        return {
            "parameters": len(self.names),
            "rank": self.rank,
            "known": sum(word == KNOWN for word in self.identifiable),
            "condition": self.condition,
            "feasible": self.feasible,
            "method": self.method,
        }

    def _frame_columns(self) -> Mapping[str, object]:
        low, high = self.intervals.T
        return {
            "parameter": self.names,
            "unit": self.units,
            "cad": self.nominal,
            "identified": self.values,
            "std": self.std,
            "low": low,
            "high": high,
            "difference": self.difference,
            "identifiable": self.identifiable,
        }

    def plot(self) -> Figure:
        """Plot of an inertial fit: estimates with intervals over the CAD values, base parameters below."""
        from vpm.plot.inertial import plot_inertial

        return plot_inertial(self)
