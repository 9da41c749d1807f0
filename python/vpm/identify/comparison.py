"""What a fit compares: the problem of a mode, with first states, pieces and ties where they are asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vpm.errors import IdentificationError
from vpm.experiment import Experiment
from vpm.identify.balance import InverseDynamicsProblem
from vpm.identify.input_error import InputErrorProblem
from vpm.identify.objective import AnyProblem
from vpm.identify.output_error import OutputErrorProblem
from vpm.identify.parallel import worker_count
from vpm.identify.prediction_error import PredictionErrorProblem
from vpm.identify.relative import relative_to_drives
from vpm.identify.settings import Fitting
from vpm.identify.shooting import ShootingProblem
from vpm.identify.ties import TiedProblem, Untied
from vpm.model import Model
from vpm.simulate import MODES, Setup

#: Modes of a fit: those of a simulation, the model turned round, and the model that follows the log.
FIT_MODES = (*MODES, "input_error", "prediction_error")


def problem(
    model: Model,
    experiments: Sequence[Experiment],
    mode: str = "inverse_dynamics",
    *,
    cutoff: float | None = None,
    setup: Setup | None = None,
    channels: Sequence[str] | None = None,
    workers: int = 1,
) -> Untied:
    """Set up the residual of ``model`` against ``experiments`` in one of the modes of a fit.

    ``channels`` are the compared outputs of simulated modes, ``workers`` the records that are simulated at a time.

    Raises
    ------
    IdentificationError, SimulationError
        There is no record, the mode is unknown, or it does not go with this machine and these records.
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
    return OutputErrorProblem(model, experiments, mode, channels=channels, setup=setup, cutoff=cutoff, workers=workers)


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
) -> AnyProblem:
    """Set up what a fit compares.

    Parameters
    ----------
    model, records, mode, cutoff, setup, ties, fitting, free
        As for `identify`.
    """
    chosen = fitting or Fitting()
    workers = 1 if chosen.starts > 1 else worker_count(chosen.workers or None)  # starts take the threads instead
    channels = chosen.channels or None
    if chosen.states or chosen.known_states or chosen.piece > 0.0:
        untied: AnyProblem = ShootingProblem(
            model,
            records,
            mode,
            states=chosen.states,
            known=chosen.known_states,
            piece=chosen.piece,
            continuity=chosen.continuity,
            channels=channels,
            setup=setup,
            workers=workers,
        )
    else:
        untied = problem(model, records, mode, cutoff=cutoff, setup=setup, channels=channels, workers=workers)
        if isinstance(untied, InverseDynamicsProblem):
            untied = relative_to_drives(model, untied, free, ties or {})
    return TiedProblem(untied, ties) if ties and not isinstance(untied, TiedProblem) else untied
