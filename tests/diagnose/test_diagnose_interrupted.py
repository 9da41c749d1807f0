"""A diagnosis that Ctrl-C ends, at each of its stages: it says what is known until then."""

import io
import json
import re
import signal
import sys
from functools import cache
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import vpm
from interrupting import running
from sledge import POLE, SAMPLED, pushed
from synthetic import Truth, nominal, simulate_axis
from vpm.demo import MODEL, TRAIN, VALIDATION
from vpm.discrepancy import ranked_effects
from vpm.experiment import Experiment
from vpm.ranking import ranking_search
from vpm.report import print_story, write_report

BIAS, FRICTION = "bias_force", "coulomb_friction"
BOTH = [BIAS, FRICTION]


@cache
def records(kind: str) -> tuple[Experiment, ...]:
    if kind == "observer":
        return tuple(pushed(seed=seed, dry=3.0, pole=POLE, duration=4.0) for seed in (1, 2))
    return tuple(simulate_axis(Truth(coulomb=9.0, bias=5.0), 2, 12.0, first_seed=7))


def stopped(kind: str, sentence: str) -> vpm.Diagnosis:
    """A diagnosis of which Ctrl-C comes with the sentences that begin so."""
    model = vpm.Model.from_toml(SAMPLED) if kind == "observer" else nominal()

    def tell(told: str) -> None:
        if told.startswith(sentence):
            raise KeyboardInterrupt

    why = vpm.diagnose(
        model,
        *records(kind),
        effects=BOTH,
        check=False,
        workers=1,
        tell=tell,
    )
    assert why.interrupted
    assert [note for note in why.notes if note.startswith("stopped by Ctrl-C")]
    return why


def named(why: vpm.Diagnosis) -> list[str]:
    return [effect.name for effect in why.effects]


@pytest.mark.parametrize("kind", ["ranking", "observer"])
def test_before_anything_is_named_nothing_is_said(kind: str) -> None:
    sentences = {"ranking": "ranking what", "observer": "fitting what"}
    why = stopped(kind, sentences[kind])
    assert (why.verdict, why.effects) == ("interrupted", ())
    assert "Stopped" in why.summary
    assert "no effect of the catalogue" not in why.summary
    assert why.model.theta.tolist() == pytest.approx(why.fit.model.theta.tolist())


@pytest.mark.parametrize("stage", ["comparing the nominal", "measuring what was named"])
def test_what_a_ranking_named_stands_without_being_measured(stage: str, tmp_path: Path) -> None:
    why = stopped("ranking", stage)
    assert (why.verdict, named(why)) == ("effect_found", BOTH)
    assert any(note.startswith("names come from a ranking") for note in why.notes)
    for effect, name, size in zip(why.effects, ("axis.bias.force", "axis.friction.coulomb"), (5.0, 9.0), strict=True):
        assert np.isnan(effect.gain)
        assert effect.evidence_nats > 0.0
        assert why.model.parameters[name].value == pytest.approx(size, rel=0.1)
        assert all(np.isnan(each.std) for each in effect.parameters)
    (gap,) = why.gap.values()
    assert gap.after < 0.1 * gap.recalibrated
    said = io.StringIO()
    print_story(why, Console(file=said, width=500))
    assert "bias_force at axis: was not measured on validation records" in said.getvalue()
    write_report(why, tmp_path)
    assert json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["effects"][0]["gain"] is None
    assert vpm.Diagnosis.load(tmp_path / "diagnosis.npz").summary == why.summary


def test_what_an_observer_did_not_measure_is_named_all_the_same() -> None:
    why = stopped("observer", "measuring what was named")
    assert named(why) == [FRICTION]
    assert np.isnan(why.effects[0].gain)
    assert why.model.parameters["way.friction.coulomb"].value == pytest.approx(3.0, rel=0.2)


def test_effects_that_were_measured_keep_their_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C while the second one is refitted: the first one has its gain, and the name of the second is told."""
    measure, calls = ranked_effects._beside, count()

    def one_only(*given: object) -> object:
        if next(calls):
            raise KeyboardInterrupt
        return measure(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(ranked_effects, "_beside", one_only)
    why = vpm.diagnose(nominal(), *records("ranking"), effects=BOTH, check=False, workers=1)
    assert why.interrupted
    assert named(why) == [BIAS]
    assert why.effects[0].gain > 0.3
    (told,) = [note for note in why.notes if note.startswith(f"the ranking names {FRICTION} at axis")]
    assert "Ctrl-C came before it was measured" in told


def test_a_ranking_whose_errors_were_not_measured_keeps_its_names(monkeypatch: pytest.MonkeyPatch) -> None:
    def pressed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(ranking_search, "gaps", pressed)
    train, test = records("ranking")
    ranking = vpm.rank(nominal(), train, test, effects=BOTH, workers=1)
    assert ranking.interrupted
    assert ranking.gaps == {}
    assert [one.effect for one in ranking.effects] == BOTH


def test_without_a_noise_floor_the_errors_are_told() -> None:
    why = stopped("ranking", "measuring the noise floor")
    assert (why.verdict, sorted(named(why))) == ("effect_found", BOTH)
    gap = why.gap["axis.effort"]
    assert gap.after < 0.2 * gap.recalibrated
    assert np.isnan(gap.noise_floor)
    assert all(effect.gain > 0.3 for effect in why.effects)


@pytest.mark.parametrize("stage", ["examining what is left", "designing discriminating"])
def test_names_keep_verdict_and_floor_after_the_naming(stage: str) -> None:
    why = stopped("ranking", stage)
    assert (why.verdict, sorted(named(why))) == ("effect_found", BOTH)
    assert why.gap["axis.effort"].noise_floor > 0.0
    assert "Missing: " in why.summary


def test_nothing_is_concluded_from_logs_that_were_not_checked() -> None:
    def pressed(*_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match=r"nothing is known yet: seed 7 was still being checked"):
        vpm.diagnose(nominal(), *records("ranking"), workers=1, progress=pressed)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another kind")
@pytest.mark.parametrize(
    ("stage", "known"), [("checking the channels of the logs", False), ("measuring the noise floor", True)]
)
def test_the_command_says_what_it_knows(stage: str, known: bool, tmp_path: Path) -> None:
    words = ["--validate", str(VALIDATION), "--effect", FRICTION, "--workers", "1", "-v", "--out", str(tmp_path)]
    with running([sys.executable, "-m", "vpm", "diagnose", str(MODEL), str(TRAIN), *words]) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if stage in line:
                break
        process.send_signal(signal.SIGINT)
        out, said = process.communicate()
    assert process.returncode == 130
    assert said.endswith("stopped by Ctrl-C\n")
    assert "Traceback" not in said
    assert bool(re.search("nothing is known yet: .* was still being checked", said)) is not known
    assert (f"{FRICTION} at shoulder" in out) is known
    assert (tmp_path / "report.json").exists() is known
