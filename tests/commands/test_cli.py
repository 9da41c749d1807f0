"""The commands as a user types them: exit codes, one sentence for an error, files where they were asked for."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from command_line import ran, vpm
from interrupting import running, spent, work
from places import EXAMPLES
from sledge import SLEDGE, pushed
from vpm import __version__
from vpm.demo import MODEL, TRAIN, VALIDATION
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simulate import simulate

RIG = EXAMPLES / "servo_cylinder" / "rig.toml"
STEP = EXAMPLES / "emps" / "step.toml"
TUDOR = EXAMPLES / "tudor" / "tudor.toml"
COMMANDS = (
    *("info", "simulate", "compare", "identify", "diagnose", "rank", "report"),
    *("climb", "simplify", "budget", "compile", "demo"),
)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_with_an_example(command: str) -> None:
    done = ran(command, "--help")
    assert "Example:" in done.stdout


def test_says_its_version_and_completes_words() -> None:
    done = vpm("--version")
    assert (done.returncode, done.stdout) == (0, f"vpm {__version__}\n")
    asked = {**os.environ, "_VPM_COMPLETE": "complete_bash", "COMP_WORDS": "vpm dia", "COMP_CWORD": "1"}
    command = [str(Path(sys.executable).with_name("vpm"))]
    assert subprocess.run(command, env=asked, capture_output=True, text=True, check=True).stdout.split() == ["diagnose"]


def test_info_lists_parameters_with_units() -> None:
    """In a process of its own, as all commands run."""
    command = [sys.executable, "-m", "vpm", "info", str(MODEL)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "shoulder.friction.viscous" in done.stdout
    assert "N m s/rad" in done.stdout
    assert "long runs are machine code, made in" in done.stdout


def test_simulate_saves_and_plots(tmp_path: Path) -> None:
    ran(
        "simulate",
        MODEL,
        VALIDATION,
        "--mode",
        "closed_loop",
        "--out",
        tmp_path / "r.npz",
        "--plot",
        tmp_path / "r.svg",
    )
    assert (tmp_path / "r.npz").stat().st_size > 1000
    assert "<svg" in (tmp_path / "r.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize("words", [("FILE", "--plot"), ("--plot", "FILE"), ("FILE", "--plot", "--out", "runs.npz")])
def test_a_scenario_runs_and_its_picture_is_named_after_it(tmp_path: Path, words: tuple[str, ...]) -> None:
    done = ran("simulate", *(STEP if word == "FILE" else word for word in words), cwd=tmp_path)
    assert "3 of 3 runs" in done.stdout
    assert "axis.position" in done.stdout
    assert (tmp_path / "step.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "runs.npz").exists() == ("--out" in words)


def test_the_picture_of_a_scenario_goes_where_it_is_asked_for(tmp_path: Path) -> None:
    for words in (("--plot", "a.svg"), ("--plot=b.pdf",), ()):
        assert vpm("simulate", STEP, *words, cwd=tmp_path).returncode == 0
    assert {path.name for path in tmp_path.iterdir()} == {"a.svg", "b.pdf"}


def test_a_log_gives_its_name_to_a_picture_without_one(tmp_path: Path) -> None:
    ran("simulate", MODEL, VALIDATION, "--plot", cwd=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["validation.png"]


def test_a_run_of_a_scenario_that_fails_is_named_and_the_others_are_shown(tmp_path: Path) -> None:
    gain = (
        'set = { "servo.velocity_gain" = -1e12, "servo.limit" = 1e99 }\n'
        'with_effects = [{ type = "quadratic_drag", at = "axis", drag = 1e99 }]'
    )
    text = STEP.read_text(encoding="utf-8").replace('model = "model.toml"', f"model = '{STEP.parent / 'model.toml'}'")
    (tmp_path / "step.toml").write_text(text.replace("[[runs]]", f"[[runs]]\n{gain}", 1), encoding="utf-8")
    done = vpm("simulate", "step.toml", "--plot", cwd=tmp_path)
    assert done.returncode == 1
    assert (tmp_path / "step.png").stat().st_size > 5000
    assert "with dry friction, stiff:" in done.stdout
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith('error: step.toml: 1 of 3 runs failed: run "as modelled": ')


def test_compare_says_where_the_residual_lives() -> None:
    done = ran("compare", MODEL, VALIDATION)
    assert "of the residual's energy" in done.stdout


@pytest.mark.parametrize(
    ("machine", "drive", "size", "channels"),
    [
        (RIG, "servo", 2e-3, ("axis.position", "servo.pressure_a")),
        (TUDOR, "motor_3", 0.2, ("joint_1.position", "joint_2.position", "joint_3.position", "gauge_1.strain")),
    ],
)
def test_compare_takes_a_machine_whose_efforts_do_not_follow_from_commands(
    tmp_path: Path, machine: Path, drive: str, size: float, channels: tuple[str, ...]
) -> None:
    """Oil and links that bend have states that no log holds: short predictions compare them unless a mode is given."""
    model, time = Model.load(machine), 1e-3 * np.arange(600)
    sent = {f"{name}.command": 0.0 * time for name in model.actuators}
    log = Experiment.from_arrays(time, sent | {f"{drive}.command": size * np.sin(20.0 * time)}, model=model)
    run = simulate(model, log)
    for channel in channels:
        log = log.with_channel(channel, run[channel], model.channel_unit(channel))
    log.save(tmp_path / "log.npz")
    assert channels[-1] in ran("compare", machine, tmp_path / "log.npz").stdout


def test_machines_with_closed_loops_are_compared_by_short_predictions(tmp_path: Path) -> None:
    """Loops share efforts among their joints: one encoder is enough for predictions, and no motion tells efforts."""
    linkage = EXAMPLES / "loops" / "parallelogram.toml"
    machine, time = Model.load(linkage), 1e-3 * np.arange(800)
    log = Experiment.from_arrays(time, {"motor.command": 3.0 * np.sin(8.0 * time)}, model=machine)
    place = simulate(machine, log)["left_crank.position"]
    log.with_channel("left_crank.position", place, "rad").save(tmp_path / "log.npz")
    assert "left_crank.position" in ran("compare", linkage, tmp_path / "log.npz").stdout
    refused = vpm("identify", linkage, tmp_path / "log.npz")
    assert refused.returncode == 1
    assert "compare in the mode restarts" in refused.stderr
    assert "left_crank.friction.viscous" in ran("identify", linkage, tmp_path / "log.npz", "--mode", "restarts").stdout


def test_identify_prints_values_and_writes_the_model(tmp_path: Path) -> None:
    fitted = tmp_path / "fitted.toml"
    done = ran("identify", MODEL, TRAIN, "--free", "shoulder.friction.viscous", "--out", fitted)
    assert "shoulder.friction.viscous" in done.stdout
    assert vpm("info", fitted).returncode == 0


def test_identify_takes_the_settings_of_the_engine() -> None:
    name = "shoulder.friction.viscous"
    words = (
        "--free",
        name,
        "--mode",
        "closed_loop",
        "--substeps",
        "2",
        "--log",
        "--noise",
        "estimated",
        "--starts",
        "2",
    )
    more = (
        "--bound",
        f"{name}=1e-4:10",
        "--known-state",
        "shoulder.velocity=0",
        "--profile",
        name,
        "--bootstrap",
        "20",
    )
    done = ran("identify", MODEL, TRAIN, *words, *more, "--loss", "huber")
    for sentence in ("of 2 starts agree", "noise of shoulder.position", f"{name}, profile:", f"{name}, bootstrap:"):
        assert sentence in done.stdout
    refused = vpm("identify", MODEL, TRAIN, "--bound", f"{name}=1")
    assert refused.returncode == 1
    assert "NAME=LOW:HIGH" in refused.stderr


def test_identify_writes_a_folder_and_judges_validation_records(tmp_path: Path) -> None:
    name, folder = "shoulder.friction.viscous", tmp_path / "fitted"
    words = ("--free", name, "--free", "arm.inertia.yy", "--fix", "arm.inertia.yy", "--validate", VALIDATION)
    done = ran("identify", MODEL, TRAIN, *words, "--out", folder, "--plot", tmp_path / "fit.svg")
    assert "unseen shoulder.effort" in done.stdout
    names = {"model.toml", "parameters.csv", "report.md", "fit.npz", "fit.png"}
    assert {path.name for path in folder.iterdir()} == names
    header, row, *rest = (folder / "parameters.csv").read_text(encoding="utf-8").splitlines()
    assert header == "name,start,value,std,low,high,unit"
    assert row.startswith(name)
    assert not rest
    report = (folder / "report.md").read_text(encoding="utf-8")
    assert f"| {name} |" in report
    assert "unseen shoulder.effort" in report
    assert vpm("info", folder / "model.toml").returncode == 0
    assert (tmp_path / "fit.svg").is_file()


def test_identify_turns_a_model_round() -> None:
    words = ("--free", "shoulder.friction.viscous", "--mode", "input_error", "--horizon", "0.2")
    done = ran("identify", MODEL, TRAIN, *words)
    assert "residual motor.command" in done.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another kind")
def test_ctrl_c_keeps_the_best_of_a_fit_and_writes_it(tmp_path: Path) -> None:
    words = ["--mode", "closed_loop", "--substeps", "4", "--log", "--starts", "1000", "--workers", "1"]
    command = [sys.executable, "-m", "vpm", "identify", str(MODEL), str(TRAIN), *words, "--out", str(tmp_path / "f")]
    with running(command) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith("evaluation 1:"):
                break
        work(process, 1.0)  # some more, so that there is a best
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate()
    assert process.returncode == 130
    assert "stopped by Ctrl-C" in out
    assert (tmp_path / "f" / "model.toml").is_file()


def test_diagnose_writes_its_report(tmp_path: Path) -> None:
    ran("diagnose", MODEL, TRAIN, "--validate", VALIDATION, "--effect", "coulomb_friction", "--out", tmp_path)
    assert json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["verdict"] == "effect_found"
    assert (tmp_path / "report.html").is_file()
    assert "coulomb" in (tmp_path / "model.toml").read_text(encoding="utf-8")
    again = ran("report", tmp_path / "diagnosis.npz", "--out", tmp_path / "again")
    assert "verdict: effect_found" in again.stdout
    first, second = ((folder / "report.json").read_bytes() for folder in (tmp_path, tmp_path / "again"))
    assert first == second


def test_diagnose_leaves_effects_out_and_stops_at_a_limit(tmp_path: Path) -> None:
    tried = ("--effect", "coulomb_friction", "--effect", "spring")
    words = ("--validate", VALIDATION, *tried, "--workers", "1", "--out", tmp_path)
    done = ran("diagnose", MODEL, TRAIN, *words, "--without", "coulomb_friction")
    assert "coulomb_friction" not in done.stdout
    assert "screening 1 of " in done.stderr
    assert "coulomb_friction" not in done.stderr
    ran("diagnose", MODEL, TRAIN, *words, "--limit", "0")
    assert json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["effects"] == []


def test_rank_names_what_is_missing_and_writes_the_model(tmp_path: Path) -> None:
    (tmp_path / "sledge.toml").write_text(SLEDGE, encoding="utf-8")
    for seed in (1, 2):
        pushed(seed=seed, lag=0.008, duration=3.0).to_csv(tmp_path / f"push_{seed}.csv")
    words = ("sledge.toml", "push_1.csv", "--validate", "push_2.csv", "--most", "1", "--out", "better.toml")
    done = ran("rank", *words, cwd=tmp_path)
    assert done.stdout.startswith("1. actuator_lag at motor removes ")
    assert "way.position, validation" in done.stdout
    better = Model.load(tmp_path / "better.toml")
    assert better.parameters["motor.lag.time_constant"].value == pytest.approx(0.008, rel=0.05)
    others = ran("rank", *words[:6], "--without", "actuator_lag", cwd=tmp_path).stdout
    assert "actuator_lag" not in others
    assert others.startswith("1. input_delay at motor removes ")


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another kind")
def test_ctrl_c_reports_what_a_diagnosis_knows(tmp_path: Path) -> None:
    """One effect is found, and more are looked for: that one stands in the report and in the repaired model."""
    words = ["--validate", str(VALIDATION), "--substeps", "20", "--out", str(tmp_path), "--workers", "1"]
    for name in ("coulomb_friction", "stribeck_friction", "asymmetric_friction", "torque_ripple", "spring"):
        words += ["--effect", name]
    command = [sys.executable, "-m", "vpm", "diagnose", str(MODEL), str(TRAIN), *words]
    with running(command) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if "coulomb_friction at shoulder removes" in line:
                break
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate()
    assert process.returncode == 130
    assert "stopped by Ctrl-C" in out
    document = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert document["interrupted"] is True
    assert [(e["name"], e["site"]) for e in document["effects"]] == [("coulomb_friction", "shoulder")]
    assert "coulomb" in (tmp_path / "model.toml").read_text(encoding="utf-8")
    assert (tmp_path / "report.html").is_file()


def test_budget_exit_code_says_whether_it_holds() -> None:
    # Time enough for a busy machine, and no loop that is watched.
    assert vpm("budget", MODEL, "--steps", "5000", "--rate", "0.1", "--latency", "0").returncode == 0
    assert vpm("budget", MODEL, "--steps", "5000", "--rate", "1e9").returncode == 1


def test_simplify_leaves_out_what_does_not_matter(tmp_path: Path) -> None:
    done = ran("simplify", MODEL, VALIDATION, "--tolerance", "0.5", "--out", tmp_path / "cheap.toml")
    assert "cheapest within 50 %" in done.stdout
    assert vpm("info", tmp_path / "cheap.toml").returncode == 0


def test_demo_tells_the_story(tmp_path: Path) -> None:
    done = ran("demo", "--out", tmp_path)
    assert "verdict: effect_found" in done.stdout
    assert "coulomb_friction at shoulder; found: coulomb_friction at shoulder" in done.stdout


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("info", "nowhere.toml"), "nowhere.toml"),
        (("simulate", MODEL, "nowhere.csv"), "nowhere.csv"),
        (("simulate", MODEL, TRAIN, "--mode", "sideways"), "unknown mode 'sideways'"),
        (("simulate", MODEL), "is a model file, and a simulation needs a log with it"),
        (("simulate", STEP, TRAIN), "is a scenario, which needs no LOG"),
        (("simulate", STEP, "--mode", "free_run"), "is a scenario, which needs no --mode"),
        (("simulate", STEP, "--plot", "step.jpg"), "step.jpg is no name of a picture"),
        (("diagnose", MODEL, TRAIN, "--effect", "coulomb"), "coulomb_friction"),
        (("diagnose", MODEL, TRAIN, "--without", "coulomb"), '--without: "coulomb" is not among'),
        (("diagnose", MODEL, TRAIN, "--effect", "spring", "--without", "spring"), "leaves no effect to try"),
        (("rank", MODEL, TRAIN, "--without", "coulomb"), '--without: "coulomb" is not among'),
        (("identify", MODEL, TRAIN, "--free", "shoulder.viscous"), "shoulder.friction.viscous"),
        (("identify", MODEL, TRAIN, "--fix", "shoulder.viscous"), '--fix: "shoulder.viscous" is not among the free'),
        (("identify", MODEL, TRAIN, "--tie", "a"), "FOLLOWER=LEADER"),
        (("identify", MODEL, TRAIN, "--out", MODEL / "in"), "name another"),
        (("budget", MODEL, "--rate", "-5"), "a rate of -5 Hz"),
    ],
)
def test_errors_are_one_sentence(words: tuple[str | Path, ...], sentence: str) -> None:
    done = vpm(*words)
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("error: ")
    assert sentence in last
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "words",
    [
        ("info", "{}"),
        ("simulate", "{}"),
        ("simulate", "--plot", "{}", MODEL),
        ("simulate", STEP, "--out", "{}"),
        ("compare", MODEL, "*{}"),
        ("diagnose", MODEL, "{}"),
        ("demo", "--out", "{}"),
        ("demo", "--out", "{}/report"),
        ("prove", "--folder", "{}"),
        ("report", "{}"),
    ],
)
def test_a_name_that_no_file_can_have_is_one_sentence(words: tuple[str | Path, ...]) -> None:
    done = vpm(*(str(word).format("a" * 300) for word in words))
    assert done.returncode != 0
    assert len(done.stderr.strip().splitlines()) == 1
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another kind")
def test_interrupting_a_long_command_ends_it_at_once() -> None:
    command = [sys.executable, "-m", "vpm", "budget", str(MODEL), "--steps", "2000000000"]
    others = sum(os.times()[2:4])  # processor time of the programs of earlier tests
    with running(command) as process:
        # It is at work as soon as it tells of it.
        assert process.stderr is not None
        assert process.stderr.readline().startswith("timed ")
        before = spent(process)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate()
    assert sum(os.times()[2:4]) - others - before < 10.0
    assert process.returncode == 130
    assert "Traceback" not in err


#: A command that does something else than a command of vpm.
ANOTHER = """
import os
from vpm import cli

class Panic(BaseException): ...

def pressed():
    try:
        os.kill(os.getpid(), 2)
    except KeyboardInterrupt as reason:
        raise Panic from reason

def panic():
    raise Panic("index out of bounds")

cli.app = lambda: {command}
cli.main()
"""


def another(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    (folder / "another.py").write_text(ANOTHER.format(command=command))
    return subprocess.run(
        [sys.executable, "-m", "another"], cwd=folder, capture_output=True, text=True, check=False, timeout=60
    )


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another kind")
@pytest.mark.parametrize("command", ["exec('raise KeyboardInterrupt')", "pressed()"])
def test_what_libraries_make_of_ctrl_c_ends_with_its_exit_code(command: str, tmp_path: Path) -> None:
    """Python kills itself where Ctrl-C comes in `exec`, as libraries call it; a panic is no `Exception`."""
    done = another(command, tmp_path)
    assert (done.returncode, done.stderr) == (130, "stopped by Ctrl-C\n")


def test_a_panic_of_the_core_is_one_sentence(tmp_path: Path) -> None:
    done = another("panic()", tmp_path)
    assert done.returncode == 1
    assert done.stderr.startswith("error: vpm met an unexpected Panic (index out of bounds)")
