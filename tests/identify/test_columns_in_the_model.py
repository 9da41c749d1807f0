"""A model file may hold the table of its logged columns, also where a fit takes the machine apart."""

from pathlib import Path

import numpy as np
import pytest

import vpm
from vpm import Model

RIG = Path(__file__).parents[2] / "examples/servo_cylinder/rig.toml"
COLUMNS = {
    "time": {"column": "t", "unit": "s"},
    "axis.position": {"column": "x_mm", "unit": "mm"},
    "servo.command": {"column": "i_mA", "unit": "mA"},
    "servo.pressure_a": {"column": "pa_bar", "unit": "bar"},
    "servo.pressure_b": {"column": "pb_bar", "unit": "bar"},
}


def test_a_cylinder_is_fitted_beside_its_columns(tmp_path: Path) -> None:
    """Both pressures tell the force, so the friction of the slide comes back from its own run."""
    rig = Model.from_dict({**Model.load(RIG).to_dict(), "channels": COLUMNS})
    time = 5e-4 * np.arange(3000)
    current = 2e-3 * np.cos(2.0 * np.pi * 3.0 * time)
    run = vpm.simulate(rig, vpm.Experiment.from_arrays(time, {"servo.command": current}), integrator="rosenbrock")
    shown = [run[name] for name in ("axis.position", "servo.pressure_a", "servo.pressure_b")]
    rows = np.column_stack([time, 1e3 * shown[0], 1e3 * current, 1e-5 * shown[1], 1e-5 * shown[2]])
    path = tmp_path / "log.csv"
    np.savetxt(path, rows, delimiter=",", header="t,x_mm,i_mA,pa_bar,pb_bar", comments="", fmt="%.9g")

    start = rig.with_parameters({"axis.friction.viscous": 500.0})
    fit = vpm.identify(start, vpm.Experiment.load(path, model=start), free=["axis.friction.viscous"])
    assert fit["axis.friction.viscous"] == pytest.approx(700.0, rel=0.01)
