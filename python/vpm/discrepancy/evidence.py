"""Evidence of an accepted effect: the validation residual over the state it depends on, without it and with it.

The residual "without" is that of the model with everything but the effect, all other parameters as they were fitted
with it. So it is the residual of the repaired model plus what the effect contributes: a partial residual (W. A. Larsen
and S. J. McCleary, "The use of partial residual plots in regression analysis", Technometrics 14, 1972), over which the
fitted law can be drawn whatever else was found.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue import EFFECTS, signature_of
from vpm.discrepancy.settings import CLEARLY, LAW_SAMPLES, PICTURE_BINS
from vpm.errors import VpmError
from vpm.identify import InverseDynamicsProblem
from vpm.identify.response_along_motion import Response, respond
from vpm.model import Model
from vpm.numbers import Array
from vpm.results import Storable

#: Axis, words, unit and values at each sample.
ExcitationRange = tuple[str, str, str, Array]


_STATE = {"position": (0, ""), "velocity": (1, "/s"), "acceleration": (2, "/s²")}


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

    - ``model``: the repaired model
    - ``effects``: name and site of those that were accepted
    - ``floor``: noise floor by channel, in its unit
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


@dataclass(frozen=True)
class View:
    """View of one record from the site of an effect: states there, and the residual."""

    model: Model  #: The repaired model.
    key: tuple[str, str]  #: Effect and site.
    problem: InverseDynamicsProblem
    record: int
    channel_name: str  #: Channel in which the effect shows.
    #: Samples as logged, between the two ends; else the retained ones, filtered as in the residual.
    fine: bool = False

    def at_full_rate(self) -> View:
        """View of the site's states at all samples, without the filter of the residual."""
        return replace(self, fine=True)

    def best(self, part: Array, counts: NDArray[np.bool_]) -> ExcitationRange:
        """State at the site, of the effect's signature, that explains most of ``part``; the earlier one if close."""
        best: ExcitationRange | None = None
        most = 0.0
        entry = EFFECTS.get(self.key[0])
        for axis in (entry.signature if entry is not None else signature_of(self.key[0])).lives_in:
            found = self.along(axis)
            if found is None:
                continue
            share = explained(found[2][counts], part[counts])
            if best is None or share > most + CLEARLY:
                best, most = (axis, *found), share
        return best if best is not None else ("time", *self._time())

    def values(self, axis: str) -> Array:
        """Values of a state at the site."""
        found = self.along(axis)
        return found[2] if found is not None else self._time()[2]

    def channel(self, model: Model) -> Array:
        """Residual of the site's channel under a model: applied - required effort, or the negative output."""
        owner, _, quantity = self.channel_name.rpartition(".")
        shown = () if quantity == "effort" else (self.channel_name,)
        m = self.problem.motions[self.record]
        answer = respond(model, model.theta, m, self.problem.experiments[self.record], (), shown)
        if shown:
            return -answer.seen[:, 0]
        column = m.joints.index(owner)
        return np.asarray(answer.applied[:, column] - answer.required[:, column])

    def along(self, axis: str) -> tuple[str, str, Array] | None:
        """Label, unit and values of one state at the site; None if machine or record has no such state."""
        if axis in {"time", "frequency"}:
            return self._time()
        if axis in _STATE:
            return self._state(axis)
        if axis == "effort":
            joint, m = self._joint(), self.problem.motions[self.record]
            answer = self._response(())
            values = self._kept(answer.required[:, m.joints.index(joint)])
            return f"effort that {joint} needs", self.model.channel_unit(f"{joint}.effort"), values
        actuator = self._actuator()
        return self._driven(axis, actuator) if actuator is not None else None

    def _time(self) -> tuple[str, str, Array]:
        m = self.problem.motions[self.record]
        return "time", "s", m.time[m.kept if self.fine else m.retained]

    def _state(self, axis: str) -> tuple[str, str, Array]:
        m, joint = self.problem.motions[self.record], self._joint()
        place, per = _STATE[axis]
        rows = m.kept if self.fine else m.retained
        values = (m.position, m.velocity, m.acceleration)[place][rows, m.joints.index(joint)]
        unit = self.model.channel_unit(f"{joint}.position") + per
        return f"{axis} of {joint}", unit, values

    def _driven(self, axis: str, actuator: str) -> tuple[str, str, Array] | None:
        m = self.problem.motions[self.record]
        channel = f"{actuator}.command"
        if axis in {"command", "command_rate"} and channel in m.drivers:
            unit = self.model.channel_unit(channel)
            values = self._kept(m.inputs[:, m.drivers.index(channel)])
            if axis == "command":
                return f"command of {actuator}", unit, values
            return f"rate of the command of {actuator}", f"{unit}/s", np.gradient(values, self._time()[2])
        if axis == "pressure_difference":
            pair = [self._shown(f"{actuator}.pressure_{chamber}") for chamber in "ab"]
            if pair[0] is not None and pair[1] is not None:
                return f"pressure difference of {actuator}", "Pa", pair[0] - pair[1]
        if axis == "flow":
            supply = self.model.supply_of_actuator(actuator)
            flow = self._shown(f"{supply}.flow") if supply is not None else None
            if flow is not None:
                return f"flow drawn from {supply}", "m³/s", flow
        return None

    def _shown(self, channel: str) -> Array | None:
        """Channel at the site as logged, else as the repaired model computes it; None if it cannot."""
        experiment = self.problem.experiments[self.record]
        if channel in experiment:
            return self._kept(experiment[channel])
        if channel not in self.model.output_channels:
            return None
        return self._kept(self._response((channel,)).seen[:, 0])

    def _response(self, shown: tuple[str, ...]) -> Response:
        """Response of the repaired model at every sample of the record, for states at the site."""
        whole = replace(self.problem.motions[self.record], edge=0)
        return respond(self.model, self.model.theta, whole, self.problem.experiments[self.record], (), shown)

    def _kept(self, values: Array) -> Array:
        """Values of the site's states at the samples of this view."""
        m = self.problem.motions[self.record]
        return values[m.kept] if self.fine else m.parallel(values)

    def _joint(self) -> str:
        actuator = self._actuator()
        moved = self.model.joints_of_actuator(actuator) if actuator is not None else ()
        own = (self.key[1], self.channel_name.rpartition(".")[0], *moved)
        return next((name for name in own if name in self.problem.joints), self.problem.joints[0])

    def _actuator(self) -> str | None:
        """Actuator at the site, or of the channel, or the first one of the supply or joint."""
        model, site, owner = self.model, self.key[1], self.channel_name.rpartition(".")[0]
        for name in (site, owner):
            if name in model.actuators:
                return name
        fed = [name for name in model.actuators if model.supply_of_actuator(name) == site]
        on_joint = [name for name in model.actuators if owner in model.joints_of_actuator(name)]
        return next(iter((*fed, *on_joint, *model.actuators)), None)


def explained(values: Array, part: Array) -> float:
    """Share of the variance of ``part`` that bins of a state's ``values`` explain (correlation ratio).

    0 for a part that hardly varies: nothing has to explain a constant.
    """
    total = float(np.var(part))
    if total <= 1e-3 * float(np.mean(part)) ** 2 or float(np.ptp(values)) <= 0.0:
        return 0.0
    place = np.digitize(values, np.linspace(values.min(), values.max(), PICTURE_BINS + 1)[1:-1])
    count = np.bincount(place, minlength=PICTURE_BINS)
    means = np.bincount(place, part, PICTURE_BINS) / np.maximum(count, 1)
    return float(np.average((means - part.mean()) ** 2, weights=count) / total)
