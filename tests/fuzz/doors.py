"""Models, scenarios and compiled models: how they are damaged, and what has to hold of what vpm makes of them."""

import json
import math
import tomllib
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import tomli_w

from fuzz import damage
from vpm import Model, Simulation, demo
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
