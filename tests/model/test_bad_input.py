"""What a user can get wrong is one sentence of vpm's own, whichever door it comes through."""

import json
import math
import os
import subprocess
import sys
import tomllib
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import vpm
from places import EXAMPLES
from vpm import demo, results
from vpm._core import System
from vpm.errors import (
    CoreError,
    DiagnosisError,
    ExperimentError,
    ModelError,
    ScenarioError,
    SimulationError,
    UnitError,
    VpmError,
)
from vpm.experiment import Experiment
from vpm.experiment.readers import open_log
from vpm.model import Model
from vpm.ranking.fit import bounded_step
from vpm.realtime import compile_model
from vpm.scenario import Scenario
from vpm.simulate import Setup
from vpm.units import parse_unit

TIME: NDArray[np.float64] = np.arange(100, dtype=np.float64) * 0.01


@pytest.fixture(scope="module")
def arm() -> Model:
    return Model.load(demo.MODEL)


@pytest.fixture(scope="module")
def log(arm: Model) -> Experiment:
    return Experiment.load(demo.TRAIN, model=arm)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda arm: arm.mass_matrix([0.1, 0.2]), "must have 1 entries, got 2"),
        (lambda arm: arm.mass_matrix("abc"), "must be an array of numbers"),
        (lambda arm: arm.equilibrium([math.nan]), "must be a finite number"),
        (lambda arm: arm.linearize({"shoulder.position": math.nan}), "must be a finite number"),
        (lambda arm: arm.linearize({"shoulder.position": "x"}), "shoulder.position is no number"),
        (lambda arm: arm.state("abc"), "is no array of numbers"),
        (lambda arm: arm.with_parameters({"arm.mass": "x"}), "arm.mass is no number"),
        (lambda arm: vpm.Simulation(arm, 1e-3).step("abc"), "the command is no array of numbers"),
        (lambda arm: vpm.Simulation(arm, 1e-3, substeps=2**70), "a whole number from 1 to 1000000"),
        (lambda arm: vpm.Simulation(arm, 1e-3).restore(vpm.Simulation(arm, 1.0).snapshot()), "another model"),
    ],
)  # fmt: skip
def test_what_the_core_refuses_is_an_error_of_vpm(arm: Model, ask: Callable[[Model], object], words: str) -> None:
    with pytest.raises(VpmError, match=words):
        ask(arm)


def test_no_result_is_a_number_that_is_none(arm: Model) -> None:
    """Finite numbers far beyond any machine, whose squares are not."""
    with pytest.raises(CoreError, match=r"`energy\[0\] at this state` must be a finite number"):
        arm.energy([1e155], [1e155])
    strip = Model.load(EXAMPLES / "flexible_pendulum" / "flexible_pendulum.toml")
    run = vpm.Simulation(strip, 1.0)

    def steps() -> None:
        for _ in range(50):
            assert np.isfinite(run.step(np.zeros(len(strip.inputs)))).all()

    with pytest.raises(SimulationError, match=r"is no longer finite|beyond"):
        steps()


def test_runs_that_no_memory_holds_are_refused_before_they_begin() -> None:
    """The core ended the process where it got no memory."""
    path = EXAMPLES / "flexible_pendulum" / "release.toml"
    content = {**tomllib.loads(path.read_text(encoding="utf-8")), "duration": 3000.0}
    with pytest.raises(ScenarioError, match=r"duration makes \d+ samples of \d+ numbers in all runs"):
        Scenario.from_dict(content, folder=path.parent)


def test_an_element_without_linear_model_says_so() -> None:
    strut = Model.load(EXAMPLES / "maxwell_narx" / "strut.toml")
    with pytest.raises(CoreError, match=r"row 1 and column 0 of A, .* no derivative .* such as a line of no length"):
        strut.linearize()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = " + "[" * 500 + "]" * 500, "nested"),
        ("a = " + "{b=" * 500 + "1" + "}" * 500, "nested"),
        ("[" + ".".join(["a"] * 5000) + "]", r"a\.a\.a \.\.\. is nested more than 32 deep"),
        ("a = " + "1" * 5000, "an integer has more than 64 bits"),
        ("[a]\nb = [1, " + "1" * 400 + "]", r"a\.b\[1\] is an integer of more than 64 bits"),
    ],
    ids=["lists", "tables", "headers", "digits", "bits"],
)
def test_toml_without_end_is_refused(text: str, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        Model.from_toml(text)


@pytest.mark.parametrize(
    ("unit", "words"),
    [
        ("(" * 5000, "it has 5000 characters"),
        ("(" * 99, "it ends where a symbol is needed"),
        ("m^²", "a number has to follow"),
        ("1/(nm^99)", "too large or too small"),
        ("1/(" + "nm^3 " * 12 + ")", "too large or too small"),
        ("m^١", "is not part of a unit"),
    ],
)
def test_units_that_are_none_are_refused(unit: str, words: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit(unit)
    assert words in str(caught.value)


def test_a_unit_that_makes_a_value_infinite_is_refused(arm: Model) -> None:
    spring = '\n[[effects]]\ntype = "spring"\nat = "shoulder"\nstiffness = { value = 9e99, unit = "kN m/rad" }\n'
    with pytest.raises(ModelError, match=r"effects\[\d\].stiffness is 9e\+99 kN m/rad, which is more than any"):
        Model.from_toml(demo.MODEL.read_text(encoding="utf-8") + spring)
    with pytest.raises(ModelError, match="more than any machine has"):
        arm.with_parameters({"arm.mass": 1e155})


@pytest.mark.parametrize("cutoff", [1e-9, 0.0, math.nan, math.inf])
def test_a_filter_that_leaves_nothing_is_refused(arm: Model, log: Experiment, cutoff: float) -> None:
    with pytest.raises(ExperimentError, match="a cut-off frequency of"):
        vpm.simulate(arm, log, "inverse_dynamics", cutoff=cutoff)


@pytest.mark.parametrize("cutoff", [1e-9, math.nan, 1e4])
def test_a_diagnosis_refuses_a_filter_before_it_works(arm: Model, log: Experiment, cutoff: float) -> None:
    said: list[str] = []
    with pytest.raises(ExperimentError, match="a cut-off frequency of"):
        vpm.diagnose(arm, log, cutoff=cutoff, tell=said.append)
    assert not said


@pytest.mark.parametrize("settings", [{"horizon": math.inf}, {"settling": math.inf}, {"substeps": 1.5}])
def test_steps_without_end_are_refused(settings: dict[str, float]) -> None:
    with pytest.raises(SimulationError, match=f"{next(iter(settings))} is "):
        Setup(**settings)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("time", "value", "words"),
    [
        (TIME[::-1], 0.0, "it has to increase"),
        (np.where(TIME[3] == TIME, np.nan, TIME), 0.0, "the time is nan"),
        (TIME**2 + TIME, 0.0, "off the median"),
        (TIME, math.nan, 'the channel "x" is nan at t = 0 s'),
        (TIME, 1e155, r'the channel "x" is 1e\+155'),
        (TIME[:3], 0.0, "has 3 of at least"),
    ],
)
def test_records_are_checked_as_files_are_however_they_are_made(
    tmp_path: Path, time: NDArray[np.float64], value: float, words: str
) -> None:
    data = np.full((len(time), 1), value)
    with pytest.raises(ExperimentError, match=words):
        Experiment("made", time, data, ("x",), ("1",))
    good = Experiment("made", TIME, np.zeros((100, 1)), ("x",), ("1",))
    object.__setattr__(good, "time", time)
    object.__setattr__(good, "data", data)
    with pytest.raises(ExperimentError, match=words):
        Experiment.load(good.save(tmp_path / "made.npz"))


@pytest.mark.parametrize(
    ("time", "data", "words"),
    [
        (TIME, np.full((100, 1), 1j), r"data is no array of numbers \(it holds complex128\)"),
        (
            np.arange(100).astype("M8[ms]"),
            np.zeros((100, 1)),
            r"time is no array of numbers \(it holds datetime64\[ms\]\)",
        ),
        (TIME, np.ma.masked_equal(np.arange(100)[:, None], 7), r'sample 7: the channel "x" is nan'),
    ],
    ids=["complex", "dates", "masked"],
)
def test_numbers_that_say_more_than_numbers_are_refused(time: ArrayLike, data: ArrayLike, words: str) -> None:
    """Imaginary parts and masks got lost, and milliseconds were taken for seconds."""
    with pytest.raises(ExperimentError, match=words):
        Experiment("made", np.asarray(time), np.asanyarray(data), ("x",), ("1",))


@pytest.mark.parametrize("place", [0.0, 0.3])
def test_a_machine_that_stands_shows_no_effect(arm: Model, place: float) -> None:
    """A stuck encoder was an inertia, a tilt of gravity and a lag; zeros ended in a division by zero."""
    channels = {"shoulder.position": np.full(2000, place), "motor.command": np.sin(0.1 * np.arange(2000))}
    stuck = Experiment.from_arrays(np.arange(2000) / 500.0, channels, {"motor.command": "A"}, name="stuck", model=arm)
    words = f"no joint moves in stuck: shoulder.position is {place:g} rad all the time"
    for ask in (vpm.rank, partial(vpm.diagnose, check=False), partial(vpm.diagnose, check=False)):
        with pytest.raises(DiagnosisError, match=words):
            ask(arm, [stuck])
    told = str(vpm.compare(vpm.simulate(arm, stuck, "inverse_dynamics"), stuck))
    assert "inf" not in told


def test_no_step_is_measured_by_errors_of_zero() -> None:
    """Infinite numbers went on to LAPACK, which wrote to the terminal."""
    structure: Any = SimpleNamespace(
        standard=np.zeros(2), anywhere=[], ends=np.tile([-1.0, 1.0], (2, 1)), model=SimpleNamespace(name="arm")
    )
    with pytest.raises(VpmError, match="arm: the records leave no error that a step could be measured by"):
        bounded_step(structure, np.zeros(5), np.full((5, 2), 1e10), 1.0)


@pytest.mark.parametrize("stamp", ["15.0e4", "1e7", "1e300"])
def test_one_wrong_stamp_is_named_where_steps_are_interpolated(tmp_path: Path, arm: Model, stamp: str) -> None:
    lines = demo.TRAIN.read_text(encoding="utf-8").splitlines()
    lines[-1] = ",".join([stamp, *lines[-1].split(",")[1:]])
    (tmp_path / "log.csv").write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(ExperimentError, match=f"line {len(lines)}: (a grid with steps|the time is)"):
        Experiment.load(tmp_path / "log.csv", model=arm, irregular="interpolate")


def test_a_grid_as_fine_as_nothing_is_refused(log: Experiment) -> None:
    with pytest.raises(ExperimentError, match="a grid with steps of 1e-12 s would have"):
        log.resample(1e12)


def test_a_dollar_in_a_name_is_a_dollar(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    record = Experiment("made", TIME, np.zeros((100, 1)), ("$x_{$",), ("1",))
    record.plot().savefig(tmp_path / "plot.png")


# ---- files -----------------------------------------------------------------------------------------------------------


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes with names")
@pytest.mark.parametrize("ending", ["csv", "toml", "npz", "parquet", "mat", "h5", "mcap"])
def test_pipes_are_not_waited_for(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"pipe.{ending}"
    os.mkfifo(path)
    load: Callable[[Path], object] = Model.load if ending == "toml" else Experiment.load
    with pytest.raises(VpmError, match="is a pipe or a device"):
        load(path)


def test_every_module_of_results_is_listed_and_no_other_is_imported(tmp_path: Path) -> None:
    for module in walk_packages(vpm.__path__, "vpm."):
        import_module(module.name)
    known = {name.partition(":")[0] for name in results._STORED_CLASSES if name.startswith("vpm.")} - {"vpm.results"}
    assert known == {f"{package}.{name}" for package, names in results._MODULES.items() for name in names}
    header = json.dumps({"format": 1, "content": {"$": "object vpm.__main__:X", "content": {}}})
    np.savez(tmp_path / "file.npz", header=np.array(header))
    program = (
        "import sys, vpm.results as r\n"
        "try:\n r.Result.load(sys.argv[1])\nexcept r.VpmError as error:\n print(error)\n"
        "print('vpm.__main__' in sys.modules, 'vpm.cli' in sys.modules)"
    )
    words = [sys.executable, "-c", program, str(tmp_path / "file.npz")]
    run = subprocess.run(words, capture_output=True, text=True, check=True)
    assert "which is not known here" in run.stdout
    assert run.stdout.endswith("False False\n")


def test_a_ratio_of_an_effect_refers_to_a_parameter() -> None:
    model = Model.load(EXAMPLES / "wrist" / "wrist.toml")
    content = json.loads(compile_model(model, 1000.0).text)["description"]
    (effect, *_) = (effect for effect in content["effects"] if "ratios" in effect)
    effect["ratios"][0]["ratio"] = 2**63 - 1
    with pytest.raises(CoreError, match="refers to parameter number 9223372036854775807, but there are"):
        System(json.dumps(content))


def test_no_byte_of_a_matlab_file_ends_the_process(tmp_path: Path) -> None:
    """Tags are checked before SciPy sees them: some of these files end a process that reads them at once."""
    from scipy.io import savemat
    from scipy.sparse import csc_matrix

    values = {"t": TIME, "log": {"q": TIME, "v": np.ones((100, 2))}, "name": "arm", "some": csc_matrix(np.eye(3))}
    savemat(tmp_path / "log.mat", values)
    good = (tmp_path / "log.mat").read_bytes()
    dice, refused = np.random.default_rng(3), 0
    for _ in range(300):
        bad = bytearray(good)
        bad[int(dice.integers(124, len(bad)))] = int(dice.choice([0, 1, 5, 14, 15, 128, 255]))
        (tmp_path / "bad.mat").write_bytes(bad)
        try:
            found = open_log(tmp_path / "bad.mat")
            found.read(found.header[:1], found.header[0])
        except VpmError:
            refused += 1
    assert 5 < refused < 300


@pytest.mark.parametrize("ending", ["parquet", "h5", "mat", "npz", "csv"])
def test_broken_files_are_refused_with_their_name(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"log.{ending}"
    values = {"time": TIME, "q": np.sin(TIME)}
    if ending == "parquet":
        pytest.importorskip("pyarrow.parquet").write_table(pytest.importorskip("pyarrow").table(values), path)
    elif ending == "h5":
        with pytest.importorskip("h5py").File(path, "w") as file:
            for name, column in values.items():
                file[name] = column
    elif ending == "mat":
        from scipy.io import savemat

        savemat(path, values, do_compression=True)
    elif ending == "npz":
        Experiment("made", TIME, np.zeros((100, 1)), ("q",), ("1",)).save(path)
    else:
        path.write_text("time,q\n" + "\n".join(f"{t!r},1" for t in TIME.tolist()), encoding="utf-8")
    good = path.read_bytes()
    dice, told = np.random.default_rng(4), []
    for _ in range(60):
        bad = bytearray(good)
        for at in dice.integers(0, len(bad), int(dice.choice([1, 4, 16]))):
            bad[at] = int(dice.integers(256))
        path.write_bytes(bad[: int(dice.choice([len(bad), len(bad) // 2]))])
        try:
            Experiment.load(path)
        except VpmError as error:
            told.append(str(error))
    assert len(told) > 5
    assert all(path.name in sentence or "made" in sentence for sentence in told), told
