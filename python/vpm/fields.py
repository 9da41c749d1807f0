"""Whether a value is what the annotation of a field says: for objects that are built from files."""

import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

#: Kinds of arrays that may stand where numbers of a kind are expected.
_KINDS = {"f": "biuf", "c": "biufc", "i": "biu", "b": "b"}


def misfit(value: object) -> str:
    """Name of the first field of a dataclass whose value is not of its type; "" where all are, and of what is none."""
    if not is_dataclass(value):
        return ""
    try:
        hints = get_type_hints(type(value))
    except NameError:  # a type that is imported for the type checker only
        return ""
    wrong = (field.name for field in fields(value) if not fits(getattr(value, field.name), hints[field.name]))
    return next(wrong, "")


def fits(value: object, hint: object) -> bool:
    """Whether a field's value is of a type; a whole number is a number.

    ``hint``: what is not known here fits.
    """
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return any(fits(value, one) for one in inner)
    if origin is Literal:
        return value in inner
    if origin is tuple:
        return isinstance(value, tuple) and _all_fit(value, inner)
    if origin is np.ndarray:
        (kind,) = get_args(inner[1])
        kinds = _KINDS.get(np.dtype(kind).kind, "")
        return isinstance(value, np.ndarray) and (not kinds or value.dtype.kind in kinds)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return isinstance(value, Mapping) and all(
            fits(key, inner[0]) and fits(item, inner[1]) for key, item in value.items()
        )
    if hint in (int, float):
        return isinstance(value, int if hint is int else int | float) and not isinstance(value, bool)
    return not isinstance(hint, type) or origin is not None or isinstance(value, hint)


def _all_fit(value: tuple[object, ...], inner: tuple[Any, ...]) -> bool:
    """Whether all entries of a tuple field fit; three dots stand for any number of a type."""
    if inner[1:] == (...,):
        return all(fits(item, inner[0]) for item in value)
    return len(value) == len(inner) and all(map(fits, value, inner))
