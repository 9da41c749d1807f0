"""Joints of every type in a model file: how they are expanded, what hangs on fixed ones, and what is refused."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from model_texts import described
from vpm.errors import ModelError
from vpm.model import Model
from vpm.model.joint import plane, unit

Matrix = NDArray[np.float64]


def machine(joint: dict[str, Any], **more: Any) -> Model:
    """One body on a joint that is called like its type."""
    joints = {joint["type"]: {"parent": "world", "child": "body", **joint}}
    body = {"mass": 2.0, "center_of_mass": [0.1, 0.0, 0.0], "inertia": [0.02, 0.03, 0.04, 0.0, 0.0, 0.0]}
    content = {"name": "joint", "gravity": [0.0, 0.0, -9.81], "bodies": {"body": body}, "joints": joints}
    return Model.from_dict({**content, **more})


def transform(axis: str, angle: float, shift: tuple[float, float, float]) -> Matrix:
    """Homogeneous transform: a turn about x or z, and a shift."""
    c, s = math.cos(angle), math.sin(angle)
    turn: list[list[float]] = [[1, 0, 0], [0, c, -s], [0, s, c]] if axis == "x" else [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, shift
    return matrix


def placed(entry: dict[str, Any]) -> Matrix:
    """Homogeneous transform of a part of a description."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.reshape(entry["rotation"], (3, 3))
    matrix[:3, 3] = entry["translation"]
    return matrix


# ---- joints of several coordinates -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "names", "kinds", "axes"),
    [
        ("cylindrical", ["rotation", "translation"], ["revolute", "prismatic"], [[0, 0, 1], [0, 0, 1]]),
        (
            "planar",
            ["x", "y", "rotation"],
            ["prismatic", "prismatic", "revolute"],
            [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        ),
        ("spherical", ["x", "y", "z"], ["revolute"] * 3, [[1, 0, 0], [0, 1, 0], [0, 0, 1]]),
        (
            "free",
            ["x", "y", "z", "rx", "ry", "rz"],
            [*["prismatic"] * 3, *["revolute"] * 3],
            [[1, 0, 0], [0, 1, 0], [0, 0, 1]] * 2,
        ),
    ],
)
def test_coordinates_follow_each_other_on_massless_carriers(
    kind: str, names: list[str], kinds: list[str], axes: list[list[float]]
) -> None:
    joint = {"type": kind, "translation": [1.0, 2.0, 3.0], "rotation": [0.1, 0.2, 0.3]}
    model = machine(joint if kind in {"spherical", "free"} else {**joint, "axis": [0.0, 0.0, 1.0]})
    assert model.joints == model.coordinates == tuple(f"{kind}_{name}" for name in names)
    assert model.bodies == ("body",)
    bodies = described(model)["bodies"]
    assert [body["joint"]["kind"] for body in bodies] == kinds
    assert [body["joint"]["axis"] for body in bodies] == axes
    assert [body["on"] for body in bodies] == ["world", *({"body": k} for k in range(len(names) - 1))]
    assert [body["inertia"] is None for body in bodies] == [True] * (len(names) - 1) + [False]
    assert bodies[-1]["name"] == "body"
    assert len({body["name"] for body in bodies}) == len(bodies)
    # The place of the joint stands before its first coordinate, and nowhere else.
    assert bodies[0]["joint"]["translation"] == [1.0, 2.0, 3.0]
    assert all(placed(body["joint"]) == pytest.approx(np.eye(4)) for body in bodies[1:])


def test_a_screw_turns_and_travels() -> None:
    model = machine({"type": "helical", "axis": [1.0, 0.0, 0.0], "pitch": 0.0008})
    assert described(model)["bodies"][0]["joint"]["kind"] == {"helical": {"pitch": 0.0008}}
    assert model.joint_kind("helical") == "helical"
    assert model.channel_unit("helical.position") == "rad"
    assert model.channel_unit("helical.effort") == "N m"
    rough = model.with_effect("coulomb_friction", at="helical", coulomb=0.1)
    assert rough.parameters["helical.friction.transition_velocity"].value == 1e-2  # as of a joint that turns


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda a: math.hypot(*a) > 0.1))
def test_directions_of_a_plane_complete_a_frame(axis: tuple[float, float, float]) -> None:
    normal = unit(axis)
    first, second = plane(normal)
    frame = np.array([first, second, normal])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1.0)


def test_directions_of_a_plane_are_frame_axes_where_the_normal_is_one() -> None:
    assert plane((0.0, 0.0, 1.0)) == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    assert plane((1.0, 0.0, 0.0)) == ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    assert plane((0.0, 1.0, 0.0)) == ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))


def test_a_coordinate_can_be_driven_measured_and_rough() -> None:
    model = machine(
        {"type": "cylindrical", "axis": [0.0, 0.0, 1.0]},
        actuators={"motor": {"joint": "cylindrical_translation", "gain": 2.0}},
        sensors={"encoder": {"measures": "cylindrical_rotation.position"}},
        effects=[{"type": "viscous_friction", "at": "cylindrical_translation", "viscous": 3.0}],
    )
    assert model.parameters["motor.gain"].unit == "N"
    assert model.parameters["cylindrical_translation.friction.viscous"].unit == "N s/m"
    assert described(model)["actuators"][0]["on"] == {"joint": 1}
    assert described(model)["effects"][0]["joint"] == 1


# ---- fixed joints ----------------------------------------------------------------------------------------------------

GANTRY = {
    "name": "gantry",
    "gravity": [0.0, 0.0, -9.81],
    "bodies": {name: {"mass": 1.0} for name in ("carriage", "motor", "arm", "lamp")},
    "joints": {
        "axis": {"type": "prismatic", "parent": "world", "child": "carriage", "axis": [1.0, 0.0, 0.0]},
        "bolts": {
            "type": "fixed",
            "parent": "carriage",
            "child": "motor",
            "translation": [0.1, 0.0, 0.0],
            "rotation": [0.0, 0.0, math.pi / 2],
        },
        "shaft": {
            "type": "revolute",
            "parent": "motor",
            "child": "arm",
            "axis": [0.0, 0.0, 1.0],
            "translation": [0.2, 0.0, 0.0],
        },
        "screws": {"type": "fixed", "parent": "motor", "child": "lamp", "translation": [0.0, 0.3, 0.0]},
    },
    "markers": {"eye": {"parent": "lamp", "translation": [0.0, 0.0, 1.0]}},
}


def test_what_hangs_on_a_fixed_body_hangs_on_what_carries_it() -> None:
    model = Model.from_dict(GANTRY)
    told = described(model)
    assert model.joints == ("axis", "shaft")
    assert model.bodies == ("carriage", "motor", "arm", "lamp")
    assert [weld["name"] for weld in told["welds"]] == ["motor", "lamp"]
    assert [weld["on"] for weld in told["welds"]] == [{"body": 0}, {"body": 0}]
    shaft = told["bodies"][1]
    assert shaft["on"] == {"body": 0}
    assert shaft["joint"]["translation"] == pytest.approx([0.1, 0.2, 0.0])  # 0.2 along the motor's x, the carriage's y
    assert told["welds"][1]["translation"] == pytest.approx([-0.2, 0.0, 0.0])
    assert told["markers"][0]["on"] == {"body": 0}
    assert told["markers"][0]["translation"] == pytest.approx([-0.2, 0.0, 1.0])
    assert told["welds"][0]["inertia"]["mass"] == model.index("motor.mass")


def test_a_body_may_be_fixed_to_the_world() -> None:
    content = {**GANTRY, "bodies": {**GANTRY["bodies"], "base": {"mass": 50.0}}}  # type: ignore[dict-item]
    content["joints"] = {
        "anchor": {"type": "fixed", "parent": "world", "child": "base", "translation": [0.0, 0.0, 2.0]},
        **GANTRY["joints"],  # type: ignore[dict-item]
        "axis": {"type": "prismatic", "parent": "base", "child": "carriage", "axis": [1.0, 0.0, 0.0]},
    }
    told = described(Model.from_dict(content))
    assert told["bodies"][0]["on"] == "world"
    assert told["bodies"][0]["joint"]["translation"] == [0.0, 0.0, 2.0]


# ---- Denavit-Hartenberg ----------------------------------------------------------------------------------------------


@given(*[st.floats(-2.0, 2.0)] * 4)
def test_links_of_the_standard_convention(a: float, alpha: float, d: float, theta: float) -> None:
    model = machine({"type": "revolute", "dh": {"a": a, "alpha": alpha, "d": d, "theta": theta}})
    told = described(model)
    # The joint comes first, about z of its parent; the body's frame follows at a constant place.
    assert told["bodies"][0]["joint"]["axis"] == [0.0, 0.0, 1.0]
    assert placed(told["bodies"][0]["joint"]) == pytest.approx(np.eye(4))
    (weld,) = told["welds"] if a or alpha or d or theta else [told["bodies"][0]["joint"]]
    expected = (
        transform("z", theta, (0, 0, 0))
        @ transform("z", 0.0, (0, 0, d))
        @ transform("x", alpha, (0, 0, 0))
        @ transform("x", 0.0, (a, 0, 0))
    )
    assert placed(weld) == pytest.approx(expected, abs=1e-12)


@given(*[st.floats(-2.0, 2.0)] * 4)
def test_links_of_the_modified_convention(a: float, alpha: float, d: float, theta: float) -> None:
    link = {"a": a, "alpha": alpha, "d": d, "theta": theta, "convention": "modified"}
    told = described(machine({"type": "prismatic", "dh": link}))
    expected = (
        transform("x", alpha, (0, 0, 0))
        @ transform("x", 0.0, (a, 0, 0))
        @ transform("z", theta, (0, 0, 0))
        @ transform("z", 0.0, (0, 0, d))
    )
    assert placed(told["bodies"][0]["joint"]) == pytest.approx(expected, abs=1e-12)
    assert told["welds"] == []
    assert told["bodies"][0]["name"] == "body"


# ---- what cannot be right --------------------------------------------------------------------------------------------

WRONG: list[tuple[dict[str, Any], str, str]] = [
    ({"type": "hinge", "axis": [0, 0, 1]}, "joints.hinge.type", 'has the type "hinge"'),
    ({"type": "revolut", "axis": [0, 0, 1]}, "joints.revolut.type", 'did you mean "revolute"'),
    ({"type": "planar"}, "joints.planar.axis", "add it, for example axis = [1.0, 0.0, 0.0]"),
    ({"type": "planar", "axis": [0, 0, 2]}, "joints.planar.axis", "with length 2"),
    ({"type": "spherical", "axis": [0, 0, 1]}, "joints.spherical.axis", "a spherical joint has no axis"),
    ({"type": "helical", "axis": [0, 0, 1]}, "joints.helical.pitch", "for example pitch = 0.0008"),
    ({"type": "helical", "axis": [0, 0, 1], "pitch": 0.0}, "joints.helical.pitch", 'take type = "revolute"'),
    ({"type": "revolute", "axis": [0, 0, 1], "pitch": 0.1}, "joints.revolute.pitch", 'take type = "helical"'),
    ({"type": "revolute", "dh": {"a": 1.0}, "axis": [0, 0, 1]}, "joints.revolute", "with dh, the axis is z"),
    ({"type": "revolute", "dh": {"a": 1.0}, "rotation": [1, 0, 0]}, "joints.revolute", "and with rotation as well"),
    ({"type": "revolute", "dh": {"b": 1.0}}, "joints.revolute.dh.b", "the choices are a, alpha, convention, d, theta"),
    (
        {"type": "revolute", "dh": {"convention": "craig"}},
        "joints.revolute.dh.convention",
        'has the convention "craig"; the choices are modified, standard',
    ),
]


@pytest.mark.parametrize(("joint", "where", "says"), WRONG, ids=[f"{w}: {s}" for _, w, s in WRONG])
def test_what_cannot_be_right_is_refused(joint: dict[str, Any], where: str, says: str) -> None:
    with pytest.raises(ModelError) as caught:
        machine(joint)
    assert caught.value.where == where
    assert says in str(caught.value)


def test_a_joint_of_several_coordinates_is_driven_by_one_of_them() -> None:
    motor = {"motor": {"joint": "planar", "gain": 1.0}}
    with pytest.raises(ModelError, match="name one of its coordinates, planar_x, planar_y, planar_rotation"):
        machine({"type": "planar", "axis": [0.0, 0.0, 1.0]}, actuators=motor)
    with pytest.raises(
        ModelError, match='is "bolts", a fixed joint, which has no coordinates; name a joint that moves'
    ):
        Model.from_dict({**GANTRY, "actuators": {"drive": {"joint": "bolts", "gain": 1.0}}})


def test_something_has_to_move() -> None:
    with pytest.raises(ModelError, match="joints has fixed joints only, so nothing moves"):
        machine({"type": "fixed"})


def test_a_fixed_joint_has_no_axis() -> None:
    bolts = {**GANTRY["joints"]["bolts"], "axis": [0.0, 0.0, 1.0]}  # type: ignore[index]
    with pytest.raises(ModelError, match=r"joints.bolts.axis is given, but a fixed joint has no axis; remove it"):
        Model.from_dict({**GANTRY, "joints": {**GANTRY["joints"], "bolts": bolts}})  # type: ignore[dict-item]


def test_coordinates_share_the_namespace() -> None:
    with pytest.raises(ModelError, match=r'joints.spherical has a coordinate "spherical_x", which is also the name of'):
        machine({"type": "spherical"}, markers={"spherical_x": {"parent": "body"}})
