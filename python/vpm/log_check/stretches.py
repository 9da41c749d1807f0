"""Faults within one channel: stretches that stand still, clipped values, spikes, coarse steps."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Experiment, noise_std, quantisation_step
from vpm.experiment.noise import PIECES, band_powers
from vpm.log_check.finding import Finding
from vpm.log_check.settings import Settings
from vpm.numbers import Array

#: Where the bands of a spectrum that are looked at end: octaves, and halves of the last one, as shares of its end.
BANDS = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 3 / 4, 1.0)


def odd_stretches(
    record: Experiment, outputs: Sequence[str], inputs: Sequence[str], settings: Settings
) -> Iterator[Finding]:
    """Odd stretches of a record's channels that the model reads, as findings.

    - ``outputs``, ``inputs``: channels that sensors show, and commands
    """
    for name in outputs:
        yield from _of_sensor(record, name, [other for other in outputs if other != name], settings)
    for name in (*outputs, *inputs):
        yield from _clipped(record, name, settings)


def _of_sensor(record: Experiment, name: str, others: Sequence[str], settings: Settings) -> Iterator[Finding]:
    values = record[name]

    def finding(kind: str, sentence: str, repair: str) -> Finding:
        return Finding(kind, (name,), (record.name,), sentence, repair)

    if np.ptp(values) == 0.0:
        yield finding("constant", f"{name} is {values[0]:g} all the time", "check that its column is the right one")
        return
    if np.unique(values).size < settings.levels:
        return
    if frozen := _frozen(record, name, others, settings):
        first, last = (_stamp(record, at) for at in (frozen.start, frozen.stop - 1))
        yield finding(
            "frozen",
            f"{name} stands still from {first} s to {last} s and then jumps",
            "cut that stretch out of the record",
        )
    spikes = _spikes(values, settings)
    if spikes.size:
        yield finding(
            "spikes",
            f"{name} has {spikes.size} {'spike' if spikes.size == 1 else 'spikes'}, the first at "
            f"{_stamp(record, int(spikes[0]))} s",
            "replace these samples by their neighbours",
        )
    step, reach = quantisation_step(values), float(np.ptp(values))
    told = name in record.slower or name in record.retained  # interpolation and resampling take noise, and say so
    if not told and _cut_off(values, step or 0.0, settings):
        yield finding(
            "filtered",
            f"{name} was filtered before it was stored, which makes it late",
            "log it unfiltered, or filter the commands alike",
        )
    if step is not None and step > settings.coarse * reach:
        yield finding(
            "coarse",
            f"{name} was recorded in steps of {step:.3g}, {100.0 * step / reach:.2g} % of its range",
            "log it with more digits, or move the machine further",
        )


def _cut_off(values: Array, step: float, settings: Settings) -> bool:
    """Whether a stretch's noise falls after two equal octaves: a filter does that, no machine.

    Or whether it falls as far between the last two bands: a machine would have to answer like the ninth power of a
    frequency, and a resonance rises before it falls. Noise is as loud at all times; what a machine or its oil does
    in an octave comes and goes with the motion. Motion falls as well, but to the noise of the sensor, which then stays;
    behind a filter there is nothing but rounding to that ``step``. Numbers of a simulation have no noise: their
    spectrum ends where their digits do.
    """
    if len(values) < settings.judged * PIECES:
        return False
    powers, window = band_powers(values, BANDS)
    levels, last = np.median(powers, axis=0), powers[:, -1]
    steady = np.max(powers, axis=0) < settings.level**2 * np.min(powers, axis=0)
    digits = len(values) / PIECES * (settings.digits * np.finfo(np.float64).eps * float(np.max(np.abs(values)))) ** 2
    rounding = max(settings.level * window * step**2 / 12.0, digits)
    if steady[-1] and steady[-2] and _is_flat(levels[-2:], settings) and float(np.median(last)) > rounding:
        return False
    steep = levels[-1] < settings.filtered * levels[-2] and levels[-2] < levels[-3]
    if steady[-1] and steady[-2] and steep and levels[-2] > digits:
        return True
    for place in range(2, len(levels)):
        noise = levels[place - 2 : place]
        falls = levels[place:].min() < settings.filtered * noise[-1]
        if steady[place - 2 : place].all() and _is_flat(noise, settings) and noise[-1] > digits and falls:
            return True
    return False


def _is_flat(levels: Array, settings: Settings) -> bool:
    return float(levels.max()) < settings.level * float(levels.min())


def _stamp(record: Experiment, sample: int) -> str:
    """Time at which a stretch begins or ends, s, with the digits that tell one sample from the next."""
    return f"{round(float(record.time[sample]), max(-math.floor(math.log10(record.dt)), 0)):.15g}"


def _frozen(record: Experiment, name: str, others: Sequence[str], settings: Settings) -> slice | None:
    """The longest stretch of one value, if it ends by a jump, or if the channel has noise elsewhere.

    A reading that does not jump may repeat one value while its joint rests: then the other sensors of that rest, too,
    or all others where it has none. A velocity may repeat one while its position goes on at that speed.
    """
    values, (owner, _, kind) = record[name], name.rpartition(".")
    others = [other for other in others if other.rpartition(".")[0] == owner] or list(others)
    steps = _steps(values, settings)
    run = _longest(steps == 0.0)
    if (
        run.stop - run.start < settings.stuck
        or run.stop >= len(steps)
        or min(values[run.start] - values.min(), values.max() - values[run.start]) <= _rounding(values, settings)
    ):
        return None  # what stays at an end was cut off there
    stretch = slice(run.start, run.stop + 1)
    if abs(steps[run.stop]) > settings.jump * float(np.abs(np.delete(steps, run.stop)).max()):
        return stretch
    gone = values[run.start] * record.time if kind == "velocity" else 0.0
    at_rest = bool(others) and all(
        _rests(record[other] - (gone if other == f"{owner}.position" else 0.0), stretch) for other in others
    )
    return stretch if not at_rest and _is_noisy(np.delete(values, run), settings) else None


def _rests(values: Array, stretch: slice) -> bool:
    """Whether noise and a step of its sensor are all that moves a channel in a stretch.

    Of n normal values the largest lies about sqrt(2 ln n) deviations above the mean (H. Cramér, *Mathematical Methods
    of Statistics*, 1946, section 28.6).
    """
    part, noise = values[stretch], noise_std(values)
    most = 2.0 * noise * float(np.sqrt(2.0 * np.log(part.size))) + (quantisation_step(values) or 0.0)
    return float(np.ptp(part)) <= most


def _is_noisy(values: Array, settings: Settings) -> bool:
    """Whether noise moves a stretch from sample to sample, so that no rest repeats a value."""
    if values.size <= settings.fewest:
        return False
    steps = np.abs(_steps(values, settings))
    least = float(np.min(steps, where=steps > 0.0, initial=np.inf))  # of an encoder, however many digits are written
    return noise_std(values) > max(least, settings.quiet * float(np.median(steps)))


def _steps(values: Array, settings: Settings) -> Array:
    """Steps (N - 1,) of a stretch; those of a computer's rounding, as interpolation leaves them, are none."""
    steps = np.diff(values)
    return np.where(np.abs(steps) <= _rounding(values, settings), 0.0, steps)


def _rounding(values: Array, settings: Settings) -> float:
    return settings.digits * float(np.finfo(np.float64).eps * np.max(np.abs(values)))


def _longest(same: NDArray[np.bool_]) -> slice:
    """Longest stretch of true values as a slice."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(int)))
    if not edges.size:
        return slice(0, 0)
    begins, ends = edges[::2], edges[1::2]
    place = int(np.argmax(ends - begins))
    return slice(int(begins[place]), int(ends[place]))


def _spikes(values: Array, settings: Settings) -> NDArray[np.intp]:
    """Stretches of one sample, far from both neighbours to the same side."""
    before, after = np.diff(values)[:-1], -np.diff(values)[1:]
    usual = np.abs(values[2:] - values[:-2])
    noise = noise_std(values)
    out = np.minimum(np.abs(before), np.abs(after))
    far = (before * after > 0.0) & (out > settings.spike * noise) & (out > settings.spike * usual)
    far &= out > settings.jump * float(np.quantile(np.abs(np.diff(values)), 1.0 - settings.clipped))
    return np.flatnonzero(far) + 1


def _clipped(record: Experiment, name: str, settings: Settings) -> Iterator[Finding]:
    values = record[name]
    if np.unique(values).size < settings.levels:
        return
    levels, counts = np.unique(values, return_counts=True)
    often = [float(level) for level in levels[counts > settings.clipped * values.size] if level != 0.0]
    held = [level for level in often if _is_held(values, level, settings)]
    if any(levels[0] < level < levels[-1] for level in held):
        return  # ramps and steps of whoever sent it: it is held at values within its range, too
    for level in held:
        word, share = "largest" if level == levels[-1] else "smallest", float(np.mean(values == level))
        yield Finding(
            "clipped",
            (name,),
            (record.name,),
            f"{name} stands at its {word} value, {level:.4g}, in {100.0 * share:.2g} % of the samples",
            "check the range of its sensor or the limit of its drive",
        )


def _is_held(values: Array, level: float, settings: Settings) -> bool:
    """Whether a stretch comes to a value at full speed and stays there.

    A swing that turns round is slow there, but no slower than beside it; a machine that rests comes slowly.
    """
    near = max(quantisation_step(values) or 0.0, settings.coarse * float(np.ptp(values)))
    there = values == level
    beside = np.count_nonzero(np.abs(values - level) < 1.5 * near) - np.count_nonzero(there)
    return bool(np.count_nonzero(there) > settings.jump * beside) and _is_abrupt(values, there, settings)


def _is_abrupt(values: Array, there: NDArray[np.bool_], settings: Settings) -> bool:
    """Whether a stretch comes to a value at full speed, as where it is cut off."""
    begins = np.flatnonzero(there[2:] & ~there[1:-1]) + 2
    steps = np.abs(np.diff(values))
    if not begins.size:
        return False
    return float(np.median(steps[begins - 2])) > settings.abrupt * float(np.sqrt(np.mean(steps**2)))
