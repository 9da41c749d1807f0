"""Identification: parameters, their uncertainty, and what the data cannot see."""

from typing import TYPE_CHECKING

from vpm.identify.comparison import FIT_MODES, problem
from vpm.identify.estimation import Estimate, estimate
from vpm.identify.export import write_fit
from vpm.identify.fit import identify
from vpm.identify.fit_result import Fit
from vpm.identify.identifiability import Combination, unseen_combinations
from vpm.identify.inertial import identify_inertial
from vpm.identify.inertial_fit import InertialFit
from vpm.identify.inertial_model import inertial_regression
from vpm.identify.inertial_regression import InertialRegression
from vpm.identify.input_error import InputErrorProblem
from vpm.identify.intervals import Bootstrap, Profile, bootstrap, profile_intervals
from vpm.identify.inverse_dynamics import InverseDynamicsProblem
from vpm.identify.output_error import OutputErrorProblem
from vpm.identify.prediction_error import PredictionErrorProblem
from vpm.identify.problem import Block, Problem, gaps, segments
from vpm.identify.refitting import judged_on
from vpm.identify.settings import Checks, Fitting
from vpm.identify.shooting import ShootingProblem
from vpm.identify.statistics import Gain, gain, robust_covariance
from vpm.identify.whiteness import Whiteness, ljung_box
from vpm.moved import names_of_study

if TYPE_CHECKING:
    from vpm.studies.oil import CylinderGeometry, OilFit, identify_oil, pressures_from_force
else:
    __getattr__ = names_of_study(__name__, "vpm.studies.oil")

__all__ = [
    "FIT_MODES",
    "Block",
    "Bootstrap",
    "Checks",
    "Combination",
    "CylinderGeometry",
    "Estimate",
    "Fit",
    "Fitting",
    "Gain",
    "InertialFit",
    "InertialRegression",
    "InputErrorProblem",
    "InverseDynamicsProblem",
    "OilFit",
    "OutputErrorProblem",
    "PredictionErrorProblem",
    "Problem",
    "Profile",
    "ShootingProblem",
    "Whiteness",
    "bootstrap",
    "estimate",
    "gain",
    "gaps",
    "identify",
    "identify_inertial",
    "identify_oil",
    "inertial_regression",
    "judged_on",
    "ljung_box",
    "pressures_from_force",
    "problem",
    "profile_intervals",
    "robust_covariance",
    "segments",
    "unseen_combinations",
    "write_fit",
]
