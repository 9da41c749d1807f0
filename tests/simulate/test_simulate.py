"""The four modes against closed forms, against each other, and against bad input."""

from pathlib import Path

import numpy as np
import pytest

import vpm
from synthetic import Truth, nominal, simulate_axis
from vpm.compare import compare
from vpm.errors import DivergedError, ExperimentError, ModelError, SimulationError
from vpm.experiment import Experiment
from vpm.identify import InverseDynamicsProblem, identify
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import HOLDS, INTEGRATORS, MODES, Run, Setup, simulate

TRUTH = Truth(mass=20.0, viscous=60.0, noise=0.0)

PUSH, SPRING, SPEED, ARRIVAL = 9.0, 1e5, 0.1, 1.5
#: A mass that its weight pulls up, away from the ground below.
GRAZE = f"""
name = "graze"
gravity = [0.0, 0.0, {PUSH}]

[bodies.mass]
mass = 1.0

[joints.guide]
type = "prismatic"
parent = "world"
child = "mass"
axis = [0.0, 0.0, 1.0]

[contacts.ground]
parent = "mass"
plane = {{ normal = [0.0, 0.0, 1.0] }}
stiffness = {SPRING}
"""


@pytest.fixture(scope="module")
def record() -> Experiment:
    """A record of exactly the nominal machine, from other code."""
    return simulate_axis(TRUTH, 1, 6.0, first_seed=1)[0]


def constant_push(volts: float, seconds: float, dt: float = 0.001) -> Experiment:
    time = np.arange(0.0, seconds, dt)
    channels = {"drive.command": np.full(time.size, volts), "axis.position": np.zeros(time.size)}
    return Experiment.from_arrays(time, channels, units={"drive.command": "V", "axis.position": "m"}, name="push")


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_free_run_reaches_terminal_speed_as_the_closed_form_says(integrator: str) -> None:
    """m dv/dt = F - c v: v = F/c (1 - exp(-c t/m))."""
    run = simulate(nominal(), constant_push(3.0, 2.0), integrator=integrator, substeps=4, initial_state=np.zeros(2))
    force, mass, viscous = 30.0, 20.0, 60.0
    expected = force / viscous * (1.0 - np.exp(-viscous * run.time / mass))
    tolerance = 1e-3 if integrator == "semi_implicit" else 1e-6
    np.testing.assert_allclose(run["axis.velocity"], expected, atol=tolerance)


def test_a_run_begins_in_states_given_by_name() -> None:
    """m dv/dt = -c v: v = v0 exp(-c t/m), and q approaches q0 + v0 m/c."""
    start = {"axis.position": 0.3, "axis.velocity": 0.4}
    run = simulate(nominal(), constant_push(0.0, 1.0), integrator="rk4", initial_state=start)
    mass, viscous = 20.0, 60.0
    gone = np.exp(-viscous * run.time / mass)
    np.testing.assert_allclose(run["axis.velocity"], 0.4 * gone, atol=1e-9)
    np.testing.assert_allclose(run["axis.position"], 0.3 + 0.4 * mass / viscous * (1.0 - gone), atol=1e-9)


@pytest.mark.parametrize(("mode", "start"), [("restarts", {"axis.position": 0.1}), ("inverse_dynamics", np.zeros(2))])
def test_a_first_state_where_the_log_tells_the_states_is_refused(mode: str, start: dict[str, float] | Array) -> None:
    with pytest.raises(SimulationError, match=f"mode '{mode}' takes no initial_state"):
        simulate(nominal(), constant_push(0.0, 1.0), mode, initial_state=start)
    with pytest.raises(ModelError, match=r"did you mean .axis\.position"):
        simulate(nominal(), constant_push(0.0, 1.0), initial_state={"axis.positoin": 0.1})


def swept(dt: float, seconds: float = 4.0) -> Experiment:
    """A smooth push that comes and goes, sampled so often."""
    time = np.arange(round(seconds / dt) + 1) * dt
    push = 3.0 * np.sin(2.0 * np.pi * time / seconds) ** 3
    channels = {"drive.command": push, "axis.position": np.zeros(time.size)}
    return Experiment.from_arrays(time, channels, units={"drive.command": "V", "axis.position": "m"}, name="sweep")


def test_a_hold_of_higher_order_makes_up_for_a_coarse_log() -> None:
    fine = simulate(nominal(), swept(0.0005), integrator="rk4", hold="cubic", initial_state=np.zeros(2))
    exact = fine["axis.position"][::80]
    errors = []
    for hold in HOLDS:
        run = simulate(nominal(), swept(0.04), integrator="rk4", hold=hold, initial_state=np.zeros(2))
        assert run.settings.get("hold", "zero_order") == hold
        errors.append(np.abs(run["axis.position"] - exact).max())
    assert errors[0] > 20.0 * errors[1] > 100.0 * errors[2]


@pytest.mark.parametrize("mode", ["free_run", "restarts"])
def test_a_fit_follows_the_hold(mode: str) -> None:
    fine = simulate(nominal(), swept(0.0005), integrator="rk4", hold="cubic", initial_state=np.zeros(2))
    exact = fine["axis.position"][::80]
    log = swept(0.04).with_channel("axis.position", exact, "m")
    masses = [
        identify(nominal(), [log], ["slide.mass"], mode=mode, setup=Setup("rk4", horizon=1.0, hold=hold)).values[0]
        for hold in HOLDS[:2]
    ]
    assert abs(masses[1] - 20.0) < 0.2 * abs(masses[0] - 20.0)


def test_a_hold_that_cannot_be_is_refused(record: Experiment) -> None:
    with pytest.raises(SimulationError, match="unknown hold 'linear'; choose one of auto, zero_order, first_order"):
        Setup(hold="linear")
    for mode in ("closed_loop", "inverse_dynamics"):
        with pytest.raises(SimulationError, match=f"hold 'cubic' is for commands of a log, and mode '{mode}' takes"):
            simulate(nominal(), record, mode, hold="cubic")


def test_closed_loop_follows_the_other_simulation(record: Experiment) -> None:
    run = simulate(nominal(), record, "closed_loop", substeps=4)
    assert compare(run, record)["axis.position"].relative_error < 0.01  # per cent
    assert compare(run, record)["drive.command"].relative_error < 2.0


def test_restarts_stay_near_where_a_free_run_drifts(record: Experiment) -> None:
    heavier = nominal().with_parameters({"slide.mass": 21.0})
    free = compare(simulate(heavier, record, "free_run"), record)["axis.position"].relative_error
    restarted = compare(simulate(heavier, record, "restarts", horizon=0.2), record)["axis.position"].relative_error
    assert restarted < 0.3 * free


def test_restarts_cover_the_log_in_pieces_of_the_horizon(record: Experiment) -> None:
    run = simulate(nominal(), record, "restarts", horizon=0.5)
    length = round(0.5 / record.dt) + 1
    np.testing.assert_array_equal(np.diff(run.starts), length)
    assert run.time.size == run.starts.size * length
    measured = run.measured[:, run.channels.index("axis.position")]
    np.testing.assert_allclose(run["axis.position"][run.starts], measured[run.starts], atol=2e-5)


def test_inverse_dynamics_gives_back_the_effort(record: Experiment) -> None:
    run = simulate(nominal(), record, "inverse_dynamics")
    assert run.channels == ("axis.effort",)
    residual = run.values - run.measured
    assert np.sqrt(np.mean(residual**2)) < 0.01 * np.sqrt(np.mean(run.measured**2))
    # What a fit balances is the same, sample by sample.
    model = nominal()
    time, applied, required = InverseDynamicsProblem(model, [record]).effort(model, model.theta, 0)
    for ours, theirs in ((run.time, time), (run.measured, applied), (run.values, required)):
        # Sums of parts in another order, each behind the filter of the motion.
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-10 * np.abs(ours).max())


def test_simulation_does_not_depend_on_the_number_of_substeps_in_the_limit(record: Experiment) -> None:
    model = nominal().with_effect("coulomb_friction", at="axis", coulomb=5.0, transition_velocity=0.01)
    fine, finer = (
        simulate(model, record, "closed_loop", integrator="rk4", substeps=n)["axis.position"] for n in (8, 16)
    )
    np.testing.assert_allclose(fine, finer, atol=1e-7)


def test_run_has_the_manners_of_a_result(record: Experiment, tmp_path: Path) -> None:
    run = simulate(nominal(), record, "closed_loop")
    assert "\n" not in repr(run)
    assert Run.load(run.save(tmp_path / "run.npz")) == run
    frame = run.to_frame()
    assert list(frame.columns)[:2] == ["time", "axis.position"]
    assert "<table" in run._repr_html_()


def test_divergence_carries_the_run_so_far() -> None:
    stiff = nominal().with_parameters({"axis.friction.viscous": 999.0, "slide.mass": 1.0})
    with pytest.raises(DivergedError) as caught:
        simulate(stiff, constant_push(1.0, 5.0, dt=0.01), integrator="semi_implicit")
    run = caught.value.run
    assert isinstance(run, Run)
    assert 0 < run.time.size < 500
    assert np.isfinite(run.values).all()
    assert "axis" in str(caught.value)


def test_missing_command_names_channel_and_mode() -> None:
    time = np.arange(0.0, 1.0, 0.01)
    log = Experiment.from_arrays(time, {"axis.position": np.sin(time)}, units={"axis.position": "m"}, name="bare")
    with pytest.raises(ExperimentError, match=r"bare: mode 'free_run' needs channel 'drive\.command'"):
        simulate(nominal(), log)


def test_closed_loop_without_controller_is_refused(record: Experiment) -> None:
    content = nominal().to_dict()
    del content["controllers"]
    with pytest.raises(SimulationError, match="needs a controller for actuator 'drive'"):
        simulate(Model.from_dict(content), record, "closed_loop")


def test_horizon_longer_than_the_log_is_refused(record: Experiment) -> None:
    with pytest.raises(SimulationError, match="longer than the log"):
        simulate(nominal(), record, "restarts", horizon=100.0)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"integrator": "euler"}, "unknown integrator 'euler'"),
        ({"integrator": "adaptive(x)"}, r"no integrator `adaptive\(x\)`"),
        ({"integrator": "adaptive(0)"}, "tolerance of adaptive must lie between 1e-12 and 0.1, got 0"),
        ({"integrator": "adaptive(2)"}, "tolerance of adaptive must lie between 1e-12 and 0.1, got 2"),
        ({"substeps": 0}, "substeps is 0"),
        ({"horizon": float("nan")}, "horizon is nan"),
    ],
)
def test_bad_settings_are_named(arguments: dict[str, object], sentence: str) -> None:
    with pytest.raises(SimulationError, match=sentence):
        Setup(**arguments)  # type: ignore[arg-type]


def test_unknown_mode_lists_the_modes(record: Experiment) -> None:
    with pytest.raises(SimulationError, match=", ".join(MODES)):
        simulate(nominal(), record, "backwards")


def test_unknown_channel_lists_the_channels(record: Experiment) -> None:
    with pytest.raises(SimulationError, match=r"no channel 'axis\.speed'"):
        simulate(nominal(), record, "closed_loop")["axis.speed"]


def test_a_touch_of_milliseconds_is_met_in_steps_of_a_second() -> None:
    # It flies towards the ground, in steps of a second as far as error control goes, touches it after 1.5 s at 0.1 m/s
    # for 8 ms, and flies off. On the ground it swings about a sag of m g / k and leaves as fast as it came.
    start = [SPEED * ARRIVAL + 0.5 * PUSH * ARRIVAL**2, -SPEED - PUSH * ARRIVAL]
    simulation = vpm.Simulation(vpm.Model.from_toml(GRAZE), 1.0, integrator="adaptive", state=start)
    for _ in range(3):
        simulation.step([])
    rate = np.sqrt(SPRING)
    touch = 2.0 * np.arctan(SPEED * rate / PUSH) / rate
    after = 3.0 - ARRIVAL - touch
    exact = [SPEED * after + 0.5 * PUSH * after**2, SPEED + PUSH * after]
    np.testing.assert_allclose(simulation.state[:2], exact, atol=1e-3)
