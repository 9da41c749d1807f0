"""What steps damp, as every way of simulating says it: of a mass on a spring, whose runs show it."""

import copy
from pathlib import Path

import numpy as np
import pytest

from command_line import vpm
from model_texts import effect_text, on_rail
from vpm.batch import Trial, simulate_batch
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.scenario import Scenario
from vpm.simulate import Resolution, Run, Setup, simulate
from vpm.stepping import Simulation

STEP, SECONDS, HERTZ = 1e-3, 0.2, 200.0

CARRIAGE = on_rail("carriage") + effect_text("spring", "axis", stiffness=2.0 * (2.0 * np.pi * HERTZ) ** 2, rest=0.0)


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
    done = vpm("simulate", "model.toml", "log.csv", "--integrator", "rk4", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "warning: rk4, 1 ms: modes above" in done.stdout
    done = vpm("simulate", "model.toml", "log.csv", "--integrator", "adaptive", cwd=tmp_path)
    assert "note:" not in done.stdout
