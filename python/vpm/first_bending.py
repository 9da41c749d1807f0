"""First bending: how links bend where a record begins, told by the first readings of what they carry.

A record may begin in mid-motion. A link then rings for as long as its damping lets it. Taken for bent as at rest it
would ring otherwise for the whole record, and damping that kills the difference would look missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vpm.errors import VpmError
from vpm.experiment.noise import noise_std
from vpm.model import Model
from vpm.numbers import Array

#: No law is exact: what is smaller than this share of a channel's variation counts as noise.
INEXACT = 0.003
#: Periods of the slowest vibration that tell how a link was bent: fewer tell an offset from it badly, and over more of
#: them errors of its frequency add up.
PERIODS = 3.0


@dataclass(frozen=True)
class FreeVibration:
    """Free vibration of links about a first state: coordinates then rates, e of each."""

    transition: Array  #: Shape (2 e, 2 e), over a sample.
    shown: Array  #: Shape (m, 2 e): what each channel shows of it.
    known: Array  #: Covariance (2 e, 2 e) before any reading.
    noise: Array  #: Standard deviation (m,) of each channel.

    @staticmethod
    def of(
        model: Model, theta: Array, start: tuple[Array, Array], read: tuple[Sequence[str], Array, float], *, held: bool
    ) -> FreeVibration | None:
        """Free vibration of a model's links; None where none of the channels shows any.

        Before the first reading all coordinates have the same energy in the mean, as much as makes the readings vary
        as they do.

        - ``start``: first state (nx,) and first commands
        - ``read``: channels, their readings (N, m) and the distance of samples, s
        - ``held``: joints follow a given motion; else they are free
        """
        from scipy.linalg import expm  # slow to import, and seldom needed

        channels, readings, dt = read
        if len(model.joints) == len(model.coordinates) or model.loops or not channels:
            return None
        try:
            equations, known, shown = _linear(model, theta, start, channels, held=held)
        except (VpmError, ValueError):  # no machine, or one that gives way
            return None
        seen, spread = np.einsum("ij,jk,ik->i", shown, known, shown), np.std(readings, axis=0)
        telling = (seen > 0.0) & (spread > 0.0)
        if not np.any(telling) or not np.all(np.isfinite(known)):
            return None
        noise = [max(noise_std(values), INEXACT * float(np.std(values))) for values in readings.T]
        return FreeVibration(
            transition=expm(equations * dt),
            shown=np.where(telling[:, None], shown, 0.0),
            known=float(np.mean(spread[telling] ** 2 / seen[telling])) * known,
            noise=np.where(telling, noise, 1.0),
        )

    def gains(self, samples: int) -> Array:
        """Gains (samples, 2 e, m): least squares of a free vibration through the readings until then.

        Those of a Kalman filter without process noise (R. Kalman, *J. Basic Engineering* 82, 1960).
        """
        known, found = self.known, np.zeros((samples, *self.shown.T.shape))
        for gain in found:
            crossed = known @ self.shown.T
            gain[:] = np.linalg.solve(self.shown @ crossed + np.diag(self.noise**2), crossed.T).T
            known = self.transition @ (known - gain @ crossed.T) @ self.transition.T
            known = 0.5 * (known + known.T)
        return found

    @property
    def samples(self) -> int:
        """Samples of the free vibration that tell how it began: some periods of the slowest one."""
        turns = np.abs(np.angle(np.linalg.eigvals(self.transition)))
        return int(np.ceil(2.0 * np.pi * PERIODS / max(float(np.min(turns)), 1e-9)))

    def departure(self, errors: Array, first: int) -> Array:
        """Departure (2 e,) of the first state: least squares through errors (n, m) from the sample ``first`` on.

        Beside an unknown constant of each channel: an offset is no vibration.
        """
        columns, passed = [], np.linalg.matrix_power(self.transition, first)
        for _ in errors:
            columns.append(self.shown @ passed)
            passed = self.transition @ passed
        response = np.array(columns)
        response -= np.mean(response, axis=0)
        left = (errors - np.mean(errors, axis=0)) / self.noise
        slopes = (response / self.noise[:, None]).reshape(left.size, -1)
        information = slopes.T @ slopes + np.linalg.inv(self.known)
        return np.asarray(np.linalg.solve(information, slopes.T @ left.ravel()))


def _linear(
    model: Model, theta: Array, start: tuple[Array, Array], channels: Sequence[str], *, held: bool
) -> tuple[Array, Array, Array]:
    """Free vibration of links: rates by states (2 e, 2 e), covariance of equal energies, and what channels show.

    Of joints that are free, with what moves along taken off the inertia; or of joints that are held.
    """
    joints, count = len(model.joints), len(model.coordinates)
    bent, size = slice(joints, count), count - joints
    rates, _, outputs, _ = model.core.linearize(theta, *start)
    mass = model.core.mass_matrix(theta, start[0][:count])
    places = np.r_[joints:count, count + joints : 2 * count]
    links = rates[count + joints : 2 * count, places]
    inertia = np.linalg.inv(np.linalg.inv(mass)[bent, bent])
    if held:
        inertia = mass[bent, bent]
        links = np.asarray(np.linalg.solve(inertia, (mass @ rates[count : 2 * count])[bent][:, places]))
    equations = np.block([[np.zeros((size, size)), np.eye(size)], [links]])
    stiffness = -inertia @ links[:, :size]
    known = np.zeros_like(equations)
    known[:size, :size] = np.linalg.inv(0.5 * (stiffness + stiffness.T))
    known[size:, size:] = np.linalg.inv(inertia)
    return equations, known, outputs[[model.output_channels.index(name) for name in channels]][:, places]


def bending_gains(
    model: Model, channels: Sequence[str], readings: Array, start: tuple[Array, Array], grid: tuple[int, float]
) -> Array:
    """Gains (samples, nx, m) by which an observer draws elastic coordinates to first readings; (0, nx, m) if none do.

    - ``channels``: those of the readings; others than outputs that bending moves have no gains
    - ``readings``: shape (N, m)
    - ``start``: first state (nx,) and first commands
    - ``grid``: number of samples and their distance, s
    """
    (samples, dt), joints, count = grid, len(model.joints), len(model.coordinates)
    vibration = FreeVibration.of(model, model.theta, start, (channels, readings, dt), held=False)
    gains = np.zeros((0 if vibration is None else samples, len(model.state_names), len(channels)))
    if vibration is not None:
        gains[:, np.r_[joints:count, count + joints : 2 * count]] = vibration.gains(samples)
    return gains


def first_departure(
    model: Model,
    theta: Array,
    start: tuple[Array, Array],
    read: tuple[Sequence[str], Array, float],
    bent_from_rest: Array,
    edge: int,
) -> Array:
    """Departure (2 coordinates,) of a first state from rest, of links that are carried along a given motion.

    - ``start``: first state (nx,) and first commands
    - ``read``: channels, their readings (N, m) and the distance of samples, s
    - ``bent_from_rest``: shape (N, m), the same channels of links that were at rest before
    - ``edge``: samples at the beginning of which the motion is not known well
    """
    joints, count = len(model.joints), len(model.coordinates)
    found = np.zeros(2 * count)
    vibration = FreeVibration.of(model, theta, start, read, held=True)
    if vibration is not None:
        rows = slice(edge, min(edge + vibration.samples, len(read[1])))
        found[np.r_[joints:count, count + joints : 2 * count]] = vibration.departure(
            read[1][rows] - bent_from_rest[rows], edge
        )
    return found
