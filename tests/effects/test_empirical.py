"""Forces without a law: what they compute, and what a diagnosis says of physics that the catalogue does not have."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

import vpm
from model_texts import DAMPED_AXIS
from nightly import at_night
from vpm.catalogue import effect_type
from vpm.catalogue.empirical import TERMS
from vpm.discrepancy.remainder.state_dependence import _other_half
from vpm.errors import ModelError
from vpm.numbers import Array

Force = Callable[[Array, Array, Array], Array]

STEP, NOISE = 2e-3, 0.02
SHAPES = {"middle": 0.1, "reach": 0.5, "speed": 2.0, "transition_velocity": 0.05, "period": 0.3}


def everything() -> vpm.Model:
    """All terms at once, with sizes that differ."""
    sizes = {name: 0.1 + 0.05 * k for k, name in enumerate(TERMS)}
    sizes |= {"load_dry": 0.1, "load_cosine": -0.05, "load_sine": 0.07}
    return vpm.Model.from_toml(DAMPED_AXIS).with_effect("empirical_force", at="axis", **SHAPES, **sizes)


def balanced(model: vpm.Model, q: float, v: float, a: float) -> float:
    return float(model.inverse_dynamics(np.array([q]), np.array([v]), np.array([a]))[0])


def by_hand(model: vpm.Model, q: float, v: float, u: float) -> float:
    """The law as the catalogue writes it."""
    x, y = np.clip((q - 0.1) / 0.5, -1.0, 1.0), np.clip(v / 2.0, -1.0, 1.0)
    s, phi = np.tanh(v / 0.05), 2.0 * np.pi * q / 0.3
    names = {"x": x, "y": y, "s": s, "phi": phi, "u": u, "cos": np.cos, "sin": np.sin, "abs": abs}
    total = 0.0
    for name, text in TERMS.items():
        python = text.replace("^", "**").replace("y|y|", "y*abs(y)").replace("|u|", "abs(u)").replace(" ", "*")
        total -= model.parameters[f"axis.empirical.{name}"].value * float(eval(python, names))
    return total


@pytest.mark.parametrize("q", [-3.0, -0.2, 0.1, 0.45, 2.0])
@pytest.mark.parametrize("v", [-5.0, -0.7, -1e-5, 0.0, 0.03, 1.3, 9.0])
@pytest.mark.parametrize("a", [-4.0, 0.5])
def test_the_core_computes_the_law_as_it_is_written(q: float, v: float, a: float) -> None:
    model = everything()
    effort = balanced(model, q, v, a)
    assert 2.0 * a + 3.0 * v == pytest.approx(effort + by_hand(model, q, v, effort), rel=1e-12, abs=1e-12)


def test_forward_and_inverse_dynamics_are_each_others_inverse() -> None:
    model = everything()
    for q, v, a in [(0.2, 0.5, -3.0), (-0.3, -1.1, 2.0), (0.9, 0.01, 0.0)]:
        effort = np.array([balanced(model, q, v, a)])
        assert model.forward_dynamics(np.array([q]), np.array([v]), effort)[0] == pytest.approx(a, abs=1e-12)


def test_outside_of_the_range_it_stays_what_it_is_at_the_edge() -> None:
    model = everything().with_parameters({f"axis.empirical.{n}": 0.0 for n in TERMS if "sine" in n})
    beyond, edge = balanced(model, 1e6, 1e6, 0.0) - 3e6, balanced(model, 0.6, 2.0, 0.0) - 6.0
    share = 0.1  # of the load, which the viscous friction of the model makes large
    assert beyond * (1 - share) == pytest.approx(edge * (1 - share) + 0.1 * (3e6 - 6.0), rel=1e-6)


def test_derivatives_are_exact() -> None:
    model, rows = everything(), 60
    generator = np.random.default_rng(1)
    position = 0.1 + 0.4 * generator.uniform(-1.0, 1.0, (rows, 1))
    velocity, acceleration = generator.normal(0.0, 0.5, (rows, 1)), generator.normal(0.0, 2.0, (rows, 1))
    names = [name for name in model.parameters if "empirical" in name]
    inputs, columns = np.zeros((rows, 1)), [model.index(name) for name in names]
    motion = (position, velocity, acceleration, inputs, STEP)
    _, _, exact = model.core.inverse_dynamics(model.theta, *motion, columns)
    for place, column in enumerate(columns):
        step = np.zeros(model.theta.size)
        step[column] = 1e-6
        ends = [model.core.inverse_dynamics(model.theta + sign * step, *motion, [])[0] for sign in (1.0, -1.0)]
        assert exact[:, 0, place] == pytest.approx((ends[0] - ends[1])[:, 0] / 2e-6, rel=1e-5, abs=1e-6), names[place]


def test_a_file_holds_the_terms_that_are_used_and_no_others() -> None:
    shapes = {name: value for name, value in SHAPES.items() if name != "period"}
    model = vpm.Model.from_toml(DAMPED_AXIS).with_effect("empirical_force", at="axis", **shapes, drag=0.5)
    again = vpm.Model.from_toml(model.to_toml())
    assert [name for name in again.parameters if "empirical" in name] == [
        f"axis.empirical.{name}" for name in ("middle", "reach", "speed", "transition_velocity", "drag")
    ]
    assert again.parameters["axis.empirical.drag"].unit == "N"
    assert "no law of physics" in effect_type("empirical_force").sentence
    with pytest.raises(ModelError, match="needs constant or position"):
        vpm.Model.from_toml(DAMPED_AXIS).with_effect("empirical_force", at="axis", **shapes)


def record(seed: int, force: Force, duration: float = 10.0) -> vpm.Experiment:
    """A multisine with ``2 a + 3 v`` and a force that no catalogue has, by closed forms and not by the simulator."""
    generator = np.random.default_rng(seed)
    time: Array = STEP * np.arange(round(duration / STEP), dtype=np.float64)
    position, velocity, acceleration = (np.zeros(time.size, dtype=np.float64) for _ in range(3))
    for rate in 2.0 * np.pi * generator.uniform(0.15, 1.2, 7):
        size, phase = 0.35 / (1.0 + rate), generator.uniform(0.0, 2.0 * np.pi)
        position += size * np.sin(rate * time + phase)
        velocity += size * rate * np.cos(rate * time + phase)
        acceleration -= size * rate**2 * np.sin(rate * time + phase)
    effort: Array = 2.0 * acceleration + 3.0 * velocity + force(position, velocity, time)
    effort += NOISE * generator.standard_normal(time.size)
    values = {"axis.position": position, "axis.velocity": velocity, "drive.command": effort}
    units = {"axis.position": "m", "axis.velocity": "m/s", "drive.command": "N"}
    return vpm.Experiment.from_arrays(time, values, units=units, name=f"record {seed}")


@cache
def diagnosed(force: Force) -> vpm.Diagnosis:
    model = vpm.Model.from_toml(DAMPED_AXIS)
    known = ["coulomb_friction", "bias_force", "spring", "torque_ripple"]
    return vpm.diagnose(model, [record(1, force), record(2, force)], record(3, force), effects=known)


def gap_ratio(why: vpm.Diagnosis) -> float:
    return why.gap["axis.effort"].after / why.gap["axis.effort"].recalibrated


PLANTED: dict[str, tuple[Force, set[str]]] = {
    "position-dependent friction": (
        lambda q, v, _: 0.8 * (1.0 + np.cos(2.0 * np.pi * q / 0.35 + 1.0)) * np.tanh(v / 1e-3),
        {"s cos(phi)", "s sin(phi)"},
    ),
    "quadratic drag": (lambda _q, v, _t: 2.5 * v * np.abs(v), {"y|y|"}),
    "cubic spring": (lambda q, _v, _t: 8.0 * q**3, {"x^3"}),
}


@pytest.mark.parametrize("name", at_night(PLANTED, but=("quadratic drag",)))
def test_physics_outside_of_the_catalogue_is_described_and_the_gap_shrinks(name: str) -> None:
    force, terms = PLANTED[name]
    why = diagnosed(force)
    assert why.verdict == "unexplained"
    assert why.empirical is not None
    assert why.empirical.formula in why.summary
    assert "no physics" in why.summary
    assert terms <= {term.term for term in why.empirical.terms}
    assert why.empirical.after < 0.5 * why.empirical.before
    assert gap_ratio(why) < 0.5
    assert any(effect.name == "empirical_force" for effect in why.model.effects)
    assert all(np.isfinite(term.std) and term.std > 0.0 for term in why.empirical.terms)


def test_coefficients_are_those_that_were_planted() -> None:
    why = diagnosed(PLANTED["quadratic drag"][0])
    assert why.empirical is not None
    (term,) = [t for t in why.empirical.terms if t.term == "y|y|"]
    speed = why.model.parameters["axis.empirical.speed"].value
    assert term.coefficient == pytest.approx(2.5 * speed**2, rel=0.1)
    assert why.empirical.states["velocity of axis"] > 0.3
    assert why.empirical.alike[0] == next(iter(why.empirical.states))
    assert "position of axis" not in why.empirical.alike


@pytest.mark.nightly
def test_a_formula_beside_a_named_effect_takes_nothing_from_it() -> None:
    why = diagnosed(lambda q, v, _: (1.5 + 0.6 * np.cos(2.0 * np.pi * q / 0.35)) * np.tanh(v / 1e-3))
    assert why.verdict == "effect_found"
    assert [effect.name for effect in why.effects] == ["coulomb_friction"]
    assert why.empirical is not None
    assert why.empirical.formula in why.summary
    assert why.empirical.after < 0.3 * why.empirical.before
    for parameter in why.effects[0].parameters:
        assert why.model.parameters[parameter.dotted].value == parameter.value
    assert {term.dotted for term in why.empirical.terms} | {"axis.friction.coulomb"} <= set(why.fit.names)


@pytest.mark.nightly
def test_a_rhythm_in_time_is_told_in_words_and_made_no_law() -> None:
    why = diagnosed(lambda _q, _v, t: 0.8 * np.sin(2.0 * np.pi * 3.3 * t + 0.4))
    assert why.verdict == "unexplained"
    assert why.empirical is not None
    assert "repeats every 0.303 s whatever the machine does" in why.summary
    assert not why.empirical.formula
    assert not any(effect.name == "empirical_force" for effect in why.model.effects)


def test_a_line_whose_phase_wanders_is_no_rhythm() -> None:
    generator, time = np.random.default_rng(3), np.arange(0.0, 20.0, 0.01)
    beat = np.sin(2.0 * np.pi * 4.0 * time)
    # Noise through a lightly damped mode at the same frequency, which forgets within about a second.
    root = np.exp((-1.0 + 2j * np.pi * 4.0) * 0.01)
    ringing = lfilter([1.0], [1.0, -2.0 * root.real, abs(root) ** 2], generator.standard_normal(time.size))
    for values, least, most in ((beat, 0.95, 1.0), (ringing / np.std(ringing), -np.inf, 0.1)):
        noisy = values + 0.1 * generator.standard_normal(time.size)
        left = _other_half(time, noisy, 4.0)
        assert least < 1.0 - left / float(noisy @ noisy) < most


@pytest.mark.nightly
def test_a_drift_in_time_is_told_in_words_and_made_no_law() -> None:
    why = diagnosed(
        lambda _q, v, t: (2.5 - 2.0 * np.minimum(t / 6.0, 1.0)) * np.tanh(v / 1e-3) - 1.5 * np.tanh(v / 1e-3)
    )
    assert why.empirical is not None
    assert "drifts" in why.empirical.remark
    assert not any(effect.name == "empirical_force" for effect in why.model.effects)


def test_nothing_is_described_where_nothing_is_missing() -> None:
    why = diagnosed(lambda q, _v, _t: np.zeros_like(q))
    assert why.verdict in {"no_disagreement", "parameters_only"}
    assert why.empirical is None
