"""Form of the tables that have to do with flexible links: beams with their sections, gauges, markers and lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from vpm.model.entry import ONE, ORIGIN, ZERO, Entry, Number, ParameterValue, Quantity, Switch, Text, Vector
from vpm.model.level import USUAL, Component, Level, parse_level
from vpm.model.reduced import ReducedLink, link_of

#: Keys that lead to a value inside of a table.
Way = tuple[str | int, ...]


class Material(Entry):
    """Isotropic linear elastic material: Young's modulus, Poisson's ratio, density."""

    units: ClassVar[Mapping[str, str]] = {"young": "Pa", "poisson": "1", "density": "kg/m^3"}
    young: ParameterValue
    poisson: ParameterValue = Quantity(value=0.3)
    density: ParameterValue

    def numbers(self, way: Way) -> dict[Way, tuple[Quantity, str]]:
        """Parameters and their units, by the way to each; `way` leads to the material."""
        return {(*way, key): (getattr(self, key), unit) for key, unit in self.units.items()}


class _Section(Entry):
    """Sizes of a cross-section; `at` is the arc length it stands at, where there are several."""

    units: ClassVar[Mapping[str, str]]
    #: Whether its stiffness follows from a shape and one material, which is that of the beam if it names none.
    solid: ClassVar[bool] = True
    at: Number | None = None
    material: Material | None = None

    @property
    def numbers(self) -> dict[Way, tuple[Quantity, str]]:
        """Parameters and their units, by the way to each inside of the table."""
        sizes: dict[Way, tuple[Quantity, str]] = {
            (key,): (getattr(self, key), unit) for key, unit in self.units.items() if getattr(self, key) is not None
        }
        return sizes | ({} if self.material is None else self.material.numbers(("material",)))


class Rectangle(_Section):
    """Full rectangle, width along x and height along y."""

    units: ClassVar[Mapping[str, str]] = {"width": "m", "height": "m"}
    shape: Literal["rectangle"]
    width: ParameterValue
    height: ParameterValue


class Circle(_Section):
    """Full circle."""

    units: ClassVar[Mapping[str, str]] = {"diameter": "m"}
    shape: Literal["circle"]
    diameter: ParameterValue


class Tube(_Section):
    """Round tube, by its outer and inner diameter."""

    units: ClassVar[Mapping[str, str]] = {"outer": "m", "inner": "m"}
    shape: Literal["tube"]
    outer: ParameterValue
    inner: ParameterValue


class IBeam(_Section):
    """Doubly symmetric I: flanges along x, the web along y."""

    units: ClassVar[Mapping[str, str]] = {"width": "m", "height": "m", "flange": "m", "web": "m"}
    shape: Literal["i"]
    width: ParameterValue
    height: ParameterValue
    flange: ParameterValue
    web: ParameterValue


class Given(_Section):
    """Any other shape of one material, by its numbers: area, second moments, torsion constant, shear factors."""

    units: ClassVar[Mapping[str, str]] = {
        "area": "m^2",
        "moment_x": "m^4",
        "moment_y": "m^4",
        "torsion": "m^4",
        "shear_x": "1",
        "shear_y": "1",
    }
    shape: Literal["given"]
    area: ParameterValue
    moment_x: ParameterValue
    moment_y: ParameterValue
    torsion: ParameterValue
    shear_x: ParameterValue = Quantity(value=5 / 6)
    shear_y: ParameterValue = Quantity(value=5 / 6)


class Layer(Material):
    """One layer of a laminate."""

    units: ClassVar[Mapping[str, str]] = {"thickness": "m", **Material.units}
    thickness: ParameterValue


class Layers(_Section):
    """Layers of one width, glued along y, the first one lowest; the axis is the neutral one."""

    units: ClassVar[Mapping[str, str]] = {"width": "m"}
    solid: ClassVar[bool] = False
    shape: Literal["layers"]
    width: ParameterValue
    layers: Annotated[tuple[Layer, ...], Field(min_length=1, max_length=60)]

    @property
    def numbers(self) -> dict[Way, tuple[Quantity, str]]:
        """Parameters and their units, by the way to each inside of the table."""
        found = super().numbers
        for i, layer in enumerate(self.layers):
            found |= layer.numbers(("layers", i))
        return found


class Stiffness(_Section):
    """Stiffness and mass per length, without a shape: measured, or of a program for sections."""

    units: ClassVar[Mapping[str, str]] = {
        "bending_x": "N m^2",
        "bending_y": "N m^2",
        "torsion": "N m^2",
        "extension": "N",
        "shear_x": "N",
        "shear_y": "N",
        "mass": "kg/m",
        "inertia_x": "kg m",
        "inertia_y": "kg m",
    }
    solid: ClassVar[bool] = False
    shape: Literal["stiffness"]
    bending_x: ParameterValue
    bending_y: ParameterValue
    torsion: ParameterValue
    extension: ParameterValue
    shear_x: ParameterValue | None = None
    shear_y: ParameterValue | None = None
    mass: ParameterValue
    inertia_x: ParameterValue = ZERO
    inertia_y: ParameterValue = ZERO


Section = Annotated[
    Rectangle | Circle | Tube | IBeam | Given | Layers | Stiffness,
    Field(discriminator="shape"),
]


#: All kinds of sections.
SECTION_KINDS = (Rectangle, Circle, Tube, IBeam, Given, Layers, Stiffness)


class Rest(Entry):
    """Curvature and twist (1/m) where nothing loads the beam; `at` is the arc length, where there are several."""

    at: Number | None = None
    bending_x: Number = 0.0
    bending_y: Number = 0.0
    torsion: Number = 0.0


class Damping(Entry):
    """D = stiffness K + mass M, and a ratio for each of the slowest clamped modes."""

    stiffness: ParameterValue | None = None
    mass: ParameterValue | None = None
    ratios: tuple[ParameterValue, ...] = ()


def _readable(text: str) -> str:
    parse_level(text)
    return text


def _different(components: tuple[Component, ...]) -> tuple[Component, ...]:
    twice = [component for i, component in enumerate(components) if component in components[:i]]
    if twice:
        raise ValueError(f"has {twice[0]} twice; remove one")
    return components


class Beam(Entry):
    """Flexible link, fixed to its parent at its root: a beam whose axis leaves it along z, or a reduced solid.

    Without its `velocity_terms` no products of rates load it; without `second_order` its deflection is linear in its
    coordinates.
    """

    parent: Text
    at: Number | None = None
    translation: Vector = ORIGIN
    rotation: Vector = ORIGIN
    length: Number | None = None
    level: Annotated[Text, AfterValidator(_readable)]
    deforms: Annotated[tuple[Component, ...], Field(min_length=1), AfterValidator(_different)] = USUAL
    material: Material | None = None
    section: Section | None = None
    sections: Annotated[tuple[Section, ...], Field(min_length=1)] | None = None
    reduced: Text | None = None
    stiffness_factor: ParameterValue = ONE
    mass_factor: ParameterValue = ONE
    rest: Rest | None = None
    rests: Annotated[tuple[Rest, ...], Field(min_length=1)] | None = None
    damping: Damping = Damping()
    velocity_terms: Switch = True
    second_order: Switch = True

    @property
    def is_of_one_material(self) -> bool:
        """Whether all of its sections are made of its material."""
        sections = [section for _, section in sections_of(self)]
        return self.material is not None and all(one.solid and one.material is None for one in sections)

    @property
    def curvature(self) -> tuple[Rest, ...]:
        """Shape at rest: nothing if it is straight, one entry if its curvature is constant."""
        return (self.rests or ()) if self.rest is None else (self.rest,)

    @property
    def detail(self) -> Level:
        """Level of detail."""
        return parse_level(self.level)

    @property
    def solid(self) -> ReducedLink | None:
        """The reduced solid that it is, if it is one."""
        return None if self.reduced is None else link_of(self.reduced)

    @property
    def reach(self) -> float:
        """Its last place: the length (m), or the number of interfaces of a reduced solid."""
        return (self.length or 0.0) if self.solid is None else float(len(self.solid.interfaces))


def sections_of(beam: Beam) -> list[tuple[tuple[str | int, ...], Section]]:
    """Sections with their keys: ``section`` of a uniform beam, else ``section.0``, ``section.1`` and so on."""
    if beam.section is not None:
        return [(("section",), beam.section)]
    return [(("section", i), section) for i, section in enumerate(beam.sections or ())]


def section_parameter(beam: str, section: Way, inside: Way) -> str:
    """Dotted name of a number of a section; that of a material of its own goes without the word."""
    return ".".join(map(str, (beam, *section, *(key for key in inside if key != "material"))))


class Gauge(Entry):
    """Axial strain of a beam at the point (x, y) of its section at the arc length `at`."""

    beam: Text
    at: Number
    x: Number = 0.0
    y: Number = 0.0


class Marker(Entry):
    """Frame to watch."""

    parent: Text
    at: Number | None = None
    translation: Vector = ORIGIN
    rotation: Vector = ORIGIN


class End(Entry):
    """End of a line: a point of a body, of a beam, or of the world."""

    parent: Text
    at: Number | None = None
    point: Vector = ORIGIN


class Part(Entry):
    """Half of a line with mass; `center` counts from the own end toward the other one."""

    mass: ParameterValue
    center: ParameterValue = ZERO
    inertia: ParameterValue = ZERO


class Line(Entry):
    """Straight connection between two points that a drive can push apart: a cylinder, a screw, a rope."""

    start: End = Field(alias="from")
    end: End = Field(alias="to")
    barrel: Part | None = None
    rod: Part | None = None
