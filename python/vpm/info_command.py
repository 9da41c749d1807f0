"""Command line of what there is: ``vpm info``."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from vpm import __version__
from vpm.command import console, load_model
from vpm.command_output import give
from vpm.errors import ModelError
from vpm.plugins import KINDS, plugins

if TYPE_CHECKING:
    from vpm.model import Model

EXAMPLES = "Example:  vpm info examples/emps/model.toml"


def info(model: Annotated[Path | None, typer.Argument(metavar="[MODEL]", help="Model file to list.")] = None) -> None:
    """Version, or a model's flexible links, how its steps run, and its parameters with units and bounds."""
    if model is None:
        give(version=__version__, plugins=(offered := _plugins()))
        console.print(f"vpm {__version__}")
        for one in offered:
            told = one["refused"] or f"of {one['package']}"
            console.print(f"  {one['kind']} {one['name']} {told}", markup=False)
        return
    loaded = load_model(model)
    way, loops = _way(loaded), _loops(loaded)
    parameters = list(loaded.parameters.values())
    give(name=loaded.name, beams=loaded.beam_summary, loops=loops, steps=way, parameters=parameters)
    console.print(repr(loaded), markup=False)
    for sentence in (*loaded.beam_summary, *loops, way):
        console.print(f"  {sentence}", markup=False)
    for p in parameters:
        spread = "known" if p.uncertainty is None else f"± {p.uncertainty:g}"
        console.print(
            f"  {p.name:40s} {p.value:14.6g} {p.unit:10s} {spread:12s} [{p.minimum:g}, {p.maximum:g}]", markup=False
        )


def _plugins() -> list[dict[str, str]]:
    """What other packages offer; nothing of them is imported."""
    if not any(map(plugins, KINDS)):
        return []
    from vpm.catalogue.entries import OWN as EFFECTS
    from vpm.experiment.readers import OWN as READERS
    from vpm.model.reading import OWN as IMPORTERS

    taken = {"effects": EFFECTS, "readers": READERS, "importers": IMPORTERS}
    found = (one for kind, names in taken.items() for one in plugins(kind, names).values())
    return [{"kind": KINDS[p.kind], "name": p.name, "package": p.package, "refused": p.refused} for p in found]


def _loops(model: Model) -> list[str]:
    """Sentences on closed loops: their equations, and the assembly that `start` chooses."""
    if not model.loops:
        return []
    try:
        q = model.loops.assembled()
    except ModelError as error:
        return [str(error)]
    return [model.loops.summary(q), f"they are closed from their start with {model.loops.describe(q)}"]


def _way(model: Model) -> str:
    """Sentence on how long runs of a model step: as machine code, or why not."""
    from vpm.simulate import Setup

    begin = perf_counter()
    reason = model.core.compile(model.theta, Setup().method(model))
    spent = 1e3 * (perf_counter() - begin)
    return f"no machine code: {reason}" if reason else f"long runs are machine code, made in {spent:.0f} ms"
