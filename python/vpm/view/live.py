"""A scene in the browser by viser, with a time line, or with a slider for each joint."""

from __future__ import annotations

import logging
import math
import socket
import time
import webbrowser
from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError, needs
from vpm.model import Model
from vpm.numbers import Array
from vpm.view.build import scene_of
from vpm.view.course import Course, resting
from vpm.view.looks import GROUND, LOOKS, colour
from vpm.view.mesh import mesh_of
from vpm.view.scene import Scene

if TYPE_CHECKING:
    from viser import GuiCheckboxHandle, GuiEvent, GuiSliderHandle, MeshHandle, ViserServer


#: Where a page is served, by default at the first free port from here on: this machine alone can see it.
HOST, FIRST_PORT, PORTS = "127.0.0.1", 8080, 100
#: Pictures per second.
RATE = 25.0
SPEEDS = ("0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1", "2", "5", "10")


class Stage:
    """What of a scene a browser shows: one mesh for each role."""

    def __init__(self, server: ViserServer, *, dark: bool) -> None:
        self._server, self._dark = server, dark
        self._meshes: dict[str, MeshHandle] = {}
        self.hidden: set[str] = set()

    def show(self, scene: Scene, sample: int) -> None:
        """Show a sample live."""
        with self._server.atomic():
            for role in scene.roles:
                self._show_role(role, *mesh_of([shape for shape in scene.shapes if shape.role == role], sample))

    def _show_role(self, role: str, places: Array, faces: NDArray[np.int64]) -> None:
        mesh = self._meshes.get(role)
        corners, shown = places.astype(np.float32), bool(len(faces)) and role not in self.hidden
        if mesh is not None and mesh.vertices.shape == corners.shape and shown:
            mesh.vertices, mesh.visible = corners, True
        elif shown:
            look = LOOKS[role]
            self._meshes[role] = self._server.scene.add_mesh_simple(
                f"/{role}",
                corners,
                faces.astype(np.uint32),
                color=colour(look, dark=self._dark),
                opacity=look.solid if look.solid < 1.0 else None,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
        elif mesh is not None:
            mesh.visible = False

    def corners(self, role: str) -> Array:
        """Corners of a role's mesh on the live stage (C, 3)."""
        return np.array(self._meshes[role].vertices, dtype=np.float64)


class Page:
    """A page in the browser.

    - ``course``: a single sample has sliders for the joints, more have a time line
    - ``port``: by default the first free one
    """

    def __init__(self, model: Model, course: Course, *, port: int | None = None, dark: bool = False) -> None:
        with needs("viser", "view"):
            import viser
        # A browser that opens a line and says nothing is no error of anybody.
        logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
        self.model, self.course = model, course
        self.scene = scene_of(model, course)
        with redirect_stdout(StringIO()):  # it greets by itself
            self.server = viser.ViserServer(HOST, free_port(port), label=f"vpm: {model.name}", verbose=False)
        self.address = f"http://localhost:{self.server.get_port()}"
        self._stage = Stage(self.server, dark=dark)
        self._stale = True
        self._now, self._drawn = 0.0, 0.0
        self._set_up(dark=dark)
        self._draw_now: Callable[[], None]
        self.server.gui.add_markdown(f"**{_plain(self.scene.title)}**  \n{_plain(self.scene.subtitle)}")
        if course.time.size > 1:
            self._add_time_line()
        else:
            self._add_joints()
        self._add_legend(dark=dark)

    def _set_up(self, *, dark: bool) -> None:
        server, scene = self.server, self.scene
        server.gui.configure_theme(dark_mode=dark, show_logo=False, show_share_button=False, control_width="medium")
        x, y, z = scene.up.tolist()
        server.scene.set_up_direction((x, y, z))
        ground = np.round(255.0 * np.array(colour(GROUND, dark=dark))).astype(np.uint8)
        server.scene.set_background_image(np.broadcast_to(ground, (2, 2, 3)).copy())
        camera, (centre, _) = scene.camera(1.5), scene.bounds
        server.initial_camera.position = tuple(camera.eye.tolist())
        server.initial_camera.look_at = tuple(centre.tolist())
        server.initial_camera.up = (x, y, z)
        server.initial_camera.fov = 2.0 * math.atan(camera.slopes[1])

    def _add_legend(self, *, dark: bool) -> None:
        gui, scene = self.server.gui, self.scene
        with gui.add_folder("What is what", expand_by_default=True):
            for role in (role for role in LOOKS if role in scene.roles):
                scale = scene.scales.get(role, f"one square is {scene.grid:g} m" if role in {"floor", "plane"} else "")
                red, green, blue = (round(255.0 * part) for part in colour(LOOKS[role], dark=dark))
                gui.add_html(
                    f'<div style="margin:2px 12px;border-left:14px solid rgb({red},{green},{blue});height:4px">'
                )
                word = LOOKS[role].word + (f" ({scale})" if scale else "")
                box = gui.add_checkbox(word, initial_value=True)
                box.on_update(self._switch(role, box))
        for note in scene.notes:
            gui.add_markdown(_plain(note))

    def _switch(self, role: str, box: GuiCheckboxHandle) -> Callable[[object], None]:
        def switch(_: object) -> None:
            (self._stage.hidden.discard if box.value else self._stage.hidden.add)(role)
            self._stale = True

        return switch

    def _add_time_line(self) -> None:
        gui, clock = self.server.gui, self.scene.time
        duration = float(clock[-1] - clock[0])
        wished = min(1.0, duration / 5.0)
        nearest = min(SPEEDS, key=lambda speed: abs(math.log(float(speed) / wished)))
        self._play: Any = gui.add_checkbox("play", initial_value=True)
        self._speed: Any = gui.add_dropdown("speed", SPEEDS, initial_value=nearest)
        self._time: Any = gui.add_slider("time (s)", 0.0, duration, max(duration / 1000.0, 1e-6), 0.0)

        def moved(event: GuiEvent[GuiSliderHandle[float]]) -> None:
            if event.client is not None:  # by hand, not by the clock
                self._now, self._stale = float(self._time.value), True

        self._time.on_update(moved)

        def draw() -> None:
            self._stage.show(self.scene, int(np.searchsorted(clock, clock[0] + self._now, side="right")) - 1)

        self._draw_now = draw

    def _add_joints(self) -> None:
        gui, model = self.server.gui, self.model
        sliders: list[Any] = []
        with gui.add_folder("Joints"):
            for name in model.joints:
                turns = model.channel_unit(f"{name}.position") == "rad"
                reach, unit = (180.0, "°") if turns else (round(self.scene.bounds[1], 3), "m")
                sliders.append(gui.add_slider(f"{name} ({unit})", -reach, reach, reach / 360.0, 0.0))
                sliders[-1].on_update(self._moved)
        turning = np.array([model.channel_unit(f"{name}.position") == "rad" for name in model.joints])

        def draw() -> None:
            values = np.array([float(slider.value) for slider in sliders])
            joints = np.where(turning, np.radians(values), values)
            self._stage.show(scene_of(model, Course("", np.zeros(1), resting(model, joints))), 0)

        self._draw_now = draw

    def _moved(self, _: object) -> None:
        self._stale = True

    def advance(self, seconds: float) -> None:
        """Let time pass on the live page, and draw if something has changed."""
        if self.course.time.size > 1 and self._play.value and seconds > 0.0:
            duration = float(self.scene.time[-1] - self.scene.time[0])
            self._now = (self._now + seconds * float(self._speed.value)) % duration
            self._time.value = self._now
            self._stale = True
        if self._stale:
            self._stale = False
            self._draw_now()

    def drawn(self, role: str) -> Array:
        """Corners of a role that the live browser was told last, shape (C, 3), m."""
        return self._stage.corners(role)

    def close(self) -> None:
        """End the server of a live view."""
        with redirect_stdout(StringIO()):
            self.server.stop()


def serve(page: Page, ended: Callable[[], bool] = lambda: False) -> None:
    """Serve a live page until Ctrl-C, or until ``ended`` says so; the server ends with it."""
    try:
        before = time.monotonic()
        while not ended():
            now = time.monotonic()
            page.advance(now - before)
            before = now
            time.sleep(1.0 / RATE)
    finally:
        page.close()


def show(page: Page) -> bool:
    """Open a live page in a browser; False where there is none."""
    try:
        return webbrowser.open(page.address)
    except webbrowser.Error:
        return False


def free_port(port: int | None) -> int:
    """Free port for a live page: the one that is asked for, or the first free one."""
    for number in range(FIRST_PORT, FIRST_PORT + PORTS) if port is None else (port,):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((HOST, number))
            except (OSError, OverflowError):
                continue
            return number
    if port is None:
        raise VpmError(f"ports {FIRST_PORT} to {FIRST_PORT + PORTS - 1} are all in use; name a free one by --port")
    raise VpmError(f"port {port} is in use or not allowed; name another one by --port, or leave it out")


def _plain(text: str) -> str:
    """Text for a live page without Markdown or HTML."""
    return "".join(f"&#{ord(letter)};" if letter in "\\`*_{}[]<>()#+!|&$~" else letter for letter in text)
