"""Candidates: every effect of the catalogue at every possible site, with start values from the data."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from itertools import compress, product

import numpy as np

from vpm.catalogue import EFFECTS, EffectType
from vpm.catalogue.shared import SLOW
from vpm.catalogue.traits import Seen
from vpm.discrepancy.screening.compliance_and_stop_start import (
    beyond,
    logged_swing,
    sites_worth_trying,
    softest,
    starts_in_series,
    stop_starts,
    strongest,
    structural_starts,
    thresholds,
)
from vpm.discrepancy.screening.ripple_periods import ripple_periods
from vpm.discrepancy.settings import LEAST, LIMITED_MOST, WITHIN_NOISE
from vpm.errors import DiagnosisError, near_match
from vpm.experiment import instrument_noise
from vpm.experiment.signal import differentiate
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.model.effect_start import kind_at
from vpm.model.splitting import spring_in_series
from vpm.numbers import Array

#: Name of an effect and where it sits.
Key = tuple[str, str]

#: Short name of the speed at which a friction law bends; where it is fixed, it is that of the dry friction beside.
TRANSITION = "transition_velocity"


@dataclass(frozen=True)
class Candidate:
    """Candidate of the screening: one effect at one site, with its start values and bounds."""

    effect: EffectType
    site: str
    #: Start values by short parameter name; several where the effect has a shape to be searched.
    starts: tuple[Mapping[str, float], ...]
    #: Data-driven bounds of shape parameters by short name, within the physical range.
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    fixed: tuple[str, ...] = ()  #: Short names of shape parameters that stay at their start.
    #: Whether the effect does nothing at its start values, so that the current residual still holds.
    neutral: bool = True

    @property
    def key(self) -> Key:
        """Effect and site of a candidate."""
        return self.effect.name, self.site

    @property
    def label(self) -> str:
        """Label of a candidate: ``effect at site``."""
        return f"{self.effect.name} at {self.site}"


@dataclass(frozen=True)
class Excitation:
    """Excitation of one joint or actuator by the records, from which candidates take their start values."""

    speed: float
    slow: tuple[float, float]  #: See `slow_speeds`.
    middle: float
    travel: float
    interval: float
    command: float
    input: int
    record: float

    def multiple(self, of: Seen, share: float) -> float:
        """Start value of a candidate as a multiple of the excitation's speed, way or time."""
        if of == "way":
            return self.middle + share * self.travel
        scales: dict[Seen, float] = {
            "speed": self.speed,
            "travel": self.travel,
            "interval": self.interval,
            "command": self.command,
            "record": self.record,
            "one": 1.0,
        }
        return share * scales[of]


def asked_for(effects: Sequence[str] | None) -> tuple[str, ...]:
    """Names of effects that may become candidates: the given ones, or all with a law.

    Raises DiagnosisError: the catalogue has no such effect, or it has no law.
    """
    laws = tuple(name for name, effect in EFFECTS.items() if effect.has_law)
    for name in effects or ():
        if name not in EFFECTS:
            raise DiagnosisError(f'the catalogue has no effect "{name}"; {near_match(name, EFFECTS)}')
        if name not in laws:
            raise DiagnosisError(
                f'"{name}" is not among the effects that are tried, for it has no law of its own: it describes what no '
                "effect explains; leave it out of effects="
            )
    return laws if effects is None else tuple(effects)


def candidates(
    model: Model,
    data: InverseDynamicsProblem,
    residual: Array,
    effects: Sequence[str] | None = None,
) -> tuple[Candidate, ...]:
    """List the candidates: all effects that could be missing from ``model``, at each site.

    - ``model``: effects that it already has are left out
    - ``data``: gives speeds, travel and commands for the start values
    - ``residual``: residual of ``model`` on ``data``; periods of a ripple are read from it
    - ``effects``: only these; all that have a law if not given
    """
    hidden, excitation = set(model.added_joints) - springs_shown(model, data), cache(partial(_excitation, data, model))
    return tuple(
        _candidate(effect, site, model, data, residual, excitation)
        for effect, site in _absent(model, effects)
        if site not in hidden and not beyond(effect, site, model)
    )


def _absent(model: Model, effects: Sequence[str] | None) -> list[tuple[EffectType, str]]:
    """Effects of the catalogue that ``model`` does not have, with each possible site, before they become candidates.

    Both sides of a joint that is split may have the same effect, each its own.
    """
    present, by_key = Counter((effect.name, effect.at) for effect in model.effects), {e.key for e in model.effects}
    tried = asked_for(None) if effects is None else effects
    found = []
    for effect in EFFECTS.values():
        if effect.name not in tried:
            continue
        for site in sites_worth_trying(effect, model):
            needed = effect.requires is None or (effect.requires, site) in by_key
            sides = 2 if effect.has_sides and model.joint_behind(site) else 1
            if present[effect.name, site] < sides and needed:
                found.append((effect, site))
    return found


def _candidate(
    effect: EffectType,
    site: str,
    model: Model,
    data: InverseDynamicsProblem,
    residual: Array,
    excitation: Callable[[str, str | None], Excitation],
) -> Candidate:
    seen = excitation(site, site if effect.site in {"actuator", "cylinder"} else None)
    if spring_in_series(effect, site, model.effects) is not None:
        found = starts_in_series(seen.travel, way_of_deflection(data, model, site))
        return Candidate(effect, site, *found, effect.fixed, neutral=False)
    if effect.motion:
        found = structural_starts(effect, site, model, seen.travel, logged_swing(data, model, site))
        return Candidate(effect, site, *found, effect.fixed, neutral=False)
    if effect.stops:
        where, _, values = _over_way(data, model, site, residual)
        return Candidate(effect, site, *stop_starts(where, values, seen.middle, seen.travel, softest(model, site)))
    if any(parameter.name == "period" and not parameter.optional for parameter in effect.parameters):
        return _periodic(effect, site, data, model, residual)
    if effect.site == "body":
        return Candidate(effect, site, _payload_places(model, site))
    return _tried(effect, site, model, seen, partial(limit_start, data, residual=residual))


def _tried(
    effect: EffectType, site: str, model: Model, seen: Excitation, limit: Callable[[str, int], float | None]
) -> Candidate:
    """Candidate with start values and bounds of the catalogue; a ``limit`` of commands starts from data."""
    # A way that is passed between two samples is like dry friction.
    least = min(seen.speed * seen.interval, 0.5 * seen.travel)
    grids, bounds = list[list[tuple[str, float]]](), dict[str, tuple[float, float]]()
    for tried in effect.tried:
        values = [seen.multiple(tried.of, share) for share in tried.shares]
        low, high = (seen.multiple(tried.of, share) for share in tried.within)
        if tried.sampled:
            low, values = max(low, least), [max(value, least) for value in values]
        if tried.of == "command":
            guessed = limit(joint_at(model, site) or model.joints[0], seen.input)
            values += [] if guessed is None else [guessed]
        bounds[tried.parameter] = low, high
        if values:
            grids.append([(tried.parameter, value) for value in values])
    starts = tuple(dict(start) for start in product(*grids))
    if TRANSITION in effect.fixed:
        # What was fitted of the dry friction without it may be far too wide: it makes up for what is missing.
        dry = model.parameters.get(f"{site}.friction.{TRANSITION}")
        velocities = {0.01 * seen.speed if dry is None else dry.value}
        velocities |= set() if effect.tried else {seen.slow[0]}
        bends = sorted(velocities, reverse=True)
        starts = tuple({**start, TRANSITION: velocity} for start in starts for velocity in bends)
        bounds[TRANSITION] = seen.slow
    elif _bends_unseen(effect, site, model, seen):
        starts = tuple({**start, TRANSITION: 0.01 * seen.speed} for start in starts)
        bounds[TRANSITION] = seen.slow
    neutral = all(effect.parameter(name).shape for start in starts for name in start)
    return Candidate(effect, site, starts, bounds, effect.fixed, neutral)


def _bends_unseen(effect: EffectType, site: str, model: Model, seen: Excitation) -> bool:
    """Whether the catalogue's transition velocity is none that the records could show, as at a shaft before a gear."""
    low, high = seen.slow
    usual = [one.default(kind_at(model, site)) or 0.0 for one in effect.parameters if one.name == TRANSITION]
    return any(not low <= velocity <= high for velocity in usual)


def _periodic(effect: EffectType, site: str, data: InverseDynamicsProblem, model: Model, residual: Array) -> Candidate:
    """Candidate that is periodic in position, such as a ripple, with the periods that the residual shows."""
    where, rate, values = _over_way(data, model, site, residual)
    if effect.rubs or effect.takes_effort:
        values = values * (np.sign(rate) if effect.rubs else _applied(data, site))
    periods = ripple_periods(where, values, 0.5 if effect.rubs else 2.0)
    bounds = {"period": (min(periods) / 1.5, max(periods) * 1.5)}
    return Candidate(effect, site, tuple({"period": p} for p in periods), bounds)


def _payload_places(model: Model, body: str) -> tuple[Mapping[str, float], ...]:
    """Start positions of a candidate payload: origin of the body, and to all sides of its centre of mass.

    On the ray from the origin through the centre of mass a payload scales gravity, as an unknown mass of the body does,
    or an unknown gain of a drive beside free inertias. So what is off that ray has to be tried. The distance is that of
    the centre of mass, or of the body's own masses by the radius of gyration where they spread wider, as about an axis
    on which a body is in equilibrium.
    """
    if body in model.beams:  # in the frame of its tip
        return ({},)
    centre, aside = extent_of(model, body)
    places = [np.zeros(3), *(centre + aside * np.vstack([np.eye(3), -np.eye(3)]))] if aside else [np.zeros(3)]
    return tuple(dict(zip("xyz", place.tolist(), strict=True)) for place in places)


def extent_of(model: Model, body: str) -> tuple[Array, float]:
    """Centre of mass (m, shape (3,)) of a candidate's body, and how far from its origin its masses are, m."""
    values = model.parameters
    centre = np.array([values[f"{body}.center_of_mass.{axis}"].value for axis in "xyz"])
    moments = sum(values[f"{body}.inertia.{axis}"].value for axis in ("xx", "yy", "zz"))
    gyration = float(np.sqrt(0.5 * moments / values[f"{body}.mass"].value))
    return centre, max(float(np.linalg.norm(centre)), gyration)


def slow_speeds(data: InverseDynamicsProblem, shares: Array) -> tuple[float, float]:
    """Bounds of a candidate's transition velocity, from the speeds of a coordinate in each record, see `slow_share`.

    A record in which the coordinate rests does not count.
    """
    rates, moving = list[Array](), list[bool]()
    for record, log in enumerate(data.experiments):
        position, velocity, _ = data.state(record)
        channels = [f"{joint}.position" for joint in data.joints]
        noise = np.array([instrument_noise(log, channel) if channel in log else 0.0 for channel in channels])
        rates.append(velocity @ shares)
        moving.append(float(np.ptp(position @ shares)) > WITHIN_NOISE * float(np.linalg.norm(shares * noise)))
    return slow_share(rates, moving)


def slow_share(rates: Sequence[Array], moving: Sequence[bool] = ()) -> tuple[float, float]:
    """Bounds of a candidate's transition velocity: shares of the largest speed in the records that are ``moving``.

    They are 1/5000 of the smallest of these speeds and 1/10 of the largest: a slow record shows what is a detail of
    small speeds there, however fast another one is.
    """
    speeds = [float(np.quantile(np.abs(rate), 0.999)) for rate in rates]
    slowest = min(compress(speeds, moving or [True] * len(speeds)), default=max(speeds))
    return SLOW[0] * max(slowest, LEAST), SLOW[1] * max(*speeds, LEAST)


def joint_at(model: Model, site: str) -> str:
    """Joint on which a candidate acts, through its drive or sensor too; "" for bodies and for several joints."""
    if site in model.joints:
        return site
    if site in model.actuators:
        return model.joints_of_actuator(site)[0]
    read = (name.rpartition(".")[0] for name in model.output_channels if model.sensor_of(name) == site)
    return next((owner for owner in read if owner in model.joints), "")


def acts_on(model: Model, problem: InverseDynamicsProblem, site: str) -> Array:
    """Samples of a residual (n,) by which a candidate shows: 1 in efforts of its joint, of all joints for a body."""
    joint, samples = joint_at(model, site), np.zeros(max(block.samples.stop for block in problem.blocks))
    for record in range(len(problem.motions)):
        for name, block in zip(problem.joints, problem.efforts(record), strict=True):
            samples[block.samples] = float(joint in {"", name})
    return samples


def shares_at(model: Model, site: str, joints: Sequence[str]) -> Array:
    """Share of each joint in the coordinate at a candidate's site, shape (n,).

    At a transmission, or a drive of one, these are its ratios, elsewhere 1 of the joint there, or of the first one.
    """
    shaft = model.transmission_of_actuator(site) if site in model.actuators else site
    if shaft in model.transmissions:
        ratios = model.ratios(shaft)
        return np.array([model.parameters[ratios[name]].value if name in ratios else 0.0 for name in joints])
    joint = joint_at(model, site) or model.joints[0]
    shares = np.zeros(len(joints))
    shares[list(joints).index(joint) if joint in joints else 0] = 1.0
    return shares


def _excitation(data: InverseDynamicsProblem, model: Model, site: str, actuator: str | None) -> Excitation:
    """Excitation of one joint: its largest speed (99.9 % quantile), middle and half range, sampling time, command."""
    if site in model.added_joints:
        position, velocity = way_of_spring(data, site)
    else:
        shares = shares_at(model, site, data.motions[0].joints)
        position = np.concatenate([m.position @ shares for m in data.motions])
        velocity = np.concatenate([m.velocity @ shares for m in data.motions])
    column = model.actuators.index(actuator) if actuator is not None else 0
    command = max((float(np.abs(m.inputs[:, column]).max()) for m in data.motions if m.inputs.size), default=1.0)
    low, high = float(position.min()), float(position.max())
    return Excitation(
        max(float(np.quantile(np.abs(velocity), 0.999)), 1e-12),
        slow_speeds(data, shares_at(model, site, data.joints)),
        0.5 * (low + high),
        max(0.5 * (high - low), 1e-12),
        min(m.dt for m in data.motions),
        max(command, 1e-12),
        column,
        max(m.dt * len(m.time) for m in data.motions),
    )


def springs_shown(model: Model, data: InverseDynamicsProblem) -> set[str]:
    """Springs of joints that were split, to sit in which a candidate needs their way: those that all logs hold."""
    return {name for name in model.added_joints if all(f"{name}.position" in log for log in data.experiments)}


def way_of_spring(data: InverseDynamicsProblem, joint: str) -> tuple[Array, Array]:
    """Way of a spring that a candidate sits in, and its rate (n,), as logs hold them: no motion of it is prescribed."""
    ways = [log[f"{joint}.position"] for log in data.experiments]
    rates = [differentiate(way, m.dt) for way, m in zip(ways, data.motions, strict=True)]
    return np.concatenate(ways), np.concatenate(rates)


def way_of_deflection(data: InverseDynamicsProblem, model: Model, joint: str) -> float:
    """Half the way that the deflection of a candidate takes in all logs; infinite where one does not hold it."""
    behind = model.joint_behind(joint)
    if behind is None or behind not in springs_shown(model, data):
        return math.inf
    return 0.5 * max(float(np.ptp(log[f"{behind}.position"])) for log in data.experiments)


def _over_way(data: InverseDynamicsProblem, model: Model, site: str, residual: Array) -> tuple[Array, Array, Array]:
    """Position, velocity and residual of one joint at all samples, for start values of candidates.

    At a transmission it is the effort on the shaft that leaves least of the residual of its joints.
    """
    shares, records = shares_at(model, site, data.joints), range(len(data.motions))
    position, velocity = (np.concatenate([data.state(r)[which] @ shares for r in records]) for which in (0, 1))
    efforts = [np.column_stack([residual[block.samples] for block in data.efforts(r)]) for r in records]
    return position, velocity, np.concatenate(efforts) @ (shares / max(float(shares @ shares), 1e-300))


def _applied(data: InverseDynamicsProblem, joint: str) -> Array:
    """Effort that the model's drives apply at a candidate's site, at all samples."""
    model, column = data.nominal, _column(data, joint)
    return np.concatenate([data.effort(model, model.theta, r)[1][:, column] for r in range(len(data.motions))])


def _column(data: InverseDynamicsProblem, joint: str) -> int:
    return data.joints.index(joint) if joint in data.joints else 0


def limit_start(data: InverseDynamicsProblem, joint: str, actuator: int, residual: Array) -> float | None:
    """Start value of a drive limit: the cut-off of the command that explains most of a residual.

    A limited drive leaves what the command has too much, which is a ramp in the command with the slope of the gain.
    Commands of a loop whose drive gives no more run far beyond it, so that shares of the largest one say little.

    - ``joint``: on which the drive acts
    - ``actuator``: its number among the inputs
    - ``residual``: of the model without the limit

    None where no such ramp is in the residual.
    """
    commands = [m.inputs[:, actuator] for m in data.motions]
    limits = thresholds(np.abs(np.concatenate(commands)), LIMITED_MOST)
    blocks = [data.efforts(record)[_column(data, joint)] for record in range(len(data.motions))]
    ramps = [
        m.parallel(command[:, None] - np.clip(command[:, None], -limits, limits)) * block.moving[:, None]
        for m, command, block in zip(data.motions, commands, blocks, strict=True)
    ]
    push = np.concatenate([residual[block.samples] for block in blocks])
    return strongest(limits, np.concatenate(ramps), push) if limits.size else None
