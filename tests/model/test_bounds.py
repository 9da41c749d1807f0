"""No state is shown that no machine can be in: one bound of the model, in every way of simulating."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from places import EXAMPLES
from vpm.batch import Trial, simulate_batch
from vpm.catalogue import register, unregister
from vpm.errors import DivergedError, SimulationError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.scenario import Scenario
from vpm.simulate import Run, Setup, simulate
from vpm.stepping import Simulation

LIGHT = 299_792_458.0
STEP = 1e-3

MACHINE = """
name = "{kind}"
gravity = [0.0, 0.0, 0.0]
[bodies.part]
mass = 2.0
inertia = [0.02, 0.02, 0.02, 0.0, 0.0, 0.0]
center_of_mass = [0.0, 0.0, {arm}]
[joints.axis]
type = "{kind}"
parent = "world"
child = "part"
axis = [1.0, 0.0, 0.0]
[actuators.drive]
joint = "axis"
gain = 1.0
[[effects]]
type = "spring"
at = "axis"
stiffness = {stiffness}
rest = 0.0
"""
#: Largest rates by hand: of a slider that of light; of a rotor that over its radius of gyration about the axis.
FASTEST = {"prismatic": LIGHT, "revolute": LIGHT / np.hypot(0.1, 0.3)}

BEGIN = 5.0
#: Square root of the slope over the mass that it pushes, 1/s: the deflection grows by that.
GROWTH = 100.0

CART = """
name = "cart"
gravity = [0.0, 0.0, 0.0]
bodies.cart.mass = 2.0
bodies.bob.mass = 1.0
joints.guide = {{ type = "prismatic", parent = "world", child = "cart", axis = [1.0, 0.0, 0.0] }}
joints.tail = {{ type = "prismatic", parent = "cart", child = "bob", axis = [1.0, 0.0, 0.0] }}
actuators.drive = {{ joint = "guide", gain = 1.0 }}
[[effects]]
at = "tail"
{effect}
"""


def machine(kind: str, stiffness: float = 1e9) -> Model:
    return Model.from_toml(MACHINE.format(kind=kind, stiffness=stiffness, arm=0.3))


def go(sim: Simulation, steps: int = 500) -> None:
    for _ in range(steps):
        sim.step(np.zeros(len(sim.inputs)))


def silence(rows: int = 500) -> Experiment:
    time = STEP * np.arange(rows)
    return Experiment.from_arrays(time, {"drive.command": np.zeros(rows)}, units={"drive.command": "N"}, name="-")


@pytest.mark.parametrize("kind", FASTEST)
@pytest.mark.parametrize("integrator", ["rk4", "semi_implicit"])
def test_a_step_that_leaves_the_bound_is_refused_and_nothing_else_changes(kind: str, integrator: str) -> None:
    sim = Simulation(machine(kind), STEP, integrator=integrator, state={"axis.position": 1e-3})
    with pytest.raises(DivergedError, match="at which its body is as fast as light") as caught:
        go(sim)
    shown = f"beyond {FASTEST[kind]:.4e}".replace("e+0", "e")
    assert shown in str(caught.value)
    assert "the velocity of joint `axis` is" in str(caught.value)
    assert caught.value.time == pytest.approx(sim.time + STEP)
    before = sim.state, sim.outputs
    assert abs(sim.state[1]) < FASTEST[kind]
    assert np.isfinite(sim.outputs).all()
    with pytest.raises(DivergedError):
        sim.step([0.0])
    np.testing.assert_array_equal(sim.state, before[0])
    np.testing.assert_array_equal(sim.outputs, before[1])
    sim.reset({"axis.position": 0.0})
    sim.step([0.0])


def test_every_way_of_simulating_has_the_same_bound_and_the_same_sentence(tmp_path: Path) -> None:
    model, state = machine("prismatic"), {"axis.position": 1e-3}
    (tmp_path / "model.toml").write_text(MACHINE.format(kind="prismatic", stiffness=1e9, arm=0.3), encoding="utf-8")
    sentences = []
    with pytest.raises(DivergedError) as caught:
        Simulation(model, STEP, integrator="rk4", state=state).run(np.zeros((500, 1)))
    sentences.append(str(caught.value))
    with pytest.raises(DivergedError) as caught:
        simulate(model, silence(), integrator="rk4", initial_state=model.state(state))
    sentences.append(str(caught.value))
    assert np.abs(caught.value.run.values[:, :2]).max() < LIGHT  # type: ignore[attr-defined]
    [failed] = simulate_batch(model, [Trial(silence(), initial_state=state)], setup=Setup("rk4"))
    sentences.append(str(failed))
    document = {
        "scenario": "plucked",
        "duration": 0.4,
        "time_step": STEP,
        "integrator": "rk4",
        "initial": state,
        "runs": [{"name": "bare", "model": "model.toml"}],
    }
    [told] = Scenario.from_dict(document, folder=tmp_path).run().failures.values()
    sentences.append(str(told))
    assert "beyond 2.9979e8, at which its body is as fast as light, at t = 0.00" in sentences[0]
    assert all(sentences[0] in sentence for sentence in sentences), sentences


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ({"axis.position": 1e14}, "position of joint `axis` is 1.0000e14, beyond 4.5036e13, where rounding hides"),
        ({"axis.velocity": 3e8}, "velocity of joint `axis` is 3.0000e8, beyond 2.9979e8"),
    ],
)
def test_a_start_beyond_its_bound_is_refused(state: dict[str, float], words: str) -> None:
    with pytest.raises(SimulationError, match="beyond") as caught:
        Simulation(machine("prismatic"), STEP, state=state)
    assert words in str(caught.value)


def test_a_line_loses_no_more_than_its_oil_can_be_pressed() -> None:
    """Numbers of any size up to rounding passed for a loss of pressure."""
    rig = Model.load(EXAMPLES / "servo_cylinder" / "rig.toml")
    rig = rig.with_effect("supply_drop", "pump", resistance=1e9, time_constant=0.01)
    # 160 bar, and 1.2 GPa times one and the logarithm of both volumes of the larger chamber, 201.06 mm^2 times 80 mm.
    most = 160e5 + 1.2e9 * (1.0 + np.log1p(0.25 * np.pi * 0.016**2 * 0.08 / 2.9e-6))
    Simulation(rig, STEP, state={"pump.drop": 0.999 * most})
    for drop in (1.001 * most, -1.001 * most, 1e15):
        with pytest.raises(SimulationError, match=r"drop of supply `pump` is .*, beyond .*, to which its stroke"):
            Simulation(rig, STEP, state={"pump.drop": drop})


LAGGING = """
[[effects]]
type = "warming_friction"
at = "axis"
coulomb = 1.0
viscous = 0.0
time_constant = 10.0
"""


def test_a_memory_starts_where_its_law_leads() -> None:
    model = Model.from_toml(MACHINE.format(kind="prismatic", stiffness=1.0, arm=0.3) + LAGGING)
    with pytest.raises(SimulationError, match=r"of an effect of joint `axis` starts at 1.0000e3, .* than 1.0000e0"):
        Simulation(model, STEP, state={"axis.warming.memory": 1e3})
    with pytest.raises(SimulationError, match=r"starts at -1.0000e3"):
        Simulation(model, STEP).reset({"axis.warming.memory": -1e3})
    # As far beyond as steps may be off.
    assert np.isfinite(Simulation(model, STEP, state={"axis.warming.memory": 1.5}).step([0.0])).all()


@pytest.mark.parametrize("damping", [0.2, 0.7, 3.0])
def test_a_spool_starts_where_the_worst_command_drives_it(damping: float) -> None:
    """A command that changes its sign with every half swing, from one end of the stroke to the other."""
    rig = Model.load(EXAMPLES / "servo_cylinder/rig.toml").with_parameters({"servo.valve.damping": damping})
    stroke, omega = (rig.parameters[f"servo.valve.{name}"].value for name in ("stroke", "frequency"))
    place = speed = most = fastest = 0.0
    step = 2e-4 / omega
    for _ in range(300_000):
        target = stroke if speed >= 0.0 else -stroke
        speed += step * (omega**2 * (target - place) - 2.0 * damping * omega * speed)
        place += step * speed
        most, fastest = max(most, abs(place)), max(fastest, abs(speed))
    for state, reach in (("servo.spool", most), ("servo.spool_rate", fastest)):
        Simulation(rig, STEP, state={state: reach})
        with pytest.raises(SimulationError, match="leads it no further than") as caught:
            Simulation(rig, STEP, state={state: 10.0 * reach})
        told = float(str(caught.value).partition("no further than ")[2].split()[0])
        assert reach <= 1.001 * told
        assert state == "servo.spool_rate" or told == pytest.approx(reach, rel=2e-3)


def test_a_beam_bends_no_further_than_a_strain_of_one_and_oil_is_pressed_no_further_than_its_stroke() -> None:
    pendulum = Model.load(EXAMPLES / "flexible_pendulum/flexible_pendulum.toml")
    far = np.zeros(len(pendulum.state_names))
    far[len(pendulum.joints)] = 1e6
    with pytest.raises(SimulationError, match=r"is 1.0000e6, beyond .* at which its beam is strained by 1"):
        Simulation(pendulum, STEP, state=far)
    rig = Model.load(EXAMPLES / "servo_cylinder/rig.toml")
    place = next(k for k, name in enumerate(rig.state_names) if "chamber_a" in name)
    pressed = rig.state({})
    pressed[place] = 1e12
    with pytest.raises(SimulationError, match=r"is 1.0000e12, beyond .* press or stretch the oil"):
        Simulation(rig, STEP, state=pressed)


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("**/*.toml")), ids=lambda path: path.stem)
def test_no_example_comes_near_its_bounds(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    if "[bodies" not in text and "[beams" not in text:
        pytest.skip("a scenario or a linkage")
    model = Model.load(path)
    try:
        sim = Simulation(model, STEP)
    except SimulationError as reason:
        pytest.skip(f"it cannot start at zero: {reason}")
    go(sim, 100)


@settings(max_examples=40, deadline=None)
@given(
    kinds=st.lists(st.sampled_from(["prismatic", "revolute"]), min_size=1, max_size=3),
    mass=st.floats(1e-3, 1e4),
    radius=st.floats(1e-3, 10.0),
    push=st.floats(0.1, 100.0),
    integrator=st.sampled_from(["linearly_implicit", "additive", "rosenbrock", "adaptive", "rk4"]),
)
def test_no_random_machine_is_ended_by_its_bounds(
    kinds: list[str], mass: float, radius: float, push: float, integrator: str
) -> None:
    inertia = mass * radius**2
    parts = ['name = "chain"\ngravity = [0.0, 0.0, -9.81]']
    for k, kind in enumerate(kinds):
        parent = "world" if k == 0 else f"part{k - 1}"
        axis = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]][k]
        # Up to 10 g, by the inertia that the effort moves.
        gain = push * (mass if kind == "prismatic" else inertia / max(radius, 0.1))
        parts.append(f"""
        bodies.part{k} = {{ mass = {mass}, inertia = [{inertia}, {inertia}, {inertia}, 0, 0, 0] }}
        joints.joint{k} = {{ type = "{kind}", parent = "{parent}", child = "part{k}", axis = {axis} }}
        actuators.drive{k} = {{ joint = "joint{k}", gain = {gain} }}
        """)
    sim = Simulation(Model.from_toml("\n".join(parts)), STEP, integrator=integrator)
    for _ in range(50):
        sim.step(np.ones(len(kinds)))


@pytest.fixture
def growing() -> Iterator[Model]:
    """A bob that is pushed away from its place on the cart."""
    register("repulsion", law="slope*q", sizes={"slope": "{E}/{C}"}, sentence="{at} is pushed away by {slope}.")
    yield Model.from_toml(CART.format(effect=f'type = "repulsion"\nslope = {GROWTH**2}'))
    unregister("repulsion")


def log(size: float = 1e-2) -> Experiment:
    time = BEGIN + STEP * np.arange(900)
    channels = {"guide.position": size * np.sin(20.0 * (time - BEGIN))}
    return Experiment.from_arrays(time, channels, units={"guide.position": "m"}, name="log")


def ended(model: Model, experiment: Experiment, integrator: str, cutoff: float | None = None) -> DivergedError:
    with pytest.raises(DivergedError) as caught:
        simulate(model, experiment, "prescribed_motion", integrator=integrator, cutoff=cutoff)
    return caught.value


INTEGRATORS = ["rk4", "semi_implicit", "linearly_implicit", "rosenbrock", "additive", "adaptive", "guarded"]


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("cutoff", [None, 20.0])
def test_what_grows_along_a_motion_ends_the_run_where_it_is(
    growing: Model, integrator: str, cutoff: float | None
) -> None:
    error = ended(growing, log(), integrator, cutoff)
    said = str(error)
    found = re.search(
        r"the velocity of joint `tail` is (\S+), beyond 2\.9979e8, at which .* light, at t = (\S+) s", said
    )
    assert found, said
    value, time = abs(float(found[1])), float(found[2])
    assert LIGHT < value < LIGHT * np.exp(1.5 * GROWTH * STEP)
    # Counted from the beginning of the log, as every other run.
    assert error.time is not None
    assert error.time == pytest.approx(BEGIN + time)
    assert isinstance(error.run, Run)
    assert error.run.time[-1] == pytest.approx(error.time - STEP)
    assert np.abs(error.run["tail.velocity"]).max() < LIGHT
    # The rows that it keeps are those of the run on a log that ends before.
    assert error.run.time[0] > BEGIN
    assert error.run["tail.velocity"][-1] == pytest.approx(np.sign(float(found[1])) * value / np.exp(0.1), rel=0.02)


def test_the_time_is_the_same_by_all_methods_that_follow_the_growth(growing: Model) -> None:
    times = [
        float(ended(growing, log(), integrator).time or 0.0)
        for integrator in ("rk4", "rosenbrock", "adaptive", "guarded")
    ]
    assert max(times) - min(times) < 2.5 * STEP


@pytest.mark.parametrize(
    ("integrator", "repair"),
    [
        ("rk4", "use more substeps or the integrator linearly_implicit, and check units and jumps of the motion"),
        ("linearly_implicit", "use more substeps or the integrator adaptive, and check units and jumps of the motion"),
        ("adaptive", "; check units and jumps of the motion"),
    ],
)
def test_the_repair_is_not_what_the_run_does_already(growing: Model, integrator: str, repair: str) -> None:
    assert str(ended(growing, log(), integrator)).endswith(repair)


def test_steps_that_let_a_stiff_spring_grow_end_likewise() -> None:
    model = Model.from_toml(CART.format(effect='type = "spring"\nstiffness = 1e9\nrest = 0.0'))
    error = ended(model, log(), "rk4")
    assert re.search(
        r"the velocity of joint `tail` is \S+, beyond 2\.9979e8, at which its body is as fast as light", str(error)
    )
    assert simulate(model, log(), "prescribed_motion", integrator="rosenbrock")["tail.position"].max() < 1e-8


def test_a_motion_faster_than_light_is_told_by_its_own_joint() -> None:
    model = Model.from_toml(CART.format(effect='type = "spring"\nstiffness = 1e3\nrest = 0.0'))
    assert "the velocity of joint `guide` is " in str(ended(model, log(1e9), "linearly_implicit"))
