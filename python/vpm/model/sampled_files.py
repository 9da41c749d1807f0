"""Drives in sampled time and reduced solids that stand in files of their own: the numbers take the place of the name.

A model is complete in itself then: it can be saved elsewhere, and its file does not need the other one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vpm.errors import VpmError
from vpm.model.beam import Beam
from vpm.model.messages import Problem, place
from vpm.model.reduced import EMBEDDED, embedded, link_of, read_bytes
from vpm.model.sampled import OUTPUT, SIZES, MaxwellNarx, Narx
from vpm.model.sampled_terms import written
from vpm.model.schema import Document
from vpm.results import Result

#: A saved sample time may differ from the one of the model file by this share: numbers in files are rounded.
_SLACK = 1e-9


def with_files(document: Document, path: str | None) -> tuple[Document, list[Problem]]:
    """Read the files that drives and flexible links name, relative to the model file.

    Parameters
    ----------
    document : Document
    path : str or None
        Model file; without one, names are relative to the working directory.

    Returns
    -------
    Document
    list of Problem
        Files that are not there, that hold something else, or that say what the model file says already.
    """
    actuators, problems = dict(document.actuators), list[Problem]()
    for name, actuator in document.actuators.items():
        if not isinstance(actuator, Narx | MaxwellNarx) or actuator.file is None:
            continue
        where = place("actuators", name, "file")
        twice = [key for key in ("terms", "k0", "s0", "k1", "c1") if getattr(actuator, key, None) is not None]
        if twice:
            rest = f"is given, and {' and '.join(twice)} as well; remove the file or what it says"
            problems.append(Problem(where, rest))
            continue
        target = _beside(actuator.file, path)
        kind = type(actuator).__name__
        try:
            result = Result.load(target)
            if type(result).__name__ != kind:
                raise VpmError(
                    f"{target} is a saved {type(result).__name__}, but the type {actuator.type} needs a {kind}"
                )
            saved: Mapping[str, Any] = result.to_stored()
            read = _narx(actuator, saved) if isinstance(actuator, Narx) else _maxwell(actuator, saved)
        except VpmError as error:
            problems.append(Problem(where, f"is wrong: {error}"))
            continue
        actuators[name] = read
    beams = dict(document.beams)
    for name, beam in document.beams.items():
        try:
            beams[name] = _with_solid(beam, path)
        except VpmError as error:
            problems.append(Problem(place("beams", name, "reduced"), f"is wrong: {error}"))
    return document.model_copy(update={"actuators": actuators, "beams": beams}), problems


def _beside(name: str, path: str | None) -> Path:
    return Path(name) if path is None else Path(path).parent / name


def _with_solid(beam: Beam, path: str | None) -> Beam:
    """A flexible link that holds the numbers of its reduced solid; any other as it is."""
    if beam.reduced is None or beam.reduced.startswith(EMBEDDED):
        _ = beam.solid  # damaged ones are told here
        return beam
    text = embedded(read_bytes(_beside(beam.reduced, path)))
    _ = link_of(text)
    return beam.model_copy(update={"reduced": text})


def _narx(actuator: Narx, saved: Mapping[str, Any]) -> Narx:
    if OUTPUT in saved["inputs"]:
        raise VpmError(f'an input of the model is called "{OUTPUT}" like its output; identify it under another name')
    names = (OUTPUT, *saved["inputs"])
    terms = {
        written(term, names): float(value) for term, value in zip(saved["terms"], saved["coefficients"], strict=True)
    }
    limit = float(saved["limit"]) if actuator.limit is None and math.isfinite(saved["limit"]) else actuator.limit
    channels = {name: actuator.inputs.get(name, name) for name in saved["inputs"]} | actuator.inputs
    return actuator.model_copy(update={"file": None, "terms": terms, "limit": limit, "inputs": channels})


def _maxwell(actuator: MaxwellNarx, saved: Mapping[str, Any]) -> MaxwellNarx:
    given, step = actuator.sample_time, float(saved["step"])
    if given is not None and abs(given - step) > _SLACK * step:
        raise VpmError(
            f"its element is sampled every {step:g} s, but sample_time is {given:g} s; remove sample_time, or fit the "
            "element at the other step"
        )
    maps = {key: _short([float(value) for value in saved[key]]) for key in ("k0", "s0")}
    numbers = {"k1": float(saved["k1"]), "c1": float(saved["c1"]), "scheme": saved["scheme"], "sample_time": step}
    return actuator.model_copy(update={"file": None, **maps, **numbers})


def _short(coefficients: list[float]) -> tuple[float, ...]:
    """Coefficients without the degrees that are all zero."""
    return tuple(coefficients[: next(size for size in SIZES if not any(coefficients[size:]))])
