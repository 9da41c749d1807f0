"""How machines follow a measured record: what their parts answer, remembered, and gauges that hold their links.

A link that hardly loses energy rings for as long as the record with every error of the motion that drives it: noise of
encoders twice differentiated, a first state that nobody knows, a stiffness that is a little wrong. A gauge shows what
the link did instead. A damper between the predicted and the measured rate of strain takes the energy out of their
difference and leaves alone what they agree in (a natural observer: M. Demetriou, *Systems & Control Letters* 51, 2004).
Below the frequency of the ringing it changes nothing: strains and efforts follow from the motion as before.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from threading import Lock
from typing import TypeAlias, TypeVar

import numpy as np

from vpm.experiment import Experiment, Motion
from vpm.experiment.signal import differentiate, lowpass
from vpm.identify.parts import Part
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import AUTOMATIC

#: Numbers (n, k) along a record, and their derivatives (n, k, columns).
Pair = tuple[Array, Array]
#: From (N, k) to the (n, k) that are compared.
Filter = Callable[[Array], Array]
#: Unfiltered numbers of a part, and their derivatives, by its values and the places of its parameters.
Work = Callable[[Array, Sequence[int]], Pair]
Object = TypeVar("Object")
#: What no parameter changes, by what it depends on.
Built: TypeAlias = OrderedDict[Hashable, object]

#: Answers that are kept for all records: what one round of a search asks, the next one asks again.
KEPT = 1000
#: Numbers that are kept for all records; the answer asked for last stays whatever its size.
MOST_NUMBERS = 40_000_000
#: Damping ratio of the difference between a link and its gauge, in the mode that the gauge shows best.
DAMPING_RATIO = 0.3


@dataclass(frozen=True)
class Answer:
    """Numbers (n, k) along a record and, by parameter name, their derivatives (n, k)."""

    values: Array
    slopes: dict[str, Array]

    @property
    def numbers(self) -> int:
        """Number of values that a remembered answer of a following machine holds."""
        return self.values.size * (1 + len(self.slopes))


class Memo:
    """Answers by what they depend on; safe to be used by several threads.

    - ``built``: what no parameter changes, where others have built it; theirs may be added to
    """

    def __init__(self, built: Built | None = None) -> None:
        self._lock = Lock()
        self._answers: OrderedDict[Hashable, Answer] = OrderedDict()
        self._built: Built = OrderedDict() if built is None else built
        self._numbers = 0

    def recall(self, key: Hashable, names: Sequence[str], work: Callable[[Sequence[str]], Pair]) -> Pair:
        """Values (n, k) and derivatives (n, k, names) of a following machine; ``work`` computes unknown names."""
        known = self.known(key)
        missing = [name for name in names if known is None or name not in known.slopes]
        if known is None or missing:
            values, slopes = work(missing)
            fresh = {name: np.ascontiguousarray(slopes[:, :, place]) for place, name in enumerate(missing)}
            # What is read elsewhere is never changed: an answer that learnt more takes its place.
            known = Answer(known.values, {**known.slopes, **fresh}) if known else Answer(values, fresh)
            self.keep(key, known)
        columns = [known.slopes[name] for name in names]
        return known.values, np.stack(columns, axis=2) if columns else np.zeros((*known.values.shape, 0))

    def known(self, key: Hashable) -> Answer | None:
        """Remembered answer of a following machine."""
        with self._lock:
            if key in self._answers:
                self._answers.move_to_end(key)
            return self._answers.get(key)

    def once(self, key: Hashable, build: Callable[[], Object]) -> Object:
        """Object of a following machine that no parameter changes, built at the first call."""
        with self._lock:
            if key in self._built:
                return self._built[key]  # type: ignore[return-value]
        built = build()
        with self._lock:
            self._built[key] = built
            while len(self._built) > KEPT:
                self._built.popitem(last=False)
        return built

    def keep(self, key: Hashable, answer: Answer) -> None:
        """Remember an answer of a following machine; the oldest one is forgotten."""
        with self._lock:
            before = self._answers.pop(key, None)
            self._answers[key] = answer
            self._numbers += answer.numbers - (before.numbers if before else 0)
            while len(self._answers) > KEPT or (self._numbers > MOST_NUMBERS and len(self._answers) > 1):
                _, oldest = self._answers.popitem(last=False)
                self._numbers -= oldest.numbers


@dataclass(frozen=True, eq=False)
class Following:
    """How machines follow one record, and what they answered to it before."""

    keep: Filter  #: Filter of the record.
    integrator: str = AUTOMATIC  #: How drives are run along the motion, as `vpm.simulate.Setup` names it.
    commands: int = 0  #: Which commands they are given: 0 for those of the record.
    hold: Hold | None = None  #: Gauges that hold the links along the record.
    departure: Array | None = None  #: By how much what is free begins away from rest.
    record: int = 0  #: Its number, among those that share the memo.
    memo: Memo = field(default_factory=Memo)

    def filtered(self, values: Array, slopes: Array) -> Pair:
        """Values (N, k) of a following machine and derivatives (N, k, columns), filtered at compared samples."""
        rows, *shape = slopes.shape
        kept = self.keep(values)
        return kept, self.keep(slopes.reshape(rows, math.prod(shape))).reshape(len(kept), *shape)

    def answer(
        self,
        part: Part,
        theta: Array,
        columns: Sequence[int],
        work: Work,
        more: Hashable = (),
        origin: Array | None = None,
    ) -> Pair:
        """Filtered values (n, k) of a following part and their derivative (n, k, columns).

        - ``theta``: shape (P,), of the whole machine
        - ``columns``: its parameters to differentiate by
        - ``more``: all else that the answer depends on
        - ``origin``: shape (P,), the answer is taken from the tangent at these values, not worked out at ``theta``
        """
        values, names = theta[part.places], part.model.parameter_names
        start = values if origin is None else np.where(part.felt, origin[part.places], values)
        own = {int(part.places[place]): int(place) for place in np.flatnonzero(part.felt)}
        felt = [number for number, column in enumerate(columns) if column in own]
        moved = np.flatnonzero(values != start).tolist()
        asked = list(dict.fromkeys([*(own[columns[number]] for number in felt), *moved]))

        def worked(missing: Sequence[str]) -> Pair:
            return self.filtered(*work(start, [names.index(name) for name in missing]))

        key = self._key(part, start, more)
        found, slopes = self.memo.recall(key, [names[place] for place in asked], worked)
        derivative = np.zeros((*found.shape, len(columns)))
        derivative[:, :, felt] = slopes[:, :, [asked.index(own[columns[number]]) for number in felt]]
        return found + slopes @ (values - start)[asked] if moved else found, derivative

    def share(
        self, one: tuple[Part, Array], others: Sequence[tuple[Part, Array, Sequence[str]]], more: Hashable
    ) -> None:
        """Let other following parts have the answer of ``one``, each with its machine's values.

        Of its own parameters, which come last, those that ``one`` was not differentiated by have no influence.
        """
        part, theta = one
        known = self.memo.known(self._key(part, theta[part.places], more))
        if known is None:
            return
        nothing = np.zeros_like(known.values)
        for other, values, own in others:
            names = [name for name in other.model.parameter_names if name in known.slopes or name in own]
            slopes = {name: known.slopes.get(name, nothing) for name in names}
            self.memo.keep(self._key(other, values[other.places], more), Answer(known.values, slopes))

    def _key(self, part: Part, values: Array, more: Hashable) -> Hashable:
        """Key of a following part's remembered answer: record, structure and parameter values."""
        return self.record, part.model.structure, values[part.felt].tobytes(), more


@dataclass(frozen=True)
class Hold:
    """Strain gauges that hold the flexible links of a machine along one record: rates and gains."""

    gauges: tuple[str, ...]  #: Those that hold.
    rate: Array  #: Shape (N, gauges); measured rates of strain, 1/s, through the filter of the motion.
    #: Shape (gauges,); how firmly, J s: force on the coordinates of the link per missing rate of strain and strain per
    #: coordinate.
    gain: Array

    def arguments(self, model: Model) -> tuple[Array, Array]:
        """Gauge rates (N, all gauges) and gains for following links, in the model's order; zero for the others."""
        rate, gain = np.zeros((len(self.rate), len(model.gauges))), np.zeros(len(model.gauges))
        for column, name in enumerate(self.gauges):
            if name in model.gauges:
                place = model.gauges.index(name)
                rate[:, place], gain[place] = self.rate[:, column], self.gain[column]
        return rate, gain


def gauge_gains(model: Model, experiments: Sequence[Experiment], position: Array) -> dict[str, float]:
    """Gains by which gauges hold bending links that follow a record, for those that all logs hold.

    With the joints held, a gauge sees the modes by their shares of its compliance, ``(C phi)^2 / omega^2`` at shapes of
    modal mass one. Alone it gives the one with the largest share the damping ratio `DAMPING_RATIO`.

    ``position``: shape (joints,), of all joints, m or rad.
    Result: gains in J s by gauge.
    """
    logged = [name for name in model.gauges if all(f"{name}.strain" in e for e in experiments)]
    joints, count = len(model.joints), len(model.coordinates)
    if not logged or count == joints:
        return {}
    core, theta = model.core, model.theta
    state = np.zeros(core.n_states)
    state[:count] = core.equilibrium(theta, position)[0]
    slopes, _, outputs, _ = core.linearize(theta, state, np.zeros(core.n_inputs))
    mass = core.mass_matrix(theta, state[:count])
    stiffness = -(mass @ slopes[count : 2 * count, :count])[joints:, joints:]
    own = mass[joints:, joints:]
    roots = np.linalg.inv(np.linalg.cholesky(own))
    squares, shapes = np.linalg.eigh(roots @ (0.5 * (stiffness + stiffness.T)) @ roots.T)
    gains = {}
    for name in logged:
        row = outputs[model.output_channels.index(f"{name}.strain"), joints:count]
        seen = (row @ roots.T @ shapes) ** 2
        if np.all(squares > 0.0) and np.any(seen):
            best = int(np.argmax(seen / squares))
            gains[name] = float(2.0 * DAMPING_RATIO * np.sqrt(squares[best]) / seen[best])
    return gains


def hold_of(gains: dict[str, float], experiment: Experiment, m: Motion) -> Hold | None:
    """Rates and gains of gauges that hold links following one record; None where no gauge does."""
    if not gains:
        return None
    strains = np.column_stack([experiment[f"{name}.strain"] for name in gains])
    rate = differentiate(lowpass(strains, 1.0 / m.dt, m.cutoff), m.dt)
    return Hold(tuple(gains), rate, np.array(list(gains.values())))
