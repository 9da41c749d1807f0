"""Springs along lines where a machine rests: what bends links, holds joints and loops, and begins runs."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import vpm
from places import EXAMPLES
from vpm.errors import SimulationError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simulate import simulate

LENGTH, RIGIDITY, MASS = 1.0, 190.0, 0.16
SPRING, PUSH, ARM = 20.0, 0.1, 0.5
COILS: dict[str, dict[str, Any]] = {
    "spring_damper": {"stiffness": SPRING, "damping": 0.3},
    "maxwell": {"stiffness": SPRING, "fast_stiffness": 300.0, "relaxation_time": 0.02},
}


def boom(coil: str) -> Model:
    """A boom along x without weight whose tip a coil, longer than its place by ``PUSH``, pushes up from below."""
    stiff = {"shape": "stiffness", "bending_x": RIGIDITY, "bending_y": RIGIDITY, "torsion": 1e3, "extension": 1e7}
    joint = {"type": "revolute", "parent": "world", "child": "hub", "axis": [0.0, 1.0, 0.0]}
    line = {"from": {"parent": "world", "point": [LENGTH, 0.0, -ARM]}, "to": {"parent": "boom"}}
    law = {"type": coil, "line": "stay", "free_length": ARM + PUSH, **COILS[coil]}
    return Model.from_dict(
        {
            "name": "boom",
            "gravity": [0.0, 0.0, 0.0],
            "bodies": {"hub": {"mass": 1.0, "inertia": [0.01, 0.01, 0.01, 0.0, 0.0, 0.0]}},
            "joints": {"hinge": {**joint, "rotation": [0.0, math.pi / 2.0, 0.0]}},
            "beams": {
                "boom": {
                    "parent": "hub",
                    "length": LENGTH,
                    "level": "strain(5)",
                    "deforms": ["bending_y"],
                    "section": {**stiff, "mass": MASS},
                }
            },
            "lines": {"stay": line},
            "markers": {"tip": {"parent": "boom"}},
            "actuators": {"coil": law, "motor": {"joint": "hinge", "gain": 1.0}},
        }
    )


@pytest.mark.parametrize("coil", COILS)
def test_a_spring_bends_the_link_that_it_holds(coil: str) -> None:
    """A cantilever with a spring at its tip, in closed form; a slope of 1 % changes it by 0.01 %."""
    model = boom(coil)
    q, effort = model.equilibrium([0.0])
    beam = 3.0 * RIGIDITY / LENGTH**3
    lift = SPRING * PUSH / (SPRING + beam)
    assert model.forward_kinematics("tip", q)[2, 3] == pytest.approx(lift, rel=2e-4)
    # The tip is pushed up, which turns about -y; what holds the joint turns it back.
    assert effort[0] == pytest.approx(beam * lift * LENGTH, rel=2e-4)
    ratio = SPRING * LENGTH**3 / RIGIDITY

    def missing(b: float) -> float:
        return b**3 * (1.0 + math.cos(b) * math.cosh(b)) + ratio * (
            math.sin(b) * math.cosh(b) - math.cos(b) * math.sinh(b)
        )

    mode = float(brentq(missing, 1.8, 2.2)) ** 2 * math.sqrt(RIGIDITY / MASS) / (2.0 * math.pi * LENGTH**2)
    assert model.natural_frequencies([0.0])[0] == pytest.approx(mode, rel=3e-4)


@pytest.mark.parametrize("coil", COILS)
def test_a_run_begins_where_springs_and_links_balance(coil: str) -> None:
    model = boom(coil)
    held = model.with_effect("spring", at="hinge", stiffness=1e9, rest=0.0)
    _, effort = model.equilibrium([0.0])
    time = 1e-3 * np.arange(200)
    pushed = {"motor.command": np.full(200, effort[0]), "hinge.position": np.zeros(200)}
    run = simulate(held, Experiment.from_arrays(time, pushed, model=model), integrator="rosenbrock")
    assert run["tip.z"][0] > 3e-3
    assert np.ptp(run["tip.z"]) < 1e-9


def test_a_prescribed_motion_tells_that_springs_do_nothing() -> None:
    still = Experiment.from_arrays(1e-3 * np.arange(200), {"hinge.position": np.zeros(200)}, model=boom("maxwell"))
    run = simulate(boom("maxwell"), still, "prescribed_motion", cutoff=40.0)
    assert np.abs(run["tip.z"]).max() < 1e-9
    assert "springs along lines (coil) did nothing" in run.notes[0]


def test_gains_over_poses_hold_what_springs_of_lines_leave() -> None:
    model = boom("spring_damper")
    feedback = vpm.state_feedback(
        model, {"hinge": [0.0, 0.1]}, deviations={"tip.z": 1e-3, "hinge.velocity": 0.1}, efforts={"motor": 1.0}
    )
    places = feedback.schedule
    for state, command in zip(places.states, places.commands, strict=True):
        held = vpm.Simulation(model, 1e-4, state=state)
        held.step(command)
        assert np.abs(np.array(held.state) - state).max() < 1e-7


def test_a_feed_forward_that_would_leave_out_a_spring_is_refused() -> None:
    move = vpm.TargetMotion.rest_to_rest([0.0], [0.2], 0.5)
    with pytest.raises(SimulationError, match=r"coil \(spring_damper\) gives an effort"):
        vpm.flexible_feedforward(boom("spring_damper"), move, ["hinge.position"], inputs=["motor"])


def test_what_holds_a_closed_loop_is_the_slope_of_its_energy() -> None:
    """By virtual work: along the loop's motion the effort is the derivative of the potential, springs included."""
    content = Model.load(EXAMPLES / "loops" / "parallelogram.toml").to_dict()
    ends = {
        "from": {"parent": "world", "point": [0.3, 0.0, 0.6]},
        "to": {"parent": "coupler", "point": [0.1, 0.0, 0.0]},
    }
    coil = {"type": "spring_damper", "line": "stay", "stiffness": 40.0, "free_length": 0.2, "damping": 1.0}
    actuators = {"coil": coil, **content["actuators"]}
    model = Model.from_dict({**content, "lines": {"stay": ends}, "actuators": actuators})

    def potential(angle: float) -> float:
        q = model.loops.assembled({"left_crank": angle})
        return float(model.energy(q, np.zeros_like(q))[1])

    slope = (potential(0.3 + 1e-5) - potential(0.3 - 1e-5)) / 2e-5
    bare = Model.from_dict(content).loops.rest({"left_crank": 0.3})[1]["left_crank"]
    assert model.loops.rest({"left_crank": 0.3})[1]["left_crank"] == pytest.approx(slope, rel=1e-7)
    assert abs(slope - bare) > 0.1


def test_a_spring_along_a_line_of_no_length_holds_nothing() -> None:
    strut = vpm.Model.load(EXAMPLES / "maxwell_narx" / "strut.toml")
    with pytest.raises(
        vpm.VpmError, match=r"joint `axis` at rest is NaN: a spring acts along a line that has no length"
    ):
        strut.equilibrium([0.0])
