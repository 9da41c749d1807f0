"""Stiffness, damping and energy of a hysteresis loop over whole cycles.

Displacement and force are Fourier series, found by least squares beside a drift. With harmonics ``X_n``, ``F_n`` of the
angular frequency ``n omega`` the energy of a cycle is ``E = oint F dx = pi sum_n n Im(F_n conj(X_n))``, and

* stiffness ``k = sum Re(F_n conj(X_n)) / sum |X_n|^2``, the slope of force over stroke,
* viscous damping ``c = E / (pi omega sum n^2 |X_n|^2)``, D'Imperio (2016), eq 5.26 for any periodic motion,
* loss factor ``eta = E / (pi k sum n |X_n|^2)``, Coulomb force ``E / oint |dx|``.

k and c are those of the regression ``F = F0 + k x + c dx/dt``, with the harmonics as instruments. Over whole cycles x
and dx/dt are orthogonal, so the velocity term cannot move the slope; over parts of a cycle it would.
Total least squares would need the ratio of the two noises; here white noise is averaged over the N samples first, and
what is left of it in the denominators, ``4 sigma_x^2 / N`` for each harmonic, is known and taken out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import IdentificationError
from vpm.narx.records import RecordLike
from vpm.numbers import Array, Complex
from vpm.results import Result
from vpm.studies.impedance.channels import Sense, check_moves, check_sense, columns
from vpm.studies.impedance.cycles import FEWEST_PER_CYCLE, Sums, parts, visible, whole_cycles
from vpm.studies.impedance.harmonics import evaluate, fourier
from vpm.studies.impedance.hysteresis_notes import loop_notes

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Most harmonics that are looked for.
MOST_HARMONICS = 20


@dataclass(frozen=True, repr=False, eq=False)
class Loop(Result):
    """Stiffness, damping and energy that a hysteresis loop shows.

    Attributes
    ----------
    frequency : float
        Hz.
    amplitude : float
        Half of the stroke, m.
    mean_displacement, mean_force : float
        m, N.
    stiffness, damping : float
        N/m, N s/m.
    stiffness_std, damping_std : float
        Of white noise, and of the uncertainty of the delay; not of what differs between tests.
    energy, energy_std : float
        Lost in one cycle, J.
    viscous_measure, structural_measure, path : float
        ``pi omega sum n^2 |X_n|^2`` (m^2/s), ``pi sum n |X_n|^2`` (m^2), ``oint |dx|`` (m): energy over each is the
        coefficient of a law.
    cycle_stiffness, cycle_damping, cycle_energy : ndarray, shape (cycles,)
    displacement_harmonics, force_harmonics : ndarray of complex
        X_n, F_n with the force as an applied one and without its delay.
    displacement_noise, force_noise : float
        Standard deviations of what the series leave, m, N.
    displacement, force : ndarray, shape (N,)
        Samples of the whole cycles, less mean and drift.
    notes : tuple of str
        What to know before the numbers are trusted.
    """

    name: str
    frequency: float
    amplitude: float
    mean_displacement: float
    mean_force: float
    stiffness: float
    damping: float
    stiffness_std: float
    damping_std: float
    energy: float
    energy_std: float
    viscous_measure: float
    structural_measure: float
    path: float
    cycle_stiffness: Array
    cycle_damping: Array
    cycle_energy: Array
    displacement_harmonics: Complex
    force_harmonics: Complex
    displacement_noise: float
    force_noise: float
    displacement: Array
    force: Array
    notes: tuple[str, ...] = ()

    @property
    def loss_factor(self) -> float:
        """Loss factor of a hysteresis loop, ``E / (pi k sum n |X_n|^2)``: structural damping, 1."""
        return self.energy / (self.stiffness * self.structural_measure)

    @property
    def coulomb_force(self) -> float:
        """Coulomb force of a hysteresis loop, ``E / oint |dx|``: dry friction that loses as much, N."""
        return self.energy / self.path

    @property
    def skew_bias(self) -> float:
        """Bias of a hysteresis loop's damping per second of force delay, (N s/m)/s.

        ``omega c' = omega c cos(omega d) - k sin(omega d)``, so ``-k`` for delays that are short beside a cycle.
        """
        return -self.stiffness

    def _headline(self) -> Mapping[str, object]:
        return {
            "name": self.name,
            "frequency": self.frequency,
            "cycles": self.cycle_energy.size,
            "amplitude": self.amplitude,
            "stiffness": self.stiffness,
            "damping": self.damping,
            "energy": self.energy,
            "loss_factor": self.loss_factor,
            "coulomb_force": self.coulomb_force,
        }

    def _frame_columns(self) -> Mapping[str, object]:
        return {
            "cycle": np.arange(self.cycle_energy.size),
            "stiffness_N_per_m": self.cycle_stiffness,
            "damping_Ns_per_m": self.cycle_damping,
            "energy_J": self.cycle_energy,
        }

    def plot(self) -> Figure:
        """Draw the loop and the ellipse of its stiffness and damping. Needs the extra ``plot``."""
        from vpm.studies.impedance.pictures import plot_loops

        return plot_loops([self])


def identify_loop(
    record: RecordLike,
    displacement: str,
    force: str,
    *,
    sense: Sense = "applied",
    frequency: float | None = None,
    delay: float = 0.0,
    delay_std: float = 0.0,
    drift: int = 1,
) -> Loop:
    """Identify a hysteresis loop: stiffness, damping and lost energy of a periodic test.

    Samples need no even steps, and a hundredth of the last cycle may be missing. Independent white noise on both
    channels biases neither energy nor slope. A force that is recorded late by d looks like damping that is smaller by
    k d, which no loop at a low frequency can tell from damping: give `delay` and its uncertainty.

    Parameters
    ----------
    record : Experiment or mapping of str to array-like, shape (N,)
        A mapping has its clock under ``"time"``, s.
    displacement, force : str
        Channels, m and N.
    sense : {"applied", "reaction"}
        ``"applied"`` for ``F = k x + c dx/dt``, ``"reaction"`` for a force that works against the displacement, such
        as that of a cylinder which pushes its ends apart.
    frequency : float, optional
        Hz; by default estimated from two cycles or more.
    delay, delay_std : float
        By how much the force is recorded later than the displacement, and its standard deviation, s.
    drift : int
        Degree of the polynomial that is taken out of both channels; 0 keeps the mean alone, as a single cycle does.

    Raises
    ------
    IdentificationError
        A channel is missing or does not move, there is no whole cycle, or a cycle has fewer than eight samples.
    ExperimentError
        A channel holds values that are no numbers, or time does not increase.
    """
    sign = check_sense(sense)
    _check_settings(delay, delay_std, drift)
    found = columns(record, (displacement, force), FEWEST_PER_CYCLE)
    check_moves(found, displacement)
    rate, cycles, used = whole_cycles(found, frequency)
    time, x, f = found.time[used], found.values[0][used], sign * found.values[1][used]
    most = min(MOST_HARMONICS, int(time.size / cycles) // 4)
    degree = drift if cycles > 1 else 0
    moved, pushed = (fourier(time, y, rate, most, degree) for y in (x, f))
    count = visible(moved, time.size)
    turn = np.exp(2j * np.pi * rate * np.arange(1, most + 1) * delay)
    total = Sums(moved, pushed, turn, rate, count, time.size)
    bent, felt = x - moved.drift, f - pushed.drift
    # The phases of a cycle count from its own first sample, which is the same sample for both channels.
    each = []
    for part in parts(time, rate, cycles):
        x_n, f_n = (fourier(time[part], y[part], rate, most, 0) for y in (bent, felt))
        each.append(Sums(x_n, f_n, turn, rate, count, int(part.sum())))
    k_std, c_std, e_std = total.spread(moved.noise, pushed.noise)
    phase = np.linspace(0.0, 2.0 * np.pi, 721)
    wave = evaluate(moved.amplitudes[:count], phase)
    loop = Loop(
        name=found.name,
        frequency=rate,
        amplitude=0.5 * float(np.ptp(wave)),
        mean_displacement=moved.mean,
        mean_force=sign * pushed.mean,
        stiffness=total.stiffness,
        damping=total.damping,
        stiffness_std=k_std,
        damping_std=float(np.hypot(c_std, total.stiffness * delay_std)),
        energy=total.energy,
        energy_std=float(np.hypot(e_std, total.stiffness * delay_std * total.viscous)),
        viscous_measure=total.viscous,
        structural_measure=total.structural,
        path=float(np.abs(np.diff(wave)).sum()),
        cycle_stiffness=np.array([one.stiffness for one in each]),
        cycle_damping=np.array([one.damping for one in each]),
        cycle_energy=np.array([one.energy for one in each]),
        displacement_harmonics=moved.amplitudes[:count],
        force_harmonics=(pushed.amplitudes * turn)[:most],
        displacement_noise=moved.noise,
        force_noise=pushed.noise,
        displacement=bent,
        force=felt,
    )
    step = float(np.median(np.diff(time)))
    left = 1.0 - moved.noise**2 / float(np.var(bent))
    return replace(loop, notes=loop_notes(loop, x, step, delay_std, left))


def _check_settings(delay: float, delay_std: float, drift: int) -> None:
    if not (np.isfinite(delay) and np.isfinite(delay_std) and delay_std >= 0.0):
        raise IdentificationError(f"delay is {delay} s with a standard deviation of {delay_std} s; give finite numbers")
    if not 0 <= drift <= 5:
        raise IdentificationError(f"drift is {drift}; give a degree of 0 to 5, higher ones would take the loop away")
