"""The Maxwell element beside a spring as a difference equation, with maps of command and length."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BeforeValidator

from vpm.errors import VpmError
from vpm.model.component import Described, Index
from vpm.model.drives.sampled import Positive, Sampled
from vpm.model.entry import Number, Text
from vpm.model.messages import Problem, place

if TYPE_CHECKING:
    from vpm.model.structure import Structure

#: Numbers of coefficients of a polynomial in two variables of degree 0, 1, 2 and 3.
SIZES = (1, 3, 6, 10)
#: A saved sample time may differ from the one of the model file by this share: numbers in files are rounded.
_SLACK = 1e-9


def _as_list(value: object) -> object:
    """Turn a bare number into the constant of a Maxwell element's polynomial."""
    return [value] if isinstance(value, int | float) and not isinstance(value, bool) else value


def _complete(value: tuple[float, ...]) -> tuple[float, ...]:
    if len(value) not in SIZES:
        raise ValueError(
            f"has {len(value)} coefficients, but a polynomial of degree 0, 1, 2 or 3 in u and s has 1, 3, 6 or 10; "
            "give zeros for the powers that are not there"
        )
    return value


Map = Annotated[tuple[Number, ...], BeforeValidator(_as_list), AfterValidator(_complete)]


class MaxwellNarx(Sampled):
    """Maxwell element beside a spring in sampled time, with maps k0 and s0 of command u and length s."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        **Sampled.EXAMPLES,
        "k0": "k0 = 1e5",
        "s0": "s0 = 0.3",
        "k1": "k1 = 5e5",
        "c1": "c1 = 2e3",
    }
    STRAIGHT: ClassVar[bool] = True
    SAVED: ClassVar[tuple[str, ...]] = ("k0", "s0", "k1", "c1")

    type: Literal["maxwell_narx"]
    k0: Map | None = None
    s0: Map | None = None
    k1: Positive | None = None
    c1: Positive | None = None
    scheme: Literal["trapezoidal", "printed", "central_mean"] = "trapezoidal"
    limit: Positive | None = None
    command_unit: Text = "1"

    def read(self, saved: Mapping[str, Any]) -> dict[str, Any]:
        """Fields of a Maxwell element from a saved result."""
        given, step = self.sample_time, float(saved["step"])
        if given is not None and abs(given - step) > _SLACK * step:
            raise VpmError(
                f"its element is sampled every {step:g} s, but sample_time is {given:g} s; remove sample_time, or fit "
                "the element at the other step"
            )
        maps = {key: _short([float(value) for value in saved[key]]) for key in ("k0", "s0")}
        numbers = {key: float(saved[key]) for key in ("k1", "c1")}
        return {**maps, **numbers, "scheme": saved["scheme"], "sample_time": step}

    def problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Problems of a Maxwell element: missing numbers, lags and joints that do not fit."""
        yield from self.lag_problems(name, structure)
        for key in self.EXAMPLES:
            if getattr(self, key) is None:
                rest = f"is missing; add it, for example {self.EXAMPLES[key]}, or file with a saved element"
                yield Problem(place("actuators", name, key), rest)
        if self.joint in structure.joints:
            kind = structure.joint_kind(str(self.joint))
            if kind != "prismatic":
                rest = f'is a maxwell_narx on the {kind} joint "{self.joint}", but it has a length; '
                yield Problem(place("actuators", name), f"{rest}put it on a line, or on a prismatic joint")

    def law(self, name: str, structure: Structure, index: Index) -> Described:  # noqa: ARG002
        """What the core reads of the law of a Maxwell-NARX drive; all its numbers are there."""
        law: Described = {key: getattr(self, key) for key in ("sample_time", *self.SAVED, "scheme", "limit")}
        for key in ("k0", "s0"):
            law[key] = [*law[key], *[0.0] * (SIZES[-1] - len(law[key]))]
        return law


def _short(coefficients: list[float]) -> tuple[float, ...]:
    """Coefficients of a Maxwell element's map without the degrees that are all zero."""
    return tuple(coefficients[: next(size for size in SIZES if not any(coefficients[size:]))])
