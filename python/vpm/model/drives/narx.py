"""NARX models as drives: terms as they are written, ``effort[k-1]^2*u[k]``, checks, and what the core is told."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from vpm.errors import VpmError, near_match
from vpm.model.component import Described, Index
from vpm.model.drives.sampled import Positive, Sampled
from vpm.model.entry import Number, Text
from vpm.model.messages import Problem, place

if TYPE_CHECKING:
    from vpm.model.structure import Structure

#: Signal and lag.
Factor = tuple[int, int]

#: What a NARX drive computes, in the terms of a file.
OUTPUT = "effort"
#: A pole may be outside of the unit circle by this much: an integrator has one on it, written with rounded numbers.
_ROUNDING = 1e-9
_FACTOR = re.compile(r"(?P<name>[^\[\]^]+)\[k(?:-(?P<lag>\d+))?\](?:\^(?P<power>[1-9]\d?))?")


class Narx(Sampled):
    """Polynomial NARX model whose output is the effort, from a file of `vpm.narx` or term by term."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        **Sampled.EXAMPLES,
        "terms": 'terms = { "effort[k-1]" = 0.9, "u[k]" = 2.5 }',
    }
    SAVED: ClassVar[tuple[str, ...]] = ("terms",)

    type: Literal["narx"]
    sample_time: Positive
    inputs: dict[str, Text] = Field(default_factory=dict)
    terms: dict[str, Number] | None = None
    limit: Positive | None = None
    initial_effort: Number = 0.0
    command_unit: Text = "1"

    @property
    def signals(self) -> tuple[str, ...]:
        """Names in a NARX drive's terms: the output, then the inputs."""
        return (OUTPUT, *self.inputs)

    def read(self, saved: Mapping[str, Any]) -> dict[str, Any]:
        """Fields of a NARX drive from a saved model; the model file's channels and limit take precedence."""
        if OUTPUT in saved["inputs"]:
            raise VpmError(
                f'an input of the model is called "{OUTPUT}" like its output; identify it under another name'
            )
        names, pairs = (OUTPUT, *saved["inputs"]), zip(saved["terms"], saved["coefficients"], strict=True)
        limit = float(saved["limit"]) if self.limit is None and math.isfinite(saved["limit"]) else self.limit
        channels = {name: self.inputs.get(name, name) for name in saved["inputs"]} | self.inputs
        return {
            "terms": {written(term, names): float(value) for term, value in pairs},
            "limit": limit,
            "inputs": channels,
        }

    def problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Problems of a NARX drive: meaningless inputs and terms, unbounded growth, wrong lags."""
        yield from self.lag_problems(name, structure)
        known = _readable(name, structure)
        for key, channel in self.inputs.items():
            where = place("actuators", name, "inputs", key)
            if key == OUTPUT:
                yield Problem(where, "has the name of the output; give the input another one")
            elif channel not in known:
                repair = near_match(channel, known, what="it can read")
                yield Problem(where, f'is "{channel}", which a NARX drive cannot read; {repair}')
        if self.terms:
            yield from self._term_problems(name, self.terms)
        else:
            rest = f"is missing; add it, for example {self.EXAMPLES['terms']}, or file with a saved model"
            yield Problem(place("actuators", name, "terms"), rest)

    def _term_problems(self, name: str, terms: Mapping[str, float]) -> Iterator[Problem]:
        seen: dict[tuple[Factor, ...], str] = {}
        for text in terms:
            where = place("actuators", name, "terms", text)
            try:
                factors = factors_of(text, self.signals)
            except ValueError as error:
                yield Problem(where, str(error))
                continue
            if factors in seen:
                yield Problem(where, f'is the same term as "{seen[factors]}"; add their coefficients and remove one')
            seen.setdefault(factors, text)
        if len(seen) < len(terms):
            return
        found = poles(tuple(seen), tuple(terms.values()))
        if found is not None and np.any(np.abs(found) > 1.0 + _ROUNDING):
            worst = found[np.argmax(np.abs(found))]
            size = f"{worst.real:.4g}" if worst.imag == 0.0 else f"{worst.real:.4g} ± {abs(worst.imag):.4g} j"
            rest = (
                f"give the pole {size}, of magnitude {abs(worst):.4g} above 1, so that the effort grows without bound "
            )
            rest += "from any start; identify the model anew, for example with fewer lags of the output"
            yield Problem(place("actuators", name, "terms"), rest)

    def law(self, name: str, structure: Structure, index: Index) -> Described:  # noqa: ARG002
        """What the core reads of the law of a NARX drive."""
        terms = self.terms or {}
        return {
            "sample_time": self.sample_time,
            "inputs": [[key, _reading(name, channel, structure)] for key, channel in self.inputs.items()],
            "terms": [[list(factor) for factor in factors_of(text, self.signals)] for text in terms],
            "coefficients": list(terms.values()),
            "limit": self.limit,
            "initial": self.initial_effort,
        }


def _readable(name: str, structure: Structure) -> tuple[str, ...]:
    """Channels that a NARX drive may read: its own command, and how joints, transmissions and lines move."""
    turning = (*structure.joints, *structure.document.transmissions)
    joints = (f"{joint}.{kind}" for joint in turning for kind in ("position", "velocity"))
    lines = (f"{line}.{kind}" for line in structure.document.lines for kind in ("length", "rate"))
    return (f"{name}.command", *joints, *lines)


def _reading(name: str, channel: str, structure: Structure) -> str | dict[str, int]:
    owner, _, kind = channel.rpartition(".")
    if owner == name:
        return "command"
    if owner in structure.joints:
        return {kind: structure.joints.index(owner)}
    of_lines = {"position": "length", "velocity": "rate"}
    return {of_lines.get(kind, kind): structure.wires.index(owner)}


def written(term: Sequence[Factor], names: Sequence[str]) -> str:
    """Text of a NARX term whose factors are (signal, lag); ``names`` of signals, the output's first."""
    factors = []
    for (signal, lag), same in groupby(sorted(term)):
        count = len(list(same))
        text = f"{names[signal]}[k-{lag}]" if lag else f"{names[signal]}[k]"
        factors.append(text if count == 1 else f"{text}^{count}")
    return "*".join(factors) or "1"


def factors_of(text: str, names: Sequence[str]) -> tuple[Factor, ...]:
    """Factors of a written NARX term."""
    if text.strip() == "1":
        return ()
    factors: list[Factor] = []
    for part in text.split("*"):
        found = _FACTOR.fullmatch(part.strip())
        if found is None:
            raise ValueError(
                f'has the factor "{part.strip()}", which is no lagged signal; write "{names[0]}[k-1]", '
                f'"{names[-1]}[k]^2" or products of such, and "1" for the constant'
            )
        name, lag = found["name"].strip(), int(found["lag"] or 0)
        if name not in names:
            known = ", ".join(f'"{known}"' for known in names)
            raise ValueError(f'names the signal "{name}", but the signals are {known}; add it to inputs or correct it')
        if name == names[0] and lag == 0:
            raise ValueError("contains the effort that it is to compute; let its lags begin at 1")
        factors += [(names.index(name), lag)] * int(found["power"] or 1)
    return tuple(sorted(factors))


def poles(terms: Sequence[Sequence[Factor]], coefficients: Sequence[float]) -> np.ndarray | None:
    """Poles of a NARX model linear in its past: roots of ``z^n - a_1 z^(n-1) - ... - a_n``.

    Result: None where a product contains the output, so that no fixed poles decide whether it stays bounded.
    """
    past = [(term, value) for term, value in zip(terms, coefficients, strict=True) if any(s == 0 for s, _ in term)]
    if any(len(term) > 1 for term, _ in past):
        return None
    polynomial = np.zeros(1 + max((term[0][1] for term, _ in past), default=0))
    polynomial[0] = 1.0
    for term, value in past:
        polynomial[term[0][1]] -= value
    return np.roots(polynomial)
