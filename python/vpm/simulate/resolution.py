"""What steps do not resolve, and what they make of it."""

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from vpm.model import Model
from vpm.numbers import Array
from vpm.results import Storable
from vpm.simulate.setup import Setup


class Modes(NamedTuple):
    """Modes of a linear machine and sites of dry friction as integration steps change them; see `Resolution`."""

    limit: float
    frequencies: Array
    ratios: Array
    times: Array
    left: Array
    shifts: Array
    sites: tuple[str, ...]
    turns: Array


class Resolution(Storable):
    """What the steps of a run do not resolve; as a text one sentence.

    Modes are those of the linear machine without dry friction, about the first state or about one where a joint is
    farthest out: that with the fastest of them, for end stops and other springs stiffen there. One is listed if its own
    damping ratio is below 0.1 and the method takes more than a tenth of its amplitude or moves its frequency by more,
    or if the method lets it grow. Dry friction is listed where steps of the method do not bring to rest what it brakes.
    That of joints, shafts, drives and seals counts, with memory and without, at the first state and where a state of a
    drive or a command is farthest out, for there it may rub most. All of it is worked out when somebody looks: a batch
    pays for no run that nobody asks.

    - ``step``: s
    - ``modes``: gives the modes; called once, or never
    """

    def __init__(self, integrator: str, step: float, modes: Callable[[], Modes]) -> None:
        self._integrator, self._step, self._find = integrator, step, modes

    @property
    def integrator(self) -> str:
        """Name of the integrator whose resolution is judged."""
        return self._integrator

    @property
    def step(self) -> float:
        """Length of a step whose resolution is judged, s."""
        return self._step

    @property
    def limit(self) -> float:
        """Resolution limit: frequency above which an undamped vibration is off by a tenth, Hz; or infinite.

        Off is its amplitude at the end of the run, or its frequency.
        """
        return self._modes.limit

    @property
    def frequencies(self) -> Array:
        """Modes that are not resolved, shape (m,), Hz, slowest first; of a decay its rate over 2 pi."""
        return self._modes.frequencies

    @property
    def ratios(self) -> Array:
        """Own damping ratios of unresolved modes, shape (m,)."""
        return self._modes.ratios

    @property
    def times(self) -> Array:
        """Times over which each unresolved loss is counted, shape (m,), s: the run, or to 1/e."""
        return self._modes.times

    @property
    def left(self) -> Array:
        """Share of amplitude that is left of each unresolved mode, shape (m,), beside its own damping.

        Above 1 where the method lets a mode grow.
        """
        return self._modes.left

    @property
    def shifts(self) -> Array:
        """Share by which each unresolved mode becomes faster, shape (m,)."""
        return self._modes.shifts

    @property
    def sites(self) -> tuple[str, ...]:
        """Sites of dry friction that steps do not resolve, k places in words."""
        return self._modes.sites

    @property
    def turns(self) -> Array:
        """Slope of unresolved friction at rest times the step over the inertia, shape (k,).

        Of friction that bends before it slides, its stiffness times the square of the step over that inertia.
        """
        return self._modes.turns

    @property
    def is_complete(self) -> bool:
        """Whether the steps resolve all modes and all dry friction."""
        return not self.frequencies.size and not self.sites

    @cached_property
    def _modes(self) -> Modes:
        return self._find()

    def to_stored(self) -> Mapping[str, object]:
        """Resolution to store, computed."""
        return {"integrator": self.integrator, "step": self.step, **self._modes._asdict()}

    @classmethod
    def from_stored(cls, content: Mapping[str, Any]) -> Self:
        """Resolution as it was stored."""
        modes = Modes(**{name: content[name] for name in Modes._fields})
        return cls(content["integrator"], content["step"], lambda: modes)

    def __reduce__(self) -> tuple[object, ...]:
        return type(self).from_stored, (self.to_stored(),)

    def __str__(self) -> str:
        """Sentence on the resolution."""
        steps = f"{self.integrator}, {1e3 * self.step:.3g} ms"
        if self.is_complete:
            return steps
        faults = "; ".join(fault for fault in (self._vibrations(), self._friction()) if fault)
        return f"{steps}: {faults}; more substeps or adaptive resolve them"

    def _vibrations(self) -> str:
        count = self.frequencies.size
        if not count:
            return ""
        others = f", and {count - 1} more up to {self.frequencies[-1]:.3g} Hz" if count > 1 else ""
        return f"modes above {self.limit:.3g} Hz are not resolved ({self._fate()}{others})"

    def _fate(self) -> str:
        """What integration steps make of the slowest mode that they do not resolve, as a few words."""
        frequency, left, time = self.frequencies[0], self.left[0], self.times[0]
        if left > 1.0:
            return f"{frequency:.3g} Hz: grows"
        if abs(self.shifts[0]) > 1.0 - left:
            return f"{frequency:.3g} Hz: becomes {frequency * (1.0 + self.shifts[0]):.3g} Hz"
        return f"{frequency:.3g} Hz: to {left:.2g} in {time:.2g} s"

    def _friction(self) -> str:
        if not self.sites:
            return ""
        worst = float(np.max(self.turns))
        sites = " and ".join(self.sites)
        return f"dry friction of {sites} stops it in {1.0 / worst:.2g} steps, so that it creeps or chatters"

    def _headline(self) -> Mapping[str, object]:
        return {"steps": str(self)}


def outermost(places: Array) -> list[int]:
    """Rows of numbers, shape (N, n), in which one of them is farthest out, to judge the resolution there."""
    if not places.size:
        return []
    return sorted({*places.argmin(axis=0).tolist(), *places.argmax(axis=0).tolist()})


def resolution(model: Model, states: Array, commands: Array, dt: float, setup: Setup, duration: float) -> Resolution:
    """What steps do not resolve in a run of ``duration`` (s) that begins in the first of ``states``.

    - ``states``: shape (N, nx); those of the run
    - ``commands``: shape (N, nu); what is held from each of them on
    - ``dt``: time between samples, s
    """
    method, internal = setup.method(model), states[:, 2 * model.core.n_coordinates :]
    passed = states[[0, *outermost(states[:, : len(model.joints)])]]
    rows = [0, *outermost(np.hstack([internal, commands]))]
    loaded = list(zip(states[rows], commands[rows], strict=True))

    def modes() -> Modes:
        core, theta, steps = model.core, model.theta, (dt, setup.substeps, method)
        each = [core.resolution(theta, state, *steps, duration) for state in passed]
        limit, found = max(each, key=lambda one: float(np.max(one[1][:, 0], initial=0.0)))
        turns: dict[str, float] = {}
        for state, command in loaded:
            for site, turn in core.unstuck(theta, state, command, *steps):
                turns[site] = max(turn, turns.get(site, 0.0))
        frequencies, ratios, times, left, shifts = found.T.copy()
        friction = tuple(turns), np.array(list(turns.values()), dtype=np.float64)
        return Modes(float(limit), frequencies, ratios, times, left, shifts, *friction)

    return Resolution(method, dt / setup.substeps, modes)
