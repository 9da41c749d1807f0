"""Input shapers: commands that leave a flexible machine at rest."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import ModelError, SimulationError
from vpm.model import Model
from vpm.numbers import Array, array_of

#: How often each kind convolves the shaper that cancels a mode once.
KINDS = {"zv": 1, "zvd": 2}


@dataclass(frozen=True, eq=False)
class Shaper:
    """A train of impulses that a command is convolved with; it cancels the vibration of some modes.

    Source: N. Singer, W. Seering, "Preshaping command inputs to reduce system vibration", *J. Dynamic Systems,
    Measurement, and Control* 112, 1990. ZV cancels at the model's frequency; ZVD cancels the derivative by frequency
    and damping too, so it forgives errors of the model, and takes twice as long.

    Attributes
    ----------
    frequencies, damping_ratios : ndarray, shape (modes,)
        Undamped frequencies in Hz, and damping ratios.
    """

    kind: str
    frequencies: Array
    damping_ratios: Array

    def __post_init__(self) -> None:
        """Check the numbers of a shaper."""
        if self.kind not in KINDS:
            raise SimulationError(f"there is no shaper '{self.kind}'; choose {' or '.join(KINDS)}")
        for name, values, possible in (
            ("frequency", self.frequencies, self.frequencies > 0.0),
            ("damping ratio", self.damping_ratios, (self.damping_ratios >= 0.0) & (self.damping_ratios < 1.0)),
        ):
            if not (np.isfinite(values) & possible).all():
                wrong = values[~(np.isfinite(values) & possible)][0]
                raise SimulationError(
                    f"a mode of {name} {wrong:.4g} cannot be shaped; only vibrations of a positive frequency and a "
                    "damping ratio below 1 need it, leave that mode out"
                )

    @property
    def impulses(self) -> tuple[Array, Array]:
        """Times (s) and amplitudes of a shaper's impulses; the amplitudes add up to 1."""
        times, amplitudes = np.zeros(1), np.ones(1)
        for frequency, damping in zip(self.frequencies, self.damping_ratios, strict=True):
            root = np.sqrt(1.0 - damping**2)
            ratio = np.exp(-damping * np.pi / root)
            for _ in range(KINDS[self.kind]):
                times = np.add.outer(np.array([0.0, 0.5 / (frequency * root)]), times).ravel()
                amplitudes = np.outer(np.array([1.0, ratio]) / (1.0 + ratio), amplitudes).ravel()
        together, places = np.unique(np.round(times, 15), return_inverse=True)
        return together, np.bincount(places, weights=amplitudes).astype(np.float64)

    def sampled(self, time_step: float) -> Array:
        """Weights of samples, shape (L,): they cancel the modes exactly, though impulses fall between samples.

        An impulse between two samples is shared among them so that the mode's pole remains a zero of the train, for
        each single shaper (B. Murphy, I. Watanabe, "Digital shaping filters for reducing machine vibration", *IEEE
        Trans. Robotics and Automation* 8, 1992).

        Raises
        ------
        SimulationError
            The samples are too far apart for a mode.
        """
        if not (np.isfinite(time_step) and time_step > 0.0):
            raise SimulationError(f"a time step of {time_step} s is not possible; give a positive time")
        weights = np.ones(1)
        for frequency, damping in zip(self.frequencies, self.damping_ratios, strict=True):
            own = _cancelling(float(frequency), float(damping), time_step)
            for _ in range(KINDS[self.kind]):
                weights = np.convolve(weights, own)
        return weights

    def apply(self, command: ArrayLike, time_step: float) -> Array:
        """The shaped command, longer by the shaper; before and after its samples the command is held.

        Parameters
        ----------
        command : array_like, shape (N, ...)
            Samples of positions, velocities, accelerations or efforts; what belongs together is shaped alike.
        time_step : float
            s.

        Returns
        -------
        ndarray, shape (N + L - 1, ...)

        Raises
        ------
        SimulationError
            There is no sample, a number is not finite, or the samples are too far apart for a mode.
        """
        given = array_of(command, "the command", SimulationError)
        if given.ndim == 0 or not given.size or not np.isfinite(given).all():
            raise SimulationError(
                f"a command of shape {given.shape} cannot be shaped; give at least one sample, finite numbers only"
            )
        weights = self.sampled(time_step)
        count, before = len(given), len(weights) - 1
        held = np.concatenate([np.repeat(given[:1], before, axis=0), given, np.repeat(given[-1:], before, axis=0)])
        shaped = np.zeros((count + before, *given.shape[1:]))
        for delay in np.flatnonzero(weights):
            shaped += weights[delay] * held[before - delay : before - delay + len(shaped)]
        return shaped

    def __repr__(self) -> str:
        modes = ", ".join(
            f"{frequency:.4g} Hz ({damping:.3g})"
            for frequency, damping in zip(self.frequencies, self.damping_ratios, strict=True)
        )
        return f"Shaper({self.kind!r}, {modes})"


def shaper(
    model: Model,
    q: ArrayLike | None = None,
    kind: str = "zvd",
    *,
    modes: int = 1,
    held: Sequence[str] | None = None,
) -> Shaper:
    """Shaper for commands that a machine follows with its joints, from its vibrations about rest.

    Parameters
    ----------
    q : array_like, shape (joints,), optional
        Where the motion ends; by default all joints at zero.
    kind : {"zv", "zvd"}
    modes : int
        How many of the slowest vibrations are cancelled.
    held : sequence of str, optional
        Joints that follow the command, by default all. The others move with the flexible links, from rest at ``q``.

    Raises
    ------
    SimulationError, ModelError, CoreError
        The machine has no such vibrations, or there is no rest.
    """
    frequencies, damping = vibrations(model, q, held)
    if not 1 <= modes <= len(frequencies):
        raise SimulationError(
            f"{model.name} has {len(frequencies)} vibrations with these joints held, so that {modes} cannot be "
            "shaped; ask for fewer, or name in held only the joints that follow the command"
        )
    return Shaper(kind, frequencies[:modes], damping[:modes])


def vibrations(model: Model, q: ArrayLike | None = None, held: Sequence[str] | None = None) -> tuple[Array, Array]:
    """Vibrations about rest for shaping, with joints held: undamped frequencies (Hz), damping ratios.

    Law: ``M x'' + D x' + K x = 0`` of the coordinates that are free, from exact derivatives of the inverse dynamics.
    """
    joints = model.joints if held is None else tuple(held)
    for name in joints:
        if name not in model.joints:
            raise ModelError(f'{model.name} has no joint "{name}" to hold; it has {", ".join(model.joints)}')
    position = np.zeros(len(model.joints)) if q is None else array_of(q, f"{model.name}: q", SimulationError)
    place, _ = model.equilibrium(position)
    zero = np.zeros_like(place)
    near = model.inverse_dynamics_derivatives(place, zero, zero)
    free = [at for at, name in enumerate(model.coordinates) if name not in joints]
    mass, damper, spring = (
        part[np.ix_(free, free)] for part in (near.by_acceleration, near.by_velocity, near.by_position)
    )
    count = len(free)
    matrix = np.zeros((2 * count, 2 * count))
    matrix[:count, count:] = np.eye(count)
    matrix[count:] = -np.linalg.solve(mass, np.hstack([spring, damper]))
    poles = np.linalg.eigvals(matrix)
    poles = poles[poles.imag > 1e-6 * np.abs(poles)]
    poles = poles[np.argsort(np.abs(poles))]
    return np.abs(poles) / (2.0 * np.pi), np.maximum(-poles.real / np.abs(poles), 0.0)


def _cancelling(frequency: float, damping: float, time_step: float) -> Array:
    """Weights of a shaper at samples 0, k and k + 1 that cancel one mode."""
    omega = 2.0 * np.pi * frequency
    turn = omega * np.sqrt(1.0 - damping**2) * time_step
    half = int(np.pi / turn)
    if half < 1:
        raise SimulationError(
            f"samples {time_step:g} s apart are too far apart for a mode of {frequency:.4g} Hz, of which half a period "
            f"takes {np.pi / turn * time_step:.3g} s; use a shorter time step or fewer modes"
        )
    # At the end the response to the impulse of a sample is as large as exp(damping omega t), and turned by its phase.
    samples = np.array([0, half, half + 1])
    left = np.exp((damping * omega * time_step - 1j * turn) * samples)
    amplitudes = np.linalg.solve(np.stack([np.ones(3), left.real, left.imag]), [1.0, 0.0, 0.0])
    weights = np.zeros(half + 2)
    weights[samples] = amplitudes
    return weights
