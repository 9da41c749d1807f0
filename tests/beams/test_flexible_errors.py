"""Errors and warnings of flexible machines, as a user meets them: which, where, how much, and what to do."""

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from command_line import ran
from model_texts import refused
from test_flexible_python import ARM
from vpm.errors import DivergedError, SimulationError, ValidityWarning
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simulate import Run, simulate
from vpm.stepping import Simulation

FORE = """
[beams.fore]
parent = "upper"
length = 0.4
level = "rigid"
material = { young = 1e11, density = 7000.0 }
section = { shape = "circle", diameter = 0.01 }
"""
CHANNELS = """
[channels]
time = { column = "t", unit = "s" }
"motor.command" = { column = "i", unit = "A" }
"""


def push(current: float, dt: float = 1e-3) -> Experiment:
    time = dt * np.arange(300)
    return Experiment.from_arrays(
        time, {"motor.command": np.full(300, current)}, units={"motor.command": "A"}, name="push"
    )


@pytest.mark.parametrize(
    ("old", "new", "where", "words"),
    [
        ("width = 0.004", "width = 0.0", "beams.upper.section.width", "is 0 m, but only more than 0 m"),
        ("width = 0.004", "width = nan", "beams.upper.section.width", "has to be a finite number"),
        ("length = 0.5", "length = 0.0", "beams.upper.length", "has to be above 0"),
        ("length = 0.5", "length = nan", "beams.upper.length", "has to be a finite number"),
        ('parent = "hub"', 'parent = "hubb"', "beams.upper.parent", 'did you mean "hub"?'),
        ('parent = "hub"', 'parent = "upper"', "beams.upper", 'upper -> upper; give one of them parent = "world"'),
        ('parent = "world"', 'parent = "fore"', "bodies.hub", "hub -> fore -> upper -> hub"),
        ("gravity = [0.0, 0.0, -9.81]\n", "", "gravity", "is missing; add it, for example gravity = [0.0, 0.0, -9.81]"),
        ("strain(3)", "strian(3)", "beams.upper.level", 'did you mean "strain"?'),
        ("strain(3)", "strain(99)", "beams.upper.level", "can be 1 to 12"),
        ('["bending_y"]', "[]", "beams.upper.deforms", "has 0 entries, but has to have at least one"),
        ("poisson = 0.3", "poisson = 0.7", "beams.upper.material.poisson", "is 0.7, but only -0.999 to 0.5"),
        ("mass = 1.0", "mass = 1e-12", "bodies.hub.mass", "is 1e-12 kg, but only 1e-09 kg or more"),
        ("at = 0.0", "at = 0.9", "gauges.root.at", "goes from 0 to 0.5 m"),
    ],
)
def test_files_are_refused_in_one_sentence(old: str, new: str, where: str, words: str) -> None:
    refused(where, words, ARM + FORE, (old, new))


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda arm: arm.mass_matrix([0.0]), "position must have 4 entries, got 1; pass one entry per coordinate"),
        (lambda arm: arm.mass_matrix(np.zeros((2, 3))), "its last axis has to have 4 entries"),
        (lambda arm: arm.mass_matrix("abc"), "must be an array of numbers; convert it"),
        (lambda arm: arm.inverse_dynamics(np.zeros(4), np.zeros(4), [0.0]), "acceleration must have 4 entries, got 1"),
        (lambda arm: arm.forward_dynamics(np.zeros(4), np.zeros(2), np.zeros(4)), "velocity must have 4 entries"),
        (lambda arm: arm.equilibrium(np.zeros(4)), "position must have 1 entries, got 4; pass one entry per joint"),
        (lambda arm: arm.natural_frequencies([np.nan]), r"`position\[0\]` must be a finite number, got NaN"),
        (lambda arm: arm.linearize(np.zeros(3)), "8 entries of state .*, but an array of shape"),
        (lambda arm: arm.linearize({"sholder.position": 1.0}), 'did you mean "shoulder.position"'),
        (
            lambda arm: simulate(arm, push(1.0), initial_state=np.full(8, np.nan)),
            r"initial_state\[0\]` must be a finite",
        ),
        (lambda arm: simulate(arm, push(1.0), "inverse_dynamics"), "use the mode 'prescribed_motion', or model.at"),
        (lambda arm: arm.mass_matrix([np.nan] * len(arm.coordinates)), r"position\[0\]` must be a finite number"),
        (lambda arm: Simulation(arm, 1e-3).step([np.nan]), r"`inputs\[0\]` must be a finite number"),
        (lambda arm: arm.at({"uper": "rigid"}), 'did you mean "upper"'),
    ],
)
def test_wrong_requests_are_refused_in_one_sentence(ask: Callable[[Model], object], words: str) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        ask(Model.from_toml(ARM))
    assert "\n" not in str(caught.value)


def test_an_explicit_step_that_is_too_large_is_refused_with_the_one_that_is_not() -> None:
    arm = Model.from_toml(ARM)
    asked: tuple[Callable[[], object], ...] = (
        lambda: simulate(arm, push(1.0, 1e-2), integrator="rk4"),
        lambda: Simulation(arm, 1e-2, integrator="rk4"),
    )
    for ask in asked:
        with pytest.raises(SimulationError) as caught:
            ask()
        for words in ("beam upper", "Hz", "is stable up to", "more substeps or the integrator linearly_implicit"):
            assert words in str(caught.value)
    stable = float(str(caught.value).split("stable up to ")[1].split(" s")[0])
    assert np.isfinite(simulate(arm, push(1.0, 0.9 * stable), integrator="rk4").values).all()


def test_a_diverging_simulation_hands_over_what_it_had() -> None:
    with pytest.raises(DivergedError, match=r"is .*, beyond .*, at t = .* use more substeps") as caught:
        simulate(Model.from_toml(ARM), push(1e9))
    run = caught.value.run
    assert isinstance(run, Run)
    assert 0 < run.time.size < 300
    assert np.isfinite(run.values).all()
    assert caught.value.time == pytest.approx(run.time[-1] + 1e-3)


def test_leaving_the_range_of_a_level_warns_wherever_it_happens(tmp_path: Path) -> None:
    arm = Model.from_toml(ARM).at("deflection(4)")
    runs = []
    asked: tuple[Callable[[], Run], ...] = (
        lambda: simulate(arm, push(20.0)),
        lambda: Simulation(arm, 1e-3).run(np.full((300, 1), 20.0)),
        lambda: Simulation(arm, 1e-3).run(lambda _: [20.0], 0.3),
    )
    for ask in asked:
        with pytest.warns(ValidityWarning, match=r"upper bends by .* rad at t = .* s.*bezier\(4\)"):
            runs.append(ask())
    for run in runs:
        assert len(run.notes) == 1
        assert run.notes[0] in run._repr_html_().replace("&quot;", '"')
        assert Run.load(run.save(tmp_path / "run.npz")).notes == run.notes
        assert "upper bends by" in run.plot().get_supxlabel().replace("\n", " ")
    np.testing.assert_allclose(runs[1].values, runs[2].values)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert simulate(arm, push(0.5)).notes == ()
        assert Simulation(arm.at("bezier(4)"), 1e-3).run(np.full((300, 1), 20.0)).notes == ()


def test_the_command_line_warns_lists_and_plots(tmp_path: Path) -> None:
    model, log, picture = tmp_path / "arm.toml", tmp_path / "log.csv", tmp_path / "run.png"
    model.write_text(ARM.replace("strain(3)", "deflection(4)") + CHANNELS, encoding="utf-8")
    rows = "".join(f"{1e-3 * k:.3f},20.0\n" for k in range(300))
    log.write_text("t,i\n" + rows, encoding="utf-8")
    done = ran("simulate", str(model), str(log), "--plot", str(picture))
    for words in ("not compared: ", "wrote "):
        assert words in done.stdout
    assert "warning: upper bends by 0.55" in done.stderr
    assert picture.stat().st_size > 5000
    done = ran("info", model)
    assert "beam upper: level deflection(4), 3 elastic coordinates (bending_y)" in done.stdout
    assert "natural frequencies with all joints locked at zero: 13.2" in done.stdout
    assert "warning" not in done.stdout + done.stderr
    soft = ARM.replace("strain(3)", "deflection(4)").replace("value = 206.0", "value = 2.0")
    model.write_text(soft, encoding="utf-8")
    done = ran("info", model)
    assert "warning: upper sags by" in done.stdout
