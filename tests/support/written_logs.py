"""What tests of formats of logs share: what is written, which column is which, and whether it was read."""

import importlib.util

import numpy as np
import pytest

from vpm.experiment import Experiment
from vpm.model import ChannelEntry
from vpm.numbers import Array

COUNT = 60
TIME = 0.01 * np.arange(COUNT)
Q = np.sin(3.0 * TIME)


def needs(package: str) -> pytest.MarkDecorator:
    return pytest.mark.skipif(importlib.util.find_spec(package) is None, reason=f"{package} is not installed")


def table(time: str, q: str, **extra: str) -> dict[str, ChannelEntry]:
    named = {"time": (time, "s"), "axis.position": (q, "mm"), **{key: (value, "V") for key, value in extra.items()}}
    return {channel: ChannelEntry(column=column, unit=unit) for channel, (column, unit) in named.items()}


def check(record: Experiment, q: Array = Q) -> None:
    np.testing.assert_allclose(record.time - record.time[0], TIME, atol=1e-12)
    np.testing.assert_allclose(record["axis.position"], 1e-3 * q, rtol=1e-12)
