"""Accepted effects when the search has ended: plainer names, and the order they stand in."""

from dataclasses import dataclass, field
from typing import cast

import numpy as np
import pytest

import vpm
from shared_cases import shared_case
from vpm.discrepancy.confirmation.confirmation import Judged
from vpm.discrepancy.rivals.ambiguity import Rivals, in_order
from vpm.discrepancy.search.search import Search


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
    return Rivals("effect", "site", (), cast("Judged | None", without))


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
