"""Virtual prototype models: real-time robot dynamics that know where they disagree with the machine.

One way through the package::

    model -> simulate -> compare -> identify -> diagnose -> simplify -> budget -> report

Each arrow is a function of this module, each result one frozen object. Names are loaded when they are first used, so
that ``import vpm`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vpm.budget import BudgetReport, budget
    from vpm.catalogue import EFFECTS
    from vpm.compare import Comparison, compare
    from vpm.discrepancy import Diagnosis, diagnose
    from vpm.errors import VpmError
    from vpm.experiment import Experiment
    from vpm.identify import Fit, identify
    from vpm.model import Model
    from vpm.report import write_report
    from vpm.simplify import Ladder, simplify
    from vpm.simulate import Run, Setup, simulate

__version__ = version("vpm-dynamics")

_HOMES = {
    "BudgetReport": "budget",
    "budget": "budget",
    "EFFECTS": "catalogue",
    "Comparison": "compare",
    "compare": "compare",
    "Diagnosis": "discrepancy",
    "diagnose": "discrepancy",
    "VpmError": "errors",
    "Experiment": "experiment",
    "Fit": "identify",
    "identify": "identify",
    "Model": "model",
    "write_report": "report",
    "Ladder": "simplify",
    "simplify": "simplify",
    "Run": "simulate",
    "Setup": "simulate",
    "simulate": "simulate",
}

__all__ = [
    "EFFECTS",
    "BudgetReport",
    "Comparison",
    "Diagnosis",
    "Experiment",
    "Fit",
    "Ladder",
    "Model",
    "Run",
    "Setup",
    "VpmError",
    "__version__",
    "budget",
    "compare",
    "diagnose",
    "identify",
    "simplify",
    "simulate",
    "write_report",
]


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'vpm' has no attribute '{name}'")
    value = getattr(import_module(f"vpm.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
