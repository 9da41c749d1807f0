"""Where the piston of a cylinder touches the ends of its stroke.

An end stop of 5e8 N/m makes 500 N out of a micrometre that an encoder is off: no balance of effort holds there. How far
a piston is from its ends is read from the measured motion, with the noise that the filter took from it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vpm.errors import IdentificationError
from vpm.experiment import Experiment, Motion
from vpm.model import Model

Array = NDArray[np.float64]

#: A piston touches an end that it is nearer to than this many standard deviations of the noise of its place.
STOP_DEVIATIONS = 4.0
#: Of what needs no drive to follow the lengths of lines.
_GEOMETRY = ("name", "gravity", "bodies", "joints", "beams", "lines")


def at_stops(model: Model, experiment: Experiment, m: Motion) -> Mapping[str, NDArray[np.bool_]]:
    """For each hydraulic actuator of ``model``, shape (N,): where its piston is at an end of its stroke or beyond.

    Parameters
    ----------
    model : Model
    experiment : Experiment
        Holds the position of every joint as it was read.
    m : Motion
        The same, filtered.
    """
    found = {}
    for name, measured, filtered in _lengths(model, experiment, m):
        stroke, drawn_in = (model.parameters[f"{name}.{key}"].value for key in ("cylinder.stroke", "retracted_length"))
        margin = STOP_DEVIATIONS * float(np.std((measured - filtered)[m.kept]))
        away = 0.5 * stroke - np.abs(filtered - drawn_in - 0.5 * stroke)
        found[name] = away <= margin
    return found


def check_left(experiment: Experiment, joint: str, name: str, left: int, fewest: int) -> None:
    """Complain about a record in which hardly anything happens between the ends of a stroke.

    Raises
    ------
    IdentificationError
    """
    if left < fewest:
        raise IdentificationError(
            f"{experiment.name}: only {left} samples of {joint} are left where the piston of {name} does not touch an "
            "end of its stroke; correct retracted_length or stroke, or record within the stroke"
        )


def _lengths(model: Model, experiment: Experiment, m: Motion) -> Iterator[tuple[str, Array, Array]]:
    """Length or coordinate (N,) that each hydraulic actuator acts on, as measured and as filtered."""
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
    """Length of each line (N,) for several courses of the joints, of the same machine without its drives."""
    content = model.to_dict()
    bare = Model.from_dict({key: content[key] for key in _GEOMETRY if key in content})
    still = np.zeros_like(positions[0])
    outputs = [
        bare.core.simulate_prescribed(bare.theta, place, still, still, 1.0, 1, "rk4", [], [])[0] for place in positions
    ]
    columns = {line: bare.output_channels.index(f"{line}.length") for line in bare.lines}
    return {line: [table[:, column] for table in outputs] for line, column in columns.items()}
