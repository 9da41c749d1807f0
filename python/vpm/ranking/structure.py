"""A model with what is unknown of it, fitted to records under an observer, and its evidence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from vpm.discrepancy.candidates import Key
from vpm.errors import VpmError
from vpm.model import Model
from vpm.ranking.colour import Colour, colour_of, plain
from vpm.ranking.observed import Observed, Observer
from vpm.ranking.settings import Settings
from vpm.weighing.priors import Prior

Array = NDArray[np.float64]
#: Shares of a step that are tried, the largest first.
SHARES = (1.0, 0.3, 0.08)
#: Residuals and derivatives that no record has; their squares are still numbers.
RUNAWAY = 1e100


@dataclass(frozen=True, eq=False)
class Structure:
    """Effects in a model, the values of its parameters, and what is known of the unknown ones beforehand.

    Attributes
    ----------
    model : Model
    theta : ndarray, shape (p,)
        Values; those of the model are its own.
    priors : mapping of str to Prior
        Parameters that are unknown.
    effects : tuple of (str, str)
        What was added to the model of the user, in order.
    shown : tuple of str
        Shapes that records show between two ends alone: at one of these the effect is another one, or none.
    """

    model: Model
    theta: Array
    priors: Mapping[str, Prior]
    effects: tuple[Key, ...] = ()
    shown: tuple[str, ...] = ()

    @property
    def seen(self) -> bool:
        """Whether each of its shapes lies inside of what the records can show."""
        pairs = [(self.priors[name], float(self.theta[self.model.index(name)])) for name in self.shown]
        return all(prior.low < value < prior.high for prior, value in pairs)

    @cached_property
    def columns(self) -> list[int]:
        """Places of the unknown parameters."""
        return [self.model.index(name) for name in self.priors]

    @cached_property
    def ends(self) -> Array:
        """What is possible (k, 2), in deviations of the priors."""
        return np.array([prior.ends for prior in self.priors.values()]).reshape(-1, 2)

    @cached_property
    def standard(self) -> Array:
        """The unknown parameters in deviations of their priors (k,)."""
        pairs = zip(self.priors.values(), self.columns, strict=True)
        return np.array([prior.standard(float(self.theta[column])) for prior, column in pairs])

    @cached_property
    def slopes(self) -> Array:
        """Change of each unknown parameter by a deviation (k,)."""
        pairs = zip(self.priors.values(), self.columns, strict=True)
        return np.array([prior.slope(float(self.theta[column])) for prior, column in pairs])

    @property
    def values(self) -> dict[str, float]:
        """Unknown parameters by name, SI."""
        return {name: float(self.theta[column]) for name, column in zip(self.priors, self.columns, strict=True)}

    def at(self, standard: Array) -> Structure:
        """With unknown parameters at these deviations of their priors, as far as they are possible."""
        inside = np.clip(standard, self.ends[:, 0], self.ends[:, 1])
        theta = self.theta.copy()
        for prior, column, z in zip(self.priors.values(), self.columns, inside, strict=True):
            theta[column] = prior.value(float(z))
        return replace(self, theta=theta)

    def behind(self, joint: str) -> Structure:
        """The same with what rubs, pulls or stops at a joint on its link side."""
        content, renamed = self.model.to_dict(), {}
        for entry, effect in zip(content["effects"], self.model.effects, strict=True):
            if effect.at == joint and effect.type.has_sides:
                entry["side"] = "link"
        model = type(self.model)(content)
        for old, new in zip(self.model.effects, model.effects, strict=True):
            renamed.update({name: new.parameter_names[short] for short, name in old.parameter_names.items()})
        theta = model.theta.copy()
        for name, value in zip(self.model.parameter_names, self.theta, strict=True):
            theta[model.index(renamed.get(name, name))] = value
        priors = {renamed.get(name, name): prior for name, prior in self.priors.items()}
        return Structure(model, theta, priors, self.effects, tuple(renamed.get(name, name) for name in self.shown))

    def without(self, key: Key) -> Structure:
        """The same without one of its effects.

        Raises
        ------
        ModelError
            Another effect rests on it.
        """
        effect = next(effect for effect in reversed(self.model.effects) if (effect.name, effect.at) == key)
        model = self.model.without_effect(*key, effect.side)
        theta = np.array([self.theta[self.model.index(name)] for name in model.parameter_names])
        priors = {name: prior for name, prior in self.priors.items() if name in model.parameters}
        return Structure(
            model,
            theta,
            priors,
            tuple(effect for effect in self.effects if effect != key),
            tuple(name for name in self.shown if name in priors),
        )


@dataclass(frozen=True, eq=False)
class Fitted:
    """A structure under an observer.

    Attributes
    ----------
    structure : Structure
    observer : Observer
    residual : ndarray, shape (N, m)
    jacobian : ndarray, shape (N, m, k)
        By unknown parameters.
    samples : ndarray
        Log likelihood of each sample by the structure's own colour.
    evidence : float
        Logarithm of the probability density of the records under the structure, nats.
    colour : Colour
    """

    structure: Structure
    observer: Observer
    residual: Array
    jacobian: Array
    samples: Array
    evidence: float
    colour: Colour

    @property
    def log_likelihood(self) -> float:
        """At the values."""
        return float(np.sum(self.samples))


class Fitter:
    """Fits structures to what an observer leaves."""

    def __init__(self, observed: Observed, settings: Settings) -> None:
        self.observed, self.settings = observed, settings

    def weighed(self, structure: Structure, observer: Observer) -> Fitted:
        """The structure as it stands.

        Raises
        ------
        VpmError
            It runs away from the records.
        """
        return self._weighed(structure, observer, *self.followed(structure, observer))

    def fitted(
        self, structure: Structure, observer: Observer, colour: Colour | None = None, goal: float = math.inf
    ) -> Fitted:
        """Most probable values, by bounded Gauss-Newton steps; under a given colour, or else as the channels are.

        It gives up where several times what a step promises would not bring the `cost` below a goal.

        Raises
        ------
        VpmError
            The structure runs away from the records where it begins.
        """
        structure = structure.at(structure.standard)
        residual, jacobian = self.followed(structure, observer)
        colour = colour or plain(residual, self.observed.parts)
        for _ in range(self.settings.iterations if structure.priors else 0):
            errors, slopes = self._white(structure, residual, jacobian, colour)
            move = bounded_step(structure, errors, slopes, self.settings.reach)
            before = self.cost(structure, residual, colour)
            gain = _promised(structure, errors, slopes, move)
            if gain < self.settings.tolerance or before - self.settings.patience * gain > goal:
                break
            better = self._better(structure, observer, colour, move, before)
            if better is None:
                break
            structure, after = better
            residual, jacobian = self.followed(structure, observer)
            if before - after < self.settings.tolerance:
                break
        return self._weighed(structure, observer, residual, jacobian)

    def settled(self, found: Fitted) -> Fitted:
        """At its own colour, bandwidth and number of steps, the effects being fitted anew at each."""
        found = self._improved(found, found.observer)
        for change in (_finer, _wider, _narrower):
            while (observer := change(found.observer, self.settings)) is not None:
                other = self._improved(found, observer)
                if other is found:
                    break
                found = other
        return found

    def _improved(self, found: Fitted, observer: Observer) -> Fitted:
        """Fitted under another observer, under the colour there, if that is better."""
        try:
            other = self.weighed(found.structure, observer)
            while other.evidence + 2.0 * self.promise(other) > found.evidence:
                better = self.fitted(other.structure, observer, other.colour)
                if not better.evidence > other.evidence + self.settings.tolerance:
                    break
                other = better
        except (VpmError, ArithmeticError):
            return found
        return other if other.evidence > found.evidence + self.settings.tolerance else found

    def promise(self, found: Fitted) -> float:
        """What a bounded Gauss-Newton step would gain if all were linear, nats."""
        errors, slopes = self._white(found.structure, found.residual, found.jacobian, found.colour)
        move = bounded_step(found.structure, errors, slopes, self.settings.reach)
        return _promised(found.structure, errors, slopes, move)

    def _better(
        self, structure: Structure, observer: Observer, colour: Colour, move: Array, before: float
    ) -> tuple[Structure, float] | None:
        """The first of the shares of a step that is better, and its cost; it is looked for without derivatives."""
        for share in SHARES:
            tried = structure.at(structure.standard + share * move)
            try:
                residual, _ = self.followed(tried, observer, slopes=False)
            except (VpmError, ArithmeticError):
                continue
            after = self.cost(tried, residual, colour)
            if after < before:
                return tried, after
        return None

    def followed(self, structure: Structure, observer: Observer, *, slopes: bool = True) -> tuple[Array, Array]:
        """What the observer leaves of the records (N, m), and its derivatives by unknown parameters (N, m, k).

        Without ``slopes`` there are none of these (N, m, 0).

        Raises
        ------
        VpmError
            The structure runs away from the records.
        """
        residual, jacobian = self.observed.follow(
            structure.model, structure.theta, observer, structure.columns if slopes else ()
        )
        if not all(np.max(np.abs(numbers), initial=0.0) < RUNAWAY for numbers in (residual, jacobian)):
            raise VpmError(f"{structure.model.name} runs away from the records")
        return residual, jacobian

    def _white(self, structure: Structure, residual: Array, jacobian: Array, colour: Colour) -> tuple[Array, Array]:
        """Prediction errors in roots of their weights, and their change by deviations of the priors."""
        parts = self.observed.parts
        errors = colour.whitened(residual, parts)
        roots = colour.roots(errors)
        return errors * roots, colour.whitened(jacobian, parts) * structure.slopes * roots[:, None]

    def cost(self, structure: Structure, residual: Array, colour: Colour) -> float:
        """Negative logarithm of the posterior density but for a constant."""
        errors = colour.whitened(residual, self.observed.parts)
        return colour.cost(errors) + 0.5 * float(structure.standard @ structure.standard)

    def _weighed(self, structure: Structure, observer: Observer, residual: Array, jacobian: Array) -> Fitted:
        parts = self.observed.parts
        colour = colour_of(residual, parts, self.settings.order)
        errors = colour.whitened(residual, parts)
        samples = colour.log_density(errors)
        informed = np.repeat(np.sqrt(colour.information()), len(errors) // residual.shape[1])
        slopes = colour.whitened(jacobian, parts) * structure.slopes * informed[:, None]
        z = structure.standard
        curvature = np.eye(len(z)) + slopes.T @ slopes
        evidence = float(np.sum(samples)) - 0.5 * float(z @ z) - 0.5 * float(np.linalg.slogdet(curvature)[1])
        return Fitted(structure, observer, residual, jacobian, samples, evidence, colour)


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


def _promised(structure: Structure, errors: Array, slopes: Array, move: Array) -> float:
    """What a step gains if all is linear, nats, the scale of the errors being the most likely one before it."""
    z, scale = structure.standard, max(float(np.mean(errors**2)), 1e-300)
    after = float(np.sum((errors + slopes @ move) ** 2))
    gain = (float(errors @ errors) - after) / scale
    return 0.5 * (gain + float(z @ z) - float((z + move) @ (z + move)))


def _finer(observer: Observer, settings: Settings) -> Observer | None:
    return Observer(observer.band, 2 * observer.steps) if 2 * observer.steps <= settings.finest else None


def _wider(observer: Observer, settings: Settings) -> Observer | None:
    return Observer(2.0 * observer.band, observer.steps) if 2.0 * observer.band <= settings.widest else None


def _narrower(observer: Observer, settings: Settings) -> Observer | None:
    return Observer(0.5 * observer.band, observer.steps) if 0.5 * observer.band >= settings.narrowest else None
