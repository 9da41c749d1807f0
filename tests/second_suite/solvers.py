"""Solvers that can be scored: each answers with the (effect, site) of what is missing."""

import importlib
import importlib.util

import vpm
from second_suite.score import Named, Solver
from vpm import Experiment, Model


def diagnose(model: Model, train: list[Experiment], holdout: list[Experiment]) -> list[Named]:
    """`vpm.diagnose`, on one core."""
    why = vpm.diagnose(model, train, holdout, workers=1)
    return [(effect.name, effect.site) for effect in why.effects]


def rank(model: Model, train: list[Experiment], holdout: list[Experiment]) -> list[Named]:
    """`vpm.ranking.rank`, on one core; it weighs evidence, so all records are its own."""
    ranking = importlib.import_module("vpm.ranking").rank(model, [*train, *holdout], workers=1)
    return [(one.effect, one.site) for one in ranking.effects]


def found(name: str) -> Solver:
    """A solver by its name here, or by the dotted name of any function of this kind."""
    if name == "rank" and importlib.util.find_spec("vpm.ranking") is None:
        raise SystemExit(f"there is no vpm.ranking in the vpm of {vpm.__file__}; choose another solver or another vpm")
    if name in {"diagnose", "rank"}:
        return {"diagnose": diagnose, "rank": rank}[name]
    module, _, function = name.rpartition(".")
    solver: Solver = getattr(importlib.import_module(module), function)
    return solver
