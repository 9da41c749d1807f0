"""What steps damp because they do not resolve it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from vpm.model import Model
from vpm.results import Storable
from vpm.simulate.setup import Setup

Array = NDArray[np.float64]


class Modes(NamedTuple):
    """What a linear machine's vibrations lose to steps; see `Resolution`."""

    limit: float
    frequencies: Array
    ratios: Array
    times: Array
    left: Array


class Resolution(Storable):
    """What the steps of a run damp because they do not resolve it; as a text one sentence.

    Modes are those of the linear machine about the first state, without dry friction. One is listed if its own damping
    ratio is below 0.1 and the method takes more than a tenth of its amplitude. They are worked out when somebody looks:
    a batch pays for no run that nobody asks.

    Parameters
    ----------
    integrator : str
    step : float
        s.
    modes : callable
        Gives the modes; called once, or never.
    """

    def __init__(self, integrator: str, step: float, modes: Callable[[], Modes]) -> None:
        self._integrator, self._step, self._find = integrator, step, modes

    @property
    def integrator(self) -> str:
        """Name of the method."""
        return self._integrator

    @property
    def step(self) -> float:
        """Length of a step, s."""
        return self._step

    @property
    def limit(self) -> float:
        """Frequency above which an undamped vibration loses more than a tenth of its amplitude over the run, Hz.

        Infinite if there is none.
        """
        return self._modes.limit

    @property
    def frequencies(self) -> Array:
        """Modes that are damped, shape (m,), Hz, slowest first."""
        return self._modes.frequencies

    @property
    def ratios(self) -> Array:
        """Their own damping ratios, shape (m,)."""
        return self._modes.ratios

    @property
    def times(self) -> Array:
        """Over which each loss is counted, shape (m,), s: the run, or the time to 1/e by itself if that is shorter."""
        return self._modes.times

    @property
    def left(self) -> Array:
        """Share of its amplitude that the method leaves of each over that time, shape (m,), beside its own damping."""
        return self._modes.left

    @cached_property
    def _modes(self) -> Modes:
        return self._find()

    def to_stored(self) -> Mapping[str, object]:
        """All of it, worked out."""
        return {"integrator": self.integrator, "step": self.step, **self._modes._asdict()}

    @classmethod
    def from_stored(cls, content: Mapping[str, Any]) -> Self:
        """As it was stored."""
        modes = Modes(**{name: content[name] for name in Modes._fields})
        return cls(content["integrator"], content["step"], lambda: modes)

    def __reduce__(self) -> tuple[object, ...]:
        return type(self).from_stored, (self.to_stored(),)

    def __str__(self) -> str:
        """One sentence."""
        steps = f"{self.integrator}, {1e3 * self.step:.3g} ms"
        if not self.frequencies.size:
            return steps
        told = f"{self.frequencies[0]:.3g} Hz: to {self.left[0]:.2g} in {self.times[0]:.2g} s"
        others = f", and {self.frequencies.size - 1} more up to {self.frequencies[-1]:.3g} Hz"
        told += others if self.frequencies.size > 1 else ""
        return f"{steps}: modes above {self.limit:.3g} Hz are damped ({told}); more substeps or adaptive resolve them"

    def _headline(self) -> Mapping[str, object]:
        return {"steps": str(self)}


def resolution(model: Model, state: Array, dt: float, setup: Setup, duration: float) -> Resolution:
    """What steps damp in a run of ``duration`` (s) that begins in ``state``.

    Parameters
    ----------
    model : Model
    state : ndarray, shape (nx,)
    dt : float
        Time between samples, s.
    setup : Setup
    duration : float
    """
    method = setup.method(model)

    def modes() -> Modes:
        limit, damped = model.core.resolution(model.theta, state, dt, setup.substeps, method, duration)
        return Modes(float(limit), *damped.T.copy())

    return Resolution(method, dt / setup.substeps, modes)
