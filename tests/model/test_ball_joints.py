"""Spherical and free joints through all orientations, against solutions by other methods; what needs their angles."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipk

import vpm
from vpm import Experiment, Model, Simulation, simulate
from vpm.errors import CoreError, DivergedError, VpmError
from vpm.numbers import Array

MOMENTS = np.array([1.0, 2.0, 2.5])
STEP = 1e-3
ANGLES = ("ball_x", "ball_y", "ball_z")
QUATERNION = ("ball.qw", "ball.qx", "ball.qy", "ball.qz")
OMEGA = ("ball.wx", "ball.wy", "ball.wz")
ORDERS = {"semi_implicit": 1, "linearly_implicit": 2, "rk4": 4, "rosenbrock": 4, "additive": 4}


def top(*, gravity: float = 0.0, center: float = 0.0, **rest: Any) -> Model:
    """A body on a spherical joint, its centre of mass on the third axis of its own."""
    body = {"mass": 1.0, "center_of_mass": [0.0, 0.0, center], "inertia": [*MOMENTS, 0.0, 0.0, 0.0]}
    joint = {"type": "spherical", "parent": "world", "child": "body"}
    content = {"name": "top", "gravity": [0.0, 0.0, -gravity], "bodies": {"body": body}, "joints": {"ball": joint}}
    return Model.from_dict({**content, **rest})


def start(angles: Array, omega: Array) -> dict[str, float]:
    """Where angles and angular velocity are these; the middle angle must not be 90 degrees."""
    _, b, c = angles
    u = (np.cos(c) * omega[0] - np.sin(c) * omega[1]) / np.cos(b)
    rates = (u, np.sin(c) * omega[0] + np.cos(c) * omega[1], omega[2] - u * np.sin(b))
    motions = zip(ANGLES, angles, rates, strict=True)
    return {f"{n}.{k}": v for n, q, r in motions for k, v in (("position", q), ("velocity", r))}


def stepped(model: Model, state: dict[str, float], seconds: float, step: float = STEP, method: str = "rk4") -> vpm.Run:
    simulation = Simulation(model, step, integrator=method, state=state)
    return simulation.run(np.zeros((round(seconds / step), len(model.inputs))))


def columns(run: vpm.Run, names: tuple[str, ...]) -> Array:
    return np.stack([run[name] for name in names], axis=1)


def test_modes_of_rounding_are_no_modes() -> None:
    """A body that floats has no vibration, and its eigenvalues are zero but for rounding."""
    joint = {"type": "free", "parent": "world", "child": "body"}
    model = top(center=0.1, gravity=9.81, joints={"ball": joint})
    state = {"ball_rx.velocity": 4.0, "ball_ry.velocity": 6.0, "ball_rz.velocity": -3.0}
    for method in ORDERS:
        run = stepped(model, state, 0.5, method=method)
        assert run.resolution is not None
        assert run.resolution.is_complete, str(run.resolution)


def rotations(run: vpm.Run) -> Rotation:
    return Rotation.from_quat(columns(run, QUATERNION), scalar_first=True)


def by_angles(run: vpm.Run) -> Rotation:
    return Rotation.from_euler("XYZ", columns(run, tuple(f"{name}.position" for name in ANGLES)))


def turning(quaternion: Array, omega: Array) -> Array:
    """Derivative of a unit quaternion, real part first."""
    w, v = quaternion[0], quaternion[1:]
    return 0.5 * np.concatenate(([-(v @ omega)], w * omega + np.cross(v, omega)))


def exact(rates: Callable[[float, Array], Array], first: Array, times: Array) -> Array:
    solution = solve_ivp(rates, (0.0, times[-1]), first, "DOP853", t_eval=times, rtol=1e-13, atol=1e-13)
    return np.asarray(solution.y.T)


def euler(gravity: float, center: float) -> Callable[[float, Array], Array]:
    """Euler's equations of a body that turns about a fixed point, with its quaternion."""
    inertia = MOMENTS + np.array([1.0, 1.0, 0.0]) * center**2

    def rates(_: float, x: Array) -> Array:
        quaternion, omega = x[:4] / np.linalg.norm(x[:4]), x[4:]
        down = Rotation.from_quat(quaternion, scalar_first=True).inv().apply([0.0, 0.0, -gravity])
        torque = np.cross([0.0, 0.0, center], down)
        return np.concatenate((turning(quaternion, omega), (torque - np.cross(omega, inertia * omega)) / inertia))

    return rates


def first_of(angles: Array, omega: Array) -> Array:
    return np.concatenate((Rotation.from_euler("XYZ", angles).as_quat(scalar_first=True), omega))


tumbles = st.tuples(
    st.tuples(*[st.floats(-1.4, 1.4)] * 3).map(np.array), st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(np.array)
)


# ---- against other methods ------------------------------------------------------------------------------------------


@settings(max_examples=12, deadline=None)
@given(tumbles, st.sampled_from([(0.0, 0.0), (9.81, 0.3)]))
def test_bodies_tumble_as_by_eulers_equations(tumble: tuple[Array, Array], weight: tuple[float, float]) -> None:
    """What is left of Euler's equations is the error of the steps, and falls as their order says."""
    gravity, center = weight
    model, seconds = top(gravity=gravity, center=center), 10.0
    other = exact(euler(gravity, center), first_of(*tumble), np.linspace(0.0, seconds, 21))[1:]
    expected = Rotation.from_quat(other[:, :4], scalar_first=True)
    left = []
    for step in (2.0 * STEP, STEP):
        run, own = stepped(model, start(*tumble), seconds, step), round(0.5 / step)
        last = slice(own - 1, None, own)
        turned = (rotations(run)[last].inv() * expected).magnitude()
        assert (by_angles(run)[last].inv() * rotations(run)[last]).magnitude().max() < 1e-10
        left.append(max(turned.max(), np.abs(columns(run, OMEGA)[last] - other[:, 4:]).max()))
    assert left[1] < max(left[0] / 12.0, 1e-10)
    assert left[1] < 1e-7


def test_a_body_that_turns_over_follows_jacobis_functions() -> None:
    """Landau & Lifshitz, "Mechanics", section 37; turning about the middle axis, which turns over."""
    omega = np.array([0.4, 2.0, 0.0])
    one, two, three = MOMENTS
    energy, momentum = float(MOMENTS @ omega**2), float(MOMENTS**2 @ omega**2)
    assert momentum < energy * two  # then first and third axis change their parts
    frequency = np.sqrt((two - one) * (energy * three - momentum) / (one * two * three))
    ratio = (three - two) * (momentum - energy * one) / ((two - one) * (energy * three - momentum))
    run = stepped(top(), start(np.zeros(3), omega), 10.0)
    size = np.sqrt((energy * three - momentum) / (one * (three - one)))
    other = np.sqrt((momentum - energy * one) / (two * (two - one)))
    last = np.sqrt((momentum - energy * one) / (three * (three - one)))
    # It begins where the middle rate is largest, a quarter of the period after zero.
    sn, cn, dn, _ = ellipj(frequency * run.time + ellipk(ratio), ratio)
    expected = np.stack([size * dn, other * sn, last * cn], axis=1)
    assert np.abs(columns(run, OMEGA) - expected).max() < 1e-8


ARM = {
    "name": "arm",
    "gravity": [0.0, 0.0, -9.81],
    "bodies": {
        "link": {"mass": 2.0, "center_of_mass": [0.3, 0.0, 0.0], "inertia": [0.1, 0.2, 0.2, 0.0, 0.0, 0.0]},
        "load": {"mass": 1.0, "center_of_mass": [0.05, -0.1, 0.2], "inertia": [0.05, 0.08, 0.1, 0.0, 0.0, 0.0]},
    },
    "joints": {
        "base": {"type": "revolute", "parent": "world", "child": "link", "axis": [0.0, 1.0, 0.0]},
        "ball": {"type": "spherical", "parent": "link", "child": "load", "translation": [0.6, 0.0, 0.0]},
    },
    "actuators": {"motor": {"joint": "base", "gain": 1.0}},
}


def arm_by_kane(_: float, x: Array) -> Array:
    """Kane's equations in angle and rate of the arm, quaternion of the load in the world and its angular velocity."""
    angle, quaternion, rate, omega = x[0], x[1:5] / np.linalg.norm(x[1:5]), x[5], x[6:]
    turn = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    arm = np.array([np.cos(angle), 0.0, -np.sin(angle)])
    across = np.array([-np.sin(angle), 0.0, -np.cos(angle)])
    center, moments = np.array([0.05, -0.1, 0.2]), np.array([0.05, 0.08, 0.1])
    skew = np.array([[0.0, -center[2], center[1]], [center[2], 0.0, -center[0]], [-center[1], center[0], 0.0]])
    moves = np.column_stack((0.6 * across, -turn @ skew))  # velocity of the load's centre per rate
    drift = -0.6 * arm * rate**2 + turn @ np.cross(omega, np.cross(omega, center))
    down = np.array([0.0, 0.0, -9.81])
    mass = moves.T @ moves
    mass[0, 0] += 0.2 + 2.0 * 0.3**2
    mass[1:, 1:] += np.diag(moments)
    force = moves.T @ (down - drift)
    force[0] += 2.0 * 0.3 * (across @ down)
    force[1:] -= np.cross(omega, moments * omega)
    return np.concatenate(([rate], turning(quaternion, omega), np.linalg.solve(mass, force)))


@settings(max_examples=5, deadline=None)
@given(tumbles)
def test_a_load_on_an_arm_moves_as_by_kanes_equations(tumble: tuple[Array, Array]) -> None:
    angles, omega = tumble
    # The arm turns about y by 0.4 rad at 1 rad/s; the load's own motion is relative to it.
    arm = Rotation.from_euler("Y", 0.4)
    relative = Rotation.from_euler("XYZ", angles)
    world = omega + relative.inv().apply([0.0, 1.0, 0.0])
    state = {"base.position": 0.4, "base.velocity": 1.0, **start(angles, omega)}
    run = stepped(Model.from_dict(ARM), state, 2.0, step=5e-4)  # longer ways of this machine are chaotic
    times = np.concatenate(([0.0], run.time))[::500]
    first = np.concatenate(([0.4], (arm * relative).as_quat(scalar_first=True), [1.0], world))
    other = exact(arm_by_kane, first, times)[1:]
    own = slice(499, None, 500)
    assert np.abs(run["base.position"][own] - other[:, 0]).max() < 1e-8
    turned = Rotation.from_euler("Y", run["base.position"][own, None]) * rotations(run)[own]
    assert (turned.inv() * Rotation.from_quat(other[:, 1:5], scalar_first=True)).magnitude().max() < 1e-8


def test_a_thrown_body_tumbles_about_its_centre_of_mass() -> None:
    body = {"mass": 2.0, "center_of_mass": [0.1, 0.2, 0.3], "inertia": [*MOMENTS, 0.0, 0.0, 0.0]}
    joint = {"type": "free", "parent": "world", "child": "body"}
    marker = {"centre": {"parent": "body", "translation": [0.1, 0.2, 0.3]}}
    content = {"name": "thrown", "gravity": [0.0, 0.0, -9.81], "bodies": {"body": body}, "joints": {"ball": joint}}
    angles, omega = np.array([0.3, 1.3, -0.5]), np.array([0.5, 3.0, 0.4])
    state = {name.replace("ball_", "ball_r"): value for name, value in start(angles, omega).items()}
    simulation = Simulation(Model.from_dict({**content, "markers": marker}), STEP, integrator="rk4", state=state)
    at = np.array([simulation[f"centre.{k}"] for k in "xyz"])
    velocity = Rotation.from_euler("XYZ", angles).apply(np.cross(omega, [0.1, 0.2, 0.3]))
    run = simulation.run(np.zeros((5000, 0)))
    fall = at + velocity * run.time[:, None] + np.outer(run.time**2, [0.0, 0.0, -0.5 * 9.81])
    assert np.abs(columns(run, ("centre.x", "centre.y", "centre.z")) - fall).max() < 1e-8
    other = exact(euler(0.0, 0.0), first_of(angles, omega), np.array([0.0, 5.0]))[-1]
    expected = Rotation.from_quat(other[:4], scalar_first=True)
    assert (rotations(run)[-1].inv() * expected).magnitude() < 1e-8


@pytest.mark.parametrize("method", ORDERS)
def test_the_error_of_the_energy_falls_with_the_order(method: str) -> None:
    angles, omega = np.array([0.2, 1.4, -0.4]), np.array([0.3, 3.0, 0.2])
    errors = []
    for step in (0.01, 0.005):
        run = stepped(top(gravity=9.81, center=0.3), start(angles, omega), 3.0, step, method)
        moments = MOMENTS + np.array([0.09, 0.09, 0.0])
        height = rotations(run).apply([0.0, 0.0, 0.3])[:, 2]
        energy = 0.5 * columns(run, OMEGA) ** 2 @ moments + 9.81 * height
        before = 0.5 * omega**2 @ moments + 9.81 * Rotation.from_euler("XYZ", angles).apply([0.0, 0.0, 0.3])[2]
        errors.append(np.abs(energy - before).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(ORDERS[method], abs=0.7)


def test_a_body_that_spins_through_the_singularity_keeps_its_momentum_with_the_default() -> None:
    """A case that angles got wrong by a fifth of the energy without a word."""
    angles, omega = np.array([0.0, np.pi / 2 - 1e-3, 0.0]), np.array([1.0, 0.5, 2.0])
    run = stepped(top(), start(angles, omega), 1.0, method="auto")
    energy = columns(run, OMEGA) ** 2 @ MOMENTS
    assert np.abs(energy / (omega**2 @ MOMENTS) - 1.0).max() < 1e-5
    momentum = rotations(run).apply(columns(run, OMEGA) * MOMENTS)
    before = Rotation.from_euler("XYZ", angles).apply(omega * MOMENTS)
    assert np.abs(momentum - before).max() < 1e-4


# ---- what users see -------------------------------------------------------------------------------------------------


def test_a_start_at_the_singularity_is_a_start_like_any_other() -> None:
    state = {"ball_y.position": np.pi / 2, "ball_x.velocity": 1.0, "ball_y.velocity": 2.0, "ball_z.velocity": 0.5}
    run = stepped(top(), state, 1.0)
    omega = np.array([0.0, 2.0, 1.5])
    other = exact(euler(0.0, 0.0), first_of(np.array([0.0, np.pi / 2, 0.0]), omega), np.array([0.0, 1.0]))[-1]
    assert np.abs(columns(run, OMEGA)[-1] - other[4:]).max() < 1e-8


def test_angles_go_on_where_they_were() -> None:
    turns = stepped(top(), {"ball_y.velocity": 5.0}, 3.0)
    assert np.abs(turns["ball_y.position"] - 5.0 * turns.time).max() < 1e-9
    assert np.abs(turns["ball_x.position"]).max() < 1e-9
    spins = stepped(top(), {"ball_z.velocity": 7.0, "ball_z.position": 10.0}, 3.0)
    assert np.abs(spins["ball_z.position"] - 10.0 - 7.0 * spins.time).max() < 1e-9
    state = start(np.array([0.3, -0.7, 4.0]), np.array([1.0, 2.0, 3.0]))
    simulation = Simulation(top(), STEP, state=state)
    assert [simulation[f"{name}.position"] for name in ANGLES] == [0.3, -0.7, 4.0]
    assert [simulation[name] for name in state] == pytest.approx(list(state.values()), rel=1e-14)


def test_accelerations_of_angles_are_those_of_the_model() -> None:
    model = top(gravity=9.81, center=0.3)
    simulation = Simulation(model, STEP, state=start(np.array([0.3, 0.9, -0.4]), np.array([1.0, 2.0, 3.0])))
    for _ in range(50):
        q, v = np.split(simulation.state, 2)
        shown = [simulation[f"{name}.acceleration"] for name in ANGLES]
        np.testing.assert_allclose(shown, model.forward_dynamics(q, v, np.zeros(3)), rtol=1e-9)
        simulation.step()


def log(model: Model, count: int, size: float = 3.0) -> Experiment:
    time = STEP * np.arange(count)
    channels = {"motor.command": size * np.sin(2.0 * time)} | {f"{n}.position": 0.0 * time for n in model.joints}
    units = {name: "N m" if name == "motor.command" else "rad" for name in channels}
    return Experiment.from_arrays(time, channels, units=units, name="push")


@pytest.mark.parametrize("method", [*ORDERS, "adaptive", "guarded"])
def test_runs_steps_and_machine_code_agree(method: str) -> None:
    model = Model.from_dict(ARM)
    state = model.state({"base.position": 0.4, **start(np.array([0.3, 1.4, -0.4]), np.array([1.0, 4.0, 0.5]))})
    record = log(model, 1001)
    run = simulate(model, record, integrator=method, initial_state=state)
    for compiled in (False, True):
        simulation = Simulation(model, STEP, integrator=method, state=state, compiled=compiled)
        rows = simulation.run(record["motor.command"][:-1, None])
        for name in ("base.position", "ball_y.position", "ball.qw", "ball.wz"):
            np.testing.assert_allclose(rows[name], run[name][1:], rtol=1e-9, atol=1e-11)


def test_orientation_can_be_measured() -> None:
    gain = {"type": "sensor_gain", "at": "imu", "value": 2.0}
    model = top(sensors={"imu": {"measures": "ball.wz"}}, effects=[gain])
    simulation = Simulation(model, STEP, state={"ball_z.velocity": 3.0})
    assert simulation["ball.wz"] == 6.0
    assert model.channel_unit("ball.qw") == "1"
    assert model.channel_unit("ball.wx") == "rad/s"


# ---- what needs angles ----------------------------------------------------------------------------------------------

FRICTION = {"type": "viscous_friction", "at": "ball_x", "viscous": 0.0}
#: Right through the singularity, the other two angles at rest.
OVER = {"ball_y.position": 1.0, "ball_y.velocity": 1.5}


@settings(max_examples=15, deadline=None)
@given(tumbles, st.sampled_from(["auto", "rk4", "rosenbrock", "adaptive"]))
def test_runs_on_angles_are_right_or_refused(tumble: tuple[Array, Array], method: str) -> None:
    right = stepped(top(), start(*tumble), 3.0)
    said = ""
    try:
        run = stepped(top(effects=[FRICTION]), start(*tumble), 3.0, method=method)
    except VpmError as error:
        said = str(error)
    if said:
        assert "joint `ball` comes too near to the singularity of its angles" in said
    else:
        assert (rotations(run)[-1].inv() * rotations(right)[-1]).magnitude() < 1e-3


HINDRANCES: list[tuple[dict[str, Any], str]] = [
    ({"effects": [FRICTION]}, "an effect acts on `ball_x`"),
    ({"effects": [{"type": "rotor_inertia", "at": "ball_y", "inertia": 1e-6}]}, "an effect acts on `ball_y`"),
    ({"actuators": {"motor": {"joint": "ball_z", "gain": 1.0}}}, "actuator `motor` acts on one of them"),
    ({"transmissions": {"shaft": {"ratios": {"ball_x": 2.0}}}}, "transmission `shaft` turns one of them"),
    ({"velocity_terms": False}, "the model leaves out terms that depend on the choice of coordinates"),
]


@pytest.mark.parametrize(("extra", "says"), HINDRANCES, ids=[says for _, says in HINDRANCES])
def test_what_needs_an_angle_ends_the_run_with_one_sentence(extra: dict[str, Any], says: str) -> None:
    with pytest.raises(DivergedError) as caught:
        stepped(top(**extra), OVER, 1.0)
    for part in (
        "joint `ball` comes too near to the singularity",
        "`ball_y` is ",
        says,
        "at t = ",
        "turn the frame of",
    ):
        assert part in str(caught.value)


def test_a_run_on_a_log_ends_likewise_and_keeps_what_it_has() -> None:
    model = top(actuators={"motor": {"joint": "ball_z", "gain": 1.0}})
    with pytest.raises(DivergedError, match="joint `ball` comes too near to the singularity") as caught:
        simulate(model, log(model, 3000, 0.0), integrator="rk4", initial_state=model.state(OVER))
    assert isinstance(caught.value.run, vpm.Run)
    assert 0 < len(caught.value.run.time) < 3000


def test_what_angles_cannot_give_is_refused() -> None:
    model = top()
    state = {"ball_y.position": np.pi / 2}
    with pytest.raises(CoreError, match="joint `ball` is at the singularity of its angles"):
        model.linearize(state)
    with pytest.raises(CoreError, match="joint `ball` is at the singularity of its angles"):
        model.forward_dynamics(model.state(state)[:3], np.zeros(3), np.zeros(3))
    # Efforts that a motion needs are right everywhere.
    assert np.all(np.isfinite(model.inverse_dynamics(model.state(state)[:3], np.ones(3), np.ones(3))))
