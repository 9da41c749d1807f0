"""Wheels from dist/: of these sources and for this machine, or none; recipes say what pyproject says."""

import platform
import re
import sys
import tomllib
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

from places import ROOT, script

MACHINES = ("x86_64", "aarch64", "arm64", "amd64")


@pytest.fixture(scope="module")
def sources() -> ModuleType:
    return script(ROOT / "release" / "sources.py", "release_sources")


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A checkout in small."""
    for name in ("Cargo.toml", "crates/vpm-core/src/lib.rs", "python/vpm/model/a.py", "python/vpm/demo/train.csv"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(f"{name}\n", encoding="utf-8")
    (tmp_path / "dist").mkdir()
    return tmp_path


def wheel(folder: Path, tags: str, stamp: str | None) -> Path:
    path = folder / f"vpm_dynamics-0.1.0-{tags}.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("vpm/__init__.py", "")
        if stamp is not None:
            archive.writestr("vpm/sources.txt", stamp + "\n")
    return path


def tags_here() -> str:
    system = {"linux": "manylinux_2_17", "darwin": "macosx_11_0", "win32": "win"}[sys.platform]
    return f"cp311-abi3-{system}_{platform.machine().lower()}"


def test_a_wheel_of_these_sources_is_taken_and_a_stale_one_never(sources: ModuleType, tree: Path) -> None:
    assert sources.fitting(tree / "dist", tree) is None
    made = wheel(tree / "dist", tags_here(), sources.digest(tree))
    assert sources.fitting(tree / "dist", tree) == made
    for name in ("crates/vpm-core/src/lib.rs", "python/vpm/model/a.py", "python/vpm/demo/train.csv"):
        text = (tree / name).read_text(encoding="utf-8")
        (tree / name).write_text(text + "# more\n", encoding="utf-8")
        assert sources.fitting(tree / "dist", tree) is None, name
        (tree / name).write_text(text, encoding="utf-8")
    (tree / "python/vpm/model/a.py").rename(tree / "python/vpm/model/b.py")
    assert sources.fitting(tree / "dist", tree) is None
    (tree / "python/vpm/model/b.py").rename(tree / "python/vpm/model/a.py")
    assert sources.fitting(tree / "dist", tree) == made


def test_every_crate_of_the_wheel_counts(sources: ModuleType) -> None:
    bindings = ROOT / "crates" / "vpm-py"
    with (bindings / "Cargo.toml").open("rb") as file:
        needed = [each["path"] for each in tomllib.load(file)["dependencies"].values() if "path" in each]
    counted = set(sources.files())
    assert needed
    assert [path for path in needed if (bindings / path / "src" / "lib.rs").resolve() not in counted] == []


def test_what_is_made_from_sources_does_not_count(sources: ModuleType, tree: Path) -> None:
    before = sources.digest(tree)
    (tree / "python/vpm/_core.abi3.so").write_bytes(b"core")
    (tree / "python/vpm/sources.txt").write_text("number", encoding="utf-8")
    (tree / "python/vpm/__pycache__").mkdir()
    (tree / "python/vpm/__pycache__/a.pyc").write_bytes(b"compiled")
    assert sources.digest(tree) == before


def test_a_wheel_for_another_machine_or_without_a_stamp_or_broken_is_not_taken(sources: ModuleType, tree: Path) -> None:
    number, here = sources.digest(tree), tags_here()
    other = next(name for name in ("aarch64", "x86_64") if name != platform.machine())
    wheel(tree / "dist", here.replace(platform.machine().lower(), other), number)
    wheel(tree / "dist", here.replace("cp311", "cp399"), number)
    wheel(tree / "dist", "py3-none-any", number)
    wheel(tree / "dist", here, None)
    assert sources.fitting(tree / "dist", tree) is None
    wheel(tree / "dist", here, "0" * 64)
    assert sources.fitting(tree / "dist", tree) is None
    (tree / "dist" / f"vpm_dynamics-0.1.0-{here}.whl").write_bytes(b"no archive")
    assert sources.fitting(tree / "dist", tree) is None


def test_the_recipe_has_the_version_and_the_libraries_of_the_package() -> None:
    recipe = (ROOT / "conda" / "recipe.yaml").read_text(encoding="utf-8")
    cargo = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f'version: "{cargo["workspace"]["package"]["version"]}"' in recipe
    run = recipe.split("  run:\n")[1].split("\ntests:")[0]
    asked = [line.strip(" -").replace(" ", "") for line in run.strip().splitlines()]
    assert asked == [f"python{project['requires-python']}", *project["dependencies"]]


def test_the_workflow_runs_what_there_is() -> None:
    workflow = (ROOT / ".github" / "workflows" / "release.yml").read_text(encoding="utf-8")
    named = re.findall(r"(?:tests|release)/[\w/]+\.py", workflow)
    assert len(named) >= 5
    assert all((ROOT / name).is_file() for name in named)
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert all(f"\n{target}:" in makefile for target in re.findall(r"make (\w+)", workflow))
