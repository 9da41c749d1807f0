"""Dependence of a residual on states: the share that each state predicts on validation records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vpm.discrepancy.judged_model import Data, Judged
from vpm.discrepancy.settings import BINS, CLEARLY, FEWEST_PERIODS, MOST_SAMPLES, PULL
from vpm.errors import CoreError
from vpm.identify import InverseDynamicsProblem
from vpm.identify.statistics import robust_covariance
from vpm.numbers import NORMAL_95, Array

#: A state, the direction of the motion (0 or 1) and what is to be predicted.
Cells = tuple[Array, NDArray[np.int64], Array]


@dataclass(frozen=True)
class Shares:
    """Shares of a validation residual that each state predicts."""

    of: dict[str, float]  #: Share of the mean square on validation data by state, the largest first.
    #: States whose share these data do not discriminate from the largest, the largest itself among them; none if they
    #: cannot tell the largest from zero.
    alike: tuple[str, ...]


def busiest_joint(data: Data, final: Judged) -> int:
    """Joint whose validation residual is the largest part of its effort; its dependence on states is examined."""
    sums = np.zeros(len(data.validation.joints))
    for record in range(len(data.validation.motions)):
        for column, block in enumerate(data.validation.efforts(record)):
            scale = (block.scale or 1.0) * block.weight  # of drives that are off there is no effort
            sums[column] += float(np.sum((final.validation[block.samples] / scale) ** 2))
    return int(np.argmax(sums))


def shares(data: Data, final: Judged, joint: int) -> Shares:
    """Share of one joint's validation residual that a binned map of each state predicts.

    A map is a table of means over bins of equal count, for both directions of the motion or for each on its own. Two
    states are alike where the mean difference of the squares that they leave is within its 95 % interval. The interval
    allows for samples that resemble their neighbours (F. Diebold and R. Mariano, *J. Business & Econ. Statistics* 13,
    1995).
    """
    sides = []
    for problem, residual in ((data.training, final.fit.residual), (data.validation, final.validation)):
        sides.append((_states(problem, final, joint), _residual(problem, residual, joint)))
    (seen, target), (met, left) = sides
    found: dict[str, Array] = {}
    for name in seen:
        edges = np.quantile(seen[name], np.linspace(0.0, 1.0, BINS + 1)[1:-1])
        direction = [np.zeros(values.size, dtype=np.int64) for values in (target, left)]
        plain = _left((seen[name], direction[0], target), (met[name], direction[1], left), edges)
        if name.startswith("velocity of " + data.training.joints[joint]):
            found[name] = plain
            continue
        own = f"velocity of {data.training.joints[joint]}"
        signs = [(states[own] > 0.0).astype(np.int64) for states in (seen, met)]
        both = _left((seen[name], signs[0], target), (met[name], signs[1], left), edges)
        with_direction = _share(both, left) > _share(plain, left) + CLEARLY
        found[f"{name} and direction" if with_direction else name] = both if with_direction else plain
    best = min(found, key=lambda name: float(found[name] @ found[name]))
    ends = np.cumsum([0, *(data.validation.efforts(r)[joint].time.size for r in range(len(data.validation.motions)))])
    records = [slice(int(a), int(b)) for a, b in pairwise(ends)]
    clear = not _as_good(found[best], left, records)
    alike = {name for name in found if clear and _as_good(found[best], found[name], records)}
    ranked = dict(sorted(((name, _share(rest, left)) for name, rest in found.items()), key=lambda item: -item[1]))
    return Shares(ranked, tuple(name for name in ranked if name in alike))


def _as_good(best: Array, other: Array, records: Sequence[slice]) -> bool:
    """Whether two states predict a residual equally well within chance."""
    difference = other**2 - best**2
    mean = float(difference.mean())
    variance = robust_covariance(np.ones((difference.size, 1)), difference - mean, records)[0, 0]
    return mean <= NORMAL_95 * float(np.sqrt(max(variance, 0.0)))


def _share(rest: Array, target: Array) -> float:
    power = float(target @ target)
    return max(0.0, 1.0 - float(rest @ rest) / power) if power > 0.0 else 0.0


def rhythm(data: Data, final: Judged, joint: int) -> tuple[float, float]:
    """Dependence on time as a rhythm: dominant period of the training residual, s, and its validation share.

    The phase is free on the validation records: nobody knows when they began in the beat of the disturbance. But a
    disturbance keeps it: each half of a record has to predict the other one. Links that ring with noise have a line of
    their own, whose phase wanders within the time in which they forget.
    """
    series = [_series(data.training, final.fit.residual, joint), _series(data.validation, final.validation, joint)]
    shortest = min(time[-1] - time[0] for time, _ in series[0])
    step = max(float(np.median(np.diff(time))) for time, _ in series[0])
    frequencies = np.arange(FEWEST_PERIODS / shortest, 0.25 / step, 0.2 / shortest)
    if not frequencies.size:
        return 0.0, 0.0
    power = [sum(_line(time, values, f) for time, values in series[0]) for f in frequencies]
    best = float(frequencies[int(np.argmax(power))])
    fine = best + np.linspace(-0.2, 0.2, 41) / shortest
    best = float(fine[int(np.argmax([sum(_line(t, x, f) for t, x in series[0]) for f in fine]))])
    total = sum(float(values @ values) for _, values in series[1])
    left = sum(_other_half(time, values, best) for time, values in series[1])
    return 1.0 / best, max(0.0, 1.0 - left / total) if total > 0.0 else 0.0


def own_vibration(data: Data, final: Judged, period: float) -> float:
    """Dependence on time as links ring with their joints held: the frequency of a rhythm, Hz; 0 if none has it.

    A line is as wide as one period in the shortest record, and frequencies of links depend on the pose.
    """
    problem, model = data.training, final.model
    if not period or model.loops or not model.core.n_elastic:
        return 0.0
    width = 1.0 / min(float(np.ptp(motion.time)) for motion in problem.motions)
    for record in range(len(problem.motions)):
        ways = dict(zip(problem.joints, problem.state(record)[0].T, strict=True))
        poses = np.column_stack([ways.get(joint, np.zeros(len(problem.state(record)[0]))) for joint in model.joints])
        with suppress(CoreError):
            told = np.array([model.natural_frequencies(pose) for pose in poses[:: max(1, len(poses) // BINS)]])
            if np.any((told.min(axis=0) - width <= 1.0 / period) & (1.0 / period <= told.max(axis=0) + width)):
                return 1.0 / period
    return 0.0


def _series(problem: InverseDynamicsProblem, residual: Array, joint: int) -> list[tuple[Array, Array]]:
    blocks = [problem.efforts(record)[joint] for record in range(len(problem.motions))]
    thin = [max(1, block.time.size // MOST_SAMPLES) for block in blocks]
    return [(b.time[::t], residual[b.samples][::t]) for b, t in zip(blocks, thin, strict=True)]


def _other_half(time: Array, values: Array, frequency: float) -> float:
    """Sum of squares of a time dependence in each half of a record, fitted to the other half."""
    columns, middle = _waves(time, frequency), time.size // 2
    halves = slice(None, middle), slice(middle, None)
    left = 0.0
    for seen, met in (halves, halves[::-1]):
        size = np.linalg.lstsq(columns[seen], values[seen], rcond=None)[0]
        left += float(np.sum((values[met] - columns[met] @ size) ** 2))
    return left


def _waves(time: Array, frequency: float) -> Array:
    phase = 2.0 * np.pi * frequency * time
    return np.column_stack([np.cos(phase), np.sin(phase)])


def _line(time: Array, values: Array, frequency: float) -> float:
    columns = _waves(time, frequency)
    right = columns.T @ values
    return float(right @ np.linalg.lstsq(columns.T @ columns, right, rcond=None)[0])


def _residual(problem: InverseDynamicsProblem, residual: Array, joint: int) -> Array:
    return np.concatenate([residual[problem.efforts(r)[joint].samples] for r in range(len(problem.motions))])


def _states(problem: InverseDynamicsProblem, final: Judged, joint: int) -> Mapping[str, Array]:
    """States that a residual may depend on, by name: of all joints, the load, pressures and the time."""
    found: dict[str, list[Array]] = {}
    for record, m in enumerate(problem.motions):
        for column, name in enumerate(problem.joints):
            for quantity, values in zip(("position", "velocity", "acceleration"), problem.state(record), strict=True):
                found.setdefault(f"{quantity} of {name}", []).append(values[:, column])
        _, applied, _ = problem.effort(final.model, final.model.theta, record)
        found.setdefault(f"size of the load of {problem.joints[joint]}", []).append(np.abs(applied[:, joint]))
        experiment = problem.experiments[record]
        for channel in experiment.channels:
            if ".pressure" in channel:
                values = experiment[channel][m.retained]
                found.setdefault(" of ".join(reversed(channel.split("."))), []).append(values)
        time = problem.efforts(record)[joint].time
        found.setdefault("time", []).append(time - time[0])
    count = len(problem.motions)
    return {name: np.concatenate(parts) for name, parts in found.items() if len(parts) == count}


def _left(seen: Cells, met: Cells, edges: Array) -> Array:
    """Sum of squares of a validation residual that means in bins of a state do not predict."""
    cells = [np.digitize(state, edges) * 2 + direction for state, direction, _ in (seen, met)]
    count = np.bincount(cells[0], minlength=2 * BINS)
    means = np.bincount(cells[0], seen[2], minlength=2 * BINS) / (count + PULL * seen[2].size / BINS)
    rest: Array = met[2] - means[cells[1]]
    return rest
