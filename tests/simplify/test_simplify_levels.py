"""Walking down with flexible links: coarser levels, single deformations, ways to step, against the full model."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import vpm
from flexible_link import one_flexible_link
from vpm.errors import SimulationError
from vpm.simplify import Ladder, Reduction, Rung, reduced, reductions, simplify
from vpm.simplify.search import _simplest

ARM = one_flexible_link(
    "elements(5)",
    young='{ value = 200.0, unit = "GPa", uncertainty = 10.0 }',
    section=(0.004, 0.015),
    damping=1.0,
    gains=(100.0, 4.0),
)
STEP, RATE = 4e-3, 500.0


def record(model: vpm.Model, sizes: tuple[float, float]) -> vpm.Experiment:
    time = STEP * np.arange(300)
    angle = sum(a * (1.0 - np.cos(2.0 * np.pi * f * time)) for a, f in zip(sizes, (0.8, 2.7), strict=True))
    return vpm.Experiment.from_arrays(time, {"motor.reference": angle}, model=model, name="swing")


@pytest.fixture(scope="module")
def full() -> vpm.Model:
    return vpm.Model.from_toml(ARM)


@pytest.fixture(scope="module")
def ladder(full: vpm.Model) -> Ladder:
    return simplify(
        full,
        record(full, (0.3, 0.02)),
        validate=record(full, (0.2, 0.05)),
        rate=RATE,
        tolerance=0.05,
        against="model",
        channels=("root.strain",),
    )


def test_the_cheapest_level_keeps_the_strain_within_the_tolerance_on_an_unseen_motion(
    full: vpm.Model, ladder: Ladder
) -> None:
    chosen = ladder.chosen
    assert chosen.removed
    assert "rigid" not in chosen.removed[0]
    assert chosen.states < ladder.full.states
    assert chosen.loss <= 0.05
    # By hand: the chosen model in its own steps beside the full one in finer steps.
    validation = record(full, (0.2, 0.05))
    steps = round(STEP * RATE) * chosen.substeps
    simple = vpm.simulate(ladder.model, validation, "closed_loop", integrator=chosen.integrator, substeps=steps)
    exact = vpm.simulate(full, validation, "closed_loop", substeps=8 * steps)
    error = np.linalg.norm(simple["root.strain"] - exact["root.strain"]) / np.linalg.norm(exact["root.strain"])
    assert error <= 0.051
    assert error == pytest.approx(chosen.error, abs=0.005)


def test_a_rigid_link_shows_no_strain_and_is_seen_to_lose_all(ladder: Ladder) -> None:
    rigid = [rung for rung in ladder.rungs if rung.removed == ("link as rigid",)]
    assert all(rung.error == pytest.approx(1.0) for rung in rigid)


def test_nothing_beats_the_front(ladder: Ladder) -> None:
    front = ladder.front
    assert [r.seconds for r in front] == sorted(r.seconds for r in front)
    assert [r.error for r in front] == sorted((r.error for r in front), reverse=True)
    for rung in ladder.rungs:
        assert any(best.seconds <= rung.seconds and best.error <= rung.error for best in front)


def test_a_choice_that_is_the_full_model_is_as_fast_as_that(ladder: Ladder) -> None:
    """One time faster is no gain; a choice beside which others took less time says why it was made."""
    full = replace(ladder, chosen=ladder.full, holds=True)
    assert full.verdict.endswith("and is as fast as the full model")
    told = str(full)
    faster = any(one.loss <= ladder.tolerance and one.seconds < ladder.full.seconds for one in ladder.rungs)
    assert ("the most exact of those that a clock cannot tell apart" in told) == faster


def test_the_verdict_names_what_breaks_the_period_and_the_best_compromise(ladder: Ladder) -> None:
    # Whether the steps of the slowest thousandth were in time is a matter of what else the machine did.
    assert "it holds 500 Hz" in replace(ladder, holds=True).verdict
    broken = replace(ladder, holds=False, share=1e-9)
    assert "nothing that was tried does; most of the full model's step goes to link" in broken.verdict
    tight = replace(ladder, holds=False, share=1.0001 * min(r.slowest for r in ladder.rungs) * RATE)
    assert "the best that does loses" in tight.verdict


def test_a_ladder_can_be_drawn_saved_and_loaded(ladder: Ladder, tmp_path: Path) -> None:
    ladder.plot().savefig(tmp_path / "front.png")
    assert (tmp_path / "front.png").stat().st_size > 5000
    assert Ladder.load(ladder.save(tmp_path / "ladder.npz")) == ladder


def test_places_and_their_changes_exclude_each_other() -> None:
    spatial = vpm.Model.from_toml(
        ARM.replace('deforms = ["bending_y"]', 'deforms = ["bending_y", "torsion", "extension"]')
    )
    sites = reductions(spatial)
    assert {site for site, _ in sites} == {
        "level",
        "component torsion",
        "component extension",
        "terms velocity",
        "terms second-order",
    }
    levels = [change.name for change in sites["level", "link"]]
    assert levels[-1] == "rigid"
    assert "elements(8)" not in levels
    changed = reduced(spatial, [Reduction("level", "bezier(3)", "link"), Reduction("component", "torsion", "link")])
    assert changed.to_dict()["beams"]["link"]["level"] == "bezier(3)"
    assert changed.core.n_elastic == 2 + 3


def test_steps_of_the_controller_have_to_fill_the_samples(full: vpm.Model) -> None:
    with pytest.raises(SimulationError, match=r"swing: a sample lasts 0\.004 s, which is 0\.4 steps at 100 Hz"):
        simplify(full, record(full, (0.1, 0.0)), rate=100.0, against="model")
    with pytest.raises(SimulationError, match=r'against is "truth"; choose "data" or "model"'):
        simplify(full, record(full, (0.1, 0.0)), against="truth")
    with pytest.raises(SimulationError, match="restarts starts from the measured motion"):
        simplify(full, record(full, (0.1, 0.0)), rate=RATE, against="model", mode="restarts")


def test_of_what_a_clock_does_not_tell_apart_the_more_exact_is_taken() -> None:
    def rung(removed: tuple[str, ...], error: float, seconds: float, states: int = 12) -> Rung:
        return Rung(removed, "rk4", 1, states, error, "root.strain", error, seconds, seconds)

    quickest = rung(("a", "b"), 0.04, 10.0e-6)
    exact = rung(("a", "c"), 0.01, 10.4e-6)
    fuller = rung(("a",), 0.001, 10.4e-6)
    larger = rung(("a", "d"), 0.001, 10.4e-6, states=14)
    dearer = rung(("a", "e"), 0.001, 11.0e-6)
    simpler = rung(("a", "b", "c"), 0.03, 12.0e-6)
    assert _simplest([quickest, exact, fuller, larger, dearer]) is exact
    assert _simplest([quickest, exact, simpler]) is simpler
