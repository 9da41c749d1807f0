"""The time grid of a log: what is refused, and what is interpolated when the user asks for it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.errors import ExperimentError
from vpm.experiment.signal import interpolate
from vpm.numbers import LARGEST, Array

#: Fewest samples that make a log.
FEWEST_SAMPLES = 10

#: Largest difference of one step from the median step, as a share of it: a clock written to the microsecond passes.
STEP_TOLERANCE = 5e-3

#: Largest distance of a sample from the uniform grid, in steps.
GRID_TOLERANCE = 0.05

#: A step beyond this many median steps is a gap.
GAP = 1.5

#: Most samples of an interpolated record for each of its own: with more, nearly all of it would be invented.
MOST_GROWTH = 10.0

#: The same where somebody asks for a finer grid.
MOST_FINER = 1000.0

#: What helps where samples are missing or uneven, in Python and on the command line.
INTERPOLATE = 'load with irregular="interpolate" (--interpolate)'

#: Quantities that change smoothly, and so may be interpolated by a spline.
SMOOTH_QUANTITIES = ("position", "velocity", "acceleration", "length", "rate", "pressure", "pressure_a", "pressure_b")


@dataclass(frozen=True)
class Source:
    """File or record that numbers came from, so that an error can name file and line."""

    name: str  #: File, or name of the record.
    #: Line of the file for each sample; None for arrays, whose samples are counted from zero.
    lines: NDArray[np.int64] | None = None
    path: str | None = None  #: File.

    def at(self, sample: int) -> str:
        """Place of a grid's sample in its file, in words, such as ``log.csv, line 12``."""
        if self.lines is None:
            return f"{self.name}, sample {sample}"
        return f"{self.name}, line {self.lines[sample]}"

    def error(self, message: str, *, channel: str | None = None, time: float | None = None) -> ExperimentError:
        """Error about a grid that carries the path."""
        return ExperimentError(message, path=self.path, channel=channel, time=time)


def check_finite(values: Array, time: Array, what: str, source: Source, *, channel: str | None = None) -> None:
    """Refuse NaN, infinity and what no machine can be at, on the grid."""
    bad = np.flatnonzero(~(np.abs(values) <= LARGEST))  # nor NaN
    if bad.size:
        first = int(bad[0])
        when = f" at t = {time[first]:.6g} s" if np.isfinite(time[first]) else ""
        count = "the only one" if bad.size == 1 else f"the first of {bad.size}"
        nothing = np.all(np.isnan(values[bad])) and np.isfinite(time[first])
        repair = f"fill these cells, or {INTERPOLATE}" if nothing else "repair these cells"
        raise source.error(
            f"{source.at(first)}: {what} is {values[first]}{when}, {count}; {repair}",
            channel=channel,
            time=float(time[first]) if np.isfinite(time[first]) else None,
        )


def unrounded(time: Array) -> tuple[Array, float] | None:
    """Even clock behind stamps that were rounded or cut to whole counts, and the count, s; None where none is.

    Every stamp of such a clock lies within one count of a straight line. A lost row lengthens one step, a row that was
    written twice leaves one of no length. Rounding does both: what one step lacks the next ones have.

    ``time``: shape (N,), s
    """
    steps = np.diff(time)
    usual = float(np.median(steps))
    repeats = int(np.sum(steps == 0.0))
    longer = int(np.sum(steps > GAP * usual))
    lost = longer > 0 if not repeats else repeats < 2 or abs(longer - repeats) > 1
    if time.size < FEWEST_SAMPLES or usual <= 0.0 or steps.min() < 0.0 or lost:
        return None
    counts = (10.0**-digits for digits in range(7))
    whole = (one for one in counts if np.allclose(time / one, np.round(time / one), rtol=0.0, atol=1e-3))
    count = next(whole, 0.0)
    even = np.polynomial.Polynomial.fit(np.arange(time.size), time, 1)(np.arange(time.size))
    off = np.ptp(time - even)
    return (even, count) if STEP_TOLERANCE * usual < off <= 1.05 * count else None


def usual_step(time: Array) -> float:
    """Mean step of a clock, s, without its gaps: that of its grid.

    The median is one of the steps, each of which is rounded to what the clock counts or its numbers hold. A grid of
    rounded steps drifts away from the samples.
    """
    steps = np.diff(time)
    return float(np.mean(steps[steps <= GAP * np.median(steps)]))


def check_increasing(time: Array, source: Source) -> None:
    """Refuse a grid that is too short, or whose time stands still or goes back."""
    if time.size < FEWEST_SAMPLES:
        raise source.error(
            f"{source.name} has {time.size} of at least {FEWEST_SAMPLES} samples that are needed; record longer"
        )
    if np.ptp(time) == 0.0:
        raise source.error(
            f"{source.name}: the time is {time[0]:.9g} s in all {time.size} samples; "
            "map the column that holds the clock",
            time=float(time[0]),
        )
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if back.size:
        first = int(back[0])
        repair = (
            "delete the repeated row"
            if time[first] == time[first + 1]
            else "sort the rows, or cut the log where its clock was set anew"
        )
        raise source.error(
            f"{source.at(first + 1)}: the time goes from {time[first]:.9g} s to {time[first + 1]:.9g} s, and it has to "
            f"increase; {repair}",
            time=float(time[first + 1]),
        )


def check_uniform(time: Array, source: Source) -> str:
    """Refuse gaps and uneven steps of a grid.

    Result: sentence on the grid for the history.
    Raises `ExperimentError`: samples are missing, one step is off by more than 0.5 % of the median step, or a sample
    lies further than a twentieth of a step from the uniform grid.
    """
    steps = np.diff(time)
    median = float(np.median(steps))
    repair = f"trim the log there, or {INTERPOLATE}"
    gaps = np.flatnonzero(steps > GAP * median)
    if gaps.size:
        first = int(gaps[0])
        missing = round(float(steps[first]) / median) - 1
        more = "" if gaps.size == 1 else f" and there are {gaps.size - 1} more such gaps"
        raise source.error(
            f"{source.at(first + 1)}: {missing} {_samples(missing)} missing after t = {time[first]:.9g} s (a step of "
            f"{steps[first]:.6g} s where {median:.6g} s is usual){more}; {repair}",
            time=float(time[first]),
        )
    worst = int(np.argmax(np.abs(steps - median)))
    share = abs(float(steps[worst]) - median) / median
    if share > STEP_TOLERANCE:
        raise source.error(
            f"{source.at(worst + 1)}: the step at t = {time[worst]:.9g} s is {steps[worst]:.6g} s, {share:.2%} off the "
            f"median of {median:.6g} s, and {STEP_TOLERANCE:.1%} is allowed; {INTERPOLATE}",
            time=float(time[worst]),
        )
    _check_drift(time, source)
    rate = (time.size - 1) / float(time[-1] - time[0])
    return (
        f"The {time.size} samples are {1.0 / rate:.9g} s apart ({rate:.6g} Hz), each step within {share:.1e} of that."
    )


def make_uniform(
    time: Array, data: Array, channels: tuple[str, ...], rate: float | None, source: Source
) -> tuple[Array, Array, str]:
    """Interpolate a record onto a uniform grid.

    - ``time``: shape (N,), increasing, s
    - ``data``: shape (N, C)
    - ``channels``: positions, velocities and accelerations are interpolated by cubic splines, all others by straight
      lines
    - ``rate``: Hz; None takes the usual step

    - result ``time``: shape (M,)
    - result ``data``: shape (M, C)
    - result ``sentence``: for the history
    """
    steps = np.diff(time)
    usual = usual_step(time)
    step = usual if rate is None else 1.0 / rate
    check_grid(time, step, MOST_GROWTH if rate is None else MOST_FINER, source)
    grid = time[0] + step * np.arange(int((time[-1] - time[0]) / step * (1.0 + 1e-12) + 1e-6) + 1)
    grid = grid[grid <= time[-1] + 1e-6 * step]
    inside = np.minimum(grid, time[-1])
    columns = [interpolate(time, data[:, i], inside, smooth=is_smooth(channel)) for i, channel in enumerate(channels)]
    gaps = steps[steps > GAP * usual]
    missing = int(np.sum(np.round(gaps / usual) - 1))
    text = f"The record was interpolated onto a uniform grid of {grid.size} samples, {step:.9g} s apart"
    if missing:
        longest = round(float(gaps.max()) / usual) - 1
        text += (
            f"; {missing} {_samples(missing)} missing before, the longest gap being {longest} long "
            f"after t = {time[int(np.argmax(steps))]:.6g} s"
        )
    return grid, np.column_stack(columns) if columns else np.zeros((grid.size, 0)), text + "."


def check_grid(time: Array, step: float, growth: float, source: Source) -> None:
    """Refuse a grid that has many times the samples of the record."""
    count = float(time[-1] - time[0]) / step if step > 0.0 else np.inf
    if count > growth * time.size:
        steps = np.diff(time)
        at = int(np.argmax(steps))
        raise source.error(
            f"{source.at(at + 1)}: a grid with steps of {step:.6g} s would have {count:.3g} samples where the record "
            f"has {time.size}, and its longest step is from {time[at]:.9g} s to {time[at + 1]:.9g} s; correct this "
            "time stamp, or trim the record there",
            time=float(time[at + 1]),
        )


def is_smooth(channel: str) -> bool:
    """Whether a channel on the grid is a motion, which has no jumps."""
    return channel.rpartition(".")[2] in SMOOTH_QUANTITIES


def _check_drift(time: Array, source: Source) -> None:
    step = float(time[-1] - time[0]) / (time.size - 1)
    away = np.abs(time - (time[0] + step * np.arange(time.size))) / step
    worst = int(np.argmax(away))
    if away[worst] > GRID_TOLERANCE:
        raise source.error(
            f"{source.at(worst)}: the sample at t = {time[worst]:.9g} s lies {away[worst]:.2g} steps from a uniform "
            f"grid of {step:.6g} s, and {GRID_TOLERANCE:g} is allowed, because the clock's rate changes; "
            f"{INTERPOLATE}",
            time=float(time[worst]),
        )


def _samples(count: int) -> str:
    return "sample is" if count == 1 else "samples are"
