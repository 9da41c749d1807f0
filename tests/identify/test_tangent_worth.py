"""A fit of drives without a chance beside another one ends after a whole step; one that has it goes on."""

from collections.abc import Sequence
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vpm.identify import Worth
from vpm.identify.tangent import estimate_on_tangent
from vpm.model import Model

MODEL = Model.from_toml("""
name = "arm"
gravity = [0, 0, 0]
bodies.link = { mass = 1.0, inertia = [0.1, 0.1, 0.1, 0, 0, 0] }
joints.hinge = { type = "revolute", parent = "world", child = "link", axis = [0, 0, 1] }
""")
NAME = "link.center_of_mass.x"


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


@pytest.mark.parametrize(("least", "early", "expected"), [(1.0, True, -0.9), (30.0, False, -1.654)])
def test_what_neither_reaches_nor_promises_enough_ends(
    least: float, early: bool, expected: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(import_module(estimate_on_tangent.__module__), "drives_on_tangent", lambda *_: True)
    data: Any = _Curved()
    fit = estimate_on_tangent(
        MODEL, data, (NAME,), MODEL.theta, bounds={NAME: (-9.0, 9.0)}, tolerance=1e-10, worth=Worth(least, 10)
    )
    assert fit.early == early
    assert fit.values[0] == pytest.approx(expected, abs=1e-3)
