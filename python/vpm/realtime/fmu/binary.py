"""The shared library of an FMU, by the C compiler of this machine."""

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from vpm.errors import SimulationError

_SYSTEMS = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib"), "win32": ("windows", ".dll")}
_PROCESSORS = {"amd64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
#: In C99 mode compilers contract no operations, so that all machines round alike.
_OPTIONS = ("-std=c99", "-fPIC", "-shared", "-fvisibility=hidden", "-DFMI3_OVERRIDE_FUNCTION_PREFIX=1")
#: Characters of a source that are optimised in seconds; larger ones, of links with many coordinates, take minutes.
_LARGE = 500_000


def compiler() -> str | None:
    """C compiler for an FMU's binary: what ``CC`` names, or ``cc``."""
    return shutil.which(os.environ.get("CC") or "cc")


def platform_name() -> tuple[str, str] | None:
    """Platform of an FMU's binary, such as ``"x86_64-linux"``, and how its libraries end; or None."""
    system = _SYSTEMS.get(sys.platform)
    processor = _PROCESSORS.get(platform.machine().lower())
    return None if system is None or processor is None else (f"{processor}-{system[0]}", system[1])


def shared_library(sources: dict[str, str], files: list[str]) -> bytes:
    """Compile sources into an FMU's binary, a shared library.

    Parameters
    ----------
    sources : dict of str to str
        Texts by file name.
    files : list of str
        Which of them are compiled.

    Raises
    ------
    SimulationError
        The compiler fails; the message has what it says first.
    """
    command = compiler()
    if command is None:
        raise SimulationError("there is no C compiler `cc` here for the FMU's library; install one, or leave it out")
    optimise = "-O2" if sum(map(len, sources.values())) <= _LARGE else "-O1"
    with TemporaryDirectory() as place:
        folder = Path(place)
        for name, text in sources.items():
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
        words = [command, *_OPTIONS, optimise, *files, "-o", "library", "-lm"]
        try:
            done = subprocess.run(  # noqa: S603 - the compiler that the user has
                words, cwd=folder, capture_output=True, text=True, errors="replace", check=False
            )
        except OSError as error:
            raise SimulationError(f"the C compiler {command} does not start ({error}); install another") from error
        if done.returncode != 0:
            first = next((line for line in done.stderr.splitlines() if "error" in line), "it says nothing")
            raise SimulationError(
                f"the C compiler {command} fails ({first.strip()[:200]}); install another, or leave it out"
            )
        return (folder / "library").read_bytes()
