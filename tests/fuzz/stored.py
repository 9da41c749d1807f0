"""Files of results: their bytes, and the document and the arrays in them."""

import io
import json
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from fuzz import damage
from fuzz.doors import arm
from vpm import Experiment, compare, demo, identify, simulate
from vpm.results import Result


@cache
def good(folder: Path) -> tuple[bytes, ...]:
    """Some results, as files hold them."""
    log = Experiment.load(demo.TRAIN, model=arm())
    log = Experiment(log.name, log.time[:200], log.data[:200], log.channels, log.units)
    run = simulate(arm(), log, "free_run")
    made: list[Result] = [log, run, arm().linearize()]
    made.append(compare(run, log))
    made.append(identify(arm(), log, ["shoulder.friction.viscous"], mode="closed_loop"))
    return tuple(result.save(folder / f"good_{k}.npz").read_bytes() for k, result in enumerate(made))


def result(dice: Random, folder: Path) -> None:
    """A file of a result: read, and shown."""
    content, path = dice.choice(good(folder)), folder / "result.npz"
    path.write_bytes(damage.octets(content, dice) if dice.random() < 0.3 else _rebuilt(content, dice))
    found = Result.load(path)
    str(found)
    found._repr_html_()


def _rebuilt(content: bytes, dice: Random) -> bytes:
    """An archive that is whole, with other content."""
    with np.load(io.BytesIO(content)) as file:
        arrays: dict[str, Any] = {name: file[name] for name in file.files}
    header = damage.document(json.loads(str(arrays["header"])), dice)
    arrays["header"] = np.array(json.dumps(header))
    if dice.random() < 0.3:
        name = dice.choice(sorted(arrays))
        arrays[name] = dice.choice((np.zeros(0), np.full(3, np.nan), np.ones((2, 2, 2)), np.array("x"), np.array(1j)))
    written = io.BytesIO()
    np.savez(written, **arrays)
    return written.getvalue()
