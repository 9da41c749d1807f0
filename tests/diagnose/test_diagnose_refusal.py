"""What a refitted candidate is refused for."""

import re
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import vpm
from vpm.catalogue import EFFECTS
from vpm.demo import MODEL
from vpm.discrepancy.confirmation.confirmation import Trial
from vpm.discrepancy.confirmation.refusal import (
    Thresholds,
    refuse_probe,
    refuse_timing,
    refuse_trial,
    worse_in_simulation,
)
from vpm.discrepancy.screening.candidates import Candidate
from vpm.discrepancy.screening.probe import Probe
from vpm.discrepancy.settings import NEGLIGIBLE
from vpm.identify import Gain
from vpm.model import Model


def gained() -> Gain:
    """A gain on validation data that nobody would doubt."""
    return Gain(before=1.0, after=0.1, weight=1.0, score=50.0, pieces=40)


def trial(value: float) -> Trial:
    """A refitted gain of the demonstration arm's encoder that explains much in every view."""
    model = Model.load(MODEL).with_effect("sensor_gain", at="encoder", value=value)
    candidate = Candidate(EFFECTS["sensor_gain"], "encoder", ({},))
    judged = SimpleNamespace(model=model, bounds={})
    return cast(
        "Trial",
        SimpleNamespace(
            probe=SimpleNamespace(candidate=candidate),
            judged=judged,
            parameters=("encoder.gain.value",),
            validation=gained(),
            there=gained(),
            training=gained(),
            simulated=None,
            diverged="",
            clear=True,
            error=NEGLIGIBLE,
            size=NEGLIGIBLE,
        ),
    )


@pytest.mark.parametrize(
    ("way", "std", "dry", "accepted"),
    [
        (1.9e-4, 6e-5, False, False),
        (1.9e-4, 5e-5, False, True),
        (2.1e-4, 6e-5, False, True),
        (1.9e-4, 6e-5, True, True),
        (1e-4, 6e-5, True, False),
    ],
)
def test_a_hysteresis_within_two_samples_is_dry_friction_unless_that_is_fitted_beside_it(
    way: float, std: float, dry: bool, accepted: bool
) -> None:
    model = Model.load(MODEL).with_effect("hysteresis", at="shoulder", force=0.1, displacement=way)
    name = "shoulder.hysteresis.displacement"
    one = trial(1.1)
    held = {
        "probe": SimpleNamespace(candidate=Candidate(EFFECTS["hysteresis"], "shoulder", ({},))),
        "judged": SimpleNamespace(
            model=model,
            bounds={name: (1e-4, 1.0)},
            fit=SimpleNamespace(names=[name], std=[std]),
            free=("shoulder.friction.coulomb", name) if dry else (name,),
        ),
        "parameters": ("shoulder.hysteresis.force", name),
    }
    reason = refuse_trial(cast("Trial", SimpleNamespace(**{**vars(one), **held})), Thresholds(30, 1e-3))
    assert (reason == "") == accepted
    assert accepted or "between two samples" in reason


@pytest.mark.parametrize(("drop", "words"), [(-63.0, "larger"), (1e-3, "only 0.10 %")])
def test_what_screening_promises_nothing_of_is_told_in_words_that_fit(drop: float, words: str) -> None:
    promised = cast("Probe", SimpleNamespace(free=("axis.backlash.gap",), held=(), drop=drop, here=0.0))
    assert words in refuse_probe(promised)


@pytest.mark.parametrize(
    ("relative", "score", "beside", "accepted"),
    [
        (0.5, 9.0, 0.3, True),
        (0.15, 3.3, 0.3, False),
        (0.15, 3.3, 0.0, True),
        (0.15, 2.2, 0.0, False),
        (0.01, 3.3, 0.0, False),
    ],
)
def test_what_leaves_no_shift_of_the_commands_is_told_from_it_by_one_sure_question(
    relative: float, score: float, beside: float, accepted: bool
) -> None:
    parts = Gain(before=1.0, after=(1.0 - relative) ** 0.5, weight=1.0, score=score, pieces=100)
    reason = refuse_timing(parts, 0.3, Thresholds(60, 4e-3), beside=beside)
    assert (reason == "") == accepted
    assert accepted or "beside a shift of the commands by 1.2 ms" in reason


def changed(before: float, after: float) -> Gain:
    return Gain(before=before, after=after, weight=0.0, score=0.0, pieces=40)


sizes = st.floats(1e-9, 1e9)


@given(sizes, sizes, sizes, sizes)
def test_what_is_said_of_two_numbers_goes_in_their_direction(a: float, b: float, c: float, d: float) -> None:
    """A candidate that raises the validation error: it lowers the training error only where that becomes smaller."""
    c, d = min(c, d), max(c, d)
    assume(1.0 - (d / c) ** 2 < 0.0)
    worse = trial(1.5)
    vars(worse).update(training=changed(a, b), validation=changed(c, d), there=changed(c, d))
    reason = refuse_trial(worse, Thresholds(30, 1e-3))
    said = re.findall(
        r"(lowers|raises) the (training|validation) error by [\d.e+]+ % of its mean square \((\S+) to (\S+)\)", reason
    )
    assert [where for _, where, _, _ in said] == ["training", "validation"]
    for word, _, before, after in said:
        assert word == "raises" or float(after) <= float(before)
        assert word == "lowers" or float(after) >= float(before)


def test_a_little_of_the_validation_error_is_told_with_its_direction() -> None:
    for after, words in (
        (0.98, "lowers the validation error by only 3.96 %"),
        (1.02, "raises the validation error by 4.04 %"),
    ):
        little = trial(1.5)
        vars(little).update(there=changed(1.0, after))
        assert words in refuse_trial(little, Thresholds(30, 1e-3))


def test_a_simulation_that_becomes_worse_is_told_beside_what_the_balance_says() -> None:
    for after, word, joined in ((0.9, "lowers", "but"), (1.1, "raises", "and")):
        parts = trial(1.5)
        vars(parts).update(
            validation=changed(1.0, after), simulated=SimpleNamespace(relative=-3.0, harm=9.0, before=1.0, after=2.0)
        )
        vars(parts.judged).update(model=Model.load(MODEL))
        said = worse_in_simulation(parts)
        assert said.startswith(f"it {word} the validation error of the inverse-dynamics residual")
        assert f", {joined} raises that of the simulation by 300.00 % of its mean square (1 to 2)" in said


def test_a_payload_like_a_free_mass_is_called_that() -> None:
    """In slow motion a weight anywhere on the only link is a heavier link; at its axis alone it would do nothing."""
    arm = vpm.Model.from_toml("""
        name = "slow arm"
        gravity = [0.0, 0.0, -9.81]
        [bodies.arm]
        mass = { value = 4.0, unit = "kg", uncertainty = 0.4 }
        center_of_mass = [0.5, 0.0, 0.0]
        inertia = [0.01, 0.3, 0.3, 0.0, 0.0, 0.0]
        [joints.axis]
        type = "revolute"
        parent = "world"
        child = "arm"
        axis = [0.0, -1.0, 0.0]
        [actuators.drive]
        joint = "axis"
        gain = 1.0
        command_unit = "N m"
    """)
    time = 0.01 * np.arange(2000)
    q = 0.6 * np.sin(0.5 * time)
    noise = np.random.default_rng(5).normal(scale=0.05, size=time.size)
    torque = (4.0 * 0.5 + 1.0 * 0.9) * 9.81 * np.cos(q) - 0.6 * 0.25 * (0.3 + 1.0 + 0.81) * np.sin(0.5 * time) + noise
    log = vpm.Experiment.from_arrays(time, {"axis.position": q, "drive.command": torque}, model=arm)
    why = vpm.diagnose(arm, log, effects=["payload"], names="search", check=False, workers=1)
    (refused,) = [one for one in why.refused if one.name == "payload"]
    assert refused.reason == "these data do not discriminate it from arm.mass"
