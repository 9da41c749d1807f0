"""The blind proving ground: its machines agree with the package if nothing is hidden, its effects do as they say."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import cache

import numpy as np
import pytest

from blind import EFFECTS, MACHINES, Case, hideable, make_case, make_cases
from blind import case as case_module
from blind.batch import Plan
from blind.case import _plan
from blind.driveline import Driveline
from blind.loads import JointLoads
from blind.loop import Actuators, Sensors
from blind.machines.axis import LINEAR
from nightly import at_night
from vpm.catalogue import EFFECTS as CATALOGUE
from vpm.model import Model
from vpm.simulate import simulate

#: For each machine a seed whose base has no dry friction, which the two simulations write differently, and the largest
#: difference of both simulations relative to the largest value of the channel. That of the flexible arm is the error
#: of its eight segments and falls with the square of their number: the strain of the outer link differs by 1.0 % (root
#: mean square) with 8 and by 0.47 % with 12.
EXACT = {
    "axis_linear": (0, {"position": 1e-7, "command": 1e-6}),
    "axis_rotary": (0, {"position": 1e-6, "command": 1e-5}),
    "arm2r": (3, {"position": 1e-7, "command": 3e-6}),
    "flexible_arm": (3, {"position": 5e-4, "strain": 2.5e-2, "command": 1e-2}),
    "hydraulic_leg": (5, {"position": 1e-5, "pressure_a": 1e-3, "pressure_b": 1e-3, "command": 1e-4}),
    "servo_cylinder": (1, {"position": 1e-6, "pressure_a": 1e-4, "pressure_b": 1e-4, "command": 1e-6}),
}
#: Machines that are simulated fastest.
QUICK = ("axis_linear", "arm2r")
STEP = 1e-4


@contextmanager
def shorter() -> Iterator[None]:
    """Records of a third of the length, which say as much about a simulation."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(case_module, "SHORTEST", 3.5)
        patch.setattr(case_module, "LONGEST", 4.5)
        yield


@pytest.fixture
def short() -> Iterator[None]:
    """The same for a whole test."""
    with shorter():
        yield


@cache
def made(machine: str) -> dict[str, Case]:
    """A case without a secret, one with a wrong parameter, and some effects; without noise, with counts.

    Those of the flexible arm are as long as ever: what its eight segments lack is counted against the whole motion.
    """
    names = ("none", "parameters", *hideable(machine)[::9])
    with nullcontext() if machine == "flexible_arm" else shorter():
        cases = make_cases(machine, [(name, EXACT[machine][0]) for name in names], noise_level=0.0, recalibrate=False)
    return dict(zip(names, cases, strict=True))


def planned(machine: str, hidden: str, seed: int) -> Plan:
    """A case that nobody simulates."""
    return _plan(MACHINES[machine], hidden, seed, 1.0, recalibrate=False)


@pytest.mark.parametrize("machine", at_night(EXACT, but=QUICK))
def test_a_machine_without_secrets_is_the_model(machine: str) -> None:
    tolerances, case = EXACT[machine][1], made(machine)["none"]
    assert "coulomb" not in case.model_text
    for record, exact in zip((*case.train, *case.validate), case.oracle.with_effect, strict=True):
        # The steps of the model are those of its controllers, at 500 Hz the larger part of the difference.
        run = simulate(case.model(), record, "closed_loop", substeps=4 if machine == "arm2r" else 1)
        for channel, values in exact.items():
            tolerance = tolerances[channel.partition(".")[2]]
            assert np.abs(run[channel] - values).max() < tolerance * np.abs(values).max(), channel


@pytest.mark.parametrize("machine", at_night(MACHINES, but=QUICK))
def test_every_case_is_a_model_with_records(machine: str) -> None:
    for name, case in made(machine).items():
        missing = case.truth.hidden
        assert [hidden.name for hidden in missing] == [name] * (name in EFFECTS)
        model = case.model()
        for record in (*case.train, *case.validate):
            assert 3.0 < record.duration < 12.0
            assert set(record) >= {f"{joint}.position" for joint in model.joints}
        adjustable = {key for key, parameter in model.parameters.items() if parameter.adjustable}
        assert len(adjustable) == len(case.truth.nominal)
        there = [(effect.type.name, effect.at) for effect in model.effects]
        assert all((hidden.name, hidden.site) not in there for hidden in missing)


def test_records_are_as_long_as_a_patient_person_makes_them() -> None:
    truth = planned("axis_linear", "none", 0)
    assert all(9.0 <= path.shape[1] / truth.draft.rate <= 12.0 for path in truth.paths)


@pytest.mark.usefixtures("short")
def test_a_case_follows_from_its_seed_alone() -> None:
    """Whatever else is made beside it."""
    alone = make_case("axis_rotary", "hysteresis", 5, recalibrate=False)
    beside = make_cases("axis_rotary", [("none", 1), ("hysteresis", 5), ("spring", 6), ("hysteresis", 7)])[1]
    assert alone.model_text == beside.model_text
    for one, other in zip(alone.train, beside.train, strict=True):
        for channel in one:
            np.testing.assert_array_equal(one[channel], other[channel])
    again = make_case("axis_rotary", "hysteresis", 8, recalibrate=False)
    assert again.model_text != alone.model_text
    hysteresis = beside.truth.hidden
    assert hysteresis == alone.truth.hidden


#: Effects that the generators do not hide, with the tests that show them.
NOT_HIDDEN = {
    "current_ripple",  # test_ranking
    "drive_friction",  # test_drive_friction
    "empirical_force",  # test_empirical
    "lugre_friction",  # test_frictions
    "warming_friction",  # as friction_drift, below
}


def test_names_of_known_effects_are_those_of_the_catalogue() -> None:
    known = {name for name, effect in EFFECTS.items() if effect.known}
    assert not {name for name, effect in EFFECTS.items() if not effect.known} & set(CATALOGUE)
    assert known - set(CATALOGUE) == {"friction_drift"}
    assert set(CATALOGUE) - known == NOT_HIDDEN
    drifting = make_case("axis_linear", "friction_drift", 0).truth.hidden[0]
    assert drifting.name == "warming_friction"
    assert set(drifting.parameters) < {one.name for one in CATALOGUE["warming_friction"].parameters}


def test_effects_where_they_make_no_sense_are_refused() -> None:
    with pytest.raises(ValueError, match="makes no sense on axis_linear"):
        make_case("axis_linear", "gravity_tilt", 0)


@pytest.mark.usefixtures("short")
def test_the_oracle_sees_clear_effects_and_no_others() -> None:
    names = ["none", "parameters", "bias_force", "payload"]
    nothing, wrong, clear, absorbed = make_cases("axis_linear", [(name, 0) for name in names])
    assert nothing.oracle.strength == wrong.oracle.strength == 0.0
    assert not nothing.oracle.solvable
    assert clear.oracle.solvable
    assert absorbed.oracle.strength < 0.05 * max(absorbed.oracle.gap.values())


def test_wrong_parameters_are_wrong_and_others_nearly_right() -> None:
    truth = planned("axis_rotary", "parameters", 4).truth
    for key, true in truth.parameters.items():
        error = abs(truth.nominal[key] / true - 1.0)
        assert (error >= 0.1) == (key in truth.wrong)
    exact = planned("axis_rotary", "none", 4).truth
    assert exact.nominal == exact.parameters


def bare_axis(**values: float) -> Driveline:
    """An axis of 2 kg, half of it the motor's, with some effects."""
    column = {"body.mass": 1.0, "axis.rotor": 1.0, "drive.gain": 1.0}
    column |= {key.replace("__", "."): value for key, value in values.items()}
    return LINEAR.plant([column], STEP)


def push(axis: Driveline, force: float, seconds: float) -> None:
    for k in range(round(seconds / STEP)):
        axis.advance(np.array([[force]]), k * STEP)


def test_dry_friction_sticks_and_takes_a_step_at_reversal() -> None:
    axis = bare_axis(axis__coulomb_friction__coulomb=3.0)
    push(axis, 2.9, 1.0)
    assert axis.q[0, 0] == 0.0
    push(axis, 5.0, 0.1)
    forward = axis.a[0, 0]
    assert forward == pytest.approx((5.0 - 3.0) / 2.0)
    push(axis, -5.0, 1.0)
    assert axis.a[0, 0] == pytest.approx((-5.0 + 3.0) / 2.0)


def test_stribeck_friction_holds_more_than_it_brakes() -> None:
    values = {"axis__coulomb_friction__coulomb": 3.0, "axis__stribeck_friction__stribeck": 1.0}
    axis = bare_axis(**values, axis__stribeck_friction__stribeck_velocity=0.01)
    push(axis, 3.9, 0.5)
    assert axis.q[0, 0] == 0.0
    push(axis, 4.1, 0.5)
    assert axis.a[0, 0] == pytest.approx(1.1 / 2.0)


def test_play_loses_motion_and_a_contact_only_pushes() -> None:
    values = {"axis__backlash__gap": 1e-3, "axis__backlash__stiffness": 1e5, "axis__backlash__damping": 30.0}
    axis = bare_axis(**values, axis__viscous_friction__viscous=20.0)
    push(axis, 1.0, 1.0)
    ahead = (axis.motor_q - axis.q)[0, 0]
    push(axis, -1.0, 2.0)
    behind = (axis.motor_q - axis.q)[0, 0]
    assert ahead - behind == pytest.approx(1e-3 + 2 * 0.5 / 1e5, rel=0.02)
    gear = bare_axis(**values)
    assert gear.gear(np.array([[4e-4]]), np.array([[1.0]]))[0, 0] == 0.0
    assert gear.gear(np.array([[6e-4]]), np.array([[-9.0]]))[0, 0] == 0.0


def test_a_compliant_joint_rings_at_its_frequency() -> None:
    axis = bare_axis(axis__joint_compliance__stiffness=1e4)
    axis.motor_q = np.array([[1e-3]])
    twist = np.array([_twist(axis) for _ in range(round(1.0 / STEP))])
    rate = np.sum(np.diff(np.sign(twist)) != 0) / 2.0
    assert rate == pytest.approx(np.sqrt(1e4 * 2.0) / (2.0 * np.pi), abs=0.6)
    assert np.abs(twist[-1000:]).max() == pytest.approx(1e-3, rel=1e-2)


def _twist(axis: Driveline) -> float:
    axis.advance(np.zeros((1, 1)), 0.0)
    return float((axis.motor_q - axis.q)[0, 0])


@pytest.mark.parametrize(
    "effect",
    ["viscous_friction", "coulomb_friction", "stribeck_friction", "asymmetric_friction", "hysteresis", "quadratic_drag",
     "position_dependent_friction", "end_stop"],
)  # fmt: skip
def test_dissipative_effects_take_energy_over_every_cycle(effect: str) -> None:
    case = planned("axis_linear", effect, 2)
    values = {f"axis.{effect}.{key}": value for key, value in case.truth.hidden[0].parameters.items()}
    if effect == "position_dependent_friction":
        cosine, sine = (values.pop(f"axis.{effect}.{part}") for part in ("cosine", "sine"))
        values[f"axis.{effect}.coulomb"] = 2.0 * float(np.hypot(cosine, sine))
        values[f"axis.{effect}.phase"] = float(np.arctan2(-sine, cosine))
    if effect == "asymmetric_friction":
        values |= {f"axis.{key}": value for key, value in _friction(case).items()}
    loads, taken, width = JointLoads(["axis"], [values], STEP), [], 0.3
    for k in range(round(4.0 / STEP)):
        phase = 2.0 * np.pi * k * STEP
        q, v = np.array([[width * np.sin(phase)]]), np.array([[width * 2.0 * np.pi * np.cos(phase)]])
        dry = loads.dry(q, v, 0.0, np.zeros((1, 1)))
        effort = loads.smooth(q, v, 0.0, np.zeros((1, 1))) + (0.0 if dry is None else dry * np.sign(v))
        taken.append(float((effort * v)[0, 0]) * STEP)
    cycles = np.array(taken).reshape(4, -1).sum(1)
    assert np.all(cycles[1:] > 0.0)


def _friction(case: Plan) -> dict[str, float]:
    return {key.removeprefix("axis."): value for key, value in case.truth.parameters.items() if "friction" in key}


def test_buffers_delay_exactly_and_a_lag_is_exponential() -> None:
    late = Actuators(["drive"], [{"drive.input_delay.time": 0.0025}], 0.001, 10)
    means = []
    for k in range(6):
        late.sample(k, np.array([[float(k >= 1)]]), np.zeros((1, 1)))
        means.append(np.mean([late.step(j)[0, 0] for j in range(10)]))
    np.testing.assert_allclose(means, [0.0, 0.0, 0.0, 0.5, 1.0, 1.0], atol=1e-12)
    lag = Actuators(["drive"], [{"drive.actuator_lag.time_constant": 0.005}], 0.001, 10)
    lag.sample(0, np.zeros((1, 1)), np.zeros((1, 1)))
    for k in range(5):
        lag.sample(k + 1, np.ones((1, 1)), np.zeros((1, 1)))
        for j in range(10):
            lag.step(j)
    assert lag.state is not None
    assert lag.state[0, 0] == pytest.approx(1.0 - np.exp(-1.0), rel=1e-12)


def test_dead_zone_and_limit_cut_commands() -> None:
    drive = Actuators(["drive"], [{"drive.dead_zone.width": 0.2, "drive.saturation.limit": 1.0}], 0.001, 10)
    shown = []
    for command in (0.1, -0.7, 3.0):
        drive.sample(1, np.array([[command]]), np.zeros((1, 1)))
        shown.append(drive.step(0)[0, 0])
    np.testing.assert_allclose(shown, [0.0, -0.5, 1.0])


def test_sensors_count_scale_shift_and_lag() -> None:
    column = {"s.quantum": 0.01, "s.sensor_gain.excess": 0.5, "s.sensor_offset.value": 1.0}
    sensor = Sensors(["s"], [column], 0.001, 10)
    assert sensor.read(np.array([[0.333]]), np.zeros((1, 1)))[0, 0] == pytest.approx(1.50)
    late = Sensors(["s"], [{"s.sensor_delay.time": 0.00125}], 0.001, 10)
    for k in range(40):
        late.keep(np.array([[1e-4 * k]]))
    assert late.read(np.array([[39e-4]]), np.zeros((1, 1)))[0, 0] == pytest.approx(39e-4 - 0.00125)


def test_model_texts_can_be_written_and_read_back() -> None:
    model = made("axis_linear")["parameters"].model()
    assert Model.from_toml(model.to_toml()) == model


@pytest.mark.parametrize(
    ("machine", "pair"),
    [
        ("axis_rotary", ("asymmetric_friction", "coulomb_friction")),
        ("axis_linear", ("asymmetric_friction", "viscous_friction")),
        ("arm2r", ("coulomb_friction@elbow", "stribeck_friction@elbow")),
    ],
)
def test_a_refinement_can_be_hidden_with_what_it_refines(machine: str, pair: tuple[str, str]) -> None:
    for seed in range(4):
        plan = _plan(MACHINES[machine], pair, seed, 1.0, recalibrate=False)
        hidden = {h.name: h for h in plan.truth.hidden}
        assert list(hidden) == [name.partition("@")[0] for name in pair]
        assert not {(h.name, h.site) for h in hidden.values()} & set(plan.base), "the nominal model lacks both"
        assert not any(h.name in key and key.startswith(h.site) for h in hidden.values() for key in plan.truth.nominal)
        if "coulomb_friction" in hidden and "asymmetric_friction" in hidden:
            difference = hidden["asymmetric_friction"].parameters["coulomb_difference"]
            assert abs(difference) < 2.0 * hidden["coulomb_friction"].parameters["coulomb"], "each direction dissipates"
    model = Model.from_toml(plan.machine.text({**plan.without, **plan.truth.nominal}, plan.draft, plan.base))
    assert not {(effect.name, effect.at) for effect in model.effects} & {(h.name, h.site) for h in hidden.values()}
