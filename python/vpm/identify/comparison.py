"""The residual of a fit by its mode: with first states, pieces and equality constraints where they are asked for."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from vpm.errors import IdentificationError
from vpm.experiment import Experiment, joints_from_sensors
from vpm.identify.first_states import OF_PARAMETER, difference
from vpm.identify.input_error import InputErrorProblem
from vpm.identify.inverse_dynamics import InverseDynamicsProblem
from vpm.identify.output_error import OutputErrorProblem
from vpm.identify.parallel import worker_count
from vpm.identify.prediction_error import PredictionErrorProblem
from vpm.identify.problem import Problem, tied
from vpm.identify.settings import Fitting
from vpm.identify.shooting import ShootingProblem, state_channel
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import MODES, Setup

#: Modes of a fit: those of a simulation, the model turned round, and the model that follows the log.
FIT_MODES = (*MODES, "input_error", "prediction_error")
#: Those that compare outputs of a simulation.
OUTPUT_ERROR = tuple(mode for mode in MODES if mode != "inverse_dynamics")
#: Those in which the model follows the measured motion of its joints.
FOLLOWING = frozenset({"inverse_dynamics", "prescribed_motion", "input_error"})
#: The problems of these modes.
Compared = InverseDynamicsProblem | OutputErrorProblem | InputErrorProblem | PredictionErrorProblem


def followed(model: Model, records: Sequence[Experiment], mode: str, free: Sequence[str] = ()) -> list[Experiment]:
    """Records for a comparison, with positions of joints from lengths and shafts where the mode follows these."""
    if mode not in FOLLOWING:
        return list(records)
    return [joints_from_sensors(record, model, free=free) for record in records]


def problem(
    model: Model,
    experiments: Sequence[Experiment],
    mode: str = "inverse_dynamics",
    *,
    cutoff: float | None = None,
    setup: Setup | None = None,
    channels: Sequence[str] | None = None,
    workers: int = 1,
    offsets: Sequence[str] = (),
) -> Compared:
    """Comparison of ``model`` and ``experiments`` as a residual in one of the modes of a fit.

    ``channels`` are the compared outputs of simulated modes, ``offsets`` those of them that are off by a constant in
    each record, ``workers`` the records that are simulated at a time.
    """
    if not experiments:
        raise IdentificationError("no experiment was given; pass at least one")
    if mode not in FIT_MODES:
        raise IdentificationError(f"unknown mode '{mode}'; choose one of {', '.join(FIT_MODES)}")
    if mode == "inverse_dynamics":
        return InverseDynamicsProblem(model, experiments, cutoff=cutoff, hold=(setup or Setup()).course)
    if mode == "input_error":
        return InputErrorProblem(model, experiments, channels=channels, setup=setup, cutoff=cutoff, workers=workers)
    if mode == "prediction_error":
        return PredictionErrorProblem(model, experiments, channels=channels, setup=setup, workers=workers)
    return OutputErrorProblem(
        model, experiments, mode, channels=channels, setup=setup, cutoff=cutoff, workers=workers, offsets=offsets
    )


def comparison(
    model: Model,
    records: Sequence[Experiment],
    mode: str,
    *,
    cutoff: float | None = None,
    setup: Setup | None = None,
    ties: Mapping[str, str] | None = None,
    fitting: Fitting | None = None,
    free: Sequence[str] = (),
) -> Problem:
    """Set up what a fit compares."""
    chosen = fitting or Fitting()
    workers = 1 if chosen.starts > 1 else worker_count(chosen.workers or None)  # starts take the threads instead
    _check_offsets(model, mode, chosen)
    if chosen.states or chosen.known_states or chosen.piece > 0.0:
        return tied(ShootingProblem(model, records, mode, chosen, setup=setup, workers=workers), ties or {})
    given = {"cutoff": cutoff, "setup": setup, "channels": chosen.channels or None, "offsets": chosen.offsets}
    data = problem(model, records, mode, workers=workers, **given)  # type: ignore[arg-type]
    if isinstance(data, InverseDynamicsProblem):
        data = relative_to_drives(model, data, free, ties or {})
    return tied(data, ties or {})


def _check_offsets(model: Model, mode: str, fitting: Fitting) -> None:
    """Refuse offsets that a comparison's mode has not, or of readings that begin a simulation."""
    if fitting.offsets and mode not in OUTPUT_ERROR:
        raise IdentificationError(
            f"offsets belong to compared outputs, and mode '{mode}' is none of {', '.join(OUTPUT_ERROR)}; take one of "
            "these or leave offsets out"
        )
    begun = {state_channel(model, name): name for name in model.state_names if name not in fitting.states}
    for channel in fitting.offsets:
        if channel in begun and begun[channel] not in fitting.known_states:
            raise IdentificationError(
                f'offsets: the simulation begins at what "{channel}" reads, so that has to be right; leave it out, '
                f'or fit or state the first state "{begun[channel]}"'
            )


class RelativeProblem(InverseDynamicsProblem):
    """An inverse-dynamics residual, at each joint over what the drives deliver, in parts of that before the fit.

    That gets smaller with the gain of its drives: the least sum of squares belongs to a machine without forces.
    The commands were measured, not the efforts. Their density is that of the residual times the derivative of effort by
    command, and what maximises it makes the residual least in units of the delivered effort (J. Nocedal and S. Wright,
    *Numerical Optimization*, 2nd ed., 10.4, for errors of what was measured; G. Seber and C. Wild, *Nonlinear
    Regression*, 2003, 2.8, for the determinant that a change of variables brings).

    ``drives``: drives whose parameters change what they deliver.
    """

    def __init__(self, data: InverseDynamicsProblem, drives: Sequence[str]) -> None:
        vars(self).update(vars(data))
        self._drives = tuple(drives)
        self._before = self._strengths(data.nominal, data.nominal.theta)

    def evaluate(
        self, model: Model, theta: Array, columns: Sequence[int] = (), origin: Array | None = None
    ) -> tuple[Array, Array]:
        """Comparison relative to the delivered effort: residual and derivative; see :class:`Problem`.

        So is what is expected: where all forces are larger, that is as well.
        """
        residual, jacobian = super().evaluate(model, theta, columns, origin)
        residual = residual + self.expected
        strengths = self._strengths(model, theta)
        slopes = {
            place: self._slope(model, theta, column) / strengths
            for place, column in enumerate(columns)
            if model.parameter_names[column].partition(".")[0] in self._drives
        }
        for record in range(len(self.motions)):
            for joint, block in enumerate(self.efforts(record)):
                rows, ratio = block.samples, self._before[joint] / strengths[joint]
                residual[rows] *= ratio
                jacobian[rows] *= ratio
                for place, slope in slopes.items():
                    jacobian[rows, place] -= residual[rows] * slope[joint]
        return residual - self.expected, jacobian

    def _strengths(self, model: Model, theta: Array) -> Array:
        """Effort of drives at each joint to which a comparison is relative; 1 where that is nothing."""
        strengths = self.strengths(model, theta)
        return np.where(strengths > 0.0, strengths, 1.0)

    def _slope(self, model: Model, theta: Array, column: int) -> Array:
        """Derivative by one parameter, within its bounds, of the efforts to which a comparison is relative."""
        parameter, step = model.parameters[model.parameter_names[column]], OF_PARAMETER * (abs(theta[column]) or 1.0)
        middle = theta.copy()
        middle[column] = np.clip(theta[column], parameter.minimum + step, parameter.maximum - step)
        return difference(partial(self._strengths, model), middle, column, step)


def relative_to_drives(
    model: Model, data: InverseDynamicsProblem, free: Sequence[str], ties: Mapping[str, str]
) -> InverseDynamicsProblem:
    """Comparison relative to drive efforts, if a free drive parameter is held by no log.

    Pressures of a cylinder hold its areas and valves. A current holds no torque constant.
    """
    moved = {*free, *(follower for follower, leader in ties.items() if leader in free)}
    held = {channel.partition(".pressure")[0] for channel in data.shown if ".pressure" in channel}
    drives = [name for name in model.actuators if name not in held]
    return RelativeProblem(data, drives) if any(name.partition(".")[0] in drives for name in moved) else data
