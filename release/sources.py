"""What a wheel is made from, as one number, and the wheel that is made from what stands here.

::

    python release/sources.py          # the number, which each wheel carries as vpm/sources.txt
    python release/sources.py dist     # the wheel in a folder for this machine and these sources; exit code 1 for none

Needs nothing but Python.
"""

import platform
import sys
import zipfile
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STAMP = "vpm/sources.txt"
TOP = ("Cargo.toml", "Cargo.lock", "pyproject.toml", "README.md", "LICENSE*")
PARTS = (*TOP, "crates/vpm-core/**/*", "crates/vpm-py/**/*", "crates/vpm-studies/**/*", "python/vpm/**/*")
#: Beginnings of names of platforms in wheels, by what Python calls the system.
SYSTEMS = {"linux": ("manylinux", "linux"), "darwin": ("macosx",), "win32": ("win",)}


def files(root: Path = ROOT) -> Iterator[Path]:
    """Everything that goes into a wheel, or that its core is compiled from."""
    for part in PARTS:
        for path in sorted(root.glob(part)):
            made = "__pycache__" in path.parts or path.suffix in {".so", ".pyd", ".dylib"} or path.name == "sources.txt"
            if path.is_file() and not made:
                yield path


def digest(root: Path = ROOT) -> str:
    """Number of the sources: names and contents."""
    whole = sha256()
    for path in files(root):
        content = path.read_bytes()
        whole.update(f"{path.relative_to(root).as_posix()} {len(content)}\n".encode() + content)
    return whole.hexdigest()


def fits_machine(wheel: Path) -> bool:
    """Whether the tags of a wheel are those of this interpreter and machine; pip looks closer when it installs."""
    python, abi, platforms = wheel.stem.split("-")[-3:]
    version = python.removeprefix("cp3")
    if platform.python_implementation() != "CPython" or abi != "abi3" or not version.isdigit():
        return False
    systems, machine = SYSTEMS.get(sys.platform, ()), platform.machine().lower()
    tags = [tag for tag in platforms.split(".") if tag.startswith(systems) and tag.endswith((machine, "universal2"))]
    return bool(tags) and sys.version_info >= (3, int(version))


def stamped(wheel: Path) -> str:
    """Number of the sources that a wheel was made from; "" where it does not say so."""
    try:
        with zipfile.ZipFile(wheel) as archive:
            return archive.read(STAMP).decode().strip()
    except (KeyError, OSError, UnicodeDecodeError, zipfile.BadZipFile):
        return ""


def fitting(folder: Path, root: Path = ROOT) -> Path | None:
    """The wheel for this machine that was made from these sources; None where there is none."""
    wheels = [wheel for wheel in sorted(folder.glob("vpm_dynamics-*.whl")) if fits_machine(wheel)]
    ours = digest(root) if wheels else ""
    return next((wheel for wheel in wheels if stamped(wheel) == ours), None)


if __name__ == "__main__":
    if sys.argv[1:]:
        found = fitting(Path(sys.argv[1]))
        if found is None:
            sys.exit(1)
        print(found)
    else:
        print(digest())
