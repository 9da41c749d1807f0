"""The proving ground counts what it says: scoring on made-up answers, and one case from its seed to the table."""

import json
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import vpm
from blind import EFFECTS, MACHINES, hideable, proving, score, sites_of, table
from blind import case as case_module
from blind.answer import Answer, Named, _Alarm, informed
from blind.batch import simulated
from blind.case import _plan
from blind.proving import Job
from shared_cases import shared_case
from vpm.cli import app
from vpm.errors import DiagnosisError
from vpm.prove_command import BEGIN, END, _maker, numbers, page
from vpm.ranking.calibration import Calibration
from vpm.ranking.settings import Settings

TESTS = Path(__file__).resolve().parents[1]


def effect(text: str) -> Named:
    name, _, site = text.partition("@")
    return Named(name, site)


def answer(missing: str, *found: str, **more: object) -> Answer:
    """An answer to a solvable case on the linear axis; effects as ``name@site``."""
    there = tuple(effect(one) for one in missing.split())
    told = tuple(effect(one) for one in found)
    kind = "single" if len(there) == 1 else "pairs" if there else "none"
    plain = Answer("axis_linear", kind, tuple(h.name for h in there) or ("none",), 3, 1.0, known=True)
    full = replace(plain, hidden=there, strengths=(5.0,) * len(there), named=told, ranking=told, verdict="effect_found")
    return replace(full, **more)  # type: ignore[arg-type]


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Records of a third of the length, which say as much about what no record can tell."""
    monkeypatch.setattr(case_module, "SHORTEST", 3.5)
    monkeypatch.setattr(case_module, "LONGEST", 4.5)


def test_only_the_first_name_counts_as_top_1() -> None:
    right = answer("spring@axis", "spring@axis")
    late = answer("spring@axis", "bias_force@axis", "spring@axis")
    none = answer("spring@axis", ranking=(Named("payload", "body"), Named("spring", "axis")))
    assert [score.top(a, 1) for a in (right, late, none)] == [True, False, False]
    assert all(score.top(a, 3) for a in (right, late, none))
    assert score.alone(right)
    assert not score.alone(answer("spring@axis", "spring@axis", "bias_force@axis"))
    fourth = tuple(Named(n, "axis") for n in ("a", "b", "c", "spring"))
    assert not score.top(answer("spring@axis", ranking=fourth), 3)
    twice = (Named("a", "one"), Named("a", "two"), Named("b", "one"), Named("spring", "axis"))
    assert score.top(answer("spring@axis", ranking=twice), 3)


def test_a_right_name_at_a_wrong_site_is_half_right() -> None:
    astray = answer("coulomb_friction@elbow", "coulomb_friction@shoulder", machine="arm2r")
    assert score.top(astray, 1)
    assert not score.in_place(astray)


def test_the_mean_of_friction_that_differs_along_the_way_counts_with_it() -> None:
    hidden, mean = "position_dependent_friction@axis", "coulomb_friction@axis"
    both = answer(hidden, mean, hidden)
    assert score.top(both, 1)
    assert score.in_place(both)
    assert score.alone(both)
    assert not score.alone(answer(hidden, mean, hidden, "bias_force@axis"))
    assert not score.top(answer(hidden, mean), 1)


def test_equivalent_names_count_on_their_machines_only() -> None:
    late = answer("sensor_delay@encoder", "input_delay@drive")
    assert score.top(late, 1)
    assert score.in_place(late)
    elsewhere = answer("sensor_delay@encoder", "input_delay@servo", machine="servo_cylinder")
    assert not score.top(elsewhere, 1)
    tilted = answer("bias_force@axis", "gravity_tilt@world")
    assert score.in_place(tilted)
    assert not score.in_place(replace(tilted, machine="axis_rotary"))


def test_every_equivalence_is_of_things_that_can_be_hidden_or_named() -> None:
    for same in score.EQUIVALENT:
        assert same.reason
        for machine in same.machines:
            assert same.at in sites_of(machine, same.hidden), (machine, same.hidden)


@pytest.mark.parametrize(
    ("machine", "seed", "one", "other", "settled"),
    [
        ("axis_linear", 0, {"encoder.sensor_delay.time": 4e-3}, {"drive.input_delay.time": 4e-3}, 0.0),
        ("axis_rotary", 0, {"encoder.sensor_offset.value": 0.02}, {"world.gravity_tilt.angle": -0.02}, 4.0),
        ("arm2r", 3, {"encoder_1.sensor_offset.value": 0.02}, {"world.gravity_tilt.angle": -0.02}, 4.0),
        ("servo_cylinder", 1, {"slide.payload.mass": 2.0}, {"axis.rotor_inertia.inertia": 2.0}, 0.0),
    ],
)
def test_equivalent_effects_leave_the_same_records(
    machine: str, seed: int, one: dict[str, float], other: dict[str, float], settled: float
) -> None:
    """Machines that start from other places have to settle first."""
    quiet = _plan(MACHINES[machine], "none", seed, 0.0, recalibrate=False)
    samples = round((settled + 3.0) * quiet.draft.rate)
    quiet = replace(quiet, paths=tuple(path[:, :samples] for path in quiet.paths[:1]))
    plans = [replace(quiet, with_effect={**quiet.with_effect, **values}) for values in ({}, one, other)]
    none, first, second = (records[0][:, :, 1] for _, records in simulated(plans))
    begin = round(settled * quiet.draft.rate)
    size = np.abs(first - none)[begin:].max(0)
    assert np.all(np.abs(first - second)[begin:].max(0) < 0.01 * size.max() + 1e-9 * np.abs(none).max(0))
    assert np.all(size > 0.0)


@pytest.mark.parametrize("seed", [2, 1002])
def test_a_payload_behind_a_turning_axis_is_its_centre_and_inertia(seed: int) -> None:
    """Both of which may be calibrated: nobody can tell it from them, so that it does not count."""
    payload = _plan(MACHINES["axis_rotary"], "payload", seed, 0.0, recalibrate=False)
    payload = replace(payload, paths=tuple(path[:, : round(3.0 * payload.draft.rate)] for path in payload.paths[:1]))
    true, bare = payload.with_effect, payload.without
    mass, load, lever = true["body.mass"], true["body.payload.mass"], true["body.payload.lever"]
    centre = true["body.centre"] + load * lever / mass
    inertia = true["body.inertia"] + mass * (true["body.centre"] ** 2 - centre**2) + load * lever**2
    assert {"body.centre", "body.inertia"} <= set(payload.truth.nominal)
    assert inertia > 0.0
    calibrated = replace(payload, with_effect={**bare, "body.centre": centre, "body.inertia": inertia})
    first, second, none = (
        records[0][:, :, column]
        for plan, column in ((payload, 1), (calibrated, 1), (payload, 2))
        for _, records in simulated([plan])
    )
    assert np.abs(first - second).max() < 1e-6 * np.abs(first - none).max()
    assert proving.absorbed("axis_rotary", "payload", "body")


@pytest.mark.nightly
def test_where_a_machine_begins_says_nothing_of_its_encoder() -> None:
    """On a level slide only the volumes of oil depend on the place; in gravity an offset shows wherever one begins."""
    slide = shared_case("servo_cylinder", "sensor_offset@encoder", 42)
    assert slide.oracle.strength < 0.5
    arm = shared_case("arm2r", "sensor_offset@encoder_2", 5003)
    assert arm.oracle.solvable


def test_where_the_angle_of_a_level_arm_is_counted_from_shows_nowhere() -> None:
    """An offset of its first encoder leaves the log of an arm without one whose angles are all counted from there."""
    hidden = _plan(MACHINES["flexible_arm"], "sensor_offset@encoder_1", 1, 0.0, recalibrate=False)
    hidden = replace(hidden, paths=tuple(path[:, : round(0.5 * hidden.draft.rate)] for path in hidden.paths[:1]))
    (offset,) = hidden.truth.hidden[0].parameters.values()
    turned = replace(hidden, with_effect=hidden.without, paths=tuple(p - [[offset], [0.0]] for p in hidden.paths))
    (_, (first,)), (_, (second,)) = (next(iter(simulated([plan]))) for plan in (hidden, turned))
    shift = np.zeros(first.shape[1])
    shift[0] = offset
    assert np.abs(first[:, :, 1] - second[:, :, 1] - shift).max() < 1e-9
    assert np.abs(first[:, :, 1] - first[:, :, 2]).max() > 0.5 * abs(offset)
    assert proving.absorbed("flexible_arm", "sensor_offset", "encoder_1")
    assert not proving.absorbed("flexible_arm", "sensor_offset", "encoder_2")


def test_both_of_a_pair_have_to_be_named() -> None:
    both = answer("spring@axis bias_force@axis", "bias_force@axis", "spring@axis")
    assert score.all_named(both)
    assert not score.all_named(replace(both, named=both.named[:1]))
    weak = replace(both, strengths=(5.0, 0.4))
    assert score.pairs([both, weak]) == [both]


def test_an_effect_named_where_none_is_missing_is_an_alarm() -> None:
    alarm, quiet = answer("", "spring@axis"), answer("", verdict="no_disagreement")
    failed = answer("", error="ValueError: no", verdict="")
    assert score.without([alarm, quiet, failed]) == [alarm, quiet]
    assert str(score.rate(score.without([alarm, quiet]), score.alarmed)).startswith("1/2 = 50 %")
    assert table.failed(alarm) == "spring at axis"
    assert not table.failed(quiet)


def test_a_diagnosis_that_fails_is_wrong() -> None:
    failed = answer("spring@axis", error="ValueError: no", verdict="")
    assert score.single([failed]) == [failed]
    assert not score.top(failed, 1)
    assert not score.top(failed, 3)
    assert "ValueError: no" in table.tables([failed])


def test_weak_effects_do_not_count() -> None:
    assert score.single([answer("spring@axis", strengths=(0.9,)), answer("spring@axis", strengths=())]) == []


def test_intervals_are_those_of_wilson() -> None:
    """Against R. Newcombe, Statistics in Medicine 17 (1998) 857, table I, method 3."""
    for hits, count, low, high in ((81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611)):
        assert score.Rate(hits, count).interval == pytest.approx((low, high), abs=5e-5)
    assert score.Rate(1, 29).interval == pytest.approx((0.0061, 0.1718), abs=5e-5)
    assert score.Rate(0, 0).interval == (0.0, 1.0)


def test_errors_of_parameters_are_against_the_truth() -> None:
    hidden = Named("end_stop", "axis", {"stiffness": 200.0, "low": -1e9})
    named = Named("end_stop", "axis", {"stiffness": 210.0, "low": -3.0}, {"stiffness": 5.0})
    found = score.parameter_errors([answer("end_stop@axis", hidden=(hidden,), named=(named,))])
    assert [e.parameter for e in found] == ["stiffness"]
    assert (found[0].relative, found[0].deviations) == pytest.approx((0.05, 2.0))
    astray = replace(named, site="elbow")
    assert score.parameter_errors([answer("end_stop@axis", hidden=(hidden,), named=(astray,))]) == []


def test_gaps_are_compared_where_they_are_known() -> None:
    known = answer("spring@axis", "spring@axis", gap=1.1, oracle_gap=1.0, recalibrated_gap=4.4)
    assert score.gap_ratios([known, answer("spring@axis")]) == pytest.approx([1.1])
    assert score.closed([known]) == pytest.approx([0.25])


def test_the_matrix_counts_hidden_against_named() -> None:
    found = [
        answer("spring@axis", "spring@axis"),
        answer("spring@axis", "payload@body"),
        answer("sensor_delay@encoder", "input_delay@drive"),
        answer("", verdict="no_disagreement"),
        answer("spring@axis", strengths=(0.1,)),
    ]
    part = table.tables(found).partition("### Hidden against named")[2].partition("###")[0]
    assert part.strip() == "- spring: right 1, payload 1"


def test_answers_are_kept_as_plain_data(tmp_path: Path) -> None:
    found = [answer("spring@axis", "spring@axis", rivals=("payload",)), answer("", error="ValueError: no")]
    proving.save_json(found, tmp_path / "cases.json")
    assert "NaN" not in (tmp_path / "cases.json").read_text(encoding="utf-8")
    back = proving.load_json(tmp_path / "cases.json")
    assert [repr(a) for a in back] == [repr(a) for a in found]


def test_cases_are_dealt_out_over_seeds() -> None:
    todo = proving.jobs(["axis_linear"], seeds=range(5), each=2)
    kinds = {kind: [job for job in todo if job.kind == kind] for kind in proving.KINDS}
    assert len(kinds["single"]) == 2 * len(hideable("axis_linear", known=True))
    assert len({job.seed for job in kinds["single"]}) == 5
    assert len(kinds["none"]) == len(kinds["parameters"]) == 5
    assert all(len(job.request) == 2 for job in kinds["pairs"])
    assert len(kinds["pairs"]) == 10
    assert len({job.request for job in kinds["pairs"]}) > 7
    assert {name for job in kinds["pairs"] for name in job.request} <= set(hideable("axis_linear", known=True)) - {
        "payload"
    }
    assert len(set(todo)) == len(todo)
    only = proving.jobs(["arm2r", "axis_linear"], ["gravity_tilt"], seeds=[7])
    assert only == [Job("arm2r", "single", ("gravity_tilt",), 7, 1.0)]
    for wrong in ({"machines": ["crane"]}, {"effects": ["magic"]}, {"kinds": ["all"]}, {"each": 2}):
        with pytest.raises(ValueError, match=r"the proving ground has no|each effect is to be hidden"):
            proving.jobs(**wrong)


@pytest.mark.nightly
def test_a_pair_knows_how_strong_each_effect_is_alone_and_beside_the_other() -> None:
    job = Job("axis_linear", "pairs", ("bias_force", "spring"), 2, 1.0)
    ((_, case, strengths, alone, _, error),) = proving.make([job])
    assert not error
    assert case is not None
    apart = [shared_case("axis_linear", name, 2) for name in job.request]
    assert alone == pytest.approx([one.oracle.strength for one in apart])
    # A spring's place of rest is unknown too, and that is a constant force.
    assert strengths[0] < 0.05 * alone[0]
    assert strengths[1] == pytest.approx(alone[1], rel=0.3)


@pytest.mark.usefixtures("short")
def test_two_names_for_one_physics_cannot_be_told_apart() -> None:
    job = Job("axis_linear", "pairs", ("input_delay", "sensor_delay"), 2, 1.0)
    ((_, _, strengths, alone, _, _),) = proving.make([job])
    assert strengths == (0.0, 0.0)
    assert min(alone) > 0.0


@pytest.mark.usefixtures("short")
def test_what_is_exactly_a_calibratable_parameter_is_not_solvable() -> None:
    ((_, _, strengths, _, _, _),) = proving.make([Job("axis_linear", "single", ("payload",), 0, 1.0)])
    assert strengths == (0.0,)


@pytest.mark.usefixtures("short")
def test_a_case_that_blows_up_loses_itself_only(monkeypatch: pytest.MonkeyPatch) -> None:
    spring = EFFECTS["spring"]
    wild = replace(spring, draw=lambda _g, _s: {"stiffness": -1e12, "rest": 1.0})
    monkeypatch.setattr(case_module, "EFFECTS", {**EFFECTS, "spring": wild})
    jobs = [Job("axis_linear", "single", (name,), 1, 1.0) for name in ("spring", "bias_force")]
    lost, kept = proving.make(jobs)
    assert lost[1] is None
    assert "seed 1 does not stay finite" in proving.ask(lost, 1.0).error
    assert kept[1] is not None


def test_the_oracle_knows_the_hidden_effect() -> None:
    case = shared_case("axis_linear", "spring", 1)
    model, free = informed(case)
    hidden = case.truth.hidden[0]
    assert {"axis.spring.stiffness", "axis.spring.rest", "body.mass"} <= set(free)
    assert model.parameters["axis.spring.stiffness"].value == hidden.parameters["stiffness"]
    assert model.parameters["body.mass"].value == pytest.approx(case.truth.parameters["body.mass"], rel=1e-12)


def test_a_case_is_written_for_people(tmp_path: Path) -> None:
    case = shared_case("axis_linear", "spring", 1)
    case.write(tmp_path / "case")
    model = vpm.Model.load(tmp_path / "case" / "model.toml")
    assert model == case.model()
    for name, record in (("train_1", case.train[0]), ("train_2", case.train[1]), ("validate", case.validate[0])):
        read = vpm.Experiment.load(tmp_path / "case" / f"{name}.csv", model=model)
        np.testing.assert_allclose(read["axis.position"], record["axis.position"], rtol=1e-12)
    truth = json.loads((tmp_path / "case" / "truth.json").read_text(encoding="utf-8"))
    assert truth["hidden"][0]["name"] == "spring"


def test_one_case_from_its_seed_to_the_page(tmp_path: Path) -> None:
    out = tmp_path / "page.md"
    out.write_text(f"# Mine\n\n{BEGIN}\nold\n{END}\nafter\n", encoding="utf-8")
    words = ["prove", "--machine", "axis_linear", "--effect", "coulomb_friction", "--kind", "single"]
    words += ["--seeds", "0", "--workers", "1"]
    run = CliRunner().invoke(app, [*words, "--folder", str(TESTS), "--out", str(out)], catch_exceptions=False)
    assert run.exit_code == 0
    text = out.read_text(encoding="utf-8")
    assert text.startswith("# Mine")
    assert text.endswith(f"{END}\nafter\n")
    assert "old" not in text
    assert "named first (top-1)" in text
    (found,) = proving.load_json(tmp_path / "page.json")
    assert score.in_place(found)
    assert found.oracle_gap > 0.0
    assert score.gap_ratios([found]) == pytest.approx(1.0, abs=0.3)
    (error,) = (e for e in score.parameter_errors([found]) if e.parameter == "coulomb")
    assert abs(error.relative) < 0.05
    assert found.weighed[0].accepted
    assert found.named[0].probability == pytest.approx(1.0 - Settings().astray, abs=0.02)
    assert (tmp_path / "page.svg").read_text(encoding="utf-8").startswith("<?xml")

    again = ["prove", "--answers", str(tmp_path / "page.json"), "--folder", str(TESTS)]
    run = CliRunner().invoke(app, [*again, "--calibrate", str(tmp_path / "numbers.json")], catch_exceptions=False)
    assert run.exit_code == 0
    assert "named first (top-1)" in run.output
    assert Calibration.load(tmp_path / "numbers.json").seeds == "0"


def test_what_is_done_is_kept_when_someone_interrupts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given = iter([answer("spring@axis", "spring@axis")])

    def ask(*_: object) -> Answer:
        for one in given:
            return one
        raise KeyboardInterrupt

    monkeypatch.setattr(proving, "ask", ask)
    words = ["prove", "--machine", "axis_linear", "--effect", "spring", "--effect", "bias_force", "--kind", "single"]
    words += ["--seeds", "0", "--workers", "1", "--folder", str(TESTS), "--out", str(tmp_path / "page.md")]
    (tmp_path / "page.md").write_text(f"The whole campaign.\n{BEGIN}\nall cases\n{END}\n", encoding="utf-8")
    (tmp_path / "page.json").write_text("all answers", encoding="utf-8")
    run = CliRunner().invoke(app, words, catch_exceptions=False)
    assert "interrupted: 1 of 2 cases are done" in run.stderr
    assert len(proving.load_json(tmp_path / "page.partial.json")) == 1
    assert "all cases" in (tmp_path / "page.md").read_text(encoding="utf-8")
    assert (tmp_path / "page.json").read_text(encoding="utf-8") == "all answers"


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs an alarm")
def test_a_diagnosis_that_takes_too_long_is_asked_to_stop_and_then_made_to() -> None:
    alarm, heard = _Alarm(0.05), []

    def work() -> None:
        with alarm.set():
            for _ in range(2):
                try:
                    while True:
                        np.sin(np.arange(1000.0))
                except KeyboardInterrupt:
                    heard.append(alarm.rung)

    with pytest.raises(TimeoutError, match="not done within"):
        work()
    assert heard == [True]


def test_a_late_answer_is_judged_and_listed() -> None:
    late = answer("coulomb_friction", "coulomb_friction", late=True)
    assert score.top(late, 1)
    assert "ended by the limit" in proving.line(late)
    assert Answer.from_dict(json.loads(json.dumps(late.to_dict()))).late
    older = late.to_dict()
    del older["late"]
    assert not Answer.from_dict(older).late


def test_outside_a_checkout_it_says_so(tmp_path: Path) -> None:
    with pytest.raises(DiagnosisError, match="holds no proving ground"):
        CliRunner().invoke(app, ["prove", "--folder", str(tmp_path)], catch_exceptions=False)


def test_words_that_are_no_seeds_or_pages_are_refused(tmp_path: Path) -> None:
    assert numbers("0-2,7") == (0, 1, 2, 7)
    for text in ("a", "1-", "3-1", ""):
        with pytest.raises(DiagnosisError, match="seed"):
            numbers(text)
    (tmp_path / "page.md").write_text("no place", encoding="utf-8")
    with pytest.raises(DiagnosisError, match="does not say where"):
        page(tmp_path / "page.md", "")


def test_a_function_that_makes_no_executor_is_refused() -> None:
    for text in ("no_module_of_this_name:make", "json:make", "json", ":make", ""):
        with pytest.raises(DiagnosisError, match="write module:function"):
            _maker(text)
