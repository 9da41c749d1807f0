"""The parameters of a model: one flat, ordered table with SI values, read from the document and checked.

Order: bodies (mass, centre of mass, inertia), rotors, beams, lines, transmissions, supplies, actuators, controllers,
contacts, bushings, then effects as they stand in the file.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from vpm.catalogue import EFFECTS, POSITIVE
from vpm.errors import UnitError
from vpm.model.beam import Beam, Line, Part, section_parameter, sections_of
from vpm.model.connection_parameters import bushing_rows, contact_rows
from vpm.model.controller import Controller
from vpm.model.drive_parameters import Row, actuator_rows, supply_rows
from vpm.model.effects import effect_unit, parameters_of
from vpm.model.entry import Quantity
from vpm.model.gains import gains
from vpm.model.messages import Problem, place
from vpm.model.schema import Document, EffectEntry
from vpm.model.structure import COORDINATE_UNIT, Structure
from vpm.model.transmission import transmission_rows
from vpm.numbers import LARGEST
from vpm.units import convert, require_dimension, si_unit

ParameterKind = Literal["linear", "shape"]

INERTIA_AXES = ("xx", "yy", "zz", "xy", "xz", "yz")

_ANY = (-math.inf, math.inf)
_ABOVE_ZERO = (POSITIVE, math.inf)
_NOT_NEGATIVE = (0.0, math.inf)
#: As POSITIVE, for areas and second moments.
_LEAST = 1e-30
#: Above -1 and not above 0.5, or straining an isotropic solid would set energy free.
_POISSON = (-0.999, 0.5)
_FEEDING = "negative damping would feed energy into the motion"


@dataclass(frozen=True)
class Parameter:
    """One parameter of a model.

    Attributes
    ----------
    name : str
        Dotted name, ``"axis.friction.viscous"``.
    value : float
        In `unit`.
    unit : str
        SI unit, ``"N s/m"``.
    uncertainty : float or None
        One standard deviation, in `unit`; infinite if nothing is known beforehand, None if the value is taken as known.
    minimum, maximum : float
        Bounds in `unit`: those of the file, inside what is physically possible.
    kind : {"linear", "shape"}
        Whether the effort that a motion needs is linear in the parameter.
    """

    name: str
    value: float
    unit: str
    uncertainty: float | None
    minimum: float
    maximum: float
    kind: ParameterKind

    @property
    def adjustable(self) -> bool:
        """Whether a calibration may move the value."""
        return self.uncertainty is not None


@dataclass(frozen=True)
class Slot:
    """Place of a parameter in the document, and what may stand there.

    Attributes
    ----------
    name : str
        Dotted name of the parameter.
    keys : tuple of str or int
        Way to it in the document.
    quantity : Quantity
        What stands there.
    unit : str
        SI unit.
    physical : (float, float)
        Physically possible range (SI).
    kind : {"linear", "shape"}
    impossible : str
        What a value outside the range would mean.
    """

    name: str
    keys: tuple[str | int, ...]
    quantity: Quantity
    unit: str
    physical: tuple[float, float]
    kind: ParameterKind
    impossible: str = ""

    def problems(self) -> Iterator[Problem]:
        """Wrong unit, bounds that leave no room, a value outside of them, an uncertainty that is none."""
        quantity, where = self.quantity, place(*self.keys)
        unit = quantity.unit or self.unit
        try:
            require_dimension(unit, self.unit)
        except UnitError as error:
            yield Problem(where, f"has a wrong unit: {error}")
            return
        if not abs(convert(quantity.value, unit, self.unit)) <= LARGEST:
            yield Problem(where, f"is {quantity.value:g} {unit}, which is more than any machine has; correct the value")
            return
        spread, low, high = quantity.uncertainty, quantity.minimum, quantity.maximum
        if spread is not None and not spread > 0.0:
            rest = f"has the uncertainty {spread:g} {unit}, which has to be above 0; leave it out if the value is known"
            yield Problem(where, rest)
        if any(bound is not None and math.isnan(bound) for bound in (low, high)):
            yield Problem(where, "has a bound that is not a number; correct min and max")
            return
        if low is not None and high is not None and low >= high:
            yield Problem(where, f"has min {low:g} {unit} and max {high:g} {unit}, but min has to be below max")
            return
        yield from self._range_problems(where, unit)

    def _range_problems(self, where: str, unit: str) -> Iterator[Problem]:
        parameter = self.parameter()
        possible = _range_text(*self.physical, self.unit, parameter.value)
        shown = f"{self.quantity.value:g}" + ("" if unit == "1" else f" {unit}")
        if not self.physical[0] <= parameter.value <= self.physical[1]:
            reason = f" ({self.impossible})" if self.impossible else ""
            yield Problem(where, f"is {shown}, but only {possible} is physically possible{reason}; correct the value")
        elif parameter.minimum >= parameter.maximum:
            yield Problem(
                where, f"has bounds that leave nothing of what is physically possible, {possible}; widen them"
            )
        elif not parameter.minimum <= parameter.value <= parameter.maximum:
            low, high = (convert(bound, self.unit, unit) for bound in (parameter.minimum, parameter.maximum))
            yield Problem(
                where, f"is {shown}, outside its bounds {low:g} to {high:g} {unit}; correct the value or the bounds"
            )

    def parameter(self) -> Parameter:
        """Table entry in SI; the unit has to be right."""
        quantity = self.si_quantity()
        low = -math.inf if quantity.minimum is None else quantity.minimum
        high = math.inf if quantity.maximum is None else quantity.maximum
        low, high = max(low, self.physical[0]), min(high, self.physical[1])
        return Parameter(self.name, quantity.value, self.unit, quantity.uncertainty, low, high, self.kind)

    def si_quantity(self) -> Quantity:
        """What stands there, in the SI unit."""
        given = self.quantity
        if given.unit is None:
            return given

        def si(number: float | None) -> float | None:
            return None if number is None else convert(number, given.unit or self.unit, self.unit)

        return Quantity(
            value=convert(given.value, given.unit, self.unit),
            unit=self.unit,
            uncertainty=si(given.uncertainty),
            minimum=si(given.minimum),
            maximum=si(given.maximum),
        )


def _range_text(low: float, high: float, unit: str, value: float) -> str:
    """Physical range in words; the catalogue and this module know ranges with a lower end only."""
    shown = "" if unit == "1" else f" {unit}"
    if low in {POSITIVE, _LEAST}:
        # A value above zero is below the least that is taken for a number with a meaning, or above the most.
        least = f"{low:g}{shown} or more" if 0.0 < value < low else f"more than 0{shown}"
        return least if math.isinf(high) else f"{least} and up to {high:g}{shown}"
    return f"{low:g}{shown} or more" if math.isinf(high) else f"{low:g} to {high:g}{shown}"


def slots(document: Document, structure: Structure) -> Iterator[Slot]:
    """Every parameter of a document whose references are right and whose effects are complete, in index order."""
    for name in structure.bodies:
        yield from _body_slots(name, document)
    for name, joint in document.joints.items():
        if joint.rotor_inertia is not None:
            yield _rotor_slot(name, joint.rotor_inertia, structure)
    for name in structure.beams:
        yield from _beam_slots(name, document.beams[name])
    for name, line in document.lines.items():
        yield from _line_slots(name, line)
    for name, transmission in document.transmissions.items():
        units = {joint: COORDINATE_UNIT[structure.joint_kind(joint)] for joint in transmission.ratios}
        yield from (_slot(("transmissions", name), row) for row in transmission_rows(transmission, units))
    for name, supply in document.supplies.items():
        yield from (_slot(("supplies", name), row) for row in supply_rows(supply))
    for name, actuator in document.actuators.items():
        rows = actuator_rows(actuator, structure.effort_unit(name), structure.driven_kind(name))
        yield from (_slot(("actuators", name), row) for row in rows)
    for name, controller in document.controllers.items():
        yield from _controller_slots(name, controller, structure)
    yield from _connection_slots(document)
    for position, entry in enumerate(document.effects):
        yield from effect_slots(position, entry, structure)


def _body_slots(name: str, document: Document) -> Iterator[Slot]:
    body, keys = document.bodies[name], ("bodies", name)
    yield Slot(f"{name}.mass", (*keys, "mass"), body.mass, "kg", _ABOVE_ZERO, "linear")
    for i, (axis, quantity) in enumerate(zip("xyz", body.center_of_mass, strict=True)):
        yield Slot(f"{name}.center_of_mass.{axis}", (*keys, "center_of_mass", i), quantity, "m", _ANY, "shape")
    for i, (axes, quantity) in enumerate(zip(INERTIA_AXES, body.inertia, strict=True)):
        bounds = _NOT_NEGATIVE if i < 3 else _ANY
        yield Slot(f"{name}.inertia.{axes}", (*keys, "inertia", i), quantity, "kg m^2", bounds, "linear")


def _rotor_slot(name: str, rotor: Quantity, structure: Structure) -> Slot:
    """Inertia that a drive's rotor adds to its joint, ratio squared times its own."""
    unit = "kg" if structure.joint_kind(name) == "prismatic" else "kg m^2"
    keys = ("joints", name, "rotor_inertia")
    return Slot(f"{name}.rotor_inertia", keys, rotor, unit, _NOT_NEGATIVE, "linear")


def _beam_slots(name: str, beam: Beam) -> Iterator[Slot]:
    """Material, sections, damping; the effort of a motion is linear in none of them, for they bend the beam."""
    keys, damping = ("beams", name), beam.damping
    if beam.solid is not None:
        for key in ("stiffness_factor", "mass_factor"):
            yield Slot(f"{name}.{key}", (*keys, key), getattr(beam, key), "1", _ABOVE_ZERO, "shape")
    for inside, (quantity, unit) in ({} if beam.material is None else beam.material.numbers(())).items():
        way = (*keys, "material", *inside)
        yield Slot(f"{name}.{inside[-1]}", way, quantity, unit, _size_range(inside[-1], unit), "shape")
    for way, section in sections_of(beam):
        place_in_file = ("section",) if len(way) == 1 else ("sections", *way[1:])
        for inside, (quantity, unit) in section.numbers.items():
            dotted = section_parameter(name, way, inside)
            bounds = _size_range(inside[-1], unit)
            yield Slot(dotted, (*keys, *place_in_file, *inside), quantity, unit, bounds, "shape")
    for key, unit in (("stiffness", "s"), ("mass", "1/s")):
        if (quantity := getattr(damping, key)) is not None:
            way = (*keys, "damping", key)
            yield Slot(f"{name}.damping.{key}", way, quantity, unit, _NOT_NEGATIVE, "shape", _FEEDING)
    for i, quantity in enumerate(damping.ratios):
        way = (*keys, "damping", "ratios", i)
        yield Slot(f"{name}.damping.ratios.{i}", way, quantity, "1", _NOT_NEGATIVE, "shape", _FEEDING)


def _size_range(key: str | int, unit: str) -> tuple[float, float]:
    """Range of a number of a section; second moments of thin ones are below the least length, 1e-12 m^4 and less."""
    if key == "poisson":
        return _POISSON
    if unit == "kg m":
        return _NOT_NEGATIVE
    return (_LEAST, math.inf) if unit in {"m^2", "m^4"} else _ABOVE_ZERO


def _line_slots(name: str, line: Line) -> Iterator[Slot]:
    for key in ("barrel", "rod"):
        part: Part | None = getattr(line, key)
        if part is None:
            continue
        keys = ("lines", name, key)
        yield Slot(f"{name}.{key}.mass", (*keys, "mass"), part.mass, "kg", _NOT_NEGATIVE, "linear")
        yield Slot(f"{name}.{key}.center", (*keys, "center"), part.center, "m", _ANY, "shape")
        yield Slot(f"{name}.{key}.inertia", (*keys, "inertia"), part.inertia, "kg m^2", _NOT_NEGATIVE, "linear")


def _slot(component: tuple[str, str], row: Row) -> Slot:
    """Place of a parameter whose dotted name is the name of its component and the keys below that."""
    dotted = ".".join((component[1], *row.keys))
    return Slot(dotted, (*component, *row.keys), row.quantity, row.unit, row.bounds, row.kind, row.impossible)


def _controller_slots(name: str, controller: Controller, structure: Structure) -> Iterator[Slot]:
    for gain in gains(controller, structure):
        keys, bounds = ("controllers", name, *gain.way), _ABOVE_ZERO if gain.is_limit else _ANY
        yield Slot(f"{name}.{gain.suffix}", keys, gain.quantity, si_unit(gain.unit), bounds, "shape")


def _connection_slots(document: Document) -> Iterator[Slot]:
    rows = [("contacts", name, row) for name, contact in document.contacts.items() for row in contact_rows(contact)]
    rows += [("bushings", name, row) for name, bushing in document.bushings.items() for row in bushing_rows(bushing)]
    for section, name, row in rows:
        keys = (section, name, *row.keys)
        yield Slot(f"{name}.{row.suffix}", keys, row.quantity, row.unit, row.bounds, row.kind, row.impossible)


def effect_slots(position: int, entry: EffectEntry, structure: Structure) -> Iterator[Slot]:
    """Parameters of the effect at one position of a complete document."""
    effect, given = EFFECTS[entry.type], entry.values
    for parameter in parameters_of(entry):
        yield Slot(
            f"{entry.owner}.{parameter.suffix}",
            ("effects", position, parameter.name),
            given[parameter.name],
            effect_unit(parameter.unit, entry, structure),
            parameter.physical,
            "linear" if parameter.linear else "shape",
            effect.impossible,
        )


def table(found: list[Slot]) -> Mapping[str, Parameter]:
    """Parameters by name, in index order."""
    return {slot.name: slot.parameter() for slot in found}
