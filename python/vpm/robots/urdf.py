"""URDF: elements of the file as the parts of a robot.

Frames: wiki.ros.org/urdf/XML. The frame of a link is that of the joint that carries it, as in vpm. Inertias are about
the centre of mass, in axes of the frame that ``origin`` of ``inertial`` gives; ``ixy`` is an entry of the matrix.
"""

import math
from collections import Counter
from collections.abc import Iterator

import numpy as np

from vpm.model.body import INERTIA_TOLERANCE
from vpm.model.joint import JointType
from vpm.model.pose import pose
from vpm.robots.markup import Element, Markup, clean
from vpm.robots.parts import ORIGIN, SINGLE, Inertial, Joint, Mimic, Robot, Vector, moved
from vpm.robots.transmissions import read_transmissions

KINDS: dict[str, JointType] = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "planar": "planar",
    "floating": "free",
    "ball": "spherical",
    "spherical": "spherical",
    "fixed": "fixed",
}
_DRAWN = {"visual", "collision"}
_READ = {"link", "joint", "transmission"}
_READ_OF_LINK = {"inertial", *_DRAWN}
_READ_OF_JOINT = {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic"}


def read_urdf(markup: Markup) -> Robot:
    """Parts of a robot of a URDF."""
    root = markup.root
    robot = Robot(clean(root.attributes.get("name", "").strip()) or "robot", markup.path)
    for link in root.all("link"):
        name = markup.text(link, "name", "the robot")
        if name in robot.links:
            markup.fail(link, f'there are two links "{clean(name)}"; rename one')
        robot.links[name] = _inertial(markup, link, f'link "{clean(name)}"', robot.notes)
    for element in root.all("joint"):
        joint = _joint(markup, element, robot)
        if joint.name in robot.joints:
            markup.fail(element, f'there are two joints "{clean(joint.name)}"; rename one')
        robot.joints[joint.name] = joint
    _check_mimics(markup, robot)
    read_transmissions(markup, robot)
    robot.notes += _left_out(root)
    return robot


def _inertial(markup: Markup, link: Element, whose: str, notes: list[str]) -> Inertial | None:
    """Mass and inertia of a link of a URDF, in its axes; None where it has no mass."""
    if (element := link.first("inertial")) is None:
        return None
    mass = markup.need(element, "mass", whose)
    value = markup.number(mass, "value", None, whose)
    if value < 0.0:
        markup.fail(mass, f"{whose} has the mass {value:g} kg, but none can be negative; correct it")
    translation, angles = origin_of(markup, element, whose)
    inertia = inertia_of(markup, element, whose)
    if value == 0.0:
        if any(inertia):
            notes.append(f"{whose}: its inertia is left out, because its mass is 0")
        return None
    if not any(inertia):
        notes.append(f"{whose}: it has no inertia, so its mass is a point")
    return moved(Inertial(value, ORIGIN, inertia), pose(translation, angles))


def origin_of(markup: Markup, element: Element, whose: str) -> tuple[Vector, Vector]:
    """Origin in URDF: translation (m) and roll, pitch, yaw (rad) of an element; zero by default."""
    if (origin := element.first("origin")) is None:
        return ORIGIN, ORIGIN
    return markup.numbers(origin, "xyz", 3, 0.0, whose), markup.numbers(origin, "rpy", 3, 0.0, whose)


def inertia_of(markup: Markup, element: Element, whose: str) -> Vector:
    """Inertia xx yy zz xy xz yz in URDF of a possible body."""
    if (inertia := element.first("inertia")) is None:
        return (0.0,) * 6
    diagonal = [markup.number(inertia, key, None, whose) for key in ("ixx", "iyy", "izz")]
    values = (*diagonal, *(markup.number(inertia, key, 0.0, whose) for key in ("ixy", "ixz", "iyz")))
    moments = np.linalg.eigvalsh(Inertial(1.0, ORIGIN, values).matrix)
    slack = INERTIA_TOLERANCE * float(np.abs(moments).max())
    if moments[0] < -slack or moments[0] + moments[1] < moments[2] - slack:
        shown = ", ".join(f"{moment:.4g}" for moment in moments)
        rest = "but none can be negative, nor the largest exceed the sum of the others; correct them"
        markup.fail(inertia, f"{whose} has the principal moments {shown} kg m^2, {rest}")
    return values


def _joint(markup: Markup, element: Element, robot: Robot) -> Joint:
    name = markup.text(element, "name", "the robot")
    whose = f'joint "{clean(name)}"'
    kind = KINDS.get(markup.text(element, "type", whose))
    if kind is None:
        markup.fail(
            element, f'{whose} has type="{clean(element.attributes["type"])}"; the types are {", ".join(KINDS)}'
        )
    ends = []
    for tag in ("parent", "child"):
        if (end := element.first(tag)) is None:
            markup.fail(element, f'{whose} has no <{tag}>; add <{tag} link="..."/>')
        link = markup.text(end, "link", whose)
        if link not in robot.links:
            markup.fail(
                end, f'{whose} has the {tag} "{clean(link)}", which is no link of the robot; add it, or correct it'
            )
        ends.append(link)
    translation, angles = origin_of(markup, element, whose)
    axis = _axis(markup, element, whose) if kind in {*SINGLE, "planar"} else None
    viscous, coulomb, rotor = _dynamics(markup, element, whose, kind, robot.notes)
    limits = _limits(markup, element, whose, kind)
    return Joint(
        *(name, kind, ends[0], ends[1], translation, angles, axis, *limits, viscous, coulomb, rotor),
        mimic=_mimic(markup, element, whose, kind),
    )


def _axis(markup: Markup, element: Element, whose: str) -> Vector:
    if (axis := element.first("axis")) is None:
        return (1.0, 0.0, 0.0)
    values = markup.numbers(axis, "xyz", 3, None, whose)
    length = math.hypot(*values)
    if length == 0.0:
        markup.fail(axis, f"{whose} has an axis of length 0; give it a direction")
    return values if abs(length - 1.0) < 1e-15 else tuple(value / length for value in values)


def _dynamics(
    markup: Markup, element: Element, whose: str, kind: JointType, notes: list[str]
) -> tuple[float, float, float]:
    """Damping, friction and, as some programs write it, armature of a URDF joint."""
    if (dynamics := element.first("dynamics")) is None:
        return 0.0, 0.0, 0.0
    values = tuple(markup.number(dynamics, key, 0.0, whose) for key in ("damping", "friction", "armature"))
    for key, value in zip(("damping", "friction", "armature"), values, strict=True):
        if value < 0.0:
            markup.fail(dynamics, f"{whose} has {key}={value:g}, but it cannot be negative; correct it")
    if kind not in SINGLE:
        if any(values):
            notes.append(f"{whose}: damping and friction are left out, because it is no joint with one coordinate")
        return 0.0, 0.0, 0.0
    return values[0], values[1], values[2]


def _limits(
    markup: Markup, element: Element, whose: str, kind: JointType
) -> tuple[float | None, float | None, float | None, float | None]:
    """Lower, upper, effort and speed; an effort or a speed of 0 is how a URDF says that nobody knows it."""
    limit = element.first("limit")
    if limit is None or kind not in SINGLE:
        return None, None, None, None
    effort, speed = (abs(markup.number(limit, key, 0.0, whose)) or None for key in ("effort", "velocity"))
    if element.attributes["type"].strip() == "continuous" or not {"lower", "upper"} & set(limit.attributes):
        return None, None, effort, speed
    lower, upper = (markup.number(limit, key, 0.0, whose) for key in ("lower", "upper"))
    if lower > upper:
        markup.fail(limit, f"{whose} has the lower limit {lower:g} above the upper one {upper:g}; exchange them")
    return lower, upper, effort, speed


def _mimic(markup: Markup, element: Element, whose: str, kind: JointType) -> Mimic | None:
    if (mimic := element.first("mimic")) is None or kind == "fixed":
        return None
    if kind not in SINGLE:
        markup.fail(mimic, f"{whose} has a <mimic>, but only joints with one coordinate can follow; remove it")
    multiplier, offset = (
        markup.number(mimic, key, value, whose) for key, value in (("multiplier", 1.0), ("offset", 0.0))
    )
    return Mimic(markup.text(mimic, "joint", whose), multiplier, offset)


def _check_mimics(markup: Markup, robot: Robot) -> None:
    """Refuse URDF joints that follow an absent joint, one with several coordinates, or a circle."""
    elements = {element.attributes["name"].strip(): element for element in markup.root.all("joint")}
    for name, joint in robot.joints.items():
        passed, mimic = {name}, joint.mimic
        while mimic is not None:
            whose = f'joint "{clean(name)}" follows "{clean(mimic.joint)}"'
            leader = robot.joints.get(mimic.joint)
            if leader is None or leader.kind not in SINGLE:
                markup.fail(elements[name], f"{whose}, which is no joint with one coordinate; correct its <mimic>")
            if leader.name in passed:
                markup.fail(elements[name], f"{whose}, which leads back to itself; remove a <mimic>")
            passed.add(leader.name)
            mimic = leader.mimic


def _left_out(root: Element) -> Iterator[str]:
    """Notes on elements of a URDF that are not imported, counted, one for each kind."""
    drawn = Counter(child.tag for link in root.all("link") for child in link.children if child.tag in _DRAWN)
    if drawn:
        counted = " and ".join(f"{drawn[tag]} {tag}" for tag in ("visual", "collision") if drawn[tag])
        yield f"shapes are left out ({counted}): they move nothing"
    others = Counter(child.tag for child in root.children if child.tag not in _READ)
    others.update(
        f"link/{child.tag}" for link in root.all("link") for child in link.children if child.tag not in _READ_OF_LINK
    )
    others.update(
        f"joint/{child.tag}" for one in root.all("joint") for child in one.children if child.tag not in _READ_OF_JOINT
    )
    for tag, count in others.items():
        yield f"<{clean(tag)}> is left out ({count} time{'s' if count > 1 else ''})"
