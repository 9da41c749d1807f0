"""Regression of masses and friction on the inverse-dynamics residual, where a fit of what a tracker leaves begins."""

from __future__ import annotations

import numpy as np

from vpm.identify import InverseDynamicsProblem
from vpm.ranking.fit import bounded_step
from vpm.ranking.model_structure import Structure
from vpm.ranking.settings import QUIET, REGRESSIONS


def regressed(structure: Structure, data: InverseDynamicsProblem) -> Structure:
    """Structure by regression at the values that leave least of the inverse-dynamics residual.

    That is linear in masses and friction, however far away they are; what a slow tracker leaves is not. The first step
    takes nearly all of the error for an error of the parameters, and each one after it what the one before has left
    for noise.

    Raises
    ------
    VpmError
        Efforts cannot be balanced in this model.
    """
    own = [name for name in structure.priors if name in structure.model.parameters]
    theta = structure.theta[: len(structure.model.theta)]
    residual, jacobian = data.evaluate(structure.model, theta, [structure.place(name) for name in own])
    whole = np.zeros((len(residual), len(structure.priors)))
    whole[:, [list(structure.priors).index(name) for name in own]] = jacobian
    variance = QUIET**2 * float(np.mean(residual**2))
    for _ in range(REGRESSIONS):
        slopes = whole * structure.slopes
        move = bounded_step(structure, residual, slopes, np.inf, variance)
        structure, residual = structure.moved(move), residual + slopes @ move
        variance = float(np.mean(residual**2))
    return structure
