"""The true machine of the demo, with room for every effect that can be hidden in it.

The machine is one link on a horizontal axis, hanging down at ``q = 0``, driven by a geared motor:

    ``(J + m l^2) dv/dt = k u_motor - m g l sin(q) - b v - tau_hidden``

Time runs in steps of 50 microseconds by Moreau's midpoint rule. Dry friction is set-valued, so that the link really
stands still while the drive pushes less than the friction holds: each step takes the friction impulse as far as it goes
toward stopping the link and no further. The catalogue's dry friction is a smooth approximation of that.

References
----------
.. [1] J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988.
.. [2] V. Acary, B. Brogliato, "Numerical Methods for Nonsmooth Dynamical Systems", 2008, chapter 10.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

SAMPLE_TIME = 0.002
"""Time between two samples of controller and log [s]."""

STEPS_PER_SAMPLE = 40
"""Steps of the simulation for each sample: 20 kHz."""

STEP = SAMPLE_TIME / STEPS_PER_SAMPLE
"""Time of a step [s]."""


@dataclass(frozen=True)
class Machine:
    """The true machine. The model file that ships beside it knows some of these values only roughly.

    It has room for every hidden effect; one that it does not have is zero.
    """

    mass: float = 1.8
    """Mass of the link [kg]."""
    center_of_mass: float = 0.221
    """Distance from the axis to the centre of mass [m]."""
    inertia: float = 0.0345
    """Moment of inertia about the centre of mass, around the axis [kg m^2]."""
    gravity: float = 9.81
    """[m/s^2]."""
    torque_per_current: float = 1.6
    """Torque on the joint for each ampere of command, gear included [N m/A]."""
    viscous: float = 0.135
    """Viscous friction [N m s/rad]."""

    coulomb: float = 0.0
    """Coulomb friction, set-valued at standstill [N m]."""
    viscous_difference: float = 0.0
    """Viscous friction in positive minus in negative direction [N m s/rad]."""
    coulomb_difference: float = 0.0
    """Coulomb friction in positive minus in negative direction [N m]."""
    stribeck: float = 0.0
    """Friction close to rest in excess of the Coulomb friction [N m]."""
    stribeck_velocity: float = 0.3
    """Speed at which that excess has fallen to 37 % [rad/s]."""
    ripple: float = 0.0
    """Amplitude of the torque ripple [N m]."""
    ripple_period: float = math.tau / 16.0
    """Period of the torque ripple along the joint [rad]."""
    ripple_phase: float = 0.7
    """The ripple is ``ripple cos(2 pi q / period - phase)`` [rad]."""
    bias: float = 0.0
    """Constant torque that the drive has to overcome [N m]."""
    spring: float = 0.0
    """Stiffness of a spring on the joint [N m/rad]."""
    spring_rest: float = 0.0
    """Angle without torque of the spring [rad]."""
    stop_stiffness: float = 0.0
    """Stiffness of an end stop [N m/rad]."""
    stop_damping: float = 0.0
    """Damping of the end stop, per way into it: it pushes with ``k x (1 + damping v)`` and never pulls [s/rad]."""
    stop_high: float = 1.0
    """Angle beyond which the end stop is touched [rad]."""
    hysteresis: float = 0.0
    """Torque of the hysteresis after a long way [N m]."""
    hysteresis_way: float = 0.05
    """Way over which it builds up, by Dahl's law [rad]."""
    tilt: float = 0.0
    """Turn of the base about the axis of the joint [rad]."""
    payload: float = 0.0
    """Mass of a point fixed to the link [kg]."""
    payload_place: tuple[float, float] = (0.15, 0.12)
    """Its place along the link and across it, in the plane of motion [m]."""
    gear_stiffness: float = 0.0
    """Stiffness between motor and link; 0 for a rigid gear [N m/rad]."""
    gear_damping: float = 0.0
    """Damping between them, where they touch [N m s/rad]."""
    gear_play: float = 0.0
    """Free way between them [rad]."""
    rotor: float = 0.0
    """Inertia on the motor's side of a gear that is not rigid, where the encoder and the friction are [kg m^2]."""

    dead_zone: float = 0.0
    """The motor answers only to the part of the command beyond this current [A]."""
    saturation: float = math.inf
    """The motor does not follow commands beyond this current [A]."""
    delay: float = 0.0
    """Time until a command reaches the motor [s]."""
    lag: float = 0.0
    """Time constant with which the motor's torque follows the command [s]."""

    sensor_offset: float = 0.0
    """Reading of the encoder at a true zero [rad]."""
    sensor_gain: float = 1.0
    """Reading per true angle."""
    sensor_delay: float = 0.0
    """Time between an angle and its reading, in whole samples [s]."""

    position_gain: float = 12.0
    """Outer gain of the controller [1/s]."""
    velocity_gain: float = 2.0
    """Inner gain of the controller [A s/rad]."""
    current_limit: float = 6.0
    """Largest command of the controller [A]."""

    encoder_counts: int = 65536
    """Counts for each turn of the joint."""
    encoder_noise: float = 5e-5
    """Standard deviation of the noise ahead of the encoder's rounding [rad]."""


@dataclass
class State:
    """What moves and what remembers."""

    position: float = 0.0
    """[rad]."""
    velocity: float = 0.0
    """[rad/s]."""
    current: float = 0.0
    """Command that has arrived at the motor, where it lags [A]."""
    bristle: float = 0.0
    """Deflection of the hysteresis, from -1 to 1."""
    link_position: float = 0.0
    """Of the link behind a gear that is not rigid [rad]."""
    link_velocity: float = 0.0
    """[rad/s]."""
    positions: list[float] = field(default_factory=list)
    """At each sample up to now [rad]."""


def advance(machine: Machine, state: State, commands: Sequence[float]) -> None:
    """Move the machine from the sample of the last command to the next one.

    ``commands``: all commands up to now [A].
    """
    along, across = machine.payload_place
    inertia = machine.inertia + machine.mass * machine.center_of_mass**2 + machine.payload * (along**2 + across**2)
    late = round(machine.delay / STEP)
    soft = machine.gear_stiffness > 0.0
    for i in range(STEPS_PER_SAMPLE):
        # The command that was given `late` steps ago; before the record starts, its first one.
        command = commands[max(len(commands) - 1 + (i - late) // STEPS_PER_SAMPLE, 0)]
        middle = state.position + 0.5 * STEP * state.velocity
        torque = _driven(machine, state, command)
        torque -= _through_gear(machine, state, middle, inertia) if soft else _load(machine, state, middle)
        viscous, dry = _friction(machine, state.velocity)
        moved = machine.rotor if soft else inertia
        damping = 0.5 * STEP * viscous / moved
        free = (1.0 - damping) * state.velocity + STEP * torque / moved
        # Set-valued friction: it takes off as much speed as it can and never turns the motion round.
        state.velocity = math.copysign(max(abs(free) - STEP * dry / moved, 0.0), free) / (1.0 + damping)
        state.position = middle + 0.5 * STEP * state.velocity


def _driven(machine: Machine, state: State, command: float) -> float:
    """Torque of the demo machine's drive [N m]."""
    command = math.copysign(max(abs(command) - machine.dead_zone, 0.0), command)
    command = min(max(command, -machine.saturation), machine.saturation)
    if machine.lag > 0.0:
        # Exact for a command that is held over the step; the torque is that of its middle.
        arrived = command + (state.current - command) * math.exp(-STEP / machine.lag)
        command, state.current = 0.5 * (state.current + arrived), arrived
    return machine.torque_per_current * command


def _through_gear(machine: Machine, state: State, motor: float, inertia: float) -> float:
    """Step of the demo machine's link behind a gear; returns the gear's torque on the motor [N m]."""
    link = state.link_position + 0.5 * STEP * state.link_velocity
    twist, half = motor - link, 0.5 * machine.gear_play
    beyond = twist - min(max(twist, -half), half)
    push = 0.0
    if half == 0.0 or beyond != 0.0:
        push = machine.gear_stiffness * beyond + machine.gear_damping * (state.velocity - state.link_velocity)
    if half > 0.0 and push * beyond < 0.0:  # flanks push and never pull
        push = 0.0
    state.link_velocity += STEP * (push - _load(machine, state, link)) / inertia
    state.link_position = link + 0.5 * STEP * state.link_velocity
    return push


def _load(machine: Machine, state: State, angle: float) -> float:
    """Load torque of the demo machine by gravity and hidden effects, but for friction [N m]."""
    load = machine.mass * machine.gravity * machine.center_of_mass * math.sin(angle + machine.tilt) + machine.bias
    if machine.ripple:
        load += machine.ripple * math.cos(math.tau * angle / machine.ripple_period - machine.ripple_phase)
    if machine.spring:
        load += machine.spring * (angle - machine.spring_rest)
    if machine.payload:
        along, across = machine.payload_place
        load += machine.payload * machine.gravity * (along * math.sin(angle) - across * math.cos(angle))
    if machine.stop_stiffness and angle > machine.stop_high:
        push = 1.0 + machine.stop_damping * state.velocity
        load += machine.stop_stiffness * (angle - machine.stop_high) * max(push, 0.0)
    if machine.hysteresis:
        # Dahl's law, exact for a way without reversal: what is missing to the full torque fades with the way.
        way = STEP * state.velocity
        full = math.copysign(1.0, way)
        state.bristle = full + (state.bristle - full) * math.exp(-abs(way) / machine.hysteresis_way)
        load += machine.hysteresis * state.bristle
    return load


def _friction(machine: Machine, velocity: float) -> tuple[float, float]:
    """Viscous friction [N m s/rad] and dry friction [N m] of the demo machine at a speed."""
    half = math.copysign(0.5, velocity)
    dry = machine.coulomb + half * machine.coulomb_difference
    if machine.stribeck:
        dry += machine.stribeck * math.exp(-((velocity / machine.stribeck_velocity) ** 2))
    return machine.viscous + half * machine.viscous_difference, dry
