"""What Python asks of machines with flexible links: rest, vibrations, Jacobians, linear models, prescribed motion."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from vpm.compare import compare
from vpm.errors import ModelError, SimulationError, ValidityWarning
from vpm.experiment import Experiment
from vpm.identify import identify
from vpm.model import Dynamics, Model
from vpm.numbers import Array
from vpm.simulate import Run, simulate
from vpm.stepping import Simulation

LENGTH, WIDTH, HEIGHT, YOUNG, DENSITY, GRAVITY = 0.5, 0.015, 0.004, 206e9, 7850.0, 9.81
STIFFNESS = YOUNG * WIDTH * HEIGHT**3 / 12.0
LINE_MASS = DENSITY * WIDTH * HEIGHT

ARM = f"""
name = "flexible arm"
gravity = [0.0, 0.0, -{GRAVITY}]

[bodies.hub]
mass = 1.0
center_of_mass = [0.0, 0.0, 0.0]
inertia = [0.01, 0.01, 0.01, 0.0, 0.0, 0.0]

[joints.shoulder]
type = "revolute"
parent = "world"
child = "hub"
axis = [0.0, 1.0, 0.0]

[beams.upper]
parent = "hub"
rotation = [0.0, 1.5707963267948966, 0.0]
length = {LENGTH}
level = "strain(3)"
deforms = ["bending_y"]
material = {{ young = {{ value = 206.0, unit = "GPa", uncertainty = 20.0 }}, poisson = 0.3, density = {DENSITY} }}
section = {{ shape = "rectangle", width = {HEIGHT}, height = {WIDTH} }}
damping = {{ stiffness = 1e-3 }}

[markers.tip]
parent = "upper"

[gauges.root]
beam = "upper"
at = 0.0
x = {HEIGHT / 2.0}
y = 0.0

[actuators.motor]
joint = "shoulder"
gain = {{ value = 2.0, unit = "N m/A" }}
command_unit = "A"

[[effects]]
type = "viscous_friction"
at = "shoulder"
viscous = 0.05
"""

LEVELS = ("strain(3)", "elements(2)", "bezier(4)", "deflection(4)", "hermite(2)", "modal(2)", "lumped(6)")


@pytest.fixture(scope="module")
def arm() -> Model:
    return Model.from_toml(ARM)


def swing(seconds: float = 1.5, dt: float = 0.002, amplitude: float = 0.4) -> Experiment:
    time = dt * np.arange(round(seconds / dt))
    angle = amplitude * (np.sin(2.0 * np.pi * time) + 0.3 * np.sin(7.0 * np.pi * time))
    return Experiment.from_arrays(time, {"shoulder.position": angle}, units={"shoulder.position": "rad"}, name="swing")


@pytest.mark.parametrize("level", LEVELS)
def test_rest_and_vibration_of_a_horizontal_arm_are_the_closed_forms(arm: Model, level: str) -> None:
    # Euler-Bernoulli cantilever: S. Timoshenko, "Vibration Problems in Engineering", section 5.11.
    model = arm.at(level)
    coordinates, effort = model.equilibrium([0.0])
    assert coordinates[0] == 0.0
    weight = LINE_MASS * LENGTH * GRAVITY
    np.testing.assert_allclose(effort, [-0.5 * weight * LENGTH], rtol=1e-4)
    first = 1.8751040687**2 / (2.0 * np.pi) * np.sqrt(STIFFNESS / (LINE_MASS * LENGTH**4))
    tolerance = 0.03 if level.startswith("lumped") else 0.002
    np.testing.assert_allclose(model.natural_frequencies([0.0])[0], first, rtol=tolerance)
    sag = Simulation(model, 1e-3, state=model.linearize().state)["tip.z"]
    np.testing.assert_allclose(sag, -LINE_MASS * GRAVITY * LENGTH**4 / (8.0 * STIFFNESS), rtol=3.0 * tolerance)


@pytest.mark.parametrize("level", LEVELS)
def test_inverse_and_forward_dynamics_undo_each_other(arm: Model, level: str) -> None:
    model, random = arm.at(level), np.random.default_rng(3)
    n = len(model.coordinates)
    q, v, effort = 0.02 * random.standard_normal((3, n))
    acceleration = model.forward_dynamics(q, v, effort)
    np.testing.assert_allclose(model.inverse_dynamics(q, v, acceleration), effort, atol=1e-9)
    mass = model.mass_matrix(q)
    np.testing.assert_allclose(mass, mass.T, atol=1e-15)
    assert model.energy(q, v)[0] == pytest.approx(0.5 * v @ mass @ v, rel=1e-9)


@pytest.mark.parametrize("level", ["strain(3)", "bezier(3)", "deflection(3)"])
def test_the_jacobian_of_a_marker_is_the_slope_of_its_place(arm: Model, level: str) -> None:
    model, random = arm.at(level), np.random.default_rng(5)
    n = len(model.coordinates)
    q = 0.05 * random.standard_normal(n)

    def place(q: Array) -> Array:
        sim = Simulation(model, 1e-3, state=np.concatenate([q, np.zeros(n)]))
        return np.array([sim[f"tip.{axis}"] for axis in "xyz"])

    quotient = np.transpose([(place(q + d) - place(q - d)) / 2e-6 for d in 1e-6 * np.eye(n)])
    jacobian = model.jacobian("tip", q)
    np.testing.assert_allclose(jacobian[3:], quotient, atol=1e-7)
    np.testing.assert_allclose(jacobian[:3, 0], [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_array_equal(Dynamics(model).jacobian("tip", q), jacobian)
    with pytest.raises(ModelError, match="tip"):
        model.jacobian("tipp", q)


@pytest.mark.parametrize("level", ["strain(3)", "hermite(2)"])
def test_linear_models_agree_with_difference_quotients(arm: Model, level: str) -> None:
    model = arm.at(level)
    n = len(model.coordinates)
    state = 0.05 * np.random.default_rng(7).standard_normal(2 * n)
    linear = model.linearize(state, [0.3])

    def rates(x: Array) -> Array:
        effort = np.zeros(n)
        effort[0] = 2.0 * 0.3
        return np.concatenate([x[n:], model.forward_dynamics(x[:n], x[n:], effort)])

    quotient = np.transpose([(rates(state + d) - rates(state - d)) / 2e-6 for d in 1e-6 * np.eye(2 * n)])
    np.testing.assert_allclose(linear.A, quotient, atol=1e-6 * np.abs(quotient).max())
    assert linear.states == model.state_names


def test_small_steps_are_those_of_the_linear_model(arm: Model) -> None:
    linear, step, small = arm.linearize({"shoulder.position": np.pi / 2}), 1e-3, 1e-3
    transition, drive = linear.sampled(step)
    sim = Simulation(arm, step, integrator="rosenbrock", substeps=4, state=linear.state)
    rest, x = sim.outputs, np.zeros(len(linear.states))
    for _ in range(400):
        x = transition @ x + drive @ [small]
        sim.step([small])
    for channel in ("shoulder.position", "root.strain", "tip.x"):
        row = linear.outputs.index(channel)
        moved = sim.outputs[row] - rest[row]
        assert moved == pytest.approx((linear.C @ x)[row], rel=2e-3), channel


def test_a_still_joint_shows_the_static_strain(arm: Model) -> None:
    time = 0.002 * np.arange(400)
    still = Experiment.from_arrays(
        time, {"shoulder.position": np.zeros(400)}, units={"shoulder.position": "rad"}, name="still"
    )
    run = simulate(arm, still, "prescribed_motion", cutoff=20.0)
    moment = 0.5 * LINE_MASS * GRAVITY * LENGTH**2
    np.testing.assert_allclose(np.abs(run["root.strain"]), moment * HEIGHT / 2.0 / STIFFNESS, rtol=1e-3)
    np.testing.assert_allclose(run["shoulder.effort"], -moment, rtol=1e-4)
    assert set(run.channels) == {
        "shoulder.effort",
        "root.strain",
        *(f"tip.{c}" for c in ("x", "y", "z", "rx", "ry", "rz")),
    }


def test_a_rigid_arm_on_a_prescribed_motion_needs_the_effort_of_inverse_dynamics(arm: Model) -> None:
    from vpm.initial import joint_motion

    log = swing()
    run = simulate(arm.at("rigid"), log, "prescribed_motion", cutoff=25.0)
    m = joint_motion(log, arm, 25.0)
    expected = [
        arm.at("rigid").inverse_dynamics(q, v, a)[0]
        for q, v, a in zip(m.position[m.kept], m.velocity[m.kept], m.acceleration[m.kept], strict=True)
    ]
    np.testing.assert_allclose(run["shoulder.effort"], expected, rtol=1e-9, atol=1e-12)


def test_stiffness_is_identified_from_a_gauge_under_a_prescribed_motion(arm: Model) -> None:
    log = swing()
    truth = arm.with_parameters({"upper.young": 180e9})
    run = simulate(truth, log, "prescribed_motion", cutoff=25.0)
    inside = slice(round((run.time[0] - log.time[0]) / log.dt), None)
    strain = np.zeros(len(log))
    strain[inside][: run.time.size] = run["root.strain"]
    channels = {"shoulder.position": log["shoulder.position"], "root.strain": strain}
    record = Experiment.from_arrays(
        log.time, channels, units={"shoulder.position": "rad", "root.strain": "1"}, name="gauge"
    )
    gap = compare(simulate(arm, record, "prescribed_motion", cutoff=25.0), record)
    assert gap["root.strain"].relative_error > 5.0
    fit = identify(arm, [record], free=["upper.young"], mode="prescribed_motion", cutoff=25.0)
    assert fit.values[0] == pytest.approx(180e9, rel=1e-4)


def test_free_runs_start_from_the_sag_of_the_links(arm: Model) -> None:
    time = 0.002 * np.arange(200)
    hold = arm.equilibrium([0.0])[1][0] / 2.0
    channels = {"shoulder.position": np.zeros(200), "motor.command": np.full(200, hold)}
    log = Experiment.from_arrays(time, channels, units={"shoulder.position": "rad", "motor.command": "A"}, name="hold")
    for mode in ("free_run", "restarts"):
        run = simulate(arm, log, mode, cutoff=20.0)
        assert np.ptp(run["root.strain"]) < 1e-6 * np.abs(run["root.strain"]).max(), mode


def test_inverse_dynamics_names_the_mode_that_works(arm: Model) -> None:
    log = swing()
    channels = {"shoulder.position": log["shoulder.position"], "motor.command": np.zeros(len(log))}
    full = Experiment.from_arrays(
        log.time, channels, units={"shoulder.position": "rad", "motor.command": "A"}, name="log"
    )
    with pytest.raises(SimulationError, match=r"upper; use the mode 'prescribed_motion'"):
        simulate(arm, full, "inverse_dynamics")
    # An identification works out along the motion what bends, and so it balances the efforts of such an arm too.
    assert identify(arm, [full], free=["upper.young"], mode="inverse_dynamics").mode == "inverse_dynamics"


def test_bending_beyond_the_kinematics_warns_once_and_stays_in_the_run(arm: Model, tmp_path: Path) -> None:
    soft = arm.at("deflection(3)").with_parameters({"upper.young": 4e9})
    with pytest.warns(ValidityWarning, match=r"bezier\(4\)") as seen:
        run = simulate(soft, swing(), "prescribed_motion", cutoff=25.0)
    assert len(seen) == 1
    warning = seen[0].message
    assert isinstance(warning, ValidityWarning)
    assert warning.beam == "upper"
    assert warning.slope > soft.core.slope_limit
    assert run.time[0] <= warning.time <= run.time[-1]
    assert run.notes == (str(warning),)
    assert "upper bends by" in run._repr_html_()
    assert Run.load(run.save(tmp_path / "run.npz")) == run
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert simulate(soft.at("bezier(4)"), swing(), "prescribed_motion", cutoff=25.0).notes == ()


def test_explicit_steps_that_are_too_long_name_the_mode_and_the_step(arm: Model) -> None:
    with pytest.raises(SimulationError, match=r"too large for rk4.*Hz, is stable\s+up to .* s; use more substeps"):
        Simulation(arm, 1e-3, integrator="rk4")
    log = swing()
    channels = {"motor.command": np.zeros(len(log))}
    driven = Experiment.from_arrays(log.time, channels, units={"motor.command": "A"}, name="log")
    with pytest.raises(SimulationError, match="too large for rk4"):
        simulate(arm, driven, integrator="rk4")
    with pytest.raises(SimulationError, match="too large for rk4"):
        simulate(arm, log, "prescribed_motion", integrator="rk4", cutoff=25.0)
    fine = simulate(arm, log, "prescribed_motion", integrator="rk4", substeps=8, cutoff=25.0)
    implicit = simulate(arm, log, "prescribed_motion", integrator="rosenbrock", cutoff=25.0)
    np.testing.assert_allclose(fine["root.strain"], implicit["root.strain"], atol=1e-3 * np.ptp(fine["root.strain"]))
    for integrator in ("linearly_implicit", "rosenbrock", "semi_implicit"):
        Simulation(arm, 1e-3, integrator=integrator).step([0.1])
