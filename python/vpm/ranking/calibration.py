"""Calibration of probabilities: two numbers of the evidence, fitted to cases with known truth."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from math import log
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from vpm.errors import DiagnosisError
from vpm.files import write_text
from vpm.numbers import Array
from vpm.ranking.posterior import robust_probabilities

#: The numbers that are shipped.
SHIPPED = Path(__file__).with_name("calibration.json")
#: Ends between which they are searched.
TEMPERING, ASTRAY = (1e-3, 1.0), (1e-3, 0.5)
#: Where bins of a reliability diagram begin, but for the first.
BINS = (0.5, 0.7, 0.8, 0.9, 0.95, 0.98)


@dataclass(frozen=True)
class Calibration:
    """Calibration numbers that turn evidence into true probabilities."""

    tempering: float  #: Power of evidence in probabilities: no model is exact.
    astray: float  #: How often evidence leads astray.
    cases: int = 0  #: How many cases they were fitted to.
    seeds: str = ""  #: Of these cases.

    def save(self, path: Path) -> Path:
        """Write a calibration as JSON."""
        return write_text(path, json.dumps(asdict(self), indent=2) + "\n")

    @classmethod
    def load(cls, path: Path) -> Calibration:
        """Read a calibration from JSON."""
        return cls(**json.loads(path.read_text(encoding="utf-8")))


@cache
def shipped() -> Calibration:
    """Shipped calibration, with which `Settings` begin."""
    return Calibration.load(SHIPPED)


@dataclass(frozen=True)
class Round:
    """Round for the calibration: effects that were weighed against each other in a case with known truth."""

    gains: tuple[float, ...]  #: Evidence of each beyond that at which it is as probable as none, nats.
    right: tuple[bool, ...]  #: Whether each is what was missing.
    missing: bool  #: Whether anything was.

    def likelihood(self, tempering: float, astray: float) -> float:
        """Probability that a calibration gives to the true effect of a round."""
        *shares, none, other = robust_probabilities(self.gains, tempering, astray)
        told = [share for share, right in zip(shares, self.right, strict=True) if right]
        return float((sum(told) if told else other) if self.missing else none)


def calibrated(rounds: Sequence[Round], seeds: str, cases: int) -> Calibration:
    """Calibration under which the true effects are most probable.

    Law: the logarithm of the probability given to the truth is a proper score. Its mean is largest for true
    probabilities (I. Good, *J. Royal Statistical Society B* 14, 1952).

    Raises
    ------
    DiagnosisError
        No round weighed anything.
    """
    if not rounds:
        raise DiagnosisError("no answer weighed any evidence; calibrate on machines that a ranking covers")

    def loss(logarithms: Array) -> float:
        tempering, astray = np.exp(logarithms)
        return -sum(log(one.likelihood(float(tempering), float(astray))) for one in rounds)

    ends = [(log(low), log(high)) for low, high in (TEMPERING, ASTRAY)]
    found = minimize(loss, np.mean(ends, axis=1), method="Nelder-Mead", bounds=ends, options={"xatol": 1e-3})
    tempering, astray = (float(f"{number:.3g}") for number in np.exp(found.x))
    return Calibration(tempering, astray, cases, seeds)


@dataclass(frozen=True)
class Reliability:
    """Reliability of a calibration in one bin: stated probabilities, and how often they were right."""

    stated: float  #: Mean of the probabilities.
    right: int
    count: int


def reliability(stated: Sequence[float], right: Sequence[bool]) -> list[Reliability]:
    """Reliability of a calibration by bins of probability; empty bins are left out."""
    numbers, outcomes = np.asarray(stated, dtype=np.float64), np.asarray(right, dtype=np.bool_)
    places = np.searchsorted(BINS, numbers, side="right")
    chosen = [places == place for place in range(len(BINS) + 1) if np.any(places == place)]
    return [Reliability(float(np.mean(numbers[c])), int(np.sum(outcomes[c])), int(np.sum(c))) for c in chosen]


def calibration_error(bins: Sequence[Reliability]) -> float:
    """Calibration error: mean distance of stated probability and frequency; NaN without bins.

    Law: the expected calibration error (M. Naeini, G. Cooper and M. Hauskrecht, *AAAI* 29, 2015).
    """
    whole = sum(one.count for one in bins)
    if whole == 0:
        return float("nan")
    return sum(one.count * abs(one.stated - one.right / one.count) for one in bins) / whole
