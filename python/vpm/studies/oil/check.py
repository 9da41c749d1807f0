"""What a record of a cylinder has to be before oil and valve are sought in it, and what is said of an answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import IdentificationError, check_known, near_match
from vpm.numbers import NORMAL_95, Array
from vpm.studies.oil.equations import CylinderGeometry
from vpm.studies.oil.solve import Rows, unexplained

if TYPE_CHECKING:
    from vpm.studies.oil.fit import OilFit


ESTIMATORS = ("instrument", "integral", "filtered", "differences")
BALANCES = ("chambers", "force")
EXTRA = ("leakage", "air", "offset")

#: Fewest samples of a record: a filter settles, and the correlation of residuals has to be seen.
FEWEST = 60
#: A supply below this (Pa) moves no machine, and one above bursts it: 0.5 bar and 5000 bar.
SUPPLIES = (5e4, 5e8)
#: From this share of noise in the column of 1/beta on, plain least squares deserves a warning.
NOISY = 0.05
#: A residual this many times its white noise, and this share of the oil's compression, has a cause of its own.
LEFT_OVER = (2.0, 0.2)


class Channels(dict[str, Array]):
    """Checked columns of a record, of one length, and the time between samples `dt` (s)."""

    dt: float


def check_choices(both: bool, force: bool, balance: str, estimator: str, extra: Sequence[str]) -> None:
    """Check choices for the oil: unknown words, and balances without channels."""
    for word, known, what in ((balance, BALANCES, "balance"), (estimator, ESTIMATORS, "estimator")):
        if word not in known:
            raise IdentificationError(f'the {what} "{word}" is unknown; {near_match(word, known)}')
    check_known(extra, EXTRA, IdentificationError, "the extra column", "is unknown")
    if len(set(extra)) < len(extra):
        raise IdentificationError(f"an extra column is named twice in {', '.join(extra)}; name each once")
    if not both and not force:
        raise IdentificationError("a force or both pressures are needed; give force, or pressure_a and pressure_b")
    if balance == "chambers" and not both:
        raise IdentificationError(
            'the balance of the chambers needs two of pressure_a, pressure_b and force; give them, or balance="force"'
        )
    if "air" in extra and balance == "force":
        raise IdentificationError(
            "entrained air cannot be told from the force, whose two sides hold air of two pressures; log both "
            "pressures, and "
            'take balance="chambers"'
        )


def check_record(time: ArrayLike, geometry: CylinderGeometry, channels: Mapping[str, ArrayLike]) -> Channels:
    """Check an oil record's columns: one length, or one sentence about the first that cannot be right.

    - ``time``: shape (N,), s
    - ``channels``: numbers stand for constant channels; SI
    """
    instants = np.asarray(time, dtype=np.float64).ravel()
    if instants.size < FEWEST:
        raise IdentificationError(
            f"the record has {instants.size} samples, and at least {FEWEST} are needed; record longer or faster"
        )
    record = Channels()
    for name, values in {"time": instants, **channels}.items():
        column = np.asarray(values, dtype=np.float64)
        if column.ndim and column.shape != instants.shape:
            raise IdentificationError(
                f"{name} has the shape {column.shape}, but time has {instants.size} samples; give one value for each"
            )
        column = np.broadcast_to(column, instants.shape)
        bad = np.flatnonzero(~np.isfinite(column))
        if bad.size:
            raise IdentificationError(
                f"{name} is no finite number in {bad.size} of {column.size} samples, first in sample {bad[0]} at "
                f"{instants[bad[0]]:g} s; mend or cut the record there"
            )
        record[name] = column
    steps = np.diff(instants)
    record.dt = float(np.median(steps))
    if not record.dt > 0.0 or np.abs(steps - record.dt).max() > 1e-3 * record.dt:
        worst = int(np.argmax(np.abs(steps - record.dt)))
        raise IdentificationError(
            f"time is not uniform: {steps[worst]:g} s after {instants[worst]:g} s, where the median is "
            f"{record.dt:g} s; resample the record"
        )
    _check_motion(record)
    _check_units(record, geometry)
    return record


def _check_motion(record: Channels) -> None:
    command = record["command"]
    if not np.any(command):
        raise IdentificationError(
            "the valve never opens: the command is zero in all samples; move the cylinder by its valve"
        )
    for name in ("command", "position", "force", "pressure_a", "pressure_b"):
        if name in record and np.ptp(record[name]) == 0.0:
            raise IdentificationError(
                f"{name} is {record[name][0]:g} in all samples, and a constant channel tells nothing; check its "
                "sensor and its column"
            )
    if "weights" in record and (np.any(record["weights"] < 0.0) or not np.any(record["weights"])):
        raise IdentificationError("weights have to be zero or larger, and some of them larger; check them")


def _check_units(record: Channels, geometry: CylinderGeometry) -> None:
    """Check units of an oil record: numbers that no cylinder has in SI are MPa, bar or mm."""
    supply, tank = record["supply"], record["tank"]
    if not (supply.max() >= SUPPLIES[0] and supply.max() <= SUPPLIES[1]):
        raise IdentificationError(
            f"the supply reaches {supply.max():g} Pa, which drives no cylinder; pressures are absolute and in Pa, "
            "16 MPa are 16e6"
        )
    if np.any(supply <= tank):
        k = int(np.argmax(supply <= tank))
        raise IdentificationError(
            f"the supply ({supply[k]:g} Pa) is not above the tank ({tank[k]:g} Pa) at {record['time'][k]:g} s; "
            "check their units and order"
        )
    ceiling = float(supply.max()) / geometry.area_ratio * 3.0
    for name in ("pressure_a", "pressure_b"):
        if name in record:
            values = record[name]
            if values.max() < 1e-3 * supply.max() or values.max() > ceiling:
                raise IdentificationError(
                    f"{name} reaches {values.max():g} Pa beside a supply of {supply.max():g} Pa; give both in Pa, "
                    "not in MPa or bar"
                )
            if values.min() < -0.02 * supply.max():
                raise IdentificationError(
                    f"{name} falls to {values.min():g} Pa, and an absolute pressure is never negative; check its "
                    "offset and its sign"
                )
    largest = geometry.area * ceiling
    if "force" in record and np.abs(record["force"]).max() > largest:
        raise IdentificationError(
            f"the force reaches {np.abs(record['force']).max():g} N, but {largest:g} N is more than a supply of "
            f"{supply.max():g} Pa does on {geometry.area:g} m^2; check the units of force, supply and area"
        )
    for side, volume in zip("ab", geometry.volumes(record["position"]), strict=True):
        if np.any(volume <= 0.0):
            k = int(np.argmin(volume))
            raise IdentificationError(
                f"side {side} would hold {volume[k]:g} m^3 with the piston at {record['position'][k]:g} m; the "
                "position counts in m "
                f"from mid-stroke, of a stroke of {geometry.stroke:g} m"
            )


def check_answer(fit: OilFit, rows: Rows, rate: float, *, ruled: bool, strict: bool) -> tuple[str, ...]:
    """Check the estimated oil: sentences about an untrustworthy answer; an error if `strict`."""
    found, names, values, share = [], fit.names, fit.values, fit.noise_share
    reach = NORMAL_95 * fit.std
    why = _reason(share, rate, ruled=ruled, integral=rows.constants.shape[1] > 0)
    if np.linalg.matrix_rank(_gram(rows), tol=1e-10) < len(names):
        found.append(
            f"the columns of {', '.join(names)} depend on each other in this record; leave out an extra one, or move "
            "differently"
        )
    if values[0] <= 0.0:
        found.append(f"beta comes out negative ({1.0 / values[0]:.3g} Pa): {why}")
    elif values[0] < reach[0]:
        found.append(f"1/beta is {values[0]:.3g} 1/Pa within {reach[0]:.2g}, which cannot be told from zero: {why}")
    if values[1] <= 0.0:
        found.append(
            f"K_v comes out negative ({values[1]:.3g}): the piston moves against the command; turn the sign of one"
        )
    elif values[1] < reach[1]:
        found.append(
            f"K_v is {values[1]:.3g} within {reach[1]:.2g}, which cannot be told from zero; move the cylinder by its "
            "valve"
        )
    if strict and found:
        raise IdentificationError(found[0], parameters=("bulk_modulus", "flow_gain"))
    if share > NOISY and rows.instruments is rows.regressors:
        found.append(f"plain least squares loses about {100.0 * share:.0f} % of 1/beta: {why}")
    return (*found, *_left_over(rows, values, fit.residual))


def _left_over(rows: Rows, values: Array, residual: Array) -> tuple[str, ...]:
    """Sentence of the oil check about a residual of integrals that noise does not explain."""
    if not rows.constants.shape[1]:
        return ()
    left, noise, compressed = unexplained(rows, values, residual)
    if left < LEFT_OVER[0] * noise or left < LEFT_OVER[1] * compressed:
        return ()
    return (
        f"the balance misses {left:.2g} m of the piston's place, where noise explains {noise:.2g} m and all "
        "compression "
        f"of the oil is {compressed:.2g} m: neither values nor intervals can be trusted; give the spool, take "
        'extra=("leakage",), check the supply, and that command and sensors share one clock',
    )


def _reason(share: float, rate: float, *, ruled: bool, integral: bool) -> str:
    """Likely cause in an oil check, and the repair."""
    column = "force or pressure" if integral else "force rate"
    if share > NOISY:
        repair = "log both chamber pressures and reverse the valve more often"
        if not integral:
            repair = 'take estimator="instrument", which differentiates nothing, and log both chamber pressures'
        return (
            f"{100.0 * share:.0f} % of the power of the {column} is sensor noise at this rate of {rate:g} Hz; {repair}"
        )
    if ruled:
        return (
            "the pressures follow from the force by a rule of steady flow, and the oil is compressed while the flow "
            "turns, when no such rule holds; log one chamber pressure or both"
        )
    return (
        "something that the balance does not hold is larger than the compression of the oil; give the spool, take "
        'extra=("leakage",), and check that command and sensors share one clock'
    )


def _gram(rows: Rows) -> Array:
    count, columns = rows.regressors.shape[1:]
    stacked = rows.regressors.reshape(-1, columns)
    if rows.constants.shape[1]:
        stacked = np.concatenate(
            [each - rows.constants @ np.linalg.lstsq(rows.constants, each, rcond=None)[0] for each in rows.regressors]
        )
    size = np.sqrt(np.mean(stacked**2, axis=0))
    gram = stacked / np.where(size > 0.0, size, 1.0)
    return np.asarray(gram.T @ gram / count, dtype=np.float64)
