"""What a model knows, back in the URDF that it came from: ``export_robot``."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path

import numpy as np

from vpm.errors import ModelError
from vpm.files import replacing
from vpm.model import Model
from vpm.model.body import INERTIA_TOLERANCE
from vpm.model.pose import Pose, pose
from vpm.robots.content import Draft, plain_effect
from vpm.robots.edits import Changes, Edits
from vpm.robots.importing import FLOATING, drafted, robot_of
from vpm.robots.lumping import Lump
from vpm.robots.markup import Element, Markup, clean, read_markup
from vpm.robots.parts import SINGLE, Inertial, Joint, Robot, moved, without
from vpm.robots.uncertain import Spread
from vpm.robots.urdf import inertia_of, origin_of
from vpm.robots.xacro import is_xacro

_AXES = ("xx", "yy", "zz", "xy", "xz", "yz")
#: Attributes of ``dynamics``, with the effects and parameters that they are.
_FRICTIONS = {"damping": plain_effect("damping"), "friction": plain_effect("friction")}


@dataclass(frozen=True)
class ExportedRobot:
    """A URDF with the numbers of a model.

    Attributes
    ----------
    content : bytes
        Of the file.
    changed : tuple of str
        What was written, one sentence for each link and each joint.
    notes : tuple of str
        What of the model has no place in a URDF.
    """

    content: bytes
    changed: tuple[str, ...]
    notes: tuple[str, ...]

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the URDF with the exported values.

        Raises
        ------
        FileError
            It cannot be written.
        """
        with replacing(path) as beside:
            beside.write_bytes(self.content)
        return Path(path)


def export_robot(model: Model, urdf: str | PathLike[str]) -> ExportedRobot:
    """Masses, centres, inertias, damping and friction of a model in the URDF that it came from.

    Only attributes whose numbers differ change; all other bytes of the file stay as they are. Where links are fixed to
    one that moves, the heaviest of them takes the difference, and the others keep their numbers.

    Parameters
    ----------
    model : Model
        As `import_robot` gave it, with other values of parameters, or with friction that was not there.
    urdf : path-like
        File that the model came from; it is read only.

    Raises
    ------
    ModelError
        The file is no URDF, lacks what the model has, or what is left for a link is no body.

    Examples
    --------
    >>> fitted = vpm.Model.load("fit/model.toml")
    >>> vpm.export_robot(fitted, "arm.urdf").save("arm_fitted.urdf")
    """
    markup = read_markup(urdf)
    if markup.root.tag != "robot" or is_xacro(markup):
        rest = "is no URDF, which alone takes values; expand a xacro file first: xacro robot.xacro > robot.urdf"
        raise ModelError(f"{urdf} {rest}", path=str(urdf))
    if markup.content[:2] in {b"\xff\xfe", b"\xfe\xff"}:
        raise ModelError(
            f"{urdf} is UTF-16, in which nothing can be written in place; save it as UTF-8", path=str(urdf)
        )
    robot = robot_of(markup, floating=FLOATING in {name.rsplit("_", 1)[0] for name in model.joints})
    tree, draft = drafted(robot, Spread())
    known = Model.from_dict(draft.content)
    writer = _Writer(markup, robot, draft, model, known, Edits(markup))
    for link, lump in tree.lumps.items():
        writer.body(link, lump)
        writer.joint(lump.joint)
    writer.notes += _without_place(model, known, draft, tree.lumps)
    return ExportedRobot(writer.edits.content(), tuple(writer.changed), tuple(dict.fromkeys(writer.notes)))


def _without_place(model: Model, known: Model, draft: Draft, lumps: dict[str, Lump]) -> Iterator[str]:
    """Effects and values of an exported model that no attribute of a URDF takes."""
    single = {draft.joints[lump.joint.name] for lump in lumps.values() if lump.joint.kind in SINGLE}
    had = {(effect.name, effect.at) for effect in known.effects}
    for effect in model.effects:
        kept = (
            effect.name in {name for name, _ in _FRICTIONS.values()} and effect.at in single and effect.side == "motor"
        )
        if not kept and (effect.name, effect.at) not in had and not effect.at.endswith("_tie"):
            yield f"effect {effect.name} at {effect.place} has no place in a URDF, and is not written"
    for name, parameter in known.parameters.items():
        if name.endswith((".rotor_inertia", ".gain", ".limit")) or ".ratios." in name:
            new = model.parameters.get(name)
            if new is not None and new.value != parameter.value and not name.endswith(".rotor_inertia"):
                yield f"{name} is {new.value:g} {new.unit} now, which has no place in a URDF, and is not written"


@dataclass
class _Writer:
    """The values of one model on their way into one file; `known` is the model of the file as it stands."""

    markup: Markup
    robot: Robot
    draft: Draft
    model: Model
    known: Model
    edits: Edits
    changed: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def _value(self, model: Model, name: str) -> float:
        if (parameter := model.parameters.get(name)) is None:
            rest = f"has {name}, which the model {model.name} has not; name the URDF that the model came from"
            raise ModelError(f"{self.markup.path} {rest}", where=name, path=self.markup.path)
        return float(parameter.value)

    def _inertial(self, model: Model, body: str) -> Inertial:
        center = tuple(self._value(model, f"{body}.center_of_mass.{axis}") for axis in "xyz")
        inertia = tuple(self._value(model, f"{body}.inertia.{axes}") for axes in _AXES)
        return Inertial(self._value(model, f"{body}.mass"), center, inertia)

    # ---- links -------------------------------------------------------------------------------------------------------

    def body(self, link: str, lump: Lump) -> None:
        """Export a moved link, where it differs from what the file has."""
        name = self.draft.bodies[link]
        new, old = self._inertial(self.model, name), self._inertial(self.known, name)
        if new == old:
            return
        heavy = {part: (own, at) for part, at in lump.parts if (own := self.robot.links[part]) is not None}
        if not heavy:
            self.notes.append(f'link "{clean(link)}" has no <inertial>, and its values are not written')
            return
        taker = max(heavy, key=lambda part: heavy[part][0].mass)
        others = [moved(own, at) for part, (own, at) in heavy.items() if part != taker]
        left = self._left(taker, new, others)
        self._write_inertial(taker, moved(left, inverse(heavy[taker][1])))

    def _left(self, taker: str, whole: Inertial, others: list[Inertial]) -> Inertial:
        """Body for one link of an exported lump: what is left for it."""
        rest = whole.mass - sum(other.mass for other in others)
        if rest > 0.0:
            left = without(whole, others)
            moments = np.linalg.eigvalsh(left.matrix)
            slack = INERTIA_TOLERANCE * float(np.abs(moments).max())
            if not others or (moments[0] >= -slack and moments[0] + moments[1] >= moments[2] - slack):
                return left
        what = f"a mass of {rest:.4g} kg" if rest <= 0.0 else "an inertia that no body has"
        text = (
            f'link "{clean(taker)}" would be left with {what} beside what is fixed to it; correct the fixed links first'
        )
        raise ModelError(f"{self.markup.path}: {text}", path=self.markup.path)

    def _write_inertial(self, link: str, new: Inertial) -> None:
        whose = f'link "{clean(link)}"'
        element = next(one for one in self.markup.root.all("link") if one.attributes["name"].strip() == link)
        inertial = self.markup.need(element, "inertial", whose)
        translation, angles = origin_of(self.markup, inertial, whose)
        turn = pose((0.0, 0.0, 0.0), angles)
        shown = moved(Inertial(new.mass, (0.0, 0.0, 0.0), new.inertia), inverse(turn))
        old = inertia_of(self.markup, inertial, whose)
        mass = self.markup.need(inertial, "mass", whose)
        self.edits.numbers(mass, "value", (new.mass,), (self.markup.number(mass, "value", None, whose),))
        origin, inertia = inertial.first("origin"), inertial.first("inertia")
        self.edits.put(inertial, origin, "origin", {"xyz": (new.center, translation)})
        values: Changes = {
            f"i{axes}": ((one,), (was,)) for axes, one, was in zip(_AXES, shown.inertia, old, strict=True)
        }
        self.edits.put(inertial, inertia, "inertia", values, size=max(map(abs, shown.inertia)))
        self.changed.append(f"{whose}: {new.mass:.6g} kg")

    # ---- joints ------------------------------------------------------------------------------------------------------

    def joint(self, joint: Joint) -> None:
        """Export damping, friction and armature of a joint."""
        if joint.kind not in SINGLE:
            return
        name, whose = self.draft.joints[joint.name], f'joint "{clean(joint.name)}"'
        element = self._element(joint)
        dynamics = element.first("dynamics")
        values: Changes = {}
        for key, (effect, parameter) in _FRICTIONS.items():
            found = [one for one in self.model.effects if (one.name, one.at, one.side) == (effect, name, "motor")]
            new = self.model.parameters[found[0].parameter_names[parameter]].value if found else 0.0
            old = 0.0 if dynamics is None else self.markup.number(dynamics, key, 0.0, whose)
            values[key] = ((float(new),), (old,))
        values |= self._armature(joint, dynamics, name, whose)
        words = [f"{key} {new[0]:.6g}" for key, (new, old) in values.items() if new != old]
        if words:
            self.edits.put(element, dynamics, "dynamics", values)
            self.changed.append(f"{whose}: {', '.join(words)}")

    def _armature(self, joint: Joint, dynamics: Element | None, name: str, whose: str) -> Changes:
        """Export the inertia of a rotor only where the file has its attribute."""
        parameter = self.model.parameters.get(f"{name}.rotor_inertia")
        new = 0.0 if parameter is None else float(parameter.value)
        if new == joint.rotor:
            return {}
        if dynamics is None or "armature" not in dynamics.attributes:
            self.notes.append(f"{whose}: a rotor of {new:g} has no place in a URDF, and is not written")
            return {}
        old = self.markup.number(dynamics, "armature", 0.0, whose)
        return {"armature": ((old + new - joint.rotor,), (old,))}

    def _element(self, joint: Joint) -> Element:
        return next(one for one in self.markup.root.all("joint") if one.attributes["name"].strip() == joint.name)


def inverse(place: Pose) -> Pose:
    """Inverse pose for export: the outer frame in the inner one."""
    if place == Pose():
        return place
    turn = np.reshape(place.rotation, (3, 3)).T
    return Pose(tuple((-turn @ np.asarray(place.translation)).tolist()), tuple(turn.ravel().tolist()))
