"""Whittle likelihood: closed-loop predictions of a model are fitted to records by it, frequency by frequency.

The inverse-dynamics residual covers a few hertz and takes the measured motion as given. It confuses stiction with
delay, and delay with lag. A closed-loop prediction along the reference confuses neither, provided its own parameters
are the best for it. Where a joint sticks, the residual errs by half of a delay; that exceeds the difference between a
delay and a lag. Each frequency is weighted by the noise that is left there: maximum likelihood with an unknown spectrum
(P. Whittle, *J. Royal Statistical Society B* 15, 1953), by steps of Gauss and Newton.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from vpm.discrepancy.confirmation.delay_in_motion import is_dry
from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.identify import OutputErrorProblem
from vpm.identify.identifiability import column_lengths
from vpm.identify.response_along_motion import bends
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Setup

Spectra = list[NDArray[np.complex128]]

#: Steps of the integration in one delay or lag, those beside dry friction, where a step blurs the break-away, and at
#: most in one sampling interval. Delay and lag may be shorter than an interval, and the error of steps has to be
#: smaller than their difference.
STEPS, DRY_STEPS, MOST_STEPS = 3, 10, 10
#: Tapered share of each record; frequencies left out at the low end, where a record is one slope.
TAPERED, LOWEST = 0.1, 2
#: The spectrum of noise is the mean over this share of the frequencies, and over so many at least.
SMOOTHED, FEWEST = 1.0 / 60.0, 15
#: Share of the power of each reading that is taken for its own, so that identical readings stay distinct.
ALIKE = 1e-6
#: Times that the spectrum is taken again from what is left.
ROUNDS = 3
#: Share of itself from which on a column stands beside others.
RANK = 1e-10
#: Most steps of a fit, and the gain in squares of a standard deviation below which none is made.
MOST_FITS, WORTH_A_STEP = 5, 1.0
#: Largest factor by which a step changes a number that cannot be negative, and how often a step that does not help is
#: made shorter, by this factor.
LEAP, TRIES, SHORTER = 3.0, 3, 0.4


@dataclass(frozen=True)
class ClosedLoopPrediction:
    """Closed-loop prediction of records by a model, fitted by the Whittle likelihood."""

    model: Model
    free: tuple[str, ...]  #: Parameters that were fitted.
    problem: OutputErrorProblem  #: All records in closed loop.
    left: Array  #: Shape (n,); what the run leaves of the logs.
    slopes: Array  #: Shape (n, free); derivatives of that by the fitted parameters.

    def spectra(self) -> Spectra:
        """Spectra of the prediction error and of its derivatives, for the Whittle likelihood."""
        return spectra(self.model, self.problem, np.column_stack([self.left, self.slopes]))

    def estimated(self, name: str) -> tuple[float, float]:
        """Parameter fitted by Whittle likelihood, and its standard deviation: infinite without influence."""
        _, _, rows = least(self.spectra())
        lengths, place = column_lengths(rows[:, 1:]), self.free.index(name)
        if not np.any(rows[:, 1 + place]):
            return self.model.parameters[name].value, np.inf
        triangle = np.linalg.qr(rows[:, 1:] / lengths, mode="r")
        spread = float(np.linalg.norm(np.linalg.pinv(triangle, rcond=RANK)[place])) / float(lengths[place])
        return self.model.parameters[name].value, spread


def fit_prediction(
    model: Model,
    free: Sequence[str],
    records: Sequence[Experiment],
    setup: Setup,
    beside: ClosedLoopPrediction | None = None,
) -> ClosedLoopPrediction:
    """Fit the free parameters of a closed-loop prediction by Whittle likelihood, starting from one ``beside`` it.

    Where links bend, which takes a hundred times as long, they stay those of the residual. Derivatives by what both
    have are those of the run ``beside`` until a step is made.

    Raises
    ------
    VpmError
        The model cannot follow the references.
    """
    start = model if beside is None else _like(model, free, beside)
    found = predict(start, tuple(free), records, setup, beside)
    for _ in range(0 if bends(model) else MOST_FITS):
        better = _step(found, setup)
        if better is None:
            break
        found = better
    return found


def spectra(model: Model, problem: OutputErrorProblem, columns: Array) -> Spectra:
    """Spectra for the Whittle likelihood over all samples, by joint with its drives (frequencies, k, columns).

    A command is what the controller made of readings, and is left out.
    """
    from scipy.signal.windows import tukey  # takes a second, and few need it

    groups: dict[tuple[str, str], Spectra] = {}
    for block in problem.blocks:
        if not block.channel.endswith(".command"):
            window = tukey(block.time.size, TAPERED)
            found = np.fft.rfft(columns[block.samples] * window[:, None], axis=0)[LOWEST:]
            groups.setdefault((block.experiment, _read_with(model, block.channel)), []).append(found)
    return [np.stack(group, axis=1) for group in groups.values()]


def _read_with(model: Model, channel: str) -> str:
    """Joint with whose readings another reading shares its noise in the Whittle likelihood."""
    owner = channel.rpartition(".")[0]
    if owner in model.actuators:
        return model.joints_of_actuator(owner)[0]
    return owner if owner in model.joints else channel


def weighted(
    spectrum: NDArray[np.complex128], left: NDArray[np.complex128], inexact: NDArray[np.complex128] | None = None
) -> Array:
    """Spectra weighted by the noise near each frequency, as real and imaginary parts for the Whittle likelihood.

    What no model is exact to, ``inexact``, adds to it where it is given, at the very frequency and to each reading.

    The noise of a drive shows in its pressures and in the motion at once. Taken separately, one noise would count once
    for each reading. So the readings of one drive are weighed by the whole matrix of their spectra.
    """
    scale, triangle = _noise(left, inexact)
    apart = np.linalg.solve(triangle, spectrum / scale[:, :, None]) * np.sqrt(2.0)
    rows = apart.reshape(-1, spectrum.shape[2])
    return np.asarray(np.vstack([rows.real, rows.imag]))


def misfit(run: ClosedLoopPrediction, left: Array | None = None) -> float:
    """Negative Whittle log-likelihood of a prediction error, but for a constant.

    With what another run of these records would leave instead, as if that model were as linear in the known parameters
    and they suited it best.
    """
    columns = np.column_stack([run.left if left is None else left, run.slopes])
    _, noise, _ = least(spectra(run.model, run.problem, columns))
    total = 0.0
    for one in noise:
        scale, triangle = _noise(one)
        total += 2.0 * float(np.sum(np.log(scale))) + 2.0 * float(np.sum(np.log(np.einsum("fii->fi", triangle).real)))
    return total


def _noise(
    left: NDArray[np.complex128], inexact: NDArray[np.complex128] | None = None
) -> tuple[Array, NDArray[np.complex128]]:
    """Noise spectrum for the Whittle likelihood: deviations (f, readings), and the triangle that readings share."""
    readings = left.shape[1]
    power = left[:, :, None] * left[:, None, :].conj()
    length = max(FEWEST * readings, int(SMOOTHED * len(power)))
    smooth = uniform_filter1d(power.real, length, axis=0, mode="reflect").astype(np.complex128)
    if readings > 1:
        smooth += 1j * uniform_filter1d(power.imag, length, axis=0, mode="reflect")
    if inexact is not None:
        smooth[:, range(readings), range(readings)] += np.abs(inexact) ** 2
    own = np.einsum("fii->fi", smooth).real
    own = np.maximum(own, 1e-12 * np.maximum(own.max(axis=0), 1e-300))
    scale = np.sqrt(own)
    alike = smooth / (scale[:, :, None] * scale[:, None, :])
    alike[:, range(readings), range(readings)] = 1.0 + ALIKE * (readings > 1)
    return scale, np.linalg.cholesky(alike)


def least(transforms: Spectra, inexact: Spectra | None = None) -> tuple[Array, Spectra, Array]:
    """Whittle step: least-squares change of parameters, remaining noise spectrum and weighted rows.

    ``inexact`` is what no model is exact to, see `weighted`.
    """
    noise = [s[:, :, 0] for s in transforms]
    floor = [None] * len(transforms) if inexact is None else [s[:, :, 0] for s in inexact]
    for _ in range(ROUNDS):
        rows = np.vstack([weighted(*each) for each in zip(transforms, noise, floor, strict=True)])
        lengths = column_lengths(rows[:, 1:])
        step = np.asarray(np.linalg.lstsq(rows[:, 1:] / lengths, -rows[:, 0], rcond=RANK)[0] / lengths)
        noise = [s[:, :, 0] + s[:, :, 1:] @ step for s in transforms]
    return step, noise, rows


def _like(model: Model, free: Sequence[str], beside: ClosedLoopPrediction) -> Model:
    """Model with the parameters of another Whittle prediction; a delay that only one has stays."""
    theirs = beside.model.parameters
    values = {name: theirs[name].value for name in free if name in beside.free}
    mine = [name for name in free if name not in beside.free]
    other = [name for name in beside.free if name not in free]
    if len(mine) == len(other) == 1 and model.parameters[mine[0]].unit == theirs[other[0]].unit:
        values[mine[0]] = theirs[other[0]].value
    return model.with_parameters(values)


def predict(
    model: Model,
    free: tuple[str, ...],
    records: Sequence[Experiment],
    setup: Setup,
    beside: ClosedLoopPrediction | None = None,
) -> ClosedLoopPrediction:
    """Closed-loop prediction with own parameters for the Whittle likelihood; ``beside`` as in `fit_prediction`.

    Raises
    ------
    VpmError
        The model cannot follow the references.
    """
    problem = OutputErrorProblem(model, records, "closed_loop", setup=_fine(model, free, records, setup))
    left, _ = problem.evaluate(model, model.theta)
    return _with_slopes(model, free, problem, left, setup, beside)


def _with_slopes(
    model: Model,
    free: tuple[str, ...],
    problem: OutputErrorProblem,
    left: Array,
    setup: Setup,
    beside: ClosedLoopPrediction | None = None,
) -> ClosedLoopPrediction:
    """Whittle prediction with derivatives by coarse steps; those known ``beside`` it are reused.

    Each takes as long as the run itself, and models of which one is a little later or slower share all but their own.
    """
    known = beside.free if beside is not None and len(beside.slopes) == len(left) else ()
    coarse = OutputErrorProblem(model, problem.experiments, "closed_loop", setup=setup)
    slopes = np.zeros((len(left), len(free)))
    unknown = [place for place, name in enumerate(free) if name not in known]
    _, slopes[:, unknown] = coarse.evaluate(model, model.theta, [model.index(free[place]) for place in unknown])
    for place, name in enumerate(free):
        if beside is not None and name in known:
            slopes[:, place] = beside.slopes[:, beside.free.index(name)]
    return ClosedLoopPrediction(model, free, problem, left, slopes)


def _fine(model: Model, free: Sequence[str], records: Sequence[Experiment], setup: Setup) -> Setup:
    """Integration steps of a Whittle prediction, as short as the model's time constants need."""
    times = [model.parameters[name] for name in free]
    shortest = min((time.value for time in times if time.unit == "s" and time.value > 0.0), default=np.inf)
    interval, steps = max(record.dt for record in records), DRY_STEPS if is_dry(model) else STEPS
    return replace(setup, substeps=max(setup.substeps, min(MOST_STEPS, ceil(steps * interval / shortest))))


def _step(run: ClosedLoopPrediction, setup: Setup) -> ClosedLoopPrediction | None:
    """Better prediction after one Gauss-Newton step of the Whittle fit, or None."""
    step, noise, rows = least(run.spectra())
    cost = float(rows[:, 0] @ rows[:, 0])
    if cost - float(np.sum((rows[:, 0] + rows[:, 1:] @ step) ** 2)) < WORTH_A_STEP:
        return None
    records = run.problem.experiments
    for share in SHORTER ** np.arange(TRIES):
        try:
            model = run.model.with_parameters(_moved(run, share * step))
            problem = OutputErrorProblem(model, records, "closed_loop", setup=_fine(model, run.free, records, setup))
            left, _ = problem.evaluate(model, model.theta)
        except VpmError:
            continue
        transforms = spectra(model, problem, left[:, None])
        now = sum(float(np.sum(weighted(s, n) ** 2)) for s, n in zip(transforms, noise, strict=True))
        if now < cost:
            return _with_slopes(model, run.free, problem, left, setup)
    return None


def _moved(run: ClosedLoopPrediction, step: Array) -> dict[str, float]:
    """Parameters after a Gauss-Newton step of the Whittle fit, within bounds and a largest factor."""
    values = {}
    for name, change in zip(run.free, map(float, step), strict=True):
        parameter = run.model.parameters[name]
        value = parameter.value + change
        if parameter.minimum >= 0.0 and parameter.value > 0.0:
            value = min(max(value, parameter.value / LEAP), parameter.value * LEAP)
        values[name] = min(max(value, parameter.minimum), parameter.maximum)
    return values
