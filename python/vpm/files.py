"""Files on the disk: what may be read, and how a file is written so that nothing is lost.

A file is written beside its place and then moved into it: whatever happens, there is the old file or the new one.
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path
from tempfile import TemporaryFile
from uuid import uuid4

from vpm.errors import VpmError

#: Bytes that a probe writes: a disk with no more room than this is full.
PROBE = 1 << 16


class FileError(VpmError):
    """A file cannot be written where it was asked for.

    Attributes
    ----------
    path : str
        The file or folder.
    """

    def __init__(self, message: str, *, path: str = "") -> None:
        super().__init__(message)
        self.path = path


@contextmanager
def replacing(path: str | PathLike[str]) -> Iterator[Path]:
    """Place beside a file to write to: it becomes the file when the block ends well, and is removed when it does not.

    ``path``: a link stays a link, and a device such as ``/dev/null`` is written to where it is.

    Yields
    ------
    pathlib.Path
        Of the same ending.

    Raises
    ------
    FileError
        The place cannot be written to; what was there is there still.
    """
    beside = target = Path(path)
    try:
        beside = target = _linked(path)
        _check_place(target)
        if not target.exists() or target.is_file():
            # Not named after the file, whose name may be as long as names can be.
            beside = target.with_name(f".vpm-{uuid4().hex}{target.suffix[:16]}")
        yield beside
        if beside is not target:
            _settle(beside, target)
    except OSError as error:
        raise _unwritable(path, error) from error
    finally:
        if beside is not target:
            with suppress(OSError):
                beside.unlink(missing_ok=True)


def write_text(path: str | PathLike[str], text: str) -> Path:
    """Write a text file in UTF-8, or leave what is there; lines end as they do in the text.

    Raises
    ------
    FileError
        The place cannot be written to.
    """
    with replacing(path) as beside:
        beside.write_text(text, encoding="utf-8", newline="\n")
    return Path(path)


def make_folder(path: str | PathLike[str]) -> Path:
    """Make a folder for files, and those above it, where they are not there."""
    try:
        _linked(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unwritable(path, error) from error
    return Path(path)


def probe_file(path: str | PathLike[str]) -> None:
    """Complain, before work begins, about a file that could not be written after it."""
    try:
        target = _linked(path)
        _check_place(target)
        if not target.exists() or target.is_file():
            _probe(target.parent)
        else:
            with target.open("wb") as device:
                device.write(bytes(PROBE))
    except OSError as error:
        raise _unwritable(path, error) from error


def probe_folder(path: str | PathLike[str]) -> None:
    """Refuse, before work begins, a folder for files that could not be made or filled after it."""
    try:
        target = _linked(path)
        there = next(folder for folder in (target, *target.parents) if folder.exists())
        if not there.is_dir():
            raise NotADirectoryError(0, f"{there} is a file")
        _probe(there)
    except OSError as error:
        raise _unwritable(path, error) from error


def exists(path: str | PathLike[str]) -> bool:
    """Whether there is a file or a folder of this name; what can be no name is none."""
    try:
        return Path(path).exists()
    except (OSError, ValueError):
        return False


def unreadable(path: str | PathLike[str]) -> str:
    """Why a path cannot be read as a file, with the repair; "" where it is an ordinary file, a folder, or not there.

    A pipe would be waited for without end, and a device may never end.
    """
    file = Path(path)
    try:
        if not file.exists() or file.is_file() or file.is_dir():
            return ""
    except (OSError, ValueError) as error:  # a name that is too long, or that holds a zero
        return f"{str(path)[:80]!r} is no name of a file ({getattr(error, 'strerror', None) or error}); correct it"
    return f"{path} is a pipe or a device, which cannot be read as a file; save its content to a file and name that"


def _linked(path: str | PathLike[str]) -> Path:
    """File where links lead to, which need not be there."""
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise OSError(0, "its links lead round in a circle")
    return target


def _check_place(target: Path) -> None:
    if target.is_dir():
        raise IsADirectoryError(0, "it is a folder")
    if target.exists() and not (target.is_file() or target.is_char_device()):
        raise OSError(0, "it is a pipe or a device")
    if target.is_file() and not os.access(target, os.W_OK):
        raise PermissionError(0, "the file is write-protected")


def _probe(folder: Path) -> None:
    # A file without a name: nothing is left behind, even by a kill.
    with TemporaryFile(dir=folder) as file:
        file.write(bytes(PROBE))
        file.flush()
        os.fsync(file.fileno())


def _settle(beside: Path, target: Path) -> None:
    """Move a written file into its place, once the disk has all of it."""
    with beside.open("rb+") as file:
        os.fsync(file.fileno())
    if target.exists():
        shutil.copymode(target, beside)
    beside.replace(target)


def _unwritable(path: str | PathLike[str], error: OSError) -> FileError:
    reason = error.strerror or str(error)
    return FileError(
        f"{path} cannot be written ({reason[:1].lower()}{reason[1:]}); free its place or name another", path=str(path)
    )
