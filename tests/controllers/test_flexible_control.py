"""The flexible model in the controller: against closed forms, Riccati equations, a batch smoother and its own plays."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve, solve_continuous_are

import vpm
from model_texts import effect_text, on_rail, sliding
from places import EXAMPLES
from vpm.control.splitting import solve, split
from vpm.errors import CoreError, SimulationError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.realtime import Loop

#: Two rods of 0.5 m and 0.3 kg in the horizontal plane; a spring holds the second one, which nothing drives.
LINK, MASS, INERTIA, STIFFNESS = 0.5, 0.3, 0.3 * 0.5**2 / 12.0, 20.0
RODS = f"""
name = "two rods"
gravity = [0.0, 0.0, -9.81]

[bodies.inner]
mass = {MASS}
center_of_mass = [{LINK / 2}, 0.0, 0.0]
inertia = [{INERTIA}, {INERTIA}, {INERTIA}, 0.0, 0.0, 0.0]

[bodies.outer]
mass = {MASS}
center_of_mass = [{LINK / 2}, 0.0, 0.0]
inertia = [{INERTIA}, {INERTIA}, {INERTIA}, 0.0, 0.0, 0.0]

[joints.hub]
type = "revolute"
parent = "world"
child = "inner"
axis = [0.0, 0.0, 1.0]

[joints.bend]
type = "revolute"
parent = "inner"
child = "outer"
axis = [0.0, 0.0, 1.0]
translation = [{LINK}, 0.0, 0.0]

[markers.tip]
parent = "outer"
translation = [{LINK}, 0.0, 0.0]

[actuators.motor]
joint = "hub"
gain = {{ value = 1.0, unit = "N m/(N m)" }}
command_unit = "N m"

[[effects]]
type = "spring"
at = "bend"
stiffness = {STIFFNESS}
rest = 0.0
"""
#: A mass that is driven, and one behind a spring.
CARTS = (
    on_rail("first", joint="way", drive="motor", gain='{ value = 1.0, unit = "N/N" }')
    + 'command_unit = "N"\n[markers.load]\nparent = "second"\n'
    + sliding("second", "0.5", "stretch", "first")
    + effect_text("spring", "stretch", stiffness=50.0, rest=0.0)
)
SMALL = 1e-4


@cache
def rods() -> Model:
    return Model.from_toml(RODS)


@cache
def turn() -> vpm.TargetMotion:
    """A tenth of a millimetre across: so little that the rods are linear."""
    return vpm.TargetMotion.rest_to_rest([0.0], [SMALL], 0.4)


@cache
def plan() -> vpm.FlexibleFeedforward:
    return vpm.flexible_feedforward(rods(), turn(), ["tip.y"])


def nines(time: Array, duration: float) -> tuple[Array, Array, Array]:
    """The flattest polynomial of degree 9 from 0 to 1, with its second and fourth derivatives."""
    shape = np.polynomial.Polynomial([0, 0, 0, 0, 0, 126.0, -420.0, 540.0, -315.0, 70.0])
    at = np.clip(time / duration, 0.0, 1.0)
    return shape(at), shape.deriv(2)(at) / duration**2, shape.deriv(4)(at) / duration**4


def test_growing_and_decaying_parts_are_the_closed_form() -> None:
    # e'' = 25 e + g(t): the bounded solution is the convolution with -exp(-5 |t|) / 10.
    time = np.arange(-3.0, 3.0005, 0.005)
    matrix = np.array([[0.0, 1.0], [25.0, 0.0]])

    def push(at: Array) -> Array:
        return np.asarray(np.exp(-10.0 * at**2))

    def rates(at: Array, states: Array) -> tuple[Array, Array]:
        slopes = states @ matrix.T
        slopes[:, 1] += push(at)
        return slopes, np.broadcast_to(matrix, (len(at), 2, 2))

    guess = np.zeros((len(time), 2))
    guess[len(time) // 2] = 1.0
    found = solve(rates, time, guess, (matrix, matrix))
    fine = np.arange(-4.0, 4.0, 1e-3)
    exact = [-0.1 * 1e-3 * np.sum(np.exp(-5.0 * np.abs(at - fine)) * push(fine)) for at in time[::50]]
    # The sum over a kink is right to the square of its step.
    np.testing.assert_allclose(found[::50, 0], exact, atol=2e-7)
    parts = split(matrix)
    assert parts.forward @ np.array([1.0, 5.0]) == pytest.approx(0.0, abs=1e-12)
    assert parts.backward @ np.array([1.0, -5.0]) == pytest.approx(0.0, abs=1e-12)


def test_motions_that_begin_to_grow_on_the_way_are_told() -> None:
    # A pole at -3 that is at +3 for a while: what it grows by is no bounded motion of either kind.
    time = np.arange(0.0, 30.0, 0.05)

    def rates(at: Array, states: Array) -> tuple[Array, Array]:
        pole = np.where((at > 5.0) & (at < 25.0), 3.0, -3.0)
        return pole[:, None] * states + np.exp(-((at - 6.0) ** 2))[:, None], pole[:, None, None]

    guess = np.zeros((len(time), 1))
    guess[3] = 1.0
    with pytest.raises(SimulationError, match=r"grow: 0 where it begins, 1 at 5\.95 s"):
        solve(rates, time, guess, (np.array([[-3.0]]), np.array([[-3.0]])))
    with pytest.raises(SimulationError, match="1 where it ends"):
        solve(rates, time, guess, (np.array([[-3.0]]), np.array([[3.0]])))


def test_the_inversion_of_a_linear_link_is_the_closed_form() -> None:
    found, length = plan(), 2.0 * LINK
    # Rods about their ends; the tip at L q1 + l q2 prescribes q1.
    outer = INERTIA + MASS * (LINK / 2) ** 2
    both = outer + MASS * LINK * LINK / 2
    first = outer + INERTIA + MASS * (LINK / 2) ** 2 + MASS * LINK**2 + MASS * LINK * LINK
    inertia = outer - both * LINK / length
    assert inertia < 0.0
    rate = np.sqrt(-STIFFNESS / inertia)
    assert np.sort(found.zeros.real) == pytest.approx([-rate, rate], rel=1e-6)
    step = 2e-4
    fine = np.arange(-0.3, 0.9, step)
    _, second, _ = nines(fine, 0.4)
    push = -both / length * SMALL * second / inertia
    bend = np.array([-step * np.sum(np.exp(-rate * np.abs(at - fine)) * push) / (2.0 * rate) for at in found.time])
    np.testing.assert_allclose(found.position[:, 1], bend, atol=1e-4 * np.abs(bend).max())
    target, wanted, _ = nines(found.time, 0.4)
    np.testing.assert_allclose(found.reached[:, 0], SMALL * target, atol=1e-11 * SMALL + 1e-15)
    middle = found.time[:-1] + 0.5e-3
    _, wanted, _ = nines(middle, 0.4)
    pushed = -both / length * SMALL * wanted / inertia
    bend_acceleration = rate**2 * np.interp(middle, found.time, bend) + pushed
    turning = (SMALL * wanted - LINK * bend_acceleration) / length
    torque = first * turning + both * bend_acceleration
    np.testing.assert_allclose(found.commands[:-1, 0], torque, atol=1e-3 * np.abs(torque).max())


def test_an_elastic_joint_is_fed_forward_by_the_closed_form() -> None:
    model = Model.from_toml(CARTS)
    move = vpm.TargetMotion.rest_to_rest([0.0], [0.2], 1.0)
    with pytest.raises(SimulationError, match="independently"):
        vpm.flexible_feedforward(model, move, ["load.x"])
    found = vpm.flexible_feedforward(model, move, ["load.x"], method="inertial")
    inner = slice(0, -1)
    middle = found.time[inner] + 0.5e-3
    _, second, fourth = nines(middle, 1.0)
    # Two carts: u = (m1 + m2) y'' + m1 m2 / k y''''.
    exact = 0.2 * (2.5 * second + 2.0 * 0.5 / 50.0 * fourth)
    np.testing.assert_allclose(found.commands[inner, 0], exact, atol=2e-4 * np.abs(exact).max())


def test_the_feed_forward_played_on_the_model_gives_the_target() -> None:
    found = plan()
    sim = vpm.Simulation(rods(), 1e-3, state=found.state[0], substeps=4)
    tip = [sim["tip.y"]]
    for command in found.commands[:-1]:
        sim.step(command)
        tip.append(sim["tip.y"])
    # Held commands of 1 ms miss what turns at 30 1/s by (h w)^2 / 24 of it.
    assert np.abs(np.array(tip) - found.target[:, 0]).max() < 1e-4 * SMALL
    assert found.pre_actuation > 0.0
    assert np.abs(found.commands[found.time < 0.0]).max() > 0.05 * np.abs(found.commands).max()


def played(model: Model, found: vpm.FlexibleFeedforward) -> Array:
    """The tip of the model itself under the commands alone."""
    sim = vpm.Simulation(model, found.time_step, state=found.state[0], substeps=4)
    return sim.run(vpm.FlexibleController(model, found), found.time[-1] - found.time[0])["tip.y"]


def test_a_large_motion_played_on_the_model_gives_the_target() -> None:
    move = vpm.TargetMotion.rest_to_rest([0.0], [0.4], 0.4)
    errors = []
    for step in (1e-3, 5e-4):
        found = vpm.flexible_feedforward(rods(), move, ["tip.y"], time_step=step)
        errors.append(np.abs(played(rods(), found) - found.target[1:, 0]).max())
    assert errors[0] < 1e-6
    # What is left is that commands are held: it falls with the square of the time step.
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_a_way_through_points_is_followed() -> None:
    move = vpm.TargetMotion.through([0.0, 0.3, 0.6], [[0.0], [0.3], [0.4]])
    found = vpm.flexible_feedforward(rods(), move, ["tip.y"])
    # A kink of the third derivative at the ends, where the spline begins, is followed to the order of the step.
    assert np.abs(played(rods(), found) - found.target[1:, 0]).max() < 2e-4
    series = vpm.flexible_feedforward(rods(), move, ["tip.y"], method="inertial")
    # Terms of the series below a millionth of the motion are left out.
    assert np.abs(series.reached - series.target).max() < 1e-6 * 0.4


def test_gains_are_those_of_the_riccati_equation() -> None:
    model, step = rods(), 1e-5
    allowed = {"tip.y": 1e-2, "hub.velocity": 0.5}
    found = vpm.state_feedback(model, {"hub": [0.0, 0.4]}, deviations=allowed, efforts={"motor": 0.3}, time_step=step)
    for place, angle in enumerate((0.0, 0.4)):
        near = model.linearize({"hub.position": angle})
        seen = np.array([near.C[near.outputs.index(name)] / value for name, value in allowed.items()])
        cost = solve_continuous_are(near.A, near.B, seen.T @ seen, np.array([[1.0 / 0.3**2]]))
        exact = 0.3**2 * near.B.T @ cost
        np.testing.assert_allclose(found.gains[place], exact, rtol=2e-3, atol=2e-3 * np.abs(exact).max())
        poles = np.sort_complex(np.log(found.poles[place]) / step)
        np.testing.assert_allclose(poles, np.sort_complex(np.linalg.eigvals(near.A - near.B @ exact)), rtol=5e-3)
    between = found.schedule.weights(np.array([0.1]))
    assert float(between[1] @ found.schedule.states[between[0], 0]) == pytest.approx(0.1, rel=1e-12)
    assert found.schedule.weights(np.array([9.0]))[1].tolist() == [0.0, 1.0]


def feedback() -> vpm.StateFeedback:
    return vpm.state_feedback(
        rods(),
        plan(),
        deviations={"tip.y": 1e-3, "hub.velocity": 0.1},
        efforts={"motor": 0.5},
        integrate={"tip.y": 1e-4},
        points=3,
    )


NOISE = vpm.Noise({"hub.position": 1e-5, "bend.position": 1e-4}, {"hub": 0.01, "bend": 0.01})


def test_the_observer_ends_where_a_batch_smoother_does() -> None:
    model, step, count = rods(), 1e-3, 60
    channels = list(NOISE.readings)
    observer = vpm.Observer(model, step, channels, NOISE)
    steady = observer.settled({}, {})
    observer.keep(steady)
    near = model.linearize()
    A, B = near.sampled(step)
    C = near.part(outputs=channels).C
    generator = np.random.default_rng(3)
    torque, readings = generator.normal(size=count), 1e-4 * generator.normal(size=(count, 2))
    for reading, command in zip(readings, torque, strict=True):
        last = observer.step(reading, [1e-3 * command])
    # All states at once by least squares: the first one as uncertain as the steady filter's, forces, readings.
    _, _, process = vpm.Observer(model, step, channels, NOISE)._core.linearised([0.0])
    gain = steady.gain
    prior = np.linalg.solve(np.eye(4) - gain @ C, steady.covariance)
    spread = [prior, *[process + 1e-30 * np.eye(4)] * (count - 1)]
    joint = np.zeros((4 * count, 4 * count))
    means = np.zeros(4 * count)
    for k in range(count):
        own = slice(4 * k, 4 * k + 4)
        joint[own, own] = (
            spread[0] if k == 0 else A @ joint[own.start - 4 : own.start, own.start - 4 : own.start] @ A.T + spread[k]
        )
        if k:
            before = slice(own.start - 4, own.start)
            means[own] = A @ means[before] + B[:, 0] * 1e-3 * torque[k - 1]
            joint[own, : own.start] = A @ joint[before, : own.start]
            joint[: own.start, own] = joint[own, : own.start].T
    tall = np.kron(np.eye(count), C)
    noise = np.kron(np.eye(count), np.diag([1e-10, 1e-8]))
    left = readings.ravel() - tall @ means
    smooth = means + joint @ tall.T @ cho_solve(cho_factor(tall @ joint @ tall.T + noise), left)
    np.testing.assert_allclose(last, smooth[-4:], atol=1e-4 * np.abs(smooth[-4:]).max())


def test_a_controller_holds_a_machine_that_is_not_its_model() -> None:
    wrong = rods().with_parameters({"outer.mass": 1.1 * MASS, "bend.spring.stiffness": 0.9 * STIFFNESS})
    seconds = len(plan().time) * 1e-3 + 0.4
    plain = vpm.Simulation(wrong, 1e-3, substeps=2).run(vpm.FlexibleController(rods(), plan()), seconds)
    controller = vpm.FlexibleController(rods(), plan(), feedback(), NOISE, channels=list(NOISE.readings))
    held = vpm.Simulation(wrong, 1e-3, substeps=2).run(controller, seconds)
    assert abs(plain["tip.y"][-1] - SMALL) > 0.05 * SMALL
    assert np.abs(held["tip.y"][-200:] - SMALL).max() < 0.01 * SMALL
    assert controller.time > turn().duration
    assert controller.step_times(50).shape == (50,)
    assert controller.time == pytest.approx(plan().time[0])
    assert "observer" in repr(controller)
    poses = vpm.state_feedback(
        rods(),
        {"hub": [-0.1, 0.1]},
        deviations={"tip.y": 1e-3, "hub.velocity": 0.1},
        efforts={"motor": 0.5},
        integrate={"tip.y": 1e-4},
    )
    over_poses = vpm.FlexibleController(rods(), plan(), poses, NOISE, channels=list(NOISE.readings))
    again = vpm.Simulation(wrong, 1e-3, substeps=2).run(over_poses, seconds)
    # On so short a way the gains of poses are those of the motion.
    np.testing.assert_allclose(again["tip.y"], held["tip.y"], atol=1e-3 * SMALL)


def test_an_observer_whose_steps_miss_what_the_feedback_acts_on_is_refused() -> None:
    """The spring vibrates at 481 Hz: twice a sample, which a step of a sample takes for something else."""
    stiff = Model.from_toml(RODS.replace(f"stiffness = {STIFFNESS}", "stiffness = 5e4"))
    plan = vpm.flexible_feedforward(stiff, turn(), ["tip.y"], method="quasi_static")
    allowed = {"tip.y": 1e-3, "bend.velocity": 1e-2}
    feedback = vpm.state_feedback(stiff, plan, deviations=allowed, efforts={"motor": 5.0}, points=3)
    parts = (stiff, plan, feedback, NOISE)
    with pytest.raises(SimulationError, match=r"grow by a factor of 1\.\d+ .* steps \(linearly_implicit, 1 ms\)"):
        vpm.FlexibleController(*parts, channels=list(NOISE.readings))
    controller = vpm.FlexibleController(*parts, channels=list(NOISE.readings), substeps=8)
    pushed = vpm.Simulation(stiff, 1e-3, state={"hub.position": 1e-3, "bend.position": 1e-6}, integrator="adaptive")
    run = pushed.run(controller, duration=1.5)
    assert np.abs(run["tip.y"][-100:] - SMALL).max() < 0.02 * SMALL


def test_a_feed_forward_is_a_log_for_the_servos_of_a_model() -> None:
    servo = """
[controllers.servo]
type = "pid"
actuator = "motor"
measures = "hub.position"
proportional = { value = 20.0, unit = "N m/rad" }
derivative = { value = 1.0, unit = "N m s/rad" }
"""
    held = Model.from_toml(RODS.replace("\n[[effects]]", servo + "\n[[effects]]"))
    log = plan().to_experiment(held)
    np.testing.assert_allclose(log["motor.disturbance"], plan().commands[:, 0])
    run = vpm.simulate(held, log, "closed_loop")
    assert np.abs(run["tip.y"] - plan().target[:, 0]).max() < 0.01 * SMALL
    run = vpm.simulate(rods(), plan().to_experiment(rods()))
    assert np.abs(run["tip.y"] - plan().target[:, 0]).max() < 0.01 * SMALL
    with pytest.raises(SimulationError, match="motor"):
        plan().to_experiment(Model.from_toml(RODS.replace("motor", "engine")))


def test_limits_stop_the_sum_of_errors() -> None:
    controller = vpm.FlexibleController(
        rods(), plan(), feedback(), NOISE, channels=["hub.position", "bend.position"], limits={"motor": 1e-6}
    )
    sums = []
    for _ in range(50):
        assert abs(float(controller.step([0.1, np.nan])[0])) <= 1e-6
        sums.append(controller._sums.copy())
    # The first reading is news for the second command only.
    assert np.abs(sums[0]).max() > 0.0
    np.testing.assert_array_equal(sums[0], sums[-1])


def test_a_controller_runs_at_a_fixed_rate() -> None:
    controller = vpm.FlexibleController(rods(), plan(), feedback(), NOISE, channels=["hub.position", "bend.position"])
    sim = vpm.Simulation(rods(), 1e-3)
    with Loop(1000.0) as loop:
        for _ in loop.ticks(0.02):
            sim.step(controller(sim))
    assert loop.report().wakes > 0
    assert np.isfinite(sim.state).all()


def test_results_are_stored_and_plotted(tmp_path: Path) -> None:
    for result in (plan(), feedback()):
        again = type(result).load(result.save(tmp_path / "own.npz"))
        assert again == result
        assert len(result.to_frame()) > 2
    assert "inversion" in repr(plan())
    assert plan().plot().axes
    log = Experiment.from_arrays(plan().time, {"tip.y": plan().target[:, 0]}, model=rods(), name="target")
    value, rate, _ = vpm.TargetMotion.from_log(log, ["tip.y"]).at([-1.0, 9.0])
    np.testing.assert_allclose(value[:, 0], [0.0, SMALL], atol=1e-12)
    assert not rate.any()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"output": ["tip.w"]}, "cannot be prescribed"),
        ({"output": ["tip.y", "tip.x"]}, "one output for each input"),
        ({"output": ["tip.z"]}, r"nothing moves tip\.z near"),
        ({"inputs": ["engine"]}, "engine"),
        ({"method": "magic"}, "no method"),
        ({"time_step": 0.1}, "twentieth"),
        ({"start": {"elbow": 1.0}}, "no joint"),
        ({"start": [1.0]}, "a number for each"),
        ({"pre_actuation": 1e-3}, "give at least"),
        ({"pre_actuation": -1.0}, "not negative"),
        ({"limits": {"motor": 1e-9}}, "beyond its limit"),
        ({"limits": {"engine": 1.0}}, "engine"),
        ({"limits": {"motor": np.nan}}, "positive number"),
        ({"time_step": 1e-6}, "samples"),
        ({"start": {"hub": "far"}}, "no number"),
    ],
)
def test_what_cannot_be_fed_forward_is_one_sentence(given: dict[str, object], message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        vpm.flexible_feedforward(rods(), turn(), **{"output": ["tip.y"], **given})  # type: ignore[arg-type]


def test_targets_out_of_reach_and_impossible_ones_are_refused() -> None:
    far = vpm.TargetMotion.rest_to_rest([0.0], [3.0], 0.4)
    with pytest.raises(SimulationError, match="within reach"):
        vpm.flexible_feedforward(rods(), far, ["tip.y"])
    wide = vpm.TargetMotion.rest_to_rest([0.0, 1.0], [0.1, 1.0], 0.4)
    with pytest.raises(SimulationError, match="2 columns"):
        vpm.flexible_feedforward(rods(), wide, ["tip.y"])
    for wrong in ([np.nan], [0.0, 1.0]):
        with pytest.raises(SimulationError, match="target"):
            vpm.TargetMotion.rest_to_rest([0.0], wrong, 1.0)
    with pytest.raises(SimulationError, match="positive time"):
        vpm.TargetMotion.rest_to_rest([0.0], [1.0], 0.0)
    with pytest.raises(SimulationError, match="ascend"):
        vpm.TargetMotion.through([0.0, 0.0], [[0.0], [1.0]])
    with pytest.raises(SimulationError, match="at least two"):
        vpm.TargetMotion.through([0.0], [[0.0]])


def test_machines_with_closed_loops_are_refused() -> None:
    model = Model.load(EXAMPLES / "loops" / "parallelogram.toml")
    drives = dict.fromkeys(model.actuators, 1.0)
    with pytest.raises(SimulationError, match=r"state feedback is not known .* closed loops \(wrist\)"):
        vpm.state_feedback(model, {"left_crank": [0.3]}, deviations={"left_crank.position": 0.1}, efforts=drives)
    with pytest.raises(SimulationError, match=r"feed-forward is not known .* closed loops \(wrist\)"):
        vpm.flexible_feedforward(model, turn(), ["left_crank.position"])


def test_motions_that_no_input_moves_and_deviations_that_see_nothing_are_named() -> None:
    with pytest.raises(SimulationError, match="shows in no deviation"):
        vpm.state_feedback(rods(), {"hub": [0.0]}, deviations={"bend.position": 1.0}, efforts={"motor": 1.0})
    apart = Model.from_toml(RODS.replace('parent = "inner"\nchild', 'parent = "world"\nchild'))
    with pytest.raises(SimulationError, match=r"bend.*moved by no input"):
        vpm.state_feedback(apart, {"hub": [0.0]}, deviations={"tip.y": 1.0}, efforts={"motor": 1.0})
    for given, message in (
        ({"deviations": {"tip.q": 1.0}}, "tip.q"),
        ({"efforts": {"motor": -1.0}}, "positive"),
        ({"efforts": {}}, "at least one"),
        ({"integrate": {"tip.x": 1.0, "tip.y": 1.0}}, "integrate fewer"),
    ):
        own: Any = {"deviations": {"tip.y": 1.0}, "efforts": {"motor": 1.0}, **given}
        with pytest.raises(SimulationError, match=message):
            vpm.state_feedback(rods(), {"hub": [0.0]}, **own)
    for axis, message in (({"hub": [1.0, 0.0]}, "ascend"), ({"elbow": [0.0]}, "no joint")):
        with pytest.raises(SimulationError, match=message):
            vpm.state_feedback(rods(), axis, deviations={"tip.y": 1.0}, efforts={"motor": 1.0})


def test_parts_that_do_not_go_together_are_refused() -> None:
    carts = Model.from_toml(CARTS)
    with pytest.raises(SimulationError, match="give noise"):
        vpm.FlexibleController(rods(), plan(), feedback())
    with pytest.raises(SimulationError, match="same model"):
        vpm.FlexibleController(Model.from_toml(RODS.replace("motor", "engine")), plan())
    with pytest.raises(SimulationError, match="unknown"):
        vpm.FlexibleController(rods(), plan(), limits={"engine": 1.0})
    other = vpm.state_feedback(carts, {"way": [0.0]}, deviations={"load.x": 1.0}, efforts={"motor": 1.0})
    with pytest.raises(SimulationError, match="feedback is of a machine"):
        vpm.FlexibleController(rods(), plan(), other, NOISE)
    slow = vpm.state_feedback(
        rods(), plan(), deviations={"tip.y": 1.0}, efforts={"motor": 1.0}, time_step=2e-3, points=2
    )
    with pytest.raises(SimulationError, match="same time step"):
        vpm.FlexibleController(rods(), plan(), slow, NOISE)
    late = rods().with_effect("input_delay", "motor", time=2e-3)
    with pytest.raises((SimulationError, CoreError), match="delay"):
        vpm.FlexibleController(late, plan(), feedback(), NOISE)
