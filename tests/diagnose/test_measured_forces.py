"""Readings of forces, as of a load cell, that no residual of efforts holds."""

from pathlib import Path

import numpy as np
import pytest

from vpm import Experiment, Model, diagnose, simulate

#: A pendulum on a load cell, whose drive turns it by a known torque.
PENDULUM = """
name = "pendulum on a load cell"
gravity = [0.0, 0.0, -9.81]
[bodies.arm]
mass = { value = 2.0, uncertainty = 0.1 }
center_of_mass = [0.0, 0.0, -0.3]
inertia = [0.02, 0.02, 0.02, 0.0, 0.0, 0.0]
[joints.hinge]
type = "revolute"
parent = "world"
child = "arm"
axis = [0.0, -1.0, 0.0]
[actuators.drive]
joint = "hinge"
gain = 1.0
command_unit = "1"
[load_cells.cell]
joint = "hinge"
[[effects]]
type = "viscous_friction"
at = "hinge"
viscous = { value = 0.2, uncertainty = 0.1 }
"""


@pytest.mark.parametrize(("size", "verdicts"), [(0.0, {"no_disagreement", "parameters_only"}), (3.0, {"unexplained"})])
def test_a_load_cell_that_reads_more_is_not_passed_over(tmp_path: Path, size: float, verdicts: set[str]) -> None:
    """The efforts agree, but a shaker beside the machine pushes the cell by some N, which no effect does."""
    (path := tmp_path / "pendulum.toml").write_text(PENDULUM)
    model = Model.load(path)
    time = np.arange(3000) / 500.0

    def record(seed: int) -> Experiment:
        random = np.random.default_rng(seed)
        command = 2.0 * np.sin(2.0 * np.pi * (0.6 + 0.05 * seed) * time) + np.sin(2.0 * np.pi * 1.7 * time + seed)
        run = simulate(model, Experiment.from_arrays(time, {"drive.command": command}, model=model), "free_run")
        angle = run["hinge.position"] + random.normal(0.0, 1e-5, time.size)
        force = run["cell.fz"] + size * np.sin(2.0 * np.pi * 3.1 * time) + random.normal(0.0, 0.05, time.size)
        return Experiment.from_arrays(
            time, {"drive.command": command, "hinge.position": angle, "cell.fz": force}, model=model
        )

    why = diagnose(model, [record(1), record(2)], [record(3)], workers=1)
    assert why.verdict in verdicts
    assert ("cell.fz" in why.summary) == (size > 0.0)
