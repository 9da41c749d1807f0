"""Variables of an FMU: their names, references, units, and what depends on what."""

import re
import sys
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vpm.errors import SimulationError
from vpm.model import Model
from vpm.realtime.source import CSource

Causality = Literal["independent", "input", "local", "output", "parameter"]


@dataclass(frozen=True)
class Variable:
    """One variable of an FMU."""

    name: str
    reference: int  #: Its value reference.
    causality: Causality
    unit: str = "1"  #: SI unit, ``"1"`` for none.
    start: float | None = None  #: None where the value is worked out.
    bounds: tuple[float, float] | None = None  #: Outside of them the FMU refuses the value.
    derivative_of: int | None = None  #: Reference of the state whose rate it is.


@dataclass(frozen=True)
class Variables:
    """All variables of an FMU, kind by kind, and the dependencies of those that are worked out."""

    time: Variable
    #: Outputs that show what an input holds are left out.
    inputs: tuple[Variable, ...]
    states: tuple[Variable, ...]
    rates: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    parameters: tuple[Variable, ...]
    #: By the reference of a rate or output: the inputs and states that change it, and the parameters that do.
    dependencies: Mapping[int, tuple[tuple[int, ...], tuple[int, ...]]]

    @property
    def all(self) -> tuple[Variable, ...]:
        """All variables of an FMU, in the order of references."""
        return (self.time, *self.inputs, *self.states, *self.rates, *self.outputs, *self.parameters)


def variables(model: Model, written: CSource, start: NDArray[np.float64]) -> Variables:
    """List the variables of a model that was written in C.

    ``start``: shape (nx,), state to begin in.
    """
    nu, nx, ny = len(model.inputs), len(model.state_names), len(model.output_channels)
    first_state = 1 + nu
    first_rate = first_state + nx
    first_output = first_rate + nx
    first_parameter = first_output + ny
    held, channels = model.command(), model.input_channels
    inputs = [
        Variable(name, 1 + place, "input", model.channel_unit(name), float(held[place]))
        for place, name in enumerate(channels)
    ]
    states, rates = [], []
    for place, (name, unit) in enumerate(zip(model.state_names, model.state_units, strict=True)):
        own, value = first_state + place, float(start[place])
        states.append(Variable(f"state.{name}", own, "local", unit, value))
        rate = unit.replace("/s", "/s^2") if unit.endswith("/s") else _rate(unit)
        rates.append(Variable(f"der(state.{name})", first_rate + place, "local", rate, derivative_of=own))
    outputs = [
        Variable(name, first_output + place, "output", model.channel_unit(name))
        for place, name in enumerate(model.output_channels)
        if name not in channels
    ]
    parameters = []
    for place, name in enumerate(written.parameters):
        p = model.parameters[name]
        bounds = (max(p.minimum, -sys.float_info.max), min(p.maximum, sys.float_info.max))
        parameters.append(Variable(name, first_parameter + place, "parameter", p.unit, p.value, bounds))
    knowns = {"x": first_state, "u": 1, "p": first_parameter}
    dependencies = {
        **_dependencies(written, "rates", first_rate, nx, knowns),
        **_dependencies(written, "outputs", first_output, ny, knowns),
    }
    found = Variables(
        Variable("time", 0, "independent", "s"),
        tuple(inputs),
        tuple(states),
        tuple(rates),
        tuple(outputs),
        tuple(parameters),
        dependencies,
    )
    _check_names(found)
    return found


def _rate(unit: str) -> str:
    """Unit of an FMU variable's change with time."""
    above, _, below = unit.partition("/")
    if not below:
        return f"{above}/s"
    return f"{above}/({below.strip('()')} s)"


def _dependencies(
    written: CSource, what: str, first: int, count: int, knowns: Mapping[str, int]
) -> dict[int, tuple[tuple[int, ...], tuple[int, ...]]]:
    """Dependencies of an FMU's rates and output variables on knowns, from their derivatives."""
    found: dict[int, tuple[list[int], list[int]]] = {first + row: ([], []) for row in range(count)}
    for kind, begin in knowns.items():
        for row, column in written.entries(what, kind):
            found[first + row][kind == "p"].append(begin + column)
    return {reference: (tuple(sorted(own)), tuple(sorted(free))) for reference, (own, free) in found.items()}


def _check_names(found: Variables) -> None:
    names = Counter(variable.name for variable in found.all)
    if twice := [name for name, count in names.items() if count > 1]:
        raise SimulationError(f"two variables of the FMU are called `{twice[0]}`; rename a joint or a drive")
    if odd := [name for name in names if re.search(r"[\x00-\x1f]", name)]:
        raise SimulationError(f"{odd[0]!r} has a control character, which an FMU cannot hold; rename it")
