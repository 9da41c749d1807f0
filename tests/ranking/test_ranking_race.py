"""Race of fits: which proposals are given up, by what the best one saved and by what it had predicted."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any, cast

import pytest

from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.ranking.fit import Fitted, Fitter
from vpm.ranking.look import Look
from vpm.ranking.model_structure import Structure
from vpm.ranking.proposal_fits import raced
from vpm.ranking.proposals import Proposal
from vpm.ranking.settings import Settings

BEFORE = 5000.0


class Fits:
    """Fits that save what is told of each effect, and the gains that each of them had to promise."""

    def __init__(self, saved: Mapping[str, float]) -> None:
        self.saved, self.settings = saved, Settings()
        self.wanted: dict[str, float] = {}

    def fitted(self, structure: Any, tracker: Any, _view: Any, goal: float, residual: Any, **_: Any) -> Fitted:
        name = structure.effects[-1][0]
        self.wanted[name] = BEFORE - goal
        return Fitted(structure, tracker, residual, BEFORE - self.saved[name])


def one_by_one(_doing: str, fit: Any, several: Sequence[Proposal], _label: Any) -> list[Fitted]:
    """Fits of some proposals."""
    return [fit(one) for one in several]


def wanted_in_race(*proposals: tuple[str, float, float, bool]) -> dict[str, float]:
    """Gains that fits had to promise, of effects that were fitted; each is a name, a prediction, and what it saves."""
    chosen = [
        Proposal(cast("Structure", SimpleNamespace(effects=[(name, "axis")])), gain, neutral)
        for name, gain, _, neutral in proposals
    ]
    fits = Fits({name: saved for name, _, saved, _ in proposals})
    fitted = SimpleNamespace(cost=BEFORE, structure=SimpleNamespace(model=None), tracker=None, residual=None)
    look = SimpleNamespace(fitted=fitted, needed=100.0, noise=None, view=None)
    raced(chosen, cast("Look", look), cast("Fitter", fits), cast("ParallelCandidates", one_by_one))
    return fits.wanted


def test_what_cannot_save_half_of_the_best_one_is_given_up() -> None:
    wanted = wanted_in_race(("end_stop", 3000.0, 2900.0, False), ("saturation", 400.0, 0.0, False))
    assert wanted == {"end_stop": 100.0}


def test_a_contact_counts_by_the_prediction_of_one_that_saved_more_than_it_predicted() -> None:
    # Torque is limited where the arm meets its stop, so either explains most. Neither touches where its fit begins.
    wanted = wanted_in_race(("saturation", 540.0, 7284.0, False), ("end_stop", 512.0, 8500.0, False))
    assert wanted == {"saturation": 100.0, "end_stop": pytest.approx(270.0)}


def test_predictions_of_what_does_nothing_at_its_start_are_believed() -> None:
    wanted = wanted_in_race(("saturation", 540.0, 7284.0, False), ("torque_ripple", 500.0, 400.0, True))
    assert wanted["torque_ripple"] == pytest.approx(3642.0)
