"""A measured two-link flexible arm (Quanser): the torque of hub 1 from named effects, judged on the unseen half.

Data: github.com/basta/quanser-2-dof-serial-flexible-link (MIT licence), AA4CC, CTU Prague. The error is the relative
root mean square of the hub's torque, 100 norm(tau - tau*) / norm(tau), tau the measured current times the motor's
constant; both sides pass the zero-phase low-pass that the package chooses for the record (54.5 Hz).
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vpm.diagnosing import diagnose
from vpm.experiment import Experiment
from vpm.identify import InverseDynamicsProblem, identify
from vpm.model import Model

LOG = Path(__file__).resolve().parents[3] / "shared" / "data" / "quanser_2dsfl" / "two_link_lqr_squarewave.csv"

pytestmark = pytest.mark.skipif(not LOG.exists(), reason="the arm's record is absent: ../shared/data")

#: Torque of hub 1 per current with its gear, N m/A, from the vendor.
TORQUE_CONSTANT = 8.925


def hub(flexible: bool) -> Model:
    """Hub 1 as an axis; of a flexible link the gauge's angle is an input that acts on the hub by its stiffness."""
    inertia = {"value": 0.0635 if flexible else 0.234, "unit": "kg m^2", "uncertainty": 0.2, "min": 1e-3, "max": 5.0}
    content: dict[str, Any] = {
        "name": "hub 1",
        "gravity": [0, 0, 0],
        "bodies": {"arm": {"mass": 1.0, "inertia": [1.0, 1.0, inertia, 0, 0, 0]}},
        "joints": {"hub": {"type": "revolute", "parent": "world", "child": "arm", "axis": [0, 0, 1]}},
        "actuators": {
            "motor": {"joint": "hub", "gain": {"value": TORQUE_CONSTANT, "unit": "N m/A"}, "command_unit": "A"}
        },
        "sensors": {"encoder": {"measures": "hub.position"}},
        "effects": [
            {"type": "viscous_friction", "at": "hub", "viscous": {"value": 4.0, "uncertainty": 2.0, "min": 0.0}}
        ],
    }
    if flexible:
        stiffness = {"value": -39.957, "unit": "N m/rad", "uncertainty": 20.0, "min": -500.0, "max": 500.0}
        content["actuators"]["link"] = {"joint": "hub", "gain": stiffness, "command_unit": "rad"}
    return Model.from_dict(content)


def halves(flexible: bool) -> tuple[Experiment, Experiment]:
    table = np.genfromtxt(LOG, delimiter=",", names=True)
    middle = len(table) // 2

    def part(name: str, rows: slice) -> Experiment:
        channels = {"hub.position": np.deg2rad(table["hub1_deg"][rows]), "motor.command": table["i1_meas_A"][rows]}
        units = {"hub.position": "rad", "motor.command": "A"}
        if flexible:
            channels["link.command"] = np.deg2rad(table["tipdefl1_deg"][rows])
            units["link.command"] = "rad"
        return Experiment.from_arrays(0.002 * np.arange(len(table[rows])), channels, units=units, name=name)

    return part("first half", slice(0, middle)), part("second half", slice(middle, None))


def error(model: Model, experiment: Experiment) -> float:
    problem = InverseDynamicsProblem(model, [experiment])
    _, applied, required = problem.effort(model, model.theta, 0)
    alone = model.with_parameters({"link.gain": 0.0}) if "link.gain" in model.parameters else model
    torque = problem.effort(alone, alone.theta, 0)[1]
    return float(100.0 * np.linalg.norm(applied - required) / np.linalg.norm(torque))


def fitted(flexible: bool, *effects: str) -> Model:
    model = hub(flexible)
    for effect in effects:
        model = model.with_effect(effect, at="hub")
    return identify(model, halves(flexible)[0]).model


def test_link_and_dry_friction_explain_the_torque_of_the_unseen_half() -> None:
    unseen = halves(True)[1]
    model = fitted(True, "coulomb_friction")
    assert error(model, unseen) < 24.0
    # The vendor's stiffness is 40 N m/rad; what the fit finds is of that size and pulls the hub towards the link.
    assert -80.0 < model.parameters["link.gain"].value < -20.0
    assert model.parameters["hub.friction.coulomb"].value > 0.5
    assert error(fitted(True), unseen) > 30.0


def test_the_flexible_link_lowers_the_error_of_a_rigid_one() -> None:
    rigid, flexible = (error(fitted(kind, "coulomb_friction"), halves(kind)[1]) for kind in (False, True))
    assert flexible < 0.95 * rigid


def test_memory_of_the_gear_lowers_it_further() -> None:
    unseen = halves(True)[1]
    assert error(fitted(True, "hysteresis"), unseen) < 0.8 * error(fitted(True, "coulomb_friction"), unseen)


@pytest.mark.nightly
def test_a_diagnosis_of_the_rigid_hub_names_its_dry_friction() -> None:
    # Without the gauge the torque alone does not show the link.
    train, test = halves(False)
    found = diagnose(hub(False), train, test, effects=["coulomb_friction", "bias_force", "spring", "stribeck_friction"])
    assert found.steps[1].effect == "coulomb_friction"
    # It explains where the hub goes, and leaves a fifth of the mean square of the torque.
    assert found.verdict == "effect_found"
    assert "A structured residual above the noise remains." in found.summary
    torque = found.gap["hub.effort"]
    assert (torque.after / torque.recalibrated) ** 2 > 0.15


@pytest.mark.nightly
def test_with_the_gauge_a_diagnosis_names_the_flexible_link_and_then_dry_friction() -> None:
    train, test = (half.with_channel("arm_bending.position", half["link.command"], "rad") for half in halves(True))
    found = diagnose(hub(False), train, test)
    assert [step.effect for step in found.steps] == ["", "link_flexibility", "coulomb_friction"]
    torque, angle = found.gap["hub.effort"], found.gap["arm_bending.position"]
    assert torque.after / torque.signal < 0.24
    assert angle.after / angle.signal < 0.42
    assert angle.recalibrated / angle.signal > 1.0
