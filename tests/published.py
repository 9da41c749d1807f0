"""Published and recomputed values with their tolerances, and how near a result comes."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

VALUES = Path(__file__).resolve().parent / "values"


def check_all(file: str, found: Mapping[str, ArrayLike]) -> None:
    """Compare with every value of a file: none may be missing, none may be off, and nothing else may be there."""
    wanted = {value["id"]: value for value in json.loads((VALUES / file).read_text(encoding="utf-8"))}
    assert set(found) == set(wanted)
    for name, numbers in found.items():
        value = wanted[name]
        expected, got = np.ravel(value["value"]), np.ravel(numbers)
        assert got.shape == expected.shape, name
        ((kind, size),) = value["tolerance"].items()
        allowed = size * np.abs(expected) if kind == "rel" else np.full_like(expected, size, dtype=float)
        off = np.abs(got - expected)
        text = f"{name} is {got} {value['unit']} instead of {expected} ({value['source']}), allowed {allowed}"
        assert (off <= allowed).all(), text
