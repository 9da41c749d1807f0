"""Is a drive late or slow? Asked of what the reference alone drives.

A delay and a lag of one time part in the second order only. That is less than what feedback does to a balance of
effort: the command answers to the disturbances that the balance leaves over, within the band of the filter, so that a
fitted time comes out wrong by a share of a sample, with a residual that favours whatever is nearer to that. What the
machine would do by itself, along the reference and without any noise, has nothing to do with the disturbances; it
serves as instrument (A. Janot, P.-O. Vandanjon, M. Gautier, *IEEE Trans. Control Systems Technology* 22, 2014). Where a
joint creeps, friction is late by itself, so that those samples do not count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.discrepancy.confirmation import Data, Judged
from vpm.discrepancy.floor import own_log
from vpm.discrepancy.motion_only import in_motion
from vpm.identify import InverseDynamicsProblem
from vpm.identify.identifiability import column_lengths

Array = NDArray[np.float64]

#: What is late is twice as often late by a delay, which a drive or an instrument may have, as by a lag of the drive.
ODDS = 2.0
#: A model that the data contradict by more standard deviations than this is not preferred to anything.
CONTRADICTED = 3.0
#: Samples for each fitted number, at least.
FEWEST = 10


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
        return abs(self.first) <= CONTRADICTED and self.evidence > float(np.log(ODDS))


def compare_driven(first: Judged, second: Judged, data: Data) -> Verdict | None:
    """Let two fitted models run the records by themselves, and ask the data which of them did what was measured.

    In the balance of each, the rival's own run leaves a gap. Its part in the measured residual is estimated with the
    gap as its own instrument and the slopes along the own run as those of the fitted parameters: 0 of a model that is
    right, 1 of one whose rival is. None where one of them cannot follow its references.
    """
    problems = (data.training, data.unseen)
    mine, its = _own_runs(first, data), _own_runs(second, data)
    if mine is None or its is None:
        return None
    counted = np.concatenate([in_motion(problem) for problem in problems])
    one = _part(first, problems, mine, its, counted)
    other = _part(second, problems, its, mine, counted)
    return Verdict(min(one[0], other[0]), one[1], other[1])


def _own_runs(judged: Judged, data: Data) -> list[InverseDynamicsProblem] | None:
    """The problems on what a model does by itself; None where it cannot follow its references."""
    if data.simulation is None or data.simulation.mode != "closed_loop":
        return None
    found = []
    for problem in (data.training, data.unseen):
        logs = [own_log(judged.model, record, data.simulation.setup) for record in problem.experiments]
        whole = [log for log in logs if log is not None]
        if len(whole) < len(logs):
            return None
        found.append(problem.along_others(judged.model, whole))
    return found


def _part(
    judged: Judged,
    problems: tuple[InverseDynamicsProblem, ...],
    own: list[InverseDynamicsProblem],
    rival: list[InverseDynamicsProblem],
    counted: Array,
) -> tuple[float, float]:
    """Size of the rival's gap beside the parameters, and of its part in the residual, in standard deviations."""
    model, theta = judged.model, judged.model.theta
    columns = [model.index(name) for name in judged.free]
    measured = [problem.evaluate(model, theta, columns) for problem in problems]
    alone = [problem.evaluate(model, theta, columns) for problem in own]
    other = [problem.evaluate(model, theta)[0] for problem in rival]
    residual = counted * np.concatenate([r for r, _ in measured])
    gap = counted * np.concatenate([r - mine for r, (mine, _) in zip(other, alone, strict=True)])
    slopes = counted[:, None] * np.vstack([j for _, j in measured])
    instruments = counted[:, None] * np.vstack([j for _, j in alone])
    samples = np.count_nonzero(residual)
    if samples < FEWEST * (len(columns) + 1) or not np.any(gap):
        return 0.0, 0.0
    regressors, instruments = np.column_stack([slopes, -gap]), np.column_stack([instruments, gap])
    lengths = column_lengths(instruments)
    regressors, instruments = regressors / lengths, instruments / lengths
    inverse = np.linalg.pinv(instruments.T @ regressors, rcond=1e-12)
    step = -inverse @ (instruments.T @ residual)
    left = residual + regressors @ step
    deviation = float(np.sqrt(left @ left / samples))
    spread = deviation * float(np.sqrt((inverse @ (instruments.T @ instruments) @ inverse.T)[-1, -1]))
    known = instruments[:, :-1]
    beside = gap - known @ np.linalg.lstsq(known, gap, rcond=1e-10)[0]
    if deviation == 0.0 or spread == 0.0:
        return 0.0, 0.0
    return float(np.linalg.norm(beside)) / deviation, float(step[-1]) / spread
