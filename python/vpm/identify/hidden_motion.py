"""The balance of effort where links bend, or joints move that nobody measures: what moves so, and what adds to it.

What is worked out along a record, and what laws at the joints and the drives add, is remembered as it is compared:
filtered, and at the samples that the filter retains.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Motion
from vpm.identify.drive_answers import picked
from vpm.identify.drive_memory import DriveMemory
from vpm.identify.reuse import Kept, Parts, parts_of, split
from vpm.model import Model

Array = NDArray[np.float64]
Pair = tuple[Array, Array]

#: Gives all outputs (N, k) along the motion of the measured joints and their derivative (N, k, columns).
Swing = Callable[[Model, Array, Sequence[int]], Pair]


def with_hidden(
    model: Model,
    theta: Array,
    m: Motion,
    wanted: tuple[Sequence[int], Sequence[str]],
    known: tuple[DriveMemory, Kept, Array | None],
    swing: Swing,
) -> tuple[Array, Array, Array, Array, Array]:
    """Elastic links, and joints that nobody measures, on the motion of the others; ideal drives.

    Parameters
    ----------
    model : Model
    theta : ndarray, shape (P,)
    m : Motion
    wanted : (sequence of int, sequence of str)
        Parameters to differentiate by, and channels beside the balance.
    known : (DriveMemory, Kept, ndarray or None)
        What was worked out before, and values of the parameters on whose tangent links bend.
    swing : callable

    Returns
    -------
    required, applied, balance, seen, slopes : ndarray
        As `vpm.identify.along.Response` has them, filtered.
    """
    (columns, channels), (memory, kept, origin) = wanted, known
    measured = [place for place, joint in enumerate(model.joints) if joint in m.joints]
    read = [f"{model.joints[place]}.effort" for place in measured] + list(channels)

    def bend(machine: Model, values: Array, asked: Sequence[int]) -> Pair:
        outputs, jacobian = picked(machine, *swing(machine, values, asked), slice(None), read)
        return _kept(outputs, jacobian, memory)

    parts = parts_of(model, m.joints)
    if parts is None:
        # A joint that winds up has no tangent, but laws on its measured side do not feel that either.
        parts, origin = split(model, m.joints, wound=True), None
    if parts is None:
        outputs, jacobian = bend(model, theta, columns)
    else:
        outputs, jacobian = _bent(parts, theta, columns, partial(kept.near, work=bend), origin)
        _add_laws(parts, theta, m, columns, (outputs, jacobian), memory)
    applied, slopes = _delivered(model, theta, m, columns, memory)
    efforts = len(measured)
    return (
        outputs[:, :efforts],
        applied[:, measured],
        jacobian[:, :efforts] - slopes[:, measured],
        outputs[:, efforts:],
        jacobian[:, efforts:],
    )


def _delivered(model: Model, theta: Array, m: Motion, columns: Sequence[int], memory: DriveMemory) -> Pair:
    return _kept(*model.core.delivered(theta, m.inputs, m.dt, list(columns)), memory)


def _bent(parts: Parts, theta: Array, columns: Sequence[int], near: Callable[..., Pair], origin: Array | None) -> Pair:
    """Channels of the bare machine and their derivative by ``columns`` of the whole one; copies."""
    places = parts.places.tolist()
    mine = {column: places.index(column) for column in columns if column in parts.moving}
    values = theta[places]
    start = values if origin is None else np.where(parts.still, values, origin[places])
    channels, slopes = near(parts, start, values, list(mine.values()))
    jacobian = np.zeros((*channels.shape, len(columns)))
    for k, column in enumerate(mine):
        jacobian[:, :, columns.index(column)] = slopes[:, :, k]
    return channels.copy(), jacobian


def _add_laws(parts: Parts, theta: Array, m: Motion, columns: Sequence[int], answer: Pair, memory: DriveMemory) -> None:
    """Add what the laws of joints take, the difference of two machines with rigid links, to the efforts."""
    if parts.laws is None or parts.shell is None:
        return
    channels, jacobian = answer
    mine, bare = parts.of_laws.tolist(), parts.of_shell.tolist()
    felt = [column for column in columns if column in parts.felt and column in mine]
    names = [parts.laws.parameter_names[mine.index(column)] for column in felt]
    required, slopes = _with_laws(parts.laws, parts.shell, theta[mine], theta[bare], (m, names, memory))
    efforts = required.shape[1]
    channels[:, :efforts] += required
    for k, column in enumerate(felt):
        jacobian[:, :efforts, columns.index(column)] += slopes[:, :, k]


def _with_laws(
    whole: Model, shell: Model, theta: Array, bare: Array, asked: tuple[Motion, Sequence[str], DriveMemory]
) -> Pair:
    """What one rigid machine needs more than the other, which lacks the laws of its joints, and the derivative."""
    m, names, memory = asked
    motion = (m.position, m.velocity, m.acceleration, m.dt)
    common = [place for place, name in enumerate(names) if name in shell.parameter_names]
    required, slopes = whole.core.required(theta, *motion, [whole.index(name) for name in names])
    less, own = shell.core.required(bare, *motion, [shell.index(names[place]) for place in common])
    slopes[:, :, common] -= own
    return _kept(required - less, slopes, memory)


def _kept(efforts: Array, slopes: Array, memory: DriveMemory) -> Pair:
    """Efforts (N, joints) and their derivative (N, joints, columns), filtered side by side."""
    rows, width, count = slopes.shape
    both = memory.keep(np.hstack([efforts, slopes.reshape(rows, width * count)]))
    return both[:, :width], both[:, width:].reshape(len(both), width, count)
