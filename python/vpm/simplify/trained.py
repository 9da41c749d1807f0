"""Coefficients of a NARX element, trained on the motion of the machine that the element drives.

A one-step prediction along a given motion uses the measured state. In the machine the error of the element moves the
joints, and their motion is its input. So the least error of a prediction is not the least error of a simulation.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.identify import OutputErrorProblem
from vpm.model import Model
from vpm.simplify.replacement import Replacement, commanded
from vpm.simulate import Setup

Array = NDArray[np.float64]

#: Integrator of the simulations: the one that is stable whatever the element is like.
STABLE = "linearly_implicit"
#: Relative step of the differences, share of the sum of squares at which the search ends, and its most simulations.
DIFFERENCE, ENOUGH, EVALUATIONS = 1e-6, 1e-3, 100
#: Error where no machine is possible or its simulation fails, in parts of what is compared.
FAILED = 1e2


def trained(
    model: Model, element: Replacement, records: Sequence[Experiment], mode: str, channels: Sequence[str] | None
) -> Replacement:
    """The element with the coefficients with which the machine moves most like the full one.

    Parameters
    ----------
    model : Model
        The full one.
    element : Replacement
        A NARX model, where the search begins; it stays what it is where the machine cannot be simulated with it.
    records : sequence of Experiment
        To learn from.
    mode : {"free_run", "closed_loop"}
    channels : sequence of str, optional
        What is compared; by default all that the records hold.
    """
    entry: dict[str, Any] = json.loads(element.entry)
    names, start = list(entry["terms"]), np.array(list(entry["terms"].values()))
    sizes = np.abs(start)

    def with_shares(shares: Array) -> Replacement:
        terms = dict(zip(names, (float(value) for value in shares * sizes), strict=True))
        return replace(element, entry=json.dumps({**entry, "terms": terms}))

    try:
        first = element.applied(model)
        driven = [commanded(first, model, record) for record in records]
        own_mode = mode if first.controlled_actuators else "free_run"
        problem = OutputErrorProblem(first, driven, own_mode, channels=channels, setup=Setup(STABLE))
        least, _ = problem.evaluate(first, first.theta)
    except VpmError:
        return element

    def residual(shares: Array) -> Array:
        try:
            machine = with_shares(shares).applied(model)
            return problem.evaluate(machine, machine.theta)[0]
        except VpmError:
            return np.full_like(least, FAILED)

    # The lags of one signal are nearly alike: damped steps, scaled by the columns, go along what tells them apart.
    found = least_squares(
        residual,
        np.sign(start),
        method="lm",
        x_scale="jac",
        diff_step=np.array(DIFFERENCE),
        ftol=ENOUGH,
        max_nfev=EVALUATIONS,
    )
    return with_shares(found.x) if 2.0 * found.cost < float(least @ least) else element
