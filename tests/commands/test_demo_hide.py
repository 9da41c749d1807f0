"""``vpm demo --hide``: other effects in the demo's machine, true to their equations, and named on both records."""

import math
import tomllib
from collections.abc import Callable
from importlib import import_module
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from scipy.integrate import solve_ivp

from nightly import at_night
from vpm.catalogue import EFFECTS
from vpm.demo import generate, print_list, run_demo
from vpm.demo.hidden import HIDDEN, LISTED, REFUSED
from vpm.demo.machine import Machine, State, advance
from vpm.errors import DiagnosisError

pytest.importorskip("jinja2", reason="the demo writes a page")
pytest.importorskip("matplotlib", reason="the demo draws")

INERTIA = 0.0345 + 1.8 * 0.221**2
WEIGHT = 1.8 * 9.81 * 0.221
#: Values that the diagnosis has to find within this share; two that share a hump of friction at rest, within the other.
CLOSE, SHARED = 0.05, 0.2
#: Nothing, a law of a joint with one beside it, a drive, a force.
DAILY = frozenset({"none", "stribeck_friction", "actuator_lag", "bias_force"})


def test_every_listed_effect_can_be_made_and_is_in_the_catalogue() -> None:
    assert set(LISTED) <= set(HIDDEN)
    assert set(LISTED) - {"none"} <= set(EFFECTS)
    assert not set(LISTED) & set(REFUSED)
    assert LISTED[0] == "coulomb_friction"
    buffer = StringIO()
    print_list(Console(file=buffer, width=400))
    lines = buffer.getvalue().splitlines()
    assert [line.split()[0] for line in lines] == list(LISTED)
    assert "tau = -force" in buffer.getvalue()


# What a user sees first has its test with the commands.
@pytest.mark.parametrize("hide", at_night(LISTED[1:], but=DAILY))
def test_the_story_comes_out_right(hide: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The effect, those that come with it, and no other one; its values; and it is not in the shipped files."""
    # Drawing takes as long as the diagnosis, and has tests of its own.
    monkeypatch.setattr(import_module("vpm.report.pictures"), "figure_to_svg", lambda *_: "<svg></svg>")
    console = Console(file=StringIO(), width=400)
    why = run_demo(tmp_path, console, lambda _: None, hide)
    entry = HIDDEN[hide]
    expected = {*entry.beside, (hide, entry.site)} if entry.site else set()
    assert {(e.name, e.site) for e in why.effects} == expected
    assert why.verdict == ("effect_found" if expected else "parameters_only")
    for name, value in entry.parameters.items():
        share = SHARED if hide == "stribeck_friction" else CLOSE
        assert why.model.parameters[name].value == pytest.approx(value, rel=share), name
    told = console.file.getvalue()  # type: ignore[attr-defined]
    assert "what was hidden in the log: " in told
    assert f"{hide} at {entry.site}" in told.split("what was hidden", 1)[1] or hide == "none"
    assert {"report.html", "report.json", "model.toml", "log"} <= {path.name for path in tmp_path.iterdir()}
    assert len(why.evidence) == len(why.effects)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("payload", "turn gravity by an angle"),
        ("sprin", 'did you mean "spring"'),
        ("viscous_friction", "has it already"),
    ],
)
def test_what_cannot_be_hidden_is_refused_with_the_reason(name: str, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(DiagnosisError, match=sentence):
        run_demo(tmp_path, Console(file=StringIO()), lambda _: None, name)


def pushed(machine: Machine, seconds: float, current: float = 1.2) -> tuple[State, list[float]]:
    """The machine under a constant command from rest, and its angle at each sample."""
    state, angles, commands = State(), [0.0], [current]
    for _ in range(round(seconds / 0.002)):
        advance(machine, state, commands)
        commands.append(current)
        angles.append(state.position)
    return state, angles


@pytest.mark.parametrize(
    ("machine", "load", "more"),
    [
        (Machine(spring=1.5, spring_rest=0.3), lambda q, _v: 1.5 * (q - 0.3), 0.0),
        (Machine(tilt=0.07), lambda q, _v: WEIGHT * (math.sin(q + 0.07) - math.sin(q)), 0.0),
        (Machine(viscous_difference=0.15), lambda _q, v: math.copysign(0.075, v) * v, 0.0),
        (
            Machine(payload=0.5),
            lambda q, _v: 0.5 * 9.81 * (0.15 * math.sin(q) - 0.12 * math.cos(q)),
            0.5 * (0.15**2 + 0.12**2),
        ),
        (
            Machine(stop_stiffness=40.0, stop_damping=0.05, stop_high=0.3),
            lambda q, v: 40.0 * max(q - 0.3, 0.0) * max(1.0 + 0.05 * v, 0.0),
            0.0,
        ),
    ],
    ids=["spring", "tilt", "asymmetric", "payload", "end stop"],
)
def test_the_machine_moves_as_its_equation_says(
    machine: Machine, load: Callable[[float, float], float], more: float
) -> None:
    _, angles = pushed(machine, 0.8)

    def rate(_time: float, x: np.ndarray) -> list[float]:
        q, v = float(x[0]), float(x[1])
        return [v, (1.6 * 1.2 - WEIGHT * math.sin(q) - 0.135 * v - load(q, v)) / (INERTIA + more)]

    exact = solve_ivp(rate, (0.0, 0.8), [0.0, 0.0], rtol=1e-10, atol=1e-12, max_step=0.002, t_eval=[0.8]).y[0, -1]
    # The stop's damping is taken at the beginning of a step: of first order, all the rest of second.
    assert angles[-1] == pytest.approx(exact, abs=1e-5 if machine.stop_stiffness else 5e-6)
    assert max(angles) > 0.3


def test_lag_follows_its_command_exactly() -> None:
    """63 % of the torque after one time constant: the state of the drive, not the motion."""
    state, _ = pushed(Machine(lag=0.02), 0.02)
    assert state.current == pytest.approx(1.2 * (1.0 - math.exp(-1.0)), rel=1e-9)


def test_a_soft_gear_moves_as_two_masses() -> None:
    stiffness, damping, rotor = 80.0, 0.6, 0.03
    _, angles = pushed(Machine(gear_stiffness=stiffness, gear_damping=damping, rotor=rotor), 0.5)

    def rate(_time: float, x: np.ndarray) -> list[float]:
        q, v, p, w = (float(each) for each in x)
        push = stiffness * (q - p) + damping * (v - w)
        return [v, (1.92 - 0.135 * v - push) / rotor, w, (push - WEIGHT * math.sin(p)) / INERTIA]

    exact = solve_ivp(rate, (0.0, 0.5), [0.0] * 4, rtol=1e-10, atol=1e-12, t_eval=[0.5]).y[0, -1]
    assert angles[-1] == pytest.approx(exact, abs=2e-4)


def test_within_the_play_the_motor_runs_alone() -> None:
    """With no torque on the link it stays at rest until the motor has crossed half the play."""
    machine = Machine(gear_stiffness=600.0, gear_damping=0.6, gear_play=0.03, rotor=0.02)
    state = State()
    while state.position < 0.0145:
        assert state.link_position == 0.0
        advance(machine, state, [0.05])
    assert state.position > 0.0
    for _ in range(100):
        advance(machine, state, [0.05])
    assert state.link_position > 0.0


def test_truth_tells_what_comes_along(tmp_path: Path) -> None:
    generate.generate(tmp_path, "stribeck_friction")
    hidden = tomllib.loads((tmp_path / "truth.toml").read_text(encoding="utf-8"))["hidden"]
    assert hidden["beside"] == [["coulomb_friction", "shoulder"]]
