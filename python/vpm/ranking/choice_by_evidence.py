"""Choice by evidence among several effects that count: they are weighed under one noise model."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vpm.discrepancy.screening.candidates import Key
from vpm.ranking.fit import ASTRAY, Fitted, Fitter, View
from vpm.ranking.look import same_curve
from vpm.ranking.noise_model import NoiseModel, fitted_noise
from vpm.ranking.posterior import apart, probabilities
from vpm.ranking.settings import Settings
from vpm.ranking.tried_effect import Trial


def weighed(counting: Sequence[Trial], fitter: Fitter) -> list[Trial]:
    """Chosen effect, then its rivals, with the evidence that each adds under one noise model.

    What nobody can tell from each other is probable together. The best is the plainest one of the most probable class,
    but for those that need values which the model file rules out where another one does not. A part of the machine
    comes before an instrument. A law that a richer one contains comes before it, if it may be enough or has a curve of
    the same shape: it will be judged again beside later effects.
    """
    several, richer = _rivals(counting, fitter.settings)
    noise = fitted_noise(several[0].fitted.residual, fitter.tracked.parts, fitter.settings.order)
    told, fits = _with_evidence(several, fitter, noise)
    if not told:
        return [replace(several[0], evidence=-np.inf), *several[1:], *richer]
    *shares, _ = probabilities([one.evidence for one in told], fitter.settings.tempering)
    places = _most_probable(shares, fits, fitter, noise)
    same = [told[place] for place in places]
    probable = [told[place] for place in _credible(shares, fitter.settings.sure)]
    doubts = [_doubt(told[place], fits[place]) for place in places]
    allowed = [one for one, doubt in zip(same, doubts, strict=True) if doubt - min(doubts) <= fitter.settings.odds]
    best = min(allowed, key=lambda trial: trial.order)
    alike = [one for one in told if one in probable or same_curve(one.key, best.key)]
    if within := [one for one in alike if best.contains(one)]:
        best, same = within[0], within[:1]
        told = [replace(trial, evidence=np.nan) if trial.contains(best) else trial for trial in told]
    rivals = [trial.label for trial in (*same, *probable) if trial.key != best.key and not trial.contains(best)]
    others = (trial for trial in told if trial.key != best.key)
    return [replace(best, rivals=tuple(dict.fromkeys(rivals))), *others, *richer]


def as_good(trial: Trial, first: Trial, settings: Settings) -> bool:
    """Whether an effect is as good a choice as the first: the difference is within the errors of their laws."""
    told = (trial.judgement, first.judgement)
    return trial.left - first.left < max(one.removed * (settings.inexact / one.shape) ** 2 for one in told)


def _rivals(counting: Sequence[Trial], settings: Settings) -> tuple[list[Trial], list[Trial]]:
    """Effects to choose from under the tracker of the best one, and richer ones of the same curve.

    A richer one fits what the laws of a plainer one are wrong by, so that its evidence says nothing. Of several fits of
    one effect the most probable one counts: some leave as little error by values that the model file all but rules out.
    """
    look = min(counting, key=lambda trial: trial.left).look
    here = sorted((trial for trial in counting if trial.look is look), key=lambda trial: trial.left)
    richer = [trial for trial in here if any(_is_richer(trial, other, settings) for other in here)]
    several: dict[Key, Trial] = {}
    for trial in here:
        if trial not in richer:
            several[trial.key] = min(several.get(trial.key, trial), trial, key=lambda one: one.fitted.cost)
    return list(several.values()), richer


def _is_richer(trial: Trial, other: Trial, settings: Settings) -> bool:
    """Whether an effect of the same curve has more numbers and is hardly better, so that it is not chosen."""
    alike = same_curve(trial.key, other.key) and trial.numbers > other.numbers
    return alike and as_good(other, trial, settings)


def likely(fitted: Fitted, fitter: Fitter, noise: NoiseModel) -> Fitted:
    """Fit at the most likely values under a noise model, where its evidence is computed."""
    cost = fitter.cost(fitted.structure, fitted.residual, noise)
    return fitter.finished(replace(fitted, cost=cost, ended=False), View(noise))


def evidence(fitted: Fitted, fitter: Fitter, noise: NoiseModel) -> float:
    """Evidence of a fit under a noise model, at its most likely values, nats."""
    return fitter.evidence(likely(fitted, fitter, noise), noise)


def _with_evidence(several: Sequence[Trial], fitter: Fitter, noise: NoiseModel) -> tuple[list[Trial], list[Fitted]]:
    """Trials with the evidence that each adds, and their fits; those that diverge are left out.

    Those that run away from the records on the way there are left out.
    """
    without = evidence(several[0].look.fitted, fitter, noise)
    told, fits = [], []
    for trial in several:
        with contextlib.suppress(*ASTRAY):
            fit = likely(trial.fitted, fitter, noise)
            told.append(replace(trial, evidence=fitter.evidence(fit, noise) - without))
            fits.append(fit)
    return told, fits


def _doubt(trial: Trial, fitted: Fitted) -> float:
    """How improbable the values are that a chosen effect gives to what was known without it, nats."""
    known = [name in trial.look.fitted.structure.priors for name in fitted.structure.priors]
    return 0.5 * float(np.sum(fitted.structure.standard[known] ** 2))


def _credible(shares: Sequence[float], sure: float) -> list[int]:
    """Credible set of the choice: indices of the most probable effects up to a total probability."""
    ordered = sorted(range(len(shares)), key=lambda place: -shares[place])
    before = np.cumsum([0.0, *(shares[place] for place in ordered)])
    return [place for place, sum_before in zip(ordered, before, strict=False) if sum_before < sure]


def _most_probable(shares: Sequence[float], fits: Sequence[Fitted], fitter: Fitter, noise: NoiseModel) -> list[int]:
    """Most probable class in the choice: indices of effects that the records do not discriminate."""
    settings = fitter.settings
    told = [fitter.log_density(fit, noise) for fit in fits]
    classes = [[place for place, other in enumerate(told) if apart(one, other) < settings.same] for one in told]
    head = max(range(len(fits)), key=lambda place: (sum(shares[other] for other in classes[place]), shares[place]))
    return classes[head]
