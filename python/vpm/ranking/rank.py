"""Rank the effects that a model is most probably missing, by one criterion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from vpm.discrepancy.parallel_candidates import ParallelCandidates, Progress
from vpm.discrepancy.screening.candidates import asked_for
from vpm.discrepancy.stuck_channels import check_moving
from vpm.discrepancy.unknown_zeros import with_unknown_zeros
from vpm.errors import DiagnosisError
from vpm.experiment import Experiment, as_records, derived_channels, joints_from_sensors, without_derived
from vpm.model import Model
from vpm.one_thread import in_one_thread
from vpm.ranking.ranking_search import Search
from vpm.ranking.result import Ranking
from vpm.ranking.settings import Settings
from vpm.simulate import Setup, with_running_lengths

#: Said of channels that are not compared.
COMPUTED = "{channel} repeats the noise of {source}, from which it was computed: it tells nothing more"


@in_one_thread
def rank(
    model: Model,
    experiments: Experiment | Sequence[Experiment],
    validate: Experiment | Sequence[Experiment] | None = None,
    *,
    effects: Sequence[str] | None = None,
    settings: Settings | None = None,
    setup: Setup | None = None,
    workers: int | None = None,
    tell: Callable[[str], None] | None = None,
    progress: Progress | None = None,
) -> Ranking:
    """Rank what ``model`` could be missing by the error that it removes; add the best effect as long as it counts.

    A slow tracker keeps every structure, the model with some effects, on the records. The structure is fitted to the
    error that this leaves of two thirds of each record. What decides is the error power that an effect removes, there
    and from the third that is held back. Nothing is inverted or differentiated, and neither the controller nor a start
    at rest is asked for.

    Parameters
    ----------
    model : Model
        Its uncertain parameters are fitted with every structure.
    experiments : Experiment or sequence of Experiment
        Positions of joints, or of as many independent transmissions, and commands of actuators.
    validate : Experiment or sequence of Experiment, optional
        Records that nothing is fitted to. They refute an effect that adds as much to their error power as it had to
        remove elsewhere, `Settings.worth`; `Ranking.gaps` is measured on them, once, when all is found.
    effects : sequence of str, optional
        Restrict the catalogue to these names.
    settings : Settings, optional
        The numbers that decide.
    setup : Setup, optional
        Integrator and hold. Where the hold is ``auto``, commands are held, as those of a digital controller are. They
        run on between samples, straight or as a cubic, if that counts as an effect would.
    workers : int, optional
        Structures that are fitted at a time; one per core if not given. The result does not depend on it.
    tell, progress : callable, optional
        Called with a sentence for every round, and after every structure with what is being done, its name, how many
        are done and how many there are.

    Returns
    -------
    Ranking
        Ctrl-C after the first fit gives what is known until then, with ``interrupted``; earlier it raises.

    Raises
    ------
    DiagnosisError
        No record was given, none shows any motion, or an effect is asked for that the catalogue does not have.
    VpmError
        A channel is missing, or the model runs away from the records.

    Examples
    --------
    >>> rank(model, log).effects
    (Ranked(effect='coulomb_friction', site='axis', judgement=Judgement(removed=0.97)),)
    """
    fitted, others = as_records(experiments), as_records(() if validate is None else validate)
    if not fitted:
        raise DiagnosisError("no record was given; pass at least one experiment")
    several, setup = with_running_lengths(model, [*fitted, *others], setup or Setup())
    records = [joints_from_sensors(record, model, free=model.adjustable) for record in several[: len(fitted)]]
    unseen = [joints_from_sensors(record, model) for record in several[len(fitted) :]]
    check_moving(model, records)
    model, zeros = with_unknown_zeros(model, records)
    derived = derived_channels(records)
    records, unseen = without_derived(records, derived), without_derived(unseen, derived)
    each = ParallelCandidates(workers, progress)
    names = asked_for(effects)
    search = Search(model, records, names, settings or Settings(), setup, each, tell or (lambda _: None), unseen)
    ranking = search.run()
    told = [COMPUTED.format(channel=channel, source=source) for channel, source in derived.items()]
    return replace(ranking, notes=(*zeros, *told, *ranking.notes))
