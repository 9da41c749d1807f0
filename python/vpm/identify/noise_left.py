"""What noise leaves of a balance of effort: that of the instruments, and that of drives that do not quite do as told.

How noisy instruments are, a log says by itself. What drives deliver beside their commands nobody measures, but it
leaves its trace: where a drive had been given another command, the same motion would leave another residual. So the
noise of the drives is as large as what a log leaves asks for, beyond what its instruments leave: components of variance
by the method of moments (S. Searle, G. Casella, C. McCulloch, *Variance Components*, 1992, chapter 5). Differences
between neighbours are compared, from which what a model lacks beside a slow motion all but vanishes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from vpm.experiment import Experiment, noise_std
from vpm.identify.balance import InverseDynamicsProblem
from vpm.identify.beginning import begun_again
from vpm.model import Model

Array = NDArray[np.float64]

#: Order of the differences, and draws that tell what noise leaves of them.
ORDER, TRIALS = 2, 3
#: Share of a command's size by which it is moved to see what is left.
MOVED = 1e-3


@dataclass(frozen=True)
class Noise:
    """Standard deviations of white noise on the channels of some records, in the units of their data.

    Attributes
    ----------
    instruments, drives : ndarray, shape (records, channels)
        Of readings, and of what commands do not tell.
    """

    instruments: Array
    drives: Array

    def drawn(self, records: Sequence[Experiment], random: np.random.Generator) -> list[tuple[Array, Array]]:
        """One draw for each record: noise of its readings, and of its drives, both of the shape of its data."""
        return [
            (seen * random.standard_normal(e.data.shape), told * random.standard_normal(e.data.shape))
            for e, seen, told in zip(records, self.instruments, self.drives, strict=True)
        ]


def mirrored(draw: Sequence[tuple[Array, Array]]) -> tuple[Sequence[tuple[Array, Array]], ...]:
    """A draw, and the same turned round: what a balance is linear in cancels from the mean of both."""
    return draw, [(-seen, -told) for seen, told in draw]


def noise_of(
    model: Model, data: InverseDynamicsProblem, quiet: Sequence[Experiment], random: np.random.Generator
) -> Noise:
    """The noise in the records of a balance, as a fitted model understands them.

    Parameters
    ----------
    model : Model
        As fitted.
    data : InverseDynamicsProblem
    quiet : sequence of Experiment
        The records as the model would have written them without noise: what these leave no drive is to blame for.
    random : Generator
    """
    same, names = data.on(data.experiments), compared(data)
    instruments = np.array([[noise_std(e[c]) if c in names else 0.0 for c in e.channels] for e in data.experiments])
    silent = np.zeros_like(instruments)
    told = [Noise(silent, moved) for moved in _commands_moved(data)]
    if not told:
        return Noise(instruments, silent)

    def powers(residuals: Array) -> Array:
        return np.asarray(np.mean([_powers(data, one) for one in residuals], axis=0))

    residual = same.evaluate(model, model.theta)[0]
    of_log = _powers(data, residual)
    of_quiet = powers(noisy(model, begun_again(model, data.on(quiet)), Noise(instruments, silent), random, TRIALS))
    by_drive = [powers(noisy(model, same, each, random, TRIALS) - residual) for each in told]
    scale = 1.0 / np.where(of_log > 0.0, of_log, 1.0)
    shares, _ = nnls((np.array(by_drive) * scale).T, np.maximum(of_log - of_quiet, 0.0) * scale)
    drives = np.sum([np.sqrt(share) * each.drives for share, each in zip(shares, told, strict=True)], axis=0)
    return Noise(instruments, drives)


def compared(data: InverseDynamicsProblem) -> tuple[str, ...]:
    """Readings that a balance compares."""
    return (*(f"{joint}.position" for joint in data.motions[0].joints), *data.shown)


def noisy(model: Model, data: InverseDynamicsProblem, noise: Noise, random: np.random.Generator, draws: int) -> Array:
    """The residual of a fitted model with draws of noise added to its records, shape (draws, n)."""
    found = []
    for _ in range(draws):
        both = noise.drawn(data.experiments, random)
        added = [replace(e, data=e.data + seen - told) for e, (seen, told) in zip(data.experiments, both, strict=True)]
        found.append(data.on(added).evaluate(model, model.theta)[0])
    return np.array(found)


def _commands_moved(data: InverseDynamicsProblem) -> list[Array]:
    """For each command of the records a small part of its size (records, channels), zero where it never changes."""
    commands = [name for name in data.motions[0].drivers if name.endswith(".command")]
    sizes = [
        np.array([[MOVED * float(np.std(e[c])) if c == command else 0.0 for c in e.channels] for e in data.experiments])
        for command in commands
    ]
    return [size for size in sizes if np.any(size)]


def _powers(data: InverseDynamicsProblem, residual: Array) -> Array:
    """Mean square of the differences of each block's residual, where all that they reach counts."""
    found = []
    for block in data.blocks:
        counts = np.convolve(block.moving > 0.0, np.ones(ORDER + 1), "valid") > ORDER + 0.5
        steps = np.diff(residual[block.samples], ORDER)[counts]
        found.append(float(np.mean(steps**2)) if steps.size else 0.0)
    return np.array(found)
