"""Walking an arm with two flexible links down from elements: what is cut, what is chosen, and what Ctrl-C leaves."""

import numpy as np
import pytest

import vpm
from places import EXAMPLES
from vpm.simplify import Ladder, simplify
from vpm.simulate import FIXED_STEP

TUDOR = EXAMPLES / "tudor"
GAUGES = ("gauge_1.strain", "gauge_2.strain")
RATE, TOLERANCE = 1000.0, 0.05


@pytest.fixture(scope="module")
def full() -> vpm.Model:
    fine = vpm.Model.load(TUDOR / "tudor.toml").at("elements(8)").to_dict()
    # Two parameters to fit for each trial instead of five: quick, and enough to be seen.
    del fine["bodies"]["elbow_drive"]["mass"]["uncertainty"]
    for beam in fine["beams"].values():
        del beam["damping"]["stiffness"]["uncertainty"]
    return vpm.Model(fine)


def record(model: vpm.Model, name: str) -> vpm.Experiment:
    whole = vpm.Experiment.load(TUDOR / f"{name}.csv", model=model)
    piece = slice(0, 41)
    values = {channel: whole[channel][piece] for channel in whole.channels}
    return vpm.Experiment.from_arrays(whole.time[piece], values, model=model, name=name)


@pytest.fixture(scope="module")
def told() -> list[str]:
    return []


@pytest.fixture(scope="module")
def ladder(full: vpm.Model, told: list[str]) -> Ladder:
    return simplify(
        full,
        record(full, "slow_fast"),
        validate=record(full, "fast_slow"),
        rate=RATE,
        tolerance=TOLERANCE,
        against="model",
        channels=GAUGES,
        tell=told.append,
    )


def test_the_chosen_model_keeps_both_strains_on_a_motion_that_the_fit_did_not_see(
    full: vpm.Model, ladder: Ladder
) -> None:
    chosen = ladder.chosen
    assert {change.split()[0] for change in chosen.removed} >= {"strip_1", "strip_2"}
    assert chosen.states < ladder.full.states / 2
    assert chosen.seconds < ladder.full.seconds / 4
    validation = record(full, "fast_slow")
    steps = round(validation.dt * RATE) * chosen.substeps
    simple = vpm.simulate(ladder.model, validation, "closed_loop", integrator=chosen.integrator, substeps=steps)
    exact = vpm.simulate(full, validation, "closed_loop", integrator="linearly_implicit", substeps=16)
    for gauge in GAUGES:
        error = np.linalg.norm(simple[gauge] - exact[gauge]) / np.linalg.norm(exact[gauge])
        assert error <= TOLERANCE + 0.002


def test_the_coarsest_come_first_and_what_is_dear_is_not_fitted(ladder: Ladder, told: list[str]) -> None:
    assert told[1].startswith("velocity terms take")
    first = told.index("the full model")
    assert all(" terms take " in line and " % of the " in line for line in told[1:first])
    assert told[first + 1] == "strip_1 as rigid, strip_2 as rigid"
    assert ladder.cut > 0
    stepped = {
        rung.integrator for rung in ladder.rungs if rung.removed == ("strip_1 as bezier(3)", "strip_2 as bezier(3)")
    }
    # Which of them are tried is a matter of measured times, but two that err alike show the error of the model.
    assert 0 < len(stepped) < len(FIXED_STEP)
    assert not any("elements" in change for rung in ladder.rungs for change in rung.removed)


def test_what_cannot_win_is_not_judged(ladder: Ladder) -> None:
    ways: dict[tuple[str, ...], list[float]] = {}
    for rung in ladder.rungs:
        ways.setdefault(rung.removed, []).append(rung.error)
        # Hinges between rigid segments have no terms of second order.
        for strip in ("strip_1", "strip_2"):
            hinged = any(change.startswith((f"{strip} as lumped", f"{strip} as rigid")) for change in rung.removed)
            assert not (hinged and f"{strip} without second-order terms" in rung.removed)
    # Two integrators show the same error: that of the model, which a third one would show again.
    assert len(ways["strip_1 as rigid", "strip_2 as rigid"]) == 2


def test_the_choice_is_timed_as_the_budget_does(ladder: Ladder) -> None:
    assert 10_000 <= ladder.budget.steps <= 100_000
    assert ladder.budget.integrator == ladder.chosen.integrator
    assert ladder.chosen.slowest == ladder.budget.quantiles["p99.9"]
    assert ladder.holds == ladder.budget.holds
    assert "priority" in ladder.budget.machine


def test_ctrl_c_ends_with_the_best_of_what_was_tried(full: vpm.Model) -> None:
    def tell(sentence: str) -> None:
        if "bezier" in sentence:
            raise KeyboardInterrupt

    swing = record(full, "fast_slow")
    stopped = simplify(
        full.at("strain(4)"), swing, rate=RATE, tolerance=0.05, against="model", channels=GAUGES, tell=tell
    )
    assert {rung.removed for rung in stopped.rungs} <= {(), ("strip_1 as rigid", "strip_2 as rigid")}
    assert stopped.chosen.removed == ()
    assert stopped.budget.quantiles["p50"] == stopped.chosen.seconds


def test_ctrl_c_in_a_fit_ends_the_search_and_not_that_fit_alone(
    full: vpm.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    from vpm.identify import OutputErrorProblem

    calls = 0
    evaluate = OutputErrorProblem.evaluate

    def once(self: OutputErrorProblem, *words: object) -> object:
        nonlocal calls
        calls += len(words) > 2  # with columns: a fit
        if calls == 2:
            calls += 1
            raise KeyboardInterrupt
        return evaluate(self, *words)  # type: ignore[arg-type]

    monkeypatch.setattr(OutputErrorProblem, "evaluate", once)
    swing = record(full, "fast_slow")
    stopped = simplify(full.at("strain(4)"), swing, rate=RATE, tolerance=0.05, against="model", channels=GAUGES)
    assert stopped.chosen.removed == ()
