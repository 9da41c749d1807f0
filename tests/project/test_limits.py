"""Limits of the tests themselves: what goes beyond them fails by name, the run goes on, and nothing is left running."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from guard import MARK
from stalls import below, processes, watched

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")

TESTS = Path(__file__).resolve().parents[1]
SUPPORT = TESTS / "support"
CONFTEST = """
import sys
sys.path.insert(0, {support!r})
from limits import Limits

def pytest_configure(config):
    config.pluginmanager.register(Limits({processor}, {looks}))
"""
BURN = [sys.executable, "-c", "while True: pass"]
#: A program whose own program goes on without it.
NEST = [sys.executable, "-c", f"import subprocess\nsubprocess.Popen({BURN!r})\nwhile True: pass"]


def run(folder: Path, text: str, *words: str, processor: float = 600.0, looks: int = 6000) -> list[str]:
    """Command of a run of tests with limits."""
    text = f"import subprocess, sys, time\nimport pytest\nBURN, NEST = {BURN!r}, {NEST!r}\n{text}"
    (folder / "conftest.py").write_text(CONFTEST.format(support=str(SUPPORT), processor=processor, looks=looks))
    (folder / "test_inner.py").write_text(text)
    return [sys.executable, "-m", "pytest", "-q", "-rfE", "--rootdir", str(folder), "-p", "no:cacheprovider", *words]


def said(folder: Path, command: list[str]) -> str:
    environment = {**os.environ, "COLUMNS": "200"}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False).stdout


def begun_below(process: subprocess.Popen[bytes], count: int) -> list[int]:
    """Processes that burn, once there are so many."""
    while len(found := [n for n in below(process.pid, processes()) if burns(n)]) < count:
        assert process.poll() is None
        time.sleep(0.05)
    return found


def burns(number: int) -> bool:
    return does(number, b"while True: pass")


def does(number: int, what: bytes) -> bool:
    try:
        return what in Path(f"/proc/{number}/cmdline").read_bytes()
    except OSError:
        return False


BEYOND = """
def test_before(): pass
def test_burns():
    while True: pass
def test_waits_for_a_program_that_burns():
    with subprocess.Popen(NEST) as process: process.communicate()
@pytest.fixture
def burning():
    while True: pass
def test_of_a_fixture(burning): pass
def test_after(): pass
"""


@pytest.mark.parametrize("words", [(), ("-n", "1")], ids=["alone", "beside"])
def test_too_much_processor_time_fails_by_name_and_the_run_goes_on(tmp_path: Path, words: tuple[str, ...]) -> None:
    told = said(tmp_path, run(tmp_path, BEYOND, *words, processor=1.5))
    for name in ("test_burns", "test_waits_for_a_program_that_burns"):
        assert f"FAILED test_inner.py::{name} - Failed: took more than 1.5 s of processor time" in told
    assert "ERROR test_inner.py::test_of_a_fixture - Failed: took more than 1.5 s of processor time" in told
    assert "2 failed, 2 passed, 1 error" in told


def test_what_waits_for_nothing_fails_by_name(tmp_path: Path) -> None:
    text = "import threading\ndef test_waits(): threading.Event().wait()"
    told = said(tmp_path, run(tmp_path, f"{text}\ndef test_after(): pass", looks=2))
    assert "FAILED test_inner.py::test_waits - Failed: stood still in 2 looks" in told
    assert "1 failed, 1 passed" in told


def test_a_program_that_waits_for_nothing_is_ended_with_its_own() -> None:
    wait = [sys.executable, "-c", "import threading; threading.Event().wait()"]
    both = f"import subprocess\nsubprocess.run({wait!r})"
    assert watched([sys.executable, "-c", both], looks=30, period=0.1) == 124
    for _ in range(100):  # one that was killed is there until somebody has taken its end
        if not (left := any(does(number, b"threading.Event().wait()") for number in processes())):
            break
        time.sleep(0.1)
    assert not left


def test_a_program_that_works_is_left_alone() -> None:
    works = "import sys, time\nwhile time.process_time() < 4.0: pass\nsys.exit(3)"
    # In these looks it works for less than it takes, and on a busy machine for a small part of that.
    assert watched([sys.executable, "-c", works], looks=30, period=0.1, waiting=0.05) == 3


def test_what_a_test_starts_ends_with_it(tmp_path: Path) -> None:
    text = """
def test_starts(): test_starts.process = subprocess.Popen(BURN)
def test_after(): assert test_starts.process.wait() == -9
"""
    assert "2 passed" in said(tmp_path, run(tmp_path, text))


@pytest.mark.parametrize("words", [(), ("-n", "1")], ids=["alone", "beside"])
def test_nothing_is_left_of_a_run_that_is_killed(tmp_path: Path, words: tuple[str, ...]) -> None:
    command = run(tmp_path, "def test_starts(): subprocess.run(NEST)", *words)
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL) as process:
        left = begun_below(process, 2)
        process.kill()
    while any(burns(number) for number in left):
        time.sleep(0.05)


@pytest.fixture
def deaf() -> Iterator[None]:
    """Programs start as a shell without job control starts them in the background."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("deaf")
def test_programs_of_a_run_in_the_background_hear_ctrl_c(tmp_path: Path) -> None:
    (tmp_path / "test_inner.py").write_text(
        "import signal, subprocess, sys\n"
        "def test_hears():\n"
        "    program = 'import signal; print(signal.getsignal(signal.SIGINT) is signal.default_int_handler)'\n"
        "    assert subprocess.check_output([sys.executable, '-c', program]) == b'True\\n'\n"
    )
    words = ["-q", "-n", "1", "--confcutdir", str(TESTS), "-p", "conftest", "-p", "no:cacheprovider"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(TESTS), str(SUPPORT)))}
    environment.pop(MARK)
    command = [sys.executable, "-m", "pytest", *words, "--rootdir", str(tmp_path), str(tmp_path)]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert "1 passed" in done.stdout
