"""Parameters of a model, and their places in its file: values in SI, bounds, and what is physically possible."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from vpm.catalogue.kinds import ABOVE_ZERO, ANY, NOT_NEGATIVE, Range
from vpm.errors import UnitError
from vpm.model.entry import Entry, Quantity
from vpm.model.messages import Problem, place
from vpm.numbers import LARGEST
from vpm.units import convert, require_dimension

ParameterKind = Literal["linear", "shape"]
#: Way to a value from the top of a file: section, name of the component, keys below.
Keys = tuple[str | int, ...]

__all__ = ["ABOVE_ZERO", "ANY", "NOT_NEGATIVE", "Keys", "Parameter", "Range", "Rule", "Slot", "rules_of", "slots_of"]

#: Above zero, for areas, gains, leakages and volumes, which are far below 1 in SI.
TINY: Range = (1e-30, math.inf)
SHARE: Range = (1e-30, 1.0)

#: What values below zero would mean.
FEEDING = "negative damping would feed energy into the motion"
INERTIA = "an inertia cannot be negative"
PUSHING = "negative friction would push along the motion and feed energy into it"


@dataclass(frozen=True)
class Rule:
    """What may stand at a key that is a parameter: an annotation of the field."""

    unit: str  #: SI unit; "" where it depends on the model.
    physical: Range  #: Physically possible range (SI).
    impossible: str = ""  #: What a value outside would mean.
    #: Whether the effort that a motion needs is linear in the parameter.
    kind: ParameterKind = "shape"


@dataclass(frozen=True)
class Parameter:
    """One parameter of a model."""

    name: str  #: Dotted name, ``"axis.friction.viscous"``.
    value: float  #: In `unit`.
    unit: str  #: SI unit, ``"N s/m"``.
    #: One standard deviation, in `unit`; infinite if nothing is known beforehand, None if the value is taken as known.
    uncertainty: float | None
    #: Bounds in `unit`: those of the file, inside what is physically possible.
    minimum: float
    maximum: float
    kind: ParameterKind  #: One of "linear", "shape"; whether the effort that a motion needs is linear in the parameter.

    @property
    def adjustable(self) -> bool:
        """Whether a calibration may change the parameter."""
        return self.uncertainty is not None


@dataclass(frozen=True)
class Slot:
    """Place of a parameter in the document, and what may stand there."""

    keys: Keys  #: Way to it in the document.
    quantity: Quantity  #: What stands there.
    unit: str  #: SI unit.
    physical: Range  #: Physically possible range (SI).
    impossible: str = ""  #: What a value outside the range would mean.
    kind: ParameterKind = "shape"
    named: str = ""  #: Dotted name of the parameter, where it is not the keys below the section, joined.

    @property
    def name(self) -> str:
        """Dotted name of the parameter."""
        return self.named or ".".join(map(str, self.keys[1:]))

    def problems(self) -> Iterator[Problem]:
        """Problems of a parameter: wrong unit, bounds without room, value outside, no valid uncertainty."""
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
        """Parameter's value, uncertainty and bounds in the SI unit."""
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
    """Physical range of a parameter in words; all known ranges have a lower end only."""
    shown = "" if unit == "1" else f" {unit}"
    if low in {ABOVE_ZERO[0], TINY[0]}:
        # A value above zero is below the least that is taken for a number with a meaning, or above the most.
        least = f"{low:g}{shown} or more" if 0.0 < value < low else f"more than 0{shown}"
        return least if math.isinf(high) else f"{least} and up to {high:g}{shown}"
    return f"{low:g}{shown} or more" if math.isinf(high) else f"{low:g} to {high:g}{shown}"


def rules_of(table: type[Entry]) -> dict[str, Rule]:
    """Rules of the keys of a table that are parameters, in the order of its fields."""
    fields = table.model_fields.items()
    return {key: rule for key, field in fields for rule in field.metadata if isinstance(rule, Rule)}


def slots_of(keys: Keys, entry: Entry, units: Mapping[str, str] = MappingProxyType({})) -> Iterator[Slot]:
    """Places of the parameters that are given in a table and in those inside; ``units`` depend on the model."""
    rules = rules_of(type(entry))
    for key in type(entry).model_fields:
        value = getattr(entry, key)
        if isinstance(value, Quantity) and key in rules:
            rule = rules[key]
            unit = rule.unit or units[key]
            yield Slot((*keys, key), value, unit, rule.physical, rule.impossible, rule.kind)
        elif isinstance(value, Entry):
            yield from slots_of((*keys, key), value, units)
