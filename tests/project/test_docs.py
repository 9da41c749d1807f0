"""Every block of code in the documents is run, so that none can rot.

Python blocks of one page share their names and run from top to bottom, in a folder of their own that holds a copy of
``examples``. Blocks of TOML are read, whole models are loaded; those of Rust are compiled by
``tests/effects/test_add_an_effect.py``. In console blocks, lines that start with ``$ vpm`` are
run through the command line, and ``$ make`` has to name a command of the Makefile.
"""

import re
import shlex
import shutil
import tomllib
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import pytest
from typer.testing import CliRunner

import vpm
from places import ROOT
from vpm.catalogue import EFFECTS, EffectType
from vpm.cli import app

LANGUAGES = {"console", "python", "rust", "text", "toml"}
FENCE = re.compile(r"^```(?P<language>\S*)[ \t]*\n(?P<code>.*?)^```[ \t]*$", re.MULTILINE | re.DOTALL)


class Block(NamedTuple):
    """One fenced block: its language, its text and the line of the page that it starts at."""

    language: str
    code: str
    line: int


def blocks(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    return [
        Block(found["language"], found["code"], text.count("\n", 0, found.start("code")) + 1)
        for found in FENCE.finditer(text)
    ]


def pages() -> list[Path]:
    return sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/**/*.md")])


def run_python(block: Block, page: Path, names: dict[str, object]) -> None:
    # As many empty lines in front as the page has, so that a traceback gives the page's line numbers.
    source = "\n" * (block.line - 1) + block.code
    exec(compile(source, str(page), "exec"), names)


def run_toml(block: Block) -> None:
    document = tomllib.loads(block.code)
    if {"gravity", "bodies", "joints"} <= set(document):
        vpm.Model.from_toml(block.code)


def run_console(block: Block, page: Path) -> None:
    for offset, line in enumerate(block.code.splitlines()):
        where = f"{page.name}, line {block.line + offset}: {line}"
        if line.startswith("$ vpm "):
            done = CliRunner().invoke(app, shlex.split(line)[2:])
            assert done.exit_code == 0, f"{where}\n{done.output}\n{done.exception!r}"
        elif line.startswith("$ make "):
            makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
            target = shlex.split(line, comments=True)[2]
            assert re.search(rf"^{re.escape(target)}:", makefile, re.MULTILINE), where


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.relative_to(ROOT).as_posix())
def test_blocks_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "Agg")
    if (ROOT / "examples").is_dir():
        shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "__main__"}
    for block in blocks(page):
        assert block.language in LANGUAGES, f"{page.name}, line {block.line}: a block is one of {sorted(LANGUAGES)}"
        if block.language == "python":
            run_python(block, page, names)
        elif block.language == "toml":
            run_toml(block)
        elif block.language == "console":
            run_console(block, page)


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page: Path) -> None:
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    targets = [target.partition("#")[0] for target in re.findall(r"\]\(([^)\s]+)\)", text)]
    local = [target for target in targets if target and "://" not in target]
    assert [target for target in local if not (page.parent / target).exists()] == []


def test_the_front_page_shows_code() -> None:
    languages = [block.language for block in blocks(ROOT / "README.md")]
    assert languages.count("console") >= 2
    assert "python" in languages


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=lambda effect: effect.name)
def test_a_law_stands_with_its_source_on_the_page_of_the_catalogue(effect: EffectType) -> None:
    """The page is written from the effect's own file; no table of the physics repeats it."""
    page, physics = ((ROOT / "docs" / name).read_text(encoding="utf-8") for name in ("catalogue.md", "physics.md"))
    section = page.split(f"\n## {effect.name}\n", 1)[1].split("\n## ", 1)[0]
    source = (import_module(f"vpm.catalogue.effects.{effect.name}").__doc__ or "").partition("\nSource: ")[2]
    assert effect.law
    assert source
    assert f": `{effect.law}` ({source.strip().removesuffix('.')})\n" in section
    assert f"| `{effect.name}` |" not in physics
