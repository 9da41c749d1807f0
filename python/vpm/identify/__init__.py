"""Identification: parameters, their uncertainty, and what the data cannot see."""

from vpm.identify.comparison import FIT_MODES, problem
from vpm.identify.estimation import Estimate, estimate
from vpm.identify.fit import Fit, identify
from vpm.identify.identifiability import Combination, unseen_combinations
from vpm.identify.input_error import InputErrorProblem
from vpm.identify.intervals import Bootstrap, Profile, bootstrap, profile_intervals
from vpm.identify.problem import Block, InverseDynamicsProblem, OutputErrorProblem, Problem, gaps, segments
from vpm.identify.settings import Fitting
from vpm.identify.shooting import ShootingProblem
from vpm.identify.statistics import Gain, gain, robust_covariance
from vpm.identify.unseen import judged_on
from vpm.identify.written import write_fit

__all__ = [
    "FIT_MODES",
    "Block",
    "Bootstrap",
    "Combination",
    "Estimate",
    "Fit",
    "Fitting",
    "Gain",
    "InputErrorProblem",
    "InverseDynamicsProblem",
    "OutputErrorProblem",
    "Problem",
    "Profile",
    "ShootingProblem",
    "bootstrap",
    "estimate",
    "gain",
    "gaps",
    "identify",
    "judged_on",
    "problem",
    "profile_intervals",
    "robust_covariance",
    "segments",
    "unseen_combinations",
    "write_fit",
]
