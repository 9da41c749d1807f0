"""How the components of a model hang together: names, tree of bodies, references, channels and their units."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from vpm.catalogue import JointKind, SiteKind
from vpm.errors import ModelError, near_match
from vpm.model.messages import Problem, place
from vpm.model.schema import SECTIONS, Document
from vpm.units import si_unit

WORLD = "world"
_RESERVED = {WORLD, "time"}
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")

JOINT_CHANNELS = ("position", "velocity", "acceleration", "effort")
ACTUATOR_OUTPUTS = ("command", "force")
ACTUATOR_CHANNELS = (*ACTUATOR_OUTPUTS, "reference", "disturbance")

COORDINATE_UNIT: Mapping[JointKind, str] = {"prismatic": "m", "revolute": "rad"}
EFFORT_UNIT: Mapping[JointKind, str] = {"prismatic": "N", "revolute": "N m"}


@dataclass(frozen=True)
class Structure:
    """Components in the order of the core: joint k moves body k.

    Attributes
    ----------
    joints, bodies : tuple of str
        Parents come before children.
    parents : tuple of int or None
        Index of the parent body; None is the world.
    document : Document
    """

    joints: tuple[str, ...]
    bodies: tuple[str, ...]
    parents: tuple[int | None, ...]
    document: Document

    def sites(self, kind: SiteKind) -> tuple[str, ...]:
        """Names of the components at which an effect of this kind can sit."""
        sites: dict[SiteKind, tuple[str, ...]] = {
            "joint": self.joints,
            "body": self.bodies,
            "actuator": tuple(self.document.actuators),
            "sensor": tuple(self.document.sensors),
        }
        return sites[kind]

    def joint_kind(self, joint: str) -> JointKind:
        """Kind of a joint."""
        return self.document.joints[joint].type

    def joint_at(self, kind: SiteKind, site: str) -> str | None:
        """Joint that a site belongs to; None for a sensor of an actuator's channel."""
        if kind == "joint":
            return site
        if kind == "body":
            return self.joints[self.bodies.index(site)]
        if kind == "actuator":
            return self.document.actuators[site].joint
        owner = self.document.sensors[site].measures.partition(".")[0]
        return owner if owner in self.document.joints else None

    @property
    def channels(self) -> tuple[str, ...]:
        """Every channel that a log may hold."""
        joints = [f"{joint}.{channel}" for joint in self.joints for channel in JOINT_CHANNELS]
        actuators = [f"{name}.{channel}" for name in self.document.actuators for channel in ACTUATOR_CHANNELS]
        return (*joints, *actuators)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Channels that a simulation gives, in the order of the core."""
        joints = [f"{joint}.{channel}" for joint in self.joints for channel in JOINT_CHANNELS]
        actuators = [f"{name}.{channel}" for name in self.document.actuators for channel in ACTUATOR_OUTPUTS]
        return (*joints, *actuators)

    def unit(self, channel: str) -> str:
        """SI unit of a channel.

        Raises
        ------
        ModelError
            The model has no such channel; the message names near ones.
        """
        owner, _, name = channel.partition(".")
        if channel not in self.channels:
            repair = near_match(channel, self.channels, what="its channels are")
            raise ModelError(f'the model has no channel "{channel}"; {repair}', where=channel)
        if owner in self.document.joints:
            coordinate = COORDINATE_UNIT[self.joint_kind(owner)]
            units = {"position": coordinate, "velocity": f"{coordinate}/s", "acceleration": f"{coordinate}/s^2"}
            return units.get(name, EFFORT_UNIT[self.joint_kind(owner)])
        actuator = self.document.actuators[owner]
        if name == "force":
            return EFFORT_UNIT[self.joint_kind(actuator.joint)]
        if name == "reference":  # of what the controller holds, which is a position of some joint
            held = [c.measures for c in self.document.controllers.values() if c.actuator == owner]
            return self.unit(held[0]) if held else COORDINATE_UNIT[self.joint_kind(actuator.joint)]
        return si_unit(actuator.command_unit)


def name_problems(document: Document) -> Iterator[Problem]:
    """Names that cannot be written in a dotted name, that are reserved, or that two components share."""
    owner: dict[str, str] = {}
    for section in SECTIONS:
        if section == "channels":
            continue
        for name in getattr(document, section):
            where = place(section, name)
            if not _NAME.fullmatch(name):
                yield Problem(where, "has a name that is not letters, digits, - and _ after a letter; rename it")
            elif name in _RESERVED:
                yield Problem(where, f'has the name "{name}", which is reserved; rename it')
            elif name in owner:
                yield Problem(
                    where, f"has the same name as {owner[name]}; all components share one namespace, rename one"
                )
            owner.setdefault(name, where)


def tree_problems(document: Document) -> Iterator[Problem]:
    """Joints that name unknown bodies, bodies with no joint or several, and loops."""
    owner: dict[str, str] = {}
    for name, joint in document.joints.items():
        if joint.parent != WORLD and joint.parent not in document.bodies:
            repair = near_match(joint.parent, [WORLD, *document.bodies], what="it has")
            yield Problem(
                place("joints", name, "parent"), f'is "{joint.parent}", which is no body of the model; {repair}'
            )
        if joint.child not in document.bodies:
            repair = near_match(joint.child, document.bodies, what="it has")
            yield Problem(
                place("joints", name, "child"), f'is "{joint.child}", which is no body of the model; {repair}'
            )
        elif joint.child in owner:
            rest = f'is "{joint.child}", which joint "{owner[joint.child]}" already carries; a body has one joint'
            yield Problem(place("joints", name, "child"), rest)
        owner.setdefault(joint.child, name)
    for body in document.bodies:
        if body not in owner:
            yield Problem(place("bodies", body), f'hangs on no joint; add a joint with child = "{body}", or remove it')
    yield from _loop_problems(document)


def _loop_problems(document: Document) -> Iterator[Problem]:
    parent = {joint.child: joint.parent for joint in document.joints.values()}
    settled: set[str] = set()
    for body in document.bodies:
        way = [body]
        while way[-1] in parent and way[-1] not in settled and parent[way[-1]] not in way:
            way.append(parent[way[-1]])
        if way[-1] in parent and way[-1] not in settled:  # the last body's parent is already on the way
            loop = [*way[way.index(parent[way[-1]]) :], parent[way[-1]]]
            rest = f'is in a loop that never reaches the world: {" -> ".join(loop)}; give one of them parent = "world"'
            yield Problem(place("bodies", body), rest)
        settled.update(way)


def reference_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Actuators, sensors and controllers that name what is not there, or sit where another one already does."""
    for name, actuator in document.actuators.items():
        if actuator.joint not in document.joints:
            repair = near_match(actuator.joint, document.joints, what="it has")
            yield Problem(
                place("actuators", name, "joint"), f'is "{actuator.joint}", which is no joint of the model; {repair}'
            )
    seen: dict[str, str] = {}
    for name, sensor in document.sensors.items():
        where = place("sensors", name, "measures")
        if sensor.measures not in structure.outputs:
            repair = near_match(sensor.measures, structure.outputs, what="it can measure")
            yield Problem(where, f'is "{sensor.measures}", which is no output of the model; {repair}')
        elif sensor.measures in seen:
            yield Problem(
                where, f'is "{sensor.measures}", which sensor "{seen[sensor.measures]}" already reads; remove one'
            )
        seen.setdefault(sensor.measures, name)
    yield from _controller_problems(document)


def _controller_problems(document: Document) -> Iterator[Problem]:
    seen: dict[str, str] = {}
    positions = [f"{joint}.position" for joint in document.joints]
    for name, controller in document.controllers.items():
        where = place("controllers", name, "actuator")
        if controller.actuator not in document.actuators:
            repair = near_match(controller.actuator, document.actuators, what="it has")
            yield Problem(where, f'is "{controller.actuator}", which is no actuator of the model; {repair}')
        elif controller.actuator in seen:
            other = seen[controller.actuator]
            rest = f'is "{controller.actuator}", which controller "{other}" already commands; remove one'
            yield Problem(where, rest)
        seen.setdefault(controller.actuator, name)
        if controller.measures not in positions:
            repair = near_match(controller.measures, positions, what="it can measure")
            where = place("controllers", name, "measures")
            yield Problem(where, f'is "{controller.measures}", which is no joint position of the model; {repair}')


def build_structure(document: Document) -> Structure:
    """Order the tree, parents first, else in the order of the file; the tree has to be free of problems."""
    joints: list[str] = []
    placed: dict[str, int] = {}
    waiting = dict(document.joints)
    while waiting:
        ready = next(name for name, joint in waiting.items() if joint.parent == WORLD or joint.parent in placed)
        placed[waiting.pop(ready).child] = len(joints)
        joints.append(ready)
    parents = tuple(placed.get(document.joints[name].parent) for name in joints)
    return Structure(tuple(joints), tuple(placed), parents, document)
