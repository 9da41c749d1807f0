"""Single evaluations: against closed forms, against each other, over random states and machines; linear models."""

from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from two_link_arm import Arm, nominal
from vpm.errors import ModelError, SimulationError
from vpm.linear import LinearModel
from vpm.model import Dynamics, Model
from vpm.numbers import Array
from vpm.stepping import Simulation

BODY = """
[bodies.b{k}]
mass = {mass}
center_of_mass = [{x}, {y}, {z}]
inertia = [{i}, {i}, {i}, 0.0, 0.0, 0.0]

[joints.j{k}]
type = "{kind}"
parent = "{parent}"
child = "b{k}"
axis = {axis}
translation = [{y}, {z}, {x}]
rotation = [{x}, {y}, {z}]

[actuators.a{k}]
joint = "j{k}"
gain = {{ value = {gain}, unit = "{unit}" }}
command_unit = "V"

[[effects]]
type = "coulomb_friction"
at = "j{k}"
coulomb = {x}
transition_velocity = 0.5

[[effects]]
type = "spring"
at = "j{k}"
stiffness = {y}
rest = 0.1
"""

unit = st.floats(0.05, 1.0)
rate = st.floats(-2.0, 2.0)


@st.composite
def machines(draw: st.DrawFn) -> Model:
    """Trees of one to four bodies with friction, springs and actuators on every joint."""
    text = 'name = "random"\ngravity = [0.5, -1.0, -9.81]\n'
    for k in range(draw(st.integers(1, 4))):
        kind = draw(st.sampled_from(["revolute", "prismatic"]))
        text += BODY.format(
            k=k,
            kind=kind,
            parent=draw(st.sampled_from(["world", *(f"b{i}" for i in range(k))])),
            axis=draw(st.sampled_from([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.6, 0.8]])),
            mass=1.0 + draw(unit),
            i=0.2 + draw(unit),
            x=draw(unit),
            y=draw(unit),
            z=draw(unit),
            gain=draw(unit),
            unit="N/V" if kind == "prismatic" else "N m/V",
        )
    return Model.from_toml(text)


def vector(data: st.DataObject, length: int) -> Array:
    return np.array(data.draw(st.lists(rate, min_size=length, max_size=length)))


def test_mass_matrix_of_the_two_link_arm_is_the_textbooks() -> None:
    # M. Spong, S. Hutchinson, M. Vidyasagar, "Robot Modeling and Control", section 6.4.
    m2, c1, c2, length, i1, i2 = 2.0, 0.20, 0.18, 0.4, 0.04, 0.03
    for elbow in (0.0, 0.7, -2.0):
        m22 = m2 * c2**2 + i2
        m12 = m22 + m2 * length * c2 * np.cos(elbow)
        m11 = 3.0 * c1**2 + i1 + m22 + m2 * (length**2 + 2.0 * length * c2 * np.cos(elbow))
        np.testing.assert_allclose(nominal().mass_matrix([0.3, elbow]), [[m11, m12], [m12, m22]], rtol=1e-12)


def test_forward_dynamics_of_the_two_link_arm_is_the_textbooks() -> None:
    arm = Arm(centres=(0.20, 0.18), inertias=(0.04, 0.03), viscous=(0.4, 0.2))
    q, v, effort = (0.3, -0.7), (0.5, 1.5), (4.0, -1.0)
    found = nominal().forward_dynamics(np.array(q), np.array(v), np.array(effort))
    np.testing.assert_allclose(found, np.array(arm.acceleration(q, v, effort)), rtol=1e-9)


@settings(max_examples=40)
@given(model=machines(), data=st.data())
def test_the_algorithms_agree_on_random_machines(model: Model, data: st.DataObject) -> None:
    n = len(model.joints)
    q, v, effort = vector(data, n), vector(data, n), vector(data, n)
    acceleration = model.forward_dynamics(q, v, effort)
    np.testing.assert_allclose(model.inverse_dynamics(q, v, acceleration), effort, atol=1e-7)
    mass = model.mass_matrix(q)
    assert np.all(np.linalg.eigvalsh(mass) > 0.0)
    bias = model.inverse_dynamics(q, v, np.zeros(n))
    np.testing.assert_allclose(mass @ acceleration + bias, effort, atol=1e-7)
    # dE/dt = effort . v - what friction takes; the effort at rest is the gradient of the potential.
    steps = 1e-5 * np.eye(n)
    gradient = [(model.energy(q + d, 0 * v)[1] - model.energy(q - d, 0 * v)[1]) / 2e-5 for d in steps]
    np.testing.assert_allclose(model.inverse_dynamics(q, 0 * v, 0 * v), gradient, atol=1e-4)


@settings(max_examples=25)
@given(model=machines(), data=st.data())
def test_linear_models_agree_with_difference_quotients(model: Model, data: st.DataObject) -> None:
    n = len(model.joints)
    state, command = vector(data, 2 * n), vector(data, n)
    linear = model.linearize(state, command)
    gains = np.array([model.parameters[f"a{k}.gain"].value for k in range(n)])

    def rates(x: Array, u: Array) -> Array:
        order = [model.joints.index(f"j{k}") for k in range(n)]
        effort = np.zeros(n)
        effort[order] = gains * u
        return np.concatenate([x[n:], model.forward_dynamics(x[:n], x[n:], effort)])

    step = 1e-6
    by_state = [(rates(state + d, command) - rates(state - d, command)) / (2 * step) for d in step * np.eye(2 * n)]
    by_input = [(rates(state, command + d) - rates(state, command - d)) / (2 * step) for d in step * np.eye(n)]
    scale = 1.0 + np.abs(linear.A).max()
    np.testing.assert_allclose(linear.A, np.transpose(by_state), atol=1e-6 * scale)
    np.testing.assert_allclose(linear.B, np.transpose(by_input), atol=1e-6 * scale)


def test_small_steps_of_the_simulation_are_those_of_the_linear_model() -> None:
    model, state = nominal(), {"shoulder.position": np.pi / 2}  # hanging down: an equilibrium
    linear = model.linearize(state)
    step, small = 2e-3, 1e-4
    transition, drive = linear.sampled(step)
    sim = Simulation(model, step, integrator="rk4", substeps=4, state=state)
    x = np.zeros(4)
    for _ in range(500):
        x = transition @ x + drive @ np.array([small, -small])
        sim.step([small, -small])
    moved = sim.state - model.state(state)
    np.testing.assert_allclose(moved, x, atol=2e-4 * np.abs(x).max())
    rest = Simulation(model, step, state=state).outputs
    outputs = linear.C @ x + linear.D @ [small, -small]
    np.testing.assert_allclose(sim.outputs - rest, outputs, atol=2e-4 * np.abs(outputs).max())


def test_poles_of_an_oscillator_are_the_closed_form() -> None:
    model = Model.from_toml(
        'name = "oscillator"\ngravity = [0.0, 0.0, 0.0]\n'
        "[bodies.cart]\nmass = 2.0\ncenter_of_mass = [0.0, 0.0, 0.0]\ninertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]\n"
        '[joints.rail]\ntype = "prismatic"\nparent = "world"\nchild = "cart"\naxis = [1.0, 0.0, 0.0]\n'
        '[actuators.push]\njoint = "rail"\ngain = { value = 3.0, unit = "N/V" }\ncommand_unit = "V"\n'
        '[[effects]]\ntype = "spring"\nat = "rail"\nstiffness = 50.0\nrest = 0.0\n'
        '[[effects]]\ntype = "viscous_friction"\nat = "rail"\nviscous = 4.0\n'
        '[[effects]]\ntype = "input_delay"\nat = "push"\ntime = 0.01\n'
    )
    linear = model.linearize()
    np.testing.assert_allclose(linear.poles(), [-1.0 + 4.898979485566356j, -1.0 - 4.898979485566356j], rtol=1e-12)
    np.testing.assert_allclose(linear.frequencies(), [5.0 / (2.0 * np.pi)], rtol=1e-12)
    np.testing.assert_allclose(linear.damping_ratios(), [0.2], rtol=1e-12)
    assert linear.stable
    assert linear.delays == {"push.delay.time": 0.01}
    response = linear.part(outputs=["rail.position"]).response([0.0, 2.0])
    np.testing.assert_allclose(response[0, 0, 0], 3.0 / 50.0, rtol=1e-12)
    w = 4.0 * np.pi
    np.testing.assert_allclose(response[1, 0, 0], 3.0 / (50.0 - 2.0 * w**2 + 4.0j * w), rtol=1e-12)
    assert linear.state_units == ("m", "m/s")
    assert linear.input_units == ("V",)


def test_a_linear_model_has_the_manners_of_results(tmp_path: Path) -> None:
    linear = nominal().linearize({"elbow.position": 0.2}, {"first": 0.5})
    assert LinearModel.load(linear.save(tmp_path / "linear.npz")) == linear
    assert "\n" not in repr(linear)
    assert len(linear.to_frame()) == 4
    assert "mode 1" in linear._repr_html_()
    for kind in ("poles", "bode"):
        assert linear.plot(kind).axes
    with pytest.raises(SimulationError, match="choose poles or bode"):
        linear.plot("nyquist")
    with pytest.raises(SimulationError, match=r"shoulder\.position"):
        linear.part(outputs=["shoulder.positio"])


def test_a_linear_model_goes_to_python_control() -> None:
    control = pytest.importorskip("control")
    linear = nominal().linearize()
    np.testing.assert_allclose(sorted(control.poles(linear.to_control())), sorted(linear.poles()))


def test_lags_settle_on_the_command_unless_they_are_named() -> None:
    model = nominal().with_effect("actuator_lag", at="first", time_constant=0.02)
    assert model.state_names[-1] == "first.lag"
    assert model.linearize(inputs={"first": 0.4}).state[-1] == 0.4
    assert model.linearize({"first.lag": 0.1}, {"first": 0.4}).state[-1] == 0.1


def test_names_and_sizes_that_are_wrong_are_said() -> None:
    model = nominal()
    with pytest.raises(ModelError, match=r'"elbow\.position"'):
        model.linearize({"elbow.positon": 0.1})
    with pytest.raises(ModelError, match="shape"):
        model.linearize([0.1, 0.2])
    with pytest.raises(ModelError, match="no actuator"):
        model.linearize(inputs={"third": 1.0})
    for call in (lambda: model.mass_matrix([0.1]), lambda: model.energy([0.1, 0.2], [0.1, 0.2, 0.3])):
        with pytest.raises(ValueError, match="must have 2 entries"):
            call()
    with pytest.raises(ValueError, match="array of numbers"):
        model.mass_matrix("ab")


def test_arrays_of_any_kind_are_read_right() -> None:
    dynamics = Dynamics(nominal())
    q = np.array([0.1, 0.9, -0.7, 0.3])
    expected = dynamics.mass_matrix([0.1, -0.7])
    for same in (q[::2], q[::2].tolist(), q[::2].astype(object), np.array([0.1, -0.7], dtype=">f8")):
        np.testing.assert_array_equal(dynamics.mass_matrix(same), expected)
    single = dynamics.mass_matrix(np.array([0.1, -0.7], dtype=np.float32))
    np.testing.assert_allclose(single, expected, rtol=1e-6)
    first = dynamics.mass_matrix(q[:2])
    kept = first.copy()
    dynamics.mass_matrix(q[2:])
    np.testing.assert_array_equal(first, kept)  # results are the caller's own


def test_threads_share_dynamics_without_mixing_results() -> None:
    dynamics = Dynamics(nominal())
    wrong: list[float] = []

    def work(elbow: float) -> None:
        q = np.array([0.0, elbow])
        expected = dynamics.mass_matrix(q)
        wrong.extend(elbow for _ in range(3000) if not np.array_equal(dynamics.mass_matrix(q), expected))

    threads = [Thread(target=work, args=(0.3 * k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
