"""NARX models and sampled Maxwell elements as actuators: the equation beside the machine, and what is refused."""

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import vpm
from vpm import narx
from vpm.errors import DivergedError, ModelError, SimulationError, VpmError
from vpm.scenario import Scenario

CARRIAGE: dict[str, Any] = {
    "name": "carriage",
    "gravity": [0.0, 0.0, -9.81],
    "bodies": {"carriage": {"mass": 8.0}},
    "joints": {"axis": {"type": "prismatic", "parent": "world", "child": "carriage", "axis": [1.0, 0.0, 0.0]}},
    "effects": [{"type": "viscous_friction", "at": "axis", "viscous": 12.0}],
}
TERMS = {
    "effort[k-1]": 1.6,
    "effort[k-2]": -0.64,
    "u[k]": 1.5,
    "v[k-1]": -0.8,
    "u[k-1]*v[k]": -0.05,
    "effort[k-1]^3": -1e-5,
}
VALVE: dict[str, Any] = {
    "type": "narx",
    "joint": "axis",
    "sample_time": 1e-4,
    "inputs": {"u": "valve.command", "v": "axis.velocity"},
    "terms": TERMS,
}


def machine(**changes: Any) -> dict[str, Any]:
    """Carriage with a NARX valve; keys whose change is None are left out."""
    content = copy.deepcopy(CARRIAGE)
    valve = {**copy.deepcopy(VALVE), **changes}
    content["actuators"] = {"valve": {key: value for key, value in valve.items() if value is not None}}
    return content


def build(**changes: Any) -> vpm.Model:
    return vpm.Model.from_dict(machine(**changes))


def alone() -> narx.Narx:
    terms = [[(0, 1)], [(0, 2)], [(1, 0)], [(2, 1)], [(1, 1), (2, 0)], [(0, 1)] * 3]
    return narx.Narx.from_terms("effort", ["u", "v"], terms, list(TERMS.values()))


def test_a_loop_at_ten_kilohertz_is_the_model_beside_it() -> None:
    sim = vpm.Simulation(build(), 1e-4, state={"axis.velocity": 0.1})
    beside = alone().stepper()
    largest, gap = 0.0, 0.0
    for k in range(5000):
        u = np.sin(2.0 * np.pi * 3.0 * sim.time) - 20.0 * sim["axis.position"]
        seen = np.array([u, sim["axis.velocity"]])
        if k == 0:
            beside.start(np.zeros(2), np.tile(seen, (2, 1)))
        force = beside.step(seen)
        sim.step(u)
        gap, largest = max(gap, abs(sim["valve.force"] - force)), max(largest, abs(force))
    assert largest > 5.0
    assert gap <= 1e-12 * largest


def test_the_held_effort_does_not_know_the_steps_of_the_integrator() -> None:
    model, inputs = build(sample_time=5e-4), np.sin(np.arange(400) * 0.05)
    for substeps in (1, 4):
        run = vpm.Simulation(model, 1e-4, substeps=substeps).run(inputs)
        held = run["valve.force"].reshape(-1, 5)
        assert np.ptp(held, axis=1).max() == 0.0
        assert np.all(np.diff(held[:, 0]) != 0.0)


def test_a_restored_simulation_goes_on_to_the_last_bit() -> None:
    model, inputs = build(sample_time=3e-4), np.sin(np.arange(200) * 0.05)
    sim = vpm.Simulation(model, 1e-4)
    sim.run(inputs[:100])
    kept = sim.snapshot()
    assert kept.time == sim.time
    first = sim.run(inputs[100:]).values
    for again in (sim, vpm.Simulation(model, 1e-4)):
        again.restore(kept)
        assert again.time == kept.time
        np.testing.assert_array_equal(again.run(inputs[100:]).values, first)
    with pytest.raises(SimulationError, match="of another model, other parameters or other steps"):
        vpm.Simulation(model, 3e-4).restore(kept)


@settings(max_examples=25, deadline=None)
@given(
    poles=st.lists(st.floats(-0.95, 0.95), min_size=1, max_size=3),
    gain=st.floats(-5.0, 5.0),
    mixed=st.floats(-0.2, 0.2),
    every=st.integers(1, 4),
    seed=st.integers(0, 100),
)
# Poles that tell a coefficient that was rounded on its way into the core.
@example(poles=[-0.9375, -0.62890625, -0.947265625], gain=1.0, mixed=0.0, every=1, seed=2)
def test_any_stable_model_gives_the_same_inside_and_beside(
    poles: list[float], gain: float, mixed: float, every: int, seed: int
) -> None:
    past = -np.poly(poles)[1:]
    terms = {f"effort[k-{d + 1}]": float(value) for d, value in enumerate(past)}
    terms |= {"u[k-1]": gain, "u[k]*v[k-1]": mixed}
    sim = vpm.Simulation(build(terms=terms, sample_time=every * 1e-4), 1e-4)
    lag = max(len(past), 1)
    model = narx.Narx.from_terms(
        "y", ["u", "v"], [*([(0, d + 1)] for d in range(lag)), [(1, 1)], [(1, 0), (2, 1)]], [*past, gain, mixed]
    )
    beside, force = model.stepper(), 0.0
    for k, u in enumerate(np.random.default_rng(seed).uniform(-1.0, 1.0, 60)):
        seen = np.array([u, sim["axis.velocity"]])
        if k == 0:
            beside.start(np.zeros(lag), np.tile(seen, (lag, 1)))
        if k % every == 0:
            force = beside.step(seen)
        sim.step(u)
        assert abs(sim["valve.force"] - force) <= 1e-12 * max(1.0, abs(force))


def test_a_saved_model_is_read_beside_the_model_file(tmp_path: Path) -> None:
    saved = narx.Narx.from_terms(
        "oil.force", ["spool", "axis.velocity"], [[(0, 1)], [(1, 0)], [(2, 1)]], [0.9, 2.0, -1.0]
    )
    saved.save(tmp_path / "valve.npz")
    content = machine(file="valve.npz", terms=None, inputs={"spool": "valve.command"})
    written = tmp_path / "machine.toml"
    inline = build(
        inputs={"spool": "valve.command", "axis.velocity": "axis.velocity"},
        terms={"effort[k-1]": 0.9, "spool[k]": 2.0, "axis.velocity[k-1]": -1.0},
    )
    text = inline.to_toml()
    begin, end = text.index("inputs ="), text.index("\n", text.index("terms ="))
    written.write_text(text[:begin] + 'file = "valve.npz"\ninputs = { spool = "valve.command" }' + text[end:])
    model = vpm.Model.load(written)
    assert model == inline
    # What is saved elsewhere needs the file no longer.
    elsewhere = tmp_path / "other"
    elsewhere.mkdir()
    assert vpm.Model.load(model.save(elsewhere / "machine.toml")) == inline
    with pytest.raises(ModelError, match="does not exist"):
        vpm.Model.from_dict(content)


def spring(**changes: Any) -> dict[str, Any]:
    element = {"type": "maxwell_narx", "joint": "axis", "sample_time": 1e-4, "k0": [4e3, 200.0, 1e4], "s0": 0.02}
    element |= {"k1": 6e3, "c1": 60.0, **changes}
    content = copy.deepcopy(CARRIAGE)
    content["actuators"] = {"muscle": {key: value for key, value in element.items() if value is not None}}
    return content


def test_a_sampled_maxwell_element_is_that_of_the_narx_module(tmp_path: Path) -> None:
    element = narx.MaxwellNarx(k0=np.array([4e3, 200.0, 1e4]), s0=np.array([0.02]), k1=6e3, c1=60.0, step=1e-4)
    element.save(tmp_path / "muscle.npz")
    numbers = dict.fromkeys(("k0", "s0", "k1", "c1", "sample_time"))
    from_file = vpm.Model.from_dict(spring(**numbers, file=str(tmp_path / "muscle.npz")))
    model = vpm.Model.from_dict(spring())
    assert model == from_file
    sim = vpm.Simulation(model, 1e-4, state={"axis.position": 0.01})
    drive = 0.5 * np.sin(np.arange(300) * 0.03)
    length, force = [], []
    for u in drive:
        length.append(sim["axis.position"])
        sim.step(u)
        force.append(sim["muscle.force"])
    # The element pulls, and a positive force of an actuator pushes.
    pulls = element.simulate_free_run(np.array(length), (-force[0], -force[1]), drive)
    np.testing.assert_allclose(-np.array(force), pulls, rtol=1e-12, atol=1e-9)
    k0 = 4e3 + 1e4 * 0.01
    assert force[0] == pytest.approx(-k0 * (0.01 - 0.02), rel=1e-12)


def test_scenarios_and_closed_loops_run(tmp_path: Path) -> None:
    content = machine(terms={"effort[k-1]": 0.9, "u[k]": 5.0}, inputs={"u": "valve.command"}, sample_time=1e-3)
    content["controllers"] = {
        "servo": {
            "type": "pd",
            "actuator": "valve",
            "measures": "axis.position",
            "proportional": 40.0,
            "derivative": 6.0,
        }
    }
    vpm.Model.from_dict(content).save(tmp_path / "machine.toml")
    (tmp_path / "step.toml").write_text(
        'scenario = "step"\nduration = 4.0\ntime_step = 1e-3\n'
        '[references.valve]\ntype = "constant"\nvalue = 0.1\n'
        '[[runs]]\nname = "nominal"\nmodel = "machine.toml"\n'
    )
    run = Scenario.load(tmp_path / "step.toml").run()["nominal"]
    assert run["axis.position"][-1] == pytest.approx(0.1, abs=1e-3)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"inputs": {"u": "valve.comand", "v": "axis.velocity"}}, r'inputs\.u is "valve\.comand".*valve\.command'),
        ({"inputs": {"u": "valve.command", "v": "valve.force"}}, r"inputs\.v.*cannot read.*axis\.velocity"),
        ({"inputs": {"u": "valve.command"}}, r'names the signal "v", but the signals are "effort", "u"'),
        ({"terms": {"effort[k-1]": 1.2, "u[k]": 1.0}}, r"give the pole 1\.2, of magnitude 1\.2 above 1"),
        ({"terms": {"effort[k-1]": 1.8, "effort[k-2]": -1.0625, "u[k]": 1.0}}, r"pole 0\.9 ± 0\.50\d* j"),
        ({"terms": {"effort[k]": 0.5}}, "contains the effort that it is to compute"),
        ({"terms": {"u(k-1)": 0.5}}, r'has the factor "u\(k-1\)"'),
        ({"terms": {"u[k]*v[k]": 0.5, "v[k]*u[k]": 0.5}}, "is the same term"),
        ({"terms": None}, "terms is missing; add it"),
        ({"terms": None, "file": "nowhere.npz"}, r"file is wrong: nowhere\.npz does not exist; check the path"),
        ({"file": "nowhere.npz"}, "file is given, and terms as well"),
        ({"sample_time": 0.0}, "sample_time is 0, but has to be above 0"),
        ({"sample_time": None}, r"sample_time is missing; add it, for example sample_time = 1e-3"),
        ({"limit": -1.0}, "limit is -1"),
        ({"k0": 1.0}, 'k0 belongs to type = "maxwell_narx"'),
    ],
)
def test_what_makes_no_model_is_said_in_one_sentence(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ModelError, match=sentence) as caught:
        build(**changes)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {"k0": [4e3, 1.0]},
            "k0 has 2 coefficients, but a polynomial .* has 1, 3, 6 or 10",
        ),
        ({"c1": -1.0}, "c1 is -1, but has to be above 0"),
        ({"k1": None}, r"k1 is missing; add it, for example k1 = 5e5"),
        ({"scheme": "euler"}, "euler"),
    ],
)
def test_what_makes_no_element_is_said_in_one_sentence(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ModelError, match=sentence):
        vpm.Model.from_dict(spring(**changes))


def test_an_element_with_a_length_stands_on_no_hinge_and_behind_no_lag() -> None:
    content = spring()
    content["joints"]["axis"]["type"] = "revolute"
    content["bodies"]["carriage"]["inertia"] = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    with pytest.raises(ModelError, match="maxwell_narx on the revolute joint"):
        vpm.Model.from_dict(content)
    content = machine()
    content["effects"] = [{"type": "actuator_lag", "at": "valve", "time_constant": 0.01}]
    with pytest.raises(ModelError, match='is a lag at "valve", a narx'):
        vpm.Model.from_dict(content)


def test_a_model_with_the_poles_of_its_start_outside_may_be_held_back_by_its_products() -> None:
    build(terms={"effort[k-1]": 1.1, "effort[k-1]^3": -0.1, "u[k]": 0.1})


def test_divergence_is_told_with_name_and_time() -> None:
    model = build(terms={"effort[k-1]": 1.5, "effort[k-1]^2": 1.0, "u[k]": 1.0}, limit=1e3)
    sim = vpm.Simulation(model, 1e-4)
    reported = r"effort of actuator `valve` is .*limit of 1\.0000e3.* t = 0\.000\d+ s"
    with pytest.raises(DivergedError, match=reported):
        sim.run(np.ones(100))
    sim.reset()
    sim.step(0.0)


def log_of(model: vpm.Model) -> vpm.Experiment:
    time = np.arange(300) * 1e-3
    u = np.sin(20.0 * time)
    run = vpm.Simulation(model, 1e-3).run(u)
    data = {"axis.position": run["axis.position"], "valve.command": u}
    return vpm.Experiment.from_arrays(time, data, {"axis.position": "m", "valve.command": "1"})


def test_modes_that_cannot_work_say_so() -> None:
    model = build(sample_time=1e-3)
    log = log_of(model)
    assert np.isfinite(vpm.simulate(model, log, mode="free_run").values).all()
    off = build(sample_time=3e-3 / 2.0)
    with pytest.raises(VpmError, match=r"actuator `valve` samples every 0\.0015 s.*sample_time 0\.002 s"):
        vpm.simulate(off, log, mode="free_run")
    with pytest.raises(ValueError, match="no linear model in continuous time"):
        model.linearize()
    with pytest.raises(VpmError, match="does not follow from its command alone"):
        vpm.simulate(model, log, mode="inverse_dynamics")
    with pytest.raises(VpmError, match="cannot start again from a state in the middle of a record"):
        vpm.simulate(model, log, mode="restarts")


def test_a_mass_behind_such_an_actuator_is_found_from_free_runs() -> None:
    model = build(sample_time=1e-3)
    log = log_of(model)
    still = log.with_channel("axis.position", np.zeros(len(log.time)), "m")
    still = still.with_channel("valve.command", log["valve.command"] * (log.time > 0.05))
    seen = still.with_channel("axis.position", vpm.simulate(model, still, mode="free_run")["axis.position"], "m")
    uncertain = model.to_dict()
    uncertain["bodies"]["carriage"]["mass"] = {"value": 8.8, "unit": "kg", "uncertainty": 1.0}
    fit = vpm.identify(vpm.Model.from_dict(uncertain), seen, mode="free_run")
    assert fit.model.parameters["carriage.mass"].value == pytest.approx(8.0, rel=1e-6)
