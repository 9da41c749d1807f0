"""Settings of a ranking: every number that decides."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from vpm.discrepancy.settings import SLIGHT
from vpm.ranking.calibration import shipped

# ---- what a tracker is, and what of the records is fitted ------------------------------------------------------

#: Damping of the error of a tracker: flat up to the bandwidth, and falling off from there (S. Butterworth, 1930).
DAMPING = float(np.sqrt(0.5))
#: Bandwidths with which pressures of chambers may be drawn, Hz; with the last one they are those that were read. Noise
#: of a drive moves pressures as fast as its valve does, noise of gauges does not: records tell which is the larger.
OF_PRESSURES = (1.0, 10.0, 100.0, np.inf)
#: Fewest steps of the integrator within a sample where a joint is split: contacts ring fast. Where no contact opens,
#: and derivatives are all that is asked or springs are taken with order 4, steps may be as long as this, s.
STEPS, COARSE = 4, 1e-3
#: Longest steps where structures are compared and errors are not controlled, of order 2 and of order 4, s.
LONGEST, LONGEST_OF_FOURTH_ORDER = 6e-4, 2e-3
#: Short steps that cost as much as one of controlled error.
CONTROLLED = 3
#: Stretches into which a record is cut, so that each of its phases is in what is fitted and in what is held back.
STRETCHES = 3
#: Parts of a stretch, of which one is held back, the last one unless another is named: two thirds tell the
#: parameters, and one third is enough for pieces to compare.
PARTS = 3

#: By which share of its deviation a parameter is moved for a difference.
MOVE = 1e-5

# ---- what noise is like ------------------------------------------------------------------------------------------

#: Degrees of freedom of Student's density among which that of the errors is chosen; without end it is the normal one.
TAILS = (3.0, 4.0, 6.0, 10.0, 20.0, np.inf)
#: Bands in an octave of the spectrum, as of acoustics, and fewest lines of a band: their mean is off by 0.4 of itself.
PER_OCTAVE, LINES = 3, 12
#: The level of a band may be higher than its lines say, as sure as a normal variable is below so many deviations: by
#: chance it is higher still once in 700 bands.
SURE = 3.0
#: Draws of the noise of commands, with a seed as any other: with them each line of a spectrum is known to a half.
DRAWS, SEED = 4, 20160331

# ---- where fits begin and how they go on -------------------------------------------------------------------------

#: Steps of a regression of masses and friction, and the share of an error that is noise in the first one.
REGRESSIONS, QUIET = 3, 0.01
#: Shares of a step of which the best by a parabola is tried where the whole step is too long, each 0.7 of the one
#: before, and the one that is tried where the model runs away at its end.
NEARER, RETREAT = 0.7 ** np.arange(1, 10), 0.08
#: Shares of a step that are tried, and of one by secants, which may point elsewhere: new derivatives help more there.
TRIALS, TRIALS_BY_SECANTS = 4, 2
#: Weight of the prior of a place in a step beside a size, see `Structure.anywhere`: it leads elsewhere than it points.
FAINT = 1e-6
#: Share of the change by one start value that the next smaller one makes, about: the catalogue's are four times apart.
NEXT_START = 0.25
#: Share of its force by which a stop is stronger against the fastest impact, to begin with.
LOSS = 0.1
#: Where a place that may lie anywhere begins, as multiples of half of the way that is seen, from its middle: within the
#: way, just outside on either side, and so far away that it pulls nearly the same everywhere.
PLACES = (0.0, -2.0, 2.0, -8.0, 8.0)
#: Waves on all of the way that is seen by which start periods differ at least: a fit finds its way over less than that.
ALIKE = 0.5
#: Shares of the way from the end of a range to the middle of its prior where fits with another effect may begin.
OFF_ENDS = (1.0, 0.5, 0.25, 0.125)
#: Delay that is nothing unusual, s: a few intervals of a field bus.
DELAY = 5e-3

# ---- what is another effect --------------------------------------------------------------------------------------

#: Factor between neighbouring shapes of a law whose shape is free: closer ones are nearly one, wider ones leave gaps.
OCTAVE = 2.0


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Settings that decide in a ranking."""

    #: Bandwidths of the trackers, Hz: a slow one, whose error is wide and easy to rank, and one that keeps a load
    #: behind a backlash in step. Own vibrations of joints without a drive may make the first one slower.
    bands: tuple[float, ...] = (1.0, 10.0)
    #: Error of a step where structures are compared, relative to each state and its natural size: it must not pass for
    #: an effect.
    exact: float = 3e-5
    #: Time at the beginning of each record that is left out, s: what a tracker makes of the first state. It grows with
    #: the period of the first one of `bands`.
    settling: float = 0.5
    pieces: int = 20  #: Pieces of the held-back stretches between which an effect has to repeat.
    #: By how much a law differs from the machine, as a share of the amplitude that it explains. Another effect over the
    #: same states at the same place has to do more than that. A richer one has to do better by it than a plainer one.
    #: Between effects over other states evidence decides.
    inexact: float = 0.01
    #: An effect that does less than this share of the amplitude of all effects of the model is none. Those whose law is
    #: exact do not count here, see `EffectType.exact`.
    slight: float = SLIGHT
    second: float = 0.05  #: The same of the amplitude of effects that were added, of whose laws less is known.
    #: Share of the error power above which an effect counts beside those all the same, and if few pieces show it.
    #: Errors of laws do not have the shape of another law by chance.
    clear: float = 0.85
    #: Share of the error power that another effect has to remove, of fitted and of held-back stretches.
    worth: float = 0.06
    score: float = 3.0  #: Standard deviations between pieces by which that differs from nothing.
    seats: int = 8  #: Effects that do nothing at their start, that are fitted under each tracker.
    starts: int = 3  #: Start values that are fitted, of those that were screened, of each effect.
    #: Effects that leave up to so many times the error power of the best, or no more than laws are wrong by, are fitted
    #: to the end.
    finished: float = 2.5
    turns: int = 3  #: Fits that follow each other until nothing is gained any more.
    iterations: int = 8  #: Steps of a fit.
    patience: float = 3.0  #: By how much more than a step predicts a fit may still gain before it is given up.
    #: Of the cost that the most promising fit of a look saves: another one that cannot save as much is given up.
    share: float = 0.5
    tolerance: float = 0.5  #: Gain of a step, nats, below which a fit ends if errors are independent.
    reach: float = 6.0  #: Deviations of its prior that a parameter may move in a step.
    #: Length of the autoregression that whitens the error of a channel where evidence is told, samples.
    order: int = 12
    #: Evidence, nats, at which an effect is as probable as none. Chance makes more of an effect that is not there once
    #: in exp(odds) times at most (A. Markov's inequality): one in a hundred is named if a hundred are tried.
    odds: float = 9.2
    #: Power of evidence in probabilities: no model is exact. As it was fitted to cases of which the truth is known.
    tempering: float = field(default_factory=lambda: shipped().tempering)
    #: How often evidence leads astray, likewise: then all that was tried, and what was not, is as probable.
    astray: float = field(default_factory=lambda: shipped().astray)
    same: float = 1.0  #: Effects between which the records decide by fewer nats than this, in the mean, are rivals.
    sure: float = 0.95  #: The most probable effects that are as probable together are rivals, too.
    effects: int = 4  #: Most effects of a structure.

    def needed(self, samples: int, share: float = 1.0) -> float:
        """Least gain, nats, for which an effect is worth it, if a share of the error power of samples is no noise."""
        return float(-0.5 * samples * np.log1p(-self.worth * share))
