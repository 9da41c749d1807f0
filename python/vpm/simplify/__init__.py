"""Model reduction: the cheapest model that still predicts the data within a tolerance."""

from vpm.simplify.pareto_front import Ladder, Rung
from vpm.simplify.reductions import Reduction, reduced, reductions
from vpm.simplify.search import simplify

__all__ = ["Ladder", "Reduction", "Rung", "reduced", "reductions", "simplify"]
