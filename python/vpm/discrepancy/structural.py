"""Start values of effects that bend, wind up or stop what is described as rigid and free.

A spring between two masses shows by its resonance, so that stiffnesses are tried at a grid of frequencies.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from vpm.catalogue import EffectType
from vpm.identify.along import has_hidden
from vpm.model import Model

#: Effects whose start values are read here.
STRUCTURAL = frozenset({"joint_compliance", "backlash", "link_flexibility", "end_stop"})
#: Effects that add coordinates that nobody measures.
HIDING = frozenset({"joint_compliance", "backlash", "link_flexibility"})
#: Frequencies at which a spring lets the link swing behind a motor that stands still, Hz, and damping ratios there.
FREQUENCIES = (3.0, 8.0, 20.0, 50.0)
LOOSE, CONTACT = 0.05, 0.1
#: Slowest of these in a fit, Hz: a softer spring holds nothing.
SLOWEST = 0.5
#: Frequency of the contacts of play, Hz, and widths of it tried, as shares of the half travel.
CONTACT_FREQUENCY = 50.0
GAP_SHARES = (5e-4, 3e-3, 1.5e-2)
#: Places of a stop, as shares of the half travel from its middle.
STOP_SHARES = (0.6, 0.8, 0.95)

#: Least inertia on the side of the drive, as a share of what the joint moves.
LEAST_DRIVEN = 1e-4
#: Effects that let something move that nobody measures.
HIDING = frozenset({"joint_compliance", "backlash", "link_flexibility"})

Starts = tuple[Mapping[str, float], ...]
Bounds = Mapping[str, tuple[float, float]]


def sites_worth_trying(effect: EffectType, model: Model) -> tuple[str, ...]:
    """Sites of an effect but those where it cannot show: links that bend already, damping of rigid beams.

    Play is looked for where an actuator drives the joint; elsewhere it needs a joint of its own.
    """
    sites = model.sites(effect.site)
    if effect.name == "link_flexibility":
        return tuple(site for site in sites if model.levels.get(site, "rigid") == "rigid")
    if effect.name == "structural_damping":
        return tuple(site for site in sites if model.levels[site] != "rigid")
    if effect.name in {"backlash", "joint_compliance"}:
        driven = {joint for name in model.actuators for joint in model.joints_of_actuator(name)}
        return tuple(site for site in sites if site in driven and f"{site}_deflection" not in model.joints)
    return sites


def beyond(effect: EffectType, site: str, model: Model, measured: Sequence[str]) -> str:
    """Why a model with one effect more could not be built, or balanced along the ``measured`` joints, or "".

    A motion with joints that nobody measures is integrated, and there no hysteresis carries its memory along.
    """
    remembering = [entry.at for entry in model.effects if entry.name == "hysteresis"]
    if effect.name == "hysteresis" and has_hidden(model, measured):
        return "its memory cannot be balanced beside what moves unseen in this model"
    if effect.name not in HIDING:
        return ""
    if remembering:
        return f"what moves unseen cannot be balanced beside the memory of the hysteresis at {remembering[0]}"
    split = [(entry.name, entry.at) for entry in model.effects if entry.name in HIDING]
    whole = model
    for key in split:
        whole = whole.without_effect(*key)
    for name, at in split:
        if _joint(whole, at) == _joint(whole, site):
            return f"the joint is split already by {name} at {at}, and no inertia is between"
    return ""


def coupled(model: Model) -> bool:
    """Whether it has several joints beside those that effects have split off, whose errors can cancel each other."""
    added = {f"{entry.at}_{suffix}" for entry in model.effects for suffix in ("bending", "deflection")}
    return len(set(model.joints) - added) > 1


def _joint(model: Model, site: str) -> str:
    """A joint itself, or the one before a body or beam."""
    return site if site in model.joints else model.joint_before(site)


def structural_starts(effect: str, site: str, model: Model, middle: float, travel: float) -> tuple[Starts, Bounds]:
    """Start values and bounds by short name.

    Parameters
    ----------
    effect, site : str
    model : Model
    middle, travel : float
        Middle and half range of the joint's travel in the data.
    """
    inertia = _moved(model, site)
    held = (inertia * (2.0 * math.pi * SLOWEST) ** 2, math.inf)
    if effect == "end_stop":
        high = tuple({"high": middle + share * travel} for share in STOP_SHARES)
        low = tuple({"low": middle - share * travel} for share in STOP_SHARES)
        reach = (middle - travel, middle + travel)  # what is never touched does not show
        bounds = {"low": reach, "high": reach, "width": (1e-6 * travel, 0.05 * travel), "stiffness": held}
        return (*high, *low), bounds
    share = (LEAST_DRIVEN * inertia, math.inf)  # without any inertia before it a spring has nothing to swing against
    if effect == "backlash":
        stiffness = inertia * (2.0 * math.pi * CONTACT_FREQUENCY) ** 2
        damping = 2.0 * CONTACT * math.sqrt(stiffness * inertia)
        common = {"stiffness": stiffness, "damping": damping}
        gaps = [share * travel for share in GAP_SHARES]
        bounds = {
            "stiffness": held,
            "gap": (0.0, 0.5 * travel),
            "width": (1e-7 * travel, 0.1 * travel),
            "inertia": share,
        }
        return tuple({**common, "gap": gap, "width": 0.05 * gap} for gap in gaps), bounds
    stiffnesses = [inertia * (2.0 * math.pi * frequency) ** 2 for frequency in FREQUENCIES]
    if effect == "link_flexibility":
        times = [LOOSE / (math.pi * frequency) for frequency in FREQUENCIES]
        return tuple({"stiffness": k, "time": t} for k, t in zip(stiffnesses, times, strict=True)), {
            "stiffness": held,
            "inertia": share,
        }
    starts = tuple({"stiffness": k, "damping": 2.0 * LOOSE * math.sqrt(k * inertia)} for k in stiffnesses)
    return starts, {"stiffness": held, "inertia": share}


def _moved(model: Model, site: str) -> float:
    """Inertia that hangs on a joint, a body or a beam when all joints stand at zero."""
    joint = model.joint_before(site)
    place = model.joints.index(joint)
    whole = float(model.mass_matrix(np.zeros(len(model.coordinates)))[place, place])
    rotor = sum(
        model.parameters[name].value
        for name in (f"{joint}.rotor_inertia", f"{joint}.rotor.inertia")
        if name in model.parameters
    )
    return max(whole - rotor, 1e-3 * whole)
