"""A checked document as structure and values: a value is changed without another look at all the rest.

A change is admitted where each value is inside its bounds and every rule that has read one of them still holds. All
else goes the long way, by a check of the whole document, which also words what is wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from vpm.model.messages import Problem
from vpm.model.parameters import Parameter, Slot
from vpm.model.schema import Document
from vpm.model.structure import Structure
from vpm.model.writer import content_of, plain
from vpm.numbers import LARGEST

Parameters = Mapping[str, Parameter]


class _Read(Mapping[str, Parameter]):
    """Parameters that remember which of them were asked for."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self.names: set[str] = set()

    def __getitem__(self, name: str) -> Parameter:
        self.names.add(name)
        return self._parameters[name]

    def __contains__(self, name: object) -> bool:
        return name in self._parameters

    def __iter__(self) -> Iterator[str]:
        return iter(self._parameters)

    def __len__(self) -> int:
        return len(self._parameters)


@dataclass(frozen=True)
class Rule:
    """A condition on several parameters."""

    #: What breaks it, of a document and of its parameters by name.
    problems: Callable[[Document, Parameters], Iterable[Problem]]
    of_effects: bool = False  #: Whether it is one on effects, so that one more can break it.
    #: Parameters that it read when it held: while these keep their values it holds.
    names: frozenset[str] = frozenset()

    def judge(self, document: Document, parameters: Parameters) -> tuple[Rule, list[Problem]]:
        """Judge a rule on a checked document: what it read, and what breaks it."""
        read = _Read(parameters)
        found = list(self.problems(document, read))
        return replace(self, names=frozenset(read.names)), found


@dataclass(frozen=True)
class Checked:
    """A document without problems, and what was found out on the way."""

    base: Document  #: As it was checked, before values were changed.
    structure: Structure  #: What does not depend on values; those in its document are the ones of `base`.
    slots: tuple[Slot, ...]  #: Places of the parameters, in index order, as in `base`.
    parameters: Parameters  #: With the values of now.
    rules: tuple[Rule, ...]  #: What has to hold between them.
    changed: frozenset[str] = frozenset()  #: Parameters whose value is not the one of `base`.

    def with_values(self, values: Mapping[str, float]) -> Checked:
        """The checked document with other values (SI) of parameters that there are; nothing is checked."""
        moved = {name: replace(self.parameters[name], value=value) for name, value in values.items()}
        return replace(self, parameters={**self.parameters, **moved}, changed=self.changed.union(values))

    def admitted(self, values: Mapping[str, float]) -> Checked | None:
        """The checked document with other values (SI); None where only a check of the whole document can tell."""
        for name, value in values.items():
            parameter = self.parameters[name]
            inside = parameter.minimum <= value <= parameter.maximum and abs(value) <= LARGEST
            if not inside or _reshapes(self.slots_by_name[name], value):
                return None
        moved = self.with_values(values)
        rules = []
        for rule in self.rules:
            if rule.names.isdisjoint(values):
                rules.append(rule)
                continue
            judged, problems = rule.judge(self.base, moved.parameters)
            if problems:
                return None
            rules.append(judged)
        return replace(moved, rules=tuple(rules))

    @cached_property
    def slots_by_name(self) -> Mapping[str, Slot]:
        """Places of the parameters in the document, by dotted name."""
        return {slot.name: slot for slot in self.slots}

    @cached_property
    def document(self) -> Document:
        """The document with the values of now."""
        return Document.model_validate(self.content()) if self.changed else self.base

    def content(self) -> dict[str, Any]:
        """Complete content of a checked document with present values; changed ones in SI units."""
        content = content_of(self.base, complete=True)
        for name in self.changed:
            slot = self.slots_by_name[name]
            *way, last = slot.keys
            target: Any = content
            for key in way:
                target = target[key]
            target[last] = plain(slot.si_quantity().model_copy(update={"value": self.parameters[name].value}))
        return content


def _reshapes(slot: Slot, value: float) -> bool:
    """Whether a value in a checked document changes the machine's structure, or another parameter's unit.

    A zero may take away the inertia before a spring or the joint of a shaft; an exponent of a contact is in the unit of
    its stiffness.
    """
    if slot.keys[0] == "contacts" and slot.keys[-1] == "exponent":
        return True
    return value == 0.0 and (slot.keys[-1] in {"inertia", "rotor_inertia"} or "ratios" in slot.keys)
