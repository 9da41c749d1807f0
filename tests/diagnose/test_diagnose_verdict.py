"""What counts as left: a channel that is above its noise and more than nothing beside its signal."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vpm.catalogue import EFFECTS
from vpm.discrepancy.diagnosis import ChannelGap
from vpm.discrepancy.findings import Findings
from vpm.discrepancy.verdict import _nothing_missing, _unheard, only_if_open, open_readings, verdict, without_effects

SIGNAL, NOISE = 1.0, 1e-3


def told(elbow: float) -> str:
    """Verdict on a structured residual with a strain of 2 ‰ at twice its noise, and so much at the elbow."""
    noise = np.random.default_rng(1).normal(0.0, 1.0, 400)
    data: Any = SimpleNamespace(validation=SimpleNamespace(blocks=(SimpleNamespace(samples=slice(0, 400)),)))
    nominal: Any = SimpleNamespace(validation=3.0 * noise, model=SimpleNamespace(deflections=()))
    recalibrated: Any = SimpleNamespace(validation=noise, free=(), fit=SimpleNamespace(std=(), unseen=()))
    found: Any = SimpleNamespace(accepted=(), ranked=None, left={}, within_laws=False, interrupted=False)
    left: Any = SimpleNamespace(present=True)
    gap = {
        "strain": ChannelGap(3e-3, 2e-3, 2e-3, NOISE, "1", SIGNAL, "inverse_dynamics"),
        "elbow": ChannelGap(2e-2, elbow, elbow, 7.0 * NOISE, "N m", SIGNAL, "inverse_dynamics"),
    }
    return verdict(data, nominal, recalibrated, found, gap, left, None)[0]


def named(label: str, left: Mapping[str, float], behind: str = "", added: tuple[Any, ...] = ()) -> Any:
    """Findings of one effect, ``name at joint``, with the share of each place that is left, and what is behind it."""
    name, joint = label.split(" at ")
    effect: Any = SimpleNamespace(key=(name, joint), label=label)
    model: Any = SimpleNamespace(
        effects=added, bodies=(), joints=(joint,), parameters={}, joint_behind={joint: behind or None}.get
    )
    final: Any = SimpleNamespace(model=model, free=(), fit=SimpleNamespace(std=(), unseen=()))
    return SimpleNamespace(
        accepted=(effect,), left=left, within_laws=False, interrupted=False, final=final, ranked=None
    )


def judged(found: Any, gap: dict[str, ChannelGap], *, structured: bool = True) -> tuple[str, str]:
    """Verdict on findings of one effect, and its sentence."""
    data: Any = SimpleNamespace(training=SimpleNamespace(joints=found.final.model.joints))
    left: Any = SimpleNamespace(present=structured)
    return verdict(data, found.final, found.final, found, gap, left, None)[:2]


@pytest.mark.parametrize(("elbow", "word"), [(8e-3, "parameters_only"), (1.4e-2, "unexplained")])
def test_a_trifle_above_its_noise_says_nothing_of_another_channel(elbow: float, word: str) -> None:
    assert told(elbow) == word


@pytest.mark.parametrize(("floor", "said"), [(0.6, True), (0.1, False)])
def test_what_noise_hides_is_no_evidence_that_nothing_is_missing(floor: float, said: bool) -> None:
    """Oil integrates the noise of a coarse encoder: a pressure of which 57 % is left may say nothing of the machine."""
    model: Any = SimpleNamespace(deflections=("arm_bending.position",))
    gap = {
        "servo.pressure_a": ChannelGap(0.6, 0.57, 0.57, floor, "Pa", SIGNAL, "inverse_dynamics"),
        "arm_bending.position": ChannelGap(1.0, 1.0, 1.0, 1.0, "rad", SIGNAL, "inverse_dynamics"),
    }
    assert ("Nothing is said of servo.pressure_a: noise" in _unheard(gap, model)) is said
    assert ("More is left of servo.pressure_a than noise" in _unheard(gap, model)) is not said


@pytest.mark.parametrize(("after", "word"), [(0.1, "effect_found"), (0.9, "unexplained")])
def test_without_efforts_an_effect_that_leaves_the_error_explains_nothing(after: float, word: str) -> None:
    """An observer alone tells what is left: a share of 0.81 of the error power is no explanation."""
    found = named("lugre_friction at shaft", {"shaft": after**2})
    gap = {"shaft.velocity": ChannelGap(1.0, 1.0, after, NOISE, "rad/s", SIGNAL, "observed")}
    assert verdict(None, found.final, found.final, found, gap, None, None)[0] == word


@pytest.mark.parametrize(("after", "word"), [(2.1e-4, "effect_found"), (1.403e-3, "unexplained")])
def test_an_effect_that_leaves_the_deflection_behind_its_joint_explains_nothing(after: float, word: str) -> None:
    """A series-elastic knee with a spring a fifth too stiff in its file: a force at the motor hides it from the motor.

    Errors are those of its record; the noise of the link's encoder is 2e-4 rad.
    """
    shares = {"knee": 0.04, "knee_deflection": (after / 1.449e-3) ** 2}
    found = named("cubic_spring at knee", shares, "knee_deflection")
    gap = {
        "knee.effort": ChannelGap(0.772, 0.4033, 0.2701, 0.09834, "N m", 7.27, "inverse_dynamics"),
        "knee_deflection.position (observed)": ChannelGap(2e-3, 1.449e-3, after, 1.969e-4, "rad", 9.24e-3, "observed"),
    }
    told, sentence = judged(found, gap)
    assert told == word
    # The sentence tells what is left there, not the little that is left elsewhere.
    assert ("leave 94 % of what was left of knee_deflection.position" in sentence) == (word == "unexplained")


@pytest.mark.parametrize(("after", "word"), [(5.14e-5, "unexplained"), (9e-6, "effect_found")])
def test_an_effect_that_a_fine_reading_alone_tells_has_to_explain_that(after: float, word: str) -> None:
    """A pulley is eccentric by a thousandth of the way: a laser of 5 micrometres sees it, and no drive does."""
    found = named("torque_ripple at x", {"x": 0.96, "spot": (after / 7.83e-5) ** 2})
    gap = {
        "x.effort": ChannelGap(0.3129, 0.1211, 0.1203, 0.1094, "N", 2.96, "inverse_dynamics"),
        "spot.x (observed)": ChannelGap(1.12e-4, 7.83e-5, after, 6.9e-6, "m", 6.96e-2, "observed"),
    }
    told, sentence = judged(found, gap, structured=False)
    assert told == word
    assert ("leave 43 % of what was left of spot.x" in sentence) == (word == "unexplained")


@pytest.mark.parametrize(
    ("effect", "left", "word"),
    [
        ("backlash", 0.38, "effect_found"),
        ("backlash", 0.62, "unexplained"),
        ("cubic_spring", 0.38, "unexplained"),
    ],
)
def test_a_play_that_does_most_of_the_work_is_the_explanation(effect: str, left: float, word: str) -> None:
    """Its impacts are no more where they were in the log, and the residual with it is as large as without."""
    added = SimpleNamespace(type=EFFECTS[effect], at="shoulder")
    found = named(f"{effect} at shoulder", {"shoulder": left}, "shoulder_deflection", (added,))
    gap = {
        "shoulder.effort": ChannelGap(0.0364, 0.0351, 0.0365, 0.0132, "N m", 1.0, "inverse_dynamics"),
        "shoulder.position (observed)": ChannelGap(7.4e-5, 6.6e-5, 6.6e-5 * left**0.5, 9e-6, "rad", 0.68, "observed"),
    }
    assert judged(found, gap)[0] == word


def test_an_error_that_grew_is_not_told_as_a_gap_that_closed() -> None:
    """Of two channels the one farthest above its noise became worse: the other one is told, and that this one grew."""
    noise = np.random.default_rng(0).standard_normal(2000)
    data: Any = SimpleNamespace(validation=SimpleNamespace(blocks=(SimpleNamespace(samples=slice(0, 2000)),)))
    nominal: Any = SimpleNamespace(validation=5.0 * noise, model=None)
    recalibrated: Any = SimpleNamespace(validation=noise, free=(), fit=SimpleNamespace(std=(), unseen=()))
    closed = ChannelGap(0.5, 0.1, 0.1, 0.01, "N", 1.0, "inverse_dynamics")
    grew = ChannelGap(0.19, 0.2, 0.2, 0.01, "N", 1.0, "inverse_dynamics")
    word, summary = _nothing_missing(data, nominal, recalibrated, ([closed, grew], []), grew, "")
    assert word == "parameters_only"
    assert summary.endswith(
        "50.00 % before, 10.00 % recalibrated; in another channel it grew, 19.00 % before, 20.00 % recalibrated."
    )
    _, plain = _nothing_missing(data, nominal, recalibrated, ([closed, grew], []), closed, "")
    assert plain.endswith("Error on validation data: 50.00 % before, 10.00 % recalibrated.")
    noisy = ChannelGap(0.53, 0.52, 0.52, 0.47, "Pa", 1.0, "inverse_dynamics")
    _, heard = _nothing_missing(data, nominal, recalibrated, ([closed, noisy], []), noisy, "")
    assert heard.endswith("Error on validation data: 50.00 % before, 10.00 % recalibrated.")


@pytest.mark.parametrize(
    ("before", "left", "kept"), [(5.7e-4, 1.11, False), (5.7e-4, 0.01, True), (5.7e-2, 1.11, True)]
)
def test_an_effect_that_explains_nothing_is_withdrawn_where_nothing_was_open(
    before: float, left: float, kept: bool
) -> None:
    """A linkage without a missing effect, of which an observer leaves less than noise: no effect is worth a name."""
    entry: Any = SimpleNamespace(key=("rotor_inertia", "crank"))
    judged: Any = SimpleNamespace()
    found = Findings((), (entry,), (), (), left={"crank": left})
    gap = {"crank.position": ChannelGap(8e-4, before, before * left**0.5, 6.6e-4, "rad", 5.2, "observed")}
    told = only_if_open(found, judged, gap)
    assert (told is found) is kept
    if not kept:
        assert [one.name for one in told.refused] == ["rotor_inertia"]
        assert told.final is judged
        assert without_effects(gap)["crank.position"].after == before


def test_a_reading_that_effects_elsewhere_leave_open_is_told() -> None:
    """A gauge that reads 12 % too little, beside friction of the lift that is found: 31 % of its signal is left."""
    gap = {
        "lift.effort": ChannelGap(0.06, 0.034, 0.02, NOISE, "N", SIGNAL, "inverse_dynamics"),
        "root.strain": ChannelGap(0.22, 0.08, 0.31, NOISE, "1", SIGNAL, "inverse_dynamics"),
        "tip.ax (observed)": ChannelGap(0.2, 0.2, 0.01, NOISE, "m/s^2", SIGNAL, "observed"),
        "root.strain (observed)": ChannelGap(0.21, 0.08, 0.3, NOISE, "1", SIGNAL, "observed"),
        "root.strain (restarts)": ChannelGap(0.2, 0.2, 0.3, NOISE, "1", SIGNAL, "restarts"),
    }
    assert open_readings(gap) == ("root.strain",)
