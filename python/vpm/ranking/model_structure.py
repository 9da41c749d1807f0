"""Structure: a model with effects, parameter values, and priors of its unknown parameters."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

from vpm.catalogue.kinds import Side
from vpm.discrepancy.screening.candidates import Key
from vpm.identify.moments import (
    AXES,
    PAIRS,
    free_moments,
    free_tensors,
    moments_of,
    rods,
    tensor_to_the_border,
    to_the_border,
)
from vpm.model import Effect, Model
from vpm.numbers import Array
from vpm.ranking.lever import Lever
from vpm.ranking.settings import MOVE
from vpm.weighing.priors import Prior

#: Deviations of a prior within which a value is that of its end.
ROUNDED = 1e-6


def sides_taken(model: Model, joint: str) -> set[Side]:
    """Sides of a joint in a structure that hold effects with a choice of side."""
    return {effect.side for effect in model.effects if effect.at == joint and effect.type.has_sides}


def approximate(model: Model) -> list[Effect]:
    """Effects of a structure's model whose laws are not exact."""
    return [effect for effect in model.effects if not effect.type.exact]


def without_sizes(model: Model, theta: Array, effects: Collection[Effect]) -> Array:
    """Parameter values of a structure at which some effects do nothing; shapes stay."""
    theta = theta.copy()
    for effect in effects:
        for short, name in effect.parameter_names.items():
            parameter = effect.type.parameter(short)
            if not parameter.shape and parameter.neutral is not None:
                theta[model.index(name)] = parameter.neutral
    return theta


@dataclass(frozen=True, eq=False)
class Structure:
    """Structure: effects in a model, parameter values, and priors of the unknown ones.

    Attributes
    ----------
    model : Model
    theta : ndarray, shape (p + f,)
        Values of the parameters, those of the model are its own, then of the unknown first states of the records.
    priors : mapping of str to Prior
        Parameters and first states that are unknown.
    effects : tuple of (str, str)
        What was added to the model of the user, in order.
    range_limited : tuple of str
        Shapes that records show between two ends alone: at one of these the effect is another one, or none.
    firsts : tuple of str
        Unknown first states, in their order.
    free_places : bool
        Whether places that records need not show, as of a spring that rests far away, may be anywhere; else they are as
        likely as their prior says.
    """

    model: Model
    theta: Array
    priors: Mapping[str, Prior]
    effects: tuple[Key, ...] = ()
    range_limited: tuple[str, ...] = ()
    firsts: tuple[str, ...] = ()
    free_places: bool = True

    def place(self, name: str) -> int:
        """Index of a parameter or first state among a structure's values."""
        if name in self.model.parameters:
            return self.model.index(name)
        return len(self.model.theta) + self.firsts.index(name)

    def shows(self, key: Key) -> bool:
        """Whether records can show each shape of an effect in a structure."""
        own = set(self.model.effect(*key, self.side(key)).parameter_names.values())
        values = {name: float(self.theta[self.model.index(name)]) for name in self.range_limited if name in own}
        return all(self.priors[name].low < value < self.priors[name].high for name, value in values.items())

    def is_overtone(self, key: Key, way: float) -> bool:
        """Whether an effect's period in a structure is a whole fraction of another's at its place.

        A law that repeats along the way has one tone, and what it stands for has overtones: those are no other effect.
        Waves are told apart that differ by one along the whole ``way`` (Lord Rayleigh, *Philosophical Magazine* 8,
        1879).
        """
        own = self._period(self.model.effect(*key, self.side(key)))
        others = [self._period(one) for one in self.model.effects if one.at == key[1] and one.name != key[0]]
        tones = [(other / own, way / other) for other in others if own and other]
        return any(round(ratio) > 1 and abs(ratio - round(ratio)) * waves < 1.0 for ratio, waves in tones)

    def lateness_of_readings(self, key: Key) -> float:
        """Time by which an effect has its sensor late in a structure, s; infinite for any other effect."""
        effect = self.model.effect(*key, self.side(key))
        if effect.type.site != "sensor" or not effect.type.shifts:
            return np.inf
        return sum(float(self.theta[self.model.index(name)]) for name in effect.parameter_names.values())

    def _period(self, effect: Effect) -> float:
        """Period of an effect in a structure; zero without one."""
        name = effect.parameter_names.get("period")
        return 0.0 if name is None else abs(float(self.theta[self.model.index(name)]))

    @cached_property
    def columns(self) -> list[int]:
        """Indices of a structure's unknown parameters."""
        return [self.place(name) for name in self.priors]

    @cached_property
    def ends(self) -> Array:
        """Bounds of a structure's unknown parameters (k, 2), in deviations of the priors."""
        return np.array([prior.ends for prior in self.priors.values()]).reshape(-1, 2)

    @cached_property
    def standard(self) -> Array:
        """Unknown parameters of a structure in deviations of their priors (k,)."""
        pairs = zip(self.priors.values(), self.columns, strict=True)
        return np.array([prior.standard(float(self.theta[column])) for prior, column in pairs])

    @cached_property
    def slopes(self) -> Array:
        """Change of each unknown parameter of a structure by one prior deviation (k,)."""
        pairs = zip(self.priors.values(), self.columns, strict=True)
        return np.array([prior.slope(float(self.theta[column])) for prior, column in pairs])

    @property
    def off_its_ends(self) -> Structure:
        """Structure with values that lie at an end of their range back in the middle of their priors.

        At its end a law answers to nothing, as friction that turns round at once and oil as soft as air. A fit that got
        there to make up for what was missing does not come back.
        """
        stuck = np.any(np.abs(self.standard[:, None] - self.ends) < ROUNDED, axis=1)
        return self.at(np.where(stuck, 0.0, self.standard)) if np.any(stuck) else self

    @property
    def doubt(self) -> float:
        """How improbable a structure's values are by its model file, and those of its effects by their priors, nats."""
        return self.doubt_of(self.model.adjustable)

    def doubt_of(self, names: Collection[str]) -> float:
        """How improbable a structure's values of some parameters are by their priors, nats."""
        return 0.5 * float(np.sum(self.standard[[name in names for name in self.priors]] ** 2))

    def moves(self, names: Sequence[str]) -> Array:
        """Step of each parameter of a structure for a difference quotient (len(names),)."""
        slopes = dict(zip(self.priors, np.abs(self.slopes), strict=True))
        return MOVE * np.array([slopes[name] or 1.0 for name in names])

    def with_room(self, places: Sequence[int], moves: Array) -> Array:
        """Parameters of a structure whose bodies stay possible where one moment at a time moves for a quotient.

        The moments of a rod are equal, and those of a plate add up: all three grow by what a step would lack.
        """
        theta = self.theta.copy()
        for moments in self._moments:
            steps = [abs(float(move)) for place, move in zip(places, moves, strict=True) if place in moments]
            own = theta[moments]
            theta[moments] += max(max(steps, default=0.0) - float(np.min(np.sum(own) - 2.0 * own)), 0.0)
        return theta

    @property
    def values(self) -> dict[str, float]:
        """Unknown parameters of a structure by name, SI."""
        own = zip(self.priors, self.columns, strict=True)
        return {name: float(self.theta[column]) for name, column in own if name not in self.firsts}

    @property
    def repaired(self) -> Model:
        """Model of a structure with its effects, at its values."""
        return self.model.with_parameters(self.values)

    def bare(self, effects: Collection[Effect]) -> Structure:
        """Structure in which some effects do nothing; shapes stay."""
        return replace(self, theta=without_sizes(self.model, self.theta, effects), priors={})

    def at(self, standard: Array) -> Structure:
        """Structure with unknown parameters at given prior deviations, within bounds."""
        inside = np.clip(standard, self.ends[:, 0], self.ends[:, 1])
        theta = self.theta.copy()
        for prior, column, z in zip(self.priors.values(), self.columns, inside, strict=True):
            theta[column] = prior.value(float(z))
        for pair in self._rods:
            theta[pair] = float(np.mean(theta[pair]))
        for moments in self._moments:
            theta[moments] = to_the_border(self.theta[moments], theta[moments])
        for inertia in self._tensors:
            theta[inertia] = tensor_to_the_border(self.theta[inertia], theta[inertia])
        return replace(self, theta=theta)

    @cached_property
    def _moments(self) -> list[list[int]]:
        """Places of all three moments of inertia in a structure, of each body of which some are unknown."""
        return [[self.place(one) for one in moments_of(names[0])] for names in free_moments(self.model, self.priors)]

    @cached_property
    def _tensors(self) -> list[list[int]]:
        """Places of moments and products of inertia in a structure, of each body whose principal axes may turn."""
        bodies, entries = free_tensors(self.model, self.priors), (*AXES, *PAIRS)
        return [[self.place(f"{body}.inertia.{axes}") for axes in entries] for body in bodies]

    @cached_property
    def room(self) -> tuple[Array, Array]:
        """By how much two moments of inertia of a structure's bodies exceed the third (r,), and its change (r, k).

        The change is by prior deviations of what is unknown. No body has less than none.
        """
        excess = np.ones((3, 3)) - 2.0 * np.eye(3)
        rooms, changes = [np.zeros(0)], [np.zeros((0, len(self.columns)))]
        for moments in self._moments:
            moved = np.equal.outer(moments, self.columns) * self.slopes
            rooms.append(excess @ self.theta[moments])
            changes.append(excess @ moved)
        return np.concatenate(rooms), np.vstack(changes)

    @cached_property
    def _rods(self) -> list[list[int]]:
        """Places of unknown moments of inertia in a structure that are equal, for no body has others."""
        return [[self.place(name) for name in pair] for pair in rods(self.model, self.priors)]

    @cached_property
    def levers(self) -> list[Lever]:
        """Sizes of a structure's effects and the places that these act at, among the unknown."""
        names, found = list(self.priors), []
        for effect in self.model.effects:
            own = [(effect.type.parameter(short), name) for short, name in effect.parameter_names.items()]
            places = tuple(names.index(name) for one, name in own if one.is_place and name in names)
            sizes = [names.index(name) for one, name in own if not one.shape and name in names]
            if places and len(sizes) == 1 and self.theta[self.columns[sizes[0]]] != 0.0:
                found.append(Lever(sizes[0], places, effect.type.adds_inertia))
        return found

    @property
    def anywhere(self) -> list[int]:
        """Places of a structure's effects, among the unknown, that records need not show and that may be anywhere."""
        return [one.places[0] for one in self.levers if self.free_places and not one.is_mass]

    def moved(self, move: Array) -> Structure:
        """Structure moved by prior deviations; products of sizes and places move in a straight line."""
        to, change = self.at(self.standard + move), move * self.slopes
        for lever in self.levers:
            size, places = self.columns[lever.size], [self.columns[place] for place in lever.places]
            before, more = float(self.theta[size]), float(to.theta[size] - self.theta[size])
            after, there = lever.moved(before, self.theta[places], more, change[list(lever.places)])
            prior = list(self.priors.values())[lever.size]
            if prior.low <= after <= prior.high:
                to.theta[size], to.theta[places] = after, there
        return to

    def way_to(self, other: Structure) -> Array:
        """Prior deviations by which another structure was moved from this one."""
        way = other.standard - self.standard
        for lever in self.levers:
            size, places = self.columns[lever.size], [self.columns[place] for place in lever.places]
            before, after = ((float(theta[size]), theta[places]) for theta in (self.theta, other.theta))
            more, there = lever.way(*before, *after)
            way[lever.size] = more / self.slopes[lever.size]
            way[list(lever.places)] = there / self.slopes[list(lever.places)]
        return way

    def carried(self, model: Model, renamed: Mapping[str, str] = MappingProxyType({})) -> Structure:
        """Structure carried to another model, for parameters that it has too."""
        names = {name: renamed.get(name, name) for name in self.model.parameter_names}
        kept = {name: new for name, new in names.items() if new in model.parameters}
        theta = np.concatenate([model.theta, self.theta[len(self.model.theta) :]])
        for name, new in kept.items():
            theta[model.index(new)] = self.theta[self.model.index(name)]
        kept |= {name: name for name in self.firsts}
        priors = {kept[name]: prior for name, prior in self.priors.items() if name in kept}
        range_limited = tuple(kept[name] for name in self.range_limited if name in kept)
        return Structure(model, theta, priors, self.effects, range_limited, self.firsts)

    def beside(self, joint: str, side: Side) -> Structure:
        """Structure with friction, springs or stops of a joint on one of its sides."""
        content, renamed = self.model.to_dict(), {}
        for entry, effect in zip(content["effects"], self.model.effects, strict=True):
            if effect.at == joint and effect.type.has_sides:
                entry["side"] = side
        model = type(self.model)(content)
        for old, new in zip(self.model.effects, model.effects, strict=True):
            renamed.update({name: new.parameter_names[short] for short, name in old.parameter_names.items()})
        return self.carried(model, renamed)

    @property
    def added(self) -> tuple[Effect, ...]:
        """Effects that were added, in order; one may be there twice, on both sides of a joint that is split."""
        return tuple(self._alike(key)[-self.effects[place:].count(key)] for place, key in enumerate(self.effects))

    def side(self, key: Key) -> Side:
        """Side of its joint on which an effect of a structure is; the last one that came, if it is on both."""
        return self._alike(key)[-1].side

    def _alike(self, key: Key) -> list[Effect]:
        return [effect for effect in self.model.effects if (effect.name, effect.at) == key]

    def without(self, key: Key, side: Side | None = None) -> Structure:
        """Structure without one of its effects.

        - ``side``: of its joint, where the effect is on both; otherwise it goes where it is

        Raises
        ------
        ModelError
            Another effect rests on it.
        """
        sides = [effect.side for effect in self._alike(key)]
        gone = side if side in sides else self.side(key)
        rest = self.carried(self.model.without_effect(*key, gone))
        left = {effect.key for effect in rest.model.effects}
        return replace(rest, effects=tuple((one.name, one.at) for one in self.added if one.key in left))

    def with_last_of(self, other: Structure) -> Structure:
        """Structure with the last effect of another structure added.

        Raises
        ------
        VpmError
            It cannot stand here.
        """
        key = (name, site) = other.effects[-1]
        there = other.model.effect(name, site, other.side(key))
        places = {short: other.model.index(dotted) for short, dotted in there.parameter_names.items()}
        values = {short: float(other.theta[place]) for short, place in places.items()}
        carried = self.carried(self.model.with_effect(name, site, side=there.side, **values))
        own = set(there.parameter_names.values()) - set(self.model.parameters)
        priors = {**carried.priors, **{name: prior for name, prior in other.priors.items() if name in own}}
        limited = (*carried.range_limited, *(name for name in other.range_limited if name in own))
        return replace(carried, priors=priors, effects=(*self.effects, key), range_limited=limited)
