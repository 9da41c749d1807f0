"""What is logged of a machine: the channels side by side, the least noise that counts, and records in its units."""

import numpy as np

from second_suite.loop import Inputs, Signals
from second_suite.machine import Machine
from vpm import Experiment
from vpm.numbers import Array


def flat(m: Machine, signals: Signals) -> Array:
    """All logged channels, (samples, channels, columns)."""
    tacho = [i for i, joint in enumerate(m.joints) if joint.speed_unit]
    parts = [signals.position[:, m.measured], signals.command[:, m.driven], signals.speed[:, tacho], signals.pressure]
    return np.concatenate(parts, axis=1)


def least(m: Machine) -> Array:
    """Noise below which no channel counts: that of its sensor, and a thousandth of a command."""
    motion = [m.joints[i].noise + m.joints[i].resolution / np.sqrt(12.0) for i in m.measured]
    speeds = [joint.speed_noise for joint in m.joints if joint.speed_unit]
    gauges = [gauge.noise + gauge.resolution / np.sqrt(12.0) for gauge in m.gauges]
    return np.array([*motion, *[1e-3] * len(m.driven), *speeds, *gauges])


def logged(m: Machine, asked: Inputs, signals: Signals, record: int) -> Experiment:
    """One record as an engineer logs it, in the units of the machine."""
    count = round(m.lengths[record] * m.rate)
    data: dict[str, Array] = {}
    units: dict[str, str] = {}
    for i, joint in enumerate(m.joints):
        if joint.encoder:
            data[joint.channel] = signals.position[:count, i, record] / joint.per_unit
            units[joint.channel] = joint.unit
        if joint.speed_unit:
            data[f"{joint.name}.velocity"] = signals.speed[:count, i, record] / joint.per_speed_unit
            units[f"{joint.name}.velocity"] = joint.speed_unit
        if joint.drive:
            data[f"{joint.drive}.command"] = signals.command[:count, i, record]
            units[f"{joint.drive}.command"] = joint.command_unit
        if joint.drive and m.known_loop:
            data[f"{joint.drive}.reference"] = asked.reference[:count, i, record] / joint.per_unit
            units[f"{joint.drive}.reference"] = joint.unit
            data[f"{joint.drive}.disturbance"] = asked.torque[:count, i, record]
            units[f"{joint.drive}.disturbance"] = joint.command_unit
    for i, gauge in enumerate(m.gauges):
        data[gauge.channel] = signals.pressure[:count, i, record] / gauge.per_unit
        units[gauge.channel] = gauge.unit
    return Experiment.from_arrays(np.arange(count) / m.rate, data, units, name=f"record {record + 1}")
