"""Noise model of a residual without missing effects: spectrum of each channel, and likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.fft import dct, idct
from scipy.linalg import solve_toeplitz
from scipy.special import chdtri, gammaln, ndtr

from vpm.numbers import Array
from vpm.ranking.settings import LINES, PER_OCTAVE, SURE, TAILS

#: Stretches of samples that belong together: the records without their beginnings.
Parts = Sequence[slice]

#: Turns of the fixed point by which the scale of that density is found.
TURNS = 60
#: Relative change of the scale at which it is found.
SAME = 1e-7

#: Relative noise on the diagonal of the normal equations, so that a residual of a few lines can be predicted.
FLOOR = 1e-9


@dataclass(frozen=True)
class Colour:
    """Noise spectrum in bands: amplitude by frequency with geometric mean one.

    Law: P. Whittle, *Arkiv for Matematik* 2, 1953: lines of the spectrum are independent, whatever the spectrum is. A
    short autoregression does not see what is slow beside its length, but goes first, so that no line leaks into others
    (R. Blackman and J. Tukey, *Bell System Technical Journal* 37, 1958).
    """

    #: Shape (b - 1,); where the next band begins, cycles per sample.
    edges: Array = field(default_factory=lambda: np.zeros(0))
    sizes: Array = field(default_factory=lambda: np.ones(1))  #: Shape (b,).

    @classmethod
    def of(cls, pieces: Sequence[Array]) -> Colour:
        """Noise spectrum of a signal in pieces (n,)."""
        places = np.concatenate([np.fft.rfftfreq(len(piece)) for piece in pieces])
        powers = np.concatenate([np.abs(np.fft.rfft(piece)) ** 2 / len(piece) for piece in pieces])
        edges, bands = _banded(places, powers)
        sizes = np.sqrt(np.maximum([np.mean(band) for band in bands], FLOOR * np.mean(powers) + 1e-300))
        mean = np.average(np.log(sizes), weights=[len(band) for band in bands])
        return cls(edges, sizes / np.exp(mean))

    def removed(self, piece: Array) -> Array:
        """Whitened piece of a signal (n,) or of derivatives (n, k): its noise spectrum is removed."""
        if len(self.sizes) == 1:
            return piece
        sizes = self.sizes[np.searchsorted(self.edges, np.fft.rfftfreq(len(piece)), side="right")]
        lines = np.fft.rfft(piece, axis=0)
        return np.asarray(np.fft.irfft((lines.T / sizes).T, len(piece), axis=0))


def _begins(places: Array) -> list[int]:
    """First lines of the frequency bands of a noise spectrum: a share of an octave each."""
    begins, last = [], 0
    for place in range(LINES, len(places) - LINES + 1):
        wide = places[place] >= places[last] * 2.0 ** (1.0 / PER_OCTAVE) and places[place] > places[place - 1]
        if wide and place - last >= LINES:
            begins.append(place)
            last = place
    return begins


@dataclass(frozen=True)
class Structured:
    """Spectrum of a signal above white noise, since sensor noise is no missing effect.

    Law: N. Wiener, *Extrapolation, Interpolation, and Smoothing of Stationary Time Series*, MIT Press 1949, the filter
    that leaves least of noise and takes least of a signal. The quietest band of the spectrum says how strong that is.
    Its level is known up to the chi-squared law of its lines (R. Blackman and J. Tukey, *Bell System Technical Journal*
    37, 1958): as much is taken as chance makes of it.
    Of a band with few lines little is known, so that it is kept: nothing may grow there unseen. The lines are those of
    a cosine transform, which mirrors a piece at its ends: no jump there leaks into others.
    """

    edges: Array  #: Shape (b - 1,); where the next band begins, cycles per sample.
    kept: Array  #: Shape (b,); share of the amplitude that is kept in each band.
    noise: float  #: Root mean square of the noise.

    @classmethod
    def of(
        cls,
        pieces: Sequence[Array],
        passed: Sequence[Array] | None = None,
        drawn: Sequence[Sequence[Array]] = (),
    ) -> Structured:
        """Spectrum of a signal in pieces (n,) above white noise.

        Parameters
        ----------
        pieces : sequence of ndarray
        passed : sequence of ndarray, optional
            Share of the power of white noise that is in each line of each piece, where not all of it is.
        drawn : sequence of sequence of ndarray
            Draws of other noise, in pieces each, which is not white. Of a band it is no more than the signal has there.
        """
        places = np.concatenate([frequencies(len(piece)) for piece in pieces])
        powers = np.concatenate([dct(piece, norm="ortho") ** 2 for piece in pieces])
        shares = np.ones(len(powers)) if passed is None else np.concatenate(list(passed))
        edges, bands = _banded(places, powers)
        passes = _banded(places, shares)[1]
        white = np.maximum([np.mean(band) for band in passes], 1e-300)
        most = np.array([np.sum(band) for band in bands]) / chdtri([len(band) for band in bands], ndtr(SURE))
        level = _white_level(bands, passes)
        other = np.zeros(len(powers))
        for several in drawn:
            other += np.concatenate([dct(piece, norm="ortho") ** 2 for piece in several]) / len(drawn)
        room = np.maximum(most - level * white, 0.0)
        shown = np.minimum([np.mean(band) for band in _banded(places, other)[1]], room)
        noise, mean = level * white + shown, np.average(shown, weights=[len(band) for band in bands])
        return cls(edges, 1.0 - noise / np.maximum(most, noise), float(np.sqrt(level * np.mean(shares) + mean)))

    def part_of(self, piece: Array) -> Array:
        """Part of a signal's piece (n,) above white noise."""
        kept = self.kept[np.searchsorted(self.edges, frequencies(len(piece)), side="right")]
        return np.asarray(idct(dct(piece, norm="ortho") * kept, norm="ortho"))


def _white_level(bands: Sequence[Array], passed: Sequence[Array]) -> float:
    """Highest level of white noise in a spectrum, of the quietest bands that lie beside each other.

    What stands out of noise only adds to a band, so that each bounds the level, and several together bound it closer:
    chance makes less of many lines. Lines through which little passes count as few.
    """
    sums = [np.cumsum([0.0, *map(np.sum, several)]) for several in (bands, passed, [one**2 for one in passed])]
    first, last = np.triu_indices(len(bands) + 1, 1)
    power, share, square = (one[last] - one[first] for one in sums)
    counts = share**2 / np.maximum(square, 1e-300)
    known = counts > LINES / 2
    bounds = power[known] * counts[known] / chdtri(counts[known], ndtr(SURE)) / share[known]
    return max(float(np.min(bounds, initial=np.inf)), 1e-300)


def frequencies(count: int) -> Array:
    """Frequencies of the cosine transform for noise spectra, cycles per sample."""
    return np.arange(count) / (2.0 * count)


def _banded(places: Array, powers: Array) -> tuple[Array, list[Array]]:
    """Frequency bands of a noise spectrum: their first lines, and the lines of each."""
    order = np.argsort(places, kind="stable")
    places = places[order]
    begins = _begins(places)
    return places[begins], np.split(powers[order], begins)


@dataclass(frozen=True)
class NoiseModel:
    """Noise model: an autoregression of each channel with Student errors."""

    filters: tuple[Array, ...]  #: Coefficients of the prediction error, the first one 1.
    colours: tuple[Colour, ...]  #: Of these errors.
    deviations: tuple[float, ...]  #: Scales of these errors.
    #: Degrees of freedom of their density, Student's: impacts and stiction leave errors that are no bell (K. Lange, R.
    #: Little and J. Taylor, *J. American Statistical Association* 84, 1989).
    tails: tuple[float, ...]

    def whitened(self, values: Array, parts: Parts) -> Array:
        """Prediction errors under the noise model of residuals (N, m) or derivatives (N, m, k), by channel.

        Returns
        -------
        ndarray, shape (n,) or (n, k)
            In scales of the errors.
        """
        channels = [
            _joined(values[:, place], parts, taps, colour) / deviation
            for place, (taps, colour, deviation) in enumerate(
                zip(self.filters, self.colours, self.deviations, strict=True)
            )
        ]
        return np.concatenate(channels)

    @property
    def freedom(self) -> Array:
        """Degrees of freedom of the noise model's errors by channel (m, 1)."""
        return np.array(self.tails)[:, None]

    def log_density(self, errors: Array) -> Array:
        """Log-density of each sample (n,) under the noise model."""
        channels = self.by_channel(errors)
        return np.asarray(log_student(channels, self.freedom) - np.log(self.deviations)[:, None]).ravel()

    def cost(self, errors: Array) -> float:
        """Negative log-density under the noise model but for a constant, at the most likely scales."""
        channels = self.by_channel(errors)
        sizes = self._scales(channels)
        spread = float(channels.shape[1] * np.sum(np.log(sizes)))
        if not np.any(np.isfinite(self.tails)):  # in their own scale normal errors are as probable, whatever they are
            return spread + 0.5 * channels.size * float(1.0 + np.log(2.0 * np.pi))
        return spread - float(np.sum(log_student(channels / sizes, self.freedom)))

    def roots(self, errors: Array) -> Array:
        """Square roots of the weights (n,) that the noise model gives to squared errors."""
        channels = self.by_channel(errors)
        sizes = self._scales(channels)
        return np.asarray(np.sqrt(_weights(channels / sizes, self.freedom)) / sizes).ravel()

    def _scales(self, channels: Array) -> Array:
        """Most likely scale of the noise model's errors by channel (m, 1)."""
        pairs = zip(channels, self.freedom, strict=True)
        return np.array([[scale_of(channel[None, :], freedom[None, :])] for channel, freedom in pairs])

    def by_channel(self, errors: Array) -> Array:
        """Errors (n,) of the noise model by channel (m, n / m)."""
        return errors.reshape(len(self.tails), -1)

    def information(self) -> Array:
        """Information in a sample under the noise model (m,), relative to a normal one of that scale."""
        tails = np.array(self.tails)
        return 1.0 - 2.0 / (tails + 3.0)


def log_student(errors: Array, freedom: Array) -> Array:
    """Log-density of Student noise with unit scale, of errors (m, n) with degrees of freedom (m, 1)."""
    normal = ~np.isfinite(freedom)
    nu = np.where(normal, 1.0, freedom)
    top = gammaln(0.5 * (nu + 1.0)) - gammaln(0.5 * nu) - 0.5 * np.log(np.pi * nu)
    squares = errors**2
    density = top - 0.5 * (nu + 1.0) * np.log1p(squares / nu)
    return np.where(normal, -0.5 * (squares + np.log(2.0 * np.pi)), density) if np.any(normal) else density


def scale_of(errors: Array, freedom: Array, near: float | None = None) -> float:
    """Most likely scale of Student noise in errors (m, n) with degrees of freedom (m, 1), near ``near``.

    Law: the fixed point in which weights are shares of their sum is the same, and sooner found (J. Kent, D. Tyler and
    Y. Vardi, *Communications in Statistics: Simulation* 23, 1994).
    """
    if not np.any(np.isfinite(freedom)):
        return _deviation(errors)
    size = near or _deviation(errors)
    for _ in range(TURNS):
        weights = _weights(errors / size, freedom)
        last, size = size, max(float(np.sqrt(np.sum(weights * errors**2) / np.sum(weights))), 1e-300)
        if abs(size - last) < SAME * size:
            break
    return size


def _weights(errors: Array, freedom: Array) -> Array:
    normal = ~np.isfinite(freedom)
    nu = np.where(normal, 1.0, freedom)
    weights = (nu + 1.0) / (nu + errors**2)
    return np.where(normal, 1.0, weights) if np.any(normal) else weights


def white_noise(residual: Array, parts: Parts) -> NoiseModel:
    """White noise model: channels in their root mean squares."""
    one = np.ones(1)
    sizes = [_deviation(_joined(residual[:, place], parts, one, Colour())) for place in range(residual.shape[1])]
    return NoiseModel(
        tuple(one for _ in sizes), tuple(Colour() for _ in sizes), tuple(sizes), tuple(np.inf for _ in sizes)
    )


def fitted_noise(residual: Array, parts: Parts, order: int) -> NoiseModel:
    """Fitted noise model: the best autoregression of each channel (Yule 1927, Walker 1931), and its spectrum."""
    taps, colours, deviations, tails = [], [], [], []
    for place in range(residual.shape[1]):
        products = np.zeros(order + 1)
        for part in parts:
            values = residual[part, place]
            spectrum = np.fft.rfft(values, 2 * len(values))
            products += np.fft.irfft(np.abs(spectrum) ** 2)[: order + 1]
        products[0] = products[0] * (1.0 + FLOOR) + 1e-300
        taps.append(np.concatenate([[1.0], solve_toeplitz(products[:-1], -products[1:])]))
        colours.append(Colour.of(_filtered(residual[:, place], parts, taps[-1])))
        size, freedom = _bell(_joined(residual[:, place], parts, taps[-1], colours[-1]))
        deviations.append(size)
        tails.append(freedom)
    return NoiseModel(tuple(taps), tuple(colours), tuple(deviations), tuple(tails))


def _bell(errors: Array) -> tuple[float, float]:
    """Most likely scale and degrees of freedom of Student noise."""
    best, size = (-np.inf, 1.0, np.inf), None
    channel = errors[None, :]
    for freedom in TAILS:
        nu = np.array([[freedom]])
        size = scale_of(channel, nu, size)
        likely = float(np.sum(log_student(channel / size, nu))) - len(errors) * float(np.log(size))
        best = max(best, (likely, size, freedom))
    return best[1], best[2]


def _joined(values: Array, parts: Parts, taps: Array, colour: Colour) -> Array:
    """Prediction errors of all parts under a noise model, joined, without their spectrum."""
    return np.concatenate([colour.removed(piece) for piece in _filtered(values, parts, taps)])


def _filtered(values: Array, parts: Parts, taps: Array) -> list[Array]:
    """Prediction errors of each part by the noise model's autoregression, without its first samples."""
    past = len(taps) - 1
    pieces = []
    for part in parts:
        piece = values[part]
        errors = piece[past:].copy()
        for lag in range(1, past + 1):
            errors += taps[lag] * piece[past - lag : len(piece) - lag]
        pieces.append(errors)
    return pieces


def _deviation(errors: Array) -> float:
    return max(float(np.sqrt(np.mean(errors**2))), 1e-300)
