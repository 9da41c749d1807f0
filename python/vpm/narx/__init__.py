"""Polynomial difference equations with inputs (NARX) from records, and how far to trust them."""

from vpm.narx.identification import Criterion, identify
from vpm.narx.maxwell import MaxwellNarx
from vpm.narx.model import Narx
from vpm.narx.records import split_in_time
from vpm.narx.run import NarxRun, ResidualTests
from vpm.narx.validation import NarxValidation, validate

__all__ = [
    "Criterion",
    "MaxwellNarx",
    "Narx",
    "NarxRun",
    "NarxValidation",
    "ResidualTests",
    "identify",
    "split_in_time",
    "validate",
]
