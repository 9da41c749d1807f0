"""The library of LISDD for one driven axis: what each effect of the catalogue adds to a balance of effort.

A balance says applied less required effort, so that a term is the load that the model lacks, counted against the
motion. Each term is linear in its coefficients. What is not stands on a grid, one term for each value: the speed of a
Stribeck law, the period of a ripple, the width of a dead zone.

Laws: B. Armstrong-Helouvry, P. Dupont and C. Canudas de Wit, Automatica 30 (1994) for friction; M. Krasnosel'skii and
A. Pokrovskii, *Systems with Hysteresis* (1989) for the operators of springs that slip and of play.

Not in it are the friction of bristles, which is hysteresis and damping in first order, and what no single axis has.
Some effects have no regressor of their own on one axis. The delay of its sensor is that of its command. The offset of
its sensor is a tilt of gravity. The gain of its sensor scales the known parameters, but for the weight.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, lfilter

from vpm.identify import InverseDynamicsProblem
from vpm.model import Model

Array = NDArray[np.float64]

#: Speed below which dry friction bends, as a share of the root mean square speed.
TRANSITION = 0.01
#: Speeds of a Stribeck law, shares of the root mean square speed.
STRIBECK = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
#: Ripples: periods on the way of the axis. None lies further than an eighth of a period from one of these at its ends.
RIPPLES = tuple(0.5 * k for k in range(2, 51))
#: The same of what rubs differently along the way.
RUBS = tuple(0.5 * k for k in range(1, 21))
#: Times after which friction is warm [s].
WARMTHS = (1.0, 2.0, 4.0, 8.0)
#: Ways of springs that slip, and gaps, as shares of the way of the axis.
SLIPS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2)
GAPS = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2)
#: Frequencies of a link behind a spring [Hz], and its damping ratio.
SWINGS, SWING_DAMPING = (5.0, 10.0, 20.0, 40.0, 80.0), 0.05
#: End stops: how far from the end of the way, in shares of it.
STOPS = (0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4)
#: Delays and time constants of a drive [s].
TIMES = (5e-4, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3)
#: Dead zones as shares of the root mean square command, limits as shares of the largest one.
ZONES = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4)
LIMITS = (0.4, 0.5, 0.6, 0.7, 0.8, 0.9)


@dataclass(frozen=True)
class Along:
    """One record on the grid of the log.

    Attributes
    ----------
    position, velocity, acceleration, command : ndarray, shape (N,)
    weight, slope : ndarray, shape (N,)
        Effort that holds the axis against gravity, and its derivative by the position.
    time : ndarray, shape (N,)
        Since the first sample, s.
    dt : float
        s.
    """

    position: Array
    velocity: Array
    acceleration: Array
    command: Array
    weight: Array
    slope: Array
    time: Array
    dt: float


@dataclass(frozen=True)
class Term:
    """A candidate: what it adds to a balance along a record, up to its coefficients.

    Attributes
    ----------
    effect, site : str
        As the catalogue and the model name them.
    shape : callable
        Columns of shape (N, k) along a record.
    resists : bool
        Whether physics allows no negative coefficient of the first column.
    """

    effect: str
    site: str
    shape: Callable[[Along], Array]
    resists: bool = True

    @property
    def named(self) -> tuple[str, str]:
        """Effect and site."""
        return self.effect, self.site


@dataclass(frozen=True)
class Span:
    """What is usual on the training records: ends of the way, speed and command (root mean square), largest command."""

    low: float
    high: float
    speed: float
    command: float
    largest: float

    @classmethod
    def of(cls, records: Sequence[Along]) -> Span:
        """Of some records together."""
        position = np.concatenate([r.position for r in records])
        velocity = np.concatenate([r.velocity for r in records])
        command = np.concatenate([r.command for r in records])
        speed, size = (float(np.sqrt(np.mean(x**2))) for x in (velocity, command))
        return cls(float(position.min()), float(position.max()), speed, size, float(np.abs(command).max()))

    @property
    def way(self) -> float:
        """Between both ends."""
        return self.high - self.low

    @property
    def middle(self) -> float:
        """Half way."""
        return 0.5 * (self.high + self.low)

    def side(self, record: Along) -> Array:
        """Sign of the velocity, bent as the catalogue bends it."""
        return np.asarray(np.tanh(record.velocity / (TRANSITION * self.speed)))


def along(problem: InverseDynamicsProblem, model: Model) -> tuple[Along, ...]:
    """The records of a problem, whose model has one joint and one command."""
    bare = model
    for effect in model.effects:
        bare = bare.without_effect(effect.name, effect.at)
    return tuple(
        Along(
            m.position[:, 0],
            m.velocity[:, 0],
            m.acceleration[:, 0],
            m.inputs[:, 0],
            *_weight(bare, m.position[:, 0]),
            m.time - m.time[0],
            m.dt,
        )
        for m in problem.motions
    )


def _weight(model: Model, position: Array) -> tuple[Array, Array]:
    """Effort that gravity needs at each position, and its derivative, from a table."""
    places = np.linspace(position.min(), position.max(), 401)
    efforts = np.array([model.inverse_dynamics([q], [0.0], [0.0])[0] for q in places])
    slopes = np.gradient(efforts, places, edge_order=2)
    return np.interp(position, places, efforts), np.interp(position, places, slopes)


def library(model: Model, span: Span) -> list[Term]:
    """All terms for the sites of a model of one axis, without the effects that it has already.

    Parameters
    ----------
    model : Model
    span : Span
        Of the training records, which the grids are shares of.
    """
    joint, drive = model.joints[0], model.actuators[0]
    terms = [
        *_friction(joint, span),
        *_finer_friction(joint, span),
        *_loads(joint, span),
        *_gearing(joint, span),
        *_stops(joint, span),
        *_drive(drive, span),
        *_elsewhere(model),
    ]
    there = {(effect.name, effect.at) for effect in model.effects}
    return [term for term in terms if term.named not in there]


def _friction(joint: str, span: Span) -> Iterator[Term]:
    side = span.side

    def stribeck(speed: float) -> Callable[[Along], Array]:
        return lambda r: _column(side(r) * np.exp(-((r.velocity / speed) ** 2)))

    yield Term("viscous_friction", joint, lambda r: _column(r.velocity))
    yield Term("coulomb_friction", joint, lambda r: _column(side(r)))
    yield Term("asymmetric_friction", joint, lambda r: np.column_stack([side(r) ** 2, r.velocity * side(r)]), False)
    for share in STRIBECK:
        yield Term("stribeck_friction", joint, stribeck(share * span.speed))


def _finer_friction(joint: str, span: Span) -> Iterator[Term]:
    side = span.side

    def along_way(wave: float) -> Callable[[Along], Array]:
        return lambda r: side(r)[:, None] * _waves(r, wave)

    def cold(time: float) -> Callable[[Along], Array]:
        return lambda r: np.exp(-r.time / time)[:, None] * np.column_stack([side(r), r.velocity])

    yield Term("quadratic_drag", joint, lambda r: _column(r.velocity * np.abs(r.velocity)))
    yield Term(
        "load_dependent_friction",
        joint,
        lambda r: np.column_stack([np.abs(r.command) * side(r), r.command * side(r) ** 2]),
    )
    for periods in RUBS:
        yield Term("position_dependent_friction", joint, along_way(2.0 * np.pi * periods / span.way), False)
    for time in WARMTHS:
        yield Term("warming_friction", joint, cold(time))


def _loads(joint: str, span: Span) -> Iterator[Term]:
    def ripple(wave: float) -> Callable[[Along], Array]:
        return lambda r: _waves(r, wave)

    def of_current(wave: float) -> Callable[[Along], Array]:
        return lambda r: r.command[:, None] * _waves(r, wave)

    yield Term("bias_force", joint, lambda r: _column(np.ones_like(r.position)), False)
    yield Term("spring", joint, lambda r: np.column_stack([r.position - span.middle, np.ones_like(r.position)]))
    yield Term("cubic_spring", joint, lambda r: _column((r.position - span.middle) ** 3), False)
    for periods in RIPPLES:
        yield Term("torque_ripple", joint, ripple(2.0 * np.pi * periods / span.way), False)
        yield Term("current_ripple", joint, of_current(2.0 * np.pi * periods / span.way), False)


def _gearing(joint: str, span: Span) -> Iterator[Term]:
    def slips(way: float) -> Callable[[Along], Array]:
        return lambda r: _column(stretch(r.position, way) / way)

    def play(gap: float) -> Callable[[Along], Array]:
        return lambda r: _column(-_rate(_rate(stretch(r.position, 0.5 * gap), r.dt), r.dt))

    def swing(frequency: float) -> Callable[[Along], Array]:
        return lambda r: _column(_behind_spring(r.acceleration, frequency, r.dt) - r.acceleration)

    yield Term("rotor_inertia", joint, lambda r: _column(r.acceleration))
    for share in SLIPS:
        yield Term("hysteresis", joint, slips(share * span.way))
    for share in GAPS:
        yield Term("backlash", joint, play(share * span.way))
    for frequency in SWINGS:
        yield Term("joint_compliance", joint, swing(frequency))


def _stops(joint: str, span: Span) -> Iterator[Term]:
    def upper(place: float) -> Callable[[Along], Array]:
        return lambda r: _pressed(np.maximum(r.position - place, 0.0), r.velocity)

    def lower(place: float) -> Callable[[Along], Array]:
        return lambda r: -_pressed(np.maximum(place - r.position, 0.0), -r.velocity)

    for share in STOPS:
        yield Term("end_stop", joint, upper(span.high - share * span.way))
        yield Term("end_stop", joint, lower(span.low + share * span.way))


def _drive(drive: str, span: Span) -> Iterator[Term]:
    def delay(time: float) -> Callable[[Along], Array]:
        return lambda r: _column(r.command - _late(r.command, time / r.dt))

    def lag(time: float) -> Callable[[Along], Array]:
        return lambda r: _column(r.command - _slow(r.command, time, r.dt))

    def zone(width: float) -> Callable[[Along], Array]:
        return lambda r: _column(np.clip(r.command, -width, width))

    def limit(size: float) -> Callable[[Along], Array]:
        return lambda r: _column(r.command - np.clip(r.command, -size, size))

    for time in TIMES:
        yield Term("input_delay", drive, delay(time))
        yield Term("actuator_lag", drive, lag(time))
    for share in ZONES:
        yield Term("dead_zone", drive, zone(share * span.command))
    for share in LIMITS:
        yield Term("saturation", drive, limit(share * span.largest))


def _elsewhere(model: Model) -> Iterator[Term]:
    body, sensor = model.sites("body")[0], model.sensors[0] if model.sensors else ""
    yield Term("payload", body, lambda r: np.column_stack([r.acceleration, r.weight]))
    yield Term("gravity_tilt", "world", lambda r: _column(r.slope), False)
    if sensor:
        yield Term("sensor_gain", sensor, lambda r: _column(r.position * r.slope), False)


def stretch(position: Array, way: float) -> Array:
    """How far a spring is stretched whose other end slips beyond a way; position less stretch is a play of twice it."""
    stretched, value = np.empty_like(position), 0.0
    for k, step in enumerate(np.diff(position, prepend=position[0]).tolist()):
        value = min(max(value + step, -way), way)
        stretched[k] = value
    return stretched


def _behind_spring(acceleration: Array, frequency: float, dt: float) -> Array:
    """Acceleration of a mass behind a spring: ``(2 d w s + w^2) / (s^2 + 2 d w s + w^2)``."""
    w = 2.0 * np.pi * frequency
    above, below = [2.0 * SWING_DAMPING * w, w**2], [1.0, 2.0 * SWING_DAMPING * w, w**2]
    return np.asarray(lfilter(*bilinear(above, below, 1.0 / dt), acceleration))


def _waves(record: Along, wave: float) -> Array:
    """Cosine and sine along the way."""
    return np.column_stack([np.cos(wave * record.position), np.sin(wave * record.position)])


def _pressed(depth: Array, speed: Array) -> Array:
    """Spring and damper of a contact (K. Hunt and F. Crossley, J. Appl. Mech. 42, 1975)."""
    return np.column_stack([depth, depth * speed])


def _late(command: Array, samples: float) -> Array:
    places = np.arange(command.size, dtype=np.float64)
    return np.interp(places - samples, places, command)


def _slow(command: Array, time: float, dt: float) -> Array:
    """Lag of first order under a held command."""
    answer = -np.expm1(-dt / time)
    return np.asarray(lfilter([answer], [1.0, answer - 1.0], command))


def _rate(values: Array, dt: float) -> Array:
    return np.asarray(np.gradient(values, dt))


def _column(values: Array) -> Array:
    return values[:, None]
