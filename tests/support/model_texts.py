"""Model files as text: the same file with a few words changed, and what of a model reaches the core."""

import json
from typing import Any

import pytest

from vpm.errors import ModelError
from vpm.model import Model

#: Thigh and shank of a leg that hangs from the world: bodies and joints of a model text.
TWO_LINKS = """\
[bodies.thigh]
mass = 8.0
center_of_mass = [0.0, 0.0, -0.2]
inertia = [0.1, 0.1, 0.01, 0.0, 0.0, 0.0]

[bodies.shank]
mass = 4.0
center_of_mass = [0.0, 0.0, -0.2]
inertia = [0.05, 0.05, 0.01, 0.0, 0.0, 0.0]

[joints.hip]
type = "revolute"
parent = "world"
child = "thigh"
axis = [0.0, 1.0, 0.0]

[joints.knee]
type = "revolute"
parent = "thigh"
child = "shank"
axis = [0.0, 1.0, 0.0]
translation = [0.0, 0.0, -0.4]
"""


def changed(text: str, *changes: tuple[str, str]) -> Model:
    """Model of a file in which each old text, which has to be there, stands once replaced by a new one."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return Model.from_toml(text)


def refused(where: str, words: str, text: str, *changes: tuple[str, str]) -> None:
    """Assert that a file with changes is refused in one sentence, which names a place and holds some words."""
    with pytest.raises(ModelError) as caught:
        changed(text, *changes)
    message = str(caught.value)
    assert caught.value.where == where, message
    assert words in message
    assert message.startswith(where)
    assert "\n" not in message


def described(model: Model) -> Any:
    """Description that the core reads."""
    return json.loads(model.description())


def on_rail(
    body: str,
    mass: str = "2.0",
    *,
    joint: str = "axis",
    drive: str = "drive",
    gain: str = "1.0",
    gravity: str = "[0.0, 0.0, 0.0]",
    along: str = "[1.0, 0.0, 0.0]",
) -> str:
    """Model file of a body on a rail with an ideal drive, whose table stands last."""
    return f"""
name = "{body}"
gravity = {gravity}
{sliding(body, mass, joint, "world", along)}[actuators.{drive}]
joint = "{joint}"
gain = {gain}
"""


def sliding(body: str, mass: str, joint: str, parent: str, along: str = "[1.0, 0.0, 0.0]") -> str:
    """Tables of a body that slides on another one."""
    return f"""[bodies.{body}]
mass = {mass}
[joints.{joint}]
type = "prismatic"
parent = "{parent}"
child = "{body}"
axis = {along}
"""


def rod(height: float, mass: str = "1.0") -> str:
    """Model file of a rod on a hinge that a motor turns, with its centre of mass above or below, m."""
    return f"""
name = "rod"
gravity = [0, 0, -9.81]
[bodies.rod]
mass = {mass}
center_of_mass = [0, 0, {height}]
inertia = [0.002, 0.002, 0.001, 0, 0, 0]
[joints.hinge]
type = "revolute"
parent = "world"
child = "rod"
axis = [0, 1, 0]
[actuators.motor]
joint = "hinge"
gain = 1.0
"""


def two_links(
    upper: str, lower: str, elbow: str, *, axis: str = "[0.0, 0.0, 1.0]", gravity: str = "[0.0, 0.0, 0.0]"
) -> str:
    """Model file of two links on parallel hinges, by the lines of their bodies and the place of the elbow."""
    return f"""
name = "two links"
gravity = {gravity}
[bodies.upper]
{upper}
[bodies.lower]
{lower}
[joints.shoulder]
type = "revolute"
parent = "world"
child = "upper"
axis = {axis}
[joints.elbow]
type = "revolute"
parent = "upper"
child = "lower"
axis = {axis}
translation = {elbow}
"""


def effect_text(kind: str, at: str, **parameters: object) -> str:
    """Table of an effect."""
    lines = [f"{name} = {value}" for name, value in parameters.items()]
    return "\n".join(["[[effects]]", f'type = "{kind}"', f'at = "{at}"', *lines, ""])


#: Carriage on a rail with an ideal drive, its mass and its viscous friction uncertain.
DAMPED_AXIS = (
    on_rail("carriage", "{ value = 2.0, uncertainty = 0.2 }")
    + 'command_unit = "N"\n'
    + effect_text("viscous_friction", "axis", viscous="{ value = 3.0, uncertainty = 1.0 }")
)
