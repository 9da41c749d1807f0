"""What steps damp, as every way of simulating says it: of a mass on a spring, whose runs show it."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from command_line import ran, vpm
from model_texts import effect_text, on_rail
from places import EXAMPLES
from vpm.batch import Trial, simulate_batch
from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.scenario import Scenario
from vpm.simulate import Resolution, Run, Setup, simulate
from vpm.stepping import Simulation

STEP, SECONDS, HERTZ = 1e-3, 0.2, 200.0

CARRIAGE = on_rail("carriage") + effect_text("spring", "axis", stiffness=2.0 * (2.0 * np.pi * HERTZ) ** 2, rest=0.0)

ROWS = 300
#: Velocity over which friction turns around, m/s: of 1 N on 1 kg, 50 times in a step.
NARROW = 2e-5


@pytest.fixture
def model(tmp_path: Path) -> Model:
    path = tmp_path / "carriage.toml"
    path.write_text(CARRIAGE, encoding="utf-8")
    return Model.load(path)


def silence(seconds: float = SECONDS) -> Experiment:
    time = STEP * np.arange(round(seconds / STEP))
    return Experiment.from_arrays(time, {"drive.command": np.zeros(time.size)}, units={"drive.command": "N"}, name="-")


def kept(run: Run) -> float:
    """Amplitude at the end of a run by that at its beginning."""
    amplitude = np.hypot(run["axis.position"], run["axis.velocity"] / (2.0 * np.pi * HERTZ))
    return float(amplitude[-1] / amplitude[0])


def found(steps: Resolution | None) -> Resolution:
    assert steps is not None
    return steps


def told(run: Run) -> float:
    """What the one mode of a run is said to keep."""
    steps = found(run.resolution)
    assert steps.integrator == "linearly_implicit"
    assert steps.frequencies == pytest.approx([HERTZ], rel=1e-6)
    assert steps.limit < HERTZ
    return float(steps.left[0])


def worked_out(run: Run) -> bool:
    return "_modes" in vars(run.resolution)


def test_a_run_says_what_its_steps_leave_also_when_loaded(model: Model, tmp_path: Path) -> None:
    state = model.state({"axis.position": 1e-3})
    run = simulate(model, silence(), integrator="linearly_implicit", initial_state=state)
    assert not worked_out(run)
    # The first and the last amplitude are not taken at the same phase of the numerical vibration: a few percent.
    assert np.log(told(run)) == pytest.approx(np.log(kept(run)), rel=0.1)
    assert told(run) < 0.5
    run.save(tmp_path / "run.npz")
    for again in (Run.load(tmp_path / "run.npz"), copy.deepcopy(run)):
        assert again == run
        assert str(again.resolution) == str(run.resolution)


def test_a_run_that_nobody_asked_is_saved_with_it(model: Model, tmp_path: Path) -> None:
    run = simulate(model, silence(), integrator="linearly_implicit", initial_state=model.state({"axis.position": 1e-3}))
    run.save(tmp_path / "run.npz")
    assert told(Run.load(tmp_path / "run.npz")) == told(run)


def test_a_simulation_says_it_of_runs_and_of_a_second(model: Model) -> None:
    sim = Simulation(model, STEP, integrator="linearly_implicit", state={"axis.position": 1e-3})
    run = sim.run(np.zeros((round(SECONDS / STEP), 1)))
    assert np.log(told(run)) == pytest.approx(np.log(kept(run)), rel=0.1)
    assert sim.resolution.left[0] == pytest.approx(told(run) ** (1.0 / SECONDS), rel=1e-6)
    assert Simulation(model, STEP, integrator="adaptive").resolution.limit == np.inf


def test_runs_of_a_batch_say_it_each_of_its_own_machine(model: Model) -> None:
    slow = {"axis.spring.stiffness": 2.0 * (2.0 * np.pi * 2.0) ** 2}
    state = {"axis.position": 1e-3}
    trials = [Trial(silence(), initial_state=state), Trial(silence(), slow, state)]
    fast, resolved = simulate_batch(model, trials, setup=Setup("linearly_implicit"))
    assert isinstance(fast, Run)
    assert isinstance(resolved, Run)
    assert not worked_out(fast)
    assert not worked_out(resolved)
    assert np.log(told(fast)) == pytest.approx(np.log(kept(fast)), rel=0.1)
    assert not found(resolved.resolution).frequencies.size


def test_a_scenario_says_it_beside_its_numbers(model: Model, tmp_path: Path) -> None:
    document = {
        "scenario": "plucked",
        "duration": SECONDS,
        "time_step": STEP,
        "integrator": "linearly_implicit",
        "initial": {"axis.position": 1e-3},
        "runs": [{"name": "bare", "model": "carriage.toml"}],
    }
    result = Scenario.from_dict(document, folder=tmp_path).run()
    assert model.name == result["bare"].model_name
    assert np.log(told(result["bare"])) == pytest.approx(np.log(kept(result["bare"])), rel=0.1)
    assert f"note: {result['bare'].resolution}" in str(result)


def with_effect(text: str) -> Model:
    """The carriage, of 1 kg and with another effect in the place of its spring."""
    head = CARRIAGE.partition("[[effects]]")[0].replace("mass = 2.0", "mass = 1.0")
    return Model.from_toml(f'{head}[[effects]]\nat = "axis"\n{text}')


def test_explicit_steps_that_move_a_frequency_are_told(model: Model) -> None:
    # Symplectic steps turn by the angle a with 2 sin(a / 2) = h omega: 8 % too far at 200 Hz, 40 % at 312 Hz.
    steps = found(simulate(model, silence(), integrator="semi_implicit", initial_state=model.state({})).resolution)
    assert steps.is_complete
    stiff = model.with_parameters({"axis.spring.stiffness": 2.0 * (2.0 * np.pi * 312.0) ** 2})
    run = simulate(stiff, silence(), integrator="semi_implicit", initial_state=stiff.state({"axis.position": 1e-3}))
    told_of = found(run.resolution)
    shown = 312.0 * (1.0 + told_of.shifts[0])
    assert f"312 Hz: becomes {shown:.3g} Hz" in str(told_of)
    crossings = np.count_nonzero(np.diff(np.sign(run["axis.position"])))
    assert 0.5 * crossings / SECONDS == pytest.approx(shown, rel=0.03)


@pytest.mark.parametrize("integrator", ["rk4", "semi_implicit", "linearly_implicit", "rosenbrock", "additive"])
@pytest.mark.parametrize(
    "text",
    [
        f'type = "end_stop"\nlow = -0.01\nhigh = 0.01\nstiffness = {(2.0 * np.pi * 312.0) ** 2}\ndamping = 0.0',
        f'type = "cubic_spring"\nstiffness = {1e6 * (2.0 * np.pi * 312.0) ** 2}',
    ],
)
def test_what_stiffens_on_the_way_is_told(integrator: str, text: str) -> None:
    model, record = with_effect(text), silence(0.5)
    still = simulate(model, record, integrator=integrator, initial_state=model.state({}))
    assert found(still.resolution).is_complete
    state = model.state({"axis.velocity": 0.5})
    for run in (
        simulate(model, record, integrator=integrator, initial_state=state),
        Simulation(model, STEP, integrator=integrator, state=state).run(np.zeros((500, 1))),
    ):
        assert "are not resolved" in str(run.resolution)
        assert str(run.resolution) in run.messages


@pytest.mark.parametrize("integrator", ["rk4", "semi_implicit", "linearly_implicit", "rosenbrock", "guarded"])
def test_dry_friction_that_a_step_does_not_resolve_is_told(integrator: str, tmp_path: Path) -> None:
    # 1 N on 1 kg over 2e-5 m/s: a step of 1 ms is 50 times as long as friction takes at its slope at rest.
    model = with_effect('type = "coulomb_friction"\ncoulomb = 1.0\ntransition_velocity = 2e-5')
    # Not a whole number of what friction brakes in a step: else a step could end at rest by luck.
    state = model.state({"axis.velocity": 0.01003})
    run = simulate(model, silence(), integrator=integrator, initial_state=state)
    steps = found(run.resolution)
    assert np.abs(run["axis.velocity"][-20:]).max() > 2e-5
    assert steps.sites == ("joint `axis`",)
    assert steps.turns == pytest.approx([50.0], rel=1e-6)
    assert "dry friction of joint `axis` stops it in 0.02 steps, so that it creeps or chatters" in run.messages[-1]
    run.save(tmp_path / "run.npz")
    assert str(Run.load(tmp_path / "run.npz").resolution) == str(steps)
    fine = simulate(model, silence(), integrator=integrator, substeps=100, initial_state=state)
    assert found(fine.resolution).is_complete
    assert np.abs(fine["axis.velocity"][-20:]).max() < 2e-5
    for exact in ("additive", "adaptive"):
        assert found(simulate(model, silence(), integrator=exact, initial_state=state).resolution).is_complete


def test_the_command_says_it_beside_its_numbers(tmp_path: Path) -> None:
    (tmp_path / "model.toml").write_text(CARRIAGE, encoding="utf-8")
    rows = "\n".join(f"{STEP * k:.3f},1.0" for k in range(200))
    (tmp_path / "log.csv").write_text(f"time,drive.command\n{rows}\n", encoding="utf-8")
    done = ran("simulate", "model.toml", "log.csv", "--integrator", "rk4", cwd=tmp_path)
    assert "warning: rk4, 1 ms: modes above" in done.stderr
    told = json.loads(ran("--json", "simulate", "model.toml", "log.csv", "--integrator", "rk4", cwd=tmp_path).stdout)
    assert told["notes"] == [done.stderr.strip()]
    done = vpm("simulate", "model.toml", "log.csv", "--integrator", "adaptive", cwd=tmp_path)
    assert "warning:" not in done.stdout + done.stderr


def carriage(**parts: Any) -> Model:
    """A carriage of 1 kg that a motor drives, with what rubs on it."""
    joint = {"type": "prismatic", "parent": "world", "child": "carriage", "axis": [1.0, 0.0, 0.0]}
    content = {
        "name": "carriage",
        "gravity": [0.0, 0.0, 0.0],
        "bodies": {"carriage": {"mass": 1.0}},
        "joints": {"axis": joint},
        "actuators": {"drive": {"joint": "axis", "gain": 1.0}},
    }
    return Model.from_dict({**content, **parts})


def turns_by_site(run: Run) -> dict[str, float]:
    assert run.resolution is not None
    return dict(zip(run.resolution.sites, run.resolution.turns.tolist(), strict=True))


def restless(run: Run, slowest: float) -> bool:
    return bool(np.abs(run["axis.velocity"][-20:]).max() > slowest)


def log(command: float = 0.0, rows: int = ROWS) -> Experiment:
    time = STEP * np.arange(rows)
    units = {"drive.command": "N"}
    return Experiment.from_arrays(time, {"drive.command": np.full(rows, command)}, units=units, name="log")


INTEGRATORS = ["rk4", "semi_implicit", "linearly_implicit", "rosenbrock", "additive", "adaptive"]


def record(columns: dict[str, tuple[float, str]]) -> Experiment:
    """A log of commands that stand still, each with its unit."""
    time = STEP * np.arange(ROWS)
    channels = {f"{name}.command": np.full(ROWS, value) for name, (value, _) in columns.items()}
    units = {f"{name}.command": unit for name, (_, unit) in columns.items()}
    return Experiment.from_arrays(time, channels, units=units, name="log")


#: A pull that the friction of the other drive holds.
OTHER = {"joint": "axis", "gain": 1.0}


def seals(width: float) -> tuple[Model, Experiment, dict[str, float]]:
    """A mass of 3 kg on a hydraulic cylinder whose oil is soft beside its seals."""
    model = Model.load(EXAMPLES / "servo_cylinder" / "rig.toml")
    content = model.to_dict()
    content["effects"], content["channels"] = [], {}
    content["actuators"]["servo"]["friction"] = {"coulomb": 300.0, "transition_velocity": width}
    return Model.from_dict(content), record({"servo": (0.0, "A")}), {"servo.chamber_a": 5e6, "servo.chamber_b": 8.2e6}


def motor(width: float) -> tuple[Model, Experiment, dict[str, float]]:
    """A motor whose gear takes 80 % of 1 N, against half a newton."""
    drive = {"type": "dc_motor", "joint": "axis", "resistance": 1.0, "time_constant": 5e-3, "torque_constant": 1.0}
    drive |= {"back_emf": 0.0, "efficiency": 0.2, "transition_velocity": width}
    model = carriage(actuators={"drive": drive, "other": OTHER})
    return model, record({"drive": (1.0, "V"), "other": (-0.5, "N")}), {"drive.current": 1.0}


def gear(width: float) -> tuple[Model, Experiment, dict[str, float]]:
    """A drive that loses 90 % of its newton where it moves, against 0.8 N."""
    effect = {"type": "drive_friction", "at": "drive", "driving": 0.9, "driven": 0.9, "transition_velocity": width}
    model = carriage(actuators={"drive": OTHER, "other": OTHER}, effects=[effect])
    return model, record({"drive": (1.0, "N"), "other": (-0.8, "N")}), {}


def warming(width: float) -> tuple[Model, Experiment, dict[str, float]]:
    """Friction that remembers the time."""
    effect = {"type": "warming_friction", "at": "axis", "coulomb": 1.0, "viscous": 0.0, "time_constant": 100.0}
    model = carriage(effects=[{**effect, "transition_velocity": width}])
    return model, log(), {}


RUBBING: dict[str, tuple[Callable[[float], tuple[Model, Experiment, dict[str, float]]], str, float]] = {
    "motor": (motor, "actuator `drive`", 0.8),
    "gear": (gear, "actuator `drive`", 0.9),
    "warming": (warming, "joint `axis`", 1.0),
}


@pytest.mark.parametrize("name", RUBBING)
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_friction_is_told_where_runs_show_that_it_does_not_stick(name: str, integrator: str) -> None:
    made, site, force = RUBBING[name]
    seen, said = [], []
    for width in (NARROW, 5e-3):
        model, experiment, rest = made(width)
        # Not a whole number of what friction brakes in a step: else a step could end at rest by luck.
        runs = []
        for phase in range(6):
            state = model.state({**rest, "axis.velocity": 0.01003 + 1.3e-4 * phase})
            runs.append(simulate(model, experiment, integrator=integrator, initial_state=state))
        seen.append(any(restless(run, width) for run in runs))
        said.append(turns_by_site(runs[0]))
    assert not seen[1]
    assert not said[1]
    if seen[0]:
        assert said[0] == {site: pytest.approx(force * STEP / NARROW, rel=1e-3)}
    if integrator == "adaptive":
        assert not said[0]


@pytest.mark.parametrize("width", [1e-4, NARROW])
def test_implicit_steps_take_the_gear_of_a_motor_by_its_chord(width: float) -> None:
    """By its tangent, which is flat in motion, they would step from one direction to the other for ever."""
    for phase in range(6):
        model, experiment, rest = motor(width)
        state = model.state({**rest, "axis.velocity": 0.01003 + 1.3e-4 * phase})
        exact, run = (
            simulate(model, experiment, integrator=integrator, initial_state=state)
            for integrator in ("adaptive(1e-8)", "linearly_implicit")
        )
        # Such steps have the speed that 0.3 N give 1 kg in 1 ms; over the run, a fifth of it is little.
        assert np.abs(run["axis.position"] - exact["axis.position"]).max() < 0.2 * (0.3 * STEP) * (ROWS * STEP)


def test_steps_that_bring_to_rest_without_a_load_only_are_told() -> None:
    """Half a newton on 0.8 N that turn round eight times in a step: from some speeds the steps never come to rest."""
    model, experiment, rest = motor(1e-4)
    states = [model.state({**rest, "axis.velocity": 0.01003 + 1.3e-4 * phase}) for phase in range(10)]
    runs = [simulate(model, experiment, integrator="rosenbrock", initial_state=state) for state in states]
    held = np.arctanh(0.5 / 0.8)
    assert any(restless(run, (1.0 + held) * 1e-4) for run in runs)
    assert all(turns_by_site(run) == {"actuator `drive`": pytest.approx(8.0, rel=1e-3)} for run in runs)


@pytest.mark.parametrize("integrator", ["rk4", "linearly_implicit", "rosenbrock", "additive"])
def test_seals_that_steps_do_not_resolve_are_told(integrator: str) -> None:
    """The oil lets a cylinder creep whatever the steps are, so that only the exact run tells what they do."""
    model, experiment, rest = seals(NARROW)
    state = model.state({**rest, "axis.velocity": 0.05})
    exact = simulate(model, experiment, integrator="adaptive", initial_state=state)
    run = simulate(model, experiment, integrator=integrator, initial_state=state)
    assert np.abs(run["axis.velocity"] - exact["axis.velocity"])[-20:].max() > 2.0 * NARROW
    # 300 N on 3 kg.
    assert turns_by_site(run) == {"actuator `servo`": pytest.approx(100.0 * STEP / NARROW, rel=1e-3)}
    assert not turns_by_site(exact)
    wide, experiment, rest = seals(0.3)
    assert not turns_by_site(simulate(wide, experiment, integrator=integrator, initial_state=wide.state(rest)))


def test_friction_of_a_drive_counts_at_its_largest_effort_and_by_its_lever() -> None:
    """On a shaft that turns 5 rad per metre, 0.9 of 2 N m are 2250 N s/m where they turn around within 0.02 rad/s."""
    effect = {"type": "drive_friction", "at": "drive", "driving": 0.9, "driven": 0.9, "transition_velocity": 0.02}
    drive = {"transmission": "shaft", "gain": 1.0}
    model = carriage(transmissions={"shaft": {"ratios": {"axis": 5.0}}}, actuators={"drive": drive}, effects=[effect])
    turn = pytest.approx(0.9 * 2.0 / 0.02 * 25.0 * 20e-3, rel=1e-3)
    commands = np.zeros((12, 1))
    commands[1:3, 0] = [-2.0, 1.0]
    sim = Simulation(model, 20e-3, integrator="rk4")
    assert not sim.resolution.sites
    assert turns_by_site(sim.run(commands)) == {"actuator `drive`": turn}
    time = 20e-3 * np.arange(12)
    channels, units = {"drive.command": commands[:, 0]}, {"drive.command": "N m"}
    experiment = Experiment.from_arrays(time, channels, units=units, name="log")
    assert turns_by_site(simulate(model, experiment, integrator="rk4", initial_state=np.zeros(2))) == {
        "actuator `drive`": turn
    }


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("text", ["lugre_friction", "hysteresis"])
def test_bristles_too_stiff_for_a_step_are_told(text: str, integrator: str) -> None:
    """1 N on 1 kg over 5e-8 m: 20 times what a step of 1 ms moves by that."""
    effects: dict[str, dict[str, Any]] = {
        "lugre_friction": {"coulomb": 1.0, "damping": 0.0, "excess": 0.0, "stribeck_velocity": 0.01},
        "hysteresis": {"force": 1.0, "shape": 1.0},
    }
    model = carriage(effects=[{"type": text, "at": "axis", "displacement": 5e-8, **effects[text]}])
    state = model.state({"axis.velocity": 0.01003})
    try:
        run = simulate(model, log(), integrator=integrator, initial_state=state)
    except VpmError:
        # An explicit step that bristles are too stiff for ends the run by itself.
        assert integrator == "rk4"
        return
    # Stopped friction stores no more than what moves the carriage by sqrt(1 N 5e-8 m / 1 kg).
    restless_one = restless(run, np.sqrt(5e-8))
    assert restless_one == (integrator in {"semi_implicit", "rosenbrock"})
    assert turns_by_site(run) == ({"joint `axis`": pytest.approx(20.0, rel=1e-3)} if restless_one else {})
