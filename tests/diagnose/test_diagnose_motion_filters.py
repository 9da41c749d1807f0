"""Filters of a diagnosis: states as quick as their noise allows, and the same band."""

import numpy as np
import pytest

from synthetic import Truth, nominal, simulate_axis
from vpm.discrepancy.preparation import filters, quickest
from vpm.discrepancy.settings import QUICKER
from vpm.experiment import Experiment, choose_cutoff, motion
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model

DRY = Truth(mass=20.0, viscous=60.0, coulomb=20.0)


def exact() -> Model:
    """The model that has what `simulate_axis` simulates."""
    return nominal().with_effect("coulomb_friction", at="axis", coulomb=20.0, transition_velocity=1e-3)


def test_the_band_is_kept_apart_from_the_filter() -> None:
    (record,) = simulate_axis(DRY, 1, 16.0, first_seed=3)
    as_ever, given = motion(record, nominal(), cutoff=10.0), motion(record, nominal(), cutoff=40.0, band=4.0)
    assert given.decimation == as_ever.decimation
    assert given.band == as_ever.band == pytest.approx(4.0, rel=0.02)
    np.testing.assert_array_equal(given.position, motion(record, nominal(), cutoff=40.0).position)


def test_dry_friction_closes_the_balance_along_quicker_states() -> None:
    """The exact model leaves little more than half in the same band: a smooth motion passes through rest too slowly."""
    records = simulate_axis(DRY, 2, 16.0, first_seed=3)
    model = exact()
    slow = InverseDynamicsProblem(model, records, cutoff=[8.0, 8.0])
    states, bands = filters(model, slow, None)
    quick = InverseDynamicsProblem(model, records, cutoff=states, band=bands)
    assert all(8.0 < one <= QUICKER * 8.0 for one in states)
    assert [m.decimation for m in quick.motions] == [m.decimation for m in slow.motions]
    left = [float(np.std(problem.evaluate(model, model.theta)[0])) for problem in (slow, quick)]
    assert left[1] < 0.6 * left[0]


def test_noise_of_the_velocity_stays_below_standstill() -> None:
    """Of white noise, what passes the filter has at most half of the speed below which a joint counts as standing."""
    rate, time = 1000.0, 1e-3 * np.arange(20000)
    place = 0.5 * np.sin(2 * np.pi * 0.5 * time)
    noise = 1e-3 * np.random.default_rng(5).standard_normal(time.size)
    data, units = {"axis.position": place + noise, "drive.command": 0.0 * time}, {"axis.position": "m"}
    record = Experiment.from_arrays(time, data, units={**units, "drive.command": "V"}, name="noisy")
    m = motion(record, nominal(), cutoff=choose_cutoff(record["axis.position"][:, None], rate).cutoff)
    highest = quickest(record, m, ("axis",))
    spectrum = np.abs(np.fft.rfft(noise)) ** 2 / noise.size**2 * 2.0
    frequency = np.fft.rfftfreq(noise.size, 1e-3)
    below = frequency < highest
    speed = np.sqrt(np.sum((2 * np.pi * frequency[below]) ** 2 * spectrum[below]))
    assert speed == pytest.approx(0.5 * 0.005 * np.pi * 0.5, rel=0.2)


def test_what_is_given_is_taken() -> None:
    records = simulate_axis(DRY, 1, 16.0, first_seed=3)
    model = nominal()
    states, bands = filters(model, InverseDynamicsProblem(model, records, cutoff=25.0), 25.0)
    assert states == (25.0,)
    assert bands == pytest.approx((10.0,))
