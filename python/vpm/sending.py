"""Work for other processes and machines, as bytes: models go as the text of a file, records as the path of theirs.

What comes to a worker was made by the program that it works for: an executor hands over functions just so.
"""

from __future__ import annotations

import hashlib
import io
import os
import pickle
import socket
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from threading import Lock
from traceback import format_exc
from typing import Any, Literal

from vpm.catalogue import adopt, registered
from vpm.errors import ExecutorError
from vpm.experiment import Experiment
from vpm.files import exists
from vpm.one_thread import ONE_THREAD

_LOCK = type(Lock())
#: What pickling raises of what it cannot write.
_UNSENT = (pickle.PicklingError, AttributeError, TypeError, RecursionError)

#: How a task ended on a worker: with a value, with an error of its own, refused before it began, or by Ctrl-C.
Ending = Literal["value", "error", "refused", "interrupted"]


def packed(work: Callable[[], object]) -> bytes:
    """Work to send as bytes for `run_packed`, with effects that this program added to the catalogue.

    ``work``: a function of a module, or a `functools.partial` of one.
    """
    return pickle.dumps((registered(), _sendable(work)))


def run_packed(their_version: str, folders: Sequence[str], content: bytes, attempt: int) -> tuple[Ending, bytes | str]:
    """Do sent work; what a worker runs.

    Linear algebra has one thread here: cores are for tasks side by side.

    - ``their_version``: of vpm where the work was packed
    - ``folders``: folders of modules that the work is made of, beside those that are installed
    - ``attempt``: so that an executor that remembers answers to the same call does not answer another attempt by an old
      one

    - result ``ending``: one of "value", "error", "refused", "interrupted"
    - result ``bytes or str``: the value or the error for `unpacked`, or the sentence why the work was refused
    """
    del attempt
    if (refusal := _refusal(their_version, folders)) is not None:
        return "refused", refusal
    try:
        effects, inside = pickle.loads(content)  # noqa: S301  see above
        adopt(effects)
        work = pickle.loads(inside)  # noqa: S301
    except ImportError as error:
        return "refused", f"the worker {worker()} cannot read the task ({error}); install there what is installed here"
    except ExecutorError as error:
        return "error", _pickled(error)
    try:
        with ONE_THREAD:
            value = work()
        return "value", _pickled(value)
    except KeyboardInterrupt:
        return "interrupted", ""
    except Exception as error:  # noqa: BLE001  the error is the answer, whatever it is
        error.add_note(f"On the worker {worker()}:\n{format_exc()}")
        return "error", _error(error)


@dataclass(frozen=True)
class Parcel:
    """Something that several tasks share, as bytes: it is pickled once, and each of them opens its own."""

    content: bytes

    @classmethod
    def of(cls, thing: object) -> Parcel:
        """Parcel to send: something pickled; records go by the path of their file.

        Raises `ExecutorError`: a part of it cannot be pickled.
        """
        return cls(_sendable(thing))

    def open(self) -> Any:  # noqa: ANN401  whatever was put into it
        """Object in a sent parcel."""
        return pickle.loads(self.content)  # noqa: S301  see above


def unpacked(answer: bytes) -> Any:  # noqa: ANN401  whatever the task gives
    """Result that `run_packed` sent as bytes."""
    return pickle.loads(answer)  # noqa: S301  see above


@cache
def vpm_version() -> str:
    """Version of vpm for sent work; "unknown" where it is not installed as a package."""
    try:
        return version("vpm-dynamics")
    except PackageNotFoundError:
        return "unknown"


def worker() -> str:
    """Host and process that does the sent work."""
    return f"{socket.gethostname()} (process {os.getpid()})"


def _refusal(their_version: str, folders: Sequence[str]) -> str | None:
    """Why no sent work is done here; None where nothing speaks against it."""
    if their_version != vpm_version():
        return (
            f"the worker {worker()} has vpm {vpm_version()}, and the program that gives it work has vpm "
            f"{their_version}; install the same version on both sides"
        )
    for folder in folders:
        if not Path(folder).is_dir():
            return f"the worker {worker()} sees no folder {folder}; put it where all workers see it under this name"
        if folder not in sys.path:
            sys.path.insert(0, folder)
    return None


class _Packer(pickle.Pickler):
    """Pickles records that stand in files as the way to read them again, where ``by_path``, and locks as new ones."""

    def __init__(self, file: io.BytesIO, *, by_path: bool) -> None:
        super().__init__(file, protocol=pickle.HIGHEST_PROTOCOL)
        self._by_path = by_path

    def reducer_override(self, thing: object) -> Any:  # noqa: ANN401  as pickle has it
        if isinstance(thing, _LOCK):
            return Lock, ()
        if self._by_path and isinstance(thing, Experiment) and thing.path is not None and exists(thing.path):
            place = str(Path(thing.path).absolute())
            return _read, (type(thing), thing.path, place, dict(thing.reading or {}), _digest(thing))
        return NotImplemented


def _sendable(thing: object) -> bytes:
    try:
        return _pickled(thing, by_path=True)
    except _UNSENT as error:
        raise ExecutorError(
            f"a task cannot be sent to another process, because a part of it cannot be pickled ({error}); give "
            "functions and settings that stand in a module, or a ThreadPoolExecutor, which sends nothing"
        ) from error


def _pickled(thing: object, *, by_path: bool = False) -> bytes:
    file = io.BytesIO()
    _Packer(file, by_path=by_path).dump(thing)
    return file.getvalue()


def _error(error: Exception) -> bytes:
    """Error to send as bytes, with all that it carries where possible."""
    try:
        content = _pickled(error)
        pickle.loads(content)  # noqa: S301  an error may be written and not read: its class wants more than a sentence
    except Exception:  # noqa: BLE001  see above
        return _pickled(RuntimeError(f"{type(error).__name__}: {error}"))
    return content


def _read(kind: type[Experiment], called: str, place: str, how: Mapping[str, Any], digest: str) -> Experiment:
    """Record in a file, if it is the one that was sent; it knows its path as it was ``called``."""
    repair = "or send its numbers, with record.renamed(record.name)"
    if not exists(place):
        raise ExecutorError(
            f"the worker {worker()} sees no file {place}; put it where all workers see it under this name, {repair}",
            worker=worker(),
            path=place,
        )
    record = kind.load(place, **how)
    if _digest(record) != digest:
        raise ExecutorError(
            f"the worker {worker()} reads other numbers in {place} than were read here; give all workers the same "
            f"file, {repair}",
            worker=worker(),
            path=place,
        )
    record.__dict__["path"] = called
    return record


def _digest(record: Experiment) -> str:
    """Checksum of a record to be sent."""
    content = hashlib.sha256(repr((record.name, record.channels, record.units, record.data.shape)).encode())
    content.update(record.time.tobytes())
    content.update(record.data.tobytes())
    return content.hexdigest()
