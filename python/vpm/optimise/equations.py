"""The equations of a model as CasADi expressions, read from the C that `vpm.realtime.c_source` writes.

The C of a model is a list of assignments, one operation each. Read into CasADi's own graph, they give first and second
derivatives that are exact and sparse, and need no C compiler.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from vpm.errors import OptimisationError, needs
from vpm.model import Model
from vpm.realtime import c_source

#: A CasADi expression; the library ships no types.
Expression = Any

_NAME = "machine"
_ASSIGNMENT = re.compile(r"\s+(?:const double )?(?P<name>\w+)(?:\[(?P<place>\d+)\])? = (?P<what>.*);")
_CHOICE = re.compile(r"(\S+) < (\S+) \? (\S+) : (\S+)")
_BINARY = re.compile(r"(\S+) ([-+*/]) (\S+)")
_CALL = re.compile(r"(\w*)\(([^(),]+)\)")
_IGNORED = re.compile(r"\s+\(void\)\w+;|\s*")


def casadi() -> ModuleType:
    """CasADi library, for equations."""
    with needs("casadi", "optimise"):
        import casadi as library
    return library  # type: ignore[no-any-return, unused-ignore]


@dataclass(frozen=True)
class Equations:
    """Equations of a model as CasADi expressions."""

    #: Names; commands are channels too, ``motor.command``.
    states: tuple[str, ...]
    commands: tuple[str, ...]
    channels: tuple[str, ...]
    state_units: tuple[str, ...]
    channel_units: tuple[str, ...]
    #: Symbols, shapes (nx,) and (nu,).
    x: Expression
    u: Expression
    #: Shapes (nx,) and (ny,).
    rates: Expression
    outputs: Expression


def equations(model: Model) -> Equations:
    """Equations of a model as CasADi expressions, from its C source."""
    ca = casadi()
    source = c_source(model, name=_NAME).source
    x, u = ca.SX.sym("x", len(model.state_names)), ca.SX.sym("u", len(model.inputs))
    commands = tuple(model.input_channels)
    return Equations(
        states=tuple(model.state_names),
        commands=commands,
        channels=tuple(model.output_channels),
        state_units=tuple(model.state_units),
        channel_units=tuple(model.channel_unit(name) for name in model.output_channels),
        x=x,
        u=u,
        rates=_read(model, source, "rates", "dx", (x, u), len(model.state_names)),
        outputs=_read(model, source, "outputs", "y", (x, u), len(model.output_channels)),
    )


def _read(
    model: Model, source: str, function: str, result: str, inputs: tuple[Expression, Expression], size: int
) -> Expression:
    """Equations of a generated C function as a CasADi expression, over all its pieces."""
    ca = casadi()
    arrays: dict[str, Any] = {"x": inputs[0].elements(), "u": inputs[1].elements(), "w": {}, result: {}}
    pieces = re.finditer(rf"static void {_NAME}_run_{function}(?:_\d+)?\([^)]*\)\n\{{\n(.*?)^\}}", source, re.S | re.M)
    for piece in pieces:
        terms = _Terms(ca, arrays)
        for line in piece[1].splitlines():
            if _IGNORED.fullmatch(line) or line.lstrip().startswith(f"{_NAME}_run_"):
                continue
            found = _ASSIGNMENT.fullmatch(line)
            value = terms.expression(found["what"]) if found else None
            if found is None or value is None:
                raise OptimisationError(
                    f"{model.name}: a law of the model searches for its value ({line.strip()[:60]}), and an "
                    "optimisation needs laws with derivatives; replace that effect"
                )
            if found["place"] is None:
                terms.local[found["name"]] = value
            else:
                arrays[found["name"]][int(found["place"])] = value
    return ca.vertcat(*(arrays[result].get(place, ca.SX(0.0)) for place in range(size)))


class _Terms:
    """Reads the right side of an assignment."""

    def __init__(self, ca: ModuleType, arrays: dict[str, Any]) -> None:
        self.ca, self.arrays = ca, arrays
        self.local: dict[str, Expression] = {}
        self._functions: dict[str, Callable[[Expression], Expression]] = {
            **{name: getattr(ca, name) for name in ("sqrt", "exp", "expm1", "log", "sin", "cos", "tanh", "atan")},
            "": lambda value: value,  # what derivatives of a simulation take for a constant
        }

    def expression(self, text: str) -> Expression | None:
        """Expression in the equations: ``a < b ? c : d``, ``a + b``, ``f(a)``, ``-a`` or ``a``; None for others."""
        if found := _CHOICE.fullmatch(text):
            a, b, yes, no = map(self._term, found.groups())
            return self.ca.if_else(a < b, yes, no)
        if found := _BINARY.fullmatch(text):
            a, b = self._term(found[1]), self._term(found[3])
            return {"+": a.__add__, "-": a.__sub__, "*": a.__mul__, "/": a.__truediv__}[found[2]](b)
        if (found := _CALL.fullmatch(text)) and found[1] in self._functions:
            return self._functions[found[1]](self._term(found[2]))
        return None if "(" in text and "INFINITY" not in text else self._term(text)

    def _term(self, text: str) -> Expression:
        if text.startswith("-"):
            return -self._term(text[1:])
        if text in self.local:
            return self.local[text]
        if text.endswith("]"):
            name, place = text[:-1].split("[")
            return self.arrays[name][int(place)]
        number = text.strip("()").replace("INFINITY", "inf").replace("NAN", "nan")
        return self.ca.SX(float(number))
