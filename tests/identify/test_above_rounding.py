"""What a parameter does is judged by its own size, whatever unit it has."""

import numpy as np

from vpm.identify.identifiability import above_rounding
from vpm.model import Model


def test_a_leakage_of_which_nothing_is_known_hides_no_friction() -> None:
    """A cylinder leaks 5e-12 m^3/(s Pa): per unit of that a column is 3e12 long, and does as much as one of 15."""
    rig = Model.load("examples/servo_cylinder/rig.toml")
    rig = rig.with_effect("coulomb_friction", at="axis", coulomb=40.0, transition_velocity=1e-3)
    rig = rig.with_effect("internal_leakage", at="servo", coefficient=5e-12)
    names = "axis.friction.coulomb", "axis.friction.transition_velocity", "servo.internal_leakage.coefficient"
    slopes = np.diag([0.1, 10.0, 3e12])
    np.testing.assert_array_equal(above_rounding(slopes, rig, [rig.index(name) for name in names]), slopes)
    slopes[1, 1] = 1e-11  # 1e-14 of what the leakage does, for the value of 1e-3
    np.testing.assert_array_equal(
        above_rounding(slopes, rig, [rig.index(name) for name in names]), np.diag([0.1, 0.0, 3e12])
    )
