"""What all drives have in common: what they act on, their command, what spoils it, and friction of their own."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, ClassVar

from vpm.catalogue import EFFECTS, effects_for_site
from vpm.errors import UnitError, near_match
from vpm.model.component import Component, Described, Index
from vpm.model.entry import Text
from vpm.model.joint import coordinate_problems
from vpm.model.messages import Problem, place
from vpm.units import require_dimension

if TYPE_CHECKING:
    from vpm.model.schema import Document
    from vpm.model.structure import Structure

LENGTH = "a length cannot be negative"


class Drive(Component):
    """Actuator on a joint, a line or a transmission; its type is the key of the table that follows."""

    #: Dimension of the command, where it is not free.
    COMMAND: ClassVar[str] = ""
    #: Whether its force acts along a line, so that no transmission takes it.
    STRAIGHT: ClassVar[bool] = False

    type: str
    joint: Text | None = None
    line: Text | None = None
    transmission: Text | None = None

    if TYPE_CHECKING:  # each type has the key at a place of its own

        @property
        def command_unit(self) -> str:
            """Unit of the command of a drive."""

    @property
    def acted_on(self) -> str:
        """Target of a drive in words: joint, line or transmission."""
        for what in ("joint", "line"):
            if (name := getattr(self, what)) is not None:
                return f'the {what} "{name}"'
        return f'the transmission "{self.transmission}"'

    def joints_turned(self, document: Document) -> tuple[str, ...]:
        """Joints that a drive turns: its own, or those of its transmission; none along a line."""
        if self.transmission in document.transmissions:
            return tuple(document.transmissions[self.transmission].ratios)
        return () if self.joint is None else (self.joint,)

    # ---- checks ------------------------------------------------------------------------------------------------------

    def target_problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Problems of a drive's target: nothing, several things, or what is not there."""
        document, keys = structure.document, ("actuators", name)
        given = [key for key in ("joint", "line", "transmission") if getattr(self, key) is not None]
        if not given:
            rest = 'is missing; add it, for example joint = "axis"'
            rest += ", or line with the name of a line" if document.lines else ""
            rest += ", or transmission with the name of one" if document.transmissions else ""
            yield Problem(place(*keys, "joint"), rest)
        elif len(given) > 1:
            listed = " and ".join(f"a {key}" for key in given)
            repair = "remove one of the two keys" if len(given) == 2 else "keep one of the three keys"
            yield Problem(place(*keys), f"drives {listed}; {repair}")
        elif self.joint is not None:
            yield from coordinate_problems(place(*keys, "joint"), self.joint, structure)
        else:
            key, known = given[0], document.lines if self.line is not None else document.transmissions
            other = getattr(self, key)
            if other not in known:
                repair = near_match(other, known, what="it has") if known else f"add a table [{key}s.{other}]"
                yield Problem(place(*keys, key), f'is "{other}", which is no {key} of the model; {repair}')

    def carrier_problems(self, name: str, structure: Structure) -> Iterator[Problem]:  # noqa: ARG002
        """Problem of a drive whose law does not know its joint, line or transmission."""
        if self.STRAIGHT and self.transmission is not None:
            rest = f'is a {self.type} on the transmission "{self.transmission}", but its force acts along a line; '
            rest += "give line in place of transmission, or take an ideal actuator or a dc_motor"
            yield Problem(place("actuators", name), rest)

    def unit_problems(self, name: str) -> Iterator[Problem]:
        """Problem of a drive's command of the wrong kind."""
        if self.COMMAND:
            try:
                require_dimension(self.command_unit, self.COMMAND)
            except UnitError as error:
                yield Problem(place("actuators", name, "command_unit"), f"is wrong: {error}")

    # ---- what the model and the core are told ------------------------------------------------------------------------

    @property
    def states(self) -> Mapping[str, str]:
        """States of a drive beside its lag, in the order of the core, with SI units; "" is that of the command."""
        return {}

    @abstractmethod
    def law(self, name: str, structure: Structure, index: Index) -> Described:
        """What the core reads of the law of a drive."""

    def described(self, name: str, structure: Structure, index: Index) -> Described:
        """What the core reads of a drive."""
        friction = group(f"{name}.friction", ("driving", "driven", "transition_velocity"), index)
        # What spoils a command is a key of its drive, called like the group of its one parameter.
        numbers = {effect.group: effect.parameters for effect in effects_for_site("actuator")}
        faults = {key: index.get(f"{name}.{own[0].suffix}") for key, own in numbers.items() if len(own) == 1}
        wire = self.line or self.transmission or ""
        on = (
            {"line": structure.wires.index(wire)}
            if self.joint is None
            else {"joint": structure.joints.index(self.joint)}
        )
        return {
            "name": name,
            "on": on,
            "drive": {"type": self.type, **self.law(name, structure, index)},
            **faults,
            **({} if friction is None else {"friction": friction}),
        }

    def rubs(self, name: str, document: Document) -> bool:
        """Whether a drive has friction of its own."""
        own = (EFFECTS[effect.type] for effect in document.effects if effect.at == name)
        return any(effect.site == "actuator" and effect.rubs for effect in own)


def group(way: str, keys: tuple[str, ...], index: Index) -> dict[str, int] | None:
    """Indices of the parameters of an effect of a drive, by key; None where the drive does not have it."""
    return {key: index[f"{way}.{key}"] for key in keys} if f"{way}.{keys[0]}" in index else None


def numbers(way: str, keys: tuple[str, ...], index: Index) -> dict[str, int | None]:
    """Parameters of a drive's law by key, as far as they are there."""
    return {key: index.get(f"{way}.{key}") for key in keys}
