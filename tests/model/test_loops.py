"""Closed loops of model files: closed forms, `vpm.linkages`, null spaces, stiff bushings in their place, refusals."""

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from command_line import ran
from model_texts import two_links
from places import EXAMPLES
from quotients import quotient
from vpm import linkages
from vpm.errors import CoreError, ModelError, VpmError
from vpm.experiment import Experiment
from vpm.identify import identify
from vpm.model import Model
from vpm.model.loops import closure
from vpm.numbers import Array
from vpm.scenario import Scenario
from vpm.simulate import Setup, simulate

G = 9.81


def load(name: str) -> Model:
    return Model.load(EXAMPLES / "loops" / f"{name}.toml")


@pytest.fixture(scope="module")
def parallelogram() -> Model:
    return load("parallelogram")


def run(
    model: Model, state: ArrayLike, steps: int, dt: float, integrator: str = "rk4", inputs: Array | None = None
) -> tuple[Array, Array, Array]:
    inputs = np.zeros((steps, len(model.inputs))) if inputs is None else inputs
    return model.core.simulate(model.theta, state, inputs, dt, 1, integrator, [])


def gaps(model: Model, states: Iterable[Array]) -> tuple[float, float]:
    n = len(model.coordinates)
    found = [(model.loops.at(x[:n], x[n : 2 * n]), x[n : 2 * n]) for x in states]
    worst = max(float(np.abs(s.gap).max()) for s, _ in found)
    return worst, max(float(np.abs(s.jacobian @ v).max()) for s, v in found)


def null_space_accelerations(model: Model, q: Array, v: Array) -> Array:
    """Accelerations by a null space in numpy: a witness that shares J and the open tree's terms alone."""
    state = model.loops.at(q, v)
    _, sizes, rows = np.linalg.svd(state.jacobian)
    N = rows[int((sizes > 1e-9 * sizes.max()).sum()) :].T
    particular = np.linalg.lstsq(state.jacobian, -state.drift, rcond=1e-9)[0]
    M, h = model.mass_matrix(q), model.inverse_dynamics(q, v, np.zeros_like(q))
    found: Array = particular + N @ np.linalg.solve(N.T @ M @ N, -N.T @ (h + M @ particular))
    return found


# ---- a parallelogram: one degree of freedom in closed form ----------------------------------------------------------


def test_the_assembly_of_a_file_is_worked_out_once(parallelogram: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    first = parallelogram.loops.assembled()
    monkeypatch.setattr(closure, "assembled", lambda *_: pytest.fail("it was worked out again"))
    again = parallelogram.loops.assembled()
    np.testing.assert_array_equal(again, first)
    again[:] = 0.0
    np.testing.assert_array_equal(parallelogram.loops.assembled(), first)
    other = parallelogram.with_parameters({"left.mass": 2.0})
    assert other.loops is not parallelogram.loops


def test_a_parallelogram_moves_as_its_closed_form(parallelogram: Model) -> None:
    for angle, rate in ((0.4, 0.0), (1.2, 2.0), (2.2, -3.0)):
        x = parallelogram.state({"left_crank.position": angle, "left_crank.velocity": rate})
        assert x[:3] == pytest.approx([angle, -angle, angle], abs=1e-11)
        assert x[3:] == pytest.approx([rate, -rate, rate], abs=1e-11)
        a = parallelogram.forward_dynamics(x[:3], x[3:], [0.5, 0.0, 0.0])
        # 2 (I + m c^2) + m_coupler l^2 against the weights of cranks and coupler, friction and motor.
        expected = (0.9 * G * math.cos(angle) - 0.05 * rate + 0.5) / 0.24
        assert a == pytest.approx([expected, -expected, expected], rel=1e-10)


def test_the_loop_stays_closed_and_energy_stays(parallelogram: Model) -> None:
    model = parallelogram.with_parameters({"left_crank.friction.viscous": 0.0})
    x = model.state({"left_crank.position": 0.5})
    _, states, _ = run(model, x, 10_000, 1e-3)
    gap, rate = gaps(model, states[::100])
    assert gap < 1e-12
    assert rate < 1e-11
    energy = np.array([sum(model.energy(s[:3], s[3:])) for s in states[::100]])
    assert np.ptp(energy) < 1e-6 * 0.9 * G


@pytest.mark.nightly
def test_nothing_drifts_over_a_million_steps(parallelogram: Model) -> None:
    model = parallelogram.with_parameters({"left_crank.friction.viscous": 0.0})
    from vpm.stepping import Simulation

    simulation = Simulation(model, 1e-3, integrator="rk4", state={"left_crank.position": 0.5}, compiled=True)
    first = sum(model.energy(simulation.state[:3], simulation.state[3:]))
    for _ in range(1000):
        for _ in range(1000):
            simulation.step([0.0])
        gap, rate = gaps(model, [simulation.state])
        assert gap < 1e-12
        assert rate < 1e-10
    # The classical method of order 4 damps; it may lose what its own error makes of a million steps.
    assert abs(sum(model.energy(simulation.state[:3], simulation.state[3:])) - first) < 1e-3 * 0.9 * G


@pytest.mark.parametrize(
    "integrator", ["rk4", "semi_implicit", "linearly_implicit", "rosenbrock", "adaptive(1e-9)", "guarded"]
)
def test_all_integrators_agree(parallelogram: Model, integrator: str) -> None:
    x = parallelogram.state({"left_crank.position": 0.5})
    _, states, _ = run(parallelogram, x, 1001, 1e-3, integrator)
    _, fine, _ = run(parallelogram, x, 2001, 5e-4, "rk4")
    tolerance = {"semi_implicit": 5e-2, "linearly_implicit": 1e-4, "guarded": 1e-6}.get(integrator, 1e-8)
    assert states[-1] == pytest.approx(fine[-1], abs=tolerance)
    assert gaps(parallelogram, states[::50])[0] < 1e-12


def test_redundant_equations_are_told(parallelogram: Model) -> None:
    assert parallelogram.loops.summary() == (
        "closed loops wrist: 5 equations, of which 2 are independent (3 of them are redundant), so that 1 of 3 "
        "coordinates are free"
    )


def test_its_loop_forces_hold_what_they_carry(parallelogram: Model) -> None:
    """Free body of the right crank: its pin moves it, about its axis."""
    x = parallelogram.state({"left_crank.position": 0.8, "left_crank.velocity": 1.5})
    outputs, _, _ = run(parallelogram, x, 1, 1e-3)
    row = dict(zip(parallelogram.output_channels, outputs[0], strict=True))
    angle, acceleration = 0.8, row["right_crank.acceleration"]
    # The wrench is that on the coupler, whose axes are those of the world.
    fx, fz = -row["wrist.fx"], -row["wrist.fz"]
    moment = 0.3 * (-math.sin(angle) * fx - math.cos(angle) * fz) + 0.15 * math.cos(angle) * G
    assert 0.03 * acceleration == pytest.approx(moment, rel=1e-9)
    assert abs(row["wrist.my"]) < 1e-12


def test_a_stiff_bushing_comes_to_the_loop(parallelogram: Model) -> None:
    """Stiff springs in the place of the loop differ from it by what they yield, which falls with their stiffness."""
    away = []
    loop = {"left_crank.position": 0.5}
    _, states, _ = run(parallelogram, parallelogram.state(loop), 401, 1e-3, "rosenbrock")
    for stiffness in (1e5, 1e7):
        content = parallelogram.to_dict()
        ends = content.pop("loops")["wrist"]
        content["bushings"] = {
            "wrist": {"a": ends["a"], "b": ends["b"], "stiffness": [0.0, 0.0, 0.0, stiffness, 0.0, stiffness]}
        }
        soft = Model.from_dict(content)
        x = soft.state(dict(zip([f"{n}.position" for n in soft.joints], (0.5, -0.5, 0.5), strict=True)))
        _, bushed, _ = run(soft, x, 401, 1e-3, "rosenbrock")
        away.append(np.abs(bushed[:, 0] - states[:, 0]).max())
    assert away[1] < 1e-5
    assert away[1] < 0.05 * away[0]


def test_mujoco_accelerates_the_same(parallelogram: Model) -> None:
    """Its constraints are soft: with the hardest impedance they let go a ten thousandth of what loops hold."""
    mujoco = pytest.importorskip("mujoco")
    hinge, hard = 'type="hinge" axis="0 1 0"', 'solimp="0.9999 0.9999 0.001"'
    crank = '<inertial pos="0.15 0 0" mass="1" diaginertia="1e-4 7.5e-3 7.5e-3"/>'
    spec = f"""<mujoco><option gravity="0 0 -9.81"/><worldbody>
    <body name="left"><joint {hinge}/>{crank}
      <body name="coupler" pos="0.3 0 0"><joint {hinge}/>
        <inertial pos="0.25 0 0" mass="2" diaginertia="1e-4 0.042 0.042"/></body></body>
    <body name="right" pos="0.5 0 0"><joint {hinge}/>{crank}</body></worldbody>
    <equality><connect body1="coupler" body2="right" anchor="0.5 0 0" {hard}/></equality></mujoco>"""
    machine = mujoco.MjModel.from_xml_string(spec)
    data = mujoco.MjData(machine)
    x = parallelogram.state({"left_crank.position": 0.7, "left_crank.velocity": 2.0})
    data.qpos[:], data.qvel[:] = x[:3], x[3:]
    data.qfrc_applied[0] = -0.05 * 2.0  # friction of the left crank
    mujoco.mj_forward(machine, data)
    ours = parallelogram.forward_dynamics(x[:3], x[3:], np.zeros(3))
    assert data.qacc == pytest.approx(ours, rel=1e-3)


def test_a_linear_model_in_independent_coordinates(parallelogram: Model) -> None:
    linear = parallelogram.linearize({"left_crank.position": math.pi / 2})
    assert linear.states == ("left_crank.position", "left_crank.velocity")
    # Hanging down: J s^2 + d s + 0.9 g = 0.
    expected = np.roots([0.24, 0.05, 0.9 * G])
    assert np.sort_complex(linear.poles()) == pytest.approx(np.sort_complex(expected), rel=1e-9)
    assert linear.B[1, 0] == pytest.approx(1.0 / 0.24, rel=1e-9)


def test_rest_and_efforts_of_driven_joints(parallelogram: Model) -> None:
    q, efforts = parallelogram.loops.rest({"left_crank": 0.3})
    assert q == pytest.approx([0.3, -0.3, 0.3], abs=1e-11)
    assert efforts["left_crank"] == pytest.approx(-0.9 * G * math.cos(0.3), rel=1e-10)
    coordinates, holding = parallelogram.equilibrium([0.3, -0.3, 0.3])
    assert coordinates == pytest.approx(q)
    assert holding == pytest.approx([efforts["left_crank"], 0.0, 0.0])
    v = parallelogram.loops.velocities(q, {"left_crank": 2.0})
    a = parallelogram.loops.accelerations(q, v, {"left_crank": 3.0})
    found = parallelogram.loops.efforts(q, v, a)
    assert found["left_crank"] == pytest.approx(0.24 * 3.0 + 0.05 * 2.0 - 0.9 * G * math.cos(0.3), rel=1e-10)


def test_a_singular_configuration_is_named_where_a_run_comes_to_it(parallelogram: Model) -> None:
    """Flat, the parallelogram can become an antiparallelogram."""
    x = parallelogram.state({"left_crank.position": 0.0, "elbow.position": 0.0})
    with pytest.raises(CoreError, match=r"singular configuration|velocities"):
        run(parallelogram, x + np.array([0, 0, 0, 1.0, 0, 0]), 5, 1e-3)
    x = np.array([0.01, -0.01, 0.01, -1.0, 1.0, -1.0])
    with pytest.raises(
        CoreError, match=r"closed loops .`wrist`. come into a singular configuration .only 1 of their 2"
    ):
        run(parallelogram, x, 301, 1e-4)


# ---- refusals -------------------------------------------------------------------------------------------------------


def test_what_cannot_close_says_how_far(parallelogram: Model) -> None:
    content = parallelogram.to_dict()
    content["loops"]["wrist"]["a"]["point"] = [1.5, 0.0, 0.0]
    long = Model.from_dict(content)
    with pytest.raises(ModelError, match=r"do not close: loop wrist stays open by 0\.4\d* m"):
        long.state()
    with pytest.raises(ModelError, match=r"left_crank = 0.3, elbow = 2 held: loop wrist stays open"):
        parallelogram.state({"left_crank.position": 0.3, "elbow.position": 2.0})


def test_axes_that_are_out_of_line_say_by_which_angle(parallelogram: Model) -> None:
    """A frame turned about its own x axis, which lies across the joint's: no joint of the plane turns it back."""
    content = parallelogram.to_dict()
    content["loops"]["wrist"]["b"]["rotation"] = [0.3, 0.0, 0.0]
    with pytest.raises(ModelError, match=r"loop wrist stays open by 0\.3 rad;"):
        Model.from_dict(content).loops.assembled({"left_crank": 0.3})


def test_open_states_and_torn_velocities_are_refused(parallelogram: Model) -> None:
    with pytest.raises(CoreError, match="leaves loop `wrist` open"):
        run(parallelogram, [0.5, -0.4, 0.5, 0.0, 0.0, 0.0], 3, 1e-3)
    with pytest.raises(CoreError, match="tear loop `wrist` apart"):
        run(parallelogram, [0.5, -0.5, 0.5, 1.0, 0.0, 0.0], 3, 1e-3)
    with pytest.raises(ModelError, match="do not let"):
        parallelogram.state({"left_crank.position": 0.3, "left_crank.velocity": 1.0, "right_crank.velocity": -1.0})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"axis": None}, "axis"),
        ({"type": "spherical"}, "belongs to type"),
        ({"b": {"parent": "coupler"}}, "both ends"),
        ({"start": {"elbo": 1.0}}, "no joint"),
        ({"typo": 1}, "not a known key"),
        ({"type": "prismatic"}, "has the type"),
    ],
)
def test_a_wrong_loop_is_one_sentence(parallelogram: Model, change: dict[str, object], message: str) -> None:
    content = parallelogram.to_dict()
    content["loops"]["wrist"] = {k: v for k, v in {**content["loops"]["wrist"], **change}.items() if v is not None}
    with pytest.raises(ModelError, match=message) as caught:
        Model.from_dict(content)
    assert str(caught.value).count("\n") == 0


def test_what_is_not_known_of_loops_is_refused(parallelogram: Model) -> None:
    zero = np.zeros((5, 3))
    with pytest.raises(CoreError, match="additive"):
        run(parallelogram, parallelogram.state(), 3, 1e-3, "additive")
    with pytest.raises(CoreError, match="follow a log"):
        parallelogram.core.simulate_prescribed(parallelogram.theta, zero, zero, zero, 1e-3, 1, "rk4", [], [])
    with pytest.raises(ModelError, match="closed loops"):
        parallelogram.natural_frequencies([0.0, 0.0, 0.0])
    with pytest.raises(ModelError, match="at rest only"):
        parallelogram.linearize({"left_crank.position": 0.5, "left_crank.velocity": 1.0})


# ---- sensitivities, machine code, writing ---------------------------------------------------------------------------


def test_derivatives_by_parameters_are_those_of_differences(parallelogram: Model) -> None:
    index = parallelogram.index("left_crank.friction.viscous")
    x = parallelogram.state({"left_crank.position": 0.5})
    inputs = np.zeros((301, 1))

    def outputs(theta: Array, by: Sequence[int] = ()) -> tuple[Array, Array, Array]:
        return parallelogram.core.simulate(theta, x, inputs, 1e-3, 1, "rk4", list(by))

    _, _, jacobian = outputs(parallelogram.theta, [index])
    difference = quotient(lambda theta: outputs(theta)[0], parallelogram.theta, index, 1e-5)
    assert jacobian[:, :, 0] == pytest.approx(difference, abs=1e-6 * np.abs(difference).max())


def test_machine_code_steps_as_the_laws_do(parallelogram: Model) -> None:
    from vpm.stepping import Simulation

    for integrator in ("rk4", "linearly_implicit"):
        pair = [
            Simulation(
                parallelogram, 1e-3, integrator=integrator, state={"left_crank.position": 0.5}, compiled=compiled
            )
            for compiled in (False, True)
        ]
        assert pair[1].not_compiled is None
        for _ in range(200):
            for simulation in pair:
                simulation.step([0.1])
        assert pair[0].state == pytest.approx(pair[1].state, abs=1e-9)
        assert gaps(parallelogram, [pair[1].state])[0] < 1e-12


def test_a_scenario_closes_the_loops_of_its_start(tmp_path: Path) -> None:
    path = tmp_path / "swing.toml"
    model = EXAMPLES / "loops" / "parallelogram.toml"
    text = 'scenario = "swing"\nduration = 0.1\ntime_step = 1e-3\n[initial]\n"left_crank.position" = 0.5\n'
    path.write_text(f"{text}[[runs]]\nname = 'loop'\nmodel = '{model}'\n")
    result = Scenario.load(path).run()
    assert not result.failures
    final = {row.channel: row.final for row in result.extremes("loop")}
    assert final["left_crank.position"] > 0.6
    assert final["elbow.position"] == pytest.approx(-final["left_crank.position"], abs=1e-11)


def test_a_model_with_loops_is_written_and_read(parallelogram: Model) -> None:
    again = Model.from_toml(parallelogram.to_toml())
    assert again == parallelogram
    assert tuple(again.loops) == ("wrist",)


# ---- KARL and the leg of HyQ against vpm.linkages -------------------------------------------------------------------


def test_karl_agrees_with_its_linkage() -> None:
    model, karl = load("karl"), linkages.load(EXAMPLES / "karl" / "karl.toml")
    assert isinstance(karl, linkages.Karl)
    for strokes in ((0.20, 0.18), (0.22, 0.2), (0.24, 0.22)):
        q = model.loops.assembled({"stroke1": strokes[0], "stroke2": strokes[1]})
        poses = karl.direct(strokes)
        angles = q[[model.coordinates.index(name) for name in ("q1", "q2")]]
        turn = np.abs((poses.angles - angles + np.pi) % (2.0 * np.pi) - np.pi).max(axis=1)
        nearest = int(np.argmin(turn))
        assert turn[nearest] < 1e-10
        T = model.loops.transmission(q, ["stroke1", "stroke2"])
        forces = np.array([300.0, 600.0])
        # tau = Lambda^-T F of the joints that the strokes move.
        levers = T[[model.coordinates.index(name) for name in ("q1", "q2")]]
        torques = np.linalg.solve(levers.T, forces)
        expected = np.atleast_2d(karl.torques(poses.angles, poses.strokes, forces))[nearest]
        assert torques == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize(
    ("stroke", "held", "guess", "published"),
    [
        ("stroke1", {"stroke2": 0.18}, {}, (0.2534, 0.1720)),
        ("stroke1", {"stroke2": 0.18}, {"stroke1": -0.24, "swing1": -0.5}, (-0.2797, -0.1983)),
        ("stroke2", {"stroke1": 0.2}, {}, (0.2481, 0.1302)),
        ("stroke2", {"stroke1": 0.2}, {"stroke2": 0.45, "swing2": 3.1}, (0.3848, 0.5026)),
    ],
)
def test_karl_loses_control_at_the_published_strokes(
    stroke: str, held: dict[str, float], guess: dict[str, float], published: tuple[float, ...]
) -> None:
    """The eight singular strokes of D'Imperio 2016, section 2.4.1: as printed, and those of the closed form."""
    found = [place.value for place in load("karl").loops.singularities(stroke, held, guess)]
    assert sorted(found) == pytest.approx(sorted(published), abs=6e-5)
    karl = linkages.load(EXAMPLES / "karl" / "karl.toml")
    assert isinstance(karl, linkages.Karl)
    exact = np.asarray(karl.singularities().strokes)
    assert all(np.abs(exact - value).min() < 1e-10 for value in found)


def test_the_leg_agrees_with_its_three_derivations() -> None:
    model, leg = load("hyq_leg"), linkages.Leg.hyq("plausible")
    random = np.random.default_rng(3)
    L1, L2 = leg.parameters.upper.length, leg.parameters.lower.length
    for _ in range(5):
        q1, q2 = np.radians(random.uniform(-20, 40)), np.radians(random.uniform(-110, -50))
        v1, v2, a1, a2 = random.normal(size=4) * (3.0, 3.0, 10.0, 10.0)
        # Height of the hip with the foot on the ground, and its rates.
        slope = np.array([-L1 * np.sin(q1) - L2 * np.sin(q1 + q2), -L2 * np.sin(q1 + q2)])
        height = L1 * np.cos(q1) + L2 * np.cos(q1 + q2)
        lift = slope @ (a1, a2) - L1 * np.cos(q1) * v1**2 - L2 * np.cos(q1 + q2) * (v1 + v2) ** 2
        q = model.loops.assembled({"height": height, "hip": q1, "knee": q2})
        strokes = q[[model.coordinates.index(name) for name in ("hip_length", "knee_length")]]
        assert strokes == pytest.approx(leg.strokes([q1, q2]), rel=1e-10)
        levers = model.loops.transmission(q, ["height", "hip", "knee"])
        assert levers[model.coordinates.index("hip_length"), 1] == pytest.approx(leg.levers([q1, q2])[0], rel=1e-10)
        v = model.loops.velocities(q, {"height": slope @ (v1, v2), "hip": v1, "knee": v2})
        a = model.loops.accelerations(q, v, {"height": lift, "hip": a1, "knee": a2})
        efforts = model.loops.efforts(q, v, a, joints=("height", "hip", "knee"))
        torques = np.array([efforts["hip"], efforts["knee"]]) + slope * efforts["height"]
        assert torques == pytest.approx(leg.torques([q1, q2], (v1, v2), (a1, a2)), rel=1e-10, abs=1e-10)


# ---- a delta robot, random machines, beams --------------------------------------------------------------------------


def test_a_delta_robot_only_translates() -> None:
    model = load("delta")
    angles = {"motor1": 0.3, "motor2": 0.5, "motor3": 0.1}
    q = model.loops.assembled(angles)
    assert model.loops.at(q).rank == 18
    n = model.coordinates
    place = q[[n.index(f"move_{k}") for k in "xyz"]]
    turned = q[[n.index(name) for name in n if name.startswith("move_r")]]
    assert turned == pytest.approx([0.0, 0.0, 0.0], abs=1e-10)
    # Inverse kinematics in closed form: a rod's length from each elbow, moved inward by the platform's radius.
    for k, angle in enumerate(angles.values()):
        way = 2.0 * math.pi * k / 3.0
        out = np.array([math.cos(way), math.sin(way), 0.0])
        elbow = (0.2 + 0.25 * math.cos(angle) - 0.05) * out - np.array([0.0, 0.0, 0.25 * math.sin(angle)])
        assert np.linalg.norm(place - elbow) == pytest.approx(0.5, rel=1e-11)
    assert set(model.loops.independent(q)) == set(angles)
    v = model.loops.velocities(q, {"motor1": 1.0, "motor2": -2.0, "motor3": 0.5})
    a = model.forward_dynamics(q, v, np.zeros(len(q)))
    assert a == pytest.approx(null_space_accelerations(model, q, v), rel=1e-8, abs=1e-8)
    moved = model.loops.accelerations(q, v, {"motor1": 3.0, "motor2": 1.0, "motor3": -2.0})
    efforts = model.loops.efforts(q, v, moved)
    whole = np.zeros(len(q))
    for name, effort in efforts.items():
        whole[n.index(name)] = effort
    assert model.forward_dynamics(q, v, whole) == pytest.approx(moved, rel=1e-8, abs=1e-8)
    x = np.concatenate([q, np.zeros(len(q))])
    _, states, _ = run(model, x, 101, 2e-3)
    assert gaps(model, states[::20])[0] < 1e-12


def random_machine(seed: int) -> Model:
    """A chain of random joints in space, whose tip is tied to the world by a random loop through another chain."""
    random = np.random.default_rng(seed)

    def vector(size: float) -> list[float]:
        return [float(x) for x in size * random.normal(size=3)]

    def unit() -> list[float]:
        way = random.normal(size=3)
        return [float(x) for x in way / np.linalg.norm(way)]

    content: dict[str, Any] = {"name": "random", "gravity": vector(5.0), "bodies": {}, "joints": {}}
    last = {"a": "world", "b": "world"}
    for chain, count in (("a", 5), ("b", 4)):
        for k in range(count):
            name = f"{chain}{k}"
            inertia = (0.01 * (1.0 + random.random(3))).tolist()
            content["bodies"][name] = {
                "mass": 1.0 + random.random(),
                "center_of_mass": vector(0.1),
                "inertia": [*inertia, 0, 0, 0],
            }
            content["joints"][f"j{name}"] = {
                "type": "revolute" if random.random() < 0.8 else "prismatic",
                "parent": last[chain],
                "child": name,
                "translation": vector(0.2),
                "rotation": vector(1.0),
                "axis": unit(),
            }
            last[chain] = name
    closed: dict[str, Any] = {
        "type": ("spherical", "revolute", "rigid")[seed % 3],
        "a": {"parent": last["a"]},
        "b": {"parent": last["b"]},
    }
    free = Model.from_dict(content)
    # The ends are put where they meet at zero, so that the machine is assembled there.
    content["markers"] = {end: {"parent": last[end]} for end in "ab"}
    marked = Model.from_dict(content)
    zero = np.zeros(len(free.coordinates))
    to_a, to_b = (marked.forward_kinematics(end, zero) for end in "ab")
    there = np.linalg.inv(to_b) @ to_a
    yaw, pitch, roll = (
        math.atan2(there[1, 0], there[0, 0]),
        -math.asin(there[2, 0]),
        math.atan2(there[2, 1], there[2, 2]),
    )
    closed["b"] |= {"point": there[:3, 3].tolist(), "rotation": [roll, pitch, yaw]}
    if closed["type"] == "revolute":
        closed["axis"] = vector(1.0)
    content["loops"] = {"tie": closed}
    return Model.from_dict(content)


@pytest.mark.parametrize("seed", range(9))
def test_random_machines_agree_with_a_null_space(seed: int) -> None:
    model = random_machine(seed)
    assert np.abs(model.loops.at(np.zeros(9)).gap).max() < 1e-12
    names = model.loops.independent(np.zeros(9))
    q = model.loops.assembled(dict.fromkeys(names[:2], 0.05))
    v = model.loops.velocities(q, dict.fromkeys(names[:2], 0.5))
    expected = null_space_accelerations(model, q, v)
    found = model.forward_dynamics(q, v, np.zeros(9))
    assert found == pytest.approx(expected, rel=1e-7, abs=1e-7 * np.abs(expected).max())
    # The drift is the derivative of J along the motion.
    h = 1e-6
    ends = [model.loops.at(q + sign * h * v).jacobian @ v for sign in (1.0, -1.0)]
    assert model.loops.at(q, v).drift == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-6, abs=1e-7)
    slopes = [model.loops.at(q + sign * h * v).gap for sign in (1.0, -1.0)]
    assert (slopes[0] - slopes[1]) / (2 * h) == pytest.approx(model.loops.at(q).jacobian @ v, abs=1e-8)
    _, states, _ = run(model, np.concatenate([q, v]), 201, 1e-3)
    assert gaps(model, states[::50])[0] < 1e-12
    energies = [sum(model.energy(s[:9], s[9:])) for s in (states[0], states[-1])]
    assert energies[1] == pytest.approx(energies[0], abs=1e-5 * max(1.0, abs(energies[0])))


def floating_rod(t: Array, w: float) -> Array:
    """Deflection (m) of the middle of the rod in its chord frame, by its first and third mode, worked out here.

    ``eta'' + (omega_n^2 - phi'^2 + N k^2 / rho A) eta = -(2 / L) int a_n sin(k x) dx``, k = n pi / L, with the normal
    acceleration a_n of a rigid rod and the mean N of its axial force (I. Viscomi, R. Ayre, J. Eng. Industry 93, 1971).
    """
    r, L, density, slider = 0.1, 0.4, 7850.0 * math.pi * 0.003**2, 0.2
    rigidity = 206e9 * math.pi * 0.003**4 / 4.0

    def rates(time: float, y: Array) -> list[float]:
        th = w * time
        phi = -math.asin(r / L * math.sin(th))
        turn = -r / L * w * math.cos(th) / math.cos(phi)
        change = (r / L * w**2 * math.sin(th) + math.sin(phi) * turn**2) / math.cos(phi)
        ax, ay = -r * w**2 * math.cos(th), -r * w**2 * math.sin(th)
        along, across = ax * math.cos(phi) + ay * math.sin(phi), -ax * math.sin(phi) + ay * math.cos(phi)
        pull = ax - L * (math.cos(phi) * turn**2 + math.sin(phi) * change)
        axial = -slider * pull / math.cos(phi) - density * (0.5 * L * along - L**2 * turn**2 / 3.0)
        found = []
        for place, n in enumerate((1, 3)):
            k = n * math.pi / L
            square = (rigidity * k**4 + axial * k**2) / density - turn**2
            found += [y[2 * place + 1], -square * y[2 * place] - 4.0 / (n * math.pi) * across - 2.0 / k * change]
        return found

    y = solve_ivp(rates, (0.0, float(t[-1])), np.zeros(4), "DOP853", t, rtol=1e-9, atol=1e-13).y
    middle: Array = y[0] - y[2]
    return middle


def test_a_flexible_rod_in_a_slider_crank() -> None:
    model = load("slider_crank")
    r, L, w, dt = 0.1, 0.4, 30.0, 2e-4
    x = model.state({"crank.position": 0.0, "crank.velocity": w})
    outputs, states, _ = run(model, x, 801, dt, "rosenbrock")
    n = len(model.coordinates)
    t: Array = dt * np.arange(801.0)
    assert gaps(model, states[::100])[0] < 1e-12
    energy = [sum(model.energy(s[:n], s[n : 2 * n])) for s in states[::100]]
    assert np.ptp(energy) < 1e-7 * energy[0]
    # The flywheel keeps its speed within 1e-4, and the rod its length but for what it bends.
    guide = r * np.cos(w * t) + np.sqrt(L**2 - (r * np.sin(w * t)) ** 2)
    assert states[:, 2] == pytest.approx(guide, abs=1e-4)
    crank = states[:, 0]
    pin = np.stack([r * np.cos(crank), -r * np.sin(crank)])
    chord = np.stack([states[:, 2], np.zeros_like(t)]) - pin
    middle = np.stack([outputs[:, model.output_channels.index(f"middle.{axis}")] for axis in "xz"]) - pin
    # Away from the chord, downward in the world as z is up and the crank turns it down first.
    away = -(chord[0] * middle[1] - chord[1] * middle[0]) / np.linalg.norm(chord, axis=0)
    expected = floating_rod(t, w)
    assert np.abs(expected).max() > 2.5e-4
    assert away == pytest.approx(expected, abs=0.03 * np.abs(expected).max())


def test_a_flexible_rod_sags_and_vibrates_between_its_pins() -> None:
    """At a dead centre nothing moves the slider: the rod is a beam on two pins, in closed form."""
    content = load("slider_crank").to_dict() | {"gravity": [0.0, 0.0, -G]}
    model = Model.from_dict(content)
    load_per_length, rigidity, L = 7850.0 * math.pi * 0.003**2, 206e9 * math.pi * 0.003**4 / 4.0, 0.4
    q, efforts = model.loops.rest({"crank": 0.0})
    sag = 5.0 * load_per_length * G * L**4 / (384.0 * rigidity)
    assert -model.forward_kinematics("middle", q)[2, 3] == pytest.approx(sag, rel=2e-3)
    # Half of the rod hangs on the crank, 0.1 m out, and the pin.
    assert efforts["crank"] == pytest.approx(-(0.5 * load_per_length * L + 1e-3) * G * 0.1, rel=1e-3)
    linear = model.linearize({"crank.position": 0.0})
    assert "rod.bending_y.0.position" in linear.states
    expected = (math.pi / L) ** 2 * math.sqrt(rigidity / load_per_length) / (2.0 * math.pi)
    assert np.abs(linear.frequencies() / expected - 1.0).min() < 2e-3


def test_a_fit_along_a_log_finds_a_parameter(parallelogram: Model) -> None:
    t = 2e-3 * np.arange(1001)
    # At rest for a while, so that the log tells the first velocity exactly.
    command = np.where(t < 0.3, 0.0, 1.5 * np.sin(7.0 * (t - 0.3)) + np.sin(2.3 * (t - 0.3)))
    x = parallelogram.state({"left_crank.position": 0.5 * math.pi})
    outputs, _, _ = run(parallelogram, x, 1001, 2e-3, inputs=command[:, None])
    log = Experiment.from_arrays(
        t,
        {
            "motor.command": command,
            "left_crank.position": outputs[:, parallelogram.output_channels.index("left_crank.position")],
        },
    )
    wrong = parallelogram.with_parameters({"left_crank.friction.viscous": 0.2})
    fit = identify(wrong, log, mode="free_run", setup=Setup("rk4"))
    assert fit.model.parameters["left_crank.friction.viscous"].value == pytest.approx(0.05, rel=1e-3)
    with pytest.raises(VpmError, match=r"closed loops|elbow"):
        identify(wrong, log)


LINK = "mass = 1.0\ninertia = [0.01, 0.01, 0.01, 0, 0, 0]"
#: Two links whose end is pinned to a point that they reach with either elbow; `start` is filled in.
ELBOW = (
    two_links(LINK, LINK, "[0.4, 0, 0]")
    + """
[loops.pin]
type = "revolute"
axis = [0, 0, 1]
a = { parent = "lower", point = [0.3, 0, 0] }
b = { parent = "world", point = [0.5, 0, 0] }
start = { START }
"""
)


#: Its angle, by the law of cosines.
BEND = math.acos((0.4**2 + 0.3**2 - 0.5**2) / (-2.0 * 0.4 * 0.3))


def elbow(start: str) -> Model:
    return Model.from_toml(ELBOW.replace("START", start))


@pytest.mark.parametrize(("start", "sign"), [("elbow = 0.4", 1.0), ("elbow = -0.4", -1.0), ("shoulder = -0.2", 1.0)])
def test_a_start_off_the_stretched_pose_chooses_the_assembly(start: str, sign: float) -> None:
    assert elbow(start).loops.assembled()[1] == pytest.approx(sign * BEND, abs=1e-9)


@pytest.mark.parametrize("start", ["shoulder = 0.3, elbow = 0.1229", "shoulder = 1.09, elbow = 0.12", "elbow = 0.01"])
def test_a_start_as_near_to_the_mirrored_assembly_is_refused(start: str) -> None:
    """On the line between both, beyond it, and next to the stretched pose, where a digit more would turn it over."""
    with pytest.raises(ModelError, match=r"close with shoulder = .*, and as near to their start with") as told:
        elbow(start).loops.assembled()
    found = [float(word) for word in re.findall(r"elbow = (\S+) rad", str(told.value))]
    assert sorted(found) == pytest.approx([-BEND, BEND], rel=1e-3)
    assert "\n" not in str(told.value)


def test_every_start_leads_to_the_nearest_assembly_or_is_refused() -> None:
    both = np.array([elbow(f"elbow = {sign * 0.8}").loops.assembled() for sign in (1.0, -1.0)])
    refused = 0
    for shoulder, bend in np.random.default_rng(0).uniform(-1.5, 1.5, (60, 2)).tolist():
        model = elbow(f"shoulder = {shoulder}, elbow = {bend}")
        away = np.linalg.norm(both - [shoulder, bend], axis=1)
        try:
            q = model.loops.assembled()
        except ModelError:
            refused += 1
            continue
        np.testing.assert_allclose(q, both[np.argmin(away)], atol=1e-9)
    assert refused < 15


def test_a_stretched_start_does_not_say_which_way_to_bend() -> None:
    with pytest.raises(ModelError, match="give a start nearer to an assembly"):
        elbow("").loops.assembled()


def test_what_is_held_or_guessed_in_full_decides_between_assemblies() -> None:
    model = elbow("")
    guess = {"shoulder": 0.3, "elbow": -1.0}
    assert model.loops.assembled(guess=guess)[1] == pytest.approx(-BEND, abs=1e-9)
    assert model.loops.assembled({"elbow": BEND}, {"shoulder": -0.6})[1] == BEND


@pytest.mark.parametrize("name", ["delta", "hyq_leg", "karl", "parallelogram", "slider_crank"])
def test_examples_say_which_assembly_they_take(name: str) -> None:
    """Also where a link bends, whose frequencies with all joints locked nobody can tell."""
    model = load(name)
    q = model.loops.assembled()
    done = ran("info", str(EXAMPLES / "loops" / f"{name}.toml"))
    assert f"closed from their start with {model.joints[0]} = {q[0]:.4g} " in done.stdout


def test_the_command_tells_the_assembly_or_that_there_are_two(tmp_path: Path) -> None:
    told = []
    for start in ("elbow = 0.4", "elbow = 0.01"):
        (tmp_path / "elbow.toml").write_text(ELBOW.replace("START", start), encoding="utf-8")
        done = ran("info", str(tmp_path / "elbow.toml"))
        told.append(done.stdout)
    assert "closed from their start with shoulder = -0.6435 rad, elbow = 1.571 rad" in told[0]
    assert "and as near to their start with" in told[1]


@pytest.fixture(scope="module")
def palletiser() -> Model:
    """A palletiser in a plane: two parallelograms keep its wrist level; upper arm and forearm are driven."""
    bodies = {name: {"mass": 1.0, "inertia": [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]} for name in ("upper", "plate", "fore")}
    bodies |= {name: dict(bodies["plate"]) for name in ("wrist", "rod", "bar")}
    places: dict[str, tuple[str, str, list[float]]] = {
        "shoulder": ("world", "upper", [0.35, 0.0, 0.0]),
        "knee": ("upper", "plate", [0.0, 0.0, 1.2]),
        "forearm": ("plate", "fore", [0.0, 0.0, 0.0]),
        "level": ("fore", "wrist", [1.35, 0.0, 0.0]),
        "rear": ("world", "rod", [0.15, 0.0, 0.0]),
        "top": ("plate", "bar", [0.0, 0.0, 0.2]),
    }
    joints = {
        name: {"type": "revolute", "parent": parent, "child": child, "translation": at, "axis": [0.0, 1.0, 0.0]}
        for name, (parent, child, at) in places.items()
    }
    ends = {
        "elbow": ({"parent": "plate", "point": [-0.2, 0.0, 0.0]}, {"parent": "rod", "point": [0.0, 0.0, 1.2]}),
        "hand": ({"parent": "wrist", "point": [0.0, 0.0, 0.2]}, {"parent": "bar", "point": [1.35, 0.0, 0.0]}),
    }
    loops = {name: {"type": "revolute", "axis": [0.0, 1.0, 0.0], "a": a, "b": b} for name, (a, b) in ends.items()}
    drives = {f"{name}_drive": {"joint": name, "gain": 1.0, "command_unit": "N m"} for name in ("shoulder", "forearm")}
    content = {"name": "palletiser", "gravity": [0.0, 0.0, 0.0], "bodies": bodies, "joints": joints, "loops": loops}
    return Model.from_dict({**content, "actuators": drives})


def test_a_log_of_driven_joints_begins_where_they_stand(palletiser: Model) -> None:
    """Rods and plates follow, and no reading moves.

    The other joints begin far from any closure, so that two assemblies may be as near: this says nothing of the log.
    """
    still = np.ones(20)
    values = {"shoulder.position": 0.2 * still, "forearm.position": 0.275 * still}
    values |= {"shoulder_drive.command": 0.0 * still, "forearm_drive.command": 0.0 * still}
    began = simulate(palletiser, Experiment.from_arrays(0.01 * np.arange(20), values))
    found = [began[f"{name}.position"][0] for name in ("shoulder", "knee", "forearm", "level", "rear", "top")]
    np.testing.assert_allclose(found, [0.2, -0.2, 0.275, -0.275, 0.2, 0.275], atol=1e-9)


def test_restarts_begin_at_what_the_driven_joints_tell(palletiser: Model) -> None:
    """Each stretch follows a run of the same model, whose other joints nobody logged."""
    time = 0.005 * np.arange(200)
    commands = {"shoulder_drive.command": 4.0 * np.sin(5.0 * time), "forearm_drive.command": 3.0 * np.cos(7.0 * time)}
    free = simulate(palletiser, Experiment.from_arrays(time, commands))
    driven = ("shoulder.position", "forearm.position")
    log = Experiment.from_arrays(time, {name: free[name] for name in driven} | commands)
    run = simulate(palletiser, log, "restarts", horizon=0.1)
    for name in driven:
        error = run[name] - np.interp(run.time, time, log[name])
        assert np.abs(error).max() < 0.01 * np.ptp(log[name])


@pytest.mark.parametrize("angle", [0.02, 0.1])
def test_a_link_bends_where_joints_cannot_hold_the_loop_closed(angle: float) -> None:
    """A strip turned at its clamp, its end pinned to a slide: 3 E I angle / L for small angles."""
    E, width, height, L = 206e9, 0.002, 0.02, 0.5
    small = {"mass": 0.5, "inertia": [1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0]}
    strip = {
        "parent": "hub",
        "length": L,
        "level": "strain(4)",
        "deforms": ["bending_y"],
        "material": {"young": E, "density": 7850.0},
        "section": {"shape": "rectangle", "width": width, "height": height},
    }
    slide = {"parent": "world", "child": "slide", "translation": [0.0, 0.0, L]}
    model = Model.from_dict(
        {
            "name": "pinned strip",
            "gravity": [0.0, 0.0, 0.0],
            "bodies": {"hub": small, "slide": small},
            "joints": {
                "clamp": {"type": "revolute", "parent": "world", "child": "hub", "axis": [0.0, 1.0, 0.0]},
                "guide": {"type": "prismatic", "axis": [0.0, 0.0, 1.0], **slide},
            },
            "beams": {"strip": strip},
            "loops": {
                "pin": {"type": "revolute", "a": {"parent": "strip"}, "b": {"parent": "slide"}, "axis": [0.0, 1.0, 0.0]}
            },
            "actuators": {"motor": {"joint": "clamp", "gain": 1.0}},
        }
    )
    q, efforts = model.loops.rest({"clamp": angle})
    assert q[0] == angle
    # The bent strip reaches less far, by the mean of half its squared slope, and is stiffer by as small a share.
    assert efforts["clamp"] == pytest.approx(3.0 * E * width**3 * height / 12.0 * angle / L, rel=0.1 * angle**2)
    assert q[1] == pytest.approx(-L * angle**2 / 10.0, rel=1e-2)


CRANK, COUPLER, ROCKER, GROUND = 0.08, 0.30, 0.22, 0.28


@pytest.fixture(scope="module")
def crank_rocker() -> Model:
    """A four-bar linkage after Grashof whose crank goes round, driven there."""
    body = {"mass": 1.0, "inertia": [0.01, 0.01, 0.01, 0.0, 0.0, 0.0]}
    turns = {"type": "revolute", "axis": [0.0, 0.0, 1.0]}
    joints = {
        "crank": {**turns, "parent": "world", "child": "wheel"},
        "pin": {**turns, "parent": "wheel", "child": "coupler", "translation": [CRANK, 0.0, 0.0]},
        "rocker": {**turns, "parent": "world", "child": "lever", "translation": [GROUND, 0.0, 0.0]},
    }
    ends = {
        "a": {"parent": "coupler", "point": [COUPLER, 0.0, 0.0]},
        "b": {"parent": "lever", "point": [ROCKER, 0.0, 0.0]},
    }
    loop = {"type": "revolute", "axis": [0.0, 0.0, 1.0], **ends, "start": {"pin": 0.8, "rocker": 1.6}}
    return Model.from_dict(
        {
            "name": "crank-rocker",
            "gravity": [0.0, 0.0, 0.0],
            "bodies": {name: dict(body) for name in ("wheel", "coupler", "lever")},
            "joints": joints,
            "loops": {"end": loop},
            "actuators": {"motor": {"joint": "crank", "gain": 1.0, "command_unit": "N m"}},
        }
    )


def rocker_angle(crank: Array) -> Array:
    """Angle of the rocker by the law of cosines, the coupler's end above the ground link."""
    x, y = CRANK * np.cos(crank) - GROUND, CRANK * np.sin(crank)
    away = np.hypot(x, y)
    return np.asarray(np.arctan2(y, x) - np.arccos((ROCKER**2 + away**2 - COUPLER**2) / (2.0 * ROCKER * away)))


@pytest.mark.parametrize("crank", [0.5, 3.7, 6.0, 8.89, -17.3, 4000.0])
def test_a_crank_that_goes_round_keeps_its_assembly(crank_rocker: Model, crank: float) -> None:
    q = crank_rocker.loops.assembled({"crank": crank})
    assert q[0] == crank
    assert math.remainder(q[2] - float(rocker_angle(np.array(crank))), 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(q[2], crank_rocker.loops.near({"crank": crank})[2], atol=1e-9)


@pytest.mark.parametrize("rocker", [0.3, 1.0, 2.9])
def test_what_a_rocker_cannot_reach_says_how_far_it_is_open_there(crank_rocker: Model, rocker: float) -> None:
    """Between the rocker's end where it is held and the ring that crank and coupler reach."""
    away = math.hypot(GROUND + ROCKER * math.cos(rocker), ROCKER * math.sin(rocker))
    missing = max(away - COUPLER - CRANK, COUPLER - CRANK - away)
    assert missing > 1e-3
    with pytest.raises(ModelError, match=rf"rocker = {rocker:g} held: loop end stays open by") as caught:
        crank_rocker.loops.assembled({"rocker": rocker})
    told = float(str(caught.value).split("stays open by ")[1].split(" m")[0])
    # Newton's method ends beside the least gap, where the linkage is stretched.
    assert missing * (1.0 - 1e-3) <= told <= 1.2 * missing


def test_restarts_of_a_crank_that_goes_round_begin_on_its_side(crank_rocker: Model) -> None:
    """The log holds the crank alone, begins after half a turn and has several turns."""
    time = 0.004 * np.arange(500)
    log = Experiment.from_arrays(time, {"crank.position": 3.7 + 9.0 * time, "motor.command": 0.0 * time})
    run = simulate(crank_rocker, log, "restarts", horizon=0.1)
    away = run["rocker.position"] - rocker_angle(run["crank.position"])
    np.testing.assert_allclose(np.remainder(away + np.pi, 2.0 * np.pi), np.pi, atol=1e-9)
