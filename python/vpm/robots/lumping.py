"""Fixed joints taken away: what hangs on them is a part of the link that moves."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from vpm.errors import ModelError
from vpm.model.pose import Pose, pose
from vpm.robots.markup import clean
from vpm.robots.parts import Inertial, Joint, Robot, moved, together

WORLD = "world"
#: More joints than this make mass matrices that no step could use.
MOST_JOINTS = 500


@dataclass(frozen=True)
class Lump:
    """A link that moves, with what is fixed to it."""

    joint: Joint  #: It carries the link.
    #: Link that moves and carries the joint, or the world; `place` is that of the joint in the frame of this one.
    parent: str
    place: Pose
    #: Links with their place in the frame of the first, which is the one that moves.
    parts: tuple[tuple[str, Pose], ...]
    inertial: Inertial | None  #: Of all of them together; None where no part has a mass.

    @property
    def kept(self) -> bool:
        """Whether a lump keeps the joint as in the file, on the frame of the named link."""
        return self.place == pose(self.joint.translation, self.joint.angles)


@dataclass(frozen=True)
class Tree:
    """Moving links of a robot, each with what is fixed to it, parents before children."""

    root: str  #: Link that stands.
    lumps: dict[str, Lump]  #: By the link that moves.
    places: dict[str, tuple[str, Pose]]  #: Link that moves, or the world, and place in its frame, of every link.


def gather(robot: Robot) -> Tree:
    """Lumps of moving links, with what is fixed to them.

    Raises `ModelError`: the links are no tree, or nothing moves.
    """
    root, order = _ordered(robot)
    places: dict[str, tuple[str, Pose]] = {root: (WORLD, Pose())}
    parts: dict[str, list[tuple[str, Pose]]] = {WORLD: [(root, Pose())]}
    hung: dict[str, tuple[Joint, str, Pose]] = {}
    for joint in order:
        carrier, place = places[joint.parent]
        own = place @ pose(joint.translation, joint.angles)
        if joint.kind == "fixed":
            places[joint.child] = carrier, own
            parts[carrier].append((joint.child, own))
        else:
            places[joint.child] = joint.child, Pose()
            parts[joint.child] = [(joint.child, Pose())]
            hung[joint.child] = joint, carrier, own
    if not hung:
        raise ModelError(
            f"{robot.path}: nothing moves, because every joint is fixed; it is no machine", path=robot.path
        )
    if len(hung) > MOST_JOINTS:
        rest = f"{len(hung)} joints move, and a model has at most {MOST_JOINTS}; divide the robot"
        raise ModelError(f"{robot.path}: {rest}", path=robot.path)
    lumps = {}
    for link, (joint, parent, place) in hung.items():
        heavy = [moved(mass, at) for name, at in parts[link] if (mass := robot.links[name]) is not None]
        lumps[link] = Lump(joint, parent, place, tuple(parts[link]), together(heavy) if heavy else None)
    _check_masses(robot, lumps)
    return Tree(root, lumps, places)


def _ordered(robot: Robot) -> tuple[str, list[Joint]]:
    """Root link for lumping, and joints with parents before children."""
    if not robot.links:
        raise ModelError(f"{robot.path}: there is no link; add one", path=robot.path)
    carried: dict[str, Joint] = {}
    below: dict[str, list[Joint]] = {}
    for joint in robot.joints.values():
        if (other := carried.get(joint.child)) is not None:
            who = f'"{clean(other.name)}" and "{clean(joint.name)}"'
            rest = f'link "{clean(joint.child)}" is the child of the joints {who}, but a link has one; remove one'
            raise ModelError(f"{robot.path}: {rest}", path=robot.path)
        carried[joint.child] = joint
        below.setdefault(joint.parent, []).append(joint)
    roots = [link for link in robot.links if link not in carried]
    if len(roots) > 1:
        shown = ", ".join(f'"{clean(link)}"' for link in roots[:3]) + (", ..." if len(roots) > 3 else "")
        rest = f"{len(roots)} links hang on no joint ({shown}), but a robot has one root; join them by joints"
        raise ModelError(f"{robot.path}: {rest}", path=robot.path)
    order: list[Joint] = []
    left = list(roots)
    while left:
        joints = below.get(left.pop(), [])
        order += joints
        left += [joint.child for joint in reversed(joints)]
    if len(order) < len(robot.joints):
        reached = {joint.name for joint in order}
        lost = next(joint for name, joint in robot.joints.items() if name not in reached)
        rest = f'joint "{clean(lost.name)}" is in a loop of links that never reaches a root; cut the loop'
        raise ModelError(f"{robot.path}: {rest}", path=robot.path)
    return roots[0], order


def _check_masses(robot: Robot, lumps: Mapping[str, Lump]) -> None:
    """Refuse lumps whose joint moves no mass."""
    heavy: set[str] = set()
    for link, lump in lumps.items():
        if lump.inertial is not None:
            heavy |= {link, *_up(lumps, lump)}
    for link, lump in lumps.items():
        if link not in heavy and lump.joint.rotor == 0.0:
            rest = f'joint "{clean(lump.joint.name)}" moves no mass; give link "{clean(link)}" an <inertial>'
            raise ModelError(f"{robot.path}: {rest}", path=robot.path)


def _up(lumps: Mapping[str, Lump], lump: Lump) -> Iterator[str]:
    """Links that carry a lump, from its parent on to the one that stands on the world."""
    while lump.parent != WORLD:
        yield lump.parent
        lump = lumps[lump.parent]
