"""Identification: parameters, their uncertainty, and what the data cannot see."""

from vpm.identify.fit import Estimate, Fit, estimate, identify
from vpm.identify.identifiability import Combination, unseen_combinations
from vpm.identify.problem import Block, InverseDynamicsProblem, OutputErrorProblem, Problem, gaps, problem, segments
from vpm.identify.statistics import Gain, gain, robust_covariance

__all__ = [
    "Block",
    "Combination",
    "Estimate",
    "Fit",
    "Gain",
    "InverseDynamicsProblem",
    "OutputErrorProblem",
    "Problem",
    "estimate",
    "gain",
    "gaps",
    "identify",
    "problem",
    "robust_covariance",
    "segments",
    "unseen_combinations",
]
