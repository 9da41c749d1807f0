"""Records side by side: what is drawn for a case, and which columns of the state arrays it needs.

A column is one record of one machine. Columns that are the same in several cases, which is so for all that lack the
hidden effect where the cases have one seed, are simulated once.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from blind.loads import Array, Column
from blind.loop import Actuators, Inputs, Sensors, closed_loop
from blind.machine import Draft, Machine
from blind.noise import normal

#: Relative step of the oracle's sensitivities.
NUDGE = 0.02
#: Numbers that the outputs of one batch may have, for the sake of memory, and columns beyond which nothing is won.
LARGEST_BATCH, MOST_COLUMNS = 4e7, 1200


@dataclass(frozen=True)
class Hidden:
    """An effect that the nominal model lacks: name, site as in the model, parameters; known to the catalogue or not."""

    name: str
    site: str
    parameters: Mapping[str, float]
    known: bool


@dataclass(frozen=True)
class Truth:
    """What is really there: hidden effects, and true and nominal values of what may be calibrated."""

    hidden: tuple[Hidden, ...]
    parameters: Mapping[str, float]
    nominal: Mapping[str, float]
    wrong: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plan:
    """A case before it is simulated."""

    machine: Machine
    seed: int
    noise_level: float
    draft: Draft
    base: tuple[tuple[str, str], ...]  #: Effects that the nominal model has.
    truth: Truth
    #: Everything that is true of the machine with the hidden effect, and of the one without.
    with_effect: Mapping[str, float]
    without: Mapping[str, float]
    varied: tuple[str, ...]  #: Parameters that the oracle recalibrates.
    paths: tuple[Array, ...]  #: References of the records; shape (actuators, samples).
    generator: Generator  #: For the noise.


class _Columns:
    """Columns of a batch, each different one once."""

    def __init__(self) -> None:
        self.values: list[Column] = []
        self.owner: list[int] = []
        self.paths: list[Array] = []
        self._place: dict[tuple[int, frozenset[tuple[str, float]]], int] = {}
        self._path: dict[bytes, int] = {}

    def path(self, path: Array) -> int:
        """Number of a reference."""
        number = self._path.setdefault(path.tobytes(), len(self.paths))
        if number == len(self.paths):
            self.paths.append(path)
        return number

    def add(self, path: int, values: Column) -> int:
        """Number of a new column."""
        self.values.append(values)
        self.owner.append(path)
        return len(self.values) - 1

    def silent(self, path: int, values: Column) -> int:
        """Number of a column without noise, which may be there already."""
        key = path, frozenset(values.items())
        if key not in self._place:
            self._place[key] = self.add(path, values)
        return self._place[key]

    def of(self, plan: Plan) -> list[list[int]]:
        """Columns of each record of a plan, to be added to this set."""
        layout = plan.machine.layout
        noisy = [signal.name for signal in (*layout.commands, *layout.sensors)]
        loud = {f"{name}.noise": plan.with_effect[f"{name}.noise"] * plan.noise_level for name in noisy}
        quiet = {f"{name}.{what}": 0.0 for name in noisy for what in ("noise", "quantum")}
        bare = {**plan.without, **quiet}
        still = [{**plan.with_effect, **quiet}, bare]
        still += [{**bare, key: bare[key] * (1.0 + NUDGE)} for key in plan.varied]
        places = []
        for reference in plan.paths:
            path = self.path(reference)
            first = self.add(path, {**plan.with_effect, **loud})
            places.append([first, *(self.silent(path, values) for values in still)])
        return places


def batches(plans: Sequence[Plan]) -> Iterator[list[int]]:
    """Plans that are simulated together: of one sampling rate, those of a seed next to each other."""
    order = sorted(range(len(plans)), key=lambda k: (plans[k].draft.rate, plans[k].seed))
    batch: list[int] = []
    columns, rate = _Columns(), 0.0
    for k in order:
        plan, layout = plans[k], plans[k].machine.layout
        if plan.draft.rate != rate and batch:
            yield batch
            batch, columns = [], _Columns()
        rate = plan.draft.rate
        numbers = max(path.shape[1] for path in plan.paths) * (len(layout.sensors) + len(layout.commands))
        columns.of(plan)
        batch.append(k)
        if len(columns.values) >= min(MOST_COLUMNS, LARGEST_BATCH / numbers):
            yield batch
            batch, columns = [], _Columns()
    if batch:
        yield batch


def simulated(plans: Sequence[Plan]) -> Iterator[tuple[int, list[Array]]]:
    """Run all records of plans with one sampling rate side by side.

    Yields
    ------
    tuple of int and list of ndarray, shape (samples, sensors and actuators, 3 + parameters)
        Number of a plan and its records: as measured, without noise, without the effect, and that with each parameter a
        little different.
    """
    machine, dt = plans[0].machine, 1.0 / plans[0].draft.rate
    fine = max(5, round(dt / machine.step))
    columns = _Columns()
    places = [columns.of(plan) for plan in plans]
    drives = [signal.name for signal in machine.layout.commands]
    sensors = [signal.name for signal in machine.layout.sensors]
    longest = max(path.shape[1] for path in columns.paths)
    held = np.stack([np.pad(p, ((0, 0), (0, longest - p.shape[1])), mode="edge").T for p in columns.paths], -1)
    loud = [place[0] for records in places for place in records]
    noise = np.zeros((longest, len(drives) + len(sensors), len(loud)))
    pairs = ((plan, path) for plan in plans for path in plan.paths)
    for k, (plan, path) in enumerate(pairs):
        noise[: path.shape[1], :, k] = normal(plan.generator, path.shape[1], noise.shape[1])
    with np.errstate(all="ignore"):
        both = closed_loop(
            machine.plant(columns.values, dt / fine),
            machine.controller(columns.values, dt),
            Actuators(drives, columns.values, dt, fine),
            Sensors(sensors, columns.values, dt, fine),
            Inputs(held, np.array(columns.owner), noise, np.array(loud)),
            dt,
            fine,
        )
    for k, (plan, records) in enumerate(zip(plans, places, strict=True)):
        yield k, [both[: p.shape[1], :, place] for p, place in zip(plan.paths, records, strict=True)]
