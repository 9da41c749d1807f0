"""Intervals and warnings of fits on the machines of `benches/coverage.py`, and the statistics that they rest on."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import f as fisher

from nightly import at_night
from places import ROOT, script
from vpm.identify import Checks, Fit, InverseDynamicsProblem, identify
from vpm.identify.closed_loop_prediction import own_residual
from vpm.identify.problem import Block
from vpm.identify.settings import OwnSimulation
from vpm.identify.statistics import freedom, white_sandwich
from vpm.identify.whiteness import explained_by, heard, powers, shifted, waves

BENCHES = ROOT / "benches"
MACHINES = ("axis", "flexible_arm", "leg", "cart")
#: All but the quickest are left to the night.
EACH = at_night(MACHINES, but=("axis",))


machines = script(BENCHES / "coverage_machines.py")
study = script(BENCHES / "coverage.py")


def fits(machine: str, seeds: Sequence[int], lacking: int) -> list[tuple[Fit, NDArray[np.bool_]]]:
    """Fits of these seeds, and which of their intervals hold the truth."""
    found = []
    for seed in seeds:
        case = study.drawn(machines.MACHINES[machine], seed, lacking)
        fit = identify(case.model, case.log, case.free)
        truth = np.array([case.truth[name] for name in fit.names])
        found.append((fit, (fit.intervals[:, 0] <= truth) & (truth <= fit.intervals[:, 1])))
    return found


def suspects(fit: Fit) -> bool:
    return any("an effect may be missing" in sentence for sentence in fit.warnings)


@pytest.mark.parametrize("machine", EACH)
def test_intervals_of_a_complete_model_hold_and_nothing_is_suspected(machine: str) -> None:
    """Of some forty intervals at 95 %, a quarter misses with a chance below 1e-4, were they independent."""
    found = fits(machine, range(8), lacking=0)
    held = np.concatenate([inside for _, inside in found])
    assert np.mean(held) > 0.75
    assert sum(suspects(fit) for fit, _ in found) <= 1


@pytest.mark.parametrize("machine", EACH)
def test_a_model_that_lacks_an_effect_is_warned_of(machine: str) -> None:
    assert sum(not fit.warnings for fit, _ in fits(machine, range(6), lacking=1)) <= 1


# ---- the statistics --------------------------------------------------------------------------------------------------


def block(samples: int) -> Block:
    return Block("log", "axis.effort", "N", slice(0, samples), np.arange(1.0 * samples), 1.0, 1.0, np.ones(samples))


def test_an_arm_that_bends_and_rings_where_its_log_begins_is_found_in_free_run() -> None:
    """Its modulus and moment of inertia ended 15 and 45 deviations away on the tangent at a rest."""
    quiet = replace(machines.MACHINES["flexible_arm"], effects=(), command_noise=0.0, seconds=4.0)
    for seed in (1, 2):
        case = study.drawn(quiet, seed, lacking=0)
        fit = identify(case.model, case.log, case.free, mode="free_run")
        truth = np.array([case.truth[name] for name in fit.names])
        assert np.all(np.abs(fit.values - truth) < 4.0 * fit.std)
        assert np.all(fit.std < 2e-3 * truth)


def test_equal_samples_have_the_freedom_of_bartletts_weights() -> None:
    """Of 1000 samples of one sign, with the seven lags of the automatic rule: 3/2 n / (lags + 1)."""
    assert freedom(np.ones((1000, 1)), [block(1000)], 0)[0] == pytest.approx(1500.0 / 8.0, rel=0.03)


def test_what_a_few_moments_decide_has_few_degrees_of_freedom() -> None:
    jacobian = np.full((1000, 2), 1e-6)
    jacobian[:, 0] = 1.0
    jacobian[100:1000:180, 1] = 1.0
    whole, rare = freedom(jacobian, [block(1000)], 2)
    assert whole > 100.0
    assert rare == pytest.approx(5.0, rel=0.1)


def test_intervals_of_what_few_samples_decide_cover() -> None:
    """Six samples of 200 decide one column: normal quantiles hold the truth in far less than 95 %, Student's in it."""
    random, jacobian = np.random.default_rng(5), np.zeros((200, 1))
    jacobian[10::34, 0] = 1.0
    (few,) = freedom(jacobian, [block(200)], 1)
    errors, deviations = [], []
    for noise in random.standard_normal((2000, 200)):
        estimate = (jacobian[:, 0] @ noise) / (jacobian[:, 0] @ jacobian[:, 0])
        errors.append(estimate)
        deviations.append(np.sqrt(white_sandwich(jacobian, noise - jacobian[:, 0] * estimate)[0, 0]))
    ratio = np.abs(np.array(errors) / np.array(deviations))
    assert few == pytest.approx(6.0, rel=0.05)
    assert np.mean(ratio < 1.96) < 0.94
    assert 0.93 < np.mean(ratio < np.sqrt(fisher.ppf(0.95, 1.0, few))) < 0.98


def test_noise_that_is_larger_where_friction_turns_round_is_no_law() -> None:
    """Errors at reversals of speed, under laws of speed: an F test of level 1e-3 takes one in seven for such a law."""
    random, n = np.random.default_rng(1), 400
    speed = np.sin(2.0 * np.pi * np.arange(n) / 67.0)
    size, counts = np.where(np.abs(speed) < 0.1, 1.0, 0.02), np.ones(n, dtype=bool)
    chances = [
        explained_by(size * random.standard_normal(n), np.ones((n, 1)), powers(speed), counts)[1] for _ in range(200)
    ]
    assert np.mean(np.array(chances) < 1e-3) <= 0.02


def test_ripple_of_any_period_is_found_among_waves() -> None:
    """27.4 waves over the range of a position, at half the size of the noise."""
    random, n = np.random.default_rng(2), 600
    position = np.sin(2.0 * np.pi * np.arange(n) / 311.0)
    residual = 0.5 * np.sin(2.0 * np.pi * 13.7 * position) + random.standard_normal(n)
    groups, counts = waves(position, Checks().waves, Checks().waves_each), np.ones(n, dtype=bool)
    chances = [explained_by(residual, np.ones((n, 1)), group, counts)[1] for group in groups]
    assert min(chances) < 1e-4
    assert int(np.argmin(chances)) == 6


def driven(noise: NDArray[np.float64], late: float) -> float:
    """Chance of a residual in which a mass under a controller, 7 s at 17 Hz, hears its drive so many samples late.

    Mass and friction are fitted: what the drive is told is their forces, and less than these by what it does untold.
    """
    time = np.arange(noise.size)
    turns = np.outer(time, np.array([0.13, 0.21, 0.34, 0.5])) + np.arange(4.0)
    slopes = np.column_stack([np.sum(np.cos(turns), axis=1), np.sum(np.sin(turns), axis=1)])
    force = slopes @ np.array([1.0, 0.3])
    told = force - noise + late * np.gradient(force)
    residual = told - force
    residual -= slopes @ np.linalg.lstsq(slopes, residual, rcond=None)[0]
    counts = np.ones(noise.size, dtype=bool)
    clear = Checks().clear / float(np.sqrt(np.mean(force**2)))
    found = heard(shifted(told), residual, slopes, counts, clear)
    return explained_by(residual, slopes, found, counts)[1] if found.size else 1.0


def test_an_effort_that_is_all_fitted_explains_no_residual() -> None:
    """What is left of it beside the fitted forces is the residual itself; beside those of a late drive it is not."""
    noises = 0.006 * np.random.default_rng(6).standard_normal((100, 120))
    assert min(driven(noise, 0.0) for noise in noises) > Checks().level
    assert max(driven(noise, 0.05) for noise in noises) < Checks().level


# ---- the model's own simulation --------------------------------------------------------------------------------------


@pytest.mark.parametrize("machine", ["flexible_arm", "leg"])
def test_links_and_cylinders_are_compared_with_their_own_simulation(machine: str) -> None:
    """With dry friction in both, what is expected is known, and what is left at the truth comes nearer to noise."""
    effects = tuple(e for e in machines.MACHINES[machine].effects if e.name == "coulomb_friction")
    quiet = {**vars(machines.MACHINES[machine]), "effects": effects, "command_noise": 0.0}
    case = next(c for seed in range(20) if (c := study.drawn(machines.Machine(**quiet), seed, 0)).present)
    true = case.model.with_parameters(dict(case.truth))
    data = InverseDynamicsProblem(true, [case.log])
    own, left = own_residual(true, data), data.evaluate(true, true.theta)[0]
    assert own is not None
    rows = data.blocks[0].samples
    assert np.std((left - own.expected)[rows]) < 0.9 * np.std(left[rows])


def test_noise_that_a_balance_is_linear_in_leaves_no_trace_in_what_is_expected() -> None:
    """The mean of pairs; a pair more changes next to nothing."""
    case = study.drawn(machines.MACHINES["axis"], 3, 0)
    true = case.model.with_parameters(dict(case.truth))
    data = InverseDynamicsProblem(true, [case.log])
    one, other = (own_residual(true, data, OwnSimulation(pairs=2), seed) for seed in (0, 1))
    assert one is not None
    assert other is not None
    assert np.std(one.expected - other.expected) < 0.1 * np.std(data.evaluate(true, true.theta)[0] - one.expected)


@pytest.mark.parametrize("machine", ["flexible_arm", "leg"])
def test_the_noise_of_drives_is_seen_in_what_they_move(machine: str) -> None:
    """Three logs each; sensors and the drive are as noisy as the simulation that wrote them was told."""
    planted = machines.MACHINES[machine]
    for seed in (1, 2, 3):
        case = study.drawn(planted, seed, 0)
        true = case.model.with_parameters(dict(case.truth))
        own = own_residual(true, InverseDynamicsProblem(true, [case.log]))
        assert own is not None
        assert np.max(own.noise.drives) == pytest.approx(planted.command_noise, rel=0.3)
        for channel, level in planted.noise.items():
            assert own.noise.instruments[0, case.log.channels.index(channel)] == pytest.approx(level, rel=0.1)
