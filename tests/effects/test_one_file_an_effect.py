"""An effect is one file of the catalogue: nothing else in the package decides by its name."""

import ast
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import pytest
from pydantic import BaseModel

import vpm
from vpm import model
from vpm.catalogue import EFFECTS, effects
from vpm.catalogue.effects import BUILT_IN, ORDER

PACKAGE = Path(vpm.__file__).parent
FILES = sorted((PACKAGE / "catalogue" / "effects").glob("[!_]*.py"))
NAMES = frozenset(effect.name for effect in BUILT_IN)
#: What a file may say of other effects: relations.
RELATIONS = frozenset({"requires", "contains", "confused_with"})
#: Folders in which a word may be a field of a component of the model file, as ``rotor_inertia`` of a joint is.
MODEL_FILE = frozenset({"model", "robots", "scenario"})
#: Folders in which a dotted name may be that of an effect's parameter: where the model file becomes the description
#: that the core reads, and where the demo and studies say by which parameters a model knows its machine.
PARAMETERS = frozenset({"model", "scenario", "demo", "studies"})
LONGEST = 200


def quoted(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Strings of a program with their lines, but for those that stand alone: these are documentation."""
    alone = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in alone:
            yield node.lineno, node.value


def fields_of_the_model_file() -> frozenset[str]:
    """Keys of the components of a model file, such as ``rotor_inertia`` of a joint."""
    for found in iter_modules(model.__path__, f"{model.__name__}."):
        import_module(found.name)
    kinds, asked = set[type[BaseModel]](), [BaseModel]
    while asked:
        fresh = [kind for kind in asked.pop().__subclasses__() if kind not in kinds]
        kinds.update(fresh)
        asked += fresh
    own = (kind for kind in kinds if kind.__module__.startswith(model.__name__))
    return frozenset(key for kind in own for key in kind.model_fields)


def decides(path: Path, fields: frozenset[str]) -> list[str]:
    """Lines of a file that quote an effect's name, but for sentences, which are for readers."""
    folder = path.relative_to(PACKAGE).parts[0]
    found = []
    for line, text in quoted(ast.parse(path.read_text(encoding="utf-8"))):
        if " " in text.strip():
            continue
        dotted = "." in text
        names = set(text.split(".")) & NAMES
        if dotted or folder in MODEL_FILE:
            names -= fields
        if not (dotted and folder in PARAMETERS):
            found += [f"{path.relative_to(PACKAGE)}:{line}: {name}" for name in sorted(names)]
    return found


def test_nothing_outside_of_the_catalogue_decides_by_the_name_of_an_effect() -> None:
    """It asks for a trait, see `vpm.catalogue.traits`."""
    fields = fields_of_the_model_file()
    assert fields & NAMES == {"rotor_inertia", "internal_leakage"}
    files = (path for path in sorted(PACKAGE.rglob("*.py")) if path.relative_to(PACKAGE).parts[0] != "catalogue")
    found = [line for path in files for line in decides(path, fields)]
    assert not found, "\n".join(found)


def test_every_effect_has_one_file_and_every_file_one_effect() -> None:
    assert sorted(ORDER) == [path.stem for path in FILES]
    assert [effect.name for effect in BUILT_IN] == list(ORDER)
    assert list(EFFECTS)[: len(ORDER)] == list(ORDER)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_file_speaks_of_its_own_effect_and_states_relations_to_others(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) < LONGEST
    tree = ast.parse(text)
    related = {
        id(node)
        for keyword in ast.walk(tree)
        if isinstance(keyword, ast.keyword) and keyword.arg in RELATIONS
        for node in ast.walk(keyword.value)
    }
    names = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in related}
    assert names & NAMES - {path.stem} == set()
    imported = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    assert not any(module.startswith(effects.__name__) for module in imported)


def test_relations_are_to_effects_of_the_catalogue() -> None:
    for effect in BUILT_IN:
        related = {*effect.confused_with, *effect.contains, *([effect.requires] if effect.requires else [])}
        assert related <= NAMES - {effect.name}
