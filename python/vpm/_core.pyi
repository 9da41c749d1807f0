"""The compiled core of vpm: a machine as one object, arrays in and out."""

from collections.abc import Callable, Sequence
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vpm.errors import CoreError
from vpm.numbers import Array

__all__ = [
    "Diverged",
    "Dynamics",
    "Kalman",
    "Karl",
    "Leg",
    "Loop",
    "MaxwellNarx",
    "Narx",
    "NarxStepper",
    "Simulation",
    "Snapshot",
    "System",
    "check_integrator",
    "hyq_parameters",
    "narx_candidates",
    "narx_fit",
    "narx_select",
    "step_all",
    "stop_when",
    "zero_phase",
]

class Diverged(CoreError):
    """A simulation left the bounds of its states, or no step of ``adaptive`` can follow it.

    Attributes
    ----------
    sample_index : int
        First sample that is missing; in a restart, counted in the log.
    outputs : ndarray, shape (M, n_outputs)
        Outputs of the samples before, from the start of the piece.
    states : ndarray, shape (M, n_states)
        States of the samples before.
    """

    sample_index: int
    outputs: Array
    states: Array

def stop_when(asked: Callable[[], bool] | None) -> None:
    """Let long computations of the calling thread stop with ``KeyboardInterrupt`` when ``asked()`` is true.

    Ctrl-C reaches Python's main thread only; this is how it tells the threads that work for it. None ends it.
    """

def zero_phase(sections: ArrayLike, values: ArrayLike, padding: int, every: int) -> Array:
    """Columns of ``values`` (N, k) filtered forward and backward; every ``every``-th sample (ceil(N / every), k).

    Each row of ``sections`` (s, 6) is ``b0 b1 b2 a0 a1 a2`` with ``a0 = 1``. Both ends are continued by ``padding``
    samples, reflected at the end point.
    """

def check_integrator(name: str) -> None:
    """Raise ``CoreError`` for a name that is no integrator's, or a tolerance in it that means nothing."""

@final
class Dynamics:
    """Single evaluations of a machine with fixed parameters, as fast as the crossing into Python allows.

    One-dimensional contiguous arrays of double precision are read where they are, others are converted first. n is
    the number of coordinates. Raises ``CoreError`` for other sizes and for numbers
    that are not finite.

    Parameters
    ----------
    system : System
    theta : array_like, shape (P,)
    """

    def __new__(cls, system: System, theta: ArrayLike) -> Dynamics: ...
    def inverse_dynamics(self, position: ArrayLike, velocity: ArrayLike, acceleration: ArrayLike) -> Array:
        """Efforts (n,) that accelerations (n,) need: ``M a + h - effects``; what no actuator gives has to be zero."""
    def forward_dynamics(self, position: ArrayLike, velocity: ArrayLike, effort: ArrayLike) -> Array:
        """Accelerations (n,) under efforts (n,), with all effects."""
    def mass_matrix(self, position: ArrayLike) -> Array:
        """Mass matrix (n, n), payloads included."""
    def energy(self, position: ArrayLike, velocity: ArrayLike) -> tuple[float, float]:
        """Kinetic and potential energy in J: of bodies in gravity, and of effects that have a potential."""
    def jacobian(self, position: ArrayLike, marker: int) -> Array:
        """Jacobian (6, n) of a marker by number: angular velocity, then velocity of its origin, in world axes."""

@final
class Kalman:
    """An extended Kalman filter that is fed sample by sample; m channels are measured.

    Parameters
    ----------
    system : System
    theta : array_like, shape (P,)
    state : array_like, shape (n_states,)
    channels : sequence of int
    noise : tuple of array_like
        As in `System.filter`.
    time_step, substeps, integrator
        As in `Simulation`.
    """

    def __new__(
        cls,
        system: System,
        theta: ArrayLike,
        state: ArrayLike,
        channels: Sequence[int],
        noise: tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike],
        time_step: float,
        substeps: int,
        integrator: str,
    ) -> Kalman: ...
    def step(self, readings: ArrayLike, inputs: ArrayLike) -> tuple[Array, Array]:
        """State (nx,) corrected by the readings (m,), and innovations (m,); inputs are held to the next sample."""
    def covariances(self) -> tuple[Array, Array]:
        """Covariance of the last estimate (nx, nx) and of the last innovations (m, m)."""
    def expected(self) -> Array:
        """State (nx,) that is expected at the coming sample."""
    def reset(self, state: ArrayLike, covariance: ArrayLike) -> None:
        """Begin again in a state (nx,) of this covariance (nx, nx)."""
    def hold_gain(self, gain: ArrayLike, covariance: ArrayLike, spread: ArrayLike) -> None:
        """Keep a gain (nx, m) under which estimates and innovations have these covariances."""
    def linearised(self, inputs: ArrayLike) -> tuple[Array, Array, Array]:
        """Transition (nx, nx) over a sample, outputs by the state (m, nx), covariance of what moves it (nx, nx)."""

@final
class Loop:
    """A loop at a fixed rate with absolute deadlines; it belongs to the thread that made it.

    Parameters
    ----------
    period : float
        Time between two deadlines, s.
    lock_memory : bool
    priority : int, optional
        Of ``SCHED_FIFO``.
    """

    def __new__(cls, period: float, lock_memory: bool, priority: int | None) -> Loop: ...
    def wait(self) -> tuple[int, float, int]:
        """Sleep until the next deadline: its number, how late it was (s), deadlines missed since the last."""
    def close(self) -> None:
        """Give memory and priority back."""
    @property
    def rights(self) -> tuple[str | None, str | None]:
        """Memory and priority: None (not asked), an empty text (given) or a sentence (refused)."""
    @property
    def wakes(self) -> int:
        """Wake-ups recorded."""
    @property
    def missed(self) -> int:
        """Deadlines missed."""
    def latencies(self, quantiles: Sequence[float]) -> list[float]:
        """Time from a deadline to its wake-up, s, at these quantiles."""
    def work(self, quantiles: Sequence[float]) -> list[float]:
        """Time from a wake-up to the next wait, s, at these quantiles."""

@final
class Simulation:
    """A simulation that goes on one sample at a time.

    Parameters
    ----------
    system : System
    theta : array_like, shape (P,)
    state : array_like, shape (n_states,)
    time_step : float
        Time between samples, s.
    substeps : int
    integrator : str
    """

    def __new__(
        cls, system: System, theta: ArrayLike, state: ArrayLike, time_step: float, substeps: int, integrator: str
    ) -> Simulation: ...
    def compile(self) -> str | None:
        """Go on by machine code from now on.

        Returns
        -------
        str or None
            Why there is no machine code; then the simulation goes on by direct evaluation.
        """
    @property
    def time(self) -> float:
        """Time since the beginning, s."""
    @property
    def state(self) -> Array:
        """State now (n_states,); a copy."""
    @property
    def outputs(self) -> Array:
        """What the sensors show now (n_outputs,); a copy."""
    def step(self, inputs: ArrayLike) -> Array:
        """Hold ``inputs`` (n_inputs,) for one sample; outputs (n_outputs,) at its end, with the inputs still held."""
    def run(self, inputs: ArrayLike) -> Array:
        """A step for each row of ``inputs`` (N, n_inputs); outputs (N, n_outputs)."""
    def reset(self, state: ArrayLike) -> None:
        """Begin again at time zero in ``state`` (n_states,), with nothing remembered."""
    def snapshot(self) -> Snapshot:
        """All that it is now, with what delays and sampled drives remember."""
    def restore(self, snapshot: Snapshot) -> None:
        """Go back to where it was when the snapshot was taken."""

def step_all(simulations: Sequence[Simulation], inputs: ArrayLike, samples: int) -> tuple[Array, list[str | None]]:
    """Hold ``inputs`` (E, n_inputs) in E simulations of one machine over so many samples.

    Returns
    -------
    outputs : ndarray, shape (E, n_outputs)
    failures : list of str or None
        Why a simulation could not go on; its outputs are those of the sample before.
    """

@final
class Snapshot:
    """A simulation as it was at one time."""

    @property
    def time(self) -> float:
        """Time of the simulation when it was taken, s."""

@final
class System:
    """A machine: rigid tree, effects, actuators, sensors and controllers over a flat parameter vector theta.

    N samples, n joints, m actuators, P parameters, k requested sensitivities; all numbers SI. The state is
    ``[coordinates, their rates, one state per actuator with lag]``; coordinates are the joints', then the beams'. The
    outputs are position, velocity, acceleration and effort of each joint, command and force of each actuator, length,
    rate and force of each line, strain of each gauge, origin and rotation vector of each marker; a sensor replaces
    the channel it measures.
    Every function raises ``CoreError``, in one sentence with the repair, for wrong shapes, numbers that are not
    finite, and parameters for which a law is not defined. Ctrl-C raises ``KeyboardInterrupt``.

    Parameters
    ----------
    description : str
        JSON; `vpm.Model` writes it.
    """

    def __new__(cls, description: str) -> System: ...
    @property
    def n_joints(self) -> int:
        """Number of joints n."""
    @property
    def n_coordinates(self) -> int:
        """Number of coordinates: joints, then the elastic coordinates of the beams."""
    @property
    def n_elastic(self) -> int:
        """Number of elastic coordinates."""
    @property
    def n_beams(self) -> int:
        """Number of beams."""
    @property
    def n_states(self) -> int:
        """Length of the state."""
    @property
    def n_actuators(self) -> int:
        """Number of actuators m."""
    @property
    def n_inputs(self) -> int:
        """Number of inputs: one command per actuator, then one pressure per logged supply."""
    @property
    def n_outputs(self) -> int:
        """Number of output channels."""
    @property
    def n_parameters(self) -> int:
        """Length P of theta."""
    def simulate(
        self,
        theta: ArrayLike,
        initial_state: ArrayLike,
        inputs: ArrayLike,
        time_step: float,
        substeps: int,
        integrator: str,
        sensitivities: Sequence[int] = ...,
        hold: str = ...,
    ) -> tuple[Array, Array, Array]:
        """Free run on ``inputs`` (N, m); between samples they do as ``hold`` says: zero_order, first_order or cubic.

        Returns
        -------
        outputs : ndarray, shape (N, n_outputs)
        states : ndarray, shape (N, n_states)
        jacobian : ndarray, shape (N, n_outputs, k)
            Exact derivative of the discrete solution by ``theta[sensitivities]``.

        Raises
        ------
        Diverged
            The state is no longer finite.
        """
    def filter(
        self,
        theta: ArrayLike,
        initial_state: ArrayLike,
        inputs: ArrayLike,
        channels: Sequence[int],
        readings: ArrayLike,
        noise: tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike],
        time_step: float,
        substeps: int,
        integrator: str,
        hold: str = ...,
    ) -> tuple[Array, Array, Array, Array, Array]:
        """An extended Kalman filter on ``readings`` (N, m) of the outputs at the places ``channels``.

        Parameters
        ----------
        noise : tuple of array_like
            Standard deviations (SI), of what is independent from sample to sample: of readings (m,), of forces on
            coordinates held for a sample (n,), of states over a sample (nx,), and of the first state (nx,).

        Returns
        -------
        innovations : ndarray, shape (N, m)
        covariances : ndarray, shape (N, m, m)
            Of the innovations.
        gains : ndarray, shape (N, nx, m)
        states, deviations : ndarray, shape (N, nx)
            Corrected by the readings up to then.

        Raises
        ------
        Diverged
            The state is no longer finite.
        """
    def observe(
        self,
        theta: ArrayLike,
        records: Sequence[tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike]],
        channels: Sequence[int],
        time_step: float,
        substeps: int,
        integrator: str,
        sensitivities: Sequence[int] = ...,
        hold: str = ...,
        alone: bool = ...,
        moves: ArrayLike | None = ...,
        innovations: bool = ...,
    ) -> list[tuple[Array, Array, Array]]:
        """Follow each of ``records``; as `simulate`, before each correction.

        A record has its first state (nx,), inputs, readings (N, m) and gains on these (N, nx * m).

        Derivatives (N, m, k) are those of the measured outputs alone; outputs are, too, where ``alone``. They are those
        of the steps. Where ``moves`` (k,) tell by how much each parameter may be moved for a difference, approximate
        ones do where they take less time: differences, or derivatives of the equations to the order of the steps. Where
        readings are ``innovations``, outputs and these are what sensors show.
        """
    def answers(
        self,
        theta: ArrayLike,
        question: str,
        marker: int,
        motions: Sequence[ArrayLike],
        by_motion: bool = ...,
        parameters: Sequence[int] = ...,
    ) -> tuple[Array, Array]:
        """Answers about N motions: positions, rates, accelerations or efforts, each (N, n).

        Returns
        -------
        values : ndarray, shape (N, width)
        derivatives : ndarray, shape (N, width, k)
            By the three parts of the motion, if wanted, then by parameters, each named once.
        """
    def compile(self, theta: ArrayLike, integrator: str) -> str | None:
        """Make the machine code of steps by ``integrator``, as long runs do; or say why there is none."""
    def resolution(
        self, theta: ArrayLike, state: ArrayLike, time_step: float, substeps: int, integrator: str, duration: float
    ) -> tuple[float, Array]:
        """What steps do not resolve in a run of ``duration`` (s) about ``state``.

        Returns
        -------
        limit : float
            Frequency above which amplitude or frequency of an undamped vibration is off by a tenth, Hz; or infinite.
        modes : ndarray, shape (m, 5)
            Each mode of a damping ratio below 0.1 that is, and each that grows: frequency (Hz), damping ratio, time (s;
            that of the run, or in which the mode falls to 1/e by itself if that is shorter), share that the method
            leaves in that time, shift of its frequency as a share of it.
        """
    def unstuck(
        self, theta: ArrayLike, state: ArrayLike, commands: ArrayLike, time_step: float, substeps: int, integrator: str
    ) -> list[tuple[str, float]]:
        """Where dry friction does not bring to rest in these steps what it brakes, at ``state`` under ``commands``.

        Returns
        -------
        list of tuple
            The place in words; the slope of friction at rest times the step over the inertia that it moves.
        """
    def simulate_closed_loop(
        self,
        theta: ArrayLike,
        initial_state: ArrayLike,
        references: ArrayLike,
        disturbances: ArrayLike,
        time_step: float,
        substeps: int,
        integrator: str,
        sensitivities: Sequence[int] = ...,
    ) -> tuple[Array, Array, Array]:
        """Closed loop on ``references``; ``disturbances`` add to the commands; both (N, m); else as `simulate`."""
    def restart(
        self,
        theta: ArrayLike,
        initial_states: ArrayLike,
        starts: Sequence[int] | NDArray[np.int64],
        horizon: int,
        inputs: ArrayLike,
        time_step: float,
        substeps: int,
        integrator: str,
        sensitivities: Sequence[int] = ...,
        hold: str = ...,
    ) -> tuple[Array, Array]:
        """Free runs of ``horizon`` samples from each of the S samples ``starts``, row 0 being the start itself.

        Returns
        -------
        outputs : ndarray, shape (S, horizon, n_outputs)
        jacobian : ndarray, shape (S, horizon, n_outputs, k)
        """
    def inverse_dynamics(
        self,
        theta: ArrayLike,
        position: ArrayLike,
        velocity: ArrayLike,
        acceleration: ArrayLike,
        inputs: ArrayLike,
        time_step: float,
        sensitivities: Sequence[int] = ...,
    ) -> tuple[Array, Array, Array]:
        """Effort that a measured motion (N, n) needs, and effort that the actuators deliver under ``inputs`` (N, m).

        Returns
        -------
        required : ndarray, shape (N, n)
            Effort of the rigid tree minus that of the effects, position sensors undone.
        applied : ndarray, shape (N, n)
            Mean over the two sample intervals that meet at the sample.
        jacobian : ndarray, shape (N, n, k)
            Derivative of ``required - applied``.
        """
    def required(
        self,
        theta: ArrayLike,
        position: ArrayLike,
        velocity: ArrayLike,
        acceleration: ArrayLike,
        time_step: float,
        sensitivities: Sequence[int] = ...,
    ) -> tuple[Array, Array]:
        """Effort (N, n) that a measured motion needs, as in `inverse_dynamics`, and its derivatives (N, n, k).

        The drives may be any: what they deliver does not enter.
        """
    def check(self, theta: ArrayLike) -> None:
        """Raise CoreError for parameters with which the machine does not exist."""
    def delivered(
        self, theta: ArrayLike, inputs: ArrayLike, time_step: float, sensitivities: Sequence[int] = ...
    ) -> tuple[Array, Array]:
        """Effort of ideal drives on the joints (N, n_joints) under ``inputs`` (N, m), as in `inverse_dynamics`.

        Unlike there, the machine may have coordinates that nobody measured; all drives have to act on joints.

        Returns
        -------
        applied, jacobian : ndarray
            (N, n_joints), and its derivatives (N, n_joints, k).
        """
    def forward_dynamics(self, theta: ArrayLike, position: ArrayLike, velocity: ArrayLike, effort: ArrayLike) -> Array:
        """Accelerations (n_coordinates,) with all effects under ``effort`` (n,) on the joints."""
    def mass_matrix(self, theta: ArrayLike, position: ArrayLike) -> Array:
        """Mass matrix over all coordinates, payloads included."""
    def energy(self, theta: ArrayLike, position: ArrayLike, velocity: ArrayLike) -> tuple[float, float]:
        """Kinetic and potential energy in J: of bodies in gravity, and of effects that have a potential."""
    def c_source(
        self,
        theta: ArrayLike,
        name: str,
        states: Sequence[str],
        inputs: Sequence[str],
        outputs: Sequence[str],
        free: Sequence[int] = ...,
    ) -> tuple[str, str]:
        """The texts of ``NAME.h`` and ``NAME.c``; parameters numbered ``free`` are arguments, others constants."""
    def linearize(self, theta: ArrayLike, state: ArrayLike, inputs: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Exact derivatives at ``state`` (n_states,) under standing commands ``inputs`` (m,).

        Delays pass their input unchanged; dead zones and saturations have the slope at the command.

        Returns
        -------
        A, B, C, D : ndarray, shapes (nx, nx), (nx, m), (ny, nx), (ny, m)
            Of the rates and of all outputs, sensors' gains included.
        """
    def simulate_prescribed(
        self,
        theta: ArrayLike,
        position: ArrayLike,
        velocity: ArrayLike,
        acceleration: ArrayLike,
        time_step: float,
        substeps: int,
        integrator: str,
        sensitivities: Sequence[int] = ...,
        passive: Sequence[int] = ...,
        strain_rate: ArrayLike | None = ...,
        strain_gain: ArrayLike | None = ...,
        first: int = ...,
        departure: ArrayLike | None = ...,
    ) -> tuple[Array, Array, Array]:
        """Joints follow a measured motion (N, n), beams respond from rest; position sensors are undone.

        Joints in ``passive`` move freely with their effects, from rest; their columns of the motion mean nothing.
        A damper of ``strain_gain`` (gauges,), J s, between each gauge and its measured ``strain_rate`` (N, gauges),
        1/s, holds the beams; 0 for gauges that were not logged. Messages count samples from ``first`` on.
        With a ``departure`` (2 n_coordinates,), coordinates then rates, what is free begins away from rest by that.

        Returns
        -------
        outputs, states, jacobian : ndarray
            As in `simulate`; ``effort`` of a joint is the effort that the motion needs.
        """
    def simulate_drives(
        self,
        theta: ArrayLike,
        position: ArrayLike,
        velocity: ArrayLike,
        acceleration: ArrayLike,
        inputs: ArrayLike,
        internal: ArrayLike,
        places: Sequence[int],
        seen: ArrayLike,
        time_step: float,
        substeps: int,
        integrator: str,
        sensitivities: Sequence[int] = ...,
    ) -> tuple[Array, Array, Array]:
        """Joints follow a measured motion (N, n), drives and supplies answer to it and to ``inputs`` (N, nu).

        They begin in the states ``internal`` (n_states - 2 n,). Position sensors are undone. States of drives that were
        measured too are ``seen`` (N, len(places)), and ``places`` tells which of ``internal`` they are.

        Returns
        -------
        outputs : ndarray, shape (N, ny + n)
            As in `simulate`, ``effort`` of a joint being the effort that the motion needs; then the effort of the
            drives on each joint, in the measured states where there are any.
        states : ndarray, shape (N, nx)
        jacobian : ndarray, shape (N, ny + n, k)
        """
    def internal_state(self, theta: ArrayLike, position: ArrayLike) -> Array:
        """What follows coordinates and rates in a state of a machine that has stood without commands.

        It stood at ``position`` (n_coordinates,). Shape (n_states - 2 n_coordinates,): lags, currents and spools zero,
        visco-elastic elements settled, chambers without net force, sagging supplies at their pressure.
        """
    def memories(self, theta: ArrayLike, position: ArrayLike, time_step: float) -> Array:
        """Memories (N, effects that remember) at every sample of a path of the joints (N, n), relaxed at the first."""
    def equilibrium(self, theta: ArrayLike, position: ArrayLike) -> tuple[Array, Array]:
        """Coordinates (n_coordinates,) at rest with the joints held at ``position``, and the holding efforts (n,)."""
    def load_at_rest(self, theta: ArrayLike, position: ArrayLike) -> tuple[Array, Array]:
        """Efforts (n,) that hold all coordinates at rest at ``position`` (n,), and their derivative (n, n) by these."""
    def natural_frequencies(self, theta: ArrayLike, position: ArrayLike) -> Array:
        """Natural frequencies (n_elastic,) in Hz with the joints locked at ``position`` (n,), slowest first.

        A negative one is the rate of growth of a beam that buckles.
        """
    def loops(self, theta: ArrayLike, position: ArrayLike, velocity: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Gap (m,) of the closed loops, its derivative (m, n), drift ``J' v`` (m,), and 1.0 where independent (m,)."""
    def slopes(self, theta: ArrayLike, states: ArrayLike) -> Array:
        """Largest slope (N, n_beams) in rad of each beam; not a number where the kinematics are exact."""
    @property
    def slope_limit(self) -> float:
        """Slope in rad up to which the kinematics of small slopes are right within 1 %."""
    def jacobian(self, theta: ArrayLike, position: ArrayLike, marker: int) -> Array:
        """Jacobian (6, n_coordinates) of a marker by number: angular velocity, then velocity, in world axes."""
    def marker_poses(self, theta: ArrayLike, positions: ArrayLike) -> Array:
        """Poses (N, markers, 12) along ``positions`` (N, n_coordinates): origin in the world, then axes by rows."""
    def time_steps(
        self,
        theta: ArrayLike,
        initial_state: ArrayLike,
        inputs: ArrayLike,
        time_step: float,
        substeps: int,
        integrator: str,
        count: int,
        states: int,
        compiled: bool,
    ) -> tuple[Array, int, int, list[tuple[str, float, float]], str | None]:
        """Single steps on the way through ``inputs`` again and again.

        Duration (count,) of each in s; how often they asked for memory; bytes that a simulation holds; at so many
        ``states`` the stages of a step: name, seconds of a call, calls in a step; why ``compiled`` steps were evaluated
        directly.
        """

_Pair = Sequence[float]

@final
class Karl:
    """KARL: a limb of two joints whose two linear actuators sit on its first body; see `vpm.linkages.Karl`.

    Tables have N rows, one configuration each; lengths in m, angles in rad, forces in N, torques in N m.
    """

    def __new__(
        cls,
        medial: float,
        distal: float,
        stroke_direction: float,
        sliders: Sequence[_Pair],
        ground_anchor: _Pair,
        distal_anchor: _Pair,
        rods: _Pair,
    ) -> Karl: ...
    @staticmethod
    def prototype() -> tuple[float, float, float, list[list[float]], list[float], list[float], list[float]]:
        """Dimensions of the prototype, in the order of the class's arguments."""
    def direct(self, strokes: _Pair) -> Array:
        """Joint angles (4, 2) of all assembly modes at two strokes."""
    def inverse(self, target: _Pair) -> Array:
        """Angles and strokes (8, 4) of all configurations that put the end point at ``target``."""
    def end_point(self, angles: ArrayLike) -> Array:
        """End points (N, 2) at joint angles (N, 2)."""
    def end_point_determinant(self, angles: ArrayLike) -> Array:
        """Determinants (N,) of the end point's Jacobian, m^2."""
    def transmission(self, angles: ArrayLike, strokes: ArrayLike) -> Array:
        """Diagonals (N, 2) of Lambda, rad/m."""
    def determinants(self, angles: ArrayLike, strokes: ArrayLike) -> Array:
        """Determinants (N, 2) of Psi and Omega, m^2."""
    def stroke_slopes(self, angles: ArrayLike, strokes: ArrayLike) -> Array:
        """Derivatives (N, 2) of the constraints by the strokes, m."""
    def torques(self, angles: ArrayLike, strokes: ArrayLike, forces: ArrayLike) -> Array:
        """Joint torques (N, 2) of actuator forces (N, 2)."""
    def alignments(self, actuator: int) -> Array:
        """Rows (stroke, angle, extended) where an actuator loses control of its joint."""
    def perpendiculars(self, actuator: int) -> Array:
        """Rows (stroke, angle) where a rod is perpendicular to its stroke."""
    def span(self, actuator: int, mode: float) -> float:
        """Turn of a joint in rad between two alignments, in mode +1 or -1."""
    def resultant(self, actuator: int, stroke: float) -> list[float]:
        """Coefficients (5,) of the resultant in s = sin q at one stroke, lowest power first."""

@final
class Leg:
    """A leg on a vertical slider with two cylinders, its foot on the ground; see `vpm.linkages.Leg`.

    ``bodies`` (2, 5): length, mass, inertia, centre of mass along and ahead; ``attachments`` (2, 4): base, angle, tip,
    angle; ``parts`` (4, 3) of hip and knee cylinder: mass, centre of mass, inertia of barrel and rod. Tables have N
    rows, one state each; all numbers SI.
    """

    def __new__(
        cls,
        slider_mass: float,
        bodies: Sequence[_Pair],
        attachments: Sequence[_Pair],
        parts: Sequence[_Pair],
        gravity: float,
    ) -> Leg: ...
    def strokes(self, angles: ArrayLike) -> Array:
        """Lengths (N, 2) of hip and knee cylinder."""
    def levers(self, angles: ArrayLike) -> Array:
        """Lever arms (N, 2) of the cylinders, m/rad."""
    def points(self, angles: ArrayLike) -> Array:
        """Points (N, 7, 2): hip, knee, foot, bases of hip and knee cylinder, their tips."""
    def terms(self, angles: ArrayLike, rates: ArrayLike, derivation: str) -> tuple[Array, Array, Array]:
        """Mass matrices (N, 2, 2), velocity terms (N, 2), gravity terms (N, 2); virtual_work or lagrange."""
    def reactions(self, angles: ArrayLike, rates: ArrayLike, accelerations: ArrayLike) -> Array:
        """Rows (N, 23): torques, cylinder forces, ground, guide (2), pins (6 x 2), bearings (2 x 2)."""
    def cylinder_forces(self, angles: ArrayLike, torques: ArrayLike) -> Array:
        """Cylinder forces (N, 2) that give joint torques (N, 2)."""
    def accelerations(self, angles: ArrayLike, rates: ArrayLike, torques: ArrayLike) -> Array:
        """Joint accelerations (N, 2) under joint torques (N, 2)."""
    def shares(self, angles: ArrayLike, rate: float, acceleration: float, samples: int, definition: str) -> Array:
        """Largest shares (N, 3) of inertia, velocity and gravity over all sampled motions."""

def hyq_parameters(
    data: str, shank: float
) -> tuple[float, list[list[float]], list[list[float]], list[list[float]], float]:
    """Parameters of the leg of HyQ in the order of the arguments of `Leg`: table, identified or plausible."""

@final
class Narx:
    """A polynomial of lagged outputs and inputs with its coefficients.

    Parameters
    ----------
    signals : list of str
        The output's name, then the inputs'.
    terms : list of list of (int, int)
        Factors of each term: signal (0 is the output) and lag.
    coefficients : array_like, shape (P,)
    """

    def __new__(
        cls, signals: Sequence[str], terms: Sequence[Sequence[tuple[int, int]]], coefficients: ArrayLike
    ) -> Narx: ...
    @property
    def longest_lag(self) -> int:
        """Longest lag in samples."""

    def texts(self) -> list[str]:
        """Terms as they are written."""

    def simulate_free_run(self, name: str, output: ArrayLike, inputs: ArrayLike, limit: float) -> Array:
        """Output (N,) from the simulated past; raises ``Diverged`` with the samples before."""

    def predict_one_step(self, name: str, output: ArrayLike, inputs: ArrayLike) -> Array:
        """Output (N,) from the measured past."""

    def stepper(self) -> NarxStepper:
        """Return a simulation that is fed sample by sample."""

@final
class NarxStepper:
    """A simulation of a NARX model that is fed sample by sample."""

    def start(self, output: ArrayLike, inputs: ArrayLike) -> None:
        """Set the past: outputs (L,) and inputs (L, m), oldest first, L the longest lag."""

    def step(self, inputs: ArrayLike) -> float:
        """Output of this sample from its inputs (m,)."""

def narx_candidates(
    lags: Sequence[tuple[int, Sequence[int]]], degree: int, constant: bool
) -> list[list[tuple[int, int]]]:
    """All products of at most `degree` lagged signals: factors (signal, lag) of each."""

def narx_fit(
    signals: Sequence[str],
    terms: Sequence[Sequence[tuple[int, int]]],
    records: Sequence[tuple[str, ArrayLike, ArrayLike]],
) -> Array:
    """Coefficients of given terms by least squares over records (name, output (N,), inputs (N, m))."""

def narx_select(
    signals: Sequence[str],
    terms: Sequence[Sequence[tuple[int, int]]],
    records: Sequence[tuple[str, ArrayLike, ArrayLike]],
    most: int,
    stop: str,
    value: float,
) -> tuple[list[list[tuple[int, int]]], Array, Array, Array, list[tuple[str, str]]]:
    """Terms chosen by error-reduction ratio: terms, coefficients, ratios, values of the criterion, dependent ones."""

@final
class MaxwellNarx:
    """A Maxwell element beside a spring as a difference equation.

    Parameters
    ----------
    k0, s0 : array_like, shape (10,)
        Coefficients over ``1, u, s, u^2, u s, s^2, u^3, u^2 s, u s^2, s^3``; N/m and m.
    k1, c1, step : float
        N/m, N s/m, s.
    scheme : str
        ``trapezoidal``, ``printed`` or ``central_mean``.
    """

    def __new__(cls, k0: ArrayLike, s0: ArrayLike, k1: float, c1: float, step: float, scheme: str) -> MaxwellNarx: ...
    def simulate_free_run(self, start: Sequence[float], drive: ArrayLike, length: ArrayLike, limit: float) -> Array:
        """Forces (N,) in N; the first two are `start`."""
