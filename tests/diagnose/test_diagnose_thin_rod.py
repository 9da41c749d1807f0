"""A rod that hangs on a driven arm: the effort of the arm shows one of its moments of inertia, and not the other."""

import pytest

from vpm.discrepancy.preparation import with_ranked
from vpm.model import Model

ROD = """
name = "rod on an arm"
gravity = [0.0, 0.0, -9.81]
[bodies.arm]
mass = 0.1
inertia = [0.01, 0.01, 0.01, 0.0, 0.0, 0.0]
[bodies.rod]
mass = 0.15
center_of_mass = [0.0, 0.0, -0.16]
inertia = [
  { value = 1.6e-3, uncertainty = 3e-4 }, { value = 1.6e-3, uncertainty = 3e-4 }, 1e-5, 0.0, 0.0, 0.0
]
[joints.turn]
type = "revolute"
parent = "world"
child = "arm"
axis = [0.0, 0.0, 1.0]
[joints.swing]
type = "revolute"
parent = "arm"
child = "rod"
translation = [0.2, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
"""


def test_a_thin_rod_takes_both_moments_from_where_both_are_seen() -> None:
    """The moments across a rod differ by less than the one along it; one from each of two fits would be no body."""
    across = ["rod.inertia.xx", "rod.inertia.yy"]
    stated = Model.from_toml(ROD)
    recalibrated = stated.with_parameters({**dict.fromkeys(across, 1.7e-3), "rod.mass": 0.16})
    ranked = stated.with_parameters({**dict.fromkeys(across, 1.5e-3), "rod.mass": 0.14})
    start = with_ranked(recalibrated, ranked, ["rod.inertia.xx"]).parameters
    assert [start[name].value for name in across] == pytest.approx([1.5e-3, 1.5e-3])
    assert start["rod.mass"].value == pytest.approx(0.16)


def test_moments_of_a_body_come_from_one_fit() -> None:
    """A recalibration of a wrong model may end near no body at all; one moment of another fit is too large for it."""
    moments = [f"arm.inertia.{axes}" for axes in ("xx", "yy", "zz")]
    stated = Model.from_toml(ROD)
    recalibrated = stated.with_parameters(dict.fromkeys(moments, 1e-9))
    ranked = stated.with_parameters(dict(zip(moments, (0.009, 0.012, 0.011), strict=True)))
    start = with_ranked(recalibrated, ranked, ["arm.inertia.zz"]).parameters
    assert [start[name].value for name in moments] == pytest.approx([0.009, 0.012, 0.011])
