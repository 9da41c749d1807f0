"""Residual by region: by time, by frequency, and by state of the machine."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vpm.numbers import Array
from vpm.results import Storable

#: A region that holds this much more of the energy than of the samples is worth naming.
WORTH_NAMING = 0.1

#: A bin at the end of a region that adds less than this is left out of the sentence.
NOT_WORTH_A_BIN = 0.01

#: Edges of the bins of speed, as shares of the highest speed.
SPEED_EDGES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)

#: Below this share of the highest speed or acceleration a machine stands still or moves evenly.
AT_REST = 0.02
STEADY = 0.05

TIME_SLICES = 20
POSITION_BINS = 10
OCTAVES = 10


@dataclass(frozen=True, repr=False, eq=False)
class Bin(Storable):
    """One interval of a quantity.

    Attributes
    ----------
    low, high : float
        Ends of the interval, in the unit of the region.
    share : float
        Of the residual's energy (sum of squares).
    occupancy : float
        Of the samples; for frequencies, of the measured signal's energy.
    mean : float
        Mean residual, in the unit of the channel; NaN without samples, and for frequencies.
    """

    low: float
    high: float
    share: float
    occupancy: float
    mean: float


@dataclass(frozen=True, repr=False, eq=False)
class Region(Storable):
    """The residual over one quantity.

    Attributes
    ----------
    quantity : str
        ``"time"``, ``"frequency"``, ``"time since restart"``, or ``"axis.speed"``, ``"axis.velocity"``,
        ``"axis.acceleration"``, ``"axis.position"``.
    bins : tuple of Bin
        In increasing order.
    """

    quantity: str
    unit: str
    bins: tuple[Bin, ...]
    sentence: str

    @property
    def worst(self) -> Bin:
        """Worst bin of a region, with the largest share of the energy."""
        return max(self.bins, key=lambda b: b.share)


@dataclass(frozen=True, repr=False, eq=False)
class Where(Storable):
    """All regions of one channel."""

    regions: tuple[Region, ...]

    @property
    def sentences(self) -> tuple[str, ...]:
        """One sentence for each region."""
        return tuple(region.sentence for region in self.regions)

    def __getitem__(self, quantity: str) -> Region:
        """Region of a quantity."""
        for region in self.regions:
            if region.quantity == quantity:
                return region
        raise KeyError(f"{quantity}; there are {', '.join(region.quantity for region in self.regions)}")


def time_region(residual: Array, time: Array) -> Region:
    """Region by time: shares of 20 equal slices, counted from the first sample, whatever the clock shows there."""
    since = time - time.min()
    bins = _bins(residual, since, np.linspace(0.0, since.max(), TIME_SLICES + 1))
    unit = "s" if time.min() == 0.0 else "s from the first sample"
    return Region("time", "s", bins, _concentration(bins, unit, "of the time"))


def restart_region(residual: Array, since: Array) -> Region:
    """Region by time since the start of a piece: shares of five parts."""
    bins = _bins(residual, since, np.linspace(0.0, since.max(), 6))
    return Region("time since restart", "s", bins, _concentration(bins, "s after a restart", "of the samples"))


def frequency_region(residual: Array, signal: Array, pieces: Sequence[slice], dt: float) -> Region:
    """Region by frequency: shares of octaves from half of the sampling rate downward."""
    nyquist = 0.5 / dt
    edges = np.concatenate([[0.0], nyquist * 2.0 ** np.arange(-OCTAVES, 1.0)])
    powers = [_band_power(values, pieces, dt, edges) for values in (residual, signal)]
    shares, occupied = (power / power.sum() if power.sum() > 0.0 else power for power in powers)
    bins = tuple(
        Bin(float(low), float(high), float(share), float(held), float("nan"))
        for low, high, share, held in zip(edges[:-1], edges[1:], shares, occupied, strict=True)
    )
    first, last = _concentrated(bins)
    sentence = (
        f"{_percent(sum(b.share for b in bins[first:last]))} of the residual's energy lies "
        f"{_interval(bins, first, last, 'Hz')}, where the measured signal has "
        f"{_percent(sum(b.occupancy for b in bins[first:last]))} of its own."
    )
    return Region("frequency", "Hz", bins, sentence)


def state_regions(
    residual: Array, joint: str, state: Mapping[str, Array], *, unit: str, residual_unit: str
) -> list[Region]:
    """Regions by a joint's state: shares over speed, velocity, acceleration and position.

    - ``residual``: shape (N,)
    - ``state``: each of shape (N,), some of ``position``, ``velocity``, ``acceleration``
    - ``unit``: of the position
    """
    makers: tuple[tuple[str, Callable[[], Region]], ...] = (
        ("velocity", lambda: _speed_region(residual, joint, state["velocity"], unit)),
        ("velocity", lambda: _velocity_region(residual, joint, state["velocity"], unit, residual_unit)),
        ("acceleration", lambda: _acceleration_region(residual, joint, state["acceleration"], unit)),
        ("position", lambda: _position_region(residual, joint, state["position"], unit)),
    )
    return [make() for quantity, make in makers if quantity in state and np.ptp(state[quantity]) > 0.0]


def _speed_region(residual: Array, joint: str, velocity: Array, unit: str) -> Region:
    speed = np.abs(velocity)
    bins = _bins(residual, speed, float(speed.max()) * np.array(SPEED_EDGES))
    return Region(f"{joint}.speed", f"{unit}/s", bins, _concentration(bins, f"{unit}/s", "of the time"))


def _velocity_region(residual: Array, joint: str, velocity: Array, unit: str, residual_unit: str) -> Region:
    """Region by signed velocity: missing friction shows as a mean that changes sign with it."""
    highest = float(np.abs(velocity).max())
    rising = highest * np.array([AT_REST, 0.1, 0.25, 0.5, 0.75, 1.0])
    bins = _bins(residual, velocity, np.concatenate([-rising[::-1], rising]))
    rest = AT_REST * highest
    moving = [velocity > rest, velocity < -rest]
    words = [f"{residual[side].mean():+.3g} {residual_unit}" if side.any() else "not known" for side in moving]
    sentence = (
        f"The mean residual is {words[0]} when {joint} moves forward and {words[1]} when it moves backward "
        f"(faster than {rest:.2g} {unit}/s)."
    )
    return Region(f"{joint}.velocity", f"{unit}/s", bins, sentence)


def _acceleration_region(residual: Array, joint: str, acceleration: Array, unit: str) -> Region:
    highest = float(np.abs(acceleration).max())
    bins = _bins(residual, np.abs(acceleration), highest * np.array([0.0, STEADY, 0.2, 0.5, 1.0]))
    sentence = _concentration(bins, f"{unit}/s^2 of acceleration", "of the time")
    return Region(f"{joint}.acceleration", f"{unit}/s^2", bins, sentence)


def _position_region(residual: Array, joint: str, position: Array, unit: str) -> Region:
    bins = _bins(residual, position, np.linspace(position.min(), position.max(), POSITION_BINS + 1))
    return Region(f"{joint}.position", unit, bins, _concentration(bins, f"{unit} of {joint}.position", "of the time"))


def _bins(residual: Array, values: Array, edges: Array) -> tuple[Bin, ...]:
    """Bins of a region: energy, samples and mean between neighbouring edges."""
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)
    counts = np.bincount(place, minlength=edges.size - 1)
    energy = np.bincount(place, weights=residual**2, minlength=edges.size - 1)
    sums = np.bincount(place, weights=residual, minlength=edges.size - 1)
    total = float(energy.sum())
    return tuple(
        Bin(
            float(low),
            float(high),
            float(part) / total if total > 0.0 else 0.0,
            float(count) / residual.size,
            float(held) / float(count) if count else float("nan"),
        )
        for low, high, part, count, held in zip(edges[:-1], edges[1:], energy, counts, sums, strict=True)
    )


def _concentrated(bins: Sequence[Bin]) -> tuple[int, int]:
    """Neighbouring bins of a region whose share exceeds their occupancy most (J. Kadane's largest sum)."""
    best, first, last, running, begin = -np.inf, 0, len(bins), 0.0, 0
    for at, each in enumerate(bins):
        if running <= 0.0:
            running, begin = 0.0, at
        running += each.share - each.occupancy
        if running > best + 1e-12:
            best, first, last = running, begin, at + 1
    while last - first > 1 and bins[first].share - bins[first].occupancy < NOT_WORTH_A_BIN:
        first += 1
    while last - first > 1 and bins[last - 1].share - bins[last - 1].occupancy < NOT_WORTH_A_BIN:
        last -= 1
    return first, last


def _concentration(bins: Sequence[Bin], unit: str, occupancy: str) -> str:
    first, last = _concentrated(bins)
    share = sum(b.share for b in bins[first:last])
    occupied = sum(b.occupancy for b in bins[first:last])
    interval = _interval(bins, first, last, unit)
    if share - occupied < WORTH_NAMING:
        low, high = f"{bins[0].low:.3g}", f"{bins[-1].high:.3g} {unit}"
        return f"The residual's energy is spread evenly from {low} to {high}."
    return f"{_percent(share)} of the residual's energy lies {interval}, {_percent(occupied)} {occupancy}."


def _interval(bins: Sequence[Bin], first: int, last: int, unit: str) -> str:
    low, high = bins[first].low, bins[last - 1].high
    if first == 0 and last < len(bins):
        return f"below {high:.3g} {unit}"
    if last == len(bins) and first > 0:
        return f"above {low:.3g} {unit}"
    return f"between {low:.3g} and {high:.3g} {unit}"


def _percent(share: float) -> str:
    return (
        f"{100.0 * share:.0f} %" if share >= 0.0095 else f"{100.0 * share:.1g} %" if share >= 1e-4 else "almost nothing"
    )


def _band_power(values: Array, pieces: Sequence[slice], dt: float, edges: Array) -> Array:
    """Energy of a frequency region between the edges, by the periodogram of each piece."""
    power = np.zeros(edges.size - 1)
    for piece in pieces:
        part = values[piece]
        energy = np.abs(np.fft.rfft(part)) ** 2 / part.size
        energy[1 : (part.size + 1) // 2] *= 2.0
        frequency = np.fft.rfftfreq(part.size, dt)
        place = np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, edges.size - 2)
        power += np.bincount(place, weights=energy, minlength=power.size)
    return power
