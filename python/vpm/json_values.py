"""JSON values of whatever a result holds."""

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import PurePath

import numpy as np


def plain(value: object) -> object:
    """JSON values: numbers, text, lists and tables of a Python value.

    ``value``: what knows its own form says it by ``to_dict``; other dataclasses give their fields.
    Result: NaN and infinity, which JSON has no word for, are None: not known. A complex number is its two parts.
    """
    match value:
        case np.ndarray() | np.generic():
            return plain(value.tolist())
        case None | bool() | int() | str():
            return value
        case float():
            return value if math.isfinite(value) else None
        case complex():
            return plain([value.real, value.imag])
        case Mapping():
            return {str(key): plain(item) for key, item in value.items()}
        case list() | tuple() | set() | frozenset():
            return [plain(item) for item in value]
        case PurePath():
            return str(value)
    if callable(own := getattr(value, "to_dict", None)):
        return plain(own())
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    return str(value)
