"""Checks of beams: length, level of detail, the order of their sections, and sizes that fit into each other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise

from vpm.model.beam import Beam, Circle, Given, IBeam, Rectangle, Section, Tube, sections_of
from vpm.model.entry import ONE
from vpm.model.messages import Problem, place
from vpm.model.parameters import Parameter
from vpm.model.reduced import ReducedLink
from vpm.model.schema import Document
from vpm.model.tree import TIP_TOLERANCE

#: A gauge may be this many half sizes of its section away from the axis: enough for layers on the surface, and too
#: little for millimetres that were taken for metres.
GAUGE_REACH = 2.0
_EXAMPLES = {
    "length": "length = 0.5",
    "material": "material = { young = 206e9, poisson = 0.3, density = 7850 }",
}


def beam_problems(document: Document) -> Iterator[Problem]:
    """What needs no parameter values to be judged."""
    for name, beam in document.beams.items():
        if beam.solid is not None:
            yield from _solid_problems(name, beam, beam.solid)
            continue
        if beam.detail.name == "reduced":
            rest = f'is "{beam.level}", but the beam has no reduced solid; name one, reduced = "link.npz"'
            yield Problem(place("beams", name, "level"), rest)
        for key in ("length", "material"):
            if getattr(beam, key) is None:
                yield Problem(place("beams", name, key), f"is missing; add it, for example {_EXAMPLES[key]}")
        for key in ("stiffness_factor", "mass_factor"):
            if getattr(beam, key) != ONE:
                yield Problem(place("beams", name, key), "is for a reduced solid; remove it, and change the material")
        if beam.length is not None and not beam.length > 0.0:
            yield Problem(
                place("beams", name, "length"), f"is {beam.length:g} m, but has to be above 0; correct the length"
            )
        yield from _section_problems(name, beam)


def _solid_problems(name: str, beam: Beam, solid: ReducedLink) -> Iterator[Problem]:
    """What a link cannot be beside a reduced solid."""
    for key in ("length", "material", "section", "sections"):
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
    elif any(at is None for at in places):
        missing = places.index(None)
        yield Problem(place("beams", name, "sections", missing, "at"), "is missing; add the arc length in m")
    else:
        known = [at for at in places if at is not None]
        rising = all(before < after for before, after in pairwise(known))
        whole = known[0] == 0.0 and math.isclose(known[-1], beam.reach, rel_tol=TIP_TOLERANCE)
        if not (rising and whole):
            shown = ", ".join(f"{at:g}" for at in known)
            rest = f"has the places {shown} m, but they have to rise from 0 to the length {beam.reach:g} m; correct at"
            yield Problem(where, rest)


def size_problems(document: Document, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
    """Sizes of sections that do not fit into each other, and gauges far outside of their section."""
    for name, beam in document.beams.items():
        for keys, section in sections_of(beam):
            prefix = ".".join((name, *map(str, keys)))
            sizes = {key: parameters[f"{prefix}.{key}"].value for key in section.sizes}
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
        case Rectangle() | IBeam():
            half = (0.5 * sizes["width"], 0.5 * sizes["height"])
        case Circle() | Tube():
            half = (0.5 * sizes["diameter" if isinstance(section, Circle) else "outer"],) * 2
        case Given():
            return
    for key, value, reach in zip("xy", point, half, strict=True):
        if abs(value) > GAUGE_REACH * reach:
            rest = f"is {value:g} m, but the section ends {reach:.4g} m from the axis; correct the place (in m)"
            yield Problem(place("gauges", gauge, key), rest)
