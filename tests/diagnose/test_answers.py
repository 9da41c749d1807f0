"""What parts of a machine answered before is what they answer again; noise of drives has the colour they give it."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module

import numpy as np
import pytest

from quotients import of_residual
from shared_cases import shared_case
from vpm.discrepancy.noise.noise_floor import noise_floor, structure
from vpm.discrepancy.noise.noise_spectrum import noise_shapes, noise_spectrum
from vpm.identify import InverseDynamicsProblem, gaps
from vpm.identify.drives import SLOPE_STEP
from vpm.identify.following import Memo
from vpm.identify.parts import carried, drives_of
from vpm.identify.response_along_motion import Response
from vpm.model import Model
from vpm.numbers import Array

Exact = tuple[Model, InverseDynamicsProblem, InverseDynamicsProblem]


@pytest.fixture(scope="module")
def exact() -> Exact:
    """A servo-cylinder of the proving ground whose model lacks nothing, with its training and validation records."""
    case = shared_case("servo_cylinder", "none", 1)
    model = Model.from_toml(case.true_text)
    training = InverseDynamicsProblem(model, case.train)
    cutoff = min(m.cutoff for m in training.motions)
    return model, training, InverseDynamicsProblem(model, case.validate, cutoff=cutoff)


@pytest.mark.nightly
def test_remembered_answers_are_those_of_a_problem_that_remembers_nothing(exact: Exact) -> None:
    model, training, _ = exact
    more = model.with_effect("hysteresis", at="axis", force=5.0, displacement=1e-3)
    more = more.with_effect("internal_leakage", at="servo", coefficient=1e-13)
    names = (
        "axis.hysteresis.force",
        "slide.mass",
        "servo.internal_leakage.coefficient",
        "servo.valve.flow_gain",
        "axis.friction.viscous",
    )
    columns = [more.index(name) for name in names]
    first = training.evaluate(more, more.theta, columns[:3])
    training.evaluate(model, model.theta, [model.index("servo.valve.flow_gain")])
    residual, jacobian = training.evaluate(more, more.theta, columns)
    fresh = InverseDynamicsProblem(model, training.experiments)
    expected, slopes = fresh.evaluate(more, more.theta, columns)
    np.testing.assert_array_equal(residual, expected)
    np.testing.assert_array_equal(jacobian, slopes)
    np.testing.assert_array_equal(first[1], slopes[:, :3])


@pytest.mark.nightly
def test_long_steps_show_less_than_the_noise(exact: Exact, monkeypatch: pytest.MonkeyPatch) -> None:
    """What no log shows is not worth three times the time; where it would show, steps stay short."""
    model, training, _ = exact
    quick = InverseDynamicsProblem(model, training.experiments)
    quick.take_long_steps()
    assert set(quick.integrators) == {"linearly_implicit"}
    assert training.motions[0].dt < SLOPE_STEP
    columns = [
        model.index(name) for name in ("servo.valve.flow_gain", "pump.oil.bulk_modulus", "servo.valve.frequency")
    ]
    residual, slopes = training.evaluate(model, model.theta, columns)
    rough, rough_slopes = quick.evaluate(model, model.theta, columns)
    assert 0.0 < np.linalg.norm(rough - residual) < 0.03 * np.linalg.norm(residual)
    assert np.all(np.linalg.norm(rough_slopes - slopes, axis=0) < 0.01 * np.linalg.norm(slopes, axis=0))
    monkeypatch.setattr(import_module(InverseDynamicsProblem.__module__), "ROUGH", 1e-9)
    exacting = InverseDynamicsProblem(model, training.experiments)
    exacting.take_long_steps()
    assert set(exacting.integrators) == {"auto"}
    np.testing.assert_array_equal(exacting.evaluate(model, model.theta)[0], residual)


def test_long_steps_may_be_off_by_a_share_of_what_was_measured() -> None:
    """A model that lacks something may answer with next to nothing where a lot was measured."""
    alike = import_module(InverseDynamicsProblem.__module__)._alike
    effort, none = np.ones((50, 1)), np.zeros((50, 1, 0))
    exact, rough = (Response(effort, effort, none, np.full((50, 1), seen), none) for seen in (1.0, 1.01))
    assert not alike(exact, rough, np.ones((50, 1)))
    assert alike(exact, rough, np.full((50, 1), 20.0))
    assert not alike(exact, replace(exact, applied=1.01 * effort), np.full((50, 1), 20.0))


@pytest.mark.nightly
def test_what_later_commands_ask_for_is_not_remembered_from_others(exact: Exact) -> None:
    model, training, _ = exact
    residual, _ = training.evaluate(model, model.theta)
    later, _ = training.later().evaluate(model, model.theta)
    assert np.linalg.norm(later - residual) > 0.03 * np.linalg.norm(residual)
    np.testing.assert_array_equal(training.evaluate(model, model.theta)[0], residual)


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["slide.mass", "axis.friction.viscous", "servo.valve.flow_gain"])
def test_the_derivative_by_parts_is_that_of_the_residual(exact: Exact, name: str) -> None:
    model, training, _ = exact
    place = model.index(name)
    _, jacobian = training.evaluate(model, model.theta, [place])
    slope = of_residual(training, model, place, 1e-5 * model.theta[place])
    assert np.abs(jacobian[:, 0] - slope).max() < 1e-5 * np.abs(slope).max()


@pytest.mark.nightly
def test_noise_of_a_valve_is_no_structure(exact: Exact) -> None:
    model, training, validation = exact
    fitted, residual = (problem.evaluate(model, model.theta)[0] for problem in (training, validation))
    assert not structure(model, training, validation, fitted, residual).present
    floor = noise_floor(model, validation, residual, "closed_loop")
    for channel, (size, _, _) in gaps(validation, residual).items():
        assert 0.75 * size < floor[channel] < 1.5 * size


@pytest.mark.nightly
def test_the_size_of_coloured_noise_is_read_off_its_quiet_part(exact: Exact) -> None:
    model, training, _ = exact
    shape = next(each for each in noise_shapes(model, training) if each is not None)
    own, drive = shape.instruments, shape.drives
    generator = np.random.default_rng(3)
    n = 2 * (own.size - 1)
    spectrum = own + 40.0 * own.mean() / drive.mean() * drive
    waves = generator.standard_normal((2, own.size)) * np.sqrt(0.5 * spectrum * n)
    residual = np.fft.irfft(waves[0] + 1j * waves[1], n)
    line = 20.0 * residual.std() * np.cos(2.0 * np.pi * 5.0 * np.arange(n) / n)
    found = noise_spectrum(residual + line, shape, 0.4)
    assert found.sum() == pytest.approx(spectrum.sum(), rel=0.35)


@pytest.mark.nightly
def test_cylinders_of_a_firm_supply_answer_one_by_one_as_they_do_together() -> None:
    model = Model.from_toml(shared_case("hydraulic_leg", "none", 21).true_text)

    def groups(machine: Model) -> list[tuple[str, ...]]:
        drives = drives_of(machine, machine.joints)
        assert drives is not None
        return [part.model.actuators for part in drives.parts]

    assert groups(model) == [("hip_drive",), ("knee_drive",)]
    sagging = model.with_effect("supply_drop", at="pump", resistance=1e9, time_constant=0.01)
    assert groups(sagging) == [("hip_drive", "knee_drive")]


@pytest.mark.nightly
def test_the_answers_of_single_cylinders_make_up_that_of_the_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    case = shared_case("hydraulic_leg", "none", 21)
    model = Model.from_toml(case.true_text).with_effect("sensor_offset", at="knee_encoder", value=0.01)
    columns = [model.index("pump.oil.bulk_modulus"), model.index("upper.mass")]
    apart = InverseDynamicsProblem(model, case.train[:1])
    values, slopes = apart.evaluate(model, model.theta, columns)
    monkeypatch.setattr(import_module(Response.__module__), "drives_of", lambda *_: None)
    whole, whole_slopes = InverseDynamicsProblem(model, case.train[:1]).evaluate(model, model.theta, columns)
    for block in apart.blocks:
        own = block.samples
        assert np.abs(values[own] - whole[own]).max() <= 1e-4 * np.abs(whole[own]).max()
        largest = np.abs(whole_slopes[own]).max(axis=0)
        assert (np.abs(slopes[own] - whole_slopes[own]).max(axis=0) <= 1e-4 * largest).all()


@pytest.mark.nightly
def test_what_carries_the_effort_of_a_motion_has_no_cylinders() -> None:
    """What the motion needs is the same without them, as are its derivatives."""
    case = shared_case("hydraulic_leg", "none", 21)
    model = Model.from_toml(case.true_text).with_effect("sensor_offset", at="knee_encoder", value=0.01)
    part, m = carried(model), InverseDynamicsProblem(model, case.train[:1]).motions[0]
    assert not part.model.actuators
    motion = (m.position[:50], m.velocity[:50], m.acceleration[:50], m.dt)
    names = ("upper.mass", "knee_encoder.offset.value")
    alone = part.model.core.required(model.theta[part.places], *motion, [part.model.index(name) for name in names])
    whole = model.core.required(model.theta, *motion, [model.index(name) for name in names])
    for one, other in zip(alone, whole, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12 * np.abs(other).max())


def test_a_memo_forgets_what_is_oldest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_module(Memo.__module__), "MOST_NUMBERS", 50)
    memo = Memo()
    worked: list[int] = []

    def work(key: int, names: Sequence[str]) -> tuple[Array, Array]:
        worked.append(key)
        return np.ones((10, 1)), np.ones((10, 1, len(names)))

    for key in (1, 2, 3, 3, 2, 1):
        memo.recall(key, ["a"], partial(work, key))
    assert worked == [1, 2, 3, 1]
