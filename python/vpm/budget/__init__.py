"""Does one step of a model fit into the period of a controller? Measured, not estimated."""

from vpm.budget.measure import budget
from vpm.budget.report import BudgetReport, Stage
from vpm.budget.steps import commands, start_state, time_steps

__all__ = ["BudgetReport", "Stage", "budget", "commands", "start_state", "time_steps"]
