"""Virtual prototype models: real-time robot dynamics that know where they disagree with the machine.

One way through the package::

    model -> simulate -> compare -> identify -> diagnose -> simplify -> budget -> report

Each arrow is a function of this module, each result one frozen object.
"""

from importlib.metadata import version

from vpm import impedance, linkages, narx, realtime
from vpm.batch import Trial, simulate_batch
from vpm.budget import BudgetReport, budget
from vpm.catalogue import EFFECTS
from vpm.climb import Climb, climb
from vpm.compare import Comparison, compare
from vpm.discrepancy import Diagnosis, diagnose
from vpm.errors import VpmError
from vpm.experiment import Campaign, Experiment
from vpm.identify import (
    CylinderGeometry,
    Fit,
    Fitting,
    InertialFit,
    InertialRegression,
    OilFit,
    identify,
    identify_inertial,
    identify_oil,
)
from vpm.linear import LinearModel
from vpm.model import Dynamics, Model
from vpm.planar import PlanarArm
from vpm.report import Report, report, write_report
from vpm.scenario import Scenario, ScenarioRun
from vpm.simplify import Ladder, simplify
from vpm.simulate import Run, Setup, simulate
from vpm.stepping import Simulation

__version__ = version("vpm-dynamics")

__all__ = [
    "EFFECTS",
    "BudgetReport",
    "Campaign",
    "Climb",
    "Comparison",
    "CylinderGeometry",
    "Diagnosis",
    "Dynamics",
    "Experiment",
    "Fit",
    "Fitting",
    "InertialFit",
    "InertialRegression",
    "Ladder",
    "LinearModel",
    "Model",
    "OilFit",
    "PlanarArm",
    "Report",
    "Run",
    "Scenario",
    "ScenarioRun",
    "Setup",
    "Simulation",
    "Trial",
    "VpmError",
    "__version__",
    "budget",
    "climb",
    "compare",
    "diagnose",
    "identify",
    "identify_inertial",
    "identify_oil",
    "impedance",
    "linkages",
    "narx",
    "realtime",
    "report",
    "simplify",
    "simulate",
    "simulate_batch",
    "write_report",
]
