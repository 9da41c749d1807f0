"""Robots of URDF, xacro and MJCF against the libraries that know these formats, and values back into a URDF."""

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import robot_texts as texts
import vpm
from command_line import ran
from command_line import vpm as run_command
from places import EXAMPLES, ROOT
from vpm.errors import MissingExtraError, ModelError
from vpm.numbers import Array
from vpm.robots import ImportedRobot
from written_logs import needs

#: Relative to the size of what is compared.
TOLERANCE = 1e-10


def imported(folder: Path, text: str, name: str = "robot.urdf", **options: Any) -> ImportedRobot:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return vpm.import_robot(path, **options)


def close(found: Any, wanted: Any, slack: float = 0.0) -> None:
    size = max(float(np.abs(wanted).max(initial=0.0)), 1e-3)
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=TOLERANCE * size + slack)


def watched(model: vpm.Model) -> vpm.Model:
    """The same with a marker on each body, and nothing that rubs or ties."""
    content = model.to_dict()
    content.pop("effects", None)
    markers = {f"of_{name}": {"parent": name} for name in content["bodies"]}
    return vpm.Model.from_dict(content | {"markers": content.get("markers", {}) | markers})


def states(model: vpm.Model, seed: int, count: int = 3) -> list[tuple[Array, Array, Array]]:
    random = np.random.default_rng(seed)
    return [tuple(random.uniform(-1.2, 1.2, (3, len(model.joints)))) for _ in range(count)]


def turned(angles: Array) -> Array:
    """Rotation Rx Ry Rz of the angles of a spherical or free joint."""
    (a, b, c), one = angles, np.ones_like(angles[0])
    zero = 0.0 * one
    x = np.array([[one, zero, zero], [zero, np.cos(a), -np.sin(a)], [zero, np.sin(a), np.cos(a)]])
    y = np.array([[np.cos(b), zero, np.sin(b)], [zero, one, zero], [-np.sin(b), zero, np.cos(b)]])
    z = np.array([[np.cos(c), -np.sin(c), zero], [np.sin(c), np.cos(c), zero], [zero, zero, one]])
    return np.asarray(x @ y @ z)


def spin(angles: Array) -> Array:
    """What rates of these angles are as an angular velocity in axes of the child; complex angles are differentiated."""
    columns = []
    for k in range(3):
        step = np.zeros(3, complex)
        step[k] = 1e-30j
        # R^T dR is the cross product with the angular velocity; the derivative by a complex step is exact.
        slope = np.imag(turned(np.real(angles) + step)) / 1e-30
        skew = turned(np.real(angles)).T @ slope
        columns.append([skew[2, 1], skew[0, 2], skew[1, 0]])
    return np.array(columns).T


def spin_rate(angles: Array, rates: Array) -> Array:
    """Its derivative by time times the rates, by differences of the fourth order."""
    h = 1e-3

    def at(x: float) -> Array:
        return spin(angles + x * rates) @ rates

    return np.asarray((8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h))


class Pin:
    """A URDF as Pinocchio has it, in the coordinates of vpm."""

    def __init__(self, text: str, model: vpm.Model, floating: bool) -> None:
        self.pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
        root = [self.pin.JointModelFreeFlyer()] if floating else []
        self.model = self.pin.buildModelFromXML(text, *root)
        self.data, self.floating = self.model.createData(), floating
        names = [name for name in self.model.names if name not in {"universe", "root_joint"}]
        free = 6 if floating else 0
        assert sorted(names) == sorted(model.joints[free:])
        self.order = [*range(free), *(list(model.joints).index(name) for name in names)]
        self.names = names

    def at(self, q: Array) -> Array:
        """Its configuration."""
        own = []
        if self.floating:
            turn = self.pin.Quaternion(turned(q[3:6]))
            own += [*q[:3], turn.x, turn.y, turn.z, turn.w]
        for name, value in zip(self.names, q[self.order][6 if self.floating else 0 :], strict=True):
            joint = self.model.joints[self.model.getJointId(name)]
            own += [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
        return np.array(own)

    def rates(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Map from rates to its velocities, and what that adds to accelerations."""
        T, more = np.eye(len(q))[self.order], np.zeros(len(q))
        if self.floating:
            R = turned(q[3:6])
            T[:3, :3], T[3:6, 3:6] = R.T, spin(q[3:6])
            omega = T[3:6, 3:6] @ v[3:6]
            more[:3] = -np.cross(omega, R.T @ v[:3])
            more[3:6] = spin_rate(q[3:6], v[3:6])
        return T, more

    def mass_matrix(self, q: Array) -> Array:
        T, _ = self.rates(q, np.zeros_like(q))
        upper = np.triu(self.pin.crba(self.model, self.data, self.at(q)))
        return np.asarray(T.T @ (upper + np.triu(upper, 1).T) @ T)

    def efforts(self, q: Array, v: Array, a: Array) -> Array:
        T, more = self.rates(q, v)
        return np.asarray(T.T @ self.pin.rnea(self.model, self.data, self.at(q), T @ v, T @ a + more))

    def places(self, q: Array) -> dict[str, tuple[Array, Array]]:
        self.pin.framesForwardKinematics(self.model, self.data, self.at(q))
        return {
            frame.name: (place.translation.copy(), place.rotation.copy())
            for frame, place in zip(self.model.frames, self.data.oMf, strict=True)
            if frame.type == self.pin.FrameType.BODY
        }


def compare_with_pin(text: str, model: vpm.Model, floating: bool, seed: int) -> None:
    model = watched(model)
    witness = Pin(text, model, floating)
    for q, v, a in states(model, seed):
        close(model.mass_matrix(q), witness.mass_matrix(q))
        close(model.inverse_dynamics(q, v, a), witness.efforts(q, v, a))
        simulation = vpm.Simulation(
            model, 1e-3, state=dict(zip((f"{n}.position" for n in model.joints), q, strict=True))
        )
        for name, (position, rotation) in witness.places(q).items():
            marker = f"of_{name}" if f"of_{name}" in model.markers else name
            if marker in model.markers:
                check_place(simulation, marker, position, rotation)


def check_place(simulation: vpm.Simulation, marker: str, position: Array, rotation: Array) -> None:
    close([simulation[f"{marker}.{axis}"] for axis in "xyz"], position)
    vector = np.array([simulation[f"{marker}.r{axis}"] for axis in "xyz"])
    angle = np.linalg.norm(vector)
    x, y, z = vector / (angle or 1.0)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    close(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K, rotation)


@pytest.mark.parametrize("name", texts.FIVE)
def test_five_robots_move_as_pinocchio_says(name: str, tmp_path: Path) -> None:
    text, floating = texts.FIVE[name]
    compare_with_pin(text, imported(tmp_path, text, floating=floating).model, floating, seed=len(name))


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=texts.random_robots(), seed=st.integers(0, 99))
def test_random_trees_move_as_pinocchio_says(text: str, seed: int, tmp_path: Path) -> None:
    compare_with_pin(text, imported(tmp_path, text).model, False, seed)


@pytest.mark.parametrize("name", texts.FIVE)
def test_export_changes_only_what_differs_and_reads_back(name: str, tmp_path: Path) -> None:
    text, floating = texts.FIVE[name]
    text = text.replace("</robot>", "  <!-- kept, ü -->\r\n\t</robot>")
    model = imported(tmp_path, text, floating=floating).model
    path = tmp_path / "robot.urdf"
    assert vpm.export_robot(model, path).content == path.read_bytes()
    random = np.random.default_rng(1)
    names = [n for n in model.parameters if n.endswith((".mass", ".inertia.zz", ".center_of_mass.x"))]
    lighter = model.with_parameters({n: model.parameters[n].value * random.uniform(1.0, 1.02) for n in names})
    rough = [joint for joint in model.joints if joint not in {"follow"} and not joint.startswith("floating_base")]
    for joint in rough:
        lighter = lighter.with_effect("coulomb_friction", at=joint, coulomb=0.3)
        lighter = lighter.with_effect("viscous_friction", at=joint, viscous=0.1234567890123)
    exported = vpm.export_robot(lighter, path)
    assert not exported.notes
    back = imported(tmp_path, exported.content.decode(), "back.urdf", floating=floating).model
    assert set(back.parameters) == set(lighter.parameters)
    for parameter in lighter.parameters.values():
        found = back.parameters[parameter.name].value
        assert found == pytest.approx(parameter.value, rel=1e-12, abs=1e-14), parameter.name
    # What is left of both files without the attributes that may change is the same, byte for byte.
    assert stripped(exported.content) == stripped(path.read_bytes())


def stripped(content: bytes) -> bytes:
    import re

    content = re.sub(rb"<dynamics[^>]*/>", b"", content)
    return re.sub(rb'(<(?:mass|inertia)\b|<inertial><origin\b)[^>]*?(\srpy="[^"]*")?/>', rb"\1\2", content)


def test_a_mimic_joint_is_led_by_a_stiff_shaft(tmp_path: Path) -> None:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    robot = imported(tmp_path, texts.HAND)
    model, whole = robot.model, pin.buildModelFromXML(texts.HAND, True)
    assert any("follows" in note for note in robot.notes)
    # The mass matrix of what is left free is that of the tree, seen through the tie.
    q = np.array([0.3, -0.4, 0.02, -0.8 * 0.02 + 0.002])
    G = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -0.8]])
    own = pin.crba(whole, whole.createData(), np.array([q[0], np.cos(q[1]), np.sin(q[1]), q[2]]))
    close(G.T @ model.mass_matrix(q) @ G, np.triu(own) + np.triu(own, 1).T)
    # At rest under gravity the follower stands where it is led to, within what gravity bends the tie by.
    simulation = vpm.Simulation(model, 1e-3, state={"shoulder.position": 0.8, "follow.position": 0.002})
    for _ in range(200):
        simulation.step(np.zeros(len(model.actuators)))
    led = -0.8 * simulation["close.position"] + 0.002
    assert abs(simulation["close.position"]) > 1e-4
    assert simulation["follow.position"] == pytest.approx(led, abs=1e-4)


TRANSMISSIONS = """  <transmission name="wrist"><type>transmission_interface/{kind}Transmission</type>
    <actuator name="m2"><role>actuator2</role><mechanicalReduction>-40</mechanicalReduction></actuator>
    <actuator name="m1"><role>actuator1</role><mechanicalReduction>50</mechanicalReduction></actuator>
    <joint name="j1"><role>joint1</role><mechanicalReduction>2</mechanicalReduction></joint>
    <joint name="j2"><role>joint2</role><mechanicalReduction>3</mechanicalReduction></joint>
  </transmission>
  <transmission name="simple"><type>transmission_interface/SimpleTransmission</type>
    <joint name="j0"/><actuator name="m0">
      <mechanicalReduction>100</mechanicalReduction><motorInertia>1e-5</motorInertia></actuator>
  </transmission>
"""


@pytest.mark.parametrize(
    ("kind", "rows"), [("Differential", ((100, 150), (-80, 120))), ("FourBarLinkage", ((100, 0), (-40, -120)))]
)
def test_coupled_transmissions_are_shafts(kind: str, rows: tuple[tuple[int, int], ...], tmp_path: Path) -> None:
    text = texts.ARM.replace("</robot>", TRANSMISSIONS.format(kind=kind) + "</robot>")
    robot = imported(tmp_path, text)
    content = robot.model.to_dict()
    for shaft, row in zip(("m1", "m2"), rows, strict=True):
        wanted = {joint: float(ratio) for joint, ratio in zip(("j1", "j2"), row, strict=True) if ratio}
        assert content["transmissions"][shaft]["ratios"] == wanted
    assert set(robot.model.actuators) == {"m1_drive", "m2_drive", "j0_drive", "j3_drive", "j4_drive", "j5_drive"}
    assert robot.model.parameters["j0.rotor_inertia"].value == pytest.approx(0.1)
    assert any("reduction 100" in note for note in robot.notes)


MJCF = """<mujoco model="toy"><compiler angle="radian"/><option gravity="0.3 0 -9.7"/>
  <worldbody>
    <body name="cart" pos="0.1 0.2 0.5" euler="0.1 0.2 0.3">
      <joint name="x" type="slide" axis="1 0.5 0" damping="2" armature="0.4" range="-1 1" limited="true" ref="0.1"/>
      <joint name="turn" type="hinge" axis="0 0.3 1" pos="0.05 0.02 0" frictionloss="0.2" ref="0.3"/>
      <geom type="box" size="0.1 0.2 0.05" mass="3" euler="0.3 0.2 0.1" pos="0.01 0.02 0.03"/>
      <body name="plate" pos="0 0.1 0.1" quat="0.8 0.2 0.1 0.5">
        <geom type="sphere" size="0.05" mass="0.4" pos="0.1 0 0"/>
        <body name="rod" pos="0 0 0.1">
          <joint name="swing" type="hinge" axis="0 1 0" pos="0 0 0.02" stiffness="1.5" springref="0.2" armature="0.01"/>
          <inertial pos="0.01 0.02 0.1" mass="1.2" fullinertia="0.02 0.03 0.04 0.001 0.002 -0.003"/>
          <site name="end" pos="0 0 0.3" euler="0.2 0.1 0"/>
          <body name="bob" pos="0 0 0.3"><joint name="ball" type="ball" pos="0 0.01 0"/>
            <geom type="ellipsoid" size="0.1 0.05 0.03" mass="0.7"/></body>
        </body>
      </body>
    </body>
    <body name="float" pos="1 1 1"><freejoint name="free"/>
      <geom type="box" size="0.1 0.2 0.3" mass="2" pos="0.1 0 0"/></body>
  </worldbody>
  <tendon><fixed name="cable"><joint joint="turn" coef="0.5"/><joint joint="swing" coef="-2"/></fixed></tendon>
  <actuator><motor name="push" joint="x" gear="30" ctrlrange="-2 2" ctrllimited="true"/>
    <motor name="pull" tendon="cable" gear="2"/>
    <position name="servo" joint="swing" kp="5"/></actuator>
</mujoco>
"""


def test_an_mjcf_moves_as_mujoco_says(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    robot = imported(tmp_path, MJCF, "toy.xml")
    full = robot.model
    assert full.parameters["push.gain"].value == 30.0
    assert full.parameters["push.limit"].value == 60.0
    assert full.to_dict()["transmissions"]["cable"]["ratios"] == {"turn": 0.5, "swing": -2.0}
    assert any("servo" in note for note in robot.notes)
    assert full.parameters["swing.spring.rest"].value == 0.2
    assert any("without" in line or "least" in line for line in robot.notes)
    # The link between slider and hinge has no mass in MuJoCo: 1e-9 kg, at most 1 m off and moved at 10 m/s^2.
    compare_with_mujoco(mujoco.MjModel.from_xml_string(MJCF), watched(full), 3, slack=1e-8)


def compare_with_mujoco(m: Any, model: vpm.Model, seed: int, slack: float = 0.0) -> None:
    """Its equations without contacts, limits, equalities and what rubs, in the coordinates of vpm."""
    import mujoco

    m.dof_damping[:] = m.dof_frictionloss[:] = m.jnt_stiffness[:] = 0.0
    flags = mujoco.mjtDisableBit
    m.opt.disableflags |= int(flags.mjDSBL_CONTACT) | int(flags.mjDSBL_LIMIT) | int(flags.mjDSBL_EQUALITY)
    data = mujoco.MjData(m)
    names = {mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_JOINT, k): k for k in range(m.njnt)}
    for q, v, a in states(model, seed):
        T, more = np.zeros((m.nv, m.nv)), np.zeros(m.nv)
        for place, coordinate in enumerate(model.joints):
            name, _, suffix = coordinate.rpartition("_")
            joint = names[coordinate if coordinate in names else name]
            dof, address = m.jnt_dofadr[joint], m.jnt_qposadr[joint]
            if coordinate in names:
                T[dof, place], data.qpos[address] = 1.0, q[place]
            elif suffix in {"x", "y", "z"} and m.jnt_type[joint] == 0:
                T[dof + "xyz".index(suffix), place], data.qpos[address + "xyz".index(suffix)] = 1.0, q[place]
            elif suffix in {"x", "rx"}:
                shift, at = (3 if suffix == "rx" else 0), slice(place, place + 3)
                dofs = slice(dof + shift, dof + shift + 3)
                T[dofs, at], more[dofs] = spin(q[at]), spin_rate(q[at], v[at])
                mujoco.mju_mat2Quat(data.qpos[address + shift : address + shift + 4], turned(q[at]).ravel())
        data.qvel[:], data.qacc[:] = T @ v, T @ a + more
        mujoco.mj_inverse(m, data)
        M = np.zeros((m.nv, m.nv))
        mujoco.mj_fullM(m, data, M)
        close(model.mass_matrix(q), T.T @ M @ T, slack)
        close(model.inverse_dynamics(q, v, a), T.T @ data.qfrc_inverse, slack)
        simulation = vpm.Simulation(
            model, 1e-3, state=dict(zip((f"{n}.position" for n in model.joints), q, strict=True))
        )
        for marker in model.markers:
            if (body := mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_SITE, marker)) >= 0:
                check_place(simulation, marker, data.site_xpos[body], data.site_xmat[body].reshape(3, 3))


@pytest.mark.parametrize("name", texts.FIVE)
def test_five_robots_move_as_mujoco_says(name: str, tmp_path: Path) -> None:
    """MuJoCo reads the URDF, writes it as MJCF with sites on what moves, and is asked about that."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    text, floating = texts.FIVE[name]
    if floating:
        text = text.replace(
            "</robot>", '<link name="world"/>' + texts.joint("base", "floating", "world", "trunk") + "</robot>"
        )
    extension = '<mujoco><compiler fusestatic="false" balanceinertia="false" discardvisual="true"/></mujoco></robot>'
    spec = mujoco.MjSpec.from_string(text.replace("</robot>", extension))
    for body in spec.bodies[1:]:
        body.add_site(name=f"of_{body.name}", pos=[0.1, 0.2, 0.3], quat=[0.5, 0.5, 0.5, 0.5])
    spec.compile()
    written = spec.to_xml()
    robot = imported(tmp_path, written, "anew.xml")
    content = robot.model.to_dict()
    content.pop("effects", None)
    model = vpm.Model.from_dict(content)
    own = imported(tmp_path, text).model
    assert set(model.joints) == set(own.joints)
    assert len(model.markers) >= 3
    compare_with_mujoco(mujoco.MjModel.from_xml_string(written), model, len(name))


def test_all_names_and_options_read_well(tmp_path: Path) -> None:
    text = texts.robot(
        texts.link("world"),
        texts.link("1st link", texts.inertial(1.0)),
        texts.link("axis", texts.inertial(2.0)),
        texts.link("time"),
        texts.joint("axis", "revolute", "world", "1st link", more='<dynamics damping="0.5" friction="0.2"/>'),
        texts.joint("left/knee", "revolute", "1st link", "axis"),
        texts.joint("x", "fixed", "axis", "time"),
    )
    robot = imported(tmp_path, text, uncertain=0.1)
    assert robot.model.joints == ("axis", "left_knee")
    assert set(robot.model.bodies) == {"link_1st_link", "axis_link"}
    assert robot.model.markers == ("time_frame",)
    assert all(f'"{name}" is called' in "\n".join(robot.notes) for name in ("1st link", "left/knee", "axis", "time"))
    assert vpm.Model.from_toml(robot.text) == robot.model
    assert all(f"# - {note}" in robot.text.splitlines() for note in robot.notes)
    friction = robot.model.parameters["axis.friction.coulomb"]
    assert friction.uncertainty == pytest.approx(0.02)
    assert friction.minimum == 0.0
    assert len(robot.model.adjustable) == 2 * 10 + 2
    for parameter in robot.model.parameters.values():
        assert parameter.minimum <= parameter.value <= parameter.maximum


def broken(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new, 1)


BOMB = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
OUTSIDE = '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]>'
DAMAGED = {
    "entity bomb": (broken(texts.ARM, "<robot", f"{BOMB}<robot"), "document type"),
    "external entity": (broken(texts.ARM, "<robot", f"{OUTSIDE}<robot"), "document type"),
    "cycle": (broken(texts.ARM, 'parent link="base"', 'parent link="l5"'), "loop|root|hang"),
    "missing link": (broken(texts.ARM, 'child link="l3"', 'child link="none"'), '"none"'),
    "two parents": (broken(texts.ARM, 'child link="l3"', 'child link="l2"'), "child of the joints"),
    "two roots": (
        broken(texts.ARM, '<link name="base"', '<link name="other"/><link name="base"'),
        "2 links hang on no",
    ),
    "nan": (broken(texts.ARM, 'mass value="4.0"', 'mass value="nan"'), "finite"),
    "huge number": (broken(texts.ARM, 'mass value="4.0"', 'mass value="1e200"'), "finite"),
    "negative mass": (broken(texts.ARM, 'mass value="4.0"', 'mass value="-4"'), "negative"),
    "words for numbers": (broken(texts.ARM, 'xyz="0 0 0.3"', 'xyz="0 0 zero"'), "3 numbers"),
    "too few numbers": (broken(texts.ARM, 'xyz="0 0 0.3"', 'xyz="0 0"'), "3 numbers"),
    "no body": (broken(texts.ARM, 'ixx="0.044"', 'ixx="0.9"'), "principal moments"),
    "no axis": (broken(texts.ARM, 'axis xyz="0 0 1"', 'axis xyz="0 0 0"'), "length 0"),
    "type": (broken(texts.ARM, 'type="revolute"', 'type="rubber"'), "rubber"),
    "mimic of itself": (broken(texts.HAND, 'mimic joint="close"', 'mimic joint="follow"'), "itself"),
    "mimic of nothing": (broken(texts.HAND, 'mimic joint="close"', 'mimic joint="nobody"'), "nobody"),
    "no mass": (texts.robot(texts.link("a"), texts.link("b"), texts.joint("j", "revolute", "a", "b")), "moves no mass"),
    "fixed": (texts.robot(texts.link("a"), texts.link("b"), texts.joint("j", "fixed", "a", "b")), "nothing moves"),
    "no link": ("<robot/>", "no link"),
    "two names": (broken(texts.ARM, 'name="l1"', 'name="l0"'), "two links"),
    "no name": (broken(texts.ARM, '<link name="l1"', "<link"), "without name"),
    "cut": (texts.ARM[:-30], "not XML"),
    "empty": ("", "not XML"),
    "deep": ("<robot>" + "<a>" * 100000, "nested"),
    "other": ("<html/>", "<html>"),
    "many joints": (
        texts.robot(
            *(texts.link(f"l{k}", texts.inertial(1.0)) for k in range(2001)),
            *(texts.joint(f"j{k}", "revolute", f"l{k}", f"l{k + 1}") for k in range(2000)),
        ),
        "at most 500",
    ),
}


@pytest.mark.parametrize("damage", DAMAGED)
def test_damaged_files_are_refused_in_one_sentence(damage: str, tmp_path: Path) -> None:
    text, words = DAMAGED[damage]
    with pytest.raises(ModelError, match=words) as caught:
        imported(tmp_path, text)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path))


def test_missing_shapes_of_a_urdf_do_not_matter(tmp_path: Path) -> None:
    shape = '<visual><geometry><mesh filename="package://gone/none.stl"/></geometry></visual>'
    robot = imported(tmp_path, broken(texts.ARM, '<link name="l0">', f'<link name="l0">{shape}'))
    assert any("1 visual" in note for note in robot.notes)


@needs("mujoco")
@pytest.mark.parametrize(
    "text",
    [
        '<mujoco><asset><mesh file="none.stl"/></asset></mujoco>',
        "<mujoco><worldbody><body><joint/></body></worldbody></mujoco>",
        "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>",
        "<mujoco><include file='/etc/passwd'/></mujoco>",
        "<mujoco><worldbody><body><joint axis='nan 0 0'/><geom size='1'/></body></worldbody></mujoco>",
        f"{BOMB}<mujoco/>",
        "<mujoco><nothing/></mujoco>",
    ],
)
def test_damaged_mjcf_is_refused_in_one_sentence(text: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError) as caught:
        imported(tmp_path, text, "robot.xml")
    assert "\n" not in str(caught.value)


def test_a_huge_file_is_refused_at_once(tmp_path: Path) -> None:
    path = tmp_path / "huge.urdf"
    with path.open("wb") as file:
        file.truncate(1 << 32)
    with pytest.raises(ModelError, match="4096 MB"):
        vpm.import_robot(path)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_file_with_noise_in_it_is_a_model_or_one_sentence(data: st.DataObject, tmp_path: Path) -> None:
    content = bytearray(texts.HAND.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(content) - 1))
        content[start : start + data.draw(st.integers(0, 20))] = data.draw(st.binary(max_size=6))
    path = tmp_path / "noise.urdf"
    path.write_bytes(bytes(content))
    try:
        robot = vpm.import_robot(path)
        vpm.export_robot(robot.model, path)
    except ModelError as error:
        told = str(error)
    else:
        told = ""
        assert vpm.Model.from_toml(robot.text) == robot.model
    assert "\n" not in told


def test_an_export_that_leaves_no_body_is_refused(tmp_path: Path) -> None:
    model = imported(tmp_path, texts.HAND).model
    light = model.with_parameters({"arm.mass": 0.3})
    with pytest.raises(ModelError, match="would be left with a mass"):
        vpm.export_robot(light, tmp_path / "robot.urdf")
    (tmp_path / "other.urdf").write_text(texts.ARM)
    with pytest.raises(ModelError, match="has not"):
        vpm.export_robot(model, tmp_path / "other.urdf")
    odd = model.with_effect("bias_force", at="shoulder", force=1.0)
    assert vpm.export_robot(odd, tmp_path / "robot.urdf").notes == (
        "effect bias_force at shoulder has no place in a URDF, and is not written",
    )


XACRO = """<robot name="made" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="mass" default="2"/>
<xacro:property name="m" value="$(arg mass)"/><link name="base"/>
<link name="arm"><inertial><mass value="${2*m}"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
<joint name="j" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>%s</robot>
"""


@needs("xacrodoc")
def test_xacro_is_expanded_and_runs_no_code(tmp_path: Path) -> None:
    assert imported(tmp_path, XACRO % "", "a.xacro", xacro_args={"mass": "3"}).model.parameters["arm.mass"].value == 6.0
    marker = tmp_path / "ran"
    code = f"""${{(lambda: [c for c in ().__class__.__base__.__subclasses__()])() and open('{marker}', 'w')}}"""
    with pytest.raises(ModelError, match="what is no arithmetic is not run"):
        imported(tmp_path, XACRO % f'<link name="{code}"/>', "a.xacro")
    assert not marker.exists()
    with pytest.raises(ModelError, match="is no URDF"):
        vpm.export_robot(imported(tmp_path, texts.ARM).model, tmp_path / "a.xacro")


def test_a_missing_library_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:

    for library in ("mujoco", "xacro", "xacrodoc"):
        monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingExtraError, match=r"vpm-dynamics\[robots\]"):
        imported(tmp_path, "<mujoco/>", "a.xml")


def test_a_robot_in_place_of_a_model_file_is_told_the_way() -> None:
    with pytest.raises(ModelError, match=r"arm\.urdf: this is XML, not TOML; vpm import makes"):
        vpm.Model.load(EXAMPLES / "robots" / "arm.urdf")


def test_commands(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(texts.ARM, encoding="utf-8")
    done = ran("import", "arm.urdf", "-o", "arm.toml", "--uncertain", "0.1", cwd=tmp_path)
    heavier = vpm.Model.load(tmp_path / "arm.toml").with_parameters({"l2.mass": 3.25})
    heavier.save(tmp_path / "fit.toml")
    done = ran("export", "fit.toml", "--urdf", "arm.urdf", "-o", "new.urdf", cwd=tmp_path)
    assert done.stdout == 'link "l2": 3.25 kg\nwrote new.urdf\n'
    old, new = (tmp_path / "arm.urdf").read_text("utf-8"), (tmp_path / "new.urdf").read_text("utf-8")
    assert new == old.replace('mass value="3.0"', 'mass value="3.25"')
    done = run_command("import", "none.urdf", "-o", "x.toml", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (1, "error: none.urdf does not exist; check the path\n")


BLOCK = re.compile(r"^```(toml|text)\n(.*?)^```", re.MULTILINE | re.DOTALL)


@pytest.mark.nightly
@needs("rosbags")
def test_the_tutorial_leads_from_a_urdf_and_a_bag_to_a_named_effect_in_three_commands(tmp_path: Path) -> None:
    """Dry friction of 1.5 N m is hidden in the elbow; only the channel table is written by hand."""
    page = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
    recording, table, commands, script = (found[2] for found in BLOCK.finditer(page))
    shutil.copytree(EXAMPLES / "robots", tmp_path / "examples" / "robots")
    for line in recording.splitlines():
        words = [sys.executable if word == "python" else word for word in line.split()]
        subprocess.run(words, cwd=tmp_path, check=True)
    (tmp_path / "channels.toml").write_text(table, encoding="utf-8")
    for line in commands.splitlines():
        ran(*line.split()[1:], cwd=tmp_path)
    found = vpm.Diagnosis.load(tmp_path / "report" / "diagnosis.npz")
    assert found.verdict == "effect_found"
    assert [(one.name, one.site) for one in found.effects] == [("coulomb_friction", "elbow")]
    # The friction is in the URDF now, and what reads it finds it there.
    repaired = vpm.import_robot(tmp_path / "repaired.urdf").model
    assert repaired.parameters["elbow.friction.coulomb"].value == pytest.approx(1.5, rel=0.1)
    assert len(script.splitlines()) <= 15
