"""The page for people: complete, self-contained, and true to the diagnosis."""

import hashlib
import io
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import vpm
from vpm.demo import MODEL, TRAIN, VALIDATION
from vpm.discrepancy.diagnosis import RefusedEffect
from vpm.identify import Combination
from vpm.numbers import percent, short
from vpm.report.messages import estimate, refitted, took
from vpm.report.story import print_story

HTML, SVG = "{http://www.w3.org/1999/xhtml}", "{http://www.w3.org/2000/svg}"
#: Most bytes of a page.
LARGEST = 1_000_000

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


def told_by(why: vpm.Diagnosis) -> str:
    """All that a diagnosis says but for the time it took, and where it comes from."""
    return repr({**why.to_dict(), "seconds": 0.0, "provenance": None})


def test_one_core_and_four_find_the_same(diagnosis: vpm.Diagnosis) -> None:
    model = vpm.Model.load(MODEL)
    train, test = (vpm.Experiment.load(path, model=model) for path in (TRAIN, VALIDATION))
    told: list[tuple[str, str, int, int]] = []
    documents = []
    for workers in (1, 4):
        why = vpm.diagnose(model, train, test, workers=workers, progress=lambda *each: told.append(each))
        documents.append(told_by(why))  # to the last digit
    assert documents[0] == documents[1] == told_by(diagnosis)
    # Every start of a candidate is told once, and the count goes up to the number of them.
    screened = [each for each in told if each[0] == "screening"]
    count = screened[0][3]
    assert [each[2] for each in screened[:count]] == list(range(1, count + 1))
    assert len({each[1] for each in screened[:count]}) > 1


def test_a_terminal_says_each_reason_once(diagnosis: vpm.Diagnosis) -> None:
    from rich.console import Console

    refused = [RefusedEffect(name, site, "too slight") for name in ("spring", "backlash") for site in ("hip", "knee")]
    console = Console(file=io.StringIO(), record=True, width=200)
    print_story(replace(diagnosis, refused=(*refused, RefusedEffect("payload", "hand", "too late"))), console)
    lines = console.export_text().splitlines()
    start = lines.index("refused:")
    assert lines[start + 1 : start + 3] == [
        "  spring at hip, knee; backlash at hip, knee: too slight",
        "  payload at hand: too late",
    ]


def test_each_finding_has_its_evidence_on_validation_data(diagnosis: vpm.Diagnosis) -> None:
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


def test_page_shows_the_model_reduction(diagnosis: vpm.Diagnosis) -> None:
    model = diagnosis.model
    ladder = vpm.simplify(model, vpm.Experiment.load(VALIDATION, model=model), tolerance=0.5)
    assert "Model reduction" in vpm.report(diagnosis, ladder)._repr_html_()
    assert "Model reduction" not in vpm.report(diagnosis)._repr_html_()


# ---- the page as a document ------------------------------------------------------------------------------------------


def text_of(element: ET.Element) -> str:
    return " ".join("".join(element.itertext()).split())


def test_page_is_valid_and_linked(page: str) -> None:
    """It parses as strict XML, names are unique, links lead somewhere, and lists and tables hold what they may."""
    root = ET.fromstring(page)
    ids = [element.attrib["id"] for element in root.iter() if "id" in element.attrib]
    assert len(ids) == len(set(ids))
    links = [a.attrib["href"] for a in root.iter(f"{HTML}a")]
    assert len(links) >= 12
    assert {link.removeprefix("#") for link in links} <= set(ids)
    children = {"ul": {"li"}, "ol": {"li"}, "tr": {"td", "th"}, "tbody": {"tr"}, "thead": {"tr"}}
    for parent, allowed in children.items():
        for element in root.iter(HTML + parent):
            assert {child.tag.removeprefix(HTML) for child in element} <= allowed
    blocks = {"p", "ul", "ol", "table", "figure", "div", "h1", "h2", "h3", "li"}
    for paragraph in root.iter(f"{HTML}p"):
        assert not {child.tag.removeprefix(HTML) for child in paragraph.iter() if child is not paragraph} & blocks
    for table in root.iter(f"{HTML}table"):
        widths = {len(row) for row in table.iter(f"{HTML}tr")}
        assert len(widths) == 1


def test_page_loads_nothing_and_suits_the_dark(page: str) -> None:
    loaded = re.findall(r"""(?:src|href|data|action)=["'](?!#|data:)[^"']+|@import|url\((?!["']?#)[^)]*""", page)
    assert loaded == []
    assert "<script" not in page
    assert "prefers-color-scheme: dark" in page
    assert len(page.encode()) < LARGEST


def test_each_picture_is_told_in_words_with_numbers(page: str) -> None:
    root = ET.fromstring(page)
    pictures = list(root.iter(f"{HTML}figure"))
    names = {figure.attrib["id"] for figure in pictures}
    expected = {"finding-1", "picture-gap", "picture-simulated", "picture-correlation", "picture-candidates"}
    assert expected | {f"picture-0-{kind}" for kind in ("time", "state", "noise")} <= names
    for figure in pictures:
        svg = next(figure.iter(f"{SVG}svg"))
        assert svg.attrib["role"] == "img"
        assert re.search(r"\d", svg.attrib["aria-label"])
        assert "nan" not in svg.attrib["aria-label"]
        assert "mathdefault" not in text_of(svg)


def test_table_bars_and_text_agree(page: str, diagnosis: vpm.Diagnosis) -> None:
    """Every share of the table stands at its bar and in its words, those of the summary among them."""
    root = ET.fromstring(page)
    table = next(t for t in root.iter(f"{HTML}table") if t.attrib.get("id") == "gap-table")
    figure = next(f for f in root.iter(f"{HTML}figure") if f.attrib["id"] == "picture-gap")
    svg = next(figure.iter(f"{SVG}svg"))
    bars = sorted(text_of(text) for text in svg.iter(f"{SVG}text") if text_of(text).endswith(" %"))
    rows = [[text_of(cell) for cell in row] for row in table.iter(f"{HTML}tr")][1:]
    assert [row[0] for row in rows] == list(diagnosis.gap)
    shares = []
    for row, gap in zip(rows, diagnosis.gap.values(), strict=True):
        for cell, value in zip(row[1:4], (gap.before, gap.recalibrated, gap.after), strict=True):
            assert cell.startswith(short(value))
            shares.append(cell.removeprefix(short(value)).strip())
            assert shares[-1] == percent(value / gap.signal)
            assert shares[-1] in svg.attrib["aria-label"]
    assert bars == sorted(shares)
    told = re.findall(r"[\d.]+ %", diagnosis.summary)
    assert len(told) == 3
    assert told == shares[:3]
    steps = next(t for t in root.iter(f"{HTML}table") if t.attrib.get("id") == "step-table")
    assert [text_of(row[3]) for row in steps.iter(f"{HTML}tr")][-1] == told[-1]


def test_steps_and_effects_stand_in_the_order_that_is_told(page: str, diagnosis: vpm.Diagnosis) -> None:
    root = ET.fromstring(page)
    steps = next(t for t in root.iter(f"{HTML}table") if t.attrib.get("id") == "step-table")
    rows = [[text_of(cell) for cell in row] for row in steps.iter(f"{HTML}tr")][1:]
    assert [row[0] for row in rows] == [str(number) for number in range(1, len(diagnosis.steps) + 1)]
    assert [row[1] for row in rows] == ["recalibrated parameters", "+ coulomb_friction at shoulder"]
    assert "in the order in which the ranking found them" in page
    searched = replace(diagnosis, effects=tuple(replace(e, evidence_nats=float("nan")) for e in diagnosis.effects))
    assert "by what each adds beside all the others" in vpm.report(searched)._repr_html_()


# ---- what is true ----------------------------------------------------------------------------------------------------


def test_samples_that_do_not_count_are_gaps_and_no_zeros(diagnosis: vpm.Diagnosis) -> None:
    (picture,) = diagnosis.pictures
    gaps = np.isnan(picture.after)
    assert 0.2 < gaps.mean() < 0.5
    assert np.array_equal(gaps, np.isnan(picture.recalibrated))
    assert not np.any(picture.after == 0.0)
    assert np.abs(picture.velocity[gaps]).mean() < np.abs(picture.velocity[~gaps]).mean()


def test_a_value_within_its_deviation_is_called_undetermined() -> None:
    assert estimate(0.5, 0.1, "N") == "0.5 ± 0.1 N"
    assert "undetermined: within its deviation of zero" in estimate(-0.05, 0.1, "N")
    assert estimate(5.0, np.inf, "N") == "5 N, undetermined: the records do not show it"
    assert "change undetermined: within its deviation of the model file's 0.45" in estimate(0.5, 0.1, "N", 0.45)
    assert "undetermined" not in estimate(0.5, 0.1, "N", 0.2)
    assert estimate(0.5, 0.0, "1") == "0.5 (held)"


def test_a_value_without_a_deviation_is_said_to_show_with_others_or_in_no_effort(diagnosis: vpm.Diagnosis) -> None:
    fit = diagnosis.fit
    first, second = [name for name in fit.names if name in diagnosis.stated][:2]
    both = Combination((first, second), (1.0, 2.0), 0.0)
    unsure = replace(fit, std=np.full_like(fit.std, np.inf), unidentifiable=(both,))
    told = {name: said for name, _, said in refitted(replace(diagnosis, fit=unsure))}
    assert told[first].endswith(f"undetermined: the efforts show it only together with {second}")
    alone = replace(unsure, unidentifiable=(Combination((first,), (1.0,), 0.0),))
    told = {name: said for name, _, said in refitted(replace(diagnosis, fit=alone))}
    assert told[first].endswith("undetermined: the efforts do not show it")


def test_an_effect_that_made_it_worse_is_not_said_to_take(diagnosis: vpm.Diagnosis) -> None:
    (effect,) = diagnosis.effects
    assert took(replace(effect, gain=0.25)).startswith("took 25.00 % of the validation mean square")
    assert took(replace(effect, gain=-0.25)).startswith("added 25.00 % to the validation mean square")
    assert took(replace(effect, gain=0.25, score=3.0)).endswith("(3.0 standard deviations)")
    hidden = replace(effect, gain=-0.04, score=0.6)
    assert took(hidden).endswith("(0.6 standard deviations, no more than chance)")
    assert took(hidden, [effect]).endswith(f"no more than chance while {effect.label} was missing)")


def test_page_says_where_it_comes_from(page: str, diagnosis: vpm.Diagnosis, tmp_path: Path) -> None:
    made = diagnosis.provenance
    assert made is not None
    assert [source.role for source in made.sources] == ["model", "fitted", "unseen"]
    for source, path in zip(made.sources, (MODEL, TRAIN, VALIDATION), strict=True):
        assert source.path == str(path)
        assert source.sha256 == hashlib.sha256(Path(path).read_bytes()).hexdigest()
        assert source.sha256 in page
    assert made.settings == {}
    assert made.version in page
    assert made.date in page
    assert vpm.Diagnosis.load(diagnosis.save(tmp_path / "why.npz")).provenance == made


def test_a_record_knows_its_file_until_it_is_changed() -> None:
    record = vpm.Experiment.load(TRAIN, model=vpm.Model.load(MODEL))
    assert record.path == str(TRAIN)
    assert record.renamed("other").path is None
    assert record == record.renamed(record.name)


def test_long_records_make_no_large_page_and_keep_their_peaks(diagnosis: vpm.Diagnosis) -> None:
    (picture,), trace = diagnosis.pictures, diagnosis.traces[0]
    n, random = 100_000, np.random.default_rng(0)
    time, noise = np.linspace(0.0, 400.0, n), random.standard_normal((5, n))
    noise[4, 50_000:50_125] = np.nan
    noise[4, 75_000] = 77.0
    names = ("position", "velocity", "measured", "recalibrated", "after")
    long = replace(picture, time=time, before=noise[4], **dict(zip(names, noise, strict=True)))
    traced = replace(trace, time=time, measured=noise[0], before=noise[1], after=noise[2])
    html = vpm.report(replace(diagnosis, pictures=(long,) * 4, traces=(traced,) * 6))._repr_html_()
    assert len(html.encode()) < LARGEST
    assert html.count("largest at the end 77 N m at 300 s") >= 2


def test_numbers_are_rounded_in_one_way() -> None:
    assert [percent(share) for share in (0.3045, 0.0096, 0.00015, -0.25, 1e-12, 0.0)] == [
        *("30.45 %", "0.96 %", "0.015 %", "-25.00 %", "0.00 %", "0.00 %"),
    ]
    assert [percent(float("nan")), short(float("nan")), short(0.451234)] == ["–", "–", "0.4512"]


def test_long_tables_are_cut_and_say_what_stands_elsewhere(diagnosis: vpm.Diagnosis) -> None:
    """Hundreds of candidates of a large machine, and of each a reason; pictures make room for them."""
    refused = RefusedEffect("spring", "axis", "no value of its parameters helps on data that were not used for the fit")
    many = replace(diagnosis, candidates=diagnosis.candidates[:1] * 9000, refused=(refused,) * 9000)
    html = vpm.report(many)._repr_html_()
    assert len(html.encode()) < LARGEST
    assert html.count("8700 more stand in report.json") == 2
