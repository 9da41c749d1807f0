"""Diagnosis of a link that rings from the first sample on, as after a jump of the first command."""

import numpy as np

import vpm
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.discrepancy.preparation import begun_anywhere, data_of, recalibrated_of

MAST = """
name = "mast"
gravity = [0.0, 0.0, 0.0]
bodies.hub = { mass = 1.0, inertia = [0.1, 0.1, 0.12, 0.0, 0.0, 0.0] }
bodies.head = { mass = 0.25, inertia = [2e-4, 2e-4, 2e-4, 0.0, 0.0, 0.0] }
joints.slew = { type = "revolute", parent = "world", child = "hub", axis = [0, 0, 1] }
joints.flange = { type = "fixed", parent = "strip", child = "head", rotation = [0.0, -1.5707963267948966, 0.0] }
actuators.motor = { joint = "slew", gain = 12.0, command_unit = "A" }
imus.chip.parent = "head"
[beams.strip]
parent = "hub"
rotation = [0.0, 1.5707963267948966, 0.0]
length = 1.2
level = "modal(1)"
deforms = ["bending_x"]
material = { young = { value = 69e9, uncertainty = 4e9 }, density = 2700.0 }
section = { shape = "rectangle", width = 0.04, height = 0.008 }
damping = { stiffness = 6e-4 }
"""
YOUNG = "strip.young"


def rung(machine: vpm.Model, jump: float, seed: int) -> vpm.Experiment:
    """Record of 3 s at 500 Hz as vpm simulates it in an eighth of the step; ``jump`` acts for the first 20 ms, A."""
    step, fine, random = 2e-3, 8, np.random.default_rng(seed)
    simulation, rows = vpm.Simulation(machine, step / fine), []
    for time in step * np.arange(1500):
        command = 0.2 * np.sin(7.0 * time) * min(1.0, time) + jump * (time < 0.02)
        rows.append((simulation["slew.position"], command, simulation["chip.ay"]))
        for _ in range(fine):
            simulation.step([command])
    position, command, lateral = np.array(rows).T
    columns = {
        "slew.position": position + 2e-5 * random.standard_normal(len(rows)),
        "motor.command": command,
        "chip.ay": lateral + 0.05 * random.standard_normal(len(rows)),
    }
    return vpm.Experiment.from_arrays(step * np.arange(len(rows)), columns, model=machine, name=f"run {seed}")


def recalibrated(jump: float) -> tuple[float, list[str]]:
    """Young's modulus that a diagnosis recalibrates from one 5 % too large, and its notes."""
    right, notes = vpm.Model.from_toml(MAST), list[str]()
    records = [rung(right, jump, 1)], [rung(right, -jump, 2)]
    wrong = right.with_parameters({YOUNG: 1.05 * 69e9})
    data = data_of(wrong, *records, "restarts", None, vpm.Setup(), notes)
    at_rest = recalibrated_of(wrong, data, notes, ParallelCandidates(1))
    _, found = begun_anywhere(wrong, data, at_rest, notes)
    return found.model.parameters[YOUNG].value, notes


def test_what_rings_from_the_first_sample_on_is_no_missing_effect() -> None:
    young, notes = recalibrated(5.0)
    assert abs(young / 69e9 - 1.0) < 0.01
    assert any("their first states are unknown" in note for note in notes)


def test_a_link_that_begins_at_rest_has_no_unknown_first_states() -> None:
    young, notes = recalibrated(0.0)
    assert abs(young / 69e9 - 1.0) < 0.01
    assert not any("their first states are unknown" in note for note in notes)
