"""How the columns of a log map on the channels of a model: ``[channels]`` of a model file, or a file of its own.

The value of a channel is ``scale column + offset``, in ``unit``; the samples are stamped ``delay`` seconds late.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from vpm.errors import UnitError, near_match
from vpm.expression import read_expression
from vpm.model.entry import Number, Switch, Text
from vpm.model.messages import Problem, place
from vpm.units import parse_unit, require_dimension

if TYPE_CHECKING:
    from vpm.model.schema import Document
    from vpm.model.structure import Structure


#: Arguments of functions that take jumps out of a column, between which nothing can be interpolated.
_OF_JUMPS = r"\b(?:unwrap|zeroed)\(([^()]*)\)"


def _not_zero(value: float) -> float:
    if value == 0.0:
        raise ValueError("is 0, which would erase the column; give another factor")
    return value


def _readable(unit: str) -> str:
    parse_unit(unit)
    return unit


class ColumnPart(BaseModel):
    """Column that a value is built from; as a name alone it holds pure numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    column: Text
    unit: Annotated[Text, AfterValidator(_readable)] = "1"
    delay: Number = 0.0  #: How late its samples are stamped against those of the other columns (s).


def _part(given: object) -> object:
    return {"column": given} if isinstance(given, str) else given


def _expression(text: str) -> str:
    if text:
        read_expression(text)
    return text


class ChannelEntry(BaseModel):
    """Column of a log that holds one channel, or columns that it is built from."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    column: str = ""  #: Name of the column; none where there is a `value`.
    #: Expression over `columns`, worked out in SI; see `vpm.expression`.
    value: Annotated[str, AfterValidator(_expression)] = ""
    #: Column of each name in `value`.
    columns: dict[str, Annotated[ColumnPart, BeforeValidator(_part)]] = Field(default_factory=dict)
    #: Unit of ``scale column + offset``; a `value` has to be of its kind.
    unit: Annotated[Text, AfterValidator(_readable)]
    scale: Annotated[Number, AfterValidator(_not_zero)] = 1.0  #: Factor on the numbers of the column.
    offset: Number = 0.0  #: Added after the scaling, in `unit`.
    delay: Number = 0.0  #: How late the samples are stamped (s).
    optional: Switch = False  #: A log without the column holds zeros here.

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        """Check that a channel is a column, or a value over columns that it names all."""
        if bool(self.column) == bool(self.value):
            raise ValueError("needs either a column, or a value over columns; give one of them")
        named = set(read_expression(self.value).names) if self.value else set()
        for name in sorted(named.symmetric_difference(self.columns)):
            if name in self.columns:
                raise ValueError(f'has columns.{name}, which its value "{self.value}" does not name; leave it out')
            raise ValueError(f'has the value "{self.value}", but columns has no {name}; name its column')
        jumping = {name for inner in re.findall(_OF_JUMPS, self.value) for name in re.findall(r"\w+", inner)}
        for name in sorted(jumping & {name for name, part in self.columns.items() if part.delay}):
            raise ValueError(f'has a delay of columns.{name}, which jumps in "{self.value}"; delay the whole channel')
        return self

    @property
    def parts(self) -> dict[str, ColumnPart]:
        """Columns of a channel by the names that its value has for them; one column alone is ``""``."""
        return self.columns or {"": ColumnPart(column=self.column, unit=self.unit)}

    @property
    def told(self) -> str:
        """Sentence on what a channel is read from."""
        return f'value "{self.value}"' if self.value else f'column "{self.column}"'


def channel_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Channels that are none of the model, and columns in other units."""
    known = ("time", *structure.channels)
    for name, entry in (document.channels or {}).items():
        if name not in known and name not in structure.deflections:
            yield Problem(place("channels", name), f"is no channel of the model; {_repair(name, known, document)}")
            continue
        try:
            require_dimension(entry.unit, "s" if name == "time" else structure.unit(name))
        except UnitError as error:
            yield Problem(place("channels", name, "unit"), f"is wrong: {error}")


def _repair(name: str, known: Sequence[str], document: Document) -> str:
    """Repair of a name that is no channel: one of the same component, or what that may have in its place."""
    owner = name.rpartition(".")[0]
    if own := [channel for channel in known if channel.rpartition(".")[0] == owner]:
        return near_match(name, own, what=f"{owner} has")
    if owner in document.bodies or owner in document.beams:
        return f"{owner} has none; a joint has its motion, a marker on {owner} its place, a gauge on a beam its strain"
    return near_match(name, known, what="its channels are")
