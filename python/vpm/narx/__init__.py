"""Polynomial difference equations with inputs (NARX) from records, and how far to trust them."""

from vpm.narx.identification import Criterion, identify
from vpm.narx.maxwell import MaxwellNarx
from vpm.narx.maxwell_fit import identify_maxwell, refine_maxwell
from vpm.narx.maxwell_maps import MaxwellMap, fit_maxwell_map
from vpm.narx.maxwell_motion import dynamic_windows
from vpm.narx.maxwell_printed import minimum_norm_static, printed_dynamic_regression, static_rank
from vpm.narx.maxwell_records import MaxwellSignals
from vpm.narx.maxwell_result import MaxwellFit
from vpm.narx.maxwell_runs import MaxwellErrors, maxwell_errors, maxwell_free_run, maxwell_one_step, thesis_sigma
from vpm.narx.maxwell_windows import MaxwellWindows, static_windows
from vpm.narx.model import Narx
from vpm.narx.records import split_in_time
from vpm.narx.run import NarxRun, ResidualTests
from vpm.narx.validation import NarxValidation, validate

__all__ = [
    "Criterion",
    "MaxwellErrors",
    "MaxwellFit",
    "MaxwellMap",
    "MaxwellNarx",
    "MaxwellSignals",
    "MaxwellWindows",
    "Narx",
    "NarxRun",
    "NarxValidation",
    "ResidualTests",
    "dynamic_windows",
    "fit_maxwell_map",
    "identify",
    "identify_maxwell",
    "maxwell_errors",
    "maxwell_free_run",
    "maxwell_one_step",
    "minimum_norm_static",
    "printed_dynamic_regression",
    "refine_maxwell",
    "split_in_time",
    "static_rank",
    "static_windows",
    "thesis_sigma",
    "validate",
]
