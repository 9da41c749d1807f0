"""Form of the drives in sampled time in a model file: NARX models, and the Maxwell element as a difference equation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from vpm.model.entry import Entry, Number, Text

#: Coefficients of a polynomial in two variables, by its total degree.
SIZES: Mapping[int, int] = {1: 0, 3: 1, 6: 2, 10: 3}
#: What a NARX drive computes, in the terms of a file.
OUTPUT = "effort"


def _positive(value: float) -> float:
    if not value > 0.0:
        raise ValueError(f"is {value:g}, but has to be above 0; correct the value")
    return value


def _as_list(value: object) -> object:
    """Turn a bare number into the constant of a polynomial."""
    return [value] if isinstance(value, int | float) and not isinstance(value, bool) else value


def _complete(value: tuple[float, ...]) -> tuple[float, ...]:
    if len(value) not in SIZES:
        raise ValueError(
            f"has {len(value)} coefficients, but a polynomial of degree 0, 1, 2 or 3 in u and s has 1, 3, 6 or 10; "
            "give zeros for the powers that are not there"
        )
    return value


Positive = Annotated[Number, AfterValidator(_positive)]
Map = Annotated[tuple[Number, ...], BeforeValidator(_as_list), AfterValidator(_complete)]


class Narx(Entry):
    """Polynomial NARX model whose output is the effort, from a file of `vpm.narx` or term by term."""

    type: Literal["narx"]
    joint: Text | None = None
    line: Text | None = None
    transmission: Text | None = None
    sample_time: Positive
    file: Text | None = None
    inputs: dict[str, Text] = Field(default_factory=dict)
    terms: dict[str, Number] | None = None
    limit: Positive | None = None
    initial_effort: Number = 0.0
    command_unit: Text = "1"


class MaxwellNarx(Entry):
    """Maxwell element beside a spring in sampled time, with maps k0 and s0 of command u and length s."""

    type: Literal["maxwell_narx"]
    joint: Text | None = None
    line: Text | None = None
    transmission: Text | None = None
    sample_time: Positive | None = None
    file: Text | None = None
    k0: Map | None = None
    s0: Map | None = None
    k1: Positive | None = None
    c1: Positive | None = None
    scheme: Literal["trapezoidal", "printed", "central_mean"] = "trapezoidal"
    limit: Positive | None = None
    command_unit: Text = "1"


#: Drives that act at samples of their own.
SAMPLED = (Narx, MaxwellNarx)

#: How a key is written, for messages about missing ones.
EXAMPLES: Mapping[str, str] = {
    "actuators.sample_time": "sample_time = 1e-3",
    "actuators.terms": 'terms = { "effort[k-1]" = 0.9, "u[k]" = 2.5 }',
    "actuators.k0": "k0 = 1e5",
    "actuators.s0": "s0 = 0.3",
    "actuators.k1": "k1 = 5e5",
    "actuators.c1": "c1 = 2e3",
}
