"""One row of the table: a name, what was found, what is expected, and how far they may part."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

VALUES = Path(__file__).parent.parent / "values"

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Row:
    """A value of the package beside its reference."""

    name: str
    found: Array
    expected: Array
    unit: str
    source: str
    #: Largest difference allowed: ``absolute + relative |expected|``.
    relative: float = 0.0
    absolute: float = 0.0

    @property
    def error(self) -> float:
        """Largest difference, as a share of what is allowed; a count has to be met exactly."""
        return float(self._shares().max())

    def _shares(self) -> Array:
        """Difference of each number, as a share of what is allowed."""
        allowed = self.absolute + self.relative * np.abs(self.expected)
        difference = np.abs(self.found - self.expected)
        return np.where(difference == 0.0, 0.0, difference / np.maximum(allowed, np.finfo(float).tiny))

    @property
    def shown(self) -> str:
        """What was found; of a list the number that is nearest to its tolerance."""
        return f"{self.found[self._worst]:.7g}"

    @property
    def reference(self) -> str:
        """What is expected of it."""
        return f"{self.expected[self._worst]:.7g}"

    @property
    def difference(self) -> str:
        """How far the two are apart, relative to the reference where the tolerance is."""
        found, expected = self.found[self._worst], self.expected[self._worst]
        return f"{abs(found - expected) / (abs(expected) if self.relative else 1.0):.1e}"

    @property
    def allowed(self) -> str:
        """The tolerance."""
        return f"{self.relative:.2g} rel." if self.relative else f"{self.absolute:.2g}" if self.absolute else "none"

    @property
    def _worst(self) -> int:
        return int(np.argmax(self._shares()))


def row(
    name: str,
    found: ArrayLike,
    expected: ArrayLike,
    unit: str,
    source: str,
    *,
    relative: float = 0.0,
    absolute: float = 0.0,
) -> Row:
    """Make a row; the shapes have to agree."""
    a, b = (np.ravel(np.asarray(numbers, dtype=float)) for numbers in (found, expected))
    if a.shape != b.shape:
        raise ValueError(f"{name}: found {a.size} numbers, but the reference has {b.size}")
    return Row(name, a, b, unit, source, relative, absolute)


def values(name: str) -> Any:
    """Content of a file of reference values."""
    return json.loads((VALUES / f"{name}.json").read_text(encoding="utf-8"))


def accepted(name: str) -> dict[str, dict[str, Any]]:
    """Reference values by their id."""
    return {entry["id"]: entry for entry in values(name)}


def against(entry: dict[str, Any], found: ArrayLike) -> Row:
    """Row of a reference value with its own tolerance."""
    tolerance = entry["tolerance"]
    source = f"{entry['kind']}: {entry['source']}"
    return row(
        entry["id"],
        found,
        entry["value"],
        entry["unit"].partition(" (")[0],
        source,
        relative=tolerance.get("rel", 0.0),
        absolute=tolerance.get("abs", 0.0),
    )
