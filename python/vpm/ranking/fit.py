"""Structures fitted to what an observer leaves of the records, and their evidence."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from vpm.discrepancy.candidates import Key
from vpm.errors import VpmError
from vpm.ranking.noise_model import NoiseModel, Parts, fitted_noise, white_noise
from vpm.ranking.observed import FINEST, Observed, Observer, fewest_steps
from vpm.ranking.settings import Settings
from vpm.ranking.structure import Structure

Array = NDArray[np.float64]
#: Another observer, if there is one.
Change = Callable[[Observer, Settings], Observer | None]
#: Shares of a step that are tried, the largest first.
SHARES = (1.0, 0.3, 0.08)
#: Shares of an effect that are left on the way to nothing.
FADING = (0.75, 0.5, 0.25, 0.0)
#: Residuals and derivatives that no record has; their squares are still numbers.
RUNAWAY = 1e100
#: What is raised of structures that the records contradict, that cannot be computed, or whose bodies are not real.
ASTRAY = (ValueError, ArithmeticError)


@dataclass(frozen=True, eq=False)
class Followed:
    """What an observer leaves of the records under a structure.

    Attributes
    ----------
    structure : Structure
    observer : Observer
    names : tuple of str
        Unknown parameters by which there are derivatives.
    residual : ndarray, shape (N, m)
    jacobian : ndarray, shape (N, m, len(names))
    """

    structure: Structure
    observer: Observer
    names: tuple[str, ...]
    residual: Array
    jacobian: Array


@dataclass(frozen=True, eq=False)
class Fitted:
    """A structure under an observer, weighed.

    Attributes
    ----------
    structure : Structure
    observer : Observer
    noise : NoiseModel
        Of what the observer leaves.
    log_likelihood : float
        Of the records under that noise model.
    evidence : float
        Logarithm of the probability density of the records under the structure, nats.
    predicted_gain : float
        What a bounded Gauss-Newton step would gain if all were linear, nats.
    cost : float
        See `Fitter.cost`; under the view of a search, and known after one alone.
    """

    structure: Structure
    observer: Observer
    noise: NoiseModel
    log_likelihood: float
    evidence: float
    predicted_gain: float
    cost: float = math.nan

    @property
    def key(self) -> Key:
        """Effect and site of what was added last."""
        return self.structure.effects[-1]


@dataclass(frozen=True, eq=False)
class View:
    """A way to look at residuals: their noise model, and derivatives that are taken as known under it.

    Attributes
    ----------
    noise : NoiseModel
    known : mapping of str to ndarray, shape (n,)
        Prediction errors by a unit of parameters, which stay as they are while a structure is fitted.
    """

    noise: NoiseModel
    known: Mapping[str, Array]

    def errors(self, followed: Followed, parts: Parts) -> tuple[Array, Array]:
        """Prediction errors (n,), and their change by deviations of the priors (n, k)."""
        errors = self.noise.whitened(followed.residual, parts)
        fresh = dict(zip(followed.names, self.noise.whitened(followed.jacobian, parts).T, strict=True))
        slopes = np.empty((len(errors), len(followed.structure.priors)))
        for place, (name, slope) in enumerate(zip(followed.structure.priors, followed.structure.slopes, strict=True)):
            slopes[:, place] = (fresh[name] if name in fresh else self.known[name]) * slope
        return errors, slopes

    def weighted(self, errors: Array, slopes: Array) -> tuple[Array, Array]:
        """The same in roots of the weights of the errors."""
        return in_roots(errors, slopes, self.noise.roots(errors))


class Fitter:
    """Fits structures to what an observer leaves.

    While it searches, derivatives come from the fewest steps of the integrator: they only show the way, and cost most.
    """

    def __init__(self, observed: Observed, settings: Settings) -> None:
        self.observed, self.settings = observed, settings
        self._coarse: WeakKeyDictionary[Fitted, Fitted] = WeakKeyDictionary()

    def fitted(self, structure: Structure, observer: Observer, noise: NoiseModel | None = None) -> Fitted:
        """Most probable values, by bounded Gauss-Newton steps; under a given noise model, or else as the channels are.

        Raises
        ------
        VpmError
            The structure runs away from the records where it begins.
        """
        begun = self.followed(structure.at(structure.standard), observer)
        noise = noise or white_noise(begun.residual, self.observed.parts)
        return self._weighed(self._descended(begun, View(noise, {})))

    def searched(
        self, structure: Structure, observer: Observer, view: View, goal: float, residual: Array | None = None
    ) -> Fitted:
        """The same under a view, the ``residual`` where it begins being known or not.

        It gives up where several times the gain that a step predicts would not bring the `cost` below a goal.

        Raises
        ------
        VpmError
            The structure runs away from the records where it begins.
        """
        fresh = tuple(name for name in structure.priors if name not in view.known)
        begun = self.followed(structure.at(structure.standard), observer, fresh, residual=residual)
        ended = self._descended(begun, view, goal, tuple(structure.priors))
        return replace(self._weighed(ended), cost=self.cost(ended.structure, ended.residual, view.noise))

    def refined(self, found: Fitted) -> Fitted:
        """At its own noise model, bandwidth and number of equal steps, the effects being fitted anew at each."""
        return self._changed(self._improved(found, found.observer), (_finer, _wider, _narrower))

    def finished(self, found: Fitted) -> Fitted:
        """The same, and where equal steps are still too coarse, under steps of controlled error."""
        found = self.refined(found)
        if found.observer.controlled or found.observer.steps < FINEST:
            return found
        return self._changed(found, (_controlled, _wider, _narrower))

    def equally_coarse(self, found: Fitted) -> Fitted:
        """What was found, under equal steps; fitted once, however often that is asked."""
        if not found.observer.controlled:
            return found
        if found not in self._coarse:
            equal = replace(found.observer, steps=FINEST, controlled=False)
            self._coarse[found] = self.fitted(found.structure, equal, found.noise)
        return self._coarse[found]

    def without(self, found: Fitted, key: Key) -> Fitted:
        """The same without one of its effects, whose part the others take over as far as they can.

        Raises
        ------
        VpmError, ArithmeticError
            Another effect rests on it, or the rest runs away from the records.
        """
        starts = [found.structure.without(key)]
        with contextlib.suppress(*ASTRAY):
            starts.append(self._faded(found, tuple(starts[0].priors)).without(key))
        start = min(starts, key=lambda one: self._cost_of(one, found))
        return self.finished(self.fitted(start, found.observer, found.noise))

    def _faded(self, found: Fitted, kept: Sequence[str]) -> Structure:
        """With an effect walked back to nothing, the others that are ``kept`` following it by linear models.

        Where they can do the same, as a gain of a sensor and what it measures, this stays on the way from one to the
        other; where they have to jump, a fit ends elsewhere.
        """
        structure, begun = found.structure, found.structure.standard
        stays = np.array([name in kept for name in structure.priors])
        for share in FADING:
            followed = self.followed(structure, found.observer)
            view = View(found.noise, {})
            errors, slopes = view.weighted(*view.errors(followed, self.observed.parts))
            move = np.where(stays, 0.0, structure.neutral + share * (begun - structure.neutral) - structure.standard)
            others = replace(structure, priors={name: structure.priors[name] for name in kept})
            move[stays] = bounded_step(others, errors + slopes @ move, slopes[:, stays], self.settings.reach)
            structure = structure.at(structure.standard + move)
        return structure

    def _cost_of(self, structure: Structure, found: Fitted) -> float:
        try:
            return self.cost(structure, self._pass(structure, found.observer, ())[0], found.noise)
        except ASTRAY:
            return math.inf

    def followed(
        self,
        structure: Structure,
        observer: Observer,
        names: Sequence[str] | None = None,
        *,
        exact: bool = False,
        residual: Array | None = None,
    ) -> Followed:
        """What the observer leaves of the records, with derivatives by some parameters, or by all that are unknown.

        ``exact`` derivatives are those of the observer's own steps, or of the finest of equal length. A ``residual``
        that is known need not be worked out where derivatives come from other steps.

        Raises
        ------
        VpmError
            The structure runs away from the records.
        """
        names = tuple(structure.priors if names is None else names)
        columns = [structure.place(name) for name in names]
        plain_steps = Observer(observer.band, FINEST if exact else fewest_steps(structure.model))
        if observer.controlled or plain_steps.steps < observer.steps:
            if residual is None:
                residual, _ = self._pass(structure, observer, ())
            with contextlib.suppress(*ASTRAY):  # contacts may be too stiff for few steps
                return Followed(structure, observer, names, residual, self._pass(structure, plain_steps, columns)[1])
        return Followed(structure, observer, names, *self._pass(structure, observer, columns))

    def log_density(self, fitted: Fitted) -> Array:
        """Logarithm of the density of each sample (n,)."""
        residual, _ = self._pass(fitted.structure, fitted.observer, ())
        return fitted.noise.log_density(fitted.noise.whitened(residual, self.observed.parts))

    def cost(self, structure: Structure, residual: Array, noise: NoiseModel) -> float:
        """Negative logarithm of the posterior density but for a constant."""
        errors = noise.whitened(residual, self.observed.parts)
        return noise.cost(errors) + 0.5 * float(structure.standard @ structure.standard)

    def _changed(self, found: Fitted, changes: Sequence[Change]) -> Fitted:
        """Under other observers, one change after the other, as far as each is for the better."""
        for change in changes:
            while (observer := change(found.observer, self.settings)) is not None:
                other = self._improved(found, observer)
                if other is found:
                    break
                found = other
        return found

    def _improved(self, found: Fitted, observer: Observer) -> Fitted:
        """Fitted under another observer, with the noise model there, if that is better."""
        try:
            followed = self.followed(found.structure, observer, exact=True)
            other = self._weighed(followed)
            while other.evidence + 2.0 * other.predicted_gain > found.evidence:
                followed = self._descended(followed, View(other.noise, {}), exact=True)
                better = self._weighed(followed)
                if not better.evidence > other.evidence + self.settings.tolerance:
                    break
                other = better
        except ASTRAY:
            return found
        return other if other.evidence > found.evidence + self.settings.tolerance else found

    def _descended(
        self,
        now: Followed,
        view: View,
        goal: float = math.inf,
        names: Sequence[str] | None = None,
        *,
        exact: bool = False,
    ) -> Followed:
        """The most probable values, as far as steps lead, with derivatives by ``names``, or those that it began with.

        Derivatives cost many times what residuals do, so that secants correct them from step to step. Where a step by
        these leads nowhere, they are worked out anew.
        """
        before, fresh = self.cost(now.structure, now.residual, view.noise), True
        errors, slopes = view.errors(now, self.observed.parts)
        for _ in range(self.settings.iterations if now.structure.priors else 0):
            move, gain = self._step(now.structure, *view.weighted(errors, slopes))
            hopeful = gain >= self.settings.tolerance and before - self.settings.patience * gain <= goal
            better = self._better(now, view.noise, move, before) if hopeful else None
            slow = better is None or before - better[2] < self.settings.tolerance
            if better is not None:
                move = better[0].standard - now.structure.standard
                now, last, before = replace(now, structure=better[0], residual=better[1]), errors, better[2]
                errors = view.noise.whitened(now.residual, self.observed.parts)
                slopes = by_secant(slopes, errors - last, move)
            if slow and fresh:
                fresh = better is None
                break
            fresh = slow
            if fresh:
                now = self.followed(now.structure, now.observer, now.names, exact=exact, residual=now.residual)
                errors, slopes = view.errors(now, self.observed.parts)
        names = now.names if names is None else tuple(names)
        if fresh and names == now.names:
            return now
        return self.followed(now.structure, now.observer, names, exact=exact, residual=now.residual)

    def _step(self, structure: Structure, errors: Array, slopes: Array) -> tuple[Array, float]:
        """A bounded Gauss-Newton step, and the gain that it predicts, nats."""
        move = bounded_step(structure, errors, slopes, self.settings.reach)
        return move, _predicted_gain(structure, errors, slopes, move)

    def _better(
        self, now: Followed, noise: NoiseModel, move: Array, before: float
    ) -> tuple[Structure, Array, float] | None:
        """The first of the shares of a step that is better, its residual and cost; no derivatives are asked for."""
        for share in SHARES:
            tried = now.structure.at(now.structure.standard + share * move)
            try:
                residual, _ = self._pass(tried, now.observer, ())
            except ASTRAY:
                continue
            after = self.cost(tried, residual, noise)
            if after < before:
                return tried, residual, after
        return None

    def _pass(self, structure: Structure, observer: Observer, columns: Sequence[int]) -> tuple[Array, Array]:
        residual, jacobian = self.observed.follow(structure.model, structure.theta, observer, columns)
        if not all(np.max(np.abs(numbers), initial=0.0) < RUNAWAY for numbers in (residual, jacobian)):
            raise VpmError(f"{structure.model.name} runs away from the records")
        return residual, jacobian

    def _weighed(self, followed: Followed) -> Fitted:
        """Evidence under the structure's own noise model, all derivatives being there."""
        structure, parts = followed.structure, self.observed.parts
        noise = fitted_noise(followed.residual, parts, self.settings.order)
        errors, slopes = View(noise, {}).errors(followed, parts)
        likely = float(np.sum(noise.log_density(errors)))
        informed = np.repeat(np.sqrt(noise.information()), len(errors) // followed.residual.shape[1])
        known = slopes * informed[:, None]
        z = structure.standard
        curvature = np.eye(len(z)) + known.T @ known
        evidence = likely - 0.5 * float(z @ z) - 0.5 * float(np.linalg.slogdet(curvature)[1])
        _, predicted = self._step(structure, *in_roots(errors, slopes, noise.roots(errors)))
        return Fitted(structure, followed.observer, noise, likely, evidence, predicted)


def in_roots(errors: Array, slopes: Array, roots: Array) -> tuple[Array, Array]:
    """Errors (n,) and their slopes (n, k) in roots of the weights of the errors (n,)."""
    return errors * roots, slopes * roots[:, None]


def by_secant(slopes: Array, change: Array, move: Array) -> Array:
    """Slopes (n, k) that give the change of the errors (n,) by a move (k,), as near to those before as can be.

    Law: C. Broyden, *Mathematics of Computation* 19, 1965.
    """
    missed = (change - slopes @ move) / max(float(move @ move), 1e-300)
    return np.asarray(slopes + np.outer(missed, move))


def bounded_step(structure: Structure, errors: Array, slopes: Array, reach: float) -> Array:
    """Gauss-Newton step in deviations of the priors, within what is possible (bounded least squares)."""
    z, scale = structure.standard, max(float(np.mean(errors**2)), 1e-300)
    normal = slopes.T @ slopes / scale + np.eye(len(z))
    sizes = 1.0 / np.sqrt(np.diag(normal))
    root = np.linalg.cholesky(normal * np.outer(sizes, sizes) + 1e-12 * np.eye(len(z))).T
    pull = -(slopes.T @ errors / scale + z) * sizes
    target = np.linalg.solve(root.T, pull)
    low = np.minimum(np.maximum(structure.ends[:, 0] - z, -reach), -1e-12) / sizes
    high = np.maximum(np.minimum(structure.ends[:, 1] - z, reach), 1e-12) / sizes
    return np.asarray(lsq_linear(root, target, (low, high), method="bvls").x * sizes)


def _predicted_gain(structure: Structure, errors: Array, slopes: Array, move: Array) -> float:
    """What a step gains if all is linear, nats, the scale of the errors being the most likely one before it."""
    z, scale = structure.standard, max(float(np.mean(errors**2)), 1e-300)
    after = float(np.sum((errors + slopes @ move) ** 2))
    gain = (float(errors @ errors) - after) / scale
    return 0.5 * (gain + float(z @ z) - float((z + move) @ (z + move)))


def _finer(observer: Observer, _: Settings) -> Observer | None:
    coarse = not observer.controlled and observer.steps < FINEST
    return replace(observer, steps=2 * observer.steps) if coarse else None


def _controlled(observer: Observer, _: Settings) -> Observer | None:
    return None if observer.controlled else replace(observer, steps=1, controlled=True)


def _wider(observer: Observer, settings: Settings) -> Observer | None:
    return replace(observer, band=2.0 * observer.band) if 2.0 * observer.band <= settings.widest else None


def _narrower(observer: Observer, settings: Settings) -> Observer | None:
    return replace(observer, band=0.5 * observer.band) if 0.5 * observer.band >= settings.narrowest else None
