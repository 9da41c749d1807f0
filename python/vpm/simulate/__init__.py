"""Simulation of a log: `modes.py` says which question each mode answers."""

from vpm.simulate.inputs import restart_grid, simulation_inputs, with_running_lengths
from vpm.simulate.modes import (
    MODES,
    check_balance,
    comparing_mode,
    judging_mode,
    places_joints,
    simulate,
    simulate_arrays,
    simulated_rows,
)
from vpm.simulate.resolution import Resolution
from vpm.simulate.run import Run, SimulatedArrays, copied_channels, judged
from vpm.simulate.setup import AUTOMATIC, FIXED_STEP, HOLDS, INTEGRATORS, Setup

__all__ = [
    "AUTOMATIC",
    "FIXED_STEP",
    "HOLDS",
    "INTEGRATORS",
    "MODES",
    "Resolution",
    "Run",
    "Setup",
    "SimulatedArrays",
    "check_balance",
    "comparing_mode",
    "copied_channels",
    "judged",
    "judging_mode",
    "places_joints",
    "restart_grid",
    "simulate",
    "simulate_arrays",
    "simulated_rows",
    "simulation_inputs",
    "with_running_lengths",
]
