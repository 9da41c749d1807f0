"""Central difference quotients, which derivatives are held against."""

from collections.abc import Callable

import numpy as np

from vpm.identify.problem import Problem
from vpm.model import Model
from vpm.numbers import Array


def quotient(answer: Callable[[Array], Array], theta: Array, column: int, step: float) -> Array:
    """Difference quotient of an answer by one parameter."""
    moved = step * (np.arange(theta.size) == column)
    return (answer(theta + moved) - answer(theta - moved)) / (2.0 * step)


def of_residual(data: Problem, model: Model, column: int, step: float) -> Array:
    """Difference quotient of a residual by one parameter."""
    return quotient(lambda theta: data.evaluate(model, theta)[0], model.theta, column, step)
