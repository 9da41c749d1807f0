"""A joint that grows without bound along a motion of a log: one error, with the state, the time and the bound."""

import re
from collections.abc import Iterator

import numpy as np
import pytest

from vpm.catalogue import register, unregister
from vpm.errors import DivergedError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simulate import Run, simulate

LIGHT = 299_792_458.0
STEP, BEGIN = 1e-3, 5.0
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
