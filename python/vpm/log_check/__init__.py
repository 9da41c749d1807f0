"""A log beside the model of its machine: wrong units, signs, names and clocks."""

from vpm.log_check.checking import check_log, refuse_mistakes
from vpm.log_check.finding import Finding, LogCheck
from vpm.log_check.settings import Settings

__all__ = ["Finding", "LogCheck", "Settings", "check_log", "refuse_mistakes"]
