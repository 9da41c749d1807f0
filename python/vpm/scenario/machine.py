"""The machine of a run: its model file, with level of detail, effects and parameter values changed."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from vpm.errors import ModelError, near_match
from vpm.files import unreadable
from vpm.model import Model
from vpm.model.messages import place
from vpm.model.writer import plain
from vpm.scenario.messages import Keys, refuse
from vpm.scenario.schema import Given, RunEntry, si_value


def machines(entries: tuple[RunEntry, ...], folder: Path) -> Mapping[str, Model]:
    """Model of each run, by the name of the run; a file that several runs name is read once.

    ``folder``: folder of the scenario file, from where the paths of model files lead.
    Raises `ScenarioError`: two runs have one name; a model file is not there; an effect, a level or a parameter does
    not fit the model.
    Raises `ModelError`: a model file is wrong; the message names it.
    """
    found: dict[str, Model] = {}
    load = cache(_built)
    for number, entry in enumerate(entries):
        keys = ("runs", number)
        if entry.name in found:
            refuse((*keys, "name"), f'is "{entry.name}", which another run is called already; give it another name')
        path = folder / entry.model
        if reason := unreadable(path):
            refuse((*keys, "model"), f"cannot be read: {reason}")
        if not path.is_file():
            nearby = sorted(file.name for file in folder.glob("*.toml"))
            repair = near_match(entry.model, nearby, what="the files beside the scenario are")
            refuse((*keys, "model"), f'is "{entry.model}", and there is no file {path}; {repair}')
        found[entry.name] = _changed(load(str(path)), entry, keys)
    return found


def _built(path: str) -> Model:
    """Model with its core, which models that differ in parameter values share."""
    model = Model.load(path)
    _ = model.core
    return model


def _changed(model: Model, entry: RunEntry, keys: Keys) -> Model:
    if entry.level is not None:
        try:
            model = model.at(entry.level)
        except ModelError as error:
            refuse((*keys, "level"), f"cannot be: {error}")
    model = _with_effects(model, entry, keys)
    values = {name: _value(model, name, given, (*keys, "set", name)) for name, given in entry.set.items()}
    try:
        return model.with_parameters(values) if values else model
    except ModelError as error:
        refuse((*keys, "set"), f"cannot be: {error}")


def _with_effects(model: Model, entry: RunEntry, keys: Keys) -> Model:
    """Model with the effects of a run, checked as those of a model file; their places are told in the scenario."""
    if not entry.with_effects:
        return model
    content: dict[str, Any] = model.to_dict()
    present = len(content.setdefault("effects", []))
    content["effects"] += [plain(effect) for effect in entry.with_effects]
    try:
        return type(model).from_dict(content)
    except ModelError as error:
        sentence = str(error)
        for number in range(len(entry.with_effects)):
            sentence = sentence.replace(f"effects[{present + number}]", place(*keys, "with_effects", number))
        head, _, rest = sentence.partition(" ")
        refuse(head, rest)


def _value(model: Model, name: str, given: Given, keys: Keys) -> float:
    """SI value of a parameter of the model."""
    if name not in model.parameters:
        repair = near_match(name, model.parameters, what="it has")
        refuse(keys, f"is no parameter of {model.name}; {repair}")
    return si_value(given, model.parameters[name].unit, keys)
