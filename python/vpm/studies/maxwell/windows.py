"""Sliding-window estimates of an element's parameters: k0 and s0 from tests at rest, k1 and c1 from tests in motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vpm.errors import IdentificationError
from vpm.narx.maxwell_records import MaxwellSignals, Samples, element_samples
from vpm.narx.records import RecordLike
from vpm.numbers import Array
from vpm.results import Result

#: Largest change over a test at rest, as a share of its noise's standard error of that change.
UNSETTLED = 4.0
#: A change that small beside the range over all tests, or beside the largest value, is rest whatever the noise.
REST, ROUNDING = 1e-3, 1e-9


@dataclass(frozen=True, repr=False, eq=False)
class MaxwellWindows(Result):
    """Two parameters of the element in each window.

    Attributes
    ----------
    names : tuple of two str
        ``("k0", "s0")`` in N/m and m, or ``("k1", "c1")`` in N/m and N s/m.
    method : str
        How they were estimated.
    drive_name : str
        Channel of the drive signal, or empty.
    tests : tuple of str
        Record or records of each window.
    drive, length : ndarray, shape (n,)
        Means over the window.
    values : ndarray, shape (n, 2)
    covariance : ndarray, shape (n, 2, 2)
    samples : ndarray, shape (n,)
    """

    names: tuple[str, str]
    method: str
    drive_name: str
    tests: tuple[str, ...]
    drive: Array
    length: Array
    values: Array
    covariance: Array
    samples: Array
    notes: tuple[str, ...] = ()

    @property
    def std(self) -> Array:
        """Standard errors of the windows, shape (n, 2)."""
        return np.sqrt(np.maximum(np.diagonal(self.covariance, axis1=1, axis2=2), 0.0))

    def _headline(self) -> Mapping[str, object]:
        return {"parameters": self.names, "method": self.method, "windows": self.drive.size, "notes": len(self.notes)}

    def _frame_columns(self) -> Mapping[str, object]:
        std = self.std
        columns: dict[str, object] = {"tests": self.tests, "drive": self.drive, "length_m": self.length}
        for at, name in enumerate(self.names):
            columns |= {name: self.values[:, at], f"{name}_std": std[:, at]}
        return columns | {"samples": self.samples.astype(int)}


@dataclass(frozen=True)
class _Pose:
    """Means of a test at rest, and their standard errors."""

    name: str
    drive: float
    length: float
    force: float
    force_error: float
    length_error: float
    samples: int


def static_windows(
    records: RecordLike | Sequence[RecordLike],
    signals: MaxwellSignals | None = None,
    *,
    width: int = 3,
    settle: float = 0.0,
    step: float | None = None,
    drive_tolerance: float = 1e-3,
) -> MaxwellWindows:
    """Stiffness and free length from tests at rest, over windows of neighbouring poses.

    At rest ``F = k0 (s - s0)``. One pose tells one number, k0 (s - s0): the columns s and 1 of the regression D'Imperio
    (2016), eq 5.56, are the same but for a factor there (rank 2 of 3). Poses of one drive signal are sorted by length,
    and a window slides over `width` of them: k0 is the slope ``dF/ds``, s0 the length at which that tangent is zero.

    Parameters
    ----------
    records : Experiment, or mapping of str to array-like, shape (N,), or a sequence of them
        One for each pose.
    width : int
        Poses in a window, 2 at least.
    settle : float
        Time at the start of each test that is left out, s; several relaxation times.
    step : float, optional
        Time between samples of records without a clock, s.
    drive_tolerance : float
        Drive signals that differ by less than this share of their range are one.

    Raises
    ------
    IdentificationError
        Poses of one length only, a test that is not at rest, records that do not fit.
    """
    signals = signals or MaxwellSignals()
    if width < 2:
        raise IdentificationError(f"a window of {width} poses cannot tell k0 from s0; take 2 poses or more")
    if settle < 0.0:
        raise IdentificationError(f"the time to settle is {settle:g} s; give a time of zero or more")
    tests = element_samples(records, signals, step)
    # What is small is judged beside all tests, because the force of one pose may be zero.
    both = ([one.force for one in tests], [one.length for one in tests])
    scales = tuple(_small(np.concatenate(columns)) for columns in both)
    poses = [_pose(one, signals, settle, scales) for one in tests]
    found = []
    lone = []
    for row in _rows(poses, drive_tolerance):
        if max(p.length for p in row) - min(p.length for p in row) <= 6.0 * max(p.length_error for p in row):
            lone.append(row)
            continue
        count = min(width, len(row))
        found += [_tangent(row[at : at + count]) for at in range(len(row) - count + 1)]
    if not found:
        raise IdentificationError(_one_length(lone, signals))
    notes = tuple(_one_length([row], signals) for row in lone)
    names, drive, length, values, covariance, samples = zip(*found, strict=True)
    columns = np.array(drive), np.array(length), np.array(values), np.array(covariance), np.array(samples)
    return MaxwellWindows(("k0", "s0"), "tangent", signals.drive or "", names, *columns, notes)


def _small(values: Array) -> float:
    return max(REST * float(np.ptp(values)), ROUNDING * float(np.abs(values).max()))


def _pose(one: Samples, signals: MaxwellSignals, settle: float, scales: tuple[float, ...]) -> _Pose:
    skip = round(settle / one.step)
    if one.force.size - skip < 3:
        raise IdentificationError(
            f"record {one.name} lasts {one.force.size * one.step:g} s, and {settle:g} s to settle leave "
            f"{max(one.force.size - skip, 0)} samples of it; give a longer test or a shorter time to settle"
        )
    force, length, drive = one.force[skip:], one.length[skip:], one.drive[skip:]
    errors = []
    for channel, column, small in zip((signals.force, signals.length), (force, length), scales, strict=True):
        time = np.linspace(-0.5, 0.5, column.size)
        slope = float(12.0 * np.mean(time * (column - column.mean())))
        noise = float(np.std(column - column.mean() - slope * time))
        error = noise / np.sqrt(column.size)
        if abs(slope) > UNSETTLED * np.sqrt(12.0) * error + small:
            raise IdentificationError(
                f'record {one.name} is not at rest: "{channel}" changes by {slope:.3g} from its start to its end, with '
                f"{noise:.3g} of noise; leave out more of its start with settle=, or give it as a test in motion"
            )
        errors.append(error if noise > ROUNDING * small else 0.0)
    return _Pose(
        one.name, float(drive.mean()), float(length.mean()), float(force.mean()), errors[0], errors[1], force.size
    )


def _rows(poses: list[_Pose], tolerance: float) -> list[list[_Pose]]:
    """Windows at rest in rows: poses of the same drive signal, by length."""
    ordered = sorted(poses, key=lambda p: p.drive)
    gap = tolerance * (ordered[-1].drive - ordered[0].drive)
    rows = [[ordered[0]]]
    for pose in ordered[1:]:
        if pose.drive - rows[-1][0].drive > gap:
            rows.append([])
        rows[-1].append(pose)
    return [sorted(row, key=lambda p: p.length) for row in rows]


def _tangent(poses: list[_Pose]) -> tuple[str, float, float, list[float], Array, int]:
    """Straight line through neighbouring windows at rest, weighted by effective variance."""
    s, f = np.array([p.length for p in poses]), np.array([p.force for p in poses])
    errors = np.array([(p.force_error, p.length_error) for p in poses])
    slope = float(np.polyfit(s - s.mean(), f, 1)[0])
    variance = errors[:, 0] ** 2 + (slope * errors[:, 1]) ** 2
    exact = variance.max() == 0.0
    w = np.ones(s.size) if exact else 1.0 / np.maximum(variance, 1e-6 * variance.max())
    centre, level = float(w @ s / w.sum()), float(w @ f / w.sum())
    spread = float(w @ (s - centre) ** 2)
    slope = float(w @ ((s - centre) * (f - level))) / spread
    if slope == 0.0:
        raise IdentificationError(
            f"the force is {level:g} N at every length of the tests {poses[0].name} to {poses[-1].name}, so that k0 is "
            "zero and there is no s0; check the force channel"
        )
    # f = level + slope (s - centre): k0 = slope, s0 = centre - level / slope.
    both = np.zeros((2, 2)) if exact else np.diag([1.0 / w.sum(), 1.0 / spread])
    jacobian = np.array([[0.0, 1.0], [-1.0 / slope, level / slope**2]])
    name = f"{poses[0].name} ... {poses[-1].name}"
    drive = float(np.mean([p.drive for p in poses]))
    covariance = jacobian @ both @ jacobian.T
    return name, drive, centre, [slope, centre - level / slope], covariance, sum(p.samples for p in poses)


def _one_length(rows: list[list[_Pose]], signals: MaxwellSignals) -> str:
    row = rows[0]
    at = f" at {signals.drive} = {row[0].drive:.4g}" if signals.drive else ""
    tests = f"test {row[0].name} is the only one" if len(row) == 1 else f"the {len(row)} tests{at} have one length"
    where = at if len(row) == 1 else ""
    return (
        f"{tests}{where} ({row[0].length:.4g} m), where the regression for k0, s0 and tau has rank 2 of 3 and only "
        f"k0 (s - s0) = {row[0].force:.4g} N can be told; add a test at another length"
    )
