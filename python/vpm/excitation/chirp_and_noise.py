"""A chirp and band-limited noise as excitations."""

import numpy as np

from vpm.errors import ExcitationError
from vpm.excitation.excitation import Excitation, check_band, check_positive, clock
from vpm.scenario.signals import chirp as chirp_values


def chirp(
    channel: str,
    unit: str = "1",
    *,
    first: float,
    last: float,
    amplitude: float,
    duration: float,
    time_step: float,
    mean: float = 0.0,
) -> Excitation:
    """Chirp: a sine with the phase ``(w_s + (w_e - w_s) t / (2 T)) t`` and linearly changing frequency.

    The phase is the integral of the frequency, so the last frequency is reached and not passed
    (`vpm.scenario.signals.chirp`).

    Parameters
    ----------
    first, last : float
        Frequency at the beginning and at the end, Hz.
    amplitude, mean : float
        In `unit`; the amplitude bounds the deviation from the mean at all times.
    duration, time_step : float
        s.

    Raises
    ------
    ExcitationError
        A frequency cannot be sampled, or a number is not positive.
    """
    check_positive(amplitude, "amplitude")
    time = clock(duration, time_step)
    check_band(min(first, last), max(first, last), time_step, "chirp")
    values = chirp_values(time, mean, amplitude, first, last, duration)
    note = f"A chirp of amplitude {amplitude:g} {unit} from {first:g} Hz to {last:g} Hz over {duration:g} s."
    return Excitation("chirp", time, values[:, None], (channel,), (unit,), (note,))


def noise(
    channel: str,
    unit: str = "1",
    *,
    band: tuple[float, float],
    rms: float,
    duration: float,
    time_step: float,
    seed: int = 0,
    peak: float | None = None,
) -> Excitation:
    """Gaussian noise of a flat spectrum within a band and nothing outside of it.

    Lines of the discrete spectrum get independent normal real and imaginary parts, so the samples are Gaussian and
    the signal is periodic over its duration (R. Pintelon and J. Schoukens, "System Identification: A Frequency Domain
    Approach", 2012, chapter 5).

    Parameters
    ----------
    band : tuple of float
        Lowest and highest frequency, Hz.
    rms : float
        Root mean square of the samples, in `unit`; exact.
    duration, time_step : float
        s; the duration is one period.
    seed : int
        The same seed gives the same numbers.
    peak : float, optional
        Largest absolute sample that is allowed, in `unit`; noise that goes beyond is refused, not clipped, because
        clipping spreads power over all frequencies.

    Raises
    ------
    ExcitationError
        The band holds no line or cannot be sampled, a number is not positive, or the peak is passed.
    """
    check_positive(rms, "root mean square")
    time = clock(duration, time_step, whole=True)
    check_band(*band, time_step, "band")
    frequency = np.fft.rfftfreq(time.size, time_step)
    inside = (frequency >= band[0] - 1e-9) & (frequency <= band[1] + 1e-9) & (frequency > 0.0)
    inside &= 2.0 * frequency * time_step < 1.0 - 1e-9
    if not inside.any():
        raise ExcitationError(
            f"no multiple of {1.0 / duration:g} Hz lies between {band[0]:g} and {band[1]:g} Hz; "
            "give a wider band or a longer duration"
        )
    rng = np.random.default_rng(seed)
    spectrum = np.zeros(frequency.size, dtype=np.complex128)
    spectrum[inside] = rng.standard_normal(inside.sum()) + 1j * rng.standard_normal(inside.sum())
    values = np.fft.irfft(spectrum, time.size)
    values *= rms / np.sqrt(np.mean(values**2))
    largest = float(np.max(np.abs(values)))
    if peak is not None and largest > peak:
        raise ExcitationError(
            f"this noise of {rms:g} {unit} (seed {seed}) reaches {largest:.4g} {unit}, and {peak:g} {unit} is allowed; "
            f"give a root mean square of {rms * peak / largest:.4g} {unit}, another seed, or a multisine"
        )
    note = f"Gaussian noise from {band[0]:g} Hz to {band[1]:g} Hz, {rms:g} {unit} root mean square, seed {seed}."
    return Excitation("noise", time, values[:, None], (channel,), (unit,), (note,))
