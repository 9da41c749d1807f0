"""Hydraulic supplies: pump, tank and oil. Their laws are in docs/hydraulics.md."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from vpm.catalogue import EFFECTS
from vpm.model.component import Component, Described, Index
from vpm.model.drives.drive import group, numbers
from vpm.model.entry import Entry, ParameterValue, Quantity
from vpm.model.messages import Problem, place
from vpm.model.parameters import TINY, Parameter, Rule

if TYPE_CHECKING:
    from vpm.model.schema import Document
    from vpm.model.structure import Structure

#: Standard atmosphere, Pa (NIST SP 811, appendix B).
ATMOSPHERE = 101325.0
#: Adiabatic exponent of air.
ADIABATIC = 1.4
#: What is lost of a supply's pressure on the way to the valves: group of the parameters, and state.
DROP = "drop"

_ABSOLUTE = "pressures are absolute: an open tank has 101325 Pa"
_SAGGING = {"resistance": 'resistance = { value = 1, unit = "bar min/l" }', "capacitance": "capacitance = 1e-11"}


class Air(Entry):
    """Bubbles in oil: volume of air per volume of oil at a pressure, and the polytropic exponent of its compression."""

    fraction: Annotated[
        ParameterValue,
        Rule("1", (0.0, 1.0), "a negative share of air is none, and above 1 there would be more air than oil"),
    ]
    exponent: Annotated[
        ParameterValue, Rule("1", (1.0, math.inf), "1 is air that keeps its temperature, 1.4 air that keeps its heat")
    ] = Quantity(value=ADIABATIC)
    reference_pressure: Annotated[ParameterValue, Rule("Pa", TINY, _ABSOLUTE)] = Quantity(value=ATMOSPHERE)


class Oil(Entry):
    """Oil of a hydraulic supply: bulk modulus, vapour pressure and entrained air."""

    bulk_modulus: Annotated[ParameterValue, Rule("Pa", (1e5, math.inf), "less would be oil softer than air at one bar")]
    vapour_pressure: Annotated[
        ParameterValue, Rule("Pa", TINY, "pressures are absolute, and no liquid boils at zero")
    ] = Quantity(value=2000.0)
    air: Air | None = None


class Supply(Component):
    """Pump and tank: two pressures, constant, from the log, or sagging behind a resistance under the drawn flow."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        "pressure": 'pressure = { value = 160, unit = "bar" }',
        "tank_pressure": 'tank_pressure = { value = 1, unit = "bar" }',
        "oil": 'oil = { bulk_modulus = { value = 1.2, unit = "GPa" } }',
        "bulk_modulus": 'bulk_modulus = { value = 1.2, unit = "GPa" }',
        "fraction": "fraction = 0.005",
    }
    CHANNELS: ClassVar[Mapping[str, str]] = {"pressure": "Pa", "flow": "m^3/s"}

    pressure: Annotated[ParameterValue, Rule("Pa", TINY, _ABSOLUTE)]
    tank_pressure: Annotated[ParameterValue, Rule("Pa", TINY, _ABSOLUTE)]
    source: Literal["constant", "logged", "sagging"] = "constant"
    resistance: Annotated[
        ParameterValue | None,
        Rule("Pa s/m^3", TINY, "a supply without resistance does not sag; take source = constant"),
    ] = None
    capacitance: Annotated[ParameterValue | None, Rule("m^3/Pa", TINY, "a pressure needs a volume that stores it")] = (
        None
    )
    oil: Oil

    def problems(self, name: str, structure: Structure) -> Iterator[Problem]:  # noqa: ARG002
        """Problems of a supply: what makes it sag is missing, or given although it does not."""
        for key, example in _SAGGING.items():
            given = getattr(self, key) is not None
            if self.source == "sagging" and not given:
                rest = f"is missing; a sagging supply needs it, for example {example}"
                yield Problem(place("supplies", name, key), rest)
            elif self.source != "sagging" and given:
                rest = f'is given, but a {self.source} supply has none; remove it, or take source = "sagging"'
                yield Problem(place("supplies", name, key), rest)

    def value_problems(self, name: str, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
        """Problems of a supply's values: pumps below their tanks, and tanks in which the oil boils."""
        pump, tank, vapour = (
            parameters[f"{name}.{key}"].value for key in ("pressure", "tank_pressure", "oil.vapour_pressure")
        )
        if not pump > tank:
            rest = f"is {pump:g} Pa, but has to be above the pressure of the tank, {tank:g} Pa; correct one of them"
            yield Problem(place("supplies", name, "pressure"), rest)
        elif not tank > vapour:
            rest = f"is {tank:g} Pa, but the oil boils at {vapour:g} Pa and would in the tank; correct one of them"
            yield Problem(place("supplies", name, "tank_pressure"), rest)

    def states(self, name: str, document: Document) -> Iterator[str]:
        """States of a supply: pressure (Pa) if it sags, and the loss (Pa) on the way to the valves if there is any."""
        if self.source == "sagging":
            yield "pressure"
        if any(EFFECTS[effect.type].group == DROP and effect.at == name for effect in document.effects):
            yield DROP

    def described(self, name: str, structure: Structure, index: Index) -> Described:  # noqa: ARG002
        """What the core reads of a hydraulic supply."""
        air = tuple(Air.model_fields)
        sagging = self.source == "sagging"
        return {
            "name": name,
            "pressure": index[f"{name}.pressure"],
            "tank_pressure": index[f"{name}.tank_pressure"],
            "oil": {
                **numbers(f"{name}.oil", ("bulk_modulus", "vapour_pressure"), index),
                "air": None if self.oil.air is None else numbers(f"{name}.oil.air", air, index),
                "more_air": group(f"{name}.entrained_air", air, index),
            },
            "source": {"sagging": numbers(name, tuple(_SAGGING), index)} if sagging else self.source,
            "drop": group(f"{name}.{DROP}", ("resistance", "time_constant"), index),
        }
