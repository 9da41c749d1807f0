"""Fits on a tangent: one that ends at a bound stays there, and one tangent follows the other until it holds."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vpm.identify.tangent import estimate_on_tangent
from vpm.model import Model

MODEL = Model.from_toml("""
name = "arm"
gravity = [0, 0, 0]
bodies.link = { mass = 1.0, inertia = [0.1, 0.1, 0.1, 0, 0, 0] }
joints.hinge = { type = "revolute", parent = "world", child = "link", axis = [0, 0, 1] }
""")
NAME = "link.center_of_mass.x"

MASS = "link.mass"


class _Curved:
    """Residual ``[5, exp(x) - 0.1]``; with an origin that of its tangent there.

    By hand: the tangent at 0 ends at -0.9, where it is off by 0.31 of 5.0, the one there at -1.654, off by 0.09.
    """

    mode = "inverse_dynamics"
    blocks = (SimpleNamespace(samples=slice(0, 2)),)
    motions = (SimpleNamespace(joints=MODEL.joints),)

    def evaluate(
        self, model: Model, theta: np.ndarray, columns: Sequence[int] = (), origin: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        x = theta[model.index(NAME)]
        at = x if origin is None else origin[model.index(NAME)]
        value = np.exp(at) * (1.0 + x - at) - 0.1
        return np.array([5.0, value]), np.array([[0.0], [np.exp(at)]])[:, : len(columns)]


def test_a_fit_goes_on_along_the_next_tangent_until_one_holds() -> None:
    data: Any = _Curved()
    fit = estimate_on_tangent(MODEL, data, (NAME,), MODEL.theta, bounds={NAME: (-9.0, 9.0)}, tolerance=1e-10)
    assert fit.values[0] == pytest.approx(-1.654, abs=1e-3)


class _Straight:
    """Residual ``m - 2``: the largest mass of the model is the best."""

    mode = "inverse_dynamics"
    blocks = (SimpleNamespace(samples=slice(0, 1)),)
    motions = (SimpleNamespace(joints=("hinge",)),)

    def evaluate(
        self, model: Model, theta: np.ndarray, columns: Sequence[int] = (), *_: object
    ) -> tuple[np.ndarray, np.ndarray]:
        """The same with an origin as without: it is its own tangent."""
        return np.array([theta[model.index(MASS)] - 2.0]), np.ones((1, 1))[:, : len(columns)]


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
    fit = estimate_on_tangent(model, data, (MASS,), model.theta, bounds={}, tolerance=1e-10)
    assert fit.values[0] == most
