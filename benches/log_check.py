"""Plant mistakes into logs of machines, with and without a missing effect, and count which of them a log check names.

Other code simulates the machines, those of the proving ground. Mistakes are what people make who write channel tables
and loggers: units read as others, factors, signs, exchanged channels, clocks, delays up to 100 ms, and stretches that
no sensor gives. Each is drawn by the seed, forty to a machine, and planted on a machine with nothing missing and on one
that lacks an effect. It counts as named if the first finding has its kind and its channel. With ``clean`` logs
are left as they are, and any mistake that is named is false.

    python benches/log_check.py planted axis_linear arm2r --seeds 1-2
    python benches/log_check.py clean axis_linear --seeds 1-20
"""

from __future__ import annotations

import sys
import time
from argparse import ArgumentParser
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.signal import butter, lfilter

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from blind import proving
from blind.case import Case
from vpm import Experiment, LogCheck, check_log

Change = Callable[[Experiment], Experiment]
Values = Callable[[np.ndarray], np.ndarray]
#: Mistakes that are planted on a machine, each twice.
COUNT = 40
#: Machines with an effect missing on which they are, and on which logs are left as they are.
FAULTY, EVERY = 8, 100
#: Factors by which numbers of a unit are off that were taken for another one, or scaled by an amplifier or a gear.
FACTORS = {
    "m": (1e3, 1e-3, 1e2, 1e6, 1 / 0.0254),
    "rad": (180 / np.pi, np.pi / 180, 0.5 / np.pi, 2 * np.pi, 1e3),
    "A": (1e3, 1e-3, 10.0, 0.1),
    "V": (1e3, 1e-3, 10.0, 0.1),
    "N": (1e3, 1e-3, 1 / 9.81, 9.81),
    "N m": (1e3, 1e-3, 1 / 9.81, 9.81),
    "Pa": (1e-5, 1e-3, 1e-6, 1 / 6894.76, 10.0),
    "1": (1e6, 1e3, 1e2),
}
DELAYS = (0.004, 0.0125, 0.03, 0.08)


@dataclass(frozen=True)
class Mistake:
    """What was done to a log, and what has to be said of it."""

    kinds: tuple[str, ...]
    channel: str
    words: str
    change: Change

    def is_named(self, check: LogCheck) -> bool:
        """Whether the first finding says it; for a stretch, whether one does and no mistake is named."""
        found = [] if "stretch" in self.kinds and check.mistakes else check.findings
        found = found if {"stretch", "filtered"} & set(self.kinds) else found[:1]
        return any(one.kind in self.kinds and self.channel in one.sentence.split(";")[0] for one in found)


def mistakes(log: Experiment, used: list[str]) -> Iterator[Mistake]:
    """Everything that can be planted into a log."""
    units = dict(zip(log.channels, log.units, strict=True))
    scale, positions = ("unit", "scale"), [name for name in used if name.endswith(".position")]
    for name in used:
        for factor in FACTORS[units[name]]:
            yield Mistake(scale, name, f"{factor:.4g} times", changed([name], lambda v, k=factor: k * v))
        yield Mistake(("sign", "swap"), name, "turned", changed([name], np.negative))
        for delay in DELAYS:
            for seconds in (delay, -delay):
                yield Mistake(("delay",), name, f"{1e3 * seconds:g} ms late", late(name, seconds))
    if len(positions) > 1:
        factor = FACTORS[units[positions[0]]][0]
        yield Mistake(scale, positions[0], "all in another unit", changed(positions, lambda v: factor * v))
    for first, second in combinations(used, 2):
        if units[first] == units[second]:
            yield Mistake(("swap",), first, f"exchanged with {second}", exchanged(first, second))
    for factor in (1e3, 1e-3, 1e6, 1 / 60):
        yield Mistake(("clock",), "time", f"{factor:.4g} times", lambda log, k=factor: replace(log, time=k * log.time))
    for name in positions:
        yield from stretches(log, name)


def stretches(log: Experiment, name: str) -> Iterator[Mistake]:
    """What is wrong with a sensor by itself."""
    count = len(log)
    moving = int(np.argmax(np.abs(np.gradient(log[name]))[count // 4 : 3 * count // 4])) + count // 4
    stop, reach = moving + round(0.3 / log.dt), float(np.ptp(log[name]))

    def frozen(values: np.ndarray) -> np.ndarray:
        values[moving:stop] = values[moving]
        return values

    def spiked(values: np.ndarray) -> np.ndarray:
        values[count // 7 :: count // 5] += reach
        return values

    low, high = float(np.min(log[name])) + 0.1 * reach, float(np.max(log[name])) - 0.1 * reach
    ways: dict[str, Values] = {
        "frozen": frozen,
        "spikes": spiked,
        "clipped": lambda values: np.clip(values, low, high),
        "coarse": lambda values: np.round(values / (0.02 * reach)) * 0.02 * reach,
        "constant": lambda values: np.full_like(values, values[0]),
    }
    for kind, way in ways.items():
        yield Mistake((kind, "stretch"), name, kind, changed([name], way))
    for share in (0.125, 0.25, 0.5):
        # What a filter makes late may be told as well.
        words = f"filtered at {share:g} of the Nyquist frequency"
        yield Mistake(("filtered", "delay"), name, words, changed([name], lambda values, s=share: lowpass(values, s)))


def lowpass(values: np.ndarray, share: float) -> np.ndarray:
    """Behind a filter of the second order at a share of the Nyquist frequency, from rest."""
    above, below = butter(2, share)
    return values[0] + lfilter(above, below, values - values[0])


def changed(names: list[str], way: Values) -> Change:
    """Other values in some channels."""

    def change(log: Experiment) -> Experiment:
        data = np.array(log.data)
        for name in names:
            data[:, log.channels.index(name)] = way(np.array(log[name]))
        return replace(log, data=data)

    return change


def exchanged(first: str, second: str) -> Change:
    """Two channels in each other's place."""

    def change(log: Experiment) -> Experiment:
        data, places = np.array(log.data), [log.channels.index(name) for name in (first, second)]
        data[:, places] = data[:, places[::-1]]
        return replace(log, data=data)

    return change


def late(name: str, seconds: float) -> Change:
    """A channel whose stamps are late, or early; its ends stand still."""

    def change(log: Experiment) -> Experiment:
        data = np.array(log.data)
        data[:, log.channels.index(name)] = np.interp(log.time - seconds, log.time, log[name])
        return replace(log, data=data)

    return change


def cases(machine: str, seed: int, effects: int) -> list[tuple[str, Case]]:
    """A machine with nothing missing, then others that lack one of some effects each."""
    nothing, *_ = proving.jobs([machine], (), [seed], (1.0,), ("none",), 1)
    single = proving.jobs([machine], (), [seed], (1.0,), ("single",), 1)
    order = np.random.default_rng(seed).permutation(len(single))[:effects]
    made = proving.make([nothing, *(single[place] for place in order)])
    return [
        ("nothing" if job.kind == "none" else "+".join(job.request), case) for job, case, *_ in made if case is not None
    ]


def checked(case: Case, change: Change) -> tuple[LogCheck, float]:
    """What is said of the first log of a case, and the processor time that took, s."""
    begin = time.process_time()
    check = check_log(case.model(), change(case.train[0]))
    return check, time.process_time() - begin


def planted(machine: str, seed: int) -> tuple[int, int, list[float]]:
    """How many of the mistakes were named, of how many, and the times."""
    dice = np.random.default_rng([seed, len(machine)])
    (_, clean), *faulty = cases(machine, seed, FAULTY)
    log, model = clean.train[0], clean.model()
    used = [
        name for name in log.channels if name in model.input_channels or not name.endswith((".command", ".reference"))
    ]
    named, tried, times = 0, 0, []
    for place, mistake in enumerate(drawn(list(mistakes(log, used)), dice)):
        for missing, case in (("nothing", clean), faulty[place % len(faulty)]):
            check, seconds = checked(case, mistake.change)
            good = mistake.is_named(check)
            named, tried = named + good, tried + 1
            times.append(seconds)
            if not good:
                said = " | ".join(f"{one.kind}: {one.sentence}" for one in check.findings) or "nothing"
                print(f"  {machine}, {missing} missing: {mistake.channel} {mistake.words}: {said}", flush=True)
    return named, tried, times


def drawn(every: list[Mistake], dice: np.random.Generator) -> list[Mistake]:
    """Some of all mistakes, each kind as often as the others as long as there are some left."""
    left = {kinds: [one for one in every if one.kinds == kinds] for kinds in dict.fromkeys(one.kinds for one in every)}
    chosen: list[Mistake] = []
    while len(chosen) < COUNT and any(left.values()):
        for several in left.values():
            if several and len(chosen) < COUNT:
                chosen.append(several.pop(int(dice.integers(len(several)))))
    return chosen


def clean(machine: str, seed: int) -> tuple[int, int, list[float]]:
    """How many logs were left in peace, of how many, and the times."""
    right, tried, times = 0, 0, []
    for missing, case in cases(machine, seed, EVERY):
        check, seconds = checked(case, lambda log: log)
        right, tried = right + (not check.mistakes), tried + 1
        times.append(seconds)
        for one in check.mistakes:
            print(f"  {machine}, {missing} missing: {one.sentence}", flush=True)
    return right, tried, times


def main() -> None:
    """Print a line for each machine."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("planted", "clean"))
    parser.add_argument("machines", nargs="+")
    parser.add_argument("--seeds", default="1")
    given = parser.parse_args()
    first, _, last = given.seeds.partition("-")
    study, total = {"planted": planted, "clean": clean}[given.what], Counter[str]()
    for machine in given.machines:
        done = [study(machine, seed) for seed in range(int(first), int(last or first) + 1)]
        right, tried = sum(one[0] for one in done), sum(one[1] for one in done)
        times = [seconds for one in done for seconds in one[2]]
        print(f"{machine}: {right} of {tried}; {np.median(times):.2f} s, at most {max(times):.1f} s", flush=True)
        total.update(right=right, tried=tried)
    print(f"all: {total['right']} of {total['tried']}")


if __name__ == "__main__":
    main()
