"""MJCF, read and compiled by MuJoCo itself: its numbers as the parts of a robot.

A body of MuJoCo turns about anchors of its joints, one after the other (``mj_kinematics``); here each joint carries a
link whose frame is at its anchor. A joint counts from its ``ref``, at which the body is where the file says.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vpm.errors import ModelError, needs
from vpm.model.joint import JointType
from vpm.model.pose import Pose
from vpm.robots.lumping import WORLD
from vpm.robots.markup import Markup, clean
from vpm.robots.parts import SINGLE, Drive, Frame, Inertial, Joint, Mimic, Robot, Shaft, angles_of, moved, rounded

_KINDS: tuple[JointType, ...] = ("free", "spherical", "prismatic", "revolute")  # mjtJoint


def read_mjcf(markup: Markup) -> Robot:
    """Parts of a robot of an MJCF file."""
    with needs("mujoco", "robots"):
        import mujoco
    path = Path(markup.path)
    before, warnings = mujoco.get_mju_user_warning(), list[str]()
    mujoco.set_mju_user_warning(warnings.append)  # else they go to a file in the working directory
    try:
        m = mujoco.MjModel.from_xml_path(str(path))
    except (ValueError, mujoco.FatalError) as error:
        what = clean(" ".join(str(error).split()))
        raise ModelError(f"{path} is refused by MuJoCo ({what}); correct the file", path=str(path)) from None
    finally:
        mujoco.set_mju_user_warning(before)
    robot = _Reader(m, markup, mujoco).robot()
    robot.notes += [f"MuJoCo warns: {clean(' '.join(warning.split()))}" for warning in warnings]
    return robot


def turn_of(quaternion: Any) -> Pose:  # noqa: ANN401 - an array of MuJoCo
    """Rotation of a unit quaternion w, x, y, z in MJCF."""
    w, x, y, z = (float(value) for value in quaternion)
    if (x, y, z) == (0.0, 0.0, 0.0):
        return Pose()
    rows = (
        *(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        *(2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        *(2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )
    return Pose((0.0, 0.0, 0.0), rows)


def _place(position: Any, quaternion: Any) -> Pose:  # noqa: ANN401
    return _shift(position) @ turn_of(quaternion)


def _shift(position: Any, sign: float = 1.0) -> Pose:  # noqa: ANN401
    return Pose(tuple(sign * float(value) + 0.0 for value in position))


class _Reader:
    """A compiled model of MuJoCo and the robot that is made of it."""

    def __init__(self, m: Any, markup: Markup, mujoco: Any) -> None:  # noqa: ANN401
        self._m, self._mujoco = m, mujoco
        name = clean(markup.root.attributes.get("model", "").strip()) or "robot"
        self._robot = Robot(name, markup.path, tuple(float(g) + 0.0 for g in m.opt.gravity))
        self._offset = {0: Pose()}  # place of each frame of a body in that of its link
        self._link = {0: WORLD}

    def _name(self, kind: str, index: int, prefix: str) -> str:
        found = self._mujoco.mj_id2name(self._m, getattr(self._mujoco.mjtObj, f"mjOBJ_{kind}"), index)
        return found or f"{prefix}{index}"

    def robot(self) -> Robot:
        """Links, joints, drives and ties of an MJCF file."""
        m, robot = self._m, self._robot
        robot.links[WORLD] = None
        for body in range(1, m.nbody):
            self._body(body)
        for site in range(m.nsite):
            body = int(m.site_bodyid[site])
            at = self._offset[body] @ _place(m.site_pos[site], m.site_quat[site])
            robot.frames.append(Frame(self._name("SITE", site, "site"), self._link[body], at))
        joints = [self._name("JOINT", joint, "joint") for joint in range(m.njnt)]
        robot.shafts, robot.drives = self._drives_and_shafts(joints)
        self._lead(joints)
        robot.notes += self._left_out()
        return robot

    def _body(self, body: int) -> None:
        m, robot = self._m, self._robot
        name = self._name("BODY", body, "body")
        name = f"{name}_body" if name == WORLD else name
        parent = int(m.body_parentid[body])
        frame, carrier = self._offset[parent] @ _place(m.body_pos[body], m.body_quat[body]), self._link[parent]
        first, count = int(m.body_jntadr[body]), int(m.body_jntnum[body])
        for joint in range(first, first + count):
            last = joint == first + count - 1
            link = name if last else f"{name}_{joint - first + 1}"
            frame = self._joint(joint, frame, carrier, link)
            robot.links[link], carrier = None, link
        if not count:
            weld = f"{name} weld"
            robot.joints[weld] = Joint(
                weld, "fixed", carrier, name, rounded(np.array(frame.translation)), angles_of(frame)
            )
            robot.links[name] = None
            # The angles are rounded: what hangs on it is placed by the same ones.
            frame = Pose()
        self._offset[body], self._link[body] = frame, name
        robot.links[name] = self._inertial(body, frame)

    def _joint(self, index: int, frame: Pose, carrier: str, link: str) -> Pose:
        """Add an MJCF joint; place of the body's frame in that of the link behind it."""
        m = self._m
        name, kind = self._name("JOINT", index, "joint"), _KINDS[int(m.jnt_type[index])]
        if kind == "free":
            self._robot.joints[name] = Joint(name, kind, carrier, link)
            self._drop_damping(index, name, 6)
            return Pose()
        anchor, dof = m.jnt_pos[index], int(m.jnt_dofadr[index])
        if kind == "spherical":
            place = frame @ _shift(anchor)
            self._add(name, kind, carrier, link, place)
            self._drop_damping(index, name, 3)
            return _shift(anchor, -1.0)
        address = int(m.jnt_qposadr[index])
        axis, ref = np.array(m.jnt_axis[index]), float(m.qpos0[address])
        place = frame @ _shift(anchor) @ _back(kind, axis, ref)
        limits = tuple(float(value) for value in m.jnt_range[index]) if m.jnt_limited[index] else (None, None)
        effort = float(np.abs(m.jnt_actfrcrange[index]).max()) if m.jnt_actfrclimited[index] else None
        stiffness = float(m.jnt_stiffness[index])
        numbers = (float(m.dof_damping[dof]), float(m.dof_frictionloss[dof]), float(m.dof_armature[dof]), stiffness)
        self._add(
            *(name, kind, carrier, link, place, tuple((axis + 0.0).tolist()), *limits, effort, None, *numbers),
            float(m.qpos_spring[address]),
        )
        return _shift(anchor, -1.0)

    def _add(self, name: str, kind: JointType, carrier: str, link: str, place: Pose, *rest: Any) -> None:  # noqa: ANN401
        translation = rounded(np.array(place.translation))
        self._robot.joints[name] = Joint(name, kind, carrier, link, translation, angles_of(place), *rest)

    def _drop_damping(self, index: int, name: str, count: int) -> None:
        m, dof = self._m, int(self._m.jnt_dofadr[index])
        dofs = slice(dof, dof + count)
        if any(np.any(values[dofs]) for values in (m.dof_damping, m.dof_frictionloss, m.dof_armature)) or np.any(
            m.jnt_stiffness[index]
        ):
            rest = "damping, friction, armature and stiffness are left out, because it is no joint with one coordinate"
            self._robot.notes.append(f'joint "{clean(name)}": {rest}')

    def _inertial(self, body: int, frame: Pose) -> Inertial | None:
        m = self._m
        if (mass := float(m.body_mass[body])) <= 0.0:
            return None
        own = Inertial(mass, (0.0, 0.0, 0.0), (*(float(moment) for moment in m.body_inertia[body]), 0.0, 0.0, 0.0))
        return moved(own, frame @ _place(m.body_ipos[body], m.body_iquat[body]))

    def _left_out(self) -> Iterator[str]:
        m = self._m
        if m.ngeom:
            yield f"shapes are left out ({m.ngeom}): their masses are counted, their contacts are not"
        single = [joint for joint in self._robot.joints.values() if joint.kind in SINGLE]
        if any(joint.lower is not None for joint in single):
            yield "limits of joints are remarks: nothing stops a joint there"
        for names, what in (
            (("body_gravcomp",), "compensation of gravity"),
            (("jnt_stiffnesspoly", "dof_dampingpoly"), "stiffness and damping that change with position or speed"),
            (("tendon_stiffness", "tendon_damping", "tendon_frictionloss", "tendon_armature"), "forces of tendons"),
        ):
            if any(np.any(values) for name in names if (values := getattr(m, name, None)) is not None):
                yield f"left out: {what}"
        if m.opt.density or m.opt.viscosity:
            yield "left out: forces of the medium (density, viscosity)"
        for count, what in (
            (getattr(m, "nflex", 0), "flexible bodies"),
            (m.nplugin, "plugins"),
            (m.nmocap, "mocap bodies"),
        ):
            if count:
                yield f"left out: {what} ({count})"

    def _drives_and_shafts(self, joints: list[str]) -> tuple[list[Shaft], list[Drive] | None]:
        """Shafts that drives turn, and drives; None where the file has no actuators, so that each joint gets one."""
        m, mujoco, robot = self._m, self._mujoco, self._robot
        if not m.nu:
            return [], None
        drives, tendons = [], {}
        for index in range(m.nu):
            name = self._name("ACTUATOR", index, "actuator")
            kind, target = int(m.actuator_trntype[index]), int(m.actuator_trnid[index][0])
            on_joint = kind in {int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)}
            if on_joint and robot.joints[joints[target]].kind in SINGLE:
                drives.append(self._drive(index, name, joint=joints[target]))
            elif kind == int(mujoco.mjtTrn.mjTRN_TENDON) and (ratios := self._ratios(target, joints)):
                tendon = self._name("TENDON", target, "tendon")
                tendons[tendon] = Shaft(tendon, ratios)
                drives.append(self._drive(index, name, shaft=tendon))
            else:
                robot.notes.append(
                    f'actuator "{clean(name)}" is left out: it drives neither one coordinate nor a fixed tendon'
                )
        return list(tendons.values()), drives

    def _ratios(self, tendon: int, joints: list[str]) -> dict[str, float]:
        """Ratios of a fixed MJCF tendon, a sum of coefficient times coordinate; none of another one."""
        m, mujoco = self._m, self._mujoco
        first, count = int(m.tendon_adr[tendon]), int(m.tendon_num[tendon])
        wraps = range(first, first + count)
        if any(int(m.wrap_type[wrap]) != int(mujoco.mjtWrap.mjWRAP_JOINT) for wrap in wraps):
            return {}
        return {joints[int(m.wrap_objid[wrap])]: float(m.wrap_prm[wrap]) for wrap in wraps if m.wrap_prm[wrap] != 0.0}

    def _drive(self, index: int, name: str, joint: str | None = None, shaft: str | None = None) -> Drive:
        """Drive of an MJCF actuator: a motor is gear times gain times command; a servo takes efforts."""
        m, mujoco = self._m, self._mujoco
        gear = float(m.actuator_gear[index][0])
        plain = (
            int(m.actuator_gaintype[index]) == int(mujoco.mjtGain.mjGAIN_FIXED)
            and int(m.actuator_biastype[index]) == int(mujoco.mjtBias.mjBIAS_NONE)
            and int(m.actuator_dyntype[index]) == int(mujoco.mjtDyn.mjDYN_NONE)
        )
        gain = float(m.actuator_gainprm[index][0]) * gear
        limits = [abs(gear) * np.abs(m.actuator_forcerange[index]).max()] if m.actuator_forcelimited[index] else []
        if plain and gain != 0.0:
            limits += [abs(gain) * np.abs(m.actuator_ctrlrange[index]).max()] if m.actuator_ctrllimited[index] else []
            limit = float(min(limits)) if limits and min(limits) > 0.0 else None
            return Drive(name, joint, shaft, gain=gain, unit="1", limit=limit)
        rest = "its law (servo, lag or bias) is left out, and its command is the effort"
        self._robot.notes.append(f'actuator "{clean(name)}": {rest}')
        return Drive(name, joint, shaft, limit=float(min(limits)) if limits and min(limits) > 0.0 else None)

    def _lead(self, joints: list[str]) -> None:
        """MJCF equalities: joints that others lead by a straight line, y - y0 = a0 + a1 (x - x0)."""
        m, mujoco, robot = self._m, self._mujoco, self._robot
        for index in range(m.neq):
            follower, leader = int(m.eq_obj1id[index]), int(m.eq_obj2id[index])
            data = m.eq_data[index][:5]
            straight = int(m.eq_type[index]) == int(mujoco.mjtEq.mjEQ_JOINT) and leader >= 0 and not np.any(data[2:])
            name = self._name("EQUALITY", index, "equality")
            free = straight and _leads(robot, joints[leader]) != joints[follower]
            if not (free and m.eq_active0[index] and robot.joints[joints[follower]].mimic is None):
                robot.notes.append(
                    f'equality "{clean(name)}" is left out: only joints that follow one other by a line are kept'
                )
                continue
            y0, x0 = (float(m.qpos0[m.jnt_qposadr[joint]]) for joint in (follower, leader))
            mimic = Mimic(joints[leader], float(data[1]), float(data[0]) + y0 - float(data[1]) * x0)
            robot.joints[joints[follower]] = replace(robot.joints[joints[follower]], mimic=mimic)


def _back(kind: JointType, axis: Any, ref: float) -> Pose:  # noqa: ANN401
    """Pose that takes a joint of MJCF from its place at ``ref`` to that at zero."""
    if ref == 0.0:
        return Pose()
    if kind == "prismatic":
        return Pose(tuple((-ref * axis).tolist()))
    half = -0.5 * ref
    return turn_of((math.cos(half), *(math.sin(half) * axis)))


def _leads(robot: Robot, joint: str) -> str:
    """Joint that leads another MJCF joint in the end; itself where it follows none."""
    while (mimic := robot.joints[joint].mimic) is not None:
        joint = mimic.joint
    return joint
