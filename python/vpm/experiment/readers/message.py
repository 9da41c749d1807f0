"""Numbers inside a ROS message: fields, elements of arrays by index or by the name beside them, and the stamp."""

import re
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

_STEP = re.compile(r"^(?P<field>[A-Za-z_]\w*)(?:\[(?P<index>[^\[\]]+)\])?$")

#: A message or a value in it, of a class that was built from what the bag says.
Message = Any

#: Fields that name the elements of the other arrays of their message (sensor_msgs/JointState, trajectories).
NAMES = ("name", "names", "joint_names")

#: Arrays that are longer are pictures or clouds; their elements can be mapped, but are not listed.
MOST_ELEMENTS = 64


class Field(NamedTuple):
    """Way to a number: steps of a field and, in an array, an index or a name; and how it is written."""

    steps: tuple[tuple[str, int | str | None], ...]
    text: str


def leaves(message: Message) -> Iterator[str]:
    """All numbers of a message in dotted words; elements by name where names of the same count stand beside them."""
    for name, value in _members(message):
        if name == "header":
            continue
        if _is_number(value):
            yield name
        elif _is_array(value) and len(value) <= MOST_ELEMENTS:
            labels = _labels(message, len(value))
            for at, element in enumerate(value):
                if _is_number(element):
                    yield f"{name}[{labels[at] if labels else at}]"
                else:
                    yield from (f"{name}[{at}].{leaf}" for leaf in leaves(element))
        elif hasattr(value, "__dataclass_fields__"):
            yield from (f"{name}.{leaf}" for leaf in leaves(value))


def parse_field(text: str, message: Message) -> Field | None:
    """Way to the number that a text names in a message; None where there is no such number.

    An index becomes the name of the element where the message has one, because senders may change the order.
    """
    steps: list[tuple[str, int | str | None]] = []
    words = []
    parent = message
    for word in re.findall(r"[^.\[\]]+(?:\[[^\[\]]*\])?", text):
        match = _STEP.match(word)
        value = getattr(parent, match["field"], None) if match else None
        if match is None or value is None:
            return None
        index: int | str | None = None
        if match["index"] is not None:
            index = _index(match["index"].strip(), parent, value)
            if index is None:
                return None
            value = value[_labels(parent, len(value)).index(index) if isinstance(index, str) else index]
        steps.append((match["field"], index))
        words.append(match["field"] if index is None else f"{match['field']}[{index}]")
        parent = value
    return Field(tuple(steps), ".".join(words)) if steps and _is_number(parent) else None


def value_of(message: Message, field: Field) -> float | None:
    """Number of a message; None where the message has no element of that name."""
    value = message
    for name, index in field.steps:
        parent, value = value, getattr(value, name)
        if isinstance(index, str):
            names = _all_labels(parent)
            if index not in names:
                return None
            value = value[names.index(index)]
        elif index is not None:
            value = value[index]
    return float(value)


def has_stamp(message: Message) -> bool:
    """Whether the sender stamped the message."""
    return stamp_of(message) != 0


def stamp_of(message: Message) -> int:
    """Stamp in the header of a message, ns; zero where there is none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return 0 if stamp is None else int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def _index(text: str, parent: Message, values: Message) -> int | str | None:
    if not _is_array(values):
        return None
    labels = _labels(parent, len(values))
    if text in labels:
        return text
    if not text.isdecimal() or int(text) >= len(values):
        return None
    return labels[int(text)] if labels else int(text)


def _labels(message: Message, count: int) -> list[str]:
    """Names of the elements of a message's array of ``count``; none where they do not match."""
    labels = _all_labels(message)
    return labels if len(labels) == count == len(set(labels)) else []


def _all_labels(message: Message) -> list[str]:
    for name in NAMES:
        labels = getattr(message, name, None)
        if isinstance(labels, list) and labels and all(isinstance(label, str) for label in labels):
            return labels
    return []


def _members(message: Message) -> Iterator[tuple[str, Message]]:
    for name in getattr(message, "__dataclass_fields__", {}):
        if not name.startswith("__"):
            yield name, getattr(message, name)


def _is_number(value: Message) -> bool:
    return isinstance(value, int | float | np.number | np.bool_)


def _is_array(value: Message) -> bool:
    return isinstance(value, list | np.ndarray) and not isinstance(value, str)
