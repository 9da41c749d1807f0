"""Effects, readers and importers of other packages, made in a folder as an installer leaves them."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import vpm
from command_line import vpm as command
from vpm.catalogue import EFFECTS, effect_type
from vpm.catalogue.entries import Catalogue
from vpm.demo import MODEL, TRAIN
from vpm.errors import ExperimentError, ModelError, PluginWarning
from vpm.plugins import PluginError, forget, plugins

POINTS = """
[vpm.effects]
rolling_drag = rolling:DRAG
torn = nothing_there:EFFECT
misdescribed = rolling:WRONG
coulomb_friction = rolling:DRAG

[vpm.readers]
roll = rolling:read
lame = nothing_there:read
csv = rolling:read
empty = rolling:nothing

[vpm.importers]
robo = rolling:robot
"""
CODE = """
import json
from pathlib import Path
from vpm.experiment.readers import open_log
Path(__file__).with_name("imported").touch()
DRAG = {"law": "-drag*v**3", "sizes": {"drag": "{E} s^3/{C}^3"}, "sentence": "{at} drags by {drag}."}
WRONG = {"law": "-drag*v", "size": {}}
def read(path):
    return open_log(Path(path).with_suffix(".csv"))
def nothing(path):
    return None
def robot(path):
    return json.loads(Path(path).read_text())
"""


def package(folder: Path, name: str, points: str) -> None:
    """A package's record, as an installer writes it."""
    record = folder / f"{name}-1.0.dist-info"
    record.mkdir(parents=True)
    (record / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
    (record / "entry_points.txt").write_text(points, encoding="utf-8")


@pytest.fixture
def rolling(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of a package that offers all kinds, some of them broken."""
    package(tmp_path, "rolling", POINTS)
    (tmp_path / "rolling.py").write_text(CODE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    forget()
    yield tmp_path
    sys.modules.pop("rolling", None)
    forget()


def test_an_effect_is_imported_when_it_is_asked_for_and_no_earlier(rolling: Path) -> None:
    catalogue = Catalogue()
    assert "coulomb_friction" in catalogue
    assert "nonsense" not in catalogue
    assert next(iter(catalogue.values())).name in EFFECTS
    assert not (rolling / "imported").exists()
    assert catalogue["rolling_drag"].title == "rolling drag"
    assert (rolling / "imported").exists()
    assert catalogue["coulomb_friction"].formula is None


def test_broken_and_colliding_effects_are_told_once_and_the_others_work(rolling: Path) -> None:
    catalogue = Catalogue()
    with pytest.warns(PluginWarning) as told:
        names = list(catalogue)
    assert names == [
        *(name for name in EFFECTS if name in catalogue.entries and name != "rolling_drag"),
        "rolling_drag",
    ]
    assert list(catalogue) == names
    sentences = sorted(str(one.message) for one in told)
    assert len(sentences) == 3
    assert sentences[0].startswith("the effect coulomb_friction of the package rolling 1.0 is refused, because vpm has")
    assert sentences[1].startswith(
        "the effect misdescribed of the package rolling 1.0 is not described by the arguments"
    )
    assert sentences[2] == (
        "the effect torn of the package rolling 1.0 cannot be imported (ModuleNotFoundError: No module named "
        "'nothing_there'); update or uninstall the package"
    )
    assert rolling.exists()


def test_a_name_that_two_packages_offer_is_refused(rolling: Path) -> None:
    package(rolling / "more", "sliding", "[vpm.effects]\nrolling_drag = sliding:DRAG\n")
    sys.path.insert(0, str(rolling / "more"))
    try:
        forget()
        one = plugins("effects")["rolling_drag"]
        with pytest.raises(PluginError, match=r"rolling 1.0 is refused, because sliding 1.0 has one of this name too"):
            one.load()
    finally:
        sys.path.remove(str(rolling / "more"))


@pytest.mark.usefixtures("rolling")
def test_a_model_has_an_effect_of_a_package_and_is_told_why_not() -> None:
    """By its law: a cubic drag takes away what it takes away."""
    text = MODEL.read_text(encoding="utf-8")
    entry = '\n[[effects]]\ntype = "rolling_drag"\nat = "shoulder"\ndrag = 0.25\n'
    try:
        with_drag, without = vpm.Model.from_toml(text + entry), vpm.Model.from_toml(text)
        q, v, a = [0.3], [-1.7], [0.4]
        difference = with_drag.inverse_dynamics(q, v, a) - without.inverse_dynamics(q, v, a)
        np.testing.assert_allclose(difference, 0.25 * -(1.7**3), rtol=1e-12)
        with pytest.warns(PluginWarning), pytest.raises(ModelError, match=r"torn of the package rolling 1.0 cannot be"):
            vpm.Model.from_toml(text + entry.replace("rolling_drag", "torn"))
        with pytest.raises(ModelError, match=r"torn of the package rolling 1.0 cannot be"):
            effect_type("torn")
    finally:
        vpm.catalogue.unregister("rolling_drag")
        vpm.catalogue._CATALOGUE.troubles.clear()


@pytest.mark.filterwarnings("ignore::vpm.errors.PluginWarning")
def test_readers_of_packages_open_their_files_only(rolling: Path, tmp_path: Path) -> None:
    model = vpm.Model.load(MODEL)
    (tmp_path / "log.csv").write_bytes(TRAIN.read_bytes())
    usual = vpm.Experiment.load(tmp_path / "log.csv", model=model)
    assert not (rolling / "imported").exists()
    for ending in ("roll", "ROLL", "lame", "empty"):
        (tmp_path / f"log.{ending}").touch()
    assert vpm.Experiment.load(tmp_path / "log.roll", model=model).time.size == usual.time.size
    assert vpm.Experiment.load(tmp_path / "log.ROLL", model=model).time.size == usual.time.size
    with pytest.raises(PluginError, match=r"the reader lame of the package rolling 1.0 cannot be imported"):
        vpm.Experiment.load(tmp_path / "log.lame", model=model)
    with pytest.raises(PluginError, match=r"the reader empty of the package rolling 1.0 gave a NoneType"):
        vpm.Experiment.load(tmp_path / "log.empty", model=model)
    with pytest.raises(ExperimentError, match=r"does not exist"):
        vpm.Experiment.load(tmp_path / "none.roll", model=model)


@pytest.mark.usefixtures("rolling")
def test_importers_of_packages_give_models_to_every_command(tmp_path: Path) -> None:
    (tmp_path / "arm.robo").write_text(json.dumps(vpm.Model.load(MODEL).to_dict()), encoding="utf-8")
    (tmp_path / "torn.robo").write_text("{", encoding="utf-8")
    assert vpm.Model.load(tmp_path / "arm.robo") == vpm.Model.load(MODEL)
    done = command("info", tmp_path / "arm.robo")
    assert (done.returncode, "shoulder.friction.viscous" in done.stdout) == (0, True)
    with pytest.raises(ModelError, match=r"torn.robo cannot be imported by the importer robo of the package rolling"):
        vpm.Model.load(tmp_path / "torn.robo")
    done = command("check", tmp_path / "arm.robo", TRAIN, "--fix")
    assert "name one with --channels" in done.stderr


def test_info_lists_plugins_and_imports_none(rolling: Path) -> None:
    """In a process of its own, as a package is found there."""
    where = {**os.environ, "PYTHONPATH": str(rolling)}
    words = [sys.executable, "-m", "vpm", "info", "--json"]
    done = subprocess.run(words, env=where, capture_output=True, text=True, check=True)
    listed = json.loads(done.stdout)["result"]["plugins"]
    assert {(one["kind"], one["name"]) for one in listed if not one["refused"]} == {
        *(("effect", name) for name in ("rolling_drag", "torn", "misdescribed")),
        *(("reader", name) for name in ("roll", "lame", "empty")),
        ("importer", "robo"),
    }
    assert {one["name"] for one in listed if one["refused"]} == {"coulomb_friction", "csv"}
    assert not (rolling / "imported").exists()
    done = subprocess.run(words[:-1], env=where, capture_output=True, text=True, check=True)
    assert "  effect rolling_drag of rolling 1.0\n" in done.stdout
