"""What an observer leaves of the records, and how much of that another effect removes."""

from __future__ import annotations

import contextlib
from collections.abc import Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue import EFFECTS
from vpm.discrepancy.candidates import Key
from vpm.model import Effect
from vpm.ranking.fit import ASTRAY, Fitted, Fitter, Followed, View, bounded_step
from vpm.ranking.judgement import Judgement
from vpm.ranking.noise_model import white_noise

Array = NDArray[np.float64]


class Look:
    """What was found, under one observer.

    Attributes
    ----------
    fitted : Fitted
    settings : Settings
    coarse : Followed
        The same with few steps of the integrator where these do, and derivatives by all that is unknown.
    view : View
        Channels in their root mean squares; derivatives are taken as known for effects that do nothing at first.
    explained : float
        Error power that all effects of the model remove that are not exact, as a multiple of what is left.
    added : float
        The same of those that were added.
    """

    def __init__(self, fitted: Fitted, fitter: Fitter, first: Look | None = None) -> None:
        observed, self._fitter, self.settings = fitter.observed, fitter, fitter.settings
        noise = white_noise(fitted.residual, observed.parts)
        self.coarse = self._followed(fitted)
        slopes = noise.whitened(self.coarse.jacobian, observed.parts).T
        self.view = View(noise, dict(zip(self.coarse.names, slopes, strict=True)))
        cost = fitter.cost(fitted.structure, fitted.residual, noise)
        self.fitted = replace(fitted, cost=cost)
        self.sizes = np.array(noise.deviations)
        self.left = observed.squares(fitted.residual, self.sizes)
        self.added = 0.0 if first is None else self._added(first.fitted.residual)
        approximate = [one for one in fitted.structure.model.effects if not one.type.exact]
        self.explained = max(self._explained(approximate), self.added)
        self._curves: dict[tuple[str, ...], float] = {}

    def _followed(self, fitted: Fitted) -> Followed:
        """With all derivatives if few steps give them; contacts may be too stiff for that."""
        names = tuple(fitted.structure.priors)
        with contextlib.suppress(*ASTRAY):
            return self._fitter.followed(fitted.structure, fitted.observer.coarse, names)
        return self._fitter.followed(fitted.structure, fitted.observer, names, fitted.residual)

    def predicted_gain(self, other: Followed) -> float:
        """What another structure gains by a step of a fit, or as it stands, with few steps of the integrator, nats."""
        parts = self._fitter.observed.parts
        before = self.view.noise.whitened(self.coarse.residual, parts)
        errors, slopes = self.view.errors(other, parts)
        move = bounded_step(other.structure, errors, slopes, self.settings.reach)
        left = min(float(np.sum((errors + slopes @ move) ** 2)), float(errors @ errors))
        return 0.5 * len(errors) * float(np.log(float(before @ before) / max(left, 1e-300)))

    @property
    def needed(self) -> float:
        """What an effect has to gain to be worth it, nats."""
        samples = self.fitted.residual.shape[1] * sum(part.stop - part.start for part in self._fitter.observed.parts)
        return float(-0.5 * samples * np.log1p(-self.settings.worth))

    def has_room(self, removed: float = 0.0) -> bool:
        """Whether any effect could still count if so much of what is left were removed before it."""
        size, beside = (float(np.sqrt((1.0 - removed) / (power + 1.0))) for power in (self.explained, self.added))
        return Judgement(1.0, 1.0, np.inf, size, beside, 1.0).counts(self.settings)

    def judged(self, fitted: Fitted, key: Key | None = None) -> Judgement:
        """What another structure removes by one of its effects, or by what is none."""
        observed = self._fitter.observed
        left = observed.squares(fitted.residual, self.sizes)
        shares = [1.0 - float(after.sum() / before.sum()) for after, before in zip(left, self.left, strict=True)]
        removed = max(1.0 - self._sum(left) / self._sum(self.left), 1e-12)
        powers = (self.explained, self.added, 0.0 if key is None else self._curve(key))
        sizes = (float(np.sqrt(removed / (power + removed))) for power in powers)
        return Judgement(removed, min(shares), _repeated(self.left[1], left[1], self.settings.pieces), *sizes)

    def _curve(self, key: Key) -> float:
        """What those effects of the model remove that show over the same states at the same place as another one."""
        present = self.fitted.structure.model.effects
        alike = [one for one in present if same_curve(key, (one.name, one.at))]
        several = (key[1], *(f"{one.name} {one.side}" for one in alike))
        if several not in self._curves:
            self._curves[several] = self._explained(alike)
        return self._curves[several]

    def _added(self, before: Array) -> float:
        """Error power that effects remove that were added and are not exact, of what was left ``before`` them."""
        structure = self.fitted.structure
        added = [structure.model.effect(*key, structure.side(key)) for key in structure.effects]
        approximate = [one for one in added if not one.type.exact]
        power = self._beside(before)
        return power if len(approximate) == len(added) else min(power, self._removed(approximate))

    def _explained(self, effects: Collection[Effect]) -> float:
        """Error power that these effects of the model remove, those that were added no more than all of these did.

        What is left without a play or a spring that holds a load, and is not fitted anew, may be anything.
        """
        added = self.fitted.structure.effects
        given = [one for one in effects if (one.name, one.at) not in added]
        power = self._removed(effects)
        return power if len(given) == len(effects) else min(power, self._removed(given) + self.added)

    def _removed(self, effects: Collection[Effect]) -> float:
        """Error power that these effects of the model remove; none where the rest runs away from the records.

        No more than that of the motion itself: a rod without mass and friction is carried off by any force.
        """
        if effects:
            with contextlib.suppress(*ASTRAY):
                bare = self.coarse.structure.bare(effects)
                left = self._fitter.followed(bare, self.fitted.observer.coarse, ()).residual
                return min(self._beside(left), self._beside(self._fitter.observed.motion))
        return 0.0

    def _beside(self, residual: Array) -> float:
        """By how many times what is left the power of another residual is more."""
        squares = self._fitter.observed.squares(residual, self.sizes)
        return max(self._sum(squares) / self._sum(self.left) - 1.0, 0.0)

    @staticmethod
    def _sum(squares: tuple[Array, Array]) -> float:
        return float(squares[0].sum() + squares[1].sum())


def same_curve(one: Key, other: Key) -> bool:
    """Whether two effects show over the same states at the same place."""
    states = (set(EFFECTS[name].signature.lives_in) for name, _ in (one, other))
    return one[1] == other[1] and bool(set.intersection(*states))


def _repeated(before: Array, after: Array, pieces: int) -> float:
    """How surely squares are smaller in all pieces, or their logarithms are, in standard deviations of the mean."""
    pairs = [
        (float(b.sum()), float(a.sum()))
        for b, a in zip(*(np.array_split(x, pieces) for x in (before, after)), strict=True)
    ]
    changes = [[b - a for b, a in pairs], [np.log(max(b, 1e-300) / max(a, 1e-300)) for b, a in pairs]]
    return max(float(np.mean(c) / max(np.std(c, ddof=1) / np.sqrt(pieces), 1e-300)) for c in changes)
