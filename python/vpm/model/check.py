"""From parsed TOML to a checked document: every way in goes through `check_document`.

What is checked stands with the components; here is the order.
"""

from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path

from pydantic import ValidationError

from vpm.errors import ModelError
from vpm.model.beams.beam import with_solids
from vpm.model.body import inertia_problems
from vpm.model.channels import channel_problems
from vpm.model.checked_document import Checked, Rule
from vpm.model.component import Component
from vpm.model.controller import controller_problems
from vpm.model.drives import actuator as drives
from vpm.model.effects import EffectEntry, complete_effects, effect_problems
from vpm.model.form import schema_problems
from vpm.model.messages import Problem, raise_first
from vpm.model.omissions import omission_problems
from vpm.model.parameters import Parameter, Slot
from vpm.model.reading import check_plain
from vpm.model.schema import Document
from vpm.model.sensor import noise_problems, sensor_problems
from vpm.model.splitting import reshapes, stop_problems
from vpm.model.structure import Structure, build_structure
from vpm.model.tree import name_problems, tree_problems


def check_document(content: Mapping[str, object], path: str | None = None) -> Checked:
    """Check the content of a model file.

    The checks come in stages, each of which relies on the ones before: form, tree, references, values.

    ``content``: as `tomllib` gives it.
    """
    check_plain(content, path)
    try:
        document = Document.model_validate(content)
    except ValidationError as error:
        raise_first(schema_problems(error), path)
    folder = Path() if path is None else Path(path).parent
    document, unread = drives.with_files(document, folder)
    document, damaged = with_solids(document, folder)
    _stop_at([*unread, *damaged], path)
    _stop_at([*_empty_problems(document), *name_problems(document), *_beam_problems(document)], path)
    _stop_at([*tree_problems(document), *_place_problems(document)], path)
    structure = build_structure(document)
    _stop_at([*_reference_problems(document, structure), *drives.command_problems(document)], path)
    _stop_at(list(noise_problems(document, structure)), path)
    said = [*drives.unit_problems(document), *effect_problems(document, structure)]
    _stop_at([*said, *channel_problems(document, structure)], path)
    document = _complete(complete_effects(document, structure))
    structure = build_structure(document)
    found = tuple(_slots(document, structure))
    _stop_at([problem for slot in found for problem in slot.problems()], path)
    parameters = _table(found)
    judged = [rule.judge(document, parameters) for rule in _rules(structure)]
    _stop_at([problem for _, problems in judged for problem in problems], path)
    return Checked(document, structure, found, parameters, tuple(rule for rule, _ in judged))


def check_effect(checked: Checked, content: Mapping[str, object]) -> Checked | None:
    """Check one effect more of a checked document, and of the rest what reads effects.

    ``content``: of the effect, as `tomllib` gives it.
    Result: None where the effect divides the machine, or where something is wrong: `check_document` tells what.
    """
    try:
        check_plain(content)
        added = EffectEntry.model_validate(content)
    except (ModelError, ValidationError):
        return None
    if reshapes(added, checked.base):
        return None
    document = checked.base.model_copy(update={"effects": (*checked.base.effects, added)})
    structure = checked.structure.with_document(document)
    if any(drives.drive_problems(document, structure)) or any(effect_problems(document, structure)):
        return None
    document = complete_effects(document, structure)
    structure = checked.structure.with_document(document)
    found = tuple(document.effects[-1].slots(len(document.effects) - 1, structure))
    if any(problem for slot in found for problem in slot.problems()):
        return None
    parameters = {**checked.parameters, **_table(found)}
    judged = [rule.judge(document, parameters) if rule.of_effects else (rule, []) for rule in checked.rules]
    if any(problems for _, problems in judged):
        return None
    rules = tuple(rule for rule, _ in judged)
    return Checked(document, structure, (*checked.slots, *found), parameters, rules, checked.changed)


def _slots(document: Document, structure: Structure) -> Iterator[Slot]:
    """Parameters of a document whose references and effects passed the check, in index order."""
    for name in structure.bodies:
        yield from document.bodies[name].slots(("bodies", name), structure)
    for name, joint in document.joints.items():
        yield from joint.slots(("joints", name), structure)
    for name in structure.beams:
        yield from document.beams[name].slots(("beams", name), structure)
    others = ("lines", "transmissions", "supplies", "actuators", "controllers", "contacts", "bushings")
    for section, name, component in document.components(*others):
        yield from component.slots((section, name), structure)
    for position, effect in enumerate(document.effects):
        yield from effect.slots(position, structure)


def _table(slots: Iterable[Slot]) -> Mapping[str, Parameter]:
    """Checked parameters by name, in index order."""
    return {slot.name: slot.parameter() for slot in slots}


def _rules(structure: Structure) -> Iterator[Rule]:
    """Rules to check between parameters of a model file, in the order of their problems."""
    yield from (Rule(partial(inertia_problems, body)) for body in structure.bodies)
    yield Rule(_size_problems)
    for sections in (("supplies", "actuators"), ("contacts", "bushings")):
        yield Rule(partial(_value_problems, sections))
    yield Rule(stop_problems, of_effects=True)


def _size_problems(document: Document, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
    for name, beam in document.beams.items():
        yield from beam.size_problems(name, document, parameters)


def _value_problems(
    sections: tuple[str, ...], document: Document, parameters: Mapping[str, Parameter]
) -> Iterator[Problem]:
    for _, name, component in document.components(*sections):
        yield from component.value_problems(name, parameters)


def _stop_at(problems: list[Problem], path: str | None) -> None:
    if problems:
        raise_first(problems, path)


def _empty_problems(document: Document) -> Iterator[Problem]:
    """Check for a machine of nothing, bodies that nothing carries, joints that do not move."""

    def missing(section: str, example: str) -> Problem:
        verb = "is empty; add" if section in document.model_fields_set else "is missing; add it, for example"
        return Problem(section, f"{verb} a table [{section}.{example}]")

    if not document.bodies and (not document.beams or document.joints):
        yield missing("bodies", "link")
    elif document.bodies and not document.joints:
        yield missing("joints", "axis")
    elif not document.beams and all(joint.type == "fixed" for joint in document.joints.values()):
        yield Problem("joints", 'has fixed joints only, so nothing moves; add one that does, such as type = "revolute"')


def _beam_problems(document: Document) -> Iterator[Problem]:
    for name, beam in document.beams.items():
        yield from beam.form_problems(name)


def _place_problems(document: Document) -> Iterator[Problem]:
    """Check for joints that move in no way, gauges where nothing strains them."""
    for name, joint in document.joints.items():
        yield from joint.form_problems(name)
    for name, gauge in document.gauges.items():
        yield from gauge.beam_problems(name, document)


def _reference_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Check for components that name what is not there, or cannot be where they are."""
    for name, actuator in document.actuators.items():
        yield from actuator.target_problems(name, structure)
    yield from sensor_problems(document, structure)
    yield from controller_problems(document, structure)
    for _, name, component in document.components("lines", "transmissions"):
        yield from component.problems(name, structure)
    yield from drives.drive_problems(document, structure)
    for _, name, component in document.components("contacts", "bushings", "loops", "load_cells"):
        yield from component.problems(name, structure)
    yield from omission_problems(document, structure)


def _complete(document: Document) -> Document:
    found: dict[str, dict[str, Component]] = {"actuators": {}, "contacts": {}}
    for section, name, component in document.components(*found):
        found[section][name] = component.complete()
    return document.model_copy(update=found)
