"""Expressions over columns of numbers, such as ``left - right``: read without running anything, units checked."""

import ast
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from vpm.errors import VpmError, near_match
from vpm.numbers import Array
from vpm.units import BASE_UNITS, Power, Unit

#: Expressions with more characters mean nothing.
LONGEST = 300
#: Powers beyond this mean nothing either.
LARGEST_POWER = 99

PURE: tuple[Power, ...] = (0,) * len(BASE_UNITS)


class Quantity(NamedTuple):
    """Numbers in SI with their dimension."""

    values: Array  #: Shape (N,) or ().
    dimension: tuple[Power, ...] = PURE  #: Powers of `vpm.units.BASE_UNITS`.


def unwrap(angle: Array, period: Array) -> Array:
    """Expression's angle or count without jumps at the ends of its range.

    ``angle``, ``period``: shape (N,) and (), two samples must be less than half a period apart.
    """
    return np.asarray(np.unwrap(angle, period=float(period)), dtype=np.float64)


def zeroed(count: Array, index: Array) -> Array:
    """Expression's encoder count from its index pulse on, less the first one.

    ``count``, ``index``: shape (N,), the pulse is high above half of its range. One that is high at the first sample
    began before.

    Raises `VpmError`: there is no pulse.
    """
    high = index > 0.5 * (index.min() + index.max())
    rises = np.flatnonzero(high[1:] & ~high[:-1])
    if not rises.size:
        raise VpmError("has no index pulse in this record; record one, or map the count by itself")
    return np.asarray(count - count[rises[0] + 1], dtype=np.float64)


class _Function(NamedTuple):
    """A function: fewest and most arguments, whether all are of one kind or pure numbers, and of what kind it is."""

    of: Callable[..., Array]
    fewest: int
    most: int
    pure_in: bool
    pure_out: bool


def _pure(of: Callable[..., Array], most: int = 1) -> _Function:
    return _Function(of, most, most, pure_in=True, pure_out=True)


def _alike(of: Callable[..., Array], fewest: int, most: int) -> _Function:
    return _Function(of, fewest, most, pure_in=False, pure_out=False)


def _mean(*columns: Array) -> Array:
    return np.asarray(sum(columns) / len(columns), dtype=np.float64)


def _largest(*columns: Array) -> Array:
    return np.asarray(np.maximum.reduce(np.broadcast_arrays(*columns)), dtype=np.float64)


def _smallest(*columns: Array) -> Array:
    return np.asarray(np.minimum.reduce(np.broadcast_arrays(*columns)), dtype=np.float64)


FUNCTIONS: Mapping[str, _Function] = {
    **{name: _pure(getattr(np, name)) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "log10")},
    "asin": _pure(np.arcsin),
    "acos": _pure(np.arccos),
    "atan": _pure(np.arctan),
    "atan2": _Function(np.arctan2, 2, 2, pure_in=False, pure_out=True),
    "abs": _alike(np.abs, 1, 1),
    "hypot": _alike(np.hypot, 2, 2),
    "mean": _alike(_mean, 2, 99),
    "max": _alike(_largest, 2, 99),
    "min": _alike(_smallest, 2, 99),
}
#: Functions with rules of their own.
OWN = ("sqrt", "pow", "unwrap", "zeroed")
CONSTANTS: Mapping[str, float] = {"pi": math.pi}


@dataclass(frozen=True)
class Expression:
    """An expression that was read."""

    text: str
    names: tuple[str, ...]  #: What it names beside constants, in order of first use.
    _tree: ast.expr

    def __call__(self, parts: Mapping[str, Quantity]) -> Quantity:
        """Value of an expression over columns.

        ``parts``: one for each of `names`.
        """
        try:
            with np.errstate(all="ignore"):
                return _value(self._tree, parts)
        except VpmError as error:
            raise VpmError(f'"{self.text}" {error}') from None


def read_expression(text: str) -> Expression:
    """Read an expression over columns of a log.

    ``text``: names of columns, numbers and ``pi`` with ``+ - * /``, constant powers (``x**2``) and functions.
    """
    if len(text) > LONGEST:
        raise VpmError(f'"{text[:30]}..." has {len(text)} characters, but {LONGEST} are the most; write it shorter')
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        told = getattr(error, "msg", None) or "it is nested too deeply"
        raise VpmError(f'"{text}" is no expression ({told}); write it as "left - right"') from None
    names: dict[str, None] = {}
    _check(tree, names, text)
    if not names:
        raise VpmError(f'"{text}" names no column; name at least one')
    return Expression(text, tuple(names), tree)


def _check(node: ast.expr, names: dict[str, None], text: str) -> None:
    """Refuse whatever is not known in an expression, and collect names."""
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool) and _is_finite(number):
            return None
        case ast.Name(id=name):
            if name not in CONSTANTS:
                names[name] = None
            return None
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
            return _check(operand, names, text)
        case ast.BinOp(left=base, op=ast.Pow(), right=power) if _exponent(power) is not None:
            return _check(base, names, text)
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div(), right=right):
            _check(left, names, text)
            return _check(right, names, text)
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS or name in OWN:
            _check_count(name, arguments, text)
            for argument in arguments:
                _check(argument, names, text)
            return None
    known = ", ".join([*FUNCTIONS, *OWN])
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        known = near_match(node.func.id, [*FUNCTIONS, *OWN], what="there are")
    raise VpmError(
        f'"{text}" has "{ast.unparse(node)[:60]}", which is not known; '
        f"use + - * /, constant powers, and functions ({known})"
    )


def _check_count(name: str, arguments: Sequence[ast.expr], text: str) -> None:
    own = {"sqrt": (1, 1), "pow": (2, 2), "unwrap": (1, 2), "zeroed": (2, 2)}
    fewest, most = own[name] if name in own else FUNCTIONS[name][1:3]
    if not fewest <= len(arguments) <= most:
        wanted = f"{fewest}" if fewest == most else f"{fewest} to {most}"
        raise VpmError(f'"{text}" gives {name} {len(arguments)} arguments; it takes {wanted}')
    if name == "pow" and _exponent(arguments[1]) is None:
        raise VpmError(f'"{text}" has a power that is no number up to {LARGEST_POWER}; write one')


def _is_finite(number: float) -> bool:
    try:
        return math.isfinite(float(number))
    except OverflowError:
        return False


def _exponent(node: ast.expr) -> float | None:
    """Exponent number of an expression's power, or None."""
    match node:
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant() as inner):
            number = _exponent(inner)
            return None if number is None else -number
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            return float(number) if _is_finite(number) and abs(number) <= LARGEST_POWER else None
    return None


def _scalar(number: float) -> Quantity:
    return Quantity(np.asarray(number, dtype=np.float64))


def _value(node: ast.expr, parts: Mapping[str, Quantity]) -> Quantity:
    match node:
        case ast.Constant(value=number):
            return _scalar(float(number))  # type: ignore[arg-type]  # checked when it was read
        case ast.Name(id=name):
            return _scalar(CONSTANTS[name]) if name in CONSTANTS else parts[name]
        case ast.UnaryOp(op=operation, operand=operand):
            inner = _value(operand, parts)
            return inner._replace(values=-inner.values) if isinstance(operation, ast.USub) else inner
        case ast.BinOp(left=base, op=ast.Pow(), right=power):
            return _power(_value(base, parts), _exponent(power) or 0.0)
        case ast.BinOp(left=left, op=operation, right=right):
            return _combined(operation, _value(left, parts), _value(right, parts), ast.unparse(node))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            if name == "pow":
                return _power(_value(arguments[0], parts), _exponent(arguments[1]) or 0.0)
            return _called(name, [_value(argument, parts) for argument in arguments], ast.unparse(node))
    raise VpmError("cannot be worked out; write it anew")  # nothing else passes `read_expression`


def _combined(operation: ast.operator, left: Quantity, right: Quantity, words: str) -> Quantity:
    pairs = zip(left.dimension, right.dimension, strict=True)
    match operation:
        case ast.Mult():
            return Quantity(left.values * right.values, tuple(a + b for a, b in pairs))
        case ast.Div():
            return Quantity(np.asarray(left.values / right.values), tuple(a - b for a, b in pairs))
    _same([left, right], words)
    sum_of = left.values + right.values if isinstance(operation, ast.Add) else left.values - right.values
    return Quantity(sum_of, left.dimension)


def _power(base: Quantity, power: float) -> Quantity:
    exact = Fraction(power).limit_denominator(1000)
    return Quantity(np.asarray(base.values**power), tuple(each * exact for each in base.dimension))


def _called(name: str, given: Sequence[Quantity], words: str) -> Quantity:
    if name == "sqrt":
        return _power(given[0], 0.5)
    values = [each.values for each in given]
    if name == "zeroed":
        return Quantity(zeroed(*np.broadcast_arrays(*values)), given[0].dimension)
    if name == "unwrap":
        return _unwrapped(given, words)
    function = FUNCTIONS[name]
    if function.pure_in:
        _same([*given, _scalar(1.0)], words)
    else:
        _same(given, words)
    return Quantity(function.of(*values), PURE if function.pure_out else given[0].dimension)


def _unwrapped(given: Sequence[Quantity], words: str) -> Quantity:
    angle, period = (*given, _scalar(2.0 * math.pi))[:2]
    _same([angle, period], words)
    if np.ndim(period.values) or not float(period.values) > 0.0:
        raise VpmError(f'has "{words}", whose period is no positive number; write one')
    return Quantity(unwrap(np.atleast_1d(angle.values), period.values), angle.dimension)


def _same(quantities: Sequence[Quantity], words: str) -> None:
    """Refuse an expression of different kinds."""
    first = quantities[0].dimension
    for other in quantities[1:]:
        if other.dimension != first:
            kinds = " and ".join(Unit("", 1.0, each, ()).kind for each in (first, other.dimension))
            raise VpmError(
                f'takes {kinds} together in "{words}"; state the units of its columns (numbers have none: for 5 mm a '
                'count say "5*count" and that the unit of count is mm)'
            )
