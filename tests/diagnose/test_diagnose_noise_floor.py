"""The floor of a gap, what counts as structure, and how a diagnosis ends: small cases with a known answer."""

import numpy as np
import pytest

from synthetic import Truth, nominal, simulate_axis
from vpm.diagnosing import diagnose
from vpm.discrepancy.noise.noise_floor import structure, white_level
from vpm.identify import InverseDynamicsProblem


def test_white_level_is_that_of_white_noise() -> None:
    generator = np.random.default_rng(1)
    levels = [white_level(0.3 * generator.standard_normal(400), np.ones(400)) for _ in range(200)]
    # White up to the Nyquist frequency, of which the retained band is four fifths of the power.
    assert np.mean(levels) == pytest.approx(0.3 * np.sqrt(0.8), rel=0.05)


def test_white_level_does_not_see_a_line_or_a_drift() -> None:
    generator = np.random.default_rng(2)
    time = np.arange(400)
    noise = 0.3 * generator.standard_normal(400)
    clear = noise + 5.0 * np.sin(0.2 * time) + 0.02 * time
    alone, beside = (white_level(x, np.ones(400)) for x in (noise, clear))
    assert beside == pytest.approx(alone, rel=0.15)
    assert np.std(clear) > 10.0 * beside


def test_white_level_of_what_never_moves_is_zero() -> None:
    assert white_level(np.zeros(100), np.zeros(100)) == 0.0


def test_ends_of_a_record_leave_no_ringing() -> None:
    """With the true parameters the ends of the balance are no worse than its middle."""
    (record,) = simulate_axis(Truth(mass=20.0, viscous=60.0), 1, 16.0, first_seed=3)
    model = nominal()
    problem = InverseDynamicsProblem(model, [record])
    residual, _ = problem.evaluate(model, model.theta)
    (block,) = problem.blocks
    counted = residual[block.moving > 0.0]
    ends = np.concatenate([counted[:8], counted[-8:]])
    assert np.abs(ends).max() < 2.0 * np.abs(counted[8:-8]).max()


def test_noise_is_no_structure_and_what_follows_the_effort_is() -> None:
    train, test = simulate_axis(Truth(mass=20.0, viscous=60.0), 2, 16.0, first_seed=5)
    model = nominal()
    problems = [InverseDynamicsProblem(model, [record]) for record in (train, test)]
    generator = np.random.default_rng(7)
    sizes = [problem.blocks[0].samples.stop for problem in problems]
    white = [generator.standard_normal(size) for size in sizes]
    assert not structure(model, problems[0], problems[1], white[0], white[1]).present
    efforts = [problem.effort(model, model.theta, 0)[1][:, 0] for problem in problems]
    growing = [noise * np.abs(effort) for noise, effort in zip(white, efforts, strict=True)]
    assert structure(model, problems[0], problems[1], growing[0], growing[1]).growing > 3.0
    friction = [np.abs(e) * np.sign(p.state(0)[1][:, 0]) for p, e in zip(problems, efforts, strict=True)]
    assert structure(model, problems[0], problems[1], friction[0], friction[1]).present


def test_a_name_that_leaves_most_open_is_no_explanation() -> None:
    train, test = simulate_axis(Truth(cubic=3000.0), 2, 16.0, first_seed=17)
    diagnosis = diagnose(nominal(), train, test, effects=["spring", "bias_force"])
    assert diagnosis.verdict == "unexplained"


def test_one_processor_finds_what_many_find() -> None:
    train, test = simulate_axis(Truth(bias=5.0), 2, 12.0, first_seed=9)
    effects = ["bias_force", "spring", "dead_zone"]
    many = diagnose(nominal(), train, test, effects=effects, workers=3)
    one = diagnose(nominal(), train, test, effects=effects, workers=1)
    assert [(e.name, e.gain) for e in many.effects] == [(e.name, e.gain) for e in one.effects]
    assert many.model.theta.tolist() == one.model.theta.tolist()
