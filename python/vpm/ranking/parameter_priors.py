"""Priors of parameters before a ranking's fit: from the model file, or natural sizes of the records."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vpm.catalogue import EffectParameter
from vpm.catalogue.shared import SLOW
from vpm.discrepancy.screening.candidates import (
    Candidate,
    extent_of,
    joint_at,
    shares_at,
    slow_speeds,
    springs_shown,
    way_of_spring,
)
from vpm.discrepancy.settings import LEAST, REACH
from vpm.discrepancy.stuck_channels import is_moving
from vpm.identify import InverseDynamicsProblem
from vpm.identify.moments import beside_known, free_moments
from vpm.model import Model, Parameter
from vpm.numbers import Array
from vpm.ranking.settings import DELAY
from vpm.ranking.tracked_records import TrackedRecords
from vpm.weighing.priors import FACTOR, NATURAL, NEAR, SHARE, Prior, natural_sizes

#: What an effect may amount to, as a share of the size of its kind, where that is not `SHARE`: what is near a value by
#: nature, and what has a size that matters rather than one that records show.
SHARES = {"one": NEAR, "channel": NEAR, "time": 1.0, "resistance": 1.0, "leakage": 1.0}


class Sizes:
    """Natural sizes for priors by joint and transmission: effort, speed and way in the records."""

    def __init__(self, model: Model, data: InverseDynamicsProblem) -> None:
        self.model, self.records = model, data.experiments
        records = range(len(data.motions))
        efforts = np.concatenate([data.effort(model, model.theta, record)[1] for record in records])
        positions, velocities, accelerations = map(np.concatenate, zip(*map(data.state, records), strict=True))
        middle = dict(zip(data.joints, np.mean(positions, axis=0).tolist(), strict=True))
        masses = np.diag(model.mass_matrix([middle.get(name, 0.0) for name in model.coordinates]))
        inertias = masses[[model.coordinates.index(joint) for joint in data.joints]]
        self.joints: dict[str, tuple[float, float, float]] = {}
        self.ways: dict[str, tuple[float, float]] = {}
        moving = [any(is_moving(log, f"{joint}.position") for log in data.experiments) for joint in data.joints]
        self.moving: set[str] = set()
        for site in (*data.joints, *model.transmissions):
            shares = shares_at(model, site, data.joints)
            way = positions @ shares
            if np.any(shares[moving]):
                self.moving.add(site)
            self.ways[site] = float(way.min()), float(way.max())
            along = shares / max(float(shares @ shares), 1e-300)
            # Where no drive does anything, it is inertia that forces are as large as, in the middle of the way.
            inertia = float(inertias @ along**2)
            size = _strength(efforts @ along) or inertia * _strength(accelerations @ shares)
            self.joints[site] = size, _strength(velocities @ shares), 0.5 * float(np.ptp(way))
        springs = springs_shown(model, data)
        for joint in data.joints:
            behind = model.joint_behind(joint)
            if behind is not None and behind in springs:
                way, rate = way_of_spring(data, behind)
                self.ways[behind] = float(way.min()), float(way.max())
                # A spring passes on what its motor does.
                self.joints[behind] = self.joints[joint][0], _strength(rate), 0.5 * float(np.ptp(way))
        self.commands = {
            name: _strength(np.concatenate([motion.inputs[:, place] for motion in data.motions]))
            for place, name in enumerate(model.actuators)
        }
        self.readings: dict[str, float] = {}
        for channel in dict.fromkeys(channel for log in data.experiments for channel in log.channels):
            if sensor := model.sensor_of(channel):
                shown = [log[channel] for log in data.experiments if channel in log]
                self.readings[sensor] = 0.5 * float(np.ptp(np.concatenate(shown)))

    def moves(self, site: str) -> bool:
        """Whether a joint or a transmission moves in the records, so that its priors have a size."""
        return site in self.moving

    def prior(self, candidate: Candidate, parameter: EffectParameter, value: float) -> Prior:
        """Prior of an effect's parameter that starts at ``value``."""
        low, high = candidate.bounds.get(parameter.name, parameter.physical)
        size = self._size(candidate.site, parameter)
        neutral = np.nan if parameter.shape or parameter.neutral is None else parameter.neutral
        if neutral in NATURAL and (candidate.neutral or value == neutral):
            return Prior(neutral, SHARES.get(parameter.scale, SHARE) * size, low, high)
        if low < 0.0 or value <= 0.0:
            return Prior(value, SHARE * size, low, high)
        return Prior(value, FACTOR, max(low, 1e-12), high, logarithmic=True)

    def _size(self, site: str, parameter: EffectParameter) -> float:
        effort, speed, way = (max(number, LEAST) for number in self._shown(site))
        sizes = {
            **natural_sizes(effort, speed, way),
            "channel": max(self.readings.get(site, way), LEAST),
            "time": DELAY,
            "command": self.commands.get(site, 1.0),
        }
        if site in self.model.bodies:
            # A load is as heavy as what carries it, and about as far out.
            sizes["mass"] = max(sizes["mass"], self.model.parameters[f"{site}.mass"].value)
            sizes["coordinate"] = extent_of(self.model, site)[1] or sizes["coordinate"]
        return sizes.get(parameter.scale, parameter.typical)

    def _shown(self, site: str) -> tuple[float, float, float]:
        """Effort, speed and way at a site for its priors; the largest of all joints for other sites."""
        if (joint := joint_at(self.model, site) or site) in self.joints:
            return self.joints[joint]
        effort, speed, way = np.max(list(self.joints.values()), axis=0)
        return float(effort), float(speed), float(way)


def _strength(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def stated(model: Model) -> dict[str, Prior]:
    """Priors of a model's parameters as its file states them, and within what bodies can have."""
    found = {
        p.name: _stated(p)
        for p in model.parameters.values()
        if p.adjustable and p.uncertainty and np.isfinite(p.uncertainty)
    }
    for names in free_moments(model, found):
        if ends := beside_known(model, names):
            one = found[names[0]]
            found[names[0]] = replace(one, low=max(one.low, ends[0]), high=min(one.high, ends[1]))
    return found


def _stated(parameter: Parameter) -> Prior:
    """Prior of a parameter as its file states it; a positive one that no force is linear in is off by a factor.

    Of these nothing leads back from afar: oil as soft as air hides all that oil could show, and a tracker that draws
    pressures leaves no error then.
    """
    value, uncertainty, low, high = parameter.value, parameter.uncertainty, parameter.minimum, parameter.maximum
    if parameter.kind == "linear" or not 0.0 <= low < value:
        return Prior(value, uncertainty or np.inf, low, high)
    share = float(np.log1p((uncertainty or np.inf) / value))
    far = float(np.exp(REACH * share))
    return Prior(value, share, max(low, value / far), min(high, value * far), logarithmic=True)


def known(model: Model, data: InverseDynamicsProblem, tracked: TrackedRecords) -> dict[str, Prior]:
    """Priors of a model as its file states them, and of the transition velocities of its dry friction.

    Nobody knows these, and a wrong one leaves a gap at every reversal, where the finer effects live. Seals of a
    cylinder rub as joints do.
    """
    priors = stated(model)
    drives = {f"{drive}.friction.transition_velocity": model.rate_channel(drive) for drive in model.actuators}
    for effect in model.effects:
        name = effect.parameter_names.get("transition_velocity")
        if name is not None and name not in priors and effect.at in (*data.joints, *model.transmissions):
            priors[name] = _turning(*slow_speeds(data, shares_at(model, effect.at, data.joints)))
        elif name is not None and effect.at in model.actuators:
            drives[name] = model.rate_channel(effect.at)
    unknown = {name: rate for name, rate in drives.items() if name in model.parameters and name not in priors}
    rates = tracked.outputs(model, tuple(unknown.values()))
    fastest = (max(float(np.quantile(np.abs(speeds), 0.999)), LEAST) for speeds in rates)
    turning = (_turning(*(share * speed for share in SLOW)) for speed in fastest)
    return priors | dict(zip(unknown, turning, strict=False))


def _turning(low: float, high: float) -> Prior:
    """Prior of the speed at which dry friction turns round, between bounds."""
    return Prior(float(np.sqrt(low * high)), 0.25 * float(np.log(high / low)), low, high, logarithmic=True)
