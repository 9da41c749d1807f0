"""Readers whose libraries do not withstand damaged files: each works in a process of its own, which has limits.

A library with compiled parts may end its process or go round in a loop where a file is damaged. Here that is a
sentence about the file.
"""

import importlib.util
import json
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Timer
from typing import Any
from weakref import finalize

import numpy as np

from vpm.errors import ExperimentError, MissingExtraError
from vpm.experiment.readers.base import Log, broken
from vpm.experiment.readers.clocked import ClockedLog
from vpm.experiment.table import Table
from vpm.numbers import Array

Answer = dict[str, Any]

#: Processor time of a reader, s: to start, and for each byte. The slowest library reads more than 1 MB in a second.
START, PER_BYTE = 20.0, 1e-6
#: By the clock it may take as many times that: other work may share the processor.
PATIENCE = 20.0
#: Address space of a reader, bytes: to start, and for each byte of the file. Files may be compressed.
SPACE, SPACE_PER_BYTE = 4 << 30, 50


class GuardedLog(Log):
    """A log whose reader works in another process.

    ``reader``: the class that reads the file.
    Raises `MissingExtraError`: the library of the reader is not installed.
    Raises `ExperimentError`: the file is broken, its library crashed, or took too much time or memory.
    """

    def __init__(self, path: str | PathLike[str], reader: type[ClockedLog]) -> None:
        if importlib.util.find_spec(reader.package) is None:
            raise MissingExtraError(reader.package, reader.extra)
        super().__init__(path)
        self._kind = reader.kind
        size = Path(path).stat().st_size
        self._seconds = START + PER_BYTE * size
        folder = TemporaryDirectory(prefix="vpm-", ignore_cleanup_errors=True)
        self._child = _started(Path(path), reader, folder.name, self._seconds, SPACE + SPACE_PER_BYTE * size)
        # The reader is ended together with this object, and at the latest with Python.
        finalize(self, _stop, self._child, folder)
        told, _ = self._ask({})
        self.header: tuple[str, ...] = tuple(told["header"])
        self.refused, self.units = told["refused"], told["units"]

    def find(self, column: str) -> str | None:
        """Name of a column as the guarded reader knows it; see `Log.find`."""
        told, _ = self._ask({"find": column})
        found: str | None = told["found"]
        return found

    def missing(self, column: str, channel: str = "") -> ExperimentError:
        """Sentence of the guarded reader on a column that is not there; see `Log.missing`."""
        told, _ = self._ask({"missing": column, "channel": channel})
        return self.error(told["message"], channel)

    def _read(self, columns: Sequence[str], clock: str) -> Table:
        """Columns by name from the guarded process; see `Log.read`."""
        told, arrays = self._ask({"read": list(columns), "clock": clock})
        names: list[str] = told["columns"]
        found, own = dict(zip(names, arrays, strict=False)), arrays[len(names) :]
        clocks = {column: own[place] for column, place in told["clocks"].items()}
        return Table(self.header, found, None, frozenset(told["stamps"]), clocks, tuple(told["notes"]))

    def _ask(self, request: Answer) -> tuple[Answer, list[Array]]:
        """Answer of the guarded reader: a line of JSON, then the numbers of its arrays.

        Raises `ExperimentError`: it says so, or it is no longer there.
        """
        child = self._child
        watch = Timer(PATIENCE * self._seconds, child.kill)
        watch.start()
        try:
            told, arrays = _exchange(child, request)
        except (OSError, ValueError, KeyError, TypeError):  # it ended before or within its answer
            raise broken(self.path, self._kind, self._end(_ended(child))) from None
        finally:
            watch.cancel()
        if "error" in told:
            raise self.error(told["error"], told.get("channel") or "")
        return told, arrays

    def _end(self, code: int) -> str:
        """Sentence on why the guarded process ended: out of time, or by a signal."""
        if code in {-getattr(signal, "SIGXCPU", 0), -getattr(signal, "SIGKILL", 0)}:
            by_clock = PATIENCE * self._seconds
            return f"reading took more than {self._seconds:.0f} s of processor time, or {by_clock:.0f} s by the clock"
        name = signal.Signals(-code).name if code < 0 else f"code {code}"
        return f"its library ended with {name}"


def _started(
    path: Path, reader: type[ClockedLog], folder: str, seconds: float, space: float
) -> subprocess.Popen[bytes]:
    """Guarded process of a reader, with a folder of its own that is removed after it."""
    found = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "TMPDIR": folder, "TEMP": folder, "TMP": folder}
    alone = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "NUMEXPR_MAX_THREADS": "1"}
    command = [sys.executable, "-P", "-m", "vpm.experiment.readers.child", reader.__module__, reader.__name__]
    return subprocess.Popen(  # noqa: S603  # its own module
        [*command, str(path), str(int(seconds)), str(int(space))],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **found, **alone},
    )


def _exchange(child: subprocess.Popen[bytes], request: Answer) -> tuple[Answer, list[Array]]:
    if child.stdin is None or child.stdout is None:
        raise OSError
    child.stdin.write(json.dumps(request).encode() + b"\n")
    child.stdin.flush()
    told: Answer = json.loads(child.stdout.readline())
    arrays = [np.frombuffer(child.stdout.read(8 * size), dtype=np.float64) for size in told["sizes"]]
    if [array.size for array in arrays] != told["sizes"]:
        raise ValueError
    return told, arrays


def _ended(child: subprocess.Popen[bytes]) -> int:
    """Exit code of a guarded reader whose answer broke off."""
    try:
        return child.wait(5.0)
    except subprocess.TimeoutExpired:
        child.kill()
        return child.wait()


def _stop(child: subprocess.Popen[bytes], folder: TemporaryDirectory[str]) -> None:
    child.kill()
    with child:  # waits, and closes its pipes
        pass
    folder.cleanup()
