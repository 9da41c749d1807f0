"""What the schema finds in a scenario file, rewritten as sentences with the repair."""

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from vpm.errors import near_match
from vpm.model.form import reason_sentence, unknown_keys_first, usual_sentence
from vpm.model.messages import Problem, place, shown
from vpm.model.schema import Place, Tables, located
from vpm.scenario.schema import INPUTS, SIGNALS, Document

#: How a key is written, for messages about missing ones.
_EXAMPLES: Mapping[str, str] = {
    "scenario": 'scenario = "drop from 50 mm"',
    "duration": "duration = 0.5",
    "time_step": "time_step = 1e-3",
    "runs": "a table [[runs]] with name and model",
    "name": 'name = "stiff"',
    "model": 'model = "arm.toml"',
    "panels": 'panels = [["axis.position"], ["drive.force"]]',
    "value": "value = 1.0",
    "amplitude": 'amplitude = { value = 5.0, unit = "deg" }',
    "frequency": "frequency = 2.0",
    "from": "from = 0.5",
    "to": "to = 10.0",
    "time": "time = [0.0, 0.1]",
    "type": 'type = "payload"',
    "at": 'at = "axis"',
}


def schema_problems(error: ValidationError) -> list[Problem]:
    """Problems of a scenario file's form that the schema found, rewritten as sentences."""
    problems = []
    for detail in unknown_keys_first(error):
        keys = _without_type(detail["loc"])
        if keys[-1] == "value" and detail["type"] not in {"missing", "extra_forbidden"} and _nested(keys):
            keys = keys[:-1]  # bare numbers have no such key
        _, tables = located(detail["loc"], Document)
        rest = _sentence(detail["type"], keys, tables, detail["input"], detail.get("ctx", {}))
        problems.append(Problem(place(*keys), rest))
    return problems


def _without_type(keys: Place) -> Place:
    """Place in the form without what the schema puts into it."""
    if keys[0] in INPUTS and len(keys) > 2:
        place_of_number = keys[5:] if len(keys) == 6 and keys[4] == "value" else keys[4:]  # bare lists have no such key
        return (*keys[:2], *keys[3:4], *place_of_number)
    if keys[0] == "runs" and len(keys) > 3 and keys[2] == "level":
        return keys[:3]
    return keys


def _nested(keys: Place) -> bool:
    """Whether ``value`` at the end of a form's place is that of a quantity, not a signal's own."""
    return not (keys[0] in INPUTS and len(keys) == 3)


def _sentence(kind: str, keys: Place, tables: Tables, found: object, context: Mapping[str, Any]) -> str:
    """Rest of the sentence for one error of a scenario's form."""
    if usual := usual_sentence(kind, str(keys[-1]), tables, found, _EXAMPLES.get(str(keys[-1]))):
        return usual
    if kind == "greater_than_equal":
        return f"is {found}, but has to be {context['ge']} or more; correct it"
    if kind == "too_short":
        return f"is empty; add {_EXAMPLES.get(str(keys[-1]), 'an entry')}"
    if kind == "union_tag_not_found":
        return f'has no type; add for example type = "points"; {near_match("", SIGNALS, what="the types are")}'
    if kind == "union_tag_invalid":
        return f"has the type {shown(context.get('tag'))}; {near_match(str(context.get('tag')), SIGNALS)}"
    return reason_sentence(str(context.get("error", f"is {shown(found)}, which cannot be; correct it")))
