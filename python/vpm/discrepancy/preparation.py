"""Preparation of a diagnosis: training and validation records, the nominal and the recalibrated model.

The customary preparation filters the motion just above the band that is kept (M. Gautier, ICRA 1997). At a reversal so
smooth a motion passes through rest sooner or later than the joint did. Dry friction, hysteresis or backlash along it
then err by more than a weak effect. Laws that are linear in the motion leave noise at its frequency, and the band
removes it later. So the filter of the states may be as fast as their noise allows.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from vpm.discrepancy.judged_model import Data, Judged, judged_anyhow
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.discrepancy.screening.candidates import shares_at, slow_share, slow_speeds
from vpm.discrepancy.settings import FAR, HELD_OUT, QUICKER, REACH, WIDER
from vpm.discrepancy.stuck_channels import check_moving, check_stuck
from vpm.errors import DiagnosisError
from vpm.experiment import Experiment, Motion, choose_cutoff, joints_from_sensors
from vpm.experiment.cutoff import HIGHEST
from vpm.experiment.lengths import line_rates
from vpm.experiment.signal import UNDISTORTED_BAND
from vpm.identify import InverseDynamicsProblem, OutputErrorProblem
from vpm.identify.between_records import changed_between
from vpm.identify.comparison import relative_to_drives
from vpm.identify.first_states import begun_likeliest, matters
from vpm.identify.moments import on_the_border
from vpm.identify.parallel import worker_count
from vpm.identify.refitting import ROUNDS
from vpm.identify.response_along_motion import answers_at_once
from vpm.identify.sample_mask import STANDSTILL_SHARE
from vpm.identify.settings import Checks
from vpm.model import Model, Parameter
from vpm.numbers import NORMAL_95, short
from vpm.simulate import Setup

#: Records to fit, records to judge on, and notes on both.
Records = tuple[tuple[Experiment, ...], tuple[Experiment, ...], list[str]]


def records_of(model: Model, experiments: Sequence[Experiment], validate: Sequence[Experiment]) -> Records:
    """Prepare records for fit and validation, with notes on both."""
    training = tuple(joints_from_sensors(record, model, free=model.adjustable) for record in experiments)
    if not training:
        raise DiagnosisError("no record was given; pass at least one experiment")
    check_moving(model, training)
    validation = tuple(joints_from_sensors(record, model) for record in validate)
    if validation:
        check_stuck(model, validation)
        return training, validation, []
    pairs = [e.split(1.0 - HELD_OUT) for e in training]
    note = f"no validation record was given: the last {100 * HELD_OUT:.0f} % of each record was kept out of the fit"
    return tuple(p[0] for p in pairs), tuple(p[1] for p in pairs), [note]


def beyond_training(model: Model, training: Sequence[Experiment], validation: Sequence[Experiment]) -> list[str]:
    """Notes on commands and positions that validation records take far beyond those of the training records.

    After a whole turn of a joint nothing is new.
    """
    notes, ends = [], {}
    for channel in (*model.input_channels, *(f"{joint}.position" for joint in model.coordinates)):
        if all(channel in record for record in (*training, *validation)):
            ends[channel] = [f([f(record[channel]) for record in training]) for f in (np.min, np.max)]
    for record in validation:
        for channel, (low, high) in ends.items():
            least, most = float(np.min(record[channel])), float(np.max(record[channel]))
            turned = record.unit(channel) == "rad" and high - low > 2.0 * np.pi
            if max(most, high) - min(least, low) > WIDER * (high - low) > 0.0 and not turned:
                reached = f"{short(least)} to {short(most)} {record.unit(channel)}"
                notes.append(
                    f"{record.name}: {channel} runs from {reached}, but in training records from {short(low)} to "
                    f"{short(high)}; train on a record that goes as far, for what acts out there has no name yet"
                )
    return notes


def data_of(
    model: Model,
    training: Sequence[Experiment],
    validation: Sequence[Experiment],
    mode: str,
    cutoff: float | None,
    setup: Setup,
    notes: list[str],
) -> Data:
    """Prepare residual problems of the records with common filters and sample masks, with a note on each."""
    constants = [name for name in model.adjustable if _is_proportional(model, name.partition(".")[0])]

    def balance(
        several: Sequence[Experiment], cut: float | Sequence[float] | None, band: Sequence[float] | float | None = None
    ) -> InverseDynamicsProblem:
        problem = InverseDynamicsProblem(model, several, cutoff=cut, band=band, hold=setup.course)
        return relative_to_drives(model, problem, constants, {})

    fitted = balance(training, cutoff)
    states, bands = filters(model, fitted, cutoff)
    if states != tuple(m.cutoff for m in fitted.motions):
        fitted = balance(training, states, bands)
    # One filter for all validation records: a gap that is measured in another band is another gap.
    predicted = balance(validation, min(states), min(bands))
    for problem in (fitted, predicted):
        problem.take_long_steps()
        for number, (record, m) in enumerate(zip(problem.experiments, problem.motions, strict=True)):
            still = problem.standstill(number)
            rest = f"; {100 * still:.0f} % at standstill left out of the residual" if still > 0.0 else ""
            notes.append(f"{record.name}: motion filtered at {m.cutoff:.4g} Hz, compared up to {m.band:.3g} Hz{rest}")
    notes.append(f"validation records simulated in mode {mode}")
    return Data(fitted, predicted, OutputErrorProblem(model, validation, mode, setup=setup))


def _is_proportional(model: Model, name: str) -> bool:
    """Whether a prepared drive gives an effort in proportion to a constant, which may grow with all masses."""
    return name in model.actuators and model.actuator_type(name) in {"ideal", "dc_motor"}


def nominal_of(model: Model, data: Data, notes: list[str]) -> Judged:
    """Prepare the nominal model: it is judged by the residual alone if it cannot simulate the records."""
    nominal, stopped = judged_anyhow(model, (), data, {})
    if stopped:
        notes.append(f"the nominal model could not simulate the validation records: {stopped}")
    return nominal


def recalibrated_of(
    model: Model, data: Data, notes: list[str], each: ParallelCandidates, ranked: Model | None = None
) -> Judged:
    """Prepare the recalibrated model: uncertain parameters fitted, judged by the residual if it cannot simulate.

    What the residual does not show, such as a spring behind which no drive acts, has its value in the ``ranked`` model.
    Bodies of which that has all values of the file are held: a ranking found that they carry a load.
    """
    held_bodies = set() if ranked is None else _untouched(model, ranked)
    free = tuple(name for name in model.adjustable if name.partition(".")[0] not in held_bodies)
    if not free:
        notes.append("the model file gives no parameter an uncertainty, so none was recalibrated")
    transitions = _transitions(model, data.training)
    bounds = {**_within_reach(model, free), **transitions}
    # This fit has all cores for its records; candidates share them from here on.
    alone = replace(data, training=data.training.side_by_side(worker_count(each.workers)))
    recalibrated, stopped = judged_anyhow(model, (*free, *transitions), alone, bounds)
    unseen = {name for one in recalibrated.fit.unseen for name in one.names}
    if ranked is not None and unseen:
        start = with_ranked(recalibrated.model, ranked, unseen)
        recalibrated, stopped = judged_anyhow(start, (*free, *transitions), alone, bounds)
    rest = free
    while ranked is not None and (held := _as_stated(model, ranked, _far(model, recalibrated))):
        # Once these are held, others may go as far in their place.
        start, rest = with_ranked(recalibrated.model, ranked, held), tuple(name for name in rest if name not in held)
        recalibrated, stopped = judged_anyhow(start, (*rest, *transitions), alone, bounds)
    if stopped:
        notes.append(f"the recalibrated model could not simulate the validation records: {stopped}")
    fit, units = recalibrated.fit, [model.parameters[name].unit for name in recalibrated.fit.names]
    blind = {name for one in fit.unseen for name in one.names}
    blocks = data.training.blocks
    notes.extend(changed_between(fit.names, fit.values, fit.residual, fit.jacobian, blocks, units, blind, Checks()))
    return recalibrated


def _untouched(model: Model, ranked: Model) -> set[str]:
    """Bodies of a prepared model that a ranking left as the file states them."""
    moved = {name.partition(".")[0] for name in model.adjustable if ranked.parameters[name] != model.parameters[name]}
    return set(model.bodies) - moved


def moved_by_observer(model: Model, ranked: Model, final: Judged) -> list[str]:
    """Notes on parameters that the prepared residual does not show, and an observer finds far from the model file."""
    notes, unseen = [], {name for one in final.fit.unseen for name in one.names}
    for name in sorted(unseen.intersection(model.adjustable)):
        file, found = model.parameters[name], ranked.parameters[name].value
        if (times := abs(found - file.value) / stated(file)) > FAR:
            notes.append(
                f"an observer moved {name} from {short(file.value)} to {_with_unit(found, file)}, {times:.1f} times "
                "its stated uncertainty: question the file, or look for what it lacks there"
            )
    return notes


def is_as_stated(model: Model, ranked: Model | None, name: str) -> bool:
    """Whether an observer, in a ranking, finds a parameter where the prepared model's file has it.

    Noise of an encoder that a controller answers to moves efforts along with rates: damping to the residual, but not to
    the observer.
    """
    found = None if ranked is None else ranked.parameters.get(name)
    file = model.parameters[name]
    return found is not None and abs(found.value - file.value) <= FAR * stated(file)


def _as_stated(model: Model, ranked: Model, names: Collection[str]) -> dict[str, float]:
    """Prepared values of a ranking's observer, of parameters that it finds as the model file states them."""
    return {name: ranked.parameters[name].value for name in names if is_as_stated(model, ranked, name)}


def begun_anywhere(model: Model, data: Data, recalibrated: Judged, notes: list[str]) -> tuple[Data, Judged]:
    """Prepared data whose records begin where first states are likeliest, if these matter, and the recalibrated model.

    Links may bend where a record begins, also of a machine at rest: the filter of its motion leaves nothing of a jump
    of the first command. What rings from there for the whole of a record is no missing effect.
    """
    first, fit = data.training, recalibrated.fit
    if not np.any(first.open_states(model)[0]):
        return data, recalibrated
    if not matters(recalibrated.model, first, fit.residual, fit.jacobian, Checks()):
        return data, recalibrated
    start = recalibrated.model
    for _ in range(ROUNDS):
        data = replace(
            data, training=begun_likeliest(start, data.training), validation=begun_likeliest(start, data.validation)
        )
        recalibrated, _ = judged_anyhow(start, recalibrated.free, data, dict(recalibrated.bounds))
        known, moved = recalibrated.fit.std, np.abs(recalibrated.model.theta - start.theta)
        start = recalibrated.model
        if np.all(moved[[model.index(name) for name in recalibrated.free]] <= known):
            break
    notes.append("links bend or move where records begin: their first states are unknown, and sought in each record")
    return data, recalibrated


def with_ranked(recalibrated: Model, ranked: Model, names: Collection[str]) -> Model:
    """Prepared model with some values as in the ranked one, and other moments of the same bodies.

    Moments of two fits may be those of no body: of a thin rod both have to be as large, and none exceeds the sum of the
    others.
    """
    bodies = {f"{name.rpartition('.inertia.')[0]}.inertia." for name in names if ".inertia." in name}
    moments = {name for name in recalibrated.parameters if name.startswith(tuple(bodies))}
    return recalibrated.with_parameters({name: ranked.parameters[name].value for name in {*names, *moments}})


def _transitions(model: Model, data: InverseDynamicsProblem) -> dict[str, tuple[float, float]]:
    """Prepared transition velocities of dry friction to recalibrate, with bounds from data.

    Nobody knows them beforehand, and a wrong one leaves an error at every reversal, where small effects show.
    """
    found = {}
    for effect in model.effects:
        name = effect.parameter_names.get("transition_velocity")
        dry = effect.type.sticks and not effect.type.close_to_rest
        if dry and name is not None and effect.at in (*data.joints, *model.transmissions):
            found[name] = slow_speeds(data, shares_at(model, effect.at, data.joints))
        elif dry and name is not None and effect.at in model.actuators:
            found[name] = _speeds_of_seals(model, effect.at, data)
    for drive in model.actuators:  # seals rub as joints do
        name = f"{drive}.friction.transition_velocity"
        if name in model.parameters and f"{drive}.friction.coulomb" in model.parameters:
            found[name] = _speeds_of_seals(model, drive, data)
    return found


def _speeds_of_seals(model: Model, drive: str, data: InverseDynamicsProblem) -> tuple[float, float]:
    """Prepared bounds of the transition velocity of a drive's own friction, see `slow_speeds`."""
    if (line := model.line_of_actuator(drive)) is None:
        return slow_speeds(data, shares_at(model, model.joint_of_actuator(drive), data.joints))
    states = [data.state(record) for record in range(len(data.motions))]
    return slow_share([line_rates(model, line, data.joints, *state[:2]) for state in states])


def _within_reach(model: Model, free: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Prepared bounds for positive nonlinear parameters, from their stated uncertainties.

    With something large missing, a fit may end where nothing shows any more, such as oil as soft as air. No effect
    leads back from there. What is linear comes back by itself.
    """
    found = {}
    for name in free:
        parameter = model.parameters[name]
        value, spread = parameter.value, parameter.uncertainty or np.inf
        if parameter.kind != "linear" and value > 0.0 <= parameter.minimum and np.isfinite(spread):
            factor = float(np.exp(REACH * spread / value))
            found[name] = max(parameter.minimum, value / factor), min(parameter.maximum, value * factor)
    return found


def filters(
    model: Model, training: InverseDynamicsProblem, cutoff: float | None
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Cut-off frequency of the motion filter and highest compared frequency of each record, Hz.

    - ``model``: flexible links and drives with states respond to the whole motion, and noise rings in them. For
      these, and where ``cutoff`` is given, the band is that of the motion filter
    - ``training``: with the cut-off frequencies that suit each record
    """
    own = tuple(m.cutoff for m in training.motions)
    bands = tuple(UNDISTORTED_BAND * one for one in own)
    if cutoff is not None or not answers_at_once(model):
        return own, bands
    pairs = zip(training.experiments, training.motions, strict=True)
    highest = (quickest(record, m, training.joints) for record, m in pairs)
    return tuple(max(one, min(QUICKER * one, most)) for one, most in zip(own, highest, strict=True)), bands


def quickest(record: Experiment, m: Motion, joints: Sequence[str]) -> float:
    """Highest cut-off frequency of a motion filter at which velocity noise does not look like motion, Hz.

    White noise of the position with deviation ``s`` at the rate ``r`` has the density ``2 s^2 / r``; its derivative
    below ``f`` the mean square ``(2 pi)^2 (2 s^2 / r) f^3 / 3``. Two deviations are to stay below the speed under which
    a joint counts as standing.
    """
    found = HIGHEST * record.rate
    for joint in joints:
        channel = f"{joint}.position"
        read, retained = [record.read_rate(channel)], [record.retained.get(channel, np.inf)]
        noise = choose_cutoff(record[channel][:, None], record.rate, read, retained).noise[0]
        speed = np.abs(m.velocity[m.kept, m.joints.index(joint)])
        least = 0.5 * STANDSTILL_SHARE * float(np.quantile(speed, 0.999))
        if noise > 0.0:
            found = min(found, float(np.cbrt(3.0 * record.rate * least**2 / (8.0 * np.pi**2 * noise**2))))
    return found


def moved_far(model: Model, final: Judged) -> list[str]:
    """Notes on parameters that calibration moved far from their prior, alone or together, or to a border."""
    notes = [
        f"calibration moved {name} from {short(model.parameters[name].value)} to "
        f"{_with_unit(final.model.parameters[name].value, model.parameters[name])}, "
        f"{times:.1f} times its stated uncertainty"
        for name, times in ruled_out(model, final).items()
    ]
    if together := ruled_out_together(model, final):
        notes.append(
            f"the records show {', '.join(together)} only together with others; no values that explain them "
            f"lie nearer to the model file than {max(together.values()):.1f} times the stated uncertainty: question "
            "the file, or look for what it lacks there, such as a load"
        )
    known = [names for names, _ in on_the_border(model, final.free)]
    found = on_the_border(final.model, final.free)
    return notes + [f"calibration stopped at {sentence}" for names, sentence in found if names not in known]


def _with_unit(value: float, parameter: Parameter) -> str:
    """Value in words of a note, with the unit of a prepared parameter; a ratio has none."""
    return short(value) if parameter.unit == "1" else f"{short(value)} {parameter.unit}"


def _far(model: Model, recalibrated: Judged) -> set[str]:
    """Parameters that a recalibration moved far from their prior, alone or together."""
    return {*ruled_out(model, recalibrated), *ruled_out_together(model, recalibrated)}


def ruled_out(model: Model, recalibrated: Judged) -> dict[str, float]:
    """Stated uncertainties by which a recalibration clearly moved parameters far from their prior."""
    found = {}
    for name, std in zip(recalibrated.free, recalibrated.fit.std, strict=True):
        if (before := model.parameters.get(name)) is None:
            continue
        away, spread = abs(recalibrated.model.parameters[name].value - before.value), stated(before)
        if away - NORMAL_95 * float(std) > FAR * spread:
            found[name] = away / spread
    return found


def ruled_out_together(model: Model, recalibrated: Judged) -> dict[str, float]:
    """Stated uncertainties by which all values of parameters that explain the records are far from their prior.

    Records may show parameters only together, and no one of them for sure: a load that was taken along is spread over
    mass, centre and inertia of what carries it.
    """
    return {name: away for name, away in _least_departures(model, recalibrated).items() if away > FAR}


def _least_departures(model: Model, recalibrated: Judged) -> dict[str, float]:
    """Prior departures, in stated uncertainties, of parameters in unidentifiable combinations.

    Values anywhere along these combinations explain the records as well. Those count whose squared departures have the
    least sum: of Gaussian priors the most probable. Of parameters of an effect that was named the model file states
    nothing, so that they move along at no cost.
    """
    parts = [dict(zip(one.names, one.weights, strict=True)) for one in recalibrated.fit.unseen]
    names = [name for name in recalibrated.free if name in model.parameters and any(name in part for part in parts)]
    if not names:
        return {}
    spreads = np.array([stated(model.parameters[name]) for name in names])
    moved = [recalibrated.model.parameters[name].value - model.parameters[name].value for name in names]
    along = np.array([[part.get(name, 0.0) for part in parts] for name in names]) / spreads[:, None]
    away = np.array(moved) / spreads
    away -= along @ np.linalg.lstsq(along, away, rcond=None)[0]
    return dict(sorted(zip(names, map(float, np.abs(away)), strict=True), key=lambda item: -item[1]))


def stated(parameter: Parameter) -> float:
    """Prior deviation of a parameter as the model file states it; infinite if nothing is stated."""
    return parameter.uncertainty or float("inf")
