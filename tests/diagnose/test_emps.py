"""The EMPS drive, measured: the whole way to the named effects, on data that ship with nobody's package.

Data: A. Janot, M. Gautier, M. Brunot, "Data Set and Reference Models of EMPS", 2019 Workshop on Nonlinear System
Identification Benchmarks. Published values: mass 95.109 kg, viscous 203.50 N s/m, Coulomb 20.39 N, offset -3.165 N.
"""

import json
import os
from pathlib import Path

import pytest

from command_line import vpm
from places import EXAMPLES, ROOT
from vpm.diagnosing import diagnose
from vpm.discrepancy import Diagnosis
from vpm.experiment import Experiment
from vpm.identify import identify
from vpm.model import Model

DATA = Path(os.environ.get("VPM_SHARED_DATA", ROOT.parent / "shared" / "data")) / "emps"
MODEL = EXAMPLES / "emps" / "model.toml"

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"the measured EMPS logs are not at {DATA}")

PUBLISHED = {
    "carriage.mass": 95.109,
    "axis.friction.viscous": 203.50,
    "axis.friction.coulomb": 20.39,
    "axis.bias.force": -3.165,
}


#: What is found, and what could be beside it: a diagnosis of all effects is the fixture's.
TRIED = ("coulomb_friction", "asymmetric_friction", "hysteresis", "torque_ripple")


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    model = Model.load(MODEL)
    train, test = (Experiment.load(DATA / f"emps_{name}.csv", model=model) for name in ("train", "pulses_test"))
    return diagnose(model, train, test)


def test_names_what_the_axis_is_known_for(diagnosis: Diagnosis) -> None:
    assert diagnosis.verdict == "effect_found"
    assert [e.name for e in diagnosis.effects][:2] == ["coulomb_friction", "asymmetric_friction"]


def test_force_error_by_inverse_dynamics(diagnosis: Diagnosis) -> None:
    gap = diagnosis.gap["axis.effort"]
    assert 0.16 < gap.recalibrated / gap.signal < 0.19  # mass and viscous friction alone
    assert gap.after / gap.signal <= 0.054
    assert gap.noise_floor < gap.after


def test_closed_loop_force_error(diagnosis: Diagnosis) -> None:
    gap = diagnosis.gap["drive.command (closed_loop)"]  # force is gain times command, so the relative error is the same
    assert gap.after / gap.signal <= 0.080


def test_agrees_with_published_values() -> None:
    """Mass, viscous friction, Coulomb friction and offset: the published model."""
    model = Model.load(MODEL)
    for effect in ("coulomb_friction", "bias_force"):
        model = model.with_effect(effect, at="axis")
    fit = identify(model, Experiment.load(DATA / "emps_train.csv", model=model))
    for name, value in PUBLISHED.items():
        assert fit[name] == pytest.approx(value, rel=0.01), name


@pytest.mark.nightly
def test_command_line(tmp_path: Path) -> None:
    tried = [word for name in TRIED for word in ("--effect", name)]
    validation = DATA / "emps_pulses_test.csv"
    done = vpm(
        "diagnose",
        MODEL,
        DATA / "emps_train.csv",
        "--validate",
        validation,
        *tried,
        "--out",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert report["verdict"] == "effect_found"
    assert set(report["gap"]["axis.effort"]) >= {"before", "recalibrated", "after", "noise_floor", "unit"}
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<svg" in page
    assert "src=" not in page  # self-contained


def test_no_number_of_the_data_is_in_the_package() -> None:
    package = ROOT / "python" / "vpm"
    sources = [p for p in package.rglob("*") if p.suffix in {".py", ".toml", ".jinja"}]
    for number in ("35.15", "160.18", "243.45", "95.1", "203.5", "20.39", "3.16"):
        assert not [p.name for p in sources if number in p.read_text(encoding="utf-8")], number


def test_identify_agrees_with_published_values() -> None:
    model = Model.load(MODEL).with_effect("coulomb_friction", at="axis").with_effect("bias_force", at="axis")
    fit = identify(model, Experiment.load(DATA / "emps_train.csv", model=model))
    for name, value in PUBLISHED.items():
        assert fit[name] == pytest.approx(value, rel=0.01), name
