"""Effects at servo-cylinders and supplies: against a solution without vpm, along a motion, and found from records."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vpm
from hydraulic_reference import AREA, RATIO, SUPPLY, TANK, VALUES
from nightly import at_night
from places import EXAMPLES
from vpm.discrepancy.screening.candidates import Candidate, candidates
from vpm.errors import IdentificationError, ModelError
from vpm.identify import InverseDynamicsProblem, gaps
from vpm.identify.sample_mask import SETTLING, at_stops
from vpm.initial import joint_motion, measured_states
from vpm.model.drives.states import commanded_states
from vpm.numbers import Array
from vpm.ranking.parameter_priors import Sizes

DT = 1e-3
BETA, GAIN, LEAKAGE = 1.2e9, float(VALUES["hyd.Kv"]["value"]), 1.7e-13
SPOOL, DAMPING = 2.0 * np.pi * 250.0, 0.7

#: Each effect with a size that a record of a few seconds shows: name, site, values.
EFFECTS: dict[str, tuple[str, dict[str, float]]] = {
    "internal_leakage": ("servo", {"coefficient": 2e-13}),
    "valve_dynamics": ("servo", {"time": 1.0 / (2.0 * np.pi * 40.0) - 1.0 / SPOOL}),
    "entrained_air": ("pump", {"fraction": 0.02}),
    "supply_drop": ("pump", {"resistance": 2e10, "time_constant": 0.05}),
    "seal_friction": ("servo", {"share": 0.02, "transition_velocity": 0.02}),
}
#: Those that act on the oil, and not on the piston.
OF_OIL = [name for name in EFFECTS if name != "seal_friction"]


@pytest.fixture(scope="module")
def rig() -> vpm.Model:
    return vpm.Model.load(EXAMPLES / "servo_cylinder" / "rig.toml")


def command(time: Array) -> Array:
    return 0.3e-3 * np.sin(2 * np.pi * 2.0 * time) + 0.5e-3 * np.sin(2 * np.pi * 7.0 * time + 0.3)


def record(truth: vpm.Model, seconds: float = 3.0, noise: float = 0.0, seed: int = 1) -> vpm.Experiment:
    """A cylinder that swings about the middle of its stroke: place and both pressures."""
    time = DT * np.arange(round(seconds / DT), dtype=np.float64)
    given = vpm.Experiment.from_arrays(time, {"servo.command": command(time)}, units={"servo.command": "A"})
    run = vpm.simulate(truth, given, integrator="adaptive(1e-7)")
    units = {"axis.position": "m", "servo.pressure_a": "Pa", "servo.pressure_b": "Pa"}
    draw = np.random.default_rng(seed)
    size = {"axis.position": 2e-6 * noise, "servo.pressure_a": 2e4 * noise, "servo.pressure_b": 2e4 * noise}
    data = {c: run[c] + size[c] * draw.normal(size=time.size) for c in units}
    return vpm.Experiment.from_arrays(
        time, {"servo.command": command(time), **data}, units={"servo.command": "A", **units}
    )


def with_effect(model: vpm.Model, name: str) -> vpm.Model:
    site, values = EFFECTS[name]
    return model.with_effect(name, at=site, **values)


def own_rates(current: float, _: float, state: Array) -> list[float]:
    """Rates of pressures a and b, place, velocity, spool, spool rate and drop, with all five effects."""
    pa, pb, x, v, spool, spool_rate, drop = state
    at_valve = SUPPLY - drop

    def flow(pressure: float) -> float:
        return float(np.sign(pressure) * np.sqrt(abs(pressure)) * GAIN * abs(spool))

    if spool > 0.0:
        into_a, out_of_b = flow(at_valve - pa), flow(pb - TANK)
        drawn = into_a
    else:
        into_a, out_of_b = -flow(pa - TANK), -flow(at_valve - pb)
        drawn = -out_of_b

    def stiffness(pressure: float) -> float:
        air = EFFECTS["entrained_air"][1]["fraction"] * float((101325.0 / pressure) ** (1.0 / 1.4))
        return (1.0 + air) / (1.0 / BETA + air / (1.4 * pressure))

    leak = (LEAKAGE + EFFECTS["internal_leakage"][1]["coefficient"]) * (pa - pb)
    va, vb = 2.9e-6 + AREA * (0.04 + x), 2.9e-6 + RATIO * AREA * (0.04 - x)
    frequency = 2.0 * np.pi * 40.0
    hoses, seals = EFFECTS["supply_drop"][1], EFFECTS["seal_friction"][1]
    rubbing = seals["share"] * AREA * (pa + pb) * float(np.tanh(v / seals["transition_velocity"]))
    return [
        stiffness(pa) / va * (into_a - AREA * v - leak),
        stiffness(pb) / vb * (-out_of_b + RATIO * AREA * v + leak),
        v,
        (AREA * (pa - RATIO * pb) - rubbing - 700.0 * v - 589.927 * x) / 3.0,
        spool_rate,
        frequency**2 * (current - spool) - 2.0 * DAMPING * frequency * spool_rate,
        (hoses["resistance"] * drawn - drop) / hoses["time_constant"],
    ]


def test_all_effects_together_against_a_solution_without_vpm(rig: vpm.Model) -> None:
    model = rig
    for name in EFFECTS:
        model = with_effect(model, name)
    time = DT * np.arange(151, dtype=np.float64)
    held = command(time)
    given = vpm.Experiment.from_arrays(time, {"servo.command": held}, units={"servo.command": "A"})
    run = vpm.simulate(model, given, integrator="adaptive(1e-8)")
    side_b = (SUPPLY + TANK) / (1.0 + RATIO)
    states = [np.array([RATIO * side_b, side_b, 0.0, 0.0, 0.0, 0.0, 0.0])]
    for current in held[:-1]:
        right = partial(own_rates, current)
        scale = np.array([1.0, 1.0, 1e-9, 1e-8, 1e-10, 1e-7, 1.0])
        found = solve_ivp(right, (0.0, DT), states[-1], method="LSODA", rtol=1e-9, atol=scale)
        states.append(found.y[:, -1])
    solved = np.array(states)
    for column, channel, floor in (
        (0, "servo.pressure_a", 1e-5 * SUPPLY),
        (1, "servo.pressure_b", 1e-5 * SUPPLY),
        (2, "axis.position", 1e-8),
        (4, "servo.spool", 1e-8),
    ):
        assert np.abs(run[channel] - solved[:, column]).max() < floor, channel
    assert solved[:, 6].max() > 1e5  # the drop matters


@pytest.mark.parametrize("name", EFFECTS)
def test_nothing_at_its_neutral_value(rig: vpm.Model, name: str) -> None:
    site, values = EFFECTS[name]
    idle = with_effect(rig, name).with_parameters(
        {rig.with_effect(name, at=site, **values).effects[-1].parameter_names[next(iter(values))]: 0.0}
    )
    time = DT * np.arange(200, dtype=np.float64)
    given = vpm.Experiment.from_arrays(time, {"servo.command": command(time)}, units={"servo.command": "A"})
    runs = [vpm.simulate(model, given, integrator="rosenbrock") for model in (rig, idle)]
    for channel in rig.output_channels:
        size = np.abs(runs[0][channel]).max()
        assert np.abs(runs[0][channel] - runs[1][channel]).max() <= 1e-9 * size, channel


def test_seals_that_pressures_press_on_are_missed_in_the_effort(rig: vpm.Model) -> None:
    truth = with_effect(rig, "seal_friction")
    problem = InverseDynamicsProblem(rig, [record(truth)])
    without = gaps(problem, problem.evaluate(rig, rig.theta)[0])["axis.effort"][1]
    within = gaps(problem, problem.evaluate(truth, truth.theta)[0])["axis.effort"][1]
    assert without > 0.1
    assert within < 0.02


@pytest.mark.parametrize("name", OF_OIL)
def test_the_balance_vanishes_with_the_effect_and_not_without(rig: vpm.Model, name: str) -> None:
    truth = with_effect(rig, name)
    problem = InverseDynamicsProblem(rig, [record(truth)])
    pressures = ("servo.pressure_a", "servo.pressure_b")
    without = gaps(problem, problem.evaluate(rig, rig.theta)[0])
    within = gaps(problem, problem.evaluate(truth, truth.theta)[0])
    for channel in pressures:
        assert within[channel][1] < 0.02
    assert max(without[c][1] / within[c][1] for c in pressures) > 4.0
    # The effort comes from the measured pressures: the faults are not in it.
    assert without["axis.effort"][1] < 0.02


@pytest.mark.parametrize("start", ["neutral", "there"])
@pytest.mark.parametrize("name", EFFECTS)
def test_derivatives_are_slopes(rig: vpm.Model, name: str, start: str) -> None:
    truth = with_effect(rig, name)
    problem = InverseDynamicsProblem(rig, [record(truth, 1.0)])
    dotted = list(truth.effects[-1].parameter_names.values())
    theta, size = truth.theta.copy(), {n: truth.parameters[n].value for n in dotted}
    if start == "neutral":
        dotted = dotted[:1]
        theta[truth.index(dotted[0])] = 0.0
    _, exact = problem.evaluate(truth, theta, [truth.index(n) for n in dotted])
    for column, dotted_name in enumerate(dotted):
        step = 1e-3 * size[dotted_name]
        one_sided = start == "neutral" and truth.parameters[dotted_name].minimum == 0.0

        def at(side: float, dotted_name: str = dotted_name, step: float = step) -> Array:
            moved = theta.copy()
            moved[truth.index(dotted_name)] += side * step
            return problem.evaluate(truth, moved)[0]

        if one_sided:
            slope = (-3.0 * at(0.0) + 4.0 * at(1.0) - at(2.0)) / (2.0 * step)
        else:
            slope = (at(1.0) - at(-1.0)) / (2.0 * step)
        assert np.abs(slope).max() > 0.0
        assert np.abs(slope - exact[:, column]).max() < 5e-3 * np.abs(slope).max(), dotted_name


@pytest.mark.parametrize("name", EFFECTS)
def test_planted_sizes_are_recovered(rig: vpm.Model, name: str) -> None:
    truth, (site, values) = with_effect(rig, name), EFFECTS[name]
    first = next(iter(values))
    start = {first: 0.0} | {key: 0.5 * value for key, value in values.items() if key != first}
    guess = rig.with_effect(name, at=site, **start)
    wanted = [guess.effects[-1].parameter_names[key] for key in values]
    fit = vpm.identify(guess, [record(truth, noise=1.0)], free=wanted, mode="inverse_dynamics")
    for key, dotted in zip(values, wanted, strict=True):
        assert fit.model.parameters[dotted].value == pytest.approx(values[key], rel=0.05), dotted


@pytest.mark.parametrize("source", ["constant", "logged", "sagging"])
def test_a_drop_needs_no_kind_of_supply(rig: vpm.Model, source: str, tmp_path: Path) -> None:
    content = rig.to_dict()
    content["supplies"]["pump"]["source"] = source
    if source == "sagging":
        content["supplies"]["pump"] |= {"resistance": 1e10, "capacitance": 1e-12}
    model = with_effect(vpm.Model.from_dict(content), "supply_drop")
    assert model.internal_names[-1] == "pump.drop"
    model.save(tmp_path / "dropping.toml")
    assert vpm.Model.load(tmp_path / "dropping.toml") == model
    time = np.arange(4000) * DT
    columns = {"servo.command": np.full(time.size, 0.3e-3)}
    units = {"servo.command": "A"}
    if source == "logged":
        columns["pump.pressure"], units["pump.pressure"] = np.full(time.size, SUPPLY), "Pa"
    run = vpm.simulate(
        model, vpm.Experiment.from_arrays(time[:800], {k: v[:800] for k, v in columns.items()}, units=units)
    )
    # Steady on the way out: the drop is resistance times flow.
    flow = run["pump.flow"][-1]
    assert flow > 0.0
    lost = 2e10 * flow
    opening = GAIN * 0.3e-3
    at_valve = (run["servo.flow_a"][-1] / opening) ** 2 + run["servo.pressure_a"][-1]
    assert run["pump.pressure"][-1] - at_valve == pytest.approx(lost, rel=0.05)


def sensed(model: vpm.Model, **errors: tuple[str, dict[str, float]]) -> vpm.Model:
    content = model.to_dict()
    content["sensors"] = {"gauge": {"measures": "servo.pressure_a"}}
    changed = vpm.Model.from_dict(content)
    for name, (site, values) in errors.items():
        changed = changed.with_effect(name, at=site, **values)
    return changed


@pytest.mark.parametrize(
    ("name", "values"),
    [("sensor_offset", {"value": 5e5}), ("sensor_gain", {"value": 1.1}), ("sensor_delay", {"time": 2.4e-3})],
)
def test_a_pressure_sensor_is_read_before_the_effort(rig: vpm.Model, name: str, values: dict[str, float]) -> None:
    nominal = sensed(rig)
    truth = nominal.with_effect(name, at="gauge", **values)
    problem = InverseDynamicsProblem(nominal, [record(truth)])
    without = gaps(problem, problem.evaluate(nominal, nominal.theta)[0])
    within = gaps(problem, problem.evaluate(truth, truth.theta)[0])
    assert within["axis.effort"][1] < 0.02
    assert without["axis.effort"][1] > 4.0 * within["axis.effort"][1]
    ((key, value),) = values.items()
    start = {"sensor_gain": 1.0}.get(name, 0.0)
    guess = nominal.with_effect(name, at="gauge", **{key: start})
    dotted = guess.effects[-1].parameter_names[key]
    fit = vpm.identify(guess, [record(truth, noise=1.0)], free=[dotted], mode="inverse_dynamics")
    assert fit.model.parameters[dotted].value == pytest.approx(value, rel=0.05)


def test_a_piston_at_its_stop_does_not_count(rig: vpm.Model) -> None:
    """A drift into the end of the stroke: an encoder's noise of 2 um is a kilonewton there."""
    drifting = rig.with_effect("internal_leakage", at="servo", coefficient=6e-13)
    hit = record(drifting, noise=1.0)
    assert hit["axis.position"].max() > 0.0399
    problem = InverseDynamicsProblem(drifting, [hit])
    (block,) = problem.efforts(0)
    assert 0.3 < block.moving.mean() < 0.97
    counted = np.interp(block.time[block.moving > 0.0], hit.time, hit["axis.position"])
    assert counted.max() < 0.04
    assert gaps(problem, problem.evaluate(drifting, drifting.theta)[0])["axis.effort"][1] < 0.1  # 0.93 with the stop
    # Within the stroke everything counts but the ends, in which the filter settles.
    within = InverseDynamicsProblem(rig, [record(rig, noise=1.0)])
    assert within.efforts(0)[0].moving[SETTLING:-SETTLING].all()
    # A stroke that the record never leaves the end of is refused.
    short = rig.with_parameters({"servo.retracted_length": -0.12})
    with pytest.raises(IdentificationError, match="touch an end of its stroke"):
        InverseDynamicsProblem(short, [record(rig)])


@pytest.mark.parametrize("lagging", [False, True])
def test_spools_follow_the_commands_before_a_start(rig: vpm.Model, lagging: bool) -> None:
    """Spool, its rate and lag in the middle of a record as a simulation of the whole has them."""
    model = with_effect(rig, "valve_dynamics").with_effect("input_delay", at="servo", time=2e-3)
    model = model.with_effect("dead_zone", at="servo", width=2e-5).with_effect("saturation", at="servo", limit=6e-4)
    if lagging:
        model = model.with_effect("actuator_lag", at="servo", time_constant=0.01)
    given = record(model, 0.4)
    run = vpm.simulate(model, given, integrator="adaptive(1e-9)")
    held = given["servo.command"][:, None]
    found = commanded_states(model, model.theta, held, DT)
    place = model.internal_names.index("servo.spool")
    # A spool behind a lag gets its mean over each millisecond.
    allowed = 2e-3 if lagging else 1e-6
    # The simulation began with a spool at rest in the middle, which is forgotten after 150 ms.
    gap = (found["servo.spool"] - run["servo.spool"])[150:]
    assert np.abs(gap).max() < allowed * np.abs(run["servo.spool"]).max()
    states = measured_states(model, given, model.theta, np.array([200, 350]), None)
    internal = 2 * len(model.joints)
    assert np.allclose(states[:, internal + place], run["servo.spool"][[200, 350]], rtol=0, atol=allowed * 6e-4)
    slope = np.gradient(run["servo.spool"], DT)
    assert np.abs(found["servo.spool_rate"] - slope)[150:-2].max() < 0.05 * np.abs(slope).max()


def test_pressures_at_a_start_are_those_behind_the_readings(rig: vpm.Model) -> None:
    truth = sensed(rig).with_effect("sensor_offset", at="gauge", value=5e5)
    truth = truth.with_effect("sensor_gain", at="gauge", value=1.1)
    log = record(truth, 0.4)
    states = measured_states(truth, log, truth.theta, np.array([200]), None)
    place = 2 * len(truth.joints) + truth.internal_names.index("servo.chamber_a")
    assert states[0, place] == pytest.approx((log["servo.pressure_a"][200] - 5e5) / 1.1, rel=1e-12)


MOTOR = """
name = "geared axis"
gravity = [0.0, 0.0, 0.0]

[bodies.wheel]
mass = 1.0
inertia = [0.5, 0.5, 0.5, 0.0, 0.0, 0.0]

[joints.axis]
type = "revolute"
parent = "world"
child = "wheel"
axis = [0.0, 0.0, 1.0]

[actuators.motor]
type = "dc_motor"
joint = "axis"
resistance = 1.2
time_constant = 2e-3
torque_constant = 0.05
gear_ratio = 50.0

[sensors.shunt]
measures = "motor.current"

[[effects]]
type = "viscous_friction"
at = "axis"
viscous = 3.0
"""

#: Tables of a model file that ask for drives.
DRIVEN = {"actuators", "supplies", "controllers", "sensors", "contacts", "effects", "channels"}

#: Of a command of 6 V and of 0.8 mA, and of a current of some amperes.
DRIVE_EFFECTS = {
    "input_delay": {"time": 4.3e-3},
    "dead_zone": {"width": 0.07},
    "saturation": {"limit": 0.6},
    "actuator_lag": {"time_constant": 5e-3},
}


def turned(truth: vpm.Model) -> vpm.Experiment:
    time = DT * np.arange(2000, dtype=np.float64)
    voltage = 3.0 * np.sin(2 * np.pi * 1.3 * time) + 3.0 * np.sin(2 * np.pi * 5.1 * time)
    given = vpm.Experiment.from_arrays(time, {"motor.command": voltage}, units={"motor.command": "V"})
    run = vpm.simulate(truth, given, integrator="adaptive(1e-8)")
    data = {"motor.command": voltage} | {c: run[c] for c in ("axis.position", "motor.current")}
    return vpm.Experiment.from_arrays(
        time, data, units={"motor.command": "V", "axis.position": "rad", "motor.current": "A"}
    )


@pytest.mark.parametrize("drive", ["servo", "motor"])
@pytest.mark.parametrize("name", DRIVE_EFFECTS)
def test_effects_of_any_actuator_balance_along_a_motion(rig: vpm.Model, drive: str, name: str) -> None:
    """Delay, dead zone, saturation and lag show in what the drive holds, and their sizes are found there."""
    nominal, size = (rig, 0.8e-3) if drive == "servo" else (vpm.Model.from_toml(MOTOR), 6.0)
    values = {k: v if k in {"time", "time_constant"} else v * size for k, v in DRIVE_EFFECTS[name].items()}
    truth = nominal.with_effect(name, at=drive, **values)
    log = record(truth) if drive == "servo" else turned(truth)
    shown = "servo.pressure_a" if drive == "servo" else "motor.current"
    problem = InverseDynamicsProblem(nominal, [log])
    without = gaps(problem, problem.evaluate(nominal, nominal.theta)[0])[shown][1]
    within = gaps(problem, problem.evaluate(truth, truth.theta)[0])[shown][1]
    assert within < 0.02
    assert without > 4.0 * within
    ((key, value),) = values.items()
    guess = nominal.with_effect(name, at=drive, **{key: 0.8 * value})
    fit = vpm.identify(guess, [log], free=[guess.effects[-1].parameter_names[key]], mode="inverse_dynamics")
    assert fit.model.parameters[guess.effects[-1].parameter_names[key]].value == pytest.approx(value, rel=0.02)


def test_a_current_is_read_before_the_effort() -> None:
    nominal = vpm.Model.from_toml(MOTOR)
    truth = nominal.with_effect("sensor_offset", at="shunt", value=0.4).with_effect(
        "sensor_gain", at="shunt", value=1.2
    )
    problem = InverseDynamicsProblem(nominal, [turned(truth)])
    without = gaps(problem, problem.evaluate(nominal, nominal.theta)[0])
    within = gaps(problem, problem.evaluate(truth, truth.theta)[0])
    assert within["axis.effort"][1] < 0.02
    assert without["axis.effort"][1] > 0.15


@pytest.mark.parametrize("name", at_night(["internal_leakage", "supply_drop", "sensor_offset"], but=["supply_drop"]))
def test_a_diagnosis_names_it(rig: vpm.Model, name: str) -> None:
    site, values = {**EFFECTS, "sensor_offset": ("gauge", {"value": 3e5})}[name]
    nominal = sensed(rig)
    truth = nominal.with_effect(name, at=site, **values)
    why = vpm.diagnose(nominal, record(truth, 2.0, noise=1.0), record(truth, 1.5, noise=1.0, seed=2))
    assert [(e.name, e.site) for e in why.effects] == [(name, site)]
    first = next(iter(values))
    dotted = truth.effects[-1].parameter_names[first]
    assert why.model.parameters[dotted].value == pytest.approx(values[first], rel=0.05)


def test_what_effects_may_amount_to_is_of_the_size_of_their_kind(rig: vpm.Model) -> None:
    """A gauge may be off by a share of what it reads, not of the way; oil by what matters, which no record shows."""
    nominal = sensed(rig)
    log = record(nominal, 1.0)
    sizes = Sizes(nominal, InverseDynamicsProblem(nominal, [log]))

    def spread(effect: str, site: str) -> float:
        parameter = vpm.catalogue.EFFECTS[effect].parameters[0]
        return sizes.prior(Candidate(vpm.catalogue.EFFECTS[effect], site, ({},)), parameter, 0.0).spread

    assert spread("sensor_offset", "gauge") == pytest.approx(0.05 * np.ptp(log["servo.pressure_a"]))
    assert spread("supply_drop", "pump") == 1e10
    assert spread("internal_leakage", "servo") == 1e-12


def test_friction_that_follows_the_load_is_that_of_any_drive(rig: vpm.Model) -> None:
    """What the motion needs does not depend on what brings it: a cylinder, or a drive that is given the effort."""
    log = record(rig, 1.0)
    content = {key: entry for key, entry in rig.to_dict().items() if key not in {"actuators", "supplies", "sensors"}}
    ideal = vpm.Model.from_dict({**content, "actuators": {"servo": {"type": "ideal", "gain": 1.0, "joint": "axis"}}})
    needed = []
    for model in (rig, ideal):
        lossy = model.with_effect("load_dependent_friction", at="axis", driving=0.1, driven=0.05)
        needed += [InverseDynamicsProblem(other, [log]).effort(other, other.theta, 0)[2] for other in (model, lossy)]
    np.testing.assert_allclose(needed[0], needed[2])
    np.testing.assert_allclose(needed[1], needed[3])
    assert np.max(np.abs(needed[1] - needed[0])) > 0.05 * np.max(np.abs(needed[0]))


def test_friction_of_seals_is_sought_at_the_joint(rig: vpm.Model) -> None:
    with pytest.raises(ModelError, match=r"the seals of servo rub at the joint that it moves; .*axis"):
        rig.with_effect("coulomb_friction", at="servo", coulomb=1.0)


def test_pistons_on_lines_are_followed_to_their_stops() -> None:
    """The leg HyL: a course of the knee that leaves the stroke of its cylinder, as lengths of a machine at rest say."""
    model = vpm.Model.load(EXAMPLES / "hyl" / "hydraulic.toml")
    knee = next(name for name in model.joints if "knee" in name)
    (drive,) = (name for name in model.actuators if model.joints_of_actuator(name) == (knee,))
    home = model.state()
    start = float(home[model.joints.index(knee)])
    time = DT * np.arange(1500, dtype=np.float64)
    course = start + 0.8 * np.sin(2 * np.pi * 0.7 * time)
    positions = {f"{name}.position": np.full(time.size, home[k]) for k, name in enumerate(model.joints)}
    positions[f"{knee}.position"] = course
    log = vpm.Experiment.from_arrays(
        time, positions, units={channel: model.channel_unit(channel) for channel in positions}
    )
    found = at_stops(model, log, joint_motion(log, model))[drive]
    line, stroke, drawn_in = (
        model.line_of_actuator(drive),
        model.parameters[f"{drive}.cylinder.stroke"].value,
        model.parameters[f"{drive}.retracted_length"].value,
    )
    picks = range(100, 1400, 50)
    lengths = []
    for k in picks:
        place = {f"{name}.position": float(positions[f"{name}.position"][k]) for name in model.joints}
        bare = vpm.Model.from_dict({key: value for key, value in model.to_dict().items() if key not in DRIVEN})
        lengths.append(vpm.Simulation(bare, DT, state=place)[f"{line}.length"] - drawn_in)
    outside = np.array([not 1e-5 < length < stroke - 1e-5 for length in lengths])
    assert outside.any()
    assert not outside.all()
    assert np.array_equal(found[list(picks)], outside)


def test_a_slow_spool_starts_as_late_as_a_lag_does(rig: vpm.Model) -> None:
    """From a thousandth of a second fits did not arrive at 32 ms, and an excavator had a lag of 52 ms."""
    data = InverseDynamicsProblem(rig, [record(rig, 1.0)])
    residual, _ = data.evaluate(rig, rig.theta)
    late = {one.effect.name: one for one in candidates(rig, data, residual, ["valve_dynamics", "actuator_lag"])}
    spool, lag = (
        [value for start in late[name].starts for value in start.values()]
        for name in ("valve_dynamics", "actuator_lag")
    )
    assert len(spool) > 1
    np.testing.assert_allclose(spool, lag)
