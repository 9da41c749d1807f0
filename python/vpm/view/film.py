"""A scene as a film, drawn by matplotlib: no browser and no graphics card, so that it works on any machine.

Triangles are drawn from far to near (M. Newell, R. Newell and T. Sancha, 1972), which is right for parts as small as
those of tubes and spheres; boxes that run into each other may show each other's edges.
"""

from __future__ import annotations

from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError, needs
from vpm.files import replacing
from vpm.numbers import Array
from vpm.view.looks import GROUND, INK, LOOKS, SOFT, colour
from vpm.view.mesh import mesh_of
from vpm.view.scene import Scene

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure
    from matplotlib.text import Text


#: Size of a film in pixels, its pictures per second, and how long it may be (s).
WIDTH, HEIGHT, RATE, LONGEST = 1280, 720, 25, 120.0
#: Formats that players know.
ENDINGS = (".mp4", ".mkv", ".gif")
#: Shares of the picture's height for the machine.
STAGE = 0.80
#: Time that a film of a short motion takes, s.
SHORT = 5.0


def draw(scene: Scene, sample: int, *, dark: bool = False, size: tuple[int, int] = (WIDTH, HEIGHT)) -> Figure:
    """Draw one picture of a film.

    ``size``: pixels across and up.
    Raises `MissingExtraError`: matplotlib is not installed.
    """
    with needs("matplotlib", "film"):
        from matplotlib.collections import PolyCollection
        from matplotlib.figure import Figure
    figure = Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100, facecolor=colour(GROUND, dark=dark))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(-1, 1), ylim=(-1, 1))
    axes.set_axis_off()
    polygons, colours = _polygons(scene, sample, size[0] / size[1], dark=dark)
    axes.add_collection(PolyCollection([*polygons], facecolors=colours, edgecolors=colours, linewidths=0.25))
    _write(figure, scene, sample, dark=dark)
    return figure


def _polygons(scene: Scene, sample: int, aspect: float, *, dark: bool) -> tuple[Array, Array]:
    """Polygons of a film's picture (F, 3, 2) and their colours (F, 4), from far to near."""
    camera = scene.camera(aspect, room=STAGE)
    lamp = camera.axes[2] + 0.6 * camera.axes[1] - 0.4 * camera.axes[0]
    lamp /= np.linalg.norm(lamp)
    places, colours, depths = [np.zeros((0, 3, 2))], [np.zeros((0, 4))], [np.zeros(0)]
    for role in scene.roles:
        corners, faces = mesh_of([shape for shape in scene.shapes if shape.role == role], sample)
        if not len(faces):
            continue
        triangles = corners[faces]
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-15)
        seen = np.einsum("fi,fi->f", normal, camera.eye - triangles.mean(axis=1)) > 0.0
        light = 0.66 + 0.12 * normal @ scene.up + 0.30 * np.maximum(normal @ lamp, 0.0)
        shown = camera.project(triangles)
        tone = np.clip(light[:, None] * colour(LOOKS[role], dark=dark), 0.0, 1.0)
        solid = np.full((len(tone), 1), LOOKS[role].solid)
        # A floor is behind all that stands on it.
        far = 1e6 if role in {"floor", "plane"} else 0.0
        places.append(shown[seen, :, :2])
        colours.append(np.hstack([tone, solid])[seen])
        depths.append(shown[seen, :, 2].mean(axis=1) + far)
    order = np.argsort(-np.concatenate(depths), kind="stable")
    return np.concatenate(places)[order], np.concatenate(colours)[order]


def _write(figure: Figure, scene: Scene, sample: int, *, dark: bool) -> None:
    ink, soft = colour(INK, dark=dark), colour(SOFT, dark=dark)
    width, height = figure.get_size_inches() * figure.dpi

    def text(x: float, y: float, words: str, size: float, tone: tuple[float, float, float]) -> Text:
        return figure.text(x / width, 1.0 - y / height, words, size=size, color=tone, va="center", parse_math=False)

    text(22, 30, scene.title, 15, ink).set_fontweight("bold")
    text(22, 56, scene.subtitle, 10.5, soft)
    text(width - 22, height - 28, f"{scene.time[sample]:.3f} s", 13, ink).set_horizontalalignment("right")
    for row, role in enumerate(role for role in LOOKS if role in scene.roles):
        scale = scene.scales.get(role, f"one square is {scene.grid:g} m" if role in {"floor", "plane"} else "")
        y = 92 + 21 * row
        text(22, y, "■", 10, colour(LOOKS[role], dark=dark))
        text(40, y, LOOKS[role].word + (f" ({scale})" if scale else ""), 9.5, ink)


def write_film(
    scene: Scene,
    path: str | PathLike[str],
    *,
    speed: float | None = None,
    dark: bool = False,
    progress: Callable[[str], object] | None = None,
) -> Path:
    """Write the film of a scene.

    - ``path``: MP4, MKV or GIF, by its ending
    - ``speed``: seconds of the machine in a second of film; by default 1, or as slow that a short motion takes `SHORT`
      seconds
    """
    target = Path(path)
    if target.suffix.lower() not in ENDINGS:
        raise VpmError(f"{path} is no name of a film; give it one of the endings {', '.join(ENDINGS)}")
    samples = film_samples(scene, speed)
    with needs("imageio-ffmpeg", "film"):
        imageio: Any = import_module("imageio.v2")
        import_module("imageio_ffmpeg")
    gif: dict[str, Any] = {"duration": 1000.0 / RATE, "loop": 0}
    how = gif if target.suffix.lower() == ".gif" else {"fps": RATE, "macro_block_size": 2, "quality": 8}
    with replacing(path) as beside, imageio.get_writer(beside, **how) as writer:
        for number, sample in enumerate(samples):
            writer.append_data(picture(draw(scene, int(sample), dark=dark)))
            if progress is not None:
                progress(f"film: {number + 1} of {len(samples)} pictures")
    return target


def film_samples(scene: Scene, speed: float | None = None) -> NDArray[np.int64]:
    """The sample of each picture of a film."""
    duration = float(scene.time[-1] - scene.time[0])
    if duration <= 0.0:
        raise VpmError(f"nothing moves in {scene.title}, so there is nothing to film; name a run or a log")
    speed = min(1.0, duration / SHORT) if speed is None else speed
    if not (np.isfinite(speed) and speed > 0.0):
        raise VpmError(f"a film cannot run at speed {speed:g}; give a positive number, 1 for the time of the machine")
    if duration / speed > LONGEST:
        raise VpmError(
            f"the film would take {duration / speed:.0f} s, more than {LONGEST:.0f} s; give a speed of at least "
            f"{duration / LONGEST:.2g}, or a shorter record"
        )
    moments = scene.time[0] + speed * np.arange(0.0, duration / speed + 0.5 / RATE, 1.0 / RATE)
    return np.asarray(np.clip(np.searchsorted(scene.time, moments), 0, scene.time.size - 1), dtype=np.int64)


def picture(figure: Figure) -> NDArray[np.uint8]:
    """Pixels of a film's picture, shape (height, width, 3)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas: Any = FigureCanvasAgg(figure)  # ships no types
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
