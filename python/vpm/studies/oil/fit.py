"""Bulk modulus of the oil and gain of the valve, by linear least squares from a record of one cylinder."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import IdentificationError
from vpm.numbers import NORMAL_95, Array
from vpm.results import Result
from vpm.studies.oil.check import Channels, check_answer, check_choices, check_record
from vpm.studies.oil.equations import CylinderGeometry, Equation, balances, pressures_from_force, through_spool
from vpm.studies.oil.solve import integral_rows, noise_share, rate_rows, solve

_UNITS = {"compliance": "1/Pa", "flow_gain": "m^3/(s Pa^0.5)", "leakage": "m^3/(s Pa)", "air": "1", "offset": ""}
#: Absolute pressure (Pa) below which dissolved air comes out of oil or the oil boils.
BOILING = 5e4


@dataclass(frozen=True, repr=False, eq=False)
class OilFit(Result):
    """Compliance of the oil and valve gain that a record of one cylinder shows.

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
        """Standard deviations of the oil's parameters, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def intervals(self) -> Array:
        """95 % intervals of an oil fit, shape (p, 2)."""
        reach = NORMAL_95 * self.std
        return np.column_stack([self.values - reach, self.values + reach])

    @property
    def bulk_modulus(self) -> float:
        """Bulk modulus of the oil, Pa; negative where the record says so."""
        return 1.0 / self["compliance"]

    @property
    def bulk_modulus_interval(self) -> tuple[float, float]:
        """95 % interval of the oil's bulk modulus, Pa, from that of 1/beta; open upwards if that has zero."""
        low, high = self.intervals[0]
        if high <= 0.0:
            return (np.nan, np.nan)
        return (1.0 / high, 1.0 / low if low > 0.0 else np.inf)

    @property
    def flow_gain(self) -> float:
        """Flow gain K_v of one valve edge in an oil fit, m^3/(s sqrt(Pa)) by unit of the command."""
        return self["flow_gain"]

    @property
    def flow_gain_interval(self) -> tuple[float, float]:
        """95 % interval of an oil fit's `flow_gain`."""
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


def identify_oil(
    time: ArrayLike,
    geometry: CylinderGeometry,
    *,
    position: ArrayLike,
    command: ArrayLike,
    supply: ArrayLike,
    tank: ArrayLike,
    force: ArrayLike | None = None,
    pressure_a: ArrayLike | None = None,
    pressure_b: ArrayLike | None = None,
    rule: str = "steady",
    balance: str | None = None,
    estimator: str = "instrument",
    extra: Sequence[str] = (),
    spool: tuple[float, float] | None = None,
    held: bool = False,
    cutoff: float | None = None,
    window: float | None = None,
    weights: ArrayLike | None = None,
    weighted: bool = True,
    strict: bool = True,
) -> OilFit:
    """Find 1/beta and K_v from a record of one cylinder: ``A X = B``, D'Imperio (2016), 5.34 to 5.41, corrected.

    Parameters
    ----------
    time : array-like, shape (N,)
        Uniform, s.
    position : array-like, shape (N,)
        Of the piston from mid-stroke, positive where side a is large, m.
    command : array-like, shape (N,)
        Of the valve, or its spool where that is measured; positive lets oil into side a. Its unit is that of K_v.
    supply, tank : float or array-like, shape (N,)
        Absolute pressures, Pa.
    force : array-like, shape (N,), optional
        Of the oil on the piston, ``A pa - alpha A pb``, N. Not needed with both pressures.
    pressure_a, pressure_b : array-like, shape (N,), optional
        Absolute, Pa. One of them follows from the other and the force; without any, both follow from the force and
        `rule`.
    rule : {"steady", "symmetric"}
        See `pressures_from_force`; the second one is 5.41 as printed, wrong for a cylinder with one rod.
    balance : {"chambers", "force"}, optional
        Two balances, one for each chamber (where both pressures are known), or one of the force.
    estimator : {"instrument", "integral", "filtered", "differences"}
        ``"differences"``: derivatives by plain central differences. ``"filtered"``: all columns through one zero-phase
        filter. ``"integral"``: the balances integrated over time, so that nothing is differentiated. ``"instrument"``:
        the same, and the noisy column of 1/beta is replaced by what the command explains of it (two-stage least
        squares; T. Söderström and P. Stoica, *Instrumental Variable Methods for System Identification*, Springer
        1983), which takes away the rest of the bias.
    extra : sequence of {"leakage", "air", "offset"}
        Further columns: leakage between the chambers; entrained air at 101325 Pa, with kappa = 1.4 (balance of the
        chambers alone); an offset of the valve, times K_v.
    spool : tuple of float, optional
        Natural frequency (rad/s) and damping ratio of the spool, through which a command passes first.
    held : bool
        With `spool`: each command is held until the next sample, as by a digital controller that logs at its own rate.
    cutoff : float, optional
        Of the filter of ``"filtered"``, Hz; without it a tenth of the rate.
    window : float, optional
        Integral forms: length of pieces with initial contents of their own, s; the whole record by default.
    weights : array-like, shape (N,), optional
        Of the samples, not negative.
    weighted : bool
        Weight the balances by what noise of the place does to each, and both chambers by the covariance of their
        residuals (A. Zellner, *J. American Statistical Association* 57, 1962).
    strict : bool
        Refuse an answer that is negative or that cannot be told from zero; otherwise it comes with warnings.

    Raises
    ------
    IdentificationError
        A channel is missing, constant or physically impossible, the valve never opens, there are too few samples, or
        (`strict`) 1/beta or K_v is negative or within its interval of zero.
    """
    seen = (pressure_a is not None) + (pressure_b is not None) + (force is not None)
    both = seen >= 2
    balance = balance or ("chambers" if both else "force")
    check_choices(both, force is not None, balance, estimator, extra)
    given = {"position": position, "command": command, "supply": supply, "tank": tank}
    optional = {"force": force, "pressure_a": pressure_a, "pressure_b": pressure_b, "weights": weights}
    record = check_record(time, geometry, {**given, **{k: v for k, v in optional.items() if v is not None}})
    opening = record["command"] if spool is None else through_spool(record["command"], record.dt, spool, held=held)
    equations, origin = _equations(record, geometry, opening, rule if not both else None, balance)
    columns = ("compliance", "flow_gain", *extra)
    if estimator in {"integral", "instrument"}:
        pieces = _pieces(len(opening), record.dt, window)
        rows = integral_rows(equations, opening, columns, record.dt, pieces, instrument=estimator == "instrument")
    else:
        kept = 0.1 / record.dt if cutoff is None else cutoff
        rows = rate_rows(equations, opening, columns, record.dt, None if estimator == "differences" else kept)
    values, covariance, residual = solve(rows, record.get("weights"), weighted=weighted)
    share = noise_share(rows, equations, record.dt)
    notes = _notes(opening, rule, record)
    fit = OilFit(columns, values, covariance, estimator, origin, share, residual, len(opening), notes, ())
    warnings = check_answer(fit, rows, 1.0 / record.dt, ruled=not both, strict=strict)
    return replace(fit, warnings=warnings)


def _equations(
    record: Channels, geometry: CylinderGeometry, opening: Array, rule: str | None, balance: str
) -> tuple[tuple[Equation, ...], str]:
    """Balances of an oil fit, and where their pressures come from."""
    ports = record["supply"], record["tank"]
    if rule is None:
        pressures, origin = _measured(record, geometry)
    else:
        pressures = pressures_from_force(record["force"], opening, *ports, geometry, rule)
        origin = f"from the force, rule {rule}"
    force = record.get("force")
    if force is None:
        force = geometry.area * (pressures[0] - geometry.area_ratio * pressures[1])
    return balances(
        geometry, record["position"], opening, pressures, ports, None if balance == "chambers" else force
    ), origin


def _measured(record: Channels, geometry: CylinderGeometry) -> tuple[tuple[Array, Array], str]:
    """Both pressures of an oil fit, one of them from the other and the force if need be."""
    if "pressure_b" not in record:
        side_b = (record["pressure_a"] - record["force"] / geometry.area) / geometry.area_ratio
        return (record["pressure_a"], side_b), "side a measured, side b with the force"
    if "pressure_a" not in record:
        side_a = record["force"] / geometry.area + geometry.area_ratio * record["pressure_b"]
        return (side_a, record["pressure_b"]), "side b measured, side a with the force"
    return (record["pressure_a"], record["pressure_b"]), "measured"


def _pieces(count: int, dt: float, window: float | None) -> tuple[slice, ...]:
    """Contiguous pieces of an oil fit of nearly equal length, none shorter than twenty samples."""
    if window is None:
        return (slice(0, count),)
    if not window >= 20.0 * dt:
        raise IdentificationError(
            f"a window of {window:g} s holds fewer than 20 samples of {dt:g} s; take at least {20.0 * dt:g} s"
        )
    number = max(1, round(count * dt / window))
    edges = np.linspace(0, count, number + 1).astype(int)
    return tuple(slice(int(a), int(b)) for a, b in pairwise(edges))


def _notes(opening: Array, rule: str, record: Channels) -> tuple[str, ...]:
    notes = []
    outward = float(np.mean(opening > 0.0))
    if not 0.05 < outward < 0.95:
        side = "outwards" if outward > 0.5 else "inwards"
        notes.append(
            f"The valve is open {side} in {100.0 * max(outward, 1.0 - outward):.0f} % of the samples: one edge of "
            "each side is seen."
        )
    for name in ("pressure_a", "pressure_b"):
        low = record.get(name, np.ones(1) * np.inf).min()
        if low < BOILING:
            notes.append(
                f"{name} falls to {low:.3g} Pa: where oil boils or air comes out, no balance holds; leave those "
                "pieces out."
            )
    ruled = sum(name in record for name in ("force", "pressure_a", "pressure_b")) < 2
    if ruled and rule == "symmetric":
        notes.append("The pressures are those of pa + pb = ps + pt, which an unequal cylinder does not keep.")
    return tuple(notes)
