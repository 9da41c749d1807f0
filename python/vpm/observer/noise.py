"""How far a machine and its sensors are trusted: as stated, or as a record itself makes it most likely."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vpm.errors import DivergedError, SimulationError, check_known
from vpm.model import Model
from vpm.numbers import Array
from vpm.observer.filtering import Record, filtered, first_deviations
from vpm.results import Storable
from vpm.simulate import Setup

#: Samples of each record that decide on the noise: second moments need no more.
SAMPLES = 4000
#: Sweeps over what is unknown, and the factor within which the last one finds it.
SWEEPS, FOUND = 3, 1.15


@dataclass(frozen=True, repr=False, eq=False)
class Noise(Storable):
    """Standard deviations, SI, of what is independent from one sample to the next.

    Attributes
    ----------
    readings : dict
        ``{channel: deviation}`` of each measured output.
    forces : dict
        ``{coordinate: deviation}`` of the force that nobody knows of, held for a sample, N or N m; coordinates are
        joints, then elastic ones. What is not named has none.
    states : dict
        ``{state: deviation}`` of what a state moves by over a sample for no known reason, as names of
        ``model.state_names``. What is not named has none.
    """

    readings: dict[str, float] = field(default_factory=dict)
    forces: dict[str, float] = field(default_factory=dict)
    states: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the noise's numbers."""
        for kind, values, least in (
            ("readings", self.readings, True),
            ("forces", self.forces, False),
            ("states", self.states, False),
        ):
            for name, value in values.items():
                if not (np.isfinite(value) and (value > 0.0 if least else value >= 0.0)):
                    condition = "a positive number" if least else "a number that is not negative"
                    raise SimulationError(f'noise of {kind}: "{name}" is {value:g}; give {condition}')

    def spreads(self, model: Model, record: Record) -> tuple[Array, Array, Array, Array]:
        """Noise deviations of readings, forces, states and the first state, as the core takes them.

        Raises
        ------
        SimulationError
            A name is unknown, or a channel of the record has no noise.
        """
        return *self.placed(model, record.channels), first_deviations(model, record.first)

    def placed(self, model: Model, channels: Sequence[str]) -> tuple[Array, Array, Array]:
        """Noise deviations of readings of these channels, of forces and of states, as the core takes them.

        Raises
        ------
        SimulationError
            A name is unknown, or a channel has no noise.
        """
        lacking = [name for name in channels if name not in self.readings]
        if lacking:
            raise SimulationError(f'noise of readings: "{lacking[0]}" has none; state it, or leave all to the record')
        readings = np.array([self.readings[name] for name in channels])
        forces = _placed("forces", self.forces, model.coordinates)
        return readings, forces, _placed("states", self.states, model.state_names)

    def scaled(self, factor: float) -> Noise:
        """Noise scaled by a factor."""
        return Noise(
            *(
                {name: factor * value for name, value in part.items()}
                for part in (self.readings, self.forces, self.states)
            )
        )


def _placed(kind: str, values: Mapping[str, float], names: Sequence[str]) -> Array:
    check_known(values, names, SimulationError, f"noise of {kind}:", "is unknown")
    return np.array([values.get(name, 0.0) for name in names])


def likely_noise(
    model: Model,
    records: Sequence[Record],
    *,
    setup: Setup | None = None,
) -> Noise:
    """The noise that makes ``records`` most likely under ``model``.

    Unknown are the deviation of each reading of which the model file states no noise, and one measure of all forces:
    they bring the same energy into every coordinate, ``s_i^2 / M_ii`` being the same for all. Where nothing is stated
    the common scale follows from the innovations themselves; the ratios are found one after the other.
    """
    pieces = [record.stretch(SAMPLES) for record in records]
    noise = first_guess(model, pieces)
    known = {name: model.sensor_noise[name] for name in noise.readings if name in model.sensor_noise}
    noise = replace(noise, readings={**noise.readings, **known})

    def likelihood(candidate: Noise) -> tuple[float, float]:
        """Log-likelihood of noise at the best common scale, and its square."""
        power, logarithms, count = 0.0, 0.0, 0
        for piece in pieces:
            try:
                found = filtered(model, piece, candidate, setup=setup)
            except DivergedError:
                return -np.inf, 1.0
            power += float(np.sum(found.whitened() ** 2))
            logarithms += found.log_volume()
            count += found.innovations.size
        if known:
            return -0.5 * (power + logarithms), 1.0
        return -0.5 * (count * float(np.log(power / count)) + logarithms), power / count

    channels = [name for name in noise.readings if name not in known]
    moves: list[Callable[[Noise, float], Noise]] = [_forces]
    moves += [_reading(name) for name in (channels if known else channels[1:])]
    best, factor = likelihood(noise), 10.0
    for sweep in range(SWEEPS if len(moves) > 1 else 1):
        for move in moves:
            step = factor if sweep == 0 else 3.0
            while step > FOUND:
                tried = [(likelihood(changed), changed) for changed in (move(noise, step), move(noise, 1.0 / step))]
                value, changed = max(tried, key=lambda pair: pair[0][0])
                if value[0] > best[0]:
                    best, noise = value, changed
                else:
                    step = np.sqrt(step)
    if not np.isfinite(best[0]):
        raise DivergedError(f"{model.name} runs away from every record, whatever the noise", run=None, time=0.0)
    return noise.scaled(float(np.sqrt(best[1])))


def first_guess(model: Model, pieces: Sequence[Record]) -> Noise:
    """A noise to begin with: readings by their differences, forces a hundredth of what moves the machine."""
    readings = {}
    for place, name in enumerate(pieces[0].channels):
        # Third differences of a smooth signal are mostly noise, whose variance they make twenty times as large.
        rough = np.concatenate([np.diff(piece.readings[:, place], n=3) for piece in pieces])
        size = np.concatenate([piece.readings[:, place] for piece in pieces])
        readings[name] = max(float(np.sqrt(np.mean(rough**2) / 20.0)), 1e-9 * max(float(np.ptp(size)), 1e-9))
    first = pieces[0].first
    n = len(model.coordinates)
    mass = np.diag(model.core.mass_matrix(model.theta, first[:n])) if n else np.ones(0)
    speeds = []
    for place, name in enumerate(pieces[0].channels):
        joint, _, quantity = name.rpartition(".")
        if quantity == "position" and joint in model.joints:
            for piece in pieces:
                step = max(1, round(0.02 / piece.dt))
                ways = piece.readings[step:, place] - piece.readings[:-step, place]
                speeds.append(float(np.std(ways)) / (step * piece.dt))
    speed = max(speeds, default=1.0) or 1.0
    energy = (
        0.01 * speed / 0.1
    )  # N per root of a kilogram: a hundredth of what reaches this speed in a tenth of a second
    forces = {name: float(energy * np.sqrt(mass[place])) for place, name in enumerate(model.coordinates)}
    return Noise(readings, forces)


def _forces(noise: Noise, factor: float) -> Noise:
    return replace(noise, forces={name: factor * value for name, value in noise.forces.items()})


def _reading(name: str) -> Callable[[Noise, float], Noise]:
    return lambda noise, factor: replace(noise, readings={**noise.readings, name: factor * noise.readings[name]})
