"""Public benchmarks: their files, divided as their scores ask for; what a model with friction scores on EMPS."""

import os
import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.io import savemat

from places import ROOT

sys.path[:0] = [str(ROOT / "benches" / "public"), str(ROOT / "benches" / "peers")]

bouc_wen, public_scores, public_sets = (import_module(n) for n in ("bouc_wen", "public_scores", "public_sets"))

Array = NDArray[np.float64]
EMPS = Path(os.environ.get("VPM_SHARED_DATA", ROOT.parent / "shared" / "data")) / "emps"


def numbers(count: int, start: float = 0.0) -> Array:
    return start + np.arange(float(count))[:, None]


def files_of(name: str) -> Mapping[str, Mapping[str, Any]]:
    """Files in the layout of a set, whose values are the numbers of their samples."""
    row = numbers(190_000).T
    match name:
        case "emps":
            table = {"qm": numbers(60), "vir": numbers(60, 0.5), "t": 1e-3 * numbers(60)}
            return {"DATA_EMPS": table, "DATA_EMPS_PULSES": table}
        case "silverbox":
            return {"SNLS80mV": {"V1": row[:, :130_000], "V2": row[:, :130_000]}}
        case "cascaded_tanks":
            return {"dataBenchmark": {key: numbers(1024) for key in ("uEst", "yEst", "uVal", "yVal")} | {"Ts": 4.0}}
        case "coupled_drives":
            return {"DATAUNIF": {key: numbers(500) for key in ("u11", "z11", "u12", "z12")}}
        case "wiener_hammerstein":
            return {"WienerHammerBenchMark": {"uBenchMark": row.T, "yBenchMark": row.T, "fs": 51_200.0}}
        case "f16":
            tables: dict[str, Any] = {"Force": row[:, :90], "Acceleration": np.vstack([row[:, :90]] * 3), "Fs": 400.0}
            levels = ("SineSw_Level1", "SineSw_Level2_Validation", "SpecialOddMSine_Level1")
            return {f"F16Data_{level}": tables for level in levels}
        case "bouc_wen":
            kinds = ("multisine", "sinesweep")
            return {f"{c}val_{kind}": {f"{c}val_{kind}": row[:, :90]} for c in "uy" for kind in kinds}
        case _:
            six = np.vstack([row[:, :90]] * 6)
            table = {f"{c}_{part}": six for c in "uy" for part in ("train", "test")}
            return {"forward_identification_without_raw_data": table}


#: First and last sample of the records to fit and of those to score, and the time between samples.
PARTS = {
    "emps": ([(0, 59)], [(0, 59)], 1e-3),
    "silverbox": ([(40650, 105_711)], [(105_712, 127_399), (100, 40574), (100, 32099)], 1 / 610.35),
    "cascaded_tanks": ([(0, 1023)], [(0, 1023)], 4.0),
    "coupled_drives": ([(0, 399)] * 2, [(400, 499)] * 2, 0.02),
    "wiener_hammerstein": ([(5200, 105_199)], [(105_200, 183_999)], 1 / 51_200),
    "f16": ([(0, 89)], [(0, 89)], 1 / 400),
    "bouc_wen": ([], [(0, 89)] * 2, 1 / 750),
    "kuka": ([(0, 89)], [(0, 89)], 0.1),
}


@pytest.mark.parametrize("name", public_sets.SETS)
def test_files_of_a_set_are_divided_as_its_score_asks_for(name: str, tmp_path: Path) -> None:
    for stem, table in files_of(name).items():
        suffix = public_sets.SETS[name].files[0].rsplit(".", 1)[1]
        savemat(tmp_path / f"{stem}.{suffix}", table, appendmat=False)
    found = public_sets.load(name, tmp_path)
    train, test, dt = PARTS[name]
    for series, expected in ((found.train, train), (found.test, test)):
        assert [(s.y[0, 0], s.y[-1, 0]) for s in series] == expected
        assert all(s.dt == pytest.approx(dt) and len(s.u) == len(s.y) for s in series)


def test_the_split_is_that_of_the_package_of_the_benchmarks(tmp_path: Path) -> None:
    public = pytest.importorskip("nonlinear_benchmarks", reason="nonlinear_benchmarks is not installed")
    own = tmp_path / "Silverbox"
    (own / "SilverboxFiles").mkdir(parents=True)
    (own / "SilverboxFiles.zip").touch()  # what its package takes for a sign that nothing has to be fetched
    savemat(own / "SilverboxFiles" / "SNLS80mV.mat", files_of("silverbox")["SNLS80mV"])
    train, tests = public.Silverbox(dir_placement=tmp_path)
    found = public_sets.load("silverbox", own)
    for theirs, ours in zip((train, *tests), (*found.train, *found.test), strict=True):
        assert np.array_equal(theirs.y, ours.y[:, 0])
        assert np.array_equal(theirs.u, ours.u[:, 0])
    assert {t.state_initialization_window_length for t in tests} == {found.window}


def test_folders_of_hdf5_files_are_read_too(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py", reason="h5py is not installed")
    for part in ("train", "test"):
        (tmp_path / part).mkdir()
        with h5py.File(tmp_path / part / "a.hdf5", "w") as file:
            for k in range(11):
                file[f"u{k}"] = np.full(20, float(k), dtype="f4")
            file["y0"] = np.arange(20, dtype="f4")
            file.attrs["fs"] = 50.0
    found = public_sets.load("kuka", tmp_path)
    assert found.test[0].u.shape == (20, 11)
    assert np.array_equal(found.test[0].u[0], np.arange(11.0))  # u10 comes after u9
    assert found.train[0].dt == pytest.approx(0.02)
    assert found.window == 100


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="has no 'SNLS80mV' of the set silverbox"):
        public_sets.load("silverbox", tmp_path)


def test_the_oscillator_answers_like_its_equations_in_another_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    from scipy.integrate import solve_ivp

    time = np.arange(150) / bouc_wen.RATE
    force = 40.0 * np.sin(2.0 * np.pi * 35.0 * time)  # whole periods: its series is itself

    def rates(t: float, state: Array) -> Array:
        answer: Array = bouc_wen._rates(state, 40.0 * np.sin(2.0 * np.pi * 35.0 * t))
        return answer

    exact = solve_ivp(rates, (0.0, time[-1]), np.zeros(3), "DOP853", time, rtol=1e-10, atol=1e-14, max_step=5e-5).y[0]
    errors = []
    for steps in (20, 80):
        monkeypatch.setattr(bouc_wen, "STEPS", steps)
        errors.append(np.max(np.abs(bouc_wen.response(force) - exact)) / np.max(np.abs(exact)))
    # The kinks of the hysteresis at reversals, which no step of fixed length hits, leave less than order 4.
    assert errors[0] < 1e-4
    assert errors[1] < 0.1 * errors[0]


@pytest.mark.skipif(not EMPS.is_dir(), reason=f"the measured EMPS logs are not at {EMPS}")
def test_friction_and_bias_score_on_emps_within_published_reach() -> None:
    case = public_scores.CASES[0]
    found = public_scores.score(case, public_scores.emps(EMPS), public_scores.FRICTION)
    assert found.test[0][1] < 5.7  # mm
