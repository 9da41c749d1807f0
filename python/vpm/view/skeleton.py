"""What of a machine is drawn, from what its model knows, and where all of it is along a motion."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from vpm.errors import SimulationError
from vpm.model import Model
from vpm.numbers import Array
from vpm.view.bodies import box_of, sphere_radius
from vpm.view.frames import Content, Frames
from vpm.view.scene import Arrow, Box, Shape, Sphere, Tube

#: Places along a bending link at which its centreline is asked for.
STATIONS = 33
#: Sizes of what has none in a model file, as shares of the size of the machine.
BAR, THIN, AXIS, TRIAD = 0.012, 0.005, 0.045, 0.075
#: Largest radius of the sphere of a mass, as a share of the size of the machine; then sizes of masses say nothing.
LARGEST = 0.07


@dataclass(frozen=True)
class Pose:
    """Places of all frames of a skeleton at every sample; see `Frames.poses`."""

    origins: Array
    axes: Array
    coordinates: Array
    size: float


Draw = Callable[[Pose], Iterator[Shape]]


class Skeleton:
    """The parts of a machine that are drawn."""

    def __init__(self, model: Model) -> None:
        self.frames = Frames(model)
        self._content = self.frames.content
        self._draws: list[Draw] = []
        #: Frames that a bar leads to, by the frame that it comes from.
        self._reached: dict[int, list[int]] = {}
        #: Frame at each contact, along each joint, and at the ends of each line, for the arrows of forces.
        self.contacts: dict[str, int] = {}
        self.joints: dict[str, tuple[int, Array]] = {}
        self.lines: dict[str, tuple[int, int]] = {}
        #: Joints whose effort is a torque.
        self.turning: set[str] = set()
        #: A machine is no smaller than its largest mass, were it a ball (m).
        self._least = 1e-3
        self._add_all()

    def pose(self, coordinates: Array, size: float | None = None) -> Pose:
        """Pose the skeleton along a motion, coordinates of shape (N, n); its size (m) is its largest."""
        origins, axes = self.frames.poses(coordinates)
        if size is None and not origins.shape[1]:
            raise SimulationError(
                "the machine has no bodies, so there is nothing to draw; describe them under [bodies]"
            )
        if size is None:
            spans = origins.max(axis=1) - origins.min(axis=1)
            size = max(float(np.max(np.linalg.norm(spans, axis=1))), self._least)
        return Pose(origins, axes, coordinates, size)

    def shapes(self, pose: Pose) -> tuple[Shape, ...]:
        """Shapes of all parts of the skeleton in a pose."""
        return tuple(shape for draw in self._draws for shape in draw(pose))

    def ghost(self, pose: Pose) -> tuple[Shape, ...]:
        """Links of the skeleton alone, in the look of what was measured."""
        links = [shape for shape in self.shapes(pose) if isinstance(shape, Tube) and shape.role in {"link", "beam"}]
        return tuple(Tube(shape.name, "measured", shape.path, 1.08 * shape.radius) for shape in links)

    # ---- parts -------------------------------------------------------------------------------------------------------

    def _add_all(self) -> None:
        content = self._content
        for number, body in enumerate(content["bodies"]):
            self._add_joint(number, body)
        for weld in content["welds"]:
            self._lead(weld["on"], self._home(weld), weld["translation"])
            self._add_mass(weld["name"], weld, self._home(weld))
        for number, beam in enumerate(content["beams"]):
            self._add_beam(number, beam)
        for line in content["lines"]:
            self._add_line(line)
        for contact in content["contacts"]:
            self._add_contact(contact)
        for marker in (*content["markers"], *content.get("imus", ())):
            self._add_marker(marker)
        self._draws.insert(0, self._bars)

    def _home(self, placed: Content) -> int:
        """Frame of a skeleton's part that sits at a place of another one."""
        return self.frames.add(placed["on"], placed["translation"], placed["rotation"])

    def _lead(self, on: object, to: int, translation: object) -> None:
        """Bar of the skeleton from the frame of what carries a part to the part."""
        if isinstance(on, dict) and "body" in on and np.any(np.asarray(translation)):
            self._reached.setdefault(self.frames.add(on), []).append(to)

    def _add_joint(self, number: int, body: Content) -> None:
        joint, own = body["joint"], self.frames.add({"body": number})
        home = self._home({"on": body["on"], **joint})
        direction = np.asarray(joint["axis"], dtype=np.float64)
        direction /= np.linalg.norm(direction)
        self.joints[joint["name"]] = (own, direction)
        self._lead(body["on"], home, joint["translation"])
        turns = joint["kind"] != "prismatic"
        if turns:
            self.turning.add(joint["name"])

        def draw(pose: Pose) -> Iterator[Shape]:
            centre = pose.origins[:, own]
            along = np.einsum("i,nij->nj", direction, pose.axes[:, own])
            radius, half = (0.022, AXIS) if turns else (0.012, 0.6 * AXIS)
            ends = np.stack([centre - half * pose.size * along, centre + half * pose.size * along], axis=1)
            yield Tube(joint["name"], "joint", ends, np.full(2, radius * pose.size))
            if not turns:
                yield from _rail(joint["name"], pose, home, direction, pose.coordinates[:, number])
            if body["inertia"] is not None:
                yield from _triad(joint["name"], pose, own)

        self._draws.append(draw)
        if body["inertia"] is not None:
            self._add_mass(body["name"], body, own)

    def _add_mass(self, name: str, body: Content, own: int) -> None:
        value, inertia = self.frames.value, body["inertia"]
        mass = value(inertia["mass"])
        centre = np.array([value(place) for place in inertia["center_of_mass"]])
        xx, yy, zz, xy, xz, yz = (value(place) for place in inertia["moments"])
        box = box_of(mass, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        radius = sphere_radius(mass)
        if mass <= 0.0:
            return
        self._least = max(self._least, 2.0 * radius)
        if np.any(centre):
            self._reached.setdefault(own, [])

        def draw(pose: Pose) -> Iterator[Shape]:
            middle = pose.origins[:, own] + np.einsum("i,nij->nj", centre, pose.axes[:, own])
            if not self._reached.get(own, True):
                ends = np.stack([pose.origins[:, own], middle], axis=1)
                yield Tube(name, "link", ends, np.full(2, BAR * pose.size))
            if box is not None and np.max(box[1]) <= pose.size:
                sides = np.einsum("ij,njk->nik", box[0], pose.axes[:, own])
                yield Box(name, "inertia", middle, sides, np.maximum(box[1], 0.5 * BAR * pose.size))
            else:
                yield Sphere(name, "mass", middle, min(radius, LARGEST * pose.size))

        self._draws.append(draw)

    def _add_beam(self, number: int, beam: Content) -> None:
        if "reduced" in beam:
            self._add_solid(number, beam)
            return
        places = np.linspace(0.0, beam["length"], STATIONS)
        stations = [self.frames.add({"section": {"beam": number, "at": float(at)}}) for at in places]
        at = [section["at"] for section in beam["sections"]]
        radii = [_equal_radius(section["shape"], self.frames) for section in beam["sections"]]
        radius = np.interp(places, at, radii)
        self._lead(beam["on"], stations[0], beam["translation"])

        def draw(pose: Pose) -> Iterator[Shape]:
            yield Tube(beam["name"], "beam", pose.origins[:, stations], np.maximum(radius, THIN * pose.size))

        self._draws.append(draw)

    def _add_solid(self, number: int, solid: Content) -> None:
        """Bars of the skeleton from the root of a reduced solid to each of its interfaces."""
        root, *ends = [
            self.frames.add({"section": {"beam": number, "at": float(at)}}) for at in range(int(solid["length"]) + 1)
        ]
        self._lead(solid["on"], root, solid["translation"])

        def draw(pose: Pose) -> Iterator[Shape]:
            for end in ends:
                yield Tube(solid["name"], "beam", pose.origins[:, [root, end]], np.full(2, 2.0 * THIN * pose.size))

        self._draws.append(draw)

    def _add_line(self, line: Content) -> None:
        start, end = (self.frames.add(line[key]["on"], line[key]["point"]) for key in ("from", "to"))
        self.lines[line["name"]] = (start, end)
        for key, frame in (("from", start), ("to", end)):
            self._lead(line[key]["on"], frame, line[key]["point"])
        cylinder = any(line[key] is not None for key in ("barrel", "rod")) or self._is_hydraulic(line["name"])

        def draw(pose: Pose) -> Iterator[Shape]:
            first, last = pose.origins[:, start], pose.origins[:, end]
            if not cylinder:
                yield Tube(line["name"], "line", np.stack([first, last], axis=1), np.full(2, THIN * pose.size))
                return
            length = np.linalg.norm(last - first, axis=1, keepdims=True)
            # A barrel is a little shorter than the cylinder drawn in, so that some of the rod is always seen.
            barrel = first + 0.85 * np.min(length) * (last - first) / np.maximum(length, 1e-12)
            yield Tube(line["name"], "barrel", np.stack([first, barrel], axis=1), np.full(2, 0.021 * pose.size))
            yield Tube(line["name"], "rod", np.stack([barrel, last], axis=1), np.full(2, 0.009 * pose.size))

        self._draws.append(draw)

    def _is_hydraulic(self, line: str) -> bool:
        lines = [one["name"] for one in self._content["lines"]]
        drives = [one for one in self._content["actuators"] if "line" in one["on"]]
        return any(
            one["drive"]["type"] == "hydraulic" and one["on"]["line"] < len(lines) and lines[one["on"]["line"]] == line
            for one in drives
        )

    def _add_contact(self, contact: Content) -> None:
        frame = self.frames.add(contact["on"], contact["point"])
        self.contacts[contact["name"]] = frame
        self._lead(contact["on"], frame, contact["point"])
        point = np.asarray(contact["plane"]["point"], dtype=np.float64)
        normal = np.asarray(contact["plane"]["normal"], dtype=np.float64)

        def draw(pose: Pose) -> Iterator[Shape]:
            yield Sphere(contact["name"], "contact", pose.origins[:, frame], 0.018 * pose.size)
            yield from plane(contact["name"], "plane", point, normal, pose)

        self._draws.append(draw)

    def _add_marker(self, marker: Content) -> None:
        frame = self._home(marker)
        self._lead(marker["on"], frame, marker["translation"])

        def draw(pose: Pose) -> Iterator[Shape]:
            yield Sphere(marker["name"], "marker", pose.origins[:, frame], 0.011 * pose.size)

        self._draws.append(draw)

    def _bars(self, pose: Pose) -> Iterator[Shape]:
        names = {own: self._content["bodies"][k]["name"] for k, own in enumerate(self._bodies())}
        for start, ends in self._reached.items():
            for end in ends:
                path = pose.origins[:, [start, end]]
                if np.max(np.linalg.norm(path[:, 1] - path[:, 0], axis=1)) > BAR * pose.size:
                    yield Tube(names.get(start, "weld"), "link", path, np.full(2, BAR * pose.size))

    def _bodies(self) -> list[int]:
        return [self.frames.add({"body": k}) for k in range(len(self._content["bodies"]))]


def _equal_radius(shape: Content, frames: Frames) -> float:
    """Radius (m) of a skeleton's round bar with the area of a section; of a tube its outer one."""
    if shape["shape"] == "stiffness":
        # A bar that resists bending as it resists extension: EJ / EA = r^2 / 4.
        bending = min(frames.value(shape[key]) for key in ("bending_x", "bending_y"))
        return float(2.0 * np.sqrt(bending / frames.value(shape["extension"])))
    if shape["shape"] == "layers":
        height = sum(frames.value(layer["thickness"]) for layer in shape["layers"])
        return float(np.sqrt(frames.value(shape["width"]) * height / np.pi))
    size = {key: frames.value(place) for key, place in shape.items() if key != "shape"}
    match shape["shape"]:
        case "circle":
            return 0.5 * size["diameter"]
        case "tube":
            return 0.5 * size["outer"]
        case "given":
            return float(np.sqrt(size["area"] / np.pi))
    return float(np.sqrt(size["width"] * size["height"] / np.pi))


def _rail(name: str, pose: Pose, home: int, direction: Array, place: Array) -> Iterator[Shape]:
    """Rail of a slider in the skeleton, from its zero to where it went."""
    low, high = min(0.0, float(np.min(place))), max(0.0, float(np.max(place)))
    along = np.einsum("i,nij->nj", direction, pose.axes[:, home])[:, None, :]
    ends = np.array([low - 2.0 * AXIS * pose.size, high + 2.0 * AXIS * pose.size])[None, :, None]
    yield Tube(name, "rail", pose.origins[:, home, None, :] + ends * along, np.full(2, 0.006 * pose.size))


def _triad(name: str, pose: Pose, frame: int) -> Iterator[Shape]:
    origin = pose.origins[:, frame]
    for axis, letter in enumerate("xyz"):
        yield Arrow(name, letter, origin, origin + TRIAD * pose.size * pose.axes[:, frame, axis], 0.0035 * pose.size)


def plane(name: str, role: str, point: Array, normal: Array, pose: Pose) -> Iterator[Shape]:
    """Plane of a skeleton's floor as lines of a net in squares of a round width."""
    normal = normal / np.linalg.norm(normal)
    first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    middle = pose.origins.reshape(-1, 3).mean(axis=0) - point
    width, count = round_down(pose.size / 6.0), 7
    shift = [width * round(float(middle @ way) / width) for way in (first, second)]
    centre = point + shift[0] * first + shift[1] * second
    reach = count * width
    for k in range(-count, count + 1):
        for way, across in ((first, second), (second, first)):
            ends = centre + k * width * across + np.array([[-reach], [reach]]) * way
            yield Tube(name, role, ends[None], np.full(2, 0.0012 * pose.size))


def round_down(value: float) -> float:
    """Round width for the skeleton's floor: the next 1, 2 or 5 times a power of ten below."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-9)))
