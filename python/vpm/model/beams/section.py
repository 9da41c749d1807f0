"""Cross-sections of flexible links: shapes of one material, layers, or stiffness that was given."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from vpm.model.component import Described
from vpm.model.entry import ZERO, Entry, Number, ParameterValue, Quantity
from vpm.model.parameters import ABOVE_ZERO, NOT_NEGATIVE, TINY, Range, Rule, rules_of

#: Above -1 and not above 0.5, or straining an isotropic solid would set energy free.
_POISSON: Range = (-0.999, 0.5)

#: Keys that lead to a value inside of a table.
Way = tuple[str | int, ...]
#: Parameters and their rules, by the way to each.
Numbers = dict[Way, tuple[Quantity, Rule]]

Length = Annotated[ParameterValue, Rule("m", ABOVE_ZERO)]
#: Second moments of thin ones are below the least length, 1e-12 m^4 and less.
Area = Annotated[ParameterValue, Rule("m^2", TINY)]
SecondMoment = Annotated[ParameterValue, Rule("m^4", TINY)]
Share = Annotated[ParameterValue, Rule("1", ABOVE_ZERO)]
Bending = Annotated[ParameterValue, Rule("N m^2", ABOVE_ZERO)]


class Material(Entry):
    """Isotropic linear elastic material: Young's modulus, Poisson's ratio, density."""

    young: Annotated[ParameterValue, Rule("Pa", ABOVE_ZERO)]
    poisson: Annotated[ParameterValue, Rule("1", _POISSON)] = Quantity(value=0.3)
    density: Annotated[ParameterValue, Rule("kg/m^3", ABOVE_ZERO)]

    def numbers(self, way: Way) -> Numbers:
        """Parameters of a section's material and their rules, by the way to each; `way` leads to the material."""
        return {(*way, key): (getattr(self, key), rule) for key, rule in rules_of(type(self)).items()}


class _Section(Entry):
    """Sizes of a cross-section; `at` is the arc length it stands at, where there are several."""

    #: Whether its stiffness follows from a shape and one material, which is that of the beam if it names none.
    solid: ClassVar[bool] = True
    #: Sizes along x and y of what has its axis in the middle.
    across: ClassVar[tuple[str, ...]] = ()
    at: Number | None = None
    material: Material | None = None

    if TYPE_CHECKING:  # each shape has the key at a place of its own

        @property
        def shape(self) -> str:
            """Kind of a cross-section."""

    @property
    def numbers(self) -> Numbers:
        """Parameters of a section and their rules, by the way to each inside of the table."""
        rules = rules_of(type(self)).items()
        sizes: Numbers = {(key,): (getattr(self, key), rule) for key, rule in rules if getattr(self, key) is not None}
        return sizes | ({} if self.material is None else self.material.numbers(("material",)))

    def misfit(self, sizes: Mapping[str, float]) -> str | None:  # noqa: ARG002
        """Sizes of a section that do not fit into each other, in words."""
        return None

    def described(self, places: Mapping[Way, int]) -> Described:
        """What the core reads of a cross-section, with the numbers of its parameters by the way to each."""
        shape = {str(way[0]): number for way, number in places.items() if len(way) == 1}
        own = {str(way[1]): number for way, number in places.items() if way[0] == "material"}
        return {"at": self.at or 0.0, "shape": {"shape": self.shape, **shape}, **({"material": own} if own else {})}


class Rectangle(_Section):
    """Full rectangle, width along x and height along y."""

    across: ClassVar[tuple[str, ...]] = ("width", "height")
    shape: Literal["rectangle"]
    width: Length
    height: Length


class Circle(_Section):
    """Cross-section that is a full circle."""

    across: ClassVar[tuple[str, ...]] = ("diameter", "diameter")
    shape: Literal["circle"]
    diameter: Length


class Tube(_Section):
    """Round tube, by its outer and inner diameter."""

    across: ClassVar[tuple[str, ...]] = ("outer", "outer")
    shape: Literal["tube"]
    outer: Length
    inner: Length

    def misfit(self, sizes: Mapping[str, float]) -> str | None:
        """Sizes of a tube section that do not fit into each other, in words."""
        if sizes["inner"] < sizes["outer"]:
            return None
        rest = f"has inner {sizes['inner']:g} m and outer {sizes['outer']:g} m, but inner has to be below outer"
        return f"{rest}; correct them"


class IBeam(_Section):
    """Doubly symmetric I: flanges along x, the web along y."""

    across: ClassVar[tuple[str, ...]] = ("width", "height")
    shape: Literal["i"]
    width: Length
    height: Length
    flange: Length
    web: Length

    def misfit(self, sizes: Mapping[str, float]) -> str | None:
        """Sizes of an I section that do not fit into each other, in words."""
        if sizes["web"] >= sizes["width"]:
            return f"has web {sizes['web']:g} m, which is not below the width {sizes['width']:g} m; correct them"
        if 2.0 * sizes["flange"] >= sizes["height"]:
            flange, height = sizes["flange"], sizes["height"]
            return f"has two flanges of {flange:g} m, which fill the height {height:g} m; correct them"
        return None


class Given(_Section):
    """Any other shape of one material, by its numbers: area, second moments, torsion constant, shear factors."""

    shape: Literal["given"]
    area: Area
    moment_x: SecondMoment
    moment_y: SecondMoment
    torsion: SecondMoment
    shear_x: Share = Quantity(value=5 / 6)
    shear_y: Share = Quantity(value=5 / 6)


class Layer(Material):
    """One layer of a laminate."""

    thickness: Length

    def numbers(self, way: Way) -> Numbers:
        """Parameters of a section's layer and their rules, by the way to each; `way` leads to the layer."""
        own = super().numbers(way)
        return {(*way, "thickness"): own.pop((*way, "thickness")), **own}


class Layers(_Section):
    """Layers of one width, glued along y, the first one lowest; the axis is the neutral one."""

    solid: ClassVar[bool] = False
    across: ClassVar[tuple[str, ...]] = ("width", "height")
    shape: Literal["layers"]
    width: Length
    layers: Annotated[tuple[Layer, ...], Field(min_length=1, max_length=60)]

    @property
    def numbers(self) -> Numbers:
        """Parameters of a layered section and their rules, by the way to each inside of the table."""
        found = super().numbers
        for i, layer in enumerate(self.layers):
            found |= layer.numbers(("layers", i))
        return found

    def described(self, places: Mapping[Way, int]) -> Described:
        """Laminate section as the core reads it, with the numbers of its parameters by the way to each."""
        described = super().described(places)
        described["shape"]["layers"] = [
            {
                "thickness": places["layers", i, "thickness"],
                "material": {key: places["layers", i, key] for key in Material.model_fields},
            }
            for i in range(len(self.layers))
        ]
        return described


class Stiffness(_Section):
    """Stiffness and mass per length, without a shape: measured, or of a program for sections."""

    solid: ClassVar[bool] = False
    shape: Literal["stiffness"]
    bending_x: Bending
    bending_y: Bending
    torsion: Bending
    extension: Annotated[ParameterValue, Rule("N", ABOVE_ZERO)]
    shear_x: Annotated[ParameterValue | None, Rule("N", ABOVE_ZERO)] = None
    shear_y: Annotated[ParameterValue | None, Rule("N", ABOVE_ZERO)] = None
    mass: Annotated[ParameterValue, Rule("kg/m", ABOVE_ZERO)]
    inertia_x: Annotated[ParameterValue, Rule("kg m", NOT_NEGATIVE)] = ZERO
    inertia_y: Annotated[ParameterValue, Rule("kg m", NOT_NEGATIVE)] = ZERO


Section = Annotated[
    Rectangle | Circle | Tube | IBeam | Given | Layers | Stiffness,
    Field(discriminator="shape"),
]


def section_parameter(beam: str, section: Way, inside: Way) -> str:
    """Dotted name of a number of a section; that of a material of its own goes without the word."""
    return ".".join(map(str, (beam, *section, *(key for key in inside if key != "material"))))
