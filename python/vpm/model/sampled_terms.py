"""Terms of NARX drives as they are written in a model file: ``effort[k-1]^2*u[k]``, ``1`` for the constant."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import groupby

import numpy as np

Factor = tuple[int, int]

_FACTOR = re.compile(r"(?P<name>[^\[\]^]+)\[k(?:-(?P<lag>\d+))?\](?:\^(?P<power>[1-9]\d?))?")


def written(term: Sequence[Factor], names: Sequence[str]) -> str:
    """Text of a term whose factors are (signal, lag); ``names`` are those of the signals, the output's first."""
    factors = []
    for (signal, lag), same in groupby(sorted(term)):
        count = len(list(same))
        text = f"{names[signal]}[k-{lag}]" if lag else f"{names[signal]}[k]"
        factors.append(text if count == 1 else f"{text}^{count}")
    return "*".join(factors) or "1"


def factors_of(text: str, names: Sequence[str]) -> tuple[Factor, ...]:
    """Factors of a written term.

    Raises
    ------
    ValueError
        The text is no term, names a signal that is not there, or the output at the sample that is computed.
    """
    if text.strip() == "1":
        return ()
    factors: list[Factor] = []
    for part in text.split("*"):
        found = _FACTOR.fullmatch(part.strip())
        if found is None:
            raise ValueError(
                f'has the factor "{part.strip()}", which is no lagged signal; write "{names[0]}[k-1]", '
                f'"{names[-1]}[k]^2" or products of such, and "1" for the constant'
            )
        name, lag = found["name"].strip(), int(found["lag"] or 0)
        if name not in names:
            known = ", ".join(f'"{known}"' for known in names)
            raise ValueError(f'names the signal "{name}", but the signals are {known}; add it to inputs or correct it')
        if name == names[0] and lag == 0:
            raise ValueError("contains the effort that it is to compute; let its lags begin at 1")
        factors += [(names.index(name), lag)] * int(found["power"] or 1)
    return tuple(sorted(factors))


def poles(terms: Sequence[Sequence[Factor]], coefficients: Sequence[float]) -> np.ndarray | None:
    """Poles of a model that is linear in its own past: roots of ``z^n - a_1 z^(n-1) - ... - a_n``.

    Returns
    -------
    ndarray or None
        None where a product contains the output, so that no fixed poles decide whether it stays bounded.
    """
    past = [(term, value) for term, value in zip(terms, coefficients, strict=True) if any(s == 0 for s, _ in term)]
    if any(len(term) > 1 for term, _ in past):
        return None
    polynomial = np.zeros(1 + max((term[0][1] for term, _ in past), default=0))
    polynomial[0] = 1.0
    for term, value in past:
        polynomial[term[0][1]] -= value
    return np.roots(polynomial)
