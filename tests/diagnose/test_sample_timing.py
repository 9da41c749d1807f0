"""What a shift of the commands within one sampling interval explains is no physics that is missing."""

from dataclasses import replace

import numpy as np
import pytest

import vpm
from model_texts import DAMPED_AXIS
from vpm.discrepancy.judged_model import Data, Judged, judged_anyhow
from vpm.discrepancy.shifted_commands import in_time
from vpm.identify import InverseDynamicsProblem
from vpm.numbers import Array

STEP, NOISE = 2e-3, 0.02


def record(seed: int, late: float) -> vpm.Experiment:
    """Sines by closed forms; the logged command is the effort of ``late`` sampling intervals later."""
    generator = np.random.default_rng(seed)
    time: Array = STEP * np.arange(4000, dtype=np.float64)
    rates = 2.0 * np.pi * generator.uniform(0.3, 2.5, 5)
    phases = generator.uniform(0.0, 2.0 * np.pi, 5)

    def wave(order: int, at: Array) -> Array:
        turned = rates[:, None] * at + phases[:, None] + 0.5 * np.pi * order
        return np.asarray(np.sum((0.3 / (1.0 + rates) * rates**order)[:, None] * np.sin(turned), axis=0))

    ahead = time + late * STEP
    effort = 2.0 * wave(2, ahead) + 3.0 * wave(1, ahead) + NOISE * generator.standard_normal(time.size)
    values = {"axis.position": wave(0, time), "drive.command": effort}
    return vpm.Experiment.from_arrays(time, values, units={"axis.position": "m", "drive.command": "N"}, name=f"r{seed}")


def judged(late: float) -> tuple[Judged, Data]:
    model = vpm.Model.from_toml(DAMPED_AXIS)
    data = Data(
        InverseDynamicsProblem(model, [record(1, late), record(2, late)]),
        InverseDynamicsProblem(model, [record(3, late)]),
        None,
    )
    return judged_anyhow(model, ("carriage.mass", "axis.friction.viscous"), data, {})[0], data


# A command that holds from its sample on acts half an interval later in the mean: half an interval early, it fits.
@pytest.mark.parametrize("late", [0.0, 0.9, 1.4])
def test_a_shift_within_the_interval_leaves_the_noise(late: float) -> None:
    start, data = judged(late)
    timed = in_time(start, data)
    noise = NOISE * np.sqrt(0.8 / data.validation.motions[0].decimation)
    assert np.sqrt(np.mean(timed.validation**2)) == pytest.approx(noise, rel=0.1)
    assert np.sqrt(np.mean(start.validation**2)) > 1.3 * noise


def test_a_longer_shift_is_cut_to_one_interval_and_stays_to_be_explained() -> None:
    start, data = judged(5.0)
    timed = in_time(start, data)
    assert np.sqrt(np.mean(timed.validation**2)) > 0.5 * np.sqrt(np.mean(start.validation**2))


def test_nothing_is_shifted_where_commands_hold_as_they_are_logged() -> None:
    start, data = judged(0.5)
    assert in_time(start, data) is start


def test_commands_of_a_later_problem_come_one_sample_later() -> None:
    model = vpm.Model.from_toml(DAMPED_AXIS)
    there = record(1, 0.0)
    later = there["drive.command"].copy()
    later[1:] = there["drive.command"][:-1]
    moved = there.with_channel("drive.command", later, "N")
    one, other = InverseDynamicsProblem(model, [there]), InverseDynamicsProblem(model, [moved])
    expected = other.evaluate(model, model.theta)[0]
    np.testing.assert_allclose(one.later().evaluate(model, model.theta)[0], expected, atol=1e-12)
    assert replace(one.blocks[0]) == one.later().blocks[0]
