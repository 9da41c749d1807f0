"""Motions that make a goal least, against closed forms, other solvers and the machine itself."""

import math
import runpy
import signal
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import fsolve

import vpm
from command_line import ran
from model_texts import effect_text, on_rail, sliding
from places import EXAMPLES
from vpm.errors import OptimisationError
from vpm.numbers import Array

pytest.importorskip("casadi", reason='CasADi is not installed (pip install "vpm-dynamics[optimise]")')

from vpm.optimise import OptimisationInterruptedError, Optimum, Task
from vpm.optimise.channels import Channels
from vpm.optimise.collocation import DERIVATIVE, NODES, POINTS, WEIGHTS
from vpm.optimise.equations import casadi, equations

#: A cart of 2 kg on a rail, pushed by a motor.
CART = on_rail("cart", joint="rail", drive="motor") + 'command_unit = "N"\n[markers.nose]\nparent = "cart"\n'
#: The same, held by a spring of 50 N/m.
SPRUNG = CART + effect_text("spring", "rail", stiffness=50.0)
#: A cart of 1 kg that pulls a load of 1 kg by a spring of 1 N/m.
PAIR = (
    CART.replace("mass = 2.0", "mass = 1.0")
    + sliding("load", "1.0", "spring", "cart")
    + effect_text("spring", "spring", stiffness=1.0)
)
#: A hand of 1 kg on two crossed rails.
GANTRY = (
    on_rail("bridge", "1.0", joint="along", drive="first")
    + 'command_unit = "N"\n'
    + sliding("hand", "1.0", "across", "bridge", "[0.0, 1.0, 0.0]")
    + '[markers.finger]\nparent = "hand"\n[actuators.second]\njoint = "across"\ngain = 1.0\ncommand_unit = "N"\n'
)
PENDULUM = """
name = "pendulum"
gravity = [0.0, 0.0, -9.81]

[bodies.rod]
mass = 1.0
center_of_mass = [0.0, 0.0, -0.5]
inertia = [0.01, 0.01, 0.01, 0.0, 0.0, 0.0]

[joints.pivot]
type = "revolute"
parent = "world"
child = "rod"
axis = [0.0, 1.0, 0.0]

[actuators.motor]
joint = "pivot"
gain = 1.0
command_unit = "N m"
"""


def dash(way: float, force: float, **more: object) -> dict[str, object]:
    """From rest to rest in least time."""
    return {
        "task": "dash",
        "minimise": "time",
        "duration": [0.1, 10.0],
        "end": {"rest": True, "rail.position": way},
        "limits": {"motor.command": [-force, force]},
        **more,
    }


def jumps(found: Optimum) -> Array:
    """When the command changes its sign, s."""
    sign = np.sign(found.node_commands[:, 0])
    at = np.flatnonzero(np.diff(sign))
    u = found.node_commands[:, 0]
    return found.node_time[at] + np.diff(found.node_time)[at] * u[at] / (u[at] - u[at + 1])


# ---- closed forms ----------------------------------------------------------------------------------------------------


def test_least_time_of_a_mass_is_a_push_and_a_brake() -> None:
    found = vpm.optimise(vpm.Model.from_toml(CART), dash(3.0, 4.0))
    assert found.duration == pytest.approx(2.0 * math.sqrt(3.0 / 2.0), rel=1e-4)
    assert jumps(found) == pytest.approx([0.5 * found.duration], abs=1e-3)
    assert found.status == "optimal"
    assert found.strayed < 1e-5
    assert "motor.command is at its most of 4 N" in str(found)
    assert "lasts" not in str(found)


@pytest.mark.parametrize(
    ("task", "word"), [({}, "least of 3 s"), ({"minimise": "energy", "duration": [2.6, 3.0]}, "most of 3 s")]
)
def test_a_duration_at_an_end_of_its_range_is_told(task: dict[str, object], word: str) -> None:
    """A push and a brake take 2.45 s; the energy 12 m^2 d^2 / T^3 falls with every duration."""
    found = vpm.optimise(vpm.Model.from_toml(CART), dash(3.0, 4.0, duration=[3.0, 10.0]) | task)
    assert found.duration == pytest.approx(3.0, rel=1e-4)
    assert f"the motion lasts its {word}" in found.binding


def test_least_energy_of_a_mass_is_a_cubic() -> None:
    found = vpm.optimise(
        vpm.Model.from_toml(CART),
        {"task": "calm", "minimise": "energy", "duration": 2.0, "end": {"rest": True, "rail.position": 3.0}},
    )
    # u = m 6 d / T^2 (1 - 2 t / T), whose square has the integral 12 m^2 d^2 / T^3.
    assert found.objective == pytest.approx(12.0 * 4.0 * 9.0 / 8.0, rel=1e-6)  # IPOPT keeps to equations by 1e-8
    s = np.clip(found.time / 2.0, 0.0, 1.0)
    assert found["rail.position"] == pytest.approx(3.0 * (3.0 * s**2 - 2.0 * s**3), abs=1e-6)


def test_least_time_of_a_mass_on_a_spring_is_two_arcs() -> None:
    stiffness, mass, force, way = 50.0, 2.0, 4.0, 0.07
    found = vpm.optimise(vpm.Model.from_toml(SPRUNG), dash(way, force))
    # In the phase plane: an arc around c = F/k from the rest at zero, then one around -c into the rest at d
    # (L. S. Pontryagin et al., The Mathematical Theory of Optimal Processes, 1962, section 5, example 2).
    c = force / stiffness
    first = math.acos((5.0 - ((way + c) / c) ** 2) / 4.0)
    second = math.atan2(c * math.sin(first), c * (2.0 - math.cos(first)))
    omega = math.sqrt(stiffness / mass)
    assert found.duration == pytest.approx((first + second) / omega, rel=1e-4)
    assert jumps(found) == pytest.approx([first / omega], abs=1e-3)


def test_least_energy_of_a_mass_on_a_spring_is_that_of_the_gramian() -> None:
    model, duration, end = vpm.Model.from_toml(SPRUNG), 1.7, np.array([0.07, 0.0])
    linear = model.linearize()
    # W by the exponential of a block matrix (C. F. Van Loan, IEEE Trans. Automatic Control 23, 1978).
    n = 2
    block = np.block([[-linear.A, linear.B @ linear.B.T], [np.zeros((n, n)), linear.A.T]])
    phi = expm(block * duration)
    gramian = phi[n:, n:].T @ phi[:n, n:]
    found = vpm.optimise(
        model,
        {"task": "calm", "minimise": "energy", "duration": duration, "end": {"rest": True, "rail.position": end[0]}},
    )
    assert found.objective == pytest.approx(float(end @ np.linalg.solve(gramian, end)), rel=1e-4)


def test_least_time_with_a_flexible_mode_has_three_jumps() -> None:
    found = vpm.optimise(vpm.Model.from_toml(PAIR), dash(1.0, 1.0, intervals=30))
    omega = math.sqrt(2.0)

    def missed(unknown: Array) -> list[float]:
        """Of what J. Ben-Asher, J. Burns and E. Cliff, J. Guidance, Control, and Dynamics 15, 1992, ask for."""
        jump, end = unknown
        times, x, v = (0.0, jump, 0.5 * end, end - jump, end), 0.0, 0.0
        for first, last, push in zip(times, times[1:], (0.5, -0.5, 0.5, -0.5), strict=False):
            x += v * (last - first) + 0.5 * push * (last - first) ** 2
            v += push * (last - first)
        return [1.0 - 2.0 * math.cos(omega * (0.5 * end - jump)) + math.cos(omega * 0.5 * end), x - 1.0]

    jump, end = fsolve(missed, [1.0, 4.2])
    assert found.duration == pytest.approx(end, rel=1e-4)
    assert jumps(found) == pytest.approx([jump, 0.5 * end, end - jump], abs=0.02 * end)


def test_points_are_those_of_radau() -> None:
    root = math.sqrt(6.0)  # Hairer and Wanner, table IV.5.6
    np.testing.assert_allclose(POINTS, [(4.0 - root) / 10.0, (4.0 + root) / 10.0, 1.0], atol=1e-14)
    np.testing.assert_allclose(WEIGHTS, [(16.0 - root) / 36.0, (16.0 + root) / 36.0, 1.0 / 9.0], atol=1e-14)
    np.testing.assert_allclose(DERIVATIVE @ NODES**3, 3.0 * POINTS**2, atol=1e-13)


# ---- elasticity ------------------------------------------------------------------------------------------------------


@pytest.mark.nightly
def test_the_flexible_arm_is_at_rest_where_the_stiff_one_swings(tmp_path: Path) -> None:
    model = vpm.Model.load(EXAMPLES / "optimise" / "arm.toml").at("bezier(2)")
    content = {**Task.load(EXAMPLES / "optimise" / "turn.toml").content, "tolerance": 3e-3, "refinements": 2}
    task = Task({**content, "intervals": 15})
    flexible, stiff = vpm.optimise(model, task), vpm.optimise(model.at("rigid"), task)
    left = {}
    for name, found in (("flexible", flexible), ("stiff", stiff)):
        run = found.play(model)
        left[name] = float(np.ptp(run["root.strain"][found.time > found.duration + 2e-3]))
    assert left["flexible"] < 0.01 * left["stiff"]
    assert stiff.duration < flexible.duration < 1.05 * stiff.duration
    loaded = Optimum.load(flexible.save(tmp_path / "turn.npz"))
    assert loaded == flexible
    assert len(flexible.to_frame()) == flexible.time.size


def test_derivatives_are_those_of_the_core() -> None:
    ca = casadi()
    for path, level in (("tudor/tudor", "bezier(2)"), ("hyl/hydraulic", None), ("hyl/rcm", None)):
        model = vpm.Model.load(EXAMPLES / f"{path}.toml")
        model = model.at(level) if level else model
        own = equations(model)
        slopes = ca.Function("AB", [own.x, own.u], [ca.jacobian(own.rates, own.x), ca.jacobian(own.rates, own.u)])
        rest = model.linearize()
        rng = np.random.default_rng(3)
        near = rest.state + 0.01 * np.maximum(1.0, np.abs(rest.state)) * rng.uniform(-1.0, 1.0, rest.state.size)
        linear = model.linearize(near, rest.command + 0.1)
        A, B = (np.array(one.full()) for one in slopes(linear.state, linear.command))
        for found, expected in ((A, linear.A), (B, linear.B)):
            size = np.abs(expected).max(axis=1, keepdims=True) + 1e-300
            np.testing.assert_allclose(found / size, expected / size, rtol=0.0, atol=1e-12)


def test_rates_of_outputs_are_derivatives_in_time() -> None:
    model = vpm.Model.from_toml(PENDULUM)
    channels = Channels(equations(model))
    value = casadi().Function("rate", [channels.variables], [channels["pivot.position.rate.rate"]])
    # (m l^2 + I) a = u - m g l sin q, without a word of vpm's own.
    q, w, u = 0.7, 1.1, 0.4
    assert float(value([q, w, u, 0.0, 1.0])) == pytest.approx((u - 9.81 * 0.5 * math.sin(q)) / 0.26, rel=1e-12)


# ---- limits, obstacles, phases, periods ------------------------------------------------------------------------------


def test_limits_hold_between_the_nodes() -> None:
    limits = {"motor.command": [-4.0, 4.0], "motor.command.rate": [-20.0, 20.0], "rail.velocity": [-1.5, 1.5]}
    found = vpm.optimise(vpm.Model.from_toml(CART), dash(3.0, 4.0, limits=limits))
    assert np.abs(found["rail.velocity"]).max() < 1.5 + 1e-3
    assert np.abs(np.diff(found["motor.command"])).max() < 20.0 * 1e-3 * (1.0 + 1e-6)
    assert not any("Between points" in note for note in found.notes)
    # Trapezoids: command up to 4 N in 0.2 s, back in 0.2 s after 0.55 s, cruise at 1.5 m/s, and the same to brake.
    assert found.duration == pytest.approx(0.95 + 3.0 / 1.5, rel=1e-4)


def test_phases_have_ends_of_their_own() -> None:
    task = dash(3.0, 4.0)
    del task["duration"]
    phases = [
        {"name": "out", "duration": [0.1, 5.0], "end": {"rail.position": 1.0, "rail.velocity": 1.0}},
        {"name": "on", "duration": [0.1, 5.0]},
    ]
    found = vpm.optimise(vpm.Model.from_toml(CART), {**task, "phases": phases})
    # Up to v at 2 m/s^2 and down to 1 m/s on the first metre, then up and down to rest.
    peak, second = math.sqrt(0.5 * (1.0 + 4.0)), math.sqrt(0.5 * (1.0 + 8.0))
    first, last = (2.0 * peak - 1.0) / 2.0, (2.0 * second - 1.0) / 2.0
    assert list(found.durations.values()) == pytest.approx([first, last], rel=2e-4)


def test_a_marker_keeps_out_of_a_ball() -> None:
    center, radius = np.array([1.0, -0.1]), 0.4
    task = {
        "task": "around",
        "minimise": "energy",
        "duration": 2.0,
        "tolerance": 1e-3,
        "end": {"rest": True, "along.position": 2.0, "across.position": 0.0},
    }
    ball = {"marker": "finger", "center": [*center, 0.0], "radius": radius}
    model = vpm.Model.from_toml(GANTRY)
    straight, around = vpm.optimise(model, task), vpm.optimise(model, {**task, "obstacles": [ball]})
    away = np.hypot(around["finger.x"] - center[0], around["finger.y"] - center[1])
    assert away.min() == pytest.approx(radius, rel=1e-2)
    # Straight on, 2 kg and the cubic; the way around costs more, and by symmetry is widest above the ball.
    assert straight.objective == pytest.approx(12.0 * 4.0 * 4.0 / 8.0, rel=1e-6)
    assert around.objective > straight.objective
    assert around["finger.y"].max() == pytest.approx(center[1] + radius, abs=0.01)


def test_a_periodic_motion_ends_as_it_begins() -> None:
    task = {
        "task": "to and fro",
        "minimise": "energy",
        "periodic": True,
        "duration": 1.0,
        "phases": [],
        "begin": {"rest": False, "rail.position": 0.1, "rail.velocity": 0.0},
    }
    found = vpm.optimise(vpm.Model.from_toml(SPRUNG), task)
    assert found.mesh_states[-1] == pytest.approx(found.mesh_states[0], abs=1e-7)
    assert found.objective > 0.0


# ---- what cannot be done ---------------------------------------------------------------------------------------------


def test_what_cannot_be_held_is_told_with_the_limit() -> None:
    with pytest.raises(
        OptimisationError, match=r"rail.position 0.08 m in place of 0.1 m.*motor.command is at its most"
    ):
        vpm.optimise(vpm.Model.from_toml(SPRUNG), dash(0.1, 4.0))


def test_what_takes_longer_is_told_with_the_limit() -> None:
    held = "and the motion lasts its most of 1 s and motor.command is at its"
    with pytest.raises(OptimisationError, match=rf"rail.position .* in place of .*, {held}"):
        vpm.optimise(vpm.Model.from_toml(CART), dash(3.0, 4.0, duration=[0.1, 1.0]))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"minimise": "speed"}, "minimise is no channel of cart"),
        ({"minimise": None}, "minimise or maximise has to stand"),
        ({"limits": {}}, r'limits."motor.command" has no least or no most'),
        ({"limits": {"motor.comand": 1.0}}, r'did you mean "motor.command"'),
        ({"limits": {"motor.command": {"least": 1.0, "most": -1.0}}}, "above the most"),
        ({"limits": {"motor.command": {"most": 1.0, "unit": "rad"}}}, "is wrong"),
        ({"limits": {"motor.command": "much"}}, "has to be a number"),
        ({"duration": -1.0}, "two positive times"),
        ({"duration": [0.1, math.inf]}, "duration"),
        ({"time_step": 1e-9}, "samples"),
        ({"speed": 1.0}, "speed is not a known key"),
        ({"end": {"rail.position": {"value": 1.0, "unti": "m"}}}, r'end."rail.position".unti .* did you mean "unit"'),
        ({"phases": [{"name": "a", "duration": 1.0, "limit": {}}]}, r'phases\[0\].limit .* did you mean "limits"'),
        ({"obstacles": [{"marker": "hand", "center": [0.0, 0.0, 0.0], "radius": 1.0}]}, 'is "hand", no marker'),
        ({"guess": {"rail.position": 1.0}}, "is no command"),
        ({"level": "bezier(3)"}, "level is wrong"),
        ({"set": {"cart.mas": 1.0}}, "set is wrong"),
    ],
)
def test_a_wrong_task_is_one_sentence(change: dict[str, object], words: str) -> None:
    content = {key: value for key, value in {**dash(3.0, 4.0), **change}.items() if value is not None}
    with pytest.raises(OptimisationError, match=words) as error:
        vpm.optimise(vpm.Model.from_toml(CART), content)
    assert "\n" not in str(error.value)


def test_ctrl_c_keeps_the_optimum_of_the_mesh_before() -> None:
    said: list[str] = []

    def press(text: str) -> None:
        said.append(text)
        if not text.startswith("20 intervals"):
            raise KeyboardInterrupt

    with pytest.raises(OptimisationInterruptedError) as stopped:
        vpm.optimise(vpm.Model.from_toml(CART), dash(3.0, 4.0, tolerance=1e-7), progress=press)
    found = stopped.value.result
    assert found.rounds == 1
    assert found.duration == pytest.approx(2.0 * math.sqrt(1.5), rel=1e-2)
    assert any("Ctrl-C" in note for note in found.notes)
    assert "iteration" in said[0]


def test_a_signal_on_the_first_mesh_keeps_the_last_iterate() -> None:
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(OptimisationInterruptedError) as stopped:
        vpm.optimise(vpm.Model.from_toml(CART), dash(3.0, 4.0), progress=lambda _: signal.raise_signal(signal.SIGINT))
    found = stopped.value.result
    assert (found.status, found.rounds, found.iterations) == ("interrupted", 0, 1)
    assert found.mesh_states.shape == (61, 2)
    assert signal.getsignal(signal.SIGINT) is before


def test_the_command_writes_a_log_that_a_simulation_plays(tmp_path: Path) -> None:
    (tmp_path / "cart.toml").write_text(CART, encoding="utf-8")
    (tmp_path / "dash.toml").write_text(
        'task = "dash"\nminimise = "time"\nduration = [0.1, 9.0]\n'
        '[end]\nrest = true\n"rail.position" = { value = 300.0, unit = "cm" }\n'
        '[limits]\n"motor.command" = [-4.0, 4.0]\n',
        encoding="utf-8",
    )
    words = ("optimise", "cart.toml", "dash.toml", "--log", "dash.csv", "--out", "dash.npz")
    done = ran(*words, cwd=tmp_path)
    assert "dash: optimal" in done.stdout
    model = vpm.Model.load(tmp_path / "cart.toml")
    record = vpm.Experiment.load(tmp_path / "dash.csv", model=model)
    # The command of the rest goes on from the last sample; without a filter's guess of the first velocity.
    assert vpm.simulate(model, record)["rail.position"][-1] == pytest.approx(3.0, abs=1e-5)
    assert Optimum.load(tmp_path / "dash.npz").name == "dash"


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("which", "words"),
    [("arm", "of the motion of rigid links: 0.0"), ("tudor", "of the motion of rigid links: 0.0"), ("jump", "to 1.1")],
)
def test_examples_use_the_elasticity(
    which: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["run.py", which, str(tmp_path)])
    runpy.run_path(str(EXAMPLES / "optimise" / "run.py"), run_name="__main__")
    assert words in capsys.readouterr().out
    assert {path.name for path in tmp_path.iterdir()} == {f"{which}.csv", f"{which}.png"}


@pytest.mark.nightly
def test_a_weak_motor_swings_a_pendulum_up() -> None:
    model = vpm.Model.from_toml(PENDULUM)
    found = vpm.optimise(
        model,
        {
            "task": "up",
            "minimise": "time",
            "duration": [0.5, 10.0],
            "intervals": 40,
            "tolerance": 1e-4,
            "end": {"rest": True, "pivot.position": math.pi},
            "limits": {"motor.command": [-1.5, 1.5]},
        },
    )
    # 1.5 N m hold it up to 18 degrees, so it has to swing to and fro.
    assert np.abs(found["pivot.position"][found.time < 0.5 * found.duration].min()) > 0.3
    assert found["pivot.position"][found.time <= found.duration][-1] == pytest.approx(math.pi, abs=0.01)
    # Power is at most that of the motor, and the way up takes at least the energy 2 m g l.
    moved = np.abs(np.diff(found["pivot.position"])).sum()
    assert 1.5 * moved > 2.0 * 9.81 * 0.5
    assert found.strayed < 1e-2
