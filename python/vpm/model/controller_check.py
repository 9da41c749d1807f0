"""What controllers name: actuators that nobody else commands, and channels that their law is made for."""

from __future__ import annotations

from collections.abc import Iterator

from vpm.errors import near_match
from vpm.model.controller import Cascade, ComputedTorque, Controller, ForceLoop, Pd, Pid
from vpm.model.drives import acted_on
from vpm.model.messages import Problem, place
from vpm.model.schema import Document
from vpm.model.structure import Structure


def controller_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Controllers that name what is not there, command what is commanded already, or cannot do what they are to."""
    seen: dict[str, str] = {}
    for name, controller in document.controllers.items():
        if isinstance(controller, ComputedTorque):
            yield from _list_problems(name, controller)
            yield from _elastic_problems(name, document)
        for i, (actuator, channel) in enumerate(controller.pairs):
            several: tuple[str | int, ...] = (i,) if isinstance(controller, ComputedTorque) else ()
            key = "actuators" if several else "actuator"
            where = place("controllers", name, key, *several)
            if actuator not in document.actuators:
                repair = near_match(actuator, document.actuators, what="it has")
                yield Problem(where, f'is "{actuator}", which is no actuator of the model; {repair}')
            elif actuator in seen:
                rest = f'is "{actuator}", which controller "{seen[actuator]}" already commands; remove one'
                yield Problem(where, rest)
            seen.setdefault(actuator, name)
            where = place("controllers", name, "measures", *several)
            yield from _channel_problems(where, channel, controller, structure)
            if actuator in document.actuators and channel in structure.outputs:
                yield from _pair_problems(where, actuator, channel, controller, document)


def _channel_problems(where: str, channel: str, controller: Controller, structure: Structure) -> Iterator[Problem]:
    positions = [f"{joint}.position" for joint in structure.joints]
    if isinstance(controller, Cascade | Pid | Pd):
        positions += [f"{shaft}.position" for shaft in structure.document.transmissions]
    lengths = [f"{line}.length" for line in structure.document.lines] if isinstance(controller, Pd) else []
    if channel not in (*positions, *lengths):
        repair = near_match(channel, [*positions, *lengths], what="it can measure")
        what = "no joint position or line length" if lengths else "no joint position"
        yield Problem(where, f'is "{channel}", which is {what} of the model; {repair}')


def _pair_problems(
    where: str, actuator: str, channel: str, controller: Controller, document: Document
) -> Iterator[Problem]:
    """Laws that go from a joint to its actuator, with an actuator that is elsewhere."""
    entry, joint = document.actuators[actuator], channel.partition(".")[0]
    elsewhere = entry.joint not in {None, joint}
    drives = acted_on(entry)
    if isinstance(controller, ForceLoop) and elsewhere:
        rest = (
            f"but a force_loop needs an actuator on a line or on the joint it measures; measure {entry.joint}.position"
        )
        yield Problem(where, f'is "{channel}", while "{actuator}" drives {drives}, {rest}')
    if isinstance(controller, ComputedTorque) and entry.type != "ideal":
        rest = f'has the type "{entry.type}", but computed_torque commands efforts; make it "ideal" or control it by pd'
        yield Problem(place("actuators", actuator, "type"), rest)
    elif isinstance(controller, ComputedTorque) and entry.joint != joint:
        rest = "but computed_torque needs each actuator on the joint it measures in the same place; reorder the lists"
        rest += "" if entry.joint is not None else ", or use force_loop"
        yield Problem(where, f'is "{channel}", while "{actuator}" drives {drives}, {rest}')


def _list_problems(name: str, controller: ComputedTorque) -> Iterator[Problem]:
    count = len(controller.actuators)
    for key in ("measures", "proportional", "derivative", "limit"):
        found = getattr(controller, key)
        if found is not None and len(found) != count:
            rest = f"has {len(found)} entries for {count} actuators; give one for each, in their order"
            yield Problem(place("controllers", name, key), rest)


def _elastic_problems(name: str, document: Document) -> Iterator[Problem]:
    elastic = [beam for beam, entry in document.beams.items() if entry.detail.name != "rigid"]
    if elastic:
        rest = (
            f'inverts the model of the machine, but nobody measures the elastic coordinates of beam "{elastic[0]}"; '
            'set its level to "rigid" or use type = "pd"'
        )
        yield Problem(place("controllers", name), rest)
