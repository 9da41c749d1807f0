"""The Maxwell element of D'Imperio's thesis from windows of tests at rest and in motion, and its errors.

The element and the refinement of all its coefficients are those of `vpm.narx`.
"""

from vpm.studies.maxwell.fit import identify_maxwell
from vpm.studies.maxwell.maps import MaxwellMap, fit_maxwell_map
from vpm.studies.maxwell.motion import dynamic_windows
from vpm.studies.maxwell.printed import minimum_norm_static, printed_dynamic_regression, static_rank
from vpm.studies.maxwell.runs import MaxwellErrors, maxwell_errors, maxwell_free_run, maxwell_one_step, thesis_sigma
from vpm.studies.maxwell.windows import MaxwellWindows, static_windows

__all__ = [
    "MaxwellErrors",
    "MaxwellMap",
    "MaxwellWindows",
    "dynamic_windows",
    "fit_maxwell_map",
    "identify_maxwell",
    "maxwell_errors",
    "maxwell_free_run",
    "maxwell_one_step",
    "minimum_norm_static",
    "printed_dynamic_regression",
    "static_rank",
    "static_windows",
    "thesis_sigma",
]
