"""Checks of beams: length, level of detail, the order of their sections, and sizes that fit into each other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from vpm.model.beam import (
    Beam,
    Circle,
    Given,
    IBeam,
    Layers,
    Rectangle,
    Section,
    Stiffness,
    Tube,
    section_parameter,
    sections_of,
)
from vpm.model.entry import ONE
from vpm.model.level import CURVED
from vpm.model.messages import Problem, place
from vpm.model.parameters import Parameter
from vpm.model.reduced import ReducedLink
from vpm.model.schema import Document
from vpm.model.tree import TIP_TOLERANCE

#: A gauge may be this many half sizes of its section away from the axis: enough for layers on the surface, and too
#: little for millimetres that were taken for metres.
GAUGE_REACH = 2.0


def beam_problems(document: Document) -> Iterator[Problem]:
    """What needs no parameter values to be judged."""
    for name, beam in document.beams.items():
        if beam.solid is not None:
            yield from _solid_problems(name, beam, beam.solid)
            continue
        if beam.detail.name == "reduced":
            rest = f'is "{beam.level}", but the beam has no reduced solid; name one, reduced = "link.npz"'
            yield Problem(place("beams", name, "level"), rest)
        if beam.length is None:
            yield Problem(place("beams", name, "length"), "is missing; add it, for example length = 0.5")
        for key in ("stiffness_factor", "mass_factor"):
            if getattr(beam, key) != ONE:
                yield Problem(place("beams", name, key), "is for a reduced solid; remove it, and change the material")
        if beam.length is not None and not beam.length > 0.0:
            yield Problem(
                place("beams", name, "length"), f"is {beam.length:g} m, but has to be above 0; correct the length"
            )
        yield from _section_problems(name, beam)
        yield from _material_problems(name, beam)
        yield from _rest_problems(name, beam)


def _solid_problems(name: str, beam: Beam, solid: ReducedLink) -> Iterator[Problem]:
    """What a link cannot be beside a reduced solid."""
    for key in ("length", "material", "section", "sections", "rest", "rests"):
        if getattr(beam, key) is not None:
            yield Problem(place("beams", name, key), "is given, but the reduced solid says it; remove one of the two")
    level = beam.detail
    if level.name not in {"rigid", "reduced"}:
        rest = f'is "{level}", but a reduced solid has modes only; write "reduced({solid.squares.size})" or "rigid"'
        yield Problem(place("beams", name, "level"), rest)
    elif level.number > solid.squares.size:
        rest = f'is "{level}", but the solid has {solid.squares.size} modes; take fewer, or reduce it again with more'
        yield Problem(place("beams", name, "level"), rest)


def _section_problems(name: str, beam: Beam) -> Iterator[Problem]:
    if beam.section is not None and beam.sections is not None:
        yield Problem(place("beams", name), "has section and sections; remove one of the two keys")
    elif beam.section is not None:
        if beam.section.at is not None:
            rest = "is given, but section holds for the whole beam; remove it, or write sections = [...]"
            yield Problem(place("beams", name, "section", "at"), rest)
    elif beam.sections is None:
        rest = 'is missing; add it, for example section = { shape = "rectangle", width = 0.015, height = 0.004 }'
        yield Problem(place("beams", name, "section"), rest)
    else:
        yield from _order_problems(name, beam, beam.sections)


def _order_problems(name: str, beam: Beam, sections: tuple[Section, ...]) -> Iterator[Problem]:
    where = place("beams", name, "sections")
    places = [section.at for section in sections]
    shapes = sorted({section.shape for section in sections})
    if len(sections) == 1:
        yield Problem(where, "has one entry; write section = {...} for a uniform beam, or add the section of the tip")
    elif len(shapes) > 1:
        rest = f"has the shapes {' and '.join(shapes)}, but sizes change only within one shape; make two beams of it"
        yield Problem(where, rest)
    elif partial := _partial(sections):
        rest = f"has {', '.join(partial)} in some entries only, but numbers change where all have them; complete them"
        yield Problem(where, rest)
    else:
        yield from _place_problems(name, "sections", places, beam.reach)


def _partial(sections: tuple[Section, ...]) -> list[str]:
    """Numbers that some sections have and others have not, materials of their own left aside."""
    kinds = [frozenset(way for way in section.numbers if way[0] != "material") for section in sections]
    return sorted(".".join(map(str, way)) for way in frozenset.union(*kinds) - frozenset.intersection(*kinds))


def _place_problems(name: str, key: str, places: Sequence[float | None], length: float) -> Iterator[Problem]:
    """Places of a table along the axis that are missing or do not rise from root to tip."""
    if None in places:
        yield Problem(place("beams", name, key, places.index(None), "at"), "is missing; add the arc length in m")
        return
    known = [at for at in places if at is not None]
    rising = all(before < after for before, after in pairwise(known))
    whole = known[0] == 0.0 and math.isclose(known[-1], length, rel_tol=TIP_TOLERANCE)
    if not (rising and whole):
        shown = ", ".join(f"{at:g}" for at in known)
        rest = f"has the places {shown} m, but they have to rise from 0 to the length {length:g} m; correct at"
        yield Problem(place("beams", name, key), rest)


def _material_problems(name: str, beam: Beam) -> Iterator[Problem]:
    """Materials that are missing, or that nothing is made of."""
    used = False
    for keys, section in sections_of(beam):
        where = place("beams", name, "section" if len(keys) == 1 else "sections", *keys[1:])
        if isinstance(section, Stiffness):
            yield from _shear_problems(where, section, beam)
        if not section.solid and section.material is not None:
            rest = f"is of no use to the shape {section.shape}, which has materials or stiffness of its own; remove it"
            yield Problem(f"{where}.material", rest)
        used |= section.solid and section.material is None
    example = "material = { young = 206e9, poisson = 0.3, density = 7850 }"
    if used and beam.material is None:
        yield Problem(place("beams", name, "material"), f"is missing; add it, for example {example}")
    elif not used and beam.material is not None and sections_of(beam):
        yield Problem(place("beams", name, "material"), "is of no use, for no section is made of it; remove it")


def _shear_problems(where: str, section: Stiffness, beam: Beam) -> Iterator[Problem]:
    for key in ("shear_x", "shear_y"):
        if key in beam.deforms and getattr(section, key) is None:
            yield Problem(f"{where}.{key}", f"is missing, but the beam deforms in {key}; add the shear stiffness in N")


def _rest_problems(name: str, beam: Beam) -> Iterator[Problem]:
    if not beam.curvature:
        return
    where = place("beams", name, "rest" if beam.rests is None else "rests")
    if beam.rest is not None and beam.rests is not None:
        yield Problem(place("beams", name), "has rest and rests; remove one of the two keys")
    elif beam.rest is not None and beam.rest.at is not None:
        yield Problem(f"{where}.at", "is given, but rest holds for the whole beam; remove it, or write rests = [...]")
    elif beam.rests is not None:
        if len(beam.rests) == 1:
            yield Problem(where, "has one entry; write rest = {...} for constant curvature, or add that of the tip")
        else:
            yield from _place_problems(name, "rests", [rest.at for rest in beam.rests], beam.reach)
    yield from _straight_problems(where, beam)


def _straight_problems(where: str, beam: Beam) -> Iterator[Problem]:
    """A curved beam where a deflection from a straight axis is interpolated, or is linear in the coordinates."""
    level, carry = beam.detail.name, ", ".join(f"{name}(n)" for name in CURVED if name != "rigid")
    if level not in CURVED:
        rest = f'is given, but the level "{beam.detail}" interpolates a deflection from a straight axis'
        yield Problem(where, f"{rest}; take one of {carry} or rigid")
    elif not beam.second_order and level not in {"rigid", "lumped"}:
        rest = "is given with second_order = false, which leaves a deflection from a straight axis"
        yield Problem(where, f"{rest}; remove one of the two")


def size_problems(document: Document, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
    """Sizes of sections that do not fit into each other, and gauges far outside of their section."""
    for name, beam in document.beams.items():
        for keys, section in sections_of(beam):
            values = {way: parameters[section_parameter(name, keys, way)].value for way in section.numbers}
            sizes = {str(way[0]): value for way, value in values.items() if len(way) == 1}
            sizes |= (
                {"height": sum(value for way, value in values.items() if way[-1] == "thickness")}
                if isinstance(section, Layers)
                else {}
            )
            where = place("beams", name, "section" if len(keys) == 1 else "sections", *keys[1:])
            yield from _fit_problems(where, section, sizes)
            for gauge, entry in document.gauges.items():
                if entry.beam == name and keys == sections_of(beam)[0][0]:
                    yield from _reach_problems(gauge, (entry.x, entry.y), section, sizes)


def _fit_problems(where: str, section: Section, sizes: Mapping[str, float]) -> Iterator[Problem]:
    match section:
        case Tube() if sizes["inner"] >= sizes["outer"]:
            rest = f"has inner {sizes['inner']:g} m and outer {sizes['outer']:g} m, but inner has to be below outer"
            yield Problem(where, f"{rest}; correct them")
        case IBeam() if sizes["web"] >= sizes["width"]:
            rest = f"has web {sizes['web']:g} m, which is not below the width {sizes['width']:g} m; correct them"
            yield Problem(where, rest)
        case IBeam() if 2.0 * sizes["flange"] >= sizes["height"]:
            rest = (
                f"has two flanges of {sizes['flange']:g} m, which fill the height {sizes['height']:g} m; correct them"
            )
            yield Problem(where, rest)


def _reach_problems(
    gauge: str, point: tuple[float, float], section: Section, sizes: Mapping[str, float]
) -> Iterator[Problem]:
    match section:
        case Rectangle() | IBeam() | Layers():
            half = (0.5 * sizes["width"], 0.5 * sizes["height"])
        case Circle() | Tube():
            half = (0.5 * sizes["diameter" if isinstance(section, Circle) else "outer"],) * 2
        case Given() | Stiffness():
            return
    for key, value, reach in zip("xy", point, half, strict=True):
        if abs(value) > GAUGE_REACH * reach:
            rest = f"is {value:g} m, but the section ends {reach:.4g} m from the axis; correct the place (in m)"
            yield Problem(place("gauges", gauge, key), rest)
