"""From the parts of a robot to the content of a model file, with the remarks that make it readable."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vpm.catalogue import EFFECTS, POSITIVE
from vpm.catalogue.traits import Plain
from vpm.model.joint import SUFFIXES, JointType
from vpm.model.pose import Pose
from vpm.robots.lumping import WORLD, Lump, Tree
from vpm.robots.markup import clean
from vpm.robots.parts import SINGLE, Drive, Inertial, Joint, Mimic, Robot, angles_of, rounded
from vpm.robots.transmissions import drives_of
from vpm.robots.uncertain import Spread

_RESERVED = ("world", "time")


@dataclass
class Names:
    """Names of robot parts given so far, and notes of those that had to be changed."""

    taken: set[str] = field(default_factory=lambda: set(_RESERVED))
    notes: list[str] = field(default_factory=list)

    def of(self, what: str, name: str, suffixes: Sequence[str] = ("",)) -> str:
        """Model-file name for a robot's name.

        - ``what``: ``"joint"``, ``"link"``: what is put before or behind a name that will not do, and stands in the
          note
        - ``suffixes``: of the names that it brings with it, such as the coordinates of a joint
        """
        safe = re.sub(r"[^A-Za-z0-9_-]", "_", name)
        if not safe[:1].isalpha():
            safe = f"{what}_{safe.lstrip('_')}"
        wanted, count = safe, 1
        while any(f"{wanted}{suffix}" in self.taken for suffix in ("", *suffixes)):
            wanted = f"{safe}_{what}" if count == 1 else f"{safe}_{what}_{count}"
            count += 1
        self.taken.update(f"{wanted}{suffix}" for suffix in ("", *suffixes))
        if wanted != name:
            self.notes.append(f'{what} "{clean(name)}" is called {wanted}')
        return wanted

    def joint(self, name: str, kind: JointType) -> str:
        """Model-file name for a robot's joint, with those of its coordinates."""
        return self.of("joint", name, SUFFIXES[kind])

    def made(self, name: str) -> str:
        """Model-file name of a part without a name in the robot file; it needs no note."""
        before = len(self.notes)
        given = self.of("part", name)
        del self.notes[before:]
        return given


def plain_effect(plain: Plain) -> tuple[str, str]:
    """Joint effect of the catalogue that a robot file gives as one number, and its parameter."""
    effect = next(one for one in EFFECTS.values() if one.plain == plain)
    return effect.name, effect.parameters[0].name


Content = dict[str, Any]
Remarks = dict[tuple[str, ...], str]

#: Mass of a link that moves and has none (kg): the least that a parameter above 0 may be.
LEAST_MASS = POSITIVE
_ORDER = "xx yy zz xy xz yz, about the centre of mass"


@dataclass
class Draft:
    """Content of a model file on its way."""

    content: Content
    #: By place: of a component before its table, of a key behind its line.
    remarks: Remarks = field(default_factory=dict)
    #: Names in the model by names in the robot's file.
    bodies: dict[str, str] = field(default_factory=dict)
    joints: dict[str, str] = field(default_factory=dict)
    names: Names = field(default_factory=Names)

    def put(self, section: str, name: str, table: Content, remark: str = "") -> None:
        """Add a component to the content of an imported model file."""
        self.content.setdefault(section, {})[name] = table
        if remark:
            self.remarks[section, name] = remark

    def plain(self, what: Plain, at: str, value: Content, **values: object) -> None:
        """Add an effect to the content that is a number of a joint."""
        kind, parameter = plain_effect(what)
        self.content.setdefault("effects", []).append({"type": kind, "at": at, parameter: value, **values})


def draft_of(robot: Robot, tree: Tree, spread: Spread) -> Draft:
    """Content of the model file of a robot, but for the ties of joints that follow others."""
    draft = Draft({"name": robot.name, "gravity": list(robot.gravity)})
    draft.remarks["gravity",] = "m/s^2"
    for lump in tree.lumps.values():
        draft.joints[lump.joint.name] = draft.names.joint(lump.joint.name, lump.joint.kind)
    for link in tree.lumps:
        draft.bodies[link] = draft.names.of("link", link)
    for link, lump in tree.lumps.items():
        _put_body(draft, robot, link, lump, spread)
    for lump in tree.lumps.values():
        _put_joint(draft, lump, spread)
    _put_shafts(draft, robot)
    _put_frames(draft, robot, tree)
    _put_drives(draft, robot, tree)
    for lump in tree.lumps.values():
        _put_effects(draft, lump.joint, spread)
    return draft


def _put_body(draft: Draft, robot: Robot, link: str, lump: Lump, spread: Spread) -> None:
    name = draft.bodies[link]
    fixed = [f'"{clean(part)}"' for part, _ in lump.parts[1:]]
    remark = f"With what is fixed to it: {', '.join(fixed)}" if fixed else ""
    if lump.inertial is None:
        table: Content = {"mass": {"value": LEAST_MASS, "unit": "kg"}}
        rest = f"it moves and has no mass, so that it gets the least that a model takes, {LEAST_MASS:g} kg"
        robot.notes.append(f'link "{clean(link)}": {rest}')
        draft.put("bodies", name, table, f"{remark}{'; ' if remark else ''}without a mass of its own")
        return
    draft.put("bodies", name, _body(lump.inertial, spread), remark)
    draft.remarks["bodies", name, "center_of_mass"] = "m"
    draft.remarks["bodies", name, "inertia"] = f"kg m^2: {_ORDER}"


def _body(inertial: Inertial, spread: Spread) -> Content:
    """Content table of an imported robot's body."""
    table: Content = {"mass": spread.scaled(inertial.mass, "kg")}
    if any(inertial.center) or spread.share:
        table["center_of_mass"] = spread.center(inertial)
    if any(inertial.inertia):
        table["inertia"] = spread.inertia(inertial)
    return table


def _put_joint(draft: Draft, lump: Lump, spread: Spread) -> None:
    joint, name = lump.joint, draft.joints[lump.joint.name]
    parent = WORLD if lump.parent == WORLD else draft.bodies[lump.parent]
    table: Content = {"type": joint.kind, "parent": parent, "child": draft.bodies[joint.child]}
    if joint.axis is not None:
        table["axis"] = list(joint.axis)
    if joint.rotor > 0.0 and joint.kind in SINGLE:
        table["rotor_inertia"] = spread.scaled(joint.rotor, "kg m^2" if joint.kind == "revolute" else "kg")
    table["translation"] = list(joint.translation if lump.kept else rounded_place(lump.place))
    table["rotation"] = list(joint.angles if lump.kept else angles_of(lump.place))
    for key, remark in (("translation", "m"), ("rotation", "rad: roll, pitch, yaw")):
        if any(table[key]):
            draft.remarks["joints", name, key] = remark
        else:
            del table[key]
    draft.put("joints", name, table, _limits(joint))


def rounded_place(place: Pose) -> tuple[float, ...]:
    """Translation of a composed place, rounded for the content."""
    return rounded(np.asarray(place.translation))


def _limits(joint: Joint) -> str:
    """Limits of a joint as a remark in the content: its controller keeps them."""
    unit = "rad" if joint.kind == "revolute" else "m"
    words = []
    if joint.lower is not None and joint.upper is not None:
        words.append(f"from {joint.lower:g} to {joint.upper:g} {unit}")
    if joint.speed is not None:
        words.append(f"up to {joint.speed:g} {unit}/s")
    if joint.effort is not None:
        words.append(f"up to {joint.effort:g} {effort_unit(joint)}")
    return f"Limits: {', '.join(words)}" if words else ""


def effort_unit(joint: Joint) -> str:
    """Unit in the content of the effort of a joint with one coordinate."""
    return "N m" if joint.kind == "revolute" else "N"


def _put_shafts(draft: Draft, robot: Robot) -> None:
    for shaft in robot.shafts:
        draft.joints[shaft.name] = name = draft.names.of("shaft", shaft.name)
        draft.put("transmissions", name, {"ratios": {draft.joints[one]: ratio for one, ratio in shaft.ratios.items()}})


def _put_frames(draft: Draft, robot: Robot, tree: Tree) -> None:
    """Put frames into the content as markers, and massless links at the end of what moves."""
    carries = {joint.parent for joint in robot.joints.values()}
    ends = [(link, link, Pose()) for link, inertial in robot.links.items() if inertial is None and link not in carries]
    for name, link, place in (*ends, *((frame.name, frame.link, frame.place) for frame in robot.frames)):
        carrier, own = tree.places[link]
        if carrier == WORLD or (name == carrier and name == link):
            continue
        at = own @ place
        marker = draft.names.of("frame", name)
        table: Content = {"parent": draft.bodies[carrier]}
        table |= {"translation": list(rounded_place(at)), "rotation": list(angles_of(at))}
        draft.put(
            "markers", marker, {key: value for key, value in table.items() if isinstance(value, str) or any(value)}
        )


def _put_drives(draft: Draft, robot: Robot, tree: Tree) -> None:
    """Put one drive for each driven joint into the content, and logged channels of moving joints."""
    given: Mapping[str, Joint] = {lump.joint.name: lump.joint for lump in tree.lumps.values()}
    driven = drives_of(robot, given)
    for drive in driven:
        _put_drive(draft, given, drive)
    for joint in given.values():
        for suffix in SUFFIXES[joint.kind] if joint.kind in {*SINGLE, "planar"} else ():
            name = f"{draft.joints[joint.name]}{suffix}"
            for what, channel in (("encoder", "position"), ("speed", "velocity")):
                draft.put("sensors", draft.names.made(f"{name}_{what}"), {"measures": f"{name}.{channel}"})
    for drive in driven:
        moves = draft.joints[drive.joint or drive.shaft or ""]
        sensor = draft.names.made(f"{moves}_effort")
        if sensor not in draft.content.get("sensors", {}):
            draft.put("sensors", sensor, {"measures": f"{moves}.effort"})


def _put_drive(draft: Draft, joints: Mapping[str, Joint], drive: Drive) -> None:
    at = draft.joints[drive.joint or drive.shaft or ""]
    unit = "N m" if drive.joint is None else effort_unit(joints[drive.joint])
    own = drive.unit is None
    table: Content = {"transmission" if drive.joint is None else "joint": at}
    table["gain"] = {"value": drive.gain, "unit": "1" if own else unit}
    if drive.limit is not None:
        table["limit"] = {"value": drive.limit, "unit": unit}
    table["command_unit"] = drive.unit if drive.unit is not None else unit
    draft.put("actuators", draft.names.made(drive.name), table)


def _put_effects(draft: Draft, joint: Joint, spread: Spread) -> None:
    if joint.kind not in SINGLE:
        return
    at, turns = draft.joints[joint.name], joint.kind == "revolute"
    if joint.viscous > 0.0:
        unit = "N m s/rad" if turns else "N s/m"
        draft.plain("damping", at, spread.friction(joint.viscous, unit))
    if joint.coulomb > 0.0:
        draft.plain("friction", at, spread.friction(joint.coulomb, effort_unit(joint)))
    if joint.stiffness > 0.0:
        stiffness = spread.friction(joint.stiffness, "N m/rad" if turns else "N/m")
        draft.plain("stiffness", at, stiffness, **({"rest": joint.rest} if joint.rest else {}))


def _short(value: float) -> float:
    return float(f"{value:.2g}")


def followers(tree: Tree) -> Iterator[tuple[Joint, Mimic]]:
    """Joints in the content that follow others, and how."""
    for lump in tree.lumps.values():
        if lump.joint.mimic is not None:
            yield lump.joint, lump.joint.mimic


def put_ties(draft: Draft, tree: Tree, moved_by: Mapping[str, float], frequency: float) -> Iterator[str]:
    """Put ties into the content: stiff, critically damped shafts for joints that follow; and sentences on them.

    The shaft turns by multiplier times leader - follower, which is - offset where the follower is in its place. A
    spring k and a damper d let an inertia m swing at w = sqrt(k/m), with the damping ratio d/(2 m w): 1 here
    (L. Meirovitch, "Fundamentals of Vibrations", 2001, section 2.2).

    - ``moved_by``: what each shaft moves where all coordinates are zero (kg m^2), by follower
    - ``frequency``: at which a tie swings, Hz
    """
    for joint, mimic in followers(tree):
        tie, rate = draft.joints[f"{joint.name} tie"], 2.0 * math.pi * frequency
        rest = {"rest": {"value": -mimic.offset, "unit": "rad"}} if mimic.offset else {}
        stiffness = _short(moved_by[joint.name] * rate**2)
        draft.plain("stiffness", tie, {"value": stiffness, "unit": "N m/rad"}, **rest)
        damping = _short(2.0 * moved_by[joint.name] * rate)
        draft.plain("damping", tie, {"value": damping, "unit": "N m s/rad"})
        follows = f'follows "{clean(mimic.joint)}"'
        yield f'joint "{clean(joint.name)}": it {follows} by a stiff shaft, {tie}, which swings at {frequency:g} Hz'


def put_tie_shafts(draft: Draft, tree: Tree) -> None:
    """Put shafts of the ties into the content, still without spring and damper."""
    for joint, mimic in followers(tree):
        name = draft.names.made(f"{draft.joints[joint.name]}_tie")
        draft.joints[f"{joint.name} tie"] = name
        ratios = {draft.joints[mimic.joint]: mimic.multiplier, draft.joints[joint.name]: -1.0}
        draft.put("transmissions", name, {"ratios": {one: ratio for one, ratio in ratios.items() if ratio != 0.0}})
