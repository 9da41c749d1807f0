"""Effects of joints that no search tries: in every mode of a simulation, along records, in fits and files."""

from typing import Literal

import numpy as np
import pytest

from places import EXAMPLES
from quotients import of_residual
from test_sides import TIMES, elastic, force
from test_split_joints import commanded, slide
from vpm import EFFECTS, Experiment, Model, simulate
from vpm.errors import ModelError
from vpm.identify import InverseDynamicsProblem, identify

#: Values that matter beside forces of 20 N on 2 kg.
VALUES: dict[str, dict[str, float]] = {
    "quadratic_drag": {"drag": 25.0},
    "cubic_spring": {"stiffness": 2e4, "rest": 0.01},
    "position_dependent_friction": {"period": 0.04, "cosine": 2.0, "sine": -3.0, "transition_velocity": 0.02},
    "current_ripple": {"period": 0.03, "cosine": 0.2, "sine": -0.1},
    "load_dependent_friction": {"driving": 0.25, "driven": 0.15, "transition_velocity": 0.02},
    "lugre_friction": {
        "coulomb": 5.0,
        "damping": 4.0,
        "displacement": 2e-3,
        "excess": 0.4,
        "stribeck_velocity": 0.05,
    },
    "warming_friction": {"coulomb": 5.0, "viscous": 20.0, "time_constant": 0.2, "transition_velocity": 0.02},
}


def with_one(name: str) -> Model:
    return slide().with_effect(name, at="axis", **VALUES[name])


def geared() -> Model:
    """All of them at one compliant joint, those that have sides on both."""
    model = elastic()
    for name, values in VALUES.items():
        model = model.with_effect(name, at="axis", **values)
        if EFFECTS[name].has_sides:
            model = model.with_effect(name, at="axis", side="link", **values)
    return model


def record(model: Model, step: float = 5e-4) -> Experiment:
    """Its motion under a command that is the same for all, in small steps."""
    time = np.arange(0.0, 0.8, step)
    command = np.array([force(t) for t in time])
    _, states, _ = model.core.simulate(
        model.theta, np.zeros(model.core.n_states), command[:, None], step, 8, "rosenbrock", []
    )
    values = {"axis.position": states[:, 0], "drive.command": command}
    return Experiment.from_arrays(time, values, model=model, name="run")


@pytest.mark.parametrize("name", VALUES)
def test_methods_agree_on_the_motion(name: str) -> None:
    model = with_one(name)
    held = np.array([[force(t)] for t in TIMES])
    found = {}
    for integrator in ("rk4", "semi_implicit", "linearly_implicit", "additive", "rosenbrock"):
        start = np.zeros(model.core.n_states)
        found[integrator] = model.core.simulate(model.theta, start, held, 1e-3, 20, integrator, [])[1]
    size = np.abs(found["rk4"]).max(axis=0)
    for integrator, states in found.items():
        first_order = integrator in {"semi_implicit", "linearly_implicit"}
        assert np.max(np.abs(states - found["rk4"]) / size) < (1e-2 if first_order else 1e-4), integrator


@pytest.mark.parametrize("name", VALUES)
def test_along_a_record_the_balance_vanishes_and_knows_its_slopes(name: str) -> None:
    truth, bare = with_one(name), slide()
    data = InverseDynamicsProblem(bare, [record(truth)], cutoff=150.0)
    columns = [truth.index(dotted) for dotted in truth.effects[0].parameter_names.values()]
    with_it, slopes = data.evaluate(truth, truth.theta, columns)
    without, _ = data.evaluate(bare, bare.theta)
    assert np.linalg.norm(with_it) < 0.03 * np.linalg.norm(without)
    for place, column in enumerate(columns):
        # Few samples see a transition velocity: over a short step the difference would be rounding alone.
        share = 1e-3 if "transition" in truth.parameter_names[column] else 1e-5
        difference = of_residual(data, truth, column, share * truth.theta[column])
        assert np.linalg.norm(difference - slopes[:, place]) < 1e-4 * np.linalg.norm(difference)


@pytest.mark.parametrize("name", VALUES)
def test_fits_find_the_sizes_again(name: str) -> None:
    truth = with_one(name)
    sizes = [
        dotted for short, dotted in truth.effects[0].parameter_names.items() if not EFFECTS[name].parameter(short).shape
    ]
    start = truth.with_parameters({dotted: 0.7 * truth.parameters[dotted].value for dotted in sizes})
    fit = identify(start, record(truth), sizes, mode="free_run")
    for dotted in sizes:
        assert fit.model.parameters[dotted].value == pytest.approx(truth.parameters[dotted].value, rel=0.05), dotted


@pytest.mark.parametrize("name", ["lugre_friction", "warming_friction"])
def test_runs_that_start_within_a_record_remember_what_was_before(name: str) -> None:
    model = with_one(name)
    data = record(model)
    run = simulate(model, data, "restarts", horizon=0.05)
    whole = simulate(model, data, "free_run")
    place = run.channels.index("axis.position")
    gap = np.nanmax(np.abs(run["axis.position"] - run.measured[:, place]))
    assert gap < 0.02 * np.ptp(whole["axis.position"])
    assert model.internal_names == (f"axis.{EFFECTS[name].memory}",)


@pytest.mark.parametrize("name", ["lugre_friction", "warming_friction"])
@pytest.mark.parametrize("side", ["motor", "link"])
def test_what_remembers_leaves_no_residual_on_either_side_of_a_spring(
    name: str, side: Literal["motor", "link"]
) -> None:
    """A motion that is prescribed at the motor carries memories along, also of what nobody measures."""
    truth = elastic().with_effect(name, at="axis", side=side, **VALUES[name])
    data = InverseDynamicsProblem(slide(), [commanded(truth)], cutoff=150.0)
    left, without, rigid = (np.linalg.norm(data.evaluate(m, m.theta)[0]) for m in (truth, elastic(), slide()))
    assert left < 0.01 * rigid
    assert left < 0.1 * without


def test_the_cold_joint_is_cold_at_the_first_sample_alone() -> None:
    model = with_one("warming_friction")
    path = np.zeros((5, 1))
    warmth = model.core.memories(model.theta, path, 0.1)[:, 0]
    assert warmth == pytest.approx(1.0 - np.exp(-0.5 * np.arange(5)), rel=1e-12)


def test_files_keep_them() -> None:
    model = geared()
    assert Model.from_toml(model.to_toml()) == model
    assert len(set(model.internal_names)) == 4


def test_what_knows_the_load_has_no_sides() -> None:
    with pytest.raises(ModelError, match="has no sides"):
        geared().with_effect("load_dependent_friction", at="axis", side="link", driving=0.1)


def test_what_knows_the_load_needs_an_actuator_on_its_joint() -> None:
    """One that closes a line beside the joint loads it, too, but not the law."""
    with pytest.raises(ModelError, match='is "knee_rotation", on which no actuator acts itself'):
        Model.load(EXAMPLES / "hyl" / "hydraulic.toml").with_effect(
            "load_dependent_friction", at="knee_rotation", driving=0.1
        )
