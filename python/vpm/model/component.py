"""What all named tables of a model file have in common: one class for each kind of component, with all of it.

A class has the keys of its table, what is checked of them beside their form, the parameters, the channels, and what the
core is told (``described``).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Self

from vpm.model.entry import Entry
from vpm.model.messages import Problem
from vpm.model.parameters import Keys, Parameter, Slot, slots_of

if TYPE_CHECKING:
    from vpm.model.structure import Structure

#: Numbers of parameters by dotted name.
Index = Mapping[str, int]
#: A part of the description that the core reads.
Described = dict[str, Any]


class Component(Entry):
    """A table with a name."""

    #: How a key is written, for messages about missing ones.
    EXAMPLES: ClassVar[Mapping[str, str]] = {}
    #: Channels, with their SI units, where these do not depend on the model.
    CHANNELS: ClassVar[Mapping[str, str]] = {}

    def problems(self, name: str, structure: Structure) -> Iterator[Problem]:  # noqa: ARG002
        """Problems of a component: what it names wrongly, and what may not be together."""
        yield from ()

    def complete(self) -> Self:
        """The component with what need not be given, once its form and its units are right."""
        return self

    def units(self, name: str, structure: Structure) -> Mapping[str, str]:  # noqa: ARG002
        """SI units of a component's parameters that depend on the model, by key."""
        return {}

    def slots(self, keys: Keys, structure: Structure) -> Iterator[Slot]:
        """Parameters of a component in index order; what it names is right, and ``keys`` are section and name."""
        yield from slots_of(keys, self, self.units(str(keys[1]), structure))

    def value_problems(self, name: str, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:  # noqa: ARG002
        """Problems of a component's values that contradict each other."""
        yield from ()
