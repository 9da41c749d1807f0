"""How often 95 % intervals of `vpm.identify` hold the truth, and whether it warns where the model lacks an effect.

Each seed draws a machine around its model file, 0 to 3 effects, and a motion. A simulation in fine steps under a
sampled controller gives the log: encoders and gauges are noisy, and drives do not quite deliver what they are told. The
machine begins in motion. The model is fitted to that one log, in the default mode.

python benches/coverage.py axis --seeds 20000 20200
python benches/coverage.py flexible_arm --seeds 20000 20060 --lacking 0
"""

from __future__ import annotations

import argparse
import time
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.stats import beta

import vpm
from coverage_machines import MACHINES, Effect, Machine
from vpm.identify import Fit, identify

Array = NDArray[np.float64]

#: Most effects of one machine, and how far the model file is from what it describes, in its own uncertainties.
MOST_EFFECTS, FARTHEST = 3, 2.5
#: Relative error of what the model file says of an effect that it has.
UNSURE = 0.1
#: Frequencies of the motion, Hz, and how many there are.
FREQUENCIES, SINES = (0.1, 1.5), 5
#: Error of the steps of the truth; it begins at rest this long before its log, s.
EXACT, BEFORE = "adaptive(1e-8)", 1.0


@dataclass(frozen=True)
class Case:
    """One machine, its model, its log, and what the model lacks."""

    model: vpm.Model
    free: tuple[str, ...]
    truth: Mapping[str, float]
    log: vpm.Experiment
    present: tuple[str, ...]
    lacking: tuple[str, ...]


@dataclass
class Tally:
    """What became of the cases of one kind."""

    fits: int = 0
    warned: int = 0
    refused: int = 0
    apart: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    held: Counter[str] = field(default_factory=Counter)

    def add(self, case: Case, fit: Fit) -> None:
        """Count one fit."""
        self.fits += 1
        self.warned += bool(fit.warnings)
        for name, value, std, (low, high) in zip(fit.names, fit.values, fit.std, fit.intervals, strict=True):
            if np.isfinite(std):
                self.apart[name].append(float((value - case.truth[name]) / max(std, 1e-300)))
                self.held[name] += bool(low <= case.truth[name] <= high)


def drawn(machine: Machine, seed: int, lacking: int | None) -> Case:
    """The case of one seed, whose model lacks so many effects; a draw of half none, half one to three, without."""
    random = np.random.default_rng(seed)
    count = int(random.integers(0, MOST_EFFECTS + 1))
    missing = int(random.integers(0, 2) * random.integers(1, MOST_EFFECTS + 1)) if lacking is None else lacking
    picked = _picked(machine, random, max(count, missing))
    absent, present = picked[:missing], picked[missing:]
    content = machine.content()
    base = vpm.Model.from_dict(content)
    free = base.adjustable
    true = base.with_parameters({name: _true(base, name, random) for name in free})
    model = base
    truth = {name: true.parameters[name].value for name in free}
    for effect in present:
        values = {name: float(random.uniform(*span)) for name, span in effect.sizes.items()}
        true = true.with_effect(effect.name, at=effect.at, **values, **effect.known)
        guessed = {n: v * (1.0 + UNSURE * float(np.clip(random.standard_normal(), -2, 2))) for n, v in values.items()}
        model = model.with_effect(effect.name, at=effect.at, **guessed, **effect.known)
        names = model.effect(effect.name, effect.at).parameter_names
        free += tuple(names[name] for name in values)
        truth |= {names[name]: value for name, value in values.items()}
    for effect in absent:
        values = {name: float(random.uniform(*span)) for name, span in effect.sizes.items()}
        true = true.with_effect(effect.name, at=effect.at, **values, **effect.known)
    log = recorded(machine, true, random, f"seed {seed}")
    return Case(model, free, truth, log, tuple(e.label for e in present), tuple(e.label for e in absent))


def _picked(machine: Machine, random: Generator, count: int) -> list[Effect]:
    """So many effects, no two of which act on the same place by the same name or exclude each other."""
    chosen: list[Effect] = []
    for place in random.permutation(len(machine.effects)):
        effect = machine.effects[place]
        if len(chosen) < count and not any(effect.group and effect.group == other.group for other in chosen):
            chosen.append(effect)
    return chosen


def _true(model: vpm.Model, name: str, random: Generator) -> float:
    parameter = model.parameters[name]
    away = float(np.clip(random.standard_normal(), -FARTHEST, FARTHEST))
    return parameter.value + away * float(parameter.uncertainty or 0.0)


def recorded(machine: Machine, true: vpm.Model, random: Generator, name: str) -> vpm.Experiment:
    """A log of the true machine under its controller."""
    step, lead = machine.time_step, round(BEFORE / machine.time_step)
    samples = lead + round(machine.seconds / step)
    wanted = machine.start[:, None] + machine.way[:, None] * _motion(random, samples, step, len(machine.way))
    driven = [joint for joint in true.joints if joint not in machine.swing]
    start = dict(zip([f"{joint}.position" for joint in driven], machine.start.tolist(), strict=True))
    start |= {f"{joint}.position": size * random.standard_normal() for joint, size in machine.swing.items()}
    sim = vpm.Simulation(true, step, integrator=EXACT, state=machine.first_state(true, start), compiled=True)
    channels = list(machine.noise)
    places, levels = [sim.channels.index(c) for c in channels], np.array(list(machine.noise.values()))
    seen, commands = np.zeros((samples, len(channels))), np.zeros((samples, len(true.inputs)))
    joints, before = len(machine.way), machine.start
    for k in range(samples):
        seen[k] = sim.outputs[places] + levels * random.standard_normal(len(levels))
        position = seen[k, :joints]
        speed = (position - before) / step
        before = position
        commands[k] = machine.command(wanted[:, k] - position, speed)
        sim.step(commands[k] + machine.command_noise * random.standard_normal(commands.shape[1]))
    columns = {channel: seen[lead:, n] for n, channel in enumerate(channels)}
    columns |= {channel: commands[lead:, n] for n, channel in enumerate(true.input_channels)}
    return vpm.Experiment.from_arrays(step * np.arange(samples - lead), columns, model=true, name=name)


def _motion(random: Generator, samples: int, step: float, joints: int) -> Array:
    """Sines for each joint, of about a deviation of one, that begin at rest."""
    t = step * np.arange(samples)
    begun = np.clip(t / BEFORE, 0.0, 1.0)
    rise = begun**3 * (10.0 - 15.0 * begun + 6.0 * begun**2)
    frequency = np.exp(random.uniform(*np.log(FREQUENCIES), (joints, SINES, 1)))
    phase = random.uniform(0.0, 2.0 * np.pi, (joints, SINES, 1))
    size = random.uniform(0.5, 1.0, (joints, SINES, 1)) / np.sqrt(frequency)
    sines = np.sum(size * np.sin(2.0 * np.pi * frequency * t + phase), axis=1)
    return np.asarray(rise * sines / np.std(sines, axis=1, keepdims=True))


def between(hits: int, count: int) -> tuple[float, float]:
    """95 % interval of a share (C. Clopper and E. Pearson, *Biometrika* 26, 1934)."""
    low = float(beta.ppf(0.025, hits, count - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, count - hits)) if hits < count else 1.0
    return low, high


def study(machine: Machine, seeds: Sequence[int], lacking: int | None, verbose: bool) -> dict[str, Tally]:
    """Fit the cases of these seeds."""
    tallies = {"complete": Tally(), "lacking": Tally()}
    for seed in seeds:
        case = drawn(machine, seed, lacking)
        tally = tallies["lacking" if case.lacking else "complete"]
        try:
            fit = identify(case.model, case.log, case.free)
        except vpm.VpmError as error:
            tally.refused += 1
            print(f"{seed}: {error}", flush=True)
            continue
        tally.add(case, fit)
        if verbose:
            truth = np.array([case.truth[name] for name in fit.names])
            apart = np.round((fit.values - truth) / fit.std, 1).tolist()
            said = [sentence[:110] for sentence in fit.warnings]
            print(f"{seed} has {case.present} lacks {case.lacking}: {apart} {said}", flush=True)
    return tallies


def told(kind: str, tally: Tally) -> None:
    """Print one table."""
    if not tally.fits + tally.refused:
        return
    hits, count = sum(tally.held.values()), sum(map(len, tally.apart.values()))
    low, high = between(tally.warned, max(tally.fits, 1))
    print(f"\n{kind}: {tally.fits} fits, {tally.refused} refused")
    print(f"warned: {tally.warned} of {tally.fits}, {100 * tally.warned / max(tally.fits, 1):.1f} % "
          f"({100 * low:.1f} to {100 * high:.1f})")  # fmt: skip
    print("| parameter | intervals | hold the truth | 95 % interval of that | mean of z | std of z |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, apart in tally.apart.items():
        low, high = between(tally.held[name], len(apart))
        print(f"| {name} | {len(apart)} | {100 * tally.held[name] / len(apart):.1f} % | {100 * low:.1f} to "
              f"{100 * high:.1f} % | {np.mean(apart):+.2f} | {np.std(apart):.2f} |")  # fmt: skip
    if count:
        low, high = between(hits, count)
        print(f"| all | {count} | {100 * hits / count:.1f} % | {100 * low:.1f} to {100 * high:.1f} % | | |")


def main() -> None:
    """Read the arguments and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("machine", choices=sorted(MACHINES))
    parser.add_argument("--seeds", type=int, nargs=2, default=(20000, 20200), help="first, and the one after the last")
    parser.add_argument("--lacking", type=int, choices=range(MOST_EFFECTS + 1), help="effects that every model lacks")
    parser.add_argument("--verbose", action="store_true", help="one line for each seed")
    asked = parser.parse_args()
    begin = time.process_time()
    tallies = study(MACHINES[asked.machine], range(*asked.seeds), asked.lacking, asked.verbose)
    for kind, tally in tallies.items():
        told(kind, tally)
    print(f"\n{asked.machine}, seeds {asked.seeds[0]} to {asked.seeds[1] - 1}: {time.process_time() - begin:.0f} s")


if __name__ == "__main__":
    main()
