"""Command line of identification: ``vpm identify``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vpm import identify_options as options
from vpm.command import (
    Channels,
    Check,
    Cutoff,
    FoundHold,
    Integrator,
    Interpolate,
    Logs,
    ModelPath,
    Plot,
    console,
    fillable,
    fitting,
    load_all,
    save_plot,
    writable,
)
from vpm.command_output import give, wrote
from vpm.errors import IdentificationError, check_known

if TYPE_CHECKING:
    from vpm.experiment import Experiment
    from vpm.identify import Fit
    from vpm.model import Model
    from vpm.simulate import Setup

EXAMPLES = (
    "Example:  vpm identify examples/emps/model.toml log.csv --free carriage.mass --free axis.friction.viscous\n\n"
    "Example:  vpm identify rig.toml a.csv b.csv --mode free_run --log --noise estimated --starts 12\n\n"
    "Example:  vpm identify rig.toml a.csv --mode free_run --piece 0.5 --loss huber --profile slide.mass\n\n"
    "Example:  vpm identify rig.toml a.csv --mode input_error --horizon 0.02 --validate b.csv --out fitted/"
)


def _place(path: Path | None) -> Path | None:
    return writable(path) if path is not None and path.suffix == ".toml" else fillable(path)


Out = Annotated[
    Path | None,
    typer.Option(
        callback=_place,
        help="Folder for model.toml, parameters.csv, report.md, fit.npz and fit.png; or a .toml: the model.",
    ),
]


def identify(
    model: ModelPath,
    logs: Logs,
    free: options.Free = None,
    fix: options.Fixed = None,
    tie: options.Tie = None,
    mode: options.FitMode = "inverse_dynamics",
    channels: Channels = None,
    interpolate: Interpolate = False,
    cutoff: Cutoff = None,
    integrator: Integrator = "auto",
    hold: FoundHold = "auto",
    substeps: options.Substeps = 1,
    horizon: options.Horizon = 0.25,
    settling: options.Settling = 0.0,
    compare_only: options.Compared = None,
    log: options.Log = False,
    bound: options.Bound = None,
    noise: options.Noise = None,
    noise_level: options.NoiseLevel = None,
    loss: options.Loss = None,
    loss_scale: options.LossScale = 1.345,
    priors: options.Priors = False,
    starts: options.Starts = 1,
    spread: options.Spread = 3.0,
    seed: options.Seed = 0,
    fit_state: options.FitState = None,
    known_state: options.KnownState = None,
    offset: options.Offset = None,
    piece: options.Piece = 0.0,
    continuity: options.Continuity = 10.0,
    evaluations: options.Evaluations = 60,
    profile: options.ProfileOf = None,
    replicates: options.Replicates = 0,
    workers: options.Workers = 0,
    validate: options.Validate = None,
    check: Check = True,
    out: Out = None,
    plot: Plot = None,
) -> None:
    """Fit parameters to one or several logs. Ctrl-C ends a fit and keeps the best until then."""
    from vpm.identify import Fitting
    from vpm.identify import identify as fit_logs
    from vpm.simulate import Setup

    settings = Fitting(
        channels=tuple(compare_only or ()),
        log=log,
        bounds=options.ranges(bound, "--bound", "NAME=LOW:HIGH"),
        noise="given" if noise_level else noise or "spread",
        noise_levels=options.numbers(noise_level, "--noise-level", "CHANNEL=STD"),
        loss=loss or "squares",
        loss_scale=loss_scale,
        priors=priors,
        starts=starts,
        spread=spread,
        states=tuple(fit_state or ()),
        known_states=options.numbers(known_state, "--known-state", "STATE=VALUE"),
        offsets=tuple(offset or ()),
        piece=piece,
        continuity=continuity,
        seed=seed,
        workers=workers,
        most_evaluations=evaluations,
    )
    asked = settings != Fitting(workers=workers, seed=seed) or noise or loss
    machine, records, unseen = load_all(model, logs, channels, interpolate, validate)
    setup = Setup(integrator, substeps, horizon, settling, hold)
    if check:
        _refuse(machine, [*records, *unseen], setup, workers)
    ties = options.names(tie, "--tie", "FOLLOWER=LEADER")
    with fitting(starts) as tell:
        fit = fit_logs(
            machine,
            records,
            _without(machine, free, fix),
            mode=mode,
            cutoff=cutoff,
            setup=setup,
            ties=ties,
            progress=tell,
            fitting=settings if asked else None,
        )
    lines = _told(fit, machine, unseen, cutoff)
    lines += _more(fit, records, profile or [], replicates, seed, cutoff)
    save_plot(fit.plot, plot)
    if out is not None:
        _write(fit, out, lines)


def _refuse(machine: Model, records: list[Experiment], setup: Setup, workers: int) -> None:
    """Refuse logs with a mistake, or in which nothing moves."""
    from vpm.discrepancy.stuck_channels import check_stuck
    from vpm.log_check import refuse_mistakes

    check_stuck(machine, records)
    refuse_mistakes(machine, records, setup=setup, workers=workers or None)


def _told(fit: Fit, machine: Model, unseen: list[Experiment], cutoff: float | None) -> list[str]:
    """Print the values of a fit, and what it leaves of validation records."""
    from vpm.identify import judged_on
    from vpm.identify.export import told, told_unseen

    give(fit=fit)
    lines = told(fit)
    if unseen:
        judged = judged_on(fit, machine, unseen, cutoff=cutoff)
        give(unseen=dict(zip(("before", "after"), judged, strict=True)))
        lines += told_unseen(judged)
    _print(lines)  # at once: intervals may take long, and Ctrl-C then still leaves the values
    return lines


def _more(
    fit: Fit, records: list[Experiment], profile: list[str], replicates: int, seed: int, cutoff: float | None
) -> list[str]:
    """Print intervals by profile and bootstrap, as far as they are asked for."""
    from vpm.identify.export import intervals, told_intervals

    try:
        found = intervals(fit, records, profile, replicates, seed, cutoff)
        give(intervals=found)
        lines = told_intervals(found)
    except KeyboardInterrupt:
        lines = ["stopped by Ctrl-C: no intervals by profile or bootstrap"]
    _print(lines)
    return lines


def _print(lines: list[str]) -> None:
    for line in lines:
        console.print(f"  {line}", markup=False)


def _without(model: Model, free: list[str] | None, fixed: list[str] | None) -> list[str] | None:
    """Names of the free parameters, less those that are to stay."""
    if not fixed:
        return free
    given = free if free is not None else list(model.adjustable)
    check_known(fixed, given, IdentificationError, "--fix:", "is not among the free parameters")
    return [name for name in given if name not in fixed]


def _write(fit: Fit, out: Path, lines: list[str]) -> None:
    """The fitted model alone, or a folder with it and what tells of the fit."""
    from vpm.identify.export import write_fit

    if out.suffix == ".toml":
        fit.model.save(out)
        written = [out]
    else:
        written = write_fit(fit, out, lines)
    wrote(*written)
