"""Look at a structure under one tracker: the error that is left, and the share that another effect removes."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.discrepancy.screening.candidates import Key
from vpm.errors import VpmError
from vpm.model import Effect
from vpm.numbers import Array
from vpm.ranking.fit import (
    ASTRAY,
    Fitted,
    Fitter,
    Followed,
    View,
    bordered,
    bounded_step,
    bounded_step_by,
    free_step_by,
)
from vpm.ranking.judgement import Judgement
from vpm.ranking.model_structure import Structure, approximate
from vpm.ranking.noise_model import white_noise
from vpm.ranking.settings import NEXT_START, PARTS, SURE
from vpm.ranking.tracked_records import TrackedRecords


class Look:
    """Look at a fitted structure under one tracker.

    Attributes
    ----------
    fitted : Fitted
    settings : Settings
    noise : NoiseModel
        Channels in their root mean squares.
    explained : ndarray, shape (m,)
        Error power of each channel that all effects of the model remove that are not exact, as a multiple of what is
        left. Here and below error power is what stands out of noise: what a sensor adds no model can remove.
    added : ndarray, shape (m,)
        The same of those that were added.
    bent : ndarray, shape (m,)
        The same of the bending of links: all that a strain gauge reads.
    """

    def __init__(self, fitted: Fitted, fitter: Fitter, first: Look | None = None) -> None:
        tracked, self._fitter, self.settings = fitter.tracked, fitter, fitter.settings
        noise = self.noise = white_noise(fitted.residual, tracked.parts)
        cost = fitter.cost(fitted.structure, fitted.residual, noise)
        self.fitted = replace(fitted, cost=cost)
        self.left = self._squares(fitted.residual)
        own = fitted.structure
        told = tracked.structured(fitted.residual, fitted.tracker.band, tracked.parts, own.model, own.theta)
        self._quiet = np.minimum([one.noise for one in told] / np.array(noise.deviations), 1.0) ** 2
        power, chance = self._above_noise(self.left)
        self._clear = power > SURE * chance
        self.added = np.zeros(len(noise.tails)) if first is None else self._added(first.fitted.residual)
        self.explained = np.maximum(self._explained(approximate(fitted.structure.model)), self.added)
        gauges = {f"{name}.strain" for name in own.model.gauges}
        reads = [channel in gauges for channel in tracked.records[0].channels]
        self.bent = np.where(reads, self._beside(tracked.motion), 0.0)
        self._curves: dict[tuple[str, ...], Array] = {}
        self._offsets: dict[int, Array] = {}

    @cached_property
    def start(self) -> Followed:
        """Start for fits from a look: derivatives by all that is unknown.

        Raises
        ------
        VpmError
            The structure runs away from the records.
        """
        own = self.fitted
        return self._fitter.followed(own.structure, own.tracker, tuple(own.structure.priors), own.residual)

    @cached_property
    def coarse(self) -> Followed:
        """Start of a look as few steps of the integrator tell it, where these do."""
        return self.start.coarse

    @cached_property
    def view(self) -> View:
        """View of a look for fits: derivatives are taken as known for effects that do nothing at first."""
        slopes = self.noise.whitened(self.coarse.jacobian, self._fitter.tracked.parts).T
        return View(self.noise, dict(zip(self.coarse.names, slopes, strict=True)))

    def predicted_gain(self, other: Followed) -> float:
        """Gain that a look predicts for another structure by one step of a fit, nats.

        None where it does most in a channel in which no effect could count any more.
        """
        return self._gain(self._after_one(self._compared(other)), self._alone)

    def gain_along(self, other: Followed) -> tuple[float, float]:
        """Gain that a look predicts for another structure if its change is scaled, nats, and the best scale.

        All that is unknown without it gives way, and stays within what is known of it. A change that is far too large
        is scaled no farther than to the next start value: nobody knows its shape from there on.
        """
        noise, (before, slopes) = self.noise, self._errors
        along = noise.whitened(self._compared(other).residual, self._fitter.tracked.parts) - before
        known, pull = self._linear
        products = bordered(known, (slopes.T @ along)[:, None], np.array([[along @ along]]))
        pull = np.append(pull, along @ before)
        share = float(free_step_by(products, pull, self.coarse.structure.standard)[-1])
        ends = [before + along]
        if share > 0.0:
            ends.append(self._giving_way(before + max(share, NEXT_START) * along))
        return self._gain(min(ends, key=noise.cost), self._given_way), share

    def _compared(self, other: Followed) -> Followed:
        """Another structure beside a look as by fine steps: what steps of the same length change is that of the look.

        Else what coarse steps do wrong would pass for something that an effect explains.
        """
        return replace(other, residual=other.residual + self._by_steps(self._steps_of(other.structure)))

    def _steps_of(self, structure: Structure) -> int:
        """Coarse steps within a sample that a structure takes beside a look."""
        tracked = self._fitter.tracked
        return max(tracked.stepping(structure.model, self.coarse.tracker, one.dt)[1] for one in tracked.records)

    def _by_steps(self, steps: int) -> Array:
        """What a look leaves more by fine steps than by so many coarse ones within a sample."""
        if steps not in self._offsets:
            left = self.coarse.residual
            if steps != self._steps_of(self.coarse.structure):
                tracker = replace(self.coarse.tracker, fewest=steps)
                left = self._fitter.followed(self.coarse.structure, tracker, ()).residual
            self._offsets[steps] = self.fitted.residual - left
        return self._offsets[steps]

    def _giving_way(self, errors: Array) -> Array:
        """Errors of a look from which all that is unknown takes what it can, within what is known of it."""
        _, slopes = self._errors
        step = free_step_by(self._linear[0], slopes.T @ errors, self.coarse.structure.standard)
        return np.asarray(errors + slopes @ step)

    @cached_property
    def _given_way(self) -> Array:
        """Errors of the look's structure alone, from which what is unknown has taken most."""
        return min(self._alone, self._giving_way(self._errors[0]), key=self.noise.cost)

    def _gain(self, left: Array, alone: Array) -> float:
        noise, rooms = self.noise, self._rooms()
        powers = (np.sum(noise.by_channel(errors) ** 2, axis=1) for errors in (left, alone))
        place = self._place(np.divide(*powers), rooms)
        return noise.cost(alone) - noise.cost(left) if rooms[place] else 0.0

    def _place(self, ratio: Array, rooms: Collection[bool]) -> int:
        """Channel of a look in which most is removed, of those with room for an effect if enough is removed there."""
        seen = np.where(list(rooms), ratio, 1.0)
        return int(np.argmin(seen if np.min(seen) < 1.0 - self.settings.worth else ratio))

    @cached_property
    def _errors(self) -> tuple[Array, Array]:
        """Errors of the look's structure alone, with derivatives by coarse steps, for all trials."""
        return self.view.errors(self.start, self._fitter.tracked.parts)

    @cached_property
    def _alone(self) -> Array:
        """Errors of the look's structure alone after a step of a fit."""
        return self._after_a_step(self.coarse.structure, *self._errors)

    @cached_property
    def _products(self) -> Array:
        """Products of derivatives by what a look has unknown (m, k, k), by channel."""
        known = self._by_channel(self._errors[1])
        return _products(known, known)

    @cached_property
    def _linear(self) -> tuple[Array, Array]:
        """Products of a look's derivatives with each other (k, k) and with its errors (k,), over all channels."""
        errors, slopes = self._errors
        return np.sum(self._products, axis=0), slopes.T @ errors

    def _by_channel(self, slopes: Array) -> Array:
        """Derivatives (n, k) of a look by channel (m, n / m, k)."""
        channels = len(self.noise.tails)
        return slopes.reshape(channels, len(slopes) // channels, slopes.shape[1])

    def _after_one(self, other: Followed) -> Array:
        """Errors of another structure beside a look after one step of a fit, by what both know of derivatives.

        Products of those by what is unknown without it are worked out once for all. Each channel has the scale of its
        own errors.
        """
        own, names = self.coarse.structure, tuple(other.structure.priors)
        count, slopes = len(own.priors), other.structure.slopes
        if names[:count] != tuple(own.priors) or not np.array_equal(slopes[:count], own.slopes):
            return self._after_a_step(other.structure, *self.view.errors(other, self._fitter.tracked.parts))
        parts, known = self._fitter.tracked.parts, self._by_channel(self._errors[1])
        errors = self.noise.by_channel(self.noise.whitened(other.residual, parts))
        places = [other.names.index(name) for name in names[count:]]
        fresh = self._by_channel(self.noise.whitened(other.jacobian[:, :, places], parts) * slopes[count:])
        weights, column = 1.0 / np.maximum(np.mean(errors**2, axis=1), 1e-300), errors[:, :, None]
        cross, further, *slope = (
            np.tensordot(weights, _products(*pair), 1)
            for pair in ((known, fresh), (fresh, fresh), (known, column), (fresh, column))
        )
        products = bordered(np.tensordot(weights, self._products, 1), cross, further)
        move = bounded_step_by(other.structure, products, np.concatenate(slope)[:, 0], self.settings.reach)
        after = errors + known @ move[:count] + fresh @ move[count:]
        return np.asarray(min(errors.ravel(), after.ravel(), key=self.noise.cost))

    def _after_a_step(self, structure: Structure, errors: Array, slopes: Array) -> Array:
        move = bounded_step(structure, *self.view.weighted(errors, slopes), self.settings.reach)
        return min(errors, errors + slopes @ move, key=self.noise.cost)

    @cached_property
    def doubt(self) -> float:
        """By how much a look's values are less probable by the model file than chance makes them, nats.

        Where the file is right, each number that the records determine is off by its deviation, in the mean.

        Law: the number of well-determined parameters (D. MacKay, *Neural Computation* 4, 1992).
        """
        errors, slopes = self.view.weighted(*self._errors)
        told = np.linalg.svd(np.linalg.qr(slopes, mode="r"), compute_uv=False) ** 2
        determined = float(np.sum(told / (told + float(np.mean(errors**2)))))
        return self.fitted.structure.doubt - 0.5 * determined

    @property
    def promising(self) -> float:
        """Least predicted gain for which a look starts a fit, nats."""
        return self.needed / self.settings.patience

    @property
    def follows(self) -> bool:
        """Whether a look leaves less error than a machine at rest, in the mean of the channels."""
        still = self._squares(self._fitter.tracked.motion)
        return float(np.sum(np.log(self._ratio(still, self.left)))) < 0.0

    @property
    def is_lost(self) -> bool:
        """Whether a look leaves more error at each of several joints than masses on which nothing acts."""
        tracked = self._fitter.tracked
        shares = zip(tracked.records[0].channels, _shares(self._drawn, self.left).tolist(), strict=True)
        joints = [share for channel, share in shares if channel in tracked.drawn_joints]
        return len(joints) > 1 and min(joints) > 1.0

    @property
    def needed(self) -> float:
        """Least gain for which an effect is worth it in a look, nats."""
        least = min((1.0 - quiet for quiet, room in zip(self._quiet, self._rooms(), strict=True) if room), default=1.0)
        return self.settings.needed(len(self.left[0]), least)

    def has_room(self, beside: Fitted | None = None) -> bool:
        """Whether a look has room for any effect that counts, alone or beside another structure."""
        if beside is None:
            return any(self._rooms())
        return any(self._rooms(self._ratio(self.left, self._squares(beside.residual))))

    def saved_by(self, beside: Fitted) -> float:
        """Cost that another structure saves beside a look under its tracker, nats."""
        return self.fitted.cost - self._fitter.cost(beside.structure, beside.residual, self.noise)

    def leaves_little(self, beside: Fitted) -> bool:
        """Whether another structure leaves less in a look than a second effect has to do, where that has room."""
        left = self._squares(beside.residual)
        (power, chance), ratio = self._above_noise(left), self._ratio(self.left, left)
        much = (power > SURE * chance) & (ratio > self.settings.second**2)
        return not np.any(much & self._rooms(ratio))

    def _rooms(self, left: Array | float = 1.0) -> list[bool]:
        """Channels in which a look has room for an effect that counts."""
        told = (np.sqrt(left / (power + 1.0)).tolist() for power in (self.explained, self.added, self.bent))
        clear = self._clear.astype(float).tolist()
        return [Judgement(c, c, np.inf, *few).counts(self.settings) for c, *few in zip(clear, *told, strict=True)]

    def _above_noise(self, squares: Sequence[Array]) -> tuple[Array, Array]:
        """Error power of a look above white noise by channel (m,), and its deviation by chance."""
        samples = sum(len(part) for part in squares)
        chance = np.sqrt(2.0 * samples) * self._quiet + 1e-300
        return np.maximum(sum(np.sum(part, axis=0) for part in squares) - samples * self._quiet, chance), chance

    def _ratio(self, before: Sequence[Array], after: Sequence[Array]) -> Array:
        """Ratio of error power after to that before in a look, by channel (m,)."""
        return np.asarray(self._above_noise(after)[0] / self._above_noise(before)[0])

    def judged(self, fitted: Fitted, key: Key | None = None, *, ended: bool = True) -> Judgement:
        """Judgement in a look: the share of the error that another structure removes by one effect.

        All parts of the record are asked where one leaves it open, of fits that have ``ended``.

        Nobody knows how exact a model can be in each channel. So the errors of all have scales of their own, of which
        each is the most likely one, and shares of error power that are left multiply. In one channel at least enough
        has to go: a little of each of many is what a law takes that has numbers to spare. That is one in which the
        effect does more than errors of laws, if it does so in any.
        """
        left = self._squares(fitted.residual)
        ratio = self._ratio(self.left, left)
        removed, gone = max(1.0 - float(np.prod(ratio)), 1e-12), np.maximum(1.0 - ratio, 1e-12)
        reads, large = (np.sqrt(gone / (power + gone)) for power in (self.bent, self.explained))
        place = self._place(ratio, (reads > self.settings.inexact) & (large > self.settings.slight))
        apart = [self._ratio([b], [a]) for b, a in zip(self.left, left, strict=True)]
        shares = [1.0 - max(float(np.prod(one)), float(one[place])) for one in apart]
        there = float(gone[place])
        curve = self.bent if key is None else np.maximum(self._curve(key), self.bent)
        powers = (self.explained, self.added, curve)
        size, beside, shape = (float(np.sqrt(there / (power[place] + there))) for power in powers)
        score = _repeated([(self.left[1], left[1])], self.settings.pieces)
        heavier = key is not None and EFFECTS[key[0]].adds_inertia
        alone = float(_shares(self._drawn, left)[place]) if heavier else 0.0
        ways = self._fitter.tracked.ways
        overtone = key is not None and fitted.structure.is_overtone(key, ways.get(key[1], np.inf))
        timed = "" if key is None else self._within_half_a_sample(fitted.structure, key)
        judgement = Judgement(removed, min(shares), score, size, beside, shape, alone, overtone, timed=timed)
        if key is None or not ended or not judgement.is_faint(self.settings, PARTS):
            return judgement
        return replace(judgement, score=max(score, self._score_of_all(fitted, left[1])))

    def _within_half_a_sample(self, structure: Structure, key: Key) -> str:
        """Text on readings that a structure has late by less than half a sample, as a mean over a sample is; else "".

        When within its sampling interval a logger reads a channel no log tells.
        """
        late = structure.lateness_of_readings(key)
        if late >= 0.5 * max(record.dt for record in self._fitter.tracked.records):
            return ""
        return f"readings of {key[1]} {1e3 * late:.2g} ms later, within their sampling interval"

    def size_of(self, key: Key) -> float:
        """Amplitude of an effect of the look's structure, as a share of that of all, where it is largest."""
        own = self.fitted.structure
        removed = self._removed([own.model.effect(*key, own.side(key))])
        return float(np.sqrt(np.max(removed / np.maximum(self.explained, removed + 1e-300))))

    def explained_by(self, trial: Fitted, judgement: Judgement) -> Judgement:
        """Judgement in a look of what another structure explains of the error, and not of its mirror image.

        What removes the error adds to its mirror image: where ``s`` is removed of ``e``, ``|e + s|^2 - |e - s|^2`` is
        four times their product. A structure that answers to noise otherwise leaves as much of both.
        """
        own = trial.structure
        with contextlib.suppress(*ASTRAY):
            mirrored, _ = self._mirrored.follow(own.model, own.theta, trial.tracker)
            real, other = (self._ratio(self.left, self._squares(one)) for one in (trial.residual, mirrored))
            told = np.minimum((other - real) / 4.0, 1.0)
            return replace(judgement, explained=1.0 - float(np.prod(1.0 - told)))
        return judgement

    @cached_property
    def _mirrored(self) -> TrackedRecords:
        """Records of which a look's structure leaves the mirror image of its error."""
        own = self.fitted.structure
        return self._fitter.tracked.mirrored(own.model, own.theta, self.fitted.tracker, self.fitted.residual)

    def _score_of_all(self, fitted: Fitted, left: Array) -> float:
        """Score in a look by cross-validation over all parts of the record.

        Law: cross-validation (M. Stone, *J. Royal Statistical Society B* 36, 1974): what is held back for a judgement
        can be fitted for another one, so that no part of a record goes unheard.
        """
        with contextlib.suppress(*ASTRAY):
            priors = tuple(fitted.structure.priors)
            start = self._fitter.followed(fitted.structure, fitted.tracker, priors, fitted.residual)
            others = [self._held_back(start, part) for part in range(PARTS - 1)]
            pairs = [(self.left[1], left), *zip(self._of_others, others, strict=True)]
            return _repeated(pairs, self.settings.pieces)
        return 0.0

    @cached_property
    def _of_others(self) -> list[Array]:
        """Squares in a look of parts of the record that are held back from a fit in turn."""
        return [self._held_back(self.start, part) for part in range(PARTS - 1)]

    def _held_back(self, start: Followed, part: int) -> Array:
        """Squares in a look of one held-back part of the record, from a fit to the others."""
        other = Fitter(self._fitter.tracked.holding_back(part), self.settings)
        moved, _ = other.moved(start, View(self.noise))
        return other.tracked.squares(moved.residual, self.noise)[1]

    @cached_property
    def _drawn(self) -> tuple[Array, Array]:
        """Squares in a look of free masses that the tracker draws; other channels as they are."""
        drawn = self._squares(self._fitter.tracked.drawn(self.fitted.tracker.band))
        fitted, held = (
            np.where(np.any(new > 0.0, axis=0), new, now) for new, now in zip(drawn, self.left, strict=True)
        )
        return fitted, held

    def _curve(self, key: Key) -> Array:
        """Error power in a look that effects over the same states at the same place remove."""
        present = self.fitted.structure.model.effects
        alike = [one for one in present if same_curve(key, (one.name, one.at))]
        several = (key[1], *(f"{one.name} {one.side}" for one in alike))
        if several not in self._curves:
            self._curves[several] = self._along(alike)
        return self._curves[several]

    def _along(self, effects: Collection[Effect]) -> Array:
        """Error power in a look that effects remove, in proportion to what a small part of them removes.

        All other laws hold, and so do most of these: without the friction that keeps a machine in step any force would
        carry it far away, and no other friction could count beside.
        """
        if not effects:
            return np.zeros(len(self.noise.tails))
        whole, part = self.fitted.structure, self.settings.inexact
        with contextlib.suppress(*ASTRAY):
            bare = whole.bare(effects)
            weaker = replace(bare, theta=whole.theta + part * (bare.theta - whole.theta))
            now, left = self._residuals([replace(bare, theta=whole.theta), weaker])
            return self._beside(now + (left - now) / part)
        return np.zeros(len(self.noise.tails))

    def _residuals(self, several: Sequence[Structure]) -> list[Array]:
        """Residuals of structures beside a look, by few steps of the integrator or, with stiff contacts, by fine ones.

        Raises
        ------
        VpmError
            One of them runs away from the records.
        """
        for steps in (self.fitted.tracker.coarse, self.fitted.tracker):
            with contextlib.suppress(*ASTRAY):
                return [self._fitter.followed(one, steps, ()).residual for one in several]
        raise VpmError(f"{self.fitted.structure.model.name} runs away from the records without one of its effects")

    def _added(self, before: Array) -> Array:
        """Error power in a look that added inexact effects remove of the error ``before`` them."""
        structure = self.fitted.structure
        added = structure.added
        approximate = [one for one in added if not one.type.exact]
        power = self._beside(before)
        return power if len(approximate) == len(added) else np.minimum(power, self._removed(approximate))

    def _explained(self, effects: Collection[Effect]) -> Array:
        """Error power in a look that some effects of the model remove.

        What is left without a play or a spring that holds a load, and is not fitted anew, may be anything.
        """
        added = {one.key for one in self.fitted.structure.added}
        given = [one for one in effects if one.key not in added]
        power = self._removed(effects)
        return power if len(given) == len(effects) else np.minimum(power, self._removed(given) + self.added)

    def _removed(self, effects: Collection[Effect]) -> Array:
        """Error power in a look that effects remove; none where the rest diverges.

        No more than that of the motion itself: a rod without mass and friction is carried off by any force.
        """
        if effects:
            with contextlib.suppress(*ASTRAY):
                (left,) = self._residuals([self.fitted.structure.bare(effects)])
                return np.minimum(self._beside(left), self._beside(self._fitter.tracked.motion))
        return np.zeros(len(self.noise.tails))

    def _beside(self, residual: Array) -> Array:
        """Ratio of the power of another residual to that of the look, less one, by channel (m,)."""
        return np.maximum(1.0 / self._ratio(self._squares(residual), self.left) - 1.0, 0.0)

    def _squares(self, residual: Array) -> tuple[Array, Array]:
        return self._fitter.tracked.squares(residual, self.noise)


def _products(one: Array, other: Array) -> Array:
    """Products (m, k, q) of a look's derivatives by channel (m, n, k) with others (m, n, q)."""
    return np.asarray(one.transpose(0, 2, 1) @ other)


def same_curve(one: Key, other: Key) -> bool:
    """Whether two effects look alike: they depend on the same states at the same place."""
    states = (set(EFFECTS[name].signature.lives_in) for name, _ in (one, other))
    return one[1] == other[1] and bool(set.intersection(*states))


def _shares(before: Sequence[Array], after: Sequence[Array]) -> Array:
    """Ratio of squares after to those before, with noise, by channel of a look (m,)."""
    sums = [np.maximum(sum(np.sum(part, axis=0) for part in several), 1e-300) for several in (before, after)]
    return np.asarray(sums[1] / sums[0])


def _repeated(parts: Sequence[tuple[Array, Array]], pieces: int) -> float:
    """Score of the decrease of squares in a look, piece by piece, in standard deviations of the mean.

    Parts of the record are cut into pieces each.
    """
    pairs = [
        [np.maximum(np.sum(piece, axis=0), 1e-300) for piece in pair]
        for part in parts
        for pair in zip(*(np.array_split(x, pieces) for x in part), strict=True)
    ]
    changes = [[float(np.sum(b - a)) for b, a in pairs], [float(np.sum(np.log(b / a))) for b, a in pairs]]
    return max(float(np.mean(c) / max(np.std(c, ddof=1) / np.sqrt(len(pairs)), 1e-300)) for c in changes)
