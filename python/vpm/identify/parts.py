"""Parts of a machine that answer to a measured motion each by itself, each with only what its answer depends on.

Along a given motion no mass and no law of a joint changes what a drive does, no drive the effort that the motion needs,
and neither laws nor faults of drives how links bend: the balance is a sum. A candidate then asks for the part that it
changes, and the others answer from memory.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue import EFFECTS
from vpm.model import Model
from vpm.model.effects import Effect
from vpm.model.splitting import name_behind

Indices = NDArray[np.int64]
Content = Mapping[str, Any]


@dataclass(frozen=True)
class Part:
    """A machine that answers for a part of another one; the values of its model mean nothing."""

    model: Model
    places: Indices  #: Its parameters among those of the whole machine.
    felt: NDArray[np.bool_]  #: Which of them change its answer.
    #: Its inputs, and its states of drives and supplies, among those of the whole machine, or of the bare one of
    #: `Drives`.
    inputs: Indices
    states: Indices


@dataclass(frozen=True)
class Bending:
    """A machine of which not all that moves was measured: what moves it, and what adds to its efforts."""

    bare: Part  #: Without the laws of its joints and the faults of its drives.
    #: Both with rigid links and no play: their difference in effort is that of the laws. None without laws.
    laws: Part | None = None
    shell: Part | None = None


@dataclass(frozen=True)
class Drives:
    """Drives on joints that were all measured, those together that share a supply that gives way."""

    bare: Part  #: The machine with rigid links, without joints that effects have split off.
    parts: tuple[Part, ...]


def whole(model: Model) -> Part:
    """The whole machine as a part of itself."""
    return _part(model, model, set(model.parameter_names))


def carried(model: Model) -> Part:
    """Part of a machine without cylinders, supplies and controllers: the effort of a motion depends on it.

    Friction that follows a load needs a drive to be read; where that was a cylinder, an idle one stands there.
    """
    gone = {name for name in model.actuators if model.actuator_type(name) == "hydraulic"}
    gone |= {*model.supplies, *model.controllers}
    content = _content(model)
    content = {key: entry for key, entry in content.items() if key not in {"supplies", "controllers"}}
    for kind in ("actuators", "sensors"):
        entries = content.get(kind, {})
        gone |= {name for name, entry in entries.items() if _owner(entry.get("measures", name)) in gone}
        content[kind] = {name: entry for name, entry in entries.items() if name not in gone}
    content["effects"] = [entry for entry in content.get("effects", ()) if entry["at"] not in gone]
    loaded = {entry["at"] for entry in content["effects"] if EFFECTS[entry["type"]].takes_effort}
    for name in gone & set(model.actuators):
        for joint in loaded & set(model.joints_of_actuator(name)):
            content["actuators"][name] = {"type": "ideal", "gain": 0.0, "joint": joint}
    kept = Model.from_dict(content)
    return _part(model, kept, set(kept.parameter_names) & set(model.parameter_names))


def of_joints_alone(model: Model, joints: tuple[str, ...]) -> Model | None:
    """A machine without the effects that give it other joints than the measured ``joints``; None where they stay."""
    bare = model
    for effect in (one for one in model.effects if one.type.motion and tuple(model.joints) != joints):
        if effect not in bare.effects:
            continue  # it went with its spring
        candidate = bare.without_effect(*effect.key)
        bare = candidate if len(candidate.joints) < len(bare.joints) else bare
    return bare if tuple(bare.joints) == joints else None


def drives_of(model: Model, joints: tuple[str, ...]) -> Drives | None:
    """Parts of a machine that its drives are, each with the measured ``joints`` it feels.

    The motor side of a joint that effects have split keeps the measured motion and the drives: these answer as in the
    machine without such effects. None where that has other joints.
    """
    bare = of_joints_alone(model, joints)
    if bare is None:
        return None
    bare = bare.at("rigid") if bare.beams else bare
    parts = tuple(_drives(bare, model, group) for group in _groups(bare))
    return Drives(_part(model, bare, set(bare.parameter_names), bare), parts)


def moves_drives(model: Model, name: str) -> bool:
    """Whether a parameter can change the drive parts along a given motion."""
    owner = _owner(name)
    return owner not in model.joints and owner not in model.bodies and owner != "world"


def bending(model: Model, joints: tuple[str, ...], *, wound: bool = False) -> Bending | None:
    """Parts of a machine that bend or fly, if its measured ``joints`` are all others; else None.

    Joints that are ``wound`` up count as plays do, if asked for.
    """
    splitting = [e for e in model.effects if e.type.has_play or (wound and e.type.splits)]
    plays = [e for e in splitting if model.joint_behind(e.at)]
    flying = {model.joint_behind(e.at) for e in plays}
    if any((e.side == "link" and model.joint_behind(e.at)) or e.at in model.added_joints for e in model.effects):
        return None  # what acts behind a spring or in it moves it
    if tuple(joint for joint in model.joints if joint not in flying) != joints:
        return None
    if not model.core.n_elastic and (not plays or any(e.type.rotor for e in model.effects)):
        return None  # a rotor is what flies against
    aside = [e for e in model.effects if e.type.site in {"joint", "actuator"} and not e.type.splits]
    if len(aside) + len(plays) < sum(e.type.site in {"joint", "actuator"} for e in model.effects):
        return None
    return _bending(model, plays, aside)


def _bending(model: Model, plays: Sequence[Effect], aside: Sequence[Effect]) -> Bending:
    content = _content(model)
    bare = _without(content, aside)
    owners = {*model.actuators, *model.controllers}
    moving = _part(model, bare, {name for name in bare.parameter_names if _owner(name) not in owners})
    laws = [effect for effect in aside if effect.type.site == "joint"]
    if not laws:
        return Bending(moving)
    read = [effect for effect in model.effects if effect.type.site == "sensor"]
    felt = {name for effect in (*laws, *read) for name in effect.parameter_names.values()}
    # With rigid links; a beam that bends by an effect does so at every level.
    bent = [*plays, *(effect for effect in model.effects if effect.type.motion == "bending")]
    rigid = bool(model.core.n_elastic)
    with_laws, shell = (_without(content, effects, rigid=rigid) for effects in (bent, [*bent, *aside]))
    return Bending(moving, _part(model, with_laws, felt), _part(model, shell, felt))


def _content(model: Model) -> dict[str, Any]:
    """Content of a machine without its table of logged columns, which may name what a part does not have."""
    return {key: entry for key, entry in model.to_dict().items() if key != "channels"}


def _without(content: Content, effects: Sequence[Effect], *, rigid: bool = False) -> Model:
    """Part of a machine without some effects and what reads their deflections, and with rigid links."""
    gone = {(effect.name, effect.at, effect.side) for effect in effects}
    lost = {name_behind(effect.at) for effect in effects if effect.type.splits}
    sensors = content.get("sensors", {})
    blind = {name for name, one in sensors.items() if _owner(one["measures"]) in lost}
    of = itemgetter("type", "at")
    kept = [entry for entry in content.get("effects", ()) if (*of(entry), entry.get("side", "motor")) not in gone]
    changed = {**content, "effects": [entry for entry in kept if entry["at"] not in blind]}
    changed["sensors"] = {name: one for name, one in sensors.items() if name not in blind}
    if rigid:
        changed["beams"] = {name: {**beam, "level": "rigid"} for name, beam in content["beams"].items()}
    return Model.from_dict(changed)


def _groups(model: Model) -> list[tuple[str, ...]]:
    """Names of drives in one part: those of one supply with a state, such as a sagging pressure."""
    if model.beams:
        return [tuple(model.actuators)]
    giving_way = {_owner(name) for name in model.internal_names} & set(model.supplies)
    groups: dict[str, list[str]] = {}
    for name in model.actuators:
        supply = model.supply_of_actuator(name)
        groups.setdefault(f"supply {supply}" if supply in giving_way else name, []).append(name)
    return [tuple(group) for group in groups.values()]


def _drives(model: Model, machine: Model, group: Sequence[str]) -> Part:
    """Part with some of the drives, without joint laws, controllers and other drives."""
    content = _content(model)
    content.pop("controllers", None)
    joints = {joint for name in group for joint in model.joints_of_actuator(name)}
    felt, sensors = {*group, *joints, *model.supplies}, content.get("sensors", {})
    content["sensors"] = {name: entry for name, entry in sensors.items() if _owner(entry["measures"]) in felt}
    content["actuators"] = {name: content["actuators"][name] for name in group}
    sites = {*group, *model.supplies, *content["sensors"]}
    effects = [entry for entry in content.get("effects", ()) if entry["at"] in sites]
    content["effects"] = [entry for entry in effects if EFFECTS[entry["type"]].site != "joint"]
    alone = Model.from_dict(content)
    return _part(machine, alone, {name for name in alone.parameter_names if moves_drives(alone, name)}, model)


def _owner(name: str) -> str:
    return name.partition(".")[0]


def _part(model: Model, alone: Model, felt: Collection[str], within: Model | None = None) -> Part:
    """A machine for a part of ``model``, whose answer changes with the parameters ``felt`` alone.

    Its inputs and states are those of a machine ``within`` that, if it is another one.
    """
    names, within = alone.parameter_names, within or model
    return Part(
        alone,
        _places(names, model.parameter_names),
        np.array([name in felt for name in names], dtype=np.bool_),
        _places(alone.inputs, within.inputs),
        _places(alone.internal_names, within.internal_names),
    )


def _places(names: Sequence[str], among: Sequence[str]) -> Indices:
    """Numbers of names in a part's list; that of an idle drive is 0."""
    places = {name: place for place, name in enumerate(among)}
    return np.array([places.get(name, 0) for name in names], dtype=np.int64)
