"""A hydraulic leg on a guide that has no drive: no inverse-dynamics residual shows what acts there."""

import numpy as np
import pytest

import vpm
from places import EXAMPLES
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array

HYL = EXAMPLES / "hyl"
RECORDS = ("squat", "bounce", "sway")
#: Noise of positions [m, rad], pressures [Pa] and of the force of the ground [N].
NOISE = {"position": 1e-5, "pressure_a": 5e3, "pressure_b": 5e3, "normal_force": 1.0}
LOGGED = (
    *("slider.position", "hip_rotation.position", "knee_rotation.position", "foot.normal_force"),
    *(f"{drive}.pressure_{side}" for drive in ("hip_drive", "knee_drive") for side in "ab"),
)
COMMANDS = tuple(f"{drive}.{what}" for drive in ("hip_drive", "knee_drive") for what in ("command", "reference"))


def leg() -> Model:
    """The leg of the examples without the hand that pulls at its slider."""
    content = Model.load(HYL / "hydraulic.toml").to_dict()
    del content["actuators"]["hand"]
    return Model(content)


def logged(model: Model) -> list[Experiment]:
    """Its three motions in closed loop with steps that are controlled, with noise of sensors."""
    random, logs = np.random.default_rng(11), []
    for name in RECORDS:
        asked = Experiment.load(HYL / f"{name}.csv", model=Model.load(HYL / "hydraulic.toml"))
        run = vpm.simulate(model, asked, "closed_loop")
        values: dict[str, Array] = {c: run[c] if c in run.channels else asked[c] for c in COMMANDS}
        for channel in LOGGED:
            level = NOISE[channel.rpartition(".")[2]]
            values[channel] = run[channel] + level * random.standard_normal(len(run.time))
        logs.append(Experiment.from_arrays(run.time, values, name=name, model=leg()))
    return logs


@pytest.mark.nightly
def test_a_payload_on_the_trunk_and_friction_of_the_guide_are_told_apart() -> None:
    effects = ["payload", "coulomb_friction"]
    *train, test = logged(leg().with_effect("payload", at="carriage", mass=0.6))
    why = vpm.diagnose(leg(), train, test, effects=effects, limit=1)
    assert [(one.name, one.site) for one in why.effects] == [("payload", "carriage")]
    assert why.effects[0].parameters[0].value == pytest.approx(0.6, rel=0.02)
    *train, test = logged(leg().with_effect("coulomb_friction", at="slider", coulomb=12.0))
    why = vpm.diagnose(leg(), train, test, effects=effects, limit=1)
    assert [(one.name, one.site) for one in why.effects] == [("coulomb_friction", "slider")]
    assert why.effects[0].parameters[0].value == pytest.approx(12.0, rel=0.05)


@pytest.mark.nightly
def test_nothing_is_said_to_be_missing_where_nothing_is() -> None:
    *train, test = logged(leg())
    why = vpm.diagnose(leg(), train, test)
    assert (why.verdict, why.effects) == ("no_disagreement", ())
    gap = why.gap["slider.position (observed)"]
    assert gap.after == pytest.approx(gap.noise_floor, rel=0.3)


@pytest.mark.nightly
def test_a_payload_on_the_trunk_is_named_with_its_mass() -> None:
    *train, test = logged(leg().with_effect("payload", at="carriage", mass=0.8))
    why = vpm.diagnose(leg(), train, test)
    assert why.verdict == "effect_found"
    assert [(one.name, one.site) for one in why.effects] == [("payload", "carriage")]
    assert why.effects[0].parameters[0].value == pytest.approx(0.8, rel=0.02)
    gap = why.gap["slider.position (observed)"]
    assert gap.after < 0.1 * gap.recalibrated


@pytest.mark.nightly
def test_dry_friction_of_the_guide_is_named() -> None:
    *train, test = logged(leg().with_effect("coulomb_friction", at="slider", coulomb=15.0))
    why = vpm.diagnose(leg(), train, test)
    assert [(one.name, one.site) for one in why.effects] == [("coulomb_friction", "slider")]
    assert why.effects[0].parameters[0].value == pytest.approx(15.0, rel=0.05)


@pytest.mark.nightly
def test_other_values_of_a_known_mass_are_parameters() -> None:
    heavier = leg().with_parameters({"carriage.mass": 7.8})
    content = leg().to_dict()
    content["bodies"]["carriage"]["mass"] = {"value": 7.36, "uncertainty": 0.3}
    *train, test = logged(heavier)
    why = vpm.diagnose(Model(content), train, test)
    assert (why.verdict, why.effects) == ("parameters_only", ())
