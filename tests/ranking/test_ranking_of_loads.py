"""Loads that a ranking names where a body is far from what its model file states, and others where it is not."""

import pytest

from model_texts import effect_text, on_rail
from sledge import MASS, OIL, pushed
from vpm import EFFECTS, Model, rank
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.experiment import Experiment
from vpm.ranking.fit import Fitted
from vpm.ranking.model_structure import Structure
from vpm.ranking.ranking_search import Search
from vpm.ranking.result import Ranking
from vpm.ranking.settings import Settings
from vpm.ranking.tracked_records import Tracker

#: Stated uncertainty of the sledge's mass, kg.
UNCERTAIN = 0.05


@pytest.fixture(scope="module")
def logs() -> list[Experiment]:
    return [pushed(seed=seed, duration=5.0) for seed in (1, 2)]


def described(stated: float) -> Model:
    """Sledge that, by its file, has that mass (kg)."""
    mass = f"{{ value = {stated}, uncertainty = {UNCERTAIN} }}"
    text = on_rail("sledge", mass, joint="way", drive="motor", gain="4.0")
    oil = effect_text("viscous_friction", "way", viscous="{ value = 7.0, uncertainty = 1.5 }")
    return Model.from_toml(text + oil)


def ranked(stated: float, logs: list[Experiment]) -> Ranking:
    return rank(described(stated), logs[:1], logs[1:], workers=1)


def test_a_mass_that_a_body_took_along_is_named(logs: list[Experiment]) -> None:
    """A mass of 3 kg where 2 are stated: fitted, it leaves no error, at a value 20 uncertainties off."""
    found = ranked(2.0, logs)
    (load,) = found.effects
    assert load.key == ("payload", "sledge")
    mass = found.model.parameters["sledge.payload.mass"].value
    assert mass + found.model.parameters["sledge.mass"].value == pytest.approx(MASS, rel=5e-3)
    assert found.model.parameters["sledge.mass"].value == pytest.approx(2.0, abs=UNCERTAIN)
    assert found.recalibrated.parameters["sledge.mass"].value == 2.0
    assert found.gaps["way.position"].after < 0.1 * found.gaps["way.position"].recalibrated


@pytest.mark.parametrize("stated", [2.9, 3.6])
def test_a_file_that_is_a_little_off_or_too_heavy_takes_no_load(stated: float, logs: list[Experiment]) -> None:
    found = ranked(stated, logs)
    assert found.effects == ()
    assert found.model.parameters["sledge.mass"].value == pytest.approx(MASS, rel=5e-3)


def test_no_load_is_asked_for_where_a_fit_by_another_tracker_stays_by_the_file(logs: list[Experiment]) -> None:
    """A fit that stopped far from the file is no sign of a load: one of two may have come back."""
    search = Search(described(2.0), logs[:1], tuple(EFFECTS), Settings(), None, ParallelCandidates(1), lambda _: None)
    far = search.looks(search.start)
    assert not search._are_by_the_file(far)
    load = search._load(far)
    assert load is not None
    assert load.key == ("payload", "sledge")
    near = search.look(search.fitter.unfitted(search.start, far[0].fitted.tracker))
    assert search._are_by_the_file([*far, near])


@pytest.mark.parametrize("off", [-1.0, 0.0, 1.0])
def test_values_off_by_their_uncertainty_are_in_no_doubt(off: float, logs: list[Experiment]) -> None:
    """Half a nat each is what chance makes of what the records determine, of arms with many bodies far more."""
    model = described(MASS + off * UNCERTAIN)
    search = Search(model, logs[:1], tuple(EFFECTS), Settings(), None, ParallelCandidates(1), lambda _: None)
    (look, *_) = search.looks(search.start)
    raw = look.fitted.structure.doubt
    assert raw == pytest.approx(0.5 * off**2 + 0.5 * ((OIL - 7.0) / 1.5) ** 2, abs=0.1)
    assert look.doubt == pytest.approx(raw - 1.0, abs=0.05)  # mass and drag are determined


def test_a_load_that_explains_no_more_is_fitted_once_under_each_tracker(
    logs: list[Experiment], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only one that does may have stopped where the fit without it would go on."""
    search = Search(described(2.0), logs[:1], tuple(EFFECTS), Settings(), None, ParallelCandidates(1), lambda _: None)
    far, fits, own = search.looks(search.start), list[Fitted](), search.fitted

    def counted(structure: Structure, tracker: Tracker) -> Fitted:
        fits.append(own(structure, tracker))
        return fits[-1]

    monkeypatch.setattr(search, "fitted", counted)
    monkeypatch.setattr(search, "own_evidence", lambda _: 0.0)
    assert search._load(far) is None
    assert [fit.tracker for fit in fits] == [look.fitted.tracker for look in far]
    assert all(fit.structure.effects[-1] == ("payload", "sledge") for fit in fits)
