"""Evidence of an accepted effect: the validation residual over the state it depends on, without it and with it.

The residual "without" is that of the model with everything but the effect, all other parameters as they were fitted
with it. So it is the residual of the repaired model plus what the effect contributes: a partial residual (W. A. Larsen
and S. J. McCleary, "The use of partial residual plots in regression analysis", Technometrics 14, 1972), over which the
fitted law can be drawn whatever else was found.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vpm.discrepancy.site_states import View
from vpm.errors import VpmError
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.numbers import Array
from vpm.results import Storable

#: Samples that the curve of a law keeps.
LAW_SAMPLES = 3000


@dataclass(frozen=True, repr=False, eq=False)
class Evidence(Storable):
    """Evidence for the picture of one accepted effect, from the validation record in which it does most.

    Attributes
    ----------
    effect, site : str
    record, channel, unit : str
        Where the residual is taken, the channel that the effect changes most, and its unit.
    axis : str
        What the residual is drawn over, see `vpm.catalogue.signature.Axis`.
    name, axis_unit : str
        The same in words, and its unit.
    time, values : ndarray, shape (n,)
        s, and the state in ``axis_unit``.
    without, repaired : ndarray, shape (n,)
        Residual of the model without the effect and with it, in ``unit``.
    law_values, law : ndarray, shape (k,)
        What the effect contributes to the residual, in ``unit``, over the state, before the filter of the residual.
    noise_floor : float
        Root mean square that noise alone leaves; NaN where it is not known.
    """

    effect: str
    site: str
    record: str
    channel: str
    unit: str
    axis: str
    name: str
    axis_unit: str
    time: Array
    values: Array
    without: Array
    repaired: Array
    law_values: Array
    law: Array
    noise_floor: float


def gather(
    model: Model, effects: Sequence[tuple[str, str]], validation: InverseDynamicsProblem, floor: Mapping[str, float]
) -> tuple[Evidence, ...]:
    """Gather the evidence of each accepted effect; none where the model without it cannot be computed.

    Parameters
    ----------
    model : Model
        The repaired model.
    effects : sequence of (str, str)
        Name and site of those that were accepted.
    validation : InverseDynamicsProblem
    floor : mapping of str to float
        Noise floor by channel, in its unit.
    """
    found = []
    for key in effects:
        try:
            found.append(_evidence(model, model.without_effect(*key), key, validation, floor))
        except VpmError:  # another effect needs it, or the machine cannot be computed without it
            continue
    return tuple(found)


def _evidence(
    model: Model,
    reduced: Model,
    key: tuple[str, str],
    validation: InverseDynamicsProblem,
    floor: Mapping[str, float],
) -> Evidence:
    repaired, _ = validation.evaluate(model, model.theta)
    without, _ = validation.evaluate(reduced, reduced.theta)
    change = without - repaired
    block = max(validation.blocks, key=lambda b: float(np.sum(change[b.samples] ** 2)))
    record = validation.blocks.index(block) // (len(validation.blocks) // len(validation.experiments))
    counts = block.moving > 0.0
    view = View(model, key, validation, record, block.channel)
    seen = view.best(change[block.samples], counts)
    if seen[0] == "command_rate":  # the rate of held samples is all steps: only the filtered one says something
        values, law = seen[3], change[block.samples] / block.weight
    else:
        fine = view.at_full_rate()
        values, law = fine.values(seen[0]), fine.channel(reduced) - fine.channel(model)
    thin = slice(None, None, -(-law.size // LAW_SAMPLES))
    return Evidence(
        *key,
        block.experiment,
        block.channel,
        block.unit,
        *seen[:3],
        block.time[counts],
        seen[3][counts],
        without[block.samples][counts] / block.weight,
        repaired[block.samples][counts] / block.weight,
        values[thin],
        law[thin],
        floor.get(block.channel, float("nan")),
    )
