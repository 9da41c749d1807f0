"""How answers are scored: what counts as right, rates with their intervals, errors of parameters."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blind.answer import NOWHERE, Answer, Named
from blind.oracle import CLEAR

Array = NDArray[np.float64]
ANY = "*"


@dataclass(frozen=True)
class Same:
    """Two names for one physics on one machine, by construction and not by lack of data."""

    machines: tuple[str, ...]
    hidden: str
    at: str
    named: str
    site: str
    reason: str


#: Everything that counts as right without being called as it was hidden. Nothing else does.
EQUIVALENT = (
    Same(
        ("axis_linear", "axis_rotary"),
        "sensor_delay",
        "encoder",
        "input_delay",
        "drive",
        "one command, one position: shifting the position in time is shifting the command in time",
    ),
    Same(
        ("axis_linear", "axis_rotary"),
        "input_delay",
        "drive",
        "sensor_delay",
        "encoder",
        "as above",
    ),
    Same(
        ("axis_linear", "servo_cylinder"),
        "bias_force",
        "axis",
        "gravity_tilt",
        "world",
        "on a level slide a tilt of gravity is a constant force",
    ),
    Same(
        ("axis_rotary",),
        "sensor_offset",
        "encoder",
        "gravity_tilt",
        "world",
        "only gravity depends on the angle itself, so a shifted zero is a tilted world",
    ),
    Same(("axis_rotary",), "gravity_tilt", "world", "sensor_offset", "encoder", "as above"),
    Same(
        ("arm2r",),
        "sensor_offset",
        "encoder_1",
        "gravity_tilt",
        "world",
        "only gravity depends on the angle of the first joint itself, so a shifted zero is a tilted world",
    ),
    Same(("arm2r",), "gravity_tilt", "world", "sensor_offset", "encoder_1", "as above"),
    Same(
        ("servo_cylinder",),
        "payload",
        "slide",
        "rotor_inertia",
        "axis",
        "on a slide both are a mass more",
    ),
)  # fmt: skip


#: What is hidden with an effect where the model file has none of it: friction of each place is no less than zero, so
#: that what differs along the way has a mean.
WITH = {"position_dependent_friction": "coulomb_friction"}


def named_beside(answer: Answer) -> tuple[Named, ...]:
    """Named effects, without what is hidden with the hidden one, if both are named."""
    brought = {(WITH[h.name], h.site) for h in answer.hidden if h.name in WITH and _is_named(answer, h)}
    return tuple(one for one in answer.named if (one.name, one.site) not in brought)


def _is_named(answer: Answer, hidden: Named) -> bool:
    return any((one.name, one.site) == (hidden.name, hidden.site) for one in answer.named)


def names_right(machine: str, hidden: Named, named: Named) -> bool:
    """Whether a name is that of the hidden effect, or one of the same physics."""
    return named.name == hidden.name or any(_same(machine, hidden, named, same) for same in EQUIVALENT)


def site_right(machine: str, hidden: Named, named: Named) -> bool:
    """Whether name and site are right."""
    here = (named.name, named.site) == (hidden.name, hidden.site)
    return here or any(_same(machine, hidden, named, same) for same in EQUIVALENT)


def _same(machine: str, hidden: Named, named: Named, same: Same) -> bool:
    there = (hidden.name, hidden.site, named.name, named.site)
    return machine in same.machines and there == (same.hidden, same.at, same.named, same.site)


@dataclass(frozen=True)
class Rate:
    """So many of so many, with the interval of E. B. Wilson (J. Amer. Statist. Assoc. 22, 1927) of 95 %."""

    hits: int
    count: int

    @property
    def value(self) -> float:
        """Share; NaN of none."""
        return self.hits / self.count if self.count else np.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Lower and upper end."""
        if not self.count:
            return 0.0, 1.0
        z2, n = 1.959963984540054**2, self.count
        middle = (self.hits + 0.5 * z2) / (n + z2)
        half = np.sqrt(z2 * (self.hits * (n - self.hits) / n + 0.25 * z2)) / (n + z2)
        return float(max(middle - half, 0.0)), float(min(middle + half, 1.0))

    def __str__(self) -> str:
        if not self.count:
            return "none"
        low, high = self.interval
        return f"{self.hits}/{self.count} = {100 * self.value:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def rate(answers: Iterable[Answer], hit: Callable[[Answer], bool]) -> Rate:
    """Share of the answers that do."""
    told = [hit(answer) for answer in answers]
    return Rate(sum(told), len(told))


def top(answer: Answer, count: int) -> bool:
    """Whether the hidden effect is among the first so many; the first is that of the answer, not of the ranking."""
    if count == 1:
        told = named_beside(answer)
        return bool(told) and names_right(answer.machine, answer.hidden[0], told[0])
    names: list[str] = []
    for named in answer.ranking:
        if named.name not in names:
            names.append(named.name)
        if len(names) > count:
            return False
        if names_right(answer.machine, answer.hidden[0], named):
            return True
    return False


def in_place(answer: Answer) -> bool:
    """Whether the first accepted effect is the hidden one at its site."""
    told = named_beside(answer)
    return bool(told) and site_right(answer.machine, answer.hidden[0], told[0])


def alone(answer: Answer) -> bool:
    """Whether the answer names the hidden effect and nothing else."""
    return top(answer, 1) and len(named_beside(answer)) == 1


def all_named(answer: Answer) -> bool:
    """Whether every hidden effect is among the accepted ones."""
    return all(any(names_right(answer.machine, h, n) for n in answer.named) for h in answer.hidden)


def alarmed(answer: Answer) -> bool:
    """Whether an effect is named where none is; an answer that failed is none."""
    return bool(answer.named)


def unexplained(answer: Answer) -> bool:
    """Whether it says that it has no name."""
    return answer.verdict in {"unexplained", "interrupted"}


def single(answers: Iterable[Answer]) -> list[Answer]:
    """Solvable cases with one effect that the catalogue has."""
    return [a for a in answers if a.kind == "single" and a.solvable]


def pairs(answers: Iterable[Answer]) -> list[Answer]:
    """Cases with two effects, each of which is solvable where the other one is there."""
    return [a for a in answers if a.kind == "pairs" and a.solvable]


def pairs_alone(answers: Iterable[Answer]) -> list[Answer]:
    """Cases with two effects, each of which is solvable where the other one is not there."""
    return [a for a in answers if a.kind == "pairs" and a.alone and all(s > CLEAR for s in a.alone)]


def outside(answers: Iterable[Answer]) -> list[Answer]:
    """Solvable cases of effects that no diagnosis screens for."""
    return [a for a in answers if a.kind == "outside" and a.solvable]


def without(answers: Iterable[Answer]) -> list[Answer]:
    """Cases without a missing effect that were answered."""
    return [a for a in answers if a.kind in {"none", "parameters"} and not a.error]


def gap_ratios(answers: Iterable[Answer]) -> Array:
    """Gap after over that of the oracle, where both are known."""
    both = [a.gap / a.oracle_gap for a in answers if np.isfinite(a.gap) and a.oracle_gap > 0.0]
    return np.array(both)


def closed(answers: Iterable[Answer]) -> Array:
    """Gap of the repaired model over that of the recalibrated one."""
    return np.array([a.gap / a.recalibrated_gap for a in answers if np.isfinite(a.gap) and a.recalibrated_gap > 0.0])


@dataclass(frozen=True)
class ParameterError:
    """Error of one parameter: relative to the truth, and in stated standard deviations (NaN if there are none)."""

    effect: str
    parameter: str
    relative: float
    deviations: float


def parameter_errors(answers: Iterable[Answer]) -> list[ParameterError]:
    """Of all effects that were called by their name at their site."""
    found = []
    for answer in answers:
        for hidden in answer.hidden:
            match = next((n for n in answer.named if (n.name, n.site) == (hidden.name, hidden.site)), None)
            for name, value in (match.values if match else {}).items():
                true = hidden.values.get(name)
                if match is None or true is None or true == 0.0 or abs(true) >= NOWHERE:
                    continue
                std = match.stds.get(name, 0.0)
                deviations = (value - true) / std if std > 0.0 else np.nan
                found.append(ParameterError(hidden.name, name, value / true - 1.0, deviations))
    return found


def quartiles(values: Sequence[float] | Array) -> tuple[float, float, float]:
    """Median, lower and upper quartile."""
    if not len(values):
        return np.nan, np.nan, np.nan
    low, middle, high = np.quantile(values, (0.25, 0.5, 0.75))
    return float(middle), float(low), float(high)
