"""Program of a reader in a process of its own: it answers requests, a line of JSON each; see `guarded`.

Its words are ``MODULE CLASS FILE SECONDS BYTES``: the class that reads, the file, and its limits.
"""

import importlib
import json
import os
import sys
from contextlib import suppress
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError
from vpm.experiment.readers.base import Log, reading

Answer = tuple[dict[str, Any], list[NDArray[np.float64]]]


def _limit(seconds: int, space: int) -> None:
    """Limit processor time and memory of the child process, where the system can."""
    try:
        import resource
    except ImportError:
        return
    wanted = {"RLIMIT_CPU": seconds, "RLIMIT_AS": space, "RLIMIT_CORE": 0}
    for name, value in wanted.items():
        what = getattr(resource, name)
        _, most = resource.getrlimit(what)
        least = value if most == resource.RLIM_INFINITY else min(value, most)
        with suppress(ValueError, OSError):  # macOS takes no limit of its memory
            resource.setrlimit(what, (least, most))


def _answer(log: Log, request: dict[str, Any]) -> Answer:
    if "find" in request:
        return {"found": log.find(request["find"])}, []
    if "missing" in request:
        return {"message": str(log.missing(request["missing"], request["channel"]))}, []
    if "read" in request:
        table = log.read(request["read"], request["clock"])
        # Columns of one group share their clock, which is sent once.
        shared = {id(own): own for own in table.clocks.values()}
        places = {name: list(shared).index(id(own)) for name, own in table.clocks.items()}
        told = {"columns": list(table.columns), "clocks": places, "stamps": list(table.stamps), "notes": table.notes}
        return told, [*table.columns.values(), *shared.values()]
    return {"header": log.header, "refused": dict(log.refused), "units": dict(log.units)}, []


def _send(out: BinaryIO, answer: Answer) -> None:
    told, arrays = answer
    out.write(json.dumps({**told, "sizes": [array.size for array in arrays]}).encode() + b"\n")
    for array in arrays:
        out.write(np.ascontiguousarray(array, dtype=np.float64).tobytes())
    out.flush()


def serve(module: str, name: str, path: str, seconds: int, space: int) -> None:
    """Answer requests in the child process until there are no more.

    - ``module``, ``name``: class of the reader
    - ``seconds``, ``space``: limits of processor time, s, and of address space, bytes
    """
    # What libraries print goes nowhere; answers have the pipe for themselves.
    out = os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    _limit(seconds, space)
    log: Log | None = None
    for line in sys.stdin.buffer:
        try:
            with reading(path):
                if log is None:
                    log = getattr(importlib.import_module(module), name)(path)
                answer = _answer(log, json.loads(line))
        except VpmError as error:
            answer = {"error": str(error), "channel": getattr(error, "channel", None)}, []
        _send(out, answer)


if __name__ == "__main__":
    serve(sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]), int(sys.argv[5]))
