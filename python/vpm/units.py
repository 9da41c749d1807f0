"""Units at the door: everything inside is SI.

A unit is written as products, quotients, powers and parentheses of symbols: ``N s/m``, ``kg m^2``, ``V/(m/s)``,
``N m s/rad``, ``1/s``, ``l/min``. A space, ``*`` or ``·`` multiplies. A product after a slash (``J/kg K``) is refused,
because readers disagree about it: write ``J/(kg K)``. A power may be a decimal number: the gain of an orifice is in
``m^3/(s A Pa^0.5)``, a contact stiffness in ``N/m^1.1``; such powers are kept as exact fractions.

Logs write units in other ways, too, which mean the same: ``Nm``, ``N-m`` and ``N.m``, ``m/s2`` and ``m/s²``, ``s-1``,
``sec``, ``RPM``, ``Volt``. A temperature in ``°C`` or ``°F`` counts from a zero of its own, and stands alone.

Angles have no dimension, and ``rad`` is 1 (SI brochure, 9th edition, section 2.3.3), so ``N m`` and ``N m/rad`` are of
one kind; so are ``Hz`` and ``rad/s``, and no factor of 2 pi stands between these two. Write ``rev/s`` for turns.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from typing import overload

import numpy as np
from numpy.typing import NDArray

from vpm.errors import UnitError, near_match

#: Powers beyond this, or with more characters, mean nothing.
LARGEST_POWER, LONGEST_POWER = 99, 8
#: Units with more characters mean nothing either.
LONGEST = 100

#: The base units that the dimension vectors count.
BASE_UNITS = ("m", "kg", "s", "A", "K")

_PREFIXES = {
    "n": 1e-9,
    "u": 1e-6,
    "µ": 1e-6,
    "μ": 1e-6,
    "m": 1e-3,
    "c": 1e-2,
    "d": 1e-1,
    "h": 1e2,
    "k": 1e3,
    "M": 1e6,
    "G": 1e9,
}

_TOKEN = re.compile(
    r"\s*(?:(?P<name>°[CF]\b|[^\W\d_]+|[°%])|(?P<power>\^|\*\*)|(?P<number>[+-]?[0-9]+(?:\.[0-9]+)?)|(?P<mark>[*·/()]))"
)
_NUMBER = re.compile(r"[+-]?[0-9]+(?:\.[0-9]+)?")
#: Other ways to write a power and a product, as in ``m²``, ``s-1``, ``m2`` and ``N-m``, ``N.m``, ``N⋅m``.
_RAISED = re.compile(r"([⁺⁻]?[⁰¹²³⁴-⁹]+)")
_FROM_RAISED = str.maketrans("⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "+-0123456789")
_ATTACHED_POWER = re.compile(r"(?<=[^\W\d_])(-?[1-9])(?![\d.])")
_PRODUCT = re.compile(r"(?<=[^\W\d_])[-.](?=[^\W\d_])|[⋅∙•×]")
#: Torques and moments of inertia whose symbols run together, as in ``Nm``, ``Nms``, ``kNm`` and ``kgcm``.
_RUN_TOGETHER = re.compile(r"([uµμmkM]?N|kg)([mc]?m)(s?)")

#: Power of a unit; a whole one is an int.
Power = int | Fraction


@dataclass(frozen=True)
class Unit:
    """A unit that was understood."""

    text: str  #: As it was written.
    factor: float  #: SI value of one such unit.
    dimension: tuple[Power, ...]  #: Powers of `BASE_UNITS`.
    #: The same unit with every symbol replaced by its SI symbol; symbols and powers.
    si_terms: tuple[tuple[str, Power], ...]
    zero: float = 0.0  #: SI value of zero of it, which is not zero of temperatures in ``°C`` and ``°F``.

    @property
    def is_si(self) -> bool:
        """Whether values of this unit are those in SI."""
        return (self.factor, self.zero) == (1.0, 0.0)

    def to_si(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values of this unit, in SI."""
        return values * self.factor + self.zero

    def from_si(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values in SI, in this unit."""
        return (values - self.zero) / self.factor

    @property
    def si(self) -> str:
        """The SI unit of the same build: ``"N/m"`` for ``"N/mm"``, ``"rad/s"`` for ``"rpm"``."""
        return _write(self.si_terms)

    @property
    def kind(self) -> str:
        """The dimension in base units: ``"kg/s^2"`` for ``"N/m"``, ``"1"`` for angles and ratios."""
        powers = dict(zip(BASE_UNITS, self.dimension, strict=True))
        return _write(tuple((name, powers[name]) for name in ("kg", "m", "s", "A", "K")))


@dataclass(frozen=True)
class _Symbol:
    factor: float
    dimension: tuple[int, ...]
    si: tuple[tuple[str, int], ...]
    prefixes: str = ""


def _symbol(factor: float, dimension: tuple[int, ...], si: str, prefixes: str = "") -> _Symbol:
    """Table entry of a unit's symbol; `si` is like ``"m^3 s^-1"``."""
    terms = tuple((name, int(power or 1)) for name, _, power in (term.partition("^") for term in si.split()))
    return _Symbol(factor, dimension, terms, prefixes)


_INCH = 0.0254  # exact: international inch, pound and pound-force (NIST SP 811, appendix B)
_POUND = 0.45359237
_STANDARD_GRAVITY = 9.80665

_SYMBOLS: Mapping[str, _Symbol] = {
    "m": _symbol(1.0, (1, 0, 0, 0, 0), "m", "nuµμmcdk"),
    "inch": _symbol(_INCH, (1, 0, 0, 0, 0), "m"),
    "in": _symbol(_INCH, (1, 0, 0, 0, 0), "m"),
    "ft": _symbol(12 * _INCH, (1, 0, 0, 0, 0), "m"),
    "l": _symbol(1e-3, (3, 0, 0, 0, 0), "m^3", "umcd"),
    "L": _symbol(1e-3, (3, 0, 0, 0, 0), "m^3", "umcd"),
    "g": _symbol(1e-3, (0, 1, 0, 0, 0), "kg", "uµμmk"),
    "t": _symbol(1e3, (0, 1, 0, 0, 0), "kg"),
    "lb": _symbol(_POUND, (0, 1, 0, 0, 0), "kg"),
    "s": _symbol(1.0, (0, 0, 1, 0, 0), "s", "nuµμm"),
    "min": _symbol(60.0, (0, 0, 1, 0, 0), "s"),
    "h": _symbol(3600.0, (0, 0, 1, 0, 0), "s"),
    "Hz": _symbol(1.0, (0, 0, -1, 0, 0), "Hz", "mkM"),
    "rpm": _symbol(2 * math.pi / 60, (0, 0, -1, 0, 0), "rad s^-1"),
    "rad": _symbol(1.0, (0, 0, 0, 0, 0), "rad", "uµμm"),
    "deg": _symbol(math.pi / 180, (0, 0, 0, 0, 0), "rad"),
    "°": _symbol(math.pi / 180, (0, 0, 0, 0, 0), "rad"),
    "arcmin": _symbol(math.pi / 10800, (0, 0, 0, 0, 0), "rad"),
    "arcsec": _symbol(math.pi / 648000, (0, 0, 0, 0, 0), "rad"),
    "rev": _symbol(2 * math.pi, (0, 0, 0, 0, 0), "rad"),
    "r": _symbol(2 * math.pi, (0, 0, 0, 0, 0), "rad"),  # a turn in "r/min" (ISO 80000-3)
    "U": _symbol(2 * math.pi, (0, 0, 0, 0, 0), "rad"),  # a turn in "U/min" (DIN 1301-2)
    "%": _symbol(1e-2, (0, 0, 0, 0, 0), ""),
    "ppm": _symbol(1e-6, (0, 0, 0, 0, 0), ""),
    "strain": _symbol(1.0, (0, 0, 0, 0, 0), "", "uµμm"),
    "ε": _symbol(1.0, (0, 0, 0, 0, 0), "", "uµμm"),
    "N": _symbol(1.0, (1, 1, -2, 0, 0), "N", "uµμmckM"),
    "lbf": _symbol(_POUND * _STANDARD_GRAVITY, (1, 1, -2, 0, 0), "N"),
    "kgf": _symbol(_STANDARD_GRAVITY, (1, 1, -2, 0, 0), "N"),
    "gn": _symbol(_STANDARD_GRAVITY, (1, 0, -2, 0, 0), "m s^-2", "uµμm"),  # of accelerometers; "g" is the gram
    "J": _symbol(1.0, (2, 1, -2, 0, 0), "J", "mkM"),
    "W": _symbol(1.0, (2, 1, -3, 0, 0), "W", "umkM"),
    "Pa": _symbol(1.0, (-1, 1, -2, 0, 0), "Pa", "hkMG"),
    "bar": _symbol(1e5, (-1, 1, -2, 0, 0), "Pa", "m"),
    "psi": _symbol(_POUND * _STANDARD_GRAVITY / _INCH**2, (-1, 1, -2, 0, 0), "Pa"),
    "A": _symbol(1.0, (0, 0, 0, 1, 0), "A", "nuµμmk"),
    "C": _symbol(1.0, (0, 0, 1, 1, 0), "C", "m"),
    "V": _symbol(1.0, (2, 1, -3, -1, 0), "V", "nuµμmk"),
    "Ohm": _symbol(1.0, (2, 1, -3, -2, 0), "Ohm", "mkM"),
    "Ω": _symbol(1.0, (2, 1, -3, -2, 0), "Ohm", "mkM"),
    "H": _symbol(1.0, (2, 1, -2, -2, 0), "H", "nuµμm"),
    "F": _symbol(1.0, (-2, -1, 4, 2, 0), "F", "nuµμm"),
    "T": _symbol(1.0, (0, 1, -2, -1, 0), "T", "um"),
    "Wb": _symbol(1.0, (2, 1, -2, -1, 0), "Wb", "m"),
    "K": _symbol(1.0, (0, 0, 0, 0, 1), "K", "m"),
}

#: Words for symbols, in whatever letters.
_WORDS: Mapping[str, str] = {
    word: symbol
    for symbol, words in {
        "s": "sec secs second seconds",
        "ms": "msec millisecond milliseconds",
        "us": "usec microsecond microseconds",
        "min": "minute minutes",
        "h": "hr hour hours",
        "m": "meter meters metre metres",
        "rad": "rad radian radians",
        "deg": "deg degs degree degrees",
        "rev": "rev revs turn turns revolution revolutions",
        "rpm": "rpm",
        "Hz": "hz hertz",
        "N": "newton newtons",
        "Pa": "pascal pascals",
        "bar": "bar bars",
        "psi": "psi",
        "kg": "kg",
        "V": "volt volts",
        "A": "amp amps ampere amperes",
        "Ohm": "ohm ohms",
        "%": "percent pct",
        "ustrain": "microstrain",
    }.items()
    for word in words.split()
}

#: Size of a degree, K, and temperature at zero degrees, K (BIPM, SI brochure, 9th edition, 2.3.1; NIST SP 811, B.8).
_TEMPERATURES: Mapping[str, tuple[float, float]] = {
    **dict.fromkeys(("°C", "degC", "deg C"), (1.0, 273.15)),
    **dict.fromkeys(("°F", "degF", "deg F"), (1.0 / 1.8, 459.67 / 1.8)),
}

_DIMENSIONLESS: tuple[Power, ...] = (0,) * len(BASE_UNITS)


@lru_cache(maxsize=1024)
def parse_unit(text: str) -> Unit:
    """Read a unit from text such as ``N m/rad``.

    ``text``: for example ``"N s/m"``; ``""`` and ``"1"`` mean no unit.
    """
    if not text.strip():
        return Unit(text, 1.0, _DIMENSIONLESS, ())
    if len(text) > LONGEST:
        raise _unreadable(text, f"it has {len(text)} characters, and at most {LONGEST} make sense")
    if (temperature := _TEMPERATURES.get(text.strip())) is not None:
        size, zero = temperature
        return Unit(text, size, _SYMBOLS["K"].dimension, _SYMBOLS["K"].si, zero)
    reader = _Reader(text)
    try:
        factor, dimension, terms = reader.expression()
    except (OverflowError, ZeroDivisionError):
        factor = math.inf
    if not 0.0 < factor < math.inf:
        raise _unreadable(text, "it is too large or too small for a number")
    if reader.next is not None:
        raise _unreadable(text, f'"{reader.next}" is not expected there')
    return Unit(text, factor, dimension, tuple(terms.items()))


def is_unit(text: str) -> bool:
    """Whether a text is a unit that can be converted; blanks are none."""
    try:
        parse_unit(text)
    except UnitError:
        return False
    return bool(text.strip())


def factor_to_si(unit: str) -> float:
    """SI value of a difference of one `unit`: 0.001 for ``"mm"``."""
    return parse_unit(unit).factor


def si_unit(unit: str) -> str:
    """SI unit of the same build as `unit`: ``"m^3/s"`` for ``"l/min"``, ``"1"`` for ``"%"``."""
    return parse_unit(unit).si


def require_dimension(unit: str, expected: str) -> None:
    """Refuse a unit of the wrong kind.

    ``expected``: a unit of the right kind, which the message suggests.
    """
    given, wanted = parse_unit(unit), parse_unit(expected)
    if given.dimension != wanted.dimension:
        raise UnitError(
            f'unit "{unit}" is of the kind {given.kind}, but {wanted.kind} is needed; write for example "{expected}"',
            unit=unit,
            expected=expected,
        )


@overload
def convert(value: float, from_unit: str, to_unit: str) -> float: ...
@overload
def convert(value: NDArray[np.float64], from_unit: str, to_unit: str) -> NDArray[np.float64]: ...
def convert(value: float | NDArray[np.float64], from_unit: str, to_unit: str) -> float | NDArray[np.float64]:
    """Express a quantity in another unit.

    Parameters
    ----------
    value : float or ndarray
        In `from_unit`.

    Returns
    -------
    float or ndarray
        In `to_unit`; the same object where both units are equally large.

    Raises
    ------
    UnitError
        The dimensions differ, or a unit cannot be read.
    """
    require_dimension(from_unit, to_unit)
    given, wanted = parse_unit(from_unit), parse_unit(to_unit)
    if (given.factor, given.zero) == (wanted.factor, wanted.zero):
        return value
    return value * (given.factor / wanted.factor) + (given.zero - wanted.zero) / wanted.factor


_Parsed = tuple[float, tuple[Power, ...], dict[str, Power]]


class _Reader:
    """Recursive descent over ``expression = power {("*" | "/" | " ") power}``, ``power = atom ["^" number]``."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens = _tokens(text, _usual(text))
        self.at = 0

    @property
    def next(self) -> str | None:
        return self.tokens[self.at] if self.at < len(self.tokens) else None

    def expression(self) -> _Parsed:
        factor, dimension, terms = self.power()
        divided = False
        while self.next not in {None, ")"}:
            sign = 1
            if self.next in {"*", "·", "/"}:
                sign = -1 if self.next == "/" else 1
                self.at += 1
            if divided and sign == 1:
                raise _unreadable(self.text, "a product after a slash is ambiguous, put the divisor into parentheses")
            divided = divided or sign == -1
            other = self.power()
            factor *= other[0] ** sign
            dimension = tuple(_whole(a + sign * b) for a, b in zip(dimension, other[1], strict=True))
            for name, power in other[2].items():
                terms[name] = _whole(terms.get(name, 0) + sign * power)
        return factor, dimension, terms

    def power(self) -> _Parsed:
        factor, dimension, terms = self.atom()
        if self.next not in {"^", "**"}:
            return factor, dimension, terms
        self.at += 1
        digits = self.next or ""
        if not _NUMBER.fullmatch(digits):
            raise _unreadable(self.text, 'a number has to follow the "^"')
        if len(digits) > LONGEST_POWER or abs(Fraction(digits)) > LARGEST_POWER:
            raise _unreadable(self.text, f"the power {digits} is beyond {LARGEST_POWER}, or has too many digits")
        exponent = _whole(Fraction(digits))
        self.at += 1
        scaled = {name: _whole(power * exponent) for name, power in terms.items()}
        # Whole powers stay products, which round less.
        size = factor**exponent if isinstance(exponent, int) else factor ** float(exponent)
        return size, tuple(_whole(power * exponent) for power in dimension), scaled

    def atom(self) -> _Parsed:
        symbol = self.next
        self.at += 1
        if symbol == "1":
            return 1.0, _DIMENSIONLESS, {}
        if symbol == "(":
            inside = self.expression()
            if self.next != ")":
                raise _unreadable(self.text, 'a ")" is missing')
            self.at += 1
            return inside
        if symbol is None:
            raise _unreadable(self.text, "it ends where a symbol is needed")
        if not (symbol.isalpha() or symbol[0] in "°%"):
            raise _unreadable(self.text, f'"{symbol}" stands where a symbol is needed')
        return _look_up(symbol, self.text)


def _whole(power: Power) -> Power:
    """Power of a unit, as an int if it is one."""
    return int(power) if power.denominator == 1 else power


def _usual(text: str) -> str:
    """The same unit with powers after a ``^`` and a ``*`` for each other sign of a product."""
    powers = _RAISED.sub(lambda raised: "^" + raised.group().translate(_FROM_RAISED), text)
    return _PRODUCT.sub("*", _ATTACHED_POWER.sub(r"^\1", powers))


def _tokens(text: str, usual: str) -> list[str]:
    tokens, at, end = [], 0, len(usual.rstrip())
    while at < end:
        match = _TOKEN.match(usual, at)
        if match is None:
            raise _unreadable(text, f'"{usual[at:].strip()[0]}" is not part of a unit')
        token, at = match.group().strip(), match.end()
        parts = _RUN_TOGETHER.fullmatch(token) if _find(token) is None else None
        tokens += [token] if parts is None else list(filter(None, parts.groups()))
    return tokens


def _look_up(name: str, text: str) -> _Parsed:
    """Look up a unit's symbol, or raise with the repair."""
    found = _find(name) or _find(_WORDS.get(name.lower(), name))
    if found is not None:
        return found
    if name in _TEMPERATURES:
        raise _unreadable(text, f"{name} counts from a zero of its own; write K, which a difference is as well")
    repair = near_match(name, _SYMBOLS, what="known symbols are")
    for at in range(1, len(name)):
        if _find(name[:at]) and _find(name[at:]):
            repair = f'did you mean "{name[:at]} {name[at:]}", with a space?'
            break
    raise UnitError(f'unit "{text}" has the unknown symbol "{name}"; {repair}', unit=text)


def _find(name: str) -> _Parsed | None:
    """Find a unit's symbol in the table, else a prefix before one; exact names win."""
    symbol, scale = _SYMBOLS.get(name), 1.0
    if symbol is None and name[0] in _PREFIXES:
        symbol, scale = _SYMBOLS.get(name[1:]), _PREFIXES[name[0]]
        if symbol is not None and name[0] not in symbol.prefixes:
            return None
    return None if symbol is None else (symbol.factor * scale, symbol.dimension, dict(symbol.si))


def _unreadable(text: str, reason: str) -> UnitError:
    shown = text if len(text) <= LONGEST else f"{text[:40]}..."
    return UnitError(f'unit "{shown}" cannot be read: {reason}; units are written like "N s/m" or "kg m^2"', unit=text)


def _write(terms: tuple[tuple[str, Power], ...]) -> str:
    """Symbols and powers as text that `parse_unit` reads back."""

    def product(sign: int) -> list[str]:
        found = [(name, sign * Fraction(power)) for name, power in terms if power * sign > 0]
        return [name if power == 1 else f"{name}^{_digits(power)}" for name, power in found]

    above, below = product(1), product(-1)
    if not below:
        return " ".join(above) or "1"
    divisor = below[0] if len(below) == 1 else f"({' '.join(below)})"
    return f"{' '.join(above) or '1'}/{divisor}"


def _digits(power: Fraction) -> str:
    """Positive power of a unit as decimal digits, which have an end."""
    return format(Decimal(power.numerator) / Decimal(power.denominator), "f")
