"""Where each effect shows: the state over which its residual is a line, what that line looks like, what excites it.

A report draws its evidence over this state, and the page of the catalogue says it in words. One row for each effect.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

Axis = Literal[
    "velocity",
    "position",
    "acceleration",
    "effort",
    "command",
    "command_rate",
    "pressure_difference",
    "flow",
    "frequency",
    "time",
]
"""What a residual can be drawn over: motion of the joint, effort that it needs, command and its rate, hydraulics."""


@dataclass(frozen=True)
class Signature:
    """How an effect shows itself.

    Attributes
    ----------
    lives_in : tuple of str
        What to draw the residual over. Of several the one that explains most of the effect in the data at hand.
    looks : str
        What is to be seen there, a sentence without its full stop.
    excite : str
        The experiment that shows it best, a sentence without its full stop.
    """

    lives_in: tuple[Axis, ...]
    looks: str
    excite: str


_SLOW_AND_FAST = "Motion in both directions at several constant speeds, with slow starts from rest"

SIGNATURES: Mapping[str, Signature] = MappingProxyType(
    {
        "viscous_friction": Signature(
            ("velocity",), "A straight line through zero", "Motion at several constant speeds"
        ),
        "coulomb_friction": Signature(
            ("velocity",), "Two levels of opposite sign, one for each direction, with a step at rest", _SLOW_AND_FAST
        ),
        "asymmetric_friction": Signature(
            ("velocity",), "Levels or slopes that differ between the two directions", _SLOW_AND_FAST
        ),
        "stribeck_friction": Signature(
            ("velocity",),
            "A hump on both sides of rest that is gone at higher speed",
            "Slow motion that starts from rest, again and again",
        ),
        "bias_force": Signature(
            ("time", "position"),
            "One level that never changes",
            "The same motion forward and back, and rest in several places",
        ),
        "spring": Signature(
            ("position",), "A straight line that crosses zero at the place of rest", "Slow motion over the whole way"
        ),
        "torque_ripple": Signature(
            ("position",),
            "A wave that repeats over the way, whatever the speed",
            "Slow motion at constant speed over many periods",
        ),
        "backlash": Signature(
            ("position", "effort"),
            "A flat part where nothing is passed on, with a step wherever the effort changes its sign",
            "Reversals under a small load, with a sensor on either side of the play",
        ),
        "hysteresis": Signature(
            ("position",),
            "A loop that is run through in the same sense at every speed",
            "Slow reversals over ways of several lengths",
        ),
        "joint_compliance": Signature(
            ("frequency",),
            "A peak at the resonance of load and motor against each other",
            "A chirp or a multisine through the resonance",
        ),
        "rotor_inertia": Signature(
            ("acceleration",),
            "A straight line through zero over the acceleration of the motor",
            "Fast reversals without a load",
        ),
        "end_stop": Signature(
            ("position",),
            "Nothing, and beyond one place a steep wall",
            "Slow motion into the stop, and faster than that",
        ),
        "payload": Signature(
            ("position", "acceleration", "effort"),
            "The course of gravity over the way, or a line over the acceleration where gravity has no lever",
            "Slow motion through several poses, then fast motion",
        ),
        "link_flexibility": Signature(
            ("frequency",),
            "A peak at the first natural frequency of the link",
            "A chirp or quick stops, with a strain gauge at the root",
        ),
        "structural_damping": Signature(
            ("frequency",),
            "A resonance that is lower and broader than modelled",
            "Quick stops, after which the link rings out freely",
        ),
        "gravity_tilt": Signature(
            ("position",), "A sine over the pose, shifted against that of gravity", "Slow motion through several poses"
        ),
        "input_delay": Signature(
            ("command_rate",), "A straight line over the rate of the command", "Steps and fast commands"
        ),
        "dead_zone": Signature(
            ("command",),
            "Two levels of opposite sign, joined through small commands",
            "Small commands of both signs under a load",
        ),
        "saturation": Signature(
            ("command",),
            "Nothing up to the limit, and beyond it a straight line",
            "Commands up to the largest that the drive may take",
        ),
        "actuator_lag": Signature(
            ("command_rate",),
            "A loop around a line over the rate of the command, open for fast commands",
            "Steps and fast commands",
        ),
        "valve_dynamics": Signature(
            ("frequency", "command_rate"),
            "An error that grows with frequency up to the bandwidth of the valve",
            "A chirp of the current",
        ),
        "internal_leakage": Signature(
            ("pressure_difference",),
            "A line over the difference of the chambers' pressures",
            "Holding a load, and slow motion under load",
        ),
        "entrained_air": Signature(
            ("pressure_difference", "time"),
            "An error of the pressures that is large where the pressure is low",
            "Load steps at low pressure",
        ),
        "supply_drop": Signature(
            ("flow",),
            "An error of the pressures that grows with the flow that is drawn",
            "Fast strokes, with the supply's pressure logged",
        ),
        "sensor_offset": Signature(
            ("position", "time"),
            "The slope of gravity or of a spring over the way; nothing without either",
            "A reference position",
        ),
        "sensor_gain": Signature(
            ("effort", "position"), "A straight line over the effort that the motion needs", "A way of known length"
        ),
        "sensor_delay": Signature(
            ("command_rate",),
            "A straight line over the rate of the command",
            "Steps, and time stamps of a second sensor",
        ),
        "quadratic_drag": Signature(
            ("velocity",), "A parabola that changes its sign at rest", "Fast motion at several constant speeds"
        ),
        "cubic_spring": Signature(
            ("position",), "A cubic parabola that crosses zero at the place of rest", "Slow motion over the whole way"
        ),
        "position_dependent_friction": Signature(
            ("position", "velocity"),
            "A wave that repeats over the way and turns over with the direction",
            "Slow motion at constant speed over many periods, forward and back",
        ),
        "current_ripple": Signature(
            ("position", "effort"),
            "A wave that repeats over the way, as large as the effort, and turns over with it",
            "Slow motion at constant speed over many periods, under several loads",
        ),
        "load_dependent_friction": Signature(
            ("effort",),
            "Lines through zero over the effort, one for each direction",
            "The same slow motion forward and back under several loads",
        ),
        "drive_friction": Signature(
            ("effort",),
            "Lines through zero over the effort of one actuator, one for each direction",
            "The same slow motion forward and back at several efforts of this actuator",
        ),
        "lugre_friction": Signature(
            ("position", "velocity"),
            "A loop over short ways, and over long ones levels with a hump close to rest",
            "Slow reversals over ways of several lengths, and starts from rest",
        ),
        "warming_friction": Signature(
            ("time", "velocity"),
            "Levels for each direction that come together over time",
            "The same motion again and again after a cold start",
        ),
        "empirical_force": Signature(
            ("velocity", "position", "acceleration", "effort", "command"),
            "Whatever the sparse formula says over the states that it was found in",
            "The motion over which it has to predict: it is not physics, and says nothing beyond",
        ),
    }
)
"""Signature of each effect by name."""

#: For effects that users add without saying where they live: what explains most of it is drawn.
ANYWHERE = Signature(
    ("velocity", "position", "acceleration", "effort", "command", "time"),
    "A line over one of the states",
    "Motion that covers the states that its law names",
)


def signature_of(name: str) -> Signature:
    """Signature of an effect; `ANYWHERE` for one that has no row.

    Parameters
    ----------
    name : str
    """
    return SIGNATURES.get(name, ANYWHERE)
