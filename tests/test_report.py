"""The page for people: complete, self-contained, and true to the diagnosis."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import vpm
from vpm.demo import MODEL, TRAIN, VALIDATION

pytest.importorskip("jinja2", reason="the page needs the extra report")
pytest.importorskip("matplotlib", reason="the page needs the extra report")


@pytest.fixture(scope="module")
def diagnosis() -> vpm.Diagnosis:
    model = vpm.Model.load(MODEL)
    train, test = (vpm.Experiment.load(path, model=model) for path in (TRAIN, VALIDATION))
    return vpm.diagnose(model, train, test)


@pytest.fixture(scope="module")
def page(diagnosis: vpm.Diagnosis, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = vpm.report(diagnosis).save(tmp_path_factory.mktemp("report") / "report.html")
    return Path(path).read_text(encoding="utf-8")


def test_one_core_and_four_find_the_same(diagnosis: vpm.Diagnosis) -> None:
    model = vpm.Model.load(MODEL)
    train, test = (vpm.Experiment.load(path, model=model) for path in (TRAIN, VALIDATION))
    told: list[tuple[str, str, int, int]] = []
    documents = []
    for workers in (1, 4):
        why = vpm.diagnose(model, train, test, workers=workers, progress=lambda *each: told.append(each))
        documents.append(repr({**why.to_dict(), "seconds": 0.0}))  # to the last digit
    assert documents[0] == documents[1] == repr({**diagnosis.to_dict(), "seconds": 0.0})
    # Every start of a candidate is told once, and the count goes up to the number of them.
    screened = [each for each in told if each[0] == "screening"]
    count = screened[0][3]
    assert [each[2] for each in screened[:count]] == list(range(1, count + 1))
    assert len({each[1] for each in screened[:count]}) > 5


def test_each_finding_has_its_evidence_on_unseen_data(diagnosis: vpm.Diagnosis) -> None:
    """Dry friction: two levels over the velocity, of the size that was hidden; what is left is far smaller."""
    (evidence,) = diagnosis.evidence
    assert (evidence.effect, evidence.site) == ("coulomb_friction", "shoulder")
    assert (evidence.record, evidence.channel) == ("validation", "shoulder.effort")
    assert (evidence.axis, evidence.axis_unit, evidence.unit) == ("velocity", "rad/s", "N m")
    fast = np.abs(evidence.values) > 0.3
    np.testing.assert_allclose(evidence.without[fast] * np.sign(evidence.values[fast]), 0.55, atol=0.12)
    assert np.sqrt(np.mean(evidence.repaired[fast] ** 2)) < 0.06
    moving = np.abs(evidence.law_values) > 0.1
    fitted = diagnosis.model.parameters["shoulder.friction.coulomb"].value
    np.testing.assert_allclose(evidence.law[moving], fitted * np.sign(evidence.law_values[moving]), atol=1e-6)


def test_evidence_stands_on_the_page_with_its_law(page: str, diagnosis: vpm.Diagnosis) -> None:
    assert page.count('class="evidence"') == len(diagnosis.effects) == 1
    assert "coulomb tanh(v/transition_velocity)" in page
    assert "which was never fitted" in page


def test_page_needs_no_other_file(page: str) -> None:
    assert not re.findall(r'(?:src|href)="(?!#|data:)[^"]+"', page)
    assert page.count("<svg") >= 5
    assert page.strip().endswith("</html>")


def test_page_says_what_the_diagnosis_says(page: str, diagnosis: vpm.Diagnosis) -> None:
    assert diagnosis.verdict in page
    for effect in diagnosis.effects:
        assert effect.name in page
        for parameter in effect.parameters:
            assert parameter.dotted in page
    for refused in diagnosis.refused:
        assert refused.name in page
    for note in diagnosis.notes:
        assert note in page


def test_names_of_the_model_cannot_become_markup(diagnosis: vpm.Diagnosis) -> None:
    content = {**diagnosis.model.to_dict(), "name": "<script>alert(1)</script>"}
    hostile = replace(diagnosis, model=vpm.Model.from_dict(content))
    assert "<script>" not in vpm.report(hostile)._repr_html_()


def test_page_shows_the_way_down(diagnosis: vpm.Diagnosis) -> None:
    model = diagnosis.model
    ladder = vpm.simplify(model, vpm.Experiment.load(VALIDATION, model=model), tolerance=0.5)
    assert "The way down" in vpm.report(diagnosis, ladder)._repr_html_()
    assert "The way down" not in vpm.report(diagnosis)._repr_html_()
