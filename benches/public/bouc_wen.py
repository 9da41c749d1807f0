"""Records of the hysteretic oscillator of Noel and Schoukens 2016, computed from its published equations.

The oscillator is a simulated benchmark: ``m y'' + c y' + k y + z = u``,
``z' = alpha y' - beta (gamma |y'| z + delta y' |z|)``. The official records were made from the same equations with
phases that the paper does not print; these have phases of their own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from public_sets import Series, Split

Array = NDArray[np.float64]

#: Table 1 of the paper: kg, N s/m, N/m, N/m, 1/m, and two numbers.
MASS, DAMPING, STIFFNESS, ALPHA, BETA, GAMMA, DELTA = 2.0, 10.0, 5e4, 5e4, 1e3, 0.8, -1.1
#: Rate of the records, Hz; samples of a period; steps between two samples.
RATE, PERIOD, STEPS = 750.0, 8192, 20


def _rates(state: Array, force: float) -> Array:
    place, velocity, hysteretic = state
    turned = GAMMA * abs(velocity) * hysteretic + DELTA * velocity * abs(hysteretic)
    acceleration = (force - STIFFNESS * place - DAMPING * velocity - hysteretic) / MASS
    return np.array([velocity, acceleration, ALPHA * velocity - BETA * turned])


def response(force: Array) -> Array:
    """Places (m) at the samples of a force (N), from rest, by the classical method of Runge and Kutta.

    Between samples the force is what its Fourier series has there, as of a period that goes on.
    """
    fine = 2 * STEPS
    spectrum = np.zeros(fine * len(force) // 2 + 1, dtype=complex)
    own = np.fft.rfft(force)
    spectrum[: len(own)] = own
    between = np.append(np.fft.irfft(spectrum, fine * len(force)) * fine, force[0])
    step, state, places = 1.0 / (RATE * STEPS), np.zeros(3), np.empty(len(force))
    for number in range(STEPS * len(force)):
        if number % STEPS == 0:
            places[number // STEPS] = state[0]
        begin, middle, end = between[2 * number : 2 * number + 3]
        first = _rates(state, begin)
        second = _rates(state + 0.5 * step * first, middle)
        third = _rates(state + 0.5 * step * second, middle)
        fourth = _rates(state + step * third, end)
        state = state + step / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
    return places


def multisine(seed: int) -> Series:
    """A period of the steady answer to all lines from 5 to 150 Hz with random phases, 50 N root mean square."""
    frequencies = np.fft.rfftfreq(PERIOD, 1.0 / RATE)
    phases = 2.0 * np.pi * np.random.default_rng(seed).random(frequencies.size)
    excited = (frequencies >= 5.0) & (frequencies <= 150.0)
    force = np.fft.irfft(np.where(excited, np.exp(1j * phases), 0.0), PERIOD)
    force *= 50.0 / float(np.sqrt(np.mean(force**2)))
    places = response(np.tile(force, 3))[2 * PERIOD :]
    return Series(f"multisine {seed}", force[:, None], places[:, None], 1.0 / RATE)


def sweep() -> Series:
    """A sweep from 20 to 50 Hz at 10 Hz a minute, 40 N, from rest."""
    time = np.arange(round(180.0 * RATE)) / RATE
    force = 40.0 * np.sin(2.0 * np.pi * (20.0 * time + 0.5 * time**2 * 10.0 / 60.0))
    return Series("sine sweep", force[:, None], response(force)[:, None], 1.0 / RATE)


def hysteretic_oscillator() -> Split:
    """Two periods to fit, and two tests as the paper has them."""
    return Split((multisine(1), multisine(2)), (multisine(3), sweep()), 50)
