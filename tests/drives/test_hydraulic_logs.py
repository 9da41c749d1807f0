"""Two measured hydraulic machines where their records are at hand, and the starts and loops that they rest on."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from drive_texts import RIG
from model_texts import changed
from places import EXAMPLES, ROOT, script
from vpm.errors import SimulationError
from vpm.experiment import Experiment
from vpm.initial import initial_state
from vpm.model import Model
from vpm.simulate import simulate

DATA = ROOT.parent / "shared" / "data"
CRANE = DATA / "hydraulic_crane_actuator" / "actuator.csv"
PRESS = DATA / "servo_hydraulic_actuator" / "chirp_mr0A.csv"

needs_crane = pytest.mark.skipif(
    not CRANE.exists(), reason="the crane's record is not at hand: ../shared/data is absent"
)
needs_press = pytest.mark.skipif(
    not PRESS.exists(), reason="the press's record is not at hand: ../shared/data is absent"
)

LOAD = 1500.0


def example(name: str) -> ModuleType:
    """The script of an example as a module."""
    return script(EXAMPLES / name / "run.py", name)


# ---- the records -----------------------------------------------------------------------------------------------------


@needs_crane
def test_a_cylinder_with_its_two_directions_predicts_the_unseen_half_of_the_crane(tmp_path: Path) -> None:
    crane = example("crane")
    record = crane.load(CRANE)
    half = crane.first(record, 512)
    assert (len(record), len(half)) == (1024, 512)
    unseen = slice(512, None)
    plain = crane.linear(record, 512, two_gains=False)
    assert 0.95 < crane.rms(plain, record, unseen) < 1.10
    gaps = {}
    for name in ("symmetric cylinder", "asymmetric", "asymmetric, overlap, stroke"):
        fit, _ = crane.fitted(crane.VARIANTS[name], half, starts=1)
        gaps[name] = crane.rms(crane.pressure(fit.model, record), record, unseen)
    # Found: 0.914, 0.618, 0.505, from the best of four starts each.
    assert gaps["symmetric cylinder"] > 0.8
    assert gaps["asymmetric"] < 0.68
    assert gaps["asymmetric, overlap, stroke"] < 0.56
    assert not fit.at_bounds
    assert crane.draw(record, {"linear": plain}, 512, tmp_path).stat().st_size > 5000


@needs_press
def test_the_press_is_predicted_beyond_the_frequencies_of_its_fit_and_under_another_load() -> None:
    press = example("servo_actuator")
    soft, stiff = press.load(PRESS), press.load(PRESS.with_name("chirp_mr1A.csv"))
    fit = press.fitted(soft, {}, pieces=((8.0, 9.5), (36.0, 37.5)))
    assert not fit.at_bounds
    for record in (soft, stiff):
        low, _ = press.gap(fit.model, record, (5.0, 12.0), press.PLACE)
        high, share = press.gap(fit.model, record, (48.0, 52.0), press.PLACE)
        assert low < 0.05e-3
        assert high < 0.09e-3
        assert share < 0.16
    _, force = press.gap(fit.model, soft, (36.0, 40.0), press.FORCE)
    assert force < 0.4


# ---- what they rest on -----------------------------------------------------------------------------------------------


def loaded() -> Model:
    """The servo-cylinder of the examples under a constant load against its coordinate, without the spring."""
    model = changed(RIG).without_effect("spring", at="axis")
    return model.with_effect("bias_force", at="axis", force=LOAD)


def standing(channels: dict[str, float]) -> Experiment:
    """A log of a machine that stands still with its valve shut."""
    values = {"servo.command": 0.0, "axis.position": 0.01, **channels}
    units = {"servo.command": "A", "axis.position": "m"} | dict.fromkeys(channels, "Pa")
    return Experiment.from_arrays(
        1e-3 * np.arange(50), {name: np.full(50, value) for name, value in values.items()}, units, name="stands"
    )


@pytest.mark.parametrize("side", ["a", "b"])
def test_one_measured_pressure_and_the_load_tell_the_other(side: str) -> None:
    model = loaded()
    area, ring = 0.25 * np.pi * 0.016**2, 0.25 * np.pi * (0.016**2 - 0.010**2)
    pressures = {"a": 9e6, "b": (area * 9e6 - LOAD) / ring}
    log = standing({f"servo.pressure_{side}": pressures[side]})
    state = initial_state(model, log, model.theta)
    places = [model.state_names.index(f"servo.chamber_{each}") for each in "ab"]
    assert state[places] == pytest.approx([pressures["a"], pressures["b"]], rel=1e-12)
    tight = model.with_parameters({"servo.cylinder.internal_leakage": 0.0})
    run = simulate(tight, log, "free_run", substeps=4)
    assert np.abs(run["axis.position"] - 0.01).max() < 1e-9


def test_a_pressure_that_no_balance_can_have_ends_at_tank_or_supply() -> None:
    model = loaded()
    log = standing({"servo.pressure_a": 2e6})
    place = model.state_names.index("servo.chamber_b")
    assert initial_state(model, log, model.theta)[place] == model.parameters["pump.tank_pressure"].value


def test_a_spring_needs_no_controller_in_a_closed_loop_but_a_cylinder_does() -> None:
    model = Model.load(EXAMPLES / "servo_actuator" / "servo.toml")
    clock = 1e-3 * np.arange(300)
    step = Experiment.from_arrays(clock, {"servo.reference": np.full(300, 1e-3)}, {"servo.reference": "m"}, name="step")
    run = simulate(model, step, "closed_loop", substeps=2)
    # The speed for an error of place is that of the valve's gain and half the supply's pressure: 1/21 ms.
    assert run["axis.position"][-1] == pytest.approx(1e-3, rel=0.02)
    assert 0.5e-3 < run["axis.position"][25] < 0.8e-3
    text = model.to_toml()
    without = Model.from_toml(text[: text.index("[controllers.loop]")] + text[text.index("[[effects]]") :])
    with pytest.raises(SimulationError, match="servo"):
        simulate(without, step, "closed_loop")
