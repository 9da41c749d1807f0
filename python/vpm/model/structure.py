"""How the components of a model hang together: tree of bodies and beams, coordinates, sites, channels."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from vpm.catalogue import JointKind, SiteKind
from vpm.model.joint import ANGULAR, EFFORT_UNIT, TURNING, Coordinate, Direction, Joint, X, Y, Z, plane, unit
from vpm.model.outputs import channels_of, outputs_of, unit_of
from vpm.model.pose import Frame, Mount, Pose, pose
from vpm.model.schema import Document
from vpm.model.splitting import bendings, deflections, flexed, name_behind, name_of_bending
from vpm.model.tree import WORLD


@dataclass(frozen=True)
class Axis:
    """A joint of the core; axis k moves body k of the core."""

    coordinate: Coordinate
    frame: Frame  #: Its frame at coordinate zero.
    joint: str  #: Joint of the file that it is a part of.
    body: str | None  #: Body of the file that it carries; None for a massless carrier.
    added: bool = False  #: Whether an effect has split it off the joint of the file.

    @property
    def name(self) -> str:
        """Name of the joint of an axis in the structure."""
        return self.coordinate.name

    @property
    def turns(self) -> bool:
        """Whether an axis in the structure turns and does nothing else."""
        return self.coordinate.kind == "revolute"

    @property
    def carrier(self) -> str:
        """Name of an axis' body in the structure; it has a dot, so no body of a file is called like one."""
        return self.body or f"{self.name}.carrier"


@dataclass(frozen=True)
class Structure:
    """Components in the order of the core."""

    axes: tuple[Axis, ...]  #: Joints with one coordinate each.
    bodies: tuple[str, ...]  #: Bodies of the file, parents before children.
    beams: tuple[str, ...]  #: Parents before children.
    frames: Mapping[str, Frame]  #: Where the frames of bodies and the root frames of beams are.
    document: Document

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Joints of the structure with one coordinate each; joint k is coordinate k."""
        return tuple(axis.name for axis in self.axes)

    @cached_property
    def added(self) -> tuple[str, ...]:
        """Joints of the structure that effects have split off; they have neither actuator nor sensor."""
        return tuple(axis.name for axis in self.axes if axis.added)

    @cached_property
    def turned(self) -> Mapping[str, str]:
        """Bodies of the structure that the last coordinate of their joint turns, with its name."""
        own = {axis.joint: axis for axis in self.axes if not axis.added}
        joints = ((joint.child, own[name]) for name, joint in self.document.joints.items() if name in own)
        return {body: axis.name for body, axis in joints if axis.coordinate.kind == "revolute"}

    @cached_property
    def deflections(self) -> Mapping[str, str]:
        """Positions of joints that effects would split off the structure, each with its joint.

        A log may hold one, from a strain gauge or a second encoder; the machine as it is takes it for zero.
        """
        bent = {name_of_bending(body): joint for body, joint in self.turned.items()}
        wound = {name_behind(joint): joint for joint in self.sites("joint")}
        return {f"{name}.position": joint for name, joint in (bent | wound).items() if name not in self.joints}

    @cached_property
    def horizontal(self) -> tuple[Direction, Direction]:
        """World axes about which the structure's gravity can be tilted; it must not be zero."""
        x, y, z = self.document.gravity
        return plane(unit((-x, -y, -z)))

    @cached_property
    def welds(self) -> tuple[str, ...]:
        """Bodies of the structure whose inertia is fixed to something else, at a constant place."""
        carried = {axis.body for axis in self.axes}
        return tuple(body for body in self.bodies if body not in carried)

    @cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Coordinates of the structure: those of the joints, then ``beam.component.number``."""
        beams = ((name, self.document.beams[name]) for name in self.beams)
        elastic = [f"{name}.{own}" for name, beam in beams for own in beam.detail.coordinates(beam.deforms)]
        return (*self.joints, *elastic)

    def with_document(self, document: Document) -> Structure:
        """The structure of a document that has other effects, none of which reshapes the machine."""
        other = replace(self, document=flexed(document))
        other.__dict__.update((name, answer) for name, answer in self.__dict__.items() if name not in other.__dict__)
        return other

    def mounted(self, parent: str, at: float | None, placed: Pose) -> Frame:
        """Frame of the structure that is fixed to a body, a beam or the world."""
        return _mounted(parent, at, placed, self.frames, self.beams, self.document)

    def sites(self, kind: SiteKind) -> tuple[str, ...]:
        """Components of the structure at which an effect of this kind can sit."""
        sites: dict[SiteKind, tuple[str, ...]] = {
            "joint": tuple(axis.name for axis in self.axes if not axis.added),
            "body": (*self.bodies, *self.beams),
            "link": (*self.turned, *(name for name in self.beams if self._bends(name))),
            "beam": self.beams,
            "world": (WORLD,) if any(self.document.gravity) else (),
            "actuator": tuple(self.document.actuators),
            "cylinder": self.driven_by("hydraulic"),
            "supply": tuple(self.document.supplies),
            "sensor": tuple(self.document.sensors),
        }
        return sites[kind]

    def joint_kind(self, joint: str) -> JointKind:
        """Kind of a joint of the structure with one coordinate."""
        return self._kinds[joint]

    @cached_property
    def _kinds(self) -> Mapping[str, JointKind]:
        return {axis.name: axis.coordinate.kind for axis in self.axes}

    def kind_at(self, kind: SiteKind, site: str) -> JointKind | None:
        """Kind of the joint in the structure that a site belongs to, or None."""
        if kind == "joint" and site in self.document.transmissions:
            return TURNING
        if kind in {"actuator", "cylinder"}:
            return self.driven_kind(site) or "prismatic"  # the length of a line
        joint = self.joint_at(kind, site)
        return None if joint is None else self.joint_kind(joint)

    def driven_kind(self, actuator: str) -> JointKind | None:
        """Kind of the joint in the structure that an actuator drives; None for one on a line."""
        entry = self.document.actuators[actuator]
        if entry.transmission is not None:
            return TURNING
        return None if entry.joint is None else self.joint_kind(entry.joint)

    def joint_at(self, kind: SiteKind, site: str) -> str | None:
        """Joint of the structure that a site belongs to, or None."""
        if kind == "joint":
            return site if site in self.joints else None
        if kind == "body":
            return next((self.joints[number] for number in self.way(self.frames[site].mount)), None)
        if kind in {"link", "beam", "world"}:
            return None
        if kind in {"actuator", "cylinder"}:
            return self.document.actuators[site].joint
        if kind == "supply":
            return None
        owner = self.document.sensors[site].measures.partition(".")[0]
        return owner if owner in self.joints else None

    def _bends(self, beam: str) -> bool:
        link = self.document.beams[beam]
        return link.solid is None and any(component.startswith("bending") for component in link.deforms)

    def way(self, mount: Mount) -> Iterator[int]:
        """Joints of the structure on the way from a mount to the world, by their numbers."""
        while mount.kind != "world":
            if mount.kind == "section":
                mount = self.frames[self.beams[mount.index]].mount
            else:
                yield mount.index
                mount = self.axes[mount.index].frame.mount

    @cached_property
    def balls(self) -> Mapping[str, tuple[tuple[int, ...], ...]]:
        """Ball joints of the structure, with the numbers of their three angles among the coordinates.

        An angle has more than one where effects split it.
        """
        return {name: self._angles(name) for name, joint in self.document.joints.items() if joint.type in ANGULAR}

    def _angles(self, joint: str) -> tuple[tuple[int, ...], ...]:
        turning = [(k, axis) for k, axis in enumerate(self.axes) if axis.joint == joint and axis.turns]
        return tuple(tuple(k for k, axis in turning if axis.coordinate.direction == way) for way in (X, Y, Z))

    @cached_property
    def wires(self) -> tuple[str, ...]:
        """Lines, then transmissions of the structure by their numbers in the core."""
        return (*self.document.lines, *self.document.transmissions)

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Channels that a log of the structure may hold."""
        return channels_of(self)

    @cached_property
    def outputs(self) -> tuple[str, ...]:
        """Channels that a simulation of the structure gives, in the order of the core."""
        return outputs_of(self)

    def driven_by(self, kind: str) -> tuple[str, ...]:
        """Actuators of a type in the structure, in the order of the file."""
        return tuple(name for name, actuator in self.document.actuators.items() if actuator.type == kind)

    def unit(self, channel: str) -> str:
        """SI unit of a channel of the structure.

        Raises `ModelError`: the model has no such channel; the message names near ones.
        """
        if channel not in self._units:
            self._units[channel] = unit_of(channel, self)
        return self._units[channel]

    @cached_property
    def _units(self) -> dict[str, str]:
        """Units of the structure's channels that were asked for so far."""
        return {}

    @cached_property
    def known_channels(self) -> frozenset[str]:
        """Set of channels that a log of the structure may hold."""
        return frozenset(self.channels)

    def effort_unit(self, actuator: str) -> str:
        """SI unit of an actuator's effort in the structure."""
        kind = self.driven_kind(actuator)
        return "N" if kind is None else EFFORT_UNIT[kind]


def build_structure(document: Document) -> Structure:
    """Build the structure: the tree, parents first, else in the order of the file."""
    document = flexed(document)
    axes: list[Axis] = []
    bodies: list[str] = []
    beams: list[str] = []
    frames: dict[str, Frame] = {}
    for name in _sorted(document):
        if name in document.beams:
            beam = document.beams[name]
            placed = pose(beam.translation, beam.rotation)
            frames[name] = _mounted(beam.parent, beam.at, placed, frames, tuple(beams), document)
            beams.append(name)
        else:
            joint = document.joints[name]
            before, after = joint.poses()
            start = _mounted(joint.parent, joint.at, before, frames, tuple(beams), document)
            parts = _parts(name, joint, document)
            found = list(_chain(name, joint, parts, start, len(axes), carries=after == Pose()))
            end = Frame(Mount("body", len(axes) + len(found) - 1), Pose()) if found else start
            axes.extend(found)
            frames[joint.child] = Frame(end.mount, end.pose @ after)
            bodies.append(joint.child)
    return Structure(tuple(axes), tuple(bodies), tuple(beams), frames, document)


def _sorted(document: Document) -> Iterator[str]:
    """Joints and beams of the structure, each after what it hangs on."""
    hangs: dict[str, tuple[str, str]] = {name: (joint.parent, joint.child) for name, joint in document.joints.items()}
    hangs |= {name: (beam.parent, name) for name, beam in document.beams.items()}
    placed = {WORLD}
    while hangs:
        ready = next(name for name, (parent, _) in hangs.items() if parent in placed)
        placed.add(hangs.pop(ready)[1])
        yield ready


def _parts(name: str, joint: Joint, document: Document) -> list[tuple[Coordinate, bool]]:
    """Coordinates of a joint in the structure, with those that effects split off."""
    split, bent = deflections(document), bendings(document)
    parts: list[tuple[Coordinate, bool]] = []
    for part in joint.coordinates(name):
        parts.append((part, False))
        if part.name in split:
            parts.append((replace(part, name=split[part.name]), True))
    if parts and joint.child in bent:
        parts.append((Coordinate(bent[joint.child], "revolute", parts[-1][0].direction), True))
    return parts


def _chain(
    name: str, joint: Joint, parts: list[tuple[Coordinate, bool]], start: Frame, first: int, *, carries: bool
) -> Iterator[Axis]:
    """Axes of a joint in the structure; the last one carries the child."""
    for i, (part, added) in enumerate(parts):
        frame = start if i == 0 else Frame(Mount("body", first + i - 1), Pose())
        yield Axis(part, frame, name, joint.child if carries and i == len(parts) - 1 else None, added)


def _mounted(
    parent: str,
    at: float | None,
    placed: Pose,
    frames: Mapping[str, Frame],
    beams: tuple[str, ...],
    document: Document,
) -> Frame:
    if parent == WORLD:
        return Frame(Mount(), placed)
    if parent in document.beams:
        length = document.beams[parent].reach
        return Frame(Mount("section", beams.index(parent), length if at is None else min(at, length)), placed)
    under = frames[parent]
    return Frame(under.mount, under.pose @ placed)
