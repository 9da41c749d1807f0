"""What the schema finds in a model file, rewritten as sentences with the repair."""

import re
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from vpm.errors import near_match
from vpm.model.component import Component
from vpm.model.drives.actuator import ACTUATOR_TYPES
from vpm.model.entry import Quantity
from vpm.model.messages import Problem, place, shown
from vpm.model.schema import SECTIONS, Tables, keys_of, located

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
    "actuator": 'actuator = "drive"',
    "controllers.actuators": 'actuators = ["drive"]',
    "measures": 'measures = "axis.position"',
    "at": 'at = "axis"',
    "value": "value = 1.0",
    "column": 'column = "q_m"',
    "unit": 'unit = "m"',
    "channels.time.unit": 'unit = "s"',
    "length": "length = 0.5",
    "level": 'level = "bezier(4)"',
    "material": "material = { young = 206e9, poisson = 0.3, density = 7850 }",
    "young": 'young = { value = 206, unit = "GPa" }',
    "density": "density = 7850",
    "beam": 'beam = "link"',
    "gauges.at": "at = 0.05",
}

#: What has to stand at a place of a file, by the kind of error that says it does not.
_KINDS: Mapping[str, str] = {
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "finite_number": "a finite number",
    "string_type": "text in quotes",
    "bool_type": "true or false",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "list_type": "a list",
    "tuple_type": "a list",
}


def schema_problems(error: ValidationError, *, within: tuple[str, ...] = ()) -> list[Problem]:
    """Problems of a model file's form that the schema found, rewritten as sentences."""
    problems = []
    for detail in unknown_keys_first(error):
        written = (*within, *detail["loc"])
        keys, tables = located(written)
        if keys[-1] == "value" and tables == (Quantity,) and detail["type"] not in {"missing", "extra_forbidden"}:
            keys = keys[:-1]  # bare numbers have no such key
        problems.append(
            Problem(
                place(*keys),
                _sentence(detail["type"], keys, tables, detail["input"], detail.get("ctx", {}), detail["msg"]),
            )
        )
    return problems


def unknown_keys_first(error: ValidationError) -> list[ErrorDetails]:
    """Errors of a file's form, unknown keys first: the key that is missing is often the one that is misspelt."""
    return sorted(error.errors(include_url=False), key=lambda found: found["type"] != "extra_forbidden")


def usual_sentence(kind: str, key: str, tables: Tables, found: object, example: str | None = None) -> str | None:
    """Rest of the sentence for an error of form that any file may have; None for all others."""
    if kind == "extra_forbidden":
        return f"is not a known key; {near_match(key, keys_of(*tables))}"
    if kind == "missing":
        return "is missing; add it" + (f", for example {example}" if example else "")
    if kind == "string_too_short":
        return "is empty text; give it a content"
    return f"is {shown(found)}, but has to be {_KINDS[kind]}; correct it" if kind in _KINDS else None


def reason_sentence(reason: str) -> str:
    """Rest of the sentence for what a check of a file's form complains about."""
    return reason if reason.startswith(("has ", "is ")) else f"is wrong: {reason}"


def _other_types(key: str, tables: Tables) -> tuple[tuple[str, ...], str]:
    """Other actuator types that have a key which the form of the given type lacks, and that type."""
    own = next((name for name, entry in ACTUATOR_TYPES.items() if entry in tables), "")
    return tuple(name for name, entry in ACTUATOR_TYPES.items() if own and key in keys_of(entry)), own


def _sentence(
    kind: str,
    keys: tuple[str | int, ...],
    tables: Tables,
    found: object,
    context: Mapping[str, Any],
    fallback: str,
) -> str:
    """Rest of the sentence for one error of form in one of some tables."""
    if kind == "extra_forbidden":
        other, own = _other_types(str(keys[-1]), tables)
        if other:
            return f'belongs to type = "{" or ".join(other)}", but this is {own}; change the type or remove the key'
    example = _EXAMPLES.get(".".join(map(str, keys))) or _example(str(keys[0]), str(keys[-1]))
    if usual := usual_sentence(kind, str(keys[-1]), tables, found, example):
        return usual
    if kind in {"too_short", "too_long"}:
        needed = context.get("min_length") or context.get("max_length")
        if isinstance(found, Mapping):
            return f"is empty; add {_example(str(keys[0]), str(keys[-1])) or 'an entry'}"
        bound = "at least one" if needed == 1 else needed
        return f"has {context['actual_length']} entries, but has to have {bound}; correct the list"
    return _choice_sentence(kind, keys, found, context, fallback)


def _example(section: str, key: str) -> str | None:
    """Example of a key's form in a model file, for messages; None where there is none."""
    kinds = SECTIONS.get(section, ())
    own = next((kind.EXAMPLES[key] for kind in kinds if issubclass(kind, Component) and key in kind.EXAMPLES), None)
    return own or _EXAMPLES.get(f"{section}.{key}", _EXAMPLES.get(key))


def _choice_sentence(
    kind: str, keys: tuple[str | int, ...], found: object, context: Mapping[str, Any], fallback: str
) -> str:
    """Rest of the sentence where the form allows one of several things, or something more special."""
    if kind in {"literal_error", "union_tag_invalid"}:
        choices = re.findall(r"'([^']*)'", str(context.get("expected") or context.get("expected_tags")))
        tag = context.get("tag", found)
        if keys[0] == "beams" and "deforms" in keys:
            return f"is {shown(tag)}, which is no deformation; {near_match(str(tag), choices)}"
        what = "shape" if keys[0] == "beams" else str(keys[-1]) if keys[-1] in {"convention", "source"} else "type"
        return f"has the {what} {shown(tag)}; {near_match(str(tag), choices)}"
    if kind == "union_tag_not_found" and keys[0] == "beams":
        return 'has no shape; add for example shape = "rectangle"'
    if kind == "union_tag_not_found":
        return 'has no type; add one, for example type = "pd"'
    if kind == "value_error":
        return reason_sentence(str(context.get("error", fallback)))
    return f"is {shown(found)}: {fallback[:1].lower()}{fallback[1:]}"
