"""Controllers in model files: against exact solutions, in the linear dynamics of an error, and what is refused."""

import math

import numpy as np
import pytest

import two_link_arm
from drive_texts import RIG
from model_texts import TWO_LINKS, changed, described, on_rail, refused
from quotients import quotient
from vpm.errors import SimulationError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import simulate, simulate_arrays

AXIS = f"""{on_rail("slide", gain='{ value = 40.0, unit = "N/V" }')}command_unit = "V"

[controllers.servo]
type = "pd"
actuator = "drive"
measures = "axis.position"
proportional = {{ value = 5.0, unit = "V/m" }}
derivative = {{ value = 0.6, unit = "V s/m" }}
"""

LEG = f"""
name = "leg"
gravity = [0.0, 0.0, -9.81]

{TWO_LINKS}
[lines.cylinder]
from = {{ parent = "thigh", point = [0.05, 0.0, -0.1] }}
to = {{ parent = "shank", point = [0.05, 0.0, -0.1] }}

[actuators.motor]
joint = "hip"
gain = {{ value = 50.0, unit = "N m/A" }}
command_unit = "A"

[actuators.valve]
line = "cylinder"
gain = {{ value = 2.0, unit = "kN/V" }}
command_unit = "V"

[controllers.hip_pd]
type = "pd"
actuator = "motor"
measures = "hip.position"
proportional = 3.0
derivative = {{ value = 0.2, unit = "A s/rad" }}
limit = 5.0

[controllers.knee_force]
type = "force_loop"
actuator = "valve"
measures = "knee.position"
proportional = {{ value = 150.0, unit = "N m/rad" }}
derivative = {{ value = 6.0, unit = "N m s/rad" }}
force_gain = {{ value = 0.2, unit = "mV/N" }}
velocity_gain = {{ value = 0.5, unit = "V s/m" }}
limit = {{ value = 8.0, unit = "V" }}
sample_time = 0.002
delay = 0.0015
"""

COMPUTED = """
[controllers.arm]
type = "computed_torque"
actuators = ["second", "first"]
measures = ["elbow.position", "shoulder.position"]
proportional = [64.0, { value = 100.0, unit = "1/s^2", uncertainty = 5.0 }]
derivative = [16.0, 20.0]
"""
ARM = two_link_arm.MODEL + COMPUTED


def grid(rows: int, step: float) -> Array:
    """Times of so many samples, s."""
    return np.asarray(step * np.arange(rows), dtype=np.float64)


def record(time: Array, model: Model, references: dict[str, Array]) -> Experiment:
    """Record of nothing but references."""
    channels = {f"{name}.reference": values for name, values in references.items()}
    units = {channel: model.channel_unit(channel) for channel in channels}
    return Experiment.from_arrays(time, channels, units=units, name="references")


def held_step(damping: float, inertia: float, h: float) -> tuple[Array, Array]:
    """Exact step of m x'' + c x' = F for a held F: closed form of the matrix exponential."""
    rate = damping / inertia
    fade = -math.expm1(-rate * h) / rate
    matrix = np.array([[1.0, fade], [0.0, math.exp(-rate * h)]])
    return matrix, np.array([(h - fade) / damping, fade / inertia])


@pytest.mark.parametrize("every", [1, 2, 5])
@pytest.mark.parametrize(("delay", "whole", "fraction"), [(0.0, 0, 0.0), (0.01, 1, 0.0), (0.015, 1, 0.5)])
def test_an_axis_under_pd_is_the_exact_discrete_solution(every: int, delay: float, whole: int, fraction: float) -> None:
    friction = '[[effects]]\ntype = "viscous_friction"\nat = "axis"\nviscous = 3.0\n'
    model = Model.from_toml(f"{AXIS}sample_time = {0.01 * every}\ndelay = {delay}\n{friction}")
    time = grid(120, 0.01)
    reference = 0.3 + 0.1 * np.sin(15.0 * time)
    log = record(time, model, {"drive": reference})
    run = simulate(model, log, "closed_loop", integrator="rk4", substeps=16, initial_state=np.array([0.1, -0.2]))
    matrix, push = held_step(3.0, 2.0, 0.01)
    state, expected = np.array([0.1, -0.2]), []
    drafts: list[float] = []
    for k, r in enumerate(reference):
        expected.append(state)
        drafts.append(5.0 * (r - state[0]) - 0.6 * state[1] if k % every == 0 else drafts[k - 1])
        command = (1.0 - fraction) * drafts[max(k - whole, 0)] + fraction * drafts[max(k - whole - 1, 0)]
        state = matrix @ state + push * 40.0 * command
    found = np.column_stack([run["axis.position"], run["axis.velocity"]])
    np.testing.assert_allclose(found, np.array(expected), atol=1e-12)


def gap_to_linear(step: float) -> float:
    """Largest gap between the error of the arm and e'' + D e' + P e = 0, both poles of a joint in one place."""
    model = Model.from_toml(ARM)
    time = grid(round(1.0 / step), step)
    shoulder, elbow = 0.5 * np.sin(2.0 * time), 0.8 * np.sin(3.0 * time + 0.4)
    log = record(time, model, {"first": shoulder, "second": elbow})
    initial = np.array([-0.1, 0.8 * np.sin(0.4) - 0.1, 1.0, 2.4 * np.cos(0.4)])
    run = simulate(model, log, "closed_loop", integrator="rk4", initial_state=initial)
    errors = [shoulder - run["shoulder.position"], elbow - run["elbow.position"]]
    exact = [0.1 * (1.0 + pole * time) * np.exp(-pole * time) for pole in (10.0, 8.0)]
    return float(np.max(np.abs(np.array(errors) - np.array(exact))))


def test_under_computed_torque_the_error_of_an_arm_dies_away_as_asked_for() -> None:
    coarse, fine = gap_to_linear(2e-3), gap_to_linear(1e-3)
    assert fine < 2e-3
    assert coarse / fine == pytest.approx(2.0, abs=0.2)  # held torques and differences are late by a share of a sample


def test_a_force_loop_asks_for_a_torque_by_way_of_the_force() -> None:
    model = Model.from_toml(LEG)
    time = grid(12, 0.001)
    log = record(time, model, {"motor": np.full(12, 0.3), "valve": np.full(12, 0.9)})
    run = simulate(model, log, "closed_loop", initial_state=np.array([0.1, 0.6, 0.5, -0.4]))

    def length(knee: float) -> float:
        """Distance of (0.05, -0.1) on the thigh and on the shank, whose origin is 0.4 m below, turned about y."""
        x = 0.05 * np.cos(knee) - 0.1 * np.sin(knee)
        z = -0.4 - 0.05 * np.sin(knee) - 0.1 * np.cos(knee)
        return float(np.hypot(x - 0.05, z + 0.1))

    arm = (length(0.6 + 1e-6) - length(0.6 - 1e-6)) / 2e-6
    assert run["cylinder.length"][0] == pytest.approx(length(0.6), abs=1e-12)
    torque = 150.0 * (0.9 - 0.6) + 6.0 * 0.4
    command = 0.2e-3 * torque / arm + 0.5 * arm * -0.4
    # Held over two samples, late by one and a half.
    assert run["valve.command"][:3] == pytest.approx(np.full(3, command), rel=1e-6)
    assert run["motor.command"][0] == pytest.approx(3.0 * 0.2 - 0.2 * 0.5)


def test_with_a_feed_forward_an_ideal_actuator_gives_the_torque_itself() -> None:
    changes = (
        (
            'force_gain = { value = 0.2, unit = "mV/N" }',
            'feed_forward = { value = 0.5, unit = "mV/N" }\nforce_gain = 0.0',
        ),
        ('velocity_gain = { value = 0.5, unit = "V s/m" }\n', ""),
        ("sample_time = 0.002\ndelay = 0.0015\n", ""),
    )
    model = changed(LEG, *changes)
    time = grid(400, 1e-3)
    log = record(time, model, {"motor": np.full(400, 0.3), "valve": 0.1 * np.sin(5.0 * time) - 0.5})
    run = simulate(model, log, "closed_loop", initial_state=np.array([0.1, -0.5, 0.5, -0.4]))
    # The power of the force along the line is that of the torque at the joint: tau dq = F ds/dt.
    torque = 150.0 * (log["valve.reference"] - run["knee.position"]) - 6.0 * run["knee.velocity"]
    power = run["valve.force"] * run["cylinder.rate"]
    np.testing.assert_allclose(torque * run["knee.velocity"], power, atol=1e-9 * np.max(np.abs(power)))


def test_a_cylinder_in_a_force_loop_comes_to_rest_at_the_force_that_is_asked_for() -> None:
    """The valve integrates: without leakage no current is left at rest, and the spring k takes F = p (r - q) = k q."""
    loop = """
[controllers.stroke]
type = "force_loop"
actuator = "servo"
measures = "axis.position"
proportional = { value = 100.0, unit = "kN/m" }
force_gain = { value = 0.1, unit = "mA/kN" }
velocity_gain = { value = 8.0, unit = "mA s/m" }
delay = 0.0005
"""
    changes = (("internal_leakage = 1.7e-13", "internal_leakage = 0.0"), ("value = 589.927", "value = 50000.0"))
    model = changed(RIG + loop, *changes)
    run = simulate(model, record(grid(1500, 1e-3), model, {"servo": np.full(1500, 0.010)}), "closed_loop", substeps=4)
    place = 1e5 * 0.010 / (1e5 + 5e4)
    assert run["axis.position"][-1] == pytest.approx(place, rel=1e-6)
    assert run["servo.force"][-1] == pytest.approx(5e4 * place, rel=1e-6)
    assert np.max(np.abs(run["servo.command"])) > 1e-6


def test_a_pd_holds_the_length_of_a_line() -> None:
    changes = (
        ('type = "force_loop"', 'type = "pd"'),
        ('measures = "knee.position"', 'measures = "cylinder.length"'),
        ('proportional = { value = 150.0, unit = "N m/rad" }', 'proportional = { value = 20.0, unit = "V/m" }'),
        ('derivative = { value = 6.0, unit = "N m s/rad" }\n', 'derivative = { value = 1.0, unit = "V s/m" }\n'),
        ('force_gain = { value = 0.2, unit = "mV/N" }\n', ""),
        ('velocity_gain = { value = 0.5, unit = "V s/m" }\n', ""),
        ("sample_time = 0.002\ndelay = 0.0015\n", ""),
    )
    model = changed(LEG, *changes)
    assert model.channel_unit("valve.reference") == "m"
    log = record(grid(12, 0.001), model, {"motor": np.zeros(12), "valve": np.full(12, 0.35)})
    run = simulate(model, log, "closed_loop", initial_state=np.array([0.1, 0.6, 0.5, -0.4]))
    expected = 20.0 * (0.35 - run["cylinder.length"]) - run["cylinder.rate"]
    np.testing.assert_allclose(run["valve.command"], expected, atol=1e-12)


def test_parameters_have_names_units_and_bounds() -> None:
    leg = Model.from_toml(LEG)
    found = {name: p.unit for name, p in leg.parameters.items() if name.startswith(("hip_pd", "knee_force"))}
    assert found == {
        "hip_pd.proportional": "A/rad",
        "hip_pd.derivative": "A s/rad",
        "hip_pd.limit": "A",
        "knee_force.proportional": "N m/rad",
        "knee_force.derivative": "N m s/rad",
        "knee_force.feed_forward": "V/N",
        "knee_force.force_gain": "V/N",
        "knee_force.velocity_gain": "V s/m",
        "knee_force.limit": "V",
    }
    assert leg.parameters["knee_force.force_gain"].value == pytest.approx(0.2e-3)
    assert leg.parameters["hip_pd.limit"].minimum > 0.0
    arm = Model.from_toml(ARM.replace("derivative = [16.0, 20.0]", "derivative = [16.0, 20.0]\nlimit = [6.0, 8.0]"))
    found = {name: p.unit for name, p in arm.parameters.items() if name.startswith("arm.")}
    assert found == {
        "arm.proportional.elbow": "1/s^2",
        "arm.proportional.shoulder": "1/s^2",
        "arm.derivative.elbow": "1/s",
        "arm.derivative.shoulder": "1/s",
        "arm.limit.elbow": "A",
        "arm.limit.shoulder": "A",
    }
    assert arm.parameters["arm.proportional.shoulder"].uncertainty == 5.0
    assert arm.with_parameters({"arm.proportional.shoulder": 81.0}).to_dict()["controllers"]["arm"]["proportional"][
        1
    ] == {
        "value": 81.0,
        "unit": "1/s^2",
        "uncertainty": 5.0,
    }


def test_controllers_reach_the_core_and_read_back_as_they_are_written() -> None:
    leg, arm = Model.from_toml(LEG), Model.from_toml(ARM)
    for model in (leg, arm):
        assert Model.from_toml(model.to_toml()) == model
        assert Model.from_dict(model.to_dict()) == model
    force = described(leg)["controllers"][1]
    assert (force["sample_time"], force["delay"], force["actuator"]) == (0.002, 0.0015, 1)
    assert described(leg)["controllers"][0]["delay"] is None
    computed = described(arm)["controllers"][0]
    assert computed["actuators"] == [1, 0]
    assert computed["measures"] == [{"kind": "position", "joint": 1}, {"kind": "position", "joint": 0}]
    assert [arm.theta[i] for i in computed["proportional"]] == [64.0, 100.0]
    assert arm.controlled_actuators == ("first", "second")
    assert leg.controlled_actuators == ("motor", "valve")


def test_derivatives_through_the_loop_are_those_of_differences() -> None:
    model = Model.from_toml(LEG)
    time = grid(200, 0.001)
    log = record(time, model, {"motor": 0.3 * np.sin(9.0 * time), "valve": 0.6 + 0.2 * np.sin(7.0 * time)})
    initial = np.array([0.1, 0.6, 0.5, -0.4])
    names = ("knee_force.force_gain", "knee_force.proportional", "hip_pd.derivative", "shank.mass")
    columns = [list(model.parameters).index(name) for name in names]
    exact = simulate_arrays(model, log, "closed_loop", columns=columns, initial_state=initial).jacobian

    def outputs(theta: np.ndarray) -> np.ndarray:
        return simulate_arrays(model, log, "closed_loop", theta=theta, initial_state=initial).outputs

    for i, column in enumerate(columns):
        slopes = quotient(outputs, model.theta, column, 1e-4 * model.theta[column])
        np.testing.assert_allclose(exact[:, :, i], slopes, atol=1e-6 * np.max(np.abs(slopes)))


def test_a_sample_time_has_to_fit_the_record() -> None:
    model = Model.from_toml(f"{AXIS}sample_time = 0.0025\n")
    log = record(grid(12, 0.001), model, {"drive": np.zeros(12)})
    with pytest.raises(SimulationError) as caught:
        simulate(model, log, "closed_loop")
    message = str(caught.value)
    assert "controller `servo` samples every 0.0025 s, which is no whole multiple" in message
    assert "time step of 0.001 s" in message
    assert "sample_time 0.003 s" in message


BEAM = """
[beams.whip]
parent = "lower"
translation = [0.3, 0.0, 0.0]
rotation = [0.0, 1.5707963267948966, 0.0]
length = 0.4
level = "strain(2)"
deforms = ["bending_x"]
material = { young = 70e9, poisson = 0.3, density = 2700 }
section = { shape = "rectangle", width = 0.02, height = 0.004 }
"""

REFUSALS = [
    (AXIS, 'type = "pd"', 'type = "dp"', "controllers.servo", 'has the type "dp"'),
    (AXIS, 'type = "pd"\n', "", "controllers.servo", "has no type"),
    (AXIS, "derivative = {", "sample_tme = 0.1\nderivative = {", "controllers.servo.sample_tme", '"sample_time"?'),
    (AXIS, "derivative = {", "sample_time = 0\nderivative = {", "controllers.servo.sample_time", "is 0 s, but samples"),
    (AXIS, "derivative = {", "delay = -0.1\nderivative = {", "controllers.servo.delay", "is -0.1 s, but a command"),
    (
        AXIS,
        "derivative = {",
        'delay = "1"\nderivative = {',
        "controllers.servo.delay",
        'is "1", but has to be a number',
    ),
    (AXIS, '"V s/m"', '"V/m"', "controllers.servo.derivative", "has a wrong unit"),
    (AXIS, '"axis.position"', '"axis.velocity"', "controllers.servo.measures", "no joint position of the model"),
    (LEG, '"hip.position"', '"hip.velocity"', "controllers.hip_pd.measures", "no joint position or line length"),
    (LEG, '"knee.position"', '"cylinder.length"', "controllers.knee_force.measures", "no joint position of the model"),
    (LEG, 'actuator = "valve"', 'actuator = "motor"', "controllers.knee_force.actuator", '"hip_pd" already commands'),
    (
        LEG.replace('actuator = "motor"\nmeasures = "hip.position"', 'actuator = "valve"\nmeasures = "hip.position"'),
        'actuator = "valve"\nmeasures = "knee.position"',
        'actuator = "motor"\nmeasures = "knee.position"',
        "controllers.knee_force.measures",
        'drives the joint "hip", but a force_loop needs an actuator on a line or on the joint it measures',
    ),
    (LEG, "limit = 5.0", "limit = -5.0", "controllers.hip_pd.limit", "only more than 0 A"),
    (ARM, 'actuators = ["second", "first"]', "actuators = []", "controllers.arm.actuators", "at least one"),
    (ARM, 'actuators = ["second", "first"]\n', "", "controllers.arm.actuators", 'for example actuators = ["drive"]'),
    (ARM, '["second", "first"]', '["first", "second"]', "controllers.arm.measures[0]", "reorder the lists"),
    (ARM, '["second", "first"]', '["second", "second"]', "controllers.arm.actuators[1]", "already commands"),
    (ARM, '["second", "first"]', '["second", "frist"]', "controllers.arm.actuators[1]", 'did you mean "first"?'),
    (ARM, "derivative = [16.0, 20.0]", "derivative = [16.0]", "controllers.arm.derivative", "has 1 entries for 2"),
    (ARM, "derivative = [16.0, 20.0]", "derivative = 16.0", "controllers.arm.derivative", "has to be a list"),
    (
        ARM,
        'joint = "elbow"\ngain = { value = 3.0, unit = "N m/A" }\ncommand_unit = "A"',
        'joint = "elbow"\ntype = "dc_motor"\nresistance = 1.0\ntime_constant = 1e-3\ntorque_constant = 0.05',
        "actuators.second.type",
        'has the type "dc_motor", but computed_torque commands efforts',
    ),
    (ARM, 'unit = "1/s^2"', 'unit = "1/s"', "controllers.arm.proportional[1]", "has a wrong unit"),
    (ARM, "[controllers.arm]", f"{BEAM}\n[controllers.arm]", "controllers.arm", 'elastic coordinates of beam "whip"'),
]


@pytest.mark.parametrize(("text", "old", "new", "where", "words"), REFUSALS, ids=[f"{r[3]}-{r[4]}" for r in REFUSALS])
def test_what_a_controller_cannot_do_is_refused(text: str, old: str, new: str, where: str, words: str) -> None:
    refused(where, words, text, (old, new))
