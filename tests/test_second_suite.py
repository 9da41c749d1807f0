"""The second suite of blind cases: its machines keep the laws of mechanics, and agree with vpm if nothing is hidden."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

import vpm
from second_suite import belt
from second_suite.cases import CLEAR, MACHINES, make_case, requests, strength
from second_suite.cases import _log as log_of
from second_suite.cases import _nudged as nudged
from second_suite.cases import _records as records_of
from second_suite.laws import SHARES, YIELD_WAYS, MaxwellSlip
from second_suite.loop import Drives
from second_suite.machine import Machine, columns_of
from second_suite.plant import Hidden, Plant
from second_suite.score import answered, table
from vpm import Experiment, Model
from vpm.errors import ValidityWarning

Array = NDArray[np.float64]
NAMES = sorted(MACHINES)
#: Largest difference of the positions of both programs over the way that is made, in free runs of one or two seconds:
#: both step the same equations, with errors of second order in the generator's steps, 0.25 to 0.5 ms, of the arm 2 ms.
#: Where gravity lets errors grow, as in the arm's shoulder, they do.
ALIKE = {"belt": 1e-6, "rotary": 1e-5, "cart": 2e-4, "scara": 1e-5, "hoist": 1e-5, "arm": 1e-3}


def without_dry_friction(m: Machine) -> dict[str, float]:
    """The machine's numbers with the law left out that both programs write differently."""
    return {name: 0.0 if name.endswith(".coulomb") else value for name, value in m.values.items()}


@lru_cache
def short(name: str) -> Machine:
    """The same machine with short records."""
    return replace(MACHINES[name], lengths=((1.2 if name == "arm" else 2.0),) * 5)


@pytest.fixture
def quick_belt(monkeypatch: pytest.MonkeyPatch) -> Iterator[Machine]:
    """The belt with records of little more than a second, for all that makes cases of it."""
    m = replace(MACHINES["belt"], lengths=(1.3, 1.6, 1.2, 1.4, 1.5))
    monkeypatch.setitem(MACHINES, "belt", m)
    nudged.cache_clear()
    yield m
    nudged.cache_clear()


@pytest.mark.parametrize("name", NAMES)
def test_energy_is_neither_made_nor_lost_without_friction_and_drives(name: str) -> None:
    m = MACHINES[name]
    values = {key: 0.0 if key.endswith((".coulomb", ".viscous")) else value for key, value in m.values.items()}
    steps, duration = (200, 0.1) if name == "arm" else (1000, 0.1)
    plant = Plant(m, columns_of(values, 3), (), duration / steps)
    rng = np.random.default_rng(1)
    plant.start(0.3 * rng.standard_normal((len(m.joints), 3)) * [[0.1 if j.prismatic else 1.0] for j in m.joints])
    plant.v = 0.5 * rng.standard_normal(plant.v.shape) * [[0.2 if j.prismatic else 1.0] for j in m.joints]
    still = np.zeros_like(plant.q)

    def kinetic() -> Array:
        mass, _ = plant.mass_and_load(plant.q, plant.v)
        return np.asarray(0.5 * np.einsum("ic,cij,jc->c", plant.v, mass, plant.v))

    # What the load at rest takes along the way is potential energy; that of the rope's damper is counted by itself.
    first, potential, largest = kinetic(), np.zeros(3), kinetic()
    for _ in range(steps):
        before = plant.q.copy()
        plant.advance(still)
        middle, speed = 0.5 * (before + plant.q), (plant.q - before) / plant.step
        potential += np.einsum("ic,ic->c", plant.mass_and_load(middle, still)[1], plant.q - before)
        if name == "hoist":
            potential += 70.0 * speed[1] ** 2 * plant.step
        largest = np.maximum(largest, kinetic())
    assert np.abs(kinetic() + potential - first).max() < 2e-4 * largest.max()
    assert np.abs(potential).max() > 0.02 * largest.max() or name == "belt"


@pytest.mark.parametrize("name", NAMES)
def test_the_machine_is_that_of_its_model_file(name: str) -> None:
    m = short(name)
    values = without_dry_friction(m)
    signals = records_of(m, 0, values, (), noisy=False, rng=np.random.default_rng(0))
    dropped = frozenset(key for key in values if key.endswith(".coulomb"))
    model = Model.from_dict(m.document(lambda key: values[key], dropped))
    for record in (0, 1, 4):
        log = log_of(m, 0, signals, record)
        state = np.zeros(model.core.n_states)
        state[: len(m.joints)] = signals.position[0, :, record]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ValidityWarning)
            run = vpm.simulate(model, log, "free_run", substeps=4, initial_state=state)
        for i in m.measured:
            channel = f"{m.joints[i].name}.position"
            gap = np.abs(run[channel] - log[channel]).max()
            assert gap < ALIKE[name] * max(np.ptp(log[channel]), 0.1), (channel, gap)


def test_a_known_controller_is_the_one_of_the_model_file() -> None:
    m = short("cart")
    values = without_dry_friction(m)
    signals = records_of(m, 0, values, (), noisy=False, rng=np.random.default_rng(0))
    model = Model.from_dict(m.document(lambda key: values[key], frozenset({"rail.coulomb"})))
    log = log_of(m, 0, signals, 1)
    run = vpm.simulate(model, log, "closed_loop", substeps=4)
    assert run["winch.command"] == pytest.approx(log["winch.command"], abs=2e-4 * np.ptp(log["winch.command"]))


def carriage(hidden: tuple[Hidden, ...], step: float = 1e-4, **numbers: float) -> Plant:
    """The belt's carriage, alone on its rail unless numbers say otherwise."""
    values = {"carriage.mass": 12.0, "axis.rotor": 6.0, "axis.coulomb": 0.0, "axis.viscous": 0.0} | numbers
    return Plant(belt.MACHINE, columns_of(values, 1), hidden, step)


def test_dry_friction_stops_after_the_way_that_its_work_takes_and_holds_then() -> None:
    plant = carriage((), **{"axis.coulomb": 14.0})
    plant.v[:] = 0.5
    for _ in range(10_000):
        plant.advance(np.zeros((1, 1)))
    assert plant.q[0, 0] == pytest.approx(0.5 * 18.0 * 0.5**2 / 14.0, rel=1e-3)
    place = plant.q.copy()
    for force, slides in ((13.9, False), (14.1, True)):
        for _ in range(1000):
            plant.advance(np.full((1, 1), force))
        assert bool((plant.q > place).all()) == slides


def test_dry_friction_in_two_coupled_joints_holds_both() -> None:
    m = MACHINES["scara"]
    plant = Plant(m, columns_of(dict(m.values), 1), (), 5e-4)
    efforts = 0.95 * np.array([[m.values[f"{joint.name}.coulomb"]] for joint in m.joints])
    efforts[2] = 9.81 * 2.2  # the quill's weight
    for _ in range(600):
        plant.advance(efforts)
    # Sweeps end before the first impulses are exact: a thousandth of a count.
    assert np.abs(plant.q).max() < 1e-3 * m.joints[0].resolution


def test_a_soft_belt_swings_at_the_frequency_of_two_masses() -> None:
    plant = carriage((Hidden("joint_compliance", "axis", {"stiffness": 4e4, "damping": 0.0}),))
    plant.q[:] = [[0.001], [-0.002]]
    windup = []
    for _ in range(5000):
        plant.advance(np.zeros((1, 1)))
        windup.append(float(plant.q[1, 0] - plant.q[0, 0]))
    falls = np.flatnonzero((np.array(windup[:-1]) > 0) & (np.array(windup[1:]) <= 0))
    period = np.diff(falls).mean() * plant.step
    assert 2.0 * np.pi / period == pytest.approx(np.sqrt(4e4 * (1.0 / 12.0 + 1.0 / 6.0)), rel=2e-3)


def test_a_loose_gear_lets_the_motor_fly_through_its_play() -> None:
    plant = carriage((Hidden("backlash", "axis", {"gap": 1e-3, "stiffness": 4e5, "damping": 400.0}),))
    plant.v[1] = 0.1
    steps = 0
    while plant.v[1, 0] > 0.0999:
        plant.advance(np.zeros((1, 1)))
        steps += 1
    assert steps * plant.step == pytest.approx(0.5e-3 / 0.1, abs=3e-4)
    assert plant.q[0, 0] < 1e-5


def test_maxwell_slip_takes_the_energy_of_its_sliding_elements() -> None:
    values, size = {"force": 20.0, "way": 0.01}, 0.08
    slip, work = MaxwellSlip(values, 1), 0.0
    path = np.concatenate([np.linspace(0, size, 4000), np.linspace(size, -size, 8000), np.linspace(-size, size, 8000)])
    for k, way in enumerate(np.diff(path)):
        force = slip.moved(np.full(1, way))
        if k >= 3999:  # one closed loop, after the first way
            work -= float(force[0]) * way
    loop = float(np.sum(4.0 * 20.0 * SHARES * (size - 0.01 * YIELD_WAYS)))
    assert work == pytest.approx(loop, rel=2e-3)
    assert float(force[0]) == pytest.approx(-20.0)


def test_a_delay_shifts_the_record_and_a_lag_keeps_its_time() -> None:
    m = short("belt")
    step = 1.0 / m.rate / m.substeps
    history = np.zeros((40, 1, 1))
    history[10:] = 1.0
    late = Drives(m, (Hidden("input_delay", "drive", {"time": 0.007}),), step, 1)
    slow = Drives(m, (Hidden("actuator_lag", "drive", {"time": 0.01}),), step, 1)
    ripple = np.zeros((1, 1))
    times, efforts, slows = [], [], []
    for k in range(40):
        for sub in range(m.substeps):
            times.append((k * m.substeps + sub) * step)
            efforts.append(float(late.effort(history, k, sub, ripple)[0, 0]))
            slows.append(float(slow.effort(history, k, sub, ripple)[0, 0]))
    begun = times[int(np.flatnonzero(efforts)[0])]
    assert begun == pytest.approx(10 / m.rate + 0.007, abs=step)
    risen = np.interp(10 / m.rate + 0.01, times, slows) / belt.GAIN
    assert risen == pytest.approx(1.0 - np.exp(-1.0), abs=0.02)


def test_every_effect_can_be_asked_for_and_a_case_is_the_same_again(quick_belt: Machine) -> None:
    assert MACHINES["belt"] is quick_belt
    for name in NAMES:
        assert {"none", "parameters"} < set(requests(name))
        assert {"single", "pair", "outside"} < set(requests(name).values())
    first, second = (make_case("belt", "dead_zone@drive", 3) for _ in range(2))
    assert first.train == second.train
    assert first.document == second.document
    assert first.solvable
    lengths = [len(record) for record in (*first.train, *first.validate)]
    assert len(lengths) == 5
    assert len(set(lengths)) == 5


def test_what_a_free_parameter_does_alike_is_no_effect_that_anyone_could_see(quick_belt: Machine) -> None:
    drag = (Hidden("viscous_friction", "axis", {"viscous": 14.0}),)
    assert strength(quick_belt, 0, drag, (), list(quick_belt.adjustable)) < CLEAR
    assert strength(quick_belt, 0, drag, (), ["carriage.mass"]) > CLEAR


@pytest.mark.usefixtures("quick_belt")
def test_another_diagnosis_is_scored_by_the_same_rules() -> None:
    case = make_case("belt", "dead_zone@drive", 3)

    def said(*names: tuple[str, str]) -> SimpleNamespace:
        effects = [SimpleNamespace(name=name, site=site) for name, site in names]
        return SimpleNamespace(verdict="effect_found" if names else "unexplained", effects=effects, candidates=[])

    def guess(*names: tuple[str, str]) -> object:
        def diagnose(model: Model, train: list[Experiment], validate: list[Experiment]) -> SimpleNamespace:
            assert model.joints == ("axis",)
            assert (len(train), len(validate)) == (4, 1)
            return said(*names)

        return answered(case, diagnose, 0.0)

    right, wrong, nothing = guess(("dead_zone", "drive")), guess(("saturation", "drive")), guess()
    assert [a.good for a in (right, wrong, nothing)] == [True, False, False]  # type: ignore[attr-defined]
    assert wrong.class_right  # type: ignore[attr-defined]
    assert "1/3" in table([right, wrong, nothing])  # type: ignore[list-item]
