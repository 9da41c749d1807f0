"""Motions and commands that show what a model has to know: multisines, chirps, noise, trapezoids, Fourier series."""

from vpm.excitation.base_parameters import BaseParameters, base_parameters
from vpm.excitation.chirp_and_noise import chirp, noise
from vpm.excitation.design import fourier_trajectory
from vpm.excitation.excitation import Excitation
from vpm.excitation.fourier import FourierTrajectory
from vpm.excitation.limits import JointLimits
from vpm.excitation.multisine import multisine
from vpm.excitation.trapezoid import trapezoid

__all__ = [
    "BaseParameters",
    "Excitation",
    "FourierTrajectory",
    "JointLimits",
    "base_parameters",
    "chirp",
    "fourier_trajectory",
    "multisine",
    "noise",
    "trapezoid",
]
