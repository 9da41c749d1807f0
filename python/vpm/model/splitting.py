"""What effects divide: joints whose drive and link part ways, links that bend although they are described as rigid.

A split joint keeps its name and coordinate on the motor side, with the actuator and, unless they say that they sit on
the link side, all other effects on it. Behind it comes a joint of the same kind and axis without actuator, which
carries the link: ``axis_deflection`` for play and wind-up, ``arm_bending`` for a body that bends at its root. A rigid
beam that bends is not split; it gets a level of detail that bends.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Protocol, TypeVar

from vpm.catalogue import effect_type
from vpm.catalogue.traits import Traits
from vpm.model.drives.motor import DcMotor
from vpm.model.messages import Problem, place

if TYPE_CHECKING:
    from vpm.model.effects import EffectEntry
    from vpm.model.parameters import Parameter
    from vpm.model.schema import Document


class Seated(Protocol):
    """What splits a joint or sits elsewhere: an effect of a model or of its file."""

    @property
    def at(self) -> str:
        """Component that it sits at."""

    @property
    def traits(self) -> Traits:
        """What it does."""


AnyEffect = TypeVar("AnyEffect", bound=Seated)

#: Level of a rigid beam that bends: two strain polynomials carry its first mode within 0.48 % (docs/beams.md).
FLEXED = "strain(2)"


def name_behind(joint: str) -> str:
    """Name of the joint that carries the link where an effect splits one."""
    return f"{joint}_deflection"


def name_of_bending(body: str) -> str:
    """Name of the joint at the root of a link that an effect splits to bend."""
    return f"{body}_bending"


def spring_in_series(traits: Traits, at: str, effects: Iterable[AnyEffect]) -> AnyEffect | None:
    """Spring with which a play at a joint is in series, so that they split the joint once; None if there is none.

    The play has a gap of its own. Contacts are as stiff as the spring, and its inertia is before both.
    """
    return next((one for one in effects if traits.has_play and one.traits.winds_up and one.at == at), None)


def splits_joint(entry: EffectEntry, document: Document) -> bool:
    """Whether an effect splits a joint into motor and link: wind-up always, play where an actuator drives directly.

    A joint without an actuator may be the play itself. What is in series with a spring leaves the split to that.
    """
    if spring_in_series(entry.traits, entry.at, document.effects) is not None:
        return False
    if entry.traits.has_play:
        return any(entry.at in actuator.joints_turned(document) for actuator in document.actuators.values())
    return entry.traits.splits


def reshapes(entry: EffectEntry, document: Document) -> bool:
    """Whether one effect more splits the machine into other joints or beams."""
    return entry.traits.motion == "bending" or splits_joint(entry, document)


def deflections(document: Document) -> Mapping[str, str]:
    """Coordinates that are split, each with the name of the joint behind it."""
    return {entry.at: name_behind(entry.at) for entry in document.effects if splits_joint(entry, document)}


def bendings(document: Document) -> Mapping[str, str]:
    """Bodies that an effect splits into bending links, each with the name of the joint at its root."""
    bent = (entry.at for entry in document.effects if entry.traits.motion == "bending" and entry.at in document.bodies)
    return {at: name_of_bending(at) for at in bent}


def flexed(document: Document) -> Document:
    """Document with the levels of detail that splitting effects ask for."""
    bent = {entry.at for entry in document.effects if entry.traits.motion == "bending"}
    rigid = [name for name, beam in document.beams.items() if name in bent and beam.detail.name == "rigid"]
    if not rigid:
        return document
    raised = {name: document.beams[name].model_copy(update={"level": FLEXED}) for name in rigid}
    return document.model_copy(update={"beams": {**document.beams, **raised}})


def splitting_problems(document: Document, names: Mapping[str, str]) -> Iterator[Problem]:
    """Two effects that split the same joint, names that are taken, and a motor side without inertia.

    ``names``: last coordinate of the joint of each body that its joint turns.
    """
    split: dict[str, int] = {}
    for position, entry in enumerate(document.effects):
        yield from _stiffness_problems(position, entry, document)
        bends = entry.traits.motion == "bending" and entry.at in names
        if not (bends or splits_joint(entry, document)):
            continue
        where, joint = place("effects", position), names[entry.at] if bends else entry.at
        earlier = split.setdefault(joint, position)
        if earlier != position:
            other = document.effects[earlier].type
            rest = f'splits joint "{joint}" again, after {other} in effects[{earlier}], and no inertia is between'
            yield Problem(where, f"{rest}; keep one of them")
        added = name_of_bending(entry.at) if bends else name_behind(entry.at)
        if added in {*document.joints, *document.bodies, *document.beams, *document.actuators, *document.sensors}:
            yield Problem(where, f'adds a joint "{added}", but the model has a component of this name; rename that one')
        if not _has_rotor(document, joint):
            given = entry.values.get("inertia")
            if given is None or given.value == 0.0:
                rest = "is missing" if given is None else "is 0"
                yield Problem(
                    place("effects", position, "inertia"),
                    f'{rest}, so nothing between the drive of "{joint}" and {"the bending" if bends else "the spring"} '
                    "has inertia; give it, or a rotor_inertia of the joint",
                )


def _stiffness_problems(position: int, entry: EffectEntry, document: Document) -> Iterator[Problem]:
    """Problem of splitting by a tip stiffness: the link's sections have no modulus in common."""
    beam = document.beams.get(entry.at)
    if entry.traits.motion == "bending" and beam is not None and not beam.is_of_one_material:
        rest = f"sets the modulus of {entry.at}, whose sections are not all of its material"
        yield Problem(place("effects", position), f"{rest}; give the stiffness in the sections, or remove the effect")


def stop_problems(document: Document, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
    """Problem of end stops, after splitting, that leave no way between them."""
    for position, entry in enumerate(document.effects):
        if entry.traits.stops:
            group = effect_type(entry.type).group
            low, high = (parameters[f"{entry.owner}.{group}.{end}"].value for end in ("low", "high"))
            if low >= high:
                rest = f"is {low:g}, but the upper end is {high:g} (SI); the lower one has to be below"
                yield Problem(place("effects", position, "low"), rest)


def _has_rotor(document: Document, joint: str) -> bool:
    """Whether the motor side of a split joint has an inertia of its own."""
    described = document.joints.get(joint)
    if described is not None and described.rotor_inertia is not None and described.rotor_inertia.value > 0.0:
        return True
    if any(entry.traits.rotor and entry.at == joint for entry in document.effects):
        return True
    shafts = (shaft for shaft in document.transmissions.values() if joint in shaft.ratios)
    if any(shaft.inertia is not None and shaft.inertia.value > 0.0 for shaft in shafts):
        return True
    motors = (actuator for actuator in document.actuators.values() if isinstance(actuator, DcMotor))
    return any(joint in motor.joints_turned(document) and motor.rotor_inertia is not None for motor in motors)
