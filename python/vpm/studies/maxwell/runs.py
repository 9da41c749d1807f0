"""Runs of an element over records, and their errors test by test."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vpm.errors import DivergedError, SimulationError
from vpm.narx.maxwell import MaxwellNarx
from vpm.narx.maxwell_records import MaxwellSignals, Samples, element_samples
from vpm.narx.maxwell_recursion import Recursion, seen, stretch, surface_columns
from vpm.narx.maxwell_result import FAR
from vpm.narx.records import RecordLike
from vpm.narx.run import NarxRun
from vpm.numbers import Array
from vpm.results import Result
from vpm.studies.maxwell.smoothing import smoothed


def maxwell_one_step(element: MaxwellNarx, record: RecordLike, signals: MaxwellSignals | None = None) -> NarxRun:
    """One-step run of a Maxwell element: each force from the **measured** force before it.

    Parameters
    ----------
    record : Experiment or mapping of str to array-like, shape (N,)

    Raises
    ------
    IdentificationError
        The record does not fit the signals.
    SimulationError
        The record has another step than the element.
    """
    signals = signals or MaxwellSignals()
    return _ahead(element, _sampled(element, record, signals), signals)


def maxwell_free_run(
    element: MaxwellNarx, record: RecordLike, signals: MaxwellSignals | None = None, *, limit: float | None = None
) -> NarxRun:
    """Free run of a Maxwell element: each force from the **simulated** one; two samples are the record's.

    Parameters
    ----------
    record : Experiment or mapping of str to array-like, shape (N,)
    limit : float, optional
        Force that counts as diverged, N; by default a thousand times the largest measured one.

    Raises
    ------
    IdentificationError
        The record does not fit the signals.
    SimulationError
        The record has another step than the element.
    DivergedError
        The force left the limit; `run` has the samples before.
    """
    signals = signals or MaxwellSignals()
    return _free(element, _sampled(element, record, signals), signals, limit)


def _one_step(element: MaxwellNarx, one: Samples) -> Array:
    """Force of each sample from the **measured** force a lag before, N, shape (N,); the first two are as given."""
    recursion = Recursion(element.scheme, element.relaxation_time / element.step)
    w, r = recursion.weights, recursion.ratio
    columns = surface_columns(one.drive, one.length)
    stiffness = columns @ element.k0
    elastic = stiffness * (one.length - columns @ element.s0)
    rate = (seen(element.scheme, stiffness) + element.k1) * stretch(element.scheme, one.length)
    past = (w.gamma + w.delta * r) * recursion.lagged(one.force)
    values = (seen(element.scheme, elastic) + r * rate + past) / (w.alpha + w.beta * r)
    values[:2] = one.force[:2]
    return np.asarray(values)


def _ahead(element: MaxwellNarx, one: Samples, signals: MaxwellSignals) -> NarxRun:
    return _run("one-step prediction", one, _one_step(element, one), signals)


def _free(element: MaxwellNarx, one: Samples, signals: MaxwellSignals, limit: float | None = None) -> NarxRun:
    bound = FAR * float(np.abs(one.force).max()) if limit is None else limit
    start = float(one.force[0]), float(one.force[1])
    try:
        values = element.simulate_free_run(one.length, start, one.drive, limit=bound or np.inf)
    except DivergedError as error:
        kept = np.asarray(error.run)
        part = slice(0, kept.size)
        arrays = one.force[part], one.length[part], one.drive[part]
        cut = Samples(one.name, one.unit, one.time[part], one.step, *arrays)
        message = error.message.replace("record `arrays`", f"record `{one.name}`", 1)
        at = float(one.time[kept.size])
        raise DivergedError(message, run=_run("free run", cut, kept, signals), time=at) from error
    return _run("free run", one, values, signals)


def _sampled(element: MaxwellNarx, record: RecordLike, signals: MaxwellSignals) -> Samples:
    one = element_samples(record, signals, element.step)[0]
    _same_clock(element, one)
    return one


def _same_clock(element: MaxwellNarx, one: Samples) -> None:
    if abs(one.step - element.step) > 1e-6 * element.step:
        raise SimulationError(
            f"record {one.name} is sampled every {one.step:g} s, but the element every {element.step:g} s; resample "
            "the record, or give the element that step: k0, s0, k1 and c1 are physical and stay"
        )


def _run(kind: str, one: Samples, values: Array, signals: MaxwellSignals) -> NarxRun:
    inputs = (signals.length, *([signals.drive] if signals.drive else []))
    table = np.column_stack([one.length, one.drive])[:, : len(inputs)]
    return NarxRun(kind, one.name, signals.force, one.unit, inputs, one.time, one.step, one.force, values, table, 2)


@dataclass(frozen=True, repr=False, eq=False)
class MaxwellErrors(Result):
    """Errors of the free run and of the one-step prediction, one row for each test.

    Attributes
    ----------
    sigma : tuple of float
        ``100 mean((|F| - |F*|) / |F|)`` of the free run, %: the measure of D'Imperio (2016), Table 5.5. Errors of both
        signs cancel in it, and samples near zero force decide it; samples of exactly zero force are left out.
    fit : tuple of float
        ``100 (1 - |F - F*| / |F - mean F|)`` of the free run, %.
    max_error, rmse : tuple of float
        Of the free run, N.
    prediction_rmse : tuple of float
        One step ahead, N.
    white : tuple of bool
        Whether the residual of the free run is white: its autocorrelation lies **inside** ``1.96 / sqrt(N)``. Noise on
        the measured force is in that residual as it is; one step ahead it would appear twice, and never be white.
    independent : tuple of bool
        Whether it owes nothing to length and drive signal.
    notes : tuple of str
        Free runs that diverged.
    """

    tests: tuple[str, ...]
    samples: tuple[int, ...]
    sigma: tuple[float, ...]
    fit: tuple[float, ...]
    max_error: tuple[float, ...]
    rmse: tuple[float, ...]
    prediction_rmse: tuple[float, ...]
    white: tuple[bool, ...]
    independent: tuple[bool, ...]
    notes: tuple[str, ...] = ()

    def _headline(self) -> Mapping[str, object]:
        return {"tests": len(self.tests), "fit": self.fit, "sigma": self.sigma, "max_error": self.max_error}

    def _frame_columns(self) -> Mapping[str, object]:
        return {
            "test": self.tests,
            "samples": self.samples,
            "sigma_%": self.sigma,
            "fit_%": self.fit,
            "max_error_N": self.max_error,
            "rmse_N": self.rmse,
            "prediction_rmse_N": self.prediction_rmse,
            "white": self.white,
            "independent": self.independent,
        }


def thesis_sigma(run: NarxRun) -> float:
    """``100 mean((|F| - |F*|) / |F|)`` over the samples of a run after its start, % (D'Imperio 2016, Table 5.5)."""
    measured, computed = np.abs(run.measured[run.start :]), np.abs(run.values[run.start :])
    moving = measured > 0.0
    return float(100.0 * np.mean((measured[moving] - computed[moving]) / measured[moving])) if moving.any() else 0.0


def maxwell_errors(
    element: MaxwellNarx,
    records: RecordLike | Sequence[RecordLike],
    signals: MaxwellSignals | None = None,
    *,
    cutoff: float | None = None,
) -> MaxwellErrors:
    """Free run and one-step prediction of an element on each test, apart from each other.

    Parameters
    ----------
    records : Experiment, or mapping of str to array-like, or a sequence of them
        Tests that were not used for the fit.
    cutoff : float, optional
        Of a low-pass filter for the length, Hz; by default none.

    Raises
    ------
    IdentificationError
        There is no record, or one does not fit the signals.
    SimulationError
        A record has another step than the element.
    """
    signals = signals or MaxwellSignals()
    tests = [smoothed(one, cutoff) for one in element_samples(records, signals, element.step)]
    # Of all tests: in one of them the force may be next to zero.
    limit = FAR * max(float(np.abs(one.force).max()) for one in tests)
    rows, notes = [], []
    for one in tests:
        _same_clock(element, one)
        predicted = _ahead(element, one, signals)
        try:
            free = _free(element, one, signals, limit)
            errors = thesis_sigma(free), free.fit, free.max_error, free.rmse
            tests_of_residual = free.residual_tests()
            verdict = tests_of_residual.white, tests_of_residual.independent_of_inputs
        except DivergedError as error:
            notes.append(error.message)
            errors, verdict = (float("-inf"), float("-inf"), float("inf"), float("inf")), (False, False)
        rows.append((one.name, predicted.residual.size, *errors, predicted.rmse, *verdict))
    names, samples, sigma, fit, largest, rmse, ahead, white, independent = zip(*rows, strict=True)
    columns = names, samples, sigma, fit, largest, rmse, ahead, white, independent
    return MaxwellErrors(*columns, notes=tuple(notes))
