"""Transmissions of a URDF: those of one joint, and those that couple two.

Laws: the documentation of ``transmission_interface`` of ros2_control, of its classes ``DifferentialTransmission`` and
``FourBarLinkageTransmission``, there "joint to actuator", position.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

from vpm.robots.markup import Element, Markup, clean
from vpm.robots.parts import SINGLE, Drive, Joint, Robot, Shaft

_REDUCTION = ("mechanicalReduction", "mechanical_reduction")


def read_transmissions(markup: Markup, robot: Robot) -> None:
    """Put shafts of coupled transmissions, and rotors that they say, into a robot."""
    for element in markup.root.all("transmission"):
        name = clean(element.attributes.get("name", "").strip()) or "transmission"
        kind_element = element.first("type")
        kind = element.attributes.get("type", "") if kind_element is None else _text(markup, kind_element)
        joints, actuators = list(element.all("joint")), list(element.all("actuator"))
        names = [markup.text(joint, "name", f'transmission "{name}"') for joint in joints]
        for one, joint in zip(names, joints, strict=True):
            if one not in robot.joints or robot.joints[one].kind not in SINGLE:
                rest = f'is on "{clean(one)}", which is no joint with one coordinate; correct it'
                markup.fail(joint, f'transmission "{name}" {rest}')
        coupled = {"Differential": _differential, "FourBar": _four_bar}
        law = next((law for key, law in coupled.items() if key in kind), None)
        if law is not None and len(joints) == len(actuators) == 2 and len(set(names)) == 2:
            _couple(robot, name, law, _by_role(actuators, markup, name), _by_role(joints, markup, name))
        elif len(names) == 1:
            _single(markup, robot, name, names[0], element)
        else:
            robot.notes.append(f'transmission "{name}" ({clean(kind) or "no type"}) is left out')


def _text(markup: Markup, element: Element) -> str:
    """Text between the tags of a transmission's element that holds nothing else."""
    written = markup.content[element.start : max(element.start, element.close)]
    first = written.find(b">")
    return "" if first < 0 else written[first + 1 :].decode("utf-8", "replace").strip()


def _number_below(markup: Markup, element: Element, tags: tuple[str, ...], whose: str) -> float | None:
    """Number of a transmission in the first element of one of the tags, or as its ``value``."""
    for child in element.children:
        if child.tag in tags:
            written = child.attributes.get("value", _text(markup, child))
            return markup.number(replace(child, attributes={"value": written}), "value", None, whose)
    return None


def _by_role(elements: list[Element], markup: Markup, name: str) -> list[tuple[str, float]]:
    """Names and reductions of a transmission in the order of their roles, joint1 before joint2."""
    whose = f'transmission "{name}"'
    found = []
    for element in elements:
        reduction = _number_below(markup, element, _REDUCTION, whose)
        if reduction == 0.0:
            markup.fail(element, f"{whose} has a reduction of 0; correct it")
        found.append((_role(element, markup), markup.text(element, "name", whose), reduction or 1.0))
    return [(one, reduction) for _, one, reduction in sorted(found, key=lambda entry: entry[0])]


def _role(element: Element, markup: Markup) -> str:
    below = element.first("role")
    return element.attributes.get("role", "") if below is None else _text(markup, below)


Pair = list[tuple[str, float]]
Law = Callable[[Pair, Pair], list[tuple[float, float]]]


def _differential(actuators: Pair, joints: Pair) -> list[tuple[float, float]]:
    (_, a1), (_, a2), (_, j1), (_, j2) = *actuators, *joints
    return [(a1 * j1, a1 * j2), (a2 * j1, -a2 * j2)]


def _four_bar(actuators: Pair, joints: Pair) -> list[tuple[float, float]]:
    (_, a1), (_, a2), (_, j1), (_, j2) = *actuators, *joints
    return [(a1 * j1, 0.0), (a2, a2 * j2)]


def _couple(robot: Robot, name: str, law: Law, actuators: Pair, joints: Pair) -> None:
    rows = law(actuators, joints)
    for (actuator, _), row in zip(actuators, rows, strict=True):
        ratios = {joint: ratio for (joint, _), ratio in zip(joints, row, strict=True) if ratio != 0.0}
        robot.shafts.append(Shaft(actuator, ratios))
    robot.notes.append(
        f'transmission "{name}": its actuators are shafts, which turn with both joints; offsets are left out'
    )


def _single(markup: Markup, robot: Robot, name: str, joint: str, element: Element) -> None:
    """Drive of a transmission with one joint: its reduction is told, its rotor becomes joint inertia."""
    whose = f'transmission "{name}"'
    reduction = rotor = None
    for below in (element, *element.all("actuator"), *element.all("joint")):
        gear = _number_below(markup, below, (*_REDUCTION, "drake:gear_ratio"), whose)
        inertia = _number_below(markup, below, ("motorInertia", "drake:rotor_inertia"), whose)
        reduction, rotor = gear if gear is not None else reduction, inertia if inertia is not None else rotor
    if rotor is not None and rotor < 0.0:
        markup.fail(element, f"{whose} has the rotor inertia {rotor:g} kg m^2, but none can be negative; correct it")
    if rotor:
        felt = rotor * (reduction or 1.0) ** 2
        robot.joints[joint] = replace(robot.joints[joint], rotor=robot.joints[joint].rotor + felt)
    if reduction not in {None, 1.0}:
        rest = "commands and efforts are those of the joint, behind it"
        robot.notes.append(f'{whose}: the reduction {reduction:g} of joint "{clean(joint)}" is left out; {rest}')


def drives_of(robot: Robot, joints: Mapping[str, Joint]) -> list[Drive]:
    """Drives by transmission: those that the file names, else one for each shaft and free joint.

    A joint that turns with a shaft, or that follows another one, has none of its own.
    """
    if robot.drives is not None:
        return robot.drives
    turned = {joint for shaft in robot.shafts for joint in shaft.ratios}
    of_shafts = [Drive(f"{shaft.name}_drive", shaft=shaft.name) for shaft in robot.shafts]
    return of_shafts + [
        Drive(f"{joint.name}_drive", joint=joint.name, limit=joint.effort)
        for joint in joints.values()
        if joint.kind in SINGLE and joint.mimic is None and joint.name not in turned
    ]
