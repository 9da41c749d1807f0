"""One configuration or many: the core takes tables, people also give single rows."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import ModelError, refused_as
from vpm.numbers import Array


def rowwise(question: Callable[..., Array], *tables: ArrayLike, what: str) -> Array:
    """Ask the core about arrays of two numbers a row; a single row gives a single answer.

    - ``question``: takes as many tables (N, 2) as are given
    - ``*tables``: shape (2,) or (N, 2), single rows are repeated where others are tables
    - result: shape (...) or (N, ...)
    """
    arrays = [np.asarray(table, dtype=float) for table in tables]
    for array in arrays:
        if array.ndim not in {1, 2} or array.shape[-1] != 2:
            raise ModelError(f"{what}: needs the shape (2,) or (N, 2), got {array.shape}; give two numbers per row")
    single = all(array.ndim == 1 for array in arrays)
    with refused_as(ModelError, what):
        answer = question(*np.broadcast_arrays(*(np.atleast_2d(array) for array in arrays)))
    return answer[0] if single else answer
