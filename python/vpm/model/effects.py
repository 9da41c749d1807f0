"""Effects of a model: their tables, checks against the catalogue, values that a file need not give, parameters."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict, Field

from vpm.catalogue import EFFECTS, EffectParameter, EffectType, Side, repair_of
from vpm.catalogue.kinds import in_words
from vpm.catalogue.traits import Traits
from vpm.errors import near_match
from vpm.model.component import Index
from vpm.model.entry import ParameterValue, Quantity, Text
from vpm.model.joint import COORDINATE_UNIT, EFFORT_UNIT
from vpm.model.messages import Problem, place
from vpm.model.parameters import Slot
from vpm.model.splitting import Seated, bendings, deflections, splitting_problems, spring_in_series
from vpm.units import si_unit

if TYPE_CHECKING:
    from vpm.model.parameters import Parameter
    from vpm.model.schema import Document
    from vpm.model.structure import Structure

#: Sites whose effects are entries of their own for the core; those of actuators and sensors are keys of them.
SITES = frozenset({"joint", "body", "link", "beam", "world"})


class EffectEntry(BaseModel):
    """An effect of the catalogue at a site; the other keys are its parameters."""

    model_config = ConfigDict(extra="allow", frozen=True)
    __pydantic_extra__: dict[str, ParameterValue] = Field(init=False)

    type: Text
    at: Text
    side: Side = "motor"  #: Where at a joint with a compliance or backlash.

    @property
    def owner(self) -> str:
        """Component with its side, with which the dotted names of an effect's parameters begin."""
        return self.at if self.side == "motor" else f"{self.at}.{self.side}"

    @property
    def traits(self) -> Traits:
        """Traits of an effect in a model file; none if the catalogue does not have it."""
        return EFFECTS.get(self.type, Traits())

    @property
    def values(self) -> dict[str, Quantity]:
        """Parameters of an effect by short name, as far as they are given."""
        return dict(self.__pydantic_extra__)

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """Parameters of a complete effect: all but optional ones that are not given, and those of a spring."""
        return tuple(p for p in EFFECTS[self.type].parameters if p.name in self.values)

    def slots(self, position: int, structure: Structure) -> Iterator[Slot]:
        """Parameters of an effect, when it is complete and stands at a position of the file."""
        effect, given = EFFECTS[self.type], self.values
        for parameter in self.parameters:
            yield Slot(
                ("effects", position, parameter.name),
                given[parameter.name],
                effect_unit(parameter.unit, self, structure),
                parameter.physical,
                effect.impossible,
                "linear" if parameter.linear else "shape",
                f"{self.owner}.{parameter.suffix}",
            )


@dataclass(frozen=True)
class Effect:
    """An effect of a model."""

    name: str  #: Type in the catalogue.
    at: str  #: Component that it sits at.
    side: Side  #: Where at a joint with a compliance or backlash.
    parameter_names: Mapping[str, str]  #: Short name to dotted name of each parameter.
    #: Short name to dotted name of each parameter that a play has from a spring that it is in series with.
    of_spring: Mapping[str, str] = field(default_factory=dict)

    @property
    def key(self) -> tuple[str, str] | tuple[str, str, Side]:
        """Key of an effect that no other one of the model has: name and component, and its side on the link."""
        return (self.name, self.at) if self.side == "motor" else (self.name, self.at, self.side)

    @property
    def place(self) -> str:
        """Place of an effect in words: component and side."""
        return in_words(self.at, self.side)

    @property
    def type(self) -> EffectType:
        """Entry of the catalogue for an effect of a model."""
        return EFFECTS[self.name]

    @property
    def traits(self) -> Traits:
        """Traits of an effect of a model."""
        return self.type

    def sentence(self, parameters: Mapping[str, Parameter]) -> str:
        """Sentence on an effect of a model for a report, with its values."""
        known = {short: parameters[name] for short, name in {**self.parameter_names, **self.of_spring}.items()}
        texts = {short: f"{one.value:.4g} {one.unit}" for short, one in known.items()}
        return self.type.sentence.format(at=self.place, **texts)


def effect_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Types, sites and keys that are not there, the same effect twice at a site, and values that have to be given."""
    seen: dict[tuple[str, str], int] = {}
    for position, entry in enumerate(document.effects):
        keys = ("effects", position)
        if entry.type not in EFFECTS:
            repair = repair_of(entry.type)
            yield Problem(place(*keys, "type"), f'is "{entry.type}", which is no effect; {repair}')
            continue
        effect = EFFECTS[entry.type]
        sites = structure.sites(effect.site)
        if effect.has_sides:
            sites = (*sites, *document.transmissions)
        if effect.in_springs:
            sites = (*sites, *structure.added)
        if entry.at in document.transmissions and entry.at not in sites:
            rest = f'is "{entry.at}", a transmission, but {effect.name} sits at {_a(effect.site)} alone'
            repair = _shaft_repair(effect)
            yield Problem(place(*keys, "at"), f"{rest}; {repair}")
        elif entry.at not in sites:
            repair = near_match(entry.at, sites, what="it has")
            if effect.site == "joint" and entry.at in structure.sites("cylinder"):
                repair = f"the seals of {entry.at} rub at the joint that it moves; {repair}"
            rest = f'is "{entry.at}", which is no {effect.site} of the model; {effect.name} sits at one, {repair}'
            yield Problem(place(*keys, "at"), rest)
        elif effect.takes_effort and all(drive.joint != entry.at for drive in document.actuators.values()):
            rest = f'is "{entry.at}", on which no actuator acts itself, so that {effect.name} does nothing there'
            yield Problem(place(*keys, "at"), f"{rest}; name a joint with an actuator, or leave the effect out")
        if entry.side == "link" and entry.at in document.transmissions:
            yield Problem(place(*keys, "side"), 'is "link", but a transmission has no sides; leave the key out')
        elif entry.side == "link" and not effect.has_sides:
            yield Problem(place(*keys, "side"), f'is "link", but a {effect.title} has no sides; leave the key out')
        earlier = seen.setdefault((entry.type, entry.owner), position)
        if earlier != position:
            rest = f'is a second {entry.type} at "{entry.at}", after effects[{earlier}]; remove one'
            yield Problem(place(*keys), rest)
        yield from _value_problems(effect, entry, keys, document)
    yield from splitting_problems(document, structure.turned)


def _a(site: str) -> str:
    return f"{'an' if site[0] in 'aeiou' else 'a'} {site}"


def _shaft_repair(effect: EffectType) -> str:
    if effect.takes_effort:
        of_drive = next(name for name, one in EFFECTS.items() if one.beside_others)
        return f"{of_drive} of its actuator follows the load"
    if effect.rotor:
        return "give the inertia of the transmission"
    return f"put it at {_a(effect.site)}, or leave it out"


def own_parameters(effect: EffectType, at: str, effects: Iterable[Seated]) -> tuple[EffectParameter, ...]:
    """Parameters of an effect at a site: a play in series with a spring there has some from that."""
    shared = dict(effect.of_spring) if spring_in_series(effect, at, effects) is not None else {}
    return tuple(parameter for parameter in effect.parameters if parameter.name not in shared)


def _value_problems(
    effect: EffectType, entry: EffectEntry, keys: tuple[str, int], document: Document
) -> Iterator[Problem]:
    own, known = own_parameters(effect, entry.at, document.effects), [one.name for one in effect.parameters]
    names = [parameter.name for parameter in own]
    spring = spring_in_series(effect, entry.at, document.effects)
    for key in entry.values:
        if spring is not None and key in known and key not in names:
            rest = f"is that of {spring.type} at {entry.at}, which {effect.name} is in series with"
            yield Problem(place(*keys, key), f"{rest}; leave it out, or remove {spring.type}")
        elif key not in names:
            repair = near_match(key, ["type", "at", *(["side"] if effect.has_sides else []), *names])
            yield Problem(place(*keys, key), f"is not a known key of {effect.name}; {repair}")
    for parameter in own:
        if parameter.start is None and not parameter.optional and parameter.name not in entry.values:
            yield Problem(place(*keys, parameter.name), f"is missing; add it: {parameter.meaning}")
    sizes = [parameter.name for parameter in own if not parameter.shape]
    if spring is None and not any(name in entry.values for name in sizes):
        yield Problem(place(*keys, sizes[0]), f"is missing; a {effect.title} needs {' or '.join(sizes)}")


def complete_effects(document: Document, structure: Structure) -> Document:
    """Give every parameter of every effect a value and a unit: start values stand in for what is not given.

    Values that have to be given are there: `effect_problems` has seen to it.
    """
    entries = []
    for entry in document.effects:
        effect, given = EFFECTS[entry.type], entry.values
        kind = structure.kind_at(effect.site, entry.at)
        values = {}
        for parameter in own_parameters(effect, entry.at, document.effects):
            if parameter.optional and parameter.name not in given:
                continue
            start = parameter.default(kind)
            quantity = given[parameter.name] if start is None else given.get(parameter.name, Quantity(value=start))
            unit = quantity.unit or effect_unit(parameter.unit, entry, structure)
            values[parameter.name] = quantity.model_copy(update={"unit": unit})
        entries.append(EffectEntry.model_validate({"type": entry.type, "at": entry.at, "side": entry.side, **values}))
    return document.model_copy(update={"effects": tuple(entries)})


def effect_unit(template: str, entry: EffectEntry, structure: Structure) -> str:
    """SI unit of a parameter of an effect at its site, from the template of the catalogue."""
    site = EFFECTS[entry.type].site
    units: dict[str, str] = {"U": "1", "S": "1", "E": "1", "C": "1"}
    kind = structure.kind_at(site, entry.at)
    if kind is not None:
        units |= {"C": COORDINATE_UNIT[kind], "E": EFFORT_UNIT[kind]}
    if site == "actuator":
        units["U"] = structure.document.actuators[entry.at].command_unit
    if site == "sensor":
        units["S"] = structure.unit(structure.document.sensors[entry.at].measures)
    return si_unit(template.format_map(_Parenthesised(units)))


class _Parenthesised(dict[str, str]):
    """Fill templates with units that stay one factor: ``{E}/{U}`` with ``m/s`` for U is ``(N)/(m/s)``."""

    def __getitem__(self, key: str) -> str:
        return f"({super().__getitem__(key)})"


def effects_of(document: Document) -> tuple[Effect, ...]:
    """The effects of a checked document, in the order of the file."""
    return tuple(
        Effect(entry.type, entry.at, entry.side, _names(entry), _names_of_spring(entry, document))
        for entry in document.effects
    )


def _names(entry: EffectEntry) -> dict[str, str]:
    return {one.name: f"{entry.owner}.{one.suffix}" for one in entry.parameters}


def _names_of_spring(entry: EffectEntry, document: Document) -> dict[str, str]:
    spring = spring_in_series(entry.traits, entry.at, document.effects)
    names = {} if spring is None else _names(spring)
    return {own: names[its] for own, its in entry.traits.of_spring if its in names}


def effect_described(effect: Effect, structure: Structure, index: Index) -> list[dict[str, Any]]:
    """Entries of one effect; one that splits a joint has two, its law behind and the inertia before."""
    numbers = {short: index[dotted] for short, dotted in {**effect.parameter_names, **effect.of_spring}.items()}
    match effect.type.site:
        case "world":
            return [{"type": effect.name, "axes": [list(axis) for axis in structure.horizontal], **numbers}]
        case "beam":
            return [{"type": effect.name, "beam": structure.beams.index(effect.at), **numbers}]
        case "body":
            position = [numbers.pop(axis) for axis in "xyz"]
            return [{"type": effect.name, **_carrier(effect.at, structure), **numbers, "position": position}]
        case "link" if effect.at in structure.beams:
            numbers.pop("inertia")  # of what carries the beam
            return [{"type": effect.name, "beam": structure.beams.index(effect.at), **numbers}]
    return _on_joint(effect, structure, numbers, index)


def _law(effect: Effect, seat: Mapping[str, Any], numbers: Mapping[str, int]) -> dict[str, Any]:
    """An effect that is nothing but a law on one coordinate."""
    formula = effect.type.formula
    if formula is None:
        return {"type": effect.name, **seat, **numbers}
    law = {"program": list(formula.program), "constants": list(formula.constants)}
    return {"type": "formula", **seat, **law, "parameters": list(numbers.values())}


def _on_joint(effect: Effect, structure: Structure, numbers: dict[str, int], index: Index) -> list[dict[str, Any]]:
    places = structure.joints
    if effect.at in structure.document.transmissions:
        shafts = structure.document.transmissions
        seat = {
            "transmission": list(shafts).index(effect.at),
            "ratios": shafts[effect.at].levers(effect.at, structure, index),
        }
        return [_law(effect, seat, numbers)]
    before, behind = effect.at, deflections(structure.document).get(effect.at)
    if effect.type.site == "link":
        before, behind = structure.turned[effect.at], bendings(structure.document)[effect.at]
    seat = {"joint": places.index(before)}
    if effect.side == "link" and behind is not None:
        seat["behind"] = places.index(behind)
    if not effect.type.motion:
        return [_law(effect, seat, numbers)]
    rotor = next(name for name, one in EFFECTS.items() if one.rotor)
    inertia = {"type": rotor, "joint": places.index(before), "inertia": numbers.pop("inertia")}
    law = {"type": effect.name, "joint": places.index(behind or before), **numbers}
    if effect.of_spring:
        return [law]
    loose = any(one.at == effect.at and one.traits.has_play for one in structure.document.effects)
    return [inertia] if loose and effect.type.winds_up else [law, inertia]


def _carrier(site: str, structure: Structure) -> dict[str, int]:
    """Number of the body, weld or beam on which the core puts a payload effect."""
    if site in structure.beams:
        return {"beam": structure.beams.index(site)}
    if site in structure.welds:
        return {"weld": structure.welds.index(site)}
    return {"body": next(k for k, axis in enumerate(structure.axes) if axis.body == site)}
