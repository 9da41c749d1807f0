"""Polynomial difference equations with inputs (NARX) from records, and how far to trust them."""

from typing import TYPE_CHECKING

from vpm.moved import names_of_study
from vpm.narx.identification import Criterion, identify
from vpm.narx.maxwell import MaxwellNarx
from vpm.narx.maxwell_records import MaxwellSignals
from vpm.narx.maxwell_refinement import refine_maxwell
from vpm.narx.maxwell_result import MaxwellFit
from vpm.narx.model import Narx
from vpm.narx.records import split_in_time
from vpm.narx.run import NarxRun, ResidualTests
from vpm.narx.validation import NarxValidation, validate

if TYPE_CHECKING:
    from vpm.studies.maxwell import (
        MaxwellErrors,
        MaxwellMap,
        MaxwellWindows,
        dynamic_windows,
        fit_maxwell_map,
        identify_maxwell,
        maxwell_errors,
        maxwell_free_run,
        maxwell_one_step,
        minimum_norm_static,
        printed_dynamic_regression,
        static_rank,
        static_windows,
        thesis_sigma,
    )
else:
    __getattr__ = names_of_study(__name__, "vpm.studies.maxwell")

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
