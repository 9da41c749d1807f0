"""Two effects that are missing at once, of which neither is what a search sees first."""

from __future__ import annotations

import numpy as np
import pytest

import vpm
from blind import make_case
from vpm.ranking.judgement import Judgement
from vpm.ranking.settings import Settings


def test_two_effects_that_make_each_other_uneven_count_together() -> None:
    """Drag and an offset of the angle in gravity: beside either alone, pieces of record differ by the other one."""
    effects = ("quadratic_drag", "sensor_offset")
    case = make_case("axis_rotary", effects, 9800)
    model = case.model()
    ranking = vpm.rank(model, case.train, effects=effects, settings=Settings(effects=2))
    assert {one.key for one in ranking.effects} == {("quadratic_drag", "axis"), ("sensor_offset", "encoder")}
    assert all(one.judgement.counts(Settings()) and one.evidence > Settings().odds for one in ranking.effects)
    assert vpm.rank(model, case.train, effects=["quadratic_drag"]).effects == ()
    hidden = {(one.name, one.site): one.parameters for one in case.truth.hidden}
    drag = ranking.model.parameters[ranking.model.effect("quadratic_drag", "axis").parameter_names["drag"]].value
    assert drag == pytest.approx(hidden["quadratic_drag", "axis"]["drag"], rel=0.05)


@pytest.mark.nightly
def test_what_does_the_work_of_two_effects_makes_room_for_them() -> None:
    """A gain of the encoder leaves a twentieth of what a stiffening spring does, until a delay stands beside them."""
    case = make_case("axis_rotary", ("cubic_spring", "input_delay"), 9803)
    effects = ("cubic_spring", "input_delay", "sensor_gain")
    ranking = vpm.rank(case.model(), case.train, effects=effects, settings=Settings(effects=2))
    assert ranking.rounds[0][0].effect == "sensor_gain"
    assert [one.key for one in ranking.effects] == [("cubic_spring", "axis"), ("input_delay", "drive")]
    hidden = {(one.name, one.site): one.parameters for one in case.truth.hidden}
    stiffness = ranking.model.parameters["axis.cubic_spring.stiffness"].value
    assert stiffness == pytest.approx(hidden["cubic_spring", "axis"]["stiffness"], rel=0.02)


@pytest.mark.parametrize(("score", "uneven"), [(1.0, True), (0.0, False), (-1.0, False), (4.0, False)])
def test_what_lacks_its_score_alone_is_uneven(score: float, uneven: bool) -> None:
    judgement = Judgement(0.5, 0.5, score, 0.1, 1.0, 1.0)
    assert judgement.is_faint(Settings(), np.inf) is uneven
    assert not Judgement(0.05, 0.05, score, 0.1, 1.0, 1.0).is_faint(Settings(), np.inf)
