"""Flexible links: beams with their sections, or reduced solids; their damping, and their shape at rest."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import AfterValidator, Field

from vpm.errors import VpmError
from vpm.model.beams.level import CURVED, USUAL, Level, parse_level
from vpm.model.beams.level import Component as Deformation
from vpm.model.beams.reduced import EMBEDDED, ReducedLink, embedded, link_of, read_bytes
from vpm.model.beams.section import Layers, Material, Section, Stiffness, Way, section_parameter
from vpm.model.component import Component, Described, Index
from vpm.model.entry import ONE, ORIGIN, Entry, Number, ParameterValue, Switch, Text, Vector
from vpm.model.messages import Problem, place
from vpm.model.parameters import ABOVE_ZERO, FEEDING, NOT_NEGATIVE, Keys, Parameter, Rule, Slot, rules_of, slots_of

if TYPE_CHECKING:
    from vpm.model.schema import Document
    from vpm.model.structure import Structure

#: A place along a beam may be this share of its length beyond the tip: numbers in files are rounded.
TIP_TOLERANCE = 1e-9
#: Parameters of a reduced solid in the place of young, poisson and density; the core has no use for the second one.
_FACTORS = ("stiffness_factor", "stiffness_factor", "mass_factor")


class Rest(Entry):
    """Curvature and twist (1/m) where nothing loads the beam; `at` is the arc length, where there are several."""

    at: Number | None = None
    bending_x: Number = 0.0
    bending_y: Number = 0.0
    torsion: Number = 0.0

    def described(self) -> Described:
        """What the core reads of the curvature at rest of a beam, at one place."""
        return {"at": self.at or 0.0, "curvature": [self.bending_x, self.bending_y, self.torsion]}


class Damping(Entry):
    """D = stiffness K + mass M, and a ratio for each of the slowest clamped modes."""

    stiffness: Annotated[ParameterValue | None, Rule("s", NOT_NEGATIVE, FEEDING)] = None
    mass: Annotated[ParameterValue | None, Rule("1/s", NOT_NEGATIVE, FEEDING)] = None
    ratios: tuple[ParameterValue, ...] = ()


def _readable(text: str) -> str:
    parse_level(text)
    return text


def _different(components: tuple[Deformation, ...]) -> tuple[Deformation, ...]:
    twice = [component for i, component in enumerate(components) if component in components[:i]]
    if twice:
        raise ValueError(f"has {twice[0]} twice; remove one")
    return components


class Beam(Component):
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
    deforms: Annotated[tuple[Deformation, ...], Field(min_length=1), AfterValidator(_different)] = USUAL
    material: Material | None = None
    section: Section | None = None
    sections: Annotated[tuple[Section, ...], Field(min_length=1)] | None = None
    reduced: Text | None = None
    stiffness_factor: Annotated[ParameterValue, Rule("1", ABOVE_ZERO)] = ONE
    mass_factor: Annotated[ParameterValue, Rule("1", ABOVE_ZERO)] = ONE
    rest: Rest | None = None
    rests: Annotated[tuple[Rest, ...], Field(min_length=1)] | None = None
    damping: Damping = Damping()
    velocity_terms: Switch = True
    second_order: Switch = True

    @property
    def is_of_one_material(self) -> bool:
        """Whether all sections of a beam are made of the beam's material."""
        sections = [section for _, section in self.keyed_sections]
        return self.material is not None and all(one.solid and one.material is None for one in sections)

    @property
    def curvature(self) -> tuple[Rest, ...]:
        """Beam's shape at rest: nothing if it is straight, one entry if its curvature is constant."""
        return (self.rests or ()) if self.rest is None else (self.rest,)

    @property
    def detail(self) -> Level:
        """Level of detail of a beam."""
        return parse_level(self.level)

    @cached_property
    def solid(self) -> ReducedLink | None:
        """Reduced solid that a beam stands for, if it is one."""
        return None if self.reduced is None else link_of(self.reduced)

    @property
    def reach(self) -> float:
        """Last place on a beam: its length (m), or the number of interfaces of a reduced solid."""
        return (self.length or 0.0) if self.solid is None else float(len(self.solid.interfaces))

    @property
    def keyed_sections(self) -> list[tuple[Way, Section]]:
        """Sections with their keys: ``section`` of a uniform beam, else ``section.0``, ``section.1`` and so on."""
        if self.section is not None:
            return [(("section",), self.section)]
        return [(("section", i), section) for i, section in enumerate(self.sections or ())]

    # ---- checks ------------------------------------------------------------------------------------------------------

    def form_problems(self, name: str) -> Iterator[Problem]:
        """Problems of a beam's form, judged without other components and parameter values."""
        keys = ("beams", name)
        if self.solid is not None:
            yield from self._solid_problems(keys, self.solid)
            return
        if self.detail.name == "reduced":
            rest = f'is "{self.level}", but the beam has no reduced solid; name one, reduced = "link.npz"'
            yield Problem(place(*keys, "level"), rest)
        if self.length is None:
            yield Problem(place(*keys, "length"), "is missing; add it, for example length = 0.5")
        for key in ("stiffness_factor", "mass_factor"):
            if getattr(self, key) != ONE:
                yield Problem(place(*keys, key), "is for a reduced solid; remove it, and change the material")
        if self.length is not None and not self.length > 0.0:
            yield Problem(place(*keys, "length"), f"is {self.length:g} m, but has to be above 0; correct the length")
        yield from self._section_problems(keys)
        yield from self._material_problems(keys)
        yield from self._rest_problems(keys)

    def _solid_problems(self, keys: Keys, solid: ReducedLink) -> Iterator[Problem]:
        """Problems of a beam that is a reduced solid and something else."""
        for key in ("length", "material", "section", "sections", "rest", "rests"):
            if getattr(self, key) is not None:
                yield Problem(place(*keys, key), "is given, but the reduced solid says it; remove one of the two")
        level = self.detail
        if level.name not in {"rigid", "reduced"}:
            rest = f'is "{level}", but a reduced solid has modes only; write "reduced({solid.squares.size})" or "rigid"'
            yield Problem(place(*keys, "level"), rest)
        elif level.number > solid.squares.size:
            rest = (
                f'is "{level}", but the solid has {solid.squares.size} modes; take fewer, or reduce it again with more'
            )
            yield Problem(place(*keys, "level"), rest)

    def _section_problems(self, keys: Keys) -> Iterator[Problem]:
        if self.section is not None and self.sections is not None:
            yield Problem(place(*keys), "has section and sections; remove one of the two keys")
        elif self.section is not None:
            if self.section.at is not None:
                rest = "is given, but section holds for the whole beam; remove it, or write sections = [...]"
                yield Problem(place(*keys, "section", "at"), rest)
        elif self.sections is None:
            rest = 'is missing; add it, for example section = { shape = "rectangle", width = 0.015, height = 0.004 }'
            yield Problem(place(*keys, "section"), rest)
        else:
            yield from self._order_problems(keys, self.sections)

    def _order_problems(self, keys: Keys, sections: tuple[Section, ...]) -> Iterator[Problem]:
        where = place(*keys, "sections")
        places = [section.at for section in sections]
        shapes = sorted({section.shape for section in sections})
        if len(sections) == 1:
            yield Problem(
                where, "has one entry; write section = {...} for a uniform beam, or add the section of the tip"
            )
        elif len(shapes) > 1:
            rest = (
                f"has the shapes {' and '.join(shapes)}, but sizes change only within one shape; make two beams of it"
            )
            yield Problem(where, rest)
        elif partial := _partial(sections):
            rest = (
                f"has {', '.join(partial)} in some entries only, but numbers change where all have them; complete them"
            )
            yield Problem(where, rest)
        else:
            yield from _place_problems(keys, "sections", places, self.reach)

    def _material_problems(self, keys: Keys) -> Iterator[Problem]:
        """Problems of a beam's materials: missing, or nothing is made of them."""
        used = False
        for way, section in self.keyed_sections:
            where = place(*keys, *in_file(way))
            if isinstance(section, Stiffness):
                yield from self._shear_problems(where, section)
            if not section.solid and section.material is not None:
                rest = (
                    f"is of no use to the shape {section.shape}, which has materials or stiffness of its own; remove it"
                )
                yield Problem(f"{where}.material", rest)
            used |= section.solid and section.material is None
        example = "material = { young = 206e9, poisson = 0.3, density = 7850 }"
        if used and self.material is None:
            yield Problem(place(*keys, "material"), f"is missing; add it, for example {example}")
        elif not used and self.material is not None and self.keyed_sections:
            yield Problem(place(*keys, "material"), "is of no use, for no section is made of it; remove it")

    def _shear_problems(self, where: str, section: Stiffness) -> Iterator[Problem]:
        for key in ("shear_x", "shear_y"):
            if key in self.deforms and getattr(section, key) is None:
                yield Problem(
                    f"{where}.{key}", f"is missing, but the beam deforms in {key}; add the shear stiffness in N"
                )

    def _rest_problems(self, keys: Keys) -> Iterator[Problem]:
        if not self.curvature:
            return
        where = place(*keys, "rest" if self.rests is None else "rests")
        if self.rest is not None and self.rests is not None:
            yield Problem(place(*keys), "has rest and rests; remove one of the two keys")
        elif self.rest is not None and self.rest.at is not None:
            yield Problem(
                f"{where}.at", "is given, but rest holds for the whole beam; remove it, or write rests = [...]"
            )
        elif self.rests is not None:
            if len(self.rests) == 1:
                yield Problem(where, "has one entry; write rest = {...} for constant curvature, or add that of the tip")
            else:
                yield from _place_problems(keys, "rests", [rest.at for rest in self.rests], self.reach)
        yield from self._straight_problems(where)

    def _straight_problems(self, where: str) -> Iterator[Problem]:
        """A curved beam where a deflection from a straight axis is interpolated, or is linear in the coordinates."""
        level, carry = self.detail.name, ", ".join(f"{name}(n)" for name in CURVED if name != "rigid")
        if level not in CURVED:
            rest = f'is given, but the level "{self.detail}" interpolates a deflection from a straight axis'
            yield Problem(where, f"{rest}; take one of {carry} or rigid")
        elif not self.second_order and level not in {"rigid", "lumped"}:
            rest = "is given with second_order = false, which leaves a deflection from a straight axis"
            yield Problem(where, f"{rest}; remove one of the two")

    def size_problems(self, name: str, document: Document, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
        """Problems of a beam's sizes: sections that do not fit, and gauges far outside of their section."""
        gauges = {key: gauge for key, gauge in document.gauges.items() if gauge.beam == name}
        for number, (way, section) in enumerate(self.keyed_sections):
            values = {inside: parameters[section_parameter(name, way, inside)].value for inside in section.numbers}
            sizes = {str(inside[0]): value for inside, value in values.items() if len(inside) == 1}
            if isinstance(section, Layers):
                sizes["height"] = sum(value for inside, value in values.items() if inside[-1] == "thickness")
            if misfit := section.misfit(sizes):
                yield Problem(place("beams", name, *in_file(way)), misfit)
            for key, gauge in gauges.items() if number == 0 else ():
                yield from gauge.reach_problems(key, section, sizes)

    def outside_problems(self, keys: Keys, at: float, name: str) -> Iterator[Problem]:
        """Problem of a place before a beam's root or beyond its tip."""
        solid = self.solid
        if solid is not None:
            if at not in range(len(solid.interfaces) + 1):
                known = ", ".join(f"{number} ({one})" for number, one in enumerate(("root", *solid.interfaces)))
                rest = (
                    f'is {at:g}, but on "{name}", a reduced solid, it is the number of an interface: {known}; take one'
                )
                yield Problem(place(*keys, "at"), rest)
        elif not 0.0 <= at <= self.reach * (1.0 + TIP_TOLERANCE):
            rest = f'is {at:g} m, but beam "{name}" goes from 0 to {self.reach:g} m; correct the place'
            yield Problem(place(*keys, "at"), rest)

    # ---- what the model and the core are told ------------------------------------------------------------------------

    def with_solid(self, folder: Path) -> Beam:
        """The beam with the numbers of its reduced solid, if it is one; those of a file take the place of its name."""
        own = self.reduced is None or self.reduced.startswith(EMBEDDED)
        read = self if own else self.model_copy(update={"reduced": embedded(read_bytes(folder / str(self.reduced)))})
        _ = read.solid  # damaged ones are told here
        return read

    def slots(self, keys: Keys, structure: Structure) -> Iterator[Slot]:  # noqa: ARG002
        """Material, sections, damping; the effort of a motion is linear in none of them, for they bend the beam."""
        name, damping = str(keys[1]), self.damping
        if self.solid is not None:
            factors = rules_of(Beam).items()
            yield from (Slot((*keys, key), getattr(self, key), rule.unit, rule.physical) for key, rule in factors)
        for inside, (quantity, rule) in ({} if self.material is None else self.material.numbers(())).items():
            yield Slot((*keys, "material", *inside), quantity, rule.unit, rule.physical, named=f"{name}.{inside[-1]}")
        for way, section in self.keyed_sections:
            for inside, (quantity, rule) in section.numbers.items():
                named = section_parameter(name, way, inside)
                yield Slot((*keys, *in_file(way), *inside), quantity, rule.unit, rule.physical, named=named)
        yield from slots_of((*keys, "damping"), damping)
        for i, quantity in enumerate(damping.ratios):
            yield Slot((*keys, "damping", "ratios", i), quantity, "1", NOT_NEGATIVE, FEEDING)

    def described(self, name: str, structure: Structure, index: Index) -> Described:
        """What the core reads of a beam."""
        level, damping = self.detail, f"{name}.damping"
        own = _FACTORS if self.solid is not None else () if self.material is None else tuple(Material.model_fields)
        material = {key: index[f"{name}.{of_beam}"] for key, of_beam in zip(Material.model_fields, own, strict=False)}
        # A coarse level has fewer modes than ratios may be given for.
        ratios = range(min(len(level.coordinates(self.deforms)), len(self.damping.ratios)))
        sections = [
            section.described({inside: index[section_parameter(name, way, inside)] for inside in section.numbers})
            for way, section in self.keyed_sections
        ]
        return {
            "name": name,
            **structure.frames[name].described(),
            "length": self.reach,
            "level": level.name if level.name == "rigid" else {level.name: level.number},
            "deforms": list(self.deforms),
            **({"material": material} if own else {}),
            "sections": sections,
            **({"rest": [rest.described() for rest in self.curvature]} if self.curvature else {}),
            "damping": {
                **{key: index.get(f"{damping}.{key}") for key in ("stiffness", "mass")},
                "ratios": [index[f"{damping}.ratios.{i}"] for i in ratios],
            },
            **({} if self.solid is None else {"reduced": self.solid.content()}),
        }


def in_file(way: Way) -> Way:
    """Keys of a beam's section as they stand in a file."""
    return way if len(way) == 1 else ("sections", *way[1:])


def _partial(sections: tuple[Section, ...]) -> list[str]:
    """Numbers that some sections of a beam have and others have not, own materials left aside."""
    kinds = [frozenset(way for way in section.numbers if way[0] != "material") for section in sections]
    return sorted(".".join(map(str, way)) for way in frozenset.union(*kinds) - frozenset.intersection(*kinds))


def _place_problems(keys: Keys, key: str, places: Sequence[float | None], length: float) -> Iterator[Problem]:
    """Places of a beam's table along the axis that are missing or do not rise from root to tip."""
    if None in places:
        yield Problem(place(*keys, key, places.index(None), "at"), "is missing; add the arc length in m")
        return
    known = [at for at in places if at is not None]
    rising = all(before < after for before, after in pairwise(known))
    whole = known[0] == 0.0 and math.isclose(known[-1], length, rel_tol=TIP_TOLERANCE)
    if not (rising and whole):
        shown = ", ".join(f"{at:g}" for at in known)
        rest = f"has the places {shown} m, but they have to rise from 0 to the length {length:g} m; correct at"
        yield Problem(place(*keys, key), rest)


def with_solids(document: Document, folder: Path) -> tuple[Document, list[Problem]]:
    """Read the files that beams name, and tell those that are not there or damaged."""
    beams, problems = dict(document.beams), list[Problem]()
    for name, beam in document.beams.items():
        try:
            beams[name] = beam.with_solid(folder)
        except VpmError as error:
            problems.append(Problem(place("beams", name, "reduced"), f"is wrong: {error}"))
    return document.model_copy(update={"beams": beams}), problems
