"""Inverse-dynamics problems of a blind case, without simulations."""

from blind import Case
from vpm.discrepancy.judged_model import Data
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model


def inverse_dynamics_data(case: Case) -> tuple[Model, tuple[str, ...], Data]:
    """Nominal model, its adjustable parameters, and the inverse-dynamics problems of its records."""
    model = case.model()
    training, validation = (InverseDynamicsProblem(model, records) for records in (case.train, case.validate))
    for problem in (training, validation):
        problem.take_long_steps()
    free = tuple(p.name for p in model.parameters.values() if p.adjustable)
    return model, free, Data(training, validation, None)
