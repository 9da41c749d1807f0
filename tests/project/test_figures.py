"""What the pictures of docs/ show is so: not pixel by pixel, but the numbers they are drawn from."""

import json
import runpy
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from places import ROOT
from vpm.catalogue import EFFECTS
from vpm.catalogue.signature import ANYWHERE

FIGURES = ROOT / "docs" / "figures"


@pytest.fixture(scope="module")
def drawn() -> SimpleNamespace:
    return SimpleNamespace(**runpy.run_path(str(FIGURES / "validity.py")))


def test_the_exact_level_is_the_elastica(drawn: SimpleNamespace) -> None:
    """Rows of load, deflection down, shortening and angle of the tip, from elliptic integrals."""
    cases = json.loads((ROOT / "tests" / "values" / "beams.json").read_text(encoding="utf-8"))
    for load, down, shortening, _ in cases["tip_loaded_cantilever_elastica"]["rows"][:3]:
        place, _ = drawn.resting(drawn.EXACT, line=1e-9, tip=1.0, gravity=load)
        np.testing.assert_allclose(place, (1.0 - shortening, -down), atol=2e-6)


@pytest.mark.parametrize("level", ["deflection(4)", "hermite(2)", "modal(3)"])
@pytest.mark.parametrize("case", ["force at the tip", "own weight"])
def test_loads_at_rest_stay_within_a_percent_up_to_the_limit(drawn: SimpleNamespace, level: str, case: str) -> None:
    limit = drawn.cantilever(drawn.EXACT).core.slope_limit
    solve, loads = drawn.CASES[case]
    slope, error = drawn.validity(level, solve, loads[[3, 6, 9]]).T
    assert slope[0] < limit < slope[1]
    at_limit = np.exp(np.interp(np.log(limit), np.log(slope), np.log(error)))
    # Three modes are off by 0.1 % of their own, to the other side.
    assert at_limit < 0.0105
    assert at_limit > (0.007 if level.startswith("modal") else 0.0095)
    # With the square of the slope, when the level's own error is left behind.
    order = np.diff(np.log(error[1:])) / np.diff(np.log(slope[1:]))
    np.testing.assert_allclose(order, 2.0, atol=0.15)


def test_a_quick_turn_reaches_a_percent_at_a_slope_of_a_tenth(drawn: SimpleNamespace) -> None:
    (slope, error), *_ = drawn.validity("deflection(4)", drawn.spun, np.array([4.5]))
    assert slope == pytest.approx(0.10, abs=0.005)
    assert error == pytest.approx(0.0105, abs=0.002)


def test_a_coordinate_buys_what_the_picture_shows(drawn: SimpleNamespace) -> None:
    found = {kind: drawn.frequencies(kind) for kind in drawn.COUNTS}
    # Small deflections: polynomials of the strain and of the deflection are the same space.
    np.testing.assert_allclose(found["strain"], found["bezier"], rtol=1e-3, atol=1e-8)
    for rows in found.values():
        assert np.all(np.diff(rows[:, 1]) < 1e-7)
    assert found["bezier"][3, 2] < 1e-4 < found["lumped"][-1, 2]


@pytest.mark.parametrize("name", ["validity.svg", "levels.svg"])
def test_the_pictures_are_there(name: str) -> None:
    assert "<svg" in (FIGURES / name).read_text(encoding="utf-8")
    assert f"figures/{name}" in (ROOT / "docs" / "beams.md").read_text(encoding="utf-8")


def test_the_picture_of_oil_and_valve_is_there() -> None:
    assert "<svg" in (FIGURES / "oil.svg").read_text(encoding="utf-8")
    assert "figures/oil.svg" in (ROOT / "docs" / "oil_and_valve.md").read_text(encoding="utf-8")


def test_lines_of_oil_and_valve_are_what_the_page_says() -> None:
    oil = SimpleNamespace(**runpy.run_path(str(FIGURES / "oil.py"), run_name="figure"))
    # Straight in the lateness, through one where the clocks agree.
    late = oil.of_clock(oil.BENCH.BARE)
    assert late[3] == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(late, np.polyval(np.polyfit(oil.LATE, late, 1), oil.LATE), atol=0.1)
    assert np.all(np.diff(oil.of_air(("leakage",))) > 0.0)
    np.testing.assert_allclose(oil.of_air(("leakage", "air")), 1.0, atol=0.01)
    np.testing.assert_allclose(oil.of_ripple(oil.BENCH.BARE, known=True), 1.0, atol=0.01)


@pytest.fixture(scope="module")
def effects() -> SimpleNamespace:
    return SimpleNamespace(**runpy.run_path(str(FIGURES / "effects.py"), run_name="figure"))


def test_the_page_of_the_catalogue_is_what_the_catalogue_says(effects: SimpleNamespace) -> None:
    """Written by ``make figures``: a new entry, or another word in one, has to be written again."""
    assert (ROOT / "docs" / "catalogue.md").read_text(encoding="utf-8") == effects.page()


@pytest.mark.parametrize("name", EFFECTS)
def test_every_entry_of_the_catalogue_has_its_section_and_picture(effects: SimpleNamespace, name: str) -> None:
    assert EFFECTS[name].signature is not ANYWHERE
    page = (ROOT / "docs" / "catalogue.md").read_text(encoding="utf-8")
    section = page.split(f"\n## {name}\n", 1)[1].split("\n## ", 1)[0]
    assert EFFECTS[name].law in section
    for parameter in EFFECTS[name].parameters:
        assert f"`{parameter.name}`" in section
    for other in EFFECTS[name].confused_with:
        assert f"(#{other})" in section
    assert name in effects.SHOWN
    assert f"figures/effects/{name}.svg" in section
    assert "<svg" in (FIGURES / "effects" / f"{name}.svg").read_text(encoding="utf-8")


#: Laws that stand in one state, written once more, and where that is.
LAWS: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
    "viscous_friction": lambda v: 0.3 * v,
    "coulomb_friction": lambda v: 0.5 * np.tanh(v / 0.02),
    "spring": lambda q: 1.5 * (q - 0.3),
    "torque_ripple": lambda q: 0.3 * np.cos(2 * np.pi * q / 0.39) + 0.25 * np.sin(2 * np.pi * q / 0.39),
    "bias_force": lambda t: 0.4 + 0.0 * t,
    "sensor_offset": lambda q: 1.8 * 9.81 * 0.22 * (np.sin(q - 0.06) - np.sin(q)),
}


@pytest.mark.parametrize("name", LAWS)
def test_signatures_are_the_laws_over_the_state_that_they_live_in(effects: SimpleNamespace, name: str) -> None:
    """Effort applied less effort required lacks what the effect takes; the motion is filtered at 40 Hz."""
    seen, added = effects.view(name)
    axis, _, _, values = seen.best(added, np.ones(added.size, dtype=bool))
    assert axis == EFFECTS[name].signature.lives_in[0]
    np.testing.assert_allclose(added, LAWS[name](values), atol=2e-3 * np.abs(added).max())
