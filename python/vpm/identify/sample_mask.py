"""Which samples of an inverse-dynamics residual count: not at standstill, at a stop, or where the filter settles.

An end stop of 5e8 N/m makes 500 N out of a micrometre that an encoder is off: no effort can be predicted there. How far
a piston is from its ends is read from the measured motion, with the noise that the filter took from it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from vpm.errors import IdentificationError
from vpm.experiment import Experiment, Motion
from vpm.identify.problem import FEWEST_SAMPLES
from vpm.identify.response_along_motion import bends
from vpm.model import Model
from vpm.numbers import Array

#: A joint stands still where it is slower than this share of its largest speed for one decimated sample on end: the
#: filter of the motion shows no shorter rest.
STANDSTILL_SHARE = 0.005
#: A drive rests where its joint is slower than this share of its largest speed, in the mean over this time, s.
REST_SHARE, REST_TIME = 0.03, 0.1
#: A joint that moves for less than this share of all records is judged at standstill too: nothing else is left of it.
LEAST_MOVING = 0.5
#: Retained samples at each end of a record in which the parallel filter settles: what a record that ends in motion sets
#: off near the new Nyquist frequency falls by about two fifths from one retained sample to the next.
SETTLING = 8
#: A piston touches an end that it is nearer to than this many standard deviations of the noise of its place.
STOP_DEVIATIONS = 4.0
#: Of what needs no drive to follow the lengths of lines.
_GEOMETRY = ("name", "gravity", "bodies", "joints", "beams", "lines")


@dataclass(frozen=True)
class SampleMask:
    """Which samples of some records count."""

    experiments: Sequence[Experiment]
    motions: Sequence[Motion]
    joints: Sequence[str]  #: Those whose balance is drawn up.
    places: Sequence[int]  #: Their columns in the motions.

    @property
    def _largest(self) -> Array:
        """Largest speed (joints,) of all records, but for a thousandth of their samples."""
        speeds = [np.abs(m.velocity[m.kept][:, self.places]) for m in self.motions]
        return np.asarray(np.max([np.quantile(speed, 0.999, axis=0) for speed in speeds], axis=0))

    def moving(self, model: Model) -> list[Array]:
        """Sample mask of each record (n, joints): 1 where a joint moves, 0 at standstill; all 1 if it mostly stands.

        Zero too where the parallel filter settles, and where a piston that moves it touches an end of its stroke.
        """
        slow, halved = STANDSTILL_SHARE * self._largest, 2 if bends(model) else 1
        speeds = [np.abs(m.velocity[:, self.places]) for m in self.motions]
        standing = [_standing(v, slow, _period(m) // halved) for v, m in zip(speeds, self.motions, strict=True)]
        masks = [~_widened(still, m)[m.retained] for still, m in zip(standing, self.motions, strict=True)]
        moves = np.mean(np.vstack(masks), axis=0) >= LEAST_MOVING
        free = [self.free(model, record) for record in range(len(masks))]
        return [
            (np.where(moves, mask, True) & away) * settled(len(mask), m.decimation)[:, None]
            for mask, away, m in zip(masks, free, self.motions, strict=True)
        ]

    def of_channel(self, model: Model, channel: str, record: int, ends: Array) -> Array:
        """Samples of a channel that count: those of a drive not while its joint rests.

        What a shut valve encloses drifts with the smallest leak, and whatever load dry friction takes up does not show.
        """
        owner = channel.rpartition(".")[0]
        if owner not in model.actuators:
            return ends
        joints = [self.joints.index(joint) for joint in model.joints_of_actuator(owner) if joint in self.joints]
        counts: Array = ends * np.prod(self.busy(record)[:, joints], axis=1)
        return counts

    def busy(self, record: int) -> Array:
        """Sample mask (n, joints): 0 where a joint is slow in the mean over ``REST_TIME``."""
        m = self.motions[record]
        width = min(max(1, round(REST_TIME / m.dt)), len(m.velocity))  # a wrong clock may shrink the whole record
        mean = np.abs(uniform_filter1d(m.velocity[:, self.places], width, axis=0))
        moving = maximum_filter1d(mean, width, axis=0) > REST_SHARE * self._largest
        busy = moving[m.retained].astype(np.float64)
        return busy if busy.mean() >= 0.5 else np.ones_like(busy)

    def free(self, model: Model, record: int) -> NDArray[np.bool_]:
        """Samples (n, joints) at which no piston of a record touches an end, as far as the filters carry the touch."""
        m, experiment = self.motions[record], self.experiments[record]
        away = np.ones((len(m.retained), len(self.joints)), dtype=np.bool_)
        for name, touching in at_stops(model, experiment, m).items():
            # An impact rings, in the oil and in the filters: three times as long as the ends of the record settle.
            near = maximum_filter1d(touching.view(np.uint8), 6 * m.edge + 1)[m.retained] > 0
            for column, joint in enumerate(self.joints):
                if near.any() and joint in model.joints_of_actuator(name):
                    away[:, column] &= ~near
                    check_left(experiment, joint, name, int(away[:, column].sum()), FEWEST_SAMPLES)
        return away


def settled(samples: int, decimation: int) -> Array:
    """1 for retained samples behind and ahead of which the parallel filter has all that it needs, else 0.

    A short record loses no more than a fifth at each end: what little there is has to do.
    """
    ends = min(SETTLING, samples // 5) if decimation > 1 else 0
    place = np.arange(samples)
    return ((place >= ends) & (place < samples - ends)).astype(np.float64)


def _period(m: Motion) -> int:
    """Samples in which the motion filter tells a stop from a reversal, no more than the parallel filter keeps apart."""
    return min(m.decimation, max(1, round(1.0 / (m.cutoff * m.dt))))


def _standing(speed: Array, limit: Array, samples: int) -> NDArray[np.bool_]:
    """Samples at which all speeds within ``samples`` to both sides are below the limit."""
    return np.asarray(maximum_filter1d(speed, 2 * samples + 1, axis=0) < limit)


def _widened(standing: NDArray[np.bool_], m: Motion) -> NDArray[np.bool_]:
    """Sample mask of standstill with its surroundings, into which filters carry it."""
    reach = m.decimation + max(m.decimation, round(1.0 / (m.cutoff * m.dt)))
    return np.asarray(maximum_filter1d(standing.view(np.uint8), 2 * reach + 1, axis=0).astype(np.bool_))


def at_stops(model: Model, experiment: Experiment, m: Motion) -> Mapping[str, NDArray[np.bool_]]:
    """Sample mask (N,) for each hydraulic actuator: where its piston is at an end of its stroke or beyond.

    ``experiment``: holds the position of every joint as it was read; ``m``: the same, filtered.
    """
    found = {}
    for name, measured, filtered in _lengths(model, experiment, m):
        stroke, drawn_in = (model.parameters[f"{name}.{key}"].value for key in ("cylinder.stroke", "retracted_length"))
        margin = STOP_DEVIATIONS * float(np.std((measured - filtered)[m.kept]))
        away = 0.5 * stroke - np.abs(filtered - drawn_in - 0.5 * stroke)
        found[name] = away <= margin
    return found


def check_left(experiment: Experiment, joint: str, name: str, left: int, fewest: int) -> None:
    """Refuse a record whose sample mask leaves hardly any motion between the ends of a stroke."""
    if left < fewest:
        raise IdentificationError(
            f"{experiment.name}: only {left} samples of {joint} are left where the piston of {name} does not touch an "
            "end of its stroke; correct retracted_length or stroke, or record within the stroke"
        )


def _lengths(model: Model, experiment: Experiment, m: Motion) -> Iterator[tuple[str, Array, Array]]:
    """Length or coordinate (N,) of each hydraulic actuator for the sample mask, measured and filtered."""
    cylinders = [name for name in model.actuators if model.actuator_type(name) == "hydraulic"]
    raw = np.column_stack([experiment[f"{joint}.position"] for joint in m.joints]) if cylinders else m.position
    lines = _line_lengths(model, (raw, m.position)) if any(map(model.line_of_actuator, cylinders)) else {}
    for name in cylinders:
        line = model.line_of_actuator(name)
        if line is None:
            column = m.joints.index(model.joint_of_actuator(name))
            yield name, raw[:, column], m.position[:, column]
        else:
            measured, filtered = lines[line]
            yield name, measured, filtered


def _line_lengths(model: Model, positions: Sequence[Array]) -> dict[str, list[Array]]:
    """Length of each line (N,) for the sample mask, for several courses of the joints."""
    content = model.to_dict()
    bare = Model.from_dict({key: content[key] for key in _GEOMETRY if key in content})
    still = np.zeros_like(positions[0])
    outputs = [
        bare.core.simulate_prescribed(bare.theta, place, still, still, 1.0, 1, "rk4", [], [])[0] for place in positions
    ]
    columns = {line: bare.output_channels.index(f"{line}.length") for line in bare.lines}
    return {line: [table[:, column] for table in outputs] for line, column in columns.items()}
