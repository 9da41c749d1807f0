"""From a checked document to the core: names become indices, parameters one flat vector.

One core serves all models that differ in parameter values only. It is given the values at every call; what it records
and compiles of the equations then serves every model of the same structure.
"""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError
from vpm.model.body import inertia_described
from vpm.model.checked_document import Checked
from vpm.model.component import Described, Index
from vpm.model.effects import SITES, effect_described, effects_of
from vpm.model.omissions import omissions
from vpm.model.structure import Axis

if TYPE_CHECKING:
    from vpm._core import System
    from vpm.model.model import Model

#: Systems that are kept; each holds what it recorded and compiled.
KEPT = 64

_systems: OrderedDict[str, System] = OrderedDict()
_lock = Lock()


def described(structure: str, theta: NDArray[np.float64]) -> str:
    """Compiled description of a model for the core, as JSON text, from structure and parameter values.

    Minus zeros are zeros there: two models are equal when their descriptions are.
    """
    return f'{{"parameters": {json.dumps((theta + 0.0).tolist(), allow_nan=False)}, {structure.removeprefix("{")}'


def structure_text(checked: Checked) -> str:
    """Compiled description of a model without parameter values, as JSON text.

    Result: everything that is a parameter is an index into ``parameters``; all numbers are SI.
    """
    index = {name: i for i, name in enumerate(checked.parameters)}
    structure, document = checked.structure, checked.document

    def those(section: str) -> list[Described]:
        components: Mapping[str, Any] = getattr(structure.document, section)
        return [entry.described(name, structure, index) for name, entry in components.items()]

    effects = [effect for effect in effects_of(document) if effect.type.site in SITES]
    content = {
        "gravity": list(document.gravity),
        "parameter_names": list(index),
        "bodies": [_body(axis, index) for axis in structure.axes],
        "welds": [
            {"name": name, **structure.frames[name].described(), "inertia": inertia_described(name, index)}
            for name in structure.welds
        ],
        "beams": [structure.document.beams[name].described(name, structure, index) for name in structure.beams],
        "gauges": those("gauges"),
        "markers": those("markers"),
        "lines": those("lines"),
        "effects": [part for effect in effects for part in effect_described(effect, structure, index)],
        "supplies": those("supplies"),
        "actuators": those("actuators"),
        "sensors": those("sensors"),
        "controllers": those("controllers"),
        "contacts": those("contacts"),
        "bushings": those("bushings"),
        "load_cells": those("load_cells"),
    }
    if document.transmissions:  # older programs know no such key
        content["transmissions"] = those("transmissions")
    if document.imus:
        content["imus"] = those("imus")
    if document.loops:
        content["loops"] = those("loops")
    if structure.balls:
        content["balls"] = [{"name": name, "angles": list(map(list, of))} for name, of in structure.balls.items()]
    if not document.velocity_terms:
        content["drop_velocity_terms"] = True
    if omitted := omissions(structure):
        content["omissions"] = omitted
    return json.dumps(_unsigned(content), allow_nan=False)


def _unsigned(value: object) -> object:
    """Content without minus zeros before it is compiled: equal models have equal descriptions."""
    match value:
        case float():
            return value + 0.0
        case list():
            return [_unsigned(item) for item in value]
        case dict():
            return {key: _unsigned(item) for key, item in value.items()}
    return value


def _body(axis: Axis, index: Index) -> Described:
    """Compiled joint with one coordinate, and what it carries."""
    coordinate, frame = axis.coordinate, axis.frame
    kind = {"helical": {"pitch": coordinate.pitch}} if coordinate.kind == "helical" else coordinate.kind
    return {
        "name": axis.carrier,
        "on": frame.mount.described(),
        "joint": {"name": axis.name, "kind": kind, "axis": list(coordinate.direction), **frame.pose.described()},
        "inertia": None if axis.body is None else inertia_described(axis.body, index),
        "rotor_inertia": index.get(f"{axis.name}.rotor_inertia"),
    }


def core_of(structure: str, theta: NDArray[np.float64]) -> System:
    """Compiled system of a structure, as `structure_text` gives it, for the parameters ``theta``."""
    try:
        from vpm._core import System
    except ImportError as error:
        raise VpmError(f"the compiled core of vpm cannot be imported ({error}); reinstall vpm-dynamics") from error
    with _lock:
        known = _systems.get(structure)
        if known is not None:
            _systems.move_to_end(structure)
    if known is not None:
        known.check(theta)
        return known
    system = System(described(structure, theta))
    with _lock:
        _systems[structure] = system
        while len(_systems) > KEPT:
            _systems.popitem(last=False)
    return system


@dataclass(frozen=True)
class Shape:
    """A model of which the structure counts alone: the key of answers that hold whatever the values are."""

    model: Model = field(compare=False)  #: One of those that differ in values only.
    structure: str = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "structure", self.model.structure)
