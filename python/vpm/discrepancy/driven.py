"""Is a drive late or slow? Asked of what the reference alone drives.

A delay and a lag of one time part in the second order only. That is less than what feedback does to a balance of
effort: the command answers to the disturbances that the balance leaves over, within the band of the filter. What the
machine does by itself, along the reference and without any noise, has nothing to do with the disturbances. So both
models run the records in closed loop, and what parts their runs is looked for in what the runs leave of the log, beside
what the fitted parameters may change. The runs hold the whole spectrum, of which the balance compares the lowest part
only, and each frequency counts by the noise that is left there: generalised least squares with an unknown spectrum
(P. Whittle, *J. Royal Statistical Society B* 15, 1953).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from vpm.discrepancy.confirmation import Data, Judged
from vpm.errors import VpmError
from vpm.identify import OutputErrorProblem
from vpm.identify.identifiability import column_lengths
from vpm.simulate import Setup

Array = NDArray[np.float64]
Spectra = list[NDArray[np.complex128]]

#: What is late is twice as often late by a delay, which a drive or an instrument may have, as by a lag of the drive.
ODDS = 2.0
#: A model that the data contradict by more standard deviations than this, and by more than this share of what parts it
#: from its rival, is not preferred to anything.
CONTRADICTED, IN_PART = 3.0, 0.25
#: Steps of the integration in one delay or lag, and most of them in one sampling interval: both times may be shorter
#: than that, and an error of steps is as small a difference as theirs.
STEPS, MOST_STEPS = 3, 10
#: Tapered share of each record; frequencies left out at the low end, where a record is one slope.
TAPERED, LOWEST = 0.1, 2
#: The spectrum of noise is the mean over this share of the frequencies, and over so many at least.
SMOOTHED, FEWEST = 1.0 / 60.0, 15
#: Times that the spectrum is taken again from what is left.
ROUNDS = 3
#: Share of itself from which on a column stands beside others.
RANK = 1e-10


@dataclass(frozen=True)
class Verdict:
    """What the reference says of two models.

    Attributes
    ----------
    apart : float
        By how many standard deviations of the noise they differ along it, the smaller of both views; 0 where it cannot
        be said.
    first, second : float
        By how many standard deviations the data ask each of them for what the other one does instead.
    """

    apart: float
    first: float
    second: float

    @property
    def evidence(self) -> float:
        """Logarithm of how many times as likely the data are with the first model as with the second.

        Of a model that is right the data ask nothing, and of one that is wrong as much as both differ, with an error of
        one standard deviation: the likelihood ratio of two normal means, of which both views give one.
        """
        return 0.5 * self.apart * (self.second - self.first)

    @property
    def prefers_first(self) -> bool:
        """Whether the data, which do not contradict it, make the first more likely by more than ``ODDS``."""
        return abs(self.first) <= max(CONTRADICTED, IN_PART * self.apart) and self.evidence > float(np.log(ODDS))


def compare_driven(first: Judged, second: Judged, data: Data) -> Verdict | None:
    """Let two fitted models run the records by themselves, and ask the data which of them did what was measured.

    Of what one model leaves, the part of the gap to its rival's run is estimated together with changes of its fitted
    parameters: 0 of a model that is right, 1 of one whose rival is. None where one of them cannot follow its
    references.
    """
    if data.simulation is None or data.simulation.mode != "closed_loop":
        return None
    fine = replace(data.simulation.setup, substeps=_steps((first, second), data))
    try:
        problems = [_problems(first, data, setup) for setup in (fine, data.simulation.setup)]
        runs = [[_run(judged, *pair) for pair in zip(*problems, strict=True)] for judged in (first, second)]
    except VpmError:
        return None
    views = []
    for mine, rival in (runs, runs[::-1]):
        spectra: Spectra = []
        for problem, (left, slopes), (its, _) in zip(problems[0], mine, rival, strict=True):
            spectra += _spectra(problem, np.column_stack([left, left - its, slopes]))
        views.append(_part(spectra))
    return Verdict(min(views[0][0], views[1][0]), views[0][1], views[1][1])


def _steps(judged: Sequence[Judged], data: Data) -> int:
    """Steps of the integration in one sampling interval."""
    times = [one.model.parameters[name] for one in judged for name in one.free]
    shortest = min((time.value for time in times if time.unit == "s" and time.value > 0.0), default=np.inf)
    interval = max(record.dt for record in data.unseen.experiments)
    least = 1 if data.simulation is None else data.simulation.setup.substeps
    return max(least, min(MOST_STEPS, ceil(STEPS * interval / shortest)))


def _problems(judged: Judged, data: Data, setup: Setup) -> list[OutputErrorProblem]:
    """Training and unseen records, run in closed loop."""
    parts = (data.training, data.unseen)
    return [OutputErrorProblem(judged.model, part.experiments, "closed_loop", setup=setup) for part in parts]


def _run(judged: Judged, fine: OutputErrorProblem, coarse: OutputErrorProblem) -> tuple[Array, Array]:
    """What the run of a model leaves of the logs, and its derivative by the fitted parameters, to few digits."""
    model, theta = judged.model, judged.model.theta
    left, _ = fine.evaluate(model, theta)
    _, slopes = coarse.evaluate(model, theta, [model.index(name) for name in judged.free])
    return left, slopes


def _spectra(problem: OutputErrorProblem, columns: Array) -> Spectra:
    """Transforms of what the runs leave of each reading; a command is what the controller made of the readings."""
    from scipy.signal.windows import tukey  # takes a second, and few need it

    found: Spectra = []
    for block in problem.blocks:
        if not block.channel.endswith(".command"):
            window = tukey(block.time.size, TAPERED)
            found.append(np.fft.rfft(columns[block.samples] * window[:, None], axis=0)[LOWEST:])
    return found


def _part(spectra: Spectra) -> tuple[float, float]:
    """Size of the rival's gap beside the parameters, and its part in what is left, both in standard deviations.

    The columns of each spectrum are what is left, the gap, and the slopes.
    """
    noise = [s[:, 0] for s in spectra]
    apart = part = 0.0
    for _ in range(ROUNDS):
        rows = np.vstack([_weighted(s, one) for s, one in zip(spectra, noise, strict=True)])
        left, gap, slopes = rows[:, 0], rows[:, 1], rows[:, 2:]
        slopes = slopes / column_lengths(slopes)
        beside = gap - slopes @ np.linalg.lstsq(slopes, gap, rcond=RANK)[0]
        apart = float(np.linalg.norm(beside))
        if apart <= RANK * float(np.linalg.norm(gap)):
            return 0.0, 0.0
        part = float(beside @ left) / apart
        lengths = column_lengths(rows[:, 1:])
        step = np.linalg.lstsq(rows[:, 1:] / lengths, -left, rcond=RANK)[0] / lengths
        noise = [s[:, 0] + s[:, 1:] @ step for s in spectra]
    return apart, part


def _weighted(spectrum: NDArray[np.complex128], left: NDArray[np.complex128]) -> Array:
    """Real and imaginary parts relative to the noise, whose spectrum is the mean of what is left near a frequency."""
    power = np.abs(left) ** 2
    smooth = uniform_filter1d(power, max(FEWEST, int(SMOOTHED * power.size)), mode="reflect")
    weight = np.sqrt(2.0 / np.maximum(smooth, 1e-12 * max(float(smooth.max()), 1e-300)))
    return np.asarray(np.vstack([spectrum.real * weight[:, None], spectrum.imag * weight[:, None]]))
