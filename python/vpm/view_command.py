"""``vpm view``: a machine to look at."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vpm.command import FORMATS, Channels, Interpolate, ModelPath, console, load_model, load_record, progress, writable
from vpm.command_output import give, note, wrote
from vpm.errors import VpmError

if TYPE_CHECKING:
    from vpm.experiment import Experiment
    from vpm.model import Model
    from vpm.scenario import ScenarioRun
    from vpm.simulate import Run

EXAMPLES = (
    "Example:  vpm view examples/arm/arm.toml    (sliders for its joints, in the browser)\n\n"
    "Example:  vpm simulate examples/hyl/hydraulic_drop.toml --out drop.npz\n\n"
    "Example:  vpm view examples/hyl/hydraulic.toml drop.npz --page landing.html --film landing.mp4"
)


def view(
    model: ModelPath,
    moved: Annotated[
        Path | None,
        typer.Argument(metavar="RUN|LOG", help=f"Saved run (NPZ), or measured record ({FORMATS}), simulated first."),
    ] = None,
    run: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Which run of a saved scenario; the first of this model by default."),
    ] = None,
    mode: Annotated[
        str | None,
        typer.Option(
            metavar="MODE", help="How a log is simulated; by default as its commands, references or motion allow."
        ),
    ] = None,
    page: Annotated[
        Path | None, typer.Option(callback=writable, help="Write one static page (HTML) that needs no network.")
    ] = None,
    film: Annotated[
        Path | None, typer.Option(callback=writable, help="Write a film (MP4, MKV or GIF); extra film.")
    ] = None,
    speed: Annotated[float | None, typer.Option(help="Seconds of the machine in a second of film.")] = None,
    dark: Annotated[bool, typer.Option("--dark", help="On dark ground.")] = False,
    port: Annotated[int | None, typer.Option(help="Of the page in the browser; the first free one from 8080.")] = None,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open a browser.")] = True,
    channels: Channels = None,
    interpolate: Interpolate = False,
) -> None:
    """Show a machine in the browser, moved by a run or a log; or write a page or a film of it."""
    from vpm.view import course_of, scene_of

    machine = load_model(model)
    course = course_of(machine, _source(moved, run, machine, channels, interpolate), mode)
    scene = scene_of(machine, course)
    for told in scene.notes:
        note(told)
    give(name=machine.name)
    if page is not None:
        from vpm.view.page import write_page

        wrote(write_page(scene, page))
    if film is not None:
        from vpm.view.film import write_film

        with progress() as tell:
            write_film(scene, film, speed=speed, dark=dark, progress=tell)
        wrote(film)
    if page is None and film is None:
        from vpm.view.live import Page, serve, show

        live = Page(machine, course, port=port, dark=dark)
        console.print(f"{machine.name} is at {live.address}; Ctrl-C ends it", markup=False)
        if browser and not show(live):
            note("no browser was found here; open the address in one, or write a page by --page")
        serve(live)


def _source(
    path: Path | None, run: str | None, model: Model, channels: Path | None, interpolate: bool
) -> Run | ScenarioRun | Experiment | None:
    """What moves the machine: a saved result, or a log."""
    from vpm.experiment import Experiment
    from vpm.results import Result
    from vpm.scenario import ScenarioRun
    from vpm.simulate import Run

    if path is None or path.suffix.lower() != ".npz":
        if run is not None:
            raise VpmError(
                "--run names a run of a saved scenario, and none is given; name its file (NPZ), or leave it out"
            )
        return None if path is None else load_record(path, model, channels, interpolate)
    result: Result = Result.load(path)
    if isinstance(result, ScenarioRun):
        return result if run is None else result[run]
    if run is not None:
        raise VpmError(f"{path} holds no scenario, so it has no run {run}; leave --run out")
    if isinstance(result, Run | Experiment):
        return result
    raise VpmError(f"{path} holds a {type(result).__name__}, in which nothing moves; name a saved run, or a log")
