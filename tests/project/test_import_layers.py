"""Python modules import downward only, and heavy optional libraries only where they are used.

The layers stand in pyproject.toml, where import-linter reads them too. This check needs nothing but Python, and also
covers the compiled module, which import-linter cannot see.
"""

import ast
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

import vpm
from places import ROOT

PACKAGE = ROOT / "python" / "vpm"

OPTIONAL = {
    *("asammdf", "control", "h5py", "jinja2", "matplotlib", "mcap", "nptdms", "pandas", "pyarrow", "pyulog", "rosbags"),
    "skfem",
}
"""Libraries of the extras: a plain install has none of them."""

SLOW = OPTIONAL | {"rich", "scipy.signal", "scipy.stats", "typer"}
"""What no name of ``vpm`` may load before it is called."""


class Import(NamedTuple):
    """One import statement's target, with where it stands."""

    target: str
    line: int
    at_module_level: bool


def layers() -> dict[str, int]:
    """Height of each part of the package; the lowest is 0."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    (contract,) = (contract for contract in contracts if contract["id"] == "layers")
    rows = reversed(contract["layers"])
    return {part.strip(" ()"): height for height, row in enumerate(rows) for part in row.split("|")}


def is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test) in {"TYPE_CHECKING", "typing.TYPE_CHECKING"}


def imports(nodes: Iterable[ast.AST], at_module_level: bool = True) -> Iterator[Import]:
    """All imports that can happen at run time, ``from a import b`` as ``a.b``."""
    for node in nodes:
        if is_type_checking(node):
            continue
        if isinstance(node, ast.Import):
            yield from (Import(alias.name, node.lineno, at_module_level) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (Import(f"{node.module}.{alias.name}", node.lineno, at_module_level) for alias in node.names)
        else:
            inside_function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            yield from imports(ast.iter_child_nodes(node), at_module_level and not inside_function)


def upward(part: str, found: Iterable[Import], heights: dict[str, int]) -> list[str]:
    """Sentences on the imports of `part` that do not go downward."""
    wrong = []
    for target, line, _ in found:
        root, *names = target.split(".")
        if root != "vpm" or names == ["__version__"] or names[:1] == [part]:
            continue
        if not names or names[0] not in heights:
            wrong.append(f"line {line}: {target} is taken from the package as a whole; name its module")
        elif heights[names[0]] >= heights[part]:
            wrong.append(f"line {line}: {part} may not import {names[0]}, which is not below it")
    return wrong


def modules() -> list[Path]:
    return sorted(path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py")


def part_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def found_in(path: Path) -> list[Import]:
    return list(imports(ast.parse(path.read_text(encoding="utf-8")).body))


def test_every_part_has_its_layer() -> None:
    parts = {part_of(path) for path in modules()} | {"_core"}
    assert parts == set(layers())


@pytest.mark.parametrize("path", modules(), ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_imports_go_downward(path: Path) -> None:
    assert upward(part_of(path), found_in(path), layers()) == []


@pytest.mark.parametrize("path", modules(), ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_optional_libraries_are_imported_on_use(path: Path) -> None:
    early = [found for found in found_in(path) if found.at_module_level and found.target.split(".")[0] in OPTIONAL]
    assert early == []


def test_demo_log_is_made_without_vpm() -> None:
    """But for the names of what is hidden, which the catalogue gives."""
    own = ("generate", "hidden", "machine")
    used = {found.target for name in own for found in found_in(PACKAGE / "demo" / f"{name}.py")}
    among = (*(f"vpm.demo.{name}." for name in own), "vpm.catalogue.SiteKind", "vpm.catalogue.effects_for_site")
    assert [target for target in used if target.startswith("vpm") and not target.startswith(among)] == []


def loaded_by(program: str) -> set[str]:
    """Names of the modules that are there after a program, in an interpreter of its own."""
    program += "\nimport sys; print('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


def test_import_vpm_loads_nothing_but_what_python_has() -> None:
    # Besides the standard library, what the interpreter of an editable installation loads by itself.
    added = loaded_by("import vpm") - loaded_by("pass")
    assert {name.split(".")[0] for name in added} - sys.stdlib_module_names == {"vpm"}


def test_a_simulation_needs_no_scipy() -> None:
    added = loaded_by("from vpm import Experiment, Model, Scenario, compare, simulate")
    assert "vpm.simulate.run" in added
    assert not any(name.split(".")[0] == "scipy" for name in added)


def test_names_of_vpm_are_light() -> None:
    added = loaded_by("from vpm import *")
    assert "vpm.discrepancy" in added
    assert SLOW & added == set()


def test_the_tool_works_without_the_studies() -> None:
    # Also where the name of a study stands in a text, which the layers do not see.
    parts = sorted({part_of(path) for path in modules()} - {"impedance", "linkages", "studies"})
    added = loaded_by("import " + ", ".join(f"vpm.{part}" for part in parts))
    assert "vpm.simplify.learnt" in added
    assert not any(name.startswith("vpm.studies") for name in added)


def test_names_of_vpm_are_those_that_type_checkers_see() -> None:
    body = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8")).body
    (block,) = (node for node in body if is_type_checking(node) and isinstance(node, ast.If) and not node.orelse)
    seen = {alias.name: n.module for n in block.body if isinstance(n, ast.ImportFrom) for alias in n.names}
    homes = {name: vpm._HOMES.get(name, "vpm") for name in vpm.__all__}
    assert homes == {**seen, "__version__": "vpm"}
    assert vpm._HOMES.keys() <= homes.keys() <= set(dir(vpm))


def test_names_that_vpm_has_not() -> None:
    with pytest.raises(AttributeError, match="module 'vpm' has no attribute 'simulation'"):
        vpm.simulation  # type: ignore[attr-defined] # noqa: B018
    assert not hasattr(vpm, "__wrapped__")


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        ("import vpm.report", "line 1: model may not import report, which is not below it"),
        ("from vpm.model import Model", ""),
        ("def f():\n    from vpm import simulate", "line 2: model may not import simulate, which is not below it"),
        ("if TYPE_CHECKING:\n    from vpm import simulate", ""),
        ("from vpm import Experiment", "line 1: vpm.Experiment is taken from the package as a whole; name its module"),
        ("from vpm import _core, errors", ""),
        ("from vpm import __version__", ""),
    ],
)
def test_the_check_sees(source: str, sentence: str) -> None:
    heights = {"_core": 0, "errors": 1, "model": 2, "simulate": 3, "report": 4}
    assert upward("model", imports(ast.parse(source).body), heights) == ([sentence] if sentence else [])


def test_the_check_tells_module_level_from_function_level() -> None:
    source = "import numpy\nclass A:\n    import pandas\n    def f(self):\n        import matplotlib.pyplot as plt"
    found = [(item.target, item.at_module_level) for item in imports(ast.parse(source).body)]
    assert found == [("numpy", True), ("pandas", True), ("matplotlib.pyplot", False)]


def test_functions_keep_their_names_beside_modules_of_the_same_name() -> None:
    # Importing a module binds it in its package under its own name, where a function may stand already, or come later.
    parts = sorted({part_of(path) for path in modules()} - {"__main__", "cli"})
    program = f"""
import importlib, vpm
for part in {parts}:
    importlib.import_module("vpm." + part)
for name in vpm.__all__:
    if name.islower() and name not in {{"__version__", "impedance", "linkages", "narx", "realtime"}}:
        assert callable(getattr(vpm, name)), name
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
