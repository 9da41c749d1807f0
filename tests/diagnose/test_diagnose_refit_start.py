"""Where refits begin: at what the recalibration left, or at what the model file states."""

import numpy as np
import pytest

from blind import Case
from inverse_dynamics import inverse_dynamics_data
from shared_cases import shared_case
from vpm.catalogue import EFFECTS
from vpm.discrepancy.confirmation.confirmation import confirm, judge, nearer_start
from vpm.discrepancy.screening.candidates import Candidate
from vpm.discrepancy.screening.probe import probe
from vpm.identify import InverseDynamicsProblem

#: What a recalibration makes of a valve that does not answer to small commands: soft oil, and a small opening.
MISLED = {"pump.oil.bulk_modulus": 0.45, "servo.valve.flow_gain": 0.75}


@pytest.fixture(scope="module")
def case() -> Case:
    return shared_case("servo_cylinder", "dead_zone", 42)


@pytest.mark.nightly
def test_a_refit_leaves_what_a_recalibration_without_the_effect_made_of_the_oil(case: Case) -> None:
    stated = case.model()
    data = InverseDynamicsProblem(stated, case.train[:1])
    misled = stated.with_parameters({name: share * stated.parameters[name].value for name, share in MISLED.items()})
    width = case.truth.hidden[0].parameters["width"]
    start = misled.with_effect("dead_zone", at="servo", width=width)
    own, known = ("servo.dead_zone.width",), tuple(MISLED)
    found = nearer_start(start, own, known, data)
    assert {name: found.parameters[name].value for name in known} == {n: stated.parameters[n].value for n in known}
    assert found.parameters[own[0]].value == width
    # What is fitted well already stays: the file is not nearer, and laws of joints change nothing of the drive.
    assert nearer_start(found, own, known, InverseDynamicsProblem(misled, case.train[:1])) is found
    loaded = misled.with_effect("bias_force", at="axis", force=1.0)
    assert nearer_start(loaded, ("axis.bias.force",), known, data) is loaded


@pytest.mark.nightly
def test_a_wide_dead_zone_of_a_valve_is_found_from_there(case: Case) -> None:
    model, free, data = inverse_dynamics_data(case)
    oil = model.parameters["pump.oil.bulk_modulus"].value
    without = judge(model, free, data, {"pump.oil.bulk_modulus": (oil / 2.2, 2.2 * oil)})
    trial = confirm(
        without, data, probe(without.baseline, data.training, Candidate(EFFECTS["dead_zone"], "servo", ({},)))
    )
    width = trial.judged.model.parameters["servo.dead_zone.width"].value
    assert np.isclose(width, case.truth.hidden[0].parameters["width"], rtol=0.03)
    assert trial.validation.relative > 0.9
