"""The second suite's flexible links: closed forms, energy, convergence, and vpm's exact beam in free runs."""

import warnings
from dataclasses import replace
from functools import lru_cache, partial
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

import vpm
from nightly import at_night
from second_suite import laws, plant, slewer, sweeper
from second_suite.blade import Blade
from second_suite.cases import _log as log_of
from second_suite.cases import _records as records_of
from second_suite.cases import hidden_of, make_case, requests
from second_suite.entries import file
from second_suite.laws import Numbers
from second_suite.machine import Joint, Machine, columns_of
from second_suite.plant import Hidden, Plant
from vpm import Experiment, Model
from vpm.errors import ValidityWarning
from vpm.numbers import Array

MACHINES = {"slewer": (slewer.MACHINE, slewer.STRIP), "sweeper": (sweeper.MACHINE, sweeper.BLADE)}
NAMES = list(MACHINES)
#: What no catalogue has.
PAD = "coulomb_friction@pad"
#: Shares that are left of what is not quite the catalogue's: Maxwell slip, and a lag in steps, half a step early.
LEFT = {"hysteresis@slew": 0.2, "actuator_lag@motor": 0.02}
ALSO = ("backlash@slew", "joint_compliance@slew", "warming_friction@slew", "gravity_tilt@world", "dead_zone@drive")
HIDDEN = [
    *(("slewer", w) for w, kind in requests("slewer").items() if kind in {"single", "outside"} and w != PAD),
    *(("sweeper", w) for w in ALSO),
]


#: Those that are compared outside of `make test-nightly`.
FEW = [("slewer", "hysteresis@slew"), ("slewer", "actuator_lag@motor"), ("sweeper", "backlash@slew")]


@lru_cache
def short(name: str) -> Machine:
    return replace(MACHINES[name][0], lengths=(1.3,) * 4)


def smooth_values(m: Machine, **numbers: float) -> dict[str, float]:
    """The machine's numbers without dry friction."""
    return {**m.values, "slew.coulomb": 0.0} | numbers


def bent(name: str, *hidden: Hidden, step: float = 2.5e-4, **numbers: float) -> Plant:
    """A machine at rest whose blade is bent by a force of 1.5 N at its tip."""
    m, blade = MACHINES[name]
    made = Plant(m, columns_of({**m.values} | numbers, 1), hidden, step)
    end = blade.shapes.T @ blade.shape(np.array([blade.length]))[0, 0]
    made.q[1:, 0] = np.linalg.solve(m.values["blade.young"] * stiffness_of(blade), 1.5 * end)
    return made


def stiffness_of(blade: Blade) -> Array:
    """Per modulus, in the coordinates of the machine."""
    return np.asarray(blade.shapes.T @ blade.elastic[2] @ blade.shapes)


def ends(blade: Blade, young: float, hub: float, omega: float) -> float:
    """Determinant of the conditions at both ends of a blade that swings at omega; the hub is held if it is infinite."""
    wave, stiff = (blade.line_density * omega**2 / (young * blade.moment)) ** 0.25, young * blade.moment

    def shapes(s: float) -> Array:
        """Four solutions and three derivatives, scaled against overflow."""
        rows = []
        for order in range(4):
            turn, far, near = wave * s + 0.5 * np.pi * order, np.exp(wave * (s - blade.length)), np.exp(-wave * s)
            rows.append(wave**order * np.array([np.cos(turn), np.sin(turn), far, (-1.0) ** order * near]))
        return np.array(rows)

    w, slope, moment, shear = shapes(0.0)
    v, turned, bend, pull = shapes(blade.length)
    swings = slope if np.isinf(hub) else slope + stiff * (moment - blade.root * shear) / (omega**2 * hub)
    rows = [w - blade.root * slope, swings, stiff * bend - omega**2 * blade.tip_inertia * turned]
    rows.append(stiff * pull + omega**2 * blade.tip_mass * v)
    return float(np.linalg.det(np.array([row / np.linalg.norm(row) for row in rows])))


@pytest.mark.parametrize("hub", [np.inf, 0.17])
@pytest.mark.parametrize("name", NAMES)
def test_the_blade_swings_at_the_frequencies_of_the_closed_form(name: str, hub: float) -> None:
    m, blade = MACHINES[name]
    held = np.isinf(hub)
    values = columns_of({**m.values, "hub.inertia": 0.0 if held else hub, "blade.damping": 0.0}, 5)
    place = np.zeros((5, 5))
    place[1:, 1:] = np.eye(4)
    still = 0.0 * place
    mass, stiffness = m.tree(values, still, still)[0][0], m.tree(values, place, still)[1]
    if held:
        mass, stiffness = mass[1:, 1:], stiffness[1:, 1:]
    found = np.sort(np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(mass, stiffness)))))
    for omega, share in zip(found[0 if held else 1 :], (2e-5, 1e-4, 1e-3), strict=False):
        # The inertia against turning of the sections is all that the closed form leaves out.
        exact = brentq(lambda x: ends(blade, m.values["blade.young"], hub, x), (1 - share) * omega, (1 + share) * omega)
        assert omega == pytest.approx(exact, rel=share)


@pytest.mark.parametrize("name", NAMES)
def test_a_stuck_hub_stays_and_its_blade_rings_as_if_clamped(name: str) -> None:
    m, blade = MACHINES[name]
    made = bent(name, **{"slew.coulomb": 3.0})
    tip = blade.shapes.T @ blade.shape(np.array([blade.length]))[0, 0]
    way = []
    for _ in range(6000):
        made.advance(np.zeros_like(made.q))
        way.append(float(tip @ made.q[1:, 0]))
    assert np.abs(made.q[0]).max() < 1e-12
    signal = np.array(way)
    falls = np.flatnonzero((signal[:-1] > 0.0) & (signal[1:] <= 0.0))
    times = made.step * (falls + signal[falls] / (signal[falls] - signal[falls + 1]))
    omega = 2.0 * np.pi / np.diff(times).mean()
    clamped = brentq(lambda x: ends(blade, m.values["blade.young"], np.inf, x), 0.99 * omega, 1.01 * omega)
    peaks = [signal[a:b].max() for a, b in pairwise(falls)]
    ratio = 0.5 * m.values["blade.damping"] * clamped
    assert omega == pytest.approx(clamped * np.sqrt(1.0 - ratio**2), rel=1e-4)
    assert -np.polyfit(np.arange(len(peaks)), np.log(peaks), 1)[0] == pytest.approx(2.0 * np.pi * ratio, rel=0.01)


@pytest.mark.parametrize("hidden", [(), (Hidden("coulomb_friction", "pad", {"coulomb": 0.3}),)])
@pytest.mark.parametrize("name", NAMES)
def test_work_goes_into_motion_and_strain_or_is_lost(name: str, hidden: tuple[Hidden, ...]) -> None:
    m, blade = MACHINES[name]
    made, bending = bent(name, *hidden), m.values["blade.young"] * stiffness_of(blade)

    def stored() -> float:
        mass, v, p = made.mass_and_load(made.q, made.v)[0][0], made.v[:, 0], made.q[1:, 0]
        return float(0.5 * v @ mass @ v + 0.5 * p @ bending @ p)

    first, work, lost = stored(), 0.0, 0.0
    for k in range(4000):
        before, effort = made.q[:, 0].copy(), np.zeros_like(made.q)
        effort[0] = 2.0 * np.sin(12.0 * k * made.step)
        made.advance(effort)
        moved = made.q[:, 0] - before
        rate = moved / made.step
        work += float(effort[0, 0] * moved[0])
        lost += float(m.values["slew.coulomb"] * abs(moved[0]) + m.values["slew.viscous"] * rate[0] * moved[0])
        lost += float(m.values["blade.damping"] * rate[1:] @ bending @ moved[1:])
        lost += sum(h.values["coulomb"] * abs(moved[2]) for h in hidden)
    assert first + work - lost == pytest.approx(stored(), abs=2e-5 * work)
    assert lost > 0.2 * work


@pytest.mark.parametrize("name", NAMES)
def test_halved_steps_make_a_quarter_of_the_error(name: str) -> None:
    places = []
    for steps in (200, 400, 1600):
        made = bent(name, step=0.05 / steps, **{"slew.coulomb": 0.0})
        made.v[0] = 5.0
        for _ in range(steps):
            made.advance(np.zeros_like(made.q))
        places.append(made.q[:, 0])
    coarse, half = (np.abs(place - places[2]) for place in places[:2])
    # Against a solution of an error of 1/64: (1 - 1/64) / (1/4 - 1/64).
    assert coarse[:3] / half[:3] == pytest.approx(4.2 * np.ones(3), rel=0.1)


def padded(count: int, rng: np.random.Generator, time: Array, record: int) -> Array:
    """References with zeros for coordinates that a finer blade has."""
    return np.pad(slewer.motion(rng, time, record), ((0, 0), (0, count)))


def test_more_modes_change_less_than_the_noise() -> None:
    m, records = replace(MACHINES["slewer"][0], lengths=(0.8,) * 4, substeps=32), []
    for modes in (4, 6):
        blade = replace(slewer.STRIP, modes=modes)
        more = tuple(Joint(f"mode{k}") for k in range(4, modes))
        finer = replace(m, joints=m.joints + more, tree=blade.tree(), motion=partial(padded, modes - 4))
        signals = records_of(finer, 0, smooth_values(m), (), noisy=False, rng=np.random.default_rng(0))
        records.append(signals.position[:, :2])
    change = np.sqrt(np.mean((records[1] - records[0]) ** 2, axis=(0, 2)))
    assert (change < [joint.noise / 10.0 for joint in m.joints[:2]]).all()


def gaps(document: dict[str, object], log: Experiment, start: Array | None = None) -> Array:
    """Root mean squares of what a free run from rest differs from a log."""
    model = Model.from_dict(document)
    first = np.zeros(model.core.n_states) if start is None else start
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)
        run = vpm.simulate(model, log, "free_run", substeps=4, initial_state=first)
    channels = [c for c in ("slew.position", "root.strain") if c in log.channels]
    return np.array([np.sqrt(np.mean((run[c] - log[c]) ** 2)) for c in channels])


def noise_of(m: Machine) -> Array:
    """Of the sensors, with their counts."""
    return np.array([m.joints[i].noise + m.joints[i].resolution / np.sqrt(12.0) for i in m.measured])


@pytest.mark.parametrize("name", NAMES)
def test_the_machine_moves_as_the_exact_beam_of_its_model_file_does(name: str) -> None:
    m = short(name)
    values = smooth_values(m)
    signals = records_of(m, 0, values, (), noisy=False, rng=np.random.default_rng(0))
    for record in range(4):
        log = log_of(m, 0, signals, record)
        assert ("root.strain" in log) == (name == "slewer")
        assert (gaps(file(m, values), log) < 0.1 * noise_of(m)).all()


@pytest.mark.parametrize("name", NAMES)
def test_a_hub_in_fast_rotation_stiffens_its_blade_as_the_exact_beam_does(name: str) -> None:
    m = MACHINES[name][0]
    values = smooth_values(m, **{"slew.viscous": 0.0})
    made = Plant(m, columns_of(values, 1), (), 1.25e-4)
    made.v[0] = 8.0
    time = np.arange(800) / m.rate
    command, drive, places = 1.2 * np.sin(25.0 * time), m.joints[0].drive, []
    for u in command:
        places.append(made.q[:, 0])
        for _ in range(round(1.0 / m.rate / made.step)):
            made.advance(np.array([[m.joints[0].gain * u], *[[0.0]] * 4]))
    data = {f"{drive}.command": command} | {m.joints[i].channel: np.array(places)[:, i] for i in m.measured}
    units = {channel: {"position": "rad", "command": "A", "strain": "1"}[channel.split(".")[1]] for channel in data}
    log, document = Experiment.from_arrays(time, data, units), file(m, values)
    start = np.zeros(Model.from_dict(document).core.n_states)
    start[start.size // 2] = 8.0
    assert (gaps(document, log, start) < 0.3 * noise_of(m)).all()
    assert (gaps(document | {"velocity_terms": False}, log, start) > 10.0 * noise_of(m)).all()


def of_the_catalogue(name: str, values: Numbers, q: Array, v: Array, time: float, load: Array) -> object:
    """Dry friction of the machine with the hump of the catalogue's law."""
    if name == "stribeck_friction":
        return (values["stribeck"] * np.exp(-((v / values["speed"]) ** 2)),) * 2
    return laws.dry(name, values, q, v, time, load)


@pytest.mark.parametrize(("name", "word"), at_night(HIDDEN, but=FEW))
def test_a_hidden_effect_is_that_of_the_catalogue(name: str, word: str, monkeypatch: pytest.MonkeyPatch) -> None:
    m = short(name)
    (hidden,), step = hidden_of(m, word, 0), 1.0 / m.rate / m.substeps
    # Humps and ripples are of other shapes here; with those of the catalogue all else has to be the same.
    monkeypatch.setattr(laws, "SECOND_HARMONIC", 0.0)
    monkeypatch.setattr(plant, "dry", of_the_catalogue)
    if hidden.effect.endswith("_delay"):  # a whole number of steps
        hidden = replace(hidden, values={"time": step * round(hidden.values["time"] / step)})
    values = dict(m.values) if hidden.effect == "coulomb_friction" else smooth_values(m)
    signals = records_of(m, 0, values, (hidden,), noisy=False, rng=np.random.default_rng(0))
    log = log_of(m, 0, signals, 1)
    left, without = gaps(file(m, values, hidden), log), gaps(file(m, values, hidden, told=False), log)
    assert (left < np.maximum(noise_of(m), LEFT.get(word, 0.0) * without)).all()
    assert (without > 3.0 * noise_of(m)).any()


@pytest.mark.parametrize("name", NAMES)
def test_all_kinds_of_cases_have_files_that_can_be_read(name: str) -> None:
    m = MACHINES[name][0]
    assert set(requests(name).values()) == {"none", "parameters", "single", "pair", "outside"}
    for far in (-3.0, 3.0):
        values = {key: value * float(np.exp(far * m.adjustable.get(key, 0.0))) for key, value in m.values.items()}
        assert Model.from_dict(file(m, values)).joints == ("slew",)


@pytest.mark.parametrize("name", ["slewer", "sweeper"])
def test_restarts_begin_with_the_blade_as_the_motion_has_bent_it(name: str) -> None:
    """From the place of balance the strain would be off by half of it, and the hub by a tenth of its motion."""
    case = make_case(name, "none", 0)
    model = case.model()
    for record in case.train[:2]:
        run = vpm.simulate(model, record, "restarts")
        rows = np.searchsorted(record.time, run.time)
        for channel in {"slew.position", "root.strain"} & set(record.channels):
            left = np.std(run[channel] - record[channel][rows])
            assert left < (0.1 if channel == "root.strain" else 0.01) * np.std(record[channel])
