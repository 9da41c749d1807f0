"""Joint states of a robot in an MCAP bag, as a driver of ROS 2 records them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
KIND = "sensor_msgs/msg/JointState"


def write_joint_states(folder: Path, time: Array, states: Mapping[str, tuple[Array, Array, Array]]) -> Path:
    """Write position, velocity and effort of joints as ``/joint_states``; the MCAP file."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types, names = store.types, list(states)
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/joint_states", KIND, typestore=store)
        for k, t in enumerate(time):
            stamp = 1_700_000_000 * 10**9 + round(1e9 * t)
            clock = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
            columns = [np.array([states[name][what][k] for name in names]) for what in range(3)]
            header = types["std_msgs/msg/Header"](stamp=clock, frame_id="")
            message = types[KIND](header, names, *columns)
            writer.write(connection, stamp, store.serialize_cdr(message, KIND))
    return next(folder.glob("*.mcap"))
