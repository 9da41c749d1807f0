"""Command line of the proving ground: ``vpm prove``."""

import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer

from vpm.command import console, writable
from vpm.command_output import give, note, progressed, wrote
from vpm.errors import DiagnosisError, refused_as
from vpm.files import exists, write_text

EXAMPLES = (
    "Example:  vpm prove --machine axis_linear --effect coulomb_friction --seeds 0-4 --each 5\n\n"
    "Example:  vpm prove --seeds 0-9 --out docs/proving_ground.md"
)
#: Lines between which a page holds the tables.
BEGIN, END = "<!-- tables of vpm prove: begin -->", "<!-- tables of vpm prove: end -->"


def prove(
    machine: Annotated[list[str] | None, typer.Option(help="Machine; all by default.")] = None,
    effect: Annotated[list[str] | None, typer.Option(help="Effect to hide; all by default.")] = None,
    seeds: Annotated[str, typer.Option(help="Seeds, for example 0-9 or 1,4,7.")] = "0-4",
    each: Annotated[int, typer.Option(help="Cases of each effect on each machine; seeds are dealt out in turn.")] = 1,
    noise: Annotated[list[float] | None, typer.Option(help="Noise level; 1 by default.")] = None,
    kind: Annotated[
        list[str] | None, typer.Option(help="single, pairs, none, parameters, outside; all by default.")
    ] = None,
    workers: Annotated[int, typer.Option(help="Processes; 0 takes one for each core.")] = 0,
    executor: Annotated[
        str | None, typer.Option(help="Function that makes an executor, module:function, to take its workers instead.")
    ] = None,
    limit: Annotated[float, typer.Option(help="Longest time of one diagnosis on its core, s.")] = 120.0,
    folder: Annotated[Path, typer.Option(help="Folder of a checkout that holds blind/.")] = Path("tests"),
    answers: Annotated[Path | None, typer.Option(help="Tables of the answers in this file instead.")] = None,
    calibrate: Annotated[
        Path | None,
        typer.Option(
            callback=writable, help="Fit the numbers behind probabilities to the answers, and write them here."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(callback=writable, help="Write the tables into this page; beside it every case and a diagram."),
    ] = None,
) -> None:
    """Hide effects in machines that other code simulates, diagnose them blind, and count what was named."""
    proving, table, reliability = _proving_ground(folder)
    if out is not None:
        page(out, "")
    if answers is not None:
        found = proving.load_json(answers)
    else:
        with refused_as(DiagnosisError):
            kinds = kind or proving.KINDS
            todo = proving.jobs(machine or (), effect or (), numbers(seeds), noise or (1.0,), kinds, each)
        kept = None if out is None else out.with_suffix(".partial.json")
        makes = None if executor is None else _maker(executor)
        found = _asked(proving, todo, (workers, limit), kept, makes)
        if len(found) < len(todo):
            where = "" if kept is None else f"; what was answered is in {kept}, for vpm prove --answers {kept}"
            note(f"interrupted: {len(found)} of {len(todo)} cases are done{where}")
            out = calibrate = None
    found.sort(key=lambda a: (list(proving.KINDS).index(a.kind), a.machine, a.request, a.seed))
    give(answers=found)
    text = table.tables(found)
    console.print(text, markup=False)
    if out is not None:
        _write(proving, reliability, found, out, text)
    if calibrate is not None:
        fitted, told = reliability.report(found)
        console.print(told, markup=False)
        wrote(fitted.save(calibrate))


def _write(proving: ModuleType, reliability: ModuleType, found: list[Any], out: Path, text: str) -> None:
    """Write the page with the tables, and beside it the answers and how often probabilities were right."""
    proving.save_json(found, out.with_suffix(".json"))
    write_text(out, page(out, text))
    out.with_suffix(".partial.json").unlink(missing_ok=True)
    written = [out, out.with_suffix(".json")]
    if reliability.stated(found):
        written.append(reliability.draw(found, out.with_suffix(".svg")))
    wrote(*written)


def _maker(text: str) -> Callable[[], Executor]:
    """The function ``module:function``, whose module may stand in the working folder."""
    module, _, name = text.partition(":")
    if "" not in sys.path:
        sys.path.insert(0, "")
    try:
        found: Callable[[], Executor] = getattr(import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise DiagnosisError(
            f'there is no function "{text}" ({error}); write module:function, of a module that Python finds from here'
        ) from None
    return found


def _asked(
    proving: ModuleType,
    todo: Sequence[Any],
    how: tuple[int, float],
    kept: Path | None,
    executor: Callable[[], Executor] | None,
) -> list[Any]:
    """Answers to cases, told and kept as they come."""
    console.print(f"{len(todo)} cases", markup=False)
    found = []
    for answer in proving.answers(todo, *how, progressed, executor):
        found.append(answer)
        if kept is not None:
            proving.save_json(found, kept)
    return found


def page(path: Path, text: str) -> str:
    """The page with new tables between its two markers; a page that is not there begins with a title."""
    old = path.read_text(encoding="utf-8") if path.exists() else f"# Proving ground\n\n{BEGIN}\n{END}\n"
    if old.count(BEGIN) != 1 or old.count(END) != 1 or old.index(END) < old.index(BEGIN):
        raise DiagnosisError(f"{path} does not say where the tables go; it needs the lines {BEGIN} and {END}")
    head, _, rest = old.partition(BEGIN)
    return f"{head}{BEGIN}\n\n{text}\n{END}{rest.partition(END)[2]}"


def numbers(text: str) -> tuple[int, ...]:
    """Seeds from text such as ``0-4,7``."""
    found: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not first.isdigit() or (dash and not last.isdigit()):
            raise DiagnosisError(f'"{text}" are no seeds; write them like 0-9 or 1,4,7')
        found += range(int(first), int(last or first) + 1)
    if not found:
        raise DiagnosisError(f'"{text}" holds no seed; write the smaller number first, like 0-9')
    return tuple(dict.fromkeys(found))


def _proving_ground(folder: Path) -> tuple[ModuleType, ModuleType, ModuleType]:
    """Modules of the proving ground, which is no part of the installed package."""
    if not exists(folder / "blind" / "proving.py"):
        raise DiagnosisError(
            f"{folder} holds no proving ground, which is part of the source only: run vpm prove in a checkout of the "
            "repository, or say where its tests are with --folder"
        )
    place = str(folder.resolve())
    if place not in sys.path:
        sys.path.insert(0, place)
    return import_module("blind.proving"), import_module("blind.table"), import_module("blind.reliability")
