"""Nested model: a rival law that contains an accepted one is judged beside the other accepted effects.

A spring is a constant force that changes with position. On a joint in gravity, a shifted centre of mass does nearly the
same. While the constant force is missing, its residual hides the small difference, so the spring looks identical to the
centre of mass. Beside the force the residual shows whether the spring is needed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Judged
from vpm.discrepancy.screening.linear_step import linear_step
from vpm.discrepancy.screening.probe import Probe
from vpm.discrepancy.search.candidate_choice import Accepted, alike
from vpm.errors import DivergedError
from vpm.identify import InverseDynamicsProblem
from vpm.identify.identifiability import COPY_SHARE, Span
from vpm.numbers import NORMAL_95


def probe_beside(final: Judged, without: Judged, data: InverseDynamicsProblem, entry: Accepted, probe: Probe) -> Probe:
    """Probe of a nested rival beside the accepted effect whose law it contains.

    Parameters
    ----------
    final, without : Judged
        The model with all accepted effects, and without this one.
    data : InverseDynamicsProblem
        Training records.
    entry : Accepted
    probe : Probe
        Of the rival, on the model without the effect.

    Returns
    -------
    Probe
        To be refitted from the size that one step beside the effect says; ``probe`` itself if it was not held, is not
        confused with the effect at its site, cannot be computed beside it, or has no clear size there (95 %).
    """
    candidate = probe.candidate
    if probe.free or not probe.held or not candidate.neutral or not alike(candidate, entry.trial.probe.candidate):
        return probe
    names = tuple(alias.parameter for alias in probe.held)
    model = final.model.with_effect(candidate.effect.name, at=candidate.site, **candidate.starts[0])
    try:
        residual, fresh = data.evaluate(model, model.theta, [model.index(name) for name in names])
    except DivergedError:
        return probe  # beside the effect it cannot be balanced, as a rotor's inertia behind a joint with a memory
    values, std, left = linear_step(data, np.column_stack([final.fit.jacobian, fresh]), residual)
    count = len(names)
    sizes, spread = values[-count:], std[-count:]
    if not np.all(np.isfinite(spread)) or not np.all(np.abs(sizes) > NORMAL_95 * spread):
        return probe
    start, fixed = probe.model.parameters, set(_held_at_start(probe))
    shapes = tuple(name for name in probe.invisible if name not in fixed)
    power = float(without.fit.residual @ without.fit.residual)
    return replace(
        probe,
        free=(*names, *shapes),
        held=(),
        invisible=(),
        values={
            **{name: start[name].value for name in shapes},
            **{name: start[name].value + float(size) for name, size in zip(names, sizes, strict=True)},
        },
        std={**dict.fromkeys(shapes, np.inf), **dict(zip(names, map(float, spread), strict=True))},
        drop=1.0 - left / power if power > 0.0 else 0.0,
    )


def contains(rival: Judged, parameters: tuple[str, ...], final: Judged, own: tuple[str, ...]) -> bool:
    """Whether a rival is a richer law in which the accepted effect is nested.

    Then the effect is the rival with one number at zero. The distance of that number from zero on the training records
    counts as evidence, so validation records, which are fewer, only have to improve. Of laws that are different, and of
    friction whose fit makes up for reversals that filters smooth, neither holds.

    Parameters
    ----------
    rival : Judged
        The model with the rival in the place of the effect.
    parameters : tuple of str
        The rival's own.
    final : Judged
        The model with the effect.
    own : tuple of str
        The effect's own parameters.
    """
    if len(parameters) <= len(own):
        return False
    columns = rival.fit.jacobian[:, [rival.fit.names.index(name) for name in parameters]]
    plain = (final.fit.jacobian[:, final.fit.names.index(name)] for name in own)
    within = Span.of(columns)
    return all(within.share(column) > COPY_SHARE for column in plain)


def _held_at_start(probe: Probe) -> list[str]:
    candidate = probe.candidate
    effect = probe.model.effect(*candidate.key)
    return [effect.parameter_names[short] for short in candidate.fixed]
