"""Form of a task file: which keys there are and what kind of value each takes."""

from collections.abc import Mapping
from typing import Annotated

from pydantic import BeforeValidator, Field, ValidationError
from pydantic_core import ErrorDetails

from vpm.model.entry import Entry, Number, Switch, Text, Vector
from vpm.model.form import unknown_keys_first, usual_sentence
from vpm.model.messages import Problem, place, shown
from vpm.model.schema import located

#: Words of `minimise` that are no channels.
GOALS = ("time", "energy")
_RANGE = 'a number, a list [least, most] or a table like { least = -1.0, most = 1.0, unit = "rad" }'


class Range(Entry):
    """A value, or what lies between two; a missing unit means SI."""

    value: Number | None = None
    least: Number | None = None
    most: Number | None = None
    unit: Text | None = None


def _as_range(given: object) -> object:
    if isinstance(given, Range):
        return given
    if isinstance(given, Mapping):
        value, ends = "value" in given, "least" in given or "most" in given
        if value == ends:
            raise ValueError(f"has to be {_RANGE}")
        return given
    if isinstance(given, int | float) and not isinstance(given, bool):
        return {"value": given}
    if isinstance(given, list | tuple) and len(given) == 2:
        return {"least": given[0], "most": given[1]}
    raise ValueError(f"has to be {_RANGE}")


Bounds = Annotated[Range, BeforeValidator(_as_range)]


class Boundary(Entry):
    """What holds at the beginning of a motion or at the end of a phase."""

    rest: Switch = False
    channels: dict[str, Bounds] = Field(default_factory=dict)


def _as_boundary(given: object) -> object:
    """Boundary in the task's schema: channels beside the word come into a table of their own."""
    if not isinstance(given, Mapping):
        return given
    words = {key: value for key, value in given.items() if key == "rest"}
    return {**words, "channels": {key: value for key, value in given.items() if key not in words}}


Ends = Annotated[Boundary, BeforeValidator(_as_boundary)]
Intervals = Annotated[int, Field(strict=True, ge=1, le=500)]


class PhaseEntry(Entry):
    """A part of the motion with a duration, limits and an end of its own."""

    name: Text
    duration: Bounds
    intervals: Intervals = 15
    limits: dict[str, Bounds] = Field(default_factory=dict)
    guess: dict[str, Bounds] = Field(default_factory=dict)
    end: Ends = Boundary()


class ObstacleEntry(Entry):
    """A ball that a marker keeps out of."""

    marker: Text
    center: Vector
    radius: Annotated[float, Field(strict=True, gt=0.0, allow_inf_nan=False)]


class Document(Entry):
    """A whole task file."""

    task: Text
    level: Text | dict[str, Text] | None = None
    set: dict[str, Bounds] = Field(default_factory=dict)
    minimise: Text | dict[str, Number] | None = None
    maximise: Text | None = None
    duration: Bounds | None = None
    intervals: Intervals = 20
    tolerance: Annotated[float, Field(strict=True, gt=0.0, le=0.1)] = 1e-5
    refinements: Annotated[int, Field(strict=True, ge=0, le=12)] = 6
    time_step: Bounds = Range(value=1e-3)
    before: Bounds = Range(value=0.1)
    after: Bounds = Range(value=0.0)
    periodic: Switch = False
    begin: Annotated[Boundary, BeforeValidator(_as_boundary)] = Boundary(rest=True)
    end: Ends = Boundary()
    limits: dict[str, Bounds] = Field(default_factory=dict)
    guess: dict[str, Bounds] = Field(default_factory=dict)
    obstacles: tuple[ObstacleEntry, ...] = ()
    phases: tuple[PhaseEntry, ...] = ()


def schema_problems(error: ValidationError) -> list[Problem]:
    """Problems of a task file's form that the schema found, rewritten as sentences."""
    return [_problem(found) for found in unknown_keys_first(error)]


def _problem(found: ErrorDetails) -> Problem:
    keys = tuple(key for key in found["loc"] if key != "channels" and not str(key).startswith("dict["))
    kind, context = found["type"], found.get("ctx", {})
    if usual := usual_sentence(kind, str(keys[-1]), located(found["loc"], Document)[1], found["input"]):
        return Problem(place(*keys), usual)
    if kind == "value_error":
        return Problem(place(*keys), f"{context['error']}; it is {shown(found['input'])}")
    return Problem(place(*keys), f"is wrong ({found['msg'].lower()}); it is {shown(found['input'])}")
