"""All drives: one table for each kind, chosen by ``type``, and the checks of all of them and of their supplies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

from pydantic import Discriminator, Tag

from vpm.errors import UnitError, VpmError
from vpm.model.drives.drive import Drive
from vpm.model.drives.hydraulic import Hydraulic
from vpm.model.drives.ideal import Ideal
from vpm.model.drives.maxwell_narx import MaxwellNarx
from vpm.model.drives.motor import DcMotor
from vpm.model.drives.narx import Narx
from vpm.model.drives.sampled import Sampled
from vpm.model.drives.spring import Maxwell, SpringDamper
from vpm.model.drives.table import Table
from vpm.model.messages import Problem, place
from vpm.units import parse_unit

if TYPE_CHECKING:
    from vpm.model.schema import Document
    from vpm.model.structure import Structure


def _type_of(entry: object) -> str:
    """Type of an actuator as it is written; ideal without one."""
    kind = entry.get("type", "ideal") if isinstance(entry, Mapping) else getattr(entry, "type", "ideal")
    return kind if isinstance(kind, str) else str(kind)


Actuator = Annotated[
    Annotated[Ideal, Tag("ideal")]
    | Annotated[DcMotor, Tag("dc_motor")]
    | Annotated[SpringDamper, Tag("spring_damper")]
    | Annotated[Maxwell, Tag("maxwell")]
    | Annotated[Hydraulic, Tag("hydraulic")]
    | Annotated[Table, Tag("table")]
    | Annotated[Narx, Tag("narx")]
    | Annotated[MaxwellNarx, Tag("maxwell_narx")],
    Discriminator(_type_of),
]

#: Kinds of actuators by their type in a model file.
ACTUATOR_TYPES: Mapping[str, type[Drive]] = {
    tag.tag: kind for kind, tag in map(get_args, get_args(get_args(Actuator)[0]))
}


def with_files(document: Document, folder: Path) -> tuple[Document, list[Problem]]:
    """Read the files that actuators name; tell missing ones, other contents, and values said twice."""
    actuators, problems = dict(document.actuators), list[Problem]()
    for name, actuator in document.actuators.items():
        if not isinstance(actuator, Sampled) or actuator.file is None:
            continue
        where = place("actuators", name, "file")
        if twice := actuator.said_twice:
            rest = f"is given, and {' and '.join(twice)} as well; remove the file or what it says"
            problems.append(Problem(where, rest))
            continue
        try:
            actuators[name] = actuator.with_file(folder / actuator.file)
        except VpmError as error:
            problems.append(Problem(where, f"is wrong: {error}"))
    return document.model_copy(update={"actuators": actuators}), problems


def drive_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Problems of actuators: missing supplies, wrong targets, sizes missing or given twice."""
    for name, supply in document.supplies.items():
        yield from supply.problems(name, structure)
    for name, actuator in document.actuators.items():
        yield from actuator.carrier_problems(name, structure)
        if not isinstance(actuator, Sampled):
            yield from actuator.problems(name, structure)
    for name, actuator in document.actuators.items():
        if isinstance(actuator, Sampled):
            yield from actuator.problems(name, structure)


def command_problems(document: Document) -> Iterator[Problem]:
    """Problems of actuators' command units that are no units."""
    for name, actuator in document.actuators.items():
        try:
            parse_unit(actuator.command_unit)
        except UnitError as error:
            yield Problem(place("actuators", name, "command_unit"), f"is wrong: {error}")


def unit_problems(document: Document) -> Iterator[Problem]:
    """Problems of actuators' commands of the wrong kind, and impossible data-sheet numbers."""
    for name, actuator in document.actuators.items():
        yield from actuator.unit_problems(name)
