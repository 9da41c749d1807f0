"""What actuators, sensors, controllers, gauges, lines and transmissions name."""

from __future__ import annotations

from collections.abc import Iterator

from vpm.errors import near_match
from vpm.model.controller_check import controller_problems
from vpm.model.drives import Actuator
from vpm.model.messages import Problem, place
from vpm.model.schema import Document
from vpm.model.structure import Structure
from vpm.model.tree import outside_problems


def reference_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Components that name what is not there, or sit where another one already does."""
    for name, actuator in document.actuators.items():
        yield from _actuator_problems(name, actuator, document, structure)
    seen: dict[str, str] = {}
    for name, sensor in document.sensors.items():
        where = place("sensors", name, "measures")
        if sensor.measures not in structure.outputs:
            repair = near_match(sensor.measures, structure.outputs, what="it can measure")
            yield Problem(where, f'is "{sensor.measures}", which is no output of the model; {repair}')
        elif sensor.measures in seen:
            yield Problem(
                where, f'is "{sensor.measures}", which sensor "{seen[sensor.measures]}" already reads; remove one'
            )
        seen.setdefault(sensor.measures, name)
    yield from controller_problems(document, structure)
    yield from _line_problems(document)
    yield from _transmission_problems(document, structure)


def _actuator_problems(name: str, actuator: Actuator, document: Document, structure: Structure) -> Iterator[Problem]:
    given = [key for key in ("joint", "line", "transmission") if getattr(actuator, key) is not None]
    if not given:
        rest = 'is missing; add it, for example joint = "axis"'
        rest += ", or line with the name of a line" if document.lines else ""
        rest += ", or transmission with the name of one" if document.transmissions else ""
        yield Problem(place("actuators", name, "joint"), rest)
    elif len(given) > 1:
        listed = " and ".join(f"a {key}" for key in given)
        repair = "remove one of the two keys" if len(given) == 2 else "keep one of the three keys"
        yield Problem(place("actuators", name), f"drives {listed}; {repair}")
    elif actuator.joint is not None:
        yield from _joint_problems(place("actuators", name, "joint"), actuator.joint, document, structure)
    else:
        key, known = given[0], document.lines if actuator.line is not None else document.transmissions
        other = getattr(actuator, key)
        if other not in known:
            repair = near_match(other, known, what="it has") if known else f"add a table [{key}s.{other}]"
            yield Problem(place("actuators", name, key), f'is "{other}", which is no {key} of the model; {repair}')


def _transmission_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Transmissions of joints that are not there or do not turn them."""
    for name, transmission in document.transmissions.items():
        for joint, ratio in transmission.ratios.items():
            where = place("transmissions", name, "ratios", joint)
            yield from _joint_problems(where, joint, document, structure)
            if ratio.value == 0.0:
                rest = f'is 0, but a shaft that does not turn with "{joint}" needs no ratio; leave the joint out'
                yield Problem(where, rest)


def _joint_problems(where: str, joint: str, document: Document, structure: Structure) -> Iterator[Problem]:
    if joint in structure.joints:
        return
    if joint in document.joints:
        parts = [axis.name for axis in structure.axes if axis.joint == joint]
        repair = f"name one of its coordinates, {', '.join(parts)}" if parts else "name a joint that moves"
        kind = document.joints[joint].type
        yield Problem(where, f'is "{joint}", a {kind} joint, which has {len(parts) or "no"} coordinates; {repair}')
        return
    repair = near_match(joint, structure.joints, what="it has")
    yield Problem(where, f'is "{joint}", which is no joint of the model; {repair}')


def _line_problems(document: Document) -> Iterator[Problem]:
    for name, line in document.lines.items():
        start, end = line.start, line.end
        if start.parent == end.parent and (start.at == end.at or start.parent not in document.beams):
            rest = f'has both ends on "{start.parent}", so its length cannot change; give one end another parent'
            yield Problem(place("lines", name), rest)


def gauge_problems(document: Document) -> Iterator[Problem]:
    """Gauges on no beam, outside of it, or where nothing that the beam can do strains them."""
    for name, gauge in document.gauges.items():
        if gauge.beam not in document.beams:
            repair = near_match(gauge.beam, document.beams, what="it has")
            yield Problem(place("gauges", name, "beam"), f'is "{gauge.beam}", which is no beam of the model; {repair}')
            continue
        if document.beams[gauge.beam].solid is not None:
            rest = f'is "{gauge.beam}", a reduced solid, whose strains nobody knows; remove the gauge'
            yield Problem(place("gauges", name, "beam"), rest)
            continue
        yield from outside_problems(("gauges", name), gauge.at, gauge.beam, document)
        deforms = document.beams[gauge.beam].deforms
        arms = {"bending_x": gauge.y, "bending_y": gauge.x, "extension": 1.0}
        if not any(component in deforms and arm != 0.0 for component, arm in arms.items()):
            rest = (
                f'can only read zero: beam "{gauge.beam}" deforms in {", ".join(deforms)}, and the strain at '
                f"x = {gauge.x:g} m, y = {gauge.y:g} m is extension + y bending_x - x bending_y; move the gauge"
            )
            yield Problem(place("gauges", name), rest)
