"""Steps of a ranking's trackers: as few as show the way, and as many as tell effects from each other."""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from sledge import DRY, SLEDGE, pushed
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.model import Model
from vpm.numbers import Array
from vpm.ranking.fit import Fitter, Followed, View
from vpm.ranking.model_structure import Structure
from vpm.ranking.ranking_search import Search
from vpm.ranking.settings import STEPS, Settings
from vpm.ranking.tracked_records import TrackedRecords, Tracker
from vpm.weighing import Prior

COARSE = Tracker(1.0).coarse
#: A spring of the sledge's drive, and one with play.
SPRING = {"stiffness": 4e3, "damping": 5.0, "inertia": 0.05}
PLAY = {**SPRING, "gap": 1e-3, "width": 1e-5}


@lru_cache
def search() -> Search:
    records = (pushed(seed=1, duration=4.0), pushed(seed=2, duration=4.0))
    return Search(Model.from_toml(SLEDGE), records, (), Settings(), None, ParallelCandidates(1, None), lambda _: None)


@pytest.mark.parametrize(("rate", "spring"), [(2000.0, 1), (500.0, 2), (125.0, 4)])
def test_a_spring_asks_for_steps_by_time_and_a_contact_by_samples(rate: float, spring: int) -> None:
    """Waves of a spring last as long however often a log was sampled; a contact opens and closes within a sample."""
    bare = Model.from_toml(SLEDGE)
    tracked = TrackedRecords(bare, (), Settings())
    told: list[tuple[str, dict[str, Any]]] = [("joint_compliance", SPRING), ("backlash", PLAY)]
    steps = [tracked.stepping(bare.with_effect(name, "way", **values), COARSE, 1.0 / rate)[1] for name, values in told]
    assert steps == [spring, STEPS]


def test_a_structure_takes_as_many_steps_as_the_one_that_it_is_compared_with() -> None:
    """Else what coarse steps do wrong would pass for what an effect with a contact explains."""
    tracked = TrackedRecords(Model.from_toml(SLEDGE), (), Settings())
    assert tracked.stepping(Model.from_toml(SLEDGE), replace(COARSE, fewest=STEPS), 1e-3)[1] == STEPS


def test_few_steps_are_corrected_to_what_those_of_the_tracker_leave() -> None:
    """Where a fit begins they agree to rounding, and the error of a step beside grows only with the distance."""
    own = search()
    look = own.look(own.fitted(own.start, Tracker(1.0)))
    structure, start = look.fitted.structure, look.start
    assert start.few == COARSE

    def left(move: float) -> float:
        moved = structure.at(structure.standard + move)
        few, fine = own.fitter._by_few_steps(moved, start), own.fitter.unfitted(moved, Tracker(1.0)).residual
        return float(np.abs(few - fine).max())

    near, far = left(0.01), left(0.1)
    assert left(0.0) <= 1e-15
    assert near < 0.2 * far < 0.02 * np.abs(look.fitted.residual).max()


def test_a_fit_goes_on_by_few_steps_only_where_these_change_little(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a small error what more steps leave more is wrong elsewhere; of order four, twice as many may do."""
    own = search()
    fitter, start = own.fitter, own.look(own.fitted(own.start, Tracker(1.0))).start
    assert fitter._by_steps_that_do(start).few == COARSE
    much = replace(start, offset=0.3 * start.residual)
    assert fitter._by_steps_that_do(much).few is None
    monkeypatch.setattr(type(fitter.tracked.setup), "method", lambda *_, **__: "additive")
    monkeypatch.setattr(fitter.tracked, "stepping", lambda *_: ("crank_nicolson", 1))
    for share, twice in ((0.1, 2), (0.3, None)):
        monkeypatch.setattr(fitter, "_pass", lambda *_, share=share: ((1.0 - share) * start.residual, None))
        found = fitter._by_steps_that_do(much)
        assert (found.few.fewest if found.few else None) == twice
        assert np.all(found.offset == pytest.approx(share * start.residual if twice else 0.0))


def test_a_fit_that_few_steps_lead_astray_goes_on_by_those_of_its_tracker(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few steps may find a way down where there is none: what is told of a fit is what its own steps leave."""
    own = search()
    begun = own.start.at(own.start.standard + 0.3)
    view = View(own.fitter.noise_of(begun, Tracker(1.0)))
    found = own.fitter.finished(own.fitter.fitted(begun, Tracker(1.0), view), view)
    plain, misled = Fitter._by_few_steps, list[bool]()

    def downwards(fitter: Fitter, structure: Structure, near: Followed) -> Array:
        left = plain(fitter, structure, near)
        misled.append(near.few is not None)
        return 0.5 * left if near.few else left

    monkeypatch.setattr(Fitter, "_by_few_steps", downwards)
    other = own.fitter.finished(own.fitter.fitted(begun, Tracker(1.0), view), view)
    assert True in misled
    assert other.cost == pytest.approx(found.cost, abs=own.settings.tolerance)
    assert other.cost == pytest.approx(own.fitter.unfitted(other.structure, Tracker(1.0), view).cost, rel=1e-12)


@pytest.mark.parametrize(("low", "leaves"), [(1e-7, True), (1e-3, False)])
def test_a_fit_leaves_the_end_of_a_range_no_farther_than_an_effect_gains(low: float, leaves: bool) -> None:
    """Friction that turns round at once: records contradict the middle of a range, and tell nothing far below it."""
    records, name = (pushed(seed=1, duration=4.0, dry=3.4),), "way.friction.transition_velocity"
    model = Model.from_toml(DRY).with_parameters({name: low})
    own = Search(model, records, (), Settings(), None, ParallelCandidates(1, None), lambda _: None)
    known = {one: prior for one, prior in own.start.priors.items() if one != name}
    fitted = own.fitted(replace(own.start, priors=known), Tracker(1.0)).structure
    priors = {**known, name: Prior(0.1, 1.0, low, 1.0, logarithmic=True)}
    look = own.look(own.fitter.unfitted(replace(fitted, priors=priors), Tracker(1.0)))
    begun, middle = own._off_its_ends(look).fitted.structure, look.fitted.structure.off_its_ends
    costs = [own.fitter.unfitted(one, Tracker(1.0), look.view).cost - look.fitted.cost for one in (begun, middle)]
    assert costs[0] < look.needed < costs[1]
    assert (begun.values[name] > 2.0 * low) is leaves
