"""Robots of other programs as models: ``import_robot``."""

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from vpm.errors import ModelError
from vpm.files import write_text
from vpm.model import Model
from vpm.robots.content import Draft, draft_of, followers, put_tie_shafts, put_ties
from vpm.robots.lumping import WORLD, Tree, gather
from vpm.robots.markup import Markup, clean, read_markup
from vpm.robots.mjcf import read_mjcf
from vpm.robots.parts import Joint, Robot
from vpm.robots.uncertain import Spread
from vpm.robots.urdf import read_urdf
from vpm.robots.xacro import expanded, is_xacro

#: Frequency at which a joint swings about its place beside the one that it follows, Hz.
TIE_FREQUENCY = 100.0
#: Joint by which a robot floats whose file lets it stand.
FLOATING = "floating_base"


@dataclass(frozen=True)
class ImportedRobot:
    """A robot as a model.

    Attributes
    ----------
    text : str
        Of its model file, with units and comments.
    notes : tuple of str
        What was left out or changed, one sentence each; they stand at the head of the text too.
    """

    model: Model
    text: str
    notes: tuple[str, ...]

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the model file of an imported robot with its comments.

        Raises
        ------
        FileError
            It cannot be written.
        """
        return write_text(path, self.text)


def import_robot(
    path: str | PathLike[str],
    *,
    uncertain: float = 0.0,
    floating: bool = False,
    tie_frequency: float = TIE_FREQUENCY,
    xacro_args: Mapping[str, str] | None = None,
) -> ImportedRobot:
    """Model of the robot of a URDF, a xacro or an MJCF file.

    Links that a fixed joint carries are parts of what carries them; frames without mass at the end of what moves become
    markers. Each driven joint gets an ideal drive in N m or N and sensors of position, velocity and effort, so that a
    channel table is all that a log needs besides.

    Parameters
    ----------
    path : path-like
        URDF (``<robot>``), xacro (``.xacro``; needs the extra ``robots``) or MJCF (``<mujoco>``; needs ``robots``).
    uncertain : float
        Standard deviation of masses, centres, inertias, rotors, frictions and springs, as a share of their size, by
        five of which a fit may move them. 0 for known ones.
    floating : bool
        Let the root of a URDF float by a free joint ``floating_base``, in place of standing on the world.
    tie_frequency : float
        Frequency at which joints that follow others (mimic joints, equalities of joints) swing about their place, Hz.
    xacro_args : mapping of str to str, optional
        Arguments of a xacro file.

    Raises
    ------
    ModelError
        The file cannot be read, is damaged, or describes what a model cannot be; one sentence with the line.
    MissingExtraError
        The file needs a library that is not there.

    Examples
    --------
    >>> robot = vpm.import_robot("arm.urdf", uncertain=0.1)
    >>> robot.save("arm.toml")
    >>> robot.model.mass_matrix([0.0] * 6)
    """
    if not 0.0 < tie_frequency < np.inf:
        raise ModelError(f"ties swing at {tie_frequency:g} Hz; give a frequency above 0, such as {TIE_FREQUENCY:g}")
    markup = read_markup(path)
    if is_xacro(markup):
        markup = expanded(markup, xacro_args or {})
    elif xacro_args:
        raise ModelError(f"{path} is no xacro file, so it takes no arguments; leave them out", path=str(path))
    robot = robot_of(markup, floating=floating)
    tree, draft = drafted(robot, Spread(uncertain))
    if any(True for _ in followers(tree)):
        robot.notes += _tied(draft, tree, tie_frequency)
    notes = tuple(dict.fromkeys((*robot.notes, *draft.names.notes)))
    model = _checked(draft, path)
    head = [f"{clean(robot.name)}, from {clean(Path(path).name)}", *(f"- {note}" for note in notes), ""]
    return ImportedRobot(model, model.to_toml(draft.remarks, head), notes)


def robot_of(markup: Markup, *, floating: bool) -> Robot:
    """Parts of an imported robot, by the format of its file."""
    if markup.root.tag == "mujoco":
        if floating:
            raise ModelError(
                f"{markup.path} is MJCF, which says itself what floats; add a <freejoint/>", path=markup.path
            )
        return read_mjcf(markup)
    if markup.root.tag != "robot":
        rest = f"begins with <{clean(markup.root.tag)}>, but a URDF is a <robot> and MJCF a <mujoco>; name such a file"
        raise ModelError(f"{markup.path} {rest}", path=markup.path)
    robot = read_urdf(markup)
    return _afloat(robot) if floating else robot


def _afloat(robot: Robot) -> Robot:
    root = gather(robot).root
    if WORLD in robot.links or FLOATING in robot.joints:
        rest = f'has a link "{WORLD}" or a joint "{FLOATING}", so it says itself how it stands; do not let it float'
        raise ModelError(f"{robot.path} {rest}", path=robot.path)
    robot.links = {WORLD: None, **robot.links}
    robot.joints = {FLOATING: Joint(FLOATING, "free", WORLD, root), **robot.joints}
    return robot


def drafted(robot: Robot, spread: Spread) -> tuple[Tree, Draft]:
    """Moving links of an imported robot, and the content of its model but for the ties."""
    tree = gather(robot)
    standing = [
        link for link, (carrier, _) in tree.places.items() if carrier == WORLD and robot.links[link] is not None
    ]
    for link in standing:
        robot.notes.append(f'link "{clean(link)}": its mass is left out, because it stands on the world')
    return tree, draft_of(robot, tree, spread)


def _tied(draft: Draft, tree: Tree, frequency: float) -> list[str]:
    """Imported content with ties, each as stiff as what it moves needs."""
    put_tie_shafts(draft, tree)
    model = Model.from_dict(draft.content)
    inverse = np.linalg.inv(model.mass_matrix(np.zeros(len(model.coordinates))))
    moved_by = {}
    for joint, _ in followers(tree):
        ratios = draft.content["transmissions"][draft.joints[f"{joint.name} tie"]]["ratios"]
        row = np.array([ratios.get(name, 0.0) for name in model.joints])
        moved_by[joint.name] = 1.0 / float(row @ inverse @ row)
    return list(put_ties(draft, tree, moved_by, frequency))


def _checked(draft: Draft, path: str | PathLike[str]) -> Model:
    try:
        return Model.from_dict(draft.content)
    except ModelError as error:
        text = f"{path} gives a model that cannot be: {error}"
        raise ModelError(text, where=error.where, path=str(path)) from error
