"""The low-frequency part of a residual, and what a bound lets a candidate do in screening."""

import numpy as np
import pytest

from model_texts import on_rail
from vpm import Experiment, Model
from vpm.discrepancy.screening.candidates import candidates
from vpm.discrepancy.screening.probe import Baseline, probe
from vpm.identify import InverseDynamicsProblem

TEXT = (
    on_rail(
        "body",
        '{ value = 2.0, uncertainty = 0.2, unit = "kg" }',
        gain='{ value = 1.0, unit = "N/N" }',
        gravity="[0.0, 0.0, -9.81]",
    )
    + 'command_unit = "N"\n'
)


@pytest.fixture(scope="module")
def problem() -> InverseDynamicsProblem:
    """A slide that is pushed about at 0.8 and 1.7 Hz for 6 s, with forces that no mass explains: they pull it on."""
    time = 1e-3 * np.arange(6000)
    rates = 2.0 * np.pi * np.array([[0.8], [1.7]])
    path = (np.array([[0.1], [0.04]]) * np.sin(rates * time)).sum(0)
    acceleration = -(np.array([[0.1], [0.04]]) * rates**2 * np.sin(rates * time)).sum(0)
    data = {"axis.position": path, "drive.command": -0.5 * acceleration}
    record = Experiment.from_arrays(time, data, units={"axis.position": "m", "drive.command": "N"}, name="log")
    return InverseDynamicsProblem(Model.from_toml(TEXT), [record])


def test_asymmetric_friction_is_screened_with_a_change_of_direction_as_sharp_as_it_is(
    problem: InverseDynamicsProblem,
) -> None:
    """A dry friction that is fitted wide without it makes up for some of it."""
    (log,) = problem.experiments
    motion = problem.motions[0]
    command = 2.0 * motion.acceleration[:, 0] + np.where(motion.velocity[:, 0] > 0.0, 1.4, -0.6)
    uneven = Experiment.from_arrays(
        log.time,
        {"axis.position": log["axis.position"], "drive.command": command},
        units={"axis.position": "m", "drive.command": "N"},
        name="uneven",
    )
    model = Model.from_toml(TEXT).with_effect("coulomb_friction", at="axis", coulomb=1.0, transition_velocity=0.2)
    data = InverseDynamicsProblem(model, [uneven])
    free = ("body.mass", "axis.friction.coulomb")
    residual, jacobian = data.evaluate(model, model.theta, [model.index(name) for name in free])
    (candidate,) = candidates(model, data, residual, ["asymmetric_friction"])
    assert candidate.starts[0]["transition_velocity"] == 0.2
    found = probe(Baseline(model, free, residual, jacobian), data, candidate)
    assert found.model.parameters["axis.friction.asymmetric_transition_velocity"].value < 0.01
    assert found.values["axis.friction.coulomb_difference"] == pytest.approx(0.8, rel=0.1)
