"""A fit on a tangent that ends at a bound stays there: the way to it is a sum that rounding carries beyond."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vpm.identify.tangent import estimate_on_tangent
from vpm.model import Model

NAME = "link.mass"


class _Straight:
    """Residual ``m - 2``: the largest mass of the model is the best."""

    mode = "inverse_dynamics"
    blocks = (SimpleNamespace(samples=slice(0, 1)),)
    motions = (SimpleNamespace(joints=("hinge",)),)

    def evaluate(
        self, model: Model, theta: np.ndarray, columns: Sequence[int] = (), *_: object
    ) -> tuple[np.ndarray, np.ndarray]:
        """The same with an origin as without: it is its own tangent."""
        return np.array([theta[model.index(NAME)] - 2.0]), np.ones((1, 1))[:, : len(columns)]


@pytest.mark.parametrize(("start", "most"), [(0.35, 1.72), (0.3, 0.83), (0.17, 0.45), (0.06, 0.62)])
def test_a_fit_that_ends_at_a_bound_is_at_the_bound(start: float, most: float) -> None:
    assert start + (most - start) > most  # what a sum on the way makes of it
    model = Model.from_toml(f"""
    name = "arm"
    gravity = [0, 0, 0]
    bodies.link = {{ mass = {{ value = {start}, max = {most}, min = 0.01 }}, inertia = [0.1, 0.1, 0.1, 0, 0, 0] }}
    joints.hinge = {{ type = "revolute", parent = "world", child = "link", axis = [0, 0, 1] }}
    """)
    data: Any = _Straight()
    fit = estimate_on_tangent(model, data, (NAME,), model.theta, bounds={}, tolerance=1e-10)
    assert fit.values[0] == most
