"""A fit on records that it never saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from vpm.experiment import Experiment, as_records
from vpm.identify.comparison import comparison
from vpm.identify.fitted import Fit
from vpm.identify.onward import beside_first_states
from vpm.identify.problem import gaps
from vpm.model import Model

Gaps = dict[str, tuple[float, float, str]]


def judged_on(
    fit: Fit, model: Model, experiments: Experiment | Sequence[Experiment], *, cutoff: float | None = None
) -> tuple[Gaps, Gaps]:
    """How far model and unseen records are apart before and after a fit, in the fit's own mode.

    First states that the fit found belong to its own records; here they begin as for any simulation of a log, but for
    those that are known, and for those that nobody measures along a motion: a balance is beside these.

    Parameters
    ----------
    fit : Fit
    model : Model
        As it was before the fit.
    experiments : Experiment or sequence of Experiment
    cutoff : float, optional
        As for the fit.

    Returns
    -------
    before, after : dict
        ``{channel: (root mean square, share of the measured signal, unit)}``.

    Raises
    ------
    DivergedError
        The simulation leaves the finite numbers.
    """
    records = as_records(experiments)
    fitting = fit.fitting and replace(fit.fitting, states=())
    result = []
    for machine in (model, fit.model):
        data = comparison(machine, records, fit.mode, cutoff=cutoff, setup=fit.setup, fitting=fitting)
        data = beside_first_states(machine, data, {})
        result.append(gaps(data, data.evaluate(machine, machine.theta)[0]))
    return result[0], result[1]
