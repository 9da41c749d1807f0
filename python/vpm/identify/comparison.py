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
from vpm.identify.shooting import ShootingProblem, state_channel
from vpm.identify.ties import TiedProblem, Untied
from vpm.model import Model
from vpm.simulate import MODES, Setup

#: Modes of a fit: those of a simulation, the model turned round, and the model that follows the log.
FIT_MODES = (*MODES, "input_error", "prediction_error")
#: Those that compare outputs of a simulation.
OUTPUT_ERROR = tuple(mode for mode in MODES if mode != "inverse_dynamics")


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
) -> Untied:
    """Set up the residual of ``model`` against ``experiments`` in one of the modes of a fit.

    ``channels`` are the compared outputs of simulated modes, ``offsets`` those of them that are off by a constant in
    each record, ``workers`` the records that are simulated at a time.

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
    _check_offsets(model, mode, chosen)
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
            offsets=chosen.offsets,
        )
    else:
        untied = problem(
            model,
            records,
            mode,
            cutoff=cutoff,
            setup=setup,
            channels=channels,
            workers=workers,
            offsets=chosen.offsets,
        )
        if isinstance(untied, InverseDynamicsProblem):
            untied = relative_to_drives(model, untied, free, ties or {})
    return TiedProblem(untied, ties) if ties and not isinstance(untied, TiedProblem) else untied


def _check_offsets(model: Model, mode: str, fitting: Fitting) -> None:
    """Complain about offsets that a mode has not, or of readings that a simulation begins from."""
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
