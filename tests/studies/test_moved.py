"""Studies that stood among the tool keep their public names, and files that older versions wrote are read."""

import json
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import vpm
from places import EXAMPLES
from vpm import identify, narx, results
from vpm.errors import VpmError
from vpm.results import Result
from vpm.studies import impedance, linkages, maxwell, oil

KARL = EXAMPLES / "karl" / "karl.toml"

#: Classes in files of older versions: the modules as they were then.
OLDER = {
    "vpm.identify.oil_equations": ("CylinderGeometry",),
    "vpm.identify.oil_fit": ("OilFit",),
    "vpm.impedance.decay": ("Decay", "LogarithmicDecrement"),
    "vpm.impedance.hysteresis_loop": ("Loop",),
    "vpm.impedance.impact": ("ImpulseBalance", "Stop"),
    "vpm.impedance.landing": ("Landing",),
    "vpm.impedance.loss": ("LossLaw",),
    "vpm.impedance.repeated": ("ImpedanceTable", "Repeated", "RepeatedTests"),
    "vpm.linkages.dropping": ("DropLimit",),
    "vpm.linkages.karl": ("KarlGeometry",),
    "vpm.linkages.karl_results": ("KarlPoses", "KarlSingularities", "KarlWorkspace"),
    "vpm.linkages.leg_parameters": ("Attachment", "Cylinder", "LegParameters", "LegPart", "Segment"),
    "vpm.linkages.leg_results": ("LegReactions", "LegStrokes", "LegTerms", "ShareMap"),
    "vpm.narx.maxwell": ("MaxwellNarx",),
    "vpm.narx.maxwell_maps": ("MaxwellMap",),
    "vpm.narx.maxwell_records": ("MaxwellSignals",),
    "vpm.narx.maxwell_result": ("MaxwellFit",),
    "vpm.narx.maxwell_runs": ("MaxwellErrors",),
    "vpm.narx.maxwell_windows": ("MaxwellWindows",),
}


@pytest.mark.parametrize(
    "program",
    [
        "import vpm; vpm.linkages.Karl, vpm.impedance.Loop, vpm.narx.identify_maxwell, vpm.identify_oil",
        "import vpm.linkages, vpm.impedance\n"
        "from vpm.linkages import Karl, Leg\n"
        "from vpm.impedance import identify_loop\n"
        "vpm.linkages.Leg.hyq(), vpm.impedance.stop_factor",
        "from vpm.linkages import *; from vpm.impedance import *; from vpm.narx import *\n"
        "Leg, Loop, load, repeat, MaxwellWindows, Narx, static_windows, validate",
        "from vpm.narx import MaxwellMap, MaxwellNarx, Narx, identify_maxwell, refine_maxwell\n"
        "from vpm.identify import CylinderGeometry, Fit, OilFit, identify_oil, pressures_from_force",
    ],
)
def test_scripts_find_them_where_they_did(program: str) -> None:
    """In a process of its own, so that nothing is loaded before."""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("old", "study"),
    [
        (import_module("vpm.linkages"), linkages),
        (import_module("vpm.impedance"), impedance),
        (narx, maxwell),
        (sys.modules["vpm.identify"], oil),
    ],
    ids=["linkages", "impedance", "maxwell", "oil"],
)
def test_both_names_are_of_one_thing(old: object, study: object) -> None:
    names: list[str] = study.__all__  # type: ignore[attr-defined]
    assert set(names) <= set(old.__all__)  # type: ignore[attr-defined]
    assert all(getattr(old, name) is getattr(study, name) for name in names)
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        old.nothing  # type: ignore[attr-defined] # noqa: B018


def test_a_package_gives_no_other_names_of_its_study() -> None:
    with pytest.raises(ImportError, match=r"cannot import name 'descend_motion' from 'vpm.narx'"):
        exec("from vpm.narx import descend_motion")
    with pytest.raises(ImportError, match=r"cannot import name 'np' from 'vpm.identify'"):
        exec("from vpm.identify import np")


@pytest.mark.parametrize(("module", "kind"), [(module, kind) for module, kinds in OLDER.items() for kind in kinds])
def test_older_files_name_classes_that_are_found(module: str, kind: str) -> None:
    found = results._stored_class(f"{module}:{kind}", "old.npz")
    assert found.__name__ == kind
    assert found is getattr(import_module(found.__module__), kind)


def older(path: Path, now: str, then: str) -> Path:
    """The file as a version wrote it in which a module had another name."""
    with np.load(path) as file:
        arrays = dict(file)
    text = str(arrays["header"])
    assert f"object {now}:" in text
    arrays["header"] = np.array(text.replace(f"object {now}:", f"object {then}:"))
    np.savez_compressed(path, **arrays)
    return path


def test_an_older_file_is_read(tmp_path: Path) -> None:
    karl = linkages.load(KARL)
    assert isinstance(karl, linkages.Karl)
    poses = karl.direct((0.20, 0.18))
    path = poses.save(tmp_path / "poses.npz")
    assert Result.load(older(path, "vpm.studies.linkages.karl_results", "vpm.linkages.karl_results")) == poses


@pytest.mark.parametrize(
    "name", ["vpm.linkages.karl_results:Other", "vpm.linkages.other:KarlPoses", "vpm.narx.maxwell_"]
)
def test_a_file_names_no_class_that_never_was(name: str, tmp_path: Path) -> None:
    header = json.dumps({"format": 1, "content": {"$": f"object {name}", "content": {}}})
    np.savez(tmp_path / "file.npz", header=np.array(header))
    with pytest.raises(VpmError, match="which is not known here"):
        Result.load(tmp_path / "file.npz")


def test_the_public_names_are_those_of_the_studies() -> None:
    assert vpm.OilFit is oil.OilFit
    assert vpm.identify_oil is oil.identify_oil
    assert vpm.identify is identify
