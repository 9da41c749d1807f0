"""What a rigid machine needs and ideal drives deliver along a measured motion, part by part, each worked out once.

The motion never changes: what the tree needs for it, what each effect on a joint takes and what the drives deliver do
not depend on each other, and a search that tries one effect after the other asks for the same parts every time. In
masses, and in the sizes of effects, each part is linear besides: its column is the same wherever they stand.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Motion
from vpm.identify.drive_memory import DriveMemory
from vpm.model import Model
from vpm.model.effects import Effect

Array = NDArray[np.float64]

#: Laws on joints that come with another coordinate: their machine is no rigid one.
WITH_COORDINATES = frozenset({"backlash", "joint_compliance", "link_flexibility"})
#: Terms of the empirical force that follow the load of the joint, and so all other parts.
OF_THE_LOAD = ("load_dry", "load_cosine", "load_sine")
#: Type of an effect on a joint that belongs to the tree.
OF_THE_TREE = "rotor_inertia"

Pair = tuple[Array, Array]
#: Gives (N, k) efforts along a motion at parameters (P,) and their derivatives (N, k, columns).
Work = Callable[[Array, Sequence[int]], Pair]


@dataclass(frozen=True)
class Part:
    """One part of the balance of effort.

    Attributes
    ----------
    text : hashable
        What it is, without the values of its parameters: two machines with the same text have the same part.
    names : tuple of str
        Parameters that it may depend on.
    places : ndarray of int
        Their places among those of the machine.
    linear : ndarray of bool
        In which of them it is linear, all others being fixed.
    number : int
        Of an effect, its number in the description.
    joint : int
        Of an effect, its joint.
    """

    text: Hashable
    names: tuple[str, ...]
    places: NDArray[np.int64]
    linear: NDArray[np.bool_]
    number: int = -1
    joint: int = -1


@dataclass(frozen=True)
class Parts:
    """What a motion needs as the parts that add up: the tree, less what effects put on its joints."""

    tree: Part
    laws: tuple[Part, ...]


@lru_cache(maxsize=512)
def parts_needed(model: Model) -> Parts | None:
    """Parts of what a motion of all joints needs of a rigid machine; None where they do not add up."""
    if any(effect.name in WITH_COORDINATES or _follows_load(effect) for effect in model.effects):
        return None
    laws = [effect for effect in model.effects if effect.type.site == "joint" and effect.name != OF_THE_TREE]
    described = json.loads(model.description())
    entries = described["effects"]
    numbers = [place for place, entry in enumerate(entries) if "joint" in entry and entry["type"] != OF_THE_TREE]
    sensing = [name for name in model.parameter_names if name.partition(".")[0] in model.sensors]
    sensors = json.dumps(described["sensors"]), tuple(sensing), model.joints
    parts = [
        _part(
            model,
            (effect.name, str(effect.type.formula), effect.at, tuple(effect.parameter_names), sensors),
            [*effect.parameter_names.values(), *sensing],
            (number, int(entries[number]["joint"])),
        )
        for effect, number in zip(laws, numbers, strict=True)
    ]
    aside = {name for effect in laws for name in effect.parameter_names.values()}
    drives = {*model.actuators, *model.controllers}
    own = [name for name in model.parameter_names if name not in aside and name.partition(".")[0] not in drives]
    tree = {key: value for key, value in described.items() if key not in _NOT_OF_THE_TREE}
    tree["effects"] = [entry for place, entry in enumerate(entries) if place not in numbers]
    return Parts(_part(model, json.dumps(tree), own), tuple(parts))


@lru_cache(maxsize=512)
def part_delivered(model: Model) -> Part | None:
    """What ideal drives deliver on the joints; None where one pulls at a line, whose arms are those of the tree."""
    if any(model.line_of_actuator(name) is not None for name in model.actuators):
        return None
    own = [name for name in model.parameter_names if name.partition(".")[0] in model.actuators]
    actuators = json.dumps(json.loads(model.description())["actuators"])
    part = _part(model, (actuators, model.joints, "delivered"), own)
    return replace(part, linear=np.zeros_like(part.linear))  # a limit of the effort cuts off what a gain gives


_NOT_OF_THE_TREE = frozenset({"parameters", "parameter_names", "actuators", "controllers", "effects"})


def _follows_load(effect: Effect) -> bool:
    return any(term in effect.parameter_names for term in OF_THE_LOAD)


def _part(model: Model, text: Hashable, names: Sequence[str], law: tuple[int, int] = (-1, -1)) -> Part:
    places = np.array([model.index(name) for name in names], dtype=np.int64)
    linear = np.array([model.parameters[name].kind == "linear" for name in names], dtype=np.bool_)
    return Part((text, tuple(names)), tuple(names), places, linear, *law)


def needed(parts: Parts, model: Model, theta: Array, m: Motion, names: Sequence[str], memory: DriveMemory) -> Pair:
    """Effort that a motion needs at each joint (n, joints), filtered, and its derivative by the named parameters.

    Raises
    ------
    ValueError
        The machine does not exist with these parameters.
    """
    model.core.check(theta)
    required, slopes = of_tree(parts.tree, model, theta, m, names, memory)
    if not parts.laws:
        return required, slopes
    taken, own = of_laws(parts.laws, model, theta, m, names, memory)
    return required - taken, slopes - own


def of_laws(
    laws: Sequence[Part], model: Model, theta: Array, m: Motion, names: Sequence[str], memory: DriveMemory
) -> Pair:
    """What effects, at least one, put on the joints (n, joints), filtered, and its derivative."""

    def work(number: int, values: Array, asked: Sequence[int]) -> Pair:
        motion = (m.position, m.velocity, m.acceleration, m.dt)
        effort, own = model.core.effort_of_effect(values, number, *motion, list(asked))
        return effort[:, None], own[:, None]

    answers = [_answer(law, model, theta, names, (memory, partial(work, law.number))) for law in laws]
    total = np.zeros((len(answers[0][0]), len(model.joints)))
    slopes = np.zeros((*total.shape, len(names)))
    for law, (effort, own) in zip(laws, answers, strict=True):
        total[:, law.joint] += effort[:, 0]
        slopes[:, law.joint] += own[:, 0]
    return total, slopes


def of_tree(tree: Part, model: Model, theta: Array, m: Motion, names: Sequence[str], memory: DriveMemory) -> Pair:
    """What the tree needs of it (n, joints), and a fresh array of its derivative."""

    def work(values: Array, asked: Sequence[int]) -> Pair:
        motion = (m.position, m.velocity, m.acceleration, m.dt)
        return model.core.required(values, *motion, list(asked), effects=False)

    return _answer(tree, model, theta, names, (memory, work))


def delivered(drives: Part, model: Model, theta: Array, m: Motion, names: Sequence[str], memory: DriveMemory) -> Pair:
    """Effort that the drives deliver at each joint (n, joints), filtered, and its derivative."""

    def work(values: Array, asked: Sequence[int]) -> Pair:
        return model.core.delivered(values, m.inputs, m.dt, list(asked))

    drives = replace(drives, text=(drives.text, memory.commands))
    return _answer(drives, model, theta, names, (memory, work))


def _answer(part: Part, model: Model, theta: Array, names: Sequence[str], known: tuple[DriveMemory, Work]) -> Pair:
    """Filtered values (n, k) of one part and a fresh array of derivatives (n, k, names).

    Where its other parameters are those of the model, as they are in a fit that holds them, the part is linear in the
    rest: it is taken from one place, the same whoever asks first.
    """
    memory, _ = known
    own = theta[part.places]
    start = np.where(part.linear, _origin(part, memory), own) if _held(part, model, own) else own
    moved = {name for name, one, other in zip(part.names, start, own, strict=True) if one != other}
    linear = {name for name, straight in zip(part.names, part.linear, strict=True) if straight}
    felt = [name for name in names if name in part.names]
    there = [name for name in part.names if name in moved or (name in felt and (name in linear or not moved))]
    values, slopes = _recall(part, model, theta, start, there, known)
    columns = {name: slopes[:, :, place] for place, name in enumerate(there)}
    if moved:
        steps = dict(zip(part.names, own - start, strict=True))
        values = values + slopes @ np.array([steps[name] for name in there])
        here = [name for name in felt if name not in linear]
        if here:
            _, bent = _recall(part, model, theta, own, here, known)
            columns |= {name: bent[:, :, place] for place, name in enumerate(here)}
    derivative = np.zeros((*values.shape, len(names)))
    for place, name in enumerate(names):
        if name in columns:
            derivative[:, :, place] = columns[name]
    return values, derivative


def _held(part: Part, model: Model, own: Array) -> bool:
    fixed = part.places[~part.linear]
    return bool(part.linear.any()) and np.array_equal(own[~part.linear], model.theta[fixed])


def _origin(part: Part, memory: DriveMemory) -> Array:
    return np.array([memory.origin.get(name, 0.0) for name in part.names])


def _recall(
    part: Part, model: Model, theta: Array, at: Array, names: Sequence[str], known: tuple[DriveMemory, Work]
) -> Pair:
    memory, work = known
    values = theta.copy()
    values[part.places] = at

    def fresh(missing: Sequence[str]) -> Pair:
        return work(values, [model.index(name) for name in missing])

    return memory.recall((part.text, at.tobytes()), names, fresh)
