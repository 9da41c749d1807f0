"""Problems of a model file, each as one sentence: where, the failing condition, the numbers, the repair."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, NoReturn

from pydantic import ValidationError

from vpm.errors import ModelError, near_match

#: How a key is written, for messages about missing ones.
_EXAMPLES: Mapping[str, str] = {
    "name": 'name = "my robot"',
    "gravity": "gravity = [0.0, 0.0, -9.81]",
    "bodies": "a table [bodies.link]",
    "joints": "a table [joints.axis]",
    "mass": 'mass = { value = 1.0, unit = "kg" }',
    "joints.type": 'type = "prismatic"',
    "effects.type": 'type = "viscous_friction"',
    "parent": 'parent = "world"',
    "child": 'child = "link"',
    "axis": "axis = [1.0, 0.0, 0.0]",
    "joint": 'joint = "axis"',
    "gain": 'gain = { value = 1.0, unit = "N/V" }',
    "actuator": 'actuator = "drive"',
    "measures": 'measures = "axis.position"',
    "at": 'at = "axis"',
    "value": "value = 1.0",
    "column": 'column = "q_m"',
    "unit": 'unit = "m"',
}

#: What has to stand at a place, by the kind of error that says it does not.
_KINDS: Mapping[str, str] = {
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "string_type": "text in quotes",
    "bool_type": "true or false",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "list_type": "a list",
    "tuple_type": "a list",
}


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong.

    Attributes
    ----------
    where : str
        Place in the file, ``"bodies.carriage.mass"``.
    rest : str
        The sentence that begins with the place.
    """

    where: str
    rest: str

    def __str__(self) -> str:
        return f"{self.where} {self.rest}"


def raise_first(problems: Sequence[Problem], path: str | None) -> NoReturn:
    """Report the first problem and say how many more there are.

    Raises
    ------
    ModelError
        Always.
    """
    more = len(problems) - 1
    tail = f" (and {more} more problem{'s' if more > 1 else ''})" if more else ""
    head = f"{path}: " if path else ""
    raise ModelError(f"{head}{problems[0]}{tail}", where=problems[0].where, path=path, more=more)


def place(*keys: str | int) -> str:
    """Path in a file: ``effects[0].viscous``, ``bodies.carriage.mass``, ``channels."axis.position".unit``."""
    text = ""
    for key in keys:
        if isinstance(key, int):
            text += f"[{key}]"
        else:
            written = key if re.fullmatch(r"[\w-]+", key) else f'"{key}"'
            text += f".{written}" if text else written
    return text


def schema_problems(error: ValidationError, *, within: tuple[str, ...] = ()) -> list[Problem]:
    """Rewrite what the schema found.

    Parameters
    ----------
    error : pydantic.ValidationError
    within : tuple of str
        Place of the validated part in the file.
    """
    problems = []
    # Unknown keys come first: the key that is missing is often the one that is misspelt.
    for detail in sorted(error.errors(include_url=False), key=lambda found: found["type"] != "extra_forbidden"):
        keys = (*within, *detail["loc"])
        if keys[0] == "controllers" and len(keys) > 3:  # the schema puts the type of the controller into the path
            keys = (*keys[:2], *keys[3:])
        if keys[-1] == "value" and detail["type"] not in {
            "missing",
            "extra_forbidden",
        }:  # bare numbers have no such key
            keys = keys[:-1]
        problems.append(
            Problem(
                place(*keys), _sentence(detail["type"], keys, detail["input"], detail.get("ctx", {}), detail["msg"])
            )
        )
    return problems


def _sentence(kind: str, keys: tuple[str | int, ...], found: object, context: Mapping[str, Any], fallback: str) -> str:
    """Rest of the sentence for one error of the schema."""
    if kind == "extra_forbidden":
        return f"is not a known key; {near_match(str(keys[-1]), _known_keys(keys))}"
    if kind == "missing":
        example = _EXAMPLES.get(f"{keys[0]}.{keys[-1]}", _EXAMPLES.get(str(keys[-1])))
        return "is missing; add it" + (f", for example {example}" if example else "")
    if kind in _KINDS:
        return f"is {_shown(found)}, but has to be {_KINDS[kind]}; correct it"
    if kind in {"too_short", "too_long"}:
        needed = context.get("min_length") or context.get("max_length")
        if isinstance(found, Mapping):
            return f"is empty; add {_EXAMPLES.get(str(keys[-1]), 'an entry')}"
        return f"has {context['actual_length']} entries, but has to have {needed}; correct the list"
    return _choice_sentence(kind, found, context, fallback)


def _choice_sentence(kind: str, found: object, context: Mapping[str, Any], fallback: str) -> str:
    """Rest of the sentence where one of several things, or something more special, was expected."""
    if kind == "string_too_short":
        return "is empty text; give it a content"
    if kind in {"literal_error", "union_tag_invalid"}:
        choices = re.findall(r"'([^']*)'", str(context.get("expected") or context.get("expected_tags")))
        tag = context.get("tag", found)
        return f"has the type {_shown(tag)}; {near_match(str(tag), choices)}"
    if kind == "union_tag_not_found":
        return 'has no type; add type = "cascade" or type = "pid"'
    if kind == "value_error":
        reason = str(context.get("error", fallback))
        return reason if reason.startswith(("has ", "is ")) else f"is wrong: {reason}"
    return f"is {_shown(found)}: {fallback[:1].lower()}{fallback[1:]}"


def _known_keys(keys: tuple[str | int, ...]) -> tuple[str, ...]:
    """Keys that would have been right where an unknown one stands."""
    from vpm.model.schema import SECTIONS, Document, Quantity, keys_of

    if len(keys) == 1:
        return keys_of(Document)
    if len(keys) == 3 and keys[0] in SECTIONS:
        return keys_of(*SECTIONS[str(keys[0])])
    return keys_of(Quantity)


def _shown(value: object) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    return str(value)


def read_toml(path: str | PathLike[str]) -> dict[str, Any]:
    """Content of a TOML file.

    Raises
    ------
    ModelError
        The file cannot be read, is not UTF-8, or breaks the syntax of TOML.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ModelError(f"{path} does not exist; check the path", path=str(path)) from None
    except UnicodeDecodeError as error:
        raise ModelError(f"{path} is not UTF-8 text (byte {error.start}); save it as UTF-8", path=str(path)) from None
    except OSError as error:
        raise ModelError(f"{path} cannot be read: {error.strerror or error}", path=str(path)) from error
    return parse_toml(text, str(path))


def parse_toml(text: str, path: str | None = None) -> dict[str, Any]:
    """Content of a TOML text.

    Raises
    ------
    ModelError
        The text breaks the syntax of TOML; the error knows line and column.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        found = re.fullmatch(
            r"(?P<what>.*) \(at (?:line (?P<line>\d+), column (?P<column>\d+)|end of document)\)", str(error)
        )
        lines = text.splitlines() or [""]
        what = found["what"] if found else str(error)
        line = int(found["line"]) if found and found["line"] else len(lines)
        column = int(found["column"]) if found and found["column"] else len(lines[-1]) + 1
        head = f"{path}: " if path else ""
        message = f"{head}line {line}, column {column} is not TOML: {what[:1].lower()}{what[1:]}; correct the line"
        raise ModelError(message, path=path, line=line, column=column) from None
