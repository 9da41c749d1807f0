"""What bends along a measured motion, worked out once for all models that do not differ in what moves it.

Where every joint was measured, laws of effort at the joints and faults of the drives do not change how the links bend:
their effort is added to the balance as it would be on rigid links, sample by sample, with nothing to integrate. Only
what moves the links (masses, elasticities, gravity, instruments of the motion) asks for another simulation.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from operator import itemgetter
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vpm.identify.gauges import Hold
from vpm.model import Model, Shape
from vpm.model.effects import Effect

Array = NDArray[np.float64]

#: Simulations that are kept for each record: those of one round of a search.
KEPT = 48
#: Values that have moved by no more than this share of themselves leave derivatives good enough for a first look: by
#: more, links that hardly lose anything swing out of step with what was kept.
NEAR = 0.005


@dataclass(frozen=True)
class Parts:
    """A machine with elastic links as what moves them and what does not; values of these models mean nothing.

    Attributes
    ----------
    bare : Model
        Without the laws of its joints and the faults of its drives.
    places : ndarray of int
        Its parameters among those of the machine.
    laws, shell : Model
        Both machines with rigid links and no play: their difference in effort is that of the laws. None of them without
        laws.
    of_laws, of_shell : ndarray of int
        Their parameters among those of the machine.
    felt : frozenset of int
        Parameters of the machine that change this difference.
    moving : frozenset of int
        Those that may change how the links bend.
    still : ndarray of bool
        Which parameters of ``bare`` do not: those of drives and controllers.
    """

    bare: Model
    places: NDArray[np.int64]
    laws: Model | None
    shell: Model | None
    of_laws: NDArray[np.int64]
    of_shell: NDArray[np.int64]
    felt: frozenset[int]
    moving: frozenset[int]
    still: NDArray[np.bool_]


def parts_of(model: Model, joints: tuple[str, ...]) -> Parts | None:
    """Split a machine whose measured ``joints`` are all that it has beside plays; None where nothing bends or flies.

    Where a joint remembers its way, joints that wind up count as plays do: a motion that is worked out carries no
    memory along, and the measured joint, on the side of the motor, is the one that remembers.
    """
    remembers = any(effect.type.memory for effect in model.effects)
    return split(model, joints, wound=remembers)


def split(model: Model, joints: tuple[str, ...], *, wound: bool) -> Parts | None:
    """The same where joints that are ``wound`` up count as plays do, or do not."""
    return _split(Shape(model), joints, wound)


@lru_cache(maxsize=128)
def _split(shape: Shape, joints: tuple[str, ...], wound: bool) -> Parts | None:
    model = shape.model
    splitting = [e for e in model.effects if e.type.has_play or (wound and e.type.splits)]
    plays = [e for e in splitting if model.joint_behind(e.at)]
    flying = {model.joint_behind(e.at) for e in plays}
    if any(e.side == "link" and model.joint_behind(e.at) for e in model.effects):
        return None  # what acts behind a spring moves it
    if tuple(joint for joint in model.joints if joint not in flying) != joints:
        return None
    if not model.core.n_elastic and (not plays or any(e.type.rotor for e in model.effects)):
        return None  # a rotor is what flies against
    aside = [e for e in model.effects if e.type.site in {"joint", "actuator"} and not e.type.splits]
    if len(aside) + len(plays) < sum(e.type.site in {"joint", "actuator"} for e in model.effects):
        return None
    content = model.to_dict()
    bare = _without(content, aside)
    places = np.array([model.index(name) for name in bare.parameter_names], dtype=np.int64)
    owners = {*model.actuators, *model.controllers}
    still = np.array([name.partition(".")[0] in owners for name in bare.parameter_names], dtype=np.bool_)
    moving = frozenset(places[~still].tolist())
    laws = [effect for effect in aside if effect.type.site == "joint"]
    if not laws:
        return Parts(bare, places, None, None, places, places, frozenset(), moving, still)
    felt = {model.index(name) for effect in laws for name in effect.parameter_names.values()}
    read = [effect for effect in model.effects if effect.type.site == "sensor"]
    felt |= {model.index(name) for effect in read for name in effect.parameter_names.values()}
    # With rigid links; a beam that bends by an effect does so at every level.
    bent = [*plays, *(effect for effect in model.effects if effect.type.motion == "bending")]
    rigid = bool(model.core.n_elastic)
    whole, shell = (_without(content, effects, rigid=rigid) for effects in (bent, [*bent, *aside]))
    of_laws, of_shell = (np.array([model.index(n) for n in m.parameter_names], dtype=np.int64) for m in (whole, shell))
    return Parts(bare, places, whole, shell, of_laws, of_shell, frozenset(felt), moving, still)


def _without(content: Mapping[str, Any], effects: Sequence[Effect], *, rigid: bool = False) -> Model:
    """The machine of a model file's content without some effects, and with rigid links."""
    gone = {(effect.name, effect.at, effect.side) for effect in effects}
    of = itemgetter("type", "at")
    kept = [entry for entry in content.get("effects", ()) if (*of(entry), entry.get("side", "motor")) not in gone]
    changed = {**content, "effects": kept}
    if rigid:
        changed["beams"] = {name: {**beam, "level": "rigid"} for name, beam in content["beams"].items()}
    return Model.from_dict(changed)


@dataclass
class Answer:
    """Channels (n, k) along a motion and, by parameter, their derivatives (n, k)."""

    channels: Array
    slopes: dict[str, Array] = field(default_factory=dict)


#: Gives channels (n, k) and their derivative (n, k, columns).
Work = Callable[[Model, Array, Sequence[int]], tuple[Array, Array]]


class Kept:
    """Answers of bare machines along one record, by structure and parameter values; safe on several threads."""

    def __init__(self, hold: Hold | None = None, departure: Array | None = None) -> None:
        #: Gauges that hold the links along the record, and by how much what is free begins away from rest.
        self.hold, self.departure = hold, departure
        self._answers: OrderedDict[tuple[str, bytes], Answer] = OrderedDict()
        self._shared: dict[str, tuple[Array, dict[str, Array]]] = {}
        self._lock = Lock()

    def answer(self, parts: Parts, theta: Array, columns: Sequence[int], work: Work) -> tuple[Array, Array]:
        """Channels (n, k) and derivative (n, k, columns) of the bare machine; what is not known is worked out."""
        key, bare = (parts.bare.structure, theta.tobytes()), parts.bare
        names = [bare.parameter_names[column] for column in columns]
        with self._lock:
            known = self._answers.get(key)
            slopes = dict(known.slopes) if known else {}
        fresh = list(dict.fromkeys(c for c, name in zip(columns, names, strict=True) if name not in slopes))
        if known is None or fresh:
            channels, jacobian = work(bare, theta, fresh)
            slopes |= {bare.parameter_names[c]: jacobian[:, :, k] for k, c in enumerate(fresh)}
            known = Answer(channels, slopes)
            self._keep(key, known)
        stacked = [slopes[name] for name in names]
        return known.channels, np.stack(stacked, axis=2) if stacked else np.zeros((*known.channels.shape, 0))

    def near(
        self, parts: Parts, origin: Array, theta: Array, columns: Sequence[int], work: Work
    ) -> tuple[Array, Array]:
        """The same on the tangent at ``origin``."""
        moved = np.flatnonzero(theta != origin).tolist()
        wanted = list(dict.fromkeys([*columns, *moved]))
        channels, jacobian = self.answer(parts, origin, wanted, work)
        steps = (theta - origin)[wanted]
        return channels + jacobian @ steps, jacobian[:, :, : len(columns)]

    def share(self, one: tuple[Parts, Array], other: tuple[Parts, Array], own: Sequence[str]) -> None:
        """Let the machine ``other`` (its values with it) have the answer of ``one``, which moves in the same way there.

        Of its ``own`` parameters those that ``one`` was not differentiated by have no influence.
        """
        (first, theta), (second, values) = one, other
        with self._lock:
            known = self._answers.get((first.bare.structure, theta.tobytes()))
        if known is None:
            return
        nothing = np.zeros_like(known.channels)
        slopes = {name: known.slopes[name] for name in second.bare.parameter_names if name in known.slopes}
        slopes |= {name: nothing for name in own if name not in slopes}
        with self._lock:
            self._shared[second.bare.structure] = values, {name: slopes[name] for name in own}
        self._keep((second.bare.structure, values.tobytes()), Answer(known.channels, slopes))

    def share_again(self, one: tuple[Parts, Array], others: Sequence[tuple[Parts, Array]]) -> bool:
        """Let the ``others`` have the answer of ``one`` with derivatives by their own parameters shared earlier.

        False, and nothing done, where one of them was not shared or the values have moved far since.
        """
        first, theta = one
        with self._lock:
            known = self._answers.get((first.bare.structure, theta.tobytes()))
            earlier = [self._shared.get(parts.bare.structure) for parts, _ in others]
        found = []
        for (parts, values), before in zip(others, earlier, strict=True):
            if known is None or before is None:
                return False
            moved = ~parts.still & (np.abs(values - before[0]) > NEAR * np.abs(before[0]))
            if np.any(moved):
                return False
            found.append(((parts.bare.structure, values.tobytes()), Answer(known.channels, dict(before[1]))))
        for key, answer in found:
            self._keep(key, answer)
        return True

    def _keep(self, key: tuple[str, bytes], answer: Answer) -> None:
        with self._lock:
            before = self._answers.pop(key, None)
            if before is not None:
                answer.slopes = {**before.slopes, **answer.slopes}
            self._answers[key] = answer
            while len(self._answers) > KEPT:
                self._answers.popitem(last=False)
