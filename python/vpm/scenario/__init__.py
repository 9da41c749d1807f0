"""Scenarios: tests without a log, one file for what drives a machine, how it starts, and what is compared."""

from vpm.scenario.outcome import ScenarioInterruptedError, ScenarioRun
from vpm.scenario.scenario import Scenario

__all__ = ["Scenario", "ScenarioInterruptedError", "ScenarioRun"]
