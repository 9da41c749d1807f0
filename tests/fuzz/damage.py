"""How documents, tables and bytes are damaged: with a sense of their structure, by numbers from a seed."""

import copy
import math
from collections.abc import Iterator
from random import Random
from typing import Any

#: What stands in the place of something else.
HOSTILE: tuple[Any, ...] = (
    0, -1, 1, 2, 7, 1000, 0.0, -0.0, 1e-300, 1e-9, 1e9, 1e155, 1e308, -1e308, math.inf, -math.inf, math.nan, 2**63 - 1,
    10**400, True, "", "x", "world", "$x_{$", "(((((", "m^²", "1/(nm^99)", "a" * 3000, "\0", [], [0.0], [1e308, 1, 1],
    {}, {"value": 1.7e308, "unit": "kN/m"}, {"value": 1.0, "unit": "furlong"}, {"value": 1.0, "uncertainty": math.nan},
)  # fmt: skip
NUMBERS = tuple(value for value in HOSTILE if isinstance(value, int | float))
CELLS = (
    "",
    "nan",
    "inf",
    "-inf",
    "1e155",
    "1e400",
    "x",
    "1,5",
    '"',
    "1_0",
    "0x1",
    "9" * 400,
    "-0",
    "1e-320",
    "\0",
    "²",
)

Way = tuple[str | int, ...]


def document(content: dict[str, Any], dice: Random) -> dict[str, Any]:
    """Content of a file with one to three places changed."""
    changed = copy.deepcopy(content)
    for _ in range(dice.choice((1, 1, 1, 2, 3))):
        ways = list(_ways(changed, ()))
        if not ways:
            break
        # Mostly numbers in the place of numbers: what is of the wrong kind does not come far.
        numbers = [way for way in ways if isinstance(_at(changed, way), int | float)]
        way, other = dice.choice(numbers if numbers and dice.random() < 0.6 else ways), dice.choice(ways)
        owner, value = _at(changed, way[:-1]), _at(changed, way)
        if isinstance(value, int | float) and dice.random() < 0.7:
            value = float(min(value, 1 << 64))
            by = 10.0 ** dice.choice((dice.uniform(-2.0, 2.0), dice.uniform(-15.0, 15.0))) * dice.choice(
                (1.0, 1.0, -1.0)
            )
            owner[way[-1]] = dice.choice((value * by, value * by, dice.choice(NUMBERS)))
            continue
        match dice.randrange(7):
            case 0:
                del owner[way[-1]]
            case 1:
                owner[way[-1]] = copy.deepcopy(_at(changed, other))
            case 2 if isinstance(owner, dict):
                owner[f"{way[-1]}{dice.choice(('x', '2', ' ', '.', ''))}"] = owner.pop(way[-1])
            case 3 if isinstance(owner, list):
                owner *= dice.choice((2, 50))
            case _:
                owner[way[-1]] = copy.deepcopy(dice.choice(HOSTILE))
    return changed


def _ways(value: object, way: Way) -> Iterator[Way]:
    items: Any = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield (*way, key)
        if len(way) < 12:
            yield from _ways(inner, (*way, key))


def _at(value: Any, way: Way) -> Any:
    for key in way:
        value = value[key]
    return value


def table(text: str, dice: Random) -> str:
    """A table of numbers with cells, lines or stamps changed."""
    rows = [line.split(",") for line in text.splitlines()]
    for _ in range(dice.choice((1, 1, 2, 5))):
        row = dice.randrange(len(rows))
        match dice.randrange(6):
            case 0:
                del rows[row]
            case 1:
                rows.insert(row, list(rows[dice.randrange(len(rows))]))
            case 2:
                rows[row] = rows[row][: dice.randrange(len(rows[row]) + 1)]
            case 3 if rows[row]:
                rows[row][0] = repr(10.0 ** dice.randint(-12, 12))
            case _ if rows[row]:
                rows[row][dice.randrange(len(rows[row]))] = dice.choice(CELLS)
    return dice.choice(("\n", "\n", "\n", "\r\n", "\r")).join(",".join(row) for row in rows)


def octets(content: bytes, dice: Random) -> bytes:
    """Bytes with a few changed, taken out, doubled, or cut off."""
    changed = bytearray(content)
    for _ in range(dice.choice((1, 1, 2, 8))):
        at = dice.randrange(len(changed) or 1)
        match dice.randrange(6):
            case 0:
                del changed[at : at + dice.randrange(1, 9)]
            case 1:
                changed[at:at] = changed[at : at + 8]
            case 2 if dice.random() < 0.3:
                del changed[at:]
            case _:
                changed[at : at + 1] = bytes((dice.choice((0, 1, 5, 14, 15, 127, 128, 255, dice.randrange(256))),))
    return bytes(changed)
