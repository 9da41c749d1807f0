"""Start values of effects that add compliance, backlash or end stops to rigid and free parts.

A spring between two masses shows by its resonance, so stiffnesses are tried at a grid of frequencies.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from vpm.catalogue import EFFECTS, EffectType
from vpm.catalogue.kinds import POSITIVE
from vpm.discrepancy.settings import (
    BEYOND_LEAST,
    BEYOND_MOST,
    COMPARED,
    CONTACT,
    CONTACT_FREQUENCY,
    FREQUENCIES,
    GAP_SHARES,
    LEAST_DRIVEN,
    LOOSE,
    SHARES_OF_DEFLECTION,
    SOFTEST,
    STOP_SHARES,
)
from vpm.experiment.signal import differentiate
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.model.splitting import name_behind, name_of_bending, spring_in_series
from vpm.numbers import Array

Starts = tuple[Mapping[str, float], ...]
Bounds = Mapping[str, tuple[float, float]]


def sites_worth_trying(effect: EffectType, model: Model) -> tuple[str, ...]:
    """Sites where compliance, stops or other effects can show: no links that bend already, no damping if rigid.

    A backlash is tried where an actuator drives the joint; elsewhere it needs a joint of its own. Effects of joints may
    be on the motor side of a transmission too, but for those of links.
    """
    sites = model.sites(effect.site)
    if effect.has_sides and not effect.link_side_alone:
        # What sits on a shaft that one joint alone turns is the same at the joint.
        sites = (*sites, *(name for name in model.transmissions if len(model.ratios(name)) > 1))
    if effect.in_springs:
        sites = (*sites, *model.added_joints)
    if effect.beside_others:
        moved = {name: set(model.joints_of_actuator(name)) for name in model.actuators}
        shared = {site for site in sites if any(moved[site] & moved[name] for name in moved if name != site)}
        return tuple(site for site in sites if site in shared or model.line_of_actuator(site) is not None)
    if effect.motion == "bending":
        stiff = tuple(site for site in sites if model.levels.get(site, "rigid") == "rigid")
        if not model.core.n_elastic:
            return stiff
        # Beside links that bend, the spring at the root of a body is that of the joint before it, which is tried.
        springs = (one for one in EFFECTS.values() if one.winds_up)
        wound = {site for one in springs for site in sites_worth_trying(one, model)}
        return tuple(site for site in stiff if site in model.beams or model.joint_before(site) not in wound)
    if effect.damps:
        return tuple(site for site in sites if model.levels[site] != "rigid")
    if effect.splits:
        whole = (site for site in sites if site in model.driven_joints)
        return tuple(site for site in whole if not model.joint_behind(site) or _in_series(effect, site, model))
    return sites


def _in_series(effect: EffectType, site: str, model: Model) -> bool:
    """Whether what splits a joint can be in series with a spring that is there."""
    return spring_in_series(effect, site, model.effects) is not None


def beyond(effect: EffectType, site: str, model: Model) -> str:
    """Why a model with one more compliance cannot be built."""
    if not effect.motion or _in_series(effect, site, model):
        return ""
    splitting = [entry for entry in model.effects if entry.type.motion]
    split = [(one.name, one.at) for one in splitting if spring_in_series(one.type, one.at, splitting) is None]
    whole = model
    for key in split:
        whole = whole.without_effect(*key)
    for name, at in split:
        if _joint(whole, at) == _joint(whole, site):
            return f"the joint is split already by {name} at {at}, and no inertia is between"
    return ""


def _joint(model: Model, site: str) -> str:
    """Joint of a compliance or stop: the site itself, or the joint before a body or beam."""
    return site if site in model.joints else model.joint_before(site)


def logged_swing(data: InverseDynamicsProblem, model: Model, site: str) -> tuple[float, float] | None:
    """Stiffness and damping of a compliance per inertia, 1/s^2 and 1/s, where logs hold its deflection.

    What hangs on the spring obeys ``a + d'' = -(k/J) d - (c/J) d'``, ``a`` the acceleration of the joint before it.
    Two numbers by linear least squares, without gravity and the motion of other joints, so good for a start only.
    """
    behind = {f"{name}.position" for name in (name_of_bending(site), name_behind(site))}
    logged = [channel for channel in data.shown if channel in behind]
    if not logged:
        return None
    column = data.motions[0].joints.index(_joint(model, site))
    columns, wanted = [], []
    for m, experiment in zip(data.motions, data.experiments, strict=True):
        bent = experiment[logged[0]]
        rate = differentiate(bent, m.dt)
        whole = m.acceleration[:, column] + differentiate(rate, m.dt)
        kept = m.parallel(np.column_stack([bent - bent.mean(), rate, whole]))
        columns.append(kept[:, :2])
        wanted.append(-kept[:, 2])
    stiffness, damping = np.linalg.lstsq(np.vstack(columns), np.concatenate(wanted), rcond=None)[0]
    return (float(stiffness), max(float(damping), 0.0)) if stiffness > (2.0 * math.pi * SOFTEST) ** 2 else None


def structural_starts(
    effect: EffectType, site: str, model: Model, travel: float, swing: tuple[float, float] | None = None
) -> tuple[Starts, Bounds]:
    """Start values and bounds of a compliance, backlash or stop by short name.

    - ``effect``: with a motion of its own
    - ``travel``: half range of the joint's travel in the data
    - ``swing``: what the logs say of the spring, see `logged_swing`; it is tried beside the grid of frequencies
    """
    inertia = moved(model, site)
    held = (softest(model, site), math.inf)
    share = (LEAST_DRIVEN * inertia, math.inf)  # without any inertia before it a spring has nothing to swing against
    if effect.has_play:
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
    known = [(swing[0] * inertia, swing[1] * inertia)] if swing is not None else []
    if effect.motion == "bending":
        read = tuple({"stiffness": k, "time": c / k} for k, c in known)
        times = [LOOSE / (math.pi * frequency) for frequency in FREQUENCIES]
        return (*read, *({"stiffness": k, "time": t} for k, t in zip(stiffnesses, times, strict=True))), {
            "stiffness": held,
            "inertia": share,
        }
    starts = tuple({"stiffness": k, "damping": 2.0 * LOOSE * math.sqrt(k * inertia)} for k in stiffnesses)
    return (*({"stiffness": k, "damping": c} for k, c in known), *starts), {"stiffness": held, "inertia": share}


def starts_in_series(travel: float, deflection: float) -> tuple[Starts, Bounds]:
    """Start values and bounds of a play in series with a spring, which says how stiff its contacts are.

    - ``travel``: half range of the joint's travel in the data
    - ``deflection``: half the way of the deflection, which holds the gap; infinite if nobody reads it
    """
    most = max(min(travel, deflection), 100.0 * POSITIVE)  # one that stays where it is may be read, too
    shares = GAP_SHARES if travel < deflection else SHARES_OF_DEFLECTION
    starts = tuple({"gap": share * most, "width": 0.05 * share * most} for share in shares)
    return starts, {"gap": (0.0, 2.0 * most), "width": (max(1e-7 * most, POSITIVE), 0.1 * most)}


def softest(model: Model, site: str) -> float:
    """Least start stiffness of a compliance that holds what the joint moves, N/m or N m/rad."""
    return moved(model, site) * (2.0 * math.pi * SOFTEST) ** 2


def stop_starts(position: Array, residual: Array, middle: float, travel: float, least: float) -> tuple[Starts, Bounds]:
    """Start values and bounds of end stops: one end, or both where either side looks like one.

    A stop pushes back over the last part of the travel, so the residual (applied - required) grows outwards from its
    position. The positions on either side are those at which such a ramp explains most of it.

    - ``position``, ``residual`` (n,): of the joint, at the same samples
    - ``middle``, ``travel``: middle and half range of the joint's travel in the data
    - ``least``: stiffness of the softest stop
    """
    ends: dict[str, list[float]] = {}
    for name, side in (("high", 1.0), ("low", -1.0)):
        outwards = side * (position - middle)
        places = thresholds(outwards, BEYOND_MOST)
        found = strongest(places, np.maximum(outwards[:, None] - places, 0.0), side * residual)
        seen = [] if found is None else [middle + side * found]
        ends[name] = [*seen, *(middle + side * share * travel for share in STOP_SHARES)]
        ends[f"{name} seen"] = seen
    both = [{"low": low, "high": high} for low in ends["low seen"] for high in ends["high seen"]]
    reach = (middle - 1.2 * travel, middle + 1.2 * travel)
    one = [{name: place} for name in ("high", "low") for place in ends[name]]
    width = (1e-6 * travel, 0.05 * travel)
    return (*one, *both), {"low": reach, "high": reach, "width": width, "stiffness": (least, math.inf)}


def thresholds(values: Array, most: float) -> Array:
    """Places of which a share between the fewest samples and ``most`` of all lies beyond, the outermost first."""
    last = int(most * values.size)
    if last <= BEYOND_LEAST:
        return np.zeros(0)
    return np.sort(values)[-np.unique(np.geomspace(BEYOND_LEAST, last, COMPARED).astype(np.int64)) - 1]


def strongest(places: Array, ramps: Array, push: Array) -> float | None:
    """Place whose ramp (n, places) explains most of ``push`` (n,), along it; None where none does."""
    along, power = np.maximum(ramps.T @ push, 0.0), np.sum(ramps**2, axis=0)
    taken = along**2 / np.where(power > 0.0, power, np.inf)
    return float(places[np.argmax(taken)]) if np.any(taken > 0.0) else None


def moved(model: Model, site: str) -> float:
    """Inertia behind a compliance at a joint, body or beam when all joints are at zero."""
    joint = model.joint_before(site)
    place = model.joints.index(joint)
    whole = float(model.masses_at_zero[place])
    rotor = sum(
        model.parameters[name].value
        for name in (f"{joint}.rotor_inertia", f"{joint}.rotor.inertia")
        if name in model.parameters
    )
    shafts = (
        name for name in model.transmissions if joint in model.ratios(name) and f"{name}.inertia" in model.parameters
    )
    for name in shafts:
        ratio, inertia = (model.parameters[one].value for one in (model.ratios(name)[joint], f"{name}.inertia"))
        rotor += ratio**2 * inertia
    return max(whole - rotor, 1e-3 * whole)


def ends_apart(
    model: Model, free: Sequence[str], bounds: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """Bounds that keep both ends of a stop on their sides of its middle."""
    apart = dict(bounds)
    for stop in (effect.parameter_names for effect in model.effects if effect.type.stops):
        low, high = stop["low"], stop["high"]
        if low not in free or high not in free:
            continue
        lower, upper = model.parameters[low], model.parameters[high]
        middle = 0.5 * (lower.value + upper.value)
        least, most = apart.get(low, (lower.minimum, lower.maximum))
        apart[low] = least, min(most, middle)
        least, most = apart.get(high, (upper.minimum, upper.maximum))
        apart[high] = max(least, middle), most
    return apart
