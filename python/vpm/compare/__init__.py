"""Comparison of a simulated run with a log: how far they are apart, and where."""

from vpm.compare.comparison import ChannelComparison, Comparison
from vpm.compare.correlation import Correlation, autocorrelation, cross_correlation, effective_samples
from vpm.compare.export import write_mcap
from vpm.compare.measure import compare
from vpm.compare.regions import Bin, Region, Where

__all__ = [
    "Bin",
    "ChannelComparison",
    "Comparison",
    "Correlation",
    "Region",
    "Where",
    "autocorrelation",
    "compare",
    "cross_correlation",
    "effective_samples",
    "write_mcap",
]
