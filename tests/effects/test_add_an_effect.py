"""The page that adds an effect, taken literally: each block goes where its sentence says, in a copy of the sources."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from places import ROOT

PAGE = ROOT / "docs" / "add_an_effect.md"
WRITE = re.compile(r"^Write `(?P<path>[^`]+)`:\n\n```\w+\n(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL)
INSERT = re.compile(
    r"^In `(?P<path>[^`]+)`, after `(?P<line>[^`]+)`:\n\n```\w+\n(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL
)
#: What the steps touch, and what a build and a run of the tests of the effect need.
PARTS = ("Cargo.toml", "Cargo.lock", "benches", "crates", "python", "docs", "examples", "tests", "pyproject.toml")


def follow(folder: Path) -> list[Path]:
    """Take the steps of the page in a folder, and tell the files that they touch."""
    page, touched = PAGE.read_text(encoding="utf-8"), []
    for step in WRITE.finditer(page):
        path = folder / step["path"]
        assert not path.exists(), path
        path.write_text(step["code"], encoding="utf-8")
        touched.append(path)
    for step in INSERT.finditer(page):
        path, line = folder / step["path"], step["line"] + "\n"
        text = path.read_text(encoding="utf-8")
        assert text.count("\n" + line) == 1, f"{step['path']} has to hold this line once: {step['line']}"
        path.write_text(text.replace("\n" + line, "\n" + line + step["code"]), encoding="utf-8")
        touched.append(path)
    return touched


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """The sources without what was built."""
    leave = shutil.ignore_patterns("target", "__pycache__", "*.so", "*.pyd", ".*")
    for part in PARTS:
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, tmp_path / part, ignore=leave)
        else:
            shutil.copy(source, tmp_path / part)
    return tmp_path


def test_each_step_finds_its_place(copy: Path) -> None:
    touched = follow(copy)
    assert len(touched) == 10
    for path in touched:
        if path.suffix == ".py":
            compile(path.read_text(encoding="utf-8"), str(path), "exec")


@pytest.mark.nightly
def test_the_steps_give_an_effect(copy: Path) -> None:
    """Built beside what is built already, so that only the crates of vpm are compiled."""
    follow(copy)
    own = {**os.environ, "CARGO_TARGET_DIR": str(ROOT / "target"), "PYO3_PYTHON": sys.executable}

    def run(*command: str, **more: str) -> None:
        done = subprocess.run(command, cwd=copy, env={**own, **more}, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr

    run("cargo", "test", "--package", "vpm-core", "--test", "all", "recording")
    run("cargo", "build", "--release", "--package", "vpm-py", "--features", "extension-module")
    shutil.copy(ROOT / "target" / "release" / "lib_core.so", copy / "python" / "vpm" / "_core.abi3.so")
    run(sys.executable, "docs/figures/effects.py", PYTHONPATH=str(copy / "python"))
    tests = [
        "tests/effects/test_eddy_brake.py",
        "tests/effects/test_one_file_an_effect.py",
        "tests/effects/test_one_effect_more.py",
        "tests/effects/test_catalogue.py",
        "tests/proving/test_blind_generators.py::test_names_of_known_effects_are_those_of_the_catalogue",
    ]
    run(sys.executable, "-m", "pytest", "-q", *tests, PYTHONPATH=str(copy / "python"))
