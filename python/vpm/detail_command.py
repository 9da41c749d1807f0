"""Command line of detail and its cost: ``vpm climb``, ``simplify``, ``budget`` and ``compile``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vpm.command import (
    Channels,
    Integrator,
    Interpolate,
    Logs,
    ModelPath,
    Plot,
    console,
    fillable,
    load_all,
    load_model,
    load_pair,
    progress,
    save_plot,
    writable,
)
from vpm.errors import VpmError
from vpm.manner import give, note, wrote

if TYPE_CHECKING:
    from vpm.realtime import Fmu

Share = Annotated[float, typer.Option(help="Share of the period that a step may take at its 99.9 % quantile.")]


def add_to(app: typer.Typer) -> None:
    """Add the commands."""
    app.command(epilog="Example:  vpm climb model.toml log.csv --validate other.csv --plot climb.png")(climb)
    app.command(epilog="Example:  vpm simplify model.toml log.csv --rate 1000 --tolerance 0.05")(simplify)
    app.command(epilog="Example:  vpm budget examples/emps/model.toml --rate 1000")(budget)
    app.command("compile", epilog="Example:  vpm compile examples/emps/model.toml --rate 1000 --out axis.json")(
        compile_
    )


def climb(
    model: ModelPath,
    log: Logs,
    validate: Annotated[list[Path], typer.Option(help="Record to judge on, which the fit does not see; repeatable.")],
    channels: Channels = None,
    interpolate: Interpolate = False,
    mode: Annotated[str | None, typer.Option(help="Mode of simulation; by default closed loop or restarts.")] = None,
    compare: Annotated[list[str] | None, typer.Option(help="Channel that counts; all measured by default.")] = None,
    integrator: Integrator = "auto",
    settling: Annotated[float, typer.Option(help="Time at the beginning of each record that does not count, s.")] = 0.0,
    out: Annotated[
        Path | None, typer.Option(callback=writable, help="Write the model of the chosen level to this file.")
    ] = None,
    plot: Plot = None,
) -> None:
    """Identify a model level by level, as far up in detail as validation records say that it pays."""
    from vpm.climb import climb as find_level
    from vpm.simulate import Setup

    machine, records = load_all(model, log, channels, interpolate)
    validation = load_all(model, validate, channels, interpolate)[1]
    with progress() as tell:
        found = find_level(
            machine,
            records,
            validate=validation,
            mode=mode,
            channels=compare,
            setup=Setup(integrator, settling=settling),
            tell=tell,
        )
    give(climb=found)
    console.print(str(found), markup=False)
    save_plot(found.plot, plot)
    if out is not None:
        wrote(found.model.save(out))


def simplify(
    model: ModelPath,
    logs: Logs,
    rate: Annotated[float, typer.Option(help="Rate of the controller, Hz.")] = 1000.0,
    tolerance: Annotated[float, typer.Option(help="Largest loss of accuracy, as a share of the signal.")] = 0.02,
    share: Share = 0.2,
    validate: Annotated[list[Path] | None, typer.Option(help="Log to judge on; those of the fit by default.")] = None,
    against: Annotated[str, typer.Option(help="The reference: data, or the full model itself.")] = "data",
    mode: Annotated[str | None, typer.Option(help="Mode of simulation to judge in.")] = None,
    compare: Annotated[list[str] | None, typer.Option(help="Channel to judge; all by default.")] = None,
    level: Annotated[
        str | None, typer.Option(help='Level of the flexible links to begin at, "elements(20)"; that of the file.')
    ] = None,
    channels: Channels = None,
    interpolate: Interpolate = False,
    plot: Plot = None,
    out: Annotated[Path | None, typer.Option(callback=writable, help="Write the simplified model (TOML) here.")] = None,
) -> None:
    """Find the cheapest model that still tells the truth within a tolerance; exit code 1 if it misses the period."""
    from vpm.simplify import simplify as find_cheapest

    machine, records = load_all(model, logs, channels, interpolate)
    validation = load_all(model, validate, channels, interpolate)[1] if validate else None
    machine = machine if level is None else machine.at(level)
    with progress() as tell:
        ladder = find_cheapest(
            machine,
            records,
            rate=rate,
            tolerance=tolerance,
            share=share,
            validate=validation,
            against=against,
            mode=mode,
            channels=compare,
            tell=tell,
        )
    give(ladder=ladder)
    console.print(str(ladder), markup=False)
    console.print(str(ladder.budget), markup=False)
    save_plot(ladder.plot, plot)
    if out is not None:
        wrote(ladder.model.save(out))
    if not ladder.holds:
        raise typer.Exit(1)


def budget(
    model: ModelPath,
    rate: Annotated[float, typer.Option(help="Rate of the controller, Hz.")] = 1000.0,
    share: Share = 0.2,
    steps: Annotated[int, typer.Option(help="Number of steps to time.")] = 1_000_000,
    integrator: Integrator = "auto",
    substeps: Annotated[int, typer.Option(help="Integration steps in a period.")] = 1,
    log: Annotated[
        Path | None, typer.Option(help="Record whose commands drive the model; by default a sum of sines.")
    ] = None,
    latency: Annotated[
        float, typer.Option(help="Time to watch how late an idle loop at this rate wakes up, s; 0 for not at all.")
    ] = 2.0,
    instructions: Annotated[
        bool, typer.Option("--instructions", help="Count them with valgrind: a minute more.")
    ] = False,
    priority: Annotated[
        int | None, typer.Option(help="Time before all ordinary threads, at this priority of SCHED_FIFO, if permitted.")
    ] = None,
    direct: Annotated[
        bool, typer.Option("--direct", help="Time direct evaluation in the place of machine code.")
    ] = False,
    plot: Plot = None,
) -> None:
    """Time one step of the model against a controller's period; exit code 1 if it does not fit."""
    from vpm.budget import budget as time_steps

    machine, record = (load_model(model), None) if log is None else load_pair(model, log, None, False)
    with progress() as tell:
        report = time_steps(
            machine,
            rate=rate,
            share=share,
            steps=steps,
            integrator=integrator,
            substeps=substeps,
            experiment=record,
            latency=latency,
            instructions=instructions,
            priority=priority,
            compiled=not direct,
            tell=tell,
        )
    give(budget=report)
    console.print(str(report), markup=False)
    save_plot(report.plot, plot)
    if not report.holds:
        raise typer.Exit(1)


def compile_(
    model: ModelPath,
    rate: Annotated[float, typer.Option(help="Samples per second, Hz.")] = 1000.0,
    out: Annotated[Path, typer.Option(help="Write the compiled model to this file.")] = Path("compiled.json"),
    integrator: Integrator = "auto",
    substeps: Annotated[int, typer.Option(help="Integration steps in a period.")] = 1,
    c: Annotated[
        Path | None,
        typer.Option(
            "--c", callback=fillable, help="Write the equations as C99 into this folder instead, for any rate."
        ),
    ] = None,
    fmu: Annotated[
        Path | None, typer.Option(callback=writable, help="Write an FMU of FMI 3.0 to this file instead.")
    ] = None,
    name: Annotated[str | None, typer.Option(help="With --c or --fmu: what files, and names in C, begin with.")] = None,
    parameter: Annotated[
        list[str] | None,
        typer.Option(help="With --c or --fmu: parameter that can be given other values, as *.mass; repeatable."),
    ] = None,
) -> None:
    """Compile a model into one file with all that a step needs, for controllers in C and C++; into C99; or an FMU."""
    from vpm.realtime import c_source, compile_model, write_fmu

    if c is not None and fmu is not None:
        raise VpmError("--c and --fmu write different files; give one of them at a time")
    if fmu is not None:
        _tell_fmu(
            write_fmu(
                load_model(model),
                fmu,
                rate=rate,
                integrator=integrator,
                substeps=substeps,
                parameters=parameter or (),
                name=name,
            )
        )
        return
    if c is not None:
        written = c_source(load_model(model), name=name, parameters=parameter or ())
        wrote(*written.save(c))
        give(name=written.name, parameters=written.parameters)
        console.print(f"free are {', '.join(written.parameters) or 'no parameters'}", markup=False)
        return
    writable(out)
    compiled = compile_model(load_model(model), rate, integrator=integrator, substeps=substeps)
    compiled.save(out)
    wrote(out)
    give(name=compiled.name, inputs=compiled.inputs, outputs=compiled.outputs)
    console.print(f"takes {', '.join(compiled.inputs)}; shows {', '.join(compiled.outputs)}", markup=False)


def _tell_fmu(written: Fmu) -> None:
    """Say what an FMU takes and shows, and what it does otherwise than a simulation."""
    wrote(written.path)
    give(name=written.identifier, inputs=written.inputs, outputs=written.outputs, parameters=written.parameters)
    library = f"sources and a library for {written.platform}" if written.platform else "sources"
    console.print(f"{library}, steps of {written.step:g} s by {written.integrator}", markup=False)
    for what, names in (("takes", written.inputs), ("shows", written.outputs), ("free are", written.parameters)):
        console.print(f"  {what} {', '.join(names) or 'nothing'}", markup=False)
    for text in written.notes:
        note(text)
