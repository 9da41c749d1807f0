"""A bag of an arm whose joints a controller swings, as a driver of ROS 2 would record it.

python examples/robots/record.py FOLDER

Dry friction is in the elbow of the simulated arm, and not in its URDF.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import vpm

Array = NDArray[np.float64]
URDF = Path(__file__).resolve().parent / "arm.urdf"
STEP, COUNT = 5e-3, 900
FRICTION = 1.5  # N m
KIND = "sensor_msgs/msg/JointState"


def swung(model: vpm.Model) -> tuple[Array, Array, Array]:
    """Positions, velocities and efforts of both joints at all samples, with the noise of encoders."""
    random, time = np.random.default_rng(1), STEP * np.arange(COUNT)
    swing = [0.7 * np.sin(2.1 * time) + 0.2 * np.sin(5.0 * time)]
    swing += [0.9 * np.sin(3.1 * time + 0.4) + 0.2 * np.sin(7.0 * time)]
    wanted = np.minimum(time, 1.0) * np.array(swing)
    simulation = vpm.Simulation(model, STEP, substeps=2)
    q, v, u = np.zeros((3, 2, COUNT))
    for k in range(COUNT):
        q[:, k] = [simulation[f"{joint}.position"] for joint in model.joints]
        v[:, k] = [simulation[f"{joint}.velocity"] for joint in model.joints]
        q[:, k] += 1e-5 * random.standard_normal(2)
        u[:, k] = np.array([200.0, 80.0]) * (wanted[:, k] - q[:, k]) - np.array([15.0, 5.0]) * v[:, k]
        simulation.step(u[:, k])
    return q, v, u


def write(folder: Path, names: list[str], columns: tuple[Array, Array, Array]) -> None:
    """Write the columns as messages on ``/joint_states`` of an MCAP bag."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/joint_states", KIND, typestore=store)
        for k in range(COUNT):
            stamp = 1_700_000_000 * 10**9 + round(1e9 * STEP * k)
            clock = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
            header = types["std_msgs/msg/Header"](stamp=clock, frame_id="")
            message = types[KIND](header, names, *(np.ascontiguousarray(column[:, k]) for column in columns))
            writer.write(connection, stamp, store.serialize_cdr(message, KIND))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder of the bag; it must not be there yet")
    folder = parser.parse_args().folder
    hidden = vpm.import_robot(URDF).model.with_effect("coulomb_friction", at="elbow", coulomb=FRICTION)
    write(folder, list(hidden.joints), swung(hidden))


if __name__ == "__main__":
    main()
