"""Diagnosing what a model is missing: recalibrate it, name effects, judge them, and describe the rest."""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from math import inf, isfinite
from typing import Any, TypedDict
from warnings import warn

from vpm.catalogue import EFFECTS
from vpm.discrepancy.diagnosis import ChannelGap, Diagnosis
from vpm.discrepancy.diagnosis_fields import (
    deviations,
    examined,
    fit_beside,
    gaps_of,
    of_findings,
    pictures,
    so_far,
    traces,
    unmeasured,
    where,
)
from vpm.discrepancy.evidence import gather
from vpm.discrepancy.findings import Findings
from vpm.discrepancy.judged_model import Data, Judged
from vpm.discrepancy.noise.sensor_drift import Drift, sensor_drifts, without_drifts
from vpm.discrepancy.parallel_candidates import ParallelCandidates, Progress
from vpm.discrepancy.preparation import (
    Records,
    begun_anywhere,
    beyond_training,
    data_of,
    moved_by_observer,
    moved_far,
    nominal_of,
    recalibrated_of,
    records_of,
)
from vpm.discrepancy.provenance import own_settings, provenance
from vpm.discrepancy.ranked_effects import NoResidualError, tracker_gaps
from vpm.discrepancy.remainder.empirical_formula import beside
from vpm.discrepancy.remainder.remainder import Remainder, remainder
from vpm.discrepancy.rivals.ambiguity import Rivals
from vpm.discrepancy.rivals.discriminating_experiment import experiments as experiments_for
from vpm.discrepancy.screening.candidates import asked_for
from vpm.discrepancy.settings import FLOOR_FACTOR
from vpm.discrepancy.unknown_zeros import with_unknown_zeros
from vpm.discrepancy.verdict import (
    is_negligible,
    only_if_open,
    only_where_closed,
    open_readings,
    verdict,
    without_effects,
)
from vpm.experiment import Experiment, as_records
from vpm.experiment.lengths import lines_that_tell
from vpm.experiment.signal import check_cutoff
from vpm.identify.parallel import worker_count
from vpm.log_check import refuse_mistakes
from vpm.log_check.checking import UNCHECKED
from vpm.model import Model
from vpm.naming import BROKEN, FAILED, STOPPED, Request, Tell, named, ranked_notes, ranking_of, until_stopped
from vpm.observer import measured_outputs
from vpm.one_thread import in_one_thread
from vpm.ranking import Ranking, Settings
from vpm.ranking.by_tracker import deviations_by_tracker, diagnosed_by_tracker
from vpm.ranking.substitute_records import why_unbalanced
from vpm.simulate import Setup, judging_mode, with_running_lengths
from vpm.simulate.setup import READ_BACK
from vpm.tasks import done_by

#: Most effects to accept, if not given, of a machine with one joint; each further one may lack two frictions.
LEAST_LIMIT = 6
#: Said where Ctrl-C came after the naming.
STOPPED_UNMEASURED = "stopped by Ctrl-C before what was named was measured on validation records"
STOPPED_UNJUDGED = "stopped by Ctrl-C before the noise floor, and what is left above it, was examined"
STOPPED_BARE = "stopped by Ctrl-C before all pictures were drawn, and experiments that discriminate were designed"
STOPPED_LATE = "stopped by Ctrl-C before what is left, and what else would do, was examined"
#: Said where a cut-off frequency was asked for and no motion is filtered.
UNFILTERED = "the cut-off frequency is not used, for an observer filters nothing"
#: Said where something stays unexplained, of readings whose errors no candidate describes.
NO_SENSOR = "no offset, gain or delay of {channels} was tried: describe a sensor of them in the model file to try these"
#: Said of described sensors of lengths: the joints that follow from them are compared in their place.
NO_LENGTH = (
    "no offset, gain or delay of {sensor} was tried, for {joint}.position follows from what it reads: describe a "
    "sensor of that position in its place"
)
#: Said where a drive is named late whose joint is read by no described sensor.
LATE_READINGS = (
    " A late reading of {channels} would look alike, and was not tried: the model file describes no sensor of it."
)
#: What is odd in a channel and may pass for an effect.
NOTED = ("delay", "frozen", "clipped", "spikes")


class Asked(TypedDict, total=False):
    """Arguments of `diagnose` that hold for many diagnoses, without model and records."""

    effects: Sequence[str] | None
    cutoff: float | None
    setup: Setup | None
    limit: int | None
    check: bool


def diagnose(
    model: Model,
    experiments: Experiment | Sequence[Experiment],
    validate: Experiment | Sequence[Experiment] | None = None,
    *,
    effects: Sequence[str] | None = None,
    cutoff: float | None = None,
    setup: Setup | None = None,
    limit: int | None = None,
    names: str | None = None,
    check: bool = True,
    workers: int | None = None,
    tell: Tell | None = None,
    progress: Progress | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
) -> Diagnosis:
    """Name the physics that ``model`` is missing, with evidence on data that were not fitted.

    Logs with a wrong unit, sign, name or clock are refused, see `vpm.check_log`. The parameters that the model file
    calls uncertain are fitted first, for a wrong parameter is not a missing effect. A ranking of the training records
    then names what is missing, see `vpm.rank`; validation records decide no name. What was named is refitted and
    measured on these, by the inverse-dynamics residual and in simulation. Where no efforts follow from a motion, with
    closed loops or drives that go by their own samples, it is what the ranking's observer leaves of them.

    Parameters
    ----------
    model : Model
        The nominal model. Parameters with an uncertainty may be recalibrated.
    experiments : Experiment or sequence of Experiment
        Records to fit: position of every joint, or of as many independent transmissions, and command of every
        actuator.
    validate : Experiment or sequence of Experiment, optional
        Records that are never fitted. Without them the last 30 % of each record is kept out.
    effects : sequence of str, optional
        Restrict the catalogue to these names.
    cutoff : float, optional
        Cut-off frequency of the motion filter, Hz; chosen from each record if not given.
    setup : Setup, optional
        Integrator, substeps and horizon of the simulations.
    limit : int, optional
        Most effects to accept; six, and two for each joint but the first, if not given.
    names : str, optional
        Without effect, to be removed: a ranking names.
    check : bool
        Refuse logs with a mistake that no machine makes by itself.
    workers : int, optional
        Candidates that are worked on at a time; one per core if not given. The result does not depend on it.
    tell : callable, optional
        Called with a sentence at every step and for every candidate that was refitted, from several threads; an
        exception raised there ends the diagnosis.
    progress : callable, optional
        Called after every candidate with what is being done, its name, how many are done, and how many there are.
    executor : Executor or callable, optional
        Does the diagnosis as one task, see `vpm.tasks.Tasks`; `vpm.diagnose_many` gives it many. ``tell`` and
        ``progress`` hear of it when it is done, ``workers`` is one if not given.

    Returns
    -------
    Diagnosis
        Ctrl-C gives what is known until then, with ``interrupted``.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C while logs were checked, before anything was known.
    DiagnosisError
        No record was given, or an effect name is unknown.
    ExperimentError
        A channel is missing, or a log cannot be trusted.
    ExecutorError
        The executor does not take the diagnosis, or its worker died with it again and again.
    """
    if names is not None:
        warn("names= has no effect: a ranking names; leave it out", DeprecationWarning, stacklevel=2)
    asked = Asked(effects=effects, cutoff=cutoff, setup=setup, limit=limit, check=check)
    given = (as_records(experiments), as_records(validate or ()))
    check_asked(asked, workers)
    if executor is None:
        diagnosis = diagnosed(model, *given, asked, workers, tell, progress)
    else:
        done = done_by(executor, partial(recorded, diagnosed, model, *given, asked, workers or 1), tell)
        diagnosis = done.repeat(tell, progress)
    return with_provenance(diagnosis, model, *given, asked, workers)


def check_asked(asked: Asked, workers: int | None) -> None:
    """Refuse arguments of `diagnose` that no diagnosis can take.

    Raises
    ------
    DiagnosisError, IdentificationError
        An effect or the number of workers is none.
    """
    asked_for(asked.get("effects"))
    worker_count(workers)


def with_provenance(
    diagnosis: Diagnosis,
    model: Model,
    experiments: Sequence[Experiment],
    validate: Sequence[Experiment],
    asked: Asked,
    workers: int | None,
) -> Diagnosis:
    """Diagnosis with its provenance, as this process knows it; paths may differ where it was computed."""
    usual = {"effects": None, "cutoff": None, "limit": None, "check": True, "workers": None}
    given = {**usual, **asked, "workers": workers}
    settings: dict[str, tuple[object, object]] = {name: (given[name], default) for name, default in usual.items()}
    settings |= own_settings(asked.get("setup") or Setup(), "setup")
    return replace(diagnosis, provenance=provenance(model, experiments, validate, "vpm.diagnose", settings))


@in_one_thread
def diagnosed(
    model: Model,
    experiments: list[Experiment],
    validate: list[Experiment],
    asked: Asked,
    workers: int | None = None,
    tell: Tell | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnosis of `diagnose` without its provenance; a task for an executor."""
    effects, cutoff, limit = asked.get("effects"), asked.get("cutoff"), asked.get("limit")
    begun = asked.get("setup") or Setup()
    several, setup = with_running_lengths(model, [*experiments, *validate], begun)
    experiments, validate = several[: len(experiments)], several[len(experiments) :]
    records = records_of(model, experiments, validate)
    if cutoff is not None:
        for record in chain(*records[:2]):
            check_cutoff(cutoff, record.rate, len(record.time))
    each = ParallelCandidates(workers, progress)
    odd: list[str] = []
    if asked.get("check", True):
        logs = [*experiments, *validate]
        try:
            if tell is not None:
                tell("checking the channels of the logs")
            found = refuse_mistakes(model, logs, setup=setup, workers=workers, progress=progress)
        except KeyboardInterrupt as stop:
            # Also where Ctrl-C came before the first record was looked at.
            raise KeyboardInterrupt(*(stop.args or (UNCHECKED.format(record=logs[0].name),))) from None
        odd = [str(one) for one in found if one.kind in NOTED]
    most = LEAST_LIMIT + 2 * (len(model.joints) - 1) if limit is None else limit
    model, zeros = with_unknown_zeros(model, records[0])
    request = Request(effects, most, tell or (lambda _: None), each)
    diagnosis = _diagnosis(model, records, request, cutoff, setup)
    bare = _without_sensor(model, records[0])
    untried = (
        bare if diagnosis.verdict == "unexplained" else [one for one in open_readings(diagnosis.gap) if one in bare]
    )
    blind = [NO_SENSOR.format(channels=", ".join(untried))] if untried else []
    blind += _of_lengths(model, experiments)
    summary = diagnosis.summary + _or_late_readings(model, diagnosis, bare)
    far = beyond_training(model, *records[:2]) if validate else []
    return replace(diagnosis, summary=summary, notes=(*odd, *zeros, *far, *diagnosis.notes, *blind))


def _without_sensor(model: Model, records: Sequence[Experiment]) -> list[str]:
    """Logged outputs without a described sensor, whose errors a diagnosis does not try."""
    return sorted(
        {name for record in records for name in measured_outputs(model, record) if model.sensor_of(name) is None}
    )


def _of_lengths(model: Model, records: Sequence[Experiment]) -> list[str]:
    """Notes of a diagnosis on described sensors of lengths that tell joints: their errors are no candidates."""
    lines = {joint: line for record in records for joint, line in lines_that_tell(record, model).items()}
    sensors = {joint: model.sensor_of(f"{line}.length") for joint, line in lines.items()}
    return [NO_LENGTH.format(sensor=sensor, joint=joint) for joint, sensor in sensors.items() if sensor is not None]


def _or_late_readings(model: Model, diagnosis: Diagnosis, bare: Sequence[str]) -> str:
    """Sentence of a diagnosis on readings whose delay would look like that of a drive that it names, or "".

    From commands to readings only the sum of all delays shows. ``bare``: readings without a described sensor.
    """
    late = [one.site for one in diagnosis.effects if EFFECTS[one.name].shifts]
    moved = {joint for drive in late if drive in model.actuators for joint in model.joints_of_actuator(drive)}
    alike = [name for name in bare if name.rpartition(".")[0] in moved]
    return LATE_READINGS.format(channels=" or ".join(alike)) if alike else ""


def _diagnosis(model: Model, records: Records, request: Request, cutoff: float | None, setup: Setup) -> Diagnosis:
    """Diagnosis on checked records; once more without the drifts of sensors where these explain a channel."""
    began = time.perf_counter()
    training, validation, given = records
    drifts = list[Drift]()
    while True:
        fitted, kept = (without_drifts(several, drifts) for several in (training, validation))
        taken = (fitted, kept, [*given, *(drift.sentence for drift in drifts)])
        # A record cut off in the middle of a motion does not say what its controller remembers.
        mode = "restarts" if given else judging_mode(model, kept)
        outcome = _named_and_judged(_Job(model, taken, request, mode, cutoff, setup, may_drift=not drifts))
        if isinstance(outcome, Diagnosis):
            return replace(outcome, seconds=time.perf_counter() - began)
        request.tell("diagnosing again without the drift of sensors")
        drifts = outcome


@dataclass(frozen=True)
class _Job:
    """Diagnosis to be done on records, with or without the drifts of their sensors."""

    model: Model
    records: Records
    request: Request
    mode: str  #: In which records are simulated.
    cutoff: float | None
    setup: Setup
    may_drift: bool  #: Whether drifts of sensors are still in the records.


def _named_and_judged(job: _Job) -> Diagnosis | list[Drift]:
    """Diagnosis that names effects, judges them, and describes the rest; drifts of sensors where it needs them."""
    training, validation, notes = job.records
    ranking = ranking_of(job.model, (training, validation), job.request, job.setup, notes)
    try:
        return _measured(job, ranking)
    except KeyboardInterrupt:
        known = ranking or Ranking((), (), job.model, job.model)
        told = ranked_notes(known, (), known.interrupted) if ranking is not None else []
        told.append(STOPPED_UNMEASURED if known.effects else STOPPED)
        notes.extend(note for note in dict.fromkeys(told) if note not in notes)
        return unmeasured(job.model, job.records, known, Settings(effects=job.request.limit))


def _measured(job: _Job, ranking: Ranking | None) -> Diagnosis | list[Drift]:
    """Diagnosis from a ranking, measured on validation records."""
    model, request, (training, validation, notes) = job.model, job.request, job.records
    if ranking is not None and ranking.hold != job.setup.course:
        notes.append(READ_BACK.format(hold=ranking.hold))
        job = replace(job, setup=replace(job.setup, hold=ranking.hold))
    if ranking is not None and (reason := why_unbalanced(model, training)):
        return _measured_by_tracker(job, ranking, reason)
    data = data_of(model, training, validation, job.mode, job.cutoff, job.setup, notes)
    request.tell("comparing the nominal model with the data")
    nominal = nominal_of(model, data, notes)
    request.tell("recalibrating the nominal parameters")
    start = None if ranking is None else ranking.recalibrated
    recalibrated = recalibrated_of(model, data, notes, request.each, start)
    begun, recalibrated = begun_anywhere(model, data, recalibrated, notes)
    if begun is not data:
        data, nominal = begun, nominal_of(model, begun, [])
    try:
        found, ambiguous = named(ranking, recalibrated, data, request, notes)
    except NoResidualError as error:
        if ranking is None:
            raise
        return _measured_by_tracker(job, ranking, str(error))
    known = _Known(job, data, nominal, recalibrated, ranking, ambiguous)
    bare = partial(of_findings, model, job.records, recalibrated, found, (data.training, data.validation), ambiguous)
    try:
        return _told(known, found)
    except BROKEN as error:
        notes.append(FAILED.format(what="what follows the naming", error=error))
        return bare()
    except KeyboardInterrupt:
        notes.append(STOPPED_UNJUDGED)
        gap = gaps_of(data, nominal, recalibrated, found.final, {})
        return replace(bare(), verdict="effect_found" if found.accepted else "interrupted", gap=gap, interrupted=True)


def _measured_by_tracker(job: _Job, ranking: Ranking, reason: str) -> Diagnosis:
    """Diagnosis from a ranking, measured by its tracker for a ``reason`` why there is no inverse-dynamics residual."""
    job.request.tell("measuring what was named on validation records")
    job.records[-1].extend([] if job.cutoff is None else [UNFILTERED])
    asked = job.request.effects, job.request.limit
    told = diagnosed_by_tracker(ranking, job.model, job.records, asked, job.setup, reason)
    return replace(told, notes=(*told.notes, *ranked_notes(ranking, told.refused, told.interrupted)))


@dataclass(frozen=True)
class _Known:
    """Intermediate results of `diagnose` once effects are named: models, ranking and rivals."""

    job: _Job
    data: Data
    nominal: Judged
    recalibrated: Judged
    ranking: Ranking | None
    ambiguous: tuple[Rivals, ...]


def _told(known: _Known, found: Findings) -> Diagnosis | list[Drift]:
    """Diagnosis after naming: noise floor, remaining residual, and verdict; or drifts of sensors."""
    data, job = known.data, known.job
    job.request.tell("measuring the noise floor")
    measure = partial(examined, known.nominal, known.recalibrated, data, job.mode, job.setup)
    floor, gap, left = measure(found.final)
    if (kept := only_where_closed(found, data, gap, left)) is not found:
        found, (floor, gap, left) = kept, measure(kept.final)
    beyond = tracker_gaps(known.ranking, data.training.joints, gap) if known.ranking is not None else {}
    if (kept := only_if_open(found, known.recalibrated, gap | beyond)) is not found:
        found, (floor, gap, left), beyond = kept, measure(kept.final), without_effects(beyond)
    rest, stopped = until_stopped(lambda: _rest(known, found, gap), None)
    said = verdict(data, known.nominal, known.recalibrated, found, gap | beyond, left, rest)
    if said[0] == "unexplained" and not found.accepted and job.may_drift:
        pairs = ((data.training, found.final.fit.residual), (data.validation, found.final.validation))
        if drifts := sensor_drifts(found.final.model, pairs, gap, FLOOR_FACTOR):
            return drifts
    job.records[2].extend(moved_far(job.model, found.final))
    if (ranking := known.ranking) is not None:
        observed = ranking.model if found.accepted else ranking.recalibrated
        job.records[2].extend(moved_by_observer(job.model, observed, found.final))
    if stopped:
        job.records[2].append(STOPPED_LATE)
    told, found, final = _concluded(known, found, said, gap, floor, rest)
    interrupted = found.interrupted or stopped
    return _with_pictures(known, found, replace(told, gap=told.gap | beyond, interrupted=interrupted), final, floor)


def _deviations(known: _Known, found: Findings) -> dict[str, float]:
    """Deviations after naming by the residual, and by tracker of what the ranking alone estimated."""
    job, final, told = known.job, found.final.model, deviations(found, known.data.training)
    own = (final.effect(*entry.key, entry.side).parameter_names.values() for entry in found.accepted)
    names = [name for several in own for name in several if not isfinite(told.get(name, inf))]
    if not names or known.ranking is None:
        return told
    tracked = deviations_by_tracker(known.ranking, job.model, job.records, job.setup, names)
    return told | {name: tracked[name] for name in names if name in tracked}


def _concluded(
    known: _Known,
    found: Findings,
    said: tuple[str, str, bool],
    gap: dict[str, ChannelGap],
    floor: dict[str, float],
    rest: Remainder | None,
) -> tuple[Diagnosis, Findings, Judged]:
    """Diagnosis with its verdict, the findings, and its model, perhaps with a formula for the rest."""
    (word, summary, described), data, nominal = said, known.data, known.nominal
    final, empirical = found.final, None
    if described and rest is not None:
        chosen = rest.best if word == "unexplained" else rest.choices[-1]
        final, empirical = chosen.judged, chosen.empirical
        if chosen.base is not found.final:
            found = replace(found, accepted=())
        elif found.accepted:
            empirical, final = beside(found.final, chosen, data)
        gap = gaps_of(data, nominal, known.recalibrated, final, floor)
        summary = f"{summary} {empirical.sentence}"
    records, ambiguous = known.job.records, known.ambiguous if found.accepted else ()
    problems, std = (data.training, data.validation), _deviations(known, found)
    told = of_findings(known.job.model, records, nominal, found, problems, ambiguous, std)
    fit = fit_beside(known.job.model, final, data.training, nominal, found, told.training)
    summary = so_far(found, summary)
    told = replace(told, verdict=word, summary=summary, gap=gap, model=final.model, fit=fit, empirical=empirical)
    return told, found, final


def _with_pictures(
    known: _Known, found: Findings, told: Diagnosis, final: Judged, floor: dict[str, float]
) -> Diagnosis:
    """Result of `diagnose` with its evidence and pictures, as far as Ctrl-C leaves time for them."""
    data, nominal = known.data, known.nominal
    ambiguous = known.ambiguous if found.accepted else ()
    at_motors = [entry.key for entry in found.accepted if entry.side == "motor"]
    more: dict[str, Callable[[], Any]] = {
        "where": lambda: where(known.recalibrated.model, data.validation),
        "pictures": lambda: pictures(data, nominal, known.recalibrated, final),
        "evidence": lambda: gather(found.final.model, at_motors, data.validation, floor),
        "traces": lambda: traces(data, nominal, final),
        "experiments": lambda: experiments_for(found.final, ambiguous, data.training, floor),
    }
    try:
        known.job.request.tell("designing discriminating experiments")
        for field, compute in more.items():
            told = replace(told, **{field: compute()})
    except KeyboardInterrupt:
        told = replace(told, interrupted=True, notes=(*told.notes, STOPPED_BARE))
    return told


def _rest(known: _Known, found: Findings, gap: dict[str, ChannelGap]) -> Remainder | None:
    """Remainder of the residual in `diagnose`, under the effects found; none where all is known."""
    request, data = known.job.request, known.data
    request.tell("examining what is left")
    if not found.accepted and is_negligible(gap):
        return None
    start = found.final if found.interrupted or not found.accepted else known.recalibrated
    workers = worker_count(request.each.workers)
    return remainder(start, found.final, data, workers)


@dataclass(frozen=True)
class RecordedDiagnosis:
    """Diagnosis with its recorded calls of ``tell`` and ``progress``, each in their order."""

    diagnosis: Diagnosis
    sentences: tuple[str, ...]
    steps: tuple[tuple[str, str, int, int], ...]

    def repeat(self, tell: Callable[[str], None] | None, progress: Progress | None) -> Diagnosis:
        """Repeat the recorded calls in this process and return the diagnosis.

        Parameters
        ----------
        tell, progress : callable, optional
        """
        if tell is not None:
            for sentence in self.sentences:
                tell(sentence)
        if progress is not None:
            for step in self.steps:
                progress(*step)
        return self.diagnosis


def recorded(diagnosed: Callable[..., Diagnosis], *given: object) -> RecordedDiagnosis:
    """Diagnose with all calls of ``tell`` and ``progress`` recorded.

    Parameters
    ----------
    diagnosed : callable
        Takes ``tell`` and ``progress`` too.
    *given
        What else it takes.
    """
    sentences: list[str] = []
    steps: list[tuple[str, str, int, int]] = []
    diagnosis = diagnosed(*given, tell=sentences.append, progress=lambda *step: steps.append(step))
    return RecordedDiagnosis(diagnosis, tuple(sentences), tuple(steps))
