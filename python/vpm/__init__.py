"""Virtual prototype models: real-time robot dynamics that know where they disagree with the machine.

One way through the package::

    model -> simulate -> compare -> identify -> diagnose -> simplify -> budget -> report

Each arrow is a function of this module, each result one frozen object.
"""

import sys
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vpm import impedance, linkages, narx, realtime
    from vpm.batch import Trial, simulate_batch
    from vpm.budget import BudgetReport, budget
    from vpm.catalogue import EFFECTS
    from vpm.climb import Climb, climb
    from vpm.compare import Comparison, compare
    from vpm.control import (
        FlexibleController,
        FlexibleFeedforward,
        StateFeedback,
        TargetMotion,
        flexible_feedforward,
        state_feedback,
    )
    from vpm.diagnosing import diagnose
    from vpm.discrepancy import Diagnosis
    from vpm.errors import VpmError
    from vpm.experiment import Campaign, Experiment
    from vpm.identify import Fit, Fitting, InertialFit, InertialRegression, identify, identify_inertial
    from vpm.linear import LinearModel
    from vpm.log_check import LogCheck, check_log
    from vpm.many_diagnoses import Case, diagnose_many
    from vpm.model import Dynamics, Model
    from vpm.observer import Noise, Observation, Observer, observe
    from vpm.optimise import Optimum, optimise
    from vpm.ranking import Ranking, rank
    from vpm.realtime import write_fmu
    from vpm.reduction import Reduction, reduce
    from vpm.report import Report, report, write_report
    from vpm.robots import ExportedRobot, ImportedRobot, export_robot, import_robot
    from vpm.scenario import Scenario, ScenarioRun
    from vpm.shaping import Shaper, shaper
    from vpm.simplify import Ladder, simplify
    from vpm.simulate import Run, Setup, simulate
    from vpm.stepping import Simulation
    from vpm.studies.oil import CylinderGeometry, OilFit, identify_oil
    from vpm.view import view
    from vpm.weighing import Weighing, weigh

    __version__: str

__all__ = [
    "EFFECTS",
    "BudgetReport",
    "Campaign",
    "Case",
    "Climb",
    "Comparison",
    "CylinderGeometry",
    "Diagnosis",
    "Dynamics",
    "Experiment",
    "ExportedRobot",
    "Fit",
    "Fitting",
    "FlexibleController",
    "FlexibleFeedforward",
    "ImportedRobot",
    "InertialFit",
    "InertialRegression",
    "Ladder",
    "LinearModel",
    "LogCheck",
    "Model",
    "Noise",
    "Observation",
    "Observer",
    "OilFit",
    "Optimum",
    "Ranking",
    "Reduction",
    "Report",
    "Run",
    "Scenario",
    "ScenarioRun",
    "Setup",
    "Shaper",
    "Simulation",
    "StateFeedback",
    "TargetMotion",
    "Trial",
    "VpmError",
    "Weighing",
    "__version__",
    "budget",
    "check_log",
    "climb",
    "compare",
    "diagnose",
    "diagnose_many",
    "export_robot",
    "flexible_feedforward",
    "identify",
    "identify_inertial",
    "identify_oil",
    "impedance",
    "import_robot",
    "linkages",
    "narx",
    "observe",
    "optimise",
    "rank",
    "realtime",
    "reduce",
    "report",
    "shaper",
    "simplify",
    "simulate",
    "simulate_batch",
    "state_feedback",
    "view",
    "weigh",
    "write_fmu",
    "write_report",
]

#: Public names of each module.
_NAMES = {
    "vpm.batch": ("Trial", "simulate_batch"),
    "vpm.budget": ("BudgetReport", "budget"),
    "vpm.catalogue": ("EFFECTS",),
    "vpm.climb": ("Climb", "climb"),
    "vpm.compare": ("Comparison", "compare"),
    "vpm.control": (
        "FlexibleController",
        "FlexibleFeedforward",
        "StateFeedback",
        "TargetMotion",
        "flexible_feedforward",
        "state_feedback",
    ),
    "vpm.diagnosing": ("diagnose",),
    "vpm.discrepancy": ("Diagnosis",),
    "vpm.errors": ("VpmError",),
    "vpm.experiment": ("Campaign", "Experiment"),
    "vpm.identify": ("Fit", "Fitting", "InertialFit", "InertialRegression", "identify", "identify_inertial"),
    "vpm.linear": ("LinearModel",),
    "vpm.log_check": ("LogCheck", "check_log"),
    "vpm.many_diagnoses": ("Case", "diagnose_many"),
    "vpm.model": ("Dynamics", "Model"),
    "vpm.observer": ("Noise", "Observation", "Observer", "observe"),
    "vpm.optimise": ("Optimum", "optimise"),
    "vpm.ranking": ("Ranking", "rank"),
    "vpm.realtime": ("write_fmu",),
    "vpm.reduction": ("Reduction", "reduce"),
    "vpm.report": ("Report", "report", "write_report"),
    "vpm.robots": ("ExportedRobot", "ImportedRobot", "export_robot", "import_robot"),
    "vpm.scenario": ("Scenario", "ScenarioRun"),
    "vpm.shaping": ("Shaper", "shaper"),
    "vpm.simplify": ("Ladder", "simplify"),
    "vpm.simulate": ("Run", "Setup", "simulate"),
    "vpm.stepping": ("Simulation",),
    "vpm.studies.oil": ("CylinderGeometry", "OilFit", "identify_oil"),
    "vpm.view": ("view",),
    "vpm.weighing": ("Weighing", "weigh"),
}
#: The module that each name comes from, once it is asked for: a program loads what it uses.
_HOMES = {name: module for module, names in _NAMES.items() for name in names}


class _Package(ModuleType):
    """A package whose functions keep their names beside modules of the same name, such as `compare`."""

    def __setattr__(self, name: str, value: object) -> None:
        """Bind a name, but not that of a function to the module that Python has just loaded."""
        if not (name in _HOMES and value is sys.modules.get(f"vpm.{name}")):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package

# Behind the condition, so that type checkers know the names above and no other.
if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Load a name at its first use."""
        if name == "__version__":
            value = import_module("importlib.metadata").version("vpm-dynamics")
        elif name in _HOMES:
            value = getattr(import_module(_HOMES[name]), name)
        elif name.startswith("__") or find_spec(f"vpm.{name}") is None:
            raise AttributeError(f"module 'vpm' has no attribute {name!r}", name=name, obj=sys.modules[__name__])
        else:
            return import_module(f"vpm.{name}")
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
