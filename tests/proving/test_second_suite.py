"""The second suite of blind cases: its machines keep the laws of mechanics, and agree with vpm if nothing is hidden."""

import warnings
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import vpm
from nightly import at_night
from second_suite import belt
from second_suite.cases import (
    CLEAN,
    CLEAR,
    DEV,
    FRESH,
    MACHINES,
    Case,
    frozen,
    hidden_of,
    make_case,
    requests,
    strength,
    true_values,
)
from second_suite.cases import _log as log_of
from second_suite.cases import _nudged as nudged
from second_suite.cases import _records as records_of
from second_suite.laws import SHARES, YIELD_WAYS, MaxwellSlip
from second_suite.loop import Drives
from second_suite.machine import Machine, columns_of
from second_suite.plant import Hidden, Plant
from second_suite.score import Answer, Named, Solver, answered, table
from second_suite.solvers import found
from vpm import Experiment, Model
from vpm.errors import ValidityWarning
from vpm.numbers import Array

#: Without those of `test_second_suite_beam.py`: how they bend has other coordinates than in a file.
NAMES = sorted({*MACHINES} - {"slewer", "sweeper"})
#: Largest difference of the positions of both programs over the way that is made, in free runs of one or two seconds:
#: both step the same equations, with errors of second order in the generator's steps, 0.25 to 0.5 ms, of the arm 2 ms.
#: Where gravity lets errors grow, as in the arm's shoulder, they do.
ALIKE = {"belt": 1e-6, "rotary": 1e-5, "cart": 2e-4, "scara": 1e-5, "hoist": 1e-5, "arm": 1e-3, "boom": 1e-5}
#: Where a payload sits in the frame of its body, and whether a tilt is positive about y.
PAYLOADS = {"cart": {"z": -0.55}, "arm": {"x": 0.03, "z": 0.09}, "boom": {"x": 2.4}}
TILTS = {"scara": -1.0}
HEAVY = (("cart", "bob"), ("scara", "tool"), ("hoist", "load"), ("arm", "link6"), ("boom", "boom"))
#: Effects whose law is the same in both programs.
EXACT = (
    ("belt", "bias_force@axis"),
    ("belt", "dead_zone@drive"),
    ("belt", "actuator_lag@drive"),
    ("belt", "sensor_delay@encoder"),
    ("rotary", "spring@elbow"),
    ("rotary", "sensor_offset@resolver"),
    ("rotary", "saturation@motor"),
    ("cart", "sensor_gain@swing"),
    ("cart", "input_delay@winch"),
    ("scara", "joint_compliance@shoulder"),
    ("hoist", "payload@load"),
)


#: Machines that are simulated outside of `make test-nightly`: one joint, two joints that disturb each other, a line.
FEW = ("belt", "cart", "hoist")


def without_dry_friction(m: Machine) -> dict[str, float]:
    """The machine's numbers with the law left out that both programs write differently."""
    return {name: 0.0 if name.endswith(".coulomb") else value for name, value in m.values.items()}


@lru_cache
def short(name: str) -> Machine:
    """The same machine with short records."""
    return replace(MACHINES[name], lengths=((1.2 if name == "arm" else 2.0),) * 4)


@pytest.fixture
def quick_belt(monkeypatch: pytest.MonkeyPatch) -> Iterator[Machine]:
    """The belt with records of little more than a second, for all that makes cases of it."""
    m = replace(MACHINES["belt"], lengths=(1.3, 1.6, 1.2, 1.5))
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


def written(m: Machine, values: dict[str, float], *entries: dict[str, object]) -> Model:
    """The model file with these numbers and entries more, without losses that are zero."""
    dropped = frozenset(key for key, value in values.items() if not value)
    document = m.document(lambda key: values[key], dropped)
    effects = document["effects"]
    assert isinstance(effects, list)
    return Model.from_dict({**document, "effects": [*effects, *entries]})


def entry(m: Machine, hidden: Hidden) -> dict[str, object]:
    """What a model file says of a hidden effect."""
    numbers: dict[str, float] = dict(hidden.values)
    if hidden.effect == "gravity_tilt":
        numbers = {"second": TILTS.get(m.name, 1.0) * numbers["angle"]}
    elif hidden.effect == "payload":
        numbers |= PAYLOADS.get(m.name, {})
    elif hidden.effect == "actuator_lag":
        numbers = {"time_constant": numbers["time"]}
    elif hidden.effect == "joint_compliance":
        numbers["inertia"] = 1e-9  # that of the rotor is there
    return {"type": hidden.effect, "at": hidden.site, **numbers}


@pytest.mark.parametrize("name", NAMES)
def test_mass_and_loads_are_those_of_the_model_file_at_any_place(name: str) -> None:
    m, rng = MACHINES[name], np.random.default_rng(0)
    values = without_dry_friction(m)
    cases: list[tuple[Hidden, ...]] = [()]
    cases += [(Hidden("gravity_tilt", "world", {"angle": 0.07}),)] * (name != "hoist")
    cases += [(Hidden("payload", site, {"mass": 0.8}),) for machine, site in HEAVY if machine == name]
    for hidden in cases:
        plant = Plant(m, columns_of(values, 1), hidden, 1e-3)
        model = written(m, values, *(entry(m, h) for h in hidden))
        for q, v, a in rng.standard_normal((5, 3, len(m.joints))):
            mass, load = plant.mass_and_load(q[:, None], v[:, None])
            drag = -plant.forces(q[:, None], v[:, None], np.zeros((len(q), 1)), 0.0 * load)[:, 0]
            required = model.inverse_dynamics(q, v, a)
            assert mass[0] @ a + load[:, 0] + drag == pytest.approx(required, abs=1e-12 * np.abs(required).max())


@pytest.mark.parametrize("name", NAMES)
def test_a_model_file_can_be_read_however_wrong_its_numbers_are(name: str) -> None:
    m, rng = MACHINES[name], np.random.default_rng(0)
    for _ in range(10):
        signs = {key: float(rng.choice([-3.0, 3.0])) for key in m.adjustable}
        values = {
            key: v * float(np.exp(signs.get(key, 0.0) * m.adjustable.get(key, 0.0))) for key, v in m.values.items()
        }
        assert written(m, values).joints == tuple(joint.name for joint in m.joints)


def gap(m: Machine, model: Model, log: Experiment, state: Array) -> float:
    """Largest difference of a free run of the model file and a log, over the way that is made."""
    first = np.zeros(model.core.n_states)
    first[: len(state)] = state
    started = model.core.n_states == 2 * len(m.joints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)
        run = vpm.simulate(model, log, "free_run", substeps=4, initial_state=first if started else None)
    channels = [f"{m.joints[i].name}.position" for i in m.measured]
    return max(float(np.abs(run[c] - log[c]).max() / max(np.ptp(log[c]), 0.1)) for c in channels)


@pytest.mark.parametrize("name", at_night(NAMES, but=FEW))
def test_the_machine_moves_as_its_model_file_does(name: str) -> None:
    m = short(name)
    values = without_dry_friction(m)
    signals = records_of(m, 0, values, (), noisy=False, rng=np.random.default_rng(0))
    for record in (0, 1):
        log = log_of(m, 0, signals, record)
        assert gap(m, written(m, values), log, signals.position[0, :, record]) < ALIKE[name]


@pytest.mark.parametrize(("name", "word"), at_night(EXACT, but=[one for one in EXACT if one[0] in FEW]))
def test_a_hidden_effect_is_that_of_the_catalogue(name: str, word: str) -> None:
    m = short(name)
    values, hidden = without_dry_friction(m), hidden_of(m, word, 0)
    signals = records_of(m, 0, values, hidden, noisy=False, rng=np.random.default_rng(0))
    log, place = log_of(m, 0, signals, 1), signals.position[0, :, 1].copy()
    if hidden[0].effect == "sensor_offset":
        place[m.index(hidden[0].site)] -= hidden[0].values["value"]
    # Delays are whole steps in the generator: up to half a step of 0.25 to 0.5 ms is left of 5 ms or more.
    left = gap(m, written(m, values, entry(m, hidden[0])), log, place)
    assert left < 0.06 * gap(m, written(m, values), log, place)


@pytest.mark.parametrize("name", at_night(["belt", "rotary", "cart", "scara", "arm"], but=("belt", "cart")))
def test_a_clean_log_leaves_no_effort(name: str) -> None:
    m = replace(MACHINES[name], lengths=(2.0 if name == "arm" else 3.0,) * 4)
    values = without_dry_friction(m)
    signals = records_of(m, 0, values, (), noisy=False, rng=np.random.default_rng(0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)
        run = vpm.simulate(written(m, values), log_of(m, 0, signals, 1), "inverse_dynamics")
    edge = len(run.time) // 20
    left = np.sqrt(np.mean((run.measured - run.values)[edge:-edge] ** 2, axis=0))
    # Of the drive's noise, which is all that a clean record has beside its counts; nothing drives the pendulum.
    noise = np.array([joint.gain * joint.drive_noise or 1e-2 for joint in m.joints])
    assert (left < 0.1 * noise).all()


@pytest.mark.parametrize("name", at_night(sorted({*NAMES} - {"boom"}), but=FEW))
def test_dry_friction_is_that_of_the_model_file(name: str) -> None:
    m = short(name)
    values = true_values(m, 0)
    signals = records_of(m, 0, values, (), noisy=False, rng=np.random.default_rng(0))
    log, place = log_of(m, 0, signals, 1), signals.position[0, :, 1]
    without = {key: 0.0 if key.endswith(".coulomb") else value for key, value in values.items()}
    # The law of the file creeps where a joint sticks here, which is what is left.
    left = gap(m, written(m, values), log, place)
    assert left < 0.03 * gap(m, written(m, without), log, place)


@pytest.mark.parametrize("name", NAMES)
def test_halved_steps_make_a_quarter_of_the_error(name: str) -> None:
    m = MACHINES[name]
    values = columns_of(without_dry_friction(m), 1)
    ends = []
    for steps in (20, 40, 160):
        plant = Plant(m, values, (), 0.04 / steps)
        plant.start(np.full((len(m.joints), 1), 0.3))
        plant.v[:] = np.linspace(0.8, 0.4, len(m.joints))[:, None]
        for _ in range(steps):
            plant.advance(np.zeros_like(plant.q))
        ends.append(plant.q.copy())
    coarse, half = (np.abs(end - ends[2]).max() for end in ends[:2])
    # Against a solution of an error of 1/64: (1 - 1/64) / (1/4 - 1/64).
    assert coarse / half == pytest.approx(4.2, rel=0.1)


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
        assert {"none", "parameters", "single", "pair", "outside"} == set(requests(name).values())
    first, second = (make_case("belt", "dead_zone@drive", 3) for _ in range(2))
    assert first.train == second.train
    assert first.document == second.document
    assert first.solvable
    lengths = [len(record) for record in (*first.train, *first.holdout)]
    assert len(lengths) == len(set(lengths)) == 4


def test_frozen_cases_have_each_request_once_and_clean_machines_at_each_seed() -> None:
    assert not set(DEV) & set(FRESH)
    for seeds in (DEV, FRESH):
        cases = list(frozen(seeds))
        for name in NAMES:
            asked = [request for machine, request, _ in cases if machine == name]
            for request, kind in requests(name).items():
                assert asked.count(request) == (len(seeds) if kind in CLEAN else 1)


def test_what_a_free_parameter_does_alike_is_no_effect_that_anyone_could_see(quick_belt: Machine) -> None:
    drag = (Hidden("viscous_friction", "axis", {"viscous": 14.0}),)
    assert strength(quick_belt, 0, drag, (), list(quick_belt.adjustable)) < CLEAR
    assert strength(quick_belt, 0, drag, (), ["carriage.mass"]) > CLEAR


def points(case: Case, *names: Named) -> float:
    """Of an answer to a case."""

    def solver(model: Model, train: list[Experiment], holdout: list[Experiment]) -> list[Named]:
        assert model.joints
        assert (len(train), len(holdout)) == (3, 1)
        return list(names)

    return answered(case, solver).points


@pytest.mark.usefixtures("quick_belt")
def test_points_are_for_the_hidden_effects_and_nothing_else() -> None:
    case = make_case("belt", "dead_zone@drive", 3)
    assert points(case, ("dead_zone", "drive")) == 1.0
    assert points(case, ("saturation", "drive")) == 0.5
    assert points(case, ("spring", "axis")) == 0.0
    assert points(case) == 0.0
    assert points(case, ("dead_zone", "drive"), ("spring", "axis")) == 0.0
    two = (Hidden("torque_ripple", "axis", {}), Hidden("input_delay", "drive", {}))
    pair = replace(case, kind="pair", hidden=two)
    # What is read late and what is done late are one on this machine.
    assert points(pair, ("sensor_delay", "encoder"), ("torque_ripple", "axis")) == 1.0
    assert points(pair, ("input_delay", "drive")) == 0.0
    clean = replace(case, kind="none", hidden=(), strengths=())
    assert points(clean) == 1.0
    assert points(clean, ("spring", "axis")) == 0.0


def test_a_wrong_joint_is_worth_nothing_and_a_failure_neither() -> None:
    def answer(name: Named, error: str = "") -> Answer:
        true = ("coulomb_friction", "elbow")
        return Answer("scara", "coulomb_friction@elbow", 0, "single", (true,), (9.0,), True, (name,), error=error)

    right, rough = answer(("coulomb_friction", "elbow")), answer(("hysteresis", "elbow"))
    wrong, failed = answer(("coulomb_friction", "shoulder")), answer(("coulomb_friction", "elbow"), "it broke")
    assert [a.points for a in (right, rough, wrong, failed)] == [1.0, 0.5, 0.0, 0.0]
    assert "1.5/4" in table([right, rough, wrong, failed])


def test_a_solver_is_found_by_its_dotted_name() -> None:
    solver: Solver = found("second_suite.solvers.diagnose")
    assert solver is found("diagnose")
