"""The doors of vpm: what is damaged, how it is given to vpm, and what has to hold of what comes out."""

from __future__ import annotations

import json
import math
import tomllib
import warnings
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray
from scipy.io import savemat

from fuzz import damage
from vpm import Experiment, Model, Simulation, demo, simulate
from vpm._core import Simulation as CoreSimulation
from vpm._core import System
from vpm.realtime import compile_model
from vpm.scenario import Scenario

EXAMPLES = Path(__file__).parents[2] / "examples"
MODELS = (
    *("emps/model", "arm/arm", "wrist/wrist", "maxwell_narx/strut", "crane/crane", "hyl/rcm_springs"),
    *("hyl/hydraulic", "tudor/tudor", "servo_cylinder/rig", "flexible_pendulum/flexible_pendulum"),
)
SCENARIOS = ("emps/step", "flexible_pendulum/release")
#: Rows of the log that is damaged.
ROWS = 120


class NotFiniteError(Exception):
    """A result holds a number that is none."""


def finite(what: str, *values: Any) -> None:
    """Complain about NaN in a result."""
    for value in values:
        if np.isnan(np.asarray(value, dtype=np.float64)).any():
            raise NotFiniteError(f"{what} holds NaN")


@cache
def content(name: str) -> dict[str, Any]:
    """Content of an example."""
    return tomllib.loads((EXAMPLES / f"{name}.toml").read_text(encoding="utf-8"))


@cache
def arm() -> Model:
    """The model of the demo."""
    return Model.load(demo.MODEL)


@cache
def described(name: str) -> dict[str, Any]:
    """A model as `vpm compile` writes it."""
    compiled: dict[str, Any] = json.loads(compile_model(Model.load(EXAMPLES / f"{name}.toml"), 1000.0).text)
    return compiled


@cache
def files(folder: Path) -> dict[str, bytes]:
    """The same log in each format."""
    time: NDArray[np.float64] = 0.002 * np.arange(ROWS, dtype=np.float64)
    columns = {"time": time, "q": np.sin(time), "u": np.cos(time)}
    (folder / "good.csv").write_text(
        "time,q,u\n" + "\n".join(f"{t:.6g},{q:.6g},{u:.6g}" for t, q, u in zip(*columns.values(), strict=True)),
        encoding="utf-8",
    )
    savemat(folder / "good.mat", {**columns, "log": {"name": "arm", "v": np.ones((ROWS, 2))}})
    Experiment("made", time, np.column_stack([columns["q"], columns["u"]]), ("q", "u"), ("1", "1")).save(
        folder / "good.npz"
    )
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq

        pq.write_table(pa.table(columns), folder / "good.parquet")
    except ImportError:
        pass
    try:
        import h5py

        with h5py.File(folder / "good.h5", "w") as file:
            for name, column in columns.items():
                file[name] = column
    except ImportError:
        pass
    return {path.suffix: path.read_bytes() for path in folder.glob("good.*")}


def model(dice: Random, _: Path) -> None:
    """A model file: what it answers about one state, and some steps."""
    name = dice.choice(MODELS)
    changed = damage.document(content(name), dice)
    try:
        text = tomli_w.dumps(changed)
    except (TypeError, ValueError):  # what no file can hold may still be given as a mapping
        found = Model.from_dict(changed)
    else:
        found = Model.from_toml(
            damage.octets(text.encode(), dice).decode("utf-8", "replace") if dice.random() < 0.2 else text
        )
    still = np.zeros(len(found.coordinates))
    finite("mass_matrix", found.mass_matrix(still))
    finite("inverse_dynamics", found.inverse_dynamics(still, still, still))
    finite("energy", found.energy(still, still))
    finite("equilibrium", *found.equilibrium(still[: len(found.joints)]))
    if len(found.coordinates) < 10:
        finite("linearize", found.linearize().A)
    run = Simulation(found, dice.choice((1e-3, 1e-3, 1e-9, 1.0)))
    for _step in range(3):
        finite("step", run.step(np.zeros(len(found.inputs))))


def log(dice: Random, folder: Path) -> None:
    """A log: read, and a simulation along it."""
    how: Any = dice.choice(("error", "interpolate"))
    if dice.random() < 0.5:
        rows = demo.TRAIN.read_text(encoding="utf-8").splitlines()[:ROWS]
        path, machine = folder / "log.csv", arm()
        path.write_bytes(damage.table("\n".join(rows), dice).encode("utf-8", "replace"))
    else:
        known = files(folder)
        ending, machine = dice.choice(sorted(known)), None
        path = folder / f"log{ending}"
        path.write_bytes(damage.octets(known[ending], dice))
    record = Experiment.load(path, model=machine, irregular=how)
    finite("record", record.time, record.data)
    if machine is not None and dice.random() < 0.3:
        finite("run", simulate(machine, record, dice.choice(("free_run", "inverse_dynamics", "restarts"))).values)


def scenario(dice: Random, _: Path) -> None:
    """A scenario: read and run."""
    name = dice.choice(SCENARIOS)
    changed = damage.document({**content(name), "duration": 0.02}, dice)
    result = Scenario.from_dict(changed, folder=(EXAMPLES / name).parent).run()
    finite("scenario", *(run.values for run in result.runs.values()))


def compiled(dice: Random, _: Path) -> None:
    """A compiled model, as the core reads it."""
    whole = described(dice.choice(MODELS[:4]))
    changed, count = damage.document(whole, dice), len(whole["inputs"])
    description = changed.get("description")
    system = System(json.dumps(description))
    theta = np.array(_numbers(description, "parameters"))
    run = CoreSimulation(system, theta, np.array(_numbers(changed, "start")), 1e-3, 1, "linearly_implicit")
    for _step in range(3):
        finite("step", run.step(np.zeros(count)))


def _numbers(owner: Any, key: str) -> list[float]:
    """Numbers as the core would read them; others never come as far."""
    found = owner[key] if isinstance(owner, dict) and key in owner else []
    good = isinstance(found, list) and all(isinstance(x, int | float) and abs(x) < 1e300 for x in found)
    return [float(x) for x in found] if good else [math.nan]


DOORS: dict[str, Callable[[Random, Path], None]] = {
    "model": model,
    "log": log,
    "scenario": scenario,
    "compiled": compiled,
}
SHARES = (40, 40, 10, 10)


def case(seed: int, folder: Path) -> Iterator[str]:
    """One case: yields the name of its door, then goes through it."""
    dice = Random(seed)
    (name,) = dice.choices(tuple(DOORS), SHARES)
    yield name
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        DOORS[name](dice, folder)
