"""Effects on the motor side and on the link side of a compliant joint: against equations of two masses by SciPy."""

from functools import cache
from typing import Literal

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nightly import at_night
from quotients import of_residual
from test_split_joints import ARM, SPLITS, J, K, L, commanded, slide
from vpm import Model
from vpm.errors import ModelError
from vpm.identify import InverseDynamicsProblem
from vpm.numbers import Array
from vpm.simplify import reductions

#: Damping of the spring, N s/m.
D = 8.0

Side = Literal["motor", "link"]
SIDES: tuple[Side, Side] = ("motor", "link")

#: Effects with parameters that matter beside the command.
EFFECTS: dict[str, dict[str, float]] = {
    "viscous_friction": {"viscous": 30.0},
    "coulomb_friction": {"coulomb": 5.0, "transition_velocity": 0.02},
    "asymmetric_friction": {"coulomb_difference": 4.0, "viscous_difference": 6.0, "transition_velocity": 0.02},
    "stribeck_friction": {"stribeck": 6.0, "stribeck_velocity": 0.1, "transition_velocity": 0.02},
    "bias_force": {"force": 3.0},
    "spring": {"stiffness": 400.0, "rest": 0.01},
    "torque_ripple": {"period": 0.03, "cosine": 3.0, "sine": -2.0},
    "end_stop": {"stiffness": 2e4, "damping": 0.0, "low": -1.0, "high": 0.02, "width": 1e-3},
}


def effort(name: str, q: float, v: float) -> float:
    """Their laws once more, at the coordinate and rate of the side where they sit."""
    dry, wave = np.tanh(v / 0.02), 2.0 * np.pi * q / 0.03
    laws = {
        "viscous_friction": 30.0 * v,
        "coulomb_friction": 5.0 * dry,
        "asymmetric_friction": (2.0 * dry + 3.0 * v) * dry,
        "stribeck_friction": 6.0 * dry * np.exp(-((v / 0.1) ** 2)),
        "bias_force": 3.0,
        "spring": 400.0 * (q - 0.01),
        "torque_ripple": 3.0 * np.cos(wave) - 2.0 * np.sin(wave),
        "end_stop": 1e4 * (q - 0.02 + np.hypot(q - 0.02, 1e-3)) - 1e4 * (-1.0 - q + np.hypot(q + 1.0, 1e-3)),
    }
    return float(-laws[name])


def elastic(damping: float = D) -> Model:
    return slide().with_effect("joint_compliance", at="axis", stiffness=K, damping=damping, inertia=J)


def rubbing_on_both_sides() -> Model:
    """Friction on either side and what else has a side behind the spring, with little stiction beside the command."""
    model = elastic().with_effect("coulomb_friction", at="axis", coulomb=2.0, transition_velocity=0.02)
    for name, values in EFFECTS.items():
        model = model.with_effect(name, at="axis", side="link", **values)
    return model.with_effect("hysteresis", at="axis", side="link", force=4.0, displacement=2e-3)


def force(time: float) -> float:
    return float(20.0 * np.sin(13.0 * time) + 6.0 * np.cos(29.0 * time))


@cache
def witness(on_motor: tuple[str, ...], on_link: tuple[str, ...]) -> Array:
    """Two masses in places of their own, motor and link, by an adaptive implicit solver."""

    def rates(time: float, y: Array) -> list[float]:
        q, link, v, w = y
        spring = K * (q - link) + D * (v - w)
        motor_side = sum(effort(name, q, v) for name in on_motor)
        link_side = sum(effort(name, link, w) for name in on_link)
        return [v, w, (force(time) - spring + motor_side) / J, (spring + link_side) / L]

    found = solve_ivp(rates, (0.0, TIMES[-1]), np.zeros(4), "Radau", TIMES, rtol=1e-10, atol=1e-12, max_step=1e-3)
    return np.asarray(found.y.T)


def run(model: Model, times: Array, integrator: str = "rosenbrock", substeps: int = 1) -> Array:
    """Places and rates of motor and link, under a command that moves between samples as a straight line does."""
    states = model.core.n_states
    fine = 1e-4 * np.arange(10 * (len(times) - 1) + 1)
    # Held in the middle of a step, a command is right to second order.
    held = np.array([[force(t + 0.5e-4)] for t in fine])
    _, found, _ = model.core.simulate(model.theta, np.zeros(states), held, 1e-4, substeps, integrator, [])
    q, d, v, rate = found[::10, :4].T
    return np.stack([q, q + d, v, v + rate], axis=1)


TIMES: Array = np.linspace(0.0, 0.4, 401)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("name", at_night(EFFECTS, but=("coulomb_friction", "end_stop", "torque_ripple")))
def test_each_law_acts_on_its_side(name: str, side: Side) -> None:
    model = elastic().with_effect(name, at="axis", side=side, **EFFECTS[name])
    expected = witness((name,), ()) if side == "motor" else witness((), (name,))
    size = np.abs(expected).max(axis=0)
    assert np.abs(run(model, TIMES) - expected).max(axis=0) / size == pytest.approx(np.zeros(4), abs=2e-4)
    # On the other side it would be another motion.
    other = elastic().with_effect(name, at="axis", side="link" if side == "motor" else "motor", **EFFECTS[name])
    assert np.max(np.abs(run(other, TIMES) - expected) / size) > 2e-3


@pytest.mark.parametrize("integrator", ["rk4", "semi_implicit", "linearly_implicit", "additive", "rosenbrock"])
def test_friction_on_both_sides_by_every_method(integrator: str) -> None:
    behind, both = ("coulomb_friction", "viscous_friction", "spring"), elastic()
    both = both.with_effect("coulomb_friction", at="axis", **EFFECTS["coulomb_friction"])
    for name in behind:
        both = both.with_effect(name, at="axis", side="link", **EFFECTS[name])
    expected = witness(("coulomb_friction",), behind)
    first_order = integrator in {"semi_implicit", "linearly_implicit"}
    error = np.abs(run(both, TIMES, integrator, 4) - expected).max(axis=0) / np.abs(expected).max(axis=0)
    assert error.max() < (1e-2 if first_order else 2e-4)


@pytest.mark.parametrize("integrator", ["rosenbrock", "additive"])
def test_breakaway_goes_through_the_spring(integrator: str) -> None:
    dry, creep, time = 10.0, 1e-5, np.linspace(0.0, 2.0, 2001)
    values = {"coulomb": dry, "transition_velocity": creep}
    model = elastic(60.0).with_effect("coulomb_friction", at="axis", side="link", **values)
    for share in (0.9, 1.1):
        # Slowly up within a second, then held.
        held = share * dry * np.minimum(time, 1.0)[:, None]
        _, states, _ = model.core.simulate(model.theta, np.zeros(4), held, 1e-3, 2, integrator, [])
        q, d, _, _ = states[-1]
        if share > 1.0:
            # Both masses together, by what the friction does not bear.
            assert q + d == pytest.approx(0.5 * (share - 1.0) * dry / (J + L), rel=0.1)
        else:
            # The motor stands where the spring holds it; the rounded law creeps at atanh(share) transition velocities.
            assert d == pytest.approx(-share * dry / K, rel=1e-3)
            assert 0.0 < q + d < 2.0 * np.arctanh(share) * creep
    before = elastic(60.0).with_effect("coulomb_friction", at="axis", **values)
    held = 0.9 * dry * np.minimum(time, 1.0)[:, None]
    _, states, _ = before.core.simulate(before.theta, np.zeros(4), held, 1e-3, 2, integrator, [])
    # Before the spring the motor itself is held, and nothing deflects.
    assert np.abs(states[-1][0]) < 2.0 * np.arctanh(0.9) * creep
    assert np.abs(states[-1][1]) < 1e-5


def test_what_is_put_in_is_kept_or_rubbed_away() -> None:
    model = elastic(0.0)
    for name in ("spring", "torque_ripple", "end_stop", "bias_force", "viscous_friction", "coulomb_friction"):
        model = model.with_effect(name, at="axis", side="link", **EFFECTS[name])
    step, rows = 1e-4, 4000
    held = np.array([[force(step * (k + 0.5))] for k in range(rows)])
    _, states, _ = model.core.simulate(model.theta, np.zeros(4), held, step, 2, "rosenbrock", [])
    energies = np.array([sum(model.energy(x[:2], x[2:4])) for x in states])
    way = np.diff(states[:, 0])
    rate = states[:, 2] + states[:, 3]
    lost = -rate * np.array([effort("viscous_friction", 0.0, w) + effort("coulomb_friction", 0.0, w) for w in rate])
    rubbed = np.concatenate([[0.0], np.cumsum(0.5 * (lost[1:] + lost[:-1]) * step)])
    put_in = np.concatenate([[0.0], np.cumsum(held[:-1, 0] * way)])
    assert rubbed[-1] > 0.3 * np.abs(put_in).max()
    assert energies - energies[0] + rubbed == pytest.approx(put_in, abs=1e-4 * np.abs(put_in).max())


def test_linear_models_and_efforts_have_both_entries() -> None:
    model = elastic(0.0).with_effect("viscous_friction", at="axis", side="link", viscous=30.0)
    # J q'' = -K (q - l), L l'' = K (q - l) - 30 l', with d = l - q.
    expected = np.zeros((4, 4))
    expected[:2, 2:] = np.eye(2)
    expected[2, 1], expected[3, 1], expected[3, 2:] = K / J, -K / J - K / L, -30.0 / L
    found = model.linearize().A
    assert found == pytest.approx(expected, abs=1e-9)
    q, v, a = np.array([0.1, 0.01]), np.array([0.4, -0.1]), np.array([2.0, 3.0])
    efforts = model.inverse_dynamics(q, v, a)
    link = L * a.sum() + 30.0 * v.sum()
    assert efforts == pytest.approx([J * a[0] + link, link + K * q[1]])


def test_along_a_measured_motion_the_balance_vanishes() -> None:
    truth = elastic().with_effect("coulomb_friction", at="axis", side="link", coulomb=5.0, transition_velocity=0.02)
    data = InverseDynamicsProblem(slide(), [commanded(truth)], cutoff=150.0)
    with_it, slopes = data.evaluate(truth, truth.theta, list(range(len(truth.theta))))
    without, _ = data.evaluate(slide(), slide().theta)
    assert np.linalg.norm(with_it) < 0.01 * np.linalg.norm(without)
    column = truth.index("axis.link.friction.coulomb")
    difference = of_residual(data, truth, column, 1e-4)
    assert np.linalg.norm(difference - slopes[:, column]) < 1e-4 * np.linalg.norm(difference)


def test_files_names_and_states_keep_the_sides_apart() -> None:
    model = rubbing_on_both_sides()
    again = Model.from_toml(model.to_toml())
    assert again == model
    assert [effect.side for effect in again.effects] == ["motor", "motor", *["link"] * (len(EFFECTS) + 1)]
    assert {"axis.friction.coulomb", "axis.link.friction.coulomb"} <= set(model.parameters)
    assert model.internal_names == ("axis.link.memory",)
    assert model.to_toml().count('side = "link"') == len(EFFECTS) + 1
    fewer = model.without_effect("coulomb_friction", at="axis", side="link")
    assert "axis.friction.coulomb" in fewer.parameters
    assert "axis.link.friction.coulomb" not in fewer.parameters
    assert model.effect("coulomb_friction", "axis").parameter_names["coulomb"] == "axis.friction.coulomb"
    left_out = {str(change) for changes in reductions(model).values() for change in changes}
    assert {"without coulomb_friction at axis", "without coulomb_friction at axis, link side"} <= left_out
    with pytest.raises(ModelError, match="axis, link side"):
        fewer.without_effect("coulomb_friction", at="axis", side="link")
    with pytest.raises(ModelError, match="second coulomb_friction"):
        model.with_effect("coulomb_friction", at="axis", side="link", coulomb=1.0)


def test_without_a_spring_both_sides_are_the_same() -> None:
    arm = Model.from_toml(ARM)
    before, behind = (arm.with_effect("coulomb_friction", at="elbow", side=side, coulomb=3.0) for side in SIDES)
    q, v, a = [0.3, 0.7], [0.2, -0.4], [1.0, 2.0]
    assert before.inverse_dynamics(q, v, a) == pytest.approx(behind.inverse_dynamics(q, v, a), rel=1e-15)
    play = slide().with_effect("backlash", at="axis", **SPLITS["backlash"])
    assert play.with_effect("viscous_friction", at="axis", side="link", viscous=1.0).joints == play.joints


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        ({"type": "joint_compliance", "side": "link", "stiffness": K, "inertia": J}, "has no sides; leave the key out"),
        ({"type": "viscous_friction", "side": "left", "viscous": 1.0}, "side"),
    ],
)
def test_sides_that_are_none_are_refused(effect: dict[str, object], words: str) -> None:
    content = slide().to_dict()
    content["effects"] = [{"at": "axis", **effect}]
    with pytest.raises(ModelError, match=words):
        Model.from_dict(content)
