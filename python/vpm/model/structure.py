"""How the components of a model hang together: tree of bodies and beams, coordinates, channels and their units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from vpm.catalogue import JointKind, SiteKind
from vpm.errors import ModelError, near_match
from vpm.model.expand import ANGULAR, Coordinate, Direction, X, Y, Z, coordinates, plane, unit
from vpm.model.pose import Pose, denavit_hartenberg, pose
from vpm.model.schema import Document, Joint
from vpm.model.splitting import bendings, deflections, flexed, name_behind
from vpm.model.transmission import TURNING
from vpm.model.tree import WORLD
from vpm.units import si_unit

JOINT_CHANNELS = ("position", "velocity", "acceleration", "effort")
ACTUATOR_OUTPUTS = ("command", "force")
ACTUATOR_CHANNELS = (*ACTUATOR_OUTPUTS, "reference", "disturbance")
HYDRAULIC_CHANNELS: tuple[str, ...] = ("spool", "pressure_a", "pressure_b", "flow_a", "flow_b")
MOTOR_CHANNELS = ("current",)
SUPPLY_CHANNELS: tuple[str, ...] = ("pressure", "flow")
DRIVE_UNITS: Mapping[str, str] = {
    "pressure_a": "Pa",
    "pressure_b": "Pa",
    "flow_a": "m^3/s",
    "flow_b": "m^3/s",
    "current": "A",
    "pressure": "Pa",
    "flow": "m^3/s",
}
LINE_UNITS: Mapping[str, str] = {"length": "m", "rate": "m/s", "tension": "N"}
#: The core calls them length, rate and tension: a transmission is a line whose levers do not change.
SHAFT_UNITS: Mapping[str, str] = {"position": "rad", "velocity": "rad/s", "effort": "N m"}
GAUGE_UNITS: Mapping[str, str] = {"strain": "1"}
CONTACT_UNITS: Mapping[str, str] = {"depth": "m", "normal_force": "N", "fx": "N", "fy": "N", "fz": "N"}
WRENCH_UNITS: Mapping[str, str] = {"mx": "N m", "my": "N m", "mz": "N m", "fx": "N", "fy": "N", "fz": "N"}
#: Of a ball joint: unit quaternion of the child in the frame of the joint, angular velocity in axes of the child.
BALL_UNITS: Mapping[str, str] = {
    **dict.fromkeys(("qw", "qx", "qy", "qz"), "1"),
    **dict.fromkeys(("wx", "wy", "wz"), "rad/s"),
}
MARKER_UNITS: Mapping[str, str] = {"x": "m", "y": "m", "z": "m", "rx": "rad", "ry": "rad", "rz": "rad"}

COORDINATE_UNIT: Mapping[JointKind, str] = {"prismatic": "m", "revolute": "rad", "helical": "rad"}
EFFORT_UNIT: Mapping[JointKind, str] = {"prismatic": "N", "revolute": "N m", "helical": "N m"}


@dataclass(frozen=True)
class Mount:
    """What of the core something is fixed to: the world, a body, or a section of a beam.

    Attributes
    ----------
    kind : {"world", "body", "section"}
    index : int
        Of the body or the beam, in the order of the core.
    at : float
        Arc length of the section (m).
    """

    kind: Literal["world", "body", "section"] = "world"
    index: int = 0
    at: float = 0.0


@dataclass(frozen=True)
class Frame:
    """A frame that is fixed to a mount, at a constant place."""

    mount: Mount
    pose: Pose


@dataclass(frozen=True)
class Axis:
    """A joint of the core; axis k moves body k of the core.

    Attributes
    ----------
    coordinate : Coordinate
    frame : Frame
        Its frame at coordinate zero.
    joint : str
        Joint of the file that it is a part of.
    body : str or None
        Body of the file that it carries; None for a massless carrier.
    added : bool
        Whether an effect has split it off the joint of the file.
    """

    coordinate: Coordinate
    frame: Frame
    joint: str
    body: str | None
    added: bool = False

    @property
    def name(self) -> str:
        """Name of the joint."""
        return self.coordinate.name

    @property
    def turns(self) -> bool:
        """Whether it turns and does nothing else."""
        return self.coordinate.kind == "revolute"

    @property
    def carrier(self) -> str:
        """Name of the body of the core; carriers have a dot, so no body of a file is called like one."""
        return self.body or f"{self.name}.carrier"


@dataclass(frozen=True)
class Structure:
    """Components in the order of the core.

    Attributes
    ----------
    axes : tuple of Axis
        Joints with one coordinate each.
    bodies : tuple of str
        Bodies of the file, parents before children.
    beams : tuple of str
        Parents before children.
    frames : mapping of str to Frame
        Where the frames of bodies and the root frames of beams are.
    document : Document
    """

    axes: tuple[Axis, ...]
    bodies: tuple[str, ...]
    beams: tuple[str, ...]
    frames: Mapping[str, Frame]
    document: Document

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Joints with one coordinate each; joint k is coordinate k."""
        return tuple(axis.name for axis in self.axes)

    @cached_property
    def added(self) -> tuple[str, ...]:
        """Joints that effects have split off; they have neither actuator nor sensor."""
        return tuple(axis.name for axis in self.axes if axis.added)

    @cached_property
    def turned(self) -> Mapping[str, str]:
        """Bodies that the last coordinate of their joint turns, with the name of that."""
        own = {axis.joint: axis for axis in self.axes if not axis.added}
        joints = ((joint.child, own[name]) for name, joint in self.document.joints.items() if name in own)
        return {body: axis.name for body, axis in joints if axis.coordinate.kind == "revolute"}

    @cached_property
    def deflections(self) -> Mapping[str, str]:
        """Positions of joints that effects would split off, each with the joint it is split from.

        A log may hold one, from a strain gauge or a second encoder; the machine as it is takes it for zero.
        """
        bent = {f"{body}_bending": joint for body, joint in self.turned.items()}
        wound = {name_behind(joint): joint for joint in self.sites("joint")}
        return {f"{name}.position": joint for name, joint in (bent | wound).items() if name not in self.joints}

    @cached_property
    def horizontal(self) -> tuple[Direction, Direction]:
        """Axes of the world about which gravity can be tilted; it must not be zero."""
        x, y, z = self.document.gravity
        return plane(unit((-x, -y, -z)))

    @cached_property
    def welds(self) -> tuple[str, ...]:
        """Bodies whose inertia is fixed to something else, at a constant place."""
        carried = {axis.body for axis in self.axes}
        return tuple(body for body in self.bodies if body not in carried)

    @cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Every coordinate: those of the joints, then ``beam.component.number`` of each beam."""
        beams = ((name, self.document.beams[name]) for name in self.beams)
        elastic = [f"{name}.{own}" for name, beam in beams for own in beam.detail.coordinates(beam.deforms)]
        return (*self.joints, *elastic)

    def with_document(self, document: Document) -> Structure:
        """The same of a document that has other effects, none of which reshapes the machine."""
        other = replace(self, document=flexed(document))
        other.__dict__.update((name, answer) for name, answer in self.__dict__.items() if name not in other.__dict__)
        return other

    def mounted(self, parent: str, at: float | None, placed: Pose) -> Frame:
        """Frame that is fixed to a body, a beam or the world."""
        return _mounted(parent, at, placed, self.frames, self.beams, self.document)

    def sites(self, kind: SiteKind) -> tuple[str, ...]:
        """Names of the components at which an effect of this kind can sit."""
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
        """Kind of a joint with one coordinate."""
        return self._kinds[joint]

    @cached_property
    def _kinds(self) -> Mapping[str, JointKind]:
        return {axis.name: axis.coordinate.kind for axis in self.axes}

    def kind_at(self, kind: SiteKind, site: str) -> JointKind | None:
        """Kind of the joint that a site belongs to, or that a transmission is like; None for what belongs to none."""
        if kind == "joint" and site in self.document.transmissions:
            return TURNING
        joint = self.joint_at(kind, site)
        return None if joint is None else self.joint_kind(joint)

    def driven_kind(self, actuator: str) -> JointKind | None:
        """Kind of the joint that an actuator acts on, or that its transmission is like; None for one on a line."""
        entry = self.document.actuators[actuator]
        if entry.transmission is not None:
            return TURNING
        return None if entry.joint is None else self.joint_kind(entry.joint)

    def joint_at(self, kind: SiteKind, site: str) -> str | None:
        """Joint that a site belongs to; None for what belongs to none, such as a sensor of an actuator's channel."""
        if kind == "joint":
            return site if site in self.joints else None
        if kind == "body":
            return self._mover(site)
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

    def _mover(self, site: str) -> str | None:
        """Last joint on the way from the world to a body or a beam."""
        mount = self.frames[site].mount
        while mount.kind == "section":
            mount = self.frames[self.beams[mount.index]].mount
        return self.joints[mount.index] if mount.kind == "body" else None

    @cached_property
    def balls(self) -> Mapping[str, tuple[tuple[int, ...], ...]]:
        """Joints that turn anyhow, with the numbers of the coordinates of their three angles.

        An angle has more than one where effects split it.
        """
        return {name: self._angles(name) for name, joint in self.document.joints.items() if joint.type in ANGULAR}

    def _angles(self, joint: str) -> tuple[tuple[int, ...], ...]:
        turning = [(k, axis) for k, axis in enumerate(self.axes) if axis.joint == joint and axis.turns]
        return tuple(tuple(k for k, axis in turning if axis.coordinate.direction == way) for way in (X, Y, Z))

    @cached_property
    def wires(self) -> tuple[str, ...]:
        """Lines, then transmissions: along what of the core forces act, by their numbers there."""
        return (*self.document.lines, *self.document.transmissions)

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Every channel that a log may hold."""
        return self._listed(ACTUATOR_CHANNELS)

    @cached_property
    def outputs(self) -> tuple[str, ...]:
        """Channels that a simulation gives, in the order of the core."""
        return self._listed(ACTUATOR_OUTPUTS)

    def _listed(self, of_actuators: tuple[str, ...]) -> tuple[str, ...]:
        document = self.document
        groups: list[tuple[tuple[str, ...], tuple[str, ...]]] = [
            (self.joints, JOINT_CHANNELS),
            (tuple(document.actuators), of_actuators),
            (tuple(document.lines), tuple(LINE_UNITS)),
            (tuple(document.transmissions), tuple(SHAFT_UNITS)),
            (tuple(document.gauges), tuple(GAUGE_UNITS)),
            (tuple(document.markers), tuple(MARKER_UNITS)),
            (self.driven_by("hydraulic"), HYDRAULIC_CHANNELS),
            (self.driven_by("dc_motor"), MOTOR_CHANNELS),
            (tuple(document.supplies), SUPPLY_CHANNELS),
            (tuple(document.contacts), tuple(CONTACT_UNITS)),
            (tuple(document.bushings), tuple(WRENCH_UNITS)),
            (tuple(document.load_cells), tuple(WRENCH_UNITS)),
            (tuple(self.balls), tuple(BALL_UNITS)),
            (tuple(document.loops), tuple(WRENCH_UNITS)),
        ]
        return tuple(f"{owner}.{channel}" for owners, channels in groups for owner in owners for channel in channels)

    def driven_by(self, kind: str) -> tuple[str, ...]:
        """Actuators of a type, in the order of the file."""
        return tuple(name for name, actuator in self.document.actuators.items() if actuator.type == kind)

    def unit(self, channel: str) -> str:
        """SI unit of a channel.

        Raises
        ------
        ModelError
            The model has no such channel; the message names near ones.
        """
        if channel not in self._units:
            self._units[channel] = self._unit(channel)
        return self._units[channel]

    @cached_property
    def _units(self) -> dict[str, str]:
        """Units that were asked for; not of all channels at once, since one may be wrong while a file is checked."""
        return {}

    @cached_property
    def _known_channels(self) -> frozenset[str]:
        return frozenset(self.channels)

    def _unit(self, channel: str) -> str:
        owner, _, name = channel.partition(".")
        if channel in self.deflections:
            return COORDINATE_UNIT[self.joint_kind(self.deflections[channel])]
        if channel not in self._known_channels:
            repair = near_match(channel, self.channels, what="its channels are")
            raise ModelError(f'the model has no channel "{channel}"; {repair}', where=channel)
        if owner in self._kinds:
            coordinate = COORDINATE_UNIT[self.joint_kind(owner)]
            units = {"position": coordinate, "velocity": f"{coordinate}/s", "acceleration": f"{coordinate}/s^2"}
            return units.get(name, EFFORT_UNIT[self.joint_kind(owner)])
        if owner in self.document.transmissions:
            return SHAFT_UNITS[name]
        if name in DRIVE_UNITS:
            return DRIVE_UNITS[name]
        if owner in self.document.actuators:
            return self._actuator_unit(owner, name)
        return {**LINE_UNITS, **GAUGE_UNITS, **MARKER_UNITS, **CONTACT_UNITS, **WRENCH_UNITS, **BALL_UNITS}[name]

    def _actuator_unit(self, actuator: str, channel: str) -> str:
        if channel == "force":
            return self.effort_unit(actuator)
        if (
            channel == "reference"
        ):  # of what the controller holds: a position of some joint or shaft, a length of some line
            pairs = [pair for controller in self.document.controllers.values() for pair in controller.pairs]
            held = [measured for commanded, measured in pairs if commanded == actuator]
            kind = self.driven_kind(actuator)
            own = "m" if kind is None else COORDINATE_UNIT[kind]
            return self.unit(held[0]) if held else own
        return si_unit(self.document.actuators[actuator].command_unit)

    def effort_unit(self, actuator: str) -> str:
        """SI unit of the effort of an actuator: what its joint or shaft takes, or a force along its line."""
        kind = self.driven_kind(actuator)
        return "N" if kind is None else EFFORT_UNIT[kind]


def build_structure(document: Document) -> Structure:
    """Order the tree, parents first, else in the order of the file; the tree has to be free of problems."""
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
            before, after = _places(joint)
            start = _mounted(joint.parent, joint.at, before, frames, tuple(beams), document)
            parts = _parts(name, joint, document)
            found = list(_chain(name, joint, parts, start, len(axes), carries=after == Pose()))
            end = Frame(Mount("body", len(axes) + len(found) - 1), Pose()) if found else start
            axes.extend(found)
            frames[joint.child] = Frame(end.mount, end.pose @ after)
            bodies.append(joint.child)
    return Structure(tuple(axes), tuple(bodies), tuple(beams), frames, document)


def _sorted(document: Document) -> Iterator[str]:
    """Names of joints and beams, each after what it hangs on."""
    hangs: dict[str, tuple[str, str]] = {name: (joint.parent, joint.child) for name, joint in document.joints.items()}
    hangs |= {name: (beam.parent, name) for name, beam in document.beams.items()}
    placed = {WORLD}
    while hangs:
        ready = next(name for name, (parent, _) in hangs.items() if parent in placed)
        placed.add(hangs.pop(ready)[1])
        yield ready


def _places(joint: Joint) -> tuple[Pose, Pose]:
    """Constant places before and after the motion of a joint."""
    return (pose(joint.translation, joint.rotation), Pose()) if joint.dh is None else denavit_hartenberg(joint.dh)


def _parts(name: str, joint: Joint, document: Document) -> list[tuple[Coordinate, bool]]:
    """Coordinates of a joint, with those that effects split off, and whether each is such a one."""
    split, bent = deflections(document), bendings(document)
    parts: list[tuple[Coordinate, bool]] = []
    for part in coordinates(name, joint):
        parts.append((part, False))
        if part.name in split:
            parts.append((replace(part, name=split[part.name]), True))
    if parts and joint.child in bent:
        parts.append((Coordinate(bent[joint.child], "revolute", parts[-1][0].direction), True))
    return parts


def _chain(
    name: str, joint: Joint, parts: list[tuple[Coordinate, bool]], start: Frame, first: int, *, carries: bool
) -> Iterator[Axis]:
    """Axes of a joint; the last one carries the child, unless that sits at a constant place away from it."""
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
