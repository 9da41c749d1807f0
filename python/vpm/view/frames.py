"""Where the parts of a machine are along a motion, asked of the core all at once."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vpm.model import Model
from vpm.numbers import Array

if TYPE_CHECKING:
    from vpm._core import System

Content = dict[str, Any]

_UPRIGHT = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


class Frames:
    """Frames that are fixed to parts of a machine, numbered as they come.

    What a part hangs on is said as in the core's description: the world, the body of a joint, a section of a beam.
    """

    def __init__(self, model: Model) -> None:
        self._content: Content = json.loads(model.description())
        self._theta = model.theta
        # Sensors may read the markers of the model by their number, and controllers the sensors.
        self._content |= {"sensors": [], "controllers": []}
        self._asked: list[Content] = []
        self._system: tuple[int, System] | None = None

    @property
    def content(self) -> Content:
        """Core's description of the machine with its frames."""
        return self._content

    def value(self, place: int | None) -> float:
        """Parameter by its place in the description of the frames (SI); zero where there is none."""
        return 0.0 if place is None else float(self._theta[place])

    def add(self, on: object, translation: Sequence[float] = (0.0,) * 3, rotation: Sequence[float] = _UPRIGHT) -> int:
        """Number of a new frame at a place of a part; equal ones have one number."""
        frame = {"on": on, "translation": [*map(float, translation)], "rotation": [*map(float, rotation)]}
        if frame in self._asked:
            return self._asked.index(frame)
        self._asked.append(frame)
        return len(self._asked) - 1

    def poses(self, coordinates: Array) -> tuple[Array, Array]:
        """Origins and axes of all drawn frames along a motion.

        ``coordinates``: shape (N, n), of joints and flexible links.

        - result ``origins``: shape (N, F, 3), m, in the world
        - result ``axes``: shape (N, F, 3, 3), row i is the direction of axis i in the world
        """
        poses = self._core().marker_poses(self._theta, coordinates)
        axes = poses[:, :, 3:].reshape(*poses.shape[:2], 3, 3)
        return poses[:, :, :3], np.swapaxes(axes, 2, 3)

    def _core(self) -> System:
        """The machine with all frames as its markers, kept until another frame is asked for."""
        from vpm._core import System

        if self._system is None or self._system[0] != len(self._asked):
            markers = [{"name": f"view.{number}", **frame} for number, frame in enumerate(self._asked)]
            self._system = len(markers), System(json.dumps({**self._content, "markers": markers}))
        return self._system[1]
