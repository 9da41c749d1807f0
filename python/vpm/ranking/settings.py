"""Every number that decides in a ranking."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Numbers that decide.

    Attributes
    ----------
    bands : tuple of float
        Bandwidths of the observers that search, Hz: a slow one, whose residual is wide and easy to rank, and one that
        keeps a load behind a backlash in step.
    widest, narrowest : float
        Bandwidths among which a structure finds its own, Hz.
    order : int
        Length of the autoregression that whitens what an observer leaves of a channel, samples.
    settling : float
        Time at the beginning of each record that is left out, s: what an observer makes of the first state.
    seats : int
        Effects of a round that are fitted for each observer and each way to look at what it leaves.
    least : float
        Gain that a step has to predict, nats, for an effect to be fitted.
    starts : int
        Start values that are fitted, of those that were screened, of an effect that is there at its start already.
    finalists : int
        Effects of a round that are fitted at every bandwidth that serves them.
    optima : int
        Fits of each of these that are pursued: contacts have several optima.
    iterations : int
        Steps of a fit.
    patience : float
        By how much more than a step predicts a fit may still gain before it is given up.
    share : float
        Of the cost that the most promising fit of a look saves: another one that cannot save as much is given up.
    tolerance : float
        Gain of a step, nats, below which a fit ends.
    reach : float
        Deviations of its prior that a parameter may move in a step.
    odds : float
        Evidence, nats, that another effect has to bring.
    inexact : float
        By how much an effect differs from its law, as a share of what it does: another effect may take that up.
    inexact_curve : float
        The same where the other effect shows over the same state at the same site.
    tempering : float
        Power of evidence in probabilities: no model is exact.
    same : float
        Effects between which the records decide by fewer nats than this, in the mean, are one class.
    effects : int
        Most effects of a structure.
    """

    bands: tuple[float, ...] = (1.0, 10.0)
    widest: float = 160.0
    narrowest: float = 0.25
    order: int = 12
    settling: float = 0.5
    seats: int = 5
    least: float = 4.0
    starts: int = 3
    finalists: int = 4
    optima: int = 3
    iterations: int = 8
    patience: float = 3.0
    share: float = 0.5
    tolerance: float = 0.5
    reach: float = 6.0
    odds: float = 16.0
    inexact: float = 0.05
    inexact_curve: float = 0.3
    tempering: float = 0.2
    same: float = 1.0
    effects: int = 4
