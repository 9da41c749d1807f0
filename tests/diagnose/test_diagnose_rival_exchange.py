"""Accepted effects when the search has ended: what takes the place of a plainer name, and the order they stand in."""

from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import cast

import numpy as np
import pytest

import vpm
from inverse_dynamics import inverse_dynamics_data
from shared_cases import shared_case
from vpm.discrepancy.confirmation.confirmation import Judged, judge
from vpm.discrepancy.diagnosis import RefusedEffect
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.discrepancy.rivals.ambiguity import Rivals
from vpm.discrepancy.rivals.rival_exchange import earned, in_order
from vpm.discrepancy.screening.candidates import candidates
from vpm.discrepancy.screening.probe import Baseline, probe
from vpm.discrepancy.search.search import Search, Stage, begin, further
from vpm.discrepancy.search.search_round import Request
from vpm.identify import Gain, InverseDynamicsProblem, estimate


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [2, 7, 106])
def test_a_spring_is_named_and_not_the_constant_force_that_is_the_plainer_name(seed: int) -> None:
    """A spring that rests elsewhere holds a constant force, and in gravity looks like a shifted centre of mass."""
    case = shared_case("axis_rotary", "spring", seed)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=["bias_force", "spring"], workers=1)
    assert [(effect.name, effect.site) for effect in why.effects] == [("spring", "axis")]


@pytest.mark.nightly
def test_a_constant_force_keeps_its_name_where_finer_laws_know_nothing_more() -> None:
    case = shared_case("axis_rotary", "bias_force", 2)
    tried = ["bias_force", "spring", "asymmetric_friction"]
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=tried, workers=1)
    assert [effect.name for effect in why.effects] == ["bias_force"]


@pytest.mark.nightly
def test_a_spring_that_looked_like_a_shifted_centre_of_mass_is_found_beside_the_constant_force() -> None:
    case = shared_case("axis_rotary", "spring", 106)
    (hidden,) = case.truth.hidden
    why = vpm.diagnose(
        case.model(), case.train, case.validate, effects=["bias_force", "spring"], names="search", workers=1
    )
    assert [(s.change, s.effect) for s in why.steps][1:] == [
        ("added", "bias_force"),
        ("removed", "bias_force"),
        ("added", "spring"),
    ]
    for parameter in why.effects[0].parameters:
        assert parameter.value == pytest.approx(hidden.parameters[parameter.name], abs=3.0 * parameter.std)


@pytest.mark.nightly
def test_a_spring_is_screened_with_the_place_where_it_rests() -> None:
    case = shared_case("axis_rotary", "spring", 100)
    (hidden,) = case.truth.hidden
    data = InverseDynamicsProblem(case.model(), case.train)
    free = tuple(p.name for p in data.nominal.parameters.values() if p.adjustable)
    fit = estimate(data.nominal, data, free)
    model = data.nominal.with_parameters(dict(zip(free, map(float, fit.values), strict=True)))
    (candidate,) = (c for c in candidates(model, data, fit.residual, ["spring"]) if c.site == "axis")
    found = probe(Baseline(model, free, fit.residual, fit.jacobian), data, candidate)
    assert found.drop > 0.99
    for short, value in hidden.parameters.items():
        assert found.values[f"axis.spring.{short}"] == pytest.approx(value, rel=0.05)


@pytest.mark.parametrize(
    ("left", "more", "paid"), [(0.999, 0, True), (0.999, 1, False), (0.99, 1, True), (0.99, 3, False), (1.01, 0, False)]
)
def test_a_rival_earns_its_additional_numbers_where_they_were_fitted(left: float, more: int, paid: bool) -> None:
    """Of 1000 independent pieces a number has to take 0.7 % of the mean square."""
    assert earned(Gain(1.0, float(np.sqrt(left)), 1.0, 3.0, 1000), more) == paid


@pytest.mark.nightly
def test_a_search_goes_on_beside_what_took_the_place_of_an_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside the true name a second effect stands clear; the name that went out does not come back."""
    naming = import_module("vpm.naming")
    model, free, data = inverse_dynamics_data(shared_case("axis_linear", ("spring", "viscous_friction"), 3))
    start, asked = judge(model, free, data, {}), Request(["spring"], 6, print, ParallelCandidates(1))
    spring = further(begin(start), data, asked)
    gone = (Stage("added", "bias_force", "axis", start), Stage("removed", "bias_force", "axis", start))
    exchanged = replace(
        spring,
        stages=(spring.stages[0], *gone, *spring.stages[1:]),
        refused=(RefusedEffect("bias_force", "axis", "exchanged"),),
    )
    plain = replace(exchanged, accepted=spring.accepted)
    monkeypatch.setattr(
        naming,
        "replaced",
        lambda found, known, _: (exchanged if found is plain else found, known),
    )
    found, known = naming._settled(plain, data, replace(asked, effects=["bias_force", "spring", "viscous_friction"]))
    assert {entry.key for entry in found.accepted} == {("spring", "axis"), ("viscous_friction", "axis")}
    assert {(one.effect, one.site) for one in known} == {entry.key for entry in found.accepted}
    assert ("bias_force", "axis") not in {(c.name, c.site) for c in found.ranking}
    assert [one.reason for one in found.refused if one.name == "bias_force"] == ["exchanged"]


@dataclass
class _Alias:
    partner: str


@dataclass
class _Trial:
    parameters: tuple[str, ...]
    held: tuple[_Alias, ...] = ()


@dataclass
class _Entry:
    trial: _Trial


@dataclass
class _Judged:
    validation: np.ndarray = field(default_factory=lambda: np.ones(4))


@dataclass(frozen=True)
class _Found:
    accepted: tuple[_Entry, ...]
    final: _Judged


def _known(power: float | None) -> Rivals:
    without = None if power is None else _Judged(np.full(4, power))
    return Rivals("effect", "site", (), (), cast("Judged | None", without))


def _ordered(entries: dict[str, tuple[_Entry, float | None]]) -> list[str]:
    """Names in the order they stand in, of effects with what is left of the validation data without each."""
    accepted = tuple(entry for entry, _ in entries.values())
    found = cast("Search", _Found(accepted, _Judged()))
    changed, known = in_order(found, [_known(power) for _, power in entries.values()])
    assert len(known) == len(accepted)
    names = {id(entry): name for name, (entry, _) in entries.items()}
    return [names[id(one)] for one in changed.accepted]


def test_the_effect_without_which_most_is_left_comes_first() -> None:
    first, second, third = (_Entry(_Trial((name,))) for name in "abc")
    assert _ordered({"a": (first, 2.0), "b": (second, 5.0), "c": (third, None)}) == ["c", "b", "a"]


def test_an_effect_stands_after_the_one_that_a_number_of_it_was_held_for() -> None:
    plain, finer = _Entry(_Trial(("axis.bias.force",))), _Entry(_Trial(("x",), (_Alias("axis.bias.force"),)))
    other = _Entry(_Trial(("y",)))
    assert _ordered({"plain": (plain, 1.1), "finer": (finer, 9.0), "other": (other, 2.0)}) == [
        "other",
        "plain",
        "finer",
    ]
