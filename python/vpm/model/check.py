"""From parsed TOML to a checked document: every way in goes through `check_document`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np
from pydantic import ValidationError

from vpm.errors import ModelError, UnitError, near_match
from vpm.model.beam_check import beam_problems, size_problems
from vpm.model.checked import Checked, Rule
from vpm.model.connection_check import complete_contacts, connection_problems, connection_value_problems
from vpm.model.drive_check import complete_drives, drive_problems, unit_problems, value_problems
from vpm.model.effects import complete_effects, effect_problems
from vpm.model.form import schema_problems
from vpm.model.messages import Problem, check_plain, place, raise_first
from vpm.model.omissions import omission_problems
from vpm.model.parameters import Parameter, effect_slots, slots, table
from vpm.model.references import gauge_problems, reference_problems
from vpm.model.sampled_files import with_files
from vpm.model.schema import Document, EffectEntry
from vpm.model.sensor_noise import noise_problems
from vpm.model.splitting import reshapes, stop_problems
from vpm.model.structure import Structure, build_structure
from vpm.model.tree import joint_problems, name_problems, tree_problems
from vpm.units import parse_unit, require_dimension

#: An inertia may break its conditions by this share of its size: numbers in files are rounded.
INERTIA_TOLERANCE = 1e-6


def check_document(content: Mapping[str, object], path: str | None = None) -> Checked:
    """Check the content of a model file.

    The checks come in stages, each of which relies on the ones before: form, tree, references, values.

    Parameters
    ----------
    content : mapping
        As `tomllib` gives it.
    path : str, optional
        File that it comes from, for messages.

    Raises
    ------
    ModelError
        One sentence about the first problem, and how many more the stage found.
    """
    check_plain(content, path)
    try:
        document = Document.model_validate(content)
    except ValidationError as error:
        raise_first(schema_problems(error), path)
    document, unread = with_files(document, path)
    _stop_at(unread, path)
    _stop_at([*_empty_problems(document), *name_problems(document), *beam_problems(document)], path)
    _stop_at([*tree_problems(document), *joint_problems(document), *gauge_problems(document)], path)
    structure = build_structure(document)
    references = [*reference_problems(document, structure), *drive_problems(document, structure)]
    references += connection_problems(document, structure)
    references += omission_problems(document, structure)
    _stop_at([*references, *_command_problems(document)], path)
    _stop_at(list(noise_problems(document, structure)), path)
    _stop_at(
        [*unit_problems(document), *effect_problems(document, structure), *_channel_problems(document, structure)], path
    )
    document = complete_contacts(complete_drives(complete_effects(document, structure)))
    structure = build_structure(document)
    found = tuple(slots(document, structure))
    _stop_at([problem for slot in found for problem in slot.problems()], path)
    parameters = table(list(found))
    judged = [rule.judge(document, parameters) for rule in _rules(structure)]
    _stop_at([problem for _, problems in judged for problem in problems], path)
    return Checked(document, structure, found, parameters, tuple(rule for rule, _ in judged))


def check_effect(checked: Checked, content: Mapping[str, object]) -> Checked | None:
    """Check one effect more of a checked document, and of the rest what reads effects.

    Parameters
    ----------
    checked : Checked
    content : mapping
        Of the effect, as `tomllib` gives it.

    Returns
    -------
    Checked or None
        None where the effect divides the machine, or where something is wrong: `check_document` tells what.
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
    if any(drive_problems(document, structure)) or any(effect_problems(document, structure)):
        return None
    document = complete_effects(document, structure)
    structure = checked.structure.with_document(document)
    found = tuple(effect_slots(len(document.effects) - 1, document.effects[-1], structure))
    if any(problem for slot in found for problem in slot.problems()):
        return None
    parameters = {**checked.parameters, **table(list(found))}
    judged = [rule.judge(document, parameters) if rule.of_effects else (rule, []) for rule in checked.rules]
    if any(problems for _, problems in judged):
        return None
    rules = tuple(rule for rule, _ in judged)
    return Checked(document, structure, (*checked.slots, *found), parameters, rules, checked.changed)


def _rules(structure: Structure) -> Iterator[Rule]:
    """What has to hold between parameters, in the order in which it is told."""
    yield from (Rule(partial(_inertia_problems, body)) for body in structure.bodies)
    yield from map(Rule, (size_problems, value_problems, connection_value_problems))
    yield Rule(stop_problems, of_effects=True)


def _stop_at(problems: list[Problem], path: str | None) -> None:
    if problems:
        raise_first(problems, path)


def _empty_problems(document: Document) -> Iterator[Problem]:
    """A machine of nothing, bodies that nothing carries, joints that do not move."""

    def missing(section: str, example: str) -> Problem:
        verb = "is empty; add" if section in document.model_fields_set else "is missing; add it, for example"
        return Problem(section, f"{verb} a table [{section}.{example}]")

    if not document.bodies and (not document.beams or document.joints):
        yield missing("bodies", "link")
    elif document.bodies and not document.joints:
        yield missing("joints", "axis")
    elif not document.beams and all(joint.type == "fixed" for joint in document.joints.values()):
        yield Problem("joints", 'has fixed joints only, so nothing moves; add one that does, such as type = "revolute"')


def _command_problems(document: Document) -> Iterator[Problem]:
    for name, actuator in document.actuators.items():
        try:
            parse_unit(actuator.command_unit)
        except UnitError as error:
            yield Problem(place("actuators", name, "command_unit"), f"is wrong: {error}")


def _channel_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    known = ("time", *structure.channels)
    for name, entry in (document.channels or {}).items():
        if name not in known and name not in structure.deflections:
            repair = near_match(name, known, what="its channels are")
            yield Problem(place("channels", name), f"is no channel of the model; {repair}")
            continue
        try:
            require_dimension(entry.unit, "s" if name == "time" else structure.unit(name))
        except UnitError as error:
            yield Problem(place("channels", name, "unit"), f"is wrong: {error}")


def _inertia_problems(body: str, _: Document, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
    """Conditions on the inertia about the centre of mass: no negative principal moment, and the triangle inequality.

    Principal moments are integrals of squared distances, for example of y^2 + z^2, so none exceeds the sum of the other
    two. (J. Wittenburg, "Dynamics of Multibody Systems", 2008, section 3.1.)
    """
    xx, yy, zz, xy, xz, yz = (
        parameters[f"{body}.inertia.{axes}"].value for axes in ("xx", "yy", "zz", "xy", "xz", "yz")
    )
    moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    slack = INERTIA_TOLERANCE * float(np.abs(moments).max()) + float(np.finfo(np.float64).tiny)
    shown = ", ".join(f"{moment:.4g}" for moment in moments)
    where = place("bodies", body, "inertia")
    if moments[0] < -slack:
        yield Problem(
            where, f"has the principal moments {shown} kg m^2, but none can be negative; correct the products"
        )
    elif moments[0] + moments[1] < moments[2] - slack:
        rest = (
            f"has the principal moments {shown} kg m^2, but the largest cannot exceed the sum of the others"
            f" ({moments[0] + moments[1]:.4g}); correct it"
        )
        yield Problem(where, rest)
