"""How evidence becomes probability: two numbers, fitted to cases of which the truth is known."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from math import exp, log
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from vpm.errors import DiagnosisError
from vpm.ranking.posterior import probabilities

Array = NDArray[np.float64]

#: The numbers that are shipped.
SHIPPED = Path(__file__).with_name("calibration.json")
#: Ends between which the power of evidence is searched.
TEMPERING = (1e-3, 1.0)
#: Where bins of a reliability diagram begin, but for the first.
BINS = (0.5, 0.7, 0.8, 0.9, 0.95, 0.98)


@dataclass(frozen=True)
class Calibration:
    """What makes probabilities true.

    Attributes
    ----------
    tempering : float
        Power of evidence in probabilities: no model is exact.
    elsewhere : float
        Probability that what is missing is none of what was tried.
    cases : int
        How many cases they were fitted to.
    seeds : str
        Of these cases.
    """

    tempering: float
    elsewhere: float
    cases: int = 0
    seeds: str = ""

    def save(self, path: Path) -> Path:
        """Write them as JSON."""
        path.write_text(json.dumps(asdict(self), indent=2) + "\n", encoding="utf-8")
        return path

    @classmethod
    def load(cls, path: Path) -> Calibration:
        """Read them back."""
        return cls(**json.loads(path.read_text(encoding="utf-8")))


@cache
def shipped() -> Calibration:
    """The numbers that `Settings` begins with."""
    return Calibration.load(SHIPPED)


@dataclass(frozen=True)
class Round:
    """Effects that were weighed against each other in a case of which the truth is known.

    Attributes
    ----------
    gains : tuple of float
        Evidence of each beyond that at which it is as probable as none, nats.
    right : tuple of bool
        Whether each is what was missing.
    missing : bool
        Whether anything was.
    """

    gains: tuple[float, ...]
    right: tuple[bool, ...]
    missing: bool

    def share(self, tempering: float) -> float:
        """Probability that was given to what was true, among what was tried and nothing; zero of what is elsewhere."""
        *shares, none = probabilities(self.gains, tempering)
        told = zip(shares, self.right, strict=True)
        return float(sum(share for share, right in told if right) if self.missing else none)

    def likelihood(self, tempering: float, elsewhere: float) -> float:
        """The same, with what is elsewhere."""
        if self.missing and not any(self.right):
            return elsewhere
        return (1.0 - elsewhere) * self.share(tempering)


def calibrated(rounds: Sequence[Round], seeds: str, cases: int) -> Calibration:
    """The numbers under which what was true was most probable.

    Law: the logarithm of the probability that was given to the truth is a proper score: it is largest in the mean for
    probabilities that are true (I. Good, *J. Royal Statistical Society B* 14, 1952). The share of rounds in which the
    truth was elsewhere is the most likely one, under a prior that says as little as can be (H. Jeffreys, *Proc. Royal
    Society A* 186, 1946).

    Raises
    ------
    DiagnosisError
        No round weighed anything.
    """
    if not rounds:
        raise DiagnosisError("no answer weighed any evidence; calibrate on machines that a ranking covers")
    inside = [one for one in rounds if not one.missing or any(one.right)]
    elsewhere = (len(rounds) - len(inside) + 0.5) / (len(rounds) + 1.0)

    def loss(logarithm: float) -> float:
        return -sum(log(max(one.share(exp(logarithm)), 1e-12)) for one in inside)

    found = minimize_scalar(loss, bounds=(log(TEMPERING[0]), log(TEMPERING[1])), method="bounded")
    tempering = exp(found.x) if inside else TEMPERING[0]
    return Calibration(float(f"{tempering:.3g}"), float(f"{elsewhere:.3g}"), cases, seeds)


@dataclass(frozen=True)
class Reliability:
    """Probabilities of one bin, and how often they were right.

    Attributes
    ----------
    stated : float
        Mean of the probabilities.
    right, count : int
    """

    stated: float
    right: int
    count: int


def reliability(stated: Sequence[float], right: Sequence[bool]) -> list[Reliability]:
    """Probabilities in bins, those without any left out."""
    numbers, outcomes = np.asarray(stated, dtype=np.float64), np.asarray(right, dtype=np.bool_)
    places = np.searchsorted(BINS, numbers, side="right")
    chosen = [places == place for place in range(len(BINS) + 1) if np.any(places == place)]
    return [Reliability(float(np.mean(numbers[c])), int(np.sum(outcomes[c])), int(np.sum(c))) for c in chosen]


def calibration_error(bins: Sequence[Reliability]) -> float:
    """Mean distance between what was stated and how often it was right; NaN of no bins.

    Law: the expected calibration error (M. Naeini, G. Cooper and M. Hauskrecht, *AAAI* 29, 2015).
    """
    whole = sum(one.count for one in bins)
    if whole == 0:
        return float("nan")
    return sum(one.count * abs(one.stated - one.right / one.count) for one in bins) / whole
