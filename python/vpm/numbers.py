"""Numbers at both doors: what users give becomes arrays or an error; what they read is rounded alike everywhere."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vpm.errors import VpmError

#: Real and complex numbers.
Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: No quantity of a machine is larger in SI units; squares and products of three are still finite numbers.
LARGEST = 1e100
#: Two-sided 95 % quantile of the normal distribution.
NORMAL_95 = 1.959963984540054
#: Said for a number that nobody knows.
UNKNOWN = "–"


def array_of(given: ArrayLike, what: str, error: type[VpmError] = VpmError) -> Array:
    """Array of numbers.

    ``what``: name for messages, as the beginning of a sentence.
    """
    try:
        array = np.asanyarray(given)
        if array.dtype.kind in "cmM":  # imaginary parts would be lost, and ticks of a clock count as seconds
            raise TypeError(f"it holds {array.dtype}")
        array = array.astype(np.float64, copy=False)
        return np.asarray(array.filled(np.nan) if isinstance(array, np.ma.MaskedArray) else array)
    except (TypeError, ValueError, OverflowError) as reason:
        raise error(f"{what} is no array of numbers ({reason}); give numbers in rows of equal length") from reason


def number_of(given: object, what: str, error: type[VpmError] = VpmError) -> float:
    """A single number."""
    try:
        return float(given)  # type: ignore[arg-type]  # whatever float takes is right
    except (TypeError, ValueError, OverflowError) as reason:
        raise error(f"{what} is no number ({reason}); give one") from reason


def short(value: float) -> str:
    """A number with four digits, as texts, tables and pictures show it; a dash where it is not known."""
    return UNKNOWN if np.isnan(value) else f"{value:.4g}"


def power(values: Array) -> float:
    """Sum of squares of numbers."""
    return float(values @ values)


def rough_percent(share: float) -> str:
    """Number in percent with three digits, for texts."""
    return f"{100.0 * share:.3g} %"


def percent(share: float) -> str:
    """Number in percent with two decimals for texts and pictures; two digits where that would hide it.

    Less than a millionth is nothing. A share of nothing is not known.
    """
    if not np.isfinite(share):
        return UNKNOWN
    if abs(share) < 1e-6:
        return "0.00 %"
    return f"{100.0 * share:.2f} %" if abs(share) >= 1e-3 else f"{100.0 * share:.2g} %"


def stretches(counts: NDArray[np.bool_]) -> list[slice]:
    """Contiguous stretches of numbers that count."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], counts, [False]]).astype(np.int8)))
    return [slice(int(first), int(last)) for first, last in zip(edges[::2], edges[1::2], strict=True)]
