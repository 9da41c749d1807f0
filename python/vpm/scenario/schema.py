"""Form of a scenario file: which keys there are and what kind of value each takes.

Only form is checked here. What needs the models of the runs to judge (channels, units, actuators) comes after.
"""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, Field

from vpm.errors import UnitError
from vpm.model.effects import EffectEntry
from vpm.model.entry import Entry, Number, Text
from vpm.scenario.messages import Keys, refuse
from vpm.simulate import AUTOMATIC
from vpm.units import convert


class Given(Entry):
    """A number with its unit; a missing unit means SI."""

    value: Number
    unit: Text | None = None


class Listed(Entry):
    """Numbers with one unit; a missing unit means SI."""

    value: Annotated[tuple[Number, ...], Field(min_length=1)]
    unit: Text | None = None


def _as_given(value: object) -> object:
    if isinstance(value, Mapping | Given):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool):
        return {"value": value}
    raise ValueError('has to be a number or a table like { value = 40.0, unit = "deg" }')


def _as_listed(value: object) -> object:
    if isinstance(value, Mapping | Listed):
        return value
    if isinstance(value, list | tuple):
        return {"value": value}
    raise ValueError('has to be a list of numbers or a table like { value = [0.0, 40.0], unit = "deg" }')


Value = Annotated[Given, BeforeValidator(_as_given)]
Values = Annotated[Listed, BeforeValidator(_as_listed)]
NOTHING = Given(value=0.0)


class Constant(Entry):
    """The same value all the time."""

    type: Literal["constant"]
    value: Value


class Sine(Entry):
    """``mean + amplitude sin(2 pi frequency (t - start) + phase)``, before ``start`` as at ``start``."""

    type: Literal["sine"]
    mean: Value = NOTHING
    amplitude: Value
    frequency: Value
    phase: Value = NOTHING
    start: Value = NOTHING


class Chirp(Entry):
    """A sine whose frequency grows evenly from one to another over the duration."""

    type: Literal["chirp"]
    mean: Value = NOTHING
    amplitude: Value
    first: Value = Field(alias="from")
    last: Value = Field(alias="to")


class Points(Entry):
    """Straight lines between points; held before the first and after the last; equal times are a jump."""

    type: Literal["points"]
    time: Values
    value: Values


Signal = Annotated[Constant | Sine | Chirp | Points, Field(discriminator="type")]
SIGNALS: Mapping[str, type[BaseModel]] = {"constant": Constant, "sine": Sine, "chirp": Chirp, "points": Points}


class RunEntry(Entry):
    """One run: a model file, with a few changes."""

    name: Text
    model: Text
    level: Text | dict[str, Text] | None = None
    set: dict[str, Value] = Field(default_factory=dict)
    with_effects: tuple[EffectEntry, ...] = ()


class PlotEntry(Entry):
    """What the picture shows: one list of channels for each panel; columns of runs stand side by side."""

    panels: Annotated[tuple[Annotated[tuple[Text, ...], Field(min_length=1)], ...], Field(min_length=1)]
    columns: dict[str, Annotated[tuple[Text, ...], Field(min_length=1)]] = Field(default_factory=dict)


class Document(Entry):
    """A whole scenario file."""

    scenario: Text
    duration: Value
    time_step: Value
    integrator: Text = AUTOMATIC
    substeps: Annotated[int, Field(strict=True, ge=1)] = 1
    initial: dict[str, Value] = Field(default_factory=dict)
    references: dict[str, Signal] = Field(default_factory=dict)
    commands: dict[str, Signal] = Field(default_factory=dict)
    supplies: dict[str, Signal] = Field(default_factory=dict)
    runs: Annotated[tuple[RunEntry, ...], Field(min_length=1)]
    plot: PlotEntry | None = None


#: Tables of signals, by the name of what each drives.
INPUTS = ("references", "commands", "supplies")


def si_value(given: Given, unit: str, keys: Keys) -> float:
    """SI value of a number that should be in a unit of this kind."""
    if given.unit is None:
        return given.value
    try:
        return convert(given.value, given.unit, unit)
    except UnitError as error:
        refuse(keys, f"is wrong: {error}")
