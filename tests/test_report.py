"""The page for people: complete, self-contained, and true to the diagnosis."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

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
