"""Rankings where nobody knows the shape of a law of friction: how it turns round, and how it fades from rest."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import vpm
from second_suite import boom
from second_suite.cases import inputs_of
from second_suite.logs import logged
from second_suite.loop import simulated
from second_suite.machine import columns_of
from sledge import DRY, SLEDGE, pushed
from vpm.catalogue.shared import SLOW
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.ranking.parameter_priors import known
from vpm.ranking.settings import Settings
from vpm.ranking.substitute_records import shown
from vpm.ranking.tracked_records import TrackedRecords


@cache
def luffed() -> tuple[Model, Experiment]:
    """The boom of a crane on a cylinder whose seals truly stick, by other code, and a model with its numbers."""
    machine = replace(boom.MACHINE, lengths=(8.0,))
    asked, _ = inputs_of(machine, 3)
    signals = simulated(machine, columns_of(machine.values, 1), (), asked, np.array([True]), np.random.default_rng(3))

    def number(key: str) -> object:
        value, share = machine.values[key], machine.adjustable.get(key)
        return value if share is None else {"value": value, "uncertainty": share * value}

    return Model.from_dict(machine.document(number, frozenset())), logged(machine, asked, signals, 0)


def test_seals_turn_round_at_a_speed_of_the_piston_that_nobody_knows() -> None:
    """The way of the piston follows from the logged angle by the law of cosines."""
    model, record = luffed()
    tracked = TrackedRecords(model, [record], Settings())
    prior = known(model, shown(model, tracked), tracked)["lifter.friction.transition_velocity"]
    length, _ = boom.line({}, np.convolve(record["luff.position"], np.full(25, 0.04), "valid"))
    rate = np.abs(np.gradient(length, record.time[1] - record.time[0]))
    assert (prior.low, prior.high) == pytest.approx(np.quantile(rate, 0.999) * np.array(SLOW), rel=0.1)
    stated = model.to_dict()
    stated["actuators"]["lifter"]["friction"]["transition_velocity"] = {"value": 2e-3, "uncertainty": 1e-3}
    sure = Model.from_dict(stated)
    told = known(sure, shown(sure, tracked), tracked)["lifter.friction.transition_velocity"]
    assert [told.value(0.0), told.value(1.0)] == pytest.approx([2e-3, 3e-3])
    pressed = model.with_effect("seal_friction", at="lifter", share=0.03)
    own = known(pressed, shown(pressed, tracked), tracked)["lifter.seal_friction.transition_velocity"]
    assert (own.low, own.high) == pytest.approx((prior.low, prior.high), rel=0.2)


def test_seals_that_stick_are_no_other_friction_of_the_joint() -> None:
    """The numbers of the model are those of the boom; its seals turn round over 1 mm/s, and those of the boom at once.

    What that leaves at every reversal looks like an excess of friction close to rest.
    """
    model, record = luffed()
    ranking = vpm.rank(model, record, effects=["stribeck_friction"])
    assert ranking.effects == ()
    assert ranking.recalibrated.parameters["lifter.friction.transition_velocity"].value < 2e-4


@pytest.mark.parametrize("seeds", [(3, 4), (11, 12)])
def test_what_a_law_is_wrong_by_in_its_shape_is_no_other_effect(seeds: tuple[int, int]) -> None:
    """An excess that falls off by the square of the speed is no bell; the rest looks like a drag, all the way.

    Nothing but the free shape refuses that here.
    """
    records = [pushed(seed=seed, dry=3.0, excess=10.0, duration=5.0) for seed in seeds]
    ranking = vpm.rank(Model.from_toml(DRY), records, effects=["stribeck_friction", "quadratic_drag"])
    assert [one.effect for one in ranking.effects] == ["stribeck_friction"]
    (drag,) = (one for one in ranking.rounds[1] if one.effect == "quadratic_drag")
    assert drag.judgement.lacks(Settings()) == "stribeck_friction at way does as well by another shape of its law"


@pytest.mark.parametrize("hidden", [{"bell": 10.0, "drag": 4.0}, {"excess": 10.0, "drag": 8.0}])
def test_a_drag_that_is_there_is_found_beside_an_excess_of_either_shape(hidden: dict[str, float]) -> None:
    records = [pushed(seed=seed, dry=3.0, duration=5.0, **hidden) for seed in (1, 2)]
    ranking = vpm.rank(Model.from_toml(DRY), records, effects=["stribeck_friction", "quadratic_drag"])
    assert {one.effect for one in ranking.effects} == {"stribeck_friction", "quadratic_drag"}


def test_friction_that_vanishes_at_some_places_counts_with_its_mean() -> None:
    """Its mean alone takes nothing from some pieces of the records, and its waves rest on that."""
    ranking = vpm.rank(Model.from_toml(SLEDGE), [pushed(seed=seed, dry=3.0, wavy=3.0) for seed in (1, 2)])
    named = {(one.effect, one.site) for one in ranking.effects}
    assert named == {("coulomb_friction", "way"), ("position_dependent_friction", "way")}
    level, wave = (ranking.model.parameters[f"way.friction.{name}"].value for name in ("coulomb", "position_cosine"))
    assert (level, wave) == pytest.approx((3.0, 3.0), rel=0.01)
