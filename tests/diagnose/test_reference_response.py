"""A delay and a lag, discriminated by the response to the reference alone."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student_t

import vpm
from blind import Case
from shared_cases import shared_case
from vpm.discrepancy.confirmation.confirmation import Data, Judged, judge
from vpm.discrepancy.confirmation.reference_response import Runs, Verdict, compare_driven, inexact, part
from vpm.discrepancy.confirmation.refusal import NEGLIGIBLE
from vpm.discrepancy.confirmation.whittle_likelihood import fit_prediction, predict, spectra, weighted
from vpm.identify import InverseDynamicsProblem, OutputErrorProblem
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Setup

#: A lag, and the delays that it may be taken for.
LATE = ("actuator_lag", "input_delay", "sensor_delay")


def fitted_late(case: Case) -> tuple[Data, list[Judged]]:
    """A lag and a delay, each fitted beside the parameters that may be calibrated."""
    model = case.model()
    training = InverseDynamicsProblem(model, case.train)
    validation = InverseDynamicsProblem(model, case.validate, cutoff=min(m.cutoff for m in training.motions))
    data = Data(training, validation, OutputErrorProblem(model, case.validate, "closed_loop"))
    free = tuple(p.name for p in model.parameters.values() if p.adjustable)
    found = []
    for name, time in (("actuator_lag", "time_constant"), ("input_delay", "time")):
        late = model.with_effect(name, at="drive", **{time: 2e-3})
        own = next(effect for effect in late.effects if effect.name == name).parameter_names[time]
        found.append(judge(late, (*free, own), data, {}))
    return data, found


def test_a_long_lag_is_told_from_a_delay_and_a_short_delay_is_not_told_from_a_lag() -> None:
    data, (lag, delay) = fitted_late(shared_case("axis_linear", "actuator_lag", 5))
    told = compare_driven(lag, delay, data)
    assert told is not None
    assert told.prefers_first()
    assert told.apart > 30.0
    assert abs(told.first) < 3.0 < abs(told.second)
    turned = compare_driven(delay, lag, data)
    assert turned is not None
    assert not turned.prefers_first()
    data, (lag, delay) = fitted_late(shared_case("axis_linear", "input_delay", 5))
    told = compare_driven(lag, delay, data)
    assert told is not None
    assert told.apart < 1.0
    assert not told.prefers_first()
    assert compare_driven(lag, delay, replace(data, simulation=None)) is None


def test_a_run_beside_another_shares_its_derivatives_and_is_worked_out_once(monkeypatch: pytest.MonkeyPatch) -> None:
    data, (lag, delay) = fitted_late(shared_case("axis_linear", "input_delay", 5))
    asked = list[int]()
    evaluate = OutputErrorProblem.evaluate

    def counted(problem: OutputErrorProblem, model: vpm.Model, theta: Array, columns: Sequence[int] = ()) -> object:
        asked.append(len(columns))
        return evaluate(problem, model, theta, columns)

    monkeypatch.setattr(OutputErrorProblem, "evaluate", counted)
    runs = Runs(data)
    first = runs(lag)
    assert asked[:2] == [0, len(lag.free)]
    done = len(asked)
    told = compare_driven(delay, lag, data, runs)
    assert asked[done : done + 2] == [0, 1]
    done = len(asked)
    turned = compare_driven(lag, delay, data, runs)
    assert len(asked) == done
    assert runs(lag) is first
    assert told is not None
    assert turned is not None
    assert (turned.first, turned.second) == (told.second, told.first)


@pytest.mark.nightly
def test_fast_parts_of_a_run_tell_a_short_lag() -> None:
    # Below the few hertz that the balance compares, the two differ by less than the noise here.
    data, (lag, delay) = fitted_late(shared_case("axis_linear", "actuator_lag", 2004))
    told = compare_driven(lag, delay, data)
    assert told is not None
    assert told.prefers_first()
    assert told.apart > 3.0


def test_a_gap_that_a_parameter_makes_too_tells_nothing() -> None:
    data, (lag, _) = fitted_late(shared_case("axis_linear", "actuator_lag", 5))
    values = {name: 1.001 * lag.model.parameters[name].value for name in lag.free if name.endswith("viscous")}
    moved = replace(lag, model=lag.model.with_parameters(values))
    told = compare_driven(lag, moved, data)
    assert told is not None
    assert told.apart < 0.1


def test_a_small_difference_counts_as_much_as_it_says() -> None:
    # Of Student's distribution with one degree of freedom the density is as 1 / (1 + z^2).
    seen = Verdict(1.5, first=-0.3, second=1.8)
    assert seen.evidence == pytest.approx(np.log(student_t.pdf(-0.3, 1) / student_t.pdf(1.8, 1)))
    assert seen.prefers_first()
    assert not seen.prefers_first(4.0)
    assert Verdict(100.0, first=4.0, second=104.0).prefers_first()


def test_data_that_contradict_both_models_tell_little() -> None:
    # By normal errors the first would be 6 and 11 times as likely.
    assert not Verdict(1.5, first=-6.0, second=7.2).prefers_first()
    assert not Verdict(0.84, first=-2.43, second=3.30).prefers_first()
    assert not Verdict(0.2, first=-1.0, second=1.2).prefers_first()


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("hidden", "seed", "named"),
    [("actuator_lag", 5, {"actuator_lag"}), ("input_delay", 2, {"input_delay", "sensor_delay"})],
)
def test_a_lag_is_named_only_where_it_shows(hidden: str, seed: int, named: set[str]) -> None:
    """A late drive and a late encoder of one axis are one delay."""
    case = shared_case("axis_linear", hidden, seed)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=LATE, workers=1)
    (effect,) = why.effects
    assert effect.name in named


@pytest.mark.nightly
@pytest.mark.parametrize("hidden", ["input_delay", "sensor_delay"])
def test_a_part_of_a_sampling_interval_is_named_where_it_explains_most(hidden: str) -> None:
    case = shared_case("axis_linear", hidden, 2003)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=LATE, workers=1)
    assert [effect.name for effect in why.effects] == ["input_delay"]
    late, truth = why.effects[0].parameters[0], case.truth.hidden[0].parameters["time"]
    assert late.value < case.train[0].dt
    assert late.value == pytest.approx(truth, rel=0.1)
    assert why.verdict == "effect_found"


@pytest.mark.nightly
def test_a_delay_of_a_machine_that_sticks_is_timed_along_its_own_run() -> None:
    # The inverse-dynamics residual says 3.2 ms instead of 1.3 ms, with which a simulation gets worse.
    case = shared_case("axis_linear", "input_delay", 22)
    truth = case.truth.hidden[0].parameters["time"]
    data, (_, delay) = fitted_late(case)
    name = delay.free[-1]
    assert delay.model.parameters[name].value > 1.5 * truth
    assert data.simulation is not None
    free = (*delay.free, "axis.friction.transition_velocity")
    run = fit_prediction(delay.model, free, data.training.experiments, data.simulation.setup)
    value, std = run.estimated(name)
    assert value == pytest.approx(truth, abs=3.0 * std)
    assert std < 0.1 * truth


@pytest.mark.nightly
def test_a_delay_of_a_machine_that_sticks_is_named() -> None:
    case = shared_case("axis_linear", "input_delay", 22)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=("input_delay",), workers=1)
    assert [effect.name for effect in why.effects] == ["input_delay"]
    truth = case.truth.hidden[0].parameters["time"]
    assert why.effects[0].parameters[0].value == pytest.approx(truth, rel=0.1)


@pytest.mark.nightly
def test_steps_of_a_run_beside_dry_friction_do_not_blur_what_parts_a_delay_from_a_lag() -> None:
    # With three steps in the delay they are off by five times that, and speak for the lag.
    case = shared_case("axis_linear", "input_delay", 103)
    time, record = case.truth.hidden[0].parameters["time"], case.train[0].split(0.3)[0]
    sticks = Model.from_toml(case.true_text).with_parameters({"axis.friction.transition_velocity": 1e-5})
    delay, lag = (
        sticks.with_effect("input_delay", at="drive", time=time),
        sticks.with_effect("actuator_lag", at="drive", time_constant=time),
    )
    ideal = [
        OutputErrorProblem(model, [record], "closed_loop", setup=Setup(substeps=40)).evaluate(model, model.theta)[0]
        for model in (delay, lag)
    ]
    name = delay.effect("input_delay", "drive").parameter_names["time"]
    run = predict(delay, (name,), [record], Setup())
    assert np.linalg.norm(run.left - ideal[0]) < np.linalg.norm(ideal[1] - ideal[0])


def test_one_noise_counts_once_however_many_readings_show_it() -> None:
    generator = np.random.default_rng(5)
    noise = generator.standard_normal((2000, 2)) + 1j * generator.standard_normal((2000, 2))
    gap = generator.standard_normal((2000, 1)) + 1j * generator.standard_normal((2000, 1))
    # The second reading shows the noise of the first once more, with a little of its own; the gap as well.
    left = np.column_stack([noise[:, 0], noise[:, 0] + 0.01 * noise[:, 1]])
    same, single = np.stack([gap, gap], axis=1), gap[:, None, :]
    both, alone = (float(np.sum(weighted(*pair) ** 2)) for pair in ((same, left), (single, left[:, :1])))
    assert both == pytest.approx(alone, rel=0.1)
    # What shows in one reading alone stands out from what both share.
    apart = np.stack([gap, np.zeros_like(gap)], axis=1)
    assert float(np.sum(weighted(apart, left) ** 2)) > 1e3 * alone


@pytest.mark.nightly
def test_readings_of_a_cylinder_go_with_its_joint_and_those_of_joints_alone() -> None:
    case = shared_case("servo_cylinder", "none", 1)
    model = case.model()
    problem = OutputErrorProblem(model, case.validate, "closed_loop")
    found = spectra(model, problem, np.zeros((problem.blocks[-1].samples.stop, 1)))
    assert [one.shape[1] for one in found] == [3]
    leg = shared_case("hydraulic_leg", "none", 21)
    problem = OutputErrorProblem(leg.model(), leg.validate, "closed_loop")
    found = spectra(leg.model(), problem, np.zeros((problem.blocks[-1].samples.stop, 1)))
    assert [one.shape[1] for one in found] == [3, 3]


def test_what_no_model_of_oil_is_exact_to_does_not_tell_late_from_slow() -> None:
    # One slow sine whose reading is 0.2 % off looks sure of a lag against noise alone.
    generator = np.random.default_rng(1)
    noise = 1e-5 * (generator.standard_normal(400) + 1j * generator.standard_normal(400))
    read = np.full(400, 1e-4, dtype=np.complex128)
    read[8] = 1.0
    gap = 1e-3j * read
    left = noise + 2.0 * np.where(np.arange(400) == 8, gap, 0.0)
    transforms = [np.stack([left, gap], axis=1)[:, None, :]]
    _, alone = part(transforms)
    apart, beside = part(transforms, [NEGLIGIBLE * read[:, None, None]])
    assert alone > 5.0
    assert abs(beside) < 1.0
    assert apart < 1.0


@pytest.mark.nightly
def test_readings_of_a_cylinder_are_what_a_model_of_oil_is_not_exact_to() -> None:
    case = shared_case("servo_cylinder", "none", 1)
    record = case.train[0].split(0.1)[0]
    run = predict(case.model(), ("servo.valve.flow_gain",), [record], Setup())
    floor = inexact(run)
    assert floor is not None
    read = np.stack([NEGLIGIBLE * block.weight * record[block.channel] for block in run.problem.blocks], axis=1)
    assert [one.shape[1] for one in floor] == [3]
    assert float(np.abs(floor[0]).max()) < float(np.abs(np.fft.rfft(read, axis=0)).max())
