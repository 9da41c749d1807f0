"""State feedback from exact linear models: linear quadratic gains, scheduled along a motion or over the workspace."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vpm.control.plan import FlexibleFeedforward
from vpm.control.schedule import TIME, Schedule
from vpm.control.task import refuse_loops
from vpm.errors import SimulationError, check_known
from vpm.linear import LinearModel
from vpm.model import Model
from vpm.numbers import Array
from vpm.results import Result

#: Points along a motion.
POINTS = 60
#: Singular values below this share of the largest are none.
NOTHING = 1e-9


@dataclass(frozen=True, repr=False, eq=False)
class StateFeedback(Result):
    """Gains at the points of a schedule: ``u = u_ref - K (x - x_ref) - K_i z``, ``z`` the sum of errors times the step.

    Attributes
    ----------
    time_step : float
        s.
    gains, integral_gains : ndarray, shapes (points, nu, nx), (points, nu, ni)
    outputs : ndarray, shape (points, ni, nx)
        Derivative of the integrated outputs by the state.
    poles : ndarray, shape (points, nx + ni)
        Of the closed loop in sampled time, all inside of the unit circle.
    """

    model_name: str
    time_step: float
    schedule: Schedule
    inputs: tuple[str, ...]
    states: tuple[str, ...]
    integrated: tuple[str, ...]
    gains: Array
    integral_gains: Array
    outputs: Array
    poles: NDArray[np.complex128]

    @property
    def damping_ratios(self) -> Array:
        """Smallest damping ratio under feedback at each point (points,), of poles ``log(z) / h``."""
        rates = np.log(self.poles) / self.time_step
        return np.asarray((-rates.real / np.maximum(np.abs(rates), 1e-300)).min(axis=1))

    def _headline(self) -> Mapping[str, object]:
        return {
            "model": self.model_name,
            "schedule": ", ".join(self.schedule.axes),
            "points": len(self.gains),
            "slowest_pole": float(np.abs(self.poles).max()),
            "least_damping": float(self.damping_ratios.min()),
        }

    def _frame_columns(self) -> Mapping[str, object]:
        mesh = np.meshgrid(*self.schedule.grid, indexing="ij")
        columns: dict[str, object] = {name: axis.ravel() for name, axis in zip(self.schedule.axes, mesh, strict=True)}
        for row, name in enumerate(self.inputs):
            columns |= {f"{name} by {state}": self.gains[:, row, place] for place, state in enumerate(self.states)}
        return columns


def state_feedback(
    model: Model,
    schedule: FlexibleFeedforward | Mapping[str, ArrayLike],
    *,
    deviations: Mapping[str, float],
    efforts: Mapping[str, float],
    integrate: Mapping[str, float] | None = None,
    time_step: float = 1e-3,
    points: int = POINTS,
) -> StateFeedback:
    """Linear quadratic gains from exact linear models, in sampled time.

    At every sample a deviation counts by its square over that of what is allowed (A. Bryson, Y.-C. Ho, "Applied Optimal
    Control", 1975, section 5.2), so does each input; gains minimise the sum (discrete algebraic Riccati equation).

    Parameters
    ----------
    model : Model
        With drives that deliver at once.
    schedule : FlexibleFeedforward or mapping of str to array_like
        The motion along which gains are worked out, or positions of joints, ``{"joint_2": [0.0, 0.5, 1.0]}``, whose
        combinations are poses of rest.
    deviations : mapping of str to float
        Allowed ones of outputs and states, SI, such as ``{"tip.x": 1e-3, "joint_2.velocity": 0.1}``.
    efforts : mapping of str to float
        Allowed ones of inputs; those that are not named rest at their reference.
    integrate : mapping of str to float, optional
        Outputs whose error is driven to zero, with the allowed deviation of its integral, such as
        ``{"tip.x": 1e-4}`` in m s; at most as many as inputs.
    time_step : float
        s.
    points : int
        Along a motion.

    Raises
    ------
    SimulationError
        A name or number is wrong, a motion that does not die out is moved by no input or seen in no deviation, or the
        machine has closed loops.

    Examples
    --------
    >>> feedback = state_feedback(arm, plan, deviations={"tip.x": 1e-3, "tip.z": 1e-3}, efforts={"motor_2": 5.0})
    """
    refuse_loops(model, "a state feedback")
    if isinstance(schedule, FlexibleFeedforward):
        places = Schedule.along(schedule, points)
    else:
        places = Schedule.over(model, schedule)
    _check(model, deviations, efforts, integrate or {})
    found = [
        _gains(model.linearize(state, command), (deviations, efforts, integrate or {}), time_step)
        for state, command in zip(places.states, places.commands, strict=True)
    ]
    gains, outputs, poles = (np.array(parts) for parts in zip(*found, strict=True))
    nx = len(model.state_names)
    return StateFeedback(
        model.name,
        time_step,
        places,
        model.inputs,
        model.state_names,
        tuple(integrate or {}),
        gains[:, :, :nx].copy(),
        gains[:, :, nx:].copy(),
        outputs,
        poles.astype(np.complex128),
    )


def _check(
    model: Model, deviations: Mapping[str, float], efforts: Mapping[str, float], integrate: Mapping[str, float]
) -> None:
    seen = (*model.output_channels, *model.state_names)
    for what, values, known in (
        ("deviations", deviations, seen),
        ("efforts", efforts, model.inputs),
        ("integrate", integrate, model.output_channels),
    ):
        check_known(values, known, SimulationError, f"{what}:", "is unknown")
        for name, value in values.items():
            if not (np.isfinite(value) and value > 0.0):
                raise SimulationError(f'{what}: "{name}" is {value:g}; give a positive number')
    if not efforts or not deviations:
        raise SimulationError("a state feedback weighs deviations against efforts; name at least one of each")
    if len(integrate) > len(efforts):
        raise SimulationError(
            f"{len(integrate)} outputs cannot all be brought to their targets by {len(efforts)} inputs; integrate fewer"
        )


def _gains(
    linear: LinearModel,
    weights: tuple[Mapping[str, float], Mapping[str, float], Mapping[str, float]],
    time_step: float,
) -> tuple[Array, Array, NDArray[np.complex128]]:
    from scipy.linalg import solve_discrete_are

    deviations, efforts, integrate = weights
    nx, extra = len(linear.states), len(integrate)
    inputs = [name.removesuffix(".command") for name in linear.inputs]
    columns = [inputs.index(name) for name in efforts]
    # An output that follows an input at once, such as an acceleration, is weighed by its share from the state.
    rows = np.array([_row(linear, name) / allowed for name, allowed in deviations.items()])
    summed = np.array([linear.C[linear.outputs.index(name)] for name in integrate]).reshape(extra, nx)
    A, B = np.eye(nx + extra), np.zeros((nx + extra, len(columns)))
    A[:nx, :nx], by_inputs = linear.sampled(time_step)
    A[nx:, :nx], B[:nx] = time_step * summed, by_inputs[:, columns]
    seen = np.zeros((len(rows) + extra, nx + extra))
    seen[: len(rows), :nx] = rows
    seen[len(rows) :, nx:] = np.diag([1.0 / allowed for allowed in integrate.values()])
    names = (*linear.states, *(f"the integral of {name}" for name in integrate))
    _reached(linear, A, B, names, f"is moved by no input of {', '.join(efforts)}; give its joint an actuator")
    _reached(linear, A.T, seen.T, names, "shows in no deviation; allow it one")
    R = np.diag([1.0 / allowed**2 for allowed in efforts.values()])
    try:
        cost = solve_discrete_are(A, B, seen.T @ seen, R)
        found = np.linalg.solve(R + B.T @ cost @ B, B.T @ cost @ A)
        poles = np.linalg.eigvals(A - B @ found)
        if not np.abs(poles).max() < 1.0:
            raise np.linalg.LinAlgError(f"a pole is left at {np.abs(poles).max():.6g}")
    except (ValueError, np.linalg.LinAlgError) as error:
        raise SimulationError(
            f"{linear.model_name}: no feedback makes the machine stable ({error}); allow larger efforts, or weigh what "
            "drifts"
        ) from error
    gains = np.zeros((len(linear.inputs), nx + extra))
    gains[columns] = found
    return gains, summed, poles.astype(np.complex128)


def _row(linear: LinearModel, name: str) -> Array:
    table, names = (np.eye(len(linear.states)), linear.states) if name in linear.states else (linear.C, linear.outputs)
    row: Array = table[names.index(name)]
    return row


def _reached(linear: LinearModel, A: Array, B: Array, names: Sequence[str], complaint: str) -> None:
    """Refuse a motion that feedback does not reach and that does not die out by itself.

    Test of Popov, Belevitch and Hautus: the rank of ``[A - z, B]`` at each eigenvalue (T. Kailath, "Linear Systems",
    1980, section 2.4), with states in units in which none is large beside the others.
    """
    from scipy.linalg import matrix_balance

    balanced, units = matrix_balance(A, permute=False)
    reached = np.linalg.solve(units, B)
    reached /= np.maximum(np.abs(reached).max(axis=0), 1e-300)
    for value in np.linalg.eigvals(balanced):
        if np.abs(value) < 1.0 - 1e-9:
            continue
        left, sizes, _ = np.linalg.svd(np.hstack([balanced - value * np.eye(len(A)), reached]))
        if sizes[-1] < NOTHING * sizes[0]:
            name = names[int(np.argmax(np.abs(left[:, -1])))]
            raise SimulationError(f"{linear.model_name}: what moves in {name} does not die out and {complaint}")


def at_axes(schedule: Schedule, model: Model, time: Array, position: Array) -> Array:
    """Values of a feedback schedule's axes at every sample of a motion (N, axes)."""
    if schedule.axes == (TIME,):
        return time.reshape(-1, 1)
    return np.take(position, [model.joints.index(name) for name in schedule.axes], axis=1)
