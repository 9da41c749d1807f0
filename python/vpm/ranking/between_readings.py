"""Between readings: outputs of a model as a log holds them that read a channel less often than it has samples.

Straight lines run from reading to reading. An accelerometer jumps with every command that a drive holds, and between
two readings it is not where the line is: compared sample by sample, such a log looks late.
"""

from vpm.experiment import Experiment
from vpm.experiment.signal import interpolate
from vpm.numbers import Array


def between_readings(experiment: Experiment, channel: str, values: Array) -> Array:
    """Values (N, ...) of a channel at all samples as a log holds them that has lines between its readings.

    Before the first reading and behind the last one values stay as they are.
    """
    time = experiment.time
    own = experiment.read_at.get(channel, time[:0])
    own = own[(own >= time[0]) & (own <= time[-1])]
    if len(own) < 2:
        return values
    inside = (time >= own[0]) & (time <= own[-1])
    found = values.copy()
    read = interpolate(time, values, own, smooth=False)
    found[inside] = interpolate(own, read, time[inside], smooth=False)
    return found
