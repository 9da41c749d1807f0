"""How wide a play is: read off the measured motion by letting a link fly from contact to contact.

Along the motion of the motor, what sits in the play flies freely whenever the effort that is passed on changes its
sign, and comes to rest at the other side. How long that takes, and so the gap, is seen in the balance: until the link
has arrived, the drive accelerates nothing but itself. In contacts that swallow every impact the flights begin anew each
time, so that no error of one passes on to the next; in lively ones each bounce enlarges the error of the one before.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vpm.discrepancy.candidates import Candidate
from vpm.discrepancy.flights import flights
from vpm.discrepancy.structural import moved
from vpm.errors import DivergedError
from vpm.identify import InverseDynamicsProblem
from vpm.identify.along import bends, has_own_drives
from vpm.model import Model

Array = NDArray[np.float64]

#: Widths tried, as shares of the half travel: 17 % apart, the flights of neighbours end within each other's impacts.
SHARES = tuple(np.geomspace(5e-5, 5e-2, 44).tolist())
#: Finer factors on the best of them, and frequencies of the contacts, Hz, with the damping ratios of these.
FINER = (0.92, 0.96, 1.04, 1.08)
FINEST = (0.95, 0.98, 1.02, 1.05)
#: So many of the widths are refined.
MOST = 3
CONTACTS = (30.0, 45.0, 65.0, 90.0)
DAMPINGS = (0.4, 0.7, 1.0)
#: Softer contacts, tried where hard ones do not simulate. They give way further, which hard ones take for a wider gap:
#: shares of theirs, tried with the damping ratio in the middle of those.
SOFT_CONTACTS = (7.0, 10.0, 14.0, 20.0)
SOFT_DAMPINGS = (0.2, 0.4, 0.7, 1.0)
CLOSER = (0.86, 0.9, 0.94, 0.98)
MIDDLING = 0.5
#: Contact of the first look.
CONTACT, DAMPING = 60.0, 1.0
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
    """A play and what it leaves, beside the best values of what else is free."""

    gap: float
    frequency: float
    damping: float
    left: float


def is_read_off(model: Model, data: InverseDynamicsProblem, candidate: Candidate) -> bool:
    """Whether a candidate is a play that the measured motion shows: between ideal drives and links that do not bend."""
    measured = candidate.site in data.motions[0].joints
    return candidate.effect.name == "backlash" and measured and not (bends(model) or has_own_drives(model))


def believed(model: Model, nominal: Model, free: Sequence[str]) -> Model:
    """The model with the parameters of the nominal one, if the recalibration moved any of these beyond belief.

    Play looks like a load that comes and goes; a fit without it may make a body weightless, along which nothing flies.
    """
    shared = [name for name in free if name in nominal.parameters]
    for name in shared:
        stated = nominal.parameters[name]
        spread = stated.uncertainty or math.inf
        if abs(model.parameters[name].value - stated.value) > MISLED * spread:
            return model.with_parameters({each: nominal.parameters[each].value for each in shared})
    return model


def only_winds_up(model: Model, site: str, data: InverseDynamicsProblem) -> str:
    """Why a fitted play is none, or "": under the effort its contacts give way further than the link flies."""
    gap, stiffness = (model.parameters[f"{site}.backlash.{name}"] for name in ("gap", "stiffness"))
    if site not in data.joints:
        return ""
    effort = max(data.efforts(record)[data.joints.index(site)].scale for record in range(len(data.motions)))
    way = effort / max(stiffness.value, 1e-300)
    if gap.value >= way:
        return ""
    return (
        f"its contacts wind up by {way:.3g} {gap.unit} under the effort of these data, more than its gap of "
        f"{gap.value:.3g} {gap.unit}: that is a spring"
    )


def read_off(
    model: Model, free: Sequence[str], data: InverseDynamicsProblem, candidate: Candidate, *, soft: bool = False
) -> Candidate:
    """The candidate with the one start that leaves least.

    Parameters
    ----------
    model : Model
        Without the play.
    free : sequence of str
        Its parameters that a fit may change; every width is judged with the best change of these.
    data : InverseDynamicsProblem
    candidate : Candidate
        A play.
    soft : bool
        Between soft contacts. Plastic flights show hard ones well; along soft ones the link sways, and both leave about
        as little in the balance where the swaying is lost in the errors of earlier bounces.
    """
    search = _Search(model, free, data, candidate)
    widths, left = search.survey()
    order = np.argsort(left)[:MOST]
    best = _Look(float(widths[order[0]]), search.slowed(CONTACT), DAMPING, math.inf)
    if left[order[0]] < HOPELESS * search.power:
        best = search.best(best, [replace(best, gap=f * float(widths[k])) for k in order for f in (1.0, *FINER)])
        best = search.soft(best) if soft else search.hard(best)
        best = search.best(best, [replace(best, gap=factor * best.gap) for factor in FINEST])
    return replace(candidate, starts=(search.values(best.gap, best.frequency, best.damping),))


class _Search:
    """Judges plays by the balance along the measured motion."""

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
        model = self.model.with_effect("backlash", at=self.candidate.site, **self.values(gap, frequency, damping))
        try:
            residual, _ = self.data.evaluate(model, model.theta)
        except DivergedError:
            return _Look(gap, frequency, damping, math.inf)
        left = float(self._left(residual))
        return _Look(gap, frequency, damping, left if math.isfinite(left) else math.inf)

    def best(self, so_far: _Look, tried: Sequence[_Look]) -> _Look:
        """What leaves least of those and the one before."""
        looks = [self(one.gap, one.frequency, one.damping) for one in tried]
        return min((so_far, *looks), key=lambda look: look.left)

    def hard(self, found: _Look) -> _Look:
        """The best of hard contacts around a width."""
        contacts = sorted({self.slowed(frequency) for frequency in CONTACTS})
        return self.best(found, [replace(found, frequency=f, damping=d) for f in contacts for d in DAMPINGS])

    def soft(self, found: _Look) -> _Look:
        """The best of soft contacts, whose gap is narrower than that of hard ones."""
        contacts = sorted({self.slowed(frequency) for frequency in SOFT_CONTACTS})
        pairs = [(f, share * found.gap) for f in contacts for share in CLOSER]
        first = [_Look(gap, f, MIDDLING, math.inf) for f, gap in pairs]
        best = self.best(replace(first[0], left=math.inf), first)
        return self.best(best, [replace(best, damping=damping) for damping in SOFT_DAMPINGS])

    def slowed(self, frequency: float) -> float:
        """A frequency of contacts, or the fastest that samples show."""
        return min(frequency, FASTEST / (2.0 * math.pi * self.interval))

    def values(self, gap: float, frequency: float, damping: float) -> Mapping[str, float]:
        """Values of the effect by short name."""
        stiffness = self.inertia * (2.0 * math.pi * frequency) ** 2
        resistance = 2.0 * damping * math.sqrt(stiffness * self.inertia)
        return {"gap": gap, "stiffness": stiffness, "contact_damping": resistance, "width": ROUNDING * gap}

    def survey(self) -> tuple[Array, Array]:
        """Widths, and what each of them leaves where every impact is plastic."""
        widths = np.array(SHARES) * self.travel
        start = self.values(float(widths[0]), CONTACT, DAMPING)
        model = self.model.with_effect("backlash", at=self.candidate.site, **start)
        added = flights(model, self.candidate.site, self.data, widths.tolist())
        return widths, self._left(self.residual[:, None] + added)

    def _left(self, residual: Array) -> Array:
        """Sum of squares, of each column, beside the best change of what is free."""
        rest = residual - self.known @ (self.known.T @ residual)
        return np.asarray(np.sum(rest**2, axis=0))
