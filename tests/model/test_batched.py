"""Many motions in one call: against single evaluations, Pinocchio, difference quotients and closed kinematics."""

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
import pytest

from vpm.errors import CoreError, ModelError
from vpm.model import Model
from vpm.numbers import Array

AXES = ([0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.36, 0.48, 0.8])
KINDS = ("revolute", "revolute", "prismatic", "revolute", "revolute")
RANDOM = np.random.default_rng(4)
TURNS, SHIFTS, CENTRES = (RANDOM.uniform(-0.5, 0.5, (5, 3)) for _ in range(3))
MASSES, PRODUCTS = RANDOM.uniform(0.5, 3.0, 5), RANDOM.uniform(-0.01, 0.01, (5, 3))
MOMENTS = RANDOM.uniform(0.1, 0.15, (5, 3))
FRICTION = """
[[effects]]
type = "coulomb_friction"
at = "j1"
coulomb = 0.8
transition_velocity = 0.1

[[effects]]
type = "viscous_friction"
at = "j2"
viscous = 0.3
"""


def chain(extra: str = "") -> Model:
    """Five joints whose axes, frames and bodies are not aligned, with a marker at the end."""
    text = 'name = "chain"\ngravity = [0.5, -1.0, -9.81]\n'
    for k, (axis, kind) in enumerate(zip(AXES, KINDS, strict=True)):
        text += f"""
[bodies.b{k}]
mass = {MASSES[k]}
center_of_mass = {CENTRES[k].tolist()}
inertia = {[*MOMENTS[k].tolist(), *PRODUCTS[k].tolist()]}

[joints.j{k}]
type = "{kind}"
parent = "{f"b{k - 1}" if k else "world"}"
child = "b{k}"
axis = {axis}
translation = {SHIFTS[k].tolist()}
rotation = {TURNS[k].tolist()}
"""
    return Model.from_toml(text + '\n[markers.tool]\nparent = "b4"\ntranslation = [0.1, 0.2, 0.3]\n' + extra)


BEAM = """
name = "flexible arm"
gravity = [0.0, 0.0, -9.81]

[bodies.hub]
mass = 1.0
inertia = [0.01, 0.01, 0.01, 0.0, 0.0, 0.0]

[joints.shoulder]
type = "revolute"
parent = "world"
child = "hub"
axis = [0.0, 1.0, 0.0]

[beams.upper]
parent = "hub"
rotation = [0.0, 1.5707963267948966, 0.0]
length = 0.5
level = "strain(2)"
deforms = ["bending_y"]
material = { young = 206e9, poisson = 0.3, density = 7850.0 }
section = { shape = "rectangle", width = 0.004, height = 0.015 }

[bodies.tip]
mass = 0.4
center_of_mass = [0.02, 0.0, 0.05]
inertia = [1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0]

[joints.wrist]
type = "revolute"
parent = "upper"
child = "tip"
axis = [1.0, 0.0, 0.0]

[markers.tool]
parent = "tip"
translation = [0.0, 0.0, 0.1]
"""


@pytest.fixture(scope="module")
def arm() -> Model:
    return chain(FRICTION)


@pytest.fixture(scope="module", params=["chain", "beam"])
def machine(request: pytest.FixtureRequest, arm: Model) -> Model:
    return arm if request.param == "chain" else Model.from_toml(BEAM)


def motions(model: Model, *shape: int, seed: int = 0) -> tuple[Array, Array, Array]:
    random, n = np.random.default_rng(seed), len(model.coordinates)
    q, v, a = (random.uniform(-1.0, 1.0, (*shape, n)) for _ in range(3))
    q[..., len(model.joints) :] *= 0.05
    return q, v, a


def one_by_one(function: Callable[..., Array], *parts: Array) -> Array:
    flat = [part.reshape(-1, part.shape[-1]) for part in parts]
    found = np.array([function(*rows) for rows in zip(*flat, strict=True)])
    return found.reshape(*parts[0].shape[:-1], *found.shape[1:])


def close(found: Array, expected: Array, within: float = 1e-10) -> None:
    assert found.shape == expected.shape
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=within * max(1.0, np.abs(expected).max(initial=0.0)))


def test_a_batch_of_any_shape_is_what_single_evaluations_give(machine: Model) -> None:
    q, v, a = motions(machine, 2, 3)
    dynamics = machine.dynamics
    close(machine.mass_matrix(q), one_by_one(dynamics.mass_matrix, q))
    effort = machine.inverse_dynamics(q, v, a)
    close(effort, one_by_one(dynamics.inverse_dynamics, q, v, a))
    close(machine.forward_dynamics(q, v, effort), a, 1e-8)
    close(np.stack(machine.energy(q, v), axis=-1), one_by_one(lambda *state: np.array(dynamics.energy(*state)), q, v))
    close(machine.jacobian("tool", q), one_by_one(lambda at: dynamics.jacobian(at, 0), q))
    # Leading axes are broadcast, and may be empty.
    spread = np.broadcast_arrays(q, v[0], a[0, 0])
    close(machine.inverse_dynamics(q, v[0], a[0, 0]), machine.inverse_dynamics(*spread))
    assert machine.mass_matrix(q[:0]).shape == (0, 3, q.shape[-1], q.shape[-1])
    assert machine.forward_kinematics("tool", q[0, 0]).shape == (4, 4)


def test_long_batches_run_as_machine_code_and_give_the_same(arm: Model) -> None:
    q, v, a = motions(arm, 12_000)
    some = slice(None, None, 1999)
    close(arm.inverse_dynamics(q, v, a)[some], arm.inverse_dynamics(q[some], v[some], a[some]))
    long, short = (arm.inverse_dynamics_derivatives(q[of], v[of], a[of]) for of in (slice(None), some))
    close(long.by_position[some], short.by_position)
    close(arm.mass_matrix(q)[some], arm.mass_matrix(q[some]))


def test_derivatives_of_efforts_are_difference_quotients(machine: Model) -> None:
    q, v, a = motions(machine, 3)
    names = [name for name in machine.parameters if name.startswith(("b1.", "tip.mass", "j1.", "j2."))]
    found = machine.inverse_dynamics_derivatives(q, v, a, parameters=names)
    close(found.effort, machine.inverse_dynamics(q, v, a))
    close(found.by_acceleration, machine.mass_matrix(q))
    size = np.abs(found.effort).max()
    for column in range(q.shape[-1]):
        step = np.zeros(q.shape[-1])
        step[column] = 1e-4
        for place, exact in enumerate((found.by_position, found.by_velocity)):
            # Fourth order: what is left is rounding, 1e-16 size / 1e-4, and the fifth derivative times 1e-16.
            moved = [
                [part + (k * step if place == at else 0.0) for at, part in enumerate((q, v, a))] for k in (-2, -1, 1, 2)
            ]
            two, one, plus, more = (machine.inverse_dynamics(*motion) for motion in moved)
            np.testing.assert_allclose(exact[..., column], (two - 8 * one + 8 * plus - more) / 1.2e-3, atol=1e-7 * size)
    for column, name in enumerate(names):
        value = machine.parameters[name].value
        width = 1e-4 * max(abs(value), 0.1)
        more, less = (
            machine.with_parameters({name: value + sign * width}).inverse_dynamics(q, v, a) for sign in (1, -1)
        )
        np.testing.assert_allclose(found.by_parameters[..., column], (more - less) / (2 * width), atol=1e-6 * size)


def test_poses_move_as_the_jacobian_says(machine: Model) -> None:
    q, *_ = motions(machine, 4)
    jacobian, pose = machine.jacobian("tool", q), machine.forward_kinematics("tool", q)
    np.testing.assert_allclose(
        pose[:, :3, :3] @ pose[:, :3, :3].transpose(0, 2, 1), np.tile(np.eye(3), (4, 1, 1)), atol=1e-12
    )
    np.testing.assert_array_equal(pose[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (4, 1)))
    for column in range(q.shape[-1]):
        step = np.zeros(q.shape[-1])
        step[column] = 1e-6
        change = (machine.forward_kinematics("tool", q + step) - machine.forward_kinematics("tool", q - step)) / 2e-6
        spin = change[:, :3, :3] @ pose[:, :3, :3].transpose(0, 2, 1)
        np.testing.assert_allclose(change[:, :3, 3], jacobian[:, 3:, column], atol=1e-8)
        np.testing.assert_allclose(spin[:, [2, 0, 1], [1, 2, 0]], jacobian[:, :3, column], atol=1e-8)


def test_the_regressor_gives_the_efforts_of_other_bodies(machine: Model) -> None:
    q, v, a = motions(machine, 5)
    table = machine.regressor(q, v, a)
    assert table.shape == (*q.shape, len(machine.standard_names))
    body = machine.standard_bodies[-1]
    changes = {
        f"{body}.mass": 5.0,
        f"{body}.center_of_mass.x": -0.3,
        f"{body}.inertia.xx": 0.4,
        f"{body}.inertia.yy": 0.45,
        f"{body}.inertia.zz": 0.5,
    }
    other = machine.with_parameters(changes)
    difference = other.inverse_dynamics(q, v, a) - machine.inverse_dynamics(q, v, a)
    close(table @ (other.standard_parameters - machine.standard_parameters), difference)


@pytest.mark.skipif(find_spec("pinocchio") is None, reason="Pinocchio is not installed (pip install pin)")
def test_pinocchio_gives_the_same() -> None:
    import pinocchio as pin

    arm, peer = chain(), pin.Model()
    peer.gravity.linear = np.array([0.5, -1.0, -9.81])
    for k, (axis, kind) in enumerate(zip(AXES, KINDS, strict=True)):
        joint = (pin.JointModelRevoluteUnaligned if kind == "revolute" else pin.JointModelPrismaticUnaligned)(
            np.array(axis)
        )
        number = peer.addJoint(k, joint, pin.SE3(pin.rpy.rpyToMatrix(TURNS[k]), SHIFTS[k]), f"j{k}")
        (xx, yy, zz), (xy, xz, yz) = MOMENTS[k], PRODUCTS[k]
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        peer.appendBodyToJoint(number, pin.Inertia(MASSES[k], CENTRES[k], inertia), pin.SE3.Identity())
    tool = peer.addFrame(pin.Frame("tool", 5, 0, pin.SE3(np.eye(3), np.array([0.1, 0.2, 0.3])), pin.FrameType.OP_FRAME))
    data, (q, v, a) = peer.createData(), motions(arm, 6)
    derived = arm.inverse_dynamics_derivatives(q, v, a)
    pose, jacobian, table = arm.forward_kinematics("tool", q), arm.jacobian("tool", q), arm.regressor(q, v, a)
    # Pinocchio's order: mass, first moment, xx xy yy xz yz zz.
    order = [0, 1, 2, 3, 4, 7, 5, 8, 9, 6]
    for row in range(6):
        close(derived.effort[row], pin.rnea(peer, data, q[row], v[row], a[row]))
        by_q, by_v, mass = pin.computeRNEADerivatives(peer, data, q[row], v[row], a[row])
        mass = np.triu(mass) + np.triu(mass, 1).T
        close(derived.by_position[row], by_q)
        close(derived.by_velocity[row], by_v)
        close(derived.by_acceleration[row], mass)
        pin.framesForwardKinematics(peer, data, q[row])
        close(pose[row], data.oMf[tool].homogeneous)
        found = pin.computeFrameJacobian(peer, data, q[row], tool, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        close(jacobian[row], np.vstack([found[3:], found[:3]]))
        theirs = pin.computeJointTorqueRegressor(peer, data, q[row], v[row], a[row]).reshape(5, 5, 10)
        close(table[row].reshape(5, 5, 10)[..., order], theirs)


def test_wrong_motions_are_told_apart(arm: Model) -> None:
    q, v, a = motions(arm, 4)
    with pytest.raises(CoreError, match=r"position has shape \(4, 4\).*5 entries.*reshape"):
        arm.mass_matrix(q[:, :4])
    with pytest.raises(CoreError, match=r"\(4, 5\), \(3, 5\).*do not go together"):
        arm.inverse_dynamics(q, v[:3], a)
    v[2, 1] = np.nan
    with pytest.raises(CoreError, match=r"velocity\[2, 1\].*finite"):
        arm.inverse_dynamics(q, v, a)
    with pytest.raises(CoreError, match=r"effort\[0, \d\] at this state"):
        arm.inverse_dynamics(q, 0 * q + 1e200, a)
    with pytest.raises(ModelError, match="marker"):
        arm.forward_kinematics("hand", q)
    with pytest.raises(ModelError, match="parameter"):
        arm.inverse_dynamics_derivatives(q, a, a, parameters=["b1.weight"])
    with pytest.raises(ModelError, match="give a list"):
        arm.inverse_dynamics_derivatives(q, a, a, parameters="b1.mass")
    with pytest.raises(CoreError, match="no array of numbers"):
        arm.mass_matrix([["a"] * 5])
