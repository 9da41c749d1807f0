"""Whether feedback and observer hold a machine together, as each does alone."""

from collections.abc import Callable, Sequence

import numpy as np

from vpm.control.feedback import StateFeedback
from vpm.control.schedule import Schedule
from vpm.errors import SimulationError
from vpm.numbers import Array
from vpm.observer import Observer
from vpm.observer.online import SteadyGain
from vpm.simulate import Setup


def check_loops(
    made: Callable[[Setup], Observer], feedback: StateFeedback, steady: Sequence[SteadyGain], setup: Setup
) -> None:
    """Refuse closed loops that grow because the observer's steps are not those of the machine.

    ``made`` gives the observer with other steps, ``steady`` are its gains at the points of the feedback.

    Feedback and observer that are stable alone are so together if both have the machine's own model (K. Astrom,
    B. Wittenmark, "Computer-Controlled Systems", 1997, section 9.4). An observer has that of its steps, which do not
    resolve all modes, and a feedback may act on just these. Steps as fine as need be tell whether it is so.
    """
    observer, exact = made(setup), None
    for number, gains in enumerate(steady):
        growth = _growth(observer, feedback, gains, number)
        if growth <= 1.0:
            continue
        exact = exact or made(Setup("adaptive"))
        places = feedback.schedule
        fine = exact.settled(places.states[number], places.commands[number])
        if _growth(exact, feedback, fine, number) <= 1.0:
            raise SimulationError(
                f"{observer.model.name}: feedback and observer together let errors grow by a factor of {growth:.4g} in "
                f"a sample {_where(places, number)}, for the observer's steps ({setup.method(observer.model)}, "
                f"{1e3 * feedback.time_step / setup.substeps:.3g} ms) are not the machine's; give more substeps, the "
                "integrator adaptive, or a model with fewer shapes"
            )


def _growth(observer: Observer, feedback: StateFeedback, steady: SteadyGain, number: int) -> float:
    """Largest factor by which errors of a closed loop grow in a sample at a point of the schedule."""
    state, command = feedback.schedule.states[number], feedback.schedule.commands[number]
    machine = observer.model.linearize(state, command).sampled(feedback.time_step)
    loop = _loop(machine, steady, _driven(observer, state, command), feedback, number)
    return float(np.abs(np.linalg.eigvals(loop)).max())


def _driven(observer: Observer, state: Array, standing: Array) -> Array:
    """What steps of a closed loop's observer make of each input near a state, shape (nx, nu).

    By central differences about the commands that stand, which enter steps nearly linearly.
    """
    unseen, columns = np.full(len(observer.channels), np.nan), []
    for place, value in enumerate(standing):
        away = np.zeros_like(standing)
        away[place] = 1e-4 * max(1.0, abs(value))
        ends = []
        for command in (standing + away, standing - away):
            observer.reset(state)
            observer.step(unseen, command)
            ends.append(observer.predicted)
        columns.append((ends[0] - ends[1]) / (2.0 * away[place]))
    return np.array(columns).T


def _loop(
    machine: tuple[Array, Array], steady: SteadyGain, driven: Array, feedback: StateFeedback, number: int
) -> Array:
    """What a closed loop makes in a sample of the machine's state, of what is expected of it, and of the sums."""
    (A, B), gain = machine, steady.gain
    K, sums = feedback.gains[number], feedback.integral_gains[number]
    nx, ni = len(A), len(feedback.integrated)
    seen = gain @ steady.output
    unseen = np.eye(nx) - seen
    outputs = feedback.time_step * feedback.outputs[number]
    return np.block(
        [
            [A, -B @ K, -B @ sums],
            [steady.transition @ seen, steady.transition @ unseen - driven @ K, -driven @ sums],
            [outputs @ seen, outputs @ unseen, np.eye(ni)],
        ]
    )


def _where(places: Schedule, number: int) -> str:
    """Where a closed loop is, in words."""
    at = np.unravel_index(number, [len(axis) for axis in places.grid])
    values = [f"{name} = {axis[place]:.4g}" for name, axis, place in zip(places.axes, places.grid, at, strict=True)]
    return "at " + ", ".join(values)
