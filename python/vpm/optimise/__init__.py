"""Trajectory optimisation with elasticity: tasks, the search for the best motion, and its result."""

from vpm.optimise.optimise import OptimisationInterruptedError, optimise
from vpm.optimise.optimum import Optimum
from vpm.optimise.task import Task

__all__ = ["OptimisationInterruptedError", "Optimum", "Task", "optimise"]
