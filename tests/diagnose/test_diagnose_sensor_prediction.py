"""The offset of a pressure gauge and a constant force: one inverse-dynamics residual, two different readings."""

import pytest

from inverse_dynamics import inverse_dynamics_data
from shared_cases import shared_case
from vpm.catalogue import EFFECTS
from vpm.discrepancy.confirmation.confirmation import confirm, judge
from vpm.discrepancy.screening.candidates import Candidate
from vpm.discrepancy.screening.probe import probe
from vpm.discrepancy.search.candidate_choice import choose

RIVALS = (("bias_force", "axis"), ("sensor_offset", "gauge_a"), ("sensor_offset", "gauge_b"))


@pytest.mark.nightly
@pytest.mark.parametrize("there", [("sensor_offset", "gauge_b"), ("bias_force", "axis")])
def test_a_gauge_is_blamed_for_what_it_reads_and_not_for_a_load(there: tuple[str, str]) -> None:
    case = shared_case("servo_cylinder", "@".join(there), 42)
    model, free, data = inverse_dynamics_data(case)
    without = judge(model, free, data, {})
    listed = [Candidate(EFFECTS[name], site, ({},)) for name, site in RIVALS]
    trials = [confirm(without, data, probe(without.baseline, data.training, candidate)) for candidate in listed]
    assert choose(trials, data).key == there
