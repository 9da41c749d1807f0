"""Strain gauges that hold the links of a model to what was measured, while it follows a measured motion.

A link that hardly loses energy rings for as long as the record with every error of the motion that drives it: noise of
encoders twice differentiated, a first state that nobody knows, a stiffness that is a little wrong. A gauge shows what
the link did instead. A damper between the worked out and the measured rate of strain takes the energy out of their
difference and leaves alone what they agree in (a natural observer: M. Demetriou, *Systems & Control Letters* 51, 2004),
and below the frequency of the ringing it changes nothing: strains and efforts follow from the motion as before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Experiment, Motion
from vpm.experiment.signal import differentiate, lowpass
from vpm.model import Model

Array = NDArray[np.float64]

#: Damping ratio of the difference between a link and its gauge, in the mode that the gauge shows best.
DAMPING_RATIO = 0.3


@dataclass(frozen=True)
class Hold:
    """What holds links along one record.

    Attributes
    ----------
    gauges : tuple of str
        Those that hold.
    rate : ndarray, shape (N, gauges)
        Measured rates of strain, 1/s, through the filter of the motion.
    gain : ndarray, shape (gauges,)
        How firmly, J s: force on the coordinates of the link per missing rate of strain and strain per coordinate.
    """

    gauges: tuple[str, ...]
    rate: Array
    gain: Array

    def arguments(self, model: Model) -> tuple[Array, Array]:
        """Rates (N, all gauges) and gains (all gauges) in the order of a model's gauges, zero for the others."""
        rate, gain = np.zeros((len(self.rate), len(model.gauges))), np.zeros(len(model.gauges))
        for column, name in enumerate(self.gauges):
            if name in model.gauges:
                place = model.gauges.index(name)
                rate[:, place], gain[place] = self.rate[:, column], self.gain[column]
        return rate, gain


def gauge_gains(model: Model, experiments: Sequence[Experiment], position: Array) -> dict[str, float]:
    """How firmly each gauge of a link that bends may hold it, for those that all logs hold.

    With the joints held, a gauge sees the modes by their shares of its compliance, ``(C phi)^2 / omega^2`` at shapes of
    modal mass one. Alone it gives the one with the largest share the damping ratio `DAMPING_RATIO`.

    Parameters
    ----------
    model : Model
    experiments : sequence of Experiment
    position : ndarray, shape (joints,)
        Of all joints, m or rad.

    Returns
    -------
    dict
        Gains in J s by gauge.
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
    """What holds links along one record; None where no gauge does."""
    if not gains:
        return None
    strains = np.column_stack([experiment[f"{name}.strain"] for name in gains])
    rate = differentiate(lowpass(strains, 1.0 / m.dt, m.cutoff), m.dt)
    return Hold(tuple(gains), rate, np.array(list(gains.values())))
