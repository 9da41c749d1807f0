"""Stiffness and damping of joints and cylinders from hysteresis loops, impacts and landings, with repeated tests."""

from vpm.studies.impedance.decay import Decay, LogarithmicDecrement, identify_decay, logarithmic_decrement
from vpm.studies.impedance.hysteresis_loop import Loop, identify_loop
from vpm.studies.impedance.impact import ImpulseBalance, Stop, impulse_balance, stop_damping, stop_factor
from vpm.studies.impedance.landing import Landing, identify_landing
from vpm.studies.impedance.loss import LossLaw, identify_loss_law
from vpm.studies.impedance.repeated import ImpedanceTable, Repeated, RepeatedTests, repeat, repeat_tests

__all__ = [
    "Decay",
    "ImpedanceTable",
    "ImpulseBalance",
    "Landing",
    "LogarithmicDecrement",
    "Loop",
    "LossLaw",
    "Repeated",
    "RepeatedTests",
    "Stop",
    "identify_decay",
    "identify_landing",
    "identify_loop",
    "identify_loss_law",
    "impulse_balance",
    "logarithmic_decrement",
    "repeat",
    "repeat_tests",
    "stop_damping",
    "stop_factor",
]
