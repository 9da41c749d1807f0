"""The stub of the compiled module says what the compiled module has."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def stubtest(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mypy.stubtest", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_stub_agrees_with_the_compiled_module() -> None:
    done = stubtest("--mypy-config-file", "pyproject.toml", "vpm._core", folder=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr


def test_package_is_marked_as_typed() -> None:
    assert (ROOT / "python" / "vpm" / "py.typed").is_file()
