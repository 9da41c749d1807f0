"""Pictures of the page in headless Chromium, and the page that viser serves."""

import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import vpm
from command_line import vpm as command
from places import ROOT
from view_scenes import arm_scene, hits, leg_scene, strip_scene
from vpm.errors import VpmError
from vpm.scenario import Scenario
from vpm.view import Scene, course_of
from vpm.view.page import STAGE, write_page

CHROMIUM = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None
)
OPTIONS = ("--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def photo(page: Path, asked: str, size: tuple[int, int]) -> NDArray[np.uint8]:
    """Pixels of a page (height, width, 3); Chromium without a graphics card may fall over once."""
    from matplotlib.image import imread

    target, words = page.with_suffix(".png"), [*OPTIONS, "--hide-scrollbars", f"--user-data-dir={page.parent / 'home'}"]
    words += [f"--window-size={size[0]},{size[1]}", "--virtual-time-budget=1500", f"--screenshot={target}"]
    for _ in range(3):
        subprocess.run(
            [str(CHROMIUM), *words, f"{page.as_uri()}#{asked}"], capture_output=True, timeout=120, check=False
        )
        if target.exists():
            return np.asarray(np.rint(255.0 * imread(target)[..., :3]), dtype=np.uint8)
    raise AssertionError("Chromium made no picture in three attempts")


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
@pytest.mark.parametrize(
    ("make", "role", "sample", "theme", "size"),
    [
        (lambda: arm_scene()[1], "link", 7, "light", (900, 640)),
        (strip_scene, "beam", 420, "dark", (500, 860)),
        (leg_scene, "barrel", 160, "light", (900, 640)),
    ],
    ids=["rigid arm", "bending link", "landing leg"],
)
def test_a_page_shows_the_parts_where_they_are(
    make: Callable[[], Scene], role: str, sample: int, theme: str, size: tuple[int, int], tmp_path: Path
) -> None:
    scene = make()
    pixels = photo(write_page(scene, tmp_path / "page.html"), f"t={scene.time[sample]:.6f}&{theme}", size)
    # A headless window may be lower than asked for, by bars that nobody sees.
    assert pixels.shape[1] == size[0]
    assert hits(pixels, scene, role, sample, STAGE, dark=theme == "dark") > 0.85
    assert hits(pixels, scene, role, 0, STAGE, dark=theme == "dark") < 0.75, "at another time they are elsewhere"
    ground = pixels[5, pixels.shape[1] // 2].astype(int)
    assert (ground.mean() < 60) == (theme == "dark")


def quiet_port() -> int:
    """A port from where other tests look for none."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_a_port_in_use_is_told() -> None:
    pytest.importorskip("viser", reason="viser is not installed")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        done = command("view", ROOT / "examples/arm/arm.toml", "--port", str(port), "--no-browser")
    assert done.returncode == 1
    assert f"port {port} is in use" in done.stderr


def test_the_browser_is_served_with_sliders_and_with_a_time_line() -> None:
    pytest.importorskip("viser", reason="viser is not installed")
    from vpm.view.live import Page, serve

    model = vpm.Model.load(ROOT / "examples/flexible_pendulum/flexible_pendulum.toml")
    for source in (None, Scenario.load(ROOT / "examples/flexible_pendulum/release.toml").run()):
        page = Page(model, course_of(model, source), port=quiet_port())
        page.advance(0.0)
        assert page.drawn("beam").shape[1] == 3
        with urllib.request.urlopen(page.address, timeout=10) as answer:
            assert answer.status == 200
        before = page.drawn("beam")
        if source is not None:
            page.advance(0.5)
            assert np.max(np.abs(page.drawn("beam") - before)) > 1e-3
        serve(page, lambda: True)
        with pytest.raises(OSError, match="refused"), urllib.request.urlopen(page.address, timeout=10):
            pass


def test_ctrl_c_ends_the_server() -> None:
    pytest.importorskip("viser", reason="viser is not installed")
    import signal

    words = [sys.executable, "-m", "vpm", "view", str(ROOT / "examples/arm/arm.toml"), "--no-browser"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert "http://localhost:" in process.stdout.readline()
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert said.strip() == "stopped by Ctrl-C"


def test_a_missing_library_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    model = vpm.Model.load(ROOT / "examples/arm/arm.toml")
    with pytest.raises(VpmError, match=r'pip install "vpm-dynamics\[view\]"'):
        vpm.view(model)
