"""Hydraulic drives from model files against reference values and closed forms, through every door of the package."""

import numpy as np
import pytest

import vpm
from drive_texts import RIG
from hydraulic_reference import AREA, OIL_FREQUENCY, RATIO, REST, STALL_IN, STALL_OUT, STEP, SUPPLY, TANK, chirp, held
from model_texts import changed
from vpm.batch import Trial, simulate_batch
from vpm.errors import DivergedError, ExperimentError, SimulationError
from vpm.experiment import Experiment
from vpm.identify import identify
from vpm.model import Model
from vpm.simulate import Run, Setup, simulate

CHANNELS = ("servo.pressure_a", "servo.pressure_b", "axis.position", "axis.velocity")
BARE = RIG[: RIG.index("[[effects]]")].replace("internal_leakage = 1.7e-13", "")
SAGGING = ("oil = {", 'source = "sagging"\nresistance = 1e10\ncapacitance = 1e-12\noil = {')
LOGGED = ("oil = {", 'source = "logged"\noil = {')


@pytest.fixture(scope="module")
def rig() -> Model:
    return Model.from_toml(RIG)


def against(run: Run, rows: tuple[tuple[float, ...], ...]) -> float:
    """Largest deviation from reference rows, relative to each value."""
    places = np.searchsorted(run.time, np.array([row[0] for row in rows]) * 1e-3 - 1e-9)
    found = np.column_stack([run[name][places] for name in CHANNELS])
    wanted = np.array([row[1:] for row in rows])
    return float(np.max(np.abs(found / wanted - 1.0)))


def test_the_response_to_steps_of_the_current(rig: Model) -> None:
    time = 1e-5 * np.arange(10001)
    run = simulate(rig, held(rig, 1e-5, np.where(time < 0.05 - 1e-9, 2e-3, -2e-3)), integrator="rosenbrock")
    assert against(run, STEP) < 1e-5


def test_chosen_steps_end_where_the_piston_does() -> None:
    fallen = Model.from_toml(BARE)
    ends = simulate(fallen, held(fallen, 1e-3, np.full(300, 10e-3)), integrator="adaptive")
    assert ends["axis.position"][-1] == pytest.approx(0.04 + STALL_OUT / 5e8, abs=1e-9)


def test_a_cylinder_at_rest_stays_at_rest(rig: Model) -> None:
    state = dict(zip(rig.state_names, rig.state(), strict=True))
    assert (state["servo.chamber_a"], state["servo.chamber_b"]) == pytest.approx(REST, rel=1e-9)
    sealed = changed(RIG, ("internal_leakage = 1.7e-13", ""))
    run = simulate(sealed, held(sealed, 1e-3, np.zeros(200)))
    assert np.max(np.abs(run["axis.position"])) < 1e-12
    assert run["servo.pressure_a"] == pytest.approx(np.full(200, REST[0]), rel=1e-9)


@pytest.mark.parametrize("current", [2e-3, -2e-3])
def test_flows_are_those_of_the_moving_areas_and_the_pump_gives_what_the_filling_chamber_takes(current: float) -> None:
    model = changed(BARE, ("stroke = { value = 80.0", "stroke = { value = 800.0"), ("value = -40.0", "value = -400.0"))
    run = simulate(model, held(model, 1e-4, np.full(15000, current)), integrator="rosenbrock")
    speed = run["axis.velocity"][-1]
    assert run["servo.flow_a"][-1] == pytest.approx(AREA * speed, rel=1e-6)
    assert run["servo.flow_b"][-1] == pytest.approx(RATIO * AREA * speed, rel=1e-6)
    filled = run["servo.flow_a"] if current > 0 else -run["servo.flow_b"]
    assert run["pump.flow"][-1] == pytest.approx(filled[-1], rel=1e-9)


@pytest.mark.parametrize(("current", "force", "end"), [(10e-3, STALL_OUT, 0.04), (-10e-3, -STALL_IN, -0.04)])
def test_a_piston_rests_at_the_end_of_its_stroke(current: float, force: float, end: float) -> None:
    model = Model.from_toml(BARE)
    run = simulate(model, held(model, 1e-4, np.full(3000, current)), integrator="rosenbrock")
    assert np.all(np.isfinite(run.values))
    assert run["axis.position"][-1] == pytest.approx(end + force / 5e8, abs=1e-9)
    assert abs(force) == pytest.approx(3204.7 if current > 0 else 1940.2, abs=0.1)
    high, low = ("a", "b") if current > 0 else ("b", "a")
    assert run[f"servo.pressure_{high}"][-1] == pytest.approx(SUPPLY, rel=1e-6)
    assert run[f"servo.pressure_{low}"][-1] == pytest.approx(TANK, rel=1e-6)


def test_a_load_that_pulls_empties_a_chamber_and_goes_on() -> None:
    heavy = changed(BARE, ("value = 3.0", "value = 300.0"))
    record = held(heavy, 1e-4, np.zeros(2000))
    state = heavy.state({"axis.velocity": 1.0})
    run = simulate(heavy, record, integrator="rosenbrock", initial_state=state)
    assert np.all(np.isfinite(run.values))
    pressures = run.values[:, [run.channels.index(f"servo.pressure_{side}") for side in "ab"]]
    assert pressures.min() == pytest.approx(2000.0, abs=1e-6)
    assert np.sum(run["servo.pressure_a"] < 2001.0) > 10
    assert np.max(np.abs(run["axis.position"])) < 0.0401


def test_a_logged_supply_is_an_input() -> None:
    constant, logged = Model.from_toml(RIG), changed(RIG, LOGGED)
    command = chirp(1e-3 * np.arange(500), 2e-3)
    plain = simulate(constant, held(constant, 1e-3, command))
    same = simulate(logged, held(logged, 1e-3, command, pump__pressure=np.full(500, SUPPLY)))
    assert np.array_equal(same.values, plain.values)
    weak = simulate(logged, held(logged, 1e-3, command, pump__pressure=np.full(500, 8e6)))
    assert np.ptp(weak["axis.position"]) < 0.8 * np.ptp(plain["axis.position"])
    assert weak["servo.pressure_b"][0] == pytest.approx((8e6 + TANK) / (1 + RATIO), rel=1e-9)
    with pytest.raises(ExperimentError, match=r"needs channel 'pump\.pressure'"):
        simulate(logged, held(logged, 1e-3, command))
    sim = vpm.Simulation(logged, 1e-3)
    assert sim.inputs == ("servo", "pump.pressure")
    sim.step({"servo": 1e-3})
    assert sim["pump.pressure"] == SUPPLY
    sim.step([1e-3, 8e6])
    assert sim["pump.pressure"] == 8e6


def test_a_supply_sags_by_its_resistance() -> None:
    changes = [("stroke = { value = 80.0", "stroke = { value = 800.0"), ("value = -40.0", "value = -400.0"), SAGGING]
    model = changed(BARE, *changes)
    run = simulate(model, held(model, 1e-4, np.full(10000, 2e-3)), integrator="rosenbrock")
    assert run["pump.pressure"][0] == SUPPLY
    drawn = run["pump.flow"][-1]
    assert drawn == pytest.approx(AREA * run["axis.velocity"][-1], rel=1e-6)
    assert run["pump.pressure"][-1] == pytest.approx(SUPPLY - 1e10 * drawn, rel=1e-9)
    assert run["pump.pressure"][-1] < 0.99 * SUPPLY


def test_the_linear_model_has_the_oil_and_the_spool() -> None:
    linear = Model.from_toml(BARE).linearize()
    assert linear.frequencies() == pytest.approx([OIL_FREQUENCY, 250.0], rel=1e-6)
    assert linear.damping_ratios() == pytest.approx([0.0, 0.7], abs=1e-6)
    assert linear.states == ("axis.position", "axis.velocity", *Model.from_toml(BARE).internal_names)
    assert linear.state_units[2:] == ("A", "A/s", "Pa", "Pa")
    opened = Model.from_toml(BARE).linearize(inputs={"servo": 1e-3})
    assert opened.state[2] == 1e-3  # the spool has followed
    logged = changed(BARE, LOGGED).linearize(inputs={"servo": 1e-3})
    assert logged.inputs == ("servo.command", "pump.pressure")
    assert logged.input_units == ("A", "Pa")
    assert np.any(logged.B[:, 1] != 0.0)


def test_a_fit_of_restarts_finds_bulk_modulus_and_gain_of_the_valve(rig: Model) -> None:
    """From the start values of the published listing, 1e8 Pa and 1e-6."""
    setup = Setup("rosenbrock", horizon=0.1)
    time = 1e-3 * np.arange(501)
    truth = simulate(rig, held(rig, 1e-3, chirp(time)), integrator="rosenbrock")
    measured = {name.replace(".", "__"): truth[name] for name in CHANNELS}
    record = held(rig, 1e-3, chirp(time), **measured)
    start = rig.with_parameters({"pump.oil.bulk_modulus": 1e8, "servo.valve.flow_gain": 1e-6})
    fit = identify(start, record, mode="restarts", setup=setup)
    assert fit["pump.oil.bulk_modulus"] == pytest.approx(1.2e9, rel=0.05)
    assert fit["servo.valve.flow_gain"] == pytest.approx(rig.parameters["servo.valve.flow_gain"].value, rel=0.05)
    assert not fit.at_bounds


def test_impacts_and_voids_need_no_choice_of_an_integrator(rig: Model) -> None:
    """Full current against both ends and back: by default a run steps so that it goes on correctly."""
    time = 1e-3 * np.arange(400)
    record = held(rig, 1e-3, np.where((time < 0.15) | ((time >= 0.16) & (time < 0.17)), 10e-3, -10e-3))
    run, exact = simulate(rig, record), simulate(rig, record, integrator="adaptive(1e-9)")
    assert run.settings["integrator"] == "adaptive"
    assert np.max(np.abs(run["axis.position"] - exact["axis.position"])) < 1e-8
    assert min(run["servo.pressure_a"].min(), run["servo.pressure_b"].min()) == 2000.0
    assert run["axis.position"][-1] == pytest.approx(-0.04 - STALL_IN / 5e8, abs=1e-7)
    assert vpm.Simulation(rig, 1e-3).run(np.zeros((2, 1))).settings["integrator"] == "adaptive"
    assert vpm.budget(rig, steps=1000).integrator == "guarded"
    with pytest.raises(DivergedError, match=r"is .* m beyond the end of its stroke, .* use the"):
        simulate(rig, record, integrator="rosenbrock")


def test_measured_pressures_are_the_start(rig: Model) -> None:
    zeros = np.zeros(50)
    pressures = {"servo__pressure_a": zeros + 5e6, "servo__pressure_b": zeros + 7e6}
    run = simulate(rig, held(rig, 1e-3, zeros, **pressures))
    assert (run["servo.pressure_a"][0], run["servo.pressure_b"][0]) == (5e6, 7e6)
    alone = simulate(rig, held(rig, 1e-3, zeros, servo__pressure_a=zeros + 5e6))
    assert alone["servo.pressure_a"][0] == 5e6
    assert alone["servo.pressure_b"][0] == pytest.approx(5e6 / RATIO, rel=1e-9)  # without a load: no net force


def test_a_piston_outside_of_its_stroke_is_refused(rig: Model) -> None:
    record = held(rig, 1e-3, np.zeros(100), axis__position=np.full(100, 0.05))
    for start in (
        lambda: simulate(rig, record),
        lambda: simulate(rig, record, "restarts", horizon=0.05),
        lambda: vpm.Simulation(rig, 1e-3, state={"axis.position": 0.05}),
    ):
        with pytest.raises(SimulationError) as caught:
            start()
        for part in ("servo", "axis", "starts 0.05", "-0.040000 m and 0.040000 m", "retracted_length"):
            assert part in str(caught.value)


def test_delays_and_limits_of_the_command() -> None:
    rig = changed(RIG, ("internal_leakage = 1.7e-13", ""))  # nothing moves before the command comes through
    command = chirp(1e-3 * np.arange(300), 2e-3)
    late = rig.with_effect("input_delay", at="servo", time=5e-3)
    plain, after = simulate(rig, held(rig, 1e-3, command)), simulate(late, held(rig, 1e-3, command))
    assert after["axis.position"][5:] == pytest.approx(plain["axis.position"][:-5], abs=1e-7)
    cut = simulate(rig.with_effect("saturation", at="servo", limit=1e-3), held(rig, 1e-3, command))
    own = simulate(rig, held(rig, 1e-3, np.clip(command, -1e-3, 1e-3)))
    assert cut["axis.position"] == pytest.approx(own["axis.position"], abs=1e-12)


def test_steps_batches_and_runs_agree(rig: Model) -> None:
    command = chirp(1e-3 * np.arange(100), 2e-3)
    record = held(rig, 1e-3, command)
    run = simulate(rig, record)
    sim = vpm.Simulation(rig, 1e-3)
    rows = sim.run(command[:, None])
    assert rows["axis.position"][:-1] == pytest.approx(run["axis.position"][1:], abs=1e-12)
    softer = Trial(record, {"pump.oil.bulk_modulus": 4e8})
    batch = simulate_batch(rig, [record, softer])
    assert all(isinstance(each, Run) for each in batch)
    assert isinstance(batch[0], Run)
    assert np.array_equal(batch[0].values, run.values)
    assert vpm.budget(rig, rate=1000.0, steps=1000).steps == 1000


def test_closed_loops_take_supplies_as_disturbances() -> None:
    servo = '\n[controllers.loop]\ntype = "pid"\nactuator = "servo"\nmeasures = "axis.position"\n'
    servo += 'proportional = { value = 0.5, unit = "A/m" }\n'
    for change in ((), (LOGGED,)):
        model = changed(RIG + servo, *change)
        time = 1e-3 * np.arange(500)
        columns = {"servo.reference": np.where(time > 0.05, 5e-3, 0.0)}
        columns |= {"pump.pressure": np.full(500, SUPPLY)} if change else {}
        run = simulate(model, Experiment.from_arrays(time, columns, model=model), "closed_loop")
        assert run["axis.position"][-1] == pytest.approx(5e-3, abs=2e-4)


def test_balances_of_effort_are_refused_in_one_sentence(rig: Model) -> None:
    time = 1e-3 * np.arange(2000)
    record = held(rig, 1e-3, chirp(time), axis__position=1e-3 * np.sin(6.0 * time))
    with pytest.raises(SimulationError, match=r"that of servo \(type hydraulic\) does not follow from its command"):
        simulate(rig, record, "inverse_dynamics")
    # Inverse dynamics of one state asks for no command, so drives do not matter.
    assert rig.inverse_dynamics([0.0], [0.1], [2.0]) == pytest.approx([3.0 * 2.0 + 700.0 * 0.1])
