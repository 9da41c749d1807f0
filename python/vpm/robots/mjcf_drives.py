"""Actuators, tendons and equalities of MJCF as drives, shafts and joints that follow others."""

from dataclasses import replace
from typing import Any

import numpy as np

from vpm.robots.markup import clean
from vpm.robots.parts import SINGLE, Drive, Mimic, Robot, Shaft


def drives_and_shafts(m: Any, mujoco: Any, joints: list[str], robot: Robot) -> tuple[list[Shaft], list[Drive] | None]:  # noqa: ANN401
    """Shafts that drives turn, and drives; None where the file has no actuators, so that each joint gets one."""
    if not m.nu:
        return [], None
    drives, tendons = [], {}
    for index in range(m.nu):
        name = mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_ACTUATOR, index) or f"actuator{index}"
        kind, target = int(m.actuator_trntype[index]), int(m.actuator_trnid[index][0])
        on_joint = kind in {int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)}
        if on_joint and robot.joints[joints[target]].kind in SINGLE:
            drives.append(_drive(m, mujoco, index, name, robot, joint=joints[target]))
        elif kind == int(mujoco.mjtTrn.mjTRN_TENDON) and (ratios := _ratios(m, mujoco, target, joints)):
            tendon = mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_TENDON, target) or f"tendon{target}"
            tendons[tendon] = Shaft(tendon, ratios)
            drives.append(_drive(m, mujoco, index, name, robot, shaft=tendon))
        else:
            robot.notes.append(
                f'actuator "{clean(name)}" is left out: it drives neither one coordinate nor a fixed tendon'
            )
    return list(tendons.values()), drives


def _ratios(m: Any, mujoco: Any, tendon: int, joints: list[str]) -> dict[str, float]:  # noqa: ANN401
    """Ratios of a fixed MJCF tendon, a sum of coefficient times coordinate; none of another one."""
    first, count = int(m.tendon_adr[tendon]), int(m.tendon_num[tendon])
    wraps = range(first, first + count)
    if any(int(m.wrap_type[wrap]) != int(mujoco.mjtWrap.mjWRAP_JOINT) for wrap in wraps):
        return {}
    return {joints[int(m.wrap_objid[wrap])]: float(m.wrap_prm[wrap]) for wrap in wraps if m.wrap_prm[wrap] != 0.0}


def _drive(
    m: Any,  # noqa: ANN401
    mujoco: Any,  # noqa: ANN401
    index: int,
    name: str,
    robot: Robot,
    joint: str | None = None,
    shaft: str | None = None,
) -> Drive:
    """Drive of an MJCF actuator: a motor is gear times gain times command; a servo takes efforts."""
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
    robot.notes.append(f'actuator "{clean(name)}": {rest}')
    return Drive(name, joint, shaft, limit=float(min(limits)) if limits and min(limits) > 0.0 else None)


def equalities(m: Any, mujoco: Any, joints: list[str], robot: Robot) -> None:  # noqa: ANN401
    """MJCF equalities: joints that others lead by a straight line, y - y0 = a0 + a1 (x - x0)."""
    for index in range(m.neq):
        follower, leader = int(m.eq_obj1id[index]), int(m.eq_obj2id[index])
        data = m.eq_data[index][:5]
        straight = int(m.eq_type[index]) == int(mujoco.mjtEq.mjEQ_JOINT) and leader >= 0 and not np.any(data[2:])
        name = mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_EQUALITY, index) or f"equality{index}"
        free = straight and _leads(robot, joints[leader]) != joints[follower]
        if not (free and m.eq_active0[index] and robot.joints[joints[follower]].mimic is None):
            robot.notes.append(
                f'equality "{clean(name)}" is left out: only joints that follow one other by a line are kept'
            )
            continue
        y0, x0 = (float(m.qpos0[m.jnt_qposadr[joint]]) for joint in (follower, leader))
        mimic = Mimic(joints[leader], float(data[1]), float(data[0]) + y0 - float(data[1]) * x0)
        robot.joints[joints[follower]] = replace(robot.joints[joints[follower]], mimic=mimic)


def _leads(robot: Robot, joint: str) -> str:
    """Joint that leads another MJCF joint in the end; itself where it follows none."""
    while (mimic := robot.joints[joint].mimic) is not None:
        joint = mimic.joint
    return joint
