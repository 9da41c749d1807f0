"""One call that shows a model."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simulate import Run
from vpm.view.build import scene_of
from vpm.view.course import course_of
from vpm.view.scene import Scene

if TYPE_CHECKING:
    from vpm.scenario import ScenarioRun


def view(
    model: Model,
    run: Run | ScenarioRun | Experiment | None = None,
    *,
    page: str | PathLike[str] | None = None,
    film: str | PathLike[str] | None = None,
    mode: str | None = None,
    speed: float | None = None,
    dark: bool = False,
    port: int | None = None,
) -> Scene:
    """Show a machine: in the browser until Ctrl-C, or as a page or film where one is asked for.

    Parameters
    ----------
    run : Run, ScenarioRun or Experiment, optional
        What moves it; a log is simulated first, and shown beside. Without one the joints have sliders.
    page : path-like, optional
        Write one static page (HTML), which opens without a network.
    film : path-like, optional
        Write a film (MP4, MKV or GIF). Needs the extra ``film``.
    mode : str, optional
        Of the simulation of a log; by default as its commands, references or motion allow; see `course_of`.
    speed : float, optional
        Of the film: seconds of the machine in a second.
    dark : bool
        On dark ground, in film and browser; a page does as its reader likes.
    port : int, optional
        Of the browser's page; by default the first free one.

    Returns
    -------
    Scene
        What is shown, as numbers.

    Raises
    ------
    VpmError
        The run is of another model, the log does not tell where the joints are, the port is in use, or an extra
        is missing.

    Examples
    --------
    >>> view(model, run, page="landing.html")
    """
    course = course_of(model, run, mode)
    scene = scene_of(model, course)
    if page is not None:
        from vpm.view.page import write_page

        write_page(scene, page)
    if film is not None:
        from vpm.view.film import write_film

        write_film(scene, film, speed=speed, dark=dark)
    if page is None and film is None:
        from vpm.view.live import Page, serve, show

        live = Page(model, course, port=port, dark=dark)
        show(live)
        serve(live)
    return scene
