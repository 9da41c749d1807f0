"""One-step prediction and free run side by side, record by record."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vpm.errors import DivergedError, IdentificationError
from vpm.narx.model import Narx
from vpm.narx.records import RecordLike, as_list
from vpm.results import Result


@dataclass(frozen=True, repr=False, eq=False)
class NarxValidation(Result):
    """Errors of a model on records, one row per record.

    Attributes
    ----------
    samples : tuple of int
        Samples that count: without the start.
    prediction_rmse, free_run_rmse : tuple of float
        Infinite where the free run diverged.
    prediction_fit, free_run_fit : tuple of float
        ``100 (1 - |y - yhat| / |y - mean y|)`` in %; minus infinity where the free run diverged.
    notes : tuple of str
        One sentence for each free run that diverged.
    """

    records: tuple[str, ...]
    samples: tuple[int, ...]
    prediction_rmse: tuple[float, ...]
    free_run_rmse: tuple[float, ...]
    prediction_fit: tuple[float, ...]
    free_run_fit: tuple[float, ...]
    free_run_max_error: tuple[float, ...]
    notes: tuple[str, ...] = ()

    def _headline(self) -> Mapping[str, object]:
        return {
            "records": len(self.records),
            "worst_prediction_fit": f"{min(self.prediction_fit):.2f} %",
            "worst_free_run_fit": f"{min(self.free_run_fit):.2f} %",
        }

    def _frame_columns(self) -> Mapping[str, object]:
        return {
            "record": self.records,
            "samples": self.samples,
            "prediction_rmse": self.prediction_rmse,
            "free_run_rmse": self.free_run_rmse,
            "prediction_fit_%": self.prediction_fit,
            "free_run_fit_%": self.free_run_fit,
            "free_run_max_error": self.free_run_max_error,
        }


def validate(model: Narx, records: RecordLike | Sequence[RecordLike]) -> NarxValidation:
    """Validate a model by one-step prediction and free run on each record.

    Parameters
    ----------
    records : Experiment, or mapping of str to array-like, or a sequence of them
        Records, or last parts of records (`split_in_time`), that were not used for the fit.

    Raises
    ------
    IdentificationError
        There is no record.
    SimulationError
        A record does not fit the model.
    """
    names: list[str] = []
    samples: list[int] = []
    predictions: list[tuple[float, float]] = []
    runs: list[tuple[float, float, float]] = []
    notes: list[str] = []
    for record in as_list(records):
        predicted = model.predict_one_step(record)
        try:
            free = model.simulate_free_run(record)
            runs.append((free.rmse, free.fit, free.max_error))
        except DivergedError as error:
            notes.append(error.message)
            runs.append((float("inf"), float("-inf"), float("inf")))
        names.append(predicted.record)
        samples.append(predicted.residual.size)
        predictions.append((predicted.rmse, predicted.fit))
    if not names:
        raise IdentificationError("there is no record; give one at least")
    prediction_rmse, prediction_fit = zip(*predictions, strict=True)
    rmse, fit, largest = zip(*runs, strict=True)
    errors = prediction_rmse, rmse, prediction_fit, fit, largest
    return NarxValidation(tuple(names), tuple(samples), *errors, tuple(notes))
