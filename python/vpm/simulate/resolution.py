"""What steps damp because they do not resolve it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.model import Model
from vpm.results import Storable
from vpm.simulate.setup import Setup

Array = NDArray[np.float64]


@dataclass(frozen=True, repr=False, eq=False)
class Resolution(Storable):
    """What the steps of a run damp because they do not resolve it; as a text one sentence.

    Modes are those of the linear machine about the first state, without dry friction. One is listed if its own damping
    ratio is below 0.1 and the method takes more than a tenth of its amplitude.

    Attributes
    ----------
    integrator : str
    step : float
        s.
    limit : float
        Frequency above which an undamped vibration loses more than a tenth of its amplitude over the run, Hz;
        infinite if there is none.
    frequencies : ndarray, shape (m,)
        Modes that are damped, Hz, slowest first.
    ratios : ndarray, shape (m,)
        Their own damping ratios.
    times : ndarray, shape (m,)
        Over which each loss is counted, s: the run, or the time in which the mode falls to 1/e by itself.
    left : ndarray, shape (m,)
        Share of its amplitude that the method leaves of each over that time, beside its own damping.
    """

    integrator: str
    step: float
    limit: float
    frequencies: Array
    ratios: Array
    times: Array
    left: Array

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
    limit, damped = model.core.resolution(model.theta, state, dt, setup.substeps, method, duration)
    frequencies, ratios, times, left = damped.T.copy()
    return Resolution(method, dt / setup.substeps, float(limit), frequencies, ratios, times, left)
