"""Start value of a backlash: its width, from simulated free flights of the link along the measured motion.

Whenever the transmitted effort changes its sign, the link flies freely and comes to rest on the other side. The
duration of the flight, and so the width, shows in the residual: until the link arrives, the drive accelerates only
itself. In soft contacts that absorb most of an impact the flights are independent, so no error carries over. Between
elastic contacts each bounce enlarges the error of the one before. So the width is sought with soft contacts, and the
stiffness of the contacts afterwards, near that width.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vpm._core import soft_flights
from vpm.discrepancy.screening.candidates import Candidate
from vpm.discrepancy.screening.compliance_and_stop_start import moved
from vpm.errors import DivergedError
from vpm.experiment import Motion
from vpm.identify import InverseDynamicsProblem
from vpm.identify.response_along_motion import answers_at_once
from vpm.model import Model
from vpm.model.splitting import name_behind
from vpm.numbers import Array

#: Widths tried, as shares of the half travel: 23 % apart, as near as the flights of neighbours end together.
SHARES = np.geomspace(5e-5, 5e-2, 34)
#: Contacts between which widths are looked for: frequencies, Hz, and damping ratio.
SURVEYED, SURVEYED_DAMPING = (8.0, 14.0, 22.0), 0.5
#: So many of the backlashes are looked at along the motion as the model has it.
MOST = 3
#: Frequencies of contacts tried at the best width, Hz, with what the survey took for them, and damping ratios.
CONTACTS = (7.0, 10.0, 14.0, 20.0, 30.0, 45.0, 65.0, 90.0)
DAMPINGS = (0.2, 1.0)
#: Least frequency of contacts that count as hard, tried where soft ones do not simulate, and their damping ratios.
HARD, HARD_DAMPINGS = 30.0, (0.4, 0.7, 1.0)
#: Factors on the width between the contacts found, on these, and on the width once more.
FINER = (0.84, 0.92, 1.08, 1.16)
BESIDE = (0.84, 1.19)
FINEST = (0.95, 0.98, 1.02, 1.05)
#: Fastest contact that samples show, rad per interval.
FASTEST = 0.7
#: Way over which a contact closes, as a share of the gap: it must not pull the link out of the middle.
ROUNDING = 1e-3
#: Distance in stated uncertainties from which a recalibration was misled by what is missing.
MISLED = 3.0
#: No width is refined that leaves more than this share of what the plain model leaves.
HOPELESS = 0.95


@dataclass(frozen=True)
class _Look:
    """Start values of a backlash, the best values of the free parameters beside it, and the residual."""

    gap: float
    frequency: float
    damping: float
    left: float


def is_read_off(model: Model, data: InverseDynamicsProblem, candidate: Candidate) -> bool:
    """Whether the width of a backlash can be searched as a start value: between ideal drives and rigid links."""
    measured = candidate.site in data.motions[0].joints
    return candidate.effect.has_play and measured and answers_at_once(model)


def near_prior(model: Model, nominal: Model, free: Sequence[str]) -> Model:
    """Model for the search of a backlash width: nominal parameters if the recalibration moved any beyond its prior.

    A backlash looks like a load that comes and goes; a fit without it may make a body weightless, along which nothing
    flies.
    """
    shared = [name for name in free if name in nominal.parameters]
    for name in shared:
        stated = nominal.parameters[name]
        spread = stated.uncertainty or math.inf
        if abs(model.parameters[name].value - stated.value) > MISLED * spread:
            return model.with_parameters({each: nominal.parameters[each].value for each in shared})
    return model


def only_compliant(model: Model, site: str, data: InverseDynamicsProblem) -> str:
    """Why a fitted backlash is none, or "": its contacts give way further than its width."""
    names = next(effect.parameter_names for effect in model.effects if effect.type.has_play and effect.at == site)
    gap, stiffness = (model.parameters[names[name]] for name in ("gap", "stiffness"))
    if site not in data.joints:
        return ""
    effort = max(data.efforts(record)[data.joints.index(site)].scale for record in range(len(data.motions)))
    way = effort / max(stiffness.value, 1e-300)
    if gap.value >= way:
        return ""
    return (
        f"its contacts deflect by {way:.3g} {gap.unit} under the effort of these data, more than its gap of "
        f"{gap.value:.3g} {gap.unit}: that is a spring"
    )


def read_off(
    model: Model, free: Sequence[str], data: InverseDynamicsProblem, candidate: Candidate, *, hard: bool = False
) -> Candidate:
    """Candidate backlash with the one start value of least residual.

    - ``model``: without the backlash
    - ``free``: its parameters that a fit may change; every width is judged with the best change of these
    - ``candidate``: a backlash
    - ``hard``: between hard contacts. Soft ones show the width best; what swings in them may still not simulate
    """
    search = _Search(model, free, data, candidate)
    looks = search.survey()
    best = replace(looks[0], left=math.inf)
    if looks[0].left < HOPELESS * search.power:
        best = search.best(best, looks)
        best = search.hard(best) if hard else search.soft(best)
        best = search.best(best, [replace(best, gap=factor * best.gap) for factor in FINEST])
    return replace(candidate, starts=(search.values(best.gap, best.frequency, best.damping),))


class _Search:
    """Search for the start values of a backlash by the residual along the measured motion."""

    def __init__(self, model: Model, free: Sequence[str], data: InverseDynamicsProblem, candidate: Candidate) -> None:
        self.model, self.data, self.candidate = model, data, candidate
        joint = data.motions[0].joints.index(candidate.site)
        self.interval = max(m.dt for m in data.motions)
        self.travel = 0.5 * float(np.ptp(np.concatenate([m.position[:, joint] for m in data.motions])))
        self.inertia = moved(model, candidate.site)
        residual, jacobian = data.evaluate(model, model.theta, [model.index(name) for name in free])
        lengths = np.linalg.norm(jacobian, axis=0)
        self.known = np.linalg.qr(jacobian[:, lengths > 0.0] / lengths[lengths > 0.0])[0]
        self.residual, self.power = residual, float(self._left(residual))

    def __call__(self, gap: float, frequency: float, damping: float) -> _Look:
        model = self._with(self.values(gap, frequency, damping))
        try:
            residual, _ = self.data.evaluate(model, model.theta)
        except DivergedError:
            return _Look(gap, frequency, damping, math.inf)
        left = float(self._left(residual))
        return _Look(gap, frequency, damping, left if math.isfinite(left) else math.inf)

    def _with(self, values: Mapping[str, float]) -> Model:
        return self.model.with_effect(self.candidate.effect.name, at=self.candidate.site, **values)

    def best(self, so_far: _Look, tried: Sequence[_Look]) -> _Look:
        """Backlash of least residual among those tried and the one before."""
        looks = [self(one.gap, one.frequency, one.damping) for one in tried]
        return min((so_far, *looks), key=lambda look: look.left)

    def hard(self, found: _Look) -> _Look:
        """Best backlash with hard contacts around a width."""
        contacts = sorted({self.slowed(frequency) for frequency in CONTACTS if frequency >= HARD})
        first = replace(found, left=math.inf)
        return self.best(first, [replace(first, frequency=f, damping=d) for f in contacts for d in HARD_DAMPINGS])

    def soft(self, found: _Look) -> _Look:
        """Best backlash with soft or hard contacts around a width: one number after the other."""
        contacts = sorted({self.slowed(frequency) for frequency in CONTACTS})
        found = self.best(found, [replace(found, frequency=f) for f in contacts])
        found = self.best(found, [replace(found, damping=d) for d in DAMPINGS])
        found = self.best(found, [replace(found, gap=factor * found.gap) for factor in FINER])
        return self.best(found, [replace(found, frequency=self.slowed(factor * found.frequency)) for factor in BESIDE])

    def slowed(self, frequency: float) -> float:
        """Contact frequency of a backlash, no faster than samples can show."""
        return min(frequency, FASTEST / (2.0 * math.pi * self.interval))

    def values(self, gap: float, frequency: float, damping: float) -> Mapping[str, float]:
        """Start values of the backlash by short name."""
        stiffness = self.inertia * (2.0 * math.pi * frequency) ** 2
        resistance = 2.0 * damping * math.sqrt(stiffness * self.inertia)
        return {"gap": gap, "stiffness": stiffness, "contact_damping": resistance, "width": ROUNDING * gap}

    def survey(self) -> list[_Look]:
        """Backlashes between soft contacts by their residual, the least first."""
        contacts = sorted({self.slowed(frequency) for frequency in SURVEYED})
        widths, frequencies = (each.ravel() for each in np.meshgrid(SHARES * self.travel, contacts))
        start = self.values(float(widths[0]), contacts[0], SURVEYED_DAMPING)
        model = self._with(start)
        dampings = np.full_like(widths, SURVEYED_DAMPING)
        left = self._left(
            self.residual[:, None] + flights(model, self.candidate.site, self.data, widths, frequencies, dampings)
        )
        order = np.argsort(left)[:MOST]
        return [_Look(float(widths[k]), float(frequencies[k]), SURVEYED_DAMPING, float(left[k])) for k in order]

    def _left(self, residual: Array) -> Array:
        """Sum of squares that each backlash column leaves beside the best change of the free parameters."""
        rest = residual - self.known @ (self.known.T @ residual)
        return np.asarray(np.sum(rest**2, axis=0))


@dataclass(frozen=True)
class _Course:
    """Data along one record from which backlash flights are simulated."""

    pull: Array  #: Shape (N,); acceleration of the link against the motor while nothing holds it.
    column: Array  #: Shape (N, joints); effort at each measured joint per such acceleration.
    interval: float  #: s.


def flights(
    model: Model, site: str, data: InverseDynamicsProblem, gaps: Array, frequencies: Array, dampings: Array
) -> Array:
    """Change of the residual by backlash flights, shape (n, backlashes).

    Law: within the gap no effort is transmitted to the link. Beyond it a spring and a damper hold it, ``y'' = pull -
    w^2 (y -+ gap/2) - 2 z w y'``, with ``w = 2 pi frequency`` and the damping ratio z. Steps take the damping at the
    new velocity, which is stable up to ``w`` times the interval of 2. Source: dead-zone model of Nordin and Gutman,
    Automatica 38(10), 2002, section 2.

    - ``model``: with the backlash, of any width
    - ``site``: its joint
    - ``gaps``, ``frequencies``, ``dampings`` (backlashes,): widths, m or rad; Hz at which the link swings on a
      contact while the motor stands; damping ratios there
    """
    added = []
    for m in data.motions:
        course = _course(model, site, m)
        swing = soft_flights(course.pull, gaps, 2.0 * np.pi * frequencies, dampings, course.interval)
        added.append(course.column[:, :, None] * swing[:, None, :])
    return data.added(added)


def _course(model: Model, site: str, m: Motion) -> _Course:
    """Measured motion for backlash flights: with the link at rest, and once more with a unit acceleration."""
    behind = model.joints.index(name_behind(site))
    before = [model.joints.index(joint) for joint in m.joints]
    motion = np.zeros((3, len(m.time), len(model.joints)))
    for order, values in enumerate((m.position, m.velocity, m.acceleration)):
        motion[order][:, before] = values
    held, _, _ = model.core.inverse_dynamics(model.theta, motion[0], motion[1], motion[2], m.inputs, m.dt)
    motion[2][:, behind] += 1.0
    moved, _, _ = model.core.inverse_dynamics(model.theta, motion[0], motion[1], motion[2], m.inputs, m.dt)
    column = moved - held
    return _Course(-held[:, behind] / column[:, behind], -column[:, before], m.dt)
