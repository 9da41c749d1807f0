"""Inertial measurement units: accelerometers and gyroscopes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from vpm.model.marker import Marker


class Imu(Marker):
    """Frame of an accelerometer and a gyroscope, which read along its axes.

    Source: Titterton and Weston 2004, *Strapdown Inertial Navigation Technology*, section 3.2.
    """

    CHANNELS: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("ax", "ay", "az"), "m/s^2"),
        **dict.fromkeys(("wx", "wy", "wz"), "rad/s"),
    }
