"""Whatever happens while a file is written, there is the old or the new one; and long commands end as they should."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from interrupting import running, work
from places import EXAMPLES
from vpm import command, demo
from vpm.cli import app
from vpm.diagnosing import diagnose
from vpm.errors import SimulationError
from vpm.experiment import Experiment
from vpm.files import FileError, make_folder, probe_file, probe_folder, replacing, write_text
from vpm.model import Model
from vpm.report import print_story, write_report

MODEL, LOG = str(demo.MODEL), str(demo.TRAIN)
SCENARIO = EXAMPLES / "emps" / "step.toml"
POSIX = pytest.mark.skipif(os.name != "posix", reason="needs limits and signals of POSIX")


@contextmanager
def largest(count: int) -> Iterator[None]:
    """No file can grow beyond so many bytes, as on a full disk."""
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (count, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


@POSIX
@pytest.mark.parametrize("what", ["text", "result", "table"])
def test_a_full_disk_leaves_what_was_there(tmp_path: Path, what: str) -> None:
    steps = np.arange(5000, dtype=np.float64)
    noise = np.random.default_rng(0).normal(size=(5000, 1))
    record = Experiment("made", 0.01 * steps, noise, ("x",), ("1",))
    target = tmp_path / "file"
    target.write_text("old", encoding="utf-8")
    write = {"text": lambda: write_text(target, "new" * 5000), "result": lambda: record.save(target)}
    with largest(4096), pytest.raises(FileError, match="file cannot be written"):
        write.get(what, lambda: record.to_csv(target))()
    assert target.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [target]


@POSIX
def test_a_kill_leaves_what_was_there(tmp_path: Path) -> None:
    target = tmp_path / "file"
    target.write_text("old", encoding="utf-8")
    program = (
        "import os, signal, sys\nfrom vpm.files import replacing\n"
        "with replacing(sys.argv[1]) as beside:\n"
        "    beside.write_text('half')\n    os.kill(os.getpid(), signal.SIGKILL)"
    )
    done = subprocess.run([sys.executable, "-c", program, str(target)], check=False)
    assert done.returncode == -signal.SIGKILL
    assert target.read_text(encoding="utf-8") == "old"


def test_links_stay_links_and_modes_stay(tmp_path: Path) -> None:
    (tmp_path / "there").write_text("old", encoding="utf-8")
    (tmp_path / "there").chmod(0o600)
    (tmp_path / "link").symlink_to("there")
    write_text(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "there").read_text(encoding="utf-8") == "new"
    assert (tmp_path / "there").stat().st_mode & 0o777 == 0o600
    write_text(os.devnull, "nothing")
    assert not Path(os.devnull).is_file()


def test_folders_behind_links_are_made_and_circles_are_refused(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("not/there")
    make_folder(tmp_path / "link")
    assert (tmp_path / "not" / "there").is_dir()
    (tmp_path / "round").symlink_to("round")
    for attempt in (make_folder, probe_folder, probe_file, lambda path: write_text(path, "new")):
        with pytest.raises(FileError, match="lead round in a circle"):
            attempt(tmp_path / "round")
    assert (tmp_path / "round").is_symlink()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
def test_results_are_written_where_the_output_cannot_be(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "vpm", "simulate", str(SCENARIO), "--out", str(tmp_path / "runs.npz")]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert "error: standard output cannot be written (no space left on device); send it elsewhere" in done.stderr
    assert (tmp_path / "runs.npz").exists()


def test_letters_that_a_terminal_does_not_have_become_marks() -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    words = [sys.executable, "-m", "vpm", "info", MODEL]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, "? 0.015" in done.stdout) == (0, True), done.stderr


def test_an_error_while_writing_leaves_what_was_there(tmp_path: Path) -> None:
    write_text(tmp_path / "file", "old")

    def stopped() -> None:
        with replacing(tmp_path / "file") as beside:
            beside.write_text("half", encoding="utf-8")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert (tmp_path / "file").read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [tmp_path / "file"]


@pytest.mark.parametrize(
    "words",
    [
        ["simulate", "none.toml", LOG, "--out", "{}"],
        ["identify", "none.toml", LOG, "--out", "{}/m.toml"],
        ["identify", "none.toml", LOG, "--out", "{}"],
        ["diagnose", "none.toml", LOG, "--out", "{}"],
        ["rank", "none.toml", LOG, "--out", "{}/m.toml"],
        ["climb", "none.toml", LOG, "--validate", LOG, "--out", "{}/m.toml"],
        ["simplify", "none.toml", LOG, "--out", "{}/m.toml"],
        ["compile", "none.toml", "--out", "{}/m.json"],
        ["compile", "none.toml", "--c", "{}"],
        ["report", "none.npz", "--out", "{}"],
        ["demo", "--out", "{}"],
        ["prove", "--folder", "none", "--out", "{}/page.md"],
        ["excite", "chirp", "--channel", "c", "--unit", "A", "--band", "1", "2", "--period", "1", "--time-step", "0.01",
         "--peak", "1", "--out", "{}/m.csv"],
        ["compare", "none.toml", LOG, "--plot", "{}/a.png"],
        ["budget", "none.toml", "--plot", "{}/a.png"],
    ],
    ids=lambda words: f"{words[0]} {words[-1]}",
)  # fmt: skip
def test_every_place_to_write_to_is_tried_before_anything_is_read(tmp_path: Path, words: list[str]) -> None:
    """The model is not there either: what is told is the place, so it came first."""
    (tmp_path / "file").write_text("no folder", encoding="utf-8")
    bad = str(tmp_path / "file" / "x")
    with pytest.raises(FileError, match="cannot be written"):
        CliRunner().invoke(app, [word.format(bad) for word in words], catch_exceptions=False)


@POSIX
@pytest.mark.parametrize("words", [["budget", MODEL, "--steps", "100000000", "--latency", "0"], ["demo", "--out", "r"]])
def test_ctrl_c_ends_with_the_exit_code_of_shells(tmp_path: Path, words: list[str]) -> None:
    program = [sys.executable, "-c", "import vpm.cli; print('begun', flush=True); vpm.cli.main()", *words]
    with running(program, tmp_path) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        work(process, 1.0)
        process.send_signal(signal.SIGINT)
        told = process.communicate()[1]
    assert process.returncode == 130
    assert "Traceback" not in told
    assert "stopped by Ctrl-C" in told


#: Presses Ctrl-C when the command line loads a module of this name for the first time.
PRESSED = """
import os, signal, sys
module = sys.argv.pop(1)
class Press:
    def find_spec(self, name, *_):
        if name == module:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Press())
from vpm.__main__ import main
main()
"""


@POSIX
@pytest.mark.parametrize("module", ["vpm.cli", "typer", "vpm.command", "numpy", "vpm._core", "pydantic"])
def test_ctrl_c_while_the_commands_are_loaded_is_one_sentence(module: str) -> None:
    command = [sys.executable, "-c", PRESSED, module, "info", MODEL]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 130
    assert done.stderr == "stopped by Ctrl-C\n"


@POSIX
def test_a_command_that_a_script_put_into_the_background_stays_deaf_to_ctrl_c() -> None:
    command = ["sh", "-c", "trap '' INT; exec \"$@\"", "sh", sys.executable, "-c", PRESSED, "numpy", "info", MODEL]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "demo arm" in done.stdout


def test_output_to_a_file_gets_a_line_for_each_stage_and_for_long_silence(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "PERIOD", 0.05)
    with command.searching() as (tell, each):
        tell("looking")
        for done in range(1, 100):
            each("round 1", "friction", done, 99)
        told = ""
        while "round 1 99 of 99: friction (after " not in told:
            time.sleep(0.01)
            told += capsys.readouterr().err
    # On a busy machine a silence may come between any two of them.
    stages = [line for line in told.splitlines() if "(after " not in line]
    assert stages == ["looking", "round 1 1 of 99: friction"]


def test_an_error_after_the_naming_leaves_what_it_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise SimulationError("the beam is bent")

    arm = Model.load(demo.MODEL)
    logs = [Experiment.load(path, model=arm) for path in (demo.TRAIN, demo.VALIDATION)]
    monkeypatch.setattr("vpm.diagnosing.examined", fail)
    found = diagnose(arm, logs[:1], logs[1:], effects=["coulomb_friction"], workers=1)
    assert [(effect.name, effect.site) for effect in found.effects] == [("coulomb_friction", "shoulder")]
    assert any("could not be computed: the beam is bent" in note for note in found.notes)
    buffer = StringIO()
    print_story(found, Console(file=buffer))
    assert "coulomb_friction" in buffer.getvalue()
    write_report(found, tmp_path)
    assert "coulomb_friction" in (tmp_path / "report.html").read_text(encoding="utf-8")
