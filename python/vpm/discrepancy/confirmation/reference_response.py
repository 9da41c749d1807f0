"""Reference response: delay or lag of a drive, discriminated by the closed-loop response to the reference alone.

A delay and a lag of one time constant differ in second order only. Feedback disturbs the inverse-dynamics residual by
more than that: within the filter's band the command reacts to the disturbances that remain in the residual. The
noise-free response of a model to its reference does not depend on them. So both models predict the records in closed
loop, each with the parameters that suit it best. Their difference is then sought in the prediction error, beside what
the parameters may change. For oil and valves a share of each reading counts as noise, frequency by frequency: no model
of them is exact to that share.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Data, Judged
from vpm.discrepancy.confirmation.refusal import NEGLIGIBLE
from vpm.discrepancy.confirmation.whittle_likelihood import (
    RANK,
    ClosedLoopPrediction,
    Spectra,
    fit_prediction,
    least,
    spectra,
)
from vpm.errors import VpmError
from vpm.identify.identifiability import column_lengths
from vpm.identify.response_along_motion import has_own_drives

#: Prior odds: a delay, which drives and instruments may have, is twice as frequent as a lag, which only drives have.
ODDS = 2.0


@dataclass(frozen=True)
class Verdict:
    """Verdict of the reference response on two models."""

    #: By how many standard deviations of the noise they differ along it, the smaller of both views; 0 where it cannot
    #: be said.
    apart: float
    #: Estimated part of the rival in the error of each model, in standard deviations, with an error of one. It is zero
    #: for the right model, and the whole difference for the wrong one.
    first: float
    second: float

    @property
    def evidence(self) -> float:
        """Log-likelihood ratio of two models by their reference responses.

        No model is exact: beside the noise there is what it leaves out, of a size that nobody knows. With as much of
        it as of noise, give or take, an error has Student's distribution with one degree of freedom (a normal one of
        unknown variance; K. Lange, R. Little and J. Taylor, *J. American Statistical Association* 84, 1989): data that
        contradict both models say little of which is right, and near both they say what normal errors would.
        """
        return float(np.log1p(self.second**2) - np.log1p(self.first**2))

    def prefers_first(self, odds: float = ODDS) -> bool:
        """Whether the reference response makes the first model more likely beyond the prior odds."""
        return self.evidence > float(np.log(odds))


class Runs:
    """Reference responses of models, each fitted and computed once; all but the first start beside another."""

    def __init__(self, data: Data) -> None:
        self.data = data
        self._known: list[tuple[Judged, ClosedLoopPrediction | None]] = []

    def __call__(self, judged: Judged) -> ClosedLoopPrediction | None:
        """Reference response of a model; None where it cannot follow its references."""
        for known, run in self._known:
            if known is judged:
                return run
        run = self._worked_out(judged)
        self._known.append((judged, run))
        return run

    def _worked_out(self, judged: Judged) -> ClosedLoopPrediction | None:
        simulation = self.data.simulation
        if simulation is None or simulation.mode != "closed_loop":
            return None
        records = (*self.data.training.experiments, *self.data.validation.experiments)
        beside = next((run for _, run in reversed(self._known) if run is not None), None)
        try:
            return fit_prediction(judged.model, judged.free, records, simulation.setup, beside)
        except VpmError:
            return None


def compare_driven(first: Judged, second: Judged, data: Data, runs: Runs | None = None) -> Verdict | None:
    """Compare two models by their reference responses, each with its best parameters.

    The part of the rival's difference in a model's error is estimated together with the fitted parameters. It is 0 for
    a right model, and 1 if its rival is right. None where one of them cannot follow its references. With ``runs``, what
    was worked out for another comparison is known.
    """
    runs = runs or Runs(data)
    one = runs(first)
    other = None if one is None else runs(second)
    if one is None or other is None:
        return None
    views = [part(against(*pair), inexact(pair[0])) for pair in ((one, other), (other, one))]
    return Verdict(min(views[0][0], views[1][0]), views[0][1], views[1][1])


def against(mine: ClosedLoopPrediction, rival: ClosedLoopPrediction) -> Spectra:
    """Spectra of a reference response: its error, the difference to its rival, and its derivatives."""
    return spectra(mine.model, mine.problem, np.column_stack([mine.left, mine.left - rival.left, mine.slopes]))


def inexact(run: ClosedLoopPrediction) -> Spectra | None:
    """Spectra of the model error that oil drives cause in a reference response; None without drive states.

    A motion of a few hertz is far above noise. Pressures depend on how a held command changes within a sample, how a
    valve shuts and how much oil pipes hold. That exceeds the difference of a delay and a lag there.
    """
    if not has_own_drives(run.model):
        return None
    problem = run.problem
    records = {record.name: record for record in problem.experiments}
    read = np.zeros(run.left.size)
    for block in problem.blocks:
        reading = records[block.experiment][block.channel]
        read[block.samples] = block.weight * (reading - np.mean(reading))[-block.time.size :]
    return spectra(run.model, problem, NEGLIGIBLE * read[:, None])


def part(transforms: Spectra, floor: Spectra | None = None) -> tuple[float, float]:
    """Size of the difference of two reference responses, and its part in the error, in standard deviations.

    ``floor`` is what no model is exact to, see `inexact`.
    """
    _, _, rows = least(transforms, floor)
    left, gap, slopes = rows[:, 0], rows[:, 1], rows[:, 2:]
    slopes = slopes / column_lengths(slopes)
    beside = gap - slopes @ np.linalg.lstsq(slopes, gap, rcond=RANK)[0]
    apart = float(np.linalg.norm(beside))
    if apart <= RANK * float(np.linalg.norm(gap)):
        return 0.0, 0.0
    return apart, float(beside @ left) / apart
