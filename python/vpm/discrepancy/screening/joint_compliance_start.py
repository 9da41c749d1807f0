"""Start value of a joint compliance: a search over stiffness, along the measured motion.

The residual depends on the stiffness only within a few per cent of the true value, where the resonance is. A softer
spring responds to other frequencies of the measured motion, and a stiffer one does nothing. A linearised step from
elsewhere predicts a gain that is not there, and a refit from it ends at a rigid spring. So stiffnesses a fifth apart
are tried, and the refit begins at the one with the least residual.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from vpm.discrepancy.screening.candidates import Candidate
from vpm.discrepancy.screening.compliance_and_stop_start import moved
from vpm.errors import DivergedError
from vpm.identify import InverseDynamicsProblem
from vpm.identify.response_along_motion import answers_at_once
from vpm.model import Model
from vpm.numbers import Array

#: Frequencies at which what a joint moves swings on the spring while the motor stands, Hz, and damping ratios.
FREQUENCIES = np.geomspace(4.0, 64.0, 16)
DAMPINGS = (0.1, 0.3)


def is_searched(model: Model, data: InverseDynamicsProblem, candidate: Candidate) -> bool:
    """Whether the stiffness of a joint compliance is searched: between an ideal drive and rigid links."""
    measured = candidate.site in data.motions[0].joints
    return candidate.effect.winds_up and measured and answers_at_once(model)


def best_start(
    model: Model, left_of: Callable[[Array], Array], data: InverseDynamicsProblem, candidate: Candidate
) -> Mapping[str, float] | None:
    """Start stiffness of a joint compliance with the least residual, or None if none improves it.

    - ``model``: without the spring
    - ``left_of``: part (n,) that its free parameters leave of a residual (n,)
    - ``candidate``: a spring in series
    """

    def left(one: Model) -> float:
        try:
            residual, _ = data.evaluate(one, one.theta)
        except DivergedError:
            return math.inf
        rest = left_of(residual)
        power = float(rest @ rest)
        return power if math.isfinite(power) else math.inf

    inertia, least, best = moved(model, candidate.site), left(model), None
    for frequency in FREQUENCIES:
        stiffness = inertia * (2.0 * math.pi * float(frequency)) ** 2
        for ratio in DAMPINGS:
            values = {"stiffness": stiffness, "damping": 2.0 * ratio * math.sqrt(stiffness * inertia)}
            power = left(model.with_effect(candidate.effect.name, at=candidate.site, **values))
            if power < least:
                least, best = power, values
    return best
