"""Contacts of points of the machine with planes, and their friction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Self

from vpm.errors import UnitError
from vpm.model.component import Component, Described, Index
from vpm.model.entry import ORIGIN, ZERO, Entry, Number, ParameterValue, Quantity, Text, Vector
from vpm.model.messages import Problem, place
from vpm.model.parameters import ABOVE_ZERO, FEEDING, NOT_NEGATIVE, PUSHING, Parameter, Rule
from vpm.model.pose import Pose
from vpm.units import convert, require_dimension

if TYPE_CHECKING:
    from vpm.model.structure import Structure


class Plane(Entry):
    """Plane at rest in the world: a point of it and its normal, of any length, towards the free side."""

    point: Vector = ORIGIN
    normal: Vector


class ContactFriction(Entry):
    """Friction per normal force: static up to one sliding velocity, dynamic from another one on."""

    static: Annotated[ParameterValue, Rule("1", NOT_NEGATIVE, PUSHING)]
    static_velocity: Annotated[ParameterValue, Rule("m/s", ABOVE_ZERO, "")]
    dynamic: Annotated[ParameterValue, Rule("1", NOT_NEGATIVE, PUSHING)]
    dynamic_velocity: Annotated[ParameterValue, Rule("m/s", ABOVE_ZERO, "")]


class Contact(Component):
    """Contact of a point of the machine with a plane: F = k d^n + c step(d / damping_depth) d'."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        "plane": "plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }",
        "normal": "normal = [0.0, 0.0, 1.0]",
        "stiffness": 'stiffness = { value = 2855, unit = "N/mm^1.1" }',
        "static": "static = 0.7",
        "static_velocity": 'static_velocity = { value = 0.1, unit = "m/s" }',
        "dynamic": "dynamic = 0.55",
        "dynamic_velocity": 'dynamic_velocity = { value = 1, unit = "m/s" }',
    }
    CHANNELS: ClassVar[Mapping[str, str]] = {"depth": "m", "normal_force": "N", "fx": "N", "fy": "N", "fz": "N"}

    parent: Text
    at: Number | None = None
    point: Vector = ORIGIN
    plane: Plane
    stiffness: Annotated[
        ParameterValue, Rule("", NOT_NEGATIVE, "a contact with negative stiffness would pull the body in")
    ]
    exponent: Annotated[
        ParameterValue, Rule("1", ABOVE_ZERO, "a spring that hardens with no power of the depth is none")
    ] = Quantity(value=1.0)
    damping: Annotated[ParameterValue, Rule("N s/m", NOT_NEGATIVE, FEEDING)] = ZERO
    damping_depth: Annotated[ParameterValue, Rule("m", ABOVE_ZERO, "")] = Quantity(value=1e-4)
    friction: ContactFriction | None = None

    @property
    def stiffness_unit(self) -> str:
        """SI unit of a contact's stiffness: ``N/m^1.1``."""
        return f"N/m^{self.exponent.value:.6g}"

    def problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Problems of a contact: what cannot touch its plane, no direction, a stiffness of another exponent."""
        if structure.mounted(self.parent, self.at, Pose()).mount.kind == "world":
            rest = f'is "{self.parent}", which does not move against the plane; name a body or a beam that moves'
            yield Problem(place("contacts", name, "parent"), rest)
        if not any(self.plane.normal):
            rest = (
                "is [0, 0, 0], which is no direction; give the direction in which the ground pushes, such as [0, 0, 1]"
            )
            yield Problem(place("contacts", name, "plane", "normal"), rest)
        unit, exponent = self.stiffness.unit, self.exponent.value
        if unit is None:
            return
        try:
            require_dimension(unit, self.stiffness_unit)
        except UnitError:
            rest = (
                f'has the unit "{unit}", but with the exponent {exponent:g} it is a force per length to that '
                f'power; write for example "N/mm^{exponent:.6g}", or correct the exponent'
            )
            yield Problem(place("contacts", name, "stiffness"), rest)

    def complete(self) -> Self:
        """Contact with its stiffness in SI; its unit holds an exponent that may be a parameter."""
        given, wanted = self.stiffness.unit, self.stiffness_unit
        if given is None:
            return self
        quantity = self.stiffness.mapped(lambda number: convert(number, given, wanted), None)
        return self.model_copy(update={"stiffness": quantity})

    def units(self, name: str, structure: Structure) -> Mapping[str, str]:  # noqa: ARG002
        """SI units of a contact's stiffness."""
        return {"stiffness": self.stiffness_unit}

    def value_problems(self, name: str, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
        """Problem of a contact's friction that does not fall."""
        if self.friction is None:
            return
        static, dynamic = (parameters[f"{name}.friction.{key}_velocity"].value for key in ("static", "dynamic"))
        if dynamic <= static:
            rest = (
                f"is {dynamic:g} m/s, but friction falls from its static value at {static:g} m/s to its dynamic one; "
                "give a dynamic_velocity above static_velocity"
            )
            yield Problem(place("contacts", name, "friction", "dynamic_velocity"), rest)

    def described(self, name: str, structure: Structure, index: Index) -> Described:
        """What the core reads of a contact."""
        frame = structure.mounted(self.parent, self.at, Pose(self.point))
        words = {"static": "static_coefficient", "dynamic": "dynamic_coefficient"}
        friction = {
            words.get(key, key): index[f"{name}.friction.{key}"]
            for key in ContactFriction.model_fields
            if self.friction
        }
        return {
            "name": name,
            "on": frame.mount.described(),
            "point": list(frame.pose.translation),
            "plane": {"point": list(self.plane.point), "normal": list(self.plane.normal)},
            "normal": {key: index[f"{name}.{key}"] for key in ("stiffness", "exponent", "damping", "damping_depth")},
            "friction": friction or None,
        }
