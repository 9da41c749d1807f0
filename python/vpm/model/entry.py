"""What every table of a model file is made of: numbers, texts, vectors, and parameters with their units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

#: A finite number; text and booleans are refused.
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
#: A number that may be infinite: bounds, and the uncertainty of what is not known beforehand. NaN is refused later.
WideNumber = Annotated[float, Field(strict=True)]
#: Yes or no; numbers are refused.
Switch = Annotated[bool, Field(strict=True)]
Text = Annotated[str, Field(strict=True, min_length=1)]
Vector = Annotated[tuple[Number, ...], Field(min_length=3, max_length=3)]


class Entry(BaseModel):
    """A table of a model file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class Quantity(Entry):
    """Value of a parameter as it stands in the file; a missing unit means SI."""

    value: Number
    unit: Text | None = None
    uncertainty: WideNumber | None = None
    minimum: WideNumber | None = Field(default=None, alias="min")
    maximum: WideNumber | None = Field(default=None, alias="max")

    def mapped(self, change: Callable[[float], float], unit: str | None) -> Quantity:
        """Entry in another unit, with value, uncertainty and limits changed by a function."""
        value, *others = (self.value, self.uncertainty, self.minimum, self.maximum)
        spread, low, high = (None if number is None else change(number) for number in others)
        return Quantity(value=change(value), unit=unit, uncertainty=spread, minimum=low, maximum=high)


def _as_table(value: object) -> object:
    """Turn a bare number into a table entry with nothing but the value."""
    if isinstance(value, Mapping | Quantity):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool):
        return {"value": value}
    raise ValueError('has to be a number or a table like { value = 1.0, unit = "kg" }')


ParameterValue = Annotated[Quantity, BeforeValidator(_as_table)]
ZERO = Quantity(value=0.0)
ONE = Quantity(value=1.0)
ORIGIN = (0.0, 0.0, 0.0)
