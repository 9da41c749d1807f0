"""How commands speak: one JSON document of what they found, less with --quiet, more with --verbose."""

import json
import math
import re
import subprocess
import sys
import warnings
from collections.abc import Mapping
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import typer

import vpm
from brick import bar_archive
from command_line import ran
from command_line import vpm as command
from places import EXAMPLES, ROOT
from vpm import info_command
from vpm.cli import app
from vpm.command_output import console
from vpm.demo import MODEL, TRAIN
from vpm.errors import ValidityWarning
from vpm.json_values import plain

BAND = ("--channel", "motor.command", "--unit", "A", "--band", "1", "20", "--period", "1", "--time-step", "0.01")
LIMITS = "[shoulder]\nposition = [-1.5, 1.5]\nspeed = 3.0\nacceleration = 15.0\n"
TURN = (
    'task = "turn"\nminimise = "energy"\nduration = 1.0\nintervals = 5\n[end]\nrest = true\n"shoulder.position" = 0.5\n'
)
LOG = "short.csv"

#: Words behind each command; files are in the folder that it runs in.
CASES: dict[str, tuple[str | Path, ...]] = {
    "info": (MODEL,),
    "simulate": (MODEL, LOG, "--out", "run.npz"),
    "compare": (MODEL, LOG),
    "check": (MODEL, LOG, "--workers", "1"),
    "identify": (MODEL, LOG, "--free", "arm.mass", "--no-check", "--validate", LOG, "--profile", "arm.mass"),
    "diagnose": (MODEL, LOG, "--effect", "coulomb_friction", "--no-check", "--workers", "1", "--out", "found"),
    "report": ("found/diagnosis.npz",),
    "rank": (MODEL, LOG, "--most", "1", "--workers", "1"),
    "prove": ("--answers", "answers.json", "--folder", ROOT / "tests"),
    "climb": (MODEL, LOG, "--validate", LOG),
    "simplify": (MODEL, LOG, "--tolerance", "0.5"),
    "budget": (MODEL, "--steps", "2000", "--latency", "0"),
    "compile": (MODEL, "--c", "c"),
    "optimise": (MODEL, "turn.toml"),
    "linkage": (EXAMPLES / "karl" / "karl.toml",),
    "study": ("carton", "--mesh", "1"),
    "view": (MODEL, "--page", "arm.html"),
    "import": (EXAMPLES / "robots" / "arm.urdf", "-o", "robot.toml"),
    "export": ("robot.toml", "--urdf", EXAMPLES / "robots" / "arm.urdf", "-o", "back.urdf"),
    "reduce": ("bar.npz", "--modes", "2", "--out", "link.npz"),
    "demo": ("--list",),
    "excite multisine": (*BAND, "--peak", "2"),
    "excite chirp": (*BAND, "--peak", "2"),
    "excite noise": (*BAND, "--rms", "0.5"),
    "excite fourier": (MODEL, "limits.toml", "--period", "2", "--time-step", "0.01", "--evaluations", "5"),
}


#: Commands whose case reads what that of another one writes.
AFTER = {"report": "diagnose", "export": "import"}


def names(group: typer.Typer, before: str = "") -> list[str]:
    """All commands, in words."""
    found = [one.name or one.callback.__name__.strip("_") for one in group.registered_commands if one.callback]
    for sub in group.registered_groups:
        found += names(sub.typer_instance, f"{sub.name} ") if sub.typer_instance and sub.name else []
    return [before + name for name in found]


def strict(text: str) -> dict[str, object]:
    """One document of JSON as the standard has it: Python's own reader takes NaN too."""

    def refuse(name: str) -> object:
        raise AssertionError(f"{name} is not JSON")

    document = json.loads(text, parse_constant=refuse)
    assert isinstance(document, dict)
    return document


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("manner")
    (place / LOG).write_text("\n".join(TRAIN.read_text(encoding="utf-8").splitlines()[:2002]), encoding="utf-8")
    (place / "turn.toml").write_text(TURN, encoding="utf-8")
    (place / "limits.toml").write_text(LIMITS, encoding="utf-8")
    answers = json.loads((ROOT / "docs" / "proving_ground.json").read_text(encoding="utf-8"))
    (place / "answers.json").write_text(json.dumps(answers[:20]), encoding="utf-8")
    bar_archive(place / "bar.npz")
    return place


def documented() -> dict[str, set[str]]:
    """What the page says that each command's result holds."""
    page = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")
    rows = re.findall(r"^- `([a-z ]+)`: ((?:`\w+`(?:, )?)+);", page, re.MULTILINE)
    return {name: set(re.findall(r"`(\w+)`", keys)) for name, keys in rows}


def test_every_command_has_a_case_and_a_line_on_the_page() -> None:
    assert sorted(CASES) == sorted(names(app))
    assert {name.split()[0] for name in CASES} == set(documented())


@pytest.mark.parametrize("name", CASES)
def test_every_command_writes_one_document(name: str, folder: Path) -> None:
    if name == "optimise":
        pytest.importorskip("casadi", reason="CasADi is not installed")
    if name in AFTER and not (folder / CASES[name][0]).exists():  # asked for alone
        command(*AFTER[name].split(), *CASES[AFTER[name]], cwd=folder)
    done = ran(*name.split(), *CASES[name], "--json", cwd=folder)
    document = strict(done.stdout)
    assert list(document) == ["schema", "vpm", "command", "result", "text", "files", "notes"]
    assert (document["schema"], document["vpm"], document["command"]) == (1, vpm.__version__, name)
    result = document["result"]
    assert isinstance(result, dict)
    assert set(result) <= documented()[name.split(maxsplit=1)[0]]
    assert result
    assert len(done.stdout) < 400_000
    files = document["files"]
    assert isinstance(files, list)
    assert all((folder / file).is_file() for file in files)
    assert bool(files) == (
        name in {"simulate", "diagnose", "report", "compile", "view", "import", "export", "reduce"}
        or name.startswith("excite")
    )


def test_numbers_in_the_document_are_those_of_the_result(folder: Path) -> None:
    document = strict(command("compare", MODEL, LOG, "--json", cwd=folder).stdout)
    model = vpm.Model.load(MODEL)
    record = vpm.Experiment.load(folder / LOG, model=model)
    found = vpm.compare(vpm.simulate(model, record, "inverse_dynamics"), record)
    assert isinstance(document["result"], dict)
    told = document["result"]["comparison"]["channels"][0]
    assert (told["channel"], told["rmse"]) == (found.channels[0].channel, found.channels[0].rmse)
    assert {"time", "measured", "simulated"}.isdisjoint(told)


@pytest.mark.parametrize(
    ("words", "code", "facts"),
    [
        (("info", "none.toml"), 1, {"kind": "ModelError", "path": "none.toml", "where": None}),
        (("compare", MODEL, "none.csv"), 1, {"kind": "ExperimentError"}),
        (("info", "--no-such"), 2, {"kind": "UsageError"}),
        (("simulate",), 2, {"kind": "UsageError"}),
        (("info", "-q", "-v"), 1, {"kind": "VpmError"}),
    ],
)
def test_errors_are_data_with_the_same_exit_code(
    words: tuple[str | Path, ...], code: int, facts: Mapping[str, object], tmp_path: Path
) -> None:
    plainly = command(*words, cwd=tmp_path)
    done = command(*words, "--json", cwd=tmp_path)
    assert (plainly.returncode, done.returncode) == (code, code)
    error = strict(done.stdout)["error"]
    assert isinstance(error, dict)
    assert facts.items() <= error.items()
    assert str(error["message"]).splitlines()[0] in plainly.stderr.replace("\n", " ") or code == 2
    assert plainly.stdout == ""


def test_ctrl_c_is_an_error_in_the_document() -> None:
    with patch.object(info_command, "load_model", side_effect=KeyboardInterrupt):
        done = command("info", MODEL, "--json")
    assert strict(done.stdout)["error"] == {"kind": "Interrupted", "message": "stopped by Ctrl-C"}
    assert (done.returncode, done.stderr) == (130, "stopped by Ctrl-C\n")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is full")
def test_a_document_that_cannot_be_written_is_one_sentence() -> None:
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        words = [sys.executable, "-m", "vpm", "info", "--json"]
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert re.fullmatch(r"error: standard output cannot be written \(.*\); send it elsewhere\n", done.stderr)


def test_what_libraries_print_stays_out_of_the_document(tmp_path: Path) -> None:
    with patch.object(info_command, "load_model", side_effect=lambda _: print("chatter")):
        done = command("info", MODEL, "--json", cwd=tmp_path)
    assert "chatter" in done.stderr
    error = strict(done.stdout)["error"]
    assert isinstance(error, dict)
    assert error["kind"] == "AttributeError"


@pytest.mark.parametrize("flag", ["", "--verbose"])
def test_an_unexpected_error_is_a_sentence_and_its_place_on_request(flag: str) -> None:
    with patch.object(info_command, "load_model", side_effect=KeyError("axis")):
        done = command("info", MODEL, *filter(None, [flag]))
    assert done.returncode == 1
    assert "error: vpm met an unexpected KeyError ('axis')" in done.stderr
    assert ("Traceback" in done.stderr) == (flag == "--verbose")


def test_quiet_says_results_only_and_verbose_says_when(folder: Path) -> None:
    words = ("excite", "multisine", *BAND, "--peak", "2")
    usual, quiet, full = (command(*words, *flag, cwd=folder) for flag in ((), ("-q",), ("-v",)))
    assert "crest factor" in usual.stderr
    assert "wrote excitation.csv" in usual.stdout
    assert (quiet.returncode, quiet.stderr) == (0, "")
    assert quiet.stdout == usual.stdout.replace("wrote excitation.csv\n", "")
    assert full.stdout == usual.stdout
    assert re.search(r"\[ +\d+\.\d\d s\] .*crest factor", full.stderr)
    assert f"vpm {vpm.__version__}, Python" in full.stderr
    assert "excite multisine took" in full.stderr


def test_flags_stand_before_a_command_too_and_end_with_it(folder: Path) -> None:
    assert strict(command("--json", "info").stdout)["result"] == {"version": vpm.__version__, "plugins": []}
    assert command("info").stdout == f"vpm {vpm.__version__}\n"
    assert strict(command("--json", "simulate", MODEL, LOG, "--plot", "-q", cwd=folder).stdout)["files"] == [
        "short.png"
    ]


def test_warnings_are_notes_in_one_sentence_once() -> None:
    warning = ValidityWarning("link", 0.4, 1.0, 0.2, "linear")

    def warned(_: Path) -> None:
        warnings.warn(warning, stacklevel=1)
        warnings.warn(warning, stacklevel=1)
        raise vpm.VpmError("that is all")

    with patch.object(info_command, "load_model", side_effect=warned):
        done = command("info", MODEL, "--json")
        quiet = command("info", MODEL, "--quiet")
    assert strict(done.stdout)["notes"] == [f"warning: {warning}"]
    assert done.stderr.splitlines() == [f"warning: {warning}", "error: that is all"]
    assert quiet.stderr == "error: that is all\n"


def test_whatever_a_result_holds_becomes_json() -> None:
    value = {
        "a": np.array([1.0, np.nan, np.inf]),
        "b": np.float32(0.5),
        "c": (np.int64(3), 1 + 2j),
        "d": Path("x"),
        4: {True},
    }
    told = plain(value)
    assert told == {"a": [1.0, None, None], "b": 0.5, "c": [3, [1.0, 2.0]], "d": "x", "4": [True]}
    assert strict(json.dumps({"told": told}, allow_nan=False))
    assert plain(-math.inf) is None


def test_a_process_of_its_own_writes_a_document_whatever_the_terminal_can_show(tmp_path: Path) -> None:
    text = MODEL.read_text(encoding="utf-8").replace('name = "', 'name = "größer ', 1)
    (tmp_path / "model.toml").write_text(text, encoding="utf-8")
    words = [sys.executable, "-m", "vpm", "info", "model.toml", "--json"]
    done = subprocess.run(words, cwd=tmp_path, env={"PYTHONIOENCODING": "ascii"}, capture_output=True, check=True)
    result = strict(done.stdout.decode("ascii"))["result"]
    assert isinstance(result, dict)
    assert result["name"].startswith("größer")
    assert not console.is_terminal
