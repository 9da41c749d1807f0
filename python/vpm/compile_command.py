"""Command line of compiled models, C sources and FMUs: ``vpm compile``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vpm.command import Integrator, ModelPath, console, fillable, load_model, writable
from vpm.command_output import give, note, wrote
from vpm.errors import VpmError

if TYPE_CHECKING:
    from vpm.realtime import Fmu


EXAMPLES = "Example:  vpm compile examples/emps/model.toml --rate 1000 --out axis.json"


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
        machine = load_model(model)
        written = c_source(machine, name=name, parameters=parameter or ())
        wrote(*written.save(c))
        parts = {"inputs": machine.inputs, "outputs": machine.output_channels, "parameters": written.parameters}
        give(name=written.name, **parts)
        console.print(f"parameters that can be set: {', '.join(written.parameters) or 'none'}", markup=False)
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
    for what, names in (("takes", written.inputs), ("shows", written.outputs)):
        console.print(f"  {what} {', '.join(names) or 'nothing'}", markup=False)
    console.print(f"  parameters that can be set: {', '.join(written.parameters) or 'none'}", markup=False)
    for text in written.notes:
        note(text)
